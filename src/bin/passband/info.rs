//! `passband info`: devices, each held against what the renderer requires.

use comfy_table::{Table, presets};
use passband::offline::error::{Error, Result};
use passband::offline::headless::survey;
use passband::{Config, Requirements, memory_footprint};
use serde_json::json;
use std::process::ExitCode;

/// Lists Vulkan devices and holds each against the renderer's requirements
#[derive(clap::Args)]
pub struct Args {
    /// Print JSON only
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<ExitCode> {
    let config = Config::new([512, 512]);
    let devices = survey(&Requirements::of(&config))?;
    if devices.is_empty() {
        return Err(Error::Device("no Vulkan device: install a driver (Debian: mesa-vulkan-drivers)".into()));
    }
    let footprint = memory_footprint(&config);
    if args.json {
        let devices: Vec<_> = devices
            .iter()
            .map(|(info, rows)| {
                let rows: Vec<_> =
                    rows.iter().map(|r| json!({ "name": r.name, "needed": r.needed, "found": r.found, "ok": r.ok })).collect();
                json!({ "device": info, "suitable": rows.iter().all(|r| r["ok"] == true), "requirements": rows })
            })
            .collect();
        let report = json!({ "schema": 1, "version": env!("CARGO_PKG_VERSION"), "devices": devices,
            "footprint_512x512_bytes": footprint.total() });
        crate::print(format_args!("{report:#}"))?;
        return Ok(ExitCode::SUCCESS);
    }
    for (index, (info, rows)) in devices.iter().enumerate() {
        crate::print(format_args!("{index}: {} ({}; Vulkan {}; {})", info.name, info.kind, info.api, info.driver))?;
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(["", "requirement", "needed", "found"]);
        for row in rows {
            table.add_row([if row.ok { "ok" } else { "MISSING" }, &row.name, &row.needed, &row.found]);
        }
        crate::print(format_args!("{table}\n"))?;
    }
    let mebibytes = footprint.total() as f64 / 1048576.0;
    crate::print(format_args!("A renderer at 512x512 takes {mebibytes:.1} MiB before environments and materials."))?;
    Ok(ExitCode::SUCCESS)
}
