//! Layers beside radiance: what the frame's own images hold, at one shading sample an output pixel.

use crate::offline::error::{Error, Result};
use crate::offline::session::Session;
use crate::offline::{decision, footprint, levels};
use crate::pass::shading_rate;
use crate::{Config, Estimator, ShadingRate};

/// A layer that `--aov` names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Distance along the view axis in metres; 0 for the background.
    Depth,
    /// World shading normal, by the normal map where there is one.
    Normal,
    /// Material index, -1 for the background.
    Material,
    /// Object index, -1 for the background.
    Object,
    /// Texture coordinate.
    Uv,
    /// d(uv)/dx and d(uv)/dy.
    Footprint,
    /// Principal curvatures in 1/m, the larger in magnitude first, positive where convex.
    Curvature,
    /// Level of the coarsest cell around the pixel that has a value: 0 is an output pixel, +1 is 2x2 coarser.
    Level,
    /// Pixels that the shading-rate attachment lets hardware shade at once there, by the logarithm to base 2 of their side, in texels of
    /// [`SHADING_RATE`].
    ShadingRate,
    /// Valid share of the weight of the sample's parents, in steps of 1/63; 0 where it was shaded without asking them.
    Weight,
    /// Predicted bandwidth of the image in cycles a pixel.
    Bandwidth,
    /// Standard deviation of the probes' integrand over its mean.
    Spread,
    /// 1 where the sample was shaded by itself.
    Shaded,
    /// Directions drawn for the sample.
    Samples,
    /// Radiance that is looked up: pre-convolved light, suns and exact lights.
    Base,
    /// What is estimated beside that: radiance to add (`cv`), or the factor on it (`residual`).
    Residual,
    /// Share of the light that the fit of the sample's material misses at its view angle; 1 where no fit stands for the material.
    FitError,
    /// What is done about that ([`decision::Decision`]): -1 no surface, 0 nothing, 1 up-sampled, 2 shaded for the sample itself, 3 for a cell
    /// of 2x2 samples, and so on.
    Decision,
    /// Lobes that the filter found, 0 where the material's own stay.
    Lobes,
    /// Level of the mips of the material's finest map at which it is looked up ([`footprint::mips`]).
    Mip,
}

const ALL: [(&str, Aov); 20] = [
    ("depth", Aov::Depth),
    ("normal", Aov::Normal),
    ("material", Aov::Material),
    ("object", Aov::Object),
    ("uv", Aov::Uv),
    ("footprint", Aov::Footprint),
    ("curvature", Aov::Curvature),
    ("level", Aov::Level),
    ("shading-rate", Aov::ShadingRate),
    ("weight", Aov::Weight),
    ("bandwidth", Aov::Bandwidth),
    ("spread", Aov::Spread),
    ("shaded", Aov::Shaded),
    ("samples", Aov::Samples),
    ("base", Aov::Base),
    ("residual", Aov::Residual),
    ("fit-error", Aov::FitError),
    ("decision", Aov::Decision),
    ("lobes", Aov::Lobes),
    ("mip", Aov::Mip),
];

impl std::str::FromStr for Aov {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        if let Some((_, aov)) = ALL.iter().find(|(n, _)| *n == name) {
            return Ok(*aov);
        }
        let names = ALL.map(|(n, _)| n).join(", ");
        Err(Error::argument("--aov", format!("some of {names}"), format!("`{name}`")))
    }
}

/// What [`Aov::ShadingRate`] asks for.
pub const SHADING_RATE: ShadingRate = ShadingRate { texel: [16, 16], coarsest: 2 };

/// A channel of a layered image: its name and row-major samples.
pub type Channel = (String, Vec<f32>);

/// The samples of one of the renderer's images that stand for output pixels: the middle sample of each, rounded up.
struct Pixels {
    words: Vec<u32>,
    components: usize,
    width: usize,
    side: usize,
    output: [usize; 2],
}

impl Pixels {
    fn read(session: &mut Session, image: &str, side: u32) -> Result<Self> {
        let (bytes, format, [width, height]) = session.image(image)?;
        let words = if format == ash::vk::Format::R16G16B16A16_SFLOAT {
            bytemuck::pod_collect_to_vec::<u8, half::f16>(&bytes).into_iter().map(|h| h.to_f32().to_bits()).collect()
        } else {
            bytemuck::pod_collect_to_vec(&bytes)
        };
        let texels = width as usize * height as usize;
        let components = words.len() / texels;
        let output = [width / side, height / side].map(|e| e as usize);
        Ok(Self { words, components, width: width as usize, side: side as usize, output })
    }

    /// As from an image, from a word of each sample.
    fn of(&self, words: Vec<u32>) -> Self {
        Self { words, components: 1, ..*self }
    }

    fn map(&self, f: impl Fn(&[u32]) -> f32) -> Vec<f32> {
        let [width, height] = self.output;
        let at = |x: usize, y: usize| {
            let (x, y) = (x * self.side + self.side / 2, y * self.side + self.side / 2);
            let texel = (y * self.width + x) * self.components;
            &self.words[texel..texel + self.components]
        };
        (0..width * height).map(|i| f(at(i % width, i / width))).collect()
    }
}

impl Aov {
    /// Whether the curvature pass must run.
    pub fn needs_curvature(self) -> bool {
        self == Self::Curvature
    }

    /// Whether it is of texture coordinates.
    pub fn needs_coordinates(self) -> bool {
        matches!(self, Self::Uv | Self::Footprint | Self::Mip)
    }

    /// The layer's channels after a frame of `config`.
    ///
    /// # Errors
    /// The device's, on read-back.
    pub fn read(self, session: &mut Session, config: &Config) -> Result<Vec<Channel>> {
        let side = config.samples_per_side;
        let name = ALL.iter().find(|(_, a)| *a == self).map_or("", |(n, _)| n);
        let covered = Pixels::read(session, "ids", side)?;
        let mask = covered.map(|t| if t[0] == 0 { 0.0 } else { 1.0 });
        // Background texels are cleared to zero bits, which every float reads as 0.
        let float = |image: &str, letters: &str, first: usize, session: &mut Session| -> Result<Vec<Channel>> {
            let pixels = Pixels::read(session, image, side)?;
            let channel = |(i, c): (usize, char)| (format!("{name}.{c}"), pixels.map(|t| f32::from_bits(t[first + i])));
            Ok(letters.chars().enumerate().map(channel).collect())
        };
        let scalar = |values: Vec<f32>| Ok(vec![(format!("{name}.Y"), values)]);
        match self {
            Self::Depth => float("surface", "Z", 3, session),
            Self::Normal => float("normals", "XYZ", 0, session),
            Self::Uv => float("coordinate", "XY", 0, session),
            Self::Footprint => float("derivative", "XYZW", 0, session),
            Self::Curvature => float("curvature", "XY", 0, session),
            Self::Material => scalar(covered.map(|t| t[0].checked_sub(1).map_or(-1.0, |id| (id & 0xffff) as f32))),
            Self::Object => scalar(covered.map(|t| t[0].checked_sub(1).map_or(-1.0, |id| (id >> 16) as f32))),
            Self::Level => {
                let pixel = side.ilog2() as f32;
                let levels = covered.of(levels::coarsest(session)?).map(|t| t[0] as f32 - pixel);
                scalar(levels.iter().zip(mask).map(|(level, mask)| level * mask).collect())
            }
            Self::ShadingRate => {
                let none = |_| Error::argument("--aov shading-rate", "a --rate with levels beside it", "the full rate");
                let bytes: Vec<u8> = session.words("rates").map_err(none)?.into_iter().flat_map(u32::to_le_bytes).collect();
                let [width, height] = covered.output;
                let [w, h] = SHADING_RATE.texel.map(|e| e as usize);
                // Rows of whole words.
                let row = 4 * shading_rate::words(shading_rate::texels(SHADING_RATE, config.extent)[0]) as usize;
                let rate = |i: usize| bytes.get(i / width / h * row + i % width / w).map_or(0.0, |r| f32::from(r & 3));
                scalar((0..width * height).map(rate).collect())
            }
            Self::Weight => {
                let weights = levels::weights(session)?.into_iter().map(f32::to_bits).collect();
                scalar(covered.of(weights).map(|t| f32::from_bits(t[0])))
            }
            Self::Bandwidth | Self::Spread => {
                let none = |_| Error::argument(format!("--aov {name}"), "--rate bandwidth beside it", "another rate");
                let (bytes, _, [width, _]) = session.image("prediction").map_err(none)?;
                let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
                let block = 2 * side as usize;
                // Of samples to of pixels.
                let unit = if self == Self::Bandwidth { side as f32 } else { 1.0 };
                let value = |i: usize| {
                    let [x, y] = [i % covered.width / block, i / covered.width / block];
                    let at = 4 * (y * width as usize + x) + usize::from(self == Self::Spread);
                    (halves.get(at).map_or(0.0, |h| h.to_f32()) * unit).to_bits()
                };
                let all = covered.of((0..covered.words.len()).map(value).collect()).map(|t| f32::from_bits(t[0]));
                scalar(all.iter().zip(mask).map(|(v, mask)| if mask > 0.0 { *v } else { 0.0 }).collect())
            }
            Self::Residual if !config.estimator.has_residual() => {
                let expected = "--estimator cv or residual beside it";
                Err(Error::argument("--aov residual", expected, config.estimator.name()))
            }
            Self::Base | Self::FitError | Self::Decision if !config.estimator.looks_up() => {
                let expected = "--estimator preconvolved, cv or residual beside it";
                Err(Error::argument(format!("--aov {name}"), expected, config.estimator.name()))
            }
            Self::FitError => {
                let errors = decision::fit_errors(session)?.into_iter().map(f32::to_bits).collect();
                scalar(covered.of(errors).map(|t| f32::from_bits(t[0])))
            }
            Self::Decision => {
                let codes = decision::decisions(session, config)?.into_iter().map(|d| d.code().to_bits()).collect();
                scalar(covered.of(codes).map(|t| f32::from_bits(t[0])))
            }
            Self::Base | Self::Residual => {
                let image = match config.estimator {
                    Estimator::Preconvolved => "radiance",
                    _ if self == Self::Residual => "radiance",
                    _ => "base",
                };
                let radiance = float(image, "RGB", 0, session)?;
                let covered = |(name, values): Channel| {
                    (name, values.iter().zip(&mask).map(|(v, m)| if *m > 0.0 { *v } else { 0.0 }).collect())
                };
                Ok(radiance.into_iter().map(covered).collect())
            }
            Self::Lobes => {
                if config.filter.lobe_layers() == 0 {
                    let expected = "a --filter that reads normals through mips beside it";
                    return Err(Error::argument("--aov lobes", expected, config.filter.name()));
                }
                let (bytes, ..) = session.image("lobes")?;
                let texels: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                let slopes = config.filter.has_slopes();
                // The first that is all 0 ends the list; a Gaussian of slopes takes two layers.
                let (samples, layers) = (covered.words.len(), if slopes { 2 } else { 1 });
                let there = |i: usize, layer: usize| texels.get(layer * samples + i).is_some_and(|t| *t != [0; 4]);
                let most = config.filter.lobe_layers() as usize / layers;
                let count = |i: usize| (0..most).take_while(|k| there(i, k * layers)).count() as u32;
                let counts = covered.of((0..samples).map(count).collect()).map(|t| t[0] as f32);
                scalar(counts.iter().zip(mask).map(|(count, mask)| count * mask).collect())
            }
            Self::Mip => {
                let mips = footprint::mips(session, config)?.into_iter().map(f32::to_bits).collect();
                scalar(covered.of(mips).map(|t| f32::from_bits(t[0])))
            }
            Self::Shaded | Self::Samples => {
                let mut shaded = vec![0; covered.words.len()];
                for ([x, y], directions) in levels::directions(session, config)? {
                    // A sample may stand for cells of several levels.
                    let sample = &mut shaded[y as usize * covered.width + x as usize];
                    *sample = if self == Self::Shaded { 1 } else { *sample + directions };
                }
                scalar(covered.of(shaded).map(|t| t[0] as f32))
            }
        }
    }
}
