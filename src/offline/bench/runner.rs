//! Frames of several variants in turn, so that whatever else the machine does falls on all of them alike.

use crate::gpu::timer::FrameTimings;
use crate::offline::bench::quality::Frame;
use crate::offline::error::Result;
use crate::offline::headless::Headless;
use crate::offline::render::{self, Settings};
use crate::offline::session::Session;
use crate::offline::stats::Stats;
use crate::offline::world::World;
use crate::{Config, Requirements};
use serde::Serialize;

/// Frames of each variant before timing starts.
pub const WARM_UP: u32 = render::WARM_UP;

/// Something that renders frames and knows their times a frame late.
pub trait Timed {
    /// Renders a frame of this seed and waits for it.
    ///
    /// # Errors
    /// The device's.
    fn frame(&mut self, seed: [u32; 2]) -> Result<()>;

    /// Times of the frame before the last.
    fn timings(&self) -> Option<&FrameTimings>;
}

/// Times of `rounds` frames of each subject, after [`WARM_UP`] frames each. Every other round runs backwards: A B B A. One
/// more frame of each, whose own time is not kept, brings the last one's. `progress` is told how many of how many frames are
/// done. Without timestamps nothing is found.
///
/// # Errors
/// The device's.
pub fn interleave<T: Timed>(
    subjects: &mut [T],
    rounds: u32,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Vec<FrameTimings>>> {
    let count = subjects.len();
    let mut times = vec![Vec::new(); count];
    let all = WARM_UP + rounds + 1;
    let total = u64::from(all) * count as u64;
    let mut done = 0;
    for round in 0..all {
        for i in 0..count {
            let i = if round.is_multiple_of(2) { i } else { count - 1 - i };
            let (Some(subject), Some(times)) = (subjects.get_mut(i), times.get_mut(i)) else { continue };
            subject.frame([0, round])?;
            if round > WARM_UP {
                times.extend(subject.timings().cloned());
            }
            done += 1;
            progress(done, total);
        }
    }
    Ok(times)
}

/// What a variant is measured for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// To be compared with the others.
    Compared,
    /// Another setting than the default: the best of these is what a scene could gain.
    Setting,
    /// What a prediction costs that gives up.
    FallBack,
    /// What others are compared with in the suite joined.
    Supersampled,
    /// The first variant once more.
    Control,
}

/// What is measured.
#[derive(Clone)]
pub struct Variant {
    /// Its row's name.
    pub name: String,
    /// What it is for.
    pub part: Part,
    /// What is rendered; `aovs`, `reference` and `timed` are not looked at.
    pub settings: Settings,
    /// Of an image with that many times the pixels a side of the others, means over as many are what is kept.
    pub finer: u32,
}

/// A session and what its frames took.
struct Subject {
    session: Session,
    config: Config,
    /// Of every frame.
    record_ms: Vec<f64>,
    /// The first round of which the image is kept.
    kept_from: u32,
    images: Vec<Frame>,
    finer: u32,
}

impl Subject {
    fn new(variant: &Variant, world: &World) -> Result<Self> {
        let config = variant.settings.config();
        config.validate()?;
        let mut session = Session::new(Headless::new(&variant.settings.device, &Requirements::of(&config))?, world, &config)?;
        variant.settings.prepare(&mut session, world, &config)?;
        Ok(Self { session, config, record_ms: Vec::new(), kept_from: u32::MAX, images: Vec::new(), finer: variant.finer })
    }
}

impl Timed for Session {
    fn frame(&mut self, seed: [u32; 2]) -> Result<()> {
        self.frame(seed)
    }

    fn timings(&self) -> Option<&FrameTimings> {
        self.timings()
    }
}

impl Timed for Subject {
    fn frame(&mut self, seed: [u32; 2]) -> Result<()> {
        // Images do not depend on how many rounds there are.
        let kept = seed[1].checked_sub(self.kept_from);
        self.session.frame(kept.map_or(seed, |image| [1, image]))?;
        self.record_ms.push(self.session.record_ms());
        if kept.is_some() {
            self.images.push(Frame::read(&mut self.session)?.averaged(self.finer));
        }
        Ok(())
    }

    fn timings(&self) -> Option<&FrameTimings> {
        self.session.timings()
    }
}

/// Variants on the device, each with a session of its own. The last is the first once more, untouched: the control, whose
/// difference from the first is the measurement's own noise.
pub struct Runner<'a> {
    world: &'a World,
    variants: Vec<Variant>,
    subjects: Vec<Subject>,
    times: Vec<Vec<FrameTimings>>,
}

/// What one variant took.
pub struct Measured {
    /// It.
    pub variant: Variant,
    /// As `passband render --stats` has it.
    pub stats: Stats,
    /// Times of each frame.
    pub times: Vec<FrameTimings>,
    /// CPU milliseconds that recording each frame took.
    pub record_ms: Vec<f64>,
}

impl<'a> Runner<'a> {
    /// Opens a session for each variant and for the control. `progress` is told how many of how many are open.
    ///
    /// # Errors
    /// Of the settings, the device or the driver.
    pub fn new(world: &'a World, mut variants: Vec<Variant>, progress: &mut dyn FnMut(u64, u64)) -> Result<Self> {
        if let Some(first) = variants.first() {
            let name = format!("control: {}", first.name);
            variants.push(Variant { name, part: Part::Control, ..first.clone() });
        }
        let total = variants.len() as u64;
        let mut runner = Self { world, variants: Vec::new(), subjects: Vec::new(), times: Vec::new() };
        for variant in variants {
            runner.subjects.push(Subject::new(&variant, world)?);
            runner.variants.push(variant);
            progress(runner.subjects.len() as u64, total);
        }
        Ok(runner)
    }

    /// Times `rounds` frames of each variant, and keeps the images of the last `kept`, at most one more than these.
    ///
    /// # Errors
    /// The device's.
    pub fn time(&mut self, rounds: u32, kept: u32, progress: &mut dyn FnMut(u64, u64)) -> Result<()> {
        self.subjects.iter_mut().for_each(|subject| subject.kept_from = WARM_UP + rounds + 1 - kept);
        self.times = interleave(&mut self.subjects, rounds, progress)?;
        Ok(())
    }

    /// Statistics and times of every variant; the control is last.
    ///
    /// # Errors
    /// The device's, on read-back.
    pub fn measured(&mut self) -> Result<Vec<Measured>> {
        let rows = self.variants.iter().zip(&mut self.subjects).zip(&self.times);
        rows.map(|((variant, subject), times)| {
            let stats = render::statistics(self.world, &variant.settings, &subject.config, &mut subject.session, times)?;
            let record_ms = subject.record_ms.iter().skip(WARM_UP as usize).take(times.len()).copied().collect();
            Ok(Measured { variant: variant.clone(), stats, times: times.clone(), record_ms })
        })
        .collect()
    }

    /// The images of the last frames of each variant but the control, as many as [`Self::time`] was told to keep.
    pub fn images(&mut self) -> Vec<Vec<Frame>> {
        let variants = self.subjects.len().saturating_sub(1);
        self.subjects.iter_mut().take(variants).map(|subject| std::mem::take(&mut subject.images)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    /// Notes who renders; the nth frame takes n milliseconds.
    struct Fake<'a> {
        name: char,
        log: &'a RefCell<String>,
        frames: u32,
        known: Option<FrameTimings>,
    }

    impl Timed for Fake<'_> {
        fn frame(&mut self, [_, round]: [u32; 2]) -> Result<()> {
            assert_eq!(round, self.frames, "another seed each round");
            self.log.borrow_mut().push(self.name);
            let span_ms = f64::from(self.frames);
            self.known = (self.frames > 0).then(|| FrameTimings { passes: Vec::new(), span_ms });
            self.frames += 1;
            Ok(())
        }

        fn timings(&self) -> Option<&FrameTimings> {
            self.known.as_ref()
        }
    }

    #[test]
    fn rounds_alternate_and_times_are_those_of_their_own_frames() {
        let log = RefCell::default();
        let mut subjects = ['A', 'B', 'C'].map(|name| Fake { name, log: &log, frames: 0, known: None });
        let mut last = (0, 0);
        let times = interleave(&mut subjects, 3, &mut |done, total| last = (done, total)).unwrap();
        assert_eq!(*log.borrow(), "ABCCBAABCCBAABCCBA");
        assert_eq!(last, (18, 18));
        // Two frames of warm-up take 1 and 2; the sixth is not known yet when the run ends.
        for times in times {
            assert_eq!(times.iter().map(|t| t.span_ms).collect::<Vec<_>>(), [3.0, 4.0, 5.0]);
        }
    }
}
