//! Small trees of shaders on disk: includes, variants, hosts, errors, determinism.

use passband_shader_compiler::{
    ChangeKind, Compiler, Error, Manifest, Module, Options, apply, changes, compile_all, read_manifest,
};
use std::fs;
use std::path::{Path, PathBuf};

const DOUBLE: &str = "float twice(float x) { return 2.0 * x; }\n";

/// A fresh folder of its own for each test.
fn tree(test: &str, files: &[(&str, &str)]) -> PathBuf {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if root.exists() {
        fs::remove_dir_all(&root).unwrap();
    }
    for (path, text) in files {
        write(&root, path, text);
    }
    root
}

fn write(root: &Path, path: &str, text: &str) {
    let path = root.join(path);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

/// A compute shader that writes `value` and includes what it is told.
fn shader(include: &str, value: &str) -> String {
    let include = if include.is_empty() { String::new() } else { format!("#include \"{include}\"\n") };
    format!(
        "#version 460\n{include}layout(local_size_x = 8) in;\nlayout(set = 0, binding = 0) buffer B {{ float x[]; }};\n\
         void main() {{ x[gl_GlobalInvocationID.x] = {value}; }}\n"
    )
}

fn names(modules: &[Module]) -> Vec<&str> {
    modules.iter().map(|module| module.name.as_str()).collect()
}

fn update(options: &Options) -> Vec<(String, ChangeKind)> {
    let modules = compile_all(options).unwrap();
    let manifest = Manifest::of(Compiler::new().unwrap().version().unwrap(), &modules);
    let found = changes(options, &modules, &manifest).unwrap();
    apply(options, &found).unwrap();
    found.iter().map(|c| (c.path.file_name().unwrap().to_string_lossy().into_owned(), c.kind)).collect()
}

#[test]
fn folders_and_files_name_modules() {
    let plain = shader("", "1.0");
    let vertex = "#version 460\nvoid main() { gl_Position = vec4(0.0); }\n";
    let root = tree(
        "names",
        &[
            ("glsl/tonemap.comp", &plain),
            ("glsl/shade/full.comp", &plain),
            ("glsl/gbuffer/draw.vert", vertex),
            ("glsl/bridge/unused.glsl", "not GLSL"),
            ("glsl/include/not_a_stage.comp", "not GLSL"),
        ],
    );
    let modules = compile_all(&Options::new(&root)).unwrap();
    assert_eq!(names(&modules), ["gbuffer_draw.vert", "shade_full.comp", "tonemap.comp"]);
    for module in &modules {
        assert_eq!(module.spirv[0], 0x0723_0203);
        assert_eq!(module.spirv[1], 0x0001_0500, "SPIR-V 1.5");
        assert_eq!(module.bytes().len(), 4 * module.spirv.len());
    }
    assert_eq!(modules[1].source, "glsl/shade/full.comp");
}

#[test]
fn includes_come_from_the_own_folder_then_include_then_the_bridge() {
    let value = "twice(from_include()) + from_bridge() + local()";
    let body =
        shader("local.glsl", value).replace("layout(local", "#include \"maths.glsl\"\n#include \"gbuffer.glsl\"\nlayout(local");
    let root = tree(
        "includes",
        &[
            ("glsl/shade/full.comp", &body),
            ("glsl/shade/local.glsl", "float local() { return 1.0; }\n"),
            ("glsl/include/local.glsl", "#error the including file's own folder comes first\n"),
            ("glsl/include/maths.glsl", "#include \"deep/double.glsl\"\nfloat from_include() { return 3.0; }\n"),
            ("glsl/include/deep/double.glsl", &format!("#include \"../guard.glsl\"\n{DOUBLE}")),
            ("glsl/include/guard.glsl", "\n"),
            ("glsl/bridge/gbuffer.glsl", "float from_bridge() { return 5.0; }\n"),
            ("host/gbuffer.glsl", "float from_bridge() { return 7.0; }\n"),
        ],
    );
    let own = Options::new(&root);
    let with_own = compile_all(&own).unwrap();
    let shared = [
        "glsl/bridge/gbuffer.glsl",
        "glsl/include/deep/double.glsl",
        "glsl/include/guard.glsl",
        "glsl/include/maths.glsl",
        "glsl/shade/local.glsl",
    ];
    assert_eq!(with_own[0].includes, shared);

    let with_host = compile_all(&Options { bridge: root.join("host"), ..own.clone() }).unwrap();
    assert!(with_host[0].includes.contains(&"host/gbuffer.glsl".to_owned()));
    assert_ne!(with_host[0].spirv, with_own[0].spirv);
    assert_ne!(with_host[0].source_sha256, with_own[0].source_sha256);

    write(&root, "glsl/include/guard.glsl", "\n\n");
    let touched = compile_all(&own).unwrap();
    assert_ne!(touched[0].source_sha256, with_own[0].source_sha256, "an include is part of the source");
    assert_eq!(touched[0].spirv, with_own[0].spirv);
}

#[test]
fn variants_are_modules_with_their_macros() {
    let taps =
        shader("", "float(TAPS)").replace("#version 460\n", "#version 460\n// variant: few TAPS=2\n// variant: many TAPS=16\n");
    let root = tree("variants", &[("glsl/blur.comp", &taps)]);
    let modules = compile_all(&Options::new(&root)).unwrap();
    assert_eq!(names(&modules), ["blur.few.comp", "blur.many.comp"]);
    assert_ne!(modules[0].spirv, modules[1].spirv);
    assert_eq!(modules[1].macros[0].to_string(), "TAPS=16");

    write(&root, "glsl/blur.comp", &taps.replace("// variant: few TAPS=2", "// variant: default TAPS=2"));
    assert_eq!(names(&compile_all(&Options::new(&root)).unwrap()), ["blur.comp", "blur.many.comp"]);
}

#[test]
fn wrong_sources_are_named() {
    let error = |files: &[(&str, &str)]| compile_all(&Options::new(tree("errors", files))).unwrap_err();

    let typo = error(&[("glsl/shade/full.comp", &shader("", "1.0 + nothing"))]);
    assert!(matches!(typo, Error::Shader { .. }));
    let text = typo.to_string();
    assert!(text.contains("shade_full.comp does not compile") && text.contains("glsl/shade/full.comp:4: error:"), "{text}");

    let inside = error(&[("glsl/a.comp", &shader("b.glsl", "b()")), ("glsl/include/b.glsl", "\nfloat b() { return c; }\n")]);
    assert!(inside.to_string().contains("glsl/include/b.glsl:2: error:"), "{inside}");

    let missing = error(&[("glsl/a.comp", &shader("b.glsl", "1.0")), ("glsl/include/b.glsl", "#include \"gone.glsl\"\n")]);
    let expected = "glsl/include/b.glsl: #include \"gone.glsl\" not found; searched glsl/include, glsl/include, glsl/bridge";
    assert_eq!(missing.to_string(), expected);

    let nul = error(&[("glsl/a.comp", "#version 460\n\0")]);
    assert_eq!(nul.to_string(), "glsl/a.comp: expected UTF-8 text without NUL, got other bytes at offset 13");

    let plain = shader("", "1.0");
    let twice = error(&[("glsl/a/b.comp", &plain), ("glsl/a_b.comp", &plain)]);
    assert_eq!(twice.to_string(), "module a_b.comp would come from glsl/a/b.comp and from glsl/a_b.comp");

    assert!(matches!(error(&[("glsl/include/a.glsl", "")]), Error::NoStages { .. }));
    assert!(matches!(error(&[("other/a.comp", &plain)]), Error::Read { .. }));
}

#[test]
fn names_in_the_manifest_do_not_depend_on_how_the_root_is_written() {
    let body = shader("../include/maths.glsl", "twice(1.0)");
    let root = tree("root", &[("glsl/shade/full.comp", &body), ("glsl/include/maths.glsl", DOUBLE)]);
    for spelled in [root.clone(), root.join("."), root.join("glsl/../../root")] {
        let module = &compile_all(&Options::new(&spelled)).unwrap()[0];
        assert_eq!((module.source.as_str(), module.includes[0].as_str()), ("glsl/shade/full.comp", "glsl/include/maths.glsl"));
    }
    let outside = compile_all(&Options { root: root.join("tools/x"), ..Options::new(&root) }).unwrap();
    assert_eq!(outside[0].source, "../../glsl/shade/full.comp");
}

#[test]
fn a_selection_takes_passes_or_modules() {
    let plain = shader("", "1.0");
    let files = [("glsl/shade/full.comp", plain.as_str()), ("glsl/shade/half.comp", &plain), ("glsl/resolve.comp", &plain)];
    let options = Options::new(tree("only", &files));
    let only = |names: &[&str]| Options { only: names.iter().map(ToString::to_string).collect(), ..options.clone() };
    assert_eq!(names(&compile_all(&only(&["shade"])).unwrap()), ["shade_full.comp", "shade_half.comp"]);
    assert_eq!(names(&compile_all(&only(&["shade_half", "resolve"])).unwrap()), ["resolve.comp", "shade_half.comp"]);
    let wrong = compile_all(&only(&["sahde"])).unwrap_err();
    assert_eq!(wrong.to_string(), "only: expected one of resolve, shade, got sahde");
}

#[test]
fn outputs_are_deterministic_and_only_touched_when_they_change() {
    let plain = shader("", "1.0");
    let root = tree("outputs", &[("glsl/a.comp", &plain), ("glsl/b.comp", &plain)]);
    let options = Options::new(&root);
    let new = |name: &str, kind| (name.to_owned(), kind);
    let (missing, different, stale) = (ChangeKind::Missing, ChangeKind::Different, ChangeKind::Stale);
    assert_eq!(update(&options), [new("a.comp.spv", missing), new("b.comp.spv", missing), new("manifest.json", missing)]);
    let first = fs::read(root.join("spirv/manifest.json")).unwrap();
    assert!(update(&options).is_empty(), "a second run changes nothing");

    write(&root, "spirv/a.comp.spv", "damaged");
    assert_eq!(update(&options), [new("a.comp.spv", different)]);
    assert_eq!(fs::read(root.join("spirv/manifest.json")).unwrap(), first);

    fs::remove_file(root.join("glsl/b.comp")).unwrap();
    assert_eq!(update(&options), [new("b.comp.spv", stale), new("manifest.json", different)]);
    let manifest = read_manifest(&root.join("spirv")).unwrap();
    assert_eq!(manifest.modules.len(), 1);
    assert_eq!(manifest.modules[0].source, "glsl/a.comp");
    assert!(!root.join("spirv/b.comp.spv").exists());

    let elsewhere = tree("outputs_elsewhere", &[("glsl/a.comp", &plain)]);
    update(&Options::new(&elsewhere));
    let again = fs::read_to_string(elsewhere.join("spirv/manifest.json")).unwrap();
    assert_eq!(again, fs::read_to_string(root.join("spirv/manifest.json")).unwrap(), "no folder of this machine is in it");

    write(&root, "spirv/manifest.json", "{\"schema\": 1, \"extra\": 2}");
    assert!(matches!(read_manifest(&root.join("spirv")).unwrap_err(), Error::Manifest { .. }));
}

#[test]
fn a_repository_has_its_own_set_and_one_for_each_host() {
    let reads = shader("gbuffer.glsl", "depth()");
    let root = tree(
        "repository",
        &[
            ("glsl/shade.comp", &reads),
            ("glsl/resolve.comp", &shader("", "1.0")),
            ("glsl/bridge/gbuffer.glsl", "float depth() { return 1.0; }\n"),
            ("examples/host/bridge/gbuffer.glsl", "float depth() { return 0.0; }\n"),
            ("examples/host/glsl/draw.comp", &reads),
            ("examples/host/passes.txt", "# what this host records\nshade # coarse to fine\n"),
            ("examples/other/main.rs", ""),
        ],
    );
    let sets = Options::of_repository(&root).unwrap();
    assert_eq!(sets.len(), 2);
    assert_eq!(names(&compile_all(&sets[0]).unwrap()), ["resolve.comp", "shade.comp"]);
    let host = compile_all(&sets[1]).unwrap();
    assert_eq!(names(&host), ["draw.comp", "shade.comp"]);
    assert!(host.iter().all(|module| module.includes == ["examples/host/bridge/gbuffer.glsl"]));
    assert_eq!(sets[1].out, root.join("examples/host/spirv"));
}
