//! The suns of an environment as shaders read them ([`crate::distribution::suns`] finds them).

use crate::distribution::prefilter::{Chain, STEPS_TO_MAP};
use crate::distribution::suns::{MAX_POINTS, MAX_SUNS, Suns};
use crate::sampling::{LatLong, latlong};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Mirrors `SunList` in `glsl/include/suns.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct SunList {
    scale: [f32; 4],
    rule: [f32; 4],
    count: [i32; 4],
    all: [SunRecord; MAX_SUNS],
    points: [SunPoint; MAX_SUNS * MAX_POINTS],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SunRecord {
    place: [f32; 4],
    irradiance: [f32; 4],
    texels: [i32; 4],
    points: [u32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SunPoint {
    place: [f32; 4],
    irradiance: [f32; 4],
}

impl SunList {
    /// The suns of `map`, and how look-ups find their levels in `chain`.
    pub fn of(map: &LatLong, chain: Chain) -> Self {
        let Suns { suns, bright, kept } = Suns::of(map);
        let mut list = Self {
            scale: [(0.5 / chain.kappa(1)) as f32, (2 * chain.levels() - 3) as f32, (1.0 / STEPS_TO_MAP) as f32, 0.0],
            rule: [bright, kept, 0.0, 0.0],
            count: [suns.len() as i32, 0, 0, 0],
            ..Self::zeroed()
        };
        let place = |direction, z: f64| latlong::uv(direction).extend(z).extend(0.0).as_vec4().to_array();
        let rgb = |irradiance: DVec3| irradiance.extend(0.0).as_vec4().to_array();
        let mut points = Vec::new();
        for (record, sun) in list.all.iter_mut().zip(&suns) {
            let [x0, x1, y0, y1] = sun.texels;
            let distance = 2.0 * (0.5 * sun.radius).sin();
            *record = SunRecord {
                place: place(sun.direction, distance * distance),
                irradiance: rgb(sun.irradiance),
                texels: [x0.rem_euclid(map.width() as i32), x1 - x0, y0, y1],
                points: [points.len() as u32, sun.points.len() as u32, 0, 0],
            };
            let part = |&[at, taken]: &[DVec3; 2]| SunPoint { place: place(at, 0.0), irradiance: rgb(taken) };
            points.extend(sun.points.iter().map(part));
        }
        list.points[..points.len()].copy_from_slice(&points);
        list
    }

    /// Whether it holds any.
    pub fn has_suns(&self) -> bool {
        self.count[0] > 0
    }
}
