//! Every GPU formula has an f64 twin: each is run on the device over random and edge inputs and compared with its twin.

mod angles;
mod bandwidth;
#[path = "../support/chosen_device.rs"]
mod chosen_device;
mod environment;
mod materials;
mod sampling;
#[path = "../support/statistics.rs"]
mod statistics;
mod vmf;

use chosen_device::DEVICE;
use glam::{DVec3, Vec3};
use passband::offline::headless::{Headless, Options};
use passband::offline::session::Session;
use passband::offline::world::{Camera, EnvironmentLight, Material, World};
use passband::reflectance::{Ggx, Model};
use passband::sampling::sobol;
use passband::{Config, Requirements};
use passband_shader_compiler as compiler;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Random inputs of each comparison.
const COUNT: u32 = 20_000;

/// The probes of `tests/glsl` by name, compiled with the repository's own includes.
fn module(name: &str) -> &'static [u32] {
    static MODULES: OnceLock<BTreeMap<String, Vec<u32>>> = OnceLock::new();
    let modules = MODULES.get_or_init(|| {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let extra = Some(root.join("tests/glsl"));
        // At least one of the repository's own stages has to be named; the cheapest is.
        let options = compiler::Options { extra, only: vec!["classify".into()], ..compiler::Options::new(root) };
        let modules = compiler::compile_all(&options).unwrap_or_else(|e| panic!("{e}"));
        modules.into_iter().map(|m| (m.name, m.spirv)).collect()
    });
    modules.get(&format!("{name}.comp")).unwrap_or_else(|| panic!("tests/glsl/{name}.comp does not exist"))
}

/// A device with materials and an environment, under the validation layer.
struct Device(Session);

impl Device {
    fn new(models: Vec<Model>, environment: Option<EnvironmentLight>) -> Self {
        let config = Config::new([8, 8]);
        let options = Options { device: Some(DEVICE.into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(&config)).unwrap_or_else(|e| panic!("{e}"));
        let camera = Camera { position: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 };
        let material = |(i, model): (usize, Model)| Material { name: i.to_string(), model, maps: Default::default() };
        let materials = models.into_iter().enumerate().map(material).collect();
        let world = World { environment, materials, ..World::empty("twins", camera) };
        Self(Session::new(headless, &world, &config).unwrap_or_else(|e| panic!("{e}")))
    }

    /// A device for formulas that read nothing.
    fn bare() -> Self {
        Self::new(vec![Model::Ggx(Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO })], None)
    }

    /// Runs probe `name`; the validation layer must have nothing to say.
    fn probe(&mut self, name: &str, input: &[[u32; 4]]) -> Vec<[f32; 4]> {
        let output = self.0.probe(module(name), input).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(self.0.messages(), Vec::<String>::new(), "{name}");
        assert_eq!(output.len(), input.len(), "{name}");
        output
    }
}

/// Pair `i` of stream `seed`, in [0, 1).
fn unit(i: u32, seed: u32) -> [f64; 2] {
    sobol::random(i, seed).map(sobol::to_unit)
}

/// A unit direction as the device gets it.
fn rounded(w: DVec3) -> Vec3 {
    w.normalize().as_vec3()
}

/// Direction `i` of stream `seed`, uniform over the sphere.
fn direction(i: u32, seed: u32) -> Vec3 {
    let [a, b] = unit(i, seed);
    let (z, phi) = (1.0 - 2.0 * a, std::f64::consts::TAU * b);
    let s = (1.0 - z * z).sqrt();
    rounded(DVec3::new(s * phi.cos(), s * phi.sin(), z))
}

/// A vector and a word as an entry.
fn entry(v: Vec3, word: u32) -> [u32; 4] {
    [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word]
}

/// The largest value, and what it belongs to.
#[derive(Default)]
struct Worst(f64, String);

impl Worst {
    /// Errors that are not numbers count as infinite.
    fn add(&mut self, error: f64, what: impl FnOnce() -> String) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > self.0 {
            *self = Self(error, what());
        }
    }

    /// Asserts the stated bound, and shows what was measured.
    fn within(&self, name: &str, bound: f64) {
        println!("{name}: {:.2e} of {bound:.0e}, at {}", self.0, self.1);
        assert!(self.0 <= bound, "{name}: {:.3e}, above {bound:e}, at {}", self.0, self.1);
    }
}
