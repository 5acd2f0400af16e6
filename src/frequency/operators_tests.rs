use super::*;

/// Figure 4 and equation 3 as matrices on (spatial, angular), with the corrected signs.
fn chain(light: f64, lobe: f64, k: f64, d: f64, cosine: f64) -> f64 {
    let times = |m: [[f64; 2]; 2], v: [f64; 2]| [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]];
    let mut v = [0.0, light];
    v = times([[1.0, k], [0.0, 1.0]], v); // C_c; P_i leaves distant light alone
    v = [v[0], v[1].min(lobe)]; // B
    v = times([[1.0, 0.0], [0.0, -1.0]], v); // S
    v = times([[1.0, -k], [0.0, 1.0]], v); // C_-c
    v = times([[1.0 / cosine, 0.0], [0.0, 1.0]], v); // P_x
    v = times([[1.0, 0.0], [-d, 1.0]], v); // T_d'
    v[1].abs()
}

fn surface(k: f64, distance: f64, cosine: f64) -> Surface {
    Surface { curvatures: [k, k], distance, cosine, pixel: 1.0 }
}

#[test]
fn the_box_is_the_papers_chain() {
    for (light, lobe) in [(3.0, 10.0), (30.0, 2.0), (5.0, 5.0), (0.0, 1.0)] {
        for (k, d, cosine) in [(0.0, 3.0, 1.0), (1.0, 4.0, 0.5), (-0.2, 2.0, 0.9), (7.0, 0.1, 0.1)] {
            let (b, c) = (Operator::Box.image(light, lobe, &surface(k, d, cosine)), chain(light, lobe, k, d, cosine));
            assert!((b - c).abs() < 1e-12 * c.max(1.0), "{light} {lobe} {k} {d} {cosine}: {b} {c}");
        }
    }
}

/// Traces neighbouring rays of a flat world to a mirror circle of radius 1: how much faster the reflected direction turns than
/// the ray.
#[test]
fn a_mirror_circle_turns_rays_as_the_operator_says() {
    let eye = 5.0f64;
    let reflected = |angle: f64| {
        // Ray from (-eye, 0) at `angle`.
        let (s, c) = angle.sin_cos();
        let along = eye * c - (1.0 - eye * eye * s * s).sqrt();
        // The inward normal, which stays away from the angles' cut.
        let normal = (-along * s).atan2(eye - along * c);
        (2.0 * normal - angle, along, c * normal.cos() + s * normal.sin())
    };
    for angle in [0.0, 0.06, 0.12, 0.16, 0.18] {
        let (after, along, cosine) = reflected(angle + 1e-6);
        let turn = ((after - reflected(angle - 1e-6).0) / 2e-6).abs();
        let sharp = surface(1.0, along, cosine);
        for operator in [Operator::Box, Operator::Clipped] {
            let predicted = operator.image(1.0, 1e9, &sharp);
            assert!((predicted / turn - 1.0).abs() < 1e-3, "{operator:?} at {angle}: {predicted} {turn}");
        }
    }
}

#[test]
fn operators_are_ordered_and_bounded_by_light_and_lobe() {
    for (light, lobe) in [(3.0, 10.0), (30.0, 2.0), (5.0, 5.0), (1e12, 1.0), (1.0, 1e12)] {
        let s = surface(0.5, 3.0, 0.7);
        let [box_, clipped, covariance] =
            [Operator::Box, Operator::Clipped, Operator::Covariance].map(|o| o.image(light, lobe, &s));
        assert!(covariance <= clipped && clipped <= box_ && covariance > 0.7 * clipped, "{light} {lobe}");
        // Under a dull lobe the light's own sharpness must not matter.
        let duller = Operator::Clipped.image(light.max(lobe), light.min(lobe), &s);
        assert!((clipped - duller).abs() < 1e-12 * duller);
    }
    assert_eq!(Operator::Covariance.image(0.0, 0.0, &surface(1.0, 1.0, 1.0)), 0.0);
    // A saddle is as fast as its sharper axis, a grazing view finite.
    let saddle = Surface { curvatures: [2.0, -2.0], ..surface(0.0, 4.0, 0.0) };
    assert_eq!(Operator::Clipped.image(1.0, 2.0, &saddle), 1.0 + 2.0 * 2.0 * 4.0 / LEAST_COSINE);
}

#[test]
fn units_hold_on_a_plane() {
    // A flat mirror shows the environment as it is: 10 cycles/radian at 0.002 radians a pixel.
    let s = Surface { curvatures: [0.0; 2], distance: 2.0, cosine: 0.5, pixel: 0.002 };
    assert!((Operator::Clipped.image(10.0, 1e6, &s) - 0.02).abs() < 1e-12);
}

#[test]
fn pixels_span_what_finite_differences_say() {
    let step = [0.003, 0.002];
    for [x, y] in [[0.0, 0.0], [0.5, 0.1], [-0.3, 0.6], [1.0, -1.0]] {
        let to = |x: f64, y: f64| glam::DVec3::new(x, y, -1.0).normalize();
        let d = [(step[0], 0.0), (0.0, step[1])].map(|(a, b)| (to(x + 1e-4 * a, y + 1e-4 * b) - to(x, y)).length() * 1e4);
        let bound = pixel_angle([x, y], step);
        assert!(d[0].max(d[1]) <= bound * (1.0 + 1e-6) && d[0].max(d[1]) > 0.7 * bound, "{d:?} {bound}");
    }
    assert!((pixel_angle([0.0; 2], [2.0 * 30f64.to_radians().tan() / 512.0; 2]) * 512.0 - 1.1547).abs() < 1e-4);
}

/// Over a plane, in the plane of incidence: how fast the light leaves the reflected ray, for a turn of the ray.
#[test]
fn nearby_lights_turn_as_finite_differences_say() {
    let eye = glam::DVec3::new(-1.0, 2.0, 0.0);
    for light in [[0.7, 1.1, 0.0], [0.1, 0.3, 0.0], [3.0, 0.5, 0.0]].map(glam::DVec3::from) {
        let at = |x: f64| {
            let to = |p: glam::DVec3| (p - glam::DVec3::new(x, 0.0, 0.0)).normalize();
            let (view, light) = (to(eye), to(light));
            // The angles of the mirrored view and of the light, and that of the ray.
            (view.y.atan2(-view.x) - light.y.atan2(light.x), view.y.atan2(view.x))
        };
        let (x, h) = (0.2, 1e-5);
        let [(a, ra), (b, rb)] = [x + h, x - h].map(at);
        let point = glam::DVec3::new(x, 0.0, 0.0);
        let [o, l] = [eye - point, light - point];
        let surface = Surface {
            curvatures: [nearby(l.length(), l.y / l.length()), 0.0],
            distance: o.length(),
            cosine: o.y / o.length(),
            pixel: 1.0,
        };
        let expected = Operator::Clipped.image(1e6, 1.0, &surface);
        assert!((((a - b) / (ra - rb)).abs() / expected - 1.0).abs() < 1e-4, "{light}: {} {expected}", (a - b) / (ra - rb));
    }
}

#[test]
fn means_are_means() {
    let probes: Vec<Probe> =
        (1..=4).map(|i| Probe { bandwidth: f64::from(i), radiance: f64::from(5 - i), reflected: 0.5 }).collect();
    let mean = Combine::Mean.over(&probes);
    assert!((mean - 2.0).abs() < 1e-12 && Combine::Max.over(&probes) == 4.0);
    assert!((Combine::Literal.over(&probes) - 0.5 * mean).abs() < 1e-12, "scales with the reflectance");
    let unlit = Probe { bandwidth: 9.0, reflected: 0.5, ..Probe::default() };
    assert_eq!(Combine::Max.over(&[probes[1], unlit]), 2.0, "brings no light");
    let dark = [Probe { bandwidth: 3.0, ..Probe::default() }];
    assert_eq!([Combine::Mean, Combine::Literal].map(|c| c.over(&dark)), [0.0; 2]);
}
