//! Measured isotropic reflectance on the grid of the MERL database (Matusik et al. 2003, "A Data-Driven Reflectance Model"):
//! the half vector's polar angle, finer towards the peak, by the light's polar and azimuth angle about the half vector
//! (Rusinkiewicz 1998). Twin of `glsl/include/reflectance/merl.glsl`.

use crate::reflectance::half_row::{Rows, arc};
use crate::reflectance::{MerlError, Reflectance, clamped, packing};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Bins of theta_half over 0..pi/2, uniform in its square root.
pub const THETA_HALF: usize = 90;
/// Bins of theta_diff over 0..pi/2.
pub const THETA_DIFF: usize = 90;
/// Bins of phi_diff over 0..pi; the other half of the circle is its mirror by reciprocity.
pub const PHI_DIFF: usize = 180;

const ENTRIES: usize = THETA_HALF * SLICE;
/// Entries of one theta_half.
const SLICE: usize = THETA_DIFF * PHI_DIFF;
const HEADER_BYTES: usize = 12;
/// 1/sr over the stored number, per channel.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// An isotropic table of 90 x 90 x 180 reflectances (theta_half, theta_diff, phi_diff), in 1/sr.
#[derive(Clone, Debug, PartialEq)]
pub struct MerlTable {
    /// Rec.709 values at bin centres, `[theta_half][theta_diff][phi_diff]`; finite and not negative.
    values: Vec<[f32; 3]>,
}

impl MerlTable {
    /// Tabulates `f(theta_half, theta_diff, phi_diff)` (radians to 1/sr) at the bin centres. Values that are negative or not
    /// finite as `f32` become 0, the table's word for "no measurement". `f` is also asked for angles that put one direction
    /// below the horizon: what it says there is interpolated into the last bins above it.
    pub fn from_fn(mut f: impl FnMut(f64, f64, f64) -> DVec3) -> Self {
        let mut values = vec![[0.0; 3]; ENTRIES];
        values.chunks_exact_mut(SLICE).enumerate().for_each(|(i, slice)| fill(slice, i, &mut f));
        Self { values }
    }

    /// [`Self::from_fn`] on all cores.
    pub(super) fn from_fn_parallel(f: impl Fn(f64, f64, f64) -> DVec3 + Sync) -> Self {
        let mut values = vec![[0.0; 3]; ENTRIES];
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(THETA_HALF);
        let mut shares: Vec<Vec<_>> = (0..threads).map(|_| Vec::new()).collect();
        for (i, slice) in values.chunks_exact_mut(SLICE).enumerate() {
            if let Some(share) = shares.get_mut(i % threads) {
                share.push((i, slice));
            }
        }
        std::thread::scope(|scope| {
            for share in shares {
                scope.spawn(|| share.into_iter().for_each(|(i, slice)| fill(slice, i, &f)));
            }
        });
        Self { values }
    }

    /// The mean of tables; black for none.
    pub(super) fn mean(tables: &[impl AsRef<Self>]) -> Self {
        let mut values = vec![[0.0; 3]; ENTRIES];
        for table in tables {
            let pairs = values.as_flattened_mut().iter_mut().zip(table.as_ref().values.as_flattened());
            pairs.for_each(|(sum, value)| *sum += value / tables.len() as f32);
        }
        Self { values }
    }

    /// Reads a `.binary` file: three little-endian `i32` (90, 90, 180), then a plane of `f64` per channel, which the
    /// database's factors (1, 1.15, 1.66) / 1500 bring to 1/sr. Negative entries mark missing measurements and read as 0.
    ///
    /// # Errors
    /// [`MerlError`] for other dimensions, a file that is too short or too long, or an entry that is not finite as `f32`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MerlError> {
        let error = |field: &str, offset: usize, expected: String, got: String| MerlError {
            field: field.into(),
            offset: offset as u64,
            expected,
            got,
        };
        let size = HEADER_BYTES + 3 * ENTRIES * size_of::<f64>();
        let expected_size = || format!("{size} bytes");
        let Some((header, planes)) = bytes.split_at_checked(HEADER_BYTES) else {
            return Err(error("size", bytes.len(), expected_size(), format!("{} bytes", bytes.len())));
        };
        let dimensions: Vec<_> = header.as_chunks().0.iter().map(|&d| i32::from_le_bytes(d)).collect();
        if dimensions != [THETA_HALF as i32, THETA_DIFF as i32, PHI_DIFF as i32] {
            let expected = format!("{THETA_HALF} {THETA_DIFF} {PHI_DIFF}");
            let got = dimensions.iter().map(i32::to_string).collect::<Vec<_>>().join(" ");
            return Err(error("dimensions", 0, expected, got));
        }
        if bytes.len() != size {
            return Err(error("size", bytes.len().min(size), expected_size(), format!("{} bytes", bytes.len())));
        }

        let mut values = vec![[0.0; 3]; ENTRIES];
        for (at, &entry) in planes.as_chunks().0.iter().enumerate() {
            let (channel, index) = (at / ENTRIES, at % ENTRIES);
            let entry = f64::from_le_bytes(entry);
            let Some(value) = stored(entry * SCALE[channel]) else {
                let field = format!("{} entry {index}", ["red", "green", "blue"][channel]);
                let offset = HEADER_BYTES + at * size_of::<f64>();
                return Err(error(&field, offset, "a finite number in single precision".into(), format!("{entry:e}")));
            };
            values[index][channel] = value;
        }
        Ok(Self { values })
    }

    /// Writes a `.binary` file that [`Self::from_bytes`] reads back bit for bit: the rounding of the division by the
    /// channel's factor, and of the multiplication when read, is far below the precision of `f32`.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, writer: &mut impl std::io::Write) -> std::io::Result<()> {
        for dimension in [THETA_HALF, THETA_DIFF, PHI_DIFF] {
            writer.write_all(&(dimension as i32).to_le_bytes())?;
        }
        for (channel, scale) in SCALE.into_iter().enumerate() {
            let plane: Vec<u8> = self.values.iter().flat_map(|v| (f64::from(v[channel]) / scale).to_le_bytes()).collect();
            writer.write_all(&plane)?;
        }
        Ok(())
    }

    /// The table for the GPU: a factor and one `E5B9G9R9_UFLOAT_PACK32` per entry, `[theta_half][theta_diff][phi_diff]`; an
    /// entry's value is the factor times what [`packing::decode`] returns. The factor is 1 unless an entry is above
    /// [`packing::MAX`], then the least power of two that brings all below.
    pub fn packed(&self) -> (f32, Vec<u32>) {
        let scale = self.packing_scale();
        (scale, self.packed_at(scale))
    }

    /// The factor of [`Self::packed`].
    pub fn packing_scale(&self) -> f32 {
        let largest = self.values.iter().flatten().fold(0.0, |a: f32, &c| a.max(c));
        let mut scale = 1.0;
        while f64::from(largest) / scale > packing::MAX {
            scale *= 2.0;
        }
        scale as f32
    }

    /// The entries of [`Self::packed`] under a given factor above 0.
    pub fn packed_at(&self, scale: f32) -> Vec<u32> {
        self.values.iter().map(|&v| packing::encode(vector(v) / f64::from(scale))).collect()
    }

    /// The table that [`Self::packed`] entries stand for: what the GPU reads.
    pub fn unpacked(scale: f32, entries: &[u32]) -> Self {
        let decoded = entries.iter().map(|&e| (packing::decode(e) * f64::from(scale)).as_vec3().to_array());
        let mut values: Vec<_> = decoded.take(ENTRIES).collect();
        values.resize(ENTRIES, [0.0; 3]);
        Self { values }
    }

    /// The value of a bin.
    fn at(&self, half: usize, diff: usize, phi: usize) -> DVec3 {
        vector(self.values[(half * THETA_DIFF + diff) * PHI_DIFF + phi])
    }

    /// Trilinear between bin centres, in bins; theta clamped to the outermost centres, phi_diff periodic.
    fn interpolate(&self, angles: Angles) -> DVec3 {
        let Angles { theta_half, theta_diff, phi_diff } = angles;
        let (h0, h1, h) = clamped((theta_half / FRAC_PI_2).sqrt(), THETA_HALF);
        let (d0, d1, d) = clamped(theta_diff / FRAC_PI_2, THETA_DIFF);
        let p = phi_diff / PI * PHI_DIFF as f64 - 0.5;
        let p0 = (p.floor() as i64).rem_euclid(PHI_DIFF as i64) as usize;
        let (p1, p) = ((p0 + 1) % PHI_DIFF, p - p.floor());

        let along_phi = |i, j| self.at(i, j, p0).lerp(self.at(i, j, p1), p);
        let along_diff = |i| along_phi(i, d0).lerp(along_phi(i, d1), d);
        along_diff(h0).lerp(along_diff(h1), h)
    }
}

impl Reflectance for MerlTable {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 { DVec3::ZERO } else { self.interpolate(Angles::of(wi, wo)) }
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        let values: Vec<f32> = self.values.iter().map(|&v| weights.dot(vector(v)) as f32).collect();
        Box::new(move |row, out| {
            let [sine, cosine] = row.polar;
            let (h0, h1, h) = clamped((sine.atan2(cosine) / FRAC_PI_2).sqrt(), THETA_HALF);
            let [first, second] = [h0, h1].map(|i| values.get(i * SLICE..(i + 1) * SLICE).unwrap_or_default());
            let [cos, sin] = row.azimuths;
            let (mut thetas, mut phis) = ([0.0; 64], [0.0; 64]);
            for (chunk, out) in out.chunks_mut(64).enumerate() {
                let columns = cos.iter().zip(sin).zip(row.cosines).skip(64 * chunk);
                for ((theta, phi), ((cos, sin), diff)) in thetas.iter_mut().zip(&mut phis).zip(columns) {
                    // The viewer in the frame of the half vector: (-x, -y, cosine of theta_diff).
                    let (x, y) = (row.wo.z * sine - row.wo.x * cos * cosine, row.wo.x * sin);
                    *theta = arc((x * x + y * y).sqrt(), *diff);
                    *phi = arc(y, x);
                }
                for ((value, theta), phi) in out.iter_mut().zip(thetas).zip(phis) {
                    let (d0, d1, d) = clamped(theta / FRAC_PI_2, THETA_DIFF);
                    // From half a bin before the first centre to half a bin behind the last.
                    let p = phi / PI * PHI_DIFF as f64 + 0.5;
                    let p1 = p as usize;
                    let p = p - p1 as f64;
                    let p0 = p1.checked_sub(1).unwrap_or(PHI_DIFF - 1);
                    let p1 = if p1 == PHI_DIFF { 0 } else { p1 };
                    let along = |d: usize, p: usize| {
                        let at = d * PHI_DIFF + p;
                        let (a, b) = (f64::from(first[at]), f64::from(second[at]));
                        a + (b - a) * h
                    };
                    let across = |d| along(d, p0) + (along(d, p1) - along(d, p0)) * p;
                    *value = across(d0) + (across(d1) - across(d0)) * d;
                }
            }
        })
    }
}

/// The coordinates of a pair of directions on the grid, in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// Between the normal and the half vector.
    pub theta_half: f64,
    /// Between the half vector and either direction.
    pub theta_diff: f64,
    /// Azimuth of the light about the half vector, 0 towards increasing theta_half; pi more or less means the directions
    /// swapped, which reflectance does not tell apart.
    pub phi_diff: f64,
}

impl Angles {
    /// The angles of unit directions `wi` and `wo` above the horizon. Precise for all of them, also where the half vector
    /// is the normal (its azimuth then counts as 0) or the directions coincide: every angle comes from an arc tangent.
    pub fn of(wi: DVec3, wo: DVec3) -> Self {
        let (sum, difference) = (wi + wo, wi - wo);
        let h = sum.normalize_or(DVec3::Z);
        let sine = h.x.hypot(h.y);
        let azimuth = if sine > 0.0 { DVec2::new(h.x, h.y) / sine } else { DVec2::X };
        // Tangents about the half vector; the difference of the directions is orthogonal to it.
        let x = difference.dot(DVec3::new(azimuth.x * h.z, azimuth.y * h.z, -sine));
        let y = difference.dot(DVec3::new(-azimuth.y, azimuth.x, 0.0));
        Self { theta_half: sine.atan2(h.z), theta_diff: difference.length().atan2(sum.length()), phi_diff: y.atan2(x) }
    }

    /// Directions `(wi, wo)` with these angles and the half vector in the xz-plane; they can lie below the horizon.
    pub fn directions(self) -> (DVec3, DVec3) {
        let (h_sin, h_cos) = self.theta_half.sin_cos();
        let (d_sin, d_cos) = self.theta_diff.sin_cos();
        let (p_sin, p_cos) = self.phi_diff.sin_cos();
        let along = DVec3::new(h_sin, 0.0, h_cos) * d_cos;
        let across = DVec3::new(h_cos * p_cos, p_sin, -h_sin * p_cos) * d_sin;
        (along + across, along - across)
    }
}

/// Tabulates one theta_half.
fn fill(slice: &mut [[f32; 3]], i: usize, mut f: impl FnMut(f64, f64, f64) -> DVec3) {
    let theta_half = FRAC_PI_2 * ((i as f64 + 0.5) / THETA_HALF as f64).powi(2);
    for (j, row) in slice.chunks_exact_mut(PHI_DIFF).enumerate() {
        let theta_diff = FRAC_PI_2 * (j as f64 + 0.5) / THETA_DIFF as f64;
        for (k, entry) in row.iter_mut().enumerate() {
            let rgb = f(theta_half, theta_diff, PI * (k as f64 + 0.5) / PHI_DIFF as f64);
            *entry = rgb.to_array().map(|c| stored(c).unwrap_or(0.0));
        }
    }
}

/// A value as the table holds it: negative is 0; `None` if it is not finite in single precision.
fn stored(value: f64) -> Option<f32> {
    let value = value as f32;
    value.is_finite().then_some(if value > 0.0 { value } else { 0.0 })
}

fn vector([r, g, b]: [f32; 3]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}
