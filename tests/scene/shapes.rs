//! Shapes from mesh files, cylinders and merged shapes: what is read, what is refused.

use std::path::PathBuf;

use glam::{DVec3, Vec2, Vec3};
use pointillist::scene::desc::*;
use pointillist::scene::{FindingKind, Loaded, SceneError, load};

const BESIDE: &str = "<sensor type=\"perspective\"/><emitter type=\"constant\"/>";

/// A bent square of four corners, the second of two faces a polygon.
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                   property float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                   0 0 0 0 0\n1 0 0 1 .25\n1 1 .5 1 1\n0 1 0 0 1\n9 9 9 0 0\n3 0 1 2\n3 0 2 3\n";

/// Reads a scene beside files of its own.
fn try_read(name: &str, files: &[(&str, &[u8])], body: &str) -> Result<Loaded, SceneError> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("shapes").join(name);
    std::fs::create_dir_all(&folder).expect("a writable folder");
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).expect("a writable folder");
    }
    let scene = folder.join("scene.xml");
    std::fs::write(&scene, format!("<scene version=\"3.0.0\">{BESIDE}\n{body}\n</scene>")).expect("a folder");
    load(&scene, &[])
}

fn mesh_of(loaded: &Loaded, shape: usize) -> &Mesh {
    let ShapeKind::Mesh(id) = loaded.desc.shapes[shape].kind else { panic!("a mesh") };
    &loaded.desc.meshes[id.0 as usize]
}

/// Numbers of Mitsuba 3.9.1 for the same files.
#[test]
fn ply_as_mitsuba_reads_it() {
    let shape = |more: &str| {
        format!("<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/>{more}</shape>\n")
    };
    let body = shape("")
        + &shape("<boolean name=\"face_normals\" value=\"true\"/>")
        + &shape(
            "<boolean name=\"flip_tex_coords\" value=\"true\"/><boolean name=\"flip_normals\" value=\"true\"/>",
        )
        + &shape("");
    let loaded = try_read("ply", &[("a.ply", PLY.as_bytes())], &body).expect("valid");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let plain = mesh_of(&loaded, 0);
    assert_eq!((&plain.triangles[..], plain.positions.len()), (&[[0, 1, 2], [0, 2, 3]][..], 4));
    let wanted = [
        [-0.23570228, -0.23570228, 0.9428091],
        [0.0, -0.4472136, 0.8944272],
        [-0.23570226, -0.23570226, 0.94280905],
        [-0.4472136, 0.0, 0.8944272],
    ];
    assert!(plain.normals.iter().zip(wanted).all(|(n, w)| n.distance(Vec3::from(w)) < 1e-6), "{plain:?}");
    assert_eq!(plain.uvs[1], Vec2::new(1.0, 0.25));
    assert!(mesh_of(&loaded, 1).normals.is_empty());
    assert_eq!(mesh_of(&loaded, 2).uvs[1], Vec2::new(1.0, 0.75));
    assert!(loaded.desc.shapes[2].flip_normals);
    assert_eq!(loaded.desc.meshes.len(), 3, "the fourth shape shares the mesh of the first");
}

/// A `serialized` file of version 3 that holds two triangles, the second of them larger. The meshes are compressed by hand: each is
/// one stored block (RFC 1950 and 1951).
fn serialized() -> Vec<u8> {
    let mesh = |size: f32| {
        let mut raw = 0x1000_u32.to_le_bytes().to_vec();
        [3_u64, 1].iter().for_each(|n| raw.extend(n.to_le_bytes()));
        [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0]
            .iter()
            .for_each(|n: &f32| raw.extend(n.to_le_bytes()));
        [0_u32, 1, 2].iter().for_each(|n| raw.extend(n.to_le_bytes()));
        let (mut a, mut b) = (1_u32, 0_u32);
        for byte in &raw {
            a = (a + u32::from(*byte)) % 65521;
            b = (b + a) % 65521;
        }
        let length = raw.len() as u16;
        let mut out = vec![0x1c, 0x04, 3, 0, 0x78, 0x01, 1];
        out.extend(length.to_le_bytes());
        out.extend((!length).to_le_bytes());
        out.extend(raw);
        out.extend((b << 16 | a).to_be_bytes());
        out
    };
    let (first, second) = (mesh(1.0), mesh(2.0));
    let places = [0, first.len() as u32, 2].map(u32::to_le_bytes).concat();
    [first, second, places].concat()
}

#[test]
fn serialized_meshes_by_their_index() {
    let shape = |more: &str| {
        format!(
            "<shape type=\"serialized\"><string name=\"filename\" value=\"a.serialized\"/>{more}</shape>\n"
        )
    };
    let index = |i: i32| shape(&format!("<integer name=\"shape_index\" value=\"{i}\"/>"));
    let file = serialized();
    let read = |body: &str| try_read("serialized", &[("a.serialized", &file)], body);
    let loaded = read(&(shape("") + &index(1))).expect("valid");
    assert_eq!(mesh_of(&loaded, 0).positions[1], Vec3::X);
    assert_eq!(mesh_of(&loaded, 1).positions[1], Vec3::X * 2.0);
    let e = read(&index(2)).expect_err("two meshes");
    assert!(e.to_string().contains("from 0 to 1") && e.location().0.ends_with("a.serialized"), "{e:?}");
    let e = read(&index(-1)).expect_err("negative");
    assert!(e.location().0.ends_with("scene.xml") && e.location().1 == 2, "{e:?}");
}

#[test]
fn a_mesh_file_that_is_missing_is_named_in_the_scene() {
    for kind in ["obj", "ply", "serialized"] {
        let body = format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"no.{kind}\"/></shape>");
        let e = try_read("missing", &[], &body).expect_err("no file");
        assert_eq!((e.kind(), e.location().1), (FindingKind::File, 2), "{e:?}");
        let e = try_read("missing", &[], &format!("<shape type=\"{kind}\"/>")).expect_err("no name");
        assert_eq!(e.kind(), FindingKind::Missing, "{e:?}");
    }
}

#[test]
fn cylinders() {
    let read = |parameters: &str| {
        try_read("cylinder", &[], &format!("<shape type=\"cylinder\">{parameters}</shape>"))
    };
    let kind = |parameters: &str| read(parameters).expect("valid").desc.shapes[0].kind.clone();
    let (p0, p1) = (DVec3::ZERO, DVec3::Z);
    assert_eq!(kind(""), ShapeKind::Cylinder { p0, p1, radius: 1.0 });
    assert_eq!(
        kind(
            "<point name=\"p0\" value=\"1 2 3\"/><point name=\"p1\" x=\"4\" y=\"0\" z=\"0\"/><float name=\"radius\" value=\"0.5\"/>"
        ),
        ShapeKind::Cylinder { p0: DVec3::new(1.0, 2.0, 3.0), p1: DVec3::X * 4.0, radius: 0.5 }
    );
    for bad in ["<float name=\"radius\" value=\"0\"/>", "<point name=\"p1\" value=\"0 0 0\"/>"] {
        assert_eq!(read(bad).expect_err(bad).kind(), FindingKind::Value);
    }
}

#[test]
fn merged_shapes_are_shapes() {
    let read = |body: &str| try_read("merge", &[], body);
    let loaded = read(
        "<shape type=\"sphere\" id=\"ball\"/>
         <shape type=\"merge\"><shape type=\"cube\"/><shape type=\"merge\" id=\"pair\"><shape type=\"disk\"/><ref id=\"ball\"/></shape>
         <shape type=\"rectangle\"><emitter type=\"area\"/></shape></shape>
         <shape type=\"shapegroup\" id=\"g\"><ref id=\"pair\"/></shape><shape type=\"instance\"><ref id=\"g\"/></shape>",
    )
    .expect("valid");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let kinds: Vec<_> =
        loaded.desc.shapes.iter().map(|s| format!("{:.4}", format!("{:?}", s.kind))).collect();
    assert_eq!(kinds, ["Sphe", "Cube", "Disk", "Sphe", "Rect", "Inst"]);
    assert!(loaded.desc.shapes[4].emission.is_some());
    assert_eq!(loaded.desc.groups[0].shapes.len(), 2);
    let loaded = read("<shape type=\"merge\"><bsdf type=\"diffuse\"/></shape>").expect("valid");
    assert_eq!((loaded.warnings.len(), loaded.desc.shapes.len()), (1, 0));
}

#[test]
fn merged_shapes_that_do_not_end_are_refused() {
    let refused = |body: &str| try_read("merge_bad", &[], body).expect_err(body).kind();
    let itself = "<shape type=\"merge\" id=\"a\"><shape type=\"merge\"><ref id=\"a\"/></shape></shape>";
    assert_eq!(refused(itself), FindingKind::Reference);
    // 64 to the power of 10, without a single shape at the end.
    let many: String = (0..10)
        .map(|i| {
            let refs = format!("<ref id=\"m{}\"/>", i + 1).repeat(64);
            format!("<shape type=\"merge\" id=\"m{i}\">{refs}</shape>")
        })
        .collect();
    assert_eq!(refused(&(many + "<shape type=\"merge\" id=\"m10\"/>")), FindingKind::Limit);
}

/// Files are read all at once, and their errors still come in the order of the scene.
#[test]
fn errors_come_in_the_order_of_the_scene() {
    let files: [(&str, &[u8]); 2] = [("bad.ply", b"ply\nnonsense\n"), ("bad.obj", b"v 0 0\n")];
    let shape = |kind: &str, name: &str| {
        format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"{name}\"/></shape>\n")
    };
    let bad = [("obj", "missing.obj"), ("ply", "bad.ply"), ("obj", "bad.obj")];
    for i in 0..bad.len() {
        let body: String = (0..3).map(|k| bad[(i + k) % 3]).map(|(kind, name)| shape(kind, name)).collect();
        let error = try_read("order", &files, &body).expect_err("bad files");
        let shown = format!("{error} {:?}", error.location());
        assert!(shown.contains(bad[i].1), "{} {shown}", bad[i].1);
    }
}
