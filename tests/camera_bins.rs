//! Cells of directions in camera space: what the passes store against a rebuild in f64, frames against those of the tangent frame's
//! cells, and what is refused.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DMat3, DVec2, DVec3, Mat4, Vec3};
use passband::distribution::Cells;
use passband::distribution::mip::Mips;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::session::{MomentLevels, Session};
use passband::offline::world::World;
use passband::reflectance::{Lobe, Model, Vmf, frame};
use passband::{Bins, Config, Estimator, Filter, GBufferSource, Light, Maps, Requirements, Roughness, Texture};
use std::f32::consts::TAU;
use std::f64::consts::PI;
use std::sync::Arc;
use support::frames::{config, ggx, world};

const FILTERS: [Filter; 3] = [Filter::Vmf4, Filter::Vmf8, Filter::Vmf];

fn texels<T>([w, h]: [u32; 2], f: impl Fn(f32, f32) -> T) -> Vec<T> {
    (0..w * h).map(|i| f(((i % w) as f32 + 0.5) / w as f32, ((i / w) as f32 + 0.5) / h as f32)).collect()
}

/// Bumps that differ along u and v.
fn bumps(size: [u32; 2], height: f32) -> Maps {
    let texel = |u: f32, v: f32| {
        let slope = Vec3::new((TAU * 9.0 * u).sin() + 0.2, 0.7 * (TAU * (7.0 * v + u)).cos() - 0.3, 0.0) * height;
        (slope + Vec3::Z).normalize().to_array()
    };
    let rough = |u: f32, v: f32| 0.1 * 4f32.powf(0.5 + 0.5 * (TAU * (3.0 * u + 2.0 * v)).sin());
    let normal = Some(Arc::new(Texture::normals(size, &texels(size, texel)).unwrap()));
    let roughness = Some((Arc::new(Texture::scalar(size, &texels(size, rough)).unwrap()), Roughness::Alpha));
    Maps { normal, roughness, ..Maps::default() }
}

fn two_lobes() -> Model {
    let lobe = |(x, weight): (f64, f64)| Lobe { mu: DVec3::new(x, 0.1, 1.0), kappa: 40.0, weight };
    Model::Vmf(Arc::new(Vmf::new(&[(0.6, 0.5), (-0.5, 0.3)].map(lobe)).unwrap()))
}

fn metal() -> Model {
    ggx(0.15, DVec3::splat(0.9), DVec3::ZERO)
}

/// One mesh under a light, without anything that makes noise.
fn scene(mesh: &str, model: Model, maps: Maps) -> World {
    let mut world = world(mesh, 128, model, builtin::environment("constant", 16).unwrap());
    Arc::make_mut(&mut world.objects[0].mesh).compute_tangents();
    world.materials[0].maps = maps;
    world.environment = None;
    world.lights = vec![Light::Directional { direction: [-0.2, -0.3, -0.9], irradiance: [1.0; 3] }];
    world
}

fn with(bins: Bins, filter: Filter, side: u32) -> Config {
    Config { filter, bins, ..config([side; 2], Estimator::Mis, 2) }
}

fn open(world: &World, config: &Config) -> passband::offline::error::Result<Session> {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    Session::new(Headless::new(&options, &Requirements::of(config)).unwrap(), world, config)
}

fn render(session: &mut Session) -> Vec<DVec3> {
    session.frame([0, 0]).unwrap();
    assert_eq!(session.messages(), [""; 0]);
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
    texels.into_iter().map(|[r, g, b, _]| DVec3::new(r.into(), g.into(), b.into())).collect()
}

/// The largest difference of two images, over the second or, where this is less, its mean.
fn apart(image: &[DVec3], expected: &[DVec3]) -> f64 {
    let mean = expected.iter().map(|c| c.x).sum::<f64>() / expected.len() as f64;
    assert!(mean > 1e-3, "the scene is dark");
    image.iter().zip(expected).map(|(a, b)| ((a - b).abs() / b.max(DVec3::splat(mean))).max_element()).fold(0.0, f64::max)
}

/// A texel's frame as `texture_space.frag` writes it: world from tangent; none where nothing is seen.
fn decoded([x, y, z, code]: [f32; 4]) -> Option<DMat3> {
    let n = DVec3::new(x.into(), y.into(), z.into());
    if n == DVec3::ZERO {
        return None;
    }
    let frame = frame::decode(n, code.into()).map(|(t, side)| DMat3::from_cols(t, n.cross(t) * side, n));
    let [x, y] = frame::basis(n);
    Some(frame.unwrap_or(DMat3::from_cols(x, y, n)))
}

/// x, y and weight - z as a vector.
fn vector([x, y, z, _]: [f32; 4], weight: f64) -> DVec3 {
    DVec3::new(x.into(), y.into(), weight - f64::from(z))
}

/// Sum of vectors and weights over the cells of a texel.
fn whole(cells: &[MomentLevels], level: usize, texel: usize) -> (DVec3, f64) {
    cells.iter().fold((DVec3::ZERO, 0.0), |(sum, weight), cell| {
        let stored = cell[level].1[texel];
        (sum + vector(stored, stored[3].into()), weight + f64::from(stored[3]))
    })
}

#[test]
fn cells_are_those_of_the_lobes_in_the_texels_frames() {
    // Power-of-two and odd sizes; mirrored, so that handedness counts; without tangents, too.
    for (name, model, size, tangents) in
        [("ggx", metal(), [64, 32], true), ("two lobes", two_lobes(), [67, 45], true), ("no tangents", metal(), [32, 32], false)]
    {
        let mut world = scene("sphere", model, bumps(size, 0.5));
        let object = &mut world.objects[0];
        object.transform = Mat4::from_rotation_y(0.8) * Mat4::from_scale(Vec3::new(-1.0, 0.9, 0.8));
        if !tangents {
            Arc::make_mut(&mut object.mesh).tangents.clear();
        }
        let view = world.camera.world_from_view().transpose();
        let weights: Vec<f64> = match &world.materials[0].model {
            Model::Vmf(vmf) => vmf.lobes().iter().map(|l| l.weight / 0.8).collect(),
            _ => vec![1.0],
        };
        for filter in FILTERS {
            let mut session = open(&world, &with(Bins::Camera, filter, 16)).unwrap();
            render(&mut session);
            let [moments, none] = session.moments(0).unwrap().unwrap();
            assert!(none.is_empty(), "no cells in the tangent frame");
            let lobes = &moments[moments.len() - weights.len()..];
            let [frames, cells] = session.object_cells(0).unwrap().unwrap();
            let partition = if filter == Filter::Vmf4 { Cells::Four } else { Cells::Eight };
            let count = partition.count();
            let frame = |i: usize| decoded(frames[0][0].1[i]);
            let covered = (0..frames[0][0].1.len()).filter(|i| frame(*i).is_some()).count();
            assert!(
                covered * 5 > frames[0][0].1.len() && covered * 2 < frames[0][0].1.len(),
                "less than half a sphere: {covered}"
            );
            // Vector, weight, weight times spread and times normal of each cell.
            let normals = (moments.len() > weights.len()).then(|| &moments[0]);
            assert_eq!(cells.len(), count + count / 4 + if normals.is_some() { count } else { 0 });
            let mips = Mips::new(size, 8 * count, |i, out| {
                out.fill(0.0);
                let Some(frame) = frame(i) else { return };
                for (lobe, weight) in lobes.iter().zip(&weights) {
                    let stored = lobe[0].1[i];
                    let turned = view * (frame * vector(stored, 1.0));
                    let normal = normals.map_or(DVec3::ZERO, |normals| view * (frame * vector(normals[0].1[i], 1.0)));
                    let own = [turned.x, turned.y, turned.z, 1.0, stored[3].into(), normal.x, normal.y, normal.z];
                    let cell = partition.of(turned);
                    out[8 * cell..].iter_mut().zip(own).for_each(|(sum, c)| *sum += weight * c);
                }
            });
            let (mut worst, mut elsewhere, mut all) = ([0.0f64; 2], 0, 0);
            for level in 1..mips.levels() {
                assert_eq!(cells[0][level - 1].0, mips.size(level));
                for i in 0..cells[0][level - 1].1.len() {
                    let expected = mips.texel(level, i).unwrap().as_chunks::<8>().0;
                    let (sum, weight) = whole(&cells[..count], level - 1, i);
                    let sums = expected.iter().fold([0.0; 4], |s, e| [s[0] + e[0], s[1] + e[1], s[2] + e[2], s[3] + e[3]]);
                    let off = (sum - DVec3::from_slice(&sums)).length().max((weight - sums[3]).abs());
                    worst[0] = worst[0].max(off);
                    for (k, e) in expected.iter().enumerate() {
                        let stored = cells[k][level - 1].1[i];
                        let mut off = (vector(stored, stored[3].into()) - DVec3::from_slice(e)).length();
                        let spread = f64::from(cells[count + k / 4][level - 1].1[i][k % 4]);
                        off = off.max((spread - e[4]).abs());
                        if let Some(normals) = cells.get(count + count / 4 + k) {
                            let normal = vector(normals[level - 1].1[i], stored[3].into());
                            off = off.max((normal - DVec3::from_slice(&e[5..])).length());
                        }
                        all += 1;
                        // A lobe on a border is in one cell here and in the other there.
                        if off > 1e-5 {
                            elsewhere += 1
                        } else {
                            worst[1] = worst[1].max(off)
                        };
                    }
                }
            }
            println!("{name} {}: whole {:.1e}, cell {:.1e}, {elsewhere} of {all} elsewhere", filter.name(), worst[0], worst[1]);
            assert!(worst[0] < 3e-6 && elsewhere * 200 < all, "{name} {}: {worst:?} {elsewhere}", filter.name());
        }
    }
}

#[test]
fn frames_are_the_surfaces_and_weights_its_coverage() {
    let world = scene("sphere", metal(), bumps([64, 64], 0.3));
    let mut session = open(&world, &with(Bins::Camera, Filter::Vmf8, 16)).unwrap();
    render(&mut session);
    let [frames, cells] = session.object_cells(0).unwrap().unwrap();
    let (_, frames) = &frames[0][0];
    let eye = world.camera.position;
    let (mut seen, mut hidden) = (0, 0);
    for (i, stored) in frames.iter().enumerate() {
        let (u, v) = (((i % 64) as f64 + 0.5) / 64.0, 1.0 - ((i / 64) as f64 + 0.5) / 64.0);
        let ((sin_phi, cos_phi), (sin, cos)) = (((u - 0.5) * 2.0 * PI).sin_cos(), ((1.0 - v) * PI).sin_cos());
        let n = DVec3::new(sin * sin_phi, cos, sin * cos_phi);
        let facing = n.dot((eye - n).normalize());
        // At the poles the grid has no triangles.
        if facing.abs() < 0.03 || !(1..63).contains(&(i / 64)) {
            continue;
        }
        match decoded(*stored) {
            Some(frame) => {
                // Growing u is to the east; the interpolation of a grid is within this.
                let east = DVec3::new(cos_phi, 0.0, -sin_phi);
                assert!(frame.z_axis.dot(n) > 1.0 - 1e-5 && frame.x_axis.dot(east) > 1.0 - 1e-3, "{u} {v}: {frame}");
                assert!(frame.determinant() > 0.999 && facing > 0.0, "{u} {v}");
                seen += 1;
            }
            None => {
                assert!(facing < 0.0, "{u} {v}: {facing}");
                hidden += 1;
            }
        }
    }
    assert!(seen > 1000 && hidden > 2000, "{seen} {hidden}");
    let covered = |i: usize| f64::from(u8::from(decoded(frames[i]).is_some()));
    for i in 0..32 * 32 {
        let at = 2 * (i / 32) * 64 + 2 * (i % 32);
        let expected = (covered(at) + covered(at + 1) + covered(at + 64) + covered(at + 65)) / 4.0;
        assert!((whole(&cells[..8], 0, i).1 - expected).abs() < 1e-6);
    }
    let share = (0..64 * 64).map(covered).sum::<f64>() / 4096.0;
    assert!((whole(&cells[..8], 5, 0).1 - share).abs() < 1e-6);
}

/// Plane under these maps; its normal, direction of growing u and of growing v are +Y, +X, -Z.
fn turned_plane(model: Model, maps: Maps, turn: Mat4) -> (World, DMat3) {
    let mut world = scene("plane", model, maps);
    world.objects[0].transform = turn;
    let frame = DMat3::from_mat4(turn.as_dmat4()) * DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    (world, frame)
}

#[test]
fn on_a_plane_all_cells_together_are_the_tangent_frames_turned() {
    let mut tangent: Option<Vec<MomentLevels>> = None;
    for (i, turn) in [(0.9, 0.0, 0.0), (0.3, 1.0, 0.4), (1.2, -0.8, 0.6), (-2.0, 0.4, 0.0)].into_iter().enumerate() {
        let turn = Mat4::from_rotation_y(turn.1) * Mat4::from_rotation_x(turn.0) * Mat4::from_rotation_z(turn.2);
        let (mut world, frame_of_plane) = turned_plane(metal(), bumps([64, 64], 0.6), turn);
        world.camera.up = DVec3::new(0.3 * i as f64, 1.0, 0.0);
        let tangent = tangent.get_or_insert_with(|| {
            let mut session = open(&world, &with(Bins::Tangent, Filter::Vmf, 16)).unwrap();
            assert!(session.object_cells(0).unwrap().is_none());
            session.moments(0).unwrap().unwrap()[1][..8].to_vec()
        });
        let mut session = open(&world, &with(Bins::Camera, Filter::Vmf, 16)).unwrap();
        render(&mut session);
        let [_, cells] = session.object_cells(0).unwrap().unwrap();
        let seen = frame_of_plane.z_axis.dot(world.camera.position) > 0.0;
        assert_eq!(seen, i < 3, "the last is seen from behind");
        let view = world.camera.world_from_view().transpose() * frame_of_plane;
        let (mut worst, mut moved) = (0.0f64, 0.0f64);
        for level in 0..cells[0].len() {
            for texel in 0..cells[0][level].1.len() {
                let ((mean, one), (sum, weight)) = (whole(tangent, level, texel), whole(&cells[..8], level, texel));
                assert!((one - 1.0).abs() < 1e-5);
                let expected = if seen { (view * mean, 1.0) } else { (DVec3::ZERO, 0.0) };
                worst = worst.max((sum - expected.0).length()).max((weight - expected.1).abs());
                moved = moved.max(f64::from((tangent[0][level].1[texel][3] - cells[0][level].1[texel][3]).abs()));
            }
        }
        println!("turn {i}: {worst:.1e}, first cell's weight changes by up to {moved:.2}");
        assert!(worst < 4e-6 && moved > 0.3, "{i}: {worst:e} {moved}");
    }
}

/// Camera on the axis of a plane that faces it, its axes those of the plane's tangent frame but for a turn by `roll` in degrees.
fn facing(model: Model, maps: Maps, roll: f64) -> World {
    let (mut world, frame) = turned_plane(model, maps, Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2));
    assert!((frame - DMat3::IDENTITY).to_cols_array().iter().all(|c| c.abs() < 1e-6));
    let (sin, cos) = roll.to_radians().sin_cos();
    world.camera.position = DVec3::new(0.0, 0.0, 3.6);
    world.camera.up = DVec3::new(sin, cos, 0.0);
    world
}

#[test]
fn where_both_frames_are_one_so_are_the_images() {
    for (name, model) in [("ggx", metal()), ("two lobes", two_lobes())] {
        for filter in FILTERS {
            // From lod 0 at 16 texels a side to 2.4 at 256: base texels, what is between them and cells, and cells alone.
            for (roll, sides) in [(0.0, &[96][..]), (90.0, &[16, 96, 256][..])] {
                for &side in sides {
                    let world = facing(model.clone(), bumps([side; 2], 0.5), roll);
                    let [tangent, camera] =
                        [Bins::Tangent, Bins::Camera].map(|bins| render(&mut open(&world, &with(bins, filter, 48)).unwrap()));
                    let off = apart(&camera, &tangent);
                    println!("{name} {} roll {roll} side {side}: {off:.1e}", filter.name());
                    // What is found is kept in 16 bits, of which one is 5e-4 of a lobe's weight and concentration.
                    assert!(off < 2e-3, "{name} {} roll {roll} side {side}: {off:e}", filter.name());
                }
            }
        }
    }
}

#[test]
fn constant_maps_change_nothing() {
    let normal = Vec3::new(0.3, -0.2, 0.9).normalize().to_array();
    let maps = |size| Maps {
        normal: Some(Arc::new(Texture::normals(size, &texels(size, |_, _| normal)).unwrap())),
        roughness: Some((Arc::new(Texture::scalar(size, &texels(size, |_, _| 0.25)).unwrap()), Roughness::Alpha)),
        ..Maps::default()
    };
    let turn = Mat4::from_rotation_y(0.3) * Mat4::from_rotation_x(1.0);
    for size in [[16, 16], [150, 100], [512, 256]] {
        let (world, _) = turned_plane(metal(), maps(size), turn);
        let point = render(&mut open(&world, &with(Bins::Tangent, Filter::Point, 48)).unwrap());
        for filter in FILTERS {
            let off = apart(&render(&mut open(&world, &with(Bins::Camera, filter, 48)).unwrap()), &point);
            println!("{size:?} {}: {off:.1e}", filter.name());
            assert!(off < 4e-3, "{size:?} {}: {off:e}", filter.name());
        }
    }
}

#[test]
fn turning_the_camera_changes_what_is_seen_only_with_its_bins() {
    const STEPS: usize = 24;
    let maps = bumps([256, 256], 0.6);
    let mut changes = Vec::new();
    for bins in [Bins::Tangent, Bins::Camera] {
        let mut session = open(&facing(metal(), maps.clone(), 0.0), &with(bins, Filter::Vmf8, 3)).unwrap();
        let (mut worst, mut sum, mut squares, mut count) = (0.0f64, 0.0, 0.0, 0.0);
        for at in [DVec2::new(0.13, 0.21), DVec2::new(-0.4, 0.1), DVec2::new(0.3, -0.35), DVec2::new(-0.2, -0.45)] {
            let value = |step: usize, session: &mut Session| {
                let mut world = facing(metal(), maps.clone(), 4.0 * step as f64);
                world.camera.position += at.extend(0.0);
                world.camera.target += at.extend(0.0);
                // A pixel of some ten texels about the axis: it is the same at every roll.
                world.camera.fov_y = 4.0;
                session.show(&world).unwrap();
                render(session)[4].x
            };
            let values: Vec<f64> = (0..STEPS).map(|step| value(step, &mut session)).collect();
            let mean = values.iter().sum::<f64>() / STEPS as f64;
            assert!(mean > 1e-3, "{mean}");
            for v in &values {
                worst = worst.max((v / mean - 1.0).abs());
                sum += v / mean;
                squares += (v / mean).powi(2);
                count += 1.0;
            }
        }
        let deviation = (squares / count - (sum / count).powi(2)).max(0.0).sqrt();
        println!("{}: deviation {deviation:.2e} of the mean, at most {worst:.2e}", bins.name());
        changes.push((deviation, worst));
    }
    assert!(changes[0].1 < 1e-4, "tangent: {:?}", changes[0]);
    assert!(changes[1].0 > 0.01, "camera: {:?}", changes[1]);
}

#[test]
fn frames_make_the_cells_and_not_the_set_up() {
    let mut world = scene("sphere", metal(), bumps([64, 64], 0.3));
    // A second object and a material of another size, a table without cells, and an object that comes later.
    let mut second = world.materials[0].clone();
    (second.name, second.maps) = ("second".into(), bumps([128, 32], 0.2));
    let mut third = world.materials[0].clone();
    (third.name, third.model, third.maps.roughness) = ("third".into(), support::frames::table("metallic-paint"), None);
    world.materials.extend([second, third]);
    for (material, x, y) in [(1, 1.2f32, 0.0f32), (2, -1.2, 0.0), (0, 0.3, 0.9)] {
        let mut object = world.objects[0].clone();
        (object.material, object.transform) = (material, Mat4::from_translation(Vec3::new(x, y, -1.0)));
        world.objects.push(object);
    }
    let tilings = [[1.0; 2], [1.0; 2], [3.0; 2]];
    world.materials.iter_mut().zip(tilings).for_each(|(material, tiling)| material.maps.tiling = tiling);
    let mut session = open(&world, &with(Bins::Camera, Filter::Vmf, 32)).unwrap();
    let names = |rows: &[(&'static str, f64)]| rows.iter().map(|(name, _)| *name).collect::<Vec<_>>();
    let first = render(&mut session);
    render(&mut session);
    let rows = names(&session.timings().unwrap().passes);
    assert_eq!(rows[..4], ["gbuffer", "texture_space", "vmf_mips", "filter"], "{rows:?}");
    assert!(session.pass_bytes().iter().any(|(name, bytes)| *name == "texture_space" && *bytes == (2 * 64 * 64 + 128 * 32) * 16));
    // What is shown counts: one less, all again, and with another material.
    let mut fewer = world.clone();
    fewer.objects.truncate(1);
    session.show(&fewer).unwrap();
    assert!(render(&mut session) != first, "one object is not all");
    session.show(&world).unwrap();
    assert!(render(&mut session) == first, "all again");
    world.objects[3].material = 1;
    session.show(&world).unwrap();
    assert!(render(&mut session) != first, "another material");
    for (object, has) in [(0, true), (1, true), (2, false), (3, true), (9, false)] {
        assert_eq!(session.object_cells(object).unwrap().is_some(), has, "{object}");
    }
    // Without moments of normals beside lobes there is nothing to average beforehand.
    let alone = open(&scene("sphere", metal(), bumps([64, 64], 0.3)), &with(Bins::Camera, Filter::Vmf8, 8)).unwrap();
    let set_up = names(alone.setup());
    assert!(set_up.contains(&"brdf_map") && !set_up.contains(&"vmf_mips"), "{set_up:?}");
}

#[test]
fn what_cells_of_the_camera_cannot_be_of_is_refused() {
    let base = with(Bins::Camera, Filter::Vmf8, 8);
    let world = scene("sphere", metal(), bumps([64, 64], 0.3));
    let refusal = |world: &World, config: &Config| open(world, config).err().unwrap().to_string();
    for filter in Filter::ALL.into_iter().filter(|filter| !FILTERS.contains(filter)) {
        let e = refusal(&world, &Config { filter, ..base.clone() });
        assert!(e.contains("Config::bins: expected tangent, unless the filter is vmf4, vmf8 or vmf"), "{e}");
        assert!(e.ends_with(&format!("got camera with {}", filter.name())), "{e}");
    }
    let host = GBufferSource::Host { layout: passband::ash::vk::DescriptorSetLayout::null() };
    let e = refusal(&world, &Config { gbuffer: host, ..base.clone() });
    assert!(e.contains("Config::bins: expected tangent, unless the G-buffer is made of draws"), "{e}");

    let mut tiled = world.clone();
    tiled.materials[0].maps.tiling = [1.0, 2.0];
    let e = refusal(&tiled, &base);
    assert!(e.contains("materials[0].maps.tiling: expected [1.0, 1.0], as bins are camera, got [1.0, 2.0]"), "{e}");
    let mut beyond = world.clone();
    Arc::make_mut(&mut beyond.objects[0].mesh).uvs.iter_mut().for_each(|uv| uv[0] *= 1.5);
    let e = refusal(&beyond, &base);
    assert!(e.contains("objects[0] texture coordinates of triangle") && e.contains("expected 0 to 1"), "{e}");
    // Both sheets of the pillow have all of the texture.
    let e = refusal(&scene("pillow", metal(), bumps([64, 64], 0.3)), &base);
    assert!(e.contains("objects[0] texture coordinates of triangle") && e.contains("no other triangle"), "{e}");
    // None of this is asked of the tangent frame's, nor of what has no cells.
    for world in [&tiled, &beyond] {
        open(world, &Config { bins: Bins::Tangent, ..base.clone() }).unwrap();
    }
    tiled.materials[0].maps = Maps { tiling: [2.0; 2], ..Maps::default() };
    render(&mut open(&tiled, &base).unwrap());
}
