//! `passband scenes`: what needs no file.

use comfy_table::{Table, presets};
use passband::offline::error::Result;
use passband::offline::scene::Scene;
use passband::reflectance::stand_in;
use std::process::ExitCode;

/// Lists the built-in scenes and reflectances
#[derive(clap::Args)]
pub struct Args {}

/// Runs the subcommand.
pub fn run(_: &Args) -> Result<ExitCode> {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    for (name, description) in Scene::builtin_names() {
        table.add_row([name, description]);
    }
    let names = stand_in::names().join(", ");
    crate::print(format_args!("{table}\n\nBuilt-in reflectances (synthetic tables): {names}"))?;
    Ok(ExitCode::SUCCESS)
}
