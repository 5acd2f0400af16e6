//! Texture files: what images mean as maps, and the scene keys that name them.
#![cfg(feature = "offline")]

use glam::{DVec2, DVec3, Vec3, dvec2};
use image::{DynamicImage, RgbImage};
use passband::offline::error::{At, Error};
use passband::offline::image_io::{LinearImage, write_exr, write_hdr};
use passband::offline::scene::Scene;
use passband::offline::texture::{Encoding, Heights, Image};
use passband::offline::world::World;
use passband::texture::Format;
use passband::{Roughness, Texture};
use std::path::Path;
use std::sync::Arc;

#[path = "support/damage.rs"]
#[allow(dead_code)]
mod damage;

/// 4 x 2 texels, each of its own.
const SIZE: [u32; 2] = [4, 2];

fn colours() -> Vec<[f64; 3]> {
    (0..8).map(|i| [f64::from(i) / 7.0, f64::from(7 - i) / 7.0, f64::from(i % 3) / 2.0]).collect()
}

/// Unit normals that lean every way.
fn normals() -> Vec<DVec3> {
    let at = |i: i32| DVec3::new(f64::from(i - 4) / 8.0, f64::from(i % 3 - 1) / 2.0, 0.9).normalize();
    (0..8).map(at).collect()
}

fn save(path: &Path, texels: &[[f64; 3]], most: f64) {
    let [w, h] = SIZE;
    let flat = texels.iter().flatten().map(|c| (c * most).round());
    let image = if most > 255.0 {
        DynamicImage::ImageRgb16(image::ImageBuffer::from_raw(w, h, flat.map(|c| c as u16).collect()).unwrap())
    } else {
        DynamicImage::ImageRgb8(RgbImage::from_raw(w, h, flat.map(|c| c as u8).collect()).unwrap())
    };
    image.save(path).unwrap();
}

fn linear(texels: &[[f64; 3]]) -> LinearImage {
    let plane = |c: usize| texels.iter().map(|t| t[c] as f32).collect();
    let channels = [("R", 0), ("G", 1), ("B", 2)].map(|(name, c)| (name.to_string(), plane(c)));
    LinearImage { width: SIZE[0], height: SIZE[1], channels: channels.into() }
}

/// The texel in column `x` from the left, row `y` from the top.
fn texel(texture: &Texture, i: usize) -> DVec3 {
    let [w, h] = texture.size();
    let (x, y) = (i as u32 % w, i as u32 / w);
    let uv = dvec2((f64::from(x) + 0.5) / f64::from(w), 1.0 - (f64::from(y) + 0.5) / f64::from(h));
    texture.sample(uv, 0.0).truncate()
}

#[test]
fn colours_of_every_kind_of_file_agree() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let srgb: Vec<_> = colours().iter().map(|t| t.map(passband::texture::encode_srgb)).collect();
    save(&at("8.png"), &srgb, 255.0);
    save(&at("16.png"), &srgb, 65535.0);
    write_exr(&at("f.exr"), &linear(&colours())).unwrap();
    write_hdr(&at("f.hdr"), &linear(&colours())).unwrap();
    for (name, format, bound) in [
        ("8.png", Format::Srgb8, 4.6e-3),
        ("16.png", Format::Half4, 5e-4),
        ("f.exr", Format::Half4, 5e-4),
        ("f.hdr", Format::Half4, 5e-3),
    ] {
        let texture = Image::read(&at(name)).unwrap().colour().unwrap();
        assert_eq!((texture.format(), texture.size(), texture.levels()), (format, SIZE, 3), "{name}");
        for (i, want) in colours().iter().enumerate() {
            let off = (texel(&texture, i) - DVec3::from(*want)).abs().max_element();
            assert!(off < bound, "{name} {i}: {off}");
        }
    }
    let below: Vec<_> = colours().iter().map(|t| t.map(|c| c - 0.5)).collect();
    write_exr(&at("below.exr"), &linear(&below)).unwrap();
    let texture = Image::read(&at("below.exr")).unwrap().colour().unwrap();
    for (i, want) in below.iter().enumerate() {
        assert!((texel(&texture, i) - DVec3::from(*want).max(DVec3::ZERO)).abs().max_element() < 5e-4, "{i}");
    }
}

#[test]
fn grey_opacity_and_jpeg() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let grey = image::GrayImage::from_fn(16, 16, |x, _| image::Luma([if x < 8 { 64 } else { 200 }]));
    grey.save(at("grey.png")).unwrap();
    grey.save(at("grey.jpg")).unwrap();
    let clear = image::RgbaImage::from_pixel(2, 2, image::Rgba([10, 20, 30, 0]));
    clear.save(at("clear.png")).unwrap();
    for (name, bound) in [("grey.png", 1e-3), ("grey.jpg", 0.01)] {
        let texture = Image::read(&at(name)).unwrap().roughness().unwrap();
        assert_eq!(texture.format(), Format::Half1);
        for (i, want) in [(0, 64.0), (15, 200.0)] {
            assert!((texel(&texture, i).x - want / 255.0).abs() < bound, "{name} {}", texel(&texture, i));
        }
    }
    let texture = Image::read(&at("clear.png")).unwrap().colour().unwrap();
    assert_eq!(texture.level(0).1[..4], [10, 20, 30, 255], "opacity does not darken");
}

#[test]
fn sizes_from_one_texel_to_16384() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    for (size, levels) in [([1, 1], 1), ([16384, 1], 15), ([1, 16384], 15)] {
        image::GrayImage::from_pixel(size[0], size[1], image::Luma([51])).save(&path).unwrap();
        let image = Image::read(&path).unwrap();
        for texture in [image.colour().unwrap(), image.roughness().unwrap(), image.heights().unwrap().normals(1.0).unwrap()] {
            assert_eq!((texture.size(), texture.levels()), (size, levels));
        }
        let last = image.roughness().unwrap().sample(dvec2(0.4, 0.2), f64::from(levels as u32)).x;
        assert!((last - 0.2).abs() < 1e-3, "{last}");
    }
}

#[test]
fn one_normal_map_in_every_encoding() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let signed: Vec<_> = normals().iter().map(|n| n.to_array()).collect();
    let unit: Vec<_> = signed.iter().map(|n| n.map(|c| c * 0.5 + 0.5)).collect();
    let down: Vec<_> = unit.iter().map(|[x, y, z]| [*x, 1.0 - *y, *z]).collect();
    save(&at("8.png"), &unit, 255.0);
    save(&at("16.png"), &unit, 65535.0);
    save(&at("down.png"), &down, 65535.0);
    write_exr(&at("unit.exr"), &linear(&unit)).unwrap();
    write_exr(&at("signed.exr"), &linear(&signed)).unwrap();
    for (name, encoding, up, bound) in [
        ("8.png", Encoding::Auto, true, 6e-3),
        ("16.png", Encoding::Auto, true, 6e-4),
        ("down.png", Encoding::Unit, false, 6e-4),
        ("unit.exr", Encoding::Auto, true, 6e-4),
        ("unit.exr", Encoding::Unit, true, 6e-4),
        ("signed.exr", Encoding::Auto, true, 6e-4),
        ("signed.exr", Encoding::Signed, true, 6e-4),
    ] {
        let texture = Image::read(&at(name)).unwrap().normals(encoding, up, 1.0).unwrap();
        assert_eq!(texture.format(), Format::Half2);
        for (i, want) in normals().iter().enumerate() {
            let off = (texel(&texture, i) - want.truncate().extend(0.0)).abs().max_element();
            assert!(off < bound, "{name} {encoding:?} {i}: {off}");
        }
    }
    // Half the slope.
    let texture = Image::read(&at("16.png")).unwrap().normals(Encoding::Unit, true, 0.5).unwrap();
    let want = (normals()[0] * DVec3::new(0.5, 0.5, 1.0)).normalize();
    assert!((texel(&texture, 0).truncate() - want.truncate()).length() < 1e-3);
    // Below the horizon and without length.
    let odd = [
        [1.0, 0.0, -1.0],
        [0.0; 3],
        [0.0, 0.0, -1.0],
        [0.6, 0.8, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
    ];
    write_exr(&at("odd.exr"), &linear(&odd)).unwrap();
    let texture = Image::read(&at("odd.exr")).unwrap().normals(Encoding::Auto, true, 1.0).unwrap();
    let found: Vec<_> = (0..4).map(|i| texel(&texture, i).truncate()).collect();
    assert!(
        found[0] == DVec2::X
            && found[1] == DVec2::ZERO
            && found[2] == DVec2::ZERO
            && (found[3] - dvec2(0.6, 0.8)).length() < 1e-3
    );
}

#[test]
fn heights_become_the_normals_of_their_surface() {
    let size = [64, 32];
    let tau = std::f64::consts::TAU;
    let surface = |u: f64, v: f64| 0.5 + 0.3 * (tau * u).sin() * (tau * 2.0 * v).cos();
    let place = |i: usize| ((i % 64) as f64 / 64.0 + 1.0 / 128.0, 1.0 - (i / 64) as f64 / 32.0 - 1.0 / 64.0);
    let values = (0..2048).map(place).map(|(u, v)| surface(u, v) as f32).collect();
    let heights = Heights::new(size, values).unwrap();
    let texture = heights.normals(0.2).unwrap();
    for i in 0..2048 {
        let (u, v) = place(i);
        // Widths: one in u, one half in v.
        let along_u = 0.2 * 0.3 * tau * (tau * u).cos() * (tau * 2.0 * v).cos();
        let along_v = 0.2 * -0.3 * 2.0 * tau * (tau * u).sin() * (tau * 2.0 * v).sin() / 0.5;
        let want = DVec3::new(-along_u, -along_v, 1.0).normalize();
        assert!((texel(&texture, i).truncate() - want.truncate()).length() < 0.012, "{i} {want}");
    }
    assert!((heights.sample(dvec2(2.25, -0.5)) - surface(0.25, 0.5)).abs() < 0.01);
}

/// A scene over a plane whose material has `maps`, beside the files of `prepare`.
fn scene(folder: &Path, maps: &str, object: &str) -> Result<World, Error> {
    let text = format!(
        "[camera]\nposition = [0, 0, 3]\n[[objects]]\n{object}\nmaterial = 'm'\n\
         [materials.m]\nreflectance = {{ ggx = {{ alpha = 0.5, f0 = 0.04, albedo = 0.5 }} }}\n{maps}\n"
    );
    std::fs::write(folder.join("s.toml"), text).unwrap();
    Scene::load(folder.join("s.toml").to_str().unwrap(), &[])?.resolve()
}

#[test]
fn scene_keys_bring_their_maps() {
    let folder = tempfile::tempdir().unwrap();
    let unit: Vec<_> = normals().iter().map(|n| n.to_array().map(|c| c * 0.5 + 0.5)).collect();
    save(&folder.path().join("a.png"), &colours(), 255.0);
    save(&folder.path().join("n.png"), &unit, 255.0);
    let world = |maps: &str| scene(folder.path(), maps, "builtin = 'plane'").unwrap();
    let plain = world("");
    assert!(plain.materials[0].maps.is_empty() && plain.objects[0].mesh.tangents.is_empty());
    let w = world(
        "albedo_map = 'a.png'\nspecular_map = 'a.png'\nroughness_map = 'a.png'\nroughness = 'kappa'\nnormal_map = 'n.png'\ntiling = [2, 3]",
    );
    let maps = &w.materials[0].maps;
    assert_eq!(maps.tiling, [2.0, 3.0]);
    let [albedo, specular, normal] = [&maps.albedo, &maps.specular, &maps.normal].map(|m| m.as_ref().unwrap());
    assert!(Arc::ptr_eq(albedo, specular), "one file, one texture");
    let (roughness, kind) = maps.roughness.as_ref().unwrap();
    assert_eq!([albedo.format(), normal.format(), roughness.format()], [Format::Srgb8, Format::Half2, Format::Half1]);
    assert_eq!(*kind, Roughness::Kappa);
    assert!((texel(roughness, 3).x - (3.0f64 / 7.0 * 255.0).round() / 255.0).abs() < 1e-3, "no sRGB");
    assert_eq!(w.objects[0].mesh.tangents.len(), w.objects[0].mesh.positions.len(), "a normal map wants tangents");
    // Green down.
    let down = world("normal_map = 'n.png'\nnormal_y = 'down'");
    let down = down.materials[0].maps.normal.clone().unwrap();
    for i in 0..8 {
        assert!((texel(&down, i) * DVec3::new(1.0, -1.0, 1.0) - texel(normal, i)).length() < 1e-3);
    }
    // A height as normals.
    let w = world("height_map = 'a.png'\nheight_scale = 0.3");
    let (made, heights) = (w.materials[0].maps.normal.clone().unwrap(), Image::read(&folder.path().join("a.png")).unwrap());
    assert_eq!(*made, heights.heights().unwrap().normals(0.3).unwrap());
    // Azimuth-dependent reflectances want tangents without any map.
    let path = folder.path().join("s.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let lobes =
        "{ vmf = [{ mu = [0.3, 0, 1], kappa = 50, weight = 1 }] }\n[materials.other]\nreflectance = { builtin = 'rough' }\n";
    let (head, _) = text.split_once("reflectance").unwrap();
    std::fs::write(&path, format!("{head}reflectance = {lobes}")).unwrap();
    let w = Scene::load(path.to_str().unwrap(), &[]).unwrap().resolve().unwrap();
    assert!(!w.objects[0].mesh.tangents.is_empty());
}

#[test]
fn displaced_objects_have_a_mesh_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    // Rows of 0, 1, 1, 0 along u.
    save(&folder.path().join("h.png"), &[0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0].map(|h| [h; 3]), 65535.0);
    let others = "[[objects]]\nbuiltin = 'plane'\nmaterial = 'n'\n[materials.n]\nreflectance = { builtin = 'rough' }";
    let maps = format!("height_map = 'h.png'\nheight_scale = 0.1\ndisplace = true\ntiling = [2, 1]\n{others}");
    let w = scene(folder.path(), &maps, "builtin = 'plane'").unwrap();
    let [moved, plain] = [0, 1].map(|i| &w.objects[i].mesh);
    assert!(plain.positions.iter().all(|p| p[1] == 0.0) && w.materials[0].maps.is_empty());
    assert_eq!(moved.positions.len(), plain.positions.len());
    // The plane is 2 wide: half of it a tile, of which a height of 1 takes a tenth.
    let top = moved.positions.iter().map(|p| p[1]).fold(0.0, f32::max);
    assert!((top - 0.1).abs() < 1e-3, "{top}");
    let heights = Image::read(&folder.path().join("h.png")).unwrap().heights().unwrap();
    for (p, uv) in moved.positions.iter().zip(&moved.uvs) {
        let [u, v] = uv.map(f64::from);
        assert!((f64::from(p[1]) - 0.1 * heights.sample(dvec2(2.0 * u, v))).abs() < 1e-6, "{p:?} {uv:?}");
    }
    assert!(moved.normals.iter().any(|n| Vec3::from(*n).y < 0.99));
}

#[test]
fn what_does_not_fit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    save(&at("a.png"), &colours(), 255.0);
    let mut nan = colours();
    nan[6][0] = f64::NAN;
    write_exr(&at("nan.exr"), &linear(&nan)).unwrap();
    std::fs::write(at("text.png"), "no image").unwrap();
    std::fs::write(at("empty.jpg"), "").unwrap();
    std::fs::create_dir(at("folder.png")).unwrap();
    // A PNG header that claims 16384 x 16384, and one that claims more; no data.
    let mut huge = std::fs::read(at("a.png")).unwrap();
    let claim = |bytes: &mut Vec<u8>, side: u32| {
        bytes[16..20].copy_from_slice(&side.to_be_bytes());
        bytes[20..24].copy_from_slice(&side.to_be_bytes());
        let mut crc = flate2::Crc::new();
        crc.update(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    };
    claim(&mut huge, 16384);
    std::fs::write(at("huge.png"), &huge).unwrap();
    claim(&mut huge, 16385);
    std::fs::write(at("huger.png"), &huge).unwrap();
    let plane = "builtin = 'plane'";
    for (maps, object, words) in [
        ("albedo_map = 'a.png'", "mesh = 't.obj'", &["objects.0.material", "`m`", "texture coordinates"][..]),
        ("height_map = 'a.png'\ndisplace = true", "mesh = 't.obj'", &["objects.0.material", "`m`"]),
        ("albedo_map = 'gone.png'", plane, &["gone.png"]),
        ("albedo_map = 'text.png'", plane, &["text.png", "well-formed"]),
        ("albedo_map = 'empty.jpg'", plane, &["empty.jpg", "content"]),
        ("albedo_map = 'folder.png'", plane, &["folder.png", "directory"]),
        ("albedo_map = 'huge.png'", plane, &["huge.png", "at least", "16384x16384"]),
        ("albedo_map = 'huger.png'", plane, &["huger.png", "16385x16385"]),
        ("albedo_map = 'nan.exr'", plane, &["nan.exr", "texel (2, 1)", "finite"]),
        ("normal_map = 'nan.exr'", plane, &["nan.exr", "texel (2, 1)"]),
        ("roughness_map = 'nan.exr'", plane, &["nan.exr", "texel (2, 1)"]),
        ("height_map = 'nan.exr'", plane, &["nan.exr", "texel (2, 1)"]),
    ] {
        let e = scene(folder.path(), maps, object).unwrap_err();
        assert!(matches!(e, Error::File { .. }) && !e.to_string().contains('\n') && e.exit_code() == 2, "{e:?}");
        for word in words {
            assert!(e.to_string().contains(word), "`{word}` is not in: {e}");
        }
    }
    // With coordinates of its own making it works, and a table takes no roughness: at the key's line.
    scene(folder.path(), "albedo_map = 'a.png'", "mesh = 't.obj'\nuv = 'box'").unwrap();
    let text = std::fs::read_to_string(at("s.toml")).unwrap();
    let (head, _) = text.split_once("reflectance").unwrap();
    std::fs::write(at("s.toml"), format!("{head}reflectance = {{ builtin = 'rough' }}\nroughness_map = 'a.png'\n")).unwrap();
    let e = Scene::load(at("s.toml").to_str().unwrap(), &[]).unwrap().resolve().unwrap_err();
    let Error::File { at: line, field, .. } = &e else { panic!("{e:?}") };
    assert_eq!((*line, field.as_str()), (At::Line(9), "materials.m.roughness_map"), "{e}");
}

#[test]
fn damaged_images_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    save(&path, &colours(), 255.0);
    let png = std::fs::read(&path).unwrap();
    let smooth = RgbImage::from_fn(24, 24, |x, y| image::Rgb([10 * x as u8, 10 * y as u8, 99]));
    smooth.save(folder.path().join("a.jpg")).unwrap();
    let jpeg = std::fs::read(folder.path().join("a.jpg")).unwrap();
    for bytes in damage::variants(&png, 300).into_iter().chain(damage::variants(&jpeg, 300)) {
        std::fs::write(&path, &bytes).unwrap();
        match Image::read(&path) {
            Ok(image) => drop(image.colour().unwrap()),
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
}
