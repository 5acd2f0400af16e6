//! The reference: direct light in f64 by quadrature, never by sampling, and primary visibility by ray casting. It shares no
//! code with the GPU's path, only the scene, the reflectances and the conventions.

mod cubature;
mod environment;
mod visibility;

pub use cubature::{Estimate, Options};
pub use visibility::{Hit, MIN_COSINE, bend};

use crate::error::{Error, Result};
use crate::offline::world::World;
use crate::reflectance::Reflectance;
use environment::Tree;
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Depth steps to the eight neighbours of an interior pixel are below this share of its depth.
const INTERIOR_STEP: f64 = 0.05;

/// A scene prepared for evaluation at any of its pixels: visibility is traced and the environment's rules are built.
pub struct Reference<'a> {
    world: &'a World,
    extent: [u32; 2],
    options: Options,
    /// In the place of the materials' own.
    reflectances: Option<Vec<&'a dyn Reflectance>>,
    hits: Vec<Option<Hit>>,
    environment: Option<Tree<'a>>,
}

/// A reference image; every vector is row-major with one entry a pixel.
#[derive(Clone, Debug)]
pub struct ReferenceImage {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Outgoing radiance (linear Rec.709); outside the objects the environment where it is visible, else zero.
    pub radiance: Vec<DVec3>,
    /// Whether an object covers the pixel's centre.
    pub coverage: Vec<bool>,
    /// What the pixel's centre sees.
    pub hits: Vec<Option<Hit>>,
    /// [`Estimate::error`] of each pixel, zero outside the objects.
    pub error: Vec<f64>,
    /// Reflectance evaluations spent in all.
    pub evaluations: u64,
}

/// Renders all of `world` at `extent` pixels.
///
/// # Errors
/// As [`Reference::new`].
pub fn render(world: &World, extent: [u32; 2], options: Options) -> Result<ReferenceImage> {
    Ok(Reference::new(world, extent, options)?.render())
}

/// The estimate at one pixel (x right, y down), `None` where no object covers its centre. To ask for several, keep a
/// [`Reference`].
///
/// # Errors
/// As [`Reference::new`] and [`Reference::pixel`].
pub fn pixel(world: &World, extent: [u32; 2], at: [u32; 2], options: Options) -> Result<Option<Estimate>> {
    Reference::new(world, extent, options)?.pixel(at)
}

impl<'a> Reference<'a> {
    /// Traces visibility and prepares the environment.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for an empty extent, a degenerate camera, or an index of a mesh or object out of range.
    pub fn new(world: &'a World, extent: [u32; 2], options: Options) -> Result<Self> {
        let hits = visibility::trace(world, extent, &options)?;
        let environment = world.environment.as_ref().map(|light| Tree::new(&light.map));
        Ok(Self { world, extent, options, reflectances: None, hits, environment })
    }

    /// As [`Reference::new`] with one reflectance per material in place of the materials' own, whose maps then count for
    /// normals only.
    ///
    /// # Errors
    /// As [`Reference::new`], and when the counts differ.
    pub fn with_reflectances(
        world: &'a World,
        extent: [u32; 2],
        options: Options,
        reflectances: Vec<&'a dyn Reflectance>,
    ) -> Result<Self> {
        if reflectances.len() != world.materials.len() {
            return Err(Error::invalid("reflectances", format!("{} of them", world.materials.len()), reflectances.len()));
        }
        Ok(Self { reflectances: Some(reflectances), ..Self::new(world, extent, options)? })
    }

    /// What each pixel's centre sees, row-major.
    pub fn hits(&self) -> &[Option<Hit>] {
        &self.hits
    }

    /// The estimate at one pixel, `None` where no object covers its centre.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a pixel outside the image.
    pub fn pixel(&self, at: [u32; 2]) -> Result<Option<Estimate>> {
        let [w, h] = self.extent;
        let index = at[1] as usize * w as usize + at[0] as usize;
        match self.hits.get(index) {
            Some(hit) if at[0] < w => Ok(hit.as_ref().map(|hit| self.shade(hit))),
            _ => Err(Error::invalid("pixel", format!("inside {w}x{h}"), format!("({}, {})", at[0], at[1]))),
        }
    }

    /// Integrates every covered pixel, in parallel; the result does not depend on the number of threads.
    pub fn render(&self) -> ReferenceImage {
        let estimates: Vec<Option<Estimate>> = self.hits.par_iter().map(|hit| hit.as_ref().map(|hit| self.shade(hit))).collect();
        let radiance = |(i, estimate): (usize, &Option<Estimate>)| estimate.map_or_else(|| self.background(i), |e| e.radiance);
        ReferenceImage {
            extent: self.extent,
            radiance: estimates.iter().enumerate().map(radiance).collect(),
            coverage: self.hits.iter().map(Option::is_some).collect(),
            hits: self.hits.clone(),
            error: estimates.iter().map(|e| e.map_or(0.0, |e| e.error)).collect(),
            evaluations: estimates.iter().flatten().map(|e| e.evaluations).sum(),
        }
    }

    /// Radiance that leaves a hit towards the viewer.
    pub fn shade(&self, hit: &Hit) -> Estimate {
        let (Some(light), Some(tree)) = (&self.world.environment, &self.environment) else { return Estimate::default() };
        let map_from_world = DMat3::from_rotation_y(-light.rotation.to_radians());
        let frame = cubature::Frame::new(hit.normal, hit.tangent).turned(map_from_world);
        let view = map_from_world * hit.view;
        let integrate = |reflectance: &dyn Reflectance| cubature::integrate(tree, frame, view, reflectance, &self.options);
        let given = self.reflectances.as_ref().map(|all| all.get(hit.material));
        let mut estimate = match (given, self.world.materials.get(hit.material)) {
            (Some(Some(reflectance)), _) => integrate(*reflectance),
            // Without maps, the model itself: a table need not be copied.
            (None, Some(material)) if material.maps.is_empty() && hit.point.kernel == 0.0 => integrate(&material.model),
            (None, Some(material)) => integrate(&hit.point.reflectance(&material.model)),
            _ => return Estimate::default(),
        };
        estimate.radiance *= light.intensity;
        estimate
    }

    fn background(&self, index: usize) -> DVec3 {
        let width = self.extent[0] as usize;
        let centre = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        match &self.world.environment {
            Some(light) if light.visible => light.radiance(self.world.camera.ray(centre, self.extent)),
            _ => DVec3::ZERO,
        }
    }
}

impl ReferenceImage {
    /// Pixels whose 3x3 neighbourhood is covered by one object without a step in depth: there a rasteriser and a ray caster
    /// see the same surface. Pixels on the image's edge are not interior.
    pub fn interior(&self) -> Vec<bool> {
        let [w, h] = self.extent.map(i64::from);
        let hit = |x: i64, y: i64| {
            if x < 0 || y < 0 || x >= w || y >= h { None } else { self.hits.get((y * w + x) as usize)?.as_ref() }
        };
        let interior = |x: i64, y: i64| {
            let Some(centre) = hit(x, y) else { return false };
            let same = |n: &Hit| n.object == centre.object && (n.depth - centre.depth).abs() < INTERIOR_STEP * centre.depth;
            (0..9).all(|k| hit(x + k % 3 - 1, y + k / 3 - 1).is_some_and(same))
        };
        (0..w * h).map(|i| interior(i % w, i / w)).collect()
    }
}
