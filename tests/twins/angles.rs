//! `angles.glsl` and `latlong.glsl` against the standard library in f64.

use crate::{COUNT, Device, Worst, direction, entry, unit};
use glam::{DVec2, Vec3};
use passband::sampling::latlong;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

/// Radians: 2e-7 of the polynomial, and the rounding of a result in [0, pi/2] and of the steps to it.
const QUADRANT: f64 = 4e-7;
/// Radians: the same with the rounding of pi and of a result up to pi.
const HALF_TURN: f64 = 6e-7;

/// Of a coordinate in [0, 1]: an angle's error over its range, and the rounding of the result.
const COORDINATE: f64 = HALF_TURN / PI + 6e-8;

/// The distance of two numbers modulo `period`.
fn apart(a: f64, b: f64, period: f64) -> f64 {
    let d = (a - b).rem_euclid(period);
    d.min(period - d)
}

#[test]
fn inverse_sine_and_cosine() {
    let mut inputs: Vec<f32> = (0..COUNT).map(|i| unit(i, 1)[0] as f32).collect();
    // Near 1 the arc cosine loses the most, near 0 the arc sine must stay relative.
    inputs.extend((0..COUNT).map(|i| (1.0 - 10f64.powf(-8.0 * unit(i, 2)[0])) as f32));
    inputs.extend((0..COUNT).map(|i| 10f64.powf(-12.0 * unit(i, 3)[0]) as f32));
    inputs.extend([0.0, 1.0, FRAC_1_SQRT_2 as f32, 0.5, f32::MIN_POSITIVE]);
    let output = Device::bare().probe("angles", &inputs.iter().map(|x| [x.to_bits(), 0, 0, 0]).collect::<Vec<_>>());
    let (mut asin, mut positive, mut full) = (Worst::default(), Worst::default(), Worst::default());
    for (&x, got) in inputs.iter().zip(output) {
        let x = f64::from(x);
        let [small, acos, acos_full, acos_negative] = got.map(f64::from);
        if x <= FRAC_1_SQRT_2 {
            asin.add((small - x.asin()).abs() / x.asin().max(1e-30), || format!("{x}"));
        }
        positive.add((acos - x.acos()).abs(), || format!("{x}"));
        full.add((acos_full - x.acos()).abs().max((acos_negative - (-x).acos()).abs()), || format!("{x}"));
        if x == 1.0 {
            assert_eq!([acos, acos_full], [0.0; 2]);
        }
    }
    asin.within("asin_small, relative", 4e-7);
    positive.within("acos_positive", QUADRANT);
    full.within("acos_full", HALF_TURN);
}

#[test]
fn arc_tangents() {
    let mut inputs: Vec<[f32; 2]> = (0..COUNT).map(|i| unit(i, 4).map(|c| (2.0 * c - 1.0) as f32)).collect();
    // Any magnitudes: only the ratio counts.
    let spread = |i, seed| {
        let [a, b] = unit(i, seed);
        (10f64.powf(60.0 * a - 30.0) * (b - 0.5).signum()) as f32
    };
    inputs.extend((0..COUNT).map(|i| [spread(i, 5), spread(i, 6)]));
    let edges = [0.0, 1.0, -1.0, 0.5, -0.5, 1e-30, -1e-30, 1e30];
    inputs.extend(edges.iter().flat_map(|&y| edges.map(|x| [y, x])));
    let output =
        Device::bare().probe("angles", &inputs.iter().map(|[y, x]| [x.to_bits(), y.to_bits(), 0, 1]).collect::<Vec<_>>());
    let (mut quadrant, mut full, mut line) = (Worst::default(), Worst::default(), Worst::default());
    for (&[y, x], got) in inputs.iter().zip(output) {
        let (y, x) = (f64::from(y), f64::from(x));
        let [q, f, l, _] = got.map(f64::from);
        let at = || format!("({y}, {x})");
        quadrant.add((q - y.abs().atan2(x.abs())).abs(), at);
        full.add((f - y.atan2(x)).abs(), at);
        line.add(apart(l, y.atan2(x), PI), at);
        assert!(f.abs() <= PI + 1e-6 && l.abs() <= FRAC_PI_2 + 1e-6, "({y}, {x}): {f}, {l}");
        if [y, x] == [0.0, 0.0] {
            assert_eq!([q, f, l], [0.0; 3]);
        }
    }
    quadrant.within("atan_quadrant", QUADRANT);
    full.within("atan_full", HALF_TURN);
    line.within("atan_line", HALF_TURN);
}

#[test]
fn cosine_and_sine() {
    let mut inputs: Vec<f32> = (0..COUNT).map(|i| ((2.0 * unit(i, 10)[0] - 1.0) * PI) as f32).collect();
    inputs.extend((0..COUNT).map(|i| 10f64.powf(-12.0 * unit(i, 11)[0]) as f32));
    inputs.extend([0.0, FRAC_PI_2, PI].iter().flat_map(|&x| [x as f32, -x as f32]));
    let output = Device::bare().probe("angles", &inputs.iter().map(|x| [x.to_bits(), 0, 0, 2]).collect::<Vec<_>>());
    let (mut both, mut small) = (Worst::default(), Worst::default());
    for (&x, got) in inputs.iter().zip(output) {
        let x = f64::from(x);
        let [c, s, ..] = got.map(f64::from);
        both.add((c - x.cos()).abs().max((s - x.sin()).abs()), || format!("{x}"));
        if x.abs() < 1.0 {
            small.add((s - x.sin()).abs() / x.sin().abs().max(1e-30), || format!("{x}"));
        }
    }
    // 5e-8 of the polynomial, the rounding of pi and that of the result.
    both.within("cos_sin", 2.5e-7);
    small.within("sine of less than 1, relative", 2.5e-7);
}

#[test]
fn latlong_coordinates_and_directions() {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    // The seam is at +Z; the poles at +Y and -Y.
    let near = |axis: Vec3| move |i| (axis + 1e-4 * direction(i, 7)).normalize();
    let mut directions: Vec<Vec3> = (0..COUNT).map(|i| direction(i, 8)).collect();
    directions.extend(axes.iter().flat_map(|&axis| (0..100).map(near(axis))));
    directions.extend(axes);
    let mut coordinates: Vec<[f32; 2]> = (0..COUNT).map(|i| unit(i, 9).map(|c| c as f32)).collect();
    coordinates.extend([0.0, 0.5, 1.0].into_iter().flat_map(|u| [0.0, 1e-4, 0.5, 1.0].map(|v| [u, v])));

    let mut device = Device::bare();
    let output = device.probe("latlong", &directions.iter().map(|&w| entry(w, 0)).collect::<Vec<_>>());
    let (mut u, mut v) = (Worst::default(), Worst::default());
    for (&w, got) in directions.iter().zip(output) {
        let expected = latlong::uv(w.as_dvec3());
        // At a pole every u is right.
        let u_error = if w.x == 0.0 && w.z == 0.0 { 0.0 } else { apart(got[0].into(), expected.x, 1.0) };
        u.add(u_error, || format!("{w}"));
        v.add((f64::from(got[1]) - expected.y).abs(), || format!("{w}"));
    }
    u.within("u of a direction", COORDINATE);
    v.within("v of a direction", COORDINATE);

    let entries = |word| coordinates.iter().map(|[u, v]| [u.to_bits(), v.to_bits(), 0, word]).collect::<Vec<_>>();
    let (there, back) = (device.probe("latlong", &entries(1)), device.probe("latlong", &entries(2)));
    let (mut toward, mut sine, mut returned) = (Worst::default(), Worst::default(), Worst::default());
    for ((&[u, v], w), back) in coordinates.iter().zip(there).zip(back) {
        let uv = DVec2::new(u.into(), v.into());
        let expected = latlong::direction(uv);
        let [x, y, z, s] = w.map(f64::from);
        let at = || format!("{uv}");
        toward.add((expected - glam::DVec3::new(x, y, z)).abs().max_element(), at);
        sine.add((s - (uv.y * PI).sin()).abs(), at);
        // Where the arc cosine is steep a rounded cosine moves v, and near the poles u means little.
        let steep = (uv.y * PI).sin();
        returned.add(((f64::from(back[1]) - uv.y).abs() * steep).max(apart(back[0].into(), uv.x, 1.0) * steep), at);
    }
    // Cosine and sine, of an argument up to pi in 32 bits.
    toward.within("direction of uv", 1e-6);
    sine.within("sine of theta", 1e-6);
    returned.within("uv there and back, times the sine of theta", 1e-6);
}
