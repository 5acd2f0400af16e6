//! Scene files: every key is accepted or not supported yet, everything else is refused with its line.
#![cfg(feature = "offline")]

use passband::offline::error::{At, Error};
use passband::offline::scene::Scene;
use passband::offline::world::World;
use passband::reflectance::Model;
use passband::{Bins, Light};
use std::path::Path;

/// The smallest valid scene, with places to add to: line 3, 6, 9 and after 11.
const BASE: &str = "\
[camera]
position = [0, 0, 3]
#camera
[environment]
builtin = 'constant'
#environment
[[objects]]
builtin = 'plane'
material = 'grey'
#object
[materials.grey]
reflectance = { ggx = { alpha = 0.5, f0 = 0.04, albedo = [0.2, 0.2, 0.2] } }
#material
";

fn load_text(text: &str, overrides: &[(&str, &str)]) -> Result<Scene, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    load(&path, overrides)
}

fn load(path: &Path, overrides: &[(&str, &str)]) -> Result<Scene, Error> {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    Scene::load(path.to_str().unwrap(), &overrides)
}

/// `BASE` with `lines` in the place of `#mark`.
fn with(mark: &str, lines: &str) -> String {
    BASE.replace(&format!("#{mark}\n"), &format!("{lines}\n"))
}

fn assert_one_line(e: &Error) {
    assert!(!e.to_string().contains('\n') && !e.to_string().is_empty(), "{e}");
    assert_eq!(e.exit_code(), 2, "{e}");
}

/// That `text` is refused at `line`, its message holding `words`.
fn refused(text: &str, line: u64, words: &[&str]) {
    let e = load_text(text, &[]).unwrap_err();
    assert_one_line(&e);
    let Error::File { at, .. } = &e else { panic!("{e:?} for\n{text}") };
    assert_eq!(*at, At::Line(line), "{e}\n{text}");
    for word in words {
        assert!(e.to_string().contains(word), "`{word}` is not in: {e}");
    }
}

#[test]
fn keys_that_work() {
    let lines = [
        ("camera", "target = [0, 1, 0]"),
        ("camera", "up = [0, 1, 1]"),
        ("camera", "fov_y = 20"),
        ("camera", "size = [640, 480]"),
        ("environment", "intensity = 0"),
        ("environment", "rotation = -370.5"),
        ("environment", "visible = true"),
        ("object", "translate = [1, 2, 3]\nrotate = [10, 20, 30]\nscale = [1, 2.5, -3]"),
        ("object", "scale = 2"),
        ("object", "uv = 'spherical'"),
        ("object", "uv = 'box'"),
        ("object", "uv = 'atlas'"),
        ("object", "transform = [1,0,0,0, 0,2,0,0, 0,0,1,0, 5,6,7,1]"),
        ("material", "[materials.other]\nreflectance = { builtin = 'rough' }"),
        ("material", "[materials.other]\nreflectance = { merl = 'x.binary' }"),
        ("material", "[settings]"),
        ("material", "[animation]\nframes = 3"),
        (
            "material",
            "[animation]\nframes = 9\ncamera = [{ frame = 0, position = [0, 0, 4] }, { frame = 8, fov_y = 30, target = [0, 0, 0], up = [0, 1, 0] }]\n\
             wave = { amplitude = 0.1, length = 1, speed = -2, direction = [0, 1, 0], objects = [0] }\n[[animation.objects]]\nobject = 0\n\
             keyframes = [{ frame = 1, translate = [0, 0, 0], rotate = [0, 0, 0], scale = 1 }]",
        ),
        (
            "material",
            "albedo_map = 'a.png'\nspecular_map = 'a.jpg'\nnormal_map = 'a.exr'\nroughness_map = 'a.jpeg'\ntiling = [2, 3]",
        ),
        ("material", "height_map = 'a.hdr'\nheight_scale = 0.1"),
        ("material", "height_map = 'a.PNG'\nheight_scale = -0.1\ndisplace = true\nnormal_map = 'n.png'"),
        ("material", "normal_map = 'n.png'\nnormal_encoding = 'auto'\nnormal_y = 'down'"),
        ("material", "roughness_map = 'n.png'\nroughness = 'kappa'"),
        ("material", "albedo_map = 'builtin:checker'\nnormal_map = 'builtin:cloth'\nroughness_map = 'builtin:cloth'"),
    ];
    for (mark, text) in lines {
        load_text(&with(mark, text), &[]).unwrap_or_else(|e| panic!("{text}: {e}"));
    }
    load_text(&BASE.replace("builtin = 'constant'", "map = 'x.EXR'"), &[]).unwrap();
    load_text(&BASE.replace("builtin = 'constant'", "map = 'x.hdr'"), &[]).unwrap();
    for file in ["x.obj", "x.ply", "x.off", "x.glb", "x.gltf", "x.obj.gz", "x.PLY"] {
        load_text(&BASE.replace("builtin = 'plane'", &format!("mesh = '{file}'")), &[]).unwrap();
    }
}

#[test]
fn unknown_keys_are_refused_with_their_line() {
    refused(&with("camera", "fov = 3"), 3, &["camera.fov", "unknown field", "fov_y"]);
    refused(&with("environment", "size = 3"), 6, &["environment.size"]);
    refused(&with("object", "name = 'x'"), 10, &["objects.0.name"]);
    refused(&with("material", "colour = 1"), 13, &["materials.grey.colour"]);
    refused(&with("material", "[setings]\neps = 0.1"), 13, &["setings"]);
    refused(&with("material", "[settings]\nepsilon = 0.1"), 14, &["settings.epsilon"]);
    refused(&with("material", "[[lights]]\ntype = 'point'\npower = 3"), 15, &["lights.0.power"]);
    refused(&with("material", "[animation]\nframes = 1\nspeed = 1"), 15, &["animation.speed"]);
    refused(&with("material", "[animation]\nframes = 1\ncamera = [{ frame = 0, roll = 1 }]"), 15, &["roll"]);
    refused(&with("material", "[animation]\nframes = 1\nwave = { amplitude = 1, length = 1, speed = 1, x = 1 }"), 15, &["x"]);
    refused(&BASE.replace("alpha = 0.5,", "alpha = 0.5, beta = 1,"), 12, &["reflectance.ggx.beta"]);
    refused(&BASE.replace("{ ggx = ", "{ gxx = "), 12, &["reflectance.gxx", "merl"]);
}

#[test]
fn values_are_checked() {
    let cases = [
        ("camera", "position = 3", 3, "TOML"),
        ("camera", "target = [0, 0]", 3, "camera.target"),
        ("camera", "target = [0, 0, 3]", 3, "camera.target"),
        ("camera", "target = [nan, 0, 0]", 3, "camera.target"),
        ("camera", "target = ['a', 0, 0]", 3, "camera.target"),
        ("camera", "up = [0, 0, -2]", 3, "camera.up"),
        ("camera", "up = [0, 0, 0]", 3, "camera.up"),
        ("camera", "fov_y = 0", 3, "camera.fov_y"),
        ("camera", "fov_y = 180.0", 3, "camera.fov_y"),
        ("camera", "fov_y = nan", 3, "camera.fov_y"),
        ("camera", "fov_y = 'wide'", 3, "camera.fov_y"),
        ("camera", "size = [0, 5]", 3, "camera.size"),
        ("camera", "size = [16385, 5]", 3, "camera.size"),
        ("camera", "size = [-1, 5]", 3, "camera.size"),
        ("camera", "size = [4.5, 5]", 3, "camera.size"),
        ("environment", "map = 'x.exr'", 6, "exactly one"),
        ("environment", "intensity = -1", 6, "environment.intensity"),
        ("environment", "intensity = inf", 6, "environment.intensity"),
        ("environment", "rotation = inf", 6, "environment.rotation"),
        ("environment", "visible = 1", 6, "environment.visible"),
        ("object", "mesh = 'x.obj'", 10, "exactly one"),
        ("object", "scale = 0", 10, "objects.0.scale"),
        ("object", "scale = [1, 1]", 10, "objects.0.scale"),
        ("object", "translate = [inf, 0, 0]", 10, "objects.0.translate"),
        ("object", "uv = 'cube'", 10, "objects.0.uv"),
        ("object", "transform = [1, 2, 3]", 10, "objects.0.transform"),
        ("object", "transform = [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]", 10, "objects.0.transform"),
        ("object", "transform = [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]", 10, "objects.0.transform"),
        ("object", "scale = 2\ntransform = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", 10, "objects.0.scale"),
        ("material", "normal_map = 'x.tiff'", 13, "normal_map"),
        ("material", "height_scale = 1", 13, "height_map"),
        ("material", "normal_y = 'up'", 13, "normal_map"),
        ("material", "normal_map = 'x.png'\nnormal_y = 'left'", 14, "normal_y"),
        ("material", "roughness_map = 'x.png'\nroughness = 'gloss'", 14, "roughness"),
        ("material", "tiling = [0, 1]", 13, "tiling"),
        ("material", "tiling = [1, inf]", 13, "tiling"),
        ("material", "height_map = 'x.png'\nheight_scale = inf", 14, "height_scale"),
        ("material", "height_map = 'x.png'\nnormal_map = 'x.png'", 13, "displace = true"),
        ("material", "displace = true", 13, "height_map"),
        ("material", "albedo_map = 'builtin:bumps'", 13, "checker"),
        ("material", "normal_map = 'builtin:fog'", 13, "dunes"),
        ("material", "height_map = 'builtin:bumps'", 13, ".png"),
        ("material", "roughness_map = 'builtin:bumps'\nroughness = 'alpha'", 14, "kappa"),
        ("material", "roughness = 'alpha'", 13, "roughness_map"),
        ("material", "[settings]\noperator = 'sphere'", 14, "settings.operator"),
        ("material", "[settings]\neps = 1.5", 14, "settings.eps"),
        ("material", "[settings]\neps = 0.0001", 14, "settings.eps"),
        ("material", "[settings]\nlmax = 6", 14, "settings.lmax"),
        ("material", "[settings]\nanisotropy = 17", 14, "settings.anisotropy"),
        ("material", "[settings]\nbudget = 0", 14, "settings.budget"),
        ("material", "[settings]\ngeometric = 'yes'", 14, "settings.geometric"),
        ("material", "[[lights]]\ntype = 'spot'", 14, "lights.0.type"),
        ("material", "[[lights]]\ntype = 'point'", 13, "no position"),
        ("material", "[[lights]]\ntype = 'point'\nposition = [0, 0, 0]\nintensity = 1\nradius = 1", 17, "radius"),
        ("material", "[[lights]]\ntype = 'directional'\ndirection = [0, 0, 0]\nirradiance = 1", 15, "direction"),
        ("material", "[[lights]]\ntype = 'directional'\ndirection = [0, 1, 0]\nirradiance = -1", 16, "irradiance"),
        (
            "material",
            "[[lights]]\ntype = 'rectangle'\nposition = [0, 1, 0]\nu = [1, 0, 0]\nv = [2, 0, 0]\nradiance = 1",
            13,
            "parallel ones",
        ),
        ("material", "[animation]\nframes = 0", 14, "animation.frames"),
        ("material", "[animation]\nframes = 2\ncamera = [{ frame = 2 }]", 15, "animation.camera.0.frame"),
        ("material", "[animation]\nframes = 2\nwave = { amplitude = 1, length = 0, speed = 1 }", 15, "length"),
        ("material", "[[animation.objects]]\nobject = 0\nkeyframes = []", 13, "animation.frames"),
        ("material", "[materials.m]\nreflectance = {}", 14, "exactly one"),
        ("material", "[materials.m]\nreflectance = { builtin = 'rough', merl = 'x' }", 14, "exactly one"),
        ("material", "[materials.m]\nreflectance = { ggx = { alpha = 0, f0 = 0, albedo = 0 } }", 14, "alpha"),
        ("material", "[materials.m]\nreflectance = { ggx = { alpha = 1.1, f0 = 0, albedo = 0 } }", 14, "alpha"),
        ("material", "[materials.m]\nreflectance = { ggx = { alpha = 1, f0 = 2, albedo = 0 } }", 14, "f0"),
        ("material", "[materials.m]\nreflectance = { ggx = { alpha = 1, f0 = 0, albedo = [0, nan, 0] } }", 14, "albedo"),
        ("material", "[materials.m]\nreflectance = { ggx = { alpha = 1, f0 = 0 } }", 14, "albedo"),
        ("material", "[materials.m]\nreflectance = { vmf = [] }", 14, "vmf"),
        ("material", "[materials.m]\nreflectance = { vmf = [{ mu = [0, 0, 0], kappa = 1, weight = 1 }] }", 14, "mu"),
        ("material", "[materials.m]", 13, "materials.m.reflectance"),
        ("material", "[materials.grey]", 13, "TOML"),
        ("material", "!", 13, "TOML"),
    ];
    for (mark, text, line, word) in cases {
        refused(&with(mark, text), line, &[word]);
    }
    refused(&BASE.replace("position = [0, 0, 3]", ""), 1, &["camera.position"]);
    refused(&BASE.replace("material = 'grey'", ""), 7, &["objects.0.material"]);
    refused(
        &with("material", "[[animation.objects]]\nkeyframes = []\n[animation]\nframes = 1"),
        13,
        &["animation.objects.0.object"],
    );
    refused(
        &with("material", "[animation]\nframes = 1\n[[animation.objects]]\nobject = 0"),
        15,
        &["animation.objects.0.keyframes"],
    );
    refused(&BASE.replace("builtin = 'constant'", ""), 4, &["environment", "exactly one"]);
    refused(&BASE.replace("'constant'", "'fog'"), 5, &["environment.builtin", "sun-sky", "fog"]);
    refused(&BASE.replace("builtin = 'constant'", "map = 'x.png'"), 5, &["environment.map", ".exr"]);
    refused(&BASE.replace("builtin = 'plane'", "mesh = 'x.stl'"), 8, &["objects.0.mesh", ".obj"]);
    refused(&BASE.replace("'plane'", "'cube'"), 8, &["objects.0.builtin", "torus-knot"]);
    refused(&BASE.replace("builtin = 'plane'", ""), 7, &["objects.0", "exactly one"]);
    refused(&BASE.replace("material = 'grey'", "material = 'gray'"), 9, &["objects.0.material", "grey", "gray"]);
    refused(&BASE.replace("[[objects]]", "[objects]"), 7, &["objects"]);
    refused("objects = []\n[camera]\nposition = [0, 0, 1]\n", 1, &["objects", "at least one"]);
    refused("[camera]\nposition = [0, 0, 1]\n", 1, &["objects"]);
}

#[test]
fn files_that_are_no_scenes() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in
        [("empty.toml", &b""[..]), ("bytes.toml", b"a = \"\xff\""), ("text.toml", b"hello\n"), ("nul.toml", b"\0\0")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let e = load(&path, &[]).unwrap_err();
        assert_one_line(&e);
        assert!(matches!(e, Error::File { .. }), "{name}: {e}");
    }
    for (path, file) in [("missing.toml", true), ("", true), ("no-such-scene", false)] {
        let e = load(&folder.path().join(path), &[]).unwrap_err();
        assert_one_line(&e);
        assert_eq!(matches!(e, Error::File { .. }), file, "{path}: {e}");
    }
    // Nesting as deep as a stack.
    let deep = format!("a = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert_one_line(&load_text(&deep, &[]).unwrap_err());
}

#[test]
fn overrides_change_what_they_name() {
    let set = |overrides: &[(&str, &str)]| load_text(BASE, overrides).unwrap().resolve().unwrap();
    let world = set(&[
        ("camera.fov_y", "40.5"),
        ("camera.position.2", "7"),
        ("camera.size", "[32, 16]"),
        ("environment.intensity", "2"),
        ("environment.visible", "true"),
        ("objects.0.translate", "[1, 2, 3]"),
        ("materials.grey.reflectance.ggx.alpha", "0.2"),
    ]);
    assert_eq!((world.camera.fov_y, world.camera.position.z, world.size), (40.5, 7.0, Some([32, 16])));
    let light = world.environment.unwrap();
    assert_eq!((light.intensity, light.visible), (2.0, true));
    assert_eq!(world.objects[0].transform.w_axis.to_array(), [1.0, 2.0, 3.0, 1.0]);
    assert!(matches!(world.materials[0].model, Model::Ggx(ggx) if ggx.alpha == 0.2));
    // A later one wins; strings need no quotes; a choice replaces the other.
    let world = set(&[("camera.fov_y", "10"), ("camera.fov_y", "20"), ("materials.grey.reflectance.builtin", "rough")]);
    assert_eq!(world.camera.fov_y, 20.0);
    assert!(matches!(world.materials[0].model, Model::Table(_)));
    let world = set(&[("objects.0.builtin", "'sphere'"), ("environment", "{ builtin = 'studio', rotation = 90 }")]);
    assert!(world.objects[0].mesh.positions.len() > 1000);
    assert_eq!(world.environment.unwrap().rotation, 90.0);
}

#[test]
fn lights_are_what_the_file_says() {
    let text = "[[lights]]\ntype = 'point'\nposition = [0, 1, 0]\nintensity = [1, 2, 3]\n\
                [[lights]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = 3\n\
                [[lights]]\ntype = 'sphere'\nposition = [0, 1, 0]\nradius = 0.5\nradiance = 9\n\
                [[lights]]\ntype = 'rectangle'\nposition = [0, 1, 0]\nu = [1, 0, 0]\nv = [0, 0, 1]\nradiance = [1, 2, 3]";
    let lights = load_text(&with("material", text), &[]).unwrap().resolve().unwrap().lights;
    let position = [0.0, 1.0, 0.0];
    let expected = [
        Light::Point { position, intensity: [1.0, 2.0, 3.0] },
        Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [3.0; 3] },
        Light::Sphere { position, radius: 0.5, radiance: [9.0; 3] },
        Light::Rectangle { position, u: [1.0, 0.0, 0.0], v: [0.0, 0.0, 1.0], radiance: [1.0, 2.0, 3.0] },
    ];
    assert_eq!(lights, expected);
}

#[test]
fn overrides_are_checked_like_the_file() {
    let cases = [
        ("camera.fov", "3", "camera.fov"),
        ("camera.fov_y", "200", "camera.fov_y"),
        ("camera.fov_y", "wide", "camera.fov_y"),
        ("kamera.fov_y", "20", "kamera"),
        ("objects.1.material", "grey", "index below 1"),
        ("objects.x.material", "grey", "index below 1"),
        ("objects.0.material", "gray", "objects.0.material"),
        ("objects.0.builtin.name", "x", "objects.0.builtin"),
        ("materials.gray.reflectance.ggx.alpha", "0.2", "grey"),
        ("materials.grey.reflectance.ggx.alpha", "7", "ggx.alpha"),
        ("materials.grey.reflectance", "{ ggx = { alpha = 7, f0 = 0, albedo = 0 } }", "ggx.alpha"),
        ("materials.grey.reflectance", "{ builtin = 'rough', rgl = 'x.bsdf' }", "exactly one"),
        ("objects", "[]", "objects"),
        ("", "1", "path"),
        ("camera..fov_y", "1", "path"),
    ];
    for (path, value, word) in cases {
        let e = load_text(BASE, &[(path, value)]).unwrap_err();
        assert_one_line(&e);
        assert!(matches!(e, Error::Argument { .. }) && e.to_string().contains(word), "{path}={value}: {e:?}");
        assert!(e.to_string().starts_with("--set"), "{e}");
    }
    let deep = vec!["a"; 100_000].join(".");
    assert!(matches!(load_text(BASE, &[(&deep, "1")]), Err(Error::Argument { .. })));
    let e = load_text(BASE, &[("settings.bins", "'world'")]).unwrap_err();
    assert!(e.to_string().starts_with("--set settings.bins: expected camera"), "{e}");
    // A mistake in the file stays the file's.
    let e = load_text(&with("camera", "fov = 3"), &[("environment.intensity", "2")]).unwrap_err();
    assert!(matches!(e, Error::File { at: At::Line(3), .. }), "{e}");
}

#[test]
fn transforms_scale_then_turn_then_move() {
    let world = |lines: &str| load_text(&with("object", lines), &[]).unwrap().resolve().unwrap();
    let w = world("scale = [2, 1, 1]\nrotate = [90, 0, 90]\ntranslate = [0, 0, 10]");
    // x: scaled to 2, X leaves it, Z turns it to y. y: X turns it to z, Z leaves it.
    let at = |p: [f32; 3]| w.objects[0].transform.transform_point3(p.into());
    assert!(at([1.0, 0.0, 0.0]).distance([0.0, 2.0, 10.0].into()) < 1e-5, "{}", at([1.0, 0.0, 0.0]));
    assert!(at([0.0, 1.0, 0.0]).distance([0.0, 0.0, 11.0].into()) < 1e-5);
    let w = world("transform = [1,0,0,0, 0,2,0,0, 0,0,1,0, 5,6,7,1]");
    assert_eq!(w.objects[0].transform.transform_point3([1.0, 1.0, 1.0].into()).to_array(), [6.0, 8.0, 8.0]);
}

#[test]
fn files_are_relative_to_the_scene_and_named_when_missing() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("s.toml");
    std::fs::write(folder.path().join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let text = BASE.replace("builtin = 'plane'", "mesh = 't.obj'") + "[[objects]]\nmesh = 't.obj'\nmaterial = 'grey'\n";
    std::fs::write(&scene, text).unwrap();
    let world = load(&scene, &[]).unwrap().resolve().unwrap();
    assert_eq!((world.objects[0].mesh.positions.len(), world.name.as_str()), (3, "s"));
    assert!(std::sync::Arc::ptr_eq(&world.objects[0].mesh, &world.objects[1].mesh), "one mesh, loaded once");
    // A measured table takes the place of whatever the scene has.
    let mut file = std::fs::File::create(folder.path().join("t.binary")).unwrap();
    passband::reflectance::stand_in::table("rough").unwrap().write(&mut std::io::BufWriter::new(&mut file)).unwrap();
    let world = load(&scene, &[("materials.grey.reflectance.merl", "t.binary")]).unwrap().resolve().unwrap();
    assert!(matches!(world.materials[0].model, Model::Table(_)));
    for (path, value) in [
        ("environment.map", "gone.exr"),
        ("objects.0.mesh", "gone.obj"),
        ("materials.grey.reflectance.merl", "gone.binary"),
        ("materials.grey.reflectance.merl", "t.obj"),
    ] {
        let e = load(&scene, &[(path, value)]).unwrap().resolve().unwrap_err();
        assert_one_line(&e);
        let Error::File { path, .. } = &e else { panic!("{e:?}") };
        assert_eq!(path, &folder.path().join(value));
    }
    let e = load(&scene, &[("materials.grey.reflectance.builtin", "velvet")]).unwrap().resolve().unwrap_err();
    assert!(matches!(&e, Error::Argument { .. }) && e.to_string().contains("metallic-paint"), "{e}");
}

#[test]
fn builtin_scenes_resolve() {
    let names = Scene::builtin_names();
    assert_eq!(
        names.iter().map(|n| n.0).collect::<Vec<_>>(),
        [
            "trio",
            "sphere",
            "bumpy-sphere",
            "torus-knot",
            "crowd",
            "maps",
            "waves",
            "furnace",
            "checker-plane",
            "cloth-plane",
            "bumps-plane",
            "disk-plane",
            "dunes-plane",
            "flake-plane",
            "atlas-plane",
            "microgeometry",
            "pillow",
            "tablecloth",
            "hall",
            "disk",
            "armour",
            "dunes"
        ]
    );
    for (name, line) in names {
        assert!(line.len() > 20 && line.ends_with('.'), "{name}: {line}");
        let world: World = Scene::load(name, &[]).unwrap().resolve().unwrap();
        assert_eq!(world.name, name);
        assert!(world.environment.is_some() && !world.objects.is_empty());
        assert!(world.objects.iter().all(|o| o.material < world.materials.len()));
    }
    let trio = Scene::load("trio", &[("objects.2.material".into(), "paint".into())]).unwrap().resolve().unwrap();
    assert_eq!(trio.materials[trio.objects[2].material].name, "paint");
    // A plane's light and surroundings can be had one without the other.
    let plane = |path: &str, value: &str| Scene::load("flake-plane", &[(path.into(), value.into())]).unwrap().resolve().unwrap();
    assert_eq!((plane("lights", "[]").lights.len(), plane("environment.intensity", "0").lights.len()), (0, 1));
    assert_eq!(plane("environment.intensity", "0").environment.unwrap().intensity, 0.0);
    // Those that need fetched files parse.
    for name in [
        "bunny-city",
        "dragon",
        "armadillo",
        "tiles",
        "bark",
        "bumpy-bunny",
        "dragon-normals",
        "copper-knot",
        "leather",
        "wet-stones",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        load(&path, &[]).unwrap();
    }
}

#[test]
fn settings_reach_the_frame() {
    use passband::frequency::operators::{Combine, Operator};
    let load = |settings: &str| load_text(&with("material", &format!("[settings]\n{settings}")), &[]).unwrap();
    let load = |settings: &str| load(settings).config([64, 64]);
    assert_eq!(load("operator = 'box'").operator, Operator::Box);
    assert_eq!(load("operator = 'clipped'").operator, Operator::Clipped);
    assert_eq!(load("operator = 'covariance'").operator, Operator::Covariance);
    assert_eq!(load("combine = 'mean'").combine, Combine::Mean);
    assert_eq!(load("combine = 'max'").combine, Combine::Max);
    assert_eq!((load("lmax = 5").lmax, load("geometric = true").geometric), (5, true));
    assert_eq!(
        ["bins = 'camera'", "bins = 'tangent'", ""].map(|text| load(text).bins),
        [Bins::Camera, Bins::Tangent, Bins::Tangent]
    );
    assert_eq!((load("eps = 0.02").eps, load("").eps), (0.02, 0.01));
    assert_eq!((load("budget = 32").directions, load("np_rule = 'sqrt'").allocation.name()), (32, "sqrt"));
    let none = load("");
    assert_eq!((none.operator, none.combine, none.lmax, none.geometric), (Operator::Clipped, Combine::Mean, 3, false));
}
