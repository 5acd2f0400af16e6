//! What each filter costs: maps on change, shading in every frame, beside 64 samples a pixel (Xu et al. 2017, table 1).
//!
//! Frames of all filters and of the supersampled one alternate. They look the environment up as it is convolved beforehand, as
//! in the paper; its convolution is the same for all and not counted. Maps are made anew before every timed frame under the first of a
//! scene's lights: they are the same under the other.

use crate::gpu::timer::FrameTimings;
use crate::offline::bench::runner::{Timed, WARM_UP, interleave};
use crate::offline::bench::statistics::{Summary, ratio_of_medians};
use crate::offline::bench::xu::report::{Cost, Rate, Row};
use crate::offline::bench::xu::stills::Kept;
use crate::offline::bench::xu::{Stage, open};
use crate::offline::error::{Error, Result};
use crate::offline::headless::DeviceInfo;
use crate::offline::session::Session;
use crate::offline::world::World;
use crate::pass::{base, filter, shade, vmf_mips};
use crate::{Config, Estimator, Filter};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Times the pixels a side of supersampling: 64 samples a pixel.
const FINER: u32 = 8;
/// Directions where a material refuses the estimator preconvolved.
const DIRECTIONS: u32 = 64;
/// The filters that others are compared with: in memory, and in time.
pub(super) const COMPARED: [Filter; 2] = [Filter::Point, Filter::Lean];
const LEAN: &str = "lean";

/// What was found beside the rows.
pub(super) struct Costs {
    pub device: DeviceInfo,
    pub texels: u64,
    pub estimator: &'static str,
    pub supersampling: Cost,
}

/// What making maps took in every timed frame.
#[derive(Clone, Default)]
pub(super) struct SetUp {
    ms: Vec<f64>,
    /// Of the pass that makes mips.
    mips_ms: Vec<f64>,
    /// What the maps take.
    bytes: u64,
}

/// A session whose maps are made anew before every timed frame, until that is known.
struct Subject {
    session: Session,
    /// Absent for the supersampled one.
    filter: Option<Filter>,
    rounds: u32,
    set_up: SetUp,
}

impl Timed for Subject {
    fn frame(&mut self, seed: [u32; 2]) -> Result<()> {
        let timed = (WARM_UP..WARM_UP + self.rounds).contains(&seed[1]);
        if timed && self.filter.is_some_and(Filter::stores) {
            let times = self.session.remake_materials()?;
            self.set_up.ms.push(times.iter().map(|(_, ms)| ms).sum());
            self.set_up.mips_ms.extend(times.iter().filter(|(name, _)| *name == vmf_mips::NAME).map(|(_, ms)| ms));
        }
        self.session.frame(seed)
    }

    fn timings(&self) -> Option<&FrameTimings> {
        self.session.timings()
    }
}

/// Times of every filter whose session is `kept`, in that session where light is looked up, into its row. `copy` is how fast the
/// device copies, and `known` what maps took before, under another light or of other filters, or will hold it.
pub(super) fn measure(
    stage: &Stage<'_>,
    rows: &mut [Row],
    kept: Vec<Kept>,
    copy: Option<Summary>,
    known: &mut BTreeMap<&'static str, SetUp>,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Costs> {
    let config = |filter, extent, estimator| {
        let directions = if estimator == Estimator::Mis { DIRECTIONS } else { 1 };
        Config { estimator, directions, ..stage.config(filter, extent, DIRECTIONS) }
    };
    let opened = |filter: Option<Filter>, extent, estimator| {
        open(&stage.world, &config(filter.unwrap_or_default(), extent, estimator), stage.device())
    };
    let extent = stage.config.extent;
    let mut estimator = (Estimator::Preconvolved, "preconvolved");
    let mut first = opened(None, extent.map(|e| e * FINER), estimator.0)?;
    if first.is_err() {
        estimator = (Estimator::Mis, "mis");
        first = opened(None, extent.map(|e| e * FINER), estimator.0)?;
    }
    let first = first.map_err(|reason| Error::argument("scene", "materials that can be rendered", reason))?;
    let mut subjects = vec![Subject { session: first, filter: None, rounds: 0, set_up: SetUp::default() }];
    for Kept { filter, session, looks_up } in kept {
        let suits = looks_up && estimator.0 == Estimator::Preconvolved;
        let session = if suits { Ok(session) } else { opened(Some(filter), extent, estimator.0)? };
        let set_up = known.get(filter.name()).cloned();
        let rounds = if set_up.is_some() { 0 } else { stage.rounds };
        match session {
            Ok(session) => {
                let set_up = set_up.unwrap_or_else(|| SetUp { bytes: session.material_bytes(), ..SetUp::default() });
                subjects.push(Subject { session, filter: Some(filter), rounds, set_up });
            }
            Err(reason) => {
                rows.iter_mut().filter(|row| row.filter == filter.name()).for_each(|row| row.refused = Some(reason.clone()))
            }
        }
    }
    // Filters are compared with one that is timed in the same frames.
    if rows.iter().any(|row| row.filter == LEAN && row.cost.is_some()) {
        let lean = opened(Some(Filter::Lean), extent, estimator.0)?;
        let set_up = known.get(LEAN).cloned().unwrap_or_default();
        subjects.extend(lean.ok().map(|session| Subject { session, filter: Some(Filter::Lean), rounds: 0, set_up }));
    }
    let times = interleave(&mut subjects, stage.rounds, progress)?;
    known.extend(subjects.iter().filter_map(|s| Some((s.filter?.name(), s.set_up.clone()))));

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
    let plain = known.get(Filter::Point.name()).map_or(0, |made| made.bytes);
    let supersampled = times.first().map(|times| shading(times)).unwrap_or_default();
    let cost = |subject: &Subject, times: &[FrameTimings]| {
        let shade = shading(times);
        let SetUp { ms: set_up, mips_ms, bytes: held } = &subject.set_up;
        let both: Vec<f64> = shade.iter().zip(set_up).map(|(a, b)| a + b).collect();
        let has_maps = set_up.iter().any(|ms| *ms > 0.0);
        let set_up_ms = has_maps.then(|| Summary::of(set_up));
        let is_filter = subject.filter.is_some();
        let bytes = subject.session.set_up_bytes().iter().find(|(name, _)| *name == vmf_mips::NAME).map(|(_, bytes)| *bytes);
        let mips = bytes.filter(|_| mips_ms.iter().any(|ms| *ms > 0.0)).map(|bytes| {
            let ms = Summary::of(mips_ms);
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
            bytes_a_texel: each(held.saturating_sub(plain) as f64),
        }
    };
    let mut supersampling = None;
    for (subject, times) in subjects.iter().zip(&times) {
        let found = cost(subject, times);
        match subject.filter {
            None => supersampling = Some(found),
            Some(filter) => {
                if let Some(row) = rows.iter_mut().find(|row| row.filter == filter.name()) {
                    row.cost.get_or_insert(found);
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
