//! A reflectance and the textures that vary it over a surface; the f64 twin of looking them up.

use crate::distribution::surface::FoundLobes;
use crate::distribution::{Gaussians, LobeFit, Surface};
use crate::error::{Error, Result};
use crate::frequency::wavelet::Grid;
use crate::frequency::{TextureBandwidth, TextureCells};
use crate::moments::Moments;
use crate::reflectance::half_row::Rows;
use crate::reflectance::{BlinnPhong, Ggx, LobeBandwidth, Model, Reflectance};
use crate::texture::{Format, Texture};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// The least GGX alpha that a map gives: a smooth mirror has no finite lobe.
pub const LEAST_ALPHA: f64 = 1e-3;

/// The greatest exponent or concentration that a map gives, that of an alpha of [`LEAST_ALPHA`].
pub const MOST_CONCENTRATION: f64 = 2.0 / (LEAST_ALPHA * LEAST_ALPHA);

/// What the values of a roughness map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Roughness {
    /// GGX alpha.
    Alpha,
    /// Concentration of a von Mises-Fisher lobe of normals, 2 / alpha^2.
    Kappa,
}

/// Textures over a surface's coordinates.
#[derive(Clone, Debug)]
pub struct Maps {
    /// [`Format::Srgb8`] or [`Format::Half4`]: multiplies the diffuse albedo of GGX and Blinn-Phong and the whole of a table;
    /// vMF lobes have no base, and get a diffuse one of this albedo.
    pub albedo: Option<Arc<Texture>>,
    /// [`Format::Srgb8`] or [`Format::Half4`]: multiplies `f0`, `specular`, or every lobe's weight. Not for tables.
    pub specular: Option<Arc<Texture>>,
    /// [`Format::Half2`]: the shading normal in the tangent frame.
    pub normal: Option<Arc<Texture>>,
    /// [`Format::Half1`]: stands in the place of the model's own alpha, exponent or (all lobes') concentration, clamped to what
    /// these may be. Not for tables.
    pub roughness: Option<(Arc<Texture>, Roughness)>,
    /// Factors on the coordinates: how many times the maps repeat.
    pub tiling: [f32; 2],
}

impl Default for Maps {
    fn default() -> Self {
        Self { albedo: None, specular: None, normal: None, roughness: None, tiling: [1.0; 2] }
    }
}

impl Maps {
    /// Albedo, specular, normal and roughness.
    pub(crate) fn textures(&self) -> [Option<&Arc<Texture>>; 4] {
        [self.albedo.as_ref(), self.specular.as_ref(), self.normal.as_ref(), self.roughness.as_ref().map(|r| &r.0)]
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.textures().iter().all(Option::is_none)
    }
}

/// What a surface is made of.
#[derive(Clone, Debug)]
pub struct Material {
    /// The reflectance.
    pub model: Model,
    /// What varies it.
    pub maps: Maps,
    /// How fast its lobes vary, if that is known; analysed when it is needed otherwise (a second for a table).
    pub lobe_bandwidth: Option<Arc<LobeBandwidth>>,
    /// The lobes that stand for it where light is looked up, if they are known; fitted when they are needed otherwise (seconds for a
    /// table).
    pub lobe_fit: Option<Arc<LobeFit>>,
    /// The mixtures of these maps, if the filter has some and they are known. Otherwise, or if they are of another size, they are fitted
    /// when they are needed: by the device, or on the host (seconds for a large map) those of [`crate::Filter::GmmUnaligned`] and those that
    /// the device has no room for.
    pub gaussians: Option<Arc<Gaussians>>,
}

impl From<Model> for Material {
    fn from(model: Model) -> Self {
        Self::new(model, Maps::default())
    }
}

/// What the maps say at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMaterial {
    /// Unit shading normal in the tangent frame.
    pub normal: DVec3,
    /// Factor of the albedo map; of vMF lobes, which need one to have a base, 0 without a map.
    pub albedo: DVec3,
    /// Factor of the specular map.
    pub specular: DVec3,
    /// The model's alpha, exponent or concentration, if there is a map of it.
    pub roughness: Option<f64>,
    /// What is added to the square of alpha, that is to 2 / concentration of every lobe: how far the normal turns within the
    /// pixel. Tables have no such parameter and stay as they are.
    pub kernel: f64,
    /// In the place of the model's own lobes, where a filter finds some.
    pub lobes: Option<Arc<FoundLobes>>,
}

/// The variance of a pixel filter, and the most that is added to the square of alpha (Tokuyoshi and Kaplanyan 2021, "Stable
/// geometric specular antialiasing with projected-space NDF filtering", listing 5).
const FILTER_VARIANCE: f64 = 0.5 / PI;
/// The most that [`geometric_kernel`] adds to the square of alpha.
pub const MOST_KERNEL: f64 = 0.18;

/// [`PointMaterial::kernel`] where the interpolated normal changes by `dx` and `dy` from one sample to the next: twice its
/// variance within the pixel (the same, isotropic form).
pub fn geometric_kernel(dx: DVec3, dy: DVec3) -> f64 {
    (2.0 * FILTER_VARIANCE * (dx.length_squared() + dy.length_squared())).min(MOST_KERNEL)
}

impl Material {
    /// A reflectance with maps.
    pub fn new(model: Model, maps: Maps) -> Self {
        Self { model, maps, lobe_bandwidth: None, lobe_fit: None, gaussians: None }
    }

    /// Whether its maps leave the model as it is, but for a factor and the normal: whether [`Self::lobe_fit`] can stand for it.
    pub(crate) fn keeps_model(&self) -> bool {
        let Maps { albedo, specular, roughness, .. } = &self.maps;
        let table = matches!(self.model, Model::Table(_) | Model::Turned(_));
        table || albedo.is_none() && specular.is_none() && roughness.is_none()
    }

    /// Whether what it looks like depends on texture coordinates or tangents.
    pub(crate) fn takes_coordinates(&self) -> bool {
        let turned = matches!(self.model, Model::Turned(_) | Model::Vmf(_));
        turned || !self.maps.is_empty()
    }

    /// Refuses parameters and maps that the model does not take.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a model that is not valid, a map in a format that is not its own, a specular or roughness
    /// map on a table, or a tiling that is not above 0.
    pub fn validate(&self) -> Result<()> {
        match &self.model {
            Model::Ggx(ggx) => ggx.validate()?,
            Model::BlinnPhong(blinn_phong) => blinn_phong.validate()?,
            Model::Table(_) | Model::Turned(_) | Model::Vmf(_) => {}
        }
        let table = matches!(self.model, Model::Table(_) | Model::Turned(_));
        let colour: &[Format] = &[Format::Srgb8, Format::Half4];
        let formats = [("albedo", colour), ("specular", colour), ("normal", &[Format::Half2]), ("roughness", &[Format::Half1])];
        for ((map, formats), texture) in formats.into_iter().zip(self.maps.textures()) {
            let Some(texture) = texture else { continue };
            if !formats.contains(&texture.format()) {
                return Err(Error::invalid(format!("maps.{map}"), format!("{formats:?}"), format!("{:?}", texture.format())));
            }
            if table && matches!(map, "specular" | "roughness") {
                return Err(Error::invalid(format!("maps.{map}"), "none on a tabulated reflectance", "one"));
            }
        }
        if !self.maps.tiling.iter().all(|t| t.is_finite() && *t > 0.0) {
            return Err(Error::invalid("maps.tiling", "two finite numbers > 0", format!("{:?}", self.maps.tiling)));
        }
        Ok(())
    }

    /// How fast colours and roughness vary over the surface, in cycles per unit of its coordinates, analysed at threshold `eps`;
    /// `None` without such maps. Normals count as curvature. Maps of more than 1024 texels a side count as their mips.
    pub fn texture_bandwidth(&self, eps: f64) -> Option<TextureCells> {
        let [albedo, specular, _, roughness] = self.maps.textures();
        let analyse = |map: &Arc<Texture>| {
            let size = map.size();
            let level = size[0].max(size[1]).div_ceil(1024).next_power_of_two().ilog2();
            let [width, height] = size.map(|side| (side >> level).max(1) as usize);
            let luminance = |x: usize, y: usize| {
                let uv = DVec2::new((x as f64 + 0.5) / width as f64, 1.0 - (y as f64 + 0.5) / height as f64);
                let texel = map.sample(uv, f64::from(level)).truncate();
                if map.format() == Format::Half1 { texel.x } else { crate::sampling::luminance(texel) }
            };
            TextureBandwidth::of(&Grid::from_fn(width, height, luminance), eps)
        };
        let maps: Vec<_> = [albedo, specular, roughness].into_iter().flatten().map(analyse).collect();
        (!maps.is_empty()).then(|| TextureCells::of(&maps, self.maps.tiling.map(f64::from)))
    }

    /// What the maps hold at `uv`, where a pixel has the extent `footprint`: the derivatives of `uv` by its x and y, before
    /// tiling. Colours come through their mips, as `sampling` says; normals and roughness from level 0.
    pub fn at(&self, uv: DVec2, footprint: [DVec2; 2], sampling: Sampling) -> PointMaterial {
        let Maps { albedo, specular, normal, roughness, tiling } = &self.maps;
        let tiling = DVec2::from(tiling.map(f64::from));
        let place = uv * tiling;
        let colour = |map: &Arc<Texture>| {
            let reach = Reach::of(footprint.map(|d| d * tiling), map.size(), sampling);
            reach.places(place).map(|at| map.sample(at, reach.lod).truncate()).sum::<DVec3>() / f64::from(reach.taps)
        };
        let without = if matches!(self.model, Model::Vmf(_)) { DVec3::ZERO } else { DVec3::ONE };
        PointMaterial {
            normal: normal.as_ref().map_or(DVec3::Z, |map| unit(map.sample(place, 0.0).truncate().truncate())),
            albedo: albedo.as_ref().map_or(without, colour),
            specular: specular.as_ref().map_or(DVec3::ONE, colour),
            roughness: roughness.as_ref().map(|(map, kind)| self.model.roughness_from(*kind, map.sample(place, 0.0).x)),
            kernel: 0.0,
            lobes: None,
        }
    }

    /// The same under the filter that `moments` belong to: normals and roughness come from these, as colours do.
    pub fn filtered_at(&self, moments: Option<&Moments>, uv: DVec2, footprint: [DVec2; 2], sampling: Sampling) -> PointMaterial {
        let point = self.at(uv, footprint, sampling);
        let Some(moments) = moments else { return point };
        let tiling = DVec2::from(self.maps.tiling.map(f64::from));
        let found = moments.at(uv * tiling, &Reach::of(footprint.map(|d| d * tiling), moments.size(), sampling));
        let normal = found.normal;
        let lobes = (found.lobes.count() > 0).then(|| Arc::new(found));
        PointMaterial { normal, lobes, ..point }
    }
}

/// How maps are looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// [`crate::Config::anisotropy`].
    pub anisotropy: u32,
    /// [`crate::Config::lod_bias`].
    pub lod_bias: f64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { anisotropy: 1, lod_bias: 0.0 }
    }
}

/// What a pixel covers of a map: look-ups along its longer axis, at the level whose texels are as large as the step from one to
/// the next; with one look-up, as large as the longer axis. Twin of `Reach` in `glsl/filter.comp`.
pub(crate) struct Reach {
    axis: DVec2,
    pub taps: u32,
    pub lod: f64,
}

impl Reach {
    /// Of the derivatives `footprint` of a texture's coordinates.
    pub fn of(footprint: [DVec2; 2], size: [u32; 2], sampling: Sampling) -> Self {
        let size = DVec2::from(size.map(f64::from));
        let [x, y] = footprint.map(|d| (d * size).length());
        let (major, minor) = (x.max(y).max(1.0), x.min(y).max(1.0));
        let taps = (major / minor - 1e-3).ceil().clamp(1.0, f64::from(sampling.anisotropy));
        Self {
            axis: footprint[usize::from(y >= x)],
            taps: taps as u32,
            lod: ((major / taps).max(1.0).log2() + sampling.lod_bias).max(0.0),
        }
    }

    /// Where the look-ups are taken about `uv`.
    pub fn places(&self, uv: DVec2) -> impl ExactSizeIterator<Item = DVec2> {
        let (axis, taps) = (self.axis, f64::from(self.taps));
        (0..self.taps as usize).map(move |i| uv + axis * ((i as f64 + 0.5) / taps - 0.5))
    }
}

/// The unit vector over x and y that faces up.
pub(crate) fn unit(xy: DVec2) -> DVec3 {
    xy.extend((1.0 - xy.length_squared()).max(0.0).sqrt()).normalize()
}

impl Model {
    /// The model's own parameter from a value of a roughness map.
    pub(crate) fn roughness_from(&self, kind: Roughness, value: f64) -> f64 {
        let value = value.max(0.0);
        let (alpha, concentration) = match kind {
            Roughness::Alpha => (value, 2.0 / (value * value)),
            Roughness::Kappa => ((2.0 / value).sqrt(), value),
        };
        match (self, kind) {
            (Self::BlinnPhong(_), Roughness::Alpha) => (concentration - 2.0).clamp(0.0, MOST_CONCENTRATION),
            (Self::BlinnPhong(_), Roughness::Kappa) | (Self::Vmf(_), _) => concentration.clamp(0.0, MOST_CONCENTRATION),
            (Self::Ggx(_) | Self::Table(_) | Self::Turned(_), _) => alpha.clamp(LEAST_ALPHA, 1.0),
        }
    }
}

impl PointMaterial {
    /// `model` as the maps make it. Albedos and reflectances at normal incidence are clamped to 1 where the model's are at most
    /// that.
    pub fn reflectance(&self, model: &Model) -> PointReflectance {
        let plain = |model| PointReflectance::Plain { model, scale: DVec3::ONE, base: DVec3::ZERO };
        let at_most_one = |c: DVec3| c.clamp(DVec3::ZERO, DVec3::ONE);
        let albedo = |c: DVec3| at_most_one(c * self.albedo);
        let specular = |c: DVec3| at_most_one(c * self.specular);
        if let Some(found) = &self.lobes {
            let coloured = match model {
                Model::Ggx(g) => Model::Ggx(Ggx { f0: specular(g.f0), albedo: albedo(g.albedo), ..*g }),
                Model::BlinnPhong(b) => {
                    Model::BlinnPhong(BlinnPhong { specular: specular(b.specular), albedo: albedo(b.albedo), ..*b })
                }
                other => other.clone(),
            };
            let found = found.as_ref().clone().widened(self.kernel);
            return PointReflectance::Found(Surface::new(coloured, &found, self.specular, albedo(DVec3::ONE)));
        }
        match model {
            Model::Ggx(g) => {
                let alpha = self.roughness.unwrap_or(g.alpha);
                let alpha = if self.kernel > 0.0 { (alpha * alpha + self.kernel).min(1.0).sqrt() } else { alpha };
                plain(Model::Ggx(Ggx { alpha, f0: specular(g.f0), albedo: albedo(g.albedo) }))
            }
            Model::BlinnPhong(b) => {
                let exponent = self.roughness.unwrap_or(b.exponent);
                let exponent =
                    if self.kernel > 0.0 { 2.0 / (2.0 / (exponent + 2.0) + self.kernel).min(1.0) - 2.0 } else { exponent };
                plain(Model::BlinnPhong(BlinnPhong { exponent, specular: specular(b.specular), albedo: albedo(b.albedo) }))
            }
            Model::Vmf(vmf) => PointReflectance::Plain {
                model: match self.roughness {
                    None if self.kernel > 0.0 => Model::Vmf(Arc::new(vmf.widened(self.kernel))),
                    None => model.clone(),
                    Some(kappa) => Model::Vmf(Arc::new(vmf.with_concentration(2.0 / (2.0 / kappa + self.kernel)))),
                },
                scale: self.specular,
                base: albedo(DVec3::ONE),
            },
            Model::Table(_) | Model::Turned(_) => {
                PointReflectance::Plain { model: model.clone(), scale: self.albedo, base: DVec3::ZERO }
            }
        }
    }
}

/// A reflectance at one point of a surface.
#[derive(Clone, Debug)]
pub enum PointReflectance {
    /// A model, scaled, over a diffuse base.
    Plain {
        /// With the colours and the parameter of its maps.
        model: Model,
        /// Factor on it.
        scale: DVec3,
        /// Albedo below.
        base: DVec3,
    },
    /// What a filter found of it.
    Found(Surface),
}

/// `value` of a model, scaled, over a diffuse base.
fn over(scale: DVec3, base: DVec3, wi: DVec3, wo: DVec3, value: DVec3) -> DVec3 {
    let above = wi.z > 0.0 && wo.z > 0.0;
    value * scale + if above { base / PI } else { DVec3::ZERO }
}

impl Reflectance for PointReflectance {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::Plain { model, scale, base } => over(*scale, *base, wi, wo, model.evaluate(wi, wo)),
            Self::Found(surface) => surface.evaluate(wi, wo),
        }
    }

    fn isotropic(&self) -> bool {
        matches!(self, Self::Plain { model, .. } if model.isotropic())
    }

    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::Plain { model, scale, base } => over(*scale, *base, wi, wo, model.mean_over_turns(wi, wo)),
            Self::Found(surface) => surface.mean_over_turns(wi, wo),
        }
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        match self {
            Self::Plain { model, scale, base } => {
                let (model, base) = (model.rows(weights * *scale), weights.dot(*base) / PI);
                Box::new(move |row, out| {
                    model(row, out);
                    out.iter_mut().for_each(|value| *value += base);
                })
            }
            Self::Found(surface) => surface.rows(weights),
        }
    }
}
