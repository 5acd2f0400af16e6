//! Rate and distortion: error over frame time and over directions, and over shaded pixels where curves of that are known, one curve a
//! way of shading.

use crate::sheet::{self, Area, Drawn, legend};
use passband::offline::bench::curves::Curve as Without;
use passband::offline::bench::report::{Row, SceneReport};
use passband::offline::bench::runner::Part;
use passband::offline::error::Result;
use passband::offline::metrics::Metrics;
use plotters::prelude::*;
use std::path::Path;

const SIZE: (u32, u32) = (2100, 760);
/// Told apart in grey too.
const COLOURS: [RGBColor; 8] = [
    RGBColor(20, 40, 110),
    RGBColor(230, 160, 40),
    RGBColor(40, 150, 90),
    RGBColor(200, 60, 40),
    RGBColor(120, 190, 220),
    RGBColor(140, 80, 160),
    RGBColor(150, 150, 60),
    RGBColor(90, 90, 90),
];

/// One way of shading at several numbers of directions.
struct Curve<'a> {
    name: &'a str,
    rows: Vec<&'a Row>,
}

/// Draws the variants of `scene` and writes them as a PNG.
pub fn write(path: &Path, scene: &SceneReport) -> Result<()> {
    let mut curves: Vec<Curve<'_>> = Vec::new();
    for row in scene.variants.iter().filter(|row| row.part == Part::Compared && row.error.is_some()) {
        let name = row.name.rsplit_once(' ').map_or(row.name.as_str(), |(name, _)| name);
        match curves.iter_mut().find(|c| c.name == name) {
            Some(curve) => curve.rows.push(row),
            None => curves.push(Curve { name, rows: vec![row] }),
        }
    }
    for curve in &mut curves {
        curve.rows.sort_by(|a, b| a.directions().total_cmp(&b.directions()));
    }
    let noise = scene.reference.as_ref().map_or(0.0, |r| r.noise.rmse);
    let title = format!("{}, {}x{}", scene.name, scene.extent[0], scene.extent[1]);
    sheet::write(path, SIZE, &title, |root| {
        let panels = root.split_evenly((1, 3));
        let [time, rate, third] = panels.as_slice() else { return Err("the sheet has three panels".into()) };
        let linear = Measure { name: "RMSE, linear radiance", of: |e| e.rmse, noise };
        panel(time, "frame, ms", &curves, &linear, |row| row.frame_ms.median)?;
        panel(rate, "directions a covered pixel: N times the shaded share", &curves, &linear, Row::directions)?;
        if !scene.curves.is_empty() {
            return reconstruction(third, &curves, &scene.curves);
        }
        let noise = scene.reference.as_ref().map_or(0.0, |r| displayed(r.noise.psnr));
        let shown = Measure { name: "RMS error as displayed", of: |e| displayed(e.psnr), noise };
        panel(third, "frame, ms", &curves, &shown, |row| row.frame_ms.median)
    })
}

/// Error without noise over shaded pixels.
fn reconstruction(area: &Area<'_>, known: &[Curve<'_>], curves: &[Without]) -> Drawn {
    let points = || curves.iter().flat_map(|c| &c.points);
    let height = around(points().map(|p| p.error));
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(84)
        .build_cartesian_2d(0.0..105.0, height.clone().log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .label_style(("sans-serif", 18))
        .axis_desc_style(("sans-serif", 20))
        .x_labels(6)
        .x_desc("shaded pixels, % of the covered ones")
        .y_desc("RMS error as displayed, of reconstruction alone")
        .y_label_formatter(&number)
        .draw()?;
    for curve in curves {
        // The same colours as beside it.
        let place = known.iter().position(|c| c.name == curve.rate).unwrap_or(known.len());
        let colour = COLOURS[place % COLOURS.len()];
        // What has no error at all stands on the axis.
        let shown = curve.points.iter().map(|p| (100.0 * p.shaded_fraction, p.error.max(height.start)));
        chart
            .draw_series(LineSeries::new(shown, colour.filled().stroke_width(3)).point_size(5))?
            .label(curve.rate)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(3)));
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)
}

/// What is on the vertical axis.
struct Measure {
    name: &'static str,
    of: fn(&Metrics) -> f64,
    /// Of the reference.
    noise: f64,
}

impl Measure {
    fn of(&self, row: &Row) -> f64 {
        row.error.as_ref().map_or(f64::NAN, self.of)
    }
}

/// The root mean square of what a PSNR is of.
fn displayed(psnr: f64) -> f64 {
    10_f64.powf(-psnr / 20.0)
}

/// A range with some space around all positive `values`; of 1 to 10 if there is none.
fn around(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let usable = values.filter(|v| *v > 0.0 && v.is_finite());
    let (least, most) = usable.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
    if most > 0.0 { least / 1.5..most * 1.5 } else { 1.0..10.0 }
}

fn number(v: &f64) -> String {
    if *v >= 0.1 { format!("{v}") } else { format!("{v:.0e}") }
}

fn panel(area: &Area<'_>, x_name: &str, curves: &[Curve<'_>], measure: &Measure, x: impl Fn(&Row) -> f64) -> Drawn {
    let noise = measure.noise;
    let rows = || curves.iter().flat_map(|c| c.rows.iter().copied());
    let width = around(rows().map(&x));
    let height = around(rows().map(|row| measure.of(row)).chain([noise]));
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(84)
        .build_cartesian_2d(width.clone().log_scale().base(2.0), height.log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .label_style(("sans-serif", 18))
        .axis_desc_style(("sans-serif", 20))
        .x_labels(6)
        .x_desc(x_name)
        .y_desc(measure.name)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.into_iter().cycle()) {
        let points: Vec<(f64, f64)> =
            curve.rows.iter().map(|row| (x(row), measure.of(row))).filter(|p| p.0 > 0.0 && p.1 > 0.0).collect();
        chart
            .draw_series(LineSeries::new(points.iter().copied(), colour.filled().stroke_width(3)).point_size(5))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(3)));
    }
    if noise > 0.0 {
        let grey = RGBColor(130, 130, 130);
        chart
            .draw_series(LineSeries::new([(width.start, noise), (width.end, noise)], grey.stroke_width(1)))?
            .label("noise of the reference")
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], grey.stroke_width(1)));
    }
    // Where neither time nor error is: curves fall from left to right.
    legend(&mut chart, SeriesLabelPosition::LowerLeft)
}
