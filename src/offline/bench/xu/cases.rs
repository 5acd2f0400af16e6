//! The scenes of the suite, and the two lights under which each is measured.

use crate::offline::bench::report::Skipped;
use crate::offline::bench::suites::Preset;
use crate::offline::bench::xu::{Order, Suite, under};
use crate::offline::builtin;
use crate::offline::error::Result;
use crate::offline::scene::Scene;
use crate::offline::world::{EnvironmentLight, World};
use serde::Serialize;

/// What shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Light {
    /// The scene's points and directions: shading is exact.
    Point,
    /// The scene's environment.
    Environment,
}

/// A scene.
struct Case {
    name: &'static str,
    /// A scene file under the root, and the fetched file that it needs with the name that `scripts/fetch-assets` knows; else it
    /// is built in.
    file: Option<[&'static str; 3]>,
    /// Whether the quick preset has it.
    quick: bool,
}

const fn built_in(name: &'static str) -> Case {
    Case { name, file: None, quick: false }
}

const fn fetched(name: &'static str, scene: &'static str, file: &'static str, asset: &'static str) -> Case {
    Case { name, file: Some([scene, file, asset]), quick: false }
}

/// Single maps on planes, from which the aims are taken; then the paper's scenes as far as they can be had.
const CASES: [Case; 13] = [
    built_in("checker-plane"),
    Case { quick: true, ..built_in("cloth-plane") },
    Case { quick: true, ..built_in("bumps-plane") },
    built_in("disk-plane"),
    built_in("dunes-plane"),
    built_in("flake-plane"),
    built_in("atlas-plane"),
    built_in("microgeometry"),
    built_in("pillow"),
    built_in("tablecloth"),
    built_in("hall"),
    fetched("bumpy-bunny", "scenes/bumpy-bunny.toml", "assets/bunny.obj", "bunny"),
    fetched("dragon-normals", "scenes/dragon-normals.toml", "assets/dragon_res3.ply.gz", "dragon"),
];

/// A plane of [`TAN`] further away: its maps repeat so many times as often.
struct Distance {
    scene: &'static str,
    times: u32,
    /// Whether the quick preset has it.
    quick: bool,
}

const fn far(scene: &'static str, times: u32, quick: bool) -> Distance {
    Distance { scene, times, quick }
}

/// The kinds of surface of Tan et al. 2005: a carved disk in several zooms, armour of hemispherical scales at two resolutions, and
/// dunes at several distances.
const TAN: [Distance; 8] = [
    far("disk-plane", 1, true),
    far("disk-plane", 2, false),
    far("disk-plane", 4, false),
    far("bumps-plane", 1, true),
    far("bumps-plane", 4, false),
    far("dunes-plane", 1, true),
    far("dunes-plane", 3, false),
    far("dunes-plane", 8, false),
];

/// The environment of scenes without one.
const ENVIRONMENT: &str = "sun-sky";

/// The scenes of the order's preset; those that lack files are `skipped`.
pub(super) fn scenes(order: &Order, skipped: &mut Vec<Skipped>) -> Result<Vec<Scene>> {
    let mut scenes = Vec::new();
    if order.suite == Suite::Tan {
        return TAN.iter().filter(|case| case.quick || order.preset == Preset::Full).map(Distance::scene).collect();
    }
    for case in CASES.iter().filter(|case| case.quick || order.preset == Preset::Full) {
        match case.file {
            None => scenes.push(Scene::load(case.name, &[])?),
            Some([scene, file, _]) if order.root.join(file).is_file() => {
                scenes.push(Scene::load(&under(&order.root, scene), &[])?);
            }
            Some([_, _, asset]) => skipped.push(Skipped { scene: case.name.into(), needs: vec![asset] }),
        }
    }
    Ok(scenes)
}

impl Distance {
    fn scene(&self) -> Result<Scene> {
        let near = Scene::load(self.scene, &[])?;
        if self.times == 1 {
            return Ok(near);
        }
        let [u, v] = near.resolve()?.materials.first().map_or([1.0; 2], |m| m.maps.tiling.map(|t| t * self.times as f32));
        let tiling = ("materials.surface.tiling".to_string(), format!("[{u}, {v}]"));
        Ok(Scene::load(self.scene, &[tiling])?.called(&format!("{} x{}", self.scene, self.times)))
    }
}

impl Light {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Point, Self::Environment];

    /// As reports call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Environment => "environment",
        }
    }

    /// `world` with nothing else shining; without such a light of its own, with one that all can have: a point that is mirrored
    /// at the vertical through the camera's target, or sun and sky.
    ///
    /// # Errors
    /// Of the built-in environment.
    pub fn alone_in(self, world: &World) -> Result<World> {
        let mut world = world.clone();
        match self {
            Self::Point => {
                world.environment = None;
                world.lights.retain(|light| !light.is_area());
                if world.lights.is_empty() {
                    let offset = world.camera.position - world.camera.target;
                    let place = world.camera.target + glam::DVec3::new(-offset.x, offset.y, -offset.z);
                    let intensity = [offset.length_squared() as f32; 3];
                    world.lights.push(crate::Light::Point { position: place.as_vec3().to_array(), intensity });
                }
            }
            Self::Environment => {
                world.lights.clear();
                if world.environment.as_ref().is_none_or(|e| e.intensity <= 0.0) {
                    let map = builtin::environment(ENVIRONMENT, builtin::DEFAULT_WIDTH)?;
                    world.environment = Some(EnvironmentLight { map, intensity: 1.0, rotation: 0.0, visible: false });
                }
            }
        }
        Ok(world)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_light_shines_alone() {
        for scene in ["sphere", "furnace", "trio"] {
            let world = Scene::load(scene, &[]).unwrap().resolve().unwrap();
            let point = Light::Point.alone_in(&world).unwrap();
            assert!(point.environment.is_none() && !point.lights.is_empty(), "{scene}");
            assert!(point.lights.iter().all(|light| !light.is_area()), "{scene}");
            let environment = Light::Environment.alone_in(&world).unwrap();
            assert!(environment.environment.is_some_and(|e| e.intensity > 0.0) && environment.lights.is_empty(), "{scene}");
        }
        let names: std::collections::BTreeSet<_> = CASES.iter().map(|c| c.name).collect();
        assert_eq!(names.len(), CASES.len());
        let tiling = |case: &Distance| case.scene().unwrap().resolve().unwrap().materials[0].maps.tiling;
        for case in &TAN {
            let near = far(case.scene, 1, true);
            assert_eq!(tiling(case), tiling(&near).map(|t| t * case.times as f32), "{}", case.scene);
        }
    }
}
