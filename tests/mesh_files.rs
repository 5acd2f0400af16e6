//! OBJ files: what is read, and what is refused without a panic.
#![cfg(feature = "offline")]

use passband::offline::error::{At, Error};
use passband::offline::mesh::{Mesh, read_obj};

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
