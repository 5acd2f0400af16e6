//! The figure of the suite joined: the truth, each method alone, and the frame that has all of them; where that is shaded, and how far
//! each is from the truth.

use crate::offline::aov::Aov;
use crate::offline::bench::figures::{Figure, Shot, Stage, picture};
use crate::offline::bench::tiles::{DECISIONS, GAIN, KEY, Tile, decisions, difference, levels, photograph};
use crate::offline::error::Result;
use crate::offline::metrics::Picture;
use crate::{Config, Estimator, Filter, Rate};

/// Directions of the estimates.
const DIRECTIONS: u32 = 64;

impl Stage<'_> {
    /// Draws it.
    ///
    /// # Errors
    /// The device's.
    pub fn together(&self) -> Result<Figure> {
        let shot = |filter, estimator, rate, aovs: &[Aov]| {
            self.shot(Config { filter, estimator, rate, directions: DIRECTIONS, ..self.base.config.clone() }, aovs)
        };
        let point = shot(Filter::Point, Estimator::Mis, Rate::Full, &[])?;
        let filtered = shot(Filter::Clusters, Estimator::Mis, Rate::Full, &[])?;
        let predicted = shot(Filter::Clusters, Estimator::Mis, Rate::Bandwidth, &[Aov::Level])?;
        let base = shot(Filter::Clusters, Estimator::Preconvolved, Rate::Full, &[])?;
        let joined = shot(Filter::Clusters, Estimator::Residual, Rate::Bandwidth, &[Aov::Decision])?;
        let (truth, exposure) = (self.truth(), self.exposure());
        let photo = |name: &str, shot: &Shot| {
            let label = format!("{name}\nPSNR {:.1} dB, relMSE {:.1e}, {:.1} ms", shot.error.psnr, shot.error.relmse, shot.ms);
            photograph(label, &picture(&shot.image), exposure)
        };
        let off = |name: &str, of: &Picture| {
            difference(format!("{name}: difference, {GAIN} times as displayed"), [of, &truth], exposure, GAIN)
        };
        let tiles: Vec<Tile> = vec![
            photograph("truth".into(), &truth, exposure),
            photo(&format!("point, mis, N = {DIRECTIONS}"), &point),
            photo(&format!("clusters, mis, N = {DIRECTIONS}"), &filtered),
            photo(&format!("clusters, predicted rate, N = {DIRECTIONS}"), &predicted),
            photo("clusters, light looked up", &base),
            photo(&format!("clusters, light looked up and residual, N = {DIRECTIONS}"), &joined),
            levels(KEY.into(), &predicted.image),
            off("point", &picture(&point.image)),
            off("clusters", &picture(&filtered.image)),
            off("predicted rate", &picture(&predicted.image)),
            off("light looked up", &picture(&base.image)),
            off("light looked up and residual", &picture(&joined.image)),
            decisions(DECISIONS.into(), &joined.image),
        ];
        let title = format!("{}: filters, rates and light that is looked up, together", self.world.name);
        Ok(Figure { name: "together", title, columns: 6, tiles })
    }
}
