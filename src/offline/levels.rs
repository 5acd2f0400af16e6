//! What the last frame decided on levels of shading, read back (`glsl/include/levels.glsl` has the encodings).

use crate::frequency::allocation::Allocation;
use crate::offline::error::Result;
use crate::offline::session::Session;
use crate::plan::Directions;
use crate::{Config, Estimator};

/// The samples that were shaded: x, y and the level over a sample of the cell that each stands for. Pre-convolved light shades
/// all that are covered; residuals that are left out count as shaded.
///
/// # Errors
/// The device's, on read-back.
pub fn shaded(session: &mut Session) -> Result<Vec<([u32; 2], u32)>> {
    if session.config().is_some_and(|config| config.estimator == Estimator::Preconvolved) {
        let (bytes, _, [width, _]) = session.image("ids")?;
        let covered = (0..).zip(bytes.chunks_exact(4)).filter(|(_, id)| id.iter().any(|byte| *byte != 0));
        return Ok(covered.map(|(i, _): (u32, _)| ([i % width, i / width], 0)).collect());
    }
    let count = session.shaded()? as usize;
    let list = session.words("list")?;
    let levelled = session.levels().is_some_and(|levels| levels.top > 0);
    let entry = |word: &u32| {
        if levelled { ([word & 0x3fff, word >> 14 & 0x3fff], word >> 28) } else { ([word & 0xffff, word >> 16], 0) }
    };
    Ok(list.iter().take(count).map(entry).collect())
}

/// The samples that were shaded, each with the directions drawn for it.
///
/// # Errors
/// The device's, on read-back.
pub fn directions(session: &mut Session, config: &Config) -> Result<Vec<([u32; 2], u32)>> {
    let (environment, area_lights) = session.sources();
    if config.allocation == Allocation::Constant {
        let all = Directions::of(config, environment, area_lights);
        let shaded = shaded(session)?.into_iter();
        return Ok(shaded.map(|(sample, level)| (sample, all.at(level, config).total(area_lights))).collect());
    }
    let total = |n| Directions::split(config, n, environment, area_lights).total(area_lights);
    let count = session.shaded()? as usize;
    let list = session.words("allocated")?;
    let entry = |words: &[u32]| Some(([words.first()? & 0x3fff, words.first()? >> 14 & 0x3fff], total(*words.get(1)?)));
    Ok(list.chunks_exact(2).take(count).filter_map(entry).collect())
}

/// For each sample, row by row, the coarsest level over a sample whose cell around it has a value; 0 where none has one.
///
/// # Errors
/// The device's, on read-back.
pub fn coarsest(session: &mut Session) -> Result<Vec<u32>> {
    let Some(levels) = session.levels() else { return Ok(Vec::new()) };
    let [width, height] = levels.extents.first().copied().unwrap_or_default();
    let mut all = vec![0; width as usize * height as usize];
    // Without blocks nothing is coarser than a sample, and the cells are those of another frame.
    if levels.top == 0 || session.words("block arguments")?.get(3) == Some(&0) {
        return Ok(all);
    }
    let cells = session.words("cells")?;
    for (i, found) in all.iter_mut().enumerate() {
        let [x, y] = [i as u32 % width, i as u32 / width];
        for (l, [columns, _]) in (0u32..).zip(&levels.extents).skip(1) {
            let cell = levels.cells_below(l) + u64::from(y >> l) * u64::from(*columns) + u64::from(x >> l);
            let least = cells.get(2 * cell as usize).map_or(7, |word| word & 7);
            if (l..7).contains(&least) {
                *found = l;
            }
        }
    }
    Ok(all)
}

/// For each sample, row by row, the valid share of its parents' weight; 0 where parents were not asked for.
///
/// # Errors
/// The device's, on read-back.
pub fn weights(session: &mut Session) -> Result<Vec<f32>> {
    let Some(levels) = session.levels() else { return Ok(Vec::new()) };
    let [width, height] = levels.extents.first().copied().unwrap_or_default();
    let mut all = vec![0.0; width as usize * height as usize];
    if levels.top == 0 {
        return Ok(all);
    }
    let count = session.words("block arguments")?.get(7).copied().unwrap_or(0) as usize;
    let (blocks, weights) = (session.words("blocks")?, session.words("weights")?);
    for (block, words) in blocks.chunks_exact(2).zip(weights.chunks_exact(4)).take(count) {
        for (k, word) in (0u32..).zip(words) {
            let [x, y] = [(block[0] & 0xffff) * 2 + k % 2, (block[0] >> 16) * 2 + k / 2];
            if x < width && y < height {
                all[(y * width + x) as usize] = (word >> 24 & 63) as f32 / 63.0;
            }
        }
    }
    Ok(all)
}
