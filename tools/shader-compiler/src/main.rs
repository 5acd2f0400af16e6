//! The command: compiles `glsl/` into `spirv/`, or a host's own set, or checks that nothing would change.

use clap::Parser;
use passband_shader_compiler::{Compiler, Manifest, Options, Result, apply, changes, compile_all};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compiles GLSL stage files into SPIR-V 1.5 modules with a manifest.
///
/// Exit code 0: done, or nothing to do; 1: --check found a difference; 2: an error, named on standard error.
#[derive(Parser)]
#[command(name = "passband-shader-compiler")]
struct Arguments {
    /// Folder to which paths in the manifest are relative
    #[arg(long, value_name = "DIR", default_value = ".")]
    root: PathBuf,
    /// Every set of the repository: its own, and one for each examples/<host>/bridge
    #[arg(long, conflicts_with_all = ["glsl", "bridge", "extra", "only", "out"])]
    all: bool,
    /// The passes' stage files and includes [default: ROOT/glsl]
    #[arg(long, value_name = "DIR")]
    glsl: Option<PathBuf>,
    /// Replaces the accessors that passes read through [default: GLSL/bridge]
    #[arg(long, value_name = "DIR")]
    bridge: Option<PathBuf>,
    /// A host's own stage files, all compiled with the same includes
    #[arg(long, value_name = "DIR")]
    extra: Option<PathBuf>,
    /// Passes or modules to take from GLSL; the output folder then holds these alone
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    only: Vec<String>,
    /// Output folder [default: ROOT/spirv]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write nothing; exit with 1 if a file would change
    #[arg(long)]
    check: bool,
}

impl Arguments {
    fn sets(&self) -> Result<Vec<Options>> {
        if self.all {
            return Options::of_repository(&self.root);
        }
        let usual = Options::new(&self.root);
        let glsl = self.glsl.clone().unwrap_or(usual.glsl);
        Ok(vec![Options {
            bridge: self.bridge.clone().unwrap_or_else(|| glsl.join("bridge")),
            extra: self.extra.clone(),
            only: self.only.clone(),
            out: self.out.clone().unwrap_or(usual.out),
            root: usual.root,
            glsl,
        }])
    }
}

/// True if a set differs from its output folder and `check` forbids to change that.
fn run(options: &Options, check: bool) -> Result<bool> {
    let modules = compile_all(options)?;
    for module in modules.iter().filter(|module| !module.warnings.is_empty()) {
        eprintln!("{}", module.warnings);
    }
    let manifest = Manifest::of(Compiler::new()?.version()?, &modules);
    let changes = changes(options, &modules, &manifest)?;
    for change in &changes {
        println!("{change}");
    }
    if !check {
        apply(options, &changes)?;
    }
    let state = if changes.is_empty() {
        "up to date"
    } else if check {
        "out of date"
    } else {
        "written"
    };
    println!("{}: {state}, modules: {}", options.out.display(), modules.len());
    Ok(check && !changes.is_empty())
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let differs = arguments.sets().and_then(|sets| {
        let results: Result<Vec<bool>> = sets.iter().map(|options| run(options, arguments.check)).collect();
        Ok(results?.contains(&true))
    });
    match differs {
        Ok(false) => ExitCode::SUCCESS,
        Ok(true) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
