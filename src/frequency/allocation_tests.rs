use super::*;

/// A number in [0, 1) for each `i`.
fn unit(i: u32) -> f64 {
    sobol::to_unit(sobol::hash(i))
}

fn histogram(weights: impl Iterator<Item = f64>) -> Vec<u32> {
    let mut all = vec![0; BINS];
    weights.zip(0..).for_each(|(w, entry)| all[bin(w, entry)] += 1);
    all
}

/// Mean directions of a sample.
fn mean(histogram: &[u32], shares: &[f64], range: [u32; 2]) -> f64 {
    let sum = |f: &dyn Fn(usize) -> f64| (0..BINS).map(|b| f64::from(histogram[b]) * f(b)).sum::<f64>();
    sum(&|b| expected(shares[b], range)) / sum(&|_| 1.0)
}

#[test]
fn the_budget_is_met_whatever_is_clamped() {
    for spread in [0.0, 0.1, 3.0, 30.0, 120.0] {
        for budget in [2u32, 3, 5, 64, 700, 4096] {
            let counts = histogram((0..5000).map(|i| (unit(!i) - 0.5) * spread));
            let range = range(budget, 1);
            let shares = shares(&counts, f64::from(budget), range);
            assert!((mean(&counts, &shares, range) / f64::from(budget) - 1.0).abs() < 1e-6, "{spread} {budget}");
            let used: Vec<f64> = (0..BINS).filter(|b| counts[*b] > 0).map(|b| expected(shares[b], range)).collect();
            assert!(used.windows(2).all(|pair| pair[0] <= pair[1]));
            let at = |end: u32| used.iter().filter(|n| **n == f64::from(end)).count();
            assert!(used.iter().all(|n| (f64::from(range[0])..=f64::from(range[1])).contains(n)));
            // A wide spread needs both clamps.
            assert!(spread < 100.0 || budget != 64 || (at(range[0]) > 10 && at(range[1]) > 10), "{spread} {budget}");
        }
    }
}

#[test]
fn between_the_clamps_directions_go_with_the_weight() {
    let range = range(64, 1);
    let counts = histogram((0..3000).map(|i| unit(!i) * 4.0));
    let shares = shares(&counts, 64.0, range);
    for b in bin(0.5, 0)..bin(2.0, 0) {
        // Two octaves of weight are two of directions, and no number is off by more than half an octave and a bin.
        assert!((expected(shares[b + 2 * BINS_AN_OCTAVE as usize], range) / expected(shares[b], range) - 4.0).abs() < 1e-9);
        assert!((expected(shares[b], range).log2() - shares[b]).abs() <= 0.5 + 1.0 / BINS_AN_OCTAVE);
    }
}

#[test]
fn equal_weights_and_none_get_the_budget_each() {
    for weight in [NONE, -3.0, 63.9] {
        let shares = shares(&histogram((0..1000).map(|_| weight)), 64.0, range(64, 1));
        assert!((0..1000).all(|entry| directions(shares[bin(weight, entry)], range(64, 1), entry) == 64));
    }
}

#[test]
fn equal_weights_have_the_budget_as_their_mean() {
    for budget in [3, 5, 64, 90, 96, 1023, 3000] {
        let range = range(budget, 1);
        let shares = shares(&histogram((0..20_000).map(|_| 0.0)), f64::from(budget), range);
        let all: Vec<u32> = (0..20_000).map(|entry| directions(shares[bin(0.0, entry)], range, entry)).collect();
        let mean = all.iter().map(|n| f64::from(*n)).sum::<f64>() / all.len() as f64;
        assert!((mean / f64::from(budget) - 1.0).abs() < 0.005, "{budget}: {mean}");
        let best = all.iter().filter(|n| n.is_power_of_two() || range.contains(n)).count();
        assert!(best * 10 >= all.len() * 7, "{budget}: {best}");
    }
}

#[test]
fn sources_get_a_direction_each_where_the_budget_has_them() {
    assert_eq!(range(64, 1), [4, 1024]);
    assert_eq!(range(64, 9), [18, 1024]);
    assert_eq!(range(64, 100), [64, 1024]);
    assert_eq!((range(2, 1), range(2000, 1)), ([2, 1024], [4, 2000]));
}

/// A lobe of `width` radians that reflects `albedo` under light that varies as fast as `light` cycles/radian.
fn probes(width: f64, albedo: f64, light: f64) -> Vec<Integrand> {
    // Drawn from the lobe, an estimate is radiance times albedo: it varies as much as light does within the lobe.
    let radiance = |i: u32| 1.0 + (std::f64::consts::TAU * light * width * (unit(i) - 0.5)).sin();
    let rho = albedo / (width * width);
    (0..64)
        .map(|i| Integrand { bandwidth: light + 1.0 / width, product: radiance(i) * rho, estimate: radiance(i) * albedo })
        .collect()
}

#[test]
fn rules_follow_the_material_each_its_own_way() {
    use Allocation::{Deviation, Equation8, RelativeDeviation};
    let widths = [0.02, 0.05, 0.1, 0.2];
    let along = |rule: Allocation| widths.map(|w| rule.log_weight(&probes(w, 0.5, 1.0), 0.0, 0.01));
    // A wider lobe sees more of the light, so its estimate varies more; equation 8 falls with the square of reflectance.
    assert!(along(Deviation).windows(2).all(|pair| pair[0] < pair[1]));
    assert!(along(RelativeDeviation).windows(2).all(|pair| pair[0] < pair[1]));
    assert!(along(Equation8).windows(2).all(|pair| pair[0] > pair[1]));
    // Four times the albedo: twice in powers of two as much variance, none relative to the mean.
    let by_albedo = |rule: Allocation| {
        let of = |albedo| rule.log_weight(&probes(0.1, albedo, 1.0), 0.0, 0.0);
        of(0.8) - of(0.2)
    };
    assert!((by_albedo(Deviation) - 2.0).abs() < 1e-9 && by_albedo(RelativeDeviation).abs() < 1e-9);
    assert!((by_albedo(Equation8) - 4.0).abs() < 1e-9);
}

#[test]
fn darkness_and_lights_take_directions_away() {
    let of = |lights, dark| Allocation::RelativeDeviation.log_weight(&probes(0.1, 0.5, 1.0), lights, dark);
    assert!(of(1.0, 0.0) < of(0.0, 0.0) && of(0.0, 1.0) < of(0.0, 0.0));
    let black = [Integrand::default(); 4];
    for rule in [Allocation::Constant, Allocation::Equation8, Allocation::Deviation, Allocation::RelativeDeviation] {
        assert_eq!(rule.log_weight(&black, 0.0, 0.0), NONE);
        assert_eq!(rule.log_weight(&[], 0.0, 0.0), NONE);
    }
}
