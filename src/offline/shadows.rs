//! Masks of a world's lights: how much of each arrives at each pixel of its camera's image.

use crate::offline::error::{At, Error, Result};
use crate::offline::texture::Image;
use std::path::Path;

/// Factors on lights, in the order of [`crate::offline::world::World::lights`]; those beyond the last layer are unshadowed.
#[derive(Clone, Debug, PartialEq)]
pub struct Shadows {
    /// Width and height in pixels, those of the images that are rendered.
    pub extent: [u32; 2],
    /// Row by row from the top; finite and not negative.
    pub layers: Vec<Vec<f32>>,
}

impl Shadows {
    /// The first channel of each of `files`, as it is stored; what has none is unshadowed. `None` if none has one.
    ///
    /// # Errors
    /// [`Error::File`] for a file that is no image, of another size than the first, or with values that are no factors.
    pub fn read<'a>(files: impl IntoIterator<Item = Option<&'a Path>>) -> Result<Option<Self>> {
        let mut found: Option<Self> = None;
        let mut unshadowed = 0;
        for file in files {
            let Some(path) = file else {
                unshadowed += 1;
                continue;
            };
            let image = Image::read(path)?;
            let shadows = found.get_or_insert_with(|| Self { extent: image.size(), layers: Vec::new() });
            if image.size() != shadows.extent {
                let expected = format!("{:?}, as the masks of other lights", shadows.extent);
                return Err(Error::file(path, At::File, "size", expected, format!("{:?}", image.size())));
            }
            let [width, height] = image.size().map(|side| side as usize);
            let values: Vec<f32> = (0..width * height).map(|i| image.raw(i).x).collect();
            if let Some(i) = values.iter().position(|v| !v.is_finite() || *v < 0.0) {
                let field = format!("pixel {}, {}", i % width, i / width);
                return Err(Error::file(
                    path,
                    At::File,
                    field,
                    "a finite factor >= 0",
                    values.get(i).copied().unwrap_or_default(),
                ));
            }
            let none = std::iter::repeat_n(vec![1.0; values.len()], std::mem::take(&mut unshadowed));
            shadows.layers.extend(none.chain([values]));
        }
        Ok(found)
    }
}
