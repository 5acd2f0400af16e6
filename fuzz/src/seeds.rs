//! The corpus from which fuzzing starts, and which `tests/unbreakable` damages: small valid files of every kind.

use exr::prelude::*;
use flate2::{Compression as Level, write::GzEncoder};
use image::{DynamicImage, ImageFormat};
use std::io::{Cursor, Write};
use std::path::Path;

type Outcome<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Writes all of them below `corpus`, one folder a loader.
pub fn write(corpus: &Path) -> Outcome<()> {
    let mut all = Vec::new();
    merl(&mut all);
    bsdf(&mut all);
    all.push(("sgd/table.csv", sgd().into_bytes()));
    exr_files(&mut all)?;
    images(&mut all)?;
    meshes(&mut all)?;
    scenes(&mut all);
    for (name, bytes) in all {
        let path = corpus.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(corpus))?;
        std::fs::write(path, bytes)?;
    }
    Ok(())
}

type Files = Vec<(&'static str, Vec<u8>)>;

/// As `loaders::merl` reads them: what differs from a whole table.
fn merl(all: &mut Files) {
    let header: Vec<u8> = [90_i32, 90, 180].into_iter().flat_map(i32::to_le_bytes).collect();
    let patch = |place: u32, number: f64| [&place.to_le_bytes()[..], &number.to_le_bytes()].concat();
    all.push(("merl/whole", [&[0][..], &header].concat()));
    all.push(("merl/patched", [&[0][..], &header, &patch(0, 1.0), &patch(4_373_999, -1.0), &patch(7, 1e9)].concat()));
    all.push(("merl/short", [&[1][..], &header, &[0; 16]].concat()));
}

/// The container of `reflectance::rgl::container`, with the fields of an isotropic and of an anisotropic material.
fn bsdf(all: &mut Files) {
    for (name, phi, theta) in [
        ("bsdf/isotropic.bsdf", vec![0.0], vec![0.0]),
        ("bsdf/whole.bsdf", vec![-std::f32::consts::PI, 0.0, std::f32::consts::PI], vec![0.1, 1.0]),
    ] {
        let (p, t) = (phi.len(), theta.len());
        let flat = |shape: &[usize]| (shape.to_vec(), vec![1.0_f32; shape.iter().product()]);
        let fields = [
            ("phi_i", (vec![p], phi)),
            ("theta_i", (vec![t], theta)),
            ("ndf", flat(&[3, 3])),
            ("sigma", flat(&[3, 3])),
            ("vndf", flat(&[p, t, 3, 3])),
            ("luminance", flat(&[p, t, 2, 2])),
            ("rgb", flat(&[p, t, 3, 2, 2])),
        ];
        let entry = |name: &str, sides: usize| 2 + name.len() + 2 + 1 + 8 + 8 * sides;
        let directory = 18 + entry("jacobian", 1) + fields.iter().map(|(n, (s, _))| entry(n, s.len())).sum::<usize>();
        let (mut head, mut data) = (b"tensor_file\0\x01\0".to_vec(), Vec::new());
        head.extend((1 + fields.len() as u32).to_le_bytes());
        let mut field = |name: &str, kind: u8, shape: &[usize], bytes: &[u8]| {
            head.extend((name.len() as u16).to_le_bytes());
            head.extend(name.bytes());
            head.extend((shape.len() as u16).to_le_bytes());
            head.push(kind);
            head.extend(((directory + data.len()) as u64).to_le_bytes());
            shape.iter().for_each(|side| head.extend((*side as u64).to_le_bytes()));
            data.extend(bytes);
        };
        field("jacobian", 1, &[1], &[1]);
        for (name, (shape, numbers)) in &fields {
            field(name, 10, shape, &numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>());
        }
        all.push((name, [head, data].concat()));
    }
}

fn sgd() -> String {
    let names = ["rhod", "rhos", "alpha", "p", "F0", "F1", "kap", "lambda", "c", "k", "theta0"];
    let values = ["0.05", "0.3", "0.2", "0.5", "0.1", "-0.1", "6", "2", "1e38", "9", "0.1"];
    let header: Vec<_> = names.iter().flat_map(|n| ["R", "G", "B"].map(|c| format!("{n}_{c}"))).collect();
    let row: Vec<_> = values.iter().flat_map(|v| [*v; 3]).collect();
    format!("material,alt_name,{}\nother,\"a, b\",{1}\npaint,p,{1}\n", header.join(","), row.join(","))
}

fn exr_files(all: &mut Files) -> Outcome<()> {
    let planes = |names: &[&str], n: usize| {
        let sample = |c: usize| move |i: usize| (i * (c + 1) % 13) as f32 * 0.25;
        let channels = names.iter().enumerate().map(|(c, name)| match c % 2 {
            0 => AnyChannel::new(*name, FlatSamples::F16((0..n).map(sample(c)).map(f16::from_f32).collect())),
            _ => AnyChannel::new(*name, FlatSamples::F32((0..n).map(sample(c)).collect())),
        });
        AnyChannels::sort(channels.collect())
    };
    let kinds = [
        ("exr/plain.exr", Compression::Uncompressed, Blocks::ScanLines),
        ("exr/rle.exr", Compression::RLE, Blocks::ScanLines),
        ("exr/zip1.exr", Compression::ZIP1, Blocks::ScanLines),
        ("exr/zip16.exr", Compression::ZIP16, Blocks::ScanLines),
        ("exr/piz.exr", Compression::PIZ, Blocks::ScanLines),
        ("exr/pxr24.exr", Compression::PXR24, Blocks::ScanLines),
        ("exr/b44.exr", Compression::B44, Blocks::ScanLines),
        ("exr/b44a.exr", Compression::B44A, Blocks::ScanLines),
        ("exr/tiles.exr", Compression::Uncompressed, Blocks::Tiles(Vec2(4, 4))),
        ("exr/zip-tiles.exr", Compression::ZIP16, Blocks::Tiles(Vec2(5, 3))),
    ];
    for (name, compression, blocks) in kinds {
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((8, 6), LayerAttributes::default(), encoding, planes(&["R", "G", "B", "A"], 48));
        let mut file = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut file)?;
        all.push((name, file.into_inner()));
    }
    let part = |name: &str, channels: &[&str]| {
        Layer::new((3, 2), LayerAttributes::named(name), Encoding::FAST_LOSSLESS, planes(channels, 6))
    };
    let mut file = Cursor::new(Vec::new());
    let parts = vec![part("depth", &["Z"]), part("grey", &["Y"])];
    Image::from_layers(ImageAttributes::with_size((3, 2)), parts).write().to_buffered(&mut file)?;
    all.push(("exr/parts.exr", file.into_inner()));
    Ok(())
}

fn images(all: &mut Files) -> Outcome<()> {
    let kinds = [
        ("png/rgba8.png", DynamicImage::new_rgba8(9, 7), ImageFormat::Png),
        ("png/rgb16.png", DynamicImage::new_rgb16(5, 3), ImageFormat::Png),
        ("png/grey8.png", DynamicImage::new_luma8(1, 1), ImageFormat::Png),
        ("png/grey-alpha16.png", DynamicImage::new_luma_a16(2, 2), ImageFormat::Png),
        ("jpg/rgb.jpg", DynamicImage::new_rgb8(17, 9), ImageFormat::Jpeg),
        ("jpg/grey.jpg", DynamicImage::new_luma8(8, 8), ImageFormat::Jpeg),
        ("hdr/flat.hdr", DynamicImage::new_rgb32f(1, 1), ImageFormat::Hdr),
        ("hdr/runs.hdr", DynamicImage::new_rgb32f(20, 3), ImageFormat::Hdr),
    ];
    for (name, mut image, format) in kinds {
        match &mut image {
            DynamicImage::ImageRgba8(p) => p.iter_mut().enumerate().for_each(|(i, v)| *v = (i * 37) as u8),
            DynamicImage::ImageRgb16(p) => p.iter_mut().enumerate().for_each(|(i, v)| *v = (i * 1237) as u16),
            DynamicImage::ImageRgb8(p) => p.iter_mut().enumerate().for_each(|(i, v)| *v = (i * 11) as u8),
            DynamicImage::ImageRgb32F(p) => p.iter_mut().enumerate().for_each(|(i, v)| *v = i as f32 * 0.1),
            _ => {}
        }
        let mut file = Cursor::new(Vec::new());
        image.write_to(&mut file, format)?;
        all.push((name, file.into_inner()));
    }
    // The older run lengths, and a header with an exposure.
    let old = b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n\x80\x40\x20\x81\x01\x01\x01\x03\x10\x10\x10\x80\x01\x01\x01\x03";
    all.push(("hdr/old-runs.hdr", old.to_vec()));
    Ok(())
}

fn meshes(all: &mut Files) -> Outcome<()> {
    let obj = "# c\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\no a\nf 1/1/1 2/2/1 3/3/1 4/1/1\ng b\nf -1//-1 -2 -3/1\nl 1 2\n";
    let off = "OFF # c\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1e0 -0.5\n3 0 1 2 255 0 0\n4 0 1 2 3\n";
    all.push(("obj/quad.obj", obj.into()));
    all.push(("off/quad.off", off.into()));
    let mut writer = GzEncoder::new(Vec::new(), Level::default());
    writer.write_all(off.as_bytes())?;
    all.push(("gz/quad.off.gz", writer.finish()?));
    let mut writer = GzEncoder::new(Vec::new(), Level::none());
    writer.write_all(off.as_bytes())?;
    all.push(("gz/stored.off.gz", writer.finish()?));
    for (name, format) in
        [("ply/ascii.ply", "ascii"), ("ply/little.ply", "binary_little_endian"), ("ply/big.ply", "binary_big_endian")]
    {
        all.push((name, ply(format)));
    }
    let buffer = buffer();
    let encoded = "data:application/octet-stream;base64,".to_string() + &base64(&buffer);
    all.push(("gltf/embedded.gltf", gltf(&format!(r#","uri":"{encoded}""#)).into_bytes()));
    let mut json = gltf("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, content) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        glb.extend((content.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(content);
    }
    all.push(("gltf/binary.glb", glb));
    Ok(())
}

/// A quad as a triangle and a polygon, its heights doubles, with coordinates.
fn ply(format: &str) -> Vec<u8> {
    let header = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty float s\nproperty float t\n\
                  element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let mut out = format!("ply\nformat {format} 1.0\ncomment c\n{header}").into_bytes();
    if format == "ascii" {
        out.extend(b"0 0 0.5 0 0\n1 0 0.5 1 0\n1 1 0.5 1 1\n0 1 0.5 0 1\n3 0 1 2\n4 0 1 2 3\n");
        return out;
    }
    let mut put = |bytes: &[u8]| match format {
        "binary_big_endian" => out.extend(bytes.iter().rev()),
        _ => out.extend(bytes),
    };
    for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
        put(&x.to_le_bytes());
        put(&f64::from(y).to_le_bytes());
        [0.5, x, y].iter().for_each(|v| put(&v.to_le_bytes()));
    }
    for face in [&[0_i32, 1, 2][..], &[0, 1, 2, 3]] {
        put(&[face.len() as u8]);
        face.iter().for_each(|i| put(&i.to_le_bytes()));
    }
    out
}

/// A triangle: positions, normals, coordinates, tangents, indices.
fn buffer() -> Vec<u8> {
    let floats = [
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0][..],
        &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0],
        &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0],
        &[1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0],
    ]
    .concat();
    let floats = floats.iter().flat_map(|f: &f32| f.to_le_bytes());
    floats.chain([0, 0, 1, 0, 2, 0, 0, 0]).collect()
}

fn gltf(uri: &str) -> String {
    let accessor = |view: u32, kind: &str, component: u32| {
        format!(r#"{{"bufferView":{view},"count":3,"type":"{kind}","componentType":{component},"min":[0,0,0],"max":[1,1,0]}}"#)
    };
    let accessors = [(0, "VEC3", 5126), (1, "VEC3", 5126), (2, "VEC2", 5126), (3, "VEC4", 5126), (4, "SCALAR", 5123)];
    let accessors = accessors.map(|(view, kind, component)| accessor(view, kind, component)).join(",");
    let sparse = r#",{"count":3,"type":"VEC3","componentType":5126,"min":[0,0,0],"max":[1,1,1],"sparse":{"count":1,"indices":{"bufferView":4,"componentType":5121},"values":{"bufferView":0}}}"#;
    let views = [(0, 36), (36, 36), (72, 24), (96, 48), (144, 8)];
    let views = views.map(|(at, size)| format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{size}}}"#)).join(",");
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
"nodes":[{{"mesh":0,"children":[2],"rotation":[0,0,0,1],"scale":[-1,1,2]}},{{"mesh":1,"camera":0}},{{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
"materials":[{{"name":"m","pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,0,1],"metallicFactor":0.5,"roughnessFactor":0.3}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"TANGENT":3}},"indices":4,"material":0}}]}},{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":5}},{{"attributes":{{"POSITION":5}},"mode":6}}]}}],
"accessors":[{accessors}{sparse}],"bufferViews":[{views}],"buffers":[{{"byteLength":152{uri}}}]}}"#
    )
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |three: &[u8]| {
        let all = three.iter().fold(0_u32, |all, b| all << 8 | u32::from(*b)) << (8 * (3 - three.len()));
        (0..4)
            .map(move |i| if i <= three.len() { DIGITS[(all >> (18 - 6 * i)) as usize & 63] as char } else { '=' })
            .collect::<String>()
    };
    bytes.chunks(3).map(digits).collect()
}

fn scenes(all: &mut Files) {
    let camera = "[camera]\nposition = [0, 1, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y = 40\nsize = [32, 24]\n";
    let ggx = "[materials.grey]\nreflectance = { ggx = { alpha = 0.3, f0 = [0.04, 0.5, 1], albedo = 0.4 } }\n";
    let plain = format!(
        "{camera}[[objects]]\nbuiltin = 'plane'\nmaterial = 'grey'\ntranslate = [0, 0, 0]\nrotate = [0, 90, 0]\nscale = 2\n\
         [[objects]]\nbuiltin = 'plane'\nmaterial = 'lobes'\nuv = 'box'\ntransform = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]\n\
         [[lights]]\ntype = 'point'\nposition = [1, 2, 3]\nintensity = 5\n\
         [[lights]]\ntype = 'rectangle'\nposition = [0, 3, 0]\nu = [1, 0, 0]\nv = [0, 0, 1]\nradiance = 2\n{ggx}[materials.lobes]\n\
         reflectance = {{ vmf = [{{ mu = [0, 0, 1], kappa = 10, weight = 1 }}] }}\n[materials.blinn]\n\
         reflectance = {{ blinn_phong = {{ exponent = 20, specular = 0.5, albedo = 0.1 }} }}\n"
    );
    let files = format!(
        "{camera}[environment]\nmap = 'sky.exr'\nintensity = 2\nrotation = 90\nvisible = false\n[[objects]]\nmesh = 'm.obj'\n\
         material = 'a'\n[materials.a]\nreflectance = {{ merl = 'a.binary' }}\n[materials.b]\nreflectance = {{ rgl = 'b.bsdf' }}\n\
         [materials.c]\nreflectance = {{ sgd = {{ table = 'c.csv', name = 'paint' }} }}\n[materials.d]\nreflectance = {{ builtin = 'rough' }}\n"
    );
    let later = format!(
        "{camera}[[objects]]\nbuiltin = 'sphere'\nmaterial = 'grey'\n{ggx}albedo_map = 'a.png'\ntiling = [2, 2]\n\
         [animation]\nframes = 10\n[settings]\noperator = 'box'\neps = 0.1\n"
    );
    all.push(("scene/plain.toml", plain.into_bytes()));
    all.push(("scene/files.toml", files.into_bytes()));
    all.push(("scene/later.toml", later.into_bytes()));
}
