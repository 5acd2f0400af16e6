//! How the tables of all materials lie in the textures that shaders read.

use crate::distribution::LobeFit;
use crate::material::Material;
use crate::reflectance::importance::{COLUMNS, Cell, DENSITY_COLUMNS, DENSITY_ROWS, ImportanceTable, ROWS, VIEW_ANGLES};
use crate::reflectance::ladder::Ladder;
use crate::reflectance::merl::{PHI_DIFF, THETA_DIFF, THETA_HALF};
use crate::reflectance::{LobeBandwidth, Model, bandwidth};
use half::f16;
use std::sync::Arc;

/// Importance tables one below the other: on every device, images may have 4096 rows.
const TABLES_A_COLUMN: usize = 64;

/// The tables of all ladders one after the other, on as many threads as there are processors: of what `fits` leave where there is one.
pub fn importance_tables(materials: &[Material], ladders: &[Ladder], fits: &[Option<&LobeFit>]) -> Vec<ImportanceTable> {
    let each = materials.iter().zip(ladders).zip(fits);
    let all: Vec<_> = each.flat_map(|((m, l), fit)| (0..l.steps()).map(move |i| (m, l, *fit, i))).collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let table = |&(m, l, fit, i): &(&Material, &Ladder, Option<&LobeFit>, usize)| match fit {
        Some(fit) => ImportanceTable::build_residual(&m.model, fit),
        None => l.table(m, i),
    };
    let build = |part: &[(&Material, &Ladder, Option<&LobeFit>, usize)]| part.iter().map(table).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let parts = all.chunks(all.len().div_ceil(threads).max(1));
        let running: Vec<_> = parts.map(|part| (part, scope.spawn(move || build(part)))).collect();
        running.into_iter().flat_map(|(part, thread)| thread.join().unwrap_or_else(|_| build(part))).collect()
    })
}

/// The lobes' bandwidths of all materials, one strip below the other; a table that several share is analysed
/// once, at threshold `eps`. With [`crate::Config::lobe_components`].
pub fn lobe_bandwidths(materials: &[Material], eps: f64, components: Option<u32>) -> Vec<f32> {
    let mut built: Vec<(&Model, Arc<LobeBandwidth>)> = Vec::new();
    let mut texels = Vec::with_capacity(materials.len() * bandwidth::WIDTH * bandwidth::SIDE);
    for Material { model, lobe_bandwidth, .. } in materials {
        let shared = built.iter().find(|(known, _)| same_table(known, model)).map(|(_, lobes)| lobes);
        let lobes = lobe_bandwidth.as_ref().or(shared).map_or_else(|| Arc::new(LobeBandwidth::build(model, eps)), Arc::clone);
        match components {
            Some(kept) => texels.extend_from_slice(lobes.compressed(kept as usize).0.texels()),
            None => texels.extend_from_slice(lobes.texels()),
        }
        built.push((model, lobes));
    }
    texels
}

/// Whether two models are one table.
pub fn same_table(a: &Model, b: &Model) -> bool {
    match (a, b) {
        (Model::Table(a), Model::Table(b)) => Arc::ptr_eq(a, b),
        (Model::Turned(a), Model::Turned(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

/// Packed tables (phi_d fastest, then theta_d, then theta_h) laid side by side in theta_d and theta_h.
pub fn tables(packed: &[Vec<u32>], [columns, rows]: [u32; 2]) -> Vec<u32> {
    let (columns, rows) = (columns as usize, rows as usize);
    let slice = THETA_DIFF * PHI_DIFF;
    let mut atlas = vec![0; columns * rows * slice * THETA_HALF];
    for (i, table) in packed.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        for (theta_h, texels) in table.chunks_exact(slice).enumerate() {
            let at = ((row * THETA_HALF + theta_h) * columns + column) * slice;
            atlas[at..at + slice].copy_from_slice(texels);
        }
    }
    atlas
}

/// Tables across and down.
fn grid(tables: usize) -> [usize; 2] {
    [tables.div_ceil(TABLES_A_COLUMN), tables.min(TABLES_A_COLUMN)]
}

/// Cells, and the extent of their image. A view angle's cells are one row of texels: what a pixel draws from lies together.
pub fn cells(tables: &[ImportanceTable]) -> (Vec<Cell>, [u32; 3]) {
    let [across, down] = grid(tables.len());
    let width = ROWS * COLUMNS;
    let mut out = vec![Cell::default(); across * width * VIEW_ANGLES * down];
    for (i, table) in tables.iter().enumerate() {
        let (column, place) = (i / TABLES_A_COLUMN, i % TABLES_A_COLUMN);
        for (angle, cells) in table.cells().chunks_exact(width).enumerate() {
            let at = ((place * VIEW_ANGLES + angle) * across + column) * width;
            out[at..at + width].copy_from_slice(cells);
        }
    }
    (out, [(across * width) as u32, (VIEW_ANGLES * down) as u32, 1])
}

/// Densities, and the extent of their image: tiles of a view angle each, side by side. Its sides are powers of two: coordinates
/// are exact, so that a clamp at a tile's edge keeps its neighbour out.
pub fn density(tables: &[ImportanceTable]) -> (Vec<f16>, [u32; 3]) {
    let [across, down] = grid(tables.len()).map(usize::next_power_of_two);
    let width = across * VIEW_ANGLES * DENSITY_COLUMNS;
    let mut out = vec![f16::ZERO; width * DENSITY_ROWS * down];
    for (i, table) in tables.iter().enumerate() {
        let (column, place) = (i / TABLES_A_COLUMN, i % TABLES_A_COLUMN);
        for (k, texels) in table.density_texels().chunks_exact(DENSITY_COLUMNS).enumerate() {
            let (angle, row) = (k / DENSITY_ROWS, k % DENSITY_ROWS);
            let at = (place * DENSITY_ROWS + row) * width + (column * VIEW_ANGLES + angle) * DENSITY_COLUMNS;
            out[at..at + DENSITY_COLUMNS].iter_mut().zip(texels).for_each(|(to, from)| *to = f16::from_f32(*from));
        }
    }
    (out, [width as u32, (DENSITY_ROWS * down) as u32, 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::Ggx;
    use glam::DVec3;

    #[test]
    fn every_tile_is_where_the_shaders_look() {
        let build = |alpha| ImportanceTable::build(&Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO });
        let (sharp, dull) = (build(0.1), build(0.6));
        // The last of them begins the second column.
        let mut tables = vec![dull.clone(); TABLES_A_COLUMN];
        tables.push(sharp.clone());
        let (cells, [width, height, _]) = super::cells(&tables);
        assert_eq!((cells.len(), [width, height]), ((width * height) as usize, [2048, 4096]));
        let (density, [across, down, _]) = super::density(&tables);
        assert_eq!((density.len(), [across, down]), ((across * down) as usize, [2048, 4096]));
        for (table, column, place) in [(&dull, 0, 3), (&sharp, 1, 0)] {
            for (angle, row, at) in [(0, 0, 0), (5, 7, 2), (63, 63, 15)] {
                let cell = cells[(place * 64 + angle) * 2048 + column * 1024 + row * 16 + at];
                assert_eq!(cell, table.cells()[(angle * 64 + row) * 16 + at]);
                let texel = density[(place * 64 + row) * 2048 + (column * 64 + angle) * 16 + at];
                assert_eq!(texel, f16::from_f32(table.density_texels()[(angle * 64 + row) * 16 + at]));
            }
        }
    }
}
