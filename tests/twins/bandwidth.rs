//! `bandwidth.glsl` against `frequency::operators` and `frequency::level`.

use crate::{COUNT, Device, Worst, unit};
use passband::frequency::level::level;
use passband::frequency::operators::{Operator, Surface, pixel_angle, texture};

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
        let (mut image, mut spatial, mut angle, mut levels) = (Worst::default(), Worst::default(), Worst::default(), 0);
        for ((a, b), got) in cases.iter().zip(output.chunks_exact(2)) {
            assert_eq!(got[0], got[1]);
            let [light, lobe, k1, k2] = a.map(f64::from);
            let [distance, cosine, pixel] = b.map(f64::from);
            let surface = Surface { curvatures: [k1, k2], distance, cosine, pixel };
            let [got_image, got_spatial, got_angle, got_level] = got[0].map(f64::from);
            let at = || format!("{a:?} {b:?}");
            let expected = operator.image(light, lobe, &surface);
            // Of the terms, which may cancel.
            let reach = distance / cosine.max(0.02) * k1.abs().max(k2.abs());
            let terms = pixel * (1.0 + 2.0 * reach) * if operator == Operator::Box { light + lobe } else { light.min(lobe) };
            image.add((got_image - expected).abs() / terms.max(1e-30), at);
            let expected = texture(light, &surface);
            spatial.add((got_spatial - expected).abs() / expected.max(1e-30), at);
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
        spatial.within("texture's image bandwidth, relative", 1e-6);
        angle.within("pixel angle, relative", 1e-6);
    }
}
