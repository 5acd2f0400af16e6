use super::*;
use crate::frequency::environment::EPS;
use crate::reflectance::{BlinnPhong, Ggx, Lobe, TurnedTables, Vmf, stand_in};
use std::sync::Arc;

fn ggx(alpha: f64, albedo: f64) -> Model {
    Model::Ggx(Ggx { alpha, f0: DVec3::ONE - albedo, albedo: DVec3::splat(albedo) })
}

/// The bandwidth at the mirror direction, over the analytic one.
fn ratio(model: &Model, degrees: f64) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let (wi, wo) = (DVec3::new(-sine, 0.0, cosine), DVec3::new(sine, 0.0, cosine));
    LobeBandwidth::build(model, EPS).at(wi, wo) / analytic(model, cosine).unwrap().bandwidth
}

#[test]
fn gaussian_lobes_read_what_theory_says() {
    for concentration in [10.0, 100.0, 1000.0, 1e5] {
        let phong = BlinnPhong { exponent: concentration, specular: DVec3::ONE, albedo: DVec3::ZERO };
        let lobe = Lobe { mu: DVec3::Z, kappa: concentration, weight: 1.0 };
        for model in [Model::BlinnPhong(phong), Model::Vmf(Arc::new(Vmf::new(&[lobe]).unwrap()))] {
            for degrees in [10.0, 30.0, 45.0] {
                let ratio = ratio(&model, degrees);
                println!("{concentration} at {degrees}: {ratio:.2}");
                assert!((0.95..1.8).contains(&ratio), "{concentration} at {degrees}: {ratio}");
            }
        }
    }
}

#[test]
fn ggx_lobes_read_a_little_more() {
    for alpha in [0.01, 0.03, 0.15, 0.45] {
        for degrees in [10.0, 30.0, 45.0, 60.0] {
            let ratio = ratio(&ggx(alpha, 0.0), degrees);
            println!("alpha {alpha} at {degrees}: {ratio:.2}");
            assert!((0.9..2.5).contains(&ratio), "alpha {alpha} at {degrees}: {ratio}");
        }
    }
}

/// The tables that the renderer shades read as the lobes that they were made of.
#[test]
fn tables_read_as_their_lobes() {
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let mirror = [DVec3::new(-sine, 0.0, cosine), DVec3::new(sine, 0.0, cosine)];
    let mut last = f64::INFINITY;
    for (name, alpha) in [("mirror-metal", 0.03), ("metallic-paint", 0.15), ("rough", 0.45)] {
        let table = LobeBandwidth::build(&Model::Table(Arc::new(stand_in::table(name).unwrap())), EPS);
        let lobe = LobeBandwidth::build(&ggx(alpha, 0.0), EPS).at(mirror[0], mirror[1]);
        let got = table.at(mirror[0], mirror[1]);
        println!("{name}: {got:.2}, its first lobe {lobe:.2} cycles/radian");
        assert!(got < last && got < 1.2 * lobe, "{name}: {got} {lobe}");
        assert!(name == "rough" || got > 0.7 * lobe, "{name}: a weak highlight over a diffuse base counts less");
        last = got;
    }
}

#[test]
fn diffuse_is_slow_and_black_nothing() {
    let matt = BlinnPhong { exponent: 100.0, specular: DVec3::ZERO, albedo: DVec3::ONE };
    let matt = LobeBandwidth::build(&Model::BlinnPhong(matt), EPS);
    // The cosine's kink is at the horizon, where nothing shines; what counts is the mean under the cosine.
    let seen = DVec3::new(0.6, 0.0, 0.8);
    println!("diffuse: {} at the zenith, {} at 60 degrees", matt.at(DVec3::Z, seen), matt.at(DVec3::new(0.0, 0.866, 0.5), seen));
    assert!(matt.at(DVec3::Z, seen) < 0.6 && matt.at(DVec3::new(0.0, 0.866, 0.5), seen) < 1.2 && matt.at(DVec3::Z, seen) > 0.0);
    let black = Model::Ggx(Ggx { alpha: 0.1, f0: DVec3::ZERO, albedo: DVec3::ZERO });
    assert_eq!(analytic(&black, 0.5), None);
    assert_eq!(LobeBandwidth::build(&ggx(0.3, 0.2), EPS), LobeBandwidth::build(&ggx(0.3, 0.2), EPS));
}

#[test]
fn turning_the_surface_takes_the_worst() {
    let [fine, dull] = ["mirror-metal", "rough"].map(|name| Arc::new(stand_in::table(name).unwrap()));
    let [of_fine, of_dull] = [&fine, &dull].map(|t| LobeBandwidth::build(&Model::Table(t.clone()), EPS));
    let turned = LobeBandwidth::build(&Model::Turned(Arc::new(TurnedTables::new(vec![fine, dull], 1).unwrap())), EPS);
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let at = |b: &LobeBandwidth| b.at(DVec3::new(-sine, 0.0, cosine), DVec3::new(sine, 0.0, cosine));
    assert!(at(&turned) >= 0.8 * at(&of_fine) && at(&turned) > 2.0 * at(&of_dull), "{}", at(&turned));
}

#[test]
fn directions_and_texels_belong_together() {
    for i in 0..SLICE * SLICE {
        let (x, y) = (i % SLICE, i / SLICE);
        let square = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / SLICE as f64;
        let Some(wi) = direction(square) else { continue };
        assert!((wi.length() - 1.0).abs() < 1e-12 && wi.z > 0.0);
        let theta = view_angle(i % SIDE);
        // Both turned alike.
        let turn = DVec2::from_angle(i as f64);
        let wo = turned(turn, DVec3::new(theta.sin(), 0.0, theta.cos()));
        let [column, row] = texel(turned(turn, wi), wo);
        assert_eq!([column, row], [i % SIDE * SIDE + x / SIDE, y / SIDE]);
    }
    assert_eq!(texel(DVec3::Z, DVec3::Z), [SIDE / 2, SIDE / 2]);
}

#[test]
fn components_lose_less_the_more_there_are() {
    let bandwidth = LobeBandwidth::build(&ggx(0.15, 0.1), EPS);
    let errors: Vec<f64> = (0..=SIDE).map(|k| bandwidth.compressed(k).1).collect();
    println!("{errors:.3?}");
    assert!(errors.windows(2).all(|w| w[1] <= w[0] + 1e-9) && errors[0] > 0.05 && errors[4] < 0.15 && errors[SIDE - 1] < 1e-6);
    for share in [0.5, 0.95, 0.999] {
        let k = bandwidth.components_for(share);
        let lost = |k: usize| (errors[k] / errors[0]).powi(2);
        assert!(lost(k) <= 1.0 - share && lost(k - 1) > 1.0 - share, "{k} components for {share}");
    }
    // The error is the one that is there.
    let (kept, error) = bandwidth.compressed(3);
    let squares = |f: &dyn Fn(f32, f32) -> f32| -> f64 {
        kept.texels().iter().zip(bandwidth.texels()).map(|(&a, &b)| f64::from(f(a, b)).powi(2)).sum()
    };
    let measured = (squares(&|a, b| a - b) / squares(&|_, b| b)).sqrt();
    assert!(measured <= error * 1.001 && measured > 0.8 * error, "{measured} {error}");
}

#[test]
fn only_whole_strips_are_taken() {
    let texels = LobeBandwidth::build(&ggx(0.5, 0.5), EPS).texels().to_vec();
    assert!(LobeBandwidth::from_texels(texels.clone()).is_some());
    assert!(LobeBandwidth::from_texels(texels[1..].to_vec()).is_none());
    assert!(LobeBandwidth::from_texels(vec![f32::NAN; texels.len()]).is_none());
}
