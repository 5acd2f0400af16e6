//! Every kind of reflectance from a scene file: what it becomes, and where what is wrong is said to stand.

use glam::DVec3;
use passband::offline::scene::Scene;
use passband::reflectance::{Model, Reflectance, stand_in};
use std::path::PathBuf;

const INLINE: &str = "rhod = [0.05, 0.01, 0.001], rhos = 0.3, alpha = 0.2, p = 0.5, F0 = 0.1, F1 = -0.1, kap = 6, lambda = 2, c = 0.4, \
                      k = 9, theta0 = 0.1";

/// A folder of the test's own that holds the files of `tests/data/rgl` and a small table of SGD parameters.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("reflectance_scenes").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/rgl");
    for name in ["isotropic.bsdf", "half.bsdf"] {
        std::fs::copy(data.join(name), folder.join(name)).unwrap();
    }
    let names = ["rhod", "rhos", "alpha", "p", "F0", "F1", "kap", "lambda", "c", "k", "theta0"];
    let header: Vec<_> = names.iter().flat_map(|n| ["R", "G", "B"].map(|c| format!("{n}_{c}"))).collect();
    let row = "0.05,0.01,0.001,0.3,0.3,0.3,0.2,0.2,0.2,0.5,0.5,0.5,0.1,0.1,0.1,-0.1,-0.1,-0.1,6,6,6,2,2,2,0.4,0.4,0.4,9,9,9,0.1,0.1,0.1";
    let bad = row.replace("0.2,0.2,0.2", "0.2,0,0.2");
    std::fs::write(folder.join("table.csv"), format!("material,{}\npaint,{row}\nbad,{bad}\n", header.join(","))).unwrap();
    folder
}

fn load(test: &str, reflectances: &[&str]) -> Result<Vec<Model>, String> {
    let materials: Vec<_> =
        reflectances.iter().enumerate().map(|(i, r)| format!("[materials.m{i}]\nreflectance = {{ {r} }}\n")).collect();
    let head = "[camera]\nposition = [0, 0, 3]\n[[objects]]\nbuiltin = 'sphere'\nmaterial = 'm0'\n";
    let path = folder(test).join("scene.toml");
    std::fs::write(&path, head.to_owned() + &materials.concat()).unwrap();
    let scene = Scene::load(path.to_str().unwrap(), &[]).map_err(|e| e.to_string())?;
    let world = scene.resolve().map_err(|e| e.to_string())?;
    Ok(world.materials.into_iter().map(|m| m.model).collect())
}

#[test]
fn every_kind_loads() {
    let inline = format!("sgd = {{ {INLINE} }}");
    let kinds = [
        "sgd = { table = 'table.csv', name = 'paint' }",
        &inline,
        "rgl = 'isotropic.bsdf'",
        "rgl = 'half.bsdf'",
        "blinn_phong = { exponent = 10, specular = 0.5, albedo = [0.1, 0.2, 0.3] }",
        "vmf = [{ mu = [0, 0, 2], kappa = 10, weight = 0.5 }, { mu = [1, 0, 1], kappa = 40, weight = 0.3 }]",
        "builtin = 'felt'",
    ];
    let models = load("kinds", &kinds).unwrap();
    let [
        Model::Table(table),
        Model::Table(inline),
        Model::Table(_),
        Model::Turned(turned),
        Model::BlinnPhong(b),
        Model::Vmf(v),
        felt,
    ] = models.as_slice()
    else {
        panic!("{models:?}");
    };
    // The same parameters are baked once, wherever they come from.
    assert!(std::sync::Arc::ptr_eq(table, inline));
    assert!(!turned.isotropic() && turned.symmetry() == 2);
    assert_eq!((b.exponent, b.specular, b.albedo), (10.0, DVec3::splat(0.5), DVec3::new(0.1, 0.2, 0.3)));
    assert_eq!((v.lobes().len(), v.lobes()[0].mu), (2, DVec3::Z));
    let (wi, wo) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8));
    assert_eq!(felt.evaluate(wi, wo), stand_in::table("felt").unwrap().evaluate(wi, wo));
    for model in &models {
        let f = model.evaluate(wi, wo);
        assert!(f.is_finite() && f.min_element() >= 0.0 && f.max_element() > 0.0, "{f}");
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let cases = [
        ("sgd = { table = 'table.csv' }", ":7: materials.m0.reflectance.sgd.table: expected a name beside it"),
        ("sgd = { name = 'paint' }", ":7: materials.m0.reflectance.sgd.name: expected a table beside it"),
        ("sgd = { table = 'table.csv', name = 'paint', rhod = 0 }", "expected no parameters beside table, got both"),
        (
            "sgd = { rhod = 0.1 }",
            "expected table and name, or rhod, rhos, alpha, p, F0, F1, kap, lambda, c, k, theta0, got no rhos",
        ),
        ("sgd = { table = 'table.csv', name = 'gold' }", "table.csv:1: name: expected paint, bad, got `gold`"),
        ("sgd = { table = 'table.csv', name = 'bad' }", "table.csv:3: sgd.alpha: expected finite numbers above 0"),
        ("sgd = { table = 'none.csv', name = 'paint' }", "none.csv: file: expected a readable file"),
        ("rgl = 'table.csv'", "expected a file name that ends in .bsdf"),
        ("rgl = 'none.bsdf'", "none.bsdf: file: expected a readable file"),
        ("blinn_phong = { exponent = -1, specular = 0.5, albedo = 0 }", "exponent: expected a number >= 0, got -1"),
        (
            "blinn_phong = { exponent = 1e300, specular = 0.5, albedo = 0 }",
            "exponent: expected numbers that single precision holds",
        ),
        (
            "vmf = [{ mu = [1, 0, 0], kappa = 10, weight = 1 }]",
            ":7: materials.m0.reflectance.vmf: expected lobes whose projected",
        ),
        ("vmf = [{ mu = [0, 0, 1], kappa = 10, weight = 0 }]", "vmf: expected weights of a sum above 0, got 0"),
    ];
    for (text, expected) in cases {
        let message = load("wrong", &[text]).unwrap_err();
        assert!(message.contains(expected) && !message.contains('\n'), "{text}: {message}");
    }
    let inline = format!("sgd = {{ {} }}", INLINE.replace("alpha = 0.2", "alpha = [0.2, 0, 0.2]"));
    let message = load("wrong", &[&inline]).unwrap_err();
    assert!(message.contains(":7: materials.m0.reflectance.sgd.alpha: expected finite numbers above 0"), "{message}");
}
