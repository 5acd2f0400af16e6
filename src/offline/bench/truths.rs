//! Supersampled images, kept on disk by the content of what they show, as `reference` keeps converged ones: halves of a few
//! sub-samples each, added until the noise is low enough.

use crate::offline::bench::reference::{Converged, Goal, Hashed, refine};
use crate::offline::cache;
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::render::Settings;
use crate::offline::session::Session;
use crate::offline::supersample::{self, Layout};
use crate::offline::world::{Camera, World};
use crate::{Config, Requirements};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Changes with whatever changes the image of one world.
const VERSION: &str = "passband truth 1";
/// The noise of a truth is to be below the smallest error over this.
const MARGIN: f64 = 10.0;
/// Seed of truths; measured frames have others.
const SEED: u32 = 0x7472_7574;

/// The folder of the user's cache in which truths are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("truth")
}

/// Truths of one world from any camera.
pub(crate) struct Truths<'a> {
    world: World,
    device: &'a Options,
    cache: Option<&'a Path>,
    /// Sub-samples of a pixel that are taken at once.
    unit: u32,
    /// Names the world's content but for the camera; made when it is first needed.
    content: Option<String>,
    session: Option<(Session, Layout, [u32; 2])>,
}

impl<'a> Truths<'a> {
    /// Of `world`, in units of `unit` sub-samples.
    pub fn new(world: &World, device: &'a Options, cache: Option<&'a Path>, unit: u32) -> Self {
        Self { world: world.clone(), device, cache, unit, content: None, session: None }
    }

    /// What `camera` sees. `progress` is told how many of at most how many sub-samples a pixel are there.
    pub fn of(
        &mut self,
        camera: &Camera,
        extent: [u32; 2],
        goal: &Goal,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Converged> {
        self.world.camera = *camera;
        let entry = self.cache.map(|folder| folder.to_path_buf());
        let entry = entry.map(|folder| folder.join(format!("{}.truth", self.key(camera, extent))));
        if let Some((session, ..)) = self.session.as_mut().filter(|(.., known)| *known == extent) {
            session.show(&self.world)?;
        } else {
            self.session = None;
        }
        let (world, device, unit) = (&self.world, self.device, self.unit);
        let session = &mut self.session;
        refine(Converged::of(extent, unit), entry.as_deref(), goal, progress, &mut |image| {
            let (session, layout, _) = match &mut *session {
                Some(session) => session,
                none => none.insert(open(world, device, extent, unit)?),
            };
            let half = supersample::half(session, layout, [SEED, image.frames()], &mut |_| ())?;
            Ok(half.into_iter().map(|v| v as f32).collect())
        })
    }

    /// `image`, refined if its noise is not far enough below the smallest error that `judge` finds by it, to at most `most` sub-samples
    /// a pixel; and that error. `judge` is called once more with what is refined.
    pub fn judged(
        &mut self,
        image: Converged,
        camera: &Camera,
        most: u64,
        judge: &mut dyn FnMut(&Converged) -> Result<f64>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<(Converged, f64)> {
        let goal = Goal { noise: judge(&image)? / MARGIN, most };
        let image = match image.noise()?.rmse > goal.noise && image.directions() < most {
            true => self.of(camera, image.extent(), &goal, progress)?,
            false => return Ok((image, goal.noise * MARGIN)),
        };
        let smallest = judge(&image)?;
        Ok((image, smallest))
    }

    /// The name of the world's content. Its debugging text has every number to the last bit; that of textures takes a second, so
    /// it is hashed once for all cameras.
    fn key(&mut self, camera: &Camera, [width, height]: [u32; 2]) -> String {
        let (world, unit) = (&self.world, self.unit);
        let content = self.content.get_or_insert_with(|| {
            // Supersampling has no shadows.
            let World { name: _, camera: _, size: _, shadows: _, environment, lights, objects, materials } = world;
            let mut hash = Hashed::default();
            // A hash takes any text.
            let _ = write!(hash, "{environment:?} {lights:?} {objects:?} {materials:?}");
            hash.text()
        });
        let mut hash = Hashed::default();
        let _ = write!(hash, "{VERSION} {width} {height} {unit} {camera:?} {content}");
        hash.text()
    }
}

fn open(world: &World, device: &Options, extent: [u32; 2], unit: u32) -> Result<(Session, Layout, [u32; 2])> {
    let settings = Settings::new(Config::new(extent));
    let config = settings.supersampled(world, 2 * unit)?;
    let session = Session::new(Headless::new(device, &Requirements::of(&config))?, &supersample::at_base(world), &config)?;
    Ok((session, supersample::layout(&settings, &config, 2 * unit), extent))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::scene::Scene;

    #[test]
    fn another_world_or_camera_has_another_name() {
        let device = Options::default();
        let key = |overrides: &[(&str, &str)], unit| {
            let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
            let world = Scene::load("sphere", &overrides).and_then(|s| s.resolve()).unwrap();
            Truths::new(&world, &device, None, unit).key(&world.camera, [8, 8])
        };
        let plain = key(&[], 64);
        assert_eq!(plain, key(&[], 64));
        for other in [("camera.fov_y", "36.0001"), ("environment.rotation", "1"), ("objects.0.translate", "[0, 0.001, 0]")] {
            assert_ne!(plain, key(&[other], 64), "{other:?}");
        }
        assert_ne!(plain, key(&[], 128));
    }
}
