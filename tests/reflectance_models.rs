//! SGD, Blinn-Phong, vMF mixtures and turned tables: values, normalisation, reciprocity, refusals, baking.

use glam::{DVec2, DVec3};
use passband::distribution::vmf;
use passband::reflectance::{BlinnPhong, Lobe, MerlTable, Model, Reflectance, Sgd, TurnedTables, Vmf, bake, sgd_table, turned};
use passband::sampling::sobol;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// A direction above the horizon, uniform over the hemisphere.
fn above([u, v]: [f64; 2]) -> DVec3 {
    let sine = (1.0 - u * u).sqrt();
    DVec3::new(sine * (TAU * v).cos(), sine * (TAU * v).sin(), u)
}

fn pair(i: u32) -> (DVec3, DVec3) {
    (above(sobol::random(i, 2).map(sobol::to_unit)), above(sobol::random(i, 3).map(sobol::to_unit)))
}

/// Midpoint quadrature over the hemisphere, fine near the normal (theta = (pi/2) x^2).
fn over_hemisphere(n: [usize; 2], mut f: impl FnMut(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for i in 0..n[0] {
        let x = (i as f64 + 0.5) / n[0] as f64;
        let theta = FRAC_PI_2 * x * x;
        for j in 0..n[1] {
            let phi = TAU * (j as f64 + 0.5) / n[1] as f64;
            let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            sum += f(h) * theta.sin() * PI * x / n[0] as f64 * TAU / n[1] as f64;
        }
    }
    sum
}

/// Reflected share of light for a view direction, over half vectors.
fn albedo(f: &dyn Reflectance, wo: DVec3, n: [usize; 2]) -> f64 {
    over_hemisphere(n, |h| {
        let cosine = wo.dot(h);
        let wi = 2.0 * cosine * h - wo;
        if cosine > 0.0 && wi.z > 0.0 { f.evaluate(wi, wo).x * wi.z * 4.0 * cosine } else { 0.0 }
    })
}

fn viewer(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, 0.0, cos)
}

/// Three made-up channels: a usual one, one whose masking cuts off (c as large as in published fits), one whose Fresnel term
/// is negative near the normal and whose masking has an enormous amplitude.
fn sgd() -> Sgd {
    Sgd::from_rows([
        [0.05, 0.01, 0.001],
        [0.6, 0.3, 0.2],
        [0.15, 0.02, 0.3],
        [0.7, 0.45, 1.2],
        [0.35, 0.08, 0.05],
        [-0.2, 0.03, 0.3],
        [5.5, 25.0, 1.5],
        [2.5, 3.0, 1e7],
        [0.4, 1e38, 1e-6],
        [9.0, 60.0, 400.0],
        [0.1, 0.5, -0.5],
    ])
}

#[test]
fn sgd_has_the_values_that_fifty_digits_give() {
    // The formula evaluated with mpmath at 50 digits.
    let rows: [([f64; 3], [f64; 3], [f64; 3]); 5] = [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.613182921252, 0.219745039553, 0.0]),
        ([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.874471543301, 0.384158864925, 0.000318309886184]),
        ([0.3, 0.4, 0.8660254037844386], [-0.1, -0.5, 0.86], [0.493553823823, 0.0289702066937, 0.000318309886184]),
        ([0.9, 0.1, 0.2], [-0.8, 0.3, 0.25], [0.0159154943092, 0.00318309886184, 0.000318309886184]),
        ([0.5, 0.5, 0.7], [0.4, 0.5, 0.76], [0.0168900476811, 0.00318309886184, 0.000318309886184]),
    ];
    for (wi, wo, expected) in rows {
        let got = sgd().evaluate(DVec3::from(wi).normalize(), DVec3::from(wo).normalize());
        let error = (got - DVec3::from(expected)).abs() / DVec3::from(expected).max(DVec3::splat(1e-9));
        assert!(error.max_element() < 1e-9, "{wi:?} {wo:?}: {got} for {expected:?}");
    }
}

#[test]
fn sgd_is_finite_reciprocal_and_not_negative_whatever_its_parameters() {
    for i in 0..20_000 {
        let number = |k: u32, low: f64, high: f64| low + (high - low) * sobol::to_unit(sobol::random(i, 100 + k)[0]);
        let wide = |k, low: f64, high: f64| 10f64.powf(number(k, low, high));
        let rows = [
            number(0, 0.0, 0.4),
            number(1, 0.0, 4.0),
            wide(2, -5.0, 0.0),
            number(3, 0.0, 1.8),
            number(4, 0.0, 8.0),
            number(5, -1.0, 7.0),
            wide(6, 0.0, 5.0),
            if i % 9 == 0 { 0.0 } else { wide(7, -8.0, 7.0) },
            if i % 7 == 0 { 1e38 } else { wide(8, -8.0, 20.0) },
            if i % 5 == 0 { 0.0 } else { number(9, -20.0, 850.0) },
            number(10, -0.7, 1.2),
        ];
        let sgd = Sgd::from_rows(rows.map(|v| [v; 3]));
        sgd.validate().unwrap();
        let (wi, wo) = pair(i);
        let edge = DVec3::new(1.0, 0.0, 1e-12).normalize();
        for (a, b) in [(wi, wo), (wi, wi), (wi, edge), (edge, edge), (DVec3::Z, wo)] {
            let f = sgd.evaluate(a, b);
            assert!(f.is_finite() && f.min_element() >= 0.0, "{sgd:?} {a} {b}: {f}");
            let swapped = sgd.evaluate(b, a);
            assert!((f - swapped).abs().max_element() <= 1e-9 * f.max_element(), "{sgd:?} {a} {b}: {f} and {swapped}");
        }
    }
    assert_eq!(sgd().evaluate(DVec3::X, DVec3::Z), DVec3::ZERO);
}

#[test]
fn sgd_normals_fill_the_projected_area() {
    // With p = 0 the table's normalisation has a closed form: kap = e^alpha / alpha. With F = G = 1 and no diffuse part,
    // f(h, h) pi cos^2 is D.
    for alpha in [0.02, 0.1, 0.5f64] {
        let grey = |v: f64| [v; 3];
        let kap = alpha.exp() / alpha;
        let rows = [0.0, 1.0, alpha, 0.0, 1.0, 0.0, kap, 0.0, 0.0, 1.0, 0.0].map(grey);
        let sgd = Sgd::from_rows(rows);
        let sum = over_hemisphere([4000, 1], |h| sgd.evaluate(h, h).x * PI * h.z * h.z * h.z);
        assert!((sum - 1.0).abs() < 1e-4, "alpha {alpha}: {sum}");
    }
}

#[test]
fn sgd_bakes_and_refuses() {
    let exact = sgd();
    let error = bake::error(&exact, &exact.bake(), 20_000);
    println!("sgd baked: {error:?}");
    // The narrowest channel, alpha 0.02, is four bins wide.
    assert!(error.rms < 0.03 && error.median < 2e-3, "{error:?}");
    let message = |change: &dyn Fn(&mut Sgd)| {
        let mut bad = sgd();
        change(&mut bad);
        bad.validate().unwrap_err().to_string()
    };
    assert!(message(&|s| s.alpha.y = 0.0).starts_with("sgd.alpha: expected finite numbers above 0"));
    assert!(message(&|s| s.k.z = f64::NAN).starts_with("sgd.k: expected finite numbers, got"));
    assert!(message(&|s| s.c.x = f64::INFINITY).starts_with("sgd.c: expected"));
    assert!(message(&|s| s.rhod.x = -0.1).starts_with("sgd.rhod: expected"));
}

/// The test's parameters as a table with its columns in another order and one more.
fn csv() -> String {
    let values = [
        ("theta0", sgd().theta0),
        ("k", sgd().k),
        ("c", sgd().c),
        ("lambda", sgd().lambda),
        ("kap", sgd().kap),
        ("F1", sgd().f1),
        ("F0", sgd().f0),
        ("p", sgd().p),
        ("alpha", sgd().alpha),
        ("rhos", sgd().rhos),
        ("rhod", sgd().rhod),
    ];
    let names = values.iter().flat_map(|(name, _)| ["B", "R", "G"].map(|c| format!("{name}_{c}")));
    let header: Vec<String> = ["note".into(), "material".into()].into_iter().chain(names).collect();
    let numbers: Vec<String> = values.iter().flat_map(|(_, v)| [v.z, v.x, v.y].map(|x| format!("{x:e}"))).collect();
    let row = |name: &str| format!("\"a, b\",{name},{}", numbers.join(","));
    format!("{}\n{}\n{}\n", header.join(","), row("first").replace("1e38", "2"), row("second"))
}

#[test]
fn tables_of_sgd_parameters_are_read_by_name() {
    assert_eq!(sgd_table::find(csv().as_bytes(), "second").unwrap(), sgd());
    assert_ne!(sgd_table::find(csv().as_bytes(), "first").unwrap(), sgd());
    let message = |text: &str, name: &str| sgd_table::find(text.as_bytes(), name).unwrap_err().to_string();
    assert_eq!(message(&csv(), "third"), "line 1: name: expected first, second, got `third`");
    let text = csv().replacen("lambda_R", "lambda_X", 1);
    assert_eq!(message(&text, "first"), "line 1: lambda_R: expected a column of that name, got none");
    assert_eq!(message("", "first"), "line 1: material: expected a column of that name, got none");
    let text = csv().replacen("second,", "second,1,", 1);
    assert_eq!(message(&text, "second"), "line 3: row: expected 35 fields, got 36 fields");
    let text = csv().replacen("1e38", "much", 1);
    assert_eq!(message(&text, "second"), "line 3: c_G: expected a number, got `much`");
    let text = csv().replacen("1e38", "inf", 1);
    assert!(message(&text, "second").starts_with("line 3: sgd.c: expected finite numbers >= 0, got"));
    let broken = [csv().as_bytes(), b"\xff\xfe,x"].concat();
    assert!(sgd_table::find(&broken, "third").unwrap_err().line >= 3);
}

#[test]
fn blinn_phong_normals_fill_the_projected_area_and_keep_energy() {
    for exponent in [0.0, 1.0, 20.0, 300.0, 10_000.0] {
        let model = BlinnPhong { exponent, specular: DVec3::ONE, albedo: DVec3::ZERO };
        model.validate().unwrap();
        let sum = over_hemisphere([4000, 1], |h| model.distribution(h) * h.z);
        assert!((sum - 1.0).abs() < 1e-5, "exponent {exponent}: {sum}");
        for degrees in [0.0, 30.0, 60.0, 80.0, 89.0] {
            let energy = albedo(&model, viewer(degrees), [1500, 300]);
            println!("blinn-phong {exponent} at {degrees}: {energy:.4}");
            assert!(energy < 1.001, "exponent {exponent} at {degrees}: {energy}");
            // Nothing to mask: a white surface, but for light that leaves by a second bounce.
            assert!(exponent < 300.0 || degrees > 60.0 || energy > 0.95, "exponent {exponent} at {degrees}: {energy}");
        }
        for i in 0..2000 {
            let (wi, wo) = pair(i);
            let (a, b) = (model.evaluate(wi, wo).x, model.evaluate(wo, wi).x);
            assert!(a.is_finite() && (a - b).abs() <= 1e-12 * a, "{wi} {wo}");
        }
    }
    // By hand at the normal: specular (e + 2) / (2 pi) / 4 + albedo / pi.
    let model = BlinnPhong { exponent: 10.0, specular: DVec3::splat(0.5), albedo: DVec3::splat(0.2) };
    assert!((model.evaluate(DVec3::Z, DVec3::Z).x - (0.5 * 12.0 / (8.0 * PI) + 0.2 / PI)).abs() < 1e-12);
    // 60 degrees apart in azimuth at 45: h at the cosine sqrt(1/2) / cos(d); D and both cosines by hand.
    let (wi, wo) = (DVec3::new(0.5f64.sqrt(), 0.0, 0.5f64.sqrt()), DVec3::new(0.0, 0.5f64.sqrt(), 0.5f64.sqrt()));
    let cos_h = (0.5f64 / 0.75).sqrt();
    let expected = 0.5 * 12.0 / TAU * cos_h.powi(10) / (4.0 * 0.5) + 0.2 / PI;
    assert!((model.evaluate(wi, wo).x - expected).abs() < 1e-12, "{} for {expected}", model.evaluate(wi, wo));
    let refused = |exponent| BlinnPhong { exponent, ..model }.validate().unwrap_err().to_string();
    assert!(refused(-1.0).starts_with("blinn_phong.exponent: expected") && refused(f64::NAN).contains("got NaN"));
    assert!(BlinnPhong { albedo: DVec3::splat(1.5), ..model }.validate().is_err());
}

fn crossed() -> Vmf {
    let lobe = |x: f64, y: f64, kappa, weight| Lobe { mu: DVec3::new(x, y, 1.0), kappa, weight };
    Vmf::new(&[lobe(0.5, 0.2, 80.0, 0.5), lobe(-0.3, 0.0, 300.0, 0.2), lobe(0.0, 0.0, 30.0, 0.1)]).unwrap()
}

#[test]
fn vmf_normals_fill_their_weight() {
    let along = |kappa| Vmf::new(&[Lobe { mu: DVec3::Z * 3.0, kappa, weight: 0.7 }]).unwrap();
    for (mixture, weight) in [(crossed(), 0.8), (along(20.0), 0.7), (along(1e4), 0.7)] {
        let sum = over_hemisphere([3000, 720], |h| mixture.distribution(h) * h.z);
        assert!((sum - weight).abs() < 2e-4, "{sum} for {weight}");
    }
    // Balanced mixtures keep energy.
    let side = |x: f64| Lobe { mu: DVec3::new(x, 0.0, 1.0), kappa: 80.0, weight: 0.4 };
    for mixture in [along(20.0), along(1e4), Vmf::new(&[side(0.3), side(-0.3)]).unwrap()] {
        let weight: f64 = mixture.lobes().iter().map(|l| l.weight).sum();
        for degrees in [0.0, 30.0, 60.0, 80.0] {
            let energy = albedo(&mixture, viewer(degrees), [1500, 600]);
            println!("vmf of weight {weight} at {degrees}: {energy:.4}");
            assert!(energy < 1.001 * weight && energy > 0.8 * weight, "at {degrees}: {energy} of {weight}");
        }
    }
    // The documented excess of broad lobes.
    for (kappa, excess) in [(3.0, 0.02), (1.0, 0.36)] {
        let sum = over_hemisphere([3000, 1], |h| along(kappa).distribution(h) * h.z) / 0.7;
        assert!((sum - 1.0 - excess).abs() < 0.005, "kappa {kappa}: {sum}");
    }
    // At a lobe's centre: weight kappa / (2 pi) over the mean cosine.
    let peak = 0.7 * 20.0 / TAU / vmf::mean_cosine(20.0);
    assert!((along(20.0).distribution(DVec3::Z) / peak - 1.0).abs() < 1e-12);
}

#[test]
fn vmf_is_reciprocal_and_its_rings_are_its_mean_over_turns() {
    let mixture = crossed();
    assert!(!mixture.isotropic());
    for i in 0..300 {
        let (wi, wo) = pair(i);
        let (a, b) = (mixture.evaluate(wi, wo).x, mixture.evaluate(wo, wi).x);
        assert!((a - b).abs() <= 1e-12 * a, "{wi} {wo}");
        const TURNS: u32 = 720;
        let sum: f64 = (0..TURNS)
            .map(|t| {
                let turn = DVec2::from_angle(TAU * f64::from(t) / f64::from(TURNS));
                mixture.evaluate(turned(turn, wi), turned(turn, wo)).x
            })
            .sum();
        let (ring, mean) = (mixture.mean_over_turns(wi, wo).x, sum / f64::from(TURNS));
        assert!((ring - mean).abs() <= 1e-6 * mean + 1e-30, "{wi} {wo}: {ring} for {mean}");
    }
    let lobe = |mu: DVec3| Vmf::new(&[Lobe { mu, kappa: 50.0, weight: 1.0 }]).unwrap();
    assert!(lobe(DVec3::Z).isotropic() && !lobe(DVec3::new(0.1, 0.0, 1.0)).isotropic());
}

#[test]
fn vmf_refuses_what_is_no_mixture_of_normals() {
    let good = Lobe { mu: DVec3::Z, kappa: 10.0, weight: 1.0 };
    let refused = |lobes: &[Lobe]| Vmf::new(lobes).unwrap_err().to_string();
    assert_eq!(refused(&[]), "vmf: expected 1 to 8 lobes, got 0");
    assert_eq!(refused(&[good; 9]), "vmf: expected 1 to 8 lobes, got 9");
    assert!(refused(&[good, Lobe { mu: DVec3::ZERO, ..good }]).starts_with("vmf.1.mu: expected"));
    assert!(refused(&[Lobe { kappa: -1.0, ..good }]).starts_with("vmf.0.kappa: expected"));
    assert!(refused(&[Lobe { weight: f64::NAN, ..good }]).starts_with("vmf.0.weight: expected"));
    assert!(refused(&[Lobe { weight: 0.0, ..good }]).starts_with("vmf: expected weights"));
    for lobe in [Lobe { mu: DVec3::X, ..good }, Lobe { mu: -DVec3::Z, ..good }, Lobe { kappa: 0.0, ..good }] {
        assert!(refused(&[lobe]).contains("projected area"), "{lobe:?}");
    }
}

#[test]
fn turned_tables_interpolate_round_the_circle() {
    let flat = |v: f64| Arc::new(MerlTable::from_fn(|_, _, _| DVec3::splat(v)));
    let values = [1.0, 2.0, 5.0, 3.0];
    for symmetry in [1, 2] {
        let tables = TurnedTables::new(values.map(flat).to_vec(), symmetry).unwrap();
        let at = |x: f64| {
            let angle = x * TAU / (4.0 * f64::from(symmetry));
            let (wi, wo) = (DVec3::new(0.6, 0.1, 0.79).normalize(), DVec3::new(0.6, -0.1, 0.79).normalize());
            let turn = DVec2::from_angle(angle);
            tables.evaluate(turned(turn, wi), turned(turn, wo)).x
        };
        for (x, expected) in [(0.0, 1.0), (1.0, 2.0), (1.5, 3.5), (3.25, 2.5), (-0.75, 2.5), (4.5, 1.5), (-3.5, 1.5)] {
            assert!((at(x) - expected).abs() < 1e-6, "symmetry {symmetry} at {x}: {}", at(x));
        }
        assert!((tables.mean_over_turns(DVec3::Z, DVec3::Z).x - 2.75).abs() < 1e-6);
    }
    assert!(TurnedTables::new(vec![], 1).is_err() && TurnedTables::new(vec![flat(1.0)], 0).is_err());
}

#[test]
fn an_anisotropic_model_bakes_into_turned_tables() {
    // The sharpest lobe is 3.3 degrees wide and 17 off the normal: 11 degrees of azimuth, half of what 16 nodes resolve.
    let exact = crossed();
    let baked = |count: u32| {
        let angle = |i: u32| TAU * f64::from(i) / f64::from(count);
        let node = |i| Arc::new(MerlTable::bake_turned(angle(i), |wi, wo| exact.evaluate(wi, wo)));
        let tables = TurnedTables::new((0..count).map(node).collect(), 1).unwrap();
        let error = bake::error(&exact, &tables, 20_000);
        println!("crossed lobes in {count} turned tables: {error:?}");
        (tables, error.rms)
    };
    let (coarse, (tables, fine)) = (baked(8).1, baked(16));
    assert!(fine < 0.15 && fine < 0.5 * coarse, "{coarse} {fine}");
    for i in 0..2000 {
        let (wi, wo) = pair(i);
        let (a, b) = (tables.evaluate(wi, wo).x, tables.evaluate(wo, wi).x);
        assert!((a - b).abs() <= 1e-9 * a, "{wi} {wo}: {a} and {b}");
    }
    let model = Model::Turned(Arc::new(tables));
    assert!(!model.isotropic() && model.mean_over_turns(DVec3::Z, DVec3::Z).is_finite());
}
