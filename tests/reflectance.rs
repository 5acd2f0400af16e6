//! MERL tables, GGX and the stand-ins: angles, files, interpolation, packing and energy.

use glam::DVec3;
use passband::reflectance::merl::{Angles, PHI_DIFF, THETA_DIFF, THETA_HALF};
use passband::reflectance::{Ggx, MerlTable, Reflectance, packing, stand_in};
use passband::sampling::sobol;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

const ENTRIES: usize = THETA_HALF * THETA_DIFF * PHI_DIFF;

/// A table whose every entry is another number.
static DISTINCT: LazyLock<MerlTable> = LazyLock::new(|| {
    let mut i = 0;
    MerlTable::from_fn(|_, _, _| {
        i += 1;
        let [a, b] = sobol::random(i, 1).map(sobol::to_unit);
        DVec3::new(a * (40.0 * b - 20.0).exp2(), f64::from(i), b / 3.0)
    })
});

fn file(table: &MerlTable) -> Vec<u8> {
    let mut bytes = Vec::new();
    table.write(&mut bytes).unwrap();
    bytes
}

/// A direction above the horizon, uniform over the hemisphere.
fn above([u, v]: [f64; 2]) -> DVec3 {
    let (z, phi) = (1.0 - u, 2.0 * PI * v);
    let sine = (1.0 - z * z).sqrt();
    DVec3::new(sine * phi.cos(), sine * phi.sin(), z)
}

fn pair(i: u32) -> (DVec3, DVec3) {
    (above(sobol::random(i, 2).map(sobol::to_unit)), above(sobol::random(i, 3).map(sobol::to_unit)))
}

#[test]
fn a_table_that_is_written_and_read_is_the_same() {
    let bytes = file(&DISTINCT);
    assert_eq!(bytes.len(), 12 + ENTRIES * 24);
    assert_eq!(MerlTable::from_bytes(&bytes).unwrap(), *DISTINCT);
    let extremes = [f32::MAX, f32::MIN_POSITIVE, f32::from_bits(1), 1.0];
    let mut i = 0;
    let table = MerlTable::from_fn(|_, _, _| {
        i += 1;
        DVec3::splat(extremes[i % 4].into())
    });
    assert_eq!(MerlTable::from_bytes(&file(&table)).unwrap(), table);
}

#[test]
fn entries_are_where_and_what_the_format_says() {
    let (i, j, k) = (13, 57, 120);
    let at = (i * THETA_DIFF + j) * PHI_DIFF + k;
    let mut bytes = [90i32, 90, 180].iter().flat_map(|d| d.to_le_bytes()).collect::<Vec<_>>();
    bytes.resize(12 + ENTRIES * 24, 0);
    let mut put = |channel: usize, index: usize, x: f64| {
        let offset = 12 + (channel * ENTRIES + index) * 8;
        bytes[offset..offset + 8].copy_from_slice(&x.to_le_bytes());
    };
    (0..3).for_each(|c| put(c, at, 1500.0));
    (0..3).for_each(|c| put(c, at + 1, -7.0));
    let table = MerlTable::from_bytes(&bytes).unwrap();
    // The centre of bin (13, 57, 120), built by hand.
    let angle = |half: f64, diff: f64, phi: f64| Angles { theta_half: half, theta_diff: diff, phi_diff: phi };
    let centre = angle(FRAC_PI_2 * (13.5f64 / 90.0).powi(2), 57.5f64.to_radians(), 120.5f64.to_radians());
    let value = |a: Angles| {
        let (wi, wo) = a.directions();
        table.evaluate(wi, wo)
    };
    assert!((value(centre) - DVec3::new(1.0, 1.15, 1.66)).abs().max_element() < 1e-6, "{}", value(centre));
    // Half way to the next bin in each coordinate: half the value, also towards the negative entry, which is 0.
    let halves = [
        angle(FRAC_PI_2 * (14f64 / 90.0).powi(2), centre.theta_diff, centre.phi_diff),
        angle(centre.theta_half, 58f64.to_radians(), centre.phi_diff),
        angle(centre.theta_half, centre.theta_diff, 121f64.to_radians()),
        angle(centre.theta_half, centre.theta_diff, 120f64.to_radians()),
    ];
    for half in halves {
        assert!((value(half).x - 0.5).abs() < 1e-6, "{half:?}: {}", value(half));
    }
}

#[test]
fn malformed_files_are_refused_with_the_place() {
    let good = file(&DISTINCT);
    let message = |bytes: &[u8]| MerlTable::from_bytes(bytes).unwrap_err().to_string();
    assert_eq!(message(&[]), "size at byte 0: expected 34992012 bytes, got 0 bytes");
    assert_eq!(message(&good[..1000]), "size at byte 1000: expected 34992012 bytes, got 1000 bytes");
    let with = |offset: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[offset..offset + new.len()].copy_from_slice(new);
        bytes
    };
    assert_eq!(message(&with(4, &91i32.to_le_bytes())), "dimensions at byte 0: expected 90 90 180, got 90 91 180");
    let long: Vec<u8> = good.iter().copied().chain([0]).collect();
    assert_eq!(message(&long), "size at byte 34992012: expected 34992012 bytes, got 34992013 bytes");
    let offset = 12 + (ENTRIES + 5) * 8;
    let place = "green entry 5 at byte 11664052: expected a finite number in single precision";
    for (bad, name) in [(f64::NAN, "NaN"), (f64::NEG_INFINITY, "-inf"), (1e300, "1e300")] {
        assert_eq!(message(&with(offset, &bad.to_le_bytes())), format!("{place}, got {name}"));
    }
}

#[test]
fn angles_survive_the_way_to_directions_and_back() {
    for i in 0..100_000 {
        let [a, b] = sobol::random(i, 4).map(sobol::to_unit);
        let [c, d] = sobol::random(i, 5).map(sobol::to_unit);
        // Down to 1e-9 radians, where arc cosines would have lost everything.
        let small = (-30.0 * d).exp2();
        let angles = Angles { theta_half: a * 1.5 * small, theta_diff: b * 1.5, phi_diff: c * 3.0 + 0.05 };
        let (wi, wo) = angles.directions();
        let back = Angles::of(wi, wo);
        assert!((back.theta_half - angles.theta_half).abs() < 1e-14, "{angles:?} {back:?}");
        assert!((back.theta_diff - angles.theta_diff).abs() < 1e-14, "{angles:?} {back:?}");
        // Nearly coincident directions hardly have an azimuth.
        let slack = 1e-14 / angles.theta_diff.sin() + 1e-14 / angles.theta_half.sin().max(1e-300);
        assert!((back.phi_diff - angles.phi_diff).abs() < slack, "{angles:?} {back:?}");
    }
}

#[test]
fn degenerate_directions_have_finite_values() {
    let cosines: [f64; 5] = [1.0, 1.0 - 1e-16, 0.5, 1e-9, f64::MIN_POSITIVE];
    for z in cosines {
        let s = (1.0 - z * z).max(0.0).sqrt();
        let v = DVec3::new(s, 0.0, z);
        // Coincident, mirrored (half vector = normal), orthogonal in azimuth.
        for w in [v, DVec3::new(-s, 0.0, z), DVec3::new(0.0, s, z), DVec3::Z] {
            assert!(DISTINCT.evaluate(v, w).is_finite() && DISTINCT.evaluate(w, v).is_finite(), "{v} {w}");
        }
    }
    assert_eq!(DISTINCT.evaluate(DVec3::X, DVec3::Z), DVec3::ZERO);
    assert_eq!(DISTINCT.evaluate(DVec3::Z, DVec3::new(0.6, 0.0, -0.8)), DVec3::ZERO);
}

#[test]
fn tables_are_reciprocal_isotropic_and_continuous_across_the_azimuth_seam() {
    let smooth = MerlTable::from_fn(|h, d, p| DVec3::new(1.0 + h, 1.0 + d, 2.0 + (2.0 * p).sin()));
    for i in 0..20_000 {
        let (wi, wo) = pair(i);
        let f = smooth.evaluate(wi, wo);
        assert!((smooth.evaluate(wo, wi) - f).abs().max_element() < 1e-9, "{wi} {wo}: not reciprocal");
        let turn = glam::DMat3::from_rotation_z(f64::from(i));
        assert!((smooth.evaluate(turn * wi, turn * wo) - f).abs().max_element() < 1e-9, "{wi} {wo}: not isotropic");
        // The interpolation error of the third channel, sin(2 phi) over bins of a degree, is h^2/8 f'' = 1.5e-4.
        let phi = Angles::of(wi, wo).phi_diff;
        assert!((f.z - 2.0 - (2.0 * phi).sin()).abs() < 2e-4, "{wi} {wo}: {f}");
    }
}

#[test]
fn a_baked_table_is_close_to_what_was_baked() {
    let ggx = Ggx { alpha: 0.3, f0: DVec3::new(0.9, 0.5, 0.1), albedo: DVec3::splat(0.2) };
    let table = MerlTable::from_fn(|theta_half, theta_diff, phi_diff| {
        let (wi, wo) = Angles { theta_half, theta_diff, phi_diff }.directions();
        ggx.evaluate(wi, wo)
    });
    for i in 0..50_000 {
        let (wi, wo) = pair(i);
        // Bins that straddle the horizon mix in the zeros below it.
        if wi.z.min(wo.z) > 0.1 {
            let (a, b) = (ggx.evaluate(wi, wo), table.evaluate(wi, wo));
            assert!((a - b).abs().max_element() < 0.01 * a.max_element(), "{wi} {wo}: {a} and {b}");
        }
    }
}

#[test]
fn packed_tables_keep_order_and_value() {
    let mut i = 0.0;
    let counting = MerlTable::from_fn(|_, _, _| {
        i += 1.0;
        DVec3::new(i, i / 2.0, 0.0)
    });
    // Up to 90 * 90 * 180 = 1,458,000: 32 * 65408 is the first bound above.
    let (scale, entries) = counting.packed();
    assert_eq!((scale, entries.len()), (32.0, ENTRIES));
    for (i, &entry) in entries.iter().enumerate() {
        let (got, expected) = (packing::decode(entry) * f64::from(scale), (i + 1) as f64);
        let error = (got - DVec3::new(expected, expected / 2.0, 0.0)).abs().max_element();
        assert!(error <= expected / 512.0, "entry {i}: {got}");
    }
    let (scale, entries) = stand_in::table("rough").unwrap().packed();
    assert_eq!((scale, entries.len()), (1.0, ENTRIES));
}

#[test]
fn ggx_refuses_what_is_not_a_reflectance() {
    let good = Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO };
    assert!(good.validate().is_ok() && Ggx { alpha: 1.0, ..good }.validate().is_ok());
    for alpha in [0.0, -0.1, 1.1, f64::NAN] {
        assert!(Ggx { alpha, ..good }.validate().unwrap_err().to_string().starts_with("ggx.alpha: expected"));
    }
    for bad in [-0.1, 1.1, f64::NAN] {
        let bad = DVec3::new(0.5, 0.5, bad);
        assert!(Ggx { f0: bad, ..good }.validate().unwrap_err().to_string().starts_with("ggx.f0: expected"));
        assert!(Ggx { albedo: bad, ..good }.validate().unwrap_err().to_string().starts_with("ggx.albedo: expected"));
    }
    assert_eq!(good.evaluate(DVec3::X, DVec3::Z), DVec3::ZERO);
}

#[test]
fn microfacet_normals_fill_the_projected_area() {
    // With f0 = 1, f 4 cos cos / (G1 G1) is D; the integral of D cos is one for every alpha.
    for alpha in [0.001, 0.01, 0.1, 0.5, 1.0] {
        let ggx = Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO };
        const N: usize = 200_000;
        let sum: f64 = (0..N)
            .map(|i| {
                // Looking along h itself, G1 twice is known; substitution tan(theta) = alpha x / (1 - x) spreads the peak.
                let x = (i as f64 + 0.5) / N as f64;
                let tan = alpha * x / (1.0 - x);
                let cos = 1.0 / (1.0 + tan * tan).sqrt();
                let h = DVec3::new(tan * cos, 0.0, cos);
                let g1 = 2.0 / (1.0 + (1.0 + alpha * alpha * tan * tan).sqrt());
                let d = ggx.evaluate(h, h).x * 4.0 * cos * cos / (g1 * g1);
                d * cos * 2.0 * PI * (tan * cos) * cos * cos * alpha / (1.0 - x).powi(2) / N as f64
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-6, "alpha {alpha}: {sum}");
    }
}

#[test]
fn stand_ins_are_what_they_are_called() {
    let names = [
        "mirror-metal",
        "metallic-paint",
        "rough",
        "red-paint",
        "shift-paint",
        "gloss-plastic",
        "satin",
        "rubber",
        "felt",
        "noisy-paint",
    ];
    assert_eq!(stand_in::names(), names);
    assert!(stand_in::table("chrome").is_none());
    let normal = |name: &str| stand_in::table(name).unwrap().evaluate(DVec3::Z, DVec3::Z);
    let [metal, paint, rough] = ["mirror-metal", "metallic-paint", "rough"].map(normal);
    // D(0) = 1 / (pi alpha^2) and G = F / f0 = 1 at normal incidence: 0.96 / (4 pi 0.03^2) and so on, a bin off the peak.
    assert!((metal.x / (0.95 * (0.96 / 9e-4 + 0.04 / 0.1225) / (4.0 * PI)) - 1.0).abs() < 0.01, "{metal}");
    assert!((metal.z / metal.x - 0.6 / 0.95).abs() < 1e-3, "{metal}");
    let diffuse = 0.05 * 0.7 / PI;
    assert!((paint.y / (0.3 * (0.6 / 0.0225 + 0.4 / 0.1225) / (4.0 * PI) + diffuse) - 1.0).abs() < 0.01, "{paint}");
    let diffuse = 0.5 * 0.96 / PI;
    assert!((rough.x / (0.04 / 0.2025 / (4.0 * PI) + diffuse) - 1.0).abs() < 0.01, "{rough}");
}

#[test]
fn stand_ins_differ_in_the_way_they_are_named() {
    let at = |name: &str, half: f64, diff: f64, phi: f64| {
        let angles = Angles { theta_half: half.to_radians(), theta_diff: diff.to_radians(), phi_diff: phi.to_radians() };
        let (wi, wo) = angles.directions();
        stand_in::table(name).unwrap().evaluate(wi, wo)
    };
    // The paint that shifts its colour: green over red face on, red over green aslant; the others keep their order.
    let (face, aslant) = (at("shift-paint", 10.0, 5.0, 90.0), at("shift-paint", 10.0, 65.0, 90.0));
    assert!(face.y > 2.0 * face.x && aslant.x > 2.0 * aslant.y, "{face} {aslant}");
    let (face, aslant) = (at("red-paint", 10.0, 5.0, 90.0), at("red-paint", 10.0, 65.0, 90.0));
    assert!(face.x > 2.0 * face.y && aslant.x > aslant.y, "{face} {aslant}");
    // How sharp: the value 6 degrees off the peak over that at the peak.
    let falloff = |name: &str| at(name, 6.0, 20.0, 90.0).y / at(name, 0.2, 20.0, 90.0).y;
    let order = ["mirror-metal", "gloss-plastic", "red-paint", "satin", "rubber"].map(falloff);
    assert!(order.is_sorted_by(|a, b| a < b) && order[0] < 0.02 && order[4] > 0.9, "{order:?}");
    // Felt throws light back where it came from, and more so at the rim; rubber does neither.
    let back = |name: &str, degrees: f64| at(name, degrees, 1.0, 90.0).y / at(name, 1.0, degrees, 90.0).y;
    assert!(back("felt", 70.0) > 1.5 && back("felt", 70.0) > 1.5 * back("felt", 30.0), "{}", back("felt", 70.0));
    assert!(back("rubber", 70.0) < 1.1, "{}", back("rubber", 70.0));
    // Rubber is dark.
    assert!(at("rubber", 20.0, 20.0, 90.0).max_element() < 0.1 * at("rough", 20.0, 20.0, 90.0).max_element() + 0.02);
}

#[test]
fn noise_is_of_each_cell_and_the_same_every_time() {
    let [plain, noisy, again] = ["metallic-paint", "noisy-paint", "noisy-paint"].map(|name| stand_in::table(name).unwrap());
    // Away from the horizon, at cells' centres; rows and columns run over the innermost two axes.
    let ratio = |half: u32, diff: u32, phi: u32| {
        let angles = Angles {
            theta_half: FRAC_PI_2 * ((f64::from(half) + 0.5) / 90.0).powi(2),
            theta_diff: (f64::from(diff) + 0.5).to_radians(),
            phi_diff: (f64::from(phi) + 0.5).to_radians(),
        };
        let (wi, wo) = angles.directions();
        assert_eq!(noisy.evaluate(wi, wo), again.evaluate(wi, wo));
        let ratio = noisy.evaluate(wi, wo) / plain.evaluate(wi, wo);
        assert!((ratio - ratio.x).abs().max_element() < 1e-3, "grey: {ratio}");
        ratio.x
    };
    let cells: Vec<[u32; 3]> =
        (0..30_u32).flat_map(|i| (0..40).flat_map(move |j| (0..50).map(move |k| [i + 5, j, 3 * k]))).collect();
    let all: Vec<f64> = cells.iter().map(|&[i, j, k]| ratio(i, j, k)).collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / all.len() as f64;
    let average = mean(&mut all.iter().copied());
    let deviation = mean(&mut all.iter().map(|r| (r - average).powi(2))).sqrt();
    // Of a log-normal factor with a deviation of 0.2 in its logarithm: sqrt(exp(0.04) - 1).
    assert!((average - 1.0).abs() < 5e-3 && (deviation - 0.202).abs() < 5e-3, "{average} {deviation}");
    for step in [1, 50, 2000] {
        let pairs = all.iter().zip(all.iter().skip(step));
        let correlation = pairs.map(|(a, b)| (a - average) * (b - average)).sum::<f64>() / all.len() as f64 / deviation.powi(2);
        assert!(correlation.abs() < 0.02, "{step}: {correlation}");
    }
}

#[test]
fn stand_ins_do_not_create_light() {
    for name in stand_in::names() {
        let table = stand_in::table(name).unwrap();
        for degrees in [0.0, 30.0, 60.0, 80.0, 88.0f64] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let wo = DVec3::new(sin, 0.0, cos);
            const N: [usize; 2] = [1000, 120];
            let mut albedo = DVec3::ZERO;
            for i in 0..N[0] {
                // Over half vectors, fine near the normal: theta = (pi/2) x^2.
                let x = (i as f64 + 0.5) / N[0] as f64;
                let theta = FRAC_PI_2 * x * x;
                for j in 0..N[1] {
                    let phi = PI * (j as f64 + 0.5) / N[1] as f64;
                    let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                    let c = wo.dot(h);
                    let wi = 2.0 * c * h - wo;
                    if c > 0.0 && wi.z > 0.0 {
                        let solid_angle = theta.sin() * 2.0 * FRAC_PI_2 * x / N[0] as f64 * 2.0 * PI / N[1] as f64;
                        albedo += table.evaluate(wi, wo) * (wi.z * 4.0 * c * solid_angle);
                    }
                }
            }
            println!("{name} at {degrees}: albedo {albedo:.3}");
            assert!(albedo.min_element() > 0.02 && albedo.max_element() < 1.0, "{name} at {degrees}: {albedo}");
        }
    }
}
