//! The lobes that a filter found at a sample, in f64: what `glsl/include/lobes.glsl` and `reflected.glsl` make of those of directions
//! of a GGX material.

use glam::{DMat3, DVec3};
use passband::distribution::mixture::{Masking, Mixture};
use passband::distribution::reflected::ReflectedLobe;
use passband::distribution::surface::{FoundLobes, Surface};
use passband::distribution::vmf::{self, Lobe};
use passband::reflectance::{Ggx, Model, Reflectance, frame};
use std::f64::consts::{PI, TAU};

/// The least cosine of a facet to the viewer.
const FACING: f64 = 0.02;

/// Of one sample, in its local frame.
pub struct Found {
    material: Ggx,
    lobes: Vec<Lobe>,
    normals: Vec<DVec3>,
    surface: Surface,
}

fn schlick(f0: DVec3, cosine: f64) -> DVec3 {
    f0 + (DVec3::ONE - f0) * (1.0 - cosine).max(0.0).powi(5)
}

fn oct(at: [f64; 2]) -> DVec3 {
    let z = 1.0 - at[0].abs() - at[1].abs();
    let fold = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 } } else { a };
    DVec3::new(fold(at[0], at[1]), fold(at[1], at[0]), z).normalize()
}

impl Found {
    /// Of texels of four words each, in a frame whose columns are x, y and z; `None` without lobes.
    pub fn unpack(texels: impl Iterator<Item = [u32; 4]>, local: &DMat3, material: Ggx) -> Option<Self> {
        let (mut lobes, mut normals) = (Vec::new(), Vec::new());
        for [x, y, normal, rest] in texels.take_while(|t| t[3] & 0xffff != 0) {
            let signed = |bits: u32| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0);
            let kappa = (f64::from(rest >> 16) * 48.0 / 65535.0 - 16.0).exp2();
            let weight = f64::from(half::f16::from_bits(rest as u16 & 0x7fff));
            lobes.push(Lobe { mu: local.transpose() * oct([x, y].map(|b| f64::from(f32::from_bits(b)))), kappa, weight });
            normals.push(local.transpose() * oct([normal, normal >> 16].map(signed)));
        }
        let found = FoundLobes {
            normal: DVec3::Z,
            lobes: Mixture::Vmf(lobes.clone()),
            normals: normals.clone(),
            // Weights hold the masses already.
            below: lobes.iter().map(|l| l.kappa).collect(),
            mass: None,
            own: Vec::new(),
            colours: Vec::new(),
            facing: 1.0,
            masking: Masking::Cavities,
        };
        let surface = Surface::new(Model::Ggx(material), &found, DVec3::ONE, DVec3::ZERO);
        (!lobes.is_empty()).then_some(Self { material, lobes, normals, surface })
    }

    /// Share of directions that are drawn by the cosine.
    fn diffuse(&self) -> f64 {
        let mean = |c: DVec3| c.element_sum() / 3.0;
        let (base, gloss) = (mean(self.material.albedo), mean(self.material.f0));
        if base > 0.0 { base / (base + gloss) } else { 0.0 }
    }

    fn alpha_squared(lobe: &Lobe) -> f64 {
        (2.0 / lobe.kappa).clamp(1e-6, 1.0)
    }

    /// A direction of light for `u` uniform in the unit square; `None` if none is drawn.
    pub fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        let share = self.diffuse();
        let (sin, cos) = ((2.0 * u[1] - 1.0) * PI).sin_cos();
        if u[0] < share {
            let square = u[0] / share;
            return Some(DVec3::new(square.sqrt() * cos, square.sqrt() * sin, (1.0 - square).sqrt()));
        }
        let total: f64 = self.lobes.iter().map(|l| l.weight).sum();
        let mut left = (u[0] - share) / (1.0 - share) * total;
        let mut chosen = self.lobes.last()?;
        for lobe in &self.lobes {
            chosen = lobe;
            if left < lobe.weight {
                break;
            }
            left -= lobe.weight;
        }
        // The last also takes what rounding leaves.
        let along = if std::ptr::eq(chosen, self.lobes.last()?) && left > chosen.weight { 1.0 } else { left / chosen.weight };
        let square = Self::alpha_squared(chosen) * along / (1.0 - along).max(1e-7);
        let t = square / (1.0 + square + (1.0 + square).sqrt());
        let [x, y] = frame::basis(chosen.mu);
        let h = (x * cos + y * sin) * (t * (2.0 - t)).max(0.0).sqrt() + chosen.mu * (1.0 - t);
        let across = wo.dot(h);
        (across > 0.0).then(|| h * (2.0 * across) - wo)
    }

    /// Density per steradian of [`Self::sample`].
    pub fn density(&self, wi: DVec3, wo: DVec3) -> f64 {
        let h = (wi + wo).normalize();
        let of = |l: &Lobe| {
            let (square, a) = ((h - l.mu).length_squared(), Self::alpha_squared(l));
            let (cosine, sine) = (1.0 - 0.5 * square, square * (1.0 - 0.25 * square));
            if cosine > 0.0 { l.weight * cosine * a / (PI * (a * cosine * cosine + sine).powi(2)) } else { 0.0 }
        };
        let weights: f64 = self.lobes.iter().map(|l| l.weight).sum();
        let specular = self.lobes.iter().map(of).sum::<f64>() / (4.0 * wo.dot(h) * weights);
        specular + (wi.z.max(0.0) / PI - specular) * self.diffuse()
    }

    /// Reflectance.
    pub fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.surface.evaluate(wi, wo)
    }

    /// How fast the lobes vary about `wi`, in cycles/radian.
    pub fn bandwidth(&self, wi: DVec3, wo: DVec3) -> f64 {
        let reflected = |(lobe, normal): (&Lobe, &DVec3)| {
            let cosine = wo.dot(lobe.mu);
            let direction = lobe.mu * (2.0 * cosine) - wo;
            let kappa = 2.0 / Self::alpha_squared(lobe);
            if cosine <= 0.0 || direction.z <= 0.0 {
                return ReflectedLobe { direction: DVec3::Z, kappa: kappa / 4.0, weight: DVec3::ZERO };
            }
            let square = Self::alpha_squared(lobe);
            let masking = |c: f64| 1.0 / (c + (square + (1.0 - square) * c * c).sqrt());
            let (ci, co) = (normal.dot(direction).max(0.0), normal.dot(wo).max(FACING));
            let narrow = kappa / (4.0 * cosine);
            let value = ci * masking(ci) * masking(co) * kappa / TAU * lobe.weight / vmf::normalisation(narrow);
            ReflectedLobe { direction, kappa: narrow, weight: schlick(self.material.f0, cosine) * value }
        };
        let lobes: Vec<_> = self.lobes.iter().zip(&self.normals).map(reflected).map(|lobe| (lobe, 1.0)).collect();
        let below = DVec3::ONE - schlick(self.material.f0, (0.5 + 0.5 * wo.z).sqrt());
        let diffuse = self.material.albedo * below / PI;
        passband::reflectance::bandwidth::found(&lobes, diffuse.element_sum() / 3.0, wi)
    }
}
