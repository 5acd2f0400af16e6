//! Images of a figure: photographs, maps in false colour, and details of them.

use crate::offline::image_io::LinearImage;
use crate::offline::metrics::{FlipMap, Picture, encode};
use crate::sampling::luminance;
use glam::DVec3;

/// Where nothing is known or seen.
const NOTHING: [u8; 3] = [120, 120, 120];
/// From level -2 (a sixteenth of a pixel) to 5: fine ones warm, coarse ones cold and dark.
const LEVELS: [[u8; 3]; 8] =
    [[255, 255, 255], [255, 225, 90], [240, 120, 50], [190, 50, 80], [110, 50, 140], [50, 80, 170], [40, 60, 110], [20, 30, 60]];
/// Those that frames have by default, in words.
pub const KEY: &str = "-2 white, -1 yellow, 0 orange, 1 red, 2 violet, 3 blue";
/// What is done at a pixel about what lobes miss, in words.
pub const DECISIONS: &str = "black: nothing, white: up-sampled\nshaded for a pixel orange, 2x2 red, 4x4 violet, 8x8 blue";
/// Level of the first colour.
const FINEST: f32 = -2.0;
/// What small differences are multiplied with.
pub const GAIN: f64 = 4.0;

/// A labelled image.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// What it is, in one line or two.
    pub label: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row-major bytes, sRGB.
    pub rgb: Vec<[u8; 3]>,
}

impl Tile {
    /// The corner of the part of 1/`parts` of each side in which neighbours differ most.
    pub fn busiest(&self, parts: usize) -> [usize; 2] {
        let [width, height] = [self.width, self.height].map(|e| e as usize);
        let [w, h] = [width, height].map(|e| (e / parts).max(1));
        let value = |x: usize, y: usize| self.rgb.get(y * width + x).map_or(0, |c| c.iter().map(|b| i64::from(*b)).sum::<i64>());
        let contrast = |[left, top]: [usize; 2]| -> i64 {
            let pixels = (0..w * h).map(|i| [left + i % w, top + i / w]);
            pixels.map(|[x, y]| (value(x, y) - value(x + 1, y)).abs() + (value(x, y) - value(x, y + 1)).abs()).sum()
        };
        let steps = 2 * parts - 1;
        let corners = (0..steps * steps).map(|i| [i % steps * w / 2, i / steps * h / 2]);
        corners.filter(|[x, y]| x + w < width && y + h < height).max_by_key(|c| contrast(*c)).unwrap_or_default()
    }

    /// The part of 1/`parts` of each side at `corner`, as large as the whole.
    pub fn detail(&self, corner: [usize; 2], parts: usize) -> Self {
        let (width, height) = (self.width as usize, self.height as usize);
        let at = |i: usize| {
            let [x, y] = [corner[0] + i % width / parts, corner[1] + i / width / parts];
            self.rgb.get(y.min(height - 1) * width + x.min(width - 1)).copied().unwrap_or(NOTHING)
        };
        Self { label: self.label.clone(), rgb: (0..width * height).map(at).collect(), ..*self }
    }

    fn of(label: String, image: &LinearImage, rgb: impl Iterator<Item = [u8; 3]>) -> Self {
        Self { label, width: image.width, height: image.height, rgb: rgb.collect() }
    }
}

fn byte(value: f64) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// `picture` as displayed.
pub fn photograph(label: String, picture: &Picture, exposure: f64) -> Tile {
    let rgb = picture.rgb.iter().map(|c| c.map(|v| byte(encode(f64::from(v) * exposure))));
    Tile { label, width: picture.width, height: picture.height, rgb: rgb.collect() }
}

/// How far two pictures are apart as displayed, channel by channel, multiplied with `gain`.
pub fn difference(label: String, [a, b]: [&Picture; 2], exposure: f64, gain: f64) -> Tile {
    let shown = |v: f32| encode(f64::from(v) * exposure);
    let apart = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| byte(gain * (shown(a[c]) - shown(b[c])).abs()));
    Tile { label, width: a.width, height: a.height, rgb: a.rgb.iter().zip(&b.rgb).map(apart).collect() }
}

/// A layer from dark at 0 to bright at `most`; grey where it is not a number.
pub fn heat(label: String, image: &LinearImage, channel: &str, most: f64) -> Tile {
    let layer = image.channel(channel).unwrap_or_default();
    let values = layer.iter().map(|v| (f64::from(*v) / most).clamp(0.0, 1.0) as f32).map(|v| if v.is_nan() { 0.0 } else { v });
    let map = FlipMap { width: image.width, height: image.height, values: values.collect() }.magma();
    let colour = |(colour, value): (&[u8; 3], &f32)| if value.is_nan() { NOTHING } else { *colour };
    Tile::of(label, image, map.as_chunks::<3>().0.iter().zip(layer).map(colour))
}

/// The layer `level`, a colour a level; grey where nothing is seen.
pub fn levels(label: String, image: &LinearImage) -> Tile {
    let layers = [image.channel("level.Y"), image.channel("A")].map(Option::unwrap_or_default);
    let colour = |(level, covered): (&f32, &f32)| match *covered > 0.0 {
        true => LEVELS.get((level - FINEST).max(0.0) as usize).copied().unwrap_or(LEVELS[7]),
        false => NOTHING,
    };
    Tile::of(label, image, layers[0].iter().zip(layers[1]).map(colour))
}

/// The layer `decision`: [`DECISIONS`]; grey where nothing is seen.
pub fn decisions(label: String, image: &LinearImage) -> Tile {
    let layer = image.channel("decision.Y").unwrap_or_default();
    let colour = |decision: &f32| match *decision as i32 {
        ..0 => NOTHING,
        0 => [0; 3],
        1 => [255; 3],
        // Two levels below a pixel's are the first colour, two codes above nothing the first level.
        level => LEVELS.get(level as usize).copied().unwrap_or(LEVELS[7]),
    };
    Tile::of(label, image, layer.iter().map(colour))
}

/// By how much the luminance of `a` is above that of `b` as displayed, from `-most` (blue) over 0 (black) to `most` (orange).
pub fn signed(label: String, [a, b]: [&Picture; 2], exposure: f64, most: f64) -> Tile {
    let shown = |rgb: &[f32; 3]| encode((exposure * luminance(DVec3::from(rgb.map(f64::from)))).max(0.0));
    let colour = |(a, b): (&[f32; 3], &[f32; 3])| {
        let along = ((shown(a) - shown(b)) / most).clamp(-1.0, 1.0);
        let end = if along < 0.0 { [0.35, 0.65, 1.0] } else { [1.0, 0.6, 0.2] };
        end.map(|c| byte(c * along.abs().sqrt()))
    };
    Tile { label, width: a.width, height: a.height, rgb: a.rgb.iter().zip(&b.rgb).map(colour).collect() }
}

/// White where a layer is above 0; grey where nothing is seen.
pub fn mask(label: String, image: &LinearImage, channel: &str) -> Tile {
    let layers = [image.channel(channel), image.channel("A")].map(Option::unwrap_or_default);
    let colour = |(value, covered): (&f32, &f32)| match (*value > 0.0, *covered > 0.0) {
        (true, _) => [255; 3],
        (false, true) => [0; 3],
        (false, false) => NOTHING,
    };
    Tile::of(label, image, layers[0].iter().zip(layers[1]).map(colour))
}

/// The median of a layer over the only layer `Y` of `measured`, where the former is above 0 and the latter above `least`.
pub fn covered_median(predicted: &LinearImage, channel: &str, measured: &LinearImage, least: f64) -> Option<f64> {
    let (predicted, measured) = (predicted.channel(channel)?, measured.channel("Y")?);
    let both = predicted.iter().zip(measured).filter(|(p, m)| **p > 0.0 && f64::from(**m) > least);
    let mut ratios: Vec<f64> = both.map(|(p, m)| f64::from(*p) / f64::from(*m)).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(channels: &[(&str, &[f32])]) -> LinearImage {
        let channels = channels.iter().map(|(name, values)| (name.to_string(), values.to_vec())).collect();
        LinearImage { width: 2, height: 2, channels }
    }

    #[test]
    fn maps_are_grey_where_nothing_is_known() {
        let image =
            layers(&[("A", &[1.0, 1.0, 0.0, 1.0]), ("level.Y", &[-2.0, 0.0, 0.0, 5.0]), ("Y", &[0.0, 2.0, f32::NAN, 1.0])]);
        let name = String::new;
        assert_eq!(levels(name(), &image).rgb, [LEVELS[0], LEVELS[2], NOTHING, LEVELS[7]]);
        assert_eq!(mask(name(), &image, "Y").rgb, [[0; 3], [255; 3], NOTHING, [255; 3]]);
        let hot = heat(name(), &image, "Y", 2.0).rgb;
        let sum = |i: usize| hot[i].iter().map(|b| u32::from(*b)).sum::<u32>();
        assert!(hot[2] == NOTHING && sum(0) < 20 && sum(0) < sum(3) && sum(3) < sum(1), "{hot:?}");
        assert_eq!(covered_median(&layers(&[("level.Y", &[3.0; 4])]), "level.Y", &image, 1.5), Some(1.5));
        assert_eq!(covered_median(&image, "level.Y", &layers(&[]), 0.0), None);
    }

    #[test]
    fn decisions_have_a_colour_each_and_differences_a_sign() {
        let image = layers(&[("decision.Y", &[-1.0, 0.0, 1.0, 5.0])]);
        assert_eq!(decisions(String::new(), &image).rgb, [NOTHING, [0; 3], [255; 3], LEVELS[5]]);
        let grey = |v: [f32; 4]| Picture { width: 2, height: 2, rgb: v.iter().map(|v| [*v; 3]).collect() };
        let (a, b) = (grey([0.5, 0.1, 0.5, 0.5]), grey([0.5, 0.5, 0.1, 0.45]));
        let tile = signed(String::new(), [&a, &b], 1.0, 0.2);
        let [same, less, more, some] = tile.rgb[..] else { panic!("{tile:?}") };
        assert!(same == [0; 3] && less[2] == 255 && less[0] < less[2] && more[0] == 255 && more[2] < more[0], "{tile:?}");
        assert!(some[0] > 0 && some[0] < 255, "{some:?}");
    }

    #[test]
    fn details_are_where_the_picture_is_busy() {
        let rgb = |i: usize| [if i % 64 > 40 && i / 64 > 40 { ((i % 64 + i / 64) % 2 * 255) as u8 } else { 9 }; 3];
        let tile = Tile { label: "x".into(), width: 64, height: 64, rgb: (0..64 * 64).map(rgb).collect() };
        let corner = tile.busiest(4);
        assert_eq!(corner, [40, 40]);
        let detail = tile.detail(corner, 4);
        assert_eq!((detail.rgb.len(), detail.rgb[0], detail.rgb[4 * 64 + 4]), (64 * 64, tile.rgb[40 * 65], tile.rgb[41 * 65]));
    }
}
