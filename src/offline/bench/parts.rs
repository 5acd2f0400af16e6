//! The figure of the suite residual: light that is looked up, what it leaves and what is found of that, beside the truth.

use crate::offline::aov::Aov;
use crate::offline::bench::figures::{Figure, Shot, Stage, picture};
use crate::offline::bench::tiles::{DECISIONS, GAIN, Tile, decisions, difference, heat, photograph, signed};
use crate::offline::error::Result;
use crate::offline::metrics::Picture;
use crate::{Config, Estimator, Rate};

/// Directions of the estimates.
const DIRECTIONS: u32 = 64;
/// The bright end of the scale of errors.
const MOST_ERROR: f64 = 0.5;
/// Ends of the scale of signed differences, of 1 as displayed.
const MOST: f64 = 0.1;

impl Stage<'_> {
    /// Draws it.
    ///
    /// # Errors
    /// The device's.
    pub fn parts(&self) -> Result<Figure> {
        let shot = |estimator, rate, directions, aovs: &[Aov]| {
            self.shot(Config { estimator, rate, directions, ..self.base.config.clone() }, aovs)
        };
        let full = shot(Estimator::Mis, Rate::Full, DIRECTIONS, &[])?;
        let base = shot(Estimator::Preconvolved, Rate::Full, 1, &[Aov::FitError])?;
        let result = shot(Estimator::Residual, Rate::Bandwidth, DIRECTIONS, &[Aov::Decision])?;
        let (truth, exposure) = (self.truth(), self.exposure());
        let shown = |shot: &Shot| picture(&shot.image);
        let photo = |name: &str, shot: &Shot| {
            let label = format!("{name}\nPSNR {:.1} dB, relMSE {:.1e}, {:.1} ms", shot.error.psnr, shot.error.relmse, shot.ms);
            photograph(label, &shown(shot), exposure)
        };
        let off = |name: &str, of: &Picture| {
            difference(format!("{name}: difference, {GAIN} times as displayed"), [of, &truth], exposure, GAIN)
        };
        let apart = |name: &str, pair| {
            signed(format!("{name}\nblue -{MOST} to orange {MOST} of what is displayed"), pair, exposure, MOST)
        };
        let tiles: Vec<Tile> = vec![
            photograph("truth".into(), &truth, exposure),
            photo(&format!("full rate, mis, N = {DIRECTIONS}"), &full),
            photo("base: light looked up", &base),
            photo(&format!("base and residual, N = {DIRECTIONS}"), &result),
            heat(format!("light that the fit misses, 0 to {MOST_ERROR}"), &base.image, "fit-error.Y", MOST_ERROR),
            off("mis", &shown(&full)),
            off("base", &shown(&base)),
            off("base and residual", &shown(&result)),
            decisions(DECISIONS.into(), &result.image),
            apart("mis without the truth: noise", [&shown(&full), &truth]),
            apart("truth without the base", [&truth, &shown(&base)]),
            apart("residual: the result without the base", [&shown(&result), &shown(&base)]),
        ];
        let title = format!("{}: light looked up, and what it leaves", self.world.name);
        Ok(Figure { name: "parts", title, columns: 4, tiles })
    }
}
