//! One image of each filter, and how far it is from the truth.

use crate::offline::aov::Aov;
use crate::offline::bench::quality::{self, Frame};
use crate::offline::bench::reference::Converged;
use crate::offline::bench::xu::cases::Light;
use crate::offline::bench::xu::report::{Errors, Row};
use crate::offline::bench::xu::{Stage, finite, open};
use crate::offline::error::Result;
use crate::offline::metrics::Picture;
use crate::offline::session::Session;
use crate::{Config, Filter};

/// Directions of one frame under an environment; frames are added until their noise is low.
const DIRECTIONS: u32 = 256;
/// The error over the noise that is low enough.
const MARGIN: f64 = 10.0;
/// Frames after which it is as it is; of a filter that draws lobes, which need more.
const MOST_FRAMES: [u32; 2] = [8, 16];
/// Of the maps of filters that are measured together, before the last of them.
const MOST_BYTES: u64 = 4 << 30;
/// Of frames, whose numbers tell them from those that are timed.
const SEED: u32 = 3;

/// An image with the filter that made it.
pub(super) struct Still {
    pub filter: Filter,
    pub picture: Picture,
    /// With the estimator preconvolved.
    preconvolved: Option<Picture>,
    directions: u32,
    noise: f64,
}

/// A filter's session, kept from its image on.
pub(super) struct Kept {
    pub filter: Filter,
    pub session: Session,
    /// Whether light is looked up in its frames.
    pub looks_up: bool,
}

/// Filters that are measured together, as their maps are in memory together.
pub(super) struct Group {
    pub stills: Vec<Still>,
    /// Of those that did not refuse.
    pub kept: Vec<Kept>,
}

/// Renders the first of `filters`, until their maps fill [`MOST_BYTES`]; those that refuse have it in their row. The filters that are
/// left.
pub(super) fn take<'f>(
    stage: &Stage<'_>,
    truth: &Converged,
    filters: &'f [Filter],
    rows: &mut [Row],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(Group, &'f [Filter])> {
    let total = rows.len();
    let reference = (truth.image().picture, truth.whole());
    let (mut stills, mut kept): (Vec<Still>, Vec<Kept>) = (Vec::new(), Vec::new());
    let mut rest = filters;
    while let Some((filter, more)) = rest.split_first() {
        if kept.iter().map(|k| k.session.material_bytes()).sum::<u64>() > MOST_BYTES {
            break;
        }
        rest = more;
        let Some(row) = rows.iter_mut().find(|row| row.filter == filter.name()) else { continue };
        let filter = *filter;
        let config = stage.config(filter, stage.config.extent, DIRECTIONS);
        // Of points the same is summed exactly by all.
        let mut looked_up = stage.looked_up(filter, stage.config.extent)?;
        let shared = if stage.light == Light::Point { looked_up.take() } else { None };
        let shares = shared.is_some();
        let drawn = match shared {
            Some(session) => Ok(session),
            None => open(&stage.world, &config, stage.device())?,
        };
        match drawn {
            Ok(mut session) => {
                let (picture, frames, noise) = average(stage, filter, &mut session, (&reference.0, &reference.1))?;
                row.lobes = lobes(&mut session, &config)?;
                let preconvolved = looked_up.as_mut().map(frame).transpose()?;
                let directions = if stage.light == Light::Point { 0 } else { frames * DIRECTIONS };
                stills.push(Still { filter, picture, preconvolved, directions, noise });
                let looks_up = shares || looked_up.is_some();
                kept.push(Kept { filter, session: looked_up.unwrap_or(session), looks_up });
            }
            Err(reason) => row.refused = Some(reason),
        }
        progress((total - rest.len()) as u64, total as u64);
    }
    Ok((Group { stills, kept }, rest))
}

/// The mean of enough frames, how many they are, and their noise as a part of the mean.
fn average(
    stage: &Stage<'_>,
    filter: Filter,
    session: &mut Session,
    (truth, mask): (&Picture, &[bool]),
) -> Result<(Picture, u32, f64)> {
    session.frame([SEED, 0])?;
    let first = Frame::read(session)?.picture;
    if stage.light == Light::Point && !filter.is_random() {
        return Ok((first, 1, 0.0));
    }
    let mut halves = [sums(&first), vec![[0.0; 3]; first.rgb.len()]];
    let mut frames = 1;
    loop {
        session.frame([SEED, frames])?;
        let next = sums(&Frame::read(session)?.picture);
        let half = &mut halves[frames as usize % 2];
        half.iter_mut().zip(next).for_each(|(sum, v)| *sum = [0, 1, 2].map(|c| sum[c] + v[c]));
        frames += 1;
        // Halves of as many frames, and no more looks than doublings.
        if !frames.is_power_of_two() {
            continue;
        }
        let mean = |of: &dyn Fn(usize) -> [f64; 3], count: u32| Picture {
            rgb: (0..first.rgb.len()).map(|i| of(i).map(|v| (v / f64::from(count)) as f32)).collect(),
            ..first
        };
        let [a, b] = [0, 1].map(|h: usize| mean(&|i| halves[h][i], frames / 2));
        let whole = mean(&|i| [0, 1, 2].map(|c| halves[0][i][c] + halves[1][i][c]), frames);
        let noise = finite(quality::noise([&a, &b], mask)?.rel_l2, "the noise of a still")?;
        let error = quality::error(&[Frame { picture: whole.clone(), coverage: Vec::new() }], truth, mask)?.rel_l2;
        if frames >= MOST_FRAMES[usize::from(filter.is_random())] || noise * MARGIN <= error {
            return Ok((whole, frames, noise));
        }
    }
}

fn sums(picture: &Picture) -> Vec<[f64; 3]> {
    picture.rgb.iter().map(|c| c.map(f64::from)).collect()
}

/// One frame.
fn frame(session: &mut Session) -> Result<Picture> {
    session.frame([SEED, 0])?;
    Ok(Frame::read(session)?.picture)
}

/// Lobes of the session's last frame, a covered pixel.
fn lobes(session: &mut Session, config: &Config) -> Result<Option<f64>> {
    if !config.filter.stores() {
        return Ok(None);
    }
    let Some((_, values)) = Aov::Lobes.read(session, config)?.into_iter().next() else { return Ok(None) };
    let covered = Frame::read(session)?.coverage;
    let each: Vec<f64> = values.iter().zip(covered).filter(|(_, a)| *a > 0.0).map(|(v, _)| f64::from(*v)).collect();
    Ok((!each.is_empty()).then(|| each.iter().sum::<f64>() / each.len() as f64))
}

/// Errors of `stills` into their rows.
pub(super) fn judge(stills: &mut [Still], truth: &Converged, rows: &mut [Row]) -> Result<()> {
    let (picture, mask) = (truth.image().picture, truth.whole());
    let [a, b] = &truth.halves();
    let noise = quality::noise([a, b], &mask)?.rel_l2;
    let sum = |of: &Picture| -> f64 {
        let judged = of.rgb.iter().zip(&mask).filter(|(_, judged)| **judged);
        judged.flat_map(|(c, _)| c).map(|v| f64::from(*v)).sum()
    };
    let errors = |of: &Picture, directions, own| -> Result<Errors> {
        let metrics = quality::error(&[Frame { picture: of.clone(), coverage: Vec::new() }], &picture, &mask)?;
        Ok(Errors::new(&metrics, sum(of) / sum(&picture), directions, [own, noise]))
    };
    for still in stills {
        let Some(row) = rows.iter_mut().find(|row| row.filter == still.filter.name()) else { continue };
        row.errors = Some(errors(&still.picture, still.directions, still.noise)?);
        row.preconvolved = still.preconvolved.as_ref().map(|of| errors(of, 0, 0.0)).transpose()?;
    }
    Ok(())
}
