//! Measured reflectance of the RGL database (Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material
//! Acquisition and Rendering"), isotropic and anisotropic, as linear Rec.709 colour.
//!
//! The half vector m is stored in the square as `u(theta) = sqrt(2 theta / pi)`, `u(phi) = (phi + pi) / (2 pi)`; for every
//! measured incidence the density of visible normals warps the square so that the rest of the reflectance is smooth there.

use crate::reflectance::{DataError, MerlTable, Reflectance, TurnedTables};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

mod container;
mod warp;

use container::Field;
use warp::{Grids, Warp};

/// Nodes over one period of the half vector's azimuth when an anisotropic material is baked.
pub const BAKED_NODES: usize = 16;

/// A material of the database. The incidence that the file is organised by is taken to be the viewer's direction.
#[derive(Clone, Debug)]
pub struct Rgl {
    /// Density of normals over the square.
    ndf: Grids<f64>,
    /// Projected area of the microsurface over the incidence's square.
    sigma: Grids<f64>,
    /// Warp by the visible normals, by incidence (phi, theta).
    vndf: Warp,
    /// What remains of the colour, over the warped square.
    rgb: Grids<DVec3>,
    /// Whether `ndf` and `sigma` are factors; otherwise `rgb` is the value itself.
    jacobian: bool,
    isotropic: bool,
    /// Parts of the circle of incidence that are alike: 1, 2 (half a turn) or 4 (mirrored in x and y).
    parts: u32,
}

impl Rgl {
    /// Reads a `.bsdf` file that has the field `rgb`.
    ///
    /// # Errors
    /// [`DataError`] with the byte offset for anything that is no such file: a directory that does not fit, a field that is
    /// missing, of another type or shape, not finite or negative where it is a density, incidences that do not rise, or a
    /// file of spectra only.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DataError> {
        let fields = container::fields(bytes)?;
        let field = |name: &str| {
            let found = fields.iter().find(|f| f.name == name);
            found.ok_or_else(|| DataError::new(name, 0, "a field of that name", "none"))
        };
        if !fields.iter().any(|f| f.name == "rgb") && fields.iter().any(|f| f.name == "spectra") {
            return Err(DataError::new("rgb", 0, "a field of that name (the database has each material as RGB)", "spectra only"));
        }
        let phi = axis(field("phi_i")?)?;
        let theta = axis(field("theta_i")?)?;
        let rgb = field("rgb")?;
        let jacobian = field("jacobian")?.flag()?;
        let isotropic = phi.len() <= 2;
        let parts = if isotropic { 1 } else { parts(field("phi_i")?, &phi)? };

        let plane = |name: &str| -> Result<Grids<f64>, DataError> {
            let field = field(name)?;
            let [height, width] = shape(field, &[])?;
            grids(field, [width, height], vec![], field.floats()?)
        };
        let (ndf, sigma) = (plane("ndf")?, plane("sigma")?);
        let vndf = field("vndf")?;
        let [height, width] = shape(vndf, &[phi.len(), theta.len()])?;
        let density = grids(vndf, [width, height], vec![phi.clone(), theta.clone()], vndf.floats()?)?;
        let vndf = Warp::new(density).ok_or_else(|| {
            DataError::new("vndf", vndf.offset, "densities >= 0 with a sum above 0 for every incidence", "others")
        })?;

        let [height, width] = shape(rgb, &[phi.len(), theta.len(), 3])?;
        let values = rgb.floats()?;
        let colours = values.chunks_exact(3 * width * height).flat_map(|incidence| {
            let channel = |c: usize| incidence.iter().skip(c * width * height).copied();
            channel(0).zip(channel(1)).zip(channel(2)).take(width * height).map(|((r, g), b)| DVec3::new(r, g, b))
        });
        let rgb = grids(rgb, [width, height], vec![phi.clone(), theta.clone()], colours.collect())?;
        Ok(Self { ndf, sigma, vndf, rgb, jacobian, isotropic, parts })
    }

    /// The table that stands for an isotropic material on the GPU: the mean of both orders of the directions, as measured
    /// data are not quite reciprocal.
    pub fn bake(&self) -> MerlTable {
        MerlTable::bake(|wi, wo| self.reciprocal(wi, wo))
    }

    /// The tables that stand for any material on the GPU, [`BAKED_NODES`] over one period of the half vector's azimuth, or
    /// one if it is isotropic; the mean of both orders of the directions.
    pub fn bake_turned(&self) -> crate::Result<TurnedTables> {
        // Mirrored quarters are no period, but half turns are.
        let symmetry = self.parts.min(2);
        let count = if self.isotropic { 1 } else { BAKED_NODES };
        let azimuth = |i: usize| TAU * i as f64 / (f64::from(symmetry) * count as f64);
        let node = |i| Arc::new(MerlTable::bake_turned(azimuth(i), |wi, wo| self.reciprocal(wi, wo)));
        TurnedTables::new((0..count).map(node).collect(), symmetry)
    }

    fn reciprocal(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        (self.evaluate(wi, wo) + self.evaluate(wo, wi)) / 2.0
    }
}

impl Reflectance for Rgl {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let (light, view) = self.folded(wi, wo);
        let m = (light + view).normalize();
        let (phi_i, theta_i) = (azimuth(view), polar(view));
        let turn = if self.isotropic { azimuth(m) - phi_i } else { azimuth(m) };
        let v = u_phi(turn);
        let u_m = [u_theta(polar(m)), v - v.floor()];
        let incidence = [phi_i, theta_i];
        let s = self.vndf.invert(u_m, &incidence);
        let mut value = self.rgb.value(s, &incidence);
        if self.jacobian {
            let sigma = self.sigma.value([u_theta(theta_i), u_phi(phi_i)], &[]);
            value *= if sigma > 0.0 { self.ndf.value(u_m, &[]) / (4.0 * sigma) } else { 0.0 };
        }
        // The stored value includes the light's cosine.
        (value / wi.z).max(DVec3::ZERO)
    }

    fn isotropic(&self) -> bool {
        self.isotropic
    }

    /// By quadrature over the turns, 8 a period.
    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if self.isotropic {
            return self.evaluate(wi, wo);
        }
        const TURNS: u32 = 8;
        let angle = |i: u32| TAU * (f64::from(i) + 0.5) / f64::from(TURNS * self.parts.min(2));
        let at = |i| {
            let turn = glam::DVec2::from_angle(angle(i));
            self.evaluate(super::turned(turn, wi), super::turned(turn, wo))
        };
        (0..TURNS).map(at).sum::<DVec3>() / f64::from(TURNS)
    }
}

impl Rgl {
    /// Both directions turned or mirrored so that the view is in the part of the circle that was measured, from azimuth -pi.
    fn folded(&self, wi: DVec3, wo: DVec3) -> (DVec3, DVec3) {
        let down = |x: f64| if x.is_sign_negative() { 1.0 } else { -1.0 };
        let sign = match self.parts {
            2 => DVec3::new(down(wo.y), down(wo.y), 1.0),
            4 => DVec3::new(down(wo.x), down(wo.y), 1.0),
            _ => DVec3::ONE,
        };
        (wi * sign, wo * sign)
    }
}

fn azimuth(w: DVec3) -> f64 {
    w.y.atan2(w.x)
}

fn polar(w: DVec3) -> f64 {
    w.x.hypot(w.y).atan2(w.z)
}

fn u_theta(theta: f64) -> f64 {
    (theta / FRAC_PI_2).sqrt()
}

fn u_phi(phi: f64) -> f64 {
    (phi + PI) / TAU
}

/// Rising nodes.
fn axis(field: &Field<'_>) -> Result<Vec<f64>, DataError> {
    let [_] = *field.shape.as_slice() else {
        return Err(DataError::new(format!("{} shape", field.name), field.at, "one dimension", format!("{:?}", field.shape)));
    };
    let nodes = field.floats()?;
    if nodes.is_empty() || !nodes.is_sorted_by(|a, b| a < b) {
        return Err(DataError::new(&field.name, field.offset, "rising numbers", format!("{nodes:.3?}")));
    }
    Ok(nodes)
}

/// How often the range of measured azimuths goes into the circle.
fn parts(field: &Field<'_>, phi: &[f64]) -> Result<u32, DataError> {
    let range = phi.last().zip(phi.first()).map_or(0.0, |(last, first)| last - first);
    match (TAU / range).round() as u32 {
        parts @ (1 | 2 | 4) => Ok(parts),
        _ => Err(DataError::new("phi_i", field.offset, "a whole, half or quarter circle", format!("{range} radians"))),
    }
}

/// Rows and columns of a field whose leading dimensions must be `leading`.
fn shape(field: &Field<'_>, leading: &[usize]) -> Result<[usize; 2], DataError> {
    match field.shape.split_last_chunk::<2>() {
        Some((front, &[rows, columns])) if front == leading && rows >= 2 && columns >= 2 => Ok([rows, columns]),
        _ => {
            let leading: String = leading.iter().map(|n| format!("{n} x ")).collect();
            let expected = format!("{leading}rows x columns, at least 2 each");
            Err(DataError::new(format!("{} shape", field.name), field.at, expected, format!("{:?}", field.shape)))
        }
    }
}

fn grids<T: warp::Value>(
    field: &Field<'_>,
    size: [usize; 2],
    axes: Vec<Vec<f64>>,
    values: Vec<T>,
) -> Result<Grids<T>, DataError> {
    let got = values.len();
    let fits = Grids::new(size, axes, values);
    fits.ok_or_else(|| DataError::new(&field.name, field.offset, "as many entries as its shape has", got))
}
