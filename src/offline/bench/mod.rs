//! `passband bench`: variants of a frame measured side by side, speed beside error, as tables and JSON.
//!
//! Frames of all variants alternate in one run (A B B A ...); errors are against converged images that are kept on disk; gains
//! are stated at equal error and at equal time, against full rate with the same and with the default estimator.

pub mod cases;
pub mod copy_rate;
pub mod curves;
pub mod environment;
pub mod equal;
pub mod figures;
pub mod joined;
pub mod judge;
pub mod parts;
pub mod quality;
pub mod reached;
pub mod reference;
pub mod report;
pub mod runner;
pub mod spectrum;
pub mod statistics;
pub mod suites;
pub mod table;
pub mod tiles;
mod together;
pub mod truths;
pub mod variants;
pub mod xu;
