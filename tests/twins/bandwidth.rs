//! `bandwidth.glsl` against `frequency::operators` and `frequency::level`, `lobe_bandwidth.glsl` against `reflectance::bandwidth`.

use crate::{COUNT, Device, Worst, direction, entry, unit};
use glam::Vec3;
use passband::frequency::level::level;
use passband::frequency::operators::{Operator, Surface, pixel_angle};
use passband::reflectance::bandwidth::{SIDE, WIDTH, texel};

const OPERATORS: [Operator; 3] = [Operator::Box, Operator::Clipped, Operator::Covariance];

#[test]
fn operators_pixel_angles_and_levels() {
    let spread = |u: f64, decades: f64| 10f64.powf(decades * (2.0 * u - 1.0)) as f32;
    let mut cases: Vec<([f32; 4], [f32; 3])> = (0..COUNT)
        .map(|i| {
            let ([a, b], [c, d], [e, f], [g, h]) = (unit(i, 40), unit(i, 41), unit(i, 42), unit(i, 43));
            let k = spread(c, 2.0) * if h < 0.3 { -1.0 } else { 1.0 };
            // Never so close to cancelling that rounding decides.
            ([spread(a, 4.0), spread(b, 4.0), k, k * d as f32], [spread(e, 2.0), f as f32, spread(g, 3.0)])
        })
        .collect();
    cases.extend([
        ([0.0, 0.0, 1.0, 1.0], [1.0, 1.0, 1e-3]),
        ([1e20, 3.0, 0.0, 0.0], [1.0, 0.0, 1e-3]),
        ([3.0, 1e20, -1.0, 1.0], [2.0, 0.5, 1e-3]),
        ([0.0, 1e20, 0.0, 0.0], [1.0, 1.0, 1.0]),
    ]);
    let mut device = Device::bare();
    for (number, operator) in (0u32..).zip(OPERATORS) {
        let entries =
            cases.iter().flat_map(|(a, b)| [a.map(f32::to_bits), [b[0].to_bits(), b[1].to_bits(), b[2].to_bits(), number]]);
        let output = device.probe("bandwidth", &entries.collect::<Vec<_>>());
        let (mut image, mut angle, mut levels) = (Worst::default(), Worst::default(), 0);
        for ((a, b), got) in cases.iter().zip(output.chunks_exact(2)) {
            assert_eq!(got[0], got[1]);
            let [light, lobe, k1, k2] = a.map(f64::from);
            let [distance, cosine, pixel] = b.map(f64::from);
            let surface = Surface { curvatures: [k1, k2], distance, cosine, pixel };
            let [got_image, got_angle, got_level, _] = got[0].map(f64::from);
            let at = || format!("{a:?} {b:?}");
            let expected = operator.image(light, lobe, &surface);
            // Of the terms, which may cancel.
            let reach = distance / cosine.max(0.02) * k1.abs().max(k2.abs());
            let terms = pixel * (1.0 + 2.0 * reach) * if operator == Operator::Box { light + lobe } else { light.min(lobe) };
            image.add((got_image - expected).abs() / terms.max(1e-30), at);
            let expected = pixel_angle([k1, k2], [pixel, 0.5 * pixel]);
            angle.add((got_angle - expected).abs() / expected, at);
            // A level changes where the logarithm is whole, within its rounding.
            let near = [1.0 - 1e-5, 1.0 + 1e-5].map(|f| level(got_image * f, 4.0, [-2, 5]));
            if near[0] == near[1] {
                assert_eq!(got_level, f64::from(near[0]), "{a:?} {b:?}");
                levels += 1;
            }
        }
        assert!(levels > 9 * cases.len() / 10);
        image.within("image bandwidth, of its terms", 1e-6);
        angle.within("pixel angle, relative", 1e-6);
    }
}

#[test]
fn lobes_texels() {
    let up = |i, seed| {
        let w = direction(i, seed);
        Vec3::new(w.x, w.y, w.z.abs())
    };
    let mut pairs: Vec<[Vec3; 2]> = (0..COUNT).map(|i| [up(i, 44), up(i, 45)]).collect();
    let edges = [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.8, 0.6)];
    pairs.extend(edges.iter().flat_map(|&a| edges.map(|b| [a, b])));
    let entries = pairs.iter().flat_map(|&[wi, wo]| [entry(wi, 3), entry(wo, 0)]).collect::<Vec<_>>();
    let output = Device::bare().probe("lobe_bandwidth", &entries);
    let mut used = vec![false; WIDTH * SIDE];
    let mut apart = 0;
    for (&[wi, wo], got) in pairs.iter().zip(output.chunks_exact(2)) {
        let [column, row] = [got[0][0] as usize, got[0][1] as usize - 3 * SIDE];
        used[row * WIDTH + column] = true;
        let expected = texel(wi.as_dvec3(), wo.as_dvec3());
        // Texels change where a coordinate is whole: there either of two neighbours, or of two angles, is right.
        let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
        let [angle, x] = [column / SIDE, column % SIDE];
        assert!(near(angle, expected[0] / SIDE) && near(x, expected[0] % SIDE) && near(row, expected[1]), "{wi} {wo}");
        apart += usize::from([column, row] != expected);
    }
    assert!(apart < pairs.len() / 500, "{apart} of {}", pairs.len());
    // Tiles are discs.
    let share = used.iter().filter(|u| **u).count() as f64 / used.len() as f64;
    assert!((0.75..0.95).contains(&share), "{share}");
}
