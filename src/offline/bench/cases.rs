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
    /// A built-in (synthetic) reflectance.
    pub reflectance: &'static str,
    /// A built-in environment, or the stem of a fetched one.
    pub environment: &'static str,
    /// Whether the quick preset has it.
    #[serde(skip)]
    pub quick: bool,
}

/// Name, scene, the scene's material, and the fetched file that it needs, with the name that `scripts/fetch-assets` knows.
const MESHES: [(&str, &str, &str, Option<[&str; 2]>); 6] = [
    ("sphere", "sphere", "paint", None),
    ("bumpy-sphere", "bumpy-sphere", "paint", None),
    ("torus-knot", "torus-knot", "paint", None),
    ("bunny", "scenes/bunny-city.toml", "bunny", Some(["bunny.obj", "bunny"])),
    ("dragon", "scenes/dragon.toml", "dragon", Some(["dragon.ply.gz", "dragon"])),
    ("armadillo", "scenes/armadillo.toml", "armadillo", Some(["armadillo.off", "armadillo"])),
];
/// Built-in environments that cases use; the others are fetched.
const BUILTIN_ENVIRONMENTS: [&str; 2] = ["sun-sky", "studio"];
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

/// Every case of both halves, or those of the quick preset.
pub fn all(quick: bool) -> Vec<(Half, Case)> {
    let half = |half: Half, cases: &[Case]| cases.iter().map(|c| (half, *c)).collect::<Vec<_>>();
    let mut cases = half(Half::Tuning, &TUNING);
    cases.extend(half(Half::Judged, &JUDGED));
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
            "mirror-metal" => Gloss::Mirror,
            "rough" | "satin" => Gloss::Rough,
            _ => Gloss::Glossy,
        }
    }

    /// Whether the mesh has no bumps of the size of a few pixels.
    pub fn is_smooth(&self) -> bool {
        matches!(self.mesh, "sphere" | "torus-knot" | "bunny")
    }

    /// The scene under `root` (the repository), or the names of what `scripts/fetch-assets` has to fetch for it.
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
        if !missing.is_empty() {
            return Ok(Err(missing));
        }
        // A path in an override is relative to the scene file, unless it is absolute.
        let map = std::path::absolute(&map).unwrap_or(map).to_string_lossy().into_owned();
        let environment = match builtin {
            true => ("environment.builtin".to_string(), self.environment.to_string()),
            // As a TOML literal, for backslashes.
            false => ("environment.map".to_string(), format!("'{map}'")),
        };
        let reflectance = (format!("materials.{material}.reflectance.builtin"), self.reflectance.to_string());
        let scene = if file.is_some() { root.join(scene).to_string_lossy().into_owned() } else { scene.to_string() };
        Ok(Ok(Scene::load(&scene, &[environment, reflectance])?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn halves_share_no_surface_and_quick_needs_no_files() {
        let surfaces = |cases: &[Case]| cases.iter().map(|c| (c.mesh, c.reflectance)).collect::<BTreeSet<_>>();
        assert_eq!(surfaces(&TUNING).intersection(&surfaces(&JUDGED)).count(), 0);
        let names: BTreeSet<_> = all(false).iter().map(|(_, c)| c.name()).collect();
        assert_eq!(names.len(), TUNING.len() + JUDGED.len());
        // Each half has every mesh, every reflectance and every environment.
        for cases in [&TUNING[..], &JUDGED[..]] {
            let count = |of: fn(&Case) -> &'static str| cases.iter().map(of).collect::<BTreeSet<_>>().len();
            assert_eq!([count(|c| c.mesh), count(|c| c.reflectance), count(|c| c.environment)], [6, 5, 4]);
        }
        let nowhere = Path::new("/nowhere");
        for (_, case) in all(true) {
            let world = case.scene(nowhere).unwrap().unwrap().resolve().unwrap();
            assert_eq!((world.name.as_str(), world.objects.len()), (case.mesh, 1));
        }
        let armadillo = Case { environment: "city", ..case("armadillo", "rough", "") };
        assert_eq!(armadillo.scene(nowhere).unwrap().unwrap_err(), ["armadillo", "environments"]);
    }
}
