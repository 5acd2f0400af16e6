//! The forms that Xu et al. 2017 print, where exact ones stand in their place: the comparison needs both.

use crate::distribution::vmf::LEAST_SPREAD;
use std::sync::LazyLock;

/// The concentration of a characteristic vector whose length is `1 - spread`, which is clamped to at least [`LEAST_SPREAD`]
/// and at most 1 (equation 8, after Banerjee et al. 2005, "Clustering on the unit hypersphere using von Mises-Fisher
/// distributions", equation 4.4): up to 4.94 % from that of the lobe with this mean, at 4.9.
pub fn concentration(spread: f64) -> f64 {
    let e = spread.clamp(LEAST_SPREAD, 1.0);
    let r = 1.0 - e;
    r * (3.0 - r * r) / (e * (2.0 - e))
}

/// The complement to 1 of the characteristic vector's length, for a concentration: the root of equation 9 in (0, 1), solved
/// for `e = 1 - r`: `-2 + 2 kappa e + (3 - kappa) e^2 - e^3 = 0`. Inverts [`concentration`].
pub fn spread(kappa: f64) -> f64 {
    (0..8).fold(1.0 / (1.0 + kappa), |e, _| {
        let value = -2.0 + e * (2.0 * kappa + e * ((3.0 - kappa) - e));
        let slope = 2.0 * kappa + e * (2.0 * (3.0 - kappa) - 3.0 * e);
        e - value / slope
    })
}

/// Entries of [`SpreadTable`].
pub const TABLE_ENTRIES: usize = 1024;

/// The sharpest lobe that a [`SpreadTable`] for maps has: that of an alpha of 0.0055.
pub const MOST_TABULATED: f64 = 65_536.0;

/// The table for maps; sharper lobes count as its sharpest.
pub static SPREADS: LazyLock<SpreadTable> = LazyLock::new(|| SpreadTable::new(MOST_TABULATED));

/// [`spread`] in a 1 x 1024 table (section 4), linearly filtered. The paper does not say how concentrations are spaced: here
/// `ln(1 + kappa)` is even, as evenly spaced concentrations would be 95 % off at the sharp end.
#[derive(Clone, Debug)]
pub struct SpreadTable {
    most: f64,
    entries: Vec<f32>,
}

impl SpreadTable {
    /// A table for concentrations from 0 to `most`.
    pub fn new(most: f64) -> Self {
        let kappa = |i: usize| (i as f64 / (TABLE_ENTRIES - 1) as f64 * most.ln_1p()).exp_m1();
        Self { most, entries: (0..TABLE_ENTRIES).map(|i| spread(kappa(i)) as f32).collect() }
    }

    /// What it holds.
    pub fn entries(&self) -> &[f32] {
        &self.entries
    }

    /// The spread at `kappa`, which is clamped to the table's range.
    pub fn spread(&self, kappa: f64) -> f64 {
        let last = TABLE_ENTRIES - 1;
        let at = (kappa.max(0.0).ln_1p() / self.most.ln_1p()).min(1.0) * last as f64;
        let first = (at as usize).min(last - 1);
        let [a, b] = [self.entries[first], self.entries[first + 1]].map(f64::from);
        a + (b - a) * (at - first as f64)
    }
}

/// The concentration of a texel's effective lobe (equations 13 and 14): a base lobe of exponent `exponent` under normals of
/// concentration `normals`, which is infinite where there is one normal.
pub fn effective(normals: f64, exponent: f64) -> f64 {
    let filtered = if normals.is_finite() { normals * exponent / (normals + exponent) } else { exponent };
    filtered + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::vmf;

    fn decades() -> impl Iterator<Item = f64> {
        (0..=3000).map(|i| 10f64.powf(-3.0 + 9.0 * f64::from(i) / 3000.0))
    }

    #[test]
    fn the_cubic_inverts_equation_8() {
        for kappa in decades() {
            assert!((concentration(spread(kappa)) / kappa - 1.0).abs() < 1e-7, "{kappa}");
            let r = 1.0 - spread(kappa);
            let residual = r.powi(3) - kappa * r * r - 3.0 * r + kappa;
            assert!(residual.abs() < 1e-9 * (1.0 + kappa) && (0.0..1.0).contains(&r), "{kappa}: {residual}");
        }
    }

    #[test]
    fn equation_8_is_within_5_percent_of_the_exact_inverse() {
        let off = |kappa: f64| concentration(vmf::spread(kappa)) / kappa - 1.0;
        let (at, worst) = decades().map(|k| (k, off(k).abs())).fold((0.0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        println!("{worst:.4} at {at:.2}");
        assert!((worst - 0.0494).abs() < 2e-4 && (4.0..6.0).contains(&at), "{worst} at {at}");
        assert!(off(100.0).abs() < 0.005);
    }

    #[test]
    fn the_table_is_as_good_as_its_cubic() {
        let (most, table) = (MOST_TABULATED, &*SPREADS);
        let error = |k: f64| (concentration(table.spread(k)) / k - 1.0).abs();
        for (from, bound) in [(0.1, 2e-4), (1.0, 3e-5)] {
            let worst = decades().filter(|k| (from..most).contains(k)).map(error).fold(0.0, f64::max);
            println!("relative error of the table from {from}: {worst:.1e}");
            assert!(worst < bound, "{from}: {worst:e}");
        }
        assert_eq!(table.spread(1e9), table.spread(most));
        assert_eq!([table.spread(0.0), table.spread(-1.0)], [1.0; 2]);
    }

    #[test]
    fn one_normal_leaves_the_base_lobe() {
        assert_eq!(effective(f64::INFINITY, 50.0), 51.0);
        assert!((effective(10.0, 50.0) - (500.0 / 60.0 + 1.0)).abs() < 1e-12);
    }
}
