//! Mips of linear quantities, at any size.

use crate::texture::{for_each_cover, halved};

/// A level: texels row by row, `channels` numbers each.
#[derive(Clone, Debug)]
struct Level {
    size: [u32; 2],
    texels: Vec<f64>,
}

/// The mips over a map whose texels are computed when they are asked for. Each side is half of the one before, rounded down, as
/// a device's images have it; each texel is the average of the area that it covers, so that the average of every level is that
/// of the map at any size. Twin of `glsl/vmf_mips.comp`.
#[derive(Clone, Debug)]
pub struct Mips {
    size: [u32; 2],
    channels: usize,
    levels: Vec<Level>,
}

impl Mips {
    /// The mips of a map of `size`, both sides above 0, whose texel `i`, counted row by row, `base` writes: `channels` numbers.
    pub fn new(size: [u32; 2], channels: usize, base: impl Fn(usize, &mut [f64])) -> Self {
        let mut mips = Self { size, channels, levels: Vec::new() };
        while mips.size(mips.levels.len()) != [1, 1] {
            let from = mips.size(mips.levels.len());
            let to = halved(from);
            let mut texels = vec![0.0; to[0] as usize * to[1] as usize * channels];
            let mut of_base = vec![0.0; channels];
            for_each_cover(from, to, |i, covered| {
                let sum = &mut texels[i * channels..(i + 1) * channels];
                for (source, share) in covered {
                    let child = match mips.levels.last() {
                        None => {
                            base(*source, &mut of_base);
                            &of_base
                        }
                        Some(level) => &level.texels[source * channels..(source + 1) * channels],
                    };
                    sum.iter_mut().zip(child).for_each(|(sum, c)| *sum += share * c);
                }
            });
            mips.levels.push(Level { size: to, texels });
        }
        mips
    }

    /// How many levels there are, with the map's own, 0.
    pub fn levels(&self) -> usize {
        self.levels.len() + 1
    }

    /// Width and height of a level, or of the last if there are not that many.
    pub fn size(&self, level: usize) -> [u32; 2] {
        let mips = self.levels.len();
        level.min(mips).checked_sub(1).map_or(self.size, |i| self.levels[i].size)
    }

    /// Texel `i` of a level above 0, row by row; `None` where there is none, and of level 0.
    pub fn texel(&self, level: usize, i: usize) -> Option<&[f64]> {
        let level = self.levels.get(level.checked_sub(1)?)?;
        level.texels.get(i * self.channels..(i + 1) * self.channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_is_the_average_of_what_it_covers() {
        for size in [[1, 1], [2, 1], [5, 7], [67, 46], [64, 32]] {
            let value = |i: usize, c: usize| ((i * 7919 + c * 31) % 101) as f64;
            let mips = Mips::new(size, 2, |i, out| (0..2).for_each(|c| out[c] = value(i, c)));
            assert_eq!(mips.levels(), 1 + size[0].max(size[1]).ilog2() as usize);
            let count = (size[0] * size[1]) as usize;
            for level in 1..mips.levels() {
                let [w, h] = mips.size(level);
                assert_eq!([w, h], mips.size(level - 1).map(|side| (side / 2).max(1)));
                // All of a level's texels have the same area.
                for c in 0..2 {
                    let mean = (0..count).map(|i| value(i, c)).sum::<f64>() / count as f64;
                    let texels = (0..(w * h) as usize).map(|i| mips.texel(level, i).unwrap()[c]);
                    assert!((texels.sum::<f64>() / f64::from(w * h) - mean).abs() < 1e-9, "{size:?} {level}");
                }
                assert!(mips.texel(level, (w * h) as usize).is_none());
            }
            assert!(mips.texel(0, 0).is_none() && mips.texel(mips.levels(), 0).is_none());
        }
        // By hand: 5 texels to 2, each of which covers two and a half.
        let mips = Mips::new([5, 1], 1, |i, out| out[0] = [1.0, 4.0, 10.0, 2.0, 6.0][i]);
        for (i, expected) in [4.0, 5.2].into_iter().enumerate() {
            assert!((mips.texel(1, i).unwrap()[0] - expected).abs() < 1e-12);
        }
    }
}
