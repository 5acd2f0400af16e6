//! `environment.glsl` against `LatLong` and `EnvironmentImportance`: look-ups, drawn directions, densities.

use crate::statistics::chi_square_p;
use crate::{COUNT, Device, Worst, direction, entry, unit};
use glam::{DMat3, DVec2, DVec3, Vec3};
use passband::offline::builtin;
use passband::offline::world::EnvironmentLight;
use passband::reflectance::{Ggx, Model};
use passband::sampling::latlong::{self, LatLong};
use passband::sampling::{EnvironmentImportance, sobol};
use std::f64::consts::{PI, TAU};

/// Error of a coordinate that the device computes and interpolates with, as a fraction of the map.
const COORDINATE: f64 = 5e-7;
/// What 32 bits leave of values and densities.
const RELATIVE: f64 = 1e-5;

/// A light, its density and its twin's view of it.
struct Case {
    light: EnvironmentLight,
    importance: EnvironmentImportance,
    density: LatLong,
}

impl Case {
    fn new(map: LatLong, intensity: f64, rotation: f64) -> Self {
        let importance = EnvironmentImportance::build(&map).unwrap();
        let density = importance.density_texels().into_iter().map(|d| [d; 3]).collect();
        let density = LatLong::new(map.width(), map.height(), density).unwrap();
        Self { light: EnvironmentLight { map, intensity, rotation, visible: false }, importance, density }
    }

    fn device(&self) -> Device {
        let ggx = Model::Ggx(Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO });
        Device::new(vec![ggx], Some(self.light.clone()))
    }

    /// World direction to the map's own.
    fn to_map(&self, w: DVec3) -> DVec3 {
        DMat3::from_rotation_y(-self.light.rotation.to_radians()) * w
    }

    /// How much `map` changes within `texels` of direction `w`: what an error of that size in the coordinate can do.
    fn variation(map: &LatLong, w: DVec3, texels: f64) -> f64 {
        let uv = latlong::uv(w);
        let (x, y) = ((uv.x * f64::from(map.width())).floor() as i64, (uv.y * f64::from(map.height())).floor() as i64);
        let values: Vec<f64> = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| map.texel(x + dx, y + dy).max_element())).collect();
        let (low, high) = values.iter().fold((f64::INFINITY, 0f64), |(l, h), &v| (l.min(v), h.max(v)));
        2.0 * (high - low) * texels
    }
}

/// Small with noise in every texel, and large with a sun of a few texels: rotated and scaled.
fn cases() -> Vec<Case> {
    let noise = (0..32 * 16).map(|i| {
        let ([a, b], [c, d]) = (unit(i, 30), unit(i, 31));
        // A few texels hold most of the light, and some are black.
        [a, b, c].map(|v| if d < 0.2 { 0.0 } else { (v * 4f64.powf(5.0 * d)) as f32 })
    });
    vec![
        Case::new(LatLong::new(32, 16, noise.collect()).unwrap(), 2.5, 77.0),
        Case::new(builtin::environment("sun-sky", 1024).unwrap(), 1.0, 0.0),
        Case::new(builtin::environment("studio", 300).unwrap(), 0.3, -200.0),
    ]
}

#[test]
fn look_ups() {
    let mut directions: Vec<Vec3> = (0..COUNT).map(|i| direction(i, 32)).collect();
    // The poles, and the seam of an unrotated map.
    for axis in [Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::X, Vec3::NEG_Z] {
        directions.extend((0..500).map(|i| (axis + 0.01 * direction(i, 33)).normalize()));
        directions.push(axis);
    }
    for case in cases() {
        let mut directions = directions.clone();
        // Half of all towards the light, where the map changes most.
        directions.extend((0..COUNT).map(|i| {
            let w = DMat3::from_rotation_y(case.light.rotation.to_radians()) * case.importance.sample(sobol::random(i, 34)).0;
            w.normalize().as_vec3()
        }));
        let input: Vec<_> = directions.iter().flat_map(|&w| [entry(w, 0); 2]).collect();
        let output = case.device().probe("lookup", &input);
        let (mut radiance, mut density, mut per_steradian) = (Worst::default(), Worst::default(), Worst::default());
        for (&w, got) in directions.iter().zip(output.chunks(2)) {
            if w.x == 0.0 && w.z == 0.0 {
                // At a pole every u is right: any colour of its row.
                assert!(got[0].iter().chain(&got[1][..1]).all(|c| c.is_finite() && *c >= 0.0), "{w}: {got:?}");
                continue;
            }
            let w = w.as_dvec3().normalize();
            let sine = w.x.hypot(w.z);
            // The arc cosine of a rounded number is steep near the poles.
            let steep = (-23f64).exp2() / (PI * sine) * f64::from(case.light.map.height());
            let texels = COORDINATE * f64::from(case.light.map.width()) + steep;
            let [r, g, b, over_uv] = got[0].map(f64::from);
            let expected = case.light.radiance(w);
            let allowed = expected.max_element() * RELATIVE
                + case.light.intensity * Case::variation(&case.light.map, case.to_map(w), texels);
            let error = (DVec3::new(r, g, b) - expected).abs().max_element();
            radiance.add(if error == 0.0 { 0.0 } else { error / allowed }, || format!("{w}"));

            let expected = case.density.radiance(case.to_map(w)).x;
            let allowed = expected * RELATIVE + Case::variation(&case.density, case.to_map(w), texels);
            density.add((over_uv - expected).abs() / allowed, || format!("{w}"));
            // At a pole both hold the density finite, each in its own way.
            if sine > 1e-5 {
                let pdf = case.importance.pdf(case.to_map(w));
                let allowed = (allowed + expected * RELATIVE) / (TAU * PI * sine);
                per_steradian.add((f64::from(got[1][0]) - pdf).abs() / allowed, || format!("{w}"));
            }
        }
        radiance.within("radiance, of the allowed error", 1.0);
        density.within("density over uv, of the allowed error", 1.0);
        per_steradian.within("density per steradian, of the allowed error", 1.0);
    }
}

#[test]
fn drawn_directions() {
    // A tent's end is steep: half a texel moves by the square root of what 24 bits leave of a uniform number.
    const STEEP: f64 = 5e-4;
    for case in cases() {
        let numbers: Vec<_> = (0..COUNT).map(|i| sobol::random(i, 35)).chain([[0, 0], [u32::MAX; 2], [0, u32::MAX]]).collect();
        let input: Vec<_> = numbers.iter().flat_map(|&[a, b]| [[a, b, 0, 0]; 2]).collect();
        let output = case.device().probe("environment", &input);
        let turn = DMat3::from_rotation_y(case.light.rotation.to_radians());
        let (mut toward, mut density, mut radiance, mut again) =
            (Worst::default(), Worst::default(), Worst::default(), Worst::default());
        for (&u, got) in numbers.iter().zip(output.chunks(2)) {
            let at = || format!("{u:x?}");
            let (expected, pdf) = case.importance.sample(u);
            let [x, y, z, d] = got[0].map(f64::from);
            let texel = PI / f64::from(case.light.map.height());
            toward.add((DVec3::new(x, y, z) - turn * expected).length() / texel, at);
            let sine = expected.x.hypot(expected.z).max(1e-7);
            // Over uv: at the poles the sine's own error would say nothing about the map.
            let over_uv = pdf * TAU * PI * sine;
            let allowed = over_uv * (RELATIVE + STEEP * texel / sine) + Case::variation(&case.density, expected, STEEP);
            density.add((d * TAU * PI * sine - over_uv).abs() / allowed, at);
            let [r, g, b, found] = got[1].map(f64::from);
            let light = case.light.radiance(turn * expected);
            let allowed =
                light.max_element() * RELATIVE + case.light.intensity * Case::variation(&case.light.map, expected, STEEP) + 1e-12;
            radiance.add((DVec3::new(r, g, b) - light).abs().max_element() / allowed, at);
            // What multiple importance sampling relies on: a look-up finds the density that the draw states.
            let texels = 3.0 * COORDINATE * f64::from(case.light.map.width());
            let allowed = over_uv * (RELATIVE + 5e-6 / sine) + Case::variation(&case.density, expected, texels);
            again.add((found - d).abs() * TAU * PI * sine / allowed, at);
        }
        toward.within("direction, in texels", STEEP);
        density.within("density, of the allowed error", 1.0);
        radiance.within("radiance, of the allowed error", 1.0);
        again.within("density by look-up, of the allowed error", 1.0);
    }
}

#[test]
fn drawn_directions_follow_their_density() {
    const DRAWS: u32 = 400_000;
    let case = cases().swap_remove(0);
    let input: Vec<_> = (0..DRAWS).flat_map(|i| [sobol::random(i, 36); 2]).map(|[a, b]| [a, b, 0, 0]).collect();
    let output = case.device().probe("environment", &input);
    // Half texels: bilinear in each, so that a midpoint is the mean.
    let [columns, rows] = [case.light.map.width(), case.light.map.height()].map(|e| 2 * e as usize);
    let mut observed = vec![0u64; columns * rows];
    for got in output.chunks(2) {
        let [x, y, z, _] = got[0].map(f64::from);
        let uv = latlong::uv(case.to_map(DVec3::new(x, y, z).normalize()));
        let [column, row] = [uv.x * columns as f64, uv.y * rows as f64].map(|c| c as usize);
        observed[row.min(rows - 1) * columns + column.min(columns - 1)] += 1;
    }
    let centre = |i: usize| DVec2::new(((i % columns) as f64 + 0.5) / columns as f64, ((i / columns) as f64 + 0.5) / rows as f64);
    let share = |i| case.density.radiance(latlong::direction(centre(i))).x / (columns * rows) as f64;
    let expected: Vec<f64> = (0..columns * rows).map(|i| share(i) * f64::from(DRAWS)).collect();
    let total: f64 = expected.iter().sum();
    assert!((total / f64::from(DRAWS) - 1.0).abs() < 1e-6, "the density sums to {total}");
    let p = chi_square_p(&observed, &expected);
    println!("chi-square p = {p:.3} over {} bins", expected.len());
    assert!(p > 1e-4, "p = {p:e}");
}
