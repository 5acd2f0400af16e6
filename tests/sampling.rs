//! Alias tables and environment importance: what is drawn has the density that is claimed.

mod support {
    pub mod statistics;
}

use glam::{DVec2, DVec3};
use passband::sampling::latlong::{direction, uv};
use passband::sampling::{AliasTable, EnvironmentImportance, LatLong, sobol};
use std::f64::consts::PI;
use support::statistics::{Mean, chi_square_p};

const P_VALUE: f64 = 1e-4;

fn probabilities(table: &AliasTable, n: usize) -> Vec<f64> {
    (0..n).map(|i| table.probability(i)).collect()
}

fn weights(n: u32) -> Vec<f64> {
    // Nine decades, a tenth of them zero.
    let one = |i| {
        let [a, b] = sobol::random(i, 5).map(sobol::to_unit);
        if b < 0.1 { 0.0 } else { (30.0 * a).exp2() }
    };
    (0..n).map(one).collect()
}

#[test]
fn alias_tables_reconstruct_their_weights() {
    for n in [1, 2, 3, 1000, 100_003] {
        let weights: Vec<f64> = weights(n).into_iter().map(|w| w + if n < 4 { 1.0 } else { 0.0 }).collect();
        let sum: f64 = weights.iter().sum();
        let table = AliasTable::build(&weights).unwrap();
        let found = probabilities(&table, n as usize);
        assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        // An index shares no more than the two slots at its ends with others.
        let least = 2.0 / table.slots().len() as f64;
        for (i, (p, w)) in found.into_iter().zip(&weights).enumerate() {
            assert!((p - w / sum).abs() <= least, "{n} weights, {i}: {p} for {}", w / sum);
            assert!(*w == 0.0 || p > 0.0, "{n} weights, {i}: none is left out");
        }
    }
}

#[test]
fn alias_tables_take_any_weights() {
    let of = |weights: &[f64]| probabilities(&AliasTable::build(weights).unwrap(), weights.len());
    assert!(AliasTable::build(&[]).is_err());
    assert_eq!(of(&[0.0; 8]), [0.125; 8]);
    assert_eq!(of(&[0.0, 0.0, 4.0, 0.0]), [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(of(&[f64::NAN, -1.0, f64::INFINITY, 3.0, 1.0]), [0.0, 0.0, 0.0, 0.75, 0.25]);
    assert!(of(&[f64::MAX; 3]).iter().all(|p| (p - 1.0 / 3.0).abs() < 1e-7));
    assert_eq!(of(&[5e-324; 4]), [0.25; 4]);
}

#[test]
fn draws_follow_the_probabilities_and_leave_a_uniform_rest() {
    let weights = weights(200);
    let table = AliasTable::build(&weights).unwrap();
    const N: u32 = 1 << 20;
    let (mut drawn, mut rest) = (vec![0; 200], vec![0; 64]);
    for i in 0..N {
        let [u, fine] = sobol::random(i, 11);
        let (index, r) = table.draw(u, fine);
        drawn[index as usize] += 1;
        rest[(r * 64.0) as usize] += 1;
    }
    let expected: Vec<f64> = probabilities(&table, 200).iter().map(|p| p * f64::from(N)).collect();
    let p = chi_square_p(&drawn, &expected);
    assert!(p > P_VALUE, "indices: p = {p}");
    let p = chi_square_p(&rest, &[f64::from(N) / 64.0; 64]);
    assert!(p > P_VALUE, "rests: p = {p}");
    for u in [0, 1, u32::MAX - 1, u32::MAX] {
        let (index, r) = table.draw(u, u);
        assert!(index < 200 && (0.0..=1.0).contains(&r));
    }
}

/// What sets these tables apart: indices follow the order of the numbers, so that strata of numbers are strata of indices.
#[test]
fn draws_grow_with_the_number() {
    for weights in [weights(200), vec![0.0, 0.0, 1.0, 0.0], vec![1.0], vec![1e-12, 1.0, 0.0, 1e-12], weights(100_003)] {
        let table = AliasTable::build(&weights).unwrap();
        let draws: Vec<u32> = (0..1 << 16).map(|i| table.draw(i << 16, 0).0).collect();
        assert!(draws.windows(2).all(|d| d[0] <= d[1]));
    }
}

/// Maps that stress what can go wrong: flat, one texel (also at the seam), a pole row, one texel in all, one row, random.
fn maps() -> Vec<(&'static str, LatLong)> {
    let map = |w: u32, h: u32, light: &dyn Fn(u32, u32) -> f32| {
        let texels = (0..w * h).map(|i| [light(i % w, i / w), 0.5 * light(i % w, i / w), 0.0]).collect();
        LatLong::new(w, h, texels).unwrap()
    };
    vec![
        ("constant", map(16, 8, &|_, _| 1.0)),
        ("black", map(16, 8, &|_, _| 0.0)),
        ("single texel", map(16, 8, &|x, y| if (x, y) == (5, 3) { 1e4 } else { 0.01 })),
        ("texel at the seam", map(16, 8, &|x, y| if (x, y) == (0, 6) { 1e4 } else { 0.01 })),
        ("north pole row", map(16, 8, &|_, y| if y == 0 { 100.0 } else { 0.1 })),
        ("south pole row", map(16, 8, &|_, y| if y == 7 { 100.0 } else { 0.1 })),
        ("one texel in all", map(1, 1, &|_, _| 2.0)),
        ("one row", map(5, 1, &|x, _| x as f32)),
        ("random", map(32, 16, &|x, y| (10.0 * sobol::to_unit(sobol::random(32 * y + x, 3)[0])).exp2() as f32)),
    ]
}

#[test]
fn environment_directions_have_the_density_that_is_claimed() {
    const N: u32 = 1 << 20;
    const BINS: [usize; 2] = [48, 40];
    const FINE: usize = 8;
    for (name, map) in maps() {
        let importance = EnvironmentImportance::build(&map).unwrap();
        // Density over map coordinates: per steradian times 2 pi^2 sin(theta).
        let density = |u: f64, v: f64| importance.pdf(direction(DVec2::new(u, v))) * 2.0 * PI * PI * (v * PI).sin();
        let mut expected = vec![0.0; BINS[0] * BINS[1]];
        let fine = [BINS[0] * FINE, BINS[1] * FINE];
        for y in 0..fine[1] {
            for x in 0..fine[0] {
                let d = density((x as f64 + 0.5) / fine[0] as f64, (y as f64 + 0.5) / fine[1] as f64);
                expected[y / FINE * BINS[0] + x / FINE] += d * f64::from(N) / (fine[0] * fine[1]) as f64;
            }
        }
        let total: f64 = expected.iter().sum::<f64>() / f64::from(N);
        assert!((total - 1.0).abs() < 1e-3, "{name}: the density integrates to {total}");

        let mut observed = vec![0; expected.len()];
        for i in 0..N {
            let (w, pdf) = importance.sample(sobol::random(i, 21));
            assert!((w.length() - 1.0).abs() < 1e-12 && pdf.is_finite() && pdf > 0.0, "{name}: {w}, {pdf}");
            assert!((pdf / importance.pdf(w) - 1.0).abs() < 1e-9, "{name}: sample and pdf disagree at {w}");
            let at = uv(w);
            let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            observed[bin(at.y, BINS[1]) * BINS[0] + bin(at.x, BINS[0])] += 1;
        }
        let p = chi_square_p(&observed, &expected);
        println!("{name}: p = {p:.3}, integral {total:.6}");
        assert!(p > P_VALUE, "{name}: p = {p}");
    }
}

#[test]
fn environment_estimates_are_unbiased() {
    for (name, map) in maps() {
        let importance = EnvironmentImportance::build(&map).unwrap();
        // Light from the map, weighted so that no symmetry hides a shifted direction.
        let integrand = |w: DVec3| map.radiance(w).x * (1.0 + w.dot(DVec3::new(0.5, 0.3, -0.6)));
        const FINE: [usize; 2] = [960, 480];
        let mut truth = 0.0;
        for y in 0..FINE[1] {
            let v = (y as f64 + 0.5) / FINE[1] as f64;
            for x in 0..FINE[0] {
                let w = direction(DVec2::new((x as f64 + 0.5) / FINE[0] as f64, v));
                truth += integrand(w) * (v * PI).sin() * 2.0 * PI * PI / (FINE[0] * FINE[1]) as f64;
            }
        }
        let mut estimate = Mean::default();
        for i in 0..1 << 19 {
            let (w, pdf) = importance.sample(sobol::random(i, 33));
            estimate.add(integrand(w) / pdf);
        }
        let off = estimate.mean() - truth;
        println!("{name}: {:.5} for {truth:.5}, deviation {:.3} of it", estimate.mean(), estimate.deviation() / truth);
        assert!(off.abs() <= 4.5 * estimate.error() + 2e-5 * truth, "{name}: {} for {truth}", estimate.mean());
        // Importance is what it is for: far below the deviation of uniform directions (16 for the single texel).
        assert!(estimate.deviation() <= 1.5 * truth, "{name}: deviation {}", estimate.deviation());
    }
}

#[test]
fn environment_density_is_the_floored_luminance_times_the_sine() {
    for (name, map) in maps() {
        let importance = EnvironmentImportance::build(&map).unwrap();
        let texels = importance.density_texels();
        let luminance: Vec<f64> =
            map.texels().iter().map(|t| 0.2126 * f64::from(t[0]) + 0.7152 * f64::from(t[1]) + 0.0722 * f64::from(t[2])).collect();
        let floor = luminance.iter().sum::<f64>() / luminance.len() as f64 * 1e-3;
        let row = |i: usize| (i as u32 / map.width()) as f64;
        let weight = |i: usize| match name {
            "black" => (PI * (row(i) + 0.5) / f64::from(map.height())).sin(),
            _ => luminance[i].max(floor) * (PI * (row(i) + 0.5) / f64::from(map.height())).sin(),
        };
        let sum = (0..texels.len()).map(weight).sum::<f64>();
        let least = 2.0 / importance.alias().slots().len() as f64;
        for (i, &texel) in texels.iter().enumerate() {
            let (found, expected) = (f64::from(texel) / texels.len() as f64, weight(i) / sum);
            assert!((found - expected).abs() <= least + 1e-6 * expected, "{name}, texel {i}: {found} for {expected}");
            assert!(found > 0.0, "{name}, texel {i} is left out");
        }
    }
}
