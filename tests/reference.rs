//! The reference's own quadrature, checked against closed forms and against brute force that shares nothing with it.
#![cfg(feature = "offline")]

use glam::{DMat3, DVec2, DVec3, Mat4, Vec3};
use passband::offline::mesh::Mesh;
use passband::offline::reference::{MIN_COSINE, Options, Reference, ReferenceImage, bend};
use passband::offline::world::{Camera, EnvironmentLight, Material, Object, World};
use passband::reflectance::{Ggx, Model, Reflectance};
use passband::sampling::{LatLong, latlong};
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;
use std::time::Instant;

/// Reflects `1/pi` in every direction.
struct Lambert;

impl Reflectance for Lambert {
    fn evaluate(&self, _: DVec3, _: DVec3) -> DVec3 {
        DVec3::splat(FRAC_1_PI)
    }
}

/// Separable Smith GGX, Schlick from 0.9 / 0.6 / 0.2.
struct Metal {
    alpha: f64,
}

impl Reflectance for Metal {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = (wi + wo).normalize();
        let a2 = self.alpha * self.alpha;
        let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
        let g1 = |z: f64| 2.0 * z / (z + (a2 + (1.0 - a2) * z * z).sqrt());
        let f0 = DVec3::new(0.9, 0.6, 0.2);
        let f = f0 + (1.0 - f0) * (1.0 - wi.dot(h)).powi(5);
        f * (d * g1(wi.z) * g1(wo.z) / (4.0 * wi.z * wo.z))
    }
}

/// A sphere with smooth normals.
fn sphere(columns: u32, rows: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let uv = DVec2::new(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            let p = latlong::direction(uv).as_vec3().to_array();
            mesh.positions.push(p);
            mesh.normals.push(p);
            mesh.uvs.push(uv.as_vec2().to_array());
            if i < columns && j < rows {
                let (a, b) = (j * (columns + 1) + i, (j + 1) * (columns + 1) + i);
                mesh.indices.extend([a, b, a + 1, a + 1, b, b + 1]);
            }
        }
    }
    mesh
}

fn world(map: LatLong) -> World {
    let model = Model::Ggx(Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO });
    World {
        name: "test".into(),
        camera: Camera { position: DVec3::new(0.0, 0.5, 3.5), target: DVec3::ZERO, up: DVec3::Y, fov_y: 36.0 },
        size: None,
        lights: Vec::new(),
        shadows: None,
        environment: Some(EnvironmentLight { map, intensity: 1.0, rotation: 0.0, visible: false }),
        objects: vec![Object { mesh: Arc::new(sphere(96, 48)), transform: Mat4::IDENTITY, material: 0 }],
        materials: vec![Material { name: "material".into(), model, maps: Default::default() }],
    }
}

fn map(width: u32, height: u32, radiance: impl Fn(u32, u32) -> DVec3) -> LatLong {
    let texels = (0..width * height).map(|i| radiance(i % width, i / width).as_vec3().to_array()).collect();
    LatLong::new(width, height, texels).unwrap()
}

fn constant() -> LatLong {
    map(1, 1, |_, _| DVec3::ONE)
}

/// A smooth sky over a dark ground with a sun of 2x2 texels.
fn sun_sky(width: u32, height: u32) -> LatLong {
    let sun = [width * 5 / 8, height / 4];
    map(width, height, |x, y| {
        let w = latlong::direction(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / DVec2::new(width.into(), height.into()));
        let sky = DVec3::new(0.3, 0.5, 1.0) * (0.4 + 0.6 * w.y.max(0.0)) + 0.2 * w.x;
        let in_sun = x.abs_diff(sun[0]) < 2 && x >= sun[0] && y.abs_diff(sun[1]) < 2 && y >= sun[1];
        if in_sun {
            DVec3::new(900.0, 800.0, 600.0)
        } else if w.y > 0.0 {
            sky.max(DVec3::ZERO)
        } else {
            DVec3::splat(0.08)
        }
    })
}

/// Every texel is different.
fn noise(width: u32, height: u32) -> LatLong {
    let hash = |i: u32| {
        let mut x = i.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
        x = (x ^ (x >> 15)).wrapping_mul(0x2C1B_3C6D);
        x = (x ^ (x >> 12)).wrapping_mul(0x297A_2D39);
        f64::from(x ^ (x >> 15)) / f64::from(u32::MAX)
    };
    map(width, height, |x, y| DVec3::from_array([0, 1, 2].map(|c| hash((y * width + x) * 3 + c).powi(4) * 5.0)))
}

fn render(world: &World, reflectance: &dyn Reflectance, size: u32, options: Options) -> ReferenceImage {
    Reference::with_reflectances(world, [size, size], options, vec![reflectance]).unwrap().render()
}

/// Covered pixels, about `count` of them.
fn some_pixels(image: &ReferenceImage, count: usize) -> Vec<usize> {
    let covered: Vec<usize> = (0..image.hits.len()).filter(|i| image.coverage[*i]).collect();
    covered.iter().step_by((covered.len() / count).max(1)).copied().collect()
}

/// The integrand's reflectance times cosine for a direction in the world.
fn lobe(reflectance: &dyn Reflectance, normal: DVec3, view: DVec3, w: DVec3) -> DVec3 {
    let (t, b) = normal.any_orthonormal_pair();
    let local = |w: DVec3| DVec3::new(w.dot(t), w.dot(b), w.dot(normal));
    let wi = local(w);
    if wi.z > 0.0 { reflectance.evaluate(wi, local(view)) * wi.z } else { DVec3::ZERO }
}

/// Midpoint rule over the environment with `per_texel` points a side in each texel.
fn brute_force(world: &World, reflectance: &dyn Reflectance, normal: DVec3, view: DVec3, per_texel: u32) -> DVec3 {
    let light = world.environment.as_ref().unwrap();
    let (w, h) = (light.map.width() * per_texel, light.map.height() * per_texel);
    let mut sum = DVec3::ZERO;
    for y in 0..h {
        let mut row = DVec3::ZERO;
        for x in 0..w {
            let uv = DVec2::new((f64::from(x) + 0.5) / f64::from(w), (f64::from(y) + 0.5) / f64::from(h));
            let world_from_map = DMat3::from_rotation_y(light.rotation.to_radians());
            let direction = world_from_map * latlong::direction(uv);
            if direction.dot(normal) > 0.0 {
                row += light.radiance(direction) * lobe(reflectance, normal, view, direction);
            }
        }
        sum += row * (PI * (f64::from(y) + 0.5) / f64::from(h)).sin();
    }
    sum * (TAU / f64::from(w)) * (PI / f64::from(h))
}

/// Midpoint rule over half vectors, warped so that a GGX lobe of `alpha` is nearly constant.
fn half_vector_rule(world: &World, metal: &Metal, normal: DVec3, view: DVec3, steps: u32) -> DVec3 {
    let light = world.environment.as_ref().unwrap();
    let (t, b) = normal.any_orthonormal_pair();
    let mut sum = DVec3::ZERO;
    for i in 0..steps {
        let u = (f64::from(i) + 0.5) / f64::from(steps);
        let tangent = metal.alpha * (u / (1.0 - u)).sqrt();
        let theta = tangent.atan();
        let dtheta_du = metal.alpha / (2.0 * (u * (1.0 - u).powi(3)).sqrt()) / (1.0 + tangent * tangent);
        for j in 0..steps {
            let phi = TAU * (f64::from(j) + 0.5) / f64::from(steps);
            let h = (t * phi.cos() + b * phi.sin()) * theta.sin() + normal * theta.cos();
            let w = h * (2.0 * h.dot(view)) - view;
            if h.dot(view) > 0.0 && w.dot(normal) > 0.0 {
                let measure = 4.0 * h.dot(view) * theta.sin() * dtheta_du;
                sum += light.radiance(w) * lobe(metal, normal, view, w) * measure;
            }
        }
    }
    sum * TAU / f64::from(steps).powi(2)
}

fn relative(a: DVec3, b: DVec3) -> f64 {
    ((a - b).abs() / b).max_element()
}

#[test]
fn lambert_in_a_furnace_returns_one() {
    let world = world(constant());
    let image = render(&world, &Lambert, 32, Options::default());
    assert!(image.coverage.iter().filter(|c| **c).count() > 400);
    for (i, radiance) in image.radiance.iter().enumerate().filter(|(i, _)| image.coverage[*i]) {
        assert!(relative(*radiance, DVec3::ONE) < 1e-3 && image.error[i] <= 1e-3, "pixel {i}: {radiance}");
    }
    let tight = Reference::with_reflectances(&world, [32, 32], Options { tolerance: 1e-6, ..Options::default() }, vec![&Lambert]);
    let estimate = tight.unwrap().pixel([16, 14]).unwrap().unwrap();
    assert!(relative(estimate.radiance, DVec3::ONE) < 1e-6 && estimate.error <= 1e-6, "{estimate:?}");
}

#[test]
fn broad_lobes_agree_with_brute_force() {
    for map in [sun_sky(64, 32), noise(64, 32)] {
        let world = World {
            environment: Some(EnvironmentLight { rotation: 37.0, ..world(map).environment.unwrap() }),
            ..world(constant())
        };
        let metal = Metal { alpha: 0.5 };
        for reflectance in [&Lambert as &dyn Reflectance, &metal] {
            let image = render(&world, reflectance, 16, Options::default());
            for i in some_pixels(&image, 8) {
                let hit = image.hits[i].as_ref().unwrap();
                let truth = brute_force(&world, reflectance, hit.normal, hit.view, 8);
                let off = relative(image.radiance[i], truth);
                assert!(off < 1e-3, "pixel {i}, cosine {}: {} for {truth}: {off:e}", hit.normal.dot(hit.view), image.radiance[i]);
            }
        }
    }
}

#[test]
fn mirror_like_lobes_agree_with_a_half_vector_rule() {
    let world = world(noise(128, 64));
    let metal = Metal { alpha: 0.03 };
    let image = render(&world, &metal, 32, Options::default());
    let mut checked = 0;
    for i in some_pixels(&image, 12) {
        let hit = image.hits[i].as_ref().unwrap();
        let [coarse, truth] = [500, 1000].map(|steps| half_vector_rule(&world, &metal, hit.normal, hit.view, steps));
        // At grazing views the horizon cuts the lobe and this rule converges slowly: what it does not know is no error.
        let unknown = relative(coarse, truth);
        if unknown < 1e-3 {
            checked += 1;
            let off = relative(image.radiance[i], truth);
            let cosine = hit.normal.dot(hit.view);
            assert!(off < 1e-3 + unknown, "pixel {i}, cosine {cosine}: {} for {truth}: {off:e}", image.radiance[i]);
        }
    }
    assert!(checked >= 5, "only {checked} pixels were checked");
}

#[test]
fn mirror_like_lobes_agree_with_brute_force() {
    for map in [sun_sky(128, 64), noise(128, 64)] {
        let world = world(map);
        let metal = Metal { alpha: 0.03 };
        let image = render(&world, &metal, 32, Options::default());
        let cosine = |i: usize| image.hits[i].as_ref().map_or(0.0, |hit| hit.normal.dot(hit.view));
        // Grazing, oblique and frontal views: the first is where a mirror's lobe is narrowest.
        for range in [0.02..0.06, 0.2..0.4, 0.9..1.0] {
            let i = (0..image.hits.len()).find(|i| range.contains(&cosine(*i))).unwrap();
            let hit = image.hits[i].as_ref().unwrap();
            let off = relative(image.radiance[i], brute_force(&world, &metal, hit.normal, hit.view, 48));
            assert!(off < 1e-3, "pixel {i}, cosine {}: {off:e}", cosine(i));
        }
    }
}

#[test]
fn a_tighter_tolerance_stays_within_the_reported_error() {
    let world = world(noise(64, 32));
    for alpha in [0.003, 0.03, 0.4] {
        let metal = Metal { alpha };
        let loose = render(&world, &metal, 16, Options { tolerance: 1e-2, ..Options::default() });
        let tight = render(&world, &metal, 16, Options { tolerance: 1e-5, ..Options::default() });
        for i in some_pixels(&loose, 40) {
            let off = relative(loose.radiance[i], tight.radiance[i]);
            assert!(
                loose.error[i] <= 1e-2 && off <= loose.error[i].max(1e-4),
                "pixel {i}: {off:e}, reported {:e}",
                loose.error[i]
            );
        }
    }
}

#[test]
fn an_exhausted_budget_is_reported() {
    let world = world(noise(64, 32));
    let image =
        render(&world, &Metal { alpha: 0.03 }, 8, Options { tolerance: 1e-9, max_evaluations: 5000, ..Options::default() });
    assert!(some_pixels(&image, 10).iter().all(|i| image.error[*i] > 1e-9));
}

#[test]
fn intensity_scales_and_rotation_turns_the_light() {
    let plain = world(sun_sky(64, 32));
    // A quarter turn about +Y moves the map's directions by a quarter of its columns.
    let turned = map(64, 32, |x, y| plain.environment.as_ref().unwrap().map.texel(i64::from(x) + 16, i64::from(y)));
    let mut rotated = world(turned);
    let light = rotated.environment.as_mut().unwrap();
    (light.rotation, light.intensity) = (-90.0, 3.0);
    let (a, b) = (render(&plain, &Lambert, 8, Options::default()), render(&rotated, &Lambert, 8, Options::default()));
    for i in some_pixels(&a, 20) {
        assert!(relative(b.radiance[i], a.radiance[i] * 3.0) < 2e-3, "{} {}", a.radiance[i], b.radiance[i]);
    }
}

#[test]
fn the_background_shows_the_environment_only_if_visible() {
    let mut world = world(constant());
    let dark = render(&world, &Lambert, 8, Options::default());
    world.environment.as_mut().unwrap().visible = true;
    let bright = render(&world, &Lambert, 8, Options::default());
    assert!(!dark.coverage[0] && dark.radiance[0] == DVec3::ZERO && bright.radiance[0] == DVec3::ONE);
    assert_eq!(dark.coverage, bright.coverage);
}

#[test]
fn hits_lie_on_the_sphere() {
    let mut world = world(constant());
    // A mirrored, unevenly scaled and moved sphere: an ellipsoid with normals by the gradient of its equation.
    let (scale, shift) = (DVec3::new(-0.6, 1.1, 0.8), DVec3::new(0.1, -0.05, 0.2));
    world.objects[0].mesh = Arc::new(sphere(512, 256));
    world.objects[0].transform = Mat4::from_translation(shift.as_vec3()) * Mat4::from_scale(scale.as_vec3());
    let image = render(&world, &Lambert, 32, Options { tolerance: 0.1, ..Options::default() });
    let axis = (world.camera.target - world.camera.position).normalize();
    let interior = image.interior();
    let mut seen = 0;
    for (i, hit) in image.hits.iter().enumerate() {
        let ray = world.camera.ray(DVec2::new((i % 32) as f64 + 0.5, (i / 32) as f64 + 0.5), [32, 32]);
        let Some(hit) = hit else {
            assert!(!interior[i]);
            continue;
        };
        assert_eq!((hit.object, hit.material, hit.view), (0, 0, -ray));
        assert!(hit.normal.dot(hit.view) >= MIN_COSINE - 1e-12);
        let point = world.camera.position + ray * (hit.depth / ray.dot(axis));
        let on_unit = (point - shift) / scale;
        let gradient = (on_unit / scale).normalize();
        assert!((on_unit.length() - 1.0).abs() < 1e-3, "{}", on_unit.length());
        if interior[i] {
            seen += 1;
            assert!(hit.normal.dot(gradient) > 1.0 - 1e-4, "{} {gradient}", hit.normal);
        }
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn the_nearest_object_wins_and_steps_are_not_interior() {
    let mut world = world(constant());
    let small = Mat4::from_translation(Vec3::new(0.0, 0.3, 2.0)) * Mat4::from_scale(Vec3::splat(0.2));
    world.objects.push(Object { mesh: world.objects[0].mesh.clone(), transform: small, material: 0 });
    let image = render(&world, &Lambert, 64, Options { tolerance: 0.1, ..Options::default() });
    let interior = image.interior();
    let object = |i: usize| image.hits[i].as_ref().map(|h| h.object);
    assert_eq!(object(32 * 64 + 32), Some(1));
    assert!((0..64 * 64).any(|i| interior[i] && object(i) == Some(0)));
    assert!((0..64 * 63).all(|i| object(i) == object(i + 64) || (!interior[i] && !interior[i + 64])));
}

#[test]
fn normals_that_face_away_are_bent_to_the_least_cosine() {
    let view = DVec3::new(0.3, -0.2, 0.9).normalize();
    for normal in [DVec3::X, -view, DVec3::new(-0.5, 0.1, -0.8).normalize(), DVec3::new(0.9, 0.0, -0.3).normalize()] {
        let bent = bend(normal, view);
        assert!((bent.length() - 1.0).abs() < 1e-12);
        if normal.dot(view) >= MIN_COSINE {
            assert_eq!(bent, normal);
        } else {
            assert!((bent.dot(view) - MIN_COSINE).abs() < 1e-12);
            // In the plane of the normal and the view direction.
            assert!(bent.dot(normal.cross(view)).abs() < 1e-12);
        }
    }
}

#[test]
fn indices_and_extents_out_of_range_are_errors() {
    let fails = |world: &World, extent: [u32; 2]| Reference::new(world, extent, Options::default()).err().unwrap().to_string();
    assert!(fails(&world(constant()), [0, 4]).contains("extent"));
    let mut broken = world(constant());
    broken.objects[0].material = 3;
    assert!(fails(&broken, [4, 4]).contains("objects[0].material: expected a material below 1, got 3"));
    let mut broken = world(constant());
    Arc::make_mut(&mut broken.objects[0].mesh).indices[7] = 99_999;
    assert!(fails(&broken, [4, 4]).contains("objects[0].mesh.indices"));
    let good = world(constant());
    let reference = Reference::new(&good, [4, 4], Options::default()).unwrap();
    assert!(reference.pixel([4, 0]).is_err() && reference.pixel([0, 4]).is_err());
    assert_eq!(reference.pixel([0, 0]).unwrap(), None);
}

/// Not a check: prints what the reference costs. `cargo test --test reference -- --ignored --nocapture`
#[test]
#[ignore = "prints timings"]
fn timings() {
    for (name, map) in [("sun-sky", sun_sky(128, 64)), ("noise", noise(128, 64)), ("noise 1024x512", noise(1024, 512))] {
        let start = Instant::now();
        let world = world(map);
        let mut line = format!("{name}:");
        let _ = Reference::with_reflectances(&world, [64, 64], Options::default(), vec![&Lambert]).unwrap();
        line += &format!(" setup {:.3} s;", start.elapsed().as_secs_f64());
        for alpha in [0.003, 0.03, 0.5] {
            let start = Instant::now();
            let metal = Metal { alpha };
            let image = render(&world, &metal, 64, Options::default());
            let pixels = image.coverage.iter().filter(|c| **c).count();
            let worst = image.error.iter().fold(0.0, |a: f64, b| a.max(*b));
            let mean = image.evaluations as f64 / pixels as f64;
            line += &format!(
                " alpha {alpha}: {:.2} s, {pixels} px, {mean:.0} evaluations, worst {worst:.1e};",
                start.elapsed().as_secs_f64()
            );
        }
        println!("{line}");
    }
    for (columns, rows, size) in [(230, 220, 64), (1000, 500, 512)] {
        let mut world = world(constant());
        world.objects[0].mesh = Arc::new(sphere(columns, rows));
        let start = Instant::now();
        let reference = Reference::with_reflectances(&world, [size, size], Options::default(), vec![&Lambert]).unwrap();
        let covered = reference.hits().iter().flatten().count();
        let triangles = 2 * columns * rows;
        println!("visibility: {triangles} triangles, {size}x{size}, {covered} covered: {:.3} s", start.elapsed().as_secs_f64());
    }
}
