//! `vmf.glsl` against `distribution::vmf`.

use crate::{COUNT, Device, Worst, direction, entry, rounded, unit};
use glam::{DVec2, DVec3, Vec3};
use passband::distribution::vmf::{self, Lobe};
use passband::sampling::latlong;
use std::f64::consts::{PI, TAU};

/// Relative errors, from 1e-2 to 1e5.
const BOUND: f64 = 1e-4;

#[test]
fn mean_vectors_their_inverse_and_densities() {
    // Concentrations even in their logarithm; directions from the lobe's centre to four deviations from it, or anywhere.
    let inputs: Vec<(Vec3, f32, Vec3)> = (0..COUNT)
        .map(|i| {
            let kappa = 10f64.powf(7.0 * unit(i, 1)[0] - 2.0) as f32;
            let (mu, other) = (direction(i, 2), direction(i, 3));
            let width = 4.0 * unit(i, 4)[0] / f64::from(kappa.max(1.0)).sqrt();
            (mu, kappa, rounded(mu.as_dvec3() + other.as_dvec3() * width))
        })
        .chain([1e-2, 0.499_999_97, 0.5, 0.500_000_06, 1e5].map(|kappa| (Vec3::Z, kappa, Vec3::Z)))
        .collect();
    // The device's own rounding of the spread is given to both.
    let spread = |kappa: f32| vmf::spread(kappa.into()) as f32;
    let entries: Vec<_> =
        inputs.iter().flat_map(|&(mu, kappa, h)| [entry(mu, kappa.to_bits()), entry(h, spread(kappa).to_bits())]).collect();
    let output = Device::bare().probe("vmf", &entries);
    let [mut mean, mut spreads, mut inverse, mut round_trip, mut density, mut centre] = [(); 6].map(|()| Worst::default());
    for (&(mu, kappa, h), got) in inputs.iter().zip(output.chunks(2)) {
        let k = f64::from(kappa);
        let at = || format!("{kappa}");
        let off = |got: f32, expected: f64| (f64::from(got) / expected - 1.0).abs();
        mean.add(off(got[0][0], vmf::mean_cosine(k)), at);
        spreads.add(off(got[0][1], vmf::spread(k)), at);
        inverse.add(off(got[0][2], vmf::concentration(spread(kappa).into())), at);
        let lobe = Lobe { mu: mu.as_dvec3(), kappa: k, weight: 1.0 };
        density.add(off(got[0][3], lobe.density(h.as_dvec3())), || format!("{kappa}, {mu}, {h}"));
        round_trip.add(off(got[1][0], k), at);
        centre.add(off(got[1][1], vmf::normalisation(k)), at);
    }
    mean.within("vmf_mean_cosine", BOUND);
    spreads.within("vmf_spread", BOUND);
    inverse.within("vmf_concentration", BOUND);
    round_trip.within("there and back", BOUND);
    density.within("vmf_density", BOUND);
    centre.within("vmf_normalisation", BOUND);
}

#[test]
fn edges_are_finite() {
    let spreads = [1.0, 0.0, -1.0, 2.0, 1e-30];
    let entries: Vec<_> = spreads.iter().flat_map(|s: &f32| [entry(Vec3::Z, 0), entry(Vec3::NEG_Z, s.to_bits())]).collect();
    let output = Device::bare().probe("vmf", &entries);
    for (&s, got) in spreads.iter().zip(output.chunks(2)) {
        // Concentration 0: no mean vector, density the same everywhere.
        assert_eq!(got[0][..2], [0.0, 1.0]);
        assert!((got[0][3] * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-6);
        let expected = vmf::concentration(s.into());
        assert!((f64::from(got[0][2]) - expected).abs() <= 1e-4 * expected, "{s}: {} for {expected}", got[0][2]);
    }
}

/// `texel_kernel.glsl` in f64: each of the four texels of a bilinear look-up under a lobe about itself, without the variance that
/// look-ups add.
fn texel_kernel(centre: DVec3, kappa: f64, variance_in_texels: f64, w: DVec3) -> f64 {
    let texel = (kappa * variance_in_texels).sqrt().recip();
    let columns = (TAU / texel).round();
    let size = DVec2::new(columns, 0.5 * columns);
    let at = latlong::uv(centre) * size - 0.5;
    let along = at - at.floor();
    let corner = |[x, y]: [f64; 2]| {
        let uv = (at.floor() + DVec2::new(x, y) + 0.5) / size;
        let (mu, sine) = (latlong::direction(uv), (PI * uv.y).sin());
        let variance = texel * texel / 12.0 * (1.0 + sine * sine);
        let narrow = vmf::concentration((vmf::spread(kappa) - variance) / (1.0 - variance));
        let share = |t: f64, c: f64| if c > 0.0 { t } else { 1.0 - t };
        share(along.x, x) * share(along.y, y) * Lobe { mu, kappa: narrow, weight: 1.0 }.density(w)
    };
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(corner).iter().sum()
}

#[test]
fn look_ups_hold_what_their_texels_do() {
    // Of the levels of a chain of 128 columns, whose concentrations are a factor of 2 apart.
    let inputs: Vec<(Vec3, f32, Vec3, f32)> = (0..COUNT)
        .map(|i| {
            let [level, reach] = unit(i, 11);
            let step = (level * 8.0).floor();
            let variance: f64 = if step % 2.0 == 0.0 { 4.0 } else { 2.0 };
            let kappa = (128.0 / TAU).powi(2) / 4.0 * (-step).exp2();
            let (centre, other) = (direction(i, 12), direction(i, 13));
            let width = 4.0 * reach / kappa.max(1.0).sqrt();
            (centre, kappa as f32, rounded(centre.as_dvec3() + other.as_dvec3() * width), variance as f32)
        })
        .collect();
    let entries: Vec<_> =
        inputs.iter().flat_map(|&(mu, kappa, w, v)| [entry(mu, kappa.to_bits()), entry(w, v.to_bits())]).collect();
    let output = Device::bare().probe("texel_kernel", &entries);
    let (mut worst, mut sum) = (Worst::default(), 0.0);
    for (&(centre, kappa, w, variance), got) in inputs.iter().zip(output.chunks(2)) {
        let expected = texel_kernel(centre.as_dvec3(), kappa.into(), variance.into(), w.as_dvec3());
        let off = (f64::from(got[0][0]) - expected) / f64::from(kappa);
        sum += off;
        worst.add(off.abs(), || format!("{centre}, {kappa}, {w}, {variance}: {} for {expected}", got[0][0]));
    }
    println!("mean {:.2e}", sum / inputs.len() as f64);
    worst.within("texel_kernel", BOUND);
}
