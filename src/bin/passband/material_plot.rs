//! The plot of `passband material`: lobes, slices and energy on one sheet.

use crate::sheet::{self, Area, Drawn, RANGE, false_colour, legend};
use glam::DVec3;
use passband::distribution::LobeFit;
use passband::offline::error::Result;
use passband::reflectance::analysis::{albedo, at};
use passband::reflectance::bandwidth::{SIDE, WIDTH};
use passband::reflectance::{LobeBandwidth, Reflectance};
use passband::sampling::luminance;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::path::Path;

const SIZE: (u32, u32) = (1600, 1800);
/// Rows of the sheet below the other panels.
const STRIPS: i32 = 640;
/// Principal components of the strips that are shown below the whole one.
const COMPONENTS: [usize; 4] = [4, 2, 1, 0];
/// The lobes' view angles in degrees.
const VIEWS: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// Colours of the lobes, told apart in grey too.
const LOBES: [RGBColor; 4] = [RGBColor(20, 40, 110), RGBColor(200, 60, 40), RGBColor(40, 150, 90), RGBColor(230, 160, 40)];
const CHANNELS: [(&str, RGBColor); 3] =
    [("red", RGBColor(205, 45, 45)), ("green", RGBColor(30, 145, 60)), ("blue", RGBColor(45, 75, 205))];
/// Decades below the largest value that are shown.
const DECADES: f64 = 5.0;
/// Cells a side of the image slice.
const CELLS: usize = 180;

type Chart<'a, 'b> = ChartContext<'a, BitMapBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws `reflectance` and writes it as a PNG.
pub fn write(path: &Path, title: &str, reflectance: &dyn Reflectance, bandwidth: &LobeBandwidth, fit: &LobeFit) -> Result<()> {
    sheet::write(path, SIZE, title, |root| {
        let (upper, strips_at) = root.split_vertically(SIZE.1 as i32 - STRIPS);
        let panels = upper.split_evenly((2, 2));
        let [lobes_at, slice_at, image_at, energy_at] = panels.as_slice() else { return Err("the sheet has four panels".into()) };
        lobes(lobes_at, reflectance, fit)?;
        slice(slice_at, reflectance)?;
        image(image_at, reflectance)?;
        energy(energy_at, reflectance)?;
        strips(&strips_at, bandwidth)
    })
}

/// A panel with axes.
fn chart<'a, 'b>(
    area: &'a Area<'b>,
    caption: &str,
    x: (std::ops::Range<f64>, &str),
    y: (std::ops::Range<f64>, &str),
    y_label: &dyn Fn(&f64) -> String,
) -> std::result::Result<Chart<'a, 'b>, Box<dyn std::error::Error>> {
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 24))
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(72)
        .build_cartesian_2d(x.0, y.0)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .label_style(("sans-serif", 18))
        .axis_desc_style(("sans-serif", 20))
        .x_desc(x.1)
        .y_desc(y.1)
        .y_labels(DECADES as usize + 1)
        .y_label_formatter(y_label)
        .draw()?;
    Ok(chart)
}

fn curve(chart: &mut Chart<'_, '_>, points: Vec<(f64, f64)>, colour: RGBColor, label: String) -> Drawn {
    chart
        .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
        .label(label)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(3)));
    Ok(())
}

/// The logarithm that is plotted, at most [`DECADES`] below the largest.
fn logarithm(value: f64, top: f64) -> f64 {
    value.max(1e-300).log10().clamp(top - DECADES, top)
}

fn power(y: &f64) -> String {
    format!("1e{}", y.round() as i32)
}

/// The range of a logarithmic axis below the largest of `values`.
fn decades(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let top = values.fold(1e-6, f64::max).log10().ceil();
    top - DECADES..top
}

/// Luminance in the plane of incidence over the light's angle, and its fit; the viewer's mirror direction is on the right.
fn lobes(area: &Area<'_>, reflectance: &dyn Reflectance, fit: &LobeFit) -> Drawn {
    let direction = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        DVec3::new(sin, 0.0, cos)
    };
    let curves = VIEWS.map(|view| {
        let value = |i: i32| {
            let light = 89.9 * f64::from(i) / 1800.0;
            (light, luminance(reflectance.mean_over_turns(direction(light), direction(-view))))
        };
        (-1800..=1800).map(value).collect::<Vec<_>>()
    });
    let range = decades(curves.iter().flatten().map(|p| p.1));
    let top = range.end;
    let caption = "Lobes in the plane of incidence";
    let mut chart = chart(area, caption, (-90.0..90.0, "light, degrees"), (range, "luminance, 1/sr"), &power)?;
    for ((points, colour), view) in curves.into_iter().zip(LOBES).zip(VIEWS) {
        let points = points.into_iter().map(|(x, y)| (x, logarithm(y, top))).collect();
        curve(&mut chart, points, colour, format!("viewer at {view} degrees"))?;
    }
    for (i, view) in VIEWS.into_iter().enumerate() {
        let node = fit.at(view.to_radians().cos());
        let value = |i: i32| {
            let light = 89.9 * f64::from(i) / 1800.0;
            let away = direction(-light);
            (light, logarithm(luminance(node.evaluate(away)) / away.z, top))
        };
        let series = chart.draw_series(LineSeries::new((-1800..=1800).map(value), BLACK.mix(0.5).stroke_width(1)))?;
        if i == 0 {
            let name = format!("fit by {} lobes", fit.count());
            series.label(name).legend(|(x, y)| PathElement::new([(x, y), (x + 24, y)], BLACK.mix(0.5).stroke_width(1)));
        }
    }
    legend(&mut chart, SeriesLabelPosition::UpperLeft)
}

/// Each channel over the half vector's angle, light and viewer about it.
fn slice(area: &Area<'_>, reflectance: &dyn Reflectance) -> Drawn {
    const DIFFERENCE: f64 = 5.0;
    let values: Vec<_> = (0..=900)
        .map(|i| {
            let x = 9.4 * f64::from(i) / 900.0;
            (x, at(reflectance, x * x, DIFFERENCE))
        })
        .collect();
    let range = decades(values.iter().map(|p| p.1.max_element()));
    let top = range.end;
    let mut chart = chart(
        area,
        "Highlight (theta_d = 5 degrees)",
        (0.0..9.4, "theta_h, square root of degrees"),
        (range, "reflectance, 1/sr"),
        &power,
    )?;
    for (c, (name, colour)) in CHANNELS.into_iter().enumerate() {
        let points = values.iter().map(|(x, rgb)| (*x, logarithm(rgb.to_array()[c], top))).collect();
        curve(&mut chart, points, colour, name.into())?;
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)
}

/// The slice across the plane of incidence, as colour.
fn image(area: &Area<'_>, reflectance: &dyn Reflectance) -> Drawn {
    let caption = "Slice phi_d = 90 degrees (white: 1 or more per sr)";
    let y = (0.0..90.0, "theta_d, degrees");
    let mut chart = chart(area, caption, (0.0..9.487, "theta_h, square root of degrees"), y, &|y| format!("{y:.0}"))?;
    let side = |i: usize, whole: f64| whole * i as f64 / CELLS as f64;
    let cells = (0..CELLS * CELLS).map(|cell| {
        let (i, j) = (cell % CELLS, cell / CELLS);
        let middle = |i: usize, whole: f64| whole * (i as f64 + 0.5) / CELLS as f64;
        let rgb = at(reflectance, middle(i, 9.487).powi(2), middle(j, 90.0));
        let [r, g, b] = rgb.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8);
        let corners = [(side(i, 9.487), side(j, 90.0)), (side(i + 1, 9.487), side(j + 1, 90.0))];
        Rectangle::new(corners, RGBColor(r, g, b).filled())
    });
    chart.draw_series(cells)?;
    Ok(())
}

/// The reflected share of light over the view angle.
fn energy(area: &Area<'_>, reflectance: &dyn Reflectance) -> Drawn {
    let values: Vec<_> = (0..=11).map(|i| 8.0 * f64::from(i)).map(|degrees| (degrees, albedo(reflectance, degrees))).collect();
    let largest = values.iter().map(|p| p.1.max_element()).fold(1.0, f64::max);
    let y = (0.0..1.05 * largest, "share");
    let caption = "Reflected share of light, by channel";
    let mut chart = chart(area, caption, (0.0..90.0, "viewer, degrees"), y, &|y| format!("{y:.1}"))?;
    chart.draw_series(LineSeries::new([(0.0, 1.0), (90.0, 1.0)], RGBColor(120, 120, 120)))?;
    for (c, (name, colour)) in CHANNELS.into_iter().enumerate() {
        let points = values.iter().map(|(x, rgb)| (*x, rgb.to_array()[c])).collect();
        curve(&mut chart, points, colour, name.into())?;
    }
    Ok(())
}

/// Bandwidth over light directions, a tile a view angle, and what few principal components make of it (Bagher 2011, figure 8).
fn strips(area: &Area<'_>, bandwidth: &LobeBandwidth) -> Drawn {
    const CELL: i32 = 6;
    const STEP: i32 = SIDE as i32 * CELL + 26;
    let text = |text: String, y: i32| area.draw(&Text::new(text, (16, y), ("sans-serif", 20)));
    let range = format!("(black {} to white {} cycles/radian)", RANGE[0], RANGE[1]);
    let whole = (format!("Bandwidth of the lobe, viewer at 0 to 90 degrees {range}"), bandwidth.clone());
    let few = COMPONENTS.into_iter().map(|k| {
        let (strip, error) = bandwidth.compressed(k);
        (format!("mean and {k} principal components: relative error {error:.3}"), strip)
    });
    for (row, (caption, strip)) in (0..).zip(std::iter::once(whole).chain(few)) {
        text(caption, row * STEP)?;
        for (i, value) in (0..).zip(strip.texels()) {
            let [r, g, b] = false_colour(f64::from(*value)).map(|c| (255.0 * c).round() as u8);
            let (x, y) = (16 + i % WIDTH as i32 * CELL, row * STEP + 22 + i / WIDTH as i32 * CELL);
            area.draw(&Rectangle::new([(x, y), (x + CELL, y + CELL)], RGBColor(r, g, b).filled()))?;
        }
    }
    Ok(())
}
