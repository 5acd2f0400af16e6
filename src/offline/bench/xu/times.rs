//! What each filter costs: maps on change, shading in every frame, beside 64 samples a pixel (Xu et al. 2017, table 1).
//!
//! Frames of all filters and of the supersampled one alternate. They look the environment up as it is convolved beforehand, as
//! in the paper; its convolution is the same for all and not counted. Maps are made anew before every timed frame.

use crate::gpu::timer::FrameTimings;
use crate::offline::bench::runner::{Timed, WARM_UP, interleave};
use crate::offline::bench::statistics::{Summary, ratio_of_medians};
use crate::offline::bench::xu::report::{Cost, Rate, Row};
use crate::offline::bench::xu::{Stage, open};
use crate::offline::error::{Error, Result};
use crate::offline::headless::DeviceInfo;
use crate::offline::session::Session;
use crate::offline::world::World;
use crate::pass::{base, filter, shade, vmf_mips};
use crate::{Config, Estimator, Filter};
use std::sync::Arc;

/// Times the pixels a side of supersampling: 64 samples a pixel.
const FINER: u32 = 8;
/// Directions where a material refuses the estimator preconvolved.
const DIRECTIONS: u32 = 64;
/// The filter that others are compared with.
const LEAN: &str = "lean";

/// What was found beside the rows.
pub(super) struct Costs {
    pub device: DeviceInfo,
    pub texels: u64,
    pub estimator: &'static str,
    pub supersampling: Cost,
}

/// A session whose maps are made anew before every timed frame.
struct Subject<'a> {
    session: Session,
    world: &'a World,
    /// Absent for the supersampled one.
    filter: Option<Filter>,
    rounds: u32,
    /// Of every timed frame.
    set_up_ms: Vec<f64>,
    /// Of the pass that makes mips.
    mips_ms: Vec<f64>,
}

impl Timed for Subject<'_> {
    fn frame(&mut self, seed: [u32; 2]) -> Result<()> {
        let timed = (WARM_UP..WARM_UP + self.rounds).contains(&seed[1]);
        if timed && self.filter.is_some_and(Filter::stores) {
            let times = self.session.renew_materials(self.world)?;
            self.set_up_ms.push(times.iter().map(|(_, ms)| ms).sum());
            self.mips_ms.extend(times.iter().filter(|(name, _)| *name == vmf_mips::NAME).map(|(_, ms)| ms));
        }
        self.session.frame(seed)
    }

    fn timings(&self) -> Option<&FrameTimings> {
        self.session.timings()
    }
}

/// Times of every filter that took the still, into its row; `copy` is how fast the device copies.
pub(super) fn measure(
    stage: &Stage<'_>,
    rows: &mut [Row],
    copy: Option<Summary>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Costs> {
    let config = |filter, extent, estimator| {
        let directions = if estimator == Estimator::Mis { DIRECTIONS } else { 1 };
        Config { estimator, directions, ..stage.config(filter, extent, DIRECTIONS) }
    };
    let subject = |filter: Option<Filter>, extent, estimator| -> Result<std::result::Result<Subject<'_>, String>> {
        let world = &stage.world;
        let session = open(world, &config(filter.unwrap_or_default(), extent, estimator), stage.device())?;
        Ok(session.map(|session| Subject {
            session,
            world,
            filter,
            rounds: stage.rounds,
            set_up_ms: Vec::new(),
            mips_ms: Vec::new(),
        }))
    };
    let extent = stage.config.extent;
    let mut estimator = (Estimator::Preconvolved, "preconvolved");
    let mut first = subject(None, extent.map(|e| e * FINER), estimator.0)?;
    if first.is_err() {
        estimator = (Estimator::Mis, "mis");
        first = subject(None, extent.map(|e| e * FINER), estimator.0)?;
    }
    let mut subjects = vec![first.map_err(|reason| Error::argument("scene", "materials that can be rendered", reason))?];
    for (filter, row) in stage.order.filters.iter().copied().zip(rows.iter_mut()).filter(|(_, row)| row.refused.is_none()) {
        match subject(Some(filter), extent, estimator.0)? {
            Ok(subject) => subjects.push(subject),
            Err(reason) => row.refused = Some(reason),
        }
    }
    let times = interleave(&mut subjects, stage.rounds, progress)?;

    let shading = |times: &[FrameTimings]| -> Vec<f64> {
        let passes = [filter::NAME, base::NAME, shade::NAME];
        times.iter().map(|t| t.passes.iter().filter(|p| passes.contains(&p.0)).map(|p| p.1).sum()).collect()
    };
    let spans = |times: &[FrameTimings]| times.iter().map(|t| t.span_ms).collect::<Vec<_>>();
    let named = |name: &str| {
        let known = subjects.iter().position(|s| s.filter.is_some_and(|filter| filter.name() == name));
        known.and_then(|i| times.get(i)).map(|times| shading(times))
    };
    let (lean, texels) = (named(LEAN), texels(&stage.world));
    let plain = subjects.iter().find(|s| s.filter == Some(Filter::Point)).map_or(0, |s| s.session.material_bytes());
    let supersampled = times.first().map(|times| shading(times)).unwrap_or_default();
    let cost = |subject: &Subject<'_>, times: &[FrameTimings]| {
        let shade = shading(times);
        let set_up = &subject.set_up_ms;
        let both: Vec<f64> = shade.iter().zip(set_up).map(|(a, b)| a + b).collect();
        let has_maps = set_up.iter().any(|ms| *ms > 0.0);
        let set_up_ms = has_maps.then(|| Summary::of(set_up));
        let is_filter = subject.filter.is_some();
        let bytes = subject.session.set_up_bytes().iter().find(|(name, _)| *name == vmf_mips::NAME).map(|(_, bytes)| *bytes);
        let mips = bytes.filter(|_| subject.mips_ms.iter().any(|ms| *ms > 0.0)).map(|bytes| {
            let ms = Summary::of(&subject.mips_ms);
            let gb_per_s = bytes as f64 / (ms.median * 1e6);
            Rate { ms, bytes, gb_per_s, of_copy: copy.map(|copy| gb_per_s / copy.median) }
        });
        let each = |total: f64| (has_maps && texels > 0).then(|| total / texels as f64);
        Cost {
            set_up_ms,
            mips,
            shade_ms: Summary::of(&shade),
            frame_ms: Summary::of(&spans(times)),
            gain: ratio_of_medians(&supersampled, &shade).filter(|_| is_filter),
            gain_with_set_up: ratio_of_medians(&supersampled, if has_maps { &both } else { &shade }).filter(|_| is_filter),
            over_lean: lean.as_ref().and_then(|lean| ratio_of_medians(&shade, lean)).filter(|_| is_filter),
            ns_a_texel: set_up_ms.and_then(|ms| each(ms.median * 1e6)),
            bytes_a_texel: each(subject.session.material_bytes().saturating_sub(plain) as f64),
        }
    };
    let mut supersampling = None;
    for (subject, times) in subjects.iter().zip(&times) {
        let found = cost(subject, times);
        match subject.filter {
            None => supersampling = Some(found),
            Some(filter) => {
                if let Some(row) = rows.iter_mut().find(|row| row.filter == filter.name()) {
                    row.cost = Some(found);
                }
            }
        }
    }
    let first = subjects.first().zip(supersampling).ok_or_else(|| Error::Device("no frame was timed".into()))?;
    let device = first.0.session.headless().info().clone();
    Ok(Costs { device, texels, estimator: estimator.1, supersampling: first.1 })
}

/// Texels of the base levels of all different pairs of maps that filters read together.
fn texels(world: &World) -> u64 {
    let mut known = Vec::new();
    for material in &world.materials {
        let (normal, roughness) = (material.maps.normal.as_ref(), material.maps.roughness.as_ref().map(|(map, _)| map));
        let pair = [normal, roughness].map(|map| map.map(Arc::as_ptr));
        let sizes = [normal, roughness].map(|map| map.map_or([0; 2], |map| map.size()));
        let [width, height] = [0, 1].map(|i| u64::from(sizes[0][i].max(sizes[1][i])));
        if !known.iter().any(|(k, _)| *k == pair) {
            known.push((pair, width * height));
        }
    }
    known.iter().map(|(_, texels)| texels).sum()
}
