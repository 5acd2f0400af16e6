//! Scene files: TOML in, a resolved [`World`] out.

use crate::distribution::filter::PRINTED_LENGTHS;
use crate::frequency::allocation::Allocation;
use crate::frequency::operators::{Combine, Operator};
use crate::offline::animation::AnimatedWorld;
use crate::offline::error::{At, Error, Result};
use crate::offline::input;
use crate::offline::world::World;
use crate::{Bins, Config, Division};
use builtins::BUILTINS;
use std::path::{Path, PathBuf};

mod animation;
mod bakes;
mod builtins;
mod check;
mod format;
mod lights;
mod maps;
mod materials;
mod overrides;
mod resolve;
mod settings;
mod source;

pub use animation::MAX_FRAMES;
pub use materials::{read_merl, read_rgl, read_sgd};

/// A scene file that has been read and checked, but whose meshes, maps and tables are still on disk.
#[derive(Debug)]
pub struct Scene {
    name: String,
    /// What relative paths are relative to.
    folder: PathBuf,
    source: source::Source,
    file: format::SceneFile,
}

impl Scene {
    /// Reads the built-in scene `scene`, or else the scene file of that path, with `overrides` applied in order: pairs of
    /// a dotted path (`camera.fov_y`, `objects.0.material`) and a TOML value, or a string without quotes. An override that
    /// makes another choice (`materials.paint.reflectance.merl` over a `builtin`) replaces the old one. Paths
    /// are relative to the scene file, and to the working directory in built-in scenes.
    ///
    /// # Errors
    /// [`Error::File`] with the line of whatever is unknown, missing, of another type or out of range;
    /// [`Error::Argument`] if an override brought it, or for a name that is neither.
    pub fn load(scene: &str, overrides: &[(String, String)]) -> Result<Self> {
        if let Some((name, text)) = BUILTINS.iter().find(|(name, _)| *name == scene) {
            return Self::parse(name, PathBuf::from(format!("<{name}>")), PathBuf::new(), text.to_string(), overrides);
        }
        let path = Path::new(scene);
        if input::extension(path) != "toml" && !path.exists() {
            let names = BUILTINS.map(|(name, _)| name).join(", ");
            return Err(Error::argument("scene", format!("a scene file or one of {names}"), format!("`{scene}`")));
        }
        let bytes = input::read(path)?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let at = At::Byte(e.utf8_error().valid_up_to() as u64);
            Error::file(path, at, "scene", "UTF-8 text", "another byte")
        })?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Self::parse(&name, path.to_path_buf(), folder, text, overrides)
    }

    fn parse(name: &str, path: PathBuf, folder: PathBuf, text: String, overrides: &[(String, String)]) -> Result<Self> {
        let (source, file) = source::Source::parse(path, text, overrides)?;
        check::scene(&source, &file)?;
        Ok(Self { name: name.to_string(), folder, source, file })
    }

    /// The scene file's stem or the built-in's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same with another name.
    pub(crate) fn called(mut self, name: &str) -> Self {
        self.name = name.into();
        self
    }

    /// Loads every file that the scene names, and makes what it takes from formulas: the world in its first frame.
    ///
    /// # Errors
    /// [`Error::File`] for the file that is missing, malformed or out of range.
    pub fn resolve(&self) -> Result<World> {
        self.animated().map(AnimatedWorld::into_world)
    }

    /// As [`Self::resolve`], with all that changes from frame to frame.
    ///
    /// # Errors
    /// As [`Self::resolve`]; [`Error::File`] also for a camera that looks nowhere between two keyframes.
    pub fn animated(&self) -> Result<AnimatedWorld> {
        let (world, sources) = resolve::world(self)?;
        animation::animated(self, world, &sources)
    }

    /// Defaults for an image of `extent` pixels, with the scene's own `[settings]` in their place.
    pub fn config(&self, extent: [u32; 2]) -> Config {
        let settings = &self.file.settings;
        let base = Config::new(extent);
        Config {
            lmax: settings.lmax.as_ref().map_or(base.lmax, |v| *v.get_ref()),
            operator: match settings.operator.as_ref().map(|v| v.get_ref().as_str()) {
                Some("box") => Operator::Box,
                Some("covariance") => Operator::Covariance,
                _ => base.operator,
            },
            combine: match settings.combine.as_ref().map(|v| v.get_ref().as_str()) {
                Some("max") => Combine::Max,
                _ => base.combine,
            },
            eps: settings.eps.as_ref().map_or(base.eps, |v| *v.get_ref()),
            lobe_components: settings.lobe_components.as_ref().map_or(base.lobe_components, |v| Some(*v.get_ref())),
            bins: match settings.bins.as_ref().map(|v| v.get_ref().as_str()) {
                Some("camera") => Bins::Camera,
                _ => base.bins,
            },
            anisotropy: settings.anisotropy.as_ref().map_or(base.anisotropy, |v| *v.get_ref() as u32),
            lod_bias: settings.lod_bias.as_ref().map_or(base.lod_bias, |v| *v.get_ref() as f32),
            division: match [&settings.eps0, &settings.eps1].map(|eps| eps.as_ref().map(|v| *v.get_ref())) {
                [None, None] => base.division,
                [one, quarters] => Division::Lengths([one.unwrap_or(PRINTED_LENGTHS[0]), quarters.unwrap_or(PRINTED_LENGTHS[1])]),
            },
            geometric: settings.geometric.as_ref().map_or(base.geometric, |v| *v.get_ref()),
            reflectance_share: settings.reflectance_share.as_ref().map_or(base.reflectance_share, |v| *v.get_ref() as f32),
            fit_lobes: settings.fit_lobes.as_ref().map_or(base.fit_lobes, |v| *v.get_ref()),
            fit_error: settings.fit_error.as_ref().map_or(base.fit_error, |v| *v.get_ref()),
            residual_errors: settings.residual_errors.as_ref().map_or(base.residual_errors, |v| v.get_ref().map(|e| e as f32)),
            exact_lobes: settings.exact_lobes.as_ref().map_or(base.exact_lobes, |v| *v.get_ref()),
            directions: settings.budget.as_ref().map_or(base.directions, |v| *v.get_ref()),
            allocation: {
                let rules = [Allocation::Equation8, Allocation::Deviation, Allocation::RelativeDeviation];
                let name = settings.np_rule.as_ref().map(|v| v.get_ref().as_str());
                rules.into_iter().find(|rule| Some(rule.name()) == name).unwrap_or(base.allocation)
            },
            ..base
        }
    }

    /// Names of the built-in scenes, each with a line that describes it.
    pub fn builtin_names() -> Vec<(&'static str, &'static str)> {
        let describe = |text: &'static str| text.lines().next().unwrap_or_default().trim_start_matches(['#', ' ']);
        BUILTINS.iter().map(|(name, text)| (*name, describe(text))).collect()
    }
}
