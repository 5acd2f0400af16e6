//! What kinds of materials there are, and the passes that are compiled for them.

use crate::config::{Config, Estimator, Rate};
use crate::distribution::Filter;
use crate::error::Result;
use crate::gpu::retire::Retired;
use crate::material::Material;
use crate::pass::fits::Packed;
use crate::pass::maps::{MapsUpload, Uses};
use crate::pass::{PassContext, bandwidth, base, filter, residual_level, shade};
use crate::reflectance::Model;

/// What passes are compiled for, and what bounds their loops. Other materials of the same kinds need no other ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kinds {
    /// Some whose lobes stay as they are, whatever the filter.
    pub unfiltered: bool,
    /// Some with a fit, and some without.
    pub fitted: bool,
    pub reflected: bool,
    /// The most lobes that stand for one where light is looked up.
    pub most_lobes: u32,
    /// The most lobes that one has as its own reflectance.
    pub most_own_lobes: u32,
    /// Where light is looked up, a bit for each `REFLECTANCE_*` of `glsl/bridge/materials.glsl` that there is.
    pub models: u32,
    /// Some that depend on texture coordinates or tangents.
    pub coordinates: bool,
    /// Classes that hold maps of each kind.
    pub uses: Uses,
    /// The most clusters that one has, at least 1.
    pub most_clusters: u32,
    /// Some of which lobes have colours of their own.
    pub coloured: bool,
}

impl Kinds {
    /// Of materials with these maps and fits.
    pub fn of(materials: &[Material], maps: &MapsUpload, fits: &Packed, filter: Filter, models: u32) -> Self {
        let found = &maps.found;
        let layers = filter.lobe_layers() / if filter.has_slopes() { 2 } else { 1 };
        let own_lobes = |material: &Material| if let Model::Vmf(vmf) = &material.model { vmf.lobes().len() as u32 } else { 1 };
        let own = |(material, found): (&Material, &bool)| if *found { layers } else { own_lobes(material) };
        let without = materials.iter().zip(found).zip(&fits.firsts).filter(|(_, first)| **first == 0);
        let reflected = without.map(|(material, _)| own(material)).max();
        Self {
            unfiltered: found.contains(&false),
            fitted: fits.most > 0,
            reflected: reflected.is_some(),
            most_lobes: reflected.unwrap_or_default().max(fits.most as u32),
            most_own_lobes: materials.iter().map(own_lobes).max().unwrap_or_default(),
            models,
            coordinates: materials.iter().any(Material::takes_coordinates),
            uses: maps.uses,
            most_clusters: maps.most_clusters,
            coloured: maps.coloured,
        }
    }
}

/// The passes.
pub(crate) struct OfKinds {
    pub kinds: Kinds,
    /// What maps say at the scale of a sample.
    pub filter: filter::Filter,
    /// Where levels follow from the predicted bandwidth of the image.
    pub bandwidth: Option<bandwidth::Bandwidth>,
    /// Where levels follow from what look-ups miss.
    pub residual_level: Option<residual_level::ResidualLevel>,
    /// Where light is looked up.
    pub base: Option<base::Base>,
    /// Where directions are drawn.
    pub shade: Option<shade::Shade>,
}

impl OfKinds {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, kinds: Kinds) -> Result<Self> {
        let (looked_up, drawn) = (config.estimator.looks_up(), config.estimator != Estimator::Preconvolved);
        let by_errors = config.rate == Rate::Bandwidth && !config.predicts();
        Ok(Self {
            kinds,
            filter: filter::Filter::new(p, config, kinds.uses, (kinds.most_clusters, kinds.coloured))?,
            bandwidth: config.predicts().then(|| bandwidth::Bandwidth::new(p, config, kinds)).transpose()?,
            residual_level: by_errors.then(|| residual_level::ResidualLevel::new(p, config, kinds)).transpose()?,
            base: looked_up.then(|| base::Base::new(p, config, kinds)).transpose()?,
            shade: drawn.then(|| shade::Shade::new(p, config, config.coarsest() > 0, kinds)).transpose()?,
        })
    }

    pub fn retire(self, bag: &mut Retired) {
        self.filter.retire(bag);
        if let Some(pass) = self.bandwidth {
            pass.retire(bag);
        }
        if let Some(pass) = self.residual_level {
            pass.retire(bag);
        }
        if let Some(pass) = self.base {
            pass.retire(bag);
        }
        if let Some(pass) = self.shade {
            pass.retire(bag);
        }
    }
}
