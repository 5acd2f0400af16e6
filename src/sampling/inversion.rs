//! Drawing an index in proportion to weights by inverting their cumulative sums. Every index owns one interval of the uniform
//! numbers, so that numbers that are well spread stay well spread within each index. The alias method (Walker 1977) needs
//! fewer look-ups, but scatters a heavy index over the whole range. A guide finds the interval in few steps (Chen and Asau
//! 1974, "On generating random variates from an empirical distribution"). Twin of `glsl/include/environment.glsl`.

use crate::error::{Error, Result};

/// An index's interval of the uniform numbers `0..2^32`, and an entry of the guide. Eight bytes, as on the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Interval {
    /// Where the interval begins, modulo `2^32`; it ends where the next one begins.
    pub start: u32,
    /// The index that the last number of a part draws, if the numbers are cut into as many equal parts as there are indices.
    pub guide: u32,
}

/// A discrete distribution over `0..len`.
#[derive(Clone, Debug)]
pub struct InversionTable {
    intervals: Vec<Interval>,
}

impl InversionTable {
    /// The distribution proportional to `weights`, in steps of `2^-32`. Weights that are negative or not finite count as
    /// zero; if all are zero, the distribution is uniform.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for no weights, or more than a 32-bit index reaches.
    pub fn build(weights: &[f64]) -> Result<Self> {
        let n = u32::try_from(weights.len()).unwrap_or(0);
        if n == 0 {
            return Err(Error::invalid("inversion table", "1 to 2^32 - 1 weights", weights.len()));
        }
        let usable = |w: f64| if w.is_finite() && w > 0.0 { w } else { 0.0 };
        let largest = weights.iter().fold(0.0, |a: f64, &w| a.max(usable(w)));
        // Scaled by the largest first, so that the sum of huge weights stays finite.
        let scaled = |w: &f64| if largest > 0.0 { usable(*w) / largest } else { 1.0 };
        let total: f64 = weights.iter().map(scaled).sum();
        let mut sum = 0.0;
        let mut end = |w: &f64| {
            sum += scaled(w);
            (sum / total * 32f64.exp2()).round() as u64
        };
        let ends: Vec<u64> = weights.iter().map(&mut end).collect();
        let mut guide = 0;
        let guides = (1..=u64::from(n)).map(|parts| {
            let last = (parts << 32).div_ceil(n.into()) - 1;
            while ends.get(guide as usize).is_some_and(|end| *end <= last) {
                guide += 1;
            }
            guide
        });
        let starts = std::iter::once(0).chain(ends.iter().map(|end| *end as u32));
        Ok(Self { intervals: starts.zip(guides).map(|(start, guide)| Interval { start, guide }).collect() })
    }

    /// One an index.
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// The exact probability of `index` below the number of weights.
    pub fn probability(&self, index: usize) -> f64 {
        let end = self.intervals.get(index + 1).map_or(0, |next| next.start);
        let length = end.wrapping_sub(self.intervals[index].start);
        // What is everything has the length of what is nothing, modulo 2^32, but only everything is drawn.
        let drawn = self.intervals.last().is_some_and(|last| last.guide as usize == index);
        if length == 0 && drawn { 1.0 } else { f64::from(length) * (-32f64).exp2() }
    }

    /// The index that the uniform `u / 2^32` draws, and where in the index's interval it lies: a fresh uniform in (0, 1)
    /// that grows with `u`.
    pub fn draw(&self, u: u32) -> (u32, f64) {
        let part = ((u64::from(u) * self.intervals.len() as u64) >> 32) as usize;
        let guide = |part: usize| self.intervals[part].guide;
        let (mut low, mut high) = (part.checked_sub(1).map_or(0, guide), guide(part));
        while low < high {
            let middle = high - (high - low) / 2;
            if self.intervals[middle as usize].start <= u { low = middle } else { high = middle - 1 }
        }
        let index = low as usize;
        let place = u - self.intervals[index].start;
        (low, (f64::from(place) + 0.5) / (self.probability(index) * 32f64.exp2()))
    }
}
