//! Levels by the contrast of the frame before, tile by tile: Yang et al. 2019, "Visually Lossless Content and Motion Adaptive
//! Shading in Games", without motion, as nothing moves between the two frames. It cannot tell noise from detail, nor what a
//! coarsely shaded tile hides. Twin of `glsl/luminance/`.

use crate::sampling::luminance;
use glam::DVec3;

/// The coarsest level, of a quarter of the pixels a side.
pub const COARSEST: u32 = 2;
/// Output pixels a side of a tile.
pub const TILE: usize = 8;
/// The error that is not noticed, as a share of a tile's mean luminance. Of 0.03 to 0.3 this is where the torus knot, the bumpy
/// sphere and the trio, at 64 directions and 256x256 pixels, come to about 40 to 50 dB in reconstruction, as by bandwidth.
pub const NOTICEABLE: f64 = 0.15;
/// Added to a tile's mean luminance, as a share of the image's: dark tiles stay coarse.
pub const AMBIENT: f64 = 0.05;
/// The error of a quarter of the pixels a side over that of half of them (Yang et al. 2019, at rest).
const QUARTER: f64 = 2.13;

/// The level of each sample, row by row, in levels over a sample: 0 in tiles that need all of their samples, else those of 2x2
/// or 4x4 output pixels. `previous` is the frame before, linear radiance and coverage of `extent` output pixels, row by row;
/// each has `side` samples a side. `noticeable` is as [`NOTICEABLE`].
pub fn levels(previous: &[[f32; 4]], extent: [u32; 2], side: u32, noticeable: f64) -> Vec<u8> {
    let [width, height] = extent.map(|e| e as usize);
    let value = |&[r, g, b, _]: &[f32; 4]| luminance(DVec3::new(r.into(), g.into(), b.into()));
    let image: Vec<f64> = previous.iter().map(value).collect();
    let covered: f64 = previous.iter().map(|p| f64::from(p[3])).sum();
    let ambient = AMBIENT * image.iter().sum::<f64>() / covered.max(1.0);
    let columns = width.div_ceil(TILE);
    let tile = |i: usize| tile_level(&image, [width, height], [i % columns * TILE, i / columns * TILE], ambient, noticeable);
    let tiles: Vec<u8> = (0..columns * height.div_ceil(TILE)).map(tile).collect();
    let (side, pixel) = (side as usize, side.ilog2() as u8);
    let at = |i: usize| {
        let [x, y] = [i % (width * side), i / (width * side)].map(|p| p / side / TILE);
        let level = tiles[y * columns + x];
        if level == 0 { 0 } else { level + pixel }
    };
    (0..width * height * side * side).map(at).collect()
}

/// Of the tile that begins at `first`: 0, 1 or 2.
fn tile_level(image: &[f64], [width, height]: [usize; 2], first: [usize; 2], ambient: f64, noticeable: f64) -> u8 {
    let (mut sum, mut count, mut squares) = (0.0, 0.0, [0.0; 2]);
    for y in first[1]..(first[1] + TILE).min(height) {
        for x in first[0]..(first[0] + TILE).min(width) {
            let here = image[y * width + x];
            let [right, down] =
                [y * width + (x + 1).min(width - 1), (y + 1).min(height - 1) * width + x].map(|i| image[i] - here);
            squares[0] += right * right;
            squares[1] += down * down;
            sum += here;
            count += 1.0;
        }
    }
    // Half of the difference of the two pixels that become one; cells are square, so that the worse direction counts.
    let error = 0.5 * (squares[0].max(squares[1]) / count).sqrt();
    let unseen = noticeable * (sum / count + ambient);
    if error * QUARTER <= unseen {
        2
    } else if error <= unseen {
        1
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_tiles_are_coarse_and_contrasty_ones_fine() {
        let extent = [41, 27];
        // From left to right: flat, a slope that half the pixels show, stripes; black below.
        let value = |x: usize, y: usize| match (x / TILE, y / TILE) {
            (_, 2..) => 0.0,
            (0, _) => 0.5,
            (1..=2, _) => 0.5 * 1.2f32.powi(x as i32 - 7),
            _ => (x % 2) as f32,
        };
        let image: Vec<_> =
            (0..41 * 27).map(|i| [[value(i % 41, i / 41); 3].as_slice(), &[1.0]].concat().try_into().unwrap()).collect();
        let of = |levels: &[u8], side: usize, x: usize, y: usize| levels[y * side * 41 * side + x * side];
        let found = levels(&image, extent, 1, NOTICEABLE);
        assert_eq!(found.len(), 41 * 27);
        assert_eq!([0, 9, 33].map(|x| of(&found, 1, x, 3)), [2, 1, 0]);
        assert_eq!(of(&found, 1, 20, 26), 2, "nothing is to be seen");
        // Four samples a pixel: tiles of as many output pixels, levels over a sample.
        let found = levels(&image, extent, 2, NOTICEABLE);
        assert_eq!(found.len(), 4 * 41 * 27);
        assert_eq!([0, 9, 33].map(|x| of(&found, 2, x, 3)), [3, 2, 0]);
    }

    #[test]
    fn exposure_does_not_matter() {
        let image: Vec<[f32; 4]> = (0..64 * 64u32)
            .map(|i| [[(i * i % 97) as f32 / (1 + i / 500) as f32; 3].as_slice(), &[1.0]].concat().try_into().unwrap())
            .collect();
        let brighter: Vec<_> = image.iter().map(|[r, g, b, a]| [r * 64.0, g * 64.0, b * 64.0, *a]).collect();
        assert_eq!(levels(&image, [64, 64], 1, NOTICEABLE), levels(&brighter, [64, 64], 1, NOTICEABLE));
    }
}
