//! How the hemisphere is cut into cells, one lobe each (Xu et al. 2017, sections 3.2 and 4).

use glam::DVec3;

/// A partition. The paper's "1x4" and "2x4" of longitude and latitude do not say where their pole is; here four are the
/// quadrants about z, which for a hemisphere of directions leave the longest mean vectors of the readings that treat x and y
/// alike, and each of the eight is the half of a quadrant that is nearer to z or to the horizon.
///
/// Directions in the surface's tangent frame make lobes that do not depend on the camera; directions turned into the camera's
/// frame, z towards the viewer, make the paper's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// 1 x 1.
    One,
    /// 1 x 4.
    Four,
    /// 2 x 4: cells `2 i` and `2 i + 1` are those of cell `i` of four.
    Eight,
}

impl Cells {
    /// All, coarse to fine.
    pub const ALL: [Self; 3] = [Self::One, Self::Four, Self::Eight];

    /// How many there are.
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }

    /// The cell of `direction`, of any length. What is below the horizon counts as on it.
    pub fn of(self, direction: DVec3) -> usize {
        let quadrant = usize::from(direction.x < 0.0) + 2 * usize::from(direction.y < 0.0);
        // Beyond 45 degrees from z.
        let low = direction.z.max(0.0).powi(2) < direction.truncate().length_squared();
        match self {
            Self::One => 0,
            Self::Four => quadrant,
            Self::Eight => 2 * quadrant + usize::from(low),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sobol;
    use std::f64::consts::TAU;

    /// Unit directions, even over the upper hemisphere.
    fn hemisphere() -> impl Iterator<Item = DVec3> {
        (0..40_000).map(|i| {
            let [z, turn] = sobol::random(i, 3).map(sobol::to_unit);
            DVec3::new((TAU * turn).cos(), (TAU * turn).sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        })
    }

    #[test]
    fn each_cell_divides_into_two_of_the_next() {
        for h in hemisphere() {
            let [one, four, eight] = Cells::ALL.map(|cells| cells.of(h));
            assert!(one == 0 && eight / 2 == four && four < 4, "{h}: {one} {four} {eight}");
            // What is below the horizon counts as on it.
            assert_eq!(Cells::Eight.of(h * DVec3::new(1.0, 1.0, -1.0)), 2 * four + 1);
            assert_eq!(Cells::Eight.of(h * 0.01), eight);
        }
        assert_eq!(Cells::ALL.map(|cells| cells.of(DVec3::Z)), [0; 3]);
    }

    #[test]
    fn means_of_an_even_hemisphere() {
        // Each quadrant: sqrt(3)/2. Of its halves, that about z has 0.9597, the other, with 0.7071 of the area, 0.8914.
        for (cells, expected) in [(Cells::One, 0.5), (Cells::Four, 0.75f64.sqrt()), (Cells::Eight, 0.9114)] {
            let mut sums = vec![(DVec3::ZERO, 0.0); cells.count()];
            for h in hemisphere() {
                let (sum, count) = &mut sums[cells.of(h)];
                (*sum, *count) = (*sum + h, *count + 1.0);
            }
            let total: f64 = sums.iter().map(|(_, count)| count).sum();
            let mean: f64 = sums.iter().map(|(sum, _)| sum.length()).sum::<f64>() / total;
            println!("{cells:?}: {mean:.4}");
            assert!((mean - expected).abs() < 2e-3, "{cells:?}: {mean}");
        }
    }
}
