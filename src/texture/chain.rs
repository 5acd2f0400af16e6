//! Mips.

use crate::texture::{Format, Level, Texture};
use std::sync::LazyLock;

/// Linear light of each 8-bit sRGB value.
static LIGHT: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| decode_srgb(i as f64 / 255.0) as f32));

/// Linear light half-way between neighbouring 8-bit sRGB values, as encoded.
static BETWEEN: LazyLock<[f32; 255]> = LazyLock::new(|| std::array::from_fn(|i| decode_srgb((i as f64 + 0.5) / 255.0) as f32));

/// Linear from sRGB-encoded light, both in [0, 1] (IEC 61966-2-1).
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// sRGB-encoded from linear light, both in [0, 1] (IEC 61966-2-1).
pub fn encode_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear from 8-bit sRGB-encoded light.
pub(crate) fn decode_byte(encoded: u8) -> f32 {
    LIGHT[usize::from(encoded)]
}

/// The nearest 8-bit sRGB value, as encoded, to linear light.
pub(super) fn encode_byte(linear: f32) -> u8 {
    BETWEEN.partition_point(|bound| *bound <= linear) as u8
}

/// The size of the next level: each side half, rounded down, at least 1.
pub(crate) fn halved(size: [u32; 2]) -> [u32; 2] {
    size.map(|side| (side / 2).max(1))
}

/// A texture and its mips: each texel of a level is the average of the area that it covers of the level before, whose side
/// need not be even. Averages are taken before they are rounded to the format.
pub(super) fn chain<const N: usize>(format: Format, size: [u32; 2], source: impl Fn(usize) -> [f32; N]) -> Texture {
    let texels = |size: [u32; 2], of: &dyn Fn(usize) -> [f32; N]| {
        let count = size[0] as usize * size[1] as usize;
        let mut out = Vec::with_capacity(count * format.bytes());
        (0..count).for_each(|i| format.encode(&of(i), &mut out));
        Level { size, texels: out }
    };
    let mut levels = vec![texels(size, &source)];
    let mut known = [size[0], size[1]];
    let mut before: Option<Vec<[f32; N]>> = None;
    while known != [1, 1] {
        let next = halved(known);
        // Of the first level there is no copy beside the caller's.
        let averages = match &before {
            None => averages(known, next, &source),
            Some(level) => averages(known, next, |i| level[i]),
        };
        levels.push(texels(next, &|i| averages[i]));
        (known, before) = (next, Some(averages));
    }
    Texture { format, levels }
}

fn averages<const N: usize>(from: [u32; 2], to: [u32; 2], texel: impl Fn(usize) -> [f32; N]) -> Vec<[f32; N]> {
    let mut out = Vec::with_capacity(to[0] as usize * to[1] as usize);
    for_each_cover(from, to, |_, covered| {
        let mut sum = [0.0f64; N];
        for (i, share) in covered {
            for (sum, c) in sum.iter_mut().zip(texel(*i)) {
                *sum += share * f64::from(c);
            }
        }
        out.push(sum.map(|c| c as f32));
    });
    out
}

/// Calls `visit` for each texel of a level of size `to`, row by row, with the texels that it covers of one of size `from`, and
/// the share of each in its area. Any sizes above 0.
pub(crate) fn for_each_cover(from: [u32; 2], to: [u32; 2], mut visit: impl FnMut(usize, &[(usize, f64)])) {
    let (columns, rows) = (axis_weights(from[0], to[0]), axis_weights(from[1], to[1]));
    let mut covered = Vec::new();
    for (y, row) in rows.iter().enumerate() {
        for (x, column) in columns.iter().enumerate() {
            covered.clear();
            for (source_y, along_y) in row.iter() {
                covered
                    .extend(column.iter().map(|(source_x, along_x)| (source_y * from[0] as usize + source_x, along_x * along_y)));
            }
            visit(y * columns.len() + x, &covered);
        }
    }
}

/// Neighbours that a texel covers: the first, and the share of each.
struct Shares {
    first: usize,
    shares: Vec<f64>,
}

impl Shares {
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.shares.iter().enumerate().map(|(i, share)| (self.first + i, *share))
    }
}

/// Of each of `to` texels along an axis, what it covers of `from`.
fn axis_weights(from: u32, to: u32) -> Vec<Shares> {
    let (from, to) = (u64::from(from), u64::from(to));
    let shares = |i: u64| {
        // In units of 1/to of a texel: whole numbers.
        let (start, end) = (i * from, (i + 1) * from);
        let first = start / to;
        let share = |texel: u64| (end.min((texel + 1) * to) - start.max(texel * to)) as f64 / from as f64;
        Shares { first: first as usize, shares: (first..=(end - 1) / to).map(share).collect() }
    };
    (0..to).map(shares).collect()
}
