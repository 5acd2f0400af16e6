//! The committed SPIR-V is what the GLSL compiles to, is valid, asks for no more than the baseline device, and has the
//! interface that Rust binds.

use ash::vk;
use passband_shader_compiler::{Compiler, Manifest, ManifestModule, Module, Options, changes, compile_all, read_manifest};
use spirq::ReflectConfig;
use spirq::constant::ConstantValue;
use spirq::entry_point::ExecutionModel;
use spirq::parse::SpirvBinary;
use spirq::spirv::{Capability, ExecutionMode, Op};
use spirq::ty::{DescriptorType, Type};
use spirq::var::Variable;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// All that a shader may ask of a device; each further one would be a requirement on every host.
const ALLOWED: [Capability; 4] = [Capability::Matrix, Capability::Shader, Capability::ImageQuery, Capability::Sampled1D];

/// What a module says about itself.
#[derive(Debug, PartialEq)]
struct Reflection {
    version: (u32, u32),
    capabilities: Vec<Capability>,
    extensions: Vec<String>,
    entry: String,
    model: ExecutionModel,
    /// Compute only.
    local_size: Option<[u32; 3]>,
    /// (offset, bytes) of each member of the push constant block.
    push: Vec<(usize, usize)>,
    /// By (set, binding): kind and count.
    bindings: BTreeMap<(u32, u32), (DescriptorType, u32)>,
}

fn reflect(words: &[u32]) -> Result<Reflection, String> {
    let binary = SpirvBinary::from(words);
    if words.len() < 5 || words[0] != 0x0723_0203 {
        return Err("no SPIR-V header".into());
    }
    let (mut capabilities, mut extensions) = (Vec::new(), Vec::new());
    let mut instructions = binary.instrs().map_err(|e| e.to_string())?;
    while let Some(instruction) = instructions.next_non_nop().map_err(|e| e.to_string())? {
        let mut operands = instruction.operands();
        match instruction.op() {
            Op::Capability => {
                let word = operands.read_u32().map_err(|e| e.to_string())?;
                capabilities.push(Capability::from_u32(word).ok_or(format!("unknown capability {word}"))?);
            }
            Op::Extension => extensions.push(operands.read_str().map_err(|e| e.to_string())?.to_owned()),
            _ => {}
        }
    }
    let entries = ReflectConfig::new().spv(words).ref_all_rscs(true).reflect().map_err(|e| e.to_string())?;
    let [entry] = entries.as_slice() else { return Err(format!("expected one entry point, got {}", entries.len())) };
    let size = entry.exec_modes.iter().find(|mode| mode.exec_mode == ExecutionMode::LocalSize);
    let local_size = size.map(|mode| {
        let words: Vec<_> = mode.operands.iter().filter_map(|operand| literal(&operand.value)).collect();
        <[u32; 3]>::try_from(words).map_err(|got| format!("local size: expected three literals, got {got:?}"))
    });
    let (mut push, mut bindings) = (Vec::new(), BTreeMap::new());
    for variable in &entry.vars {
        match variable {
            Variable::Descriptor { desc_bind, desc_ty, nbind, .. } => {
                let (at, what) = (desc_bind.into_inner(), (desc_ty.clone(), *nbind));
                if bindings.insert(at, what).is_some() {
                    return Err(format!("two resources at {desc_bind}"));
                }
            }
            Variable::PushConstant { ty: Type::Struct(block), .. } => {
                let member = |m: &spirq::ty::StructMember| Some((m.offset?, m.ty.nbyte()?));
                push = block.members.iter().map(|m| member(m).ok_or("a push constant has no size")).collect::<Result<_, _>>()?;
            }
            Variable::PushConstant { ty, .. } => return Err(format!("push constants: expected a block, got {ty}")),
            _ => {}
        }
    }
    let version = ((words[1] >> 16) & 0xff, (words[1] >> 8) & 0xff);
    let (name, model) = (entry.name.clone(), entry.exec_model);
    Ok(Reflection { version, capabilities, extensions, entry: name, model, local_size: local_size.transpose()?, push, bindings })
}

fn literal(value: &ConstantValue) -> Option<u32> {
    match value {
        ConstantValue::U32(x) => Some(*x),
        ConstantValue::Typeless(bytes) => Some(u32::from_le_bytes(bytes.as_ref().try_into().ok()?)),
        _ => None,
    }
}

/// What is beyond the baseline device in a module.
fn baseline_errors(module: &Reflection) -> Vec<String> {
    let mut errors = Vec::new();
    if module.entry != "main" {
        errors.push(format!("entry point: expected main, got {}", module.entry));
    }
    if module.version != (1, 5) {
        errors.push(format!("SPIR-V version: expected 1.5, got {}.{}", module.version.0, module.version.1));
    }
    errors.extend(module.capabilities.iter().filter(|c| !ALLOWED.contains(c)).map(|c| format!("capability {c:?}")));
    errors.extend(module.extensions.iter().map(|e| format!("extension {e}")));
    errors.extend(module.bindings.iter().filter(|(_, (_, n))| *n != 1).map(|(at, (_, n))| format!("{n} descriptors at {at:?}")));
    errors
}

/// What Rust binds for one module.
struct ModuleInterface {
    /// As the file in `spirv/`, without `.spv`.
    name: String,
    /// Compute only; any other stage is not compared.
    local_size: [u32; 3],
    push_constant_bytes: u32,
    /// The whole layouts of the sets that the module is used with: (set, binding, kind).
    bindings: Vec<(u32, u32, vk::DescriptorType)>,
}

/// One set's bindings, as (set, binding, raw kind), and those that shaders use.
type UsedLayouts = BTreeMap<Vec<(u32, u32, i32)>, BTreeSet<(u32, u32)>>;

/// Where Rust and the modules disagree; empty if they do not.
///
/// Every module has a row and every row a module. A shader's binding is in Rust's layout with the same kind. A layout may
/// be shared, and then a single shader need not use all of it, but each binding is used by one of the shaders that share
/// the set. Push constants have no hole and Rust's size; Rust's plain-data structs have no hole either, so with members
/// in the same order their offsets agree.
fn interface_errors(rows: &[ModuleInterface], modules: &BTreeMap<String, Reflection>) -> Vec<String> {
    let mut errors = Vec::new();
    let mut shared = UsedLayouts::new();
    for name in modules.keys().filter(|name| rows.iter().all(|row| row.name != **name)) {
        errors.push(format!("{name}: a module that Rust does not list"));
    }
    for row in rows {
        let mut wrong = |what: String| errors.push(format!("{}: {what}", row.name));
        let Some(module) = modules.get(&row.name) else {
            wrong("Rust lists it, but there is no such module".into());
            continue;
        };
        if module.model == ExecutionModel::GLCompute && module.local_size != Some(row.local_size) {
            wrong(format!("local size: Rust {:?}, shader {:?}", row.local_size, module.local_size));
        }
        let mut end = 0;
        for (member, &(offset, bytes)) in module.push.iter().enumerate() {
            if offset != end {
                wrong(format!("push constant member {member}: expected offset {end}, got {offset}"));
            }
            end = offset + bytes;
        }
        if end != row.push_constant_bytes as usize {
            wrong(format!("push constants: Rust {} bytes, shader {end}", row.push_constant_bytes));
        }
        for (&(set, binding), (kind, _)) in &module.bindings {
            match row.bindings.iter().find(|b| (b.0, b.1) == (set, binding)) {
                None => wrong(format!("set {set} binding {binding}: not in Rust, shader {kind:?}")),
                Some(found) if !same_kind(found.2, kind) => {
                    wrong(format!("set {set} binding {binding}: Rust {:?}, shader {kind:?}", found.2));
                }
                Some(_) => {}
            }
        }
        for set in row.bindings.iter().map(|b| b.0).collect::<BTreeSet<_>>() {
            let mut layout: Vec<_> = row.bindings.iter().filter(|b| b.0 == set).map(|b| (b.0, b.1, b.2.as_raw())).collect();
            layout.sort_unstable();
            shared.entry(layout).or_default().extend(module.bindings.keys().filter(|at| at.0 == set));
        }
    }
    for (layout, used) in &shared {
        for (set, binding, kind) in layout.iter().filter(|(set, binding, _)| !used.contains(&(*set, *binding))) {
            let kind = vk::DescriptorType::from_raw(*kind);
            errors.push(format!("set {set} binding {binding} ({kind:?}): bound by Rust, used by no shader of that layout"));
        }
    }
    errors
}

fn same_kind(rust: vk::DescriptorType, shader: &DescriptorType) -> bool {
    use vk::DescriptorType as T;
    match shader {
        DescriptorType::Sampler() => rust == T::SAMPLER,
        DescriptorType::CombinedImageSampler() => rust == T::COMBINED_IMAGE_SAMPLER,
        DescriptorType::SampledImage() => rust == T::SAMPLED_IMAGE,
        DescriptorType::StorageImage(_) => rust == T::STORAGE_IMAGE,
        DescriptorType::UniformTexelBuffer() => rust == T::UNIFORM_TEXEL_BUFFER,
        DescriptorType::StorageTexelBuffer(_) => rust == T::STORAGE_TEXEL_BUFFER,
        DescriptorType::UniformBuffer() => [T::UNIFORM_BUFFER, T::UNIFORM_BUFFER_DYNAMIC].contains(&rust),
        DescriptorType::StorageBuffer(_) => [T::STORAGE_BUFFER, T::STORAGE_BUFFER_DYNAMIC].contains(&rust),
        DescriptorType::InputAttachment(_) => rust == T::INPUT_ATTACHMENT,
        DescriptorType::AccelStruct() => rust == T::ACCELERATION_STRUCTURE_KHR,
    }
}

/// The repository's own set of modules and one for each example host.
fn sets() -> Vec<Options> {
    Options::of_repository(env!("CARGO_MANIFEST_DIR")).expect("the repository's folders are readable")
}

fn words(path: &Path) -> Vec<u32> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}; run scripts/compile-shaders", path.display()));
    assert_eq!(bytes.len() % 4, 0, "{} is not whole words", path.display());
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

/// Every committed module of every set, told by its manifest.
fn committed() -> Vec<PathBuf> {
    let mut paths = Vec::new();
    for set in sets() {
        let manifest = read_manifest(&set.out).unwrap_or_else(|e| panic!("{e}; run scripts/compile-shaders"));
        assert!(!manifest.modules.is_empty(), "{} lists no module", set.out.display());
        paths.extend(manifest.modules.iter().map(|module| set.out.join(format!("{}.spv", module.name))));
    }
    paths
}

#[test]
fn committed_modules_are_what_the_sources_compile_to() {
    let version = Compiler::new().and_then(|compiler| compiler.version()).unwrap();
    for set in sets() {
        let modules = compile_all(&set).unwrap_or_else(|e| panic!("{e}"));
        let old = read_manifest(&set.out).unwrap_or_else(|e| panic!("{e}; run scripts/compile-shaders"));
        if old.compiler == version {
            let found = changes(&set, &modules, &Manifest::of(version.clone(), &modules)).unwrap();
            let found: Vec<_> = found.iter().map(ToString::to_string).collect();
            assert!(found.is_empty(), "run scripts/compile-shaders:\n{}", found.join("\n"));
            continue;
        }
        // Another compiler writes other words for the same shader: sources and interface must agree instead.
        let mut rows = Vec::new();
        for module in &modules {
            let spirv = words(&set.out.join(module.file_name()));
            assert_eq!(reflect(&spirv), reflect(&module.spirv), "{}: run scripts/compile-shaders", module.name);
            rows.push(ManifestModule::of(&Module { spirv, ..module.clone() }));
        }
        assert_eq!(old.modules, rows, "run scripts/compile-shaders");
    }
}

#[test]
fn committed_modules_are_valid() {
    for path in committed() {
        let output = Command::new("spirv-val").args(["--target-env", "vulkan1.2"]).arg(&path).output();
        let output = output.unwrap_or_else(|e| panic!("spirv-val: {e}; scripts/bootstrap test installs it"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && said.is_empty(), "{}: {said}", path.display());
    }
}

#[test]
fn committed_modules_ask_for_no_more_than_the_baseline() {
    for path in committed() {
        let module = reflect(&words(&path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(baseline_errors(&module), Vec::<String>::new(), "{}", path.display());
    }
}

/// What the passes bind: set 0 the G-buffer bridge, set 1 the material bridge, set 2 the pass's own, and the rasterisers'
/// push constants, at most as large as every device allows.
fn bound_by_rust() -> Vec<ModuleInterface> {
    let set = |set: u32, types: &[vk::DescriptorType]| -> Vec<_> {
        (0..).zip(types).map(|(binding, &kind)| (set, binding, kind)).collect()
    };
    let compute = passband::pass::interfaces().into_iter().map(|interface| {
        let mut bindings = set(2, interface.own);
        if interface.gbuffer {
            bindings.extend(set(0, &passband::pass::gbuffer::BRIDGE));
        }
        if interface.materials {
            bindings.extend(set(1, &passband::pass::materials::BRIDGE));
        }
        let name = format!("{}.comp", interface.name);
        ModuleInterface { name, local_size: interface.local_size, push_constant_bytes: interface.push_bytes, bindings }
    });
    let passes = [("gbuffer.plain", 128), ("gbuffer.coordinates", 128), ("texture_space", 112)];
    let raster = passes.into_iter().flat_map(|(name, bytes)| ["vert", "frag"].map(|stage| (format!("{name}.{stage}"), bytes)));
    let raster = raster.map(|(name, push_constant_bytes)| ModuleInterface {
        name,
        local_size: [0; 3],
        push_constant_bytes,
        bindings: Vec::new(),
    });
    compute.chain(raster).collect()
}

/// The repository's own modules by name, told by the files in `spirv/`.
fn own_modules() -> BTreeMap<String, Reflection> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("spirv");
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let spirv = files.filter(|path| path.extension().is_some_and(|e| e == "spv"));
    let module = |path: PathBuf| {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let reflection = reflect(&words(&path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        (name, reflection)
    };
    spirv.map(module).collect()
}

/// What is bound although no shader uses it: the alias table in the sets of `bandwidth` and `resolve`, whose include declares it.
const UNUSED: [&str; 2] = ["set 2 binding 2 (COMBINED_IMAGE_SAMPLER): bound by Rust, used by no shader of that layout"; 2];

#[test]
fn passes_bind_what_their_modules_declare() {
    assert_eq!(interface_errors(&bound_by_rust(), &own_modules()), UNUSED);
}

#[test]
fn a_pass_that_binds_otherwise_is_found() {
    let modules = own_modules();
    let shade = |change: fn(&mut ModuleInterface)| {
        let mut rows = bound_by_rust();
        change(rows.iter_mut().find(|row| row.name == "shade.comp").unwrap());
        interface_errors(&rows, &modules).join("; ")
    };
    assert_eq!(shade(|_| {}), UNUSED.join("; "));
    let swapped = shade(|row| {
        let [map, arguments] = [1, 3].map(|binding| row.bindings.iter().position(|b| (b.0, b.1) == (2, binding)).unwrap());
        let kind = row.bindings[map].2;
        row.bindings[map].2 = std::mem::replace(&mut row.bindings[arguments].2, kind);
    });
    assert!(swapped.contains("set 2 binding 1: Rust STORAGE_BUFFER") && swapped.contains("set 2 binding 3: Rust"), "{swapped}");
    assert!(shade(|row| row.push_constant_bytes += 4).contains("shade.comp: push constants: Rust"));
    assert!(shade(|row| row.bindings.retain(|b| b.0 != 1)).contains("set 1 binding 0: not in Rust"));
}

#[test]
fn embedded_modules_are_the_committed_files() {
    let embedded: BTreeSet<_> = passband::pass::modules::NAMES.iter().map(ToString::to_string).collect();
    assert_eq!(embedded, own_modules().into_keys().collect(), "src/pass/modules.rs and spirv/");
}

/// Reflects a shader that is written to a folder of the test's own.
fn sample(test: &str, text: &str) -> BTreeMap<String, Reflection> {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shaders").join(test);
    std::fs::create_dir_all(root.join("glsl")).unwrap();
    std::fs::write(root.join("glsl/sample.comp"), text).unwrap();
    let modules = compile_all(&Options::new(&root)).unwrap();
    modules.into_iter().map(|module| (module.name, reflect(&module.spirv).unwrap())).collect()
}

const SAMPLE: &str = "#version 460
layout(local_size_x = 8, local_size_y = 4) in;
layout(set = 0, binding = 0) uniform sampler2D source;
layout(set = 0, binding = 1, rgba16f) writeonly uniform image2D target;
layout(set = 1, binding = 2) readonly buffer B { float x[]; };
layout(push_constant) uniform P { uvec2 extent; float scale; uint count; mat4 view; };
void main() {
    vec4 v = textureLod(source, vec2(extent) * scale, 0.0) * x[count] * view;
    imageStore(target, ivec2(gl_GlobalInvocationID.xy), v);
}
";

fn sample_row() -> ModuleInterface {
    use vk::DescriptorType as T;
    let bindings = vec![(0, 0, T::COMBINED_IMAGE_SAMPLER), (0, 1, T::STORAGE_IMAGE), (1, 2, T::STORAGE_BUFFER)];
    ModuleInterface { name: "sample.comp".into(), local_size: [8, 4, 1], push_constant_bytes: 80, bindings }
}

#[test]
fn an_interface_that_agrees_passes_and_each_disagreement_is_named() {
    let modules = sample("agrees", SAMPLE);
    assert_eq!(baseline_errors(&modules["sample.comp"]), Vec::<String>::new());
    let errors = |change: fn(&mut ModuleInterface)| {
        let mut row = sample_row();
        change(&mut row);
        interface_errors(&[row], &modules).join("; ")
    };
    assert_eq!(errors(|_| {}), "");
    assert_eq!(errors(|row| row.local_size = [8, 8, 1]), "sample.comp: local size: Rust [8, 8, 1], shader Some([8, 4, 1])");
    assert_eq!(errors(|row| row.push_constant_bytes = 84), "sample.comp: push constants: Rust 84 bytes, shader 80");
    assert!(errors(|row| row.bindings[0].2 = vk::DescriptorType::SAMPLED_IMAGE).contains("set 0 binding 0: Rust SAMPLED_IMAGE"));
    assert!(errors(|row| row.bindings.truncate(2)).contains("set 1 binding 2: not in Rust"));
    assert!(errors(|row| row.bindings.push((1, 3, vk::DescriptorType::STORAGE_BUFFER))).contains("used by no shader"));
    assert!(errors(|row| row.name = "other.comp".into()).contains("sample.comp: a module that Rust does not list"));
    assert!(errors(|row| row.name = "other.comp".into()).contains("other.comp: Rust lists it"));
}

#[test]
fn a_hole_in_push_constants_is_found() {
    let modules = sample("hole", &SAMPLE.replace("uvec2 extent; float scale;", "float scale; uvec2 extent;"));
    let found = interface_errors(&[sample_row()], &modules);
    assert_eq!(found[0], "sample.comp: push constant member 1: expected offset 4, got 8");
}

#[test]
fn shaders_beyond_the_baseline_are_found() {
    let errors = |test: &str, text: &str| baseline_errors(&sample(test, text)["sample.comp"]).join("; ");
    let extended = SAMPLE.replace("rgba16f", "rg16f");
    assert_eq!(errors("formats", &extended), "capability StorageImageExtendedFormats");
    let wide = SAMPLE.replace("#version 460\n", "#version 460\n#extension GL_ARB_gpu_shader_int64 : require\n");
    let wide = wide.replace("x[count]", "float(uint64_t(count) << (32u + count))");
    assert_eq!(errors("int64", &wide), "capability Int64");
    let array = SAMPLE.replace("sampler2D source", "sampler2D source[2]").replace("source,", "source[0],");
    assert_eq!(errors("array", &array), "2 descriptors at (0, 0)");
}
