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

/// A scene in one of its frames.
pub(super) struct Shot {
    pub scene: Scene,
    pub frame: u32,
}

/// From where a scene of [`TAN`] is seen.
enum Seen {
    /// As in this frame of its animation.
    Frame(u32),
    /// From further away: its maps repeat so many times as often, and images stay as large.
    Times(u32),
}

/// A scene of [`TAN`].
struct Scale {
    scene: &'static str,
    seen: Seen,
    /// Whether the quick preset has it.
    quick: bool,
}

const fn seen(scene: &'static str, seen: Seen, quick: bool) -> Scale {
    Scale { scene, seen, quick }
}

/// The scenes of Tan et al. 2005: a carved disk from aside along a zoom, armour of hemispherical scales at two resolutions, and a
/// desert from several distances.
const TAN: [Scale; 8] = [
    seen("disk", Seen::Frame(0), true),
    seen("disk", Seen::Frame(32), false),
    seen("disk", Seen::Frame(63), false),
    seen("armour", Seen::Times(1), false),
    seen("armour", Seen::Times(6), true),
    seen("dunes", Seen::Times(1), false),
    seen("dunes", Seen::Times(3), false),
    seen("dunes", Seen::Times(8), false),
];

/// The environment of scenes without one.
const ENVIRONMENT: &str = "sun-sky";

/// The scenes of the order's preset; those that lack files are `skipped`.
pub(super) fn shots(order: &Order, skipped: &mut Vec<Skipped>) -> Result<Vec<Shot>> {
    let mut shots = Vec::new();
    if order.suite == Suite::Tan {
        return TAN.iter().filter(|case| case.quick || order.preset == Preset::Full).map(Scale::shot).collect();
    }
    for case in CASES.iter().filter(|case| case.quick || order.preset == Preset::Full) {
        match case.file {
            None => shots.push(Shot::of(case.name)?),
            Some([scene, file, _]) if order.root.join(file).is_file() => shots.push(Shot::of(&under(&order.root, scene))?),
            Some([_, _, asset]) => skipped.push(Skipped { scene: case.name.into(), needs: vec![asset] }),
        }
    }
    Ok(shots)
}

impl Shot {
    /// The first frame of a scene file or of a built-in.
    pub fn of(scene: &str) -> Result<Self> {
        Ok(Self { scene: Scene::load(scene, &[])?, frame: 0 })
    }
}

impl Scale {
    fn shot(&self) -> Result<Shot> {
        let near = Shot::of(self.scene)?;
        match self.seen {
            Seen::Frame(0) | Seen::Times(1) => Ok(near),
            Seen::Frame(frame) => Ok(Shot { scene: near.scene.called(&format!("{} frame {frame}", self.scene)), frame }),
            Seen::Times(times) => {
                let [u, v] =
                    near.scene.resolve()?.materials.first().map_or([1.0; 2], |m| m.maps.tiling.map(|t| t * times as f32));
                let tiling = ("materials.surface.tiling".to_string(), format!("[{u}, {v}]"));
                let scene = Scene::load(self.scene, &[tiling])?.called(&format!("{} x{times}", self.scene));
                Ok(Shot { scene, frame: 0 })
            }
        }
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
        // Masks are of the lights that there were.
        let mut world = World { shadows: None, ..world.clone() };
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
        for case in &TAN {
            let [near, shot] = [Shot::of(case.scene), case.shot()].map(|shot| shot.unwrap());
            let tiling = |shot: &Shot| shot.scene.resolve().unwrap().materials[0].maps.tiling;
            let times = if let Seen::Times(times) = case.seen { times } else { 1 };
            assert_eq!(tiling(&shot), tiling(&near).map(|t| t * times as f32), "{}", case.scene);
            assert!(shot.frame < shot.scene.animated().unwrap().frames().unwrap_or(1), "{}", case.scene);
        }
    }
}
