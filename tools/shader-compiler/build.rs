//! Completes the link line where the system's `libshaderc_combined.a` holds shaderc alone and leaves glslang and SPIRV-Tools
//! to whoever links it (Debian 12 does): their archives are offered beside it. An archive gives a linker only what it still
//! misses, so a complete shaderc, or one built from source, takes nothing from here. Archives are searched for symbols that
//! come up later in the line, as lld does, rustc's default linker on x86-64 Linux.

const ARCHIVES: [&str; 8] =
    ["SPIRV", "glslang", "MachineIndependent", "GenericCodeGen", "OSDependent", "OGLCompiler", "SPIRV-Tools-opt", "SPIRV-Tools"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let Ok(system) = pkg_config::Config::new().cargo_metadata(false).probe("shaderc") else { return };
    let folders: Vec<_> = system.link_paths.iter().filter(|folder| folder.is_dir()).collect();
    for name in ARCHIVES {
        if let Some(folder) = folders.iter().find(|folder| folder.join(format!("lib{name}.a")).is_file()) {
            println!("cargo:rustc-link-search=native={}", folder.display());
            println!("cargo:rustc-link-lib=static:-bundle={name}");
        }
    }
}
