//! Animated scenes: what frames show, and what `--frames` writes.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;

use chosen_device::DEVICE;
use glam::{DMat4, DQuat, DVec3, EulerRot, Vec3};
use passband::offline::animation::AnimatedWorld;
use passband::offline::error::{At, Error};
use passband::offline::headless::{Headless, Options};
use passband::offline::image_io::{LinearImage, read_exr};
use passband::offline::render::{Settings, render};
use passband::offline::scene::Scene;
use passband::offline::sequence::render_frames;
use passband::offline::session::Session;
use passband::offline::stats::Stats;
use passband::{Config, Estimator, Rate, Requirements};
use std::ops::Range;
use std::process::Command;
use std::sync::Arc;

fn device() -> Options {
    Options { device: Some(DEVICE.into()), validate: true }
}

/// A ball and a sheet: keys for the ball and the camera, and whatever else.
fn text(animation: &str) -> String {
    format!(
        "[camera]\nposition = [0, 1, 4]\n[environment]\nbuiltin = 'studio'\n\
         [[objects]]\nbuiltin = 'sphere'\ndetail = 64\nmaterial = 'paint'\ntranslate = [0, 0.3, 0]\nscale = 0.8\n\
         [[objects]]\nbuiltin = 'cloth'\ndetail = 64\nmaterial = 'sheet'\ntranslate = [0, -0.7, 0]\n\
         [materials.paint]\nreflectance = {{ builtin = 'metallic-paint' }}\n\
         [materials.sheet]\nreflectance = {{ ggx = {{ alpha = 0.3, f0 = 0.5, albedo = 0.2 }} }}\nnormal_map = 'builtin:cloth'\n\
         {animation}"
    )
}

const MOVING: &str = "[animation]\nframes = 9\n\
    camera = [{ frame = 2, position = [0, 1, 4], fov_y = 40 }, { frame = 6, position = [2, 1, 4], fov_y = 30 }]\n\
    wave = { amplitude = 0.05, length = 0.5, speed = 0.1, direction = [0, 1, 1] }\n\
    [[animation.objects]]\nobject = 0\n\
    keyframes = [{ frame = 1, translate = [0, 0.3, 0] }, { frame = 3, rotate = [0, 20, 0], scale = [0.8, 0.4, 0.8] }, \
                 { frame = 5, translate = [0.4, 0.3, 0], rotate = [10, 80, -5], scale = 0.8 }]";

fn load(animation: &str) -> Result<AnimatedWorld, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text(animation)).unwrap();
    Scene::load(path.to_str().unwrap(), &[]).and_then(|scene| scene.animated())
}

#[test]
fn keys_are_met_exactly_and_halves_are_half_way() {
    let mut world = load(MOVING).unwrap();
    assert_eq!(world.frames(), Some(9));
    let turn = |x: f64, y: f64, z: f64| DQuat::from_euler(EulerRot::ZYX, z.to_radians(), y.to_radians(), x.to_radians());
    let place = |scale: DVec3, turn, at: [f64; 3]| {
        DMat4::from_scale_rotation_translation(scale, turn, DVec3::from(at)).as_mat4().to_cols_array()
    };
    let ball = |world: &mut AnimatedWorld, frame| {
        world.show(frame);
        world.world().objects[0].transform.to_cols_array()
    };
    // Before the first key of a kind its value holds, after the last likewise.
    let (flat, even) = (DVec3::new(0.8, 0.4, 0.8), DVec3::splat(0.8));
    let last = place(even, turn(10.0, 80.0, -5.0), [0.4, 0.3, 0.0]);
    assert_eq!(ball(&mut world, 0), place(flat, turn(0.0, 20.0, 0.0), [0.0, 0.3, 0.0]));
    assert_eq!(ball(&mut world, 5), last);
    assert_eq!(ball(&mut world, 8), last);
    let half = turn(0.0, 20.0, 0.0).slerp(turn(10.0, 80.0, -5.0), 0.5);
    let expected = place((flat + even) / 2.0, half, [0.3, 0.3, 0.0]);
    let got = ball(&mut world, 4);
    assert!(got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{got:?} {expected:?}");

    let camera = |world: &mut AnimatedWorld, frame| {
        world.show(frame);
        (world.world().camera.position.to_array(), world.world().camera.fov_y)
    };
    assert_eq!(camera(&mut world, 0), ([0.0, 1.0, 4.0], 40.0));
    assert_eq!(camera(&mut world, 4), ([1.0, 1.0, 4.0], 35.0));
    assert_eq!(camera(&mut world, 6), ([2.0, 1.0, 4.0], 30.0));
    // What has no key stays.
    assert_eq!(world.world().camera.target, DVec3::ZERO);
    assert_eq!(world.world().objects[1].transform.w_axis.to_array(), [0.0, -0.7, 0.0, 1.0]);
}

#[test]
fn waves_move_the_objects_that_are_named_and_going_back_is_exact() {
    let mut world = load(MOVING).unwrap();
    let meshes = |world: &AnimatedWorld| [0, 1].map(|i| Arc::clone(&world.world().objects[i].mesh));
    let first = meshes(&world);
    world.show(3);
    let later = meshes(&world);
    for (a, b) in first.iter().zip(&later) {
        assert!(a.positions != b.positions && a.normals != b.normals && a.uvs == b.uvs && a.indices == b.indices);
    }
    assert!(first[1].tangents != later[1].tangents && first[1].tangents.len() == first[1].positions.len());
    world.show(0);
    assert!(meshes(&world).iter().zip(&first).all(|(a, b)| a.positions == b.positions && a.tangents == b.tangents));
    // The wave is in metres of the mesh, along its normals.
    let height = first[0].positions.iter().map(|p| (Vec3::from(*p).length() - 1.0).abs()).fold(0.0, f32::max);
    assert!((0.0499..0.0501).contains(&height), "{height}");

    let mut named = load(&MOVING.replace("direction = [0, 1, 1]", "objects = [1]")).unwrap();
    let first = meshes(&named);
    named.show(3);
    let later = meshes(&named);
    assert!(Arc::ptr_eq(&first[0], &later[0]) && first[1].positions != later[1].positions);
}

#[test]
fn what_cannot_be_is_refused_with_its_line() {
    // The animation begins at line 20.
    let cases = [
        ("[animation]\nframes = 100001", 21, "1 to 100000 frames"),
        ("[animation]\nframes = 3\ncamera = [{ frame = 3 }]", 22, "rising frames below 3"),
        ("[animation]\nframes = 3\ncamera = [{ frame = 1 }, { frame = 1 }]", 22, "rising frames"),
        ("[animation]\nframes = 3\ncamera = [{ frame = 1, fov_y = 190 }]", 22, "degrees < 180"),
        // In frame 1 the camera would be in its target.
        (
            "[animation]\nframes = 3\ncamera = [\n{ frame = 0, position = [0, 0, 1] },\n{ frame = 2, position = [0, 0, -1] }]",
            23,
            "none in frame 1",
        ),
        ("[animation]\nframes = 3\nwave = { amplitude = -1, length = 1, speed = 1 }", 22, "metres"),
        ("[animation]\nframes = 3\nwave = { amplitude = 1, length = 1, speed = inf }", 22, "metres a frame"),
        ("[animation]\nframes = 3\nwave = { amplitude = 1, length = 1, speed = 1, direction = [0, 0, 0] }", 22, "not 0"),
        ("[animation]\nframes = 3\nwave = { amplitude = 1, length = 1, speed = 1, objects = [2] }", 22, "index below 2"),
        ("[animation]\nframes = 3\nwave = { amplitude = 1, length = 1, speed = 1, objects = [0, 0] }", 22, "each object once"),
        ("[animation]\nframes = 3\n[[animation.objects]]\nobject = 2\nkeyframes = []", 23, "index below 2"),
        (
            "[animation]\nframes = 3\n[[animation.objects]]\nobject = 0\nkeyframes = []\n[[animation.objects]]\nobject = 0\nkeyframes = []",
            26,
            "each object once",
        ),
        (
            "[animation]\nframes = 3\n[[animation.objects]]\nobject = 0\nkeyframes = [{ frame = 0, scale = 1 },\n{ frame = 1, scale = -1 }]",
            25,
            "signs",
        ),
        ("[animation]\nframes = 3\n[[animation.objects]]\nobject = 0\nkeyframes = [{ frame = 0, move = 1 }]", 24, "move"),
    ];
    let start = text("").lines().count() as u64;
    for (animation, line, word) in cases {
        let error = load(animation).unwrap_err();
        let Error::File { at, .. } = &error else { panic!("{error:?}") };
        assert_eq!(*at, At::Line(start + line - 19), "{error}\n{animation}");
        assert!(error.to_string().contains(word) && error.exit_code() == 2, "{word}: {error}");
    }
    let matrix = text("[animation]\nframes = 3\n[[animation.objects]]\nobject = 1\nkeyframes = []")
        .replace("translate = [0, -0.7, 0]", "transform = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, matrix).unwrap();
    let error = Scene::load(path.to_str().unwrap(), &[]).unwrap_err();
    assert!(error.to_string().contains("without a transform"), "{error}");
}

fn settings(rate: Rate) -> Settings {
    Settings { device: device(), ..Settings::new(Config { rate, directions: 8, ..Config::new([72, 48]) }) }
}

/// The images of `frames`, in order, and the statistics.
fn frames(world: &mut AnimatedWorld, settings: &Settings, frames: Range<u32>) -> (Vec<LinearImage>, Stats) {
    let mut images = Vec::new();
    let mut write = |number, image| {
        assert_eq!(number, frames.start + images.len() as u32);
        images.push(image);
        Ok(())
    };
    let stats = render_frames(world, settings, frames.clone(), &mut |_, _, _| {}, &mut write).unwrap();
    assert_eq!(stats.validation_messages, [""; 0]);
    (images, stats)
}

#[test]
fn a_frame_is_the_same_alone_and_among_others_and_a_plain_render_is_the_first() {
    for rate in [Rate::Full, Rate::Bandwidth, Rate::Uniform(1), Rate::Given] {
        let settings = |rate| Settings { oracle: rate == Rate::Given, ..settings(rate) };
        let mut world = load(MOVING).unwrap();
        let (all, _) = frames(&mut world, &settings(rate), 0..4);
        for pair in all.windows(2) {
            assert!(pair[0].channels != pair[1].channels, "something moves");
        }
        // Timed frames are the same frames.
        let timed = Settings { timed: true, ..settings(rate) };
        let (alone, stats) = frames(&mut world, &timed, 2..3);
        assert!(alone[0].channels == all[2].channels, "{rate:?}");
        assert!(stats.frame_ms.median > 0.0 && stats.setup_ms["animation"] > 0.0 && stats.pixels.shaded > 0);
        world.show(0);
        let plain = render(world.world(), &settings(rate), &mut |_, _, _| {}).unwrap();
        assert!(plain.image.channels == all[0].channels, "{rate:?}");
    }
    // What follows the frame before does so whether frames are timed or not.
    let mut world = load(MOVING).unwrap();
    let luminance = settings(Rate::Luminance);
    let (plain, _) = frames(&mut world, &luminance, 1..4);
    let (timed, _) = frames(&mut world, &Settings { timed: true, ..luminance.clone() }, 1..4);
    assert!(plain.iter().zip(&timed).all(|(a, b)| a.channels == b.channels));
}

#[test]
fn without_motion_frames_differ_by_their_seed_alone() {
    let mut still = load("[animation]\nframes = 9\nwave = { amplitude = 0, length = 1, speed = 1 }").unwrap();
    let settings = settings(Rate::Bandwidth);
    let (images, _) = frames(&mut still, &settings, 0..3);
    let config = Config { frames_in_flight: 1, rate: Rate::Bandwidth, directions: 8, ..Config::new([72, 48]) };
    let mut session =
        Session::new(Headless::new(&device(), &Requirements::of(&config)).unwrap(), still.world(), &config).unwrap();
    for (number, image) in (0..).zip(&images) {
        session.frame([0, number]).unwrap();
        let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
        let red: Vec<f32> = texels.iter().copied().step_by(4).collect();
        assert!(image.channel("R").unwrap() == red, "{number}");
    }
    assert!(images[0].channels != images[1].channels, "seeds depend on the frame");
    let scene = text("");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    // A scene without an animation stays as it is in every frame.
    let mut plain = Scene::load(path.to_str().unwrap(), &[]).unwrap().animated().unwrap();
    assert_eq!(plain.frames(), None);
    let (again, _) = frames(&mut plain, &settings, 7..8);
    let coverage = |image: &LinearImage| image.channel("A").unwrap().to_vec();
    assert!(coverage(&again[0]) == coverage(&images[0]));
}

#[test]
fn no_frame_of_the_built_in_animation_has_a_hole_or_shades_more_than_all() {
    let mut world = Scene::load("waves", &[]).unwrap().animated().unwrap();
    let last = world.frames().unwrap();
    for first in [0, last / 3, last - 2] {
        let plain = settings(Rate::Bandwidth);
        let config = Config { extent: [128, 96], directions: 64, ..plain.config.clone() };
        let settings = Settings { timed: true, config, ..plain };
        let (images, stats) = frames(&mut world, &settings, first..first + 2);
        assert!(stats.pixels.shaded <= stats.pixels.covered, "{:?}", stats.pixels);
        for image in images {
            let (rgb, alpha) = (image.rgb().unwrap(), image.channel("A").unwrap());
            assert!(alpha.iter().filter(|a| **a == 1.0).count() > 128 * 96 / 4);
            for (i, (rgb, alpha)) in rgb.iter().zip(alpha).enumerate() {
                assert!([0.0, 1.0].contains(alpha), "{i}");
                // Sky light comes from everywhere.
                assert!(rgb.iter().all(|c| c.is_finite()) && (*alpha == 0.0 || rgb.iter().sum::<f32>() > 0.0), "{i}: {rgb:?}");
            }
        }
    }
}

/// Of light that is looked up: frames do not depend on each other either, and are those that estimates alone tend to.
#[test]
fn light_that_is_looked_up_moves_with_what_moves() {
    let mut world = Scene::load("waves", &[]).unwrap().animated().unwrap();
    let estimated = |estimator, rate, directions| {
        let config = Config { estimator, rate, directions, ..Config::new([128, 96]) };
        Settings { device: device(), ..Settings::new(config) }
    };
    let (truth, _) = frames(&mut world, &estimated(Estimator::Mis, Rate::Full, 512), 20..22);
    let distance = |a: &LinearImage, b: &LinearImage| {
        let pixels = a.rgb().unwrap().into_iter().zip(b.rgb().unwrap()).zip(b.channel("A").unwrap().to_vec());
        let covered = pixels.filter(|(_, alpha)| *alpha > 0.0);
        let (off, all) = covered.fold((0.0, 0.0), |(off, all), ((a, b), _)| {
            let of = |c: [f32; 3]| DVec3::from(c.map(f64::from));
            (off + (of(a) - of(b)).abs().element_sum(), all + of(b).element_sum())
        });
        off / all
    };
    let moved = distance(&truth[0], &truth[1]);
    for (estimator, rate) in
        [(Estimator::Preconvolved, Rate::Full), (Estimator::Cv, Rate::Full), (Estimator::Residual, Rate::Bandwidth)]
    {
        let settings = estimated(estimator, rate, 64);
        let (all, stats) = frames(&mut world, &settings, 20..22);
        // The second without the first.
        let (alone, _) = frames(&mut world, &settings, 21..22);
        assert!(alone[0].channels == all[1].channels, "{estimator:?}");
        assert!(stats.validation_messages.is_empty());
        for ((found, truth), number) in all.iter().zip(&truth).zip(20..) {
            let apart = distance(found, truth);
            println!("{estimator:?}, frame {number}: {apart:.4} off, two frames are {moved:.3} apart");
            assert!(apart < 0.03 && apart < 0.3 * moved, "{estimator:?}, frame {number}: {apart}, moved {moved}");
            let pixels = found.rgb().unwrap().into_iter().zip(found.channel("A").unwrap());
            let dark = pixels.filter(|(rgb, alpha)| **alpha > 0.0 && rgb.iter().sum::<f32>() <= 0.0);
            assert_eq!(dark.count(), 0, "{estimator:?}, frame {number} has holes");
        }
    }
}

#[test]
fn uploads_of_every_frame_are_given_back() {
    let mut world = load(MOVING).unwrap();
    let settings = Settings { timed: true, ..settings(Rate::Full) };
    let (_, few) = frames(&mut world, &settings, 0..2);
    let (_, many) = frames(&mut world, &settings, 0..9);
    assert_eq!(few.memory_bytes, many.memory_bytes, "the most that is allocated at once does not grow with frames");
}

#[test]
fn the_command_writes_numbered_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), text(MOVING)).unwrap();
    let run = |args: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_passband"));
        let base = ["render", "s.toml", "--device", DEVICE, "--size", "24x16", "--samples", "4", "--validate"];
        let output = command.args(base).args(args.split_whitespace()).current_dir(folder.path()).output().unwrap();
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let files = || {
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    for (args, says) in [
        ("--frames 3..3 -o a.exr", "expected A..B with A below B"),
        ("--frames 4..3 -o a.exr", "got 4..3"),
        ("--frames 3 -o a.exr", "got 3"),
        ("--frames 0..-1 -o a.exr", "got 0..-1"),
        ("--frames 0..200000 -o a.exr", "B at most 100000"),
        ("--frames 7..10 -o a.exr", "B at most 9, got 7..10"),
        ("--frames 0..2 -o gone/a.exr", "cannot write gone/a.0000.exr"),
    ] {
        let (code, said) = run(args);
        assert!(code == 2 && said.contains(says) && said.lines().count() == 1, "{args}: {code} {said}");
    }
    assert_eq!(files(), ["s.toml"]);

    assert_eq!(run("--frames 1..4 -o a.b.exr --aov depth --stats s.json --rate bandwidth"), (0, String::new()));
    assert_eq!(files(), ["a.b.0001.exr", "a.b.0002.exr", "a.b.0003.exr", "s.json", "s.toml"]);
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["settings"]["frames"], serde_json::json!([1, 4]));
    assert!(stats["frame_ms"]["median"].as_f64().unwrap() > 0.0 && stats["setup_ms"]["loading"].as_f64().unwrap() > 0.0);
    // The file of a frame is that of a render of it alone.
    assert_eq!(run("--frames 2..3 -o b.exr --aov depth --rate bandwidth"), (0, String::new()));
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("a.b.0002.exr") == bytes("b.0002.exr"));
    let depth = |name: &str| read_exr(&folder.path().join(name)).unwrap().channel("depth.Z").unwrap().to_vec();
    assert!(depth("a.b.0001.exr") != depth("a.b.0003.exr"));
    // And `compare` takes them as a sequence.
    let mut compare = Command::new(env!("CARGO_BIN_EXE_passband"));
    let output = compare.args(["compare", "a.b.####.exr", "a.b.####.exr", "--json"]).current_dir(folder.path()).output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["flicker"], 0.0, "{report}");

    // One exposure for all frames: the first's.
    assert_eq!(run("--frames 0..2 -o p.png"), (0, String::new()));
    assert_eq!(files().iter().filter(|name| name.ends_with(".png")).count(), 2);
}
