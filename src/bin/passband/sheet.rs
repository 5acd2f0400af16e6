//! Sheets of plots, drawn into memory and written as PNG.

use passband::offline::bench::tiles::Tile;
use passband::offline::error::{Error, Result};
use passband::offline::image_io::write_png;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged};
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::path::Path;

/// Bandwidths in cycles/radian from black to white.
pub const RANGE: [f64; 2] = [0.25, 128.0];
/// False colour from slow to fast, dark to light so that it reads in grey too.
const COLOURS: [[f64; 3]; 6] =
    [[0.0, 0.0, 0.1], [0.2, 0.1, 0.5], [0.6, 0.15, 0.5], [0.9, 0.4, 0.3], [1.0, 0.75, 0.3], [1.0, 1.0, 0.85]];

/// A part of a sheet.
pub type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
/// What drawing returns.
pub type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// Draws a sheet of `size` pixels under a title and writes it.
///
/// # Errors
/// [`Error::Write`] if it cannot be drawn or written.
pub fn write(path: &Path, size: (u32, u32), title: &str, draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<()> {
    let failed = |reason: &dyn ToString| Error::Write { path: path.into(), reason: reason.to_string() };
    let mut rgb = vec![255; size.0 as usize * size.1 as usize * 3];
    // Registering again does no harm.
    let font = register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    font.map_err(|_| failed(&"the typeface is damaged"))?;
    let sheet = |rgb: &mut [u8]| -> Drawn {
        let root = BitMapBackend::with_buffer(rgb, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root.margin(14, 0, 0, 0).titled(title, ("sans-serif", 34))?)?;
        root.present()?;
        Ok(())
    };
    sheet(&mut rgb).map_err(|e| failed(&e))?;
    let rgba: Vec<u8> = rgb.as_chunks().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    write_png(path, size.0, size.1, &rgba)
}

/// Most pixels a side of a contact sheet's tile: larger ones lose pixels.
const MOST: u32 = 512;
/// Of a line of a label, under its tile; labels have one or two.
const LINE: u32 = 22;
const GAP: u32 = 12;

/// Writes images of one size under a title, each over its label, row by row.
///
/// # Errors
/// As [`write`].
pub fn contact(path: &Path, title: &str, columns: usize, tiles: &[Tile]) -> Result<()> {
    let Some(first) = tiles.first() else { return Ok(()) };
    let step = first.width.max(first.height).div_ceil(MOST);
    // Small ones are enlarged, to have space for labels.
    let times = if step > 1 { 1 } else { (MOST / first.width.max(1)).clamp(1, 8) };
    let [width, height] = [first.width, first.height].map(|e| (e / step * times).max(1));
    let (columns, rows) = (columns.max(1) as u32, tiles.len().div_ceil(columns.max(1)) as u32);
    let size = (columns * (width + GAP) + GAP, 70 + rows * (height + 2 * LINE + GAP));
    write(path, size, title, |root| {
        let text = ("sans-serif", 18).into_font().color(&BLACK);
        for (i, tile) in (0u32..).zip(tiles) {
            let left = (GAP + i % columns * (width + GAP)) as i32;
            let top = (i / columns * (height + 2 * LINE + GAP)) as i32;
            let texel = |i: u32| (i / width / times * step) * tile.width + i % width / times * step;
            let pixel = |i: u32| tile.rgb.get(texel(i) as usize).copied().unwrap_or_default();
            let rgb: Vec<u8> = (0..width * height).flat_map(pixel).collect();
            let picture = BitMapElement::<'_, _>::with_owned_buffer((left, top), (width, height), rgb);
            root.draw(&picture.ok_or("a tile is not of its size")?)?;
            for (line, label) in (0i32..).zip(tile.label.lines()) {
                let below = top + height as i32 + 5 + line * LINE as i32;
                root.draw(&Text::new(label.to_string(), (left, below), text.clone()))?;
            }
        }
        Ok(())
    })
}

/// The legend of all labelled series.
pub fn legend<'a, 'b: 'a, X, Y>(
    chart: &mut ChartContext<'a, BitMapBackend<'b>, Cartesian2d<X, Y>>,
    position: SeriesLabelPosition,
) -> Drawn
where
    X: Ranged<ValueType = f64> + AsRangedCoord<Value = f64>,
    Y: Ranged<ValueType = f64> + AsRangedCoord<Value = f64>,
{
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(190, 190, 190))
        .label_font(("sans-serif", 18))
        .draw()?;
    Ok(())
}

/// The colour of a bandwidth in cycles/radian, each channel in 0..1.
pub fn false_colour(bandwidth: f64) -> [f64; 3] {
    let along = (bandwidth.max(1e-9) / RANGE[0]).ln() / (RANGE[1] / RANGE[0]).ln();
    let x = along.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let [a, b] = [x as usize, (x as usize + 1).min(COLOURS.len() - 1)].map(|i| COLOURS.get(i).copied().unwrap_or_default());
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * x.fract())
}
