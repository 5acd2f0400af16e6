//! The scenes of the benches, in two halves: what is fixed, such as defaults, is chosen on one and judged on the other.

use crate::offline::error::Result;
use crate::offline::scene::Scene;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What a scene is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Half {
    /// Defaults were chosen on it.
    Tuning,
    /// Only judged.
    Judged,
}

/// What a reflectance is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Gloss {
    /// Images of the light are seen in it.
    Mirror,
    /// Highlights are.
    Glossy,
    /// Neither.
    Rough,
}

/// A mesh in a reflectance under an environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Case {
    /// A mesh, by the name that its scene has here.
    pub mesh: &'static str,
    /// A built-in (synthetic) reflectance; `mirror`, GGX of alpha 0.01; `rgl-satin` or `rgl-brushed`, synthetic tables in
    /// RGL's format; or `several`, those of the scene.
    pub reflectance: &'static str,
    /// A built-in environment, or the stem of a fetched one.
    pub environment: &'static str,
    /// Whether the quick preset has it.
    #[serde(skip)]
    pub quick: bool,
}

/// Name, scene, the scene's material, and the fetched file that it needs, with the name that `scripts/fetch-assets` knows.
const MESHES: [(&str, &str, &str, Option<[&str; 2]>); 7] = [
    ("trio", "trio", "", None),
    ("sphere", "sphere", "paint", None),
    ("bumpy-sphere", "bumpy-sphere", "paint", None),
    ("torus-knot", "torus-knot", "paint", None),
    ("bunny", "scenes/bunny-city.toml", "bunny", Some(["bunny.obj", "bunny"])),
    ("dragon", "scenes/dragon.toml", "dragon", Some(["dragon.ply.gz", "dragon"])),
    ("armadillo", "scenes/armadillo.toml", "armadillo", Some(["armadillo.off", "armadillo"])),
];
/// Built-in environments that cases use; the others are fetched.
const BUILTIN_ENVIRONMENTS: [&str; 2] = ["sun-sky", "studio"];
/// Reflectances that are no built-in tables, as scene files have them.
const MODELS: [(&str, &str); 1] = [("mirror", "{ ggx = { alpha = 0.01, f0 = [0.95, 0.85, 0.6], albedo = 0 } }")];
/// Synthetic tables in RGL's format, isotropic and not (`tests/rgl.rs` writes them); by their path from the repository's root.
const RGL: [(&str, &str); 2] = [("rgl-satin", "tests/data/rgl/satin.bsdf"), ("rgl-brushed", "tests/data/rgl/brushed.bsdf")];
/// In the place of a reflectance, where a scene has several and keeps them.
const SEVERAL: &str = "several";
/// Where `scripts/fetch-assets` puts files, from the repository's root.
const ASSETS: &str = "assets";

const fn case(mesh: &'static str, reflectance: &'static str, environment: &'static str) -> Case {
    Case { mesh, reflectance, environment, quick: false }
}

const fn quick(mesh: &'static str, reflectance: &'static str, environment: &'static str) -> Case {
    Case { quick: true, ..case(mesh, reflectance, environment) }
}

/// Scenes on which defaults are chosen.
pub const TUNING: [Case; 10] = [
    quick("torus-knot", "mirror-metal", "studio"),
    case("sphere", "mirror-metal", "sun-sky"),
    case("sphere", "gloss-plastic", "forest"),
    case("torus-knot", "rough", "city"),
    case("bumpy-sphere", "metallic-paint", "studio"),
    case("bumpy-sphere", "rough", "sun-sky"),
    case("bunny", "satin", "forest"),
    case("bunny", "gloss-plastic", "sun-sky"),
    case("dragon", "rough", "studio"),
    case("armadillo", "mirror-metal", "city"),
];

/// Scenes on which they are judged: no pair of mesh and reflectance is in both halves.
pub const JUDGED: [Case; 12] = [
    quick("sphere", "metallic-paint", "sun-sky"),
    quick("torus-knot", "satin", "studio"),
    quick("bumpy-sphere", "mirror-metal", "studio"),
    case("bumpy-sphere", "mirror-metal", "city"),
    case("bumpy-sphere", "satin", "sun-sky"),
    case("sphere", "rough", "city"),
    case("torus-knot", "gloss-plastic", "forest"),
    case("bunny", "metallic-paint", "city"),
    case("bunny", "rough", "studio"),
    case("dragon", "gloss-plastic", "city"),
    case("armadillo", "satin", "studio"),
    case("armadillo", "rough", "sun-sky"),
];

/// Of the suite residual, those on which its defaults are chosen.
pub const RESIDUAL_TUNING: [Case; 2] = [quick("torus-knot", "mirror-metal", "studio"), case("sphere", "gloss-plastic", "forest")];

/// Of the suite residual, those on which they are judged: of the meshes and reflectances of each half above, and with what is hard for
/// lobes that stand for a reflectance, which is a mirror, noise, and several materials in a frame.
pub const RESIDUAL_JUDGED: [Case; 12] = [
    quick("sphere", "metallic-paint", "sun-sky"),
    quick("bumpy-sphere", "mirror-metal", "studio"),
    quick("torus-knot", "mirror", "sun-sky"),
    quick("torus-knot", "noisy-paint", "studio"),
    quick("trio", SEVERAL, "studio"),
    case("bumpy-sphere", "mirror", "city"),
    case("bunny", "metallic-paint", "city"),
    case("armadillo", "rough", "sun-sky"),
    case("torus-knot", "gloss-plastic", "forest"),
    case("bunny", "felt", "city"),
    case("torus-knot", "rgl-satin", "sun-sky"),
    case("bumpy-sphere", "rgl-brushed", "studio"),
];

/// Every case of both halves, or those of the quick preset.
pub fn all(quick: bool) -> Vec<(Half, Case)> {
    halves(&TUNING, &JUDGED, quick)
}

/// The same of the suite residual.
pub fn of_residual(quick: bool) -> Vec<(Half, Case)> {
    halves(&RESIDUAL_TUNING, &RESIDUAL_JUDGED, quick)
}

fn halves(tuning: &[Case], judged: &[Case], quick: bool) -> Vec<(Half, Case)> {
    let half = |half: Half, cases: &[Case]| cases.iter().map(|c| (half, *c)).collect::<Vec<_>>();
    let mut cases = half(Half::Judged, judged);
    cases.extend(half(Half::Tuning, tuning));
    cases.retain(|(_, c)| c.quick || !quick);
    cases
}

impl Case {
    /// Its row's name.
    pub fn name(&self) -> String {
        format!("{} {} {}", self.mesh, self.reflectance, self.environment)
    }

    /// What its reflectance is like.
    pub fn gloss(&self) -> Gloss {
        match self.reflectance {
            "mirror-metal" | "mirror" => Gloss::Mirror,
            "rough" | "satin" | "felt" => Gloss::Rough,
            _ => Gloss::Glossy,
        }
    }

    /// Whether the mesh has no bumps of the size of a few pixels.
    pub fn is_smooth(&self) -> bool {
        matches!(self.mesh, "sphere" | "torus-knot" | "bunny")
    }

    /// The scene under `root` (the repository), or the names of what `scripts/fetch-assets` has to fetch for it; none of what is
    /// in the repository itself.
    ///
    /// # Errors
    /// Of the scene file.
    pub fn scene(&self, root: &Path) -> Result<std::result::Result<Scene, Vec<&'static str>>> {
        let Some((_, scene, material, file)) = MESHES.iter().find(|m| m.0 == self.mesh) else { return Ok(Err(vec![self.mesh])) };
        let assets = root.join(ASSETS);
        let builtin = BUILTIN_ENVIRONMENTS.contains(&self.environment);
        let map: PathBuf = assets.join(format!("{}.exr", self.environment));
        let mut missing = Vec::new();
        missing.extend(file.filter(|[file, _]| !assets.join(file).is_file()).map(|[_, asset]| asset));
        missing.extend((!builtin && !map.is_file()).then_some("environments"));
        let table = RGL.iter().find(|(name, _)| *name == self.reflectance);
        if !missing.is_empty() || table.is_some_and(|(_, path)| !root.join(path).is_file()) {
            return Ok(Err(missing));
        }
        // A path in an override is relative to the scene file, unless it is absolute. As a TOML literal, for backslashes.
        let literal = |path: PathBuf| format!("'{}'", std::path::absolute(&path).unwrap_or(path).to_string_lossy());
        let environment = match builtin {
            true => ("environment.builtin".to_string(), self.environment.to_string()),
            false => ("environment.map".to_string(), literal(map)),
        };
        let model = MODELS.iter().find(|(name, _)| *name == self.reflectance).map(|(_, model)| model.to_string());
        let model = model.or_else(|| table.map(|(_, path)| format!("{{ rgl = {} }}", literal(root.join(path)))));
        let reflectance = match model {
            Some(model) => Some((format!("materials.{material}.reflectance"), model)),
            None if self.reflectance == SEVERAL => None,
            None => Some((format!("materials.{material}.reflectance.builtin"), self.reflectance.to_string())),
        };
        let overrides: Vec<_> = std::iter::once(environment).chain(reflectance).collect();
        let scene = if file.is_some() { root.join(scene).to_string_lossy().into_owned() } else { scene.to_string() };
        Ok(Ok(Scene::load(&scene, &overrides)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::Model;
    use std::collections::BTreeSet;

    #[test]
    fn halves_share_no_surface_and_quick_needs_no_files() {
        let surfaces = |cases: &[Case]| cases.iter().map(|c| (c.mesh, c.reflectance)).collect::<BTreeSet<_>>();
        let [tuning, judged] =
            [[&TUNING[..], &RESIDUAL_TUNING[..]], [&JUDGED[..], &RESIDUAL_JUDGED[..]]].map(|lists| surfaces(&lists.concat()));
        assert_eq!(tuning.intersection(&judged).count(), 0);
        let names: BTreeSet<_> = of_residual(false).iter().map(|(_, c)| c.name()).collect();
        assert_eq!(names.len(), RESIDUAL_TUNING.len() + RESIDUAL_JUDGED.len());
        let names: BTreeSet<_> = all(false).iter().map(|(_, c)| c.name()).collect();
        assert_eq!(names.len(), TUNING.len() + JUDGED.len());
        // Each half has every mesh, every reflectance and every environment.
        for cases in [&TUNING[..], &JUDGED[..]] {
            let count = |of: fn(&Case) -> &'static str| cases.iter().map(of).collect::<BTreeSet<_>>().len();
            assert_eq!([count(|c| c.mesh), count(|c| c.reflectance), count(|c| c.environment)], [6, 5, 4]);
        }
        let nowhere = Path::new("/nowhere");
        for (_, case) in all(true).into_iter().chain(of_residual(true)) {
            let world = case.scene(nowhere).unwrap().unwrap().resolve().unwrap();
            let count = if case.reflectance == SEVERAL { 3 } else { 1 };
            assert_eq!((world.name.as_str(), world.objects.len(), world.materials.len()), (case.mesh, count, count));
            if case.reflectance == "mirror" {
                assert!(matches!(world.materials[0].model, Model::Ggx(ggx) if ggx.alpha == 0.01));
            }
        }
        let armadillo = Case { environment: "city", ..case("armadillo", "rough", "") };
        assert_eq!(armadillo.scene(nowhere).unwrap().unwrap_err(), ["armadillo", "environments"]);
    }
}
