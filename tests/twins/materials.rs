//! `ggx.glsl` and the material bridge against `Reflectance` and `ImportanceTable`.

use crate::{COUNT, Device, Worst, entry, rounded, unit};
use glam::{DVec3, Vec3};
use passband::reflectance::importance::{VIEW_ANGLES, node};
use passband::reflectance::merl::MerlTable;
use passband::reflectance::{Ggx, ImportanceTable, Model, Reflectance, packing, stand_in};
use passband::sampling::sobol;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Relative error of a reflectance.
const EVALUATION: f64 = 1e-3;

fn ggx(alpha: f64, f0: DVec3, albedo: DVec3) -> Model {
    Model::Ggx(Ggx { alpha, f0, albedo })
}

/// Several roughnesses, from a mirror-like lobe to none; metals, plastics and a diffuse surface.
fn analytic() -> Vec<Model> {
    let gold = DVec3::new(1.0, 0.78, 0.34);
    vec![
        ggx(0.01, DVec3::ONE, DVec3::ZERO),
        ggx(0.03, gold, DVec3::ZERO),
        ggx(0.1, DVec3::splat(0.04), DVec3::new(0.8, 0.3, 0.1)),
        ggx(0.35, gold * 0.5, DVec3::splat(0.2)),
        ggx(1.0, DVec3::splat(0.04), DVec3::splat(0.5)),
        ggx(0.5, DVec3::ZERO, DVec3::ONE),
    ]
}

fn tables() -> Vec<Arc<MerlTable>> {
    stand_in::names().iter().map(|name| Arc::new(stand_in::table(name).unwrap())).collect()
}

/// A table that tells every angle, also phi_diff from its mirror image, which the stand-ins do not; phi_diff only where it
/// means something.
fn telltale() -> MerlTable {
    MerlTable::from_fn(|half, diff, phi| {
        let turn = half.sin() * diff.sin() * DVec3::new((2.0 * phi).sin(), (2.0 * phi).cos(), phi.sin());
        DVec3::new(1.0, 0.2 + half, 0.6 + diff) + 0.2 * turn
    })
}

/// What the device holds of a table, in the same form.
fn as_packed(table: &MerlTable) -> MerlTable {
    let (scale, entries) = table.packed();
    let mut entries = entries.into_iter().map(|e| packing::decode(e) * f64::from(scale));
    MerlTable::from_fn(|_, _, _| entries.next().unwrap())
}

/// A pair of directions above the horizon for every `i`: the light anywhere, or where the half vector is near the normal; the
/// view anywhere, or low.
fn pair(i: u32) -> [Vec3; 2] {
    let upper = |cosine: f64, turn: f64| {
        let (s, phi) = ((1.0 - cosine * cosine).sqrt(), TAU * turn);
        DVec3::new(s * phi.cos(), s * phi.sin(), cosine)
    };
    let mut attempt = i;
    loop {
        let ([a, b], [c, d], [e, f]) = (unit(attempt, 40), unit(attempt, 41), unit(attempt, 42));
        let wo = upper(if e < 0.25 { 1e-3 + 0.05 * a } else { a.max(1e-3) }, b);
        let wi = if f < 0.4 {
            upper(c.max(1e-3), d)
        } else {
            let h = upper((FRAC_PI_2 * c.powi(4)).cos(), d);
            2.0 * wo.dot(h) * h - wo
        };
        if wi.z > 1e-3 {
            return [rounded(wi), rounded(wo)];
        }
        attempt = attempt.wrapping_add(0x0100_0000);
    }
}

/// Runs both directions of every pair on material `of(i)`; calls `check(i, wi, wo, forth, back)`.
fn evaluated(device: &mut Device, pairs: &[[Vec3; 2]], of: impl Fn(usize) -> u32, mut check: impl FnMut(usize, [DVec3; 4])) {
    let input: Vec<_> = pairs.iter().enumerate().flat_map(|(i, &[wi, wo])| [entry(wi, of(i)), entry(wo, 0)]).collect();
    let output = device.probe("evaluate", &input);
    for (i, (&[wi, wo], got)) in pairs.iter().zip(output.chunks(2)).enumerate() {
        let value = |v: [f32; 4]| Vec3::from_slice(&v).as_dvec3();
        check(i, [wi.as_dvec3(), wo.as_dvec3(), value(got[0]), value(got[1])]);
    }
}

/// The largest relative difference of any channel.
fn relative(got: DVec3, expected: DVec3) -> f64 {
    ((got - expected) / expected.max(DVec3::splat(1e-9))).abs().max_element()
}

/// Directions at the grid's ends, where a tile's neighbour must not show: grazing, along the normal, swapped and equal.
fn edges() -> Vec<[Vec3; 2]> {
    let low = |phi: f64, z: f64| rounded(DVec3::new(phi.cos(), phi.sin(), z));
    let mut edges = vec![[Vec3::Z, Vec3::Z]];
    for z in [1e-3, 5e-3, 0.02, 0.1] {
        for step in 0..=36 {
            let phi = PI * f64::from(step) / 36.0;
            edges.push([low(0.0, z), low(phi, z)]);
            edges.push([low(phi, 1.0), low(0.0, z)]);
        }
        edges.push([Vec3::Z, low(0.3, z)]);
    }
    edges
}

#[test]
fn ggx_evaluation_and_reciprocity() {
    let models = analytic();
    let mut device = Device::new(models.clone(), None);
    let mut pairs: Vec<_> = (0..6 * COUNT).map(pair).collect();
    pairs.extend(edges().into_iter().flat_map(|e| [e; 6]));
    let (mut worst, mut reciprocity) = (Worst::default(), Worst::default());
    evaluated(
        &mut device,
        &pairs,
        |i| (i % 6) as u32,
        |i, [wi, wo, forth, back]| {
            let at = || format!("material {}, {wi}, {wo}", i % 6);
            worst.add(relative(forth, models[i % 6].evaluate(wi, wo)), at);
            reciprocity.add(relative(back, forth), at);
        },
    );
    worst.within("GGX, relative", EVALUATION);
    // Rounded directions have not quite the same length, which Fresnel's term sees where they are almost opposite.
    reciprocity.within("GGX with directions swapped, relative", 3e-4);
}

#[test]
fn table_evaluation_and_reciprocity() {
    let mut tables = tables();
    tables.push(Arc::new(telltale()));
    // Between other materials, so that a table's place in the atlas is not its index.
    let mut models: Vec<_> = tables.iter().cloned().map(Model::Table).collect();
    models.insert(1, ggx(0.2, DVec3::ONE, DVec3::ZERO));
    let places = [0, 2, 3, 4];
    let packed: Vec<_> = tables.iter().map(|t| as_packed(t)).collect();
    let mut device = Device::new(models, None);
    let mut pairs: Vec<_> = (0..4 * COUNT).map(pair).collect();
    pairs.extend(edges().into_iter().flat_map(|e| [e; 4]));
    let mut worst = [(); 4].map(|()| [(); 3].map(|()| Worst::default()));
    evaluated(
        &mut device,
        &pairs,
        |i| places[i % 4],
        |i, [wi, wo, forth, back]| {
            let at = || format!("{wi}, {wo}");
            let [device, reciprocity, packing] = &mut worst[i % 4];
            let (held, exact) = (packed[i % 4].evaluate(wi, wo), tables[i % 4].evaluate(wi, wo));
            // A channel far below the largest is held in few steps; against the packed table that does not count.
            device.add(relative(forth, held), at);
            reciprocity.add(relative(back, forth), at);
            packing.add((held - exact).abs().max_element() / exact.max_element(), at);
        },
    );
    for (name, [device, reciprocity, packing]) in stand_in::names().iter().chain(&["telltale"]).zip(&worst) {
        device.within(&format!("{name} on the device against its packed table, relative"), EVALUATION);
        reciprocity.within(&format!("{name} with directions swapped, relative"), EVALUATION);
        packing.within(&format!("{name} packed, of the largest channel"), 4e-3);
    }
}

/// Tables and density tiles stand side by side: wherever one of them is in the atlas, its neighbours' peaks do not show.
#[test]
fn neighbours_do_not_show() {
    let (peaked, flat) = (Arc::new(as_packed(&stand_in::table("mirror-metal").unwrap())), Arc::new(as_packed(&telltale())));
    let importance = ImportanceTable::build(flat.as_ref());
    // The last fills more than one row of tables.
    for count in [4, 7, 23] {
        let copy = |i: usize| Arc::new(MerlTable::clone(if i.is_multiple_of(2) { &peaked } else { &flat }));
        let mut device = Device::new((0..count).map(|i| Model::Table(copy(i))).collect(), None);
        let flats = count / 2;
        let id = |i: usize| (2 * (i % flats) + 1) as u32;
        let pairs: Vec<_> = edges().into_iter().flat_map(|e| vec![e; flats]).collect();
        let mut worst = Worst::default();
        evaluated(&mut device, &pairs, id, |i, [wi, wo, forth, _]| {
            worst.add(relative(forth, flat.evaluate(wi, wo)), || format!("table {}, {wi}, {wo}", id(i)));
        });
        worst.within(&format!("one of {count} tables, relative"), EVALUATION);

        // At the horizon the peak of the next material is one row away.
        let low: Vec<_> = (0..64 * flats).map(|i| (i, rounded(DVec3::new((i as f64).cos(), (i as f64).sin(), 1e-4)))).collect();
        let input: Vec<_> = low.iter().flat_map(|&(i, h)| [entry(h, id(i)), [0.5f32.to_bits(), 0, 0, 0]]).collect();
        let mut worst = Worst::default();
        for (&(i, h), got) in low.iter().zip(device.probe("density", &input).chunks(2)) {
            let expected = importance.density(0.5, h.as_dvec3());
            worst.add((f64::from(got[0][0]) / expected - 1.0).abs(), || format!("material {}, {h}", id(i)));
        }
        worst.within(&format!("smooth density of one of {count}, relative"), SMOOTH);
    }
}

#[test]
fn ggx_agrees_with_mitsuba() {
    let rows: Vec<Vec<f64>> = include_str!("../data/ggx/roughconductor.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 1000);
    let vector = |v: &[f64]| Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32);
    let input: Vec<_> =
        rows.iter().flat_map(|r| [entry(vector(&r[1..4]), (r[0] as f32).to_bits()), entry(vector(&r[4..7]), 0)]).collect();
    let output = Device::bare().probe("ggx", &input);
    let mut worst = Worst::default();
    for (row, got) in rows.iter().zip(output.chunks(2)) {
        worst.add((f64::from(got[0][0]) / row[7] - 1.0).abs(), || format!("{row:?}"));
    }
    worst.within("GGX against Mitsuba, relative", 1e-4);
}

/// All models with their importance tables.
fn importance() -> (Vec<Model>, Vec<ImportanceTable>) {
    let mut models = analytic();
    models.extend(tables().into_iter().map(Model::Table));
    let tables = models.iter().map(|m| ImportanceTable::build(m)).collect();
    (models, tables)
}

/// A view cosine as the device gets it, not so near to the border of two nodes that 32 bits could tell it otherwise.
fn view_cosine(i: u32) -> f32 {
    let angle = (unit(i, 43)[0] * VIEW_ANGLES as f64).floor() + 0.01 + 0.98 * unit(i, 43)[1];
    (FRAC_PI_2 * angle / VIEW_ANGLES as f64).cos() as f32
}

#[test]
fn sampled_half_vectors_and_their_densities() {
    let (models, tables) = importance();
    let count = tables.len();
    let mut device = Device::new(models, None);
    let draws: Vec<_> = (0..count as u32 * COUNT).map(|i| (i as usize % count, view_cosine(i), sobol::random(i, 44))).collect();
    let input: Vec<_> = draws.iter().flat_map(|&(id, cosine, [a, b])| [[id as u32, cosine.to_bits(), a, b]; 2]).collect();
    let output = device.probe("sample", &input);
    let (mut toward, mut density, mut smooth) = (Worst::default(), Worst::default(), Worst::default());
    let mut nodes = std::collections::HashSet::new();
    for (&(id, cosine, u), got) in draws.iter().zip(output.chunks(2)) {
        let cosine = f64::from(cosine);
        nodes.insert(node(cosine));
        let at = || format!("material {id}, cosine {cosine}, {u:x?}");
        let (h, pdf) = tables[id].half_vector(cosine, u.map(sobol::to_unit));
        let [x, y, z, d] = got[0].map(f64::from);
        toward.add((DVec3::new(x, y, z) - h).length(), at);
        density.add((d / pdf - 1.0).abs(), at);
        let found = f64::from(got[1][0]);
        smooth.add((found / tables[id].density(cosine, DVec3::new(x, y, z)) - 1.0).abs(), at);
    }
    assert_eq!(nodes.len(), VIEW_ANGLES);
    toward.within("half vector", 2e-6);
    density.within("its density, relative", 1e-5);
    smooth.within("smooth density, relative", SMOOTH);
}

/// Relative error of the smooth density: half a step of a 16-bit float is 2^-11, and its coordinates have 32 bits.
const SMOOTH: f64 = 1e-3;

#[test]
fn smooth_density() {
    let (models, tables) = importance();
    let count = tables.len();
    let mut device = Device::new(models, None);
    let of = |i: u32| {
        let [a, b] = unit(i, 45);
        // Anywhere, near the normal, at the horizon, and along the borders of a tile's columns.
        let theta = FRAC_PI_2 * [a, a.powi(6), 1.0 - 1e-4 * a][i as usize / count % 3];
        let phi = [TAU * b, 0.0, PI, 1e-3 * b][i as usize / count / 3 % 4];
        let (s, c) = theta.sin_cos();
        (i as usize % count, view_cosine(i), rounded(DVec3::new(s * phi.cos(), s * phi.sin(), c)))
    };
    let mut inputs: Vec<_> = (0..count as u32 * COUNT).map(of).collect();
    inputs.extend((0..count).map(|id| (id, 1.0, Vec3::Z)));
    let input: Vec<_> = inputs.iter().flat_map(|&(id, cosine, h)| [entry(h, id as u32), [cosine.to_bits(), 0, 0, 0]]).collect();
    let output = device.probe("density", &input);
    let mut worst = Worst::default();
    for (&(id, cosine, h), got) in inputs.iter().zip(output.chunks(2)) {
        assert!(got[0][0] > 0.0, "material {id}, cosine {cosine}, {h}");
        // Along the normal, or so near that single precision cannot square the distance, every azimuth is right: the twin's
        // and the device's need not be the same.
        if h.x.hypot(h.y) < 1e-18 {
            continue;
        }
        let expected = tables[id].density(cosine.into(), h.as_dvec3());
        worst.add((f64::from(got[0][0]) / expected - 1.0).abs(), || format!("material {id}, cosine {cosine}, {h}"));
    }
    worst.within("smooth density, relative", SMOOTH);
}
