//! Drawing an index in proportion to weights with one table look-up: Walker's alias method, built in linear time after
//! Vose 1991 ("A linear algorithm for generating random numbers with a given distribution"). Twin of
//! `glsl/include/environment.glsl`.

use crate::error::{Error, Result};

/// One slot: keep its own index where the fraction is below `threshold`, else take `alias`. Eight bytes, as on the GPU.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct AliasEntry {
    /// Probability in [0, 1] of keeping the slot's own index.
    pub threshold: f32,
    /// The index that is taken otherwise.
    pub alias: u32,
}

/// A discrete distribution over `0..len`.
#[derive(Clone, Debug)]
pub struct AliasTable {
    entries: Vec<AliasEntry>,
}

impl AliasTable {
    /// The distribution proportional to `weights`, in time and memory linear in their number. Weights that are negative or
    /// not finite count as zero; if all are zero, the distribution is uniform. The same weights give the same table.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for no weights, or more than a 32-bit index reaches.
    pub fn build(weights: &[f64]) -> Result<Self> {
        let n = u32::try_from(weights.len()).unwrap_or(0);
        if n == 0 {
            return Err(Error::invalid("alias table", "1 to 2^32 - 1 weights", weights.len()));
        }
        let usable = |w: f64| if w.is_finite() && w > 0.0 { w } else { 0.0 };
        let largest = weights.iter().fold(0.0, |a: f64, &w| a.max(usable(w)));
        // Scaled by the largest first, so that the sum of huge weights stays finite.
        let sum: f64 = weights.iter().map(|&w| usable(w) / largest).sum();
        let mut scaled: Vec<f64> = match largest {
            0.0 => vec![1.0; weights.len()],
            _ => weights.iter().map(|&w| usable(w) / largest * (f64::from(n) / sum)).collect(),
        };

        let mut entries: Vec<_> = (0..n).map(|alias| AliasEntry { threshold: 1.0, alias }).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) = (0..n).rev().partition(|&i| scaled[i as usize] < 1.0);
        // Each slot below one is filled up from one above; what is left on either side is one, up to rounding.
        while let (Some(s), Some(&l)) = (small.pop(), large.last()) {
            let kept = scaled[s as usize];
            entries[s as usize] = AliasEntry { threshold: kept as f32, alias: l };
            let rest = &mut scaled[l as usize];
            *rest -= 1.0 - kept;
            if *rest < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        Ok(Self { entries })
    }

    /// The slots, one per weight.
    pub fn entries(&self) -> &[AliasEntry] {
        &self.entries
    }

    /// The exact probability of each index.
    pub fn probabilities(&self) -> Vec<f64> {
        let n = self.entries.len() as f64;
        let mut sums: Vec<f64> = self.entries.iter().map(|e| f64::from(e.threshold)).collect();
        for entry in &self.entries {
            sums[entry.alias as usize] += 1.0 - f64::from(entry.threshold);
        }
        sums.into_iter().map(|s| s / n).collect()
    }

    /// The index that the uniform `u / 2^32` draws, and what is left of it: a fresh uniform in `[0, 1)`.
    ///
    /// The slot is the high word of `u * len`, the fraction the upper 24 bits of the low word; the remainder rescales the
    /// fraction to the part of the slot that it fell into. It has `32 - log2(len)` bits, 24 at most.
    pub fn draw(&self, u: u32) -> (u32, f64) {
        let product = u64::from(u) * self.entries.len() as u64;
        let (slot, fraction) = ((product >> 32) as u32, f64::from(product as u32 >> 8) * (-24f64).exp2());
        let AliasEntry { threshold, alias } = self.entries[slot as usize];
        let threshold = f64::from(threshold);
        if fraction < threshold { (slot, fraction / threshold) } else { (alias, (fraction - threshold) / (1.0 - threshold)) }
    }
}
