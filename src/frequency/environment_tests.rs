use super::*;
use crate::frequency::calibration::{cosine, ratios, reading};
use crate::sampling::latlong::direction;
use crate::sampling::sobol;
use glam::DVec2;

fn map(width: u32, radiance: impl Fn(DVec3) -> f64) -> LatLong {
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        [radiance(direction(DVec2::new(x, 2.0 * y) / f64::from(width))) as f32; 3]
    };
    LatLong::new(width, width / 2, (0..width * (width / 2)).map(texel).collect()).unwrap()
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q) as usize]
}

const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::new(0.5, 0.6, 0.62)];

/// Whatever the frequency, its direction and the threshold, the calibrated estimate is the frequency.
#[test]
fn one_frequency_reads_true_at_every_threshold() {
    for eps in [0.002, 0.005, 0.01, 0.02, 0.05, 0.1] {
        let found = reading(eps).unwrap();
        println!("eps {eps}: {found:?}");
        assert!((0.95..1.06).contains(&found.median), "eps {eps}: {found:?}");
        assert!(found.medians[0] > 0.75 && found.medians[1] < 1.4, "eps {eps}: {found:?}");
        assert!(found.spread[0] > 0.5 && found.spread[1] < 1.6, "eps {eps}: {found:?}");
    }
}

#[test]
fn poles_read_true_too() {
    for axis in AXES {
        let r = ratios(&cosine(1024, 100.0, axis).unwrap(), EPS, 100.0, axis, 2.0);
        let near: Vec<f64> = ratios(&cosine(1024, 100.0, axis).unwrap(), EPS, 100.0, axis, 1.1);
        // The caps are the difference of the two, an eighth of the map's rows each.
        assert!(r.len() > near.len());
        assert!((0.8..1.4).contains(&quantile(&r, 0.5)) && quantile(&r, 0.01) > 0.4 && quantile(&r, 0.98) < 2.0, "{axis}");
    }
}

#[test]
fn a_smaller_map_of_the_same_light_reads_the_same() {
    for width in [512, 600, 1024, 2048] {
        let r = ratios(&cosine(width, 40.0, DVec3::X).unwrap(), EPS, 40.0, DVec3::X, 1.1);
        assert!((0.75..1.4).contains(&quantile(&r, 0.5)), "{width}: {}", quantile(&r, 0.5));
    }
}

#[test]
fn scaling_and_turning_the_light_changes_nothing() {
    let noise = |i: u32| sobol::random(i, 3).map(sobol::to_unit);
    let texels: Vec<[f32; 3]> = (0..64 * 32).map(|i| [(noise(i)[0] * 6.0 * noise(i)[1]).exp() as f32; 3]).collect();
    let of = |texels: Vec<[f32; 3]>| AngularBandwidth::of(&LatLong::new(64, 32, texels).unwrap(), EPS).map;
    let plain = of(texels.clone());
    let bright = of(texels.iter().map(|t| t.map(|c| 1024.0 * c)).collect());
    assert_eq!(plain, bright);
    // By half a turn: the wavelets' grid then lies as before.
    let turned: Vec<_> = (0..64 * 32).map(|i| texels[i / 64 * 64 + (i + 32) % 64]).collect();
    let turned = of(turned);
    for i in 0..plain.values.len() {
        let other = turned.values[i / 32 * 32 + (i + 16) % 32];
        assert!((plain.values[i] - other).abs() < 1e-9 * other.max(1.0), "{i}");
    }
}

#[test]
fn constant_light_has_no_bandwidth_and_odd_maps_are_finite() {
    for (width, height) in [(1, 1), (2, 1), (3, 2), (64, 32), (100, 50), (33, 17)] {
        for radiance in [0.0, 1.0, 3e4] {
            let flat = LatLong::new(width, height, vec![[radiance; 3]; (width * height) as usize]).unwrap();
            assert!(AngularBandwidth::of(&flat, EPS).map.values.iter().all(|&b| b == 0.0), "{width}x{height} {radiance}");
        }
        let spot = (0..width * height).map(|i| [if i == width / 2 { 1e5 } else { 0.0 }; 3]).collect();
        let spot = AngularBandwidth::of(&LatLong::new(width, height, spot).unwrap(), EPS);
        assert!(spot.map.values.iter().all(|b| b.is_finite() && *b >= 0.0));
        assert_eq!([spot.map.width, spot.map.height()], analysed([width, height]).map(|n| n as usize / 2));
    }
}

/// Detail where the light has it: a disc's edge is fast, the empty sky away from it slow.
#[test]
fn bandwidth_is_local() {
    let light = map(512, |w| 1.0 + if w.dot(DVec3::Z) > 0.97 { 4.0 } else { 0.0 });
    let bandwidth = AngularBandwidth::of(&light, EPS);
    let edge = DVec3::new((1.0f64 - 0.97 * 0.97).sqrt(), 0.0, 0.97);
    assert!(bandwidth.towards(edge) > 8.0 * bandwidth.towards(-DVec3::Z), "{}", bandwidth.towards(edge));
    assert!(bandwidth.towards(edge) > 10.0);
}
