//! The figures of Bagher et al. 2011 that show what prediction does, drawn of any scene (those of residuals: `parts.rs`).

use crate::frequency::operators::Combine;
use crate::offline::aov::Aov;
use crate::offline::bench::quality::{self, Frame};
use crate::offline::bench::reference::Converged;
use crate::offline::bench::report::SceneReport;
use crate::offline::bench::spectrum;
use crate::offline::bench::tiles::{GAIN, KEY, Tile, covered_median, difference, heat, levels, mask, photograph};
use crate::offline::error::Result;
use crate::offline::headless::Headless;
use crate::offline::image_io::LinearImage;
use crate::offline::metrics::{Exposure, Metrics, Picture};
use crate::offline::render::{Rendered, Settings, render};
use crate::offline::session::Session;
use crate::offline::world::World;
use crate::sampling::luminance;
use crate::{Config, Estimator, Rate, Requirements};
use glam::DVec3;

/// Samples a cycle with which a prediction never gives up, to look at all of it: bandwidths do not depend on them.
const PATIENT: f32 = 1e-4;
/// Frames of one random direction a sample from which the integrand's spread is measured.
const MEASURED: u32 = 256;
/// Probes of figure 12.
const PROBES: [u32; 4] = [1, 4, 16, 64];
/// Probes of figure 14: n of them find no spread above the root of n - 1.
const MANY: u32 = 64;
/// Cycles/pixel, and standard deviations over the mean, at the bright end of a scale.
const FASTEST: f64 = 0.5;
const WIDEST: f64 = 4.0;
/// Images a side of figure 15's detail.
const DETAILS: usize = 4;

/// Labelled images in rows.
#[derive(Clone, Debug)]
pub struct Figure {
    /// `figure-06` for figure 6 of that paper.
    pub name: &'static str,
    /// What it shows.
    pub title: String,
    /// Tiles a row.
    pub columns: usize,
    /// Row by row.
    pub tiles: Vec<Tile>,
}

/// What figures are drawn of.
pub struct Stage<'a> {
    /// The scene.
    pub world: &'a World,
    /// Its settings.
    pub base: &'a Settings,
    /// Its converged image.
    pub reference: &'a Converged,
    /// The pixels of it over which errors are found.
    pub mask: Vec<bool>,
    /// What was measured in it.
    pub found: &'a SceneReport,
}

/// A rendered image and how far it is from the reference.
pub(super) struct Shot {
    pub image: LinearImage,
    shaded: f64,
    pub ms: f64,
    pub error: Metrics,
}

impl Stage<'_> {
    /// Draws all figures.
    ///
    /// # Errors
    /// The device's, and those of `keep`.
    pub fn draw(&self, keep: &mut dyn FnMut(Figure) -> Result<()>) -> Result<()> {
        keep(self.combinations()?)?;
        if let Some(figure) = self.equals()? {
            keep(figure)?;
        }
        keep(self.probes()?)?;
        keep(self.validation()?)?;
        keep(self.antialiasing()?)
    }

    pub(super) fn title(&self, what: &str) -> String {
        format!("{what}: {}, N = {}", self.world.name, self.base.config.directions)
    }

    pub(super) fn truth(&self) -> Picture {
        self.reference.image().picture
    }

    /// Of the reference.
    pub(super) fn exposure(&self) -> f64 {
        let (picture, mask) = (self.truth(), self.reference.mask());
        let sum: f64 = picture.rgb.iter().map(|&c| luminance(DVec3::from(c.map(f64::from)))).sum();
        Exposure::Auto.factor(sum / mask.iter().filter(|m| **m).count().max(1) as f64)
    }

    fn render(&self, config: Config, aovs: &[Aov], timed: bool) -> Result<Rendered> {
        render(self.world, &Settings { config, aovs: aovs.to_vec(), timed, ..self.base.clone() }, &mut |_, _, _| ())
    }

    fn predicted(&self) -> Config {
        Config { rate: Rate::Bandwidth, ..self.base.config.clone() }
    }

    /// With times, and with layers `aovs`.
    pub(super) fn shot(&self, config: Config, aovs: &[Aov]) -> Result<Shot> {
        let Rendered { image, stats } = self.render(config, aovs, true)?;
        let frame = Frame { picture: picture(&image), coverage: image.channel("A").unwrap_or_default().to_vec() };
        let error = quality::error(&[frame], &self.truth(), &self.mask)?;
        let shaded = stats.pixels.shaded as f64 / stats.pixels.covered.max(1) as f64;
        Ok(Shot { image, shaded, ms: stats.frame_ms.median, error })
    }

    fn photograph(&self, label: String, shot: &Shot) -> Tile {
        photograph(label, &picture(&shot.image), self.exposure())
    }

    /// Figure 6: the largest of the probes' bandwidths against their mean.
    fn combinations(&self) -> Result<Figure> {
        let mut tiles = Vec::new();
        for (name, combine) in [("mean", Combine::Mean), ("max", Combine::Max)] {
            let config = Config { combine, ..self.predicted() };
            let shot = self.shot(config.clone(), &[Aov::Level])?;
            let patient = Config { samples_per_cycle: Some(PATIENT), ..config };
            let image = self.render(patient, &[Aov::Bandwidth], false)?.image;
            let share = 100.0 * shot.shaded;
            tiles.push(self.photograph(format!("{name}: PSNR {:.1} dB, {:.1} ms", shot.error.psnr, shot.ms), &shot));
            tiles.push(heat(format!("bandwidth, 0 to {FASTEST} cycles a pixel"), &image, "bandwidth.Y", FASTEST));
            tiles.push(levels(format!("levels: {share:.1} % shaded\n{KEY}"), &shot.image));
        }
        let title = self.title("Figure 6: probes combined by their mean and by their maximum");
        Ok(Figure { name: "figure-06", title, columns: 3, tiles })
    }

    /// Figure 11: full rate with as much error, and in as much time. `None` where full rate was not measured.
    fn equals(&self) -> Result<Option<Figure>> {
        let mut tiles = Vec::new();
        let both = [("mis", Estimator::Mis, "bandwidth 64"), ("brdf-random", Estimator::BrdfRandom, "bandwidth brdf-random 64")];
        for (name, estimator, row) in both {
            let Some(equal) = self.found.row(row).and_then(|row| row.against(name)) else { continue };
            let full = |directions: f64| {
                let directions = (directions.round() as u32).clamp(2, 65536);
                let config = Config { rate: Rate::Full, estimator, directions, ..self.base.config.clone() };
                Ok::<_, crate::offline::error::Error>((directions, self.shot(config, &[])?))
            };
            let ours = self.shot(Config { estimator, ..self.predicted() }, &[])?;
            let label = |what: String, shot: &Shot| format!("{what}: {:.0} ms, rmse {:.2e}", shot.ms, shot.error.rmse);
            let (directions, shot) = full(equal.directions)?;
            let same = label(format!("{name}, full, N = {directions} for the error"), &shot);
            tiles.push(self.photograph(same, &shot));
            tiles.push(self.photograph(label(format!("{name}, bandwidth, N = {}", self.base.config.directions), &ours), &ours));
            let (directions, shot) = full(equal.directions_in_time)?;
            tiles.push(self.photograph(label(format!("{name}, full, N = {directions} for the time"), &shot), &shot));
        }
        let title = self.title("Figure 11: full rate at the same error (left) and in the same time (right)");
        Ok((!tiles.is_empty()).then_some(Figure { name: "figure-11", title, columns: 3, tiles }))
    }

    /// Figure 12: what is shaded, and that few probes are enough.
    fn probes(&self) -> Result<Figure> {
        let (mut images, mut masks) = (Vec::new(), Vec::new());
        for probes in PROBES {
            let shot = self.shot(Config { probes, ..self.predicted() }, &[Aov::Shaded])?;
            let label = format!("{probes} probes: PSNR {:.2} dB, {:.1} ms", shot.error.psnr, shot.ms);
            images.push(self.photograph(label, &shot));
            masks.push(mask(format!("{:.1} % of the covered pixels shaded", 100.0 * shot.shaded), &shot.image, "shaded.Y"));
        }
        let tiles = images.into_iter().chain(masks).collect();
        let title = self.title("Figure 12: shaded pixels by the number of probes");
        Ok(Figure { name: "figure-12", title, columns: PROBES.len(), tiles })
    }

    /// Figure 14: predicted spread and bandwidth against measured ones.
    fn validation(&self) -> Result<Figure> {
        let patient = Config { samples_per_cycle: Some(PATIENT), probes: MANY, ..self.predicted() };
        let predicted = self.render(patient.clone(), &[Aov::Bandwidth, Aov::Spread], false)?.image;
        let shot = self.shot(self.predicted(), &[])?;
        let [width, height] = self.base.config.extent;
        let layer = |values: Vec<Option<f64>>| LinearImage {
            width,
            height,
            channels: vec![("Y".into(), values.iter().map(|v| v.unwrap_or(f64::NAN) as f32).collect())],
        };
        let (truth, seen) = (self.truth(), self.reference.mask());
        let grey = truth.rgb.iter().zip(&seen).map(|(c, seen)| seen.then(|| luminance(DVec3::from(c.map(f64::from)))));
        let frequency = layer(spectrum::map(&grey.collect::<Vec<_>>(), width as usize));
        let spread = layer(self.spread()?);
        let ratio = |name: &str, measured: &LinearImage, least| covered_median(&predicted, name, measured, least);
        let said = |what: &str, ratio: Option<f64>| match ratio {
            Some(ratio) => format!("{what}\nmedian of predicted over measured {ratio:.2}"),
            None => format!("{what}\nnowhere known"),
        };
        let tiles = vec![
            heat(format!("spread by {} probes, 0 to {WIDEST}", patient.probes), &predicted, "spread.Y", WIDEST),
            heat(said(&format!("spread of {MEASURED} samples"), ratio("spread.Y", &spread, 0.0)), &spread, "Y", WIDEST),
            self.photograph(format!("PSNR {:.1} dB", shot.error.psnr), &shot),
            heat(format!("bandwidth predicted, 0 to {FASTEST} cycles a pixel"), &predicted, "bandwidth.Y", FASTEST),
            heat(
                said(
                    &format!("in windows of 32x32, above {} cycles a pixel", spectrum::LEAST),
                    ratio("bandwidth.Y", &frequency, spectrum::LEAST),
                ),
                &frequency,
                "Y",
                FASTEST,
            ),
            difference("difference, 4 times as displayed".into(), [&picture(&shot.image), &truth], self.exposure(), GAIN),
        ];
        let title = self.title("Figure 14: variance and bandwidth, predicted and measured");
        Ok(Figure { name: "figure-14", title, columns: 3, tiles })
    }

    /// Standard deviation over mean of what one random reflectance direction finds, where something is seen and lit.
    fn spread(&self) -> Result<Vec<Option<f64>>> {
        let config = Config { rate: Rate::Full, estimator: Estimator::BrdfRandom, directions: 1, ..self.base.config() };
        let headless = Headless::new(&self.base.device, &Requirements::of(&config))?;
        let mut session = Session::new(headless, self.world, &config)?;
        let mut sums: Vec<[f64; 2]> = Vec::new();
        for frame in 0..MEASURED {
            session.frame([2, frame])?;
            let Frame { picture, .. } = Frame::read(&mut session)?;
            sums.resize(picture.rgb.len(), [0.0; 2]);
            for ([sum, squares], c) in sums.iter_mut().zip(&picture.rgb) {
                let value = luminance(DVec3::from(c.map(f64::from)));
                *sum += value;
                *squares += value * value;
            }
        }
        let count = f64::from(MEASURED);
        let of = |([sum, squares], seen): (&[f64; 2], bool)| {
            let mean = sum / count;
            (seen && mean > 0.0).then(|| (squares / count - mean * mean).max(0.0).sqrt() / mean)
        };
        Ok(sums.iter().zip(self.reference.mask()).map(of).collect())
    }

    /// Figure 15: antialiasing as levels finer than a pixel, in the detail that has most edges.
    fn antialiasing(&self) -> Result<Figure> {
        let (mut images, mut maps) = (Vec::new(), Vec::new());
        let exposure = self.exposure();
        for side in [1, 2, 4] {
            let config = Config { samples_per_side: side, ..self.predicted() };
            let Rendered { image, stats } = self.render(config, &[Aov::Level], true)?;
            let finer: u64 = stats.pixels.by_level.iter().filter(|(level, _)| **level < 0).map(|(_, count)| count).sum();
            let share = |part: u64, of: u64| 100.0 * part as f64 / of.max(1) as f64;
            let label = format!("{} samples a pixel: {:.1} ms", side * side, stats.frame_ms.median);
            images.push(photograph(label, &picture(&image), exposure));
            let shaded = share(stats.pixels.shaded, stats.pixels.covered);
            let finer = share(finer, stats.pixels.shaded);
            let label = format!("levels: {shaded:.1} % shaded, {finer:.0} % of it finer than a pixel\n{KEY}");
            maps.push(levels(label, &image));
        }
        let first = images.first().map(|tile| tile.busiest(DETAILS)).unwrap_or_default();
        let tiles = images.iter().chain(&maps).map(|tile| tile.detail(first, DETAILS)).collect();
        let title = self.title("Figure 15: antialiasing by finer levels");
        Ok(Figure { name: "figure-15", title, columns: images.len(), tiles })
    }
}

pub(super) fn picture(image: &LinearImage) -> Picture {
    Picture { width: image.width, height: image.height, rgb: image.rgb().unwrap_or_default() }
}
