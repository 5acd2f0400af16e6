//! OBJ, PLY, OFF and gzip files: what is read, and what is refused without a panic.
#![cfg(feature = "offline")]

use passband::offline::error::{At, Error};
use passband::offline::mesh::{self, Mesh, read_obj};

#[path = "support/damage.rs"]
mod damage;

fn read(bytes: &[u8]) -> Result<Mesh, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.obj");
    std::fs::write(&path, bytes).unwrap();
    read_obj(&path)
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn a_quad_with_everything() {
    let text = "# c\nmtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n\
                usemtl gone\ns off\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
    let mesh = read(text.as_bytes()).unwrap();
    assert_eq!((mesh.positions.len(), mesh.indices.len(), mesh.has_uvs), (4, 6, true));
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4], "normals are made unit");
    assert_eq!(mesh.uvs[2], [1.0, 1.0]);
}

#[test]
fn groups_are_merged_and_normals_are_smooth_across_them() {
    // A fold along the y axis: floor (z up) and wall (x), in two groups, by negative indices in the second.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no a\nf 1 2 3\no b\nf -4 -2 -1\n";
    let mesh = read(text.as_bytes()).unwrap();
    assert_eq!((mesh.positions.len(), mesh.indices.as_slice()), (6, &[0, 1, 2, 3, 4, 5][..]));
    assert!(!mesh.has_uvs && mesh.uvs == [[0.0; 2]; 6]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!((mesh.normals[0][0] - half).abs() < 1e-6 && (mesh.normals[0][2] - half).abs() < 1e-6, "{:?}", mesh.normals[0]);
    assert_eq!(mesh.normals[0], mesh.normals[3]);
    assert_eq!(mesh.normals[1], [0.0, 0.0, 1.0]);
}

#[test]
fn normals_that_have_no_length_or_are_missing_come_from_faces() {
    for text in [
        "vn 0 0 0\nvn 1 0 0\nf 1//1 2//1 3//1\n",
        "vn 1 0 0\nf 1 2//1 3\n",
        // Degenerate twice over: the face has no area either, but the other one does.
        "vn 0 0 0\nf 1//1 1//1 2//1\nf 1//1 2//1 3//1\n",
    ] {
        let mesh = read((TRIANGLE.to_string() + text).as_bytes()).unwrap();
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]), "{text}: {:?}", mesh.normals);
    }
    let flat = read(b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n").unwrap();
    assert_eq!(flat.normals, [[0.0, 1.0, 0.0]; 3]);
}

#[test]
fn malformed_files_are_refused_with_their_line() {
    let cases: &[(&str, u64, &str)] = &[
        ("v 0 0\nf 1 1 1\n", 1, "vertex position"),
        ("v 0 nan 0\nf 1 1 1\n", 1, "finite"),
        ("v 0 0 inf\n", 1, "finite"),
        ("v 1e99 0 0\n", 1, "finite"),
        ("v a b c\n", 1, "finite"),
        ("v 0 0 0\nvn 0 NaN 1\n", 2, "vertex normal"),
        ("v 0 0 0\nvt inf 0\n", 2, "texture coordinate"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4, "1 to 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", 4, "index"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", 4, "-3 to -1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", 4, "index"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//6148914691236517205 2//1 3//1\n", 4, "index"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//-9223372036854775808 2 3\n", 4, "index"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n", 4, "index"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", 4, "3 corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf\n", 4, "3 corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/2/3/4 2 3\n", 4, ""),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf x y z\n", 4, "index"),
    ];
    for (text, line, word) in cases {
        let e = read(text.as_bytes()).unwrap_err();
        let message = e.to_string();
        assert!(matches!(&e, Error::File { at: At::Line(l), .. } if l == line), "{text}: {message}");
        assert!(message.contains(word) && !message.contains('\n'), "{text}: {message}");
    }
    for text in [TRIANGLE, "hello\n", "\0\u{1}\u{2}", "l 1\n", "v 0 0 0 0\nf 1 1 1", "v 0 0 0 1 2\n", "v 0 0 0 1 2 3 4\n"] {
        let e = read(text.as_bytes()).unwrap_err();
        assert!(matches!(e, Error::File { .. }) && !e.to_string().contains('\n'), "{text}: {e}");
    }
    let comment = read(b"# caf\xe9 in Latin-1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    assert_eq!(comment.indices, [0, 1, 2]);
}

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty.obj");
    std::fs::write(&empty, "").unwrap();
    for path in [folder.path().to_path_buf(), folder.path().join("gone.obj"), empty] {
        let e = read_obj(&path).unwrap_err();
        assert!(matches!(e, Error::File { at: At::File, .. }) && !e.to_string().contains('\n'), "{e}");
    }
}

/// Cut anywhere and with any byte changed, a file loads or is refused; it never stops the process.
#[test]
fn damaged_files_never_panic() {
    let text =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\no a\nf 1/1/1 2/1/1 3/1/1 4/1/1\ng b\nf -1//-1 -2//1 -3//1\n";
    for end in 0..text.len() {
        let _ = read(&text.as_bytes()[..end]);
    }
    let mut state = 1_u64;
    for _ in 0..5_000 {
        let mut bytes = text.as_bytes().to_vec();
        for _ in 0..3 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] = b" /-0123456789ef.\nvnt\xff#"[(state >> 20) as usize % 21];
        }
        if let Ok(mesh) = read(&bytes) {
            assert!(mesh.indices.iter().all(|i| (*i as usize) < mesh.positions.len()));
            assert!(mesh.normals.len() == mesh.positions.len() && mesh.uvs.len() == mesh.positions.len());
        }
    }
}

fn read_as(name: &str, bytes: &[u8]) -> Result<Mesh, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    mesh::read(&path)
}

/// A pyramid over a quad: 5 vertices, 4 triangles and the base, wound counter-clockwise from outside.
const PYRAMID: [[f32; 3]; 5] = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0], [0.0, 1.5, 0.0]];
const FACES: [&[u32]; 5] = [&[3, 2, 1, 0], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

fn pyramid_off() -> String {
    let vertices: String = PYRAMID.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let words = |f: &&[u32]| f.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
    let faces: String = FACES.iter().map(|f| format!("{} {}\n", f.len(), words(f))).collect();
    format!("OFF\n5 5 8\n{vertices}{faces}")
}

/// The pyramid with normals `(0, 2, 0)` and coordinates, in one of PLY's three encodings.
fn pyramid_ply(format: &str, scalar: &str, index: &str) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment a test\nobj_info x\nelement vertex 5\nproperty {scalar} x\nproperty {scalar} y\n\
         property {scalar} z\nproperty uchar red\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float s\n\
         property float t\nelement material 1\nproperty int kind\nelement face 5\nproperty list uchar {index} vertex_indices\n\
         property float quality\nend_header\n"
    );
    let mut out = Out { bytes: header.into_bytes(), format };
    for [x, y, z] in PYRAMID {
        [x, y, z].iter().for_each(|c| out.number(scalar, *c));
        out.number("uchar", 7.0);
        [0.0, 2.0, 0.0, 0.5 + x / 2.0, 0.5].iter().for_each(|c| out.number("float", *c));
        out.end();
    }
    out.number("int", 3.0);
    out.end();
    for face in FACES {
        out.number("uchar", face.len() as f32);
        face.iter().for_each(|i| out.number(index, *i as f32));
        out.number("float", 1.0);
        out.end();
    }
    out.bytes
}

struct Out<'a> {
    bytes: Vec<u8>,
    format: &'a str,
}

impl Out<'_> {
    fn number(&mut self, kind: &str, value: f32) {
        if self.format == "ascii" {
            return self.bytes.extend(format!("{value} ").bytes());
        }
        let mut bytes = match kind {
            "uchar" => vec![value as u8],
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" => (value as i32).to_le_bytes().to_vec(),
            "uint" => (value as u32).to_le_bytes().to_vec(),
            "double" => f64::from(value).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if self.format == "binary_big_endian" {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn end(&mut self) {
        if self.format == "ascii" {
            self.bytes.push(b'\n');
        }
    }
}

/// Every triangle of the pyramid faces away from its middle.
fn assert_outward(mesh: &Mesh) {
    assert!(mesh.is_consistent() && mesh.indices.len() == 18, "{:?}", mesh.indices);
    for t in mesh.indices.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| glam::Vec3::from(mesh.positions[t[i] as usize]));
        assert!((b - a).cross(c - a).dot((a + b + c) / 3.0 - glam::Vec3::Y * 0.5) > 0.0, "{t:?}");
    }
}

#[test]
fn ply_in_every_encoding() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (scalar, index) in [("float", "int"), ("double", "uint"), ("float", "uchar"), ("float", "ushort")] {
            let mesh = read_as("m.PLY", &pyramid_ply(format, scalar, index)).unwrap_or_else(|e| panic!("{format} {scalar}: {e}"));
            assert_eq!(mesh.positions, PYRAMID, "{format} {scalar}");
            assert_eq!(mesh.normals, [[0.0, 1.0, 0.0]; 5]);
            assert!(mesh.has_uvs && mesh.uvs[1] == [1.0, 0.5] && mesh.uvs[4] == [0.5, 0.5]);
            assert_outward(&mesh);
        }
    }
    // Windows' line ends, another name of the list, coordinates of another name, no normals.
    let text = "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n\
                property float texture_u\r\nproperty float texture_v\r\nelement face 1\r\n\
                property list uchar int vertex_index\r\nend_header\r\n0 0 0 0 0\r\n1 0 0 1 0\r\n0 1 0 0 1\r\n3 0 1 2\r\n";
    let mesh = read_as("m.ply", text.as_bytes()).unwrap();
    assert_eq!((mesh.normals[0], mesh.uvs[1], mesh.has_uvs), ([0.0, 0.0, 1.0], [1.0, 0.0], true));
}

#[test]
fn off_with_comments_colours_and_counts_beside_the_word() {
    assert_outward(&read_as("m.off", pyramid_off().as_bytes()).unwrap());
    let text = "# made by hand\nOFF 4 2 0 # counts\n\n0 0 0\n1 0 0 # right\r\n 1e0 1 0\n0 1 -0.0\n3 0 1 2 255 0 0\n3 0 2 3 0.5 0.5 0.5\n";
    let mesh = read_as("m.off", text.as_bytes()).unwrap();
    assert_eq!((mesh.indices.as_slice(), mesh.normals[3]), (&[0, 1, 2, 0, 2, 3][..], [0.0, 0.0, 1.0]));
    assert!(!mesh.has_uvs && mesh.tangents.is_empty());
}

#[test]
fn gzip_of_every_kind_and_its_bombs() {
    let obj = TRIANGLE.to_string() + "f 1 2 3\n";
    for (name, content) in [
        ("m.obj.gz", obj.into_bytes()),
        ("m.off.GZ", pyramid_off().into_bytes()),
        ("m.ply.gz", pyramid_ply("binary_big_endian", "float", "int")),
    ] {
        let plain = read_as(&name[..5], &content).unwrap();
        let packed = damage::gzip(&content);
        assert_eq!(read_as(name, &packed).unwrap().positions, plain.positions, "{name}");
        for bytes in damage::variants(&packed, 100) {
            let _ = read_as(name, &bytes);
        }
        assert!(read_as(name, &packed[..packed.len() - 5]).is_err(), "{name}: a cut-off stream");
        assert!(read_as(name, &content).is_err(), "{name}: not compressed");
    }
    // 32 MiB of spaces in 33 kB: refused once 64 times the file's size has come out.
    let bomb = damage::gzip(&[b' '; 1 << 20]).repeat(32);
    let e = read_as("m.off.gz", &bomb).unwrap_err();
    assert!(e.to_string().contains("at most") && bomb.len() < 50_000, "{e} {}", bomb.len());
    assert!(read_as("m.off.gz", &damage::gzip(b"")).is_err());
    for name in ["m.gz", "m", "m.stl", "m.stl.gz"] {
        assert!(matches!(read_as(name, b"x"), Err(Error::Argument { .. })), "{name}");
    }
}

#[test]
fn malformed_off_is_refused_with_its_line() {
    let cases: &[(&str, u64, &str)] = &[
        ("", 0, "content"),
        ("OF\n", 1, "OFF"),
        ("COFF\n1 1 1\n", 1, "OFF"),
        ("OFFX 1 1 1\n", 1, "OFF"),
        ("OFF\n", 1, "counts"),
        ("OFF\n3\n", 2, "counts"),
        ("OFF\n3 -1 0\n", 2, "counts"),
        ("OFF\n3 1 0 0\n", 2, "counts"),
        ("OFF\n99999999999999 1 0\n", 2, "hold"),
        ("OFF\n3 18446744073709551615 0\n", 2, "hold"),
        ("OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", 4, "finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0 1e99\n0 1 0\n3 0 1 2\n", 4, "finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0 0\n3 0 1 2\n", 4, "3 finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0 0\n3 0 1 2\n", 5, "3 finite"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", 6, "below 3"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", 6, "3 indices"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 \n", 6, "3 indices"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1 2\n", 6, "3 or more"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n999999999999 0 1\n", 6, "indices"),
        ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2  0 0 0\n", 6, "corners"),
        ("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", 0, "triangle"),
    ];
    for (text, line, word) in cases {
        let e = read_as("m.off", text.as_bytes()).unwrap_err();
        let Error::File { at, .. } = &e else { panic!("{e}") };
        assert_eq!(*at, if *line == 0 { At::File } else { At::Line(*line) }, "{text}: {e}");
        assert!(e.to_string().contains(word) && !e.to_string().contains('\n'), "{text}: {e}");
    }
}

#[test]
fn malformed_ply_is_refused() {
    let whole = String::from_utf8(pyramid_ply("ascii", "float", "int")).unwrap();
    for (from, to, word) in [
        ("ply\n", "plx\n", "header"),
        ("ascii", "asciii", "header"),
        ("end_header", "end", "header"),
        ("property float x", "property float q", "vertex x"),
        ("vertex 5", "vertex 6", "vertex"),
        ("vertex 5", "vertex 99999999999999", "at most"),
        ("vertex 5", "vertex 18446744073709551615", "at most"),
        ("vertex 5", "vertex 99999999999999999999999", "header"),
        ("face 5", "face 4000000000000", "at most"),
        ("face 5", "face 0", "triangle"),
        ("element material 1\nproperty int kind", "element material 99999999999999", "at most"),
        ("-1 0 1 7", "nan 0 1 7", "vertex"),
        ("-1 0 1 7", "1e99 0 1 7", "position"),
        ("0 2 0 0.5 0.5", "0 2 0 1e99 0.5", "texture coordinate"),
        ("3 0 1 4", "3 0 1 5", "below 5"),
        ("3 0 1 4", "3 0 1 -1", "negative"),
        ("3 0 1 4 1", "2 0 1 1", "3 corners"),
        ("3 0 1 4 1", "250 0 1 4 1", "element face"),
        ("3 0 1 4 1", "3 0 1", "element face"),
        ("list uchar int", "list uchar float", "element face"),
        ("list uchar int vertex_indices", "list uchar int other", "3 corners"),
    ] {
        let text = whole.replacen(from, to, 1);
        assert_ne!(text, whole, "{from}");
        let Err(e) = read_as("m.ply", text.as_bytes()) else { panic!("{from} {to} is accepted") };
        let message = e.to_string();
        assert!(matches!(e, Error::File { .. }) && message.contains(word) && !message.contains('\n'), "{from} {to}: {message}");
        assert!(message.len() < 600, "{message}");
    }
    let e = read_as("m.ply", whole.replace("-1 0 1 7", "x 0 1 7").as_bytes()).unwrap_err();
    assert!(matches!(e, Error::File { at: At::Line(21), .. }), "{e}");
    // A binary list that claims 4 billion indices, and an element whose entries take no bytes at all.
    let header = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
    let e = read_as("m.ply", &[header.as_bytes(), &[255; 40]].concat()).unwrap_err();
    assert!(matches!(e, Error::File { at: At::Byte(_), .. }), "{e}");
    let e = read_as("m.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nend_header\n").unwrap_err();
    assert!(e.to_string().contains("at most 0"), "{e}");
}

#[test]
fn damaged_ply_and_off_never_panic() {
    let mut seen = [0, 0];
    let mut wholes = vec![("m.off", pyramid_off().into_bytes()), ("m.obj", format!("{TRIANGLE}f 1 2 3\n").into_bytes())];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        wholes.push(("m.ply", pyramid_ply(format, "float", "int")));
    }
    for (name, whole) in wholes {
        for bytes in damage::variants(&whole, 400) {
            match read_as(name, &bytes) {
                Ok(mesh) => {
                    assert!(mesh.is_consistent() && mesh.positions.iter().flatten().all(|c| c.is_finite()));
                    assert!(mesh.normals.iter().all(|n| (glam::Vec3::from(*n).length() - 1.0).abs() < 1e-4));
                    seen[0] += 1;
                }
                Err(e) => {
                    assert!(!e.to_string().contains('\n'), "{e}");
                    seen[1] += 1;
                }
            }
        }
    }
    assert!(seen.iter().all(|n| *n > 100), "the damage is neither harmless nor always fatal: {seen:?}");
    let folder = tempfile::tempdir().unwrap();
    for name in ["d.ply", "d.off", "d.obj.gz", "d.glb"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
        for name in [name.to_string(), format!("gone-{name}")] {
            let e = mesh::read(&folder.path().join(name)).unwrap_err();
            assert!(matches!(e, Error::File { at: At::File, .. }), "{e}");
        }
    }
}

/// The `uv` key of a scene reaches the mesh, also where two objects ask one file for different coordinates.
#[test]
fn scenes_generate_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.off"), pyramid_off()).unwrap();
    let object = |uv: &str| format!("[[objects]]\nmesh = 'm.off'\nmaterial = 'grey'\n{uv}\n");
    let scene = folder.path().join("s.toml");
    let text = format!(
        "[camera]\nposition = [0, 0, 3]\n{}{}{}{}[materials.grey]\nreflectance = {{ ggx = {{ alpha = 0.5, f0 = 0.04, albedo = 0.2 }} }}\n",
        object(""),
        object("uv = 'spherical'"),
        object("uv = 'box'"),
        object("uv = 'spherical'")
    );
    std::fs::write(&scene, text).unwrap();
    let world = passband::offline::scene::Scene::load(scene.to_str().unwrap(), &[]).unwrap().resolve().unwrap();
    let meshes: Vec<&Mesh> = world.objects.iter().map(|o| &*o.mesh).collect();
    assert_eq!(meshes.iter().map(|m| m.has_uvs).collect::<Vec<_>>(), [false, true, true, true]);
    // Each of the five faces has an axis of its own: the base's corners get 3, 3, 2 and 2 different coordinates, the tip 1.
    assert_eq!((meshes[0].positions.len(), meshes[2].positions.len()), (5, 11));
    assert!(std::sync::Arc::ptr_eq(&world.objects[1].mesh, &world.objects[3].mesh));
    meshes.iter().for_each(|mesh| assert_outward(mesh));
}
