//! The `passband` command: one file a subcommand.

mod bench;
mod compare;
mod environment;
mod info;
mod material;
mod progress;
mod render;
mod scenes;
mod sheet;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use passband::offline::error::{Error, Result};
use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

/// Shades as often as the light field needs.
#[derive(Parser)]
#[command(name = "passband", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bench(Box<bench::Args>),
    Render(Box<render::Args>),
    Compare(compare::Args),
    Environment(environment::Args),
    Info(info::Args),
    Material(material::Args),
    Scenes(scenes::Args),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let result = match &cli.command {
        Command::Bench(args) => bench::run(args),
        Command::Render(args) => render::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Environment(args) => environment::run(args),
        Command::Info(args) => info::run(args),
        Command::Material(args) => material::run(args),
        Command::Scenes(args) => scenes::run(args),
    };
    // The one place where errors become exit codes: 2 for what was asked, 3 for the device.
    result.unwrap_or_else(|error| {
        complain(&error);
        ExitCode::from(error.exit_code())
    })
}

/// Help and version go to standard output; a wrong argument is one line and exit code 2.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // A closed pipe is no failure of ours.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        complain("expected a subcommand, see passband --help");
        return ExitCode::from(2);
    }
    let text = error.render().to_string();
    let what = text.split("\n\nUsage:").next().unwrap_or_default().trim_start_matches("error: ");
    let what = what.split_whitespace().collect::<Vec<_>>().join(" ");
    complain(what);
    ExitCode::from(2)
}

/// A line on standard output. A reader that has gone away is no failure; a full disk is.
///
/// # Errors
/// [`Error::Write`] with the system's word.
fn print(text: impl Display) -> Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "standard output".into(), reason: e.to_string() })
        }
        _ => Ok(()),
    }
}

/// A line on standard error; where there is none, the exit code has to do.
fn complain(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "passband: {text}");
}
