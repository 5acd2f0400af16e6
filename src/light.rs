//! Lights beside the environment. No visibility but the host's masks: each adds to what the others send.

use crate::error::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Lights that one frame can have.
pub const MAX_LIGHTS: usize = 256;

/// A light in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A point.
    Point {
        /// Where it is.
        position: [f32; 3],
        /// Radiant intensity in W/sr.
        intensity: [f32; 3],
    },
    /// Parallel light.
    Directional {
        /// The way the light travels.
        direction: [f32; 3],
        /// Irradiance at normal incidence in W/m^2.
        irradiance: [f32; 3],
    },
    /// A sphere that radiates outwards.
    Sphere {
        /// Centre.
        position: [f32; 3],
        /// Radius in metres.
        radius: f32,
        /// Radiance in W/(m^2 sr).
        radiance: [f32; 3],
    },
    /// A parallelogram that radiates on the side of `u x v`.
    Rectangle {
        /// Centre.
        position: [f32; 3],
        /// First half-edge.
        u: [f32; 3],
        /// Second half-edge.
        v: [f32; 3],
        /// Radiance in W/(m^2 sr).
        radiance: [f32; 3],
    },
}

/// Mirrors `LightRecord` in `glsl/include/lights.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct LightRecord {
    place: [f32; 4],
    power: [f32; 4],
    edge_u: [f32; 4],
    edge_v: [f32; 4],
}

impl Light {
    /// Whether it is sampled; points and directions are summed exactly.
    pub(crate) fn is_area(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Rectangle { .. })
    }

    /// Of what is sampled, the radiance in its largest channel; 0 of all else.
    pub(crate) fn sampled_radiance(&self) -> f32 {
        match *self {
            Self::Sphere { radiance: [r, g, b], .. } | Self::Rectangle { radiance: [r, g, b], .. } => r.max(g).max(b),
            Self::Point { .. } | Self::Directional { .. } => 0.0,
        }
    }

    fn record(&self) -> LightRecord {
        let with = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w];
        let none = LightRecord::default();
        match *self {
            Self::Point { position, intensity } => {
                LightRecord { place: with(position, 0.0), power: with(intensity, 0.0), ..none }
            }
            Self::Directional { direction, irradiance } => {
                let towards = -Vec3::from(direction).normalize();
                LightRecord { place: with(towards.to_array(), 1.0), power: with(irradiance, 0.0), ..none }
            }
            Self::Sphere { position, radius, radiance } => {
                LightRecord { place: with(position, 2.0), power: with(radiance, radius), ..none }
            }
            Self::Rectangle { position, u, v, radiance } => {
                LightRecord { place: with(position, 3.0), power: with(radiance, 0.0), edge_u: with(u, 0.0), edge_v: with(v, 0.0) }
            }
        }
    }

    fn check(&self, index: usize) -> Result<()> {
        let bad =
            |field: &str, expected: &str, got: String| Err(Error::invalid(format!("lights[{index}].{field}"), expected, got));
        let (power, places): ([f32; 3], Vec<[f32; 3]>) = match *self {
            Self::Point { position, intensity } => (intensity, vec![position]),
            Self::Directional { direction, irradiance } => (irradiance, vec![direction]),
            Self::Sphere { position, radiance, .. } => (radiance, vec![position]),
            Self::Rectangle { position, u, v, radiance } => (radiance, vec![position, u, v]),
        };
        if !power.iter().all(|c| c.is_finite() && *c >= 0.0) {
            return bad("power", "finite and not negative", format!("{power:?}"));
        }
        if !places.as_flattened().iter().all(|c| c.is_finite()) {
            return bad("position", "finite numbers", format!("{places:?}"));
        }
        match *self {
            Self::Directional { direction, .. } if Vec3::from(direction).length_squared() < 1e-20 => {
                bad("direction", "a vector of some length", format!("{direction:?}"))
            }
            Self::Sphere { radius, .. } if !(radius > 0.0 && radius.is_finite()) => {
                bad("radius", "finite and positive", radius.to_string())
            }
            Self::Rectangle { u, v, .. } if Vec3::from(u).cross(Vec3::from(v)).length_squared() < 1e-20 => {
                bad("u, v", "edges that span an area", format!("{u:?}, {v:?}"))
            }
            _ => Ok(()),
        }
    }
}

/// Refuses what cannot be evaluated.
pub(crate) fn check(lights: &[Light]) -> Result<()> {
    if lights.len() > MAX_LIGHTS {
        return Err(Error::invalid("lights", format!("at most {MAX_LIGHTS}"), lights.len()));
    }
    lights.iter().enumerate().try_for_each(|(i, light)| light.check(i))
}

/// Records, exact lights first, each with its number, and the numbers of exact and area lights.
pub(crate) fn records(lights: &[Light]) -> (Vec<LightRecord>, [u32; 2]) {
    let (area, exact): (Vec<_>, Vec<_>) = lights.iter().enumerate().partition(|(_, light)| light.is_area());
    let record = |(i, light): &(usize, &Light)| {
        let mut record = light.record();
        record.edge_u[3] = *i as f32;
        record
    };
    let records = exact.iter().chain(&area).map(record).collect();
    (records, [exact.len() as u32, area.len() as u32])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_lights_come_first_and_bad_ones_are_named() {
        let sphere = Light::Sphere { position: [0.0; 3], radius: 1.0, radiance: [1.0; 3] };
        let point = Light::Point { position: [0.0; 3], intensity: [1.0; 3] };
        let (records, counts) = records(&[sphere, point, sphere]);
        assert_eq!(counts, [1, 2]);
        assert_eq!(records.iter().map(|r| (r.place[3], r.edge_u[3])).collect::<Vec<_>>(), [(0.0, 1.0), (2.0, 0.0), (2.0, 2.0)]);
        let flat = Light::Rectangle { position: [0.0; 3], u: [1.0, 0.0, 0.0], v: [2.0, 0.0, 0.0], radiance: [1.0; 3] };
        assert!(check(&[sphere, flat]).unwrap_err().to_string().contains("lights[1].u, v"));
        assert!(check(&[Light::Sphere { position: [0.0; 3], radius: -1.0, radiance: [1.0; 3] }]).is_err());
        assert!(check(&[Light::Point { position: [f32::NAN; 3], intensity: [1.0; 3] }]).is_err());
        assert!(check(&[point; MAX_LIGHTS + 1]).is_err());
    }
}
