//! RGL files: against Mitsuba's reader on random numbers (`scripts/rgl-table` makes them), and against an analytic material
//! that a synthesiser here writes as such a file; what is malformed; and the tables baked for the GPU.

use glam::{DVec2, DVec3};
use passband::reflectance::{Reflectance, Rgl, bake, turned};
use passband::sampling::sobol;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::PathBuf;

/// Mitsuba evaluates in single precision; measured 9e-7.
const MITSUBA: f64 = 1e-5;

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/rgl").join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(data(name)).unwrap()
}

#[test]
fn agrees_with_mitsuba() {
    for name in ["isotropic", "whole", "half", "quarter"] {
        let rgl = Rgl::from_bytes(&bytes(&format!("{name}.bsdf"))).unwrap();
        assert_eq!(rgl.isotropic(), name == "isotropic");
        let table = std::fs::read_to_string(data(&format!("{name}.csv"))).unwrap();
        let mut worst = (0.0, "");
        for line in table.lines().skip(1) {
            let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            let [lx, ly, lz, vx, vy, vz, r, g, b] = row[..] else { panic!("{line}: nine columns") };
            let got = rgl.evaluate(DVec3::new(lx, ly, lz), DVec3::new(vx, vy, vz));
            let error = ((got - DVec3::new(r, g, b)) / DVec3::new(r, g, b)).abs().max_element();
            if error > worst.0 {
                worst = (error, line);
            }
        }
        println!("{name}: worst {:.2e} at {}", worst.0, worst.1);
        assert_eq!(table.lines().count(), 201);
        assert!(worst.0 < MITSUBA, "{name}: {:.2e} at {}", worst.0, worst.1);
    }
}

/// GGX with two roughnesses and separable Smith masking: what the synthesised file stands for.
struct Analytic {
    alpha: DVec2,
    f0: DVec3,
}

impl Analytic {
    fn ndf(&self, m: DVec3) -> f64 {
        let q = (m.x / self.alpha.x).powi(2) + (m.y / self.alpha.y).powi(2) + m.z * m.z;
        1.0 / (PI * self.alpha.x * self.alpha.y * q * q)
    }

    fn masking(&self, w: DVec3) -> f64 {
        let slope = (self.alpha.x * w.x).powi(2) + (self.alpha.y * w.y).powi(2);
        2.0 * w.z / (w.z + (w.z * w.z + slope).sqrt())
    }

    fn fresnel(&self, cosine: f64) -> DVec3 {
        self.f0 + (DVec3::ONE - self.f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
    }
}

impl Reflectance for Analytic {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = (wi + wo).normalize();
        self.fresnel(wi.dot(h)) * (self.ndf(h) * self.masking(wi) * self.masking(wo) / (4.0 * wi.z * wo.z))
    }

    fn isotropic(&self) -> bool {
        self.alpha.x == self.alpha.y
    }
}

/// The direction of a point of the square.
fn direction(u: f64, v: f64) -> DVec3 {
    let (theta, phi) = (FRAC_PI_2 * u * u, PI * (2.0 * v - 1.0));
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// A bilinear density on `n x n` nodes, `values[row][column]`, and the point to which it takes `s`: the row by the integral
/// over rows, then the column by that along the row, both by bisection.
fn forward(values: &[f64], n: usize, s: [f64; 2]) -> [f64; 2] {
    let solve = |nodes: &[f64], share: f64| {
        let integral = |x: f64| {
            let x = x * (n - 1) as f64;
            let cell = (x as usize).min(n - 2);
            let whole: f64 = nodes.windows(2).take(cell).map(|p| 0.5 * (p[0] + p[1])).sum();
            let t = x - cell as f64;
            whole + t * (nodes[cell] + 0.5 * t * (nodes[cell + 1] - nodes[cell]))
        };
        let total = integral(1.0);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if integral(middle) < share * total { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let rows: Vec<f64> = values.chunks(n).map(|r| r.windows(2).map(|p| 0.5 * (p[0] + p[1])).sum()).collect();
    let y = solve(&rows, s[1]);
    let at = y * (n - 1) as f64;
    let row = (at as usize).min(n - 2);
    let t = at - row as f64;
    let across: Vec<f64> = (0..n).map(|c| values[row * n + c] * (1.0 - t) + values[(row + 1) * n + c] * t).collect();
    [solve(&across, s[0]), y]
}

/// A field: name, type, shape, data.
type Entry = (&'static str, u8, Vec<u64>, Vec<u8>);

fn floats(name: &'static str, shape: &[usize], values: &[f64]) -> Entry {
    assert_eq!(shape.iter().product::<usize>(), values.len(), "{name}");
    let data = values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    (name, 10, shape.iter().map(|&n| n as u64).collect(), data)
}

fn container(fields: &[Entry]) -> Vec<u8> {
    let directory: usize = fields.iter().map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len()).sum();
    let mut offset = 18 + directory;
    let mut bytes = b"tensor_file\0\x01\x00".to_vec();
    bytes.extend((fields.len() as u32).to_le_bytes());
    for (name, kind, shape, data) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend((offset as u64).to_le_bytes());
        shape.iter().for_each(|side| bytes.extend(side.to_le_bytes()));
        offset += data.len();
    }
    assert_eq!(bytes.len(), 18 + directory);
    fields.iter().for_each(|(.., data)| bytes.extend(data));
    bytes
}

/// How finely a file is written.
struct Fineness {
    /// Incidences: azimuths of a part of the circle, polar angles.
    phi: usize,
    theta: usize,
    /// Sides of the visible normals and of the colours.
    warp: usize,
    rgb: usize,
    /// Azimuths and polar angles of normals, and polar angles of projected areas.
    turns: usize,
    ndf: usize,
    sigma: usize,
}

/// To compare with what is written.
const FINE: Fineness = Fineness { phi: 9, theta: 16, warp: 64, rgb: 32, turns: 129, ndf: 512, sigma: 256 };
/// To keep.
const SMALL: Fineness = Fineness { phi: 5, theta: 8, warp: 24, rgb: 8, turns: 33, ndf: 128, sigma: 64 };

/// The file of `material` with incidences over 1/`parts` of the circle; isotropic for 0.
fn synthesise(material: &Analytic, parts: usize, fineness: &Fineness) -> Vec<u8> {
    let Fineness { phi: azimuths, theta: angles, warp, rgb: side, .. } = *fineness;
    let unit = |i: usize, n: usize| i as f64 / (n - 1) as f64;
    let phi: Vec<f64> = match parts {
        0 => vec![0.0],
        parts => (0..azimuths).map(|i| -PI + TAU / parts as f64 * unit(i, azimuths)).collect(),
    };
    let theta: Vec<f64> = (0..angles).map(|i| 1.53 * unit(i, angles)).collect();
    let plane = |size: [usize; 2], f: &dyn Fn(DVec3) -> f64| -> Vec<f64> {
        (0..size[0] * size[1]).map(|i| f(direction(unit(i % size[1], size[1]), unit(i / size[1], size[0])))).collect()
    };
    let turns = if parts == 0 { 2 } else { fineness.turns };
    let ndf = plane([turns, fineness.ndf], &|m| material.ndf(m));
    // Projected area: cosine over masking, whose limit at the horizon is half the slope's deviation.
    let sigma = plane([turns, fineness.sigma], &|w| {
        let w = if w.z < 1e-6 { DVec3::new(w.x, w.y, 1e-6) } else { w };
        w.z / material.masking(w)
    });
    let (mut vndf, mut rgb) = (Vec::new(), Vec::new());
    for &phi in &phi {
        for &theta in &theta {
            let i = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let density: Vec<f64> = (0..warp * warp)
                .map(|k| {
                    let (u, v) = (unit(k % warp, warp), unit(k / warp, warp));
                    let m = direction(u, v);
                    material.ndf(m) * i.dot(m).max(0.0) * u * m.z.acos().sin() + 1e-6
                })
                .collect();
            let mut planes = [Vec::new(), Vec::new(), Vec::new()];
            for k in 0..side * side {
                let [u, v] = forward(&density, warp, [unit(k % side, side), unit(k / side, side)]);
                let m = direction(u, v);
                let o = 2.0 * i.dot(m) * m - i;
                let rest = material.fresnel(i.dot(m)) * if o.z > 0.0 { material.masking(o) } else { 0.0 };
                planes.iter_mut().zip(rest.to_array()).for_each(|(plane, c)| plane.push(c));
            }
            vndf.extend(density);
            rgb.extend(planes.concat());
        }
    }
    container(&[
        ("description", 1, vec![9], b"synthetic".to_vec()),
        ("jacobian", 1, vec![1], vec![1]),
        floats("luminance", &[phi.len(), angles, 2, 2], &vec![1.0; phi.len() * angles * 4]),
        floats("ndf", &[turns, fineness.ndf], &ndf),
        floats("phi_i", &[phi.len()], &phi),
        floats("rgb", &[phi.len(), angles, 3, side, side], &rgb),
        floats("sigma", &[turns, fineness.sigma], &sigma),
        floats("theta_i", &[angles], &theta),
        floats("vndf", &[phi.len(), angles, warp, warp], &vndf),
    ])
}

fn materials() -> [(Analytic, usize); 4] {
    let isotropic = || Analytic { alpha: DVec2::splat(0.25), f0: DVec3::new(0.9, 0.6, 0.2) };
    let brushed = || Analytic { alpha: DVec2::new(0.4, 0.15), f0: DVec3::new(0.9, 0.6, 0.2) };
    [(isotropic(), 0), (brushed(), 1), (brushed(), 2), (brushed(), 4)]
}

#[test]
fn a_synthesised_file_reproduces_the_material_that_it_stands_for() {
    for (material, parts) in materials() {
        let rgl = Rgl::from_bytes(&synthesise(&material, parts, &FINE)).unwrap();
        assert_eq!(rgl.isotropic(), parts == 0);
        let mut errors = Vec::new();
        for i in 0..20_000 {
            let [a, b] = sobol::random(i, 71).map(sobol::to_unit);
            let [c, d] = sobol::random(i, 72).map(sobol::to_unit);
            let view = direction((0.9 * a).sqrt(), b);
            let m = direction(0.7 * c, d);
            let light = 2.0 * view.dot(m) * m - view;
            if view.z < 0.3 || light.z < 0.3 || view.dot(m) <= 0.0 {
                continue;
            }
            let (got, expected) = (rgl.evaluate(light, view), material.evaluate(light, view));
            errors.push(((got - expected) / expected).abs().max_element());
        }
        errors.sort_by(f64::total_cmp);
        let at = |q: f64| errors[(errors.len() as f64 * q) as usize];
        // Relative, far from the highlight too, where the incidences' spacing (6 degrees, and up to 45 in azimuth) shows.
        let (half, most, rms) = (at(0.5), at(0.9), bake::error(&material, &rgl, 20_000).rms);
        println!("{parts}: of {} median {half:.2e}, 90 % {most:.2e}; rms {rms:.2e}", errors.len());
        assert!(errors.len() > 5000 && half < 5e-3 && most < 0.03 && rms < 0.03, "{parts}: {half} {most} {rms}");
    }
}

/// What `passband bench --suite residual` has of this format. Written anew with `PASSBAND_BLESS=1`.
#[test]
fn the_stand_ins_of_the_bench_are_what_is_synthesised() {
    let satin = Analytic { alpha: DVec2::splat(0.3), f0: DVec3::new(0.55, 0.4, 0.3) };
    let brushed = Analytic { alpha: DVec2::new(0.4, 0.15), f0: DVec3::new(0.9, 0.85, 0.75) };
    for (name, material, parts) in [("satin.bsdf", satin, 0), ("brushed.bsdf", brushed, 4)] {
        let written = synthesise(&material, parts, &SMALL);
        if std::env::var_os("PASSBAND_BLESS").is_some() {
            std::fs::write(data(name), &written).unwrap();
        }
        let [kept, expected] = [bytes(name), written].map(|file| Rgl::from_bytes(&file).unwrap());
        assert_eq!(kept.isotropic(), parts == 0);
        let error = bake::error(&material, &kept, 20_000);
        println!("{name}: {} bytes, {error:?}", bytes(name).len());
        assert!(bytes(name).len() < 200_000 && error.rms < 0.1, "{name}: {error:?}");
        for i in 0..1000 {
            let [a, b] = sobol::random(i, 75).map(sobol::to_unit);
            let [c, d] = sobol::random(i, 76).map(sobol::to_unit);
            let (wi, wo) = (direction(0.9 * a, b), direction(0.9 * c, d));
            let (f, g) = (kept.evaluate(wi, wo), expected.evaluate(wi, wo));
            // Sines of another library may differ in the last bit.
            assert!((f - g).abs().max_element() <= 1e-3 * g.max_element(), "{name}: {f} for {g}");
        }
    }
}

#[test]
fn the_albedo_is_the_analytic_one() {
    // An integral over light, so that a warp that keeps values but moves them would show.
    for (material, parts) in materials() {
        let rgl = Rgl::from_bytes(&synthesise(&material, parts, &FINE)).unwrap();
        let view = DVec3::new(0.5, -0.3, 0.8).normalize();
        let albedo = |f: &dyn Reflectance| {
            let mut sum = DVec3::ZERO;
            for i in 0..200 {
                for j in 0..400 {
                    let (u, v) = ((f64::from(i) + 0.5) / 200.0, (f64::from(j) + 0.5) / 400.0);
                    let m = direction(u, v);
                    let (light, theta) = (2.0 * view.dot(m) * m - view, FRAC_PI_2 * u * u);
                    if light.z > 0.0 && view.dot(m) > 0.0 {
                        let solid_angle = 2.0 * PI * PI * u * theta.sin() / (200.0 * 400.0);
                        sum += f.evaluate(light, view) * (light.z * 4.0 * view.dot(m) * solid_angle);
                    }
                }
            }
            sum
        };
        let (got, expected) = (albedo(&rgl), albedo(&material));
        println!("{parts}: {got:.4} for {expected:.4}");
        assert!(((got - expected) / expected).abs().max_element() < 3e-3, "{parts}: {got} for {expected}");
    }
}

#[test]
fn baked_tables_are_close_and_reciprocal() {
    for (material, parts) in materials() {
        // One anisotropic file suffices: each takes seconds.
        if parts == 1 || parts == 2 {
            continue;
        }
        let rgl = Rgl::from_bytes(&synthesise(&material, parts, &FINE)).unwrap();
        let clock = std::time::Instant::now();
        let baked: Box<dyn Reflectance> = if parts == 0 { Box::new(rgl.bake()) } else { Box::new(rgl.bake_turned().unwrap()) };
        let seconds = clock.elapsed().as_secs_f64();
        let error = bake::error(&rgl, baked.as_ref(), 20_000);
        println!("{parts}: baked in {seconds:.1} s, {error:?}");
        assert!(error.rms < 0.03 && error.median < 0.01, "{parts}: {error:?}");
        for i in 0..1000 {
            let [a, b] = sobol::random(i, 73).map(sobol::to_unit);
            let [c, d] = sobol::random(i, 74).map(sobol::to_unit);
            let (wi, wo) = (direction(a, b), direction(c, d));
            let (f, swapped) = (baked.evaluate(wi, wo), baked.evaluate(wo, wi));
            assert!((f - swapped).abs().max_element() <= 1e-9 * f.max_element(), "{wi} {wo}: {f} and {swapped}");
        }
        // Turned against the tangent frame, only what is not isotropic changes.
        let (wi, wo) = (direction(0.5, 0.1), direction(0.6, 0.55));
        let turn = DVec2::from_angle(1.0);
        let (f, g) = (baked.evaluate(wi, wo).x, baked.evaluate(turned(turn, wi), turned(turn, wo)).x);
        assert_eq!((f / g - 1.0).abs() > 1e-3, parts != 0, "{f} {g}");
    }
}

#[test]
fn malformed_files_are_refused_with_the_place() {
    let message = |bytes: &[u8]| Rgl::from_bytes(bytes).unwrap_err().to_string();
    assert_eq!(message(b"tensor"), "identifier at byte 0: expected 12 bytes, got 6 bytes");
    assert_eq!(message(b"tensor_pile\0\x01\x00"), "identifier at byte 0: expected tensor_file, got `tensor_pile\\x00`");
    assert_eq!(message(b"tensor_file\0\x02\x00"), "version at byte 12: expected 1.0, got 2.0");
    let many = [b"tensor_file\0\x01\x00".as_slice(), &u32::MAX.to_le_bytes()].concat();
    assert_eq!(message(&many), "number of fields at byte 14: expected at most 64, got 4294967295");
    assert_eq!(message(&container(&[])), "phi_i at byte 0: expected a field of that name, got none");
    let phi = floats("phi_i", &[1], &[0.0]);
    assert_eq!(
        message(&container(&[phi.clone(), floats("theta_i", &[2], &[0.5, 0.5])])),
        "theta_i at byte 76: expected rising numbers, got [0.500, 0.500]"
    );
    let huge = ("phi_i", 10, vec![u64::MAX, 2], vec![]);
    assert!(message(&container(&[huge])).starts_with("phi_i shape at byte 36: expected at most"));
    let kind = ("phi_i", 12, vec![1], vec![0; 4]);
    assert_eq!(message(&container(&[kind])), "phi_i type at byte 27: expected 1 to 11, got 12");
    let nan = floats("phi_i", &[1], &[f64::NAN]);
    assert_eq!(message(&container(&[nan])), "phi_i entry 0 at byte 44: expected a finite number, got NaN");
    let spectra = floats("spectra", &[1], &[0.0]);
    assert!(message(&container(&[spectra])).starts_with("rgb at byte 0: expected a field of that name (the database"));
    let theta = floats("theta_i", &[1], &[0.0]);
    let flag = ("jacobian", 1, vec![1], vec![1]);
    let rgb = floats("rgb", &[1, 1, 3, 1, 2], &[0.0; 6]);
    let flat = |n: &'static str, v: f64| floats(n, &[2, 2], &[v; 4]);
    let dark = floats("vndf", &[1, 1, 2, 2], &[0.0; 4]);
    let all = [phi, theta, flag, rgb, flat("ndf", 1.0), flat("sigma", 1.0), dark];
    assert!(message(&container(&all)).contains("expected densities >= 0 with a sum above 0"));
    let mut fixed = all.clone();
    fixed[6] = floats("vndf", &[1, 1, 2, 2], &[1.0; 4]);
    assert!(message(&container(&fixed)).contains("rgb shape at byte"), "{}", message(&container(&fixed)));
    fixed[3] = floats("rgb", &[1, 1, 3, 2, 2], &[1.0; 12]);
    assert!(Rgl::from_bytes(&container(&fixed)).is_ok());
    let mut three = fixed.clone();
    three[0] = floats("phi_i", &[3], &[0.0, 1.0, 2.0]);
    assert!(message(&container(&three)).contains("a whole, half or quarter circle, got 2 radians"));
}

#[test]
fn no_damage_makes_the_reader_panic_or_a_value_that_is_not_finite() {
    let good = bytes("half.bsdf");
    for length in 0..good.len() {
        assert!(Rgl::from_bytes(&good[..length]).is_err(), "cut at {length}");
    }
    let mut survived = 0;
    for i in 0..4000 {
        let mut bad = good.clone();
        for k in 0..1 + i % 3 {
            let [at, bits] = sobol::random(i, 80 + k);
            // Mostly in the directory, where damage matters.
            let at = at as usize % if i % 4 == 0 { good.len() } else { 500 };
            bad[at] ^= 1 << (bits % 8);
        }
        if let Ok(rgl) = Rgl::from_bytes(&bad) {
            survived += 1;
            for j in 0..20 {
                let [a, b] = sobol::random(j, 90).map(sobol::to_unit);
                let [c, d] = sobol::random(j, 91).map(sobol::to_unit);
                let f = rgl.evaluate(direction(a, b), direction(c, d));
                assert!(f.is_finite() && f.min_element() >= 0.0, "damage {i}: {f}");
            }
        }
    }
    println!("{survived} of 4000 damaged files are still files");
    assert!(survived > 100 && survived < 3900);
}
