//! OpenEXR, through the `exr` crate.

use crate::offline::error::{At, Error, Result};
use crate::offline::image_io::{LinearImage, write_atomically};
use crate::offline::input;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// Row-major RGB texels with their width and height.
pub(crate) type RgbTexels = (u32, u32, Vec<[f32; 3]>);

/// Writes all channels of `image` as one part, 32-bit float, ZIP compressed in blocks of 16 rows.
///
/// # Errors
/// [`Error::Argument`] if the channels do not fit the size, [`Error::Write`] if the file cannot be written.
pub fn write_exr(path: &Path, image: &LinearImage) -> Result<()> {
    image.check()?;
    let channels = image.channels.iter();
    let channels = channels.map(|(name, samples)| AnyChannel::new(name.as_str(), FlatSamples::F32(samples.clone())));
    let encoding = Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new(
        (image.width as usize, image.height as usize),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(channels.collect()),
    );
    let file = Image::from_layer(layer);
    write_atomically(path, |sink| file.write().to_buffered(sink))
}

/// Reads every channel of every part as 32-bit float; a named part's channels get its name and a dot in front.
/// Only the data window is read; all parts must have the same size.
///
/// # Errors
/// [`Error::File`] if it is unreadable, malformed, holds deep data or sub-sampled channels, or is larger than 16384 x 16384.
pub fn read_exr(path: &Path) -> Result<LinearImage> {
    let bytes = input::read(path)?;
    let headers = headers(path, &bytes)?;
    let size = headers.first().map(|h| h.layer_size).unwrap_or_default();
    for header in &headers {
        check_header(path, header, bytes.len(), [input::MAX_SIDE; 2])?;
        if header.layer_size != size {
            let got = format!("{}x{}", header.layer_size.width(), header.layer_size.height());
            let expected = format!("{}x{}, as the first part", size.width(), size.height());
            return Err(Error::file(path, At::File, "EXR part size", expected, got));
        }
    }
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes().non_parallel();
    let file = guarded(path, || reader.from_buffered(Cursor::new(&bytes)))?;
    let several = file.layer_data.len() > 1;
    let mut channels = Vec::new();
    for layer in file.layer_data {
        let part = layer.attributes.layer_name.filter(|_| several).map(|n| format!("{n}.")).unwrap_or_default();
        for channel in layer.channel_data.list {
            let samples = match channel.sample_data {
                FlatSamples::F32(samples) => samples,
                FlatSamples::F16(samples) => samples.iter().map(|v| v.to_f32()).collect(),
                FlatSamples::U32(samples) => samples.iter().map(|v| *v as f32).collect(),
            };
            // Multi-part files often repeat the part's name in the channel's.
            let name = channel.name.to_string();
            let name = if name.starts_with(&part) { name } else { part.clone() + &name };
            channels.push((name, samples));
        }
    }
    Ok(LinearImage { width: size.width() as u32, height: size.height() as u32, channels })
}

/// Reads channels `R G B` (or a lone `Y` as grey) of the first part that has them, and nothing else.
///
/// # Errors
/// [`Error::File`] as for [`read_exr`], or if neither set of channels is there, or if the size is above `max`.
pub(crate) fn read_rgb(path: &Path, max: [u64; 2]) -> Result<RgbTexels> {
    let bytes = input::read(path)?;
    let headers = headers(path, &bytes)?;
    let with = |wanted: &[&str]| {
        let has = |h: &Header, name: &&str| h.channels.list.iter().any(|c| c.name == **name);
        headers.iter().find(|h| !h.deep && wanted.iter().all(|name| has(h, name)))
    };
    let (header, grey) = match (with(&["R", "G", "B"]), with(&["Y"])) {
        (Some(header), _) => (header, false),
        (None, Some(header)) => (header, true),
        (None, None) => {
            let names = headers.iter().flat_map(|h| &h.channels.list).map(|c| c.name.to_string());
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(Error::file(path, At::File, "EXR channels", "R, G and B, or Y, of one flat part", names));
        }
    };
    check_header(path, header, bytes.len(), max)?;
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let new = move |_, _: &_| vec![[0.0; 3]; width * height];
    let source = Cursor::new(&bytes);
    let flat = read().no_deep_data().largest_resolution_level();
    // `put` stays within `new`: the crate only passes positions inside the part that it announced.
    let put = move |texels: &mut Vec<[f32; 3]>, at: Vec2<usize>, value: [f32; 3]| {
        if let Some(texel) = texels.get_mut(at.y() * width + at.x()) {
            *texel = value;
        }
    };
    let texels = guarded(path, || {
        if grey {
            let new = move |size, _: &(ChannelDescription,)| new(size, &());
            let channels = flat.specific_channels().required("Y");
            let channels = channels.collect_pixels(new, move |texels, at, (y,): (f32,)| put(texels, at, [y; 3]));
            let image = channels.first_valid_layer().all_attributes().non_parallel().from_buffered(source)?;
            Ok(image.layer_data.channel_data.pixels)
        } else {
            let new = move |size, _: &RgbChannels| new(size, &());
            let channels = flat.specific_channels().required("R").required("G").required("B");
            let channels = channels.collect_pixels(new, move |texels, at, (r, g, b): (f32, f32, f32)| put(texels, at, [r, g, b]));
            let image = channels.first_valid_layer().all_attributes().non_parallel().from_buffered(source)?;
            Ok(image.layer_data.channel_data.pixels)
        }
    })?;
    Ok((width as u32, height as u32, texels))
}

/// Runs the decoder. On damaged tiled and B44 files it can trip over its own assertions (found by changing bytes at random):
/// that is one more way to be malformed, not a reason to stop the process. The decoder must stay on this thread: what
/// trips in its own thread pool ends the process.
fn guarded<T>(path: &Path, decode: impl FnOnce() -> exr::error::Result<T>) -> Result<T> {
    let inconsistent = || Err(exr::error::Error::Invalid("inconsistent blocks".into()));
    input::caught(decode).unwrap_or_else(inconsistent).map_err(|e| malformed(path, e))
}

fn headers(path: &Path, bytes: &[u8]) -> Result<Vec<Header>> {
    Ok(guarded(path, || MetaData::read_from_buffered(Cursor::new(bytes), false))?.headers.into_vec())
}

/// Refuses what we do not read, and sizes that the file cannot hold, before anything is allocated.
fn check_header(path: &Path, header: &Header, length: usize, max: [u64; 2]) -> Result<()> {
    input::check_size(path, [header.layer_size.width() as u64, header.layer_size.height() as u64], max)?;
    if header.deep {
        return Err(Error::file(path, At::File, "EXR part", "flat pixels", "deep data"));
    }
    if let Some(channel) = header.channels.list.iter().find(|c| c.sampling != Vec2(1, 1)) {
        let got = format!("{}x{}", channel.sampling.x(), channel.sampling.y());
        return Err(Error::file(path, At::File, format!("EXR channel {}", channel.name), "sampling 1x1", got));
    }
    let pixels = (header.layer_size.width() as u64).saturating_mul(header.layer_size.height() as u64);
    let raw = pixels.saturating_mul(header.channels.bytes_per_pixel as u64);
    // Deflate reaches 1032:1 and the other codecs less; only DWA has no useful bound on flat images.
    let ratio = match header.compression {
        Compression::Uncompressed => 1,
        Compression::DWAA(_) | Compression::DWAB(_) => u64::MAX,
        _ => input::DEFLATE_RATIO,
    };
    // Each block has an eight-byte entry in the offset table.
    let least = (raw / ratio).max((header.chunk_count as u64).saturating_mul(8));
    if (length as u64) < least {
        let expected = format!("at least {least} bytes for {}x{}", header.layer_size.width(), header.layer_size.height());
        return Err(Error::file(path, At::File, "EXR length", expected, format!("{length} bytes")));
    }
    Ok(())
}

fn malformed(path: &Path, e: exr::error::Error) -> Error {
    Error::file(path, At::File, "EXR", "a well-formed OpenEXR image", e)
}
