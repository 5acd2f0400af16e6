//! Image and environment files: what is written reads back, and what is malformed is refused without a panic.
#![cfg(feature = "offline")]

use exr::prelude::{f16, *};
use passband::offline::environment;
use passband::offline::error::{At, Error};
use passband::offline::image_io::*;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

type Outcome<T> = std::result::Result<T, Error>;

fn assert_refused<T>(outcome: Outcome<T>, what: &str) -> String {
    let Err(e) = outcome else { panic!("{what} was accepted") };
    let message = e.to_string();
    assert!(matches!(e, Error::File { .. }) && !message.contains('\n'), "{what}: {message}");
    message
}

fn layered(width: u32, height: u32) -> LinearImage {
    let n = (width * height) as usize;
    let names = ["R", "G", "B", "A", "normal.X", "normal.Y", "normal.Z", "depth.Z", "level.Y"];
    let plane = |c: usize| (0..n).map(|i| (i as f32 * 0.37 + c as f32).sin() * 10.0).collect();
    let channels = names.iter().enumerate().map(|(c, name)| (name.to_string(), plane(c))).collect();
    LinearImage { width, height, channels }
}

fn rgb_image(width: u32, height: u32, rgb: impl Fn(usize) -> [f32; 3]) -> LinearImage {
    let n = (width * height) as usize;
    let plane = |c: usize| (0..n).map(|i| rgb(i)[c]).collect();
    LinearImage { width, height, channels: vec![("R".into(), plane(0)), ("G".into(), plane(1)), ("B".into(), plane(2))] }
}

#[test]
fn exr_layers_read_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    for (w, h) in [(1, 1), (7, 33), (64, 17)] {
        let path = folder.path().join("layers.exr");
        let image = layered(w, h);
        write_exr(&path, &image).unwrap();
        let back = read_exr(&path).unwrap();
        assert_eq!((back.width, back.height, back.channels.len()), (w, h, image.channels.len()));
        for (name, samples) in &image.channels {
            assert_eq!(back.channel(name), Some(samples.as_slice()), "{name}");
        }
    }
    let first = std::fs::read(folder.path().join("layers.exr")).unwrap();
    write_exr(&folder.path().join("again.exr"), &layered(64, 17)).unwrap();
    assert_eq!(first, std::fs::read(folder.path().join("again.exr")).unwrap(), "the same image is the same file");
}

#[test]
fn parts_get_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    let part = |name: &str, channel: &str| {
        let channels =
            AnyChannels::sort([AnyChannel::new(channel, FlatSamples::F16(vec![f16::from_f32(0.5); 6]))].into_iter().collect());
        Layer::new((3, 2), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let image = Image::from_layers(ImageAttributes::with_size((3, 2)), vec![part("a", "R"), part("b", "b.Z")]);
    image.write().to_file(&path).unwrap();
    let back = read_exr(&path).unwrap();
    assert_eq!(back.channels.iter().map(|c| c.0.as_str()).collect::<Vec<_>>(), ["a.R", "b.Z"]);
    assert_eq!(back.channels[0].1, [0.5; 6]);
}

#[test]
fn hdr_reads_back_to_its_precision() {
    let folder = tempfile::tempdir().unwrap();
    for (w, h) in [(1, 1), (7, 5), (40, 9)] {
        let path = folder.path().join("x.hdr");
        let image = rgb_image(w, h, |i| [1e-3 * i as f32, 7.0 + i as f32, if i % 2 == 0 { -1.0 } else { 3e4 }]);
        write_hdr(&path, &image).unwrap();
        let (wrote, back) = (image.rgb().unwrap(), read_hdr(&path).unwrap().rgb().unwrap());
        for (a, b) in wrote.iter().zip(&back) {
            let step = a.iter().fold(0.0_f32, |m, c| m.max(*c)) / 128.0;
            assert!(a.iter().zip(b).all(|(a, b)| (a.max(0.0) - b).abs() <= step), "{a:?} {b:?}");
        }
    }
    let no_green = LinearImage { width: 1, height: 1, channels: vec![("R".into(), vec![1.0])] };
    assert!(matches!(write_hdr(&folder.path().join("y.hdr"), &no_green), Err(Error::Argument { .. })));
    let nan = rgb_image(1, 1, |_| [f32::NAN; 3]);
    assert!(matches!(write_hdr(&folder.path().join("y.hdr"), &nan), Err(Error::Argument { .. })));
    assert!(!folder.path().join("y.hdr").exists());
}

#[test]
fn hdr_exposure_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.hdr");
    let with = |header: &str| {
        let head = format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n");
        std::fs::write(&path, [head.as_bytes(), &[128, 64, 32, 129]].concat()).unwrap();
        read_hdr(&path).map(|image| image.rgb().unwrap()[0])
    };
    assert_eq!(with("").unwrap(), [1.0, 0.5, 0.25]);
    assert_eq!(with("EXPOSURE=2\nEXPOSURE=2\n").unwrap(), [0.25, 0.125, 0.0625]);
    assert!(assert_refused(with("EXPOSURE=0\n"), "zero exposure").contains("EXPOSURE"));
}

#[test]
fn png_keeps_its_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.png");
    let bytes: Vec<u8> = (0..5 * 3 * 4).map(|i| (i * 7) as u8).collect();
    write_png(&path, 5, 3, &bytes).unwrap();
    let png = read_png(&path).unwrap();
    assert_eq!(png, Png { width: 5, height: 3, channels: 4, samples: PngSamples::Bits8(bytes) });
    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_vec(2, 1, vec![1, 2, 3, 40_000, 50_000, 65_535]).unwrap();
    deep.save_with_format(&path, image::ImageFormat::Png).unwrap();
    let png = read_png(&path).unwrap();
    assert_eq!((png.channels, png.samples), (3, PngSamples::Bits16(vec![1, 2, 3, 40_000, 50_000, 65_535])));
    for (w, h, n) in [(5, 3, 59), (0, 3, 0), (u32::MAX, u32::MAX, 4)] {
        assert!(matches!(write_png(&path, w, h, &vec![0; n]), Err(Error::Argument { .. })));
    }
}

#[test]
fn the_extension_picks_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let image = layered(4, 4);
    for (name, magic) in [("a.exr", &b"\x76\x2f\x31\x01"[..]), ("a.PNG", b"\x89PNG"), ("a.hdr", b"#?RADIANCE")] {
        let path = folder.path().join(name);
        write_image(&path, &image, &[7; 64]).unwrap();
        assert!(std::fs::read(&path).unwrap().starts_with(magic), "{name}");
    }
    for name in ["a", "a.jpg", "a.exr.tmp"] {
        let e = write_image(&folder.path().join(name), &image, &[7; 64]).unwrap_err();
        assert!(matches!(e, Error::Argument { .. }), "{e}");
        assert!(!folder.path().join(name).exists());
    }
    assert!(matches!(read_image(Path::new("a.png")), Err(Error::Argument { .. })));
    assert_eq!(read_image(&folder.path().join("a.exr")).unwrap().channels.len(), 9);
}

#[test]
fn images_that_do_not_fit_are_refused() {
    let one = |name: &str, n| (name.to_string(), vec![0.0; n]);
    let path = Path::new("never-written.exr");
    for (w, h, channels) in [
        (2, 2, vec![one("R", 3)]),
        (2, 2, vec![one("R", 4), one("R", 4)]),
        (2, 2, vec![one("", 4)]),
        (2, 2, vec![]),
        (0, 2, vec![one("R", 0)]),
        (16_385, 1, vec![one("R", 16_385)]),
    ] {
        let e = write_exr(path, &LinearImage { width: w, height: h, channels }).unwrap_err();
        assert!(matches!(e, Error::Argument { .. }) && !path.exists(), "{e}");
    }
}

#[test]
fn failed_writes_leave_nothing_and_keep_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let count = || std::fs::read_dir(folder.path()).unwrap().count();
    let image = layered(4, 4);
    let e = write_image(&folder.path().join("no/such/folder/a.exr"), &image, &[0; 64]).unwrap_err();
    assert!(matches!(&e, Error::Write { .. }) && !e.to_string().contains('\n'), "{e}");
    std::fs::create_dir(folder.path().join("a.png")).unwrap();
    let e = write_image(&folder.path().join("a.png"), &image, &[0; 64]).unwrap_err();
    assert!(matches!(e, Error::Write { .. }), "{e}");
    let old = folder.path().join("old.txt");
    std::fs::write(&old, "old").unwrap();
    let half = |file: &mut BufWriter<&File>| file.write_all(b"half").and(Err(std::io::Error::other("the disk\nis full")));
    let e = write_atomically(&old, half).unwrap_err();
    assert!(e.to_string().ends_with("the disk is full") && matches!(e, Error::Write { .. }), "{e}");
    assert_eq!((std::fs::read_to_string(&old).unwrap().as_str(), count()), ("old", 2));
    write_atomically(&old, |file| file.write_all(b"new")).unwrap();
    assert_eq!((std::fs::read_to_string(&old).unwrap().as_str(), count()), ("new", 2));
}

#[cfg(unix)]
#[test]
fn devices_are_not_replaced_and_new_files_are_readable() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    let e = write_atomically(Path::new("/dev/null"), |file| file.write_all(b"x")).unwrap_err();
    assert!(matches!(e, Error::Write { .. }), "{e}");
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    #[cfg(target_os = "linux")]
    assert!(
        matches!(write_png(Path::new("/proc/x.png"), 1, 1, &[0; 4]), Err(Error::Write { .. })),
        "a folder that takes no files"
    );
    let folder = tempfile::tempdir().unwrap();
    let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
    write_atomically(&ours, |file| file.write_all(b"x")).unwrap();
    std::fs::write(&plain, "x").unwrap();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&plain));
}

fn write_samples(path: &Path, size: (usize, usize), compression: Compression, channels: Vec<(&str, FlatSamples)>) {
    let list = AnyChannels::sort(channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect());
    let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    Image::from_layer(Layer::new(size, LayerAttributes::default(), encoding, list)).write().to_file(path).unwrap();
}

#[test]
fn environments_read_every_sample_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("e.exr");
    let half = |v: f32| FlatSamples::F16(vec![f16::from_f32(v); 8]);
    let channels = vec![
        ("A", half(9.0)),
        ("B", FlatSamples::F32(vec![0.5; 8])),
        ("G", half(2.0)),
        ("R", FlatSamples::U32(vec![3; 8])),
        ("Z", half(7.0)),
    ];
    write_samples(&path, (4, 2), Compression::PIZ, channels);
    let map = environment::read(&path).unwrap();
    assert_eq!((map.width(), map.height()), (4, 2));
    assert_eq!(map.texels(), [[3.0, 2.0, 0.5]; 8]);
    write_samples(&path, (4, 2), Compression::ZIP1, vec![("A", half(1.0)), ("Y", half(0.25))]);
    assert_eq!(environment::read(&path).unwrap().texels(), [[0.25; 3]; 8]);
    // A single texel is an environment too.
    write_samples(&path, (1, 1), Compression::Uncompressed, vec![("Y", FlatSamples::F32(vec![2.0]))]);
    assert_eq!(environment::read(&path).unwrap().texels(), [[2.0; 3]]);
    // Rows and columns stay in place.
    let image = rgb_image(5, 3, |i| [i as f32, 0.0, 1.0]);
    write_exr(&path, &image).unwrap();
    assert_eq!(environment::read(&path).unwrap().texels(), image.rgb().unwrap());
}

#[test]
fn environments_clamp_small_negatives_and_refuse_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("e.exr");
    let read = |value: f32| {
        write_exr(&path, &rgb_image(4, 2, |i| if i == 5 { [1.0, value, 1.0] } else { [10.0, 0.0, 0.0] })).unwrap();
        environment::read(&path)
    };
    assert_eq!(read(-0.05).unwrap().texels()[5], [1.0, 0.0, 1.0]);
    for value in [-0.2, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(assert_refused(read(value), "bad texel").contains("texel (1, 1)"));
    }
    write_samples(&path, (4, 2), Compression::ZIP16, vec![("X", FlatSamples::F32(vec![0.0; 8]))]);
    assert!(assert_refused(environment::read(&path), "no colour").contains("got X"));
    assert!(matches!(environment::read(Path::new("sky.png")), Err(Error::Argument { .. })));
}

/// A tiled file whose header claims smaller levels, with a tile that says it belongs to one.
#[test]
fn tiles_of_other_levels_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tiles.exr");
    let list = AnyChannels::sort(
        ["R", "G", "B"].map(|n| AnyChannel::new(n, FlatSamples::F32(vec![1.0; 40 * 33]))).into_iter().collect(),
    );
    let encoding = Encoding {
        compression: Compression::Uncompressed,
        blocks: Blocks::Tiles(Vec2(16, 8)),
        line_order: LineOrder::Increasing,
    };
    Image::from_layer(Layer::new((40, 33), LayerAttributes::default(), encoding, list)).write().to_file(&path).unwrap();
    assert_eq!(environment::read(&path).unwrap().texels(), [[1.0; 3]; 40 * 33]);
    let whole = std::fs::read(&path).unwrap();
    let tiles = whole.windows(9).position(|w| w == b"tiledesc\0").unwrap() + 9 + 4;
    // Tiles start with their column, row and level in either direction.
    let first = whole.windows(16).rposition(|w| w[..4] == [1, 0, 0, 0] && w[4..16] == [0; 12]).unwrap();
    for mode in 0..4 {
        for level in [[1, 0], [0, 1], [1, 1], [5, 5], [255, 255]] {
            let mut bytes = whole.clone();
            bytes[tiles + 8] = mode;
            (bytes[first + 8], bytes[first + 12]) = (level[0], level[1]);
            std::fs::write(&path, &bytes).unwrap();
            assert_refused(read_exr(&path), &format!("mode {mode}, level {level:?}"));
        }
    }
}

/// One small valid file of each kind, with the function that reads it.
type Reader = fn(&Path) -> Outcome<()>;
fn samples(folder: &Path) -> Vec<(PathBuf, Reader)> {
    let at = |name: &str| folder.join(name);
    write_exr(&at("layers.exr"), &layered(20, 18)).unwrap();
    write_exr(&at("map.exr"), &rgb_image(20, 18, |i| [i as f32; 3])).unwrap();
    write_hdr(&at("map.hdr"), &rgb_image(20, 18, |i| [i as f32; 3])).unwrap();
    write_png(&at("image.png"), 20, 18, &[9; 20 * 18 * 4]).unwrap();
    vec![
        (at("layers.exr"), |p| read_exr(p).map(drop)),
        (at("map.exr"), |p| environment::read(p).map(drop)),
        (at("map.hdr"), |p| environment::read(p).map(drop)),
        (at("image.png"), |p| read_png(p).map(drop)),
    ]
}

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    for (path, read) in samples(folder.path()) {
        read(&path).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().to_string();
        for content in [&b""[..], b"hello", b"\0\0\0\0", &whole[..4], &whole[..whole.len() / 2]] {
            std::fs::write(&path, content).unwrap();
            assert_refused(read(&path), &format!("{name} with {} bytes", content.len()));
        }
        // Each under the others' names.
        for (other, content) in [("exr", &b"\x76\x2f\x31\x01"[..]), ("hdr", b"#?RADIANCE\n"), ("png", b"\x89PNG\r\n\x1a\n")] {
            std::fs::write(&path, content).unwrap();
            assert_refused(read(&path), &format!("{name} with the magic of {other}"));
        }
        std::fs::remove_file(&path).unwrap();
        assert_refused(read(&path), "a missing file");
        std::fs::create_dir(&path).unwrap();
        assert!(assert_refused(read(&path), "a directory").contains("directory"));
    }
}

#[test]
fn huge_claims_are_refused_before_allocation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.hdr");
    for size in ["-Y 99999 +X 99999", "-Y 4294967295 +X 4294967295", "-Y 0 +X 4", "-Y 8192 +X 16384", "-Y 16384 +X 8"] {
        std::fs::write(&path, format!("#?RADIANCE\n\n{size}\n")).unwrap();
        assert_refused(environment::read(&path), size);
    }
    let path = folder.path().join("x.exr");
    write_exr(&path, &rgb_image(4, 2, |_| [1.0; 3])).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let window = bytes.windows(10).position(|w| w == b"dataWindow").unwrap() + "dataWindow\0box2i\0".len() + 4;
    for [x, y] in [[16_383, 8_191], [99_999, 1], [i32::MAX, i32::MAX], [i32::MAX, 0], [-5, 1], [i32::MIN, i32::MIN]] {
        let mut bytes = bytes.clone();
        bytes[window + 8..window + 12].copy_from_slice(&i32::to_le_bytes(x));
        bytes[window + 12..window + 16].copy_from_slice(&i32::to_le_bytes(y));
        std::fs::write(&path, &bytes).unwrap();
        assert_refused(environment::read(&path), &format!("{x} {y}"));
        assert_refused(read_exr(&path), &format!("{x} {y}"));
    }
    let path = folder.path().join("x.png");
    write_png(&path, 4, 2, &[1; 32]).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    std::fs::write(&path, &bytes).unwrap();
    assert_refused(read_png(&path), "a huge PNG");
}

/// Cut anywhere and with any bytes changed, a file loads or is refused; it never stops the process.
#[test]
fn damaged_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    for (path, read) in samples(folder.path()) {
        let whole = std::fs::read(&path).unwrap();
        for end in (0..whole.len().min(400)).chain((400..whole.len()).step_by(97)) {
            std::fs::write(&path, &whole[..end]).unwrap();
            let _ = read(&path);
        }
        // Headers are short: half of the changes go there.
        for round in 0..500 {
            let mut bytes = whole.clone();
            for _ in 0..1 + random(3) {
                let at = random(if round % 2 == 0 { whole.len() } else { whole.len().min(500) });
                bytes[at] = [0, 1, 0x7f, 0x80, 0xff, random(256) as u8][random(6)];
            }
            std::fs::write(&path, &bytes).unwrap();
            let _ = read(&path);
        }
    }
}

#[test]
fn errors_name_the_whole_file_where_there_is_no_line() {
    let e = environment::read(Path::new("gone.exr")).unwrap_err();
    assert!(matches!(e, Error::File { at: At::File, .. }), "{e:?}");
}
