//! Drawing an index in proportion to weights with one look-up: an alias table (Walker 1977) whose slots follow the order of
//! the indices. Every slot owns an equal part of the uniform numbers and chooses between two adjacent runs of indices, those
//! on which its part of the cumulative weight falls. So numbers that are well spread stay well spread within each index, as
//! under inversion; a classic alias table scatters a heavy index over the whole range. Inside a run indices are drawn alike,
//! and [`AliasTable::probability`] says exactly how often. Twin of `glsl/include/environment.glsl`.

use crate::error::{Error, Result};
use crate::sampling::sobol::to_unit;

/// One of the equal parts of the uniform numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// First index of the first run; the second run follows it.
    pub first: u32,
    /// Indices in the first run, at least one.
    pub own: u32,
    /// Indices in the second run, or none.
    pub other: u32,
    /// How much of the slot draws from the first run, of the `2^32 / slots` numbers in it.
    pub units: u32,
    /// If the first run is one index: which stretch of it the slot stands for.
    pub own_stretch: [f64; 2],
    /// If the second run is one index: the end of its stretch, which begins at 0.
    pub other_stretch: f64,
}

/// Steps of [`Slot::own_stretch`] and [`Slot::other_stretch`].
const STRETCH_STEPS: [f64; 2] = [65535.0, 4095.0];

/// A discrete distribution over `0..len`.
#[derive(Clone, Debug)]
pub struct AliasTable {
    slots: Vec<Slot>,
    probabilities: Vec<f64>,
}

/// Slots are a power of two: about a quarter of the indices, so that a slot holds few of them.
fn slot_count(len: usize) -> usize {
    (len.next_power_of_two() / 4).clamp(1 << 14, 1 << 20)
}

impl AliasTable {
    /// The distribution about proportional to `weights`. Weights that are negative or not finite count as zero; if all are
    /// zero, the distribution is uniform. An index of positive weight has positive probability.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for no weights, or more than a 32-bit index reaches.
    pub fn build(weights: &[f64]) -> Result<Self> {
        if weights.is_empty() || u32::try_from(weights.len()).is_err() {
            return Err(Error::invalid("alias table", "1 to 2^32 - 1 weights", weights.len()));
        }
        let usable = |w: f64| if w.is_finite() && w > 0.0 { w } else { 0.0 };
        let largest = weights.iter().fold(0.0, |a: f64, &w| a.max(usable(w)));
        // Scaled by the largest first, so that the sum of huge weights stays finite.
        let weight = |i: usize| if largest > 0.0 { usable(weights[i]) / largest } else { 1.0 };
        let mut ends = Vec::with_capacity(weights.len());
        let mut sum = 0.0;
        for i in 0..weights.len() {
            sum += weight(i);
            ends.push(sum);
        }
        let count = slot_count(weights.len());
        let steps = (1u64 << 32) as f64 / count as f64;
        let mut probabilities = vec![0.0; weights.len()];
        let mut low = 0;
        let mut slots = Vec::with_capacity(count);
        for slot in 0..count {
            let bounds = [slot, slot + 1].map(|s| sum * s as f64 / count as f64);
            // The indices whose intervals of the cumulative weight meet the slot's.
            while low + 1 < ends.len() && ends[low] <= bounds[0] {
                low += 1;
            }
            let mut high = low;
            while high + 1 < ends.len() && ends[high] < bounds[1] {
                high += 1;
            }
            // The runs part where neighbours differ most: what is alike may be drawn alike.
            let contrast = |i: &usize| (weight(*i) - weight(*i + 1)).abs();
            let last_own = (low..high).max_by(|a, b| contrast(a).total_cmp(&contrast(b))).unwrap_or(high);
            let (own, other) = (last_own - low + 1, high - last_own);
            let share = (ends[last_own].min(bounds[1]) - bounds[0]) / (bounds[1] - bounds[0]);
            let units = if other == 0 { steps } else { (share * steps).round().clamp(1.0, steps - 1.0) };
            let threshold = units / steps;
            let each = |share: f64, run: usize| share / count as f64 / run.max(1) as f64;
            probabilities[low..=last_own].iter_mut().for_each(|p| *p += each(threshold, own));
            probabilities[last_own + 1..=high].iter_mut().for_each(|p| *p += each(1.0 - threshold, other));
            slots.push(Slot {
                first: low as u32,
                own: own as u32,
                other: other as u32,
                units: units as u32,
                own_stretch: [0.0, 1.0],
                other_stretch: 1.0,
            });
            low = high;
        }
        stretch(&mut slots, weights.len());
        Ok(Self { slots, probabilities })
    }

    /// All slots; their number is a power of two, at least 16384.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The exact probability of `index` below the number of weights.
    pub fn probability(&self, index: usize) -> f64 {
        self.probabilities[index]
    }

    /// The slots as the GPU reads them: first index; length of the second run, with the top bit set where the first run is one
    /// index; that index's stretch, 16 bits an end, or else the first run's length; units, and the end of the second run's
    /// stretch in the top 12 bits.
    pub fn packed(&self) -> Vec<[u32; 4]> {
        let quantised = |x: f64, steps: f64| (x * steps).round() as u32;
        let pack = |s: &Slot| {
            let [low, high] = s.own_stretch.map(|x| quantised(x, STRETCH_STEPS[0]));
            let own = if s.own == 1 { low | high << 16 } else { s.own };
            let units = s.units.min((1 << 20) - 1);
            [s.first, s.other | u32::from(s.own == 1) << 31, own, units | quantised(s.other_stretch, STRETCH_STEPS[1]) << 20]
        };
        self.slots.iter().map(pack).collect()
    }

    /// The index that the uniform `u / 2^32` draws, and where in it: a fresh uniform in `[0, 1]` that grows with `u` within
    /// an index drawn by itself. The bits of `u` below the slot's resolution come from `fine`, another uniform.
    pub fn draw(&self, u: u32, fine: u32) -> (u32, f64) {
        let bits = self.slots.len().trailing_zeros();
        let slot = self.slots[(u >> (32 - bits)) as usize];
        let at = f64::from((u << bits) >> bits) + to_unit(fine.wrapping_mul(0x9e37_79b9));
        let units = f64::from(slot.units);
        let (first, run, rest, [low, high]) = if slot.other == 0 || at < units {
            (slot.first, slot.own, at / units, slot.own_stretch)
        } else {
            let steps = (32.0 - f64::from(bits)).exp2();
            (slot.first + slot.own, slot.other, (at - units) / (steps - units), [0.0, slot.other_stretch])
        };
        let along = rest * f64::from(run);
        let step = (along as u32).min(run - 1);
        let place = (along - f64::from(step)).min(1.0);
        (first + step, if run == 1 { low + (high - low) * place } else { place })
    }
}

/// Shares each index's length out among the slots that draw it by itself, in their order.
fn stretch(slots: &mut [Slot], len: usize) {
    let steps = (1u64 << 32) as f64 / slots.len() as f64;
    let mut totals = vec![0.0; len];
    for s in slots.iter() {
        if s.own == 1 {
            totals[s.first as usize] += f64::from(s.units);
        }
        if s.other == 1 {
            totals[(s.first + s.own) as usize] += steps - f64::from(s.units);
        }
    }
    // The index that is being shared out, the units given so far and where they end, in quantised steps.
    let (mut index, mut given, mut end) = (u32::MAX, 0.0, 0.0);
    let mut share = |i: u32, units: f64, precision: f64| {
        if i != index {
            (index, given, end) = (i, 0.0, 0.0);
        }
        given += units;
        let start = end;
        end = (given / totals[i as usize] * precision).round() / precision;
        [start, end]
    };
    for s in slots.iter_mut() {
        if s.own == 1 {
            s.own_stretch = share(s.first, f64::from(s.units), STRETCH_STEPS[0]);
        }
        if s.other == 1 {
            s.other_stretch = share(s.first + s.own, steps - f64::from(s.units), STRETCH_STEPS[1])[1];
        }
    }
}
