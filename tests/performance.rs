//! How fast full-rate shading is, held against a kernel that only looks up. Ignored by default, because it needs a quiet
//! machine and, for its scene, `scripts/fetch-assets bunny environments`:
//!
//! `cargo test --test performance -- --ignored --nocapture --test-threads 1`

use passband::offline::bench::runner::interleave;
use passband::offline::headless::{Headless, Options};
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::stats::Quantiles;
use passband::offline::world::World;
use passband::{Config, Estimator, FrameTimings, Rate, Renderer, Requirements};
use std::time::Instant;

const ROUNDS: u32 = 9;

fn world() -> World {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bunny-city.toml");
    Scene::load(scene, &[]).and_then(|s| s.resolve()).expect("scripts/fetch-assets bunny environments")
}

fn session(world: &World, estimator: Estimator, directions: u32, size: u32) -> Session {
    let config = Config { estimator, directions, frames_in_flight: 1, ..Config::new([size, size]) };
    let options = Options { device: std::env::var("PASSBAND_DEVICE").ok(), validate: false };
    let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
    Session::new(headless, world, &config).unwrap()
}

fn covered(session: &mut Session) -> u32 {
    session.frame([0, 0]).unwrap();
    session.shaded().unwrap()
}

/// Milliseconds of the shade pass.
fn shade(times: &FrameTimings) -> f64 {
    times.passes.iter().find(|p| p.0 == "shade").map(|p| p.1).unwrap()
}

/// What `time` says of frames that alternate between the sessions.
fn interleaved(sessions: &mut [Session], time: impl Fn(&FrameTimings) -> f64) -> Vec<Vec<f64>> {
    let times = interleave(sessions, ROUNDS, &mut |_, _| ()).unwrap();
    times.iter().map(|times| times.iter().map(&time).collect()).collect()
}

#[test]
#[ignore = "needs a quiet machine and fetched assets"]
fn directions_a_second_against_look_ups_only() {
    let world = world();
    let mut sessions = [Estimator::Lookup, Estimator::Mis, Estimator::Brdf].map(|e| session(&world, e, 64, 512));
    println!("device: {}", sessions[0].headless().info().name);
    let directions = f64::from(covered(&mut sessions[0])) * 64.0;
    let rates: Vec<_> = interleaved(&mut sessions, shade)
        .into_iter()
        .map(|times| {
            let q = Quantiles::of(times);
            println!(
                "{:.1} ms (p10 {:.1}, p90 {:.1}): {:.2} M directions/s",
                q.median,
                q.p10,
                q.p90,
                directions / q.median / 1e3
            );
            directions / q.median / 1e3
        })
        .collect();
    println!("MIS at {:.0} % of the look-up-only kernel's rate", 100.0 * rates[1] / rates[0]);
    assert!(rates[1] >= 16.0, "{} M directions/s", rates[1]);
    assert!(rates[1] >= 0.6 * rates[0], "{} of {} M/s", rates[1], rates[0]);
}

#[test]
#[ignore = "needs a quiet machine and fetched assets"]
fn cost_is_linear_in_directions_and_pixels() {
    let world = world();
    for (label, cases) in [
        ("directions at 256x256", [16, 64, 256, 1024].map(|n| (n, 256))),
        ("size at 64 directions", [128, 256, 512, 1024].map(|size| (64, size))),
    ] {
        let mut sessions = cases.map(|(n, size)| session(&world, Estimator::Mis, n, size));
        let counts: Vec<f64> = sessions.iter_mut().map(|s| f64::from(covered(s))).collect();
        println!("{label}: directions, covered pixels, shade ms, ns a direction");
        let costs: Vec<f64> = interleaved(&mut sessions, shade)
            .into_iter()
            .zip(cases.iter().zip(&counts))
            .map(|(times, (&(n, _), &pixels))| {
                let ms = Quantiles::of(times).median;
                let ns = ms * 1e6 / (pixels * f64::from(n));
                println!("| {n} | {pixels} | {ms:.1} | {ns:.1} |");
                ns
            })
            .collect();
        let (least, most) = costs[1..].iter().fold((f64::MAX, 0.0f64), |(a, b), &c| (a.min(c), b.max(c)));
        assert!(most < 1.25 * least, "{label}: {costs:?}");
    }
}

#[test]
#[ignore = "needs a quiet machine"]
fn sixty_four_materials_against_one() {
    let crowd = Scene::load("crowd", &[]).unwrap().resolve().unwrap();
    assert_eq!((crowd.materials.len(), crowd.objects.len()), (64, 256));
    // One material of each kind, on all objects.
    let alone = ["m1", "m11", "m37", "m55"].map(|name| {
        let mut world = crowd.clone();
        world.materials.retain(|m| m.name == name);
        world.objects.iter_mut().for_each(|o| o.material = 0);
        assert_eq!(world.materials.len(), 1);
        world
    });
    let mut sessions: Vec<_> = std::iter::once(&crowd).chain(&alone).map(|w| session(w, Estimator::Mis, 64, 512)).collect();
    let times: Vec<_> = interleaved(&mut sessions, |t| t.span_ms).into_iter().map(|t| Quantiles::of(t).median).collect();
    println!("64 materials: {:.1} ms; one table, GGX, Blinn-Phong, vMF: {:.1?} ms", times[0], &times[1..]);
    // The crowd has 9, 24, 16 and 15 of them.
    let mean = times[1..].iter().zip([9.0, 24.0, 16.0, 15.0]).map(|(t, n)| t * n / 64.0).sum::<f64>();
    println!("64 materials take {:.2} times what one takes, over their kinds", times[0] / mean);
    assert!(times[0] <= 1.3 * mean, "{times:.1?}");
}

/// What a new environment takes, host and device, without its analysis and with it: the least of many turns, on a shared machine.
#[test]
#[ignore = "needs a quiet machine"]
fn an_environment_that_changes() {
    let map = passband::offline::builtin::environment("sun-sky", 1024).unwrap();
    let mut renderers = [Rate::Full, Rate::Bandwidth].map(|rate| {
        let config = Config { rate, ..Config::new([16, 16]) };
        let options = Options { device: std::env::var("PASSBAND_DEVICE").ok(), validate: false };
        let mut headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
        let (host, memory) = headless.parts().unwrap();
        // SAFETY: the handles live in `headless`, which is dropped after the renderer is destroyed.
        let renderer = unsafe { Renderer::new(&host, &config, memory) }.unwrap();
        (headless, renderer)
    });
    let mut least = [[f64::INFINITY; 2]; 2];
    for turn in 0..24 {
        for i in [turn % 2, (turn + 1) % 2] {
            let (headless, renderer) = &mut renderers[i];
            let mut host = 0.0;
            let clock = Instant::now();
            let record = headless.submit(|cmd, memory| {
                // SAFETY: the command buffer is recording and submitted at once.
                let bag = unsafe { renderer.record_environment(cmd, &map, memory) }?;
                host = clock.elapsed().as_secs_f64() * 1e3;
                Ok(bag)
            });
            record.unwrap();
            let device = clock.elapsed().as_secs_f64() * 1e3 - host;
            least[i] = [least[i][0].min(host), least[i][1].min(device)];
        }
    }
    let [[host, device], [host_too, device_too]] = least;
    println!(
        "a map of 1024x512: host {host:.1} ms, device {device:.1} ms; with its analysis {host_too:.1} and {device_too:.1} ms"
    );
    println!("the analysis takes {:.1} ms on the device", device_too - device);
    for (mut headless, renderer) in renderers {
        let bag = renderer.destroy();
        let (host, memory) = headless.parts().unwrap();
        // SAFETY: every submission was waited for.
        unsafe { bag.free(host.device, memory) };
    }
    assert!(device_too - device < 10.0);
}
