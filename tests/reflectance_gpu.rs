//! Every kind of reflectance on the device against its f64 twin, over pairs of directions.

#[path = "support/chosen_device.rs"]
mod chosen_device;

use chosen_device::DEVICE;
use glam::{DVec2, DVec3, Vec3};
use passband::offline::headless::{Headless, Options};
use passband::offline::session::Session;
use passband::offline::world::{Camera, Material, World};
use passband::reflectance::{
    BlinnPhong, Ggx, ImportanceTable, Lobe, MerlTable, Model, Reflectance, Sgd, TurnedTables, Vmf, stand_in, turned,
};
use passband::sampling::sobol;
use passband::{Config, Requirements};
use passband_shader_compiler as shaders;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const PAIRS: u32 = 10_000;

/// Relative tolerance; the worst of all kinds was measured to be 6e-4, by the steepest lobe.
const TOLERANCE: f64 = 1e-3;

fn session(models: &[Model]) -> Session {
    let materials = models
        .iter()
        .enumerate()
        .map(|(i, m)| Material { name: i.to_string(), model: m.clone(), maps: Default::default() })
        .collect();
    let camera = Camera { position: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 };
    let world = World { materials, ..World::empty("probe", camera) };
    let config = Config::new([8, 8]);
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
    Session::new(headless, &world, &config).unwrap()
}

fn module(name: &str) -> Vec<u32> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let extra = Some(root.join("tests/glsl"));
    let options = shaders::Options { extra, only: vec!["tonemap".into()], ..shaders::Options::new(root) };
    let modules = shaders::compile_all(&options).unwrap();
    modules.into_iter().find(|m| m.name == name).unwrap().spirv
}

/// A table as the device holds it.
fn packed(table: &MerlTable) -> MerlTable {
    let (scale, entries) = table.packed();
    MerlTable::unpacked(scale, &entries)
}

fn turned_tables() -> TurnedTables {
    let lobe = |x: f64, y: f64| Lobe { mu: DVec3::new(x, y, 1.0), kappa: 20.0, weight: 0.4 };
    let vmf = Vmf::new(&[lobe(0.4, 0.1), lobe(-0.2, 0.5)]).unwrap();
    let nodes = (0..7).map(|i| Arc::new(MerlTable::bake_turned(TAU * f64::from(i) / 7.0, |wi, wo| vmf.evaluate(wi, wo))));
    TurnedTables::new(nodes.collect(), 1).unwrap()
}

/// Name, what is uploaded, and the twin to compare with.
fn cases() -> Vec<(String, Model, Box<dyn Reflectance>)> {
    let mut cases: Vec<(String, Model, Box<dyn Reflectance>)> = Vec::new();
    for name in stand_in::names() {
        let table = stand_in::table(name).unwrap();
        let twin = Box::new(packed(&table));
        cases.push(((*name).into(), Model::Table(Arc::new(table)), twin));
    }
    let sgd = Sgd::from_rows([0.05, 0.6, 0.15, 0.7, 0.35, -0.2, 5.5, 2.5, 0.4, 9.0, 0.1].map(|v| [v, v * 0.9, v * 1.05]));
    let table = sgd.bake();
    let twin = Box::new(packed(&table));
    cases.push(("sgd".into(), Model::Table(Arc::new(table)), twin));
    for alpha in [0.03, 0.3] {
        let ggx = Ggx { alpha, f0: DVec3::new(0.9, 0.5, 0.04), albedo: DVec3::splat(0.3) };
        cases.push((format!("ggx {alpha}"), Model::Ggx(ggx), Box::new(ggx)));
    }
    for exponent in [0.0, 1.0, 37.5, 2000.0, 50_000.0] {
        let model = BlinnPhong { exponent, specular: DVec3::new(0.9, 0.5, 0.04), albedo: DVec3::new(0.0, 0.1, 0.3) };
        cases.push((format!("blinn-phong {exponent}"), Model::BlinnPhong(model), Box::new(model)));
    }
    let lobe = |mu, kappa, weight| Lobe { mu, kappa, weight };
    let tilted = |x: f64, y: f64| DVec3::new(x, y, 1.0);
    let mixtures = [
        ("one lobe", vec![lobe(DVec3::Z, 100.0, 0.8)]),
        ("sharp lobe", vec![lobe(DVec3::Z, 20_000.0, 0.8)]),
        ("crossed", vec![lobe(tilted(1.0, 0.0), 128.0, 0.4), lobe(tilted(-1.0, 0.0), 128.0, 0.4)]),
        (
            "eight lobes",
            (0..8)
                .map(|i| lobe(tilted(0.3 * f64::from(i).cos(), 0.3 * f64::from(i).sin()), 30.0 + f64::from(i * i), 0.1))
                .collect(),
        ),
    ];
    for (name, lobes) in mixtures {
        let vmf = Vmf::new(&lobes).unwrap();
        cases.push((name.into(), Model::Vmf(Arc::new(vmf.clone())), Box::new(vmf)));
    }
    let tables = turned_tables();
    let scale = tables.nodes().iter().map(|t| t.packing_scale()).fold(1.0, f32::max);
    let nodes = tables.nodes().iter().map(|t| Arc::new(MerlTable::unpacked(scale, &t.packed_at(scale)))).collect();
    let twin = TurnedTables::new(nodes, tables.symmetry()).unwrap();
    cases.push(("turned tables".into(), Model::Turned(Arc::new(tables)), Box::new(twin)));
    cases
}

/// A pair, the viewer in the half plane y = 0, x >= 0: even ones anywhere, odd ones about half vectors near the normal.
fn pair(i: u32) -> Option<(Vec3, Vec3, f32)> {
    let [a, b] = sobol::random(i, 61).map(sobol::to_unit);
    let [c, d] = sobol::random(i, 62).map(sobol::to_unit);
    let cos_o = 0.02 + 0.98 * a;
    let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
    let wi = if i.is_multiple_of(2) {
        let (z, phi) = (b, TAU * c);
        DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
    } else {
        let (theta, phi) = (0.5 * b.powi(3), TAU * c);
        let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        2.0 * wo.dot(h) * h - wo
    };
    // A half vector that single precision cannot tell from the normal has no azimuth.
    let h = (wi + wo).normalize();
    (wi.z > 0.01 && h.x.hypot(h.y) > 1e-4).then(|| (wi.as_vec3(), wo.as_vec3(), (d * TAU) as f32))
}

#[test]
fn the_device_agrees_with_the_twins() {
    let cases = cases();
    let models: Vec<_> = cases.iter().map(|c| c.1.clone()).collect();
    let mut session = session(&models);
    let words = module("reflectance_pairs.comp");
    let pairs: Vec<_> = (0..).filter_map(pair).take(PAIRS as usize).collect();
    for (id, (name, model, twin)) in cases.iter().enumerate() {
        let input: Vec<[u32; 4]> = pairs
            .iter()
            .flat_map(|(wi, wo, turn)| {
                let bits = |v: Vec3, w: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w];
                [bits(*wi, id as u32), bits(*wo, turn.to_bits())]
            })
            .collect();
        let output = session.probe(&words, &input).unwrap();
        let importance = ImportanceTable::build(model);
        let peak = pairs.iter().map(|(wi, wo, turn)| value(twin.as_ref(), *wi, *wo, *turn).max_element()).fold(0.0, f64::max);
        let (mut worst, mut at, mut sampled) = (0.0, String::new(), 0.0f64);
        for ((pair, out), entries) in pairs.iter().zip(output.chunks_exact(2)).zip(input.chunks_exact(2)) {
            let (wi, wo, turn) = *pair;
            let expected = value(twin.as_ref(), wi, wo, turn);
            let got = DVec3::new(out[0][0].into(), out[0][1].into(), out[0][2].into());
            // Far below the peak nothing is seen; and a table's entries end at 2^-25 of its factor.
            let floor = 1e-7 * peak;
            for channel in 0..3 {
                let error = (got[channel] - expected[channel]).abs() / (expected[channel] + floor);
                if error > worst || !error.is_finite() {
                    worst = error;
                    at = format!("{wi} {wo} turned {turn}: {got} for {expected}");
                }
            }
            // The importance table of the same material: the half vector that two numbers give, and its smooth density.
            let u = [entries[0][0] ^ entries[1][2], entries[0][1] ^ entries[1][0]].map(sobol::to_unit);
            let (h, pdf) = importance.half_vector(wo.z.into(), u);
            let drawn = DVec3::new(out[1][0].into(), out[1][1].into(), out[1][2].into());
            if drawn.distance(h) < 1e-4 {
                sampled += 1.0;
                assert!((f64::from(out[1][3]) / pdf - 1.0).abs() < 1e-3, "{name}: density {} for {pdf}", out[1][3]);
            }
            let density = importance.density(wo.z.into(), (wi + wo).as_dvec3().normalize());
            let off = (f64::from(out[0][3]) / density - 1.0).abs();
            assert!(off < 5e-3, "{name} {wi} {wo}: smooth density {} for {density}", out[0][3]);
        }
        let sampled = sampled / pairs.len() as f64;
        println!("{name}: worst {worst:.2e}; {:.2} % of half vectors drawn alike", sampled * 100.0);
        // Between cells that differ by noise, the last bits of a grazing angle matter: 3.2e-2 measured.
        let tolerance = if name == "noisy-paint" { 0.05 } else { TOLERANCE };
        assert!(worst < tolerance, "{name}: {worst:.2e} at {at}");
        // View cosines and numbers that rounding puts into a neighbouring node or cell.
        assert!(sampled > 0.999, "{name}: {sampled}");
    }
    assert_eq!(session.messages(), Vec::<String>::new());
}

fn value(twin: &dyn Reflectance, wi: Vec3, wo: Vec3, turn: f32) -> DVec3 {
    let turn = DVec2::from_angle(turn.into());
    twin.evaluate(turned(turn, wi.as_dvec3().normalize()), turned(turn, wo.as_dvec3().normalize()))
}

#[test]
fn a_turn_matters_for_kinds_that_are_not_isotropic_and_for_no_other() {
    for (name, _, twin) in cases() {
        let wi = DVec3::new(0.3, 0.2, 0.8).normalize().as_vec3();
        let wo = DVec3::new(0.5, 0.0, 0.8).normalize().as_vec3();
        let (a, b) = (value(twin.as_ref(), wi, wo, 0.0), value(twin.as_ref(), wi, wo, (PI / 3.0) as f32));
        let difference = (a - b).abs().max_element() / a.max_element();
        assert_eq!(difference > 1e-3, !twin.isotropic(), "{name}: {a} and {b}");
    }
}
