//! Which texels of a map are below one of a level of its mips: all of them, or of many some, at places that are the same in every texel.
//! Twin of the walk in `glsl/mixtures/fit.comp`, which has the same places in the same numbers.

use crate::distribution::stored::covered;
use crate::sampling::sobol;

/// Texels of the map that are looked at below one: all of them count once it is fitted.
pub(crate) const LOOKED_AT: usize = 1024;

/// Of a map of a size.
pub(super) struct Below {
    size: [u32; 2],
    places: Vec<[f32; 2]>,
}

/// Places in the unit square.
pub(crate) fn places() -> Vec<[f32; 2]> {
    (0..LOOKED_AT as u32).map(|i| sobol::point(i, 11).map(|u| sobol::to_unit(u) as f32)).collect()
}

/// Whether there are more texels of a map of size `from` below each of `size` than are looked at.
pub(crate) fn is_some(size: [u32; 2], from: [u32; 2]) -> bool {
    let area = |[w, h]: [u32; 2]| u64::from(w) * u64::from(h);
    area(from) > LOOKED_AT as u64 * area(size)
}

/// Texels of a map of size `from` in one of `size`, each way.
pub(crate) fn across(size: [u32; 2], from: [u32; 2]) -> [f32; 2] {
    [0, 1].map(|axis| from[axis] as f32 / size[axis] as f32)
}

impl Below {
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, places: places() }
    }

    /// Calls `see` for each texel below texel `i` of a level, with its share in it.
    pub fn all(&self, size: [u32; 2], i: usize, mut see: impl FnMut(usize, f64)) {
        let [x, y] = [i % size[0] as usize, i / size[0] as usize];
        for (row, of_row) in covered(y, size[1], self.size[1]) {
            for (column, of_column) in covered(x, size[0], self.size[0]) {
                see(row * self.size[0] as usize + column, of_row * of_column);
            }
        }
    }

    /// The same for those that are looked at.
    pub fn looked_at(&self, size: [u32; 2], i: usize, mut see: impl FnMut(usize, f64)) {
        if !is_some(size, self.size) {
            return self.all(size, i, see);
        }
        let across = across(size, self.size);
        let corner = [i % size[0] as usize, i / size[0] as usize];
        for place in &self.places {
            let [column, row] = [0, 1].map(|axis| {
                let side = self.size[axis] as usize;
                (corner[axis] * side / size[axis] as usize + (place[axis] * across[axis]) as usize).min(side - 1)
            });
            see(row * self.size[0] as usize + column, 1.0 / LOOKED_AT as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_of_many_texels_stand_for_all() {
        let below = Below::new([300, 200]);
        // Few enough: all of them.
        let mut all = Vec::new();
        below.looked_at([10, 6], 13, |texel, share| all.push((texel, share)));
        assert_eq!(all.len(), 30 * 34);
        let mut sums = [0.0; 3];
        below.looked_at([2, 1], 1, |texel, share| {
            let [x, y] = [texel % 300, texel / 300];
            assert!(x >= 150 && y < 200);
            [1.0, x as f64, y as f64].iter().zip(&mut sums).for_each(|(v, sum)| *sum += share * v);
        });
        assert!((sums[0] - 1.0).abs() < 1e-9 && (sums[1] - 224.5).abs() < 1.0 && (sums[2] - 99.5).abs() < 1.0, "{sums:?}");
    }
}
