//! Several samples a pixel as levels below 0 (Bagher 2011, section 4, figure 15): where they are shaded, what they draw, and
//! how far the image is from one of 64 samples a pixel, beside full supersampled shading.

#[path = "support/chosen_device.rs"]
mod chosen_device;
#[path = "support/levels.rs"]
mod support;
#[path = "support/truth.rs"]
mod truth;

use chosen_device::DEVICE;
use glam::DVec3;
use passband::frequency::reconstruction::{PLANE, Surface};
use passband::offline::bench::quality::{self, Frame};
use passband::offline::bench::runner::interleave;
use passband::offline::headless::{Headless, Options};
use passband::offline::levels;
use passband::offline::metrics::Metrics;
use passband::offline::render::{self, Settings};
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::stats::Quantiles;
use passband::offline::world::World;
use passband::{Config, Rate, Requirements};
use support::{scene, session, surface};

fn config(size: u32, rate: Rate, side: u32) -> Config {
    Config { frames_in_flight: 1, rate, samples_per_side: side, ..Config::new([size; 2]) }
}

/// What a camera sees of the surface at `p` and what it would see at `q` if it were a plane: their distance in metres.
fn off_plane(surface: &Surface, [p, q]: [[usize; 2]; 2]) -> Option<f64> {
    let [width, height] = surface.extent.map(|e| e as f64);
    let [sx, sy, ox, oy] = surface.ray;
    let point = |[x, y]: [usize; 2], depth: f64| {
        let ndc = [(x as f64 + 0.5) / width * 2.0 - 1.0, (y as f64 + 0.5) / height * 2.0 - 1.0];
        surface.axes * DVec3::new(ndc[0] * sx + ox, ndc[1] * sy + oy, -1.0) * depth
    };
    let at = |[x, y]: [usize; 2]| surface.samples[y * surface.extent[0] + x];
    let (own, other) = (at(p)?, at(q)?);
    let offset = point(q, other.depth) - point(p, own.depth);
    (own.object == other.object).then(|| own.normal.dot(offset).abs())
}

/// Whether a sample that stands for a cell of `level` must be shaded: nearby, where its parents may be, is another surface, or
/// its bandwidth asks for that level.
fn is_needed(surface: &Surface, asked: &[u32], [x, y]: [u32; 2], level: u32) -> bool {
    let [width, height] = surface.extent;
    let (at, reach) = ([x as usize, y as usize], 4 << level);
    let own = surface.samples[at[1] * width + at[0]].unwrap();
    let footprint = own.depth * (2.0 * surface.ray[0].abs() / width as f64).max(2.0 * surface.ray[1].abs() / height as f64);
    let near = |c: usize, most: usize| c.saturating_sub(reach)..(c + reach + 1).min(most);
    let mut places = near(at[1], height).flat_map(|y| near(at[0], width).map(move |x| [x, y]));
    places.any(|q| {
        let flat = off_plane(surface, [at, q]).is_some_and(|d| d <= PLANE * footprint * f64::from(1 << level));
        !flat || asked[q[1] * width + q[0]] <= level
    })
}

#[test]
fn samples_of_a_pixel_are_shaded_at_edges_or_where_the_bandwidth_asks() {
    for (name, side, most) in [("sphere", 2, 0.2), ("sphere", 4, 0.1), ("bumpy-sphere", 4, 0.2), ("trio", 4, 0.3)] {
        let world = scene(name);
        let config = config(96, Rate::Bandwidth, side);
        let mut session = session(&world, &config);
        session.frame([3, 0]).unwrap();
        assert_eq!(session.messages(), [""; 0]);
        let asked: Vec<u32> = bytemuck::pod_collect_to_vec(&session.image("level").unwrap().0);
        let surface = surface(&mut session, &world, &config);
        let pixel = side.ilog2();
        let shaded = levels::shaded(&mut session).unwrap();
        let fine: Vec<_> = shaded.iter().filter(|(_, level)| *level < pixel).collect();
        for (at, level) in &fine {
            assert!(is_needed(&surface, &asked, *at, *level), "{name}: {at:?} at {level}");
        }
        let covered = surface.samples.iter().flatten().count();
        println!("{name}, {}: {} fine of {} shaded of {covered}", side * side, fine.len(), shaded.len());
        assert!(!fine.is_empty() && (fine.len() as f64) < most * covered as f64, "{name}: {} of {covered}", fine.len());
    }
}

#[test]
fn statistics_count_levels_and_the_directions_that_they_share() {
    let world = scene("sphere");
    let stats = |rate: Rate, side| {
        let settings = Settings::new(Config { rate, samples_per_side: side, ..Config::new([64; 2]) });
        render::render(&world, &settings, &mut |_, _, _| ()).unwrap().stats
    };
    for (side, directions) in [(2, &[(-1, 32), (0, 128)][..]), (4, &[(-2, 16), (-1, 64), (0, 256)])] {
        let found = stats(Rate::Bandwidth, side);
        let of = |level: i32| directions.iter().find(|d| d.0 == level).map_or(directions[directions.len() - 1].1, |d| d.1);
        assert!(directions.iter().all(|(level, _)| found.pixels.by_level[level] > 0), "{:?}", found.pixels);
        assert_eq!(found.samples.taken, found.pixels.by_level.iter().map(|(level, count)| count * of(*level)).sum::<u64>());
        assert_eq!(found.pixels.shaded, found.pixels.by_level.values().sum::<u64>());
        let full = stats(Rate::Full, side);
        assert_eq!((full.samples.taken, full.pixels.shaded), (64 * full.pixels.covered, full.pixels.covered));
    }
}

/// A frame of each rate, and its distance from a truth.
fn against(truth: &Frame, world: &World, size: u32, side: u32) -> [Metrics; 2] {
    let mask: Vec<bool> = truth.coverage.iter().map(|a| *a > 0.0).collect();
    [Rate::Full, Rate::Bandwidth].map(|rate| {
        let mut session = open(world, &config(size, rate, side));
        session.frame([0, 0]).unwrap();
        quality::error(&[Frame::read(&mut session).unwrap()], &truth.picture, &mask).unwrap()
    })
}

/// Bounds are in decibels below full supersampling, which draws 2 and 4 times as many directions a pixel. Measured: 0.4 and 1.6 on
/// the bumpy sphere, 0.4 and 1.1 on the knot; a frame of N directions at each shaded sample, whatever its level, lost 4.2 and 3.2
/// of 16 samples a pixel.
#[test]
fn errors_are_near_those_of_supersampling() {
    for (name, most) in [("bumpy-sphere", [1.0, 2.0]), ("torus-knot", [1.0, 1.5])] {
        let world = scene(name);
        let truth = truth::supersampled(&world, [128; 2], 128);
        for (side, most) in [2, 4].into_iter().zip(most) {
            let [full, adaptive] = against(&truth, &world, 128, side).map(|m| m.psnr);
            println!("{name}, {} samples a pixel: {full:.2} dB full, {adaptive:.2} dB", side * side);
            assert!(adaptive > full - most && full > 30.0, "{name}: {adaptive} for {full} dB");
        }
    }
}

/// All samples of a pixel take turns along one sequence of points: their mean has less noise than that of as many directions
/// that each sample draws for itself.
#[test]
fn samples_of_a_pixel_share_well_spread_directions() {
    let world = scene("sphere");
    let of = |rate, directions, spc| {
        let config = Config { directions, samples_per_cycle: spc, ..config(48, rate, 4) };
        let mut session = session(&world, &config);
        session.frame([7, 0]).unwrap();
        assert_eq!(session.messages(), [""; 0]);
        (Frame::read(&mut session).unwrap(), session.shaded().unwrap())
    };
    // At so many samples a cycle all are shaded, by 256 / 16 directions each.
    let [(own, count), (shared, all), (truth, _)] =
        [of(Rate::Full, 16, None), of(Rate::Bandwidth, 64, Some(1e3)), of(Rate::Full, 2048, None)];
    assert_eq!(count, all);
    let mask: Vec<bool> = truth.coverage.iter().map(|a| *a > 0.0).collect();
    let [own, shared] = [own, shared].map(|f| quality::error(&[f], &truth.picture, &mask).unwrap().rmse);
    println!("rmse {shared:.2e} on one sequence, {own:.2e} on sixteen");
    assert!(shared < 0.8 * own, "{shared} for {own}");
}

fn open(world: &World, config: &Config) -> Session {
    let options = Options { device: Some(DEVICE.into()), validate: false };
    Session::new(Headless::new(&options, &Requirements::of(config)).unwrap(), world, config).unwrap()
}

/// Processor time of all threads so far in milliseconds, which other work on the machine does not lengthen; Linux alone tells.
fn processor_ms() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let time = |path: std::path::PathBuf| std::fs::read_to_string(path.join("schedstat")).ok()?.split(' ').next()?.parse().ok();
    threads.filter_map(|thread| time(thread.path())).map(|ns: f64| ns * 1e-6).sum()
}

/// What the antialiasing of Bagher 2011, figure 15 costs here and what it is worth, scene by scene. The times of 4 and of 16
/// samples a pixel are over that of one, all at predicted bandwidth and in turns: of the frame's span, and of the processor.
/// `AA_SIZE` is the size in pixels (256), `AA_SCENES` a part of the scenes' names.
#[test]
#[ignore = "needs a quiet machine and fetched assets"]
fn times_and_errors_of_antialiasing() {
    let size: u32 = std::env::var("AA_SIZE").map_or(256, |s| s.parse().unwrap());
    let chosen = std::env::var("AA_SCENES").unwrap_or_default();
    let files = ["scenes/bunny-city.toml", "scenes/dragon.toml", "scenes/armadillo.toml"];
    let files = files.map(|file| format!("{}/{file}", env!("CARGO_MANIFEST_DIR")));
    let names = ["sphere", "bumpy-sphere", "torus-knot"].map(String::from).into_iter().chain(files);
    for name in names.filter(|name| name.contains(&chosen)) {
        let world = Scene::load(&name, &[]).and_then(|s| s.resolve()).expect("scripts/fetch-assets");
        let mut sessions = [1, 2, 4].map(|side| open(&world, &config(size, Rate::Bandwidth, side)));
        let times = interleave(&mut sessions, 7, &mut |_, _| ()).unwrap();
        let spans = times.iter().map(|t| Quantiles::of(t.iter().map(|f| f.span_ms).collect()).median).collect::<Vec<_>>();
        let least = times.iter().map(|t| t.iter().map(|f| f.span_ms).fold(f64::MAX, f64::min)).collect::<Vec<_>>();
        let processor = [0, 1, 2].map(|i| {
            let frame = |seed| {
                let before = processor_ms();
                sessions[i].frame([1, seed]).unwrap();
                processor_ms() - before
            };
            (0..5).map(frame).fold(f64::MAX, f64::min)
        });
        println!("{}, {size}x{size}: {spans:.1?} ms, least {least:.1?}, processor {processor:.1?}", world.name);
        for (i, times) in times.iter().enumerate() {
            let median = |k: usize| Quantiles::of(times.iter().map(|f| f.passes[k].1).collect()).median;
            let passes = times[0].passes.iter().enumerate().map(|(k, p)| format!("{} {:.1}", p.0, median(k)));
            println!("  {} samples a pixel: {}", [1, 4, 16][i], passes.collect::<Vec<_>>().join(", "));
        }
        let truth = truth::supersampled(&world, [size; 2], 256);
        for (i, target) in [(1, 2.2), (2, 5.4)] {
            let [full, adaptive] = against(&truth, &world, size, 1 << i).map(|m| m.psnr);
            let covered = sessions[i].image("ids").unwrap().0.chunks_exact(4).filter(|id| **id != [0; 4]).count();
            let share = f64::from(sessions[i].shaded().unwrap()) / covered as f64;
            println!(
                "  {}x: {:.2} of the time (least {:.2}, processor {:.2}; target {target}), {full:.2} dB full, {adaptive:.2} dB, {share:.4} shaded",
                [1, 4, 16][i],
                spans[i] / spans[0],
                least[i] / least[0],
                processor[i] / processor[0],
            );
        }
    }
}
