//! Comparison strips: the truth and every filter side by side, and below each how far it is off (figures 1, 2 and 4 to 6 of Xu
//! et al. 2017).

use crate::offline::bench::figures::Figure;
use crate::offline::bench::reference::Converged;
use crate::offline::bench::tiles::{Tile, difference, photograph};
use crate::offline::bench::xu::Stage;
use crate::offline::bench::xu::cases::Light;
use crate::offline::bench::xu::report::Row;
use crate::offline::bench::xu::stills::Still;
use crate::offline::metrics::{Exposure, Picture};
use crate::sampling::luminance;
use glam::DVec3;

/// The most filters beside a truth.
const MOST_BESIDE: usize = 7;
/// What differences are multiplied with: those of filters are large.
const GAIN: f64 = 2.0;
/// Images a side of the truth's detail.
const PARTS: usize = 4;

/// The strip of a scene under a light.
pub(super) fn strip(stage: &Stage<'_>, truth: &Converged, stills: &[Still], rows: &[Row]) -> Figure {
    let (picture, mask) = (truth.image().picture, truth.mask());
    let exposure = exposure(&picture, &mask);
    let error = |still: &Still| rows.iter().find(|row| row.filter == still.filter.name()).and_then(|row| row.errors.as_ref());
    let whole = photograph(format!("truth, {} sub-samples a pixel", truth.directions()), &picture, exposure);
    let mut detail = whole.detail(whole.busiest(PARTS), PARTS);
    detail.label = "its busiest part; beside it differences, 2 times".into();
    let mut tiles = Vec::new();
    // Rows of nearly one length.
    let rows_of_images = stills.len().div_ceil(MOST_BESIDE).max(1);
    let beside = stills.len().div_ceil(rows_of_images).max(1);
    for some in stills.chunks(beside) {
        let empty = || Tile { label: String::new(), rgb: vec![[255; 3]; whole.rgb.len()], ..whole };
        let fill = |row: &mut Vec<Tile>| row.resize_with(beside + 1, empty);
        let mut images = vec![whole.clone()];
        images.extend(some.iter().map(|still| photograph(still.filter.name().into(), &still.picture, exposure)));
        fill(&mut images);
        let mut apart = vec![detail.clone()];
        apart.extend(some.iter().map(|still| {
            let label = error(still).map_or(String::new(), |e| format!("rel. L2 {:.3}, {:.1} dB", e.rel_l2, e.psnr));
            difference(label, [&still.picture, &picture], exposure, GAIN)
        }));
        fill(&mut apart);
        tiles.extend(images.into_iter().chain(apart));
    }
    let (name, light) = match stage.light {
        Light::Point => ("point", "under point lights"),
        Light::Environment => ("environment", "under an environment"),
    };
    Figure { name, title: format!("{} {light}", stage.world.name), columns: beside + 1, tiles }
}

/// As the metrics display it.
fn exposure(picture: &Picture, mask: &[bool]) -> f64 {
    let seen = picture.rgb.iter().zip(mask).filter(|(_, seen)| **seen);
    let sum: f64 = seen.map(|(&c, _)| luminance(DVec3::from(c.map(f64::from)))).sum();
    Exposure::Auto.factor(sum / mask.iter().filter(|m| **m).count().max(1) as f64)
}
