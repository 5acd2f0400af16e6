//! Importance tables over the view angle: what is drawn has the density that is claimed, and estimates have the right mean.

mod support {
    pub mod half_vectors;
    pub mod statistics;
}

use glam::DVec3;
use passband::reflectance::importance::{self, COLUMNS, ROWS, VIEW_ANGLES, borders};
use passband::reflectance::{BlinnPhong, Ggx, ImportanceTable, Lobe, Reflectance, Sgd, Vmf, stand_in, turned};
use passband::sampling::{luminance, sobol};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;
use support::half_vectors::over_half_vectors;
use support::statistics::{Mean, chi_square_p};

const P_VALUE: f64 = 1e-4;
const DEGREES: [f64; 6] = [0.0, 20.0, 45.0, 70.0, 85.0, 89.0];

type Case = (String, Box<dyn Reflectance>, ImportanceTable);

static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let case = |name: String, f: Box<dyn Reflectance>| {
        let start = std::time::Instant::now();
        let table = ImportanceTable::build(f.as_ref());
        println!("{name}: built in {:.3} s", start.elapsed().as_secs_f64());
        (name, f, table)
    };
    let baked = stand_in::names().iter().map(|&n| case(n.into(), Box::new(stand_in::table(n).unwrap())));
    let ggx = [0.01, 0.05, 0.2, 0.5]
        .map(|alpha| case(format!("ggx {alpha}"), Box::new(Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO })));
    let blinn_phong = [5.0, 2000.0].map(|exponent| {
        let f = BlinnPhong { exponent, specular: DVec3::splat(0.6), albedo: DVec3::splat(0.2) };
        case(format!("blinn-phong {exponent}"), Box::new(f))
    });
    let sgd = Sgd::from_rows([0.05, 0.6, 0.15, 0.7, 0.35, -0.2, 5.5, 2.5, 0.4, 9.0, 0.1].map(|v| [v; 3]));
    let sgd = case("sgd".into(), Box::new(sgd.bake()));
    let vmf = Vmf::new(&[Lobe { mu: DVec3::Z, kappa: 100.0, weight: 0.8 }]).unwrap();
    let vmf = case("vmf".into(), Box::new(vmf));
    let diffuse = Ggx { alpha: 1.0, f0: DVec3::ZERO, albedo: DVec3::splat(0.8) };
    let models = blinn_phong.into_iter().chain([sgd, vmf]);
    baked
        .chain(ggx)
        .chain(models)
        .chain([case("diffuse".into(), Box::new(diffuse)), case("black".into(), Box::new(Black))])
        .collect()
});

/// Reflects nothing.
struct Black;
impl Reflectance for Black {
    fn evaluate(&self, _: DVec3, _: DVec3) -> DVec3 {
        DVec3::ZERO
    }
}

/// Says nonsense.
struct Broken;
impl Reflectance for Broken {
    fn evaluate(&self, wi: DVec3, _: DVec3) -> DVec3 {
        DVec3::splat(if wi.x > 0.0 { f64::NAN } else { f64::INFINITY })
    }
}

fn viewer(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

fn reflect(wo: DVec3, h: DVec3) -> Option<(DVec3, f64)> {
    let cosine = wo.dot(h);
    let wi = 2.0 * cosine * h - wo;
    (cosine > 0.0 && wi.z > 0.0).then_some((wi, cosine))
}

#[test]
fn cells_partition_the_half_vectors_exactly() {
    for (name, _, table) in CASES.iter().chain([&("broken".into(), Box::new(Broken) as _, ImportanceTable::build(&Broken))]) {
        assert_eq!(table.cells().len(), VIEW_ANGLES * ROWS * COLUMNS);
        assert!(table.density_texels().iter().all(|d| (1e-4..=6e4).contains(d)), "{name}");
        for node in table.cells().chunks(ROWS * COLUMNS) {
            let mut t = 0;
            for row in node.chunks(COLUMNS) {
                let mut phi = 0;
                for &cell @ [t0, t1, phi0, phi1] in row {
                    assert!(t0 == t && t1 == row[0][1] && phi0 == phi, "{name}: {cell:?} does not join");
                    let [low, high, left, right] = borders(cell);
                    assert!(high > low && right > left, "{name}: {cell:?} is empty");
                    phi = phi1;
                }
                assert_eq!(phi, u16::MAX, "{name}");
                t = row[0][1];
            }
            assert_eq!(t, u16::MAX, "{name}");
        }
    }
}

#[test]
fn borders_fill_the_half_sphere() {
    assert_eq!(borders([0, u16::MAX, 0, u16::MAX]), [0.0, 1.0, 0.0, std::f32::consts::PI]);
}

#[test]
fn half_vectors_have_the_cells_density() {
    const N: u32 = 1 << 18;
    // Bins that know nothing of the cells: even in sqrt(theta) and azimuth. Both are boxes in (t, phi), so that the
    // expectation is exact.
    const BINS: [usize; 2] = [30, 11];
    let t_border = |i: usize| 1.0 - (FRAC_PI_2 * (i as f64 / BINS[0] as f64).powi(2)).cos();
    let phi_border = |i: usize| PI * i as f64 / BINS[1] as f64;
    let share = |a: f32, b: f32, low: f64, high: f64| {
        let (a, b) = (f64::from(a), f64::from(b));
        (b.min(high) - a.max(low)).max(0.0) / (b - a)
    };
    for (name, _, table) in CASES.iter() {
        for degrees in DEGREES {
            let cos_o = viewer(degrees).z;
            let mut expected = vec![0.0; 2 * BINS[0] * BINS[1]];
            for &cell in table.cells().chunks(ROWS * COLUMNS).nth(importance::node(cos_o)).unwrap() {
                let [t0, t1, phi0, phi1] = borders(cell);
                for row in 0..BINS[0] {
                    let along_t = share(t0, t1, t_border(row), t_border(row + 1));
                    for column in 0..BINS[1] {
                        let mass = along_t * share(phi0, phi1, phi_border(column), phi_border(column + 1));
                        let at = (row * BINS[1] + column) * 2;
                        (0..2).for_each(|sign| expected[at + sign] += mass * f64::from(N) / (2 * ROWS * COLUMNS) as f64);
                    }
                }
            }
            assert!((expected.iter().sum::<f64>() / f64::from(N) - 1.0).abs() < 1e-6, "{name} at {degrees}");

            let mut observed = vec![0; expected.len()];
            let mut disagree = 0;
            for i in 0..N {
                let (h, pdf) = table.half_vector(cos_o, sobol::random(i, 41).map(sobol::to_unit));
                assert!(pdf.is_finite() && pdf > 0.0, "{name} at {degrees}: {h} has density {pdf}");
                disagree += u32::from((table.pdf_half(cos_o, h) / pdf - 1.0).abs() > 1e-9);
                let x = (h.x.hypot(h.y).atan2(h.z) / FRAC_PI_2).sqrt();
                let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                let bin = at(x, BINS[0]) * BINS[1] + at(h.y.abs().atan2(h.x) / PI, BINS[1]);
                observed[bin * 2 + usize::from(h.y < 0.0)] += 1;
            }
            let p = chi_square_p(&observed, &expected);
            assert!(p > P_VALUE, "{name} at {degrees}: p = {p}");
            // Rounding may put a half vector on a border into the next cell.
            assert!(disagree < 20, "{name} at {degrees}: half_vector and pdf_half disagree {disagree} times");
        }
    }
}

#[test]
fn light_directions_have_the_density_that_is_returned() {
    const N: u32 = 1 << 18;
    // Over the light's hemisphere, even in the roots of z and of the azimuth from the mirror direction, where grazing light
    // crowds; and a last bin for rejected samples. The expectation integrates `pdf` over directions.
    const BINS: [usize; 2] = [16, 24];
    const FINE: [usize; 2] = [120, 40];
    for (name, _, table) in
        CASES.iter().filter(|c| ["rough", "felt", "ggx 0.2", "sgd", "vmf", "blinn-phong 5", "diffuse"].contains(&c.0.as_str()))
    {
        for degrees in [20.0, 70.0, 89.0] {
            let cos_o = viewer(degrees).z;
            let bins = BINS[0] * BINS[1];
            let mut expected = vec![0.0; bins + 1];
            let fine = [BINS[0] * FINE[0], BINS[1] * FINE[1]];
            for i in 0..fine[0] {
                let root = (i as f64 + 0.5) / fine[0] as f64;
                let (z, dz) = (root * root, 2.0 * root / fine[0] as f64);
                let sine = (1.0 - z * z).sqrt();
                for j in 0..fine[1] {
                    let root = 2.0 * (j as f64 + 0.5) / fine[1] as f64 - 1.0;
                    let (phi, dphi) = (PI * root * root.abs(), 4.0 * PI * root.abs() / fine[1] as f64);
                    let pdf = table.pdf(cos_o, DVec3::new(-sine * phi.cos(), -sine * phi.sin(), z));
                    expected[i / FINE[0] * BINS[1] + j / FINE[1]] += pdf * dz * dphi * f64::from(N);
                }
            }
            let mut rejected = 0.0;
            over_half_vectors([1000, 500], |h, solid_angle| {
                if reflect(viewer(degrees), h).is_none() {
                    rejected += table.pdf_half(cos_o, h) * solid_angle;
                }
            });
            expected[bins] = rejected * f64::from(N);
            let total = expected.iter().sum::<f64>() / f64::from(N);
            assert!((total - 1.0).abs() < 2e-3, "{name} at {degrees}: pdf and rejected mass sum to {total}");

            let mut observed = vec![0; bins + 1];
            for i in 0..N {
                let Some(s) = table.sample(cos_o, sobol::random(i, 43).map(sobol::to_unit)) else {
                    observed[bins] += 1;
                    continue;
                };
                assert!((s.wi.length() - 1.0).abs() < 1e-12 && s.wi.z > 0.0 && s.pdf > 0.0);
                let phi = (-s.wi.y).atan2(-s.wi.x) / PI;
                let y = (1.0 + phi.signum() * phi.abs().sqrt()) / 2.0;
                let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                observed[at(s.wi.z.sqrt(), BINS[0]) * BINS[1] + at(y, BINS[1])] += 1;
            }
            let p = chi_square_p(&observed, &expected);
            println!("{name} at {degrees}: p = {p:.3}, rejected {rejected:.4}, sum {total:.5}");
            assert!(p > P_VALUE, "{name} at {degrees}: p = {p}");
        }
    }
}

#[test]
fn estimates_have_the_mean_that_quadrature_finds() {
    for (name, f, table) in CASES.iter() {
        for degrees in DEGREES {
            let wo = viewer(degrees);
            let mut truth = 0.0;
            over_half_vectors([1500, 400], |h, solid_angle| {
                if let Some((wi, cosine)) = reflect(wo, h) {
                    truth += luminance(f.evaluate(wi, wo)) * wi.z * 4.0 * cosine * solid_angle;
                }
            });
            let mut estimate = Mean::default();
            for i in 0..1 << 18 {
                let s = table.sample(wo.z, sobol::random(i, 47).map(sobol::to_unit));
                estimate.add(s.map_or(0.0, |s| luminance(f.evaluate(s.wi, wo)) * s.wi.z / s.pdf));
            }
            let off = estimate.mean() - truth;
            let deviation = estimate.deviation() / truth.max(1e-9);
            println!("{name} at {degrees}: {:.5} for {truth:.5}, relative deviation {deviation:.3}", estimate.mean());
            assert!(off.abs() <= 4.5 * estimate.error() + 3e-4 * truth, "{name} at {degrees}: {} for {truth}", estimate.mean());
        }
    }
}

/// A reflectance whose rows are evaluated one value after the other.
struct Plain<'a>(&'a dyn Reflectance);
impl Reflectance for Plain<'_> {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.0.evaluate(wi, wo)
    }

    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.0.mean_over_turns(wi, wo)
    }
}

#[test]
fn rows_give_the_tables_that_single_values_give() {
    let lobe = |x: f64, kappa: f64| Lobe { mu: DVec3::new(x, 0.1, 1.0), kappa, weight: 0.4 };
    let leaning = Vmf::new(&[lobe(0.5, 200.0), lobe(-0.3, 20.0)]).unwrap();
    let leaning = ("leaning".to_string(), Box::new(leaning) as Box<dyn Reflectance>);
    for (name, f) in CASES.iter().map(|(name, f, _)| (name, f)).chain([(&leaning.0, &leaning.1)]) {
        let [fast, slow] = [ImportanceTable::build(f.as_ref()), ImportanceTable::build(&Plain(f.as_ref()))];
        // Either may be rounded up where the other is rounded down.
        let cells = fast.cells().as_flattened().iter().zip(slow.cells().as_flattened());
        let off = cells.filter(|(a, b)| a.abs_diff(**b) > 1).count();
        let density =
            fast.density_texels().iter().zip(slow.density_texels()).map(|(a, b)| ((a - b) / b).abs()).fold(0.0, f32::max);
        println!("{name}: {off} borders apart, densities {density:e} apart");
        assert!(off == 0 && density < 2e-6, "{name}: {off} {density}");
    }
}

/// Lobes that lean to one side, in a tangent frame turned against the viewer's.
struct Turned(Vmf, f64);
impl Reflectance for Turned {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let turn = glam::DVec2::from_angle(self.1);
        self.0.evaluate(turned(turn, wi), turned(turn, wo))
    }
}

#[test]
fn estimates_of_a_reflectance_that_is_not_isotropic_have_the_right_mean_at_every_turn() {
    let lobe = |x: f64, y: f64| Lobe { mu: DVec3::new(x, y, 1.0), kappa: 200.0, weight: 0.4 };
    let vmf = Vmf::new(&[lobe(0.5, 0.0), lobe(-0.3, 0.4)]).unwrap();
    let table = ImportanceTable::build(&vmf);
    for degrees in [20.0, 60.0] {
        let wo = viewer(degrees);
        for turn in 0..6 {
            let f = Turned(vmf.clone(), f64::from(turn) * PI / 3.0);
            let mut truth = 0.0;
            over_half_vectors([1500, 720], |h, solid_angle| {
                if let Some((wi, cosine)) = reflect(wo, h) {
                    truth += luminance(f.evaluate(wi, wo)) * wi.z * 4.0 * cosine * solid_angle;
                }
            });
            let mut estimate = Mean::default();
            for i in 0..1 << 18 {
                let s = table.sample(wo.z, sobol::random(i, 53).map(sobol::to_unit));
                estimate.add(s.map_or(0.0, |s| luminance(f.evaluate(s.wi, wo)) * s.wi.z / s.pdf));
            }
            let (mean, deviation) = (estimate.mean(), estimate.deviation());
            println!("leaning lobes at {degrees}, turn {turn}: {mean:.5} for {truth:.5}, deviation {deviation:.2}");
            assert!((mean - truth).abs() <= 4.5 * estimate.error() + 3e-4 * truth, "{degrees}, {turn}: {mean} for {truth}");
            // The table knows the ring that the lobes leave, not where on it they are; never only the floor.
            assert!(deviation < 2.5, "{degrees}, {turn}: {deviation}");
        }
    }
}

#[test]
fn the_smooth_density_follows_the_cells() {
    // Not equal by design; its integral shows that it is the same distribution, at the resolution of its bins.
    for (name, _, table) in CASES.iter() {
        for degrees in DEGREES {
            let cos_o = viewer(degrees).z;
            let mut total = 0.0;
            let mut shared = 0.0;
            over_half_vectors([1500, 400], |h, solid_angle| {
                let density = table.density(cos_o, h);
                total += density * solid_angle;
                shared += density.min(table.pdf_half(cos_o, h)) * solid_angle;
            });
            println!("{name} at {degrees}: integral {total:.3}, shared with the cells {shared:.3}");
            assert!((total - 1.0).abs() < 0.05 && shared > 0.85, "{name} at {degrees}: integral {total}, shared {shared}");
        }
    }
}
