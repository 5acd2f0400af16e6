//! The frames of an animation, with one session for all of them.

use crate::offline::animation::AnimatedWorld;
use crate::offline::bench::quality::Noise;
use crate::offline::error::{Error, Result};
use crate::offline::image_io::LinearImage;
use crate::offline::progress::Progress;
use crate::offline::render::{FRAMES, Settings, TIMED, WARM_UP, image, open, report};
use crate::offline::stats::{Pixels, Stats};
use serde_json::json;
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Instant;

/// Renders `frames` of `world` in order and hands each to `write`. A frame does not depend on those before it, except at
/// [`crate::Rate::Luminance`], which looks at the one before. In the statistics, times are those of all frames (at least five, the
/// last one being repeated) and counts the means over them; `setup_ms` holds the animation's work on the CPU and all uploads.
/// `progress` is told how many of how many materials are fitted, then of frames of the renderer.
///
/// # Errors
/// Of the range, the settings, the device or the driver, or what `write` returns.
pub fn render_frames(
    world: &mut AnimatedWorld,
    settings: &Settings,
    frames: Range<u32>,
    progress: &mut Progress<'_>,
    write: &mut dyn FnMut(u32, LinearImage) -> Result<()>,
) -> Result<Stats> {
    let most = world.frames().unwrap_or(u32::MAX);
    if frames.is_empty() || frames.end > most {
        let expected = format!("A..B with A below B and B at most {most}");
        return Err(Error::argument("frames", expected, format!("{}..{}", frames.start, frames.end)));
    }
    let mut posing = 0.0;
    let mut show = |world: &mut AnimatedWorld, number| {
        let clock = Instant::now();
        world.show(number);
        posing += clock.elapsed().as_secs_f64() * 1e3;
    };
    show(world, frames.start);
    let (mut session, config) = open(world.world(), settings, progress)?;
    let drawn = (frames.end - frames.start).saturating_mul(settings.chunks(&config));
    let repeated = if settings.timed { 1 + TIMED.saturating_sub(drawn) } else { 0 };
    let warm_up = if settings.timed { WARM_UP } else { 0 };
    let total = drawn.saturating_add(warm_up + repeated);
    let (mut times, mut counted, mut noise, mut done) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for number in frames.clone() {
        if number != frames.start {
            show(world, number);
            session.show(world.world())?;
        }
        if number == frames.start || settings.oracle {
            settings.prepare(&mut session, world.world(), &config)?;
        }
        if number == frames.start {
            for warm_up in 1..=warm_up {
                // The seeds of what `luminance` is prepared with: it goes on as if these frames had not been.
                session.frame([settings.seed, warm_up])?;
                done += 1;
                progress(FRAMES, u64::from(done), u64::from(total));
            }
        }
        let shot = image(&mut session, settings, &config, number, &mut |session| {
            // A frame's times arrive with the next one: the first brings the warm-up's.
            if done > warm_up {
                times.extend(session.timings().cloned());
            }
            done += 1;
            progress(FRAMES, u64::from(done), u64::from(total));
        })?;
        if settings.timed {
            counted.push(shot.counts(&mut session, settings, &config)?);
        }
        noise.extend(shot.noise);
        write(number, shot.image)?;
    }
    for _ in 0..repeated {
        session.frame([settings.seed, frames.end - 1])?;
        times.extend(session.timings().cloned());
        done += 1;
        progress(FRAMES, u64::from(done), u64::from(total));
    }
    let mut stats = report(world.world(), settings, &config, &session, &times, mean(&counted));
    stats.noise = Noise::mean(&noise);
    stats.settings.insert("frames", json!([frames.start, frames.end]));
    stats.setup_ms.insert("animation", posing);
    Ok(stats)
}

/// Means, rounded; what was shaded is the sum over levels.
fn mean(frames: &[(Pixels, u64)]) -> (Pixels, u64) {
    let count = (frames.len() as u64).max(1);
    let rounded = |sum: u64| (sum + count / 2) / count;
    let mut sums = BTreeMap::new();
    for (level, pixels) in frames.iter().flat_map(|f| &f.0.by_level) {
        *sums.entry(*level).or_insert(0) += pixels;
    }
    let by_level: BTreeMap<i32, u64> = sums.into_iter().map(|(level, sum)| (level, rounded(sum))).collect();
    let covered = rounded(frames.iter().map(|f| f.0.covered).sum());
    (Pixels { covered, shaded: by_level.values().sum(), by_level }, rounded(frames.iter().map(|f| f.1).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_over_all_frames_also_where_a_level_is_missing() {
        let frame = |covered, levels: &[(i32, u64)]| {
            let by_level: BTreeMap<_, _> = levels.iter().copied().collect();
            let shaded = by_level.values().sum();
            (Pixels { covered, shaded, by_level }, 10 * shaded)
        };
        let (mean, taken) = mean(&[frame(10, &[(0, 4), (1, 2)]), frame(13, &[(0, 7)])]);
        assert_eq!((mean.covered, mean.shaded, taken), (12, 7, 65));
        assert_eq!(mean.by_level, BTreeMap::from([(0, 6), (1, 1)]));
    }
}
