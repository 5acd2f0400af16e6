//! Textures: mips, sampling, materials with maps, and the arrays that hold them.

use glam::{DVec2, DVec3, dvec2};
use passband::reflectance::{BlinnPhong, Ggx, Lobe, Model, Reflectance, Vmf, stand_in};
use passband::texture::{Classes, Format, MAX_SIDE, decode_srgb, encode_srgb};
use passband::{Error, Maps, Material, Roughness, Sampling, Texture};
use std::sync::Arc;

/// A repeatable number in [0, 1).
fn noise(i: usize) -> f32 {
    let mut x = (i as u32).wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
    x = (x ^ x >> 15).wrapping_mul(0x2c1b_3c6d);
    x = (x ^ x >> 12).wrapping_mul(0x297a_2d39);
    (x ^ x >> 15) as f32 / 4_294_967_296.0
}

fn count(size: [u32; 2]) -> usize {
    (size[0] * size[1]) as usize
}

/// The mean of a level, from its texels' centres.
fn mean(texture: &Texture, level: usize) -> glam::DVec4 {
    let [w, h] = texture.level(level).0;
    let at = |i: u32| dvec2((f64::from(i % w) + 0.5) / f64::from(w), 1.0 - (f64::from(i / w) + 0.5) / f64::from(h));
    (0..w * h).map(|i| texture.sample(at(i), level as f64)).sum::<glam::DVec4>() / f64::from(w * h)
}

const SIZES: [[u32; 2]; 7] = [[1, 1], [2, 2], [3, 3], [7, 5], [16, 4], [1, 9], [37, 64]];

#[test]
fn chains_go_down_to_one_texel_as_vulkan_counts_them() {
    let texture = Texture::scalar([37, 64], &vec![0.5; 37 * 64]).unwrap();
    let sizes: Vec<_> = (0..texture.levels()).map(|i| texture.level(i).0).collect();
    assert_eq!(sizes, [[37, 64], [18, 32], [9, 16], [4, 8], [2, 4], [1, 2], [1, 1]]);
    for i in 0..texture.levels() {
        let (size, texels) = texture.level(i);
        assert_eq!(texels.len(), count(size) * texture.format().bytes());
    }
    assert_eq!(texture.bytes(), sizes.iter().map(|s| count(*s) as u64 * 2).sum::<u64>());
}

#[test]
fn every_level_has_the_mean_of_the_first() {
    for size in SIZES {
        let n = count(size);
        let bytes: Vec<_> = (0..n).map(|i| [0, 1, 2].map(|c| (noise(3 * i + c) * 255.0) as u8)).collect();
        let floats: Vec<_> = (0..n).map(|i| [0, 1, 2].map(|c| 20.0 * noise(3 * i + c))).collect();
        let normals: Vec<_> =
            (0..n).map(|i| glam::vec3(noise(2 * i) - 0.5, noise(2 * i + 1) - 0.5, 1.0).normalize().to_array()).collect();
        let scalars: Vec<_> = (0..n).map(noise).collect();
        // Half a step of the format: of 8-bit sRGB where it is coarsest in linear light, of 11 bits elsewhere.
        let cases = [
            (Texture::colour8(size, &bytes).unwrap(), 0.0045),
            (Texture::colour(size, &floats).unwrap(), 20.0 / 2048.0),
            (Texture::normals(size, &normals).unwrap(), 1.0 / 2048.0),
            (Texture::scalar(size, &scalars).unwrap(), 1.0 / 2048.0),
        ];
        for (texture, bound) in cases {
            let first = mean(&texture, 0);
            for level in 1..texture.levels() {
                let off = (mean(&texture, level) - first).abs().max_element();
                assert!(off < bound, "{:?} {size:?} level {level}: {off}", texture.format());
            }
        }
    }
}

/// 3 texels into 1, 5 into 2: by area.
#[test]
fn odd_sides_weigh_by_area() {
    let line = Texture::scalar([5, 1], &[1.0, 2.0, 4.0, 8.0, 16.0]).unwrap();
    let half = |i: usize| {
        let bytes = line.level(1).1;
        half::f16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]).to_f64()
    };
    for (i, expected) in [(0, (1.0 + 2.0 + 2.0) / 2.5), (1, (2.0 + 8.0 + 16.0) / 2.5)] {
        assert!((half(i) - expected).abs() < 0.01, "{i}: {}", half(i));
    }
}

#[test]
fn colours_average_in_linear_light() {
    let checks = Texture::colour8([2, 2], &[[0; 3], [255; 3], [255; 3], [0; 3]]).unwrap();
    // Half the light is 188 of 255 encoded, not 128.
    assert_eq!(checks.level(1), ([1, 1], &[188, 188, 188, 255][..]));
    // What is encoded already is kept to the bit.
    let bytes: Vec<_> = (0..=255).map(|i| [i, 255 - i, i / 2]).collect();
    let all = Texture::colour8([16, 16], &bytes).unwrap();
    assert_eq!(all.level(0).1, bytes.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect::<Vec<_>>());
    let bright = Texture::colour([2, 1], &[[0.0; 3], [1000.0; 3]]).unwrap();
    assert_eq!(bright.sample(DVec2::ZERO, 1.0).x, 500.0);
    for i in 0..=255 {
        let encoded = f64::from(i) / 255.0;
        assert!((encode_srgb(decode_srgb(encoded)) - encoded).abs() < 1e-7);
    }
}

#[test]
fn samples_repeat_and_row_0_is_the_top() {
    let texture = Texture::scalar([2, 2], &[1.0, 2.0, 3.0, 4.0]).unwrap();
    let at = |u: f64, v: f64| texture.sample(dvec2(u, v), 0.0).x;
    assert_eq!([at(0.25, 0.75), at(0.75, 0.75), at(0.25, 0.25), at(0.75, 0.25)], [1.0, 2.0, 3.0, 4.0]);
    assert_eq!([at(0.5, 0.5), at(0.0, 0.75), at(0.25, 0.0), at(0.25, 1.0)], [2.5, 1.5, 2.0, 2.0]);
    for (u, v) in [(0.3, 0.6), (0.01, 0.99), (0.5, 0.0)] {
        assert!((at(u, v) - at(u - 3.0, v + 5.0)).abs() < 1e-9);
    }
    // Between levels, and held at both ends.
    let lod = |lod: f64| texture.sample(dvec2(0.25, 0.75), lod).x;
    assert_eq!([lod(-3.0), lod(0.0), lod(0.5), lod(1.0), lod(9.0)], [1.0, 1.0, 1.75, 2.5, 2.5]);
}

#[test]
fn what_is_no_texture_is_refused_by_name() {
    let message = |e: Error| e.to_string();
    assert!(message(Texture::scalar([0, 4], &[]).unwrap_err()).contains("0x4"));
    assert!(message(Texture::scalar([MAX_SIDE + 1, 1], &[]).unwrap_err()).contains("16384"));
    assert!(message(Texture::colour8([2, 2], &[[0; 3]]).unwrap_err()).contains("4 texels"));
    let mut texels = vec![[0.0, 0.0, 1.0]; 6];
    texels[5][1] = f32::NAN;
    assert!(message(Texture::colour([2, 3], &texels).unwrap_err()).contains("texel (1, 2)"));
    texels[5] = [0.0, 0.0, 0.5];
    assert!(message(Texture::normals([2, 3], &texels).unwrap_err()).contains("texel (1, 2): expected a normal"));
    assert!(message(Texture::scalar([1, 1], &[f32::INFINITY]).unwrap_err()).contains("texel (0, 0)"));
    // Beyond a 16-bit float is not infinite.
    assert_eq!(
        Texture::colour([1, 1], &[[1e9, -1.0, 1.0]]).unwrap().sample(DVec2::ZERO, 0.0).to_array(),
        [65504.0, 0.0, 1.0, 1.0]
    );
}

fn scalar(value: f32) -> Arc<Texture> {
    Arc::new(Texture::scalar([1, 1], &[value]).unwrap())
}

fn colour(value: [f32; 3]) -> Arc<Texture> {
    Arc::new(Texture::colour([1, 1], &[value]).unwrap())
}

fn ggx() -> Model {
    Model::Ggx(Ggx { alpha: 0.4, f0: DVec3::splat(0.5), albedo: DVec3::new(0.8, 0.4, 0.2) })
}

fn blinn_phong() -> Model {
    Model::BlinnPhong(BlinnPhong { exponent: 20.0, specular: DVec3::splat(0.5), albedo: DVec3::splat(0.5) })
}

fn vmf() -> Model {
    let lobes = [(0.3, 40.0, 0.6), (-0.2, 8.0, 0.3)];
    let lobe = |(x, kappa, weight)| Lobe { mu: DVec3::new(x, 0.1, 1.0), kappa, weight };
    Model::Vmf(Arc::new(Vmf::new(&lobes.map(lobe)).unwrap()))
}

fn table() -> Model {
    Model::Table(Arc::new(stand_in::table("rough").unwrap()))
}

fn directions(i: usize) -> [DVec3; 2] {
    let d = |k: usize| DVec3::new(f64::from(noise(k)) - 0.5, f64::from(noise(k + 1)) - 0.5, f64::from(noise(k + 2)) + 0.05);
    [d(6 * i).normalize(), d(6 * i + 3).normalize()]
}

fn same(a: &dyn Reflectance, b: impl Fn(DVec3, DVec3) -> DVec3) {
    for [wi, wo] in (0..200).map(directions) {
        let (got, want) = (a.evaluate(wi, wo), b(wi, wo));
        assert!((got - want).abs().max_element() <= 1e-3 * want.abs().max_element() + 1e-9, "{wi} {wo}: {got} {want}");
    }
}

#[test]
fn materials_without_maps_are_their_models() {
    for model in [ggx(), blinn_phong(), vmf(), table()] {
        let material = Material::from(model.clone());
        material.validate().unwrap();
        let point = material.at(dvec2(0.3, 0.4), [DVec2::X, DVec2::Y], Sampling::default());
        assert_eq!((point.normal, point.specular, point.roughness), (DVec3::Z, DVec3::ONE, None));
        let reflectance = point.reflectance(&model);
        for [wi, wo] in (0..50).map(directions) {
            assert_eq!(reflectance.evaluate(wi, wo), model.evaluate(wi, wo));
            assert_eq!(reflectance.mean_over_turns(wi, wo), model.mean_over_turns(wi, wo));
        }
        assert_eq!(reflectance.isotropic(), model.isotropic());
    }
}

#[test]
fn maps_do_to_each_model_what_they_say() {
    let (tint, shine) = ([0.5, 0.25, 1.0], [1.5, 1.0, 0.5]);
    let all = |roughness: Option<(Arc<Texture>, Roughness)>| Maps {
        albedo: Some(colour(tint)),
        specular: Some(colour(shine)),
        roughness,
        ..Maps::default()
    };
    let [tint, shine] = [tint, shine].map(|c| DVec3::from(c.map(f64::from)));
    let at = |model: Model, maps: Maps| {
        let material = Material::new(model, maps);
        material.validate().unwrap();
        material.at(DVec2::ZERO, [DVec2::ZERO; 2], Sampling::default()).reflectance(&material.model)
    };
    // alpha 0.125 is a concentration of 128.
    for map in [(scalar(0.125), Roughness::Alpha), (scalar(128.0), Roughness::Kappa)] {
        let f0 = (DVec3::splat(0.5) * shine).min(DVec3::ONE);
        let expected = Ggx { alpha: 0.125, f0, albedo: DVec3::new(0.8, 0.4, 0.2) * tint };
        same(&at(ggx(), all(Some(map.clone()))), |wi, wo| expected.evaluate(wi, wo));
        let exponent = if map.1 == Roughness::Alpha { 126.0 } else { 128.0 };
        let expected = BlinnPhong { exponent, specular: f0, albedo: DVec3::splat(0.5) * tint };
        same(&at(blinn_phong(), all(Some(map.clone()))), |wi, wo| expected.evaluate(wi, wo));
        let Model::Vmf(lobes) = vmf() else { unreachable!() };
        let lobes: Vec<_> = lobes.lobes().iter().map(|l| Lobe { kappa: 128.0, ..*l }).collect();
        let expected = Vmf::new(&lobes).unwrap();
        let with_base = |wi, wo| expected.evaluate(wi, wo) * shine + tint / std::f64::consts::PI;
        same(&at(vmf(), all(Some(map))), with_base);
    }
    let maps = Maps { albedo: Some(colour([0.5, 0.25, 2.0])), ..Maps::default() };
    let table = table();
    same(&at(table.clone(), maps), |wi, wo| table.evaluate(wi, wo) * DVec3::new(0.5, 0.25, 2.0));
}

#[test]
fn roughness_is_clamped_to_what_models_accept() {
    let roughness = |model: Model, value: f32, kind| {
        let maps = Maps { roughness: Some((scalar(value), kind)), ..Maps::default() };
        let material = Material::new(model, maps);
        let point = material.at(DVec2::ZERO, [DVec2::ZERO; 2], Sampling::default());
        let reflectance = point.reflectance(&material.model);
        let [wi, wo] = directions(1);
        assert!(reflectance.evaluate(wi, wo).is_finite());
        point.roughness.unwrap()
    };
    use Roughness::{Alpha, Kappa};
    for (model, kind, value, expected) in [
        (ggx(), Alpha, 0.0, 1e-3),
        (ggx(), Alpha, -1.0, 1e-3),
        (ggx(), Alpha, 3.0, 1.0),
        (ggx(), Kappa, 0.0, 1.0),
        (ggx(), Kappa, -5.0, 1.0),
        (blinn_phong(), Alpha, 1.0, 0.0),
        (blinn_phong(), Alpha, 0.0, 2e6),
        (blinn_phong(), Kappa, 0.0, 0.0),
        (vmf(), Alpha, 0.0, 2e6),
        (vmf(), Kappa, 0.0, 0.0),
        (vmf(), Kappa, 0.01, 0.01),
    ] {
        let got = roughness(model, value, kind);
        assert!((got - expected).abs() <= 1e-3 * expected.max(1e-2), "{kind:?} {value}: {got}");
    }
}

#[test]
fn normals_and_roughness_come_from_level_0_and_colours_through_mips() {
    let size = [4, 4];
    let checks: Vec<_> = (0..16).map(|i| [f32::from((i + i / 4) as u8 % 2); 3]).collect();
    let slopes: Vec<_> = (0..16).map(|i| if i % 2 == 0 { [0.6, 0.0, 0.8] } else { [-0.6, 0.0, 0.8] }).collect();
    let alphas: Vec<_> = (0..16).map(|i| if i % 2 == 0 { 0.25 } else { 0.75 }).collect();
    let material = Material {
        lobe_bandwidth: None,
        lobe_fit: None,
        gaussians: None,
        model: ggx(),
        maps: Maps {
            albedo: Some(Arc::new(Texture::colour(size, &checks).unwrap())),
            normal: Some(Arc::new(Texture::normals(size, &slopes).unwrap())),
            roughness: Some((Arc::new(Texture::scalar(size, &alphas).unwrap()), Roughness::Alpha)),
            tiling: [2.0, 1.0],
            ..Maps::default()
        },
    };
    material.validate().unwrap();
    // The centre of texel (0, 0) under a tiling of 2 is at u = 1/16.
    let uv = dvec2(1.0 / 16.0, 7.0 / 8.0);
    let near = material.at(uv, [DVec2::ZERO; 2], Sampling::default());
    assert_eq!(near.albedo, DVec3::ZERO);
    assert!((near.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-3 && (near.roughness.unwrap() - 0.25).abs() < 1e-6);
    // Two texels along x: one level up, where all is grey; a step of y as long changes nothing.
    let far = material.at(uv, [dvec2(0.25, 0.0), dvec2(0.0, 0.1)], Sampling::default());
    assert_eq!((far.albedo, far.normal, far.roughness), (DVec3::splat(0.5), near.normal, near.roughness));
    // Half a level: the longer derivative counts.
    let between = material.at(uv, [dvec2(0.0, 0.25 * std::f64::consts::SQRT_2), DVec2::ZERO], Sampling::default());
    assert!((between.albedo.x - 0.25).abs() < 1e-9, "{}", between.albedo);
    // Between opposite normals there is the one that stands upright.
    let middle = material.at(dvec2(1.0 / 8.0, 7.0 / 8.0), [DVec2::ZERO; 2], Sampling::default());
    assert!((middle.normal - DVec3::Z).length() < 1e-6 && (middle.roughness.unwrap() - 0.5).abs() < 1e-6);
}

#[test]
fn maps_that_a_model_does_not_take_are_refused() {
    let flat = Arc::new(Texture::normals([1, 1], &[[0.0, 0.0, 1.0]]).unwrap());
    let refused = |model: Model, maps: Maps, word: &str| {
        let e = Material::new(model, maps).validate().unwrap_err();
        assert!(e.to_string().contains(word), "{e}");
    };
    refused(ggx(), Maps { albedo: Some(flat.clone()), ..Maps::default() }, "maps.albedo");
    refused(ggx(), Maps { specular: Some(scalar(1.0)), ..Maps::default() }, "maps.specular");
    refused(ggx(), Maps { normal: Some(scalar(1.0)), ..Maps::default() }, "maps.normal");
    refused(ggx(), Maps { roughness: Some((flat, Roughness::Alpha)), ..Maps::default() }, "maps.roughness");
    refused(table(), Maps { specular: Some(colour([1.0; 3])), ..Maps::default() }, "maps.specular");
    refused(table(), Maps { roughness: Some((scalar(0.5), Roughness::Alpha)), ..Maps::default() }, "maps.roughness");
    for tiling in [[0.0, 1.0], [1.0, -2.0], [f32::NAN, 1.0], [1.0, f32::INFINITY]] {
        refused(ggx(), Maps { tiling, ..Maps::default() }, "maps.tiling");
    }
    let bad = Model::Ggx(Ggx { alpha: 0.0, f0: DVec3::ZERO, albedo: DVec3::ZERO });
    refused(bad, Maps::default(), "ggx.alpha");
}

fn of_size(size: [u32; 2], format: Format) -> Arc<Texture> {
    let n = count(size);
    let texture = match format {
        Format::Srgb8 => Texture::colour8(size, &vec![[10, 100, 200]; n]),
        Format::Half4 => Texture::colour(size, &(0..n).map(|i| [noise(i), 0.5, 0.0]).collect::<Vec<_>>()),
        Format::Half2 => Texture::normals(size, &vec![[0.6, 0.0, 0.8]; n]),
        Format::Half1 => Texture::scalar(size, &vec![0.5; n]),
    };
    Arc::new(texture.unwrap())
}

#[test]
fn classes_share_what_is_the_same() {
    let (a, b) = (of_size([8, 8], Format::Srgb8), of_size([8, 8], Format::Srgb8));
    let n = of_size([8, 8], Format::Half2);
    let with = |albedo: &Arc<Texture>, normal: Option<&Arc<Texture>>| Material {
        lobe_bandwidth: None,
        lobe_fit: None,
        gaussians: None,
        model: ggx(),
        maps: Maps { albedo: Some(albedo.clone()), specular: Some(a.clone()), normal: normal.cloned(), ..Maps::default() },
    };
    let classes = Classes::of(&[with(&a, Some(&n)), Material::from(ggx()), with(&b, None)]);
    assert_eq!(
        classes.classes.iter().map(|c| (c.size, c.format, c.layers.len())).collect::<Vec<_>>(),
        [([8, 8], Format::Srgb8, 2), ([8, 8], Format::Half2, 1)]
    );
    let slots: Vec<_> = classes.slots.iter().map(|s| [s.albedo, s.specular, s.normal, s.roughness]).collect();
    assert_eq!(slots, [[Some((0, 0)), Some((0, 0)), Some((1, 0)), None], [None; 4], [Some((0, 1)), Some((0, 0)), None, None]]);
    assert!(Arc::ptr_eq(&classes.classes[0].layers[1], &b));
    assert!(Classes::of(&[]).classes.is_empty());
}

#[test]
fn too_many_classes_merge_where_it_costs_least() {
    let sides = [512, 300, 64, 60, 32, 16, 8, 4, 2];
    let textures: Vec<_> = sides.iter().map(|s| of_size([*s, *s], Format::Half4)).collect();
    let mut materials: Vec<_> =
        textures.iter().map(|t| Material::new(ggx(), Maps { albedo: Some(t.clone()), ..Maps::default() })).collect();
    materials[0].maps.normal = Some(of_size([2, 2], Format::Half2));
    let classes = Classes::of(&materials);
    let mut sizes: Vec<_> = classes.classes.iter().map(|c| (c.size[0], c.format, c.layers.len())).collect();
    sizes.sort_by_key(|c| (std::cmp::Reverse(c.0), c.2));
    // 10 classes: 2 and 4 become one, then these and 8.
    let expected = [512, 300, 64, 60, 32, 16].map(|s| (s, Format::Half4, 1));
    assert_eq!(sizes[..6], expected);
    assert_eq!(sizes[6..], [(8, Format::Half4, 3), (2, Format::Half2, 1)]);
    for (slots, texture) in classes.slots.iter().zip(&textures) {
        let (class, layer) = slots.albedo.unwrap();
        let (class, found) = (&classes.classes[class], &classes.classes[class].layers[layer]);
        assert_eq!((found.size(), found.format()), (class.size, class.format));
        // The same picture: same mean, and the same at the old texels' centres where these are new ones' corners.
        assert!((mean(found, 0) - mean(texture, 0)).abs().max_element() < 2e-3);
    }
    // Of two sizes neither of which holds the other, both become their union.
    let sizes = [[4, 2], [2, 4], [32, 32], [64, 64], [96, 96], [128, 128], [160, 160], [192, 192], [224, 224]];
    let classes = Classes::of(&sizes.map(|size| painted(&of_size(size, Format::Srgb8))));
    assert_eq!((classes.classes.len(), classes.classes[0].size, classes.classes[0].layers.len()), (8, [4, 4], 2));
    assert_eq!((classes.slots[1].albedo, classes.slots[2].albedo), (Some((0, 1)), Some((1, 0))));
}

fn painted(albedo: &Arc<Texture>) -> Material {
    Material::new(ggx(), Maps { albedo: Some(albedo.clone()), ..Maps::default() })
}

#[test]
fn resampling_is_in_linear_light() {
    let checks = Arc::new(Texture::colour8([2, 1], &[[0; 3], [255; 3]]).unwrap());
    let mut textures = vec![checks];
    textures.extend((2..10).map(|i| of_size([1 << i, 1], Format::Srgb8)));
    let classes = Classes::of(&textures.iter().map(painted).collect::<Vec<_>>());
    let (class, layer) = classes.slots[0].albedo.unwrap();
    let grown = &classes.classes[class].layers[layer];
    assert_eq!(grown.size(), [4, 1]);
    // A quarter and three quarters of the light.
    let encoded = |light: f64| (encode_srgb(light) * 255.0).round() as u8;
    let reds: Vec<_> = grown.level(0).1.chunks(4).map(|t| t[0]).collect();
    assert_eq!(reds, [0.25, 0.25, 0.75, 0.75].map(encoded));
}
