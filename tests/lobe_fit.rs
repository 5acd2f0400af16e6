//! Fits of reflectances by lobes, and importance tables of what they leave.

mod support {
    pub mod half_vectors;
    pub mod statistics;
}

use glam::{DVec2, DVec3};
use passband::distribution::fit::{FitNode, NODES};
use passband::distribution::{Budget, LobeFit};
use passband::reflectance::{Ggx, ImportanceTable, Lobe, Reflectance, Vmf, stand_in, turned};
use passband::sampling::sobol;
use std::f64::consts::PI;
use std::sync::LazyLock;
use support::half_vectors::over_half_vectors;
use support::statistics::Mean;

type Case = (&'static str, Box<dyn Reflectance>, LobeFit);

fn fitted(name: &'static str, f: Box<dyn Reflectance>, lobes: usize) -> Case {
    let start = std::time::Instant::now();
    let fit = LobeFit::build(f.as_ref(), Budget { lobes, ..Budget::default() });
    let seconds = start.elapsed().as_secs_f64();
    println!("{name}: {} lobes, mean error {:.4}, {seconds:.2} s", fit.count(), fit.mean_error());
    (name, f, fit)
}

fn ggx(alpha: f64) -> Box<dyn Reflectance> {
    Box::new(Ggx { alpha, f0: DVec3::new(0.9, 0.7, 0.5), albedo: DVec3::ZERO })
}

static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let baked = |name| -> Box<dyn Reflectance> { Box::new(stand_in::table(name).unwrap()) };
    vec![
        fitted("mirror-metal", baked("mirror-metal"), 15),
        fitted("metallic-paint", baked("metallic-paint"), 8),
        fitted("rough", baked("rough"), 24),
        fitted("satin", baked("satin"), 8),
        fitted("ggx 0.01", ggx(0.01), 15),
    ]
});

fn viewer(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

#[test]
fn errors_are_small() {
    // Mean over nodes, at 60 degrees, and lobes.
    let bounds = [(0.075, 0.042, 15), (0.048, 0.036, 8), (0.0115, 0.014, 4), (0.031, 0.04, 8), (0.105, 0.04, 15)];
    for ((name, f, fit), (mean, at_60, lobes)) in CASES.iter().zip(bounds) {
        let found = fit.missed(f.as_ref(), 0.5);
        assert!(fit.mean_error() < mean && found < at_60, "{name}: {} {found}", fit.mean_error());
        assert!(fit.count() <= lobes, "{name}: {} lobes", fit.count());
        let valid =
            |n: &FitNode| n.lobes.iter().all(|l| l.amplitude.min_element() >= 0.0 && (-1.0..=17.0).contains(&l.log2_kappa));
        assert!(fit.nodes().iter().all(valid), "{name}");
    }
}

/// Chains are long for grazing views alone.
#[test]
fn few_lobes_are_used_where_few_are_needed() {
    for (name, _, fit) in CASES.iter() {
        let used = |n: &FitNode| n.lobes.iter().filter(|l| l.amplitude != DVec3::ZERO).count();
        let counts: Vec<usize> = fit.nodes().iter().map(used).collect();
        println!("{name}: {counts:?}");
        let most = counts.iter().copied().max().unwrap();
        assert!(counts[0] > 0 && (2 * counts[0] <= most || most <= 4), "{name}: {counts:?}");
        // What light is looked up under is all that there is between two nodes.
        let (_, spaces) = counts.split_first().unwrap();
        assert!(counts.iter().zip(spaces).all(|(a, b)| a.abs_diff(*b) <= 4), "{name}: {counts:?}");
    }
}

#[test]
fn errors_are_those_of_a_quadrature_that_knows_no_lobes() {
    for (name, f, fit) in CASES.iter().filter(|c| ["metallic-paint", "rough", "satin"].contains(&c.0)) {
        for degrees in [10.0, 50.0, 75.0] {
            let wo = viewer(degrees);
            let node = fit.at(wo.z);
            let (rings, spokes) = (800, 300);
            let (mut missed, mut all) = (0.0, 0.0);
            for i in 0..rings {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(rings);
                for k in 0..spokes {
                    let (s, c) = (PI * (f64::from(k) + 0.5) / f64::from(spokes)).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    let w = DVec3::new(r * c, r * s, z);
                    let value = if z > 0.0 { f.evaluate(w, wo) * z } else { DVec3::ZERO };
                    missed += (value - node.evaluate(w)).abs().element_sum();
                    all += value.element_sum();
                }
            }
            let (found, expected) = (fit.missed(f.as_ref(), wo.z), missed / all);
            assert!((found / expected - 1.0).abs() < 0.03, "{name} at {degrees}: {found} for {expected}");
        }
    }
}

#[test]
fn lobes_can_be_interpolated_between_nodes() {
    for (name, f, fit) in CASES.iter() {
        let mut most: f64 = 0.0;
        for i in (0..NODES - 1).step_by(4) {
            let view = 0.5 * (LobeFit::angle(i) + LobeFit::angle(i + 1));
            let between = fit.missed(f.as_ref(), view.cos());
            let at_nodes = 0.5 * (fit.nodes()[i].error + fit.nodes()[i + 1].error);
            most = most.max(between / at_nodes);
            assert!(between < 1.1 * at_nodes + 0.001, "{name} after node {i}: {between} for {at_nodes}");
        }
        println!("{name}: at most {most:.3} times the error at nodes");
    }
}

#[test]
fn fits_are_the_same_however_many_threads_there_are() {
    let build = || LobeFit::build(ggx(0.2).as_ref(), Budget { lobes: 4, error: 0.0 });
    let alone = build();
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..3).map(|_| scope.spawn(build)).collect();
        assert!(all.into_iter().all(|one| one.join().unwrap() == alone));
    });
}

#[test]
fn fewer_lobes_are_taken_where_they_are_enough() {
    let f = ggx(0.4);
    let build = |lobes, error| LobeFit::build(f.as_ref(), Budget { lobes, error });
    let (coarse, fine, none) = (build(24, 0.2), build(8, 0.0), build(0, 0.0));
    assert!(coarse.count() < fine.count() && coarse.mean_error() < 0.25 && fine.mean_error() < coarse.mean_error());
    assert!(none.count() <= 1, "{}", none.count());
}

/// Says nonsense, or nothing.
struct Broken(f64);
impl Reflectance for Broken {
    fn evaluate(&self, wi: DVec3, _: DVec3) -> DVec3 {
        DVec3::splat(if wi.x > 0.0 { self.0 } else { -self.0 })
    }
}

#[test]
fn what_cannot_be_fitted_is_black() {
    for value in [f64::NAN, f64::INFINITY, 0.0] {
        let fit = LobeFit::build(&Broken(value), Budget { lobes: 3, error: 0.02 });
        let finite = LobeFit::new(fit.nodes().to_vec());
        assert_eq!(finite.as_ref(), Some(&fit));
        ImportanceTable::build_residual(&Broken(value), &fit);
        let sum: f64 = fit.nodes().iter().map(|n| n.evaluate(DVec3::Z).max_element()).sum();
        assert!(sum == 0.0, "{value}: {sum}");
    }
}

/// What the fit leaves of light from `w`.
fn left(f: &dyn Reflectance, node: &FitNode, w: DVec3, wo: DVec3) -> DVec3 {
    let value = if w.z > 0.0 { f.evaluate(w, wo) * w.z } else { DVec3::ZERO };
    value - node.evaluate(w)
}

#[test]
fn tables_of_what_is_left_lie_where_it_is() {
    for (name, f, fit) in CASES.iter() {
        let start = std::time::Instant::now();
        let table = ImportanceTable::build_residual(f.as_ref(), fit);
        println!("{name}: built in {:.3} s", start.elapsed().as_secs_f64());
        for degrees in [0.7, 60.0, 75.0] {
            let wo = viewer(degrees);
            let (node, mut targets) = (fit.at(wo.z), Vec::new());
            let mut sum = 0.0;
            over_half_vectors([2000, 120], |h, solid_angle| {
                let cosine = wo.dot(h);
                let pdf = table.pdf_half(wo.z, h);
                sum += pdf * solid_angle;
                if cosine > 0.0 {
                    let w = 2.0 * cosine * h - wo;
                    targets.push((left(f.as_ref(), &node, w, wo).abs().element_sum() * 4.0 * cosine, pdf, solid_angle));
                }
            });
            assert!((sum - 1.0).abs() < 5e-3, "{name} at {degrees}: {sum}");
            let total: f64 = targets.iter().map(|t| t.0 * t.2).sum();
            let shared: f64 = targets.iter().map(|t| (t.0 / total).min(t.1) * t.2).sum();
            // Where a node's range of views changes the target, its table is the mean.
            println!("{name} at {degrees}: shares {shared:.3}");
            assert!(shared > 0.7, "{name} at {degrees}: {shared}");
        }
    }
}

/// Light from everywhere, most of it from one side.
fn light(w: DVec3) -> f64 {
    0.2 + (-4.0 * (w - DVec3::new(-0.6, 0.48, 0.64)).length_squared()).exp()
}

/// Mean of the directions that half vectors above the horizon reflect to, of what is left of `light`.
fn truth(f: &dyn Reflectance, fit: &LobeFit, wo: DVec3) -> f64 {
    let (node, mut sum) = (fit.at(wo.z), 0.0);
    over_half_vectors([1200, 300], |h, solid_angle| {
        let cosine = wo.dot(h);
        if cosine > 0.0 {
            let w = 2.0 * cosine * h - wo;
            sum += light(w) * left(f, &node, w, wo).element_sum() * 4.0 * cosine * solid_angle;
        }
    });
    sum
}

fn estimate(table: &ImportanceTable, f: &dyn Reflectance, fit: &LobeFit, wo: DVec3) -> Mean {
    let (node, mut mean) = (fit.at(wo.z), Mean::default());
    for i in 0..1 << 16 {
        let sample = table.sample_sphere(wo.z, sobol::random(i, 61).map(sobol::to_unit));
        mean.add(sample.map_or(0.0, |s| {
            assert!((table.pdf_sphere(wo.z, s.wi) / s.pdf - 1.0).abs() < 1e-6 || i % 64 != 0);
            light(s.wi) * left(f, &node, s.wi, wo).element_sum() / s.pdf
        }));
    }
    mean
}

#[test]
fn estimates_of_what_is_left_have_the_right_mean_and_little_variance() {
    for (name, f, fit) in CASES.iter() {
        let (own, plain) = (ImportanceTable::build_residual(f.as_ref(), fit), ImportanceTable::build(f.as_ref()));
        for degrees in [30.0, 60.0] {
            let wo = viewer(degrees);
            let truth = truth(f.as_ref(), fit, wo);
            let [own, plain] = [&own, &plain].map(|table| estimate(table, f.as_ref(), fit, wo));
            let ratio = own.deviation() / plain.deviation();
            println!(
                "{name} at {degrees}: {:.6} for {truth:.6}, error {:.1e}, deviation ratio {ratio:.3}",
                own.mean(),
                own.error()
            );
            for mean in [&own, &plain] {
                assert!(
                    (mean.mean() - truth).abs() < 4.5 * mean.error() + 2e-5,
                    "{name} at {degrees}: {} for {truth}",
                    mean.mean()
                );
            }
            assert!(ratio < 0.9, "{name} at {degrees}: {ratio}");
        }
    }
}

/// Lobes that lean to one side, in a tangent frame turned against the viewer's.
struct Turned<'a>(&'a Vmf, f64);
impl Reflectance for Turned<'_> {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let turn = DVec2::from_angle(self.1);
        self.0.evaluate(turned(turn, wi), turned(turn, wo))
    }
}

#[test]
fn what_is_not_isotropic_is_fitted_in_the_mean_and_its_error_says_so() {
    let lobe = |x: f64, y: f64| Lobe { mu: DVec3::new(x, y, 1.0), kappa: 60.0, weight: 0.4 };
    let vmf = Vmf::new(&[lobe(0.25, 0.0), lobe(-0.25, 0.1)]).unwrap();
    let (_, _, fit) = fitted("leaning", Box::new(vmf.clone()), 4);
    let table = ImportanceTable::build_residual(&vmf, &fit);
    let wo = viewer(30.0);
    let mut missed = Mean::default();
    for turn in 0..6 {
        let f = Turned(&vmf, f64::from(turn) * PI / 3.0);
        missed.add(fit.missed(&f, wo.z));
        let (truth, found) = (truth(&f, &fit, wo), estimate(&table, &f, &fit, wo));
        println!("turn {turn}: {:.5} for {truth:.5}, deviation {:.3}", found.mean(), found.deviation());
        assert!((found.mean() - truth).abs() < 4.5 * found.error() + 1e-4, "{turn}: {} for {truth}", found.mean());
        assert!(found.deviation() < 3.0, "{turn}: {}", found.deviation());
    }
    // Each turn's own share of the light differs a little.
    let told = fit.at(wo.z).error;
    println!("error {told:.3}, of turns {:.3}", missed.mean());
    assert!((missed.mean() / told - 1.0).abs() < 0.1 && told > 0.3, "{told} for {}", missed.mean());
}
