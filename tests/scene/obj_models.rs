//! OBJ, MTL and PLY files as other programs write them, and what is told of all that is not used.

use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::{Compression, write::ZlibEncoder};
use glam::{Vec2, Vec3};
use pointillist::math::random::Random;
use pointillist::scene::desc::texture::TexturePoint;
use pointillist::scene::desc::{BsdfDesc, BsdfId, Mesh, ShapeKind};
use pointillist::scene::{Loaded, SceneDesc, load};
use pointillist::spectrum::SampledWavelengths;
use pointillist::tracer::accel::Ray;

use crate::support::models::png;

pub const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
pub const CORNERS: &str = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
pub const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

/// Writes files into a folder of this test alone; returns the path of the first.
pub fn write(test: &str, files: &[(&str, &[u8])]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("obj_models").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes).unwrap());
    folder.join(files[0].0)
}

/// A square with the material `a` of this MTL file; the pictures `a.png` and `my tex 2.png` are beside it.
pub fn square(test: &str, mtl: &str) -> Loaded {
    let obj = format!("mtllib a.mtl\n{SQUARE}{CORNERS}usemtl a\n{FACE}");
    let picture = png();
    let path = write(
        test,
        &[
            ("m.obj", obj.as_bytes()),
            ("a.mtl", format!("newmtl a\n{mtl}").as_bytes()),
            ("a.png", &picture),
            ("my tex 2.png", &picture),
        ],
    );
    load(&path, &[]).unwrap_or_else(|e| panic!("{mtl}: {e:?}"))
}

/// The material within two sides.
pub fn inner(desc: &SceneDesc, id: BsdfId) -> &BsdfDesc {
    match &desc.bsdfs[id.0 as usize] {
        BsdfDesc::TwoSided(both) => inner(desc, both.front),
        other => other,
    }
}

pub fn only(desc: &SceneDesc) -> &BsdfDesc {
    inner(desc, desc.shapes[0].bsdf)
}

fn mesh(desc: &SceneDesc) -> &Mesh {
    let ShapeKind::Mesh(id) = desc.shapes[0].kind else { panic!("{:?}", desc.shapes) };
    &desc.meshes[id.0 as usize]
}

pub fn messages(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn faces_keep_texture_coordinates_that_others_have_not() {
    let obj =
        format!("mtllib m.mtl\nv 2 -1 0\n{SQUARE}{CORNERS}usemtl a\nf 2/1 3/2 4/3 5/4\nusemtl b\nf 1 2 4\n");
    let mtl = "newmtl a\nmap_Kd a.png\nnewmtl b\nKd 0.1 0.8 0.1\n";
    let path = write("some-uvs", &[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("a.png", &png())]);
    let loaded = load(&path, &[]).unwrap();
    assert_eq!(messages(&loaded), [""; 0]);
    let uvs: Vec<usize> = loaded.desc.meshes.iter().map(|mesh| mesh.uvs.len()).collect();
    assert_eq!(uvs, [4, 0]);
}

/// The colour of a shape's material at its vertex, or on its face, of this index.
fn color_at(desc: &SceneDesc, index: usize) -> [f32; 3] {
    let values = mesh(desc).attributes[0].values.as_chunks().0;
    values[index]
}

#[test]
fn colours_of_vertices_and_faces_are_seen_without_a_material() {
    let obj = "v -1 -1 0 1 0 0\nv 1 -1 0 1 0 0\nv 1 1 0 0 0 1\nv -1 1 0 0 0 1\nf 1 2 3 4\n";
    let Loaded { desc, warnings } = load(&write("colours", &[("m.obj", obj.as_bytes())]), &[]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((color_at(&desc, 0), color_at(&desc, 2)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
    let BsdfDesc::Diffuse(paint) = only(&desc) else { panic!("{:?}", only(&desc)) };
    let mut at = TexturePoint::default();
    at.attributes[..3].copy_from_slice(&[1.0, 0.0, 0.0]);
    let lambda = SampledWavelengths::sample(0.5);
    assert!(paint.reflectance.sample(&at, &lambda).0.max_element() > 0.0);
    // Beside materials, where a face has none.
    let obj = format!("mtllib a.mtl\n{obj}usemtl a\nf 1 2 3\n");
    let path = write("colours-mtl", &[("m.obj", obj.as_bytes()), ("a.mtl", b"newmtl a\nKd 1 1 1\n")]);
    let loaded = load(&path, &[]).unwrap();
    assert_eq!(loaded.desc.meshes[0].attributes.len() + loaded.desc.meshes[1].attributes.len(), 1);
    assert!(messages(&loaded)[0].contains("colours of vertices are not used"), "{:?}", loaded.warnings);
    for names in ["red green blue", "r g b", "diffuse_red diffuse_green diffuse_blue"] {
        let properties: String = names.split(' ').map(|name| format!("property uchar {name}\n")).collect();
        let ply = ply("", "", &properties, ["", ""], [" 255 0 0", " 0 0 255"]);
        let Loaded { desc, .. } = load(&write("face-colours", &[("m.ply", ply.as_bytes())]), &[]).unwrap();
        assert_eq!((color_at(&desc, 0), color_at(&desc, 1)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]), "{names}");
    }
}

/// A PLY square of two triangles: lines of the header, properties of vertices and of faces, and what their rows end with: those of
/// vertices with y = −1 and y = 1, and those of the faces.
fn ply(header: &str, vertex: &str, face: &str, rows: [&str; 2], faces: [&str; 2]) -> String {
    format!(
        "ply\nformat ascii 1.0\n{header}element vertex 4\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
         element face 2\nproperty list uchar int vertex_indices\n{face}end_header\n\
         -1 -1 0{}\n1 -1 0{}\n1 1 0{}\n-1 1 0{}\n3 0 1 2{}\n3 0 2 3{}\n",
        rows[0], rows[0], rows[1], rows[1], faces[0], faces[1]
    )
}

#[test]
fn texture_coordinates_of_a_ply_have_many_spellings() {
    for names in [
        "u v",
        "s t",
        "texture_u texture_v",
        "texture_s texture_t",
        "tx ty",
        "texcoord_u texcoord_v",
        "tex_u tex_v",
    ] {
        let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
        let ply = ply("comment TextureFile a.png\n", &properties, "", [" 0.25 0", " 0.25 1"], ["", ""]);
        let loaded = load(&write("spellings", &[("m.ply", ply.as_bytes()), ("a.png", &png())]), &[]).unwrap();
        assert_eq!(messages(&loaded), [""; 0], "{names}");
        // Photogrammetry counts v upwards.
        assert_eq!(
            (mesh(&loaded.desc).uvs[0], mesh(&loaded.desc).uvs[2]),
            (Vec2::new(0.25, 1.0), Vec2::new(0.25, 0.0))
        );
        assert!(matches!(only(&loaded.desc), BsdfDesc::Diffuse(paint) if paint.reflectance.varies()));
    }
    let tangents = "property float tx\nproperty float ty\nproperty float tz\n";
    let loaded = load(
        &write("tangents", &[("m.ply", ply("", tangents, "", [" 1 0 0"; 2], ["", ""]).as_bytes())]),
        &[],
    )
    .unwrap();
    assert!(mesh(&loaded.desc).uvs.is_empty());
    assert_eq!(messages(&loaded), ["not used: `vertex.tx`, `vertex.ty`, `vertex.tz`"]);
}

#[test]
fn faces_of_a_ply_have_texture_coordinates_and_pictures() {
    let list = "property list uchar float texcoord\n";
    let one = ply("comment TextureFile a.png\n", "", list, ["", ""], [" 6 0 0 1 0 1 1", " 6 0 0.5 1 1 0 1"]);
    let loaded = load(&write("wedges", &[("m.ply", one.as_bytes()), ("a.png", &png())]), &[]).unwrap();
    assert_eq!(messages(&loaded), [""; 0]);
    let found = mesh(&loaded.desc);
    assert_eq!((found.triangles[1], found.positions.len()), ([4, 2, 3], 5));
    assert_eq!(
        (found.uvs[0], found.uvs[4], found.uvs[2]),
        (Vec2::new(0.0, 1.0), Vec2::new(0.0, 0.5), Vec2::new(1.0, 0.0))
    );
    let header = "comment TextureFile a.png\ncomment TextureFile my tex 2.png\n";
    let uv = " 6 0 0 1 0 1 1";
    let two = ply(
        header,
        "",
        &format!("{list}property int texnumber\n"),
        ["", ""],
        [&format!("{uv} 1"), &format!("{uv} 0")],
    );
    let files: [(&str, &[u8]); 3] = [("m.ply", two.as_bytes()), ("a.png", &png()), ("my tex 2.png", &png())];
    let loaded = load(&write("pictures", &files), &[]).unwrap();
    assert_eq!(messages(&loaded), [""; 0]);
    assert_eq!(loaded.desc.shapes.len(), 2);
    assert!(loaded.desc.meshes.iter().all(|mesh| mesh.triangles.len() == 1 && mesh.uvs.len() == 3));
    // Without texture coordinates a picture is of no use.
    let none = ply("comment TextureFile a.png\n", "", "", ["", ""], ["", ""]);
    let loaded = load(&write("no-uvs", &[("m.ply", none.as_bytes()), ("a.png", &png())]), &[]).unwrap();
    assert!(messages(&loaded)[0].contains("no texture coordinates"), "{:?}", loaded.warnings);
}

/// A scene that shows shapes, written as text.
fn scene(test: &str, shapes: &str, files: &[(&str, &[u8])]) -> Result<Loaded, String> {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>{shapes}</scene>"
    );
    let all: Vec<(&str, &[u8])> =
        [("scene.xml", text.as_bytes())].into_iter().chain(files.iter().copied()).collect();
    load(&write(test, &all), &[]).map_err(|e| format!("{e:?}"))
}

/// One message, however many shapes, in groups as well, and whatever the format.
#[test]
fn a_picture_on_a_mesh_without_texture_coordinates_is_told() {
    let obj = format!("{SQUARE}f 1 2 3 4\n");
    let ply = ply("", "", "", ["", ""], ["", ""]);
    let bsdf = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"a.png\"/></texture></bsdf></bsdf>";
    let shape = |kind: &str| {
        format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"m.{kind}\"/>{bsdf}</shape>")
    };
    let shapes = format!(
        "{}<shape type=\"shapegroup\" id=\"g\">{}</shape><shape type=\"instance\"><ref id=\"g\"/></shape>",
        shape("obj"),
        shape("ply")
    );
    let files: [(&str, &[u8]); 3] = [("m.obj", obj.as_bytes()), ("m.ply", ply.as_bytes()), ("a.png", &png())];
    let loaded = scene("unmapped", &shapes, &files).unwrap();
    let told = messages(&loaded);
    assert!(
        told.len() == 1 && told[0].contains("no texture coordinates") && told[0].contains("1 more"),
        "{told:?}"
    );
}

#[test]
fn a_mesh_without_area_draws_nothing_in_a_scene() {
    let flat = "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n";
    let shape =
        "<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape><shape type=\"sphere\"/>";
    let loaded = scene("flat", shape, &[("m.obj", flat.as_bytes())]).unwrap();
    let told = messages(&loaded);
    assert!(
        told.iter().any(|m| m.contains("no triangle that can be traced: nothing of it is seen")),
        "{told:?}"
    );
    assert!(mesh(&loaded.desc).triangles.is_empty());
    let prepared = pointillist::tracer::Scene::prepare(&loaded.desc);
    assert!(prepared.is_ok(), "{:?}", prepared.err());
    for (name, text) in [
        ("m.obj", flat),
        ("n.obj", "hello"),
        ("m.ply", &ply("", "", "", ["", ""], ["", ""]).replace('1', "0")),
    ] {
        assert!(load(&write("flat-model", &[(name, text.as_bytes())]), &[]).is_err(), "{name}");
    }
}

/// A mesh of `serialized` with these flags, and bytes after it.
fn serialized(flags: u32, after: &[u8], file_end: &[u8]) -> Vec<u8> {
    let mut raw = flags.to_le_bytes().to_vec();
    raw.extend(b"a\0");
    [3_u64, 1].iter().for_each(|n| raw.extend(n.to_le_bytes()));
    let rows =
        3 + 3 * u32::from(flags & 1 != 0) + 2 * u32::from(flags & 2 != 0) + 3 * u32::from(flags & 8 != 0);
    let mut random = Random(5);
    (0..3 * rows).for_each(|_| raw.extend((random.f64() as f32).to_le_bytes()));
    [0_u32, 1, 2].iter().for_each(|v| raw.extend(v.to_le_bytes()));
    raw.extend(after);
    let mut out = vec![0x1c, 0x04, 4, 0];
    let mut zlib = ZlibEncoder::new(&mut out, Compression::default());
    zlib.write_all(&raw).unwrap();
    zlib.finish().unwrap();
    out.extend([0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    out.extend(file_end);
    out
}

/// One thing that no reader knows, in every position that a format has for it: each is told, or the file is refused.
#[test]
fn nothing_is_left_out_in_silence() {
    let mut positions = 0;
    let mut check = |format: &str, what: &str, told: Result<Vec<String>, String>, base: usize| {
        positions += 1;
        let silent = matches!(&told, Ok(told) if told.len() <= base);
        assert!(!silent, "{format}: nothing is told of {what}: {told:?}");
    };
    let all = |loaded: Loaded| messages(&loaded);
    // OBJ: a line of each place, and words after those of each statement.
    let lines: Vec<String> = format!("{SQUARE}{CORNERS}vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng a\no b\ns 1\n")
        .lines()
        .map(str::to_owned)
        .collect();
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>";
    let obj = |text: &str| scene("silent-obj", shape, &[("m.obj", text.as_bytes())]).map(all);
    assert_eq!(obj(&lines.join("\n")), Ok(Vec::new()));
    for i in 0..=lines.len() {
        for new in [
            "what 1 2",
            "l 1 2",
            "p 1",
            "usemtl a",
            "mtllib a",
            "vp 1 2",
            "cstype bezier",
            "f 1 2",
            "f 1 2 9",
            "f a b c",
        ] {
            let mut changed = lines.clone();
            changed.insert(i, new.to_owned());
            check("OBJ", &format!("`{new}` in line {}", i + 1), obj(&changed.join("\n")), 0);
        }
        let Some(line) = lines.get(i).filter(|line| line.starts_with('v') || line.starts_with('f')) else {
            continue;
        };
        for more in ["7", "0.5 0.5 0.5 0.5", "word"] {
            let mut changed = lines.clone();
            changed[i] = format!("{line} {more}");
            check("OBJ", &changed[i].clone(), obj(&changed.join("\n")), 0);
        }
    }
    let flat = format!("{SQUARE}s off\nf 1 2 3 4\n");
    check("OBJ", "`s off` without normals", obj(&flat), 0);
    check("OBJ", "colours", obj(&format!("v 0 0 0 1 0 0\n{}", lines.join("\n"))), 0);

    // MTL: a statement of each place, an option of each map, words after numbers.
    let statements = [
        "Ka 1 1 1",
        "Kd 1 1 1",
        "Ks 0.5 0.5 0.5",
        "Ke 1 1 1",
        "Ns 50",
        "Ni 1.5",
        "d 0.5",
        "illum 2",
        "map_Kd a.png",
        "map_d a.png",
        "map_Ke a.png",
        "map_Ks a.png",
        "bump a.png",
    ];
    let mtl = |statements: &[String]| Ok(all(square("silent-mtl", &(statements.join("\n") + "\n"))));
    let lines: Vec<String> = statements.iter().map(|s| (*s).to_owned()).collect();
    assert_eq!(mtl(&lines), Ok(Vec::new()));
    for i in 0..=lines.len() {
        for new in [
            "what 1",
            "map_What a.png",
            "map_Ns a.png",
            "refl a.png",
            "disp a.png",
            "decal a.png",
            "sharpness 100",
            "Tf 0 1 0",
            "Km 1",
            "map_aat on",
            "Pcr 0.5",
            "anisor 0.2",
            "illum 10",
            "newmtl a",
        ] {
            let mut changed = lines.clone();
            changed.insert(i, new.to_owned());
            // A second material of the name takes the place of the first.
            check("MTL", &format!("`{new}` at {i}"), mtl(&changed), 0);
        }
        let Some(line) = lines.get(i) else { continue };
        let (keyword, rest) = line.split_once(' ').unwrap();
        let mut replace = |line: String| {
            let mut changed = lines.clone();
            changed[i] = line.clone();
            check("MTL", &line, mtl(&changed), 0);
        };
        if rest == "a.png" {
            for option in [
                "-what 1",
                "-mm 0.5 1",
                "-t 1 1 1",
                "-texres 5",
                "-type sphere",
                "-boost 2",
                "-imfchan r",
                "-cc on",
                "-blendu off",
                "-blendv off",
            ] {
                replace(format!("{keyword} {option} a.png"));
            }
            replace(format!("{keyword} b.png"));
            replace(keyword.to_owned());
        } else if keyword != "Ka" {
            ["word", "7 8 9 10"].iter().for_each(|more| replace(format!("{line} {more}")));
            replace(keyword.to_owned());
            replace(format!("{keyword} word"));
        }
    }
    let stray = format!("mtllib a.mtl\n{SQUARE}f 1 2 3 4\n");
    let stray = load(&write("stray", &[("m.obj", stray.as_bytes()), ("a.mtl", b"Kd 1 1 1\n")]), &[]).unwrap();
    check("MTL", "a statement without a material", Ok(messages(&stray)), 0);

    // PLY: properties and lists of each element, elements, words of the header, bytes at the end.
    let shape = "<shape type=\"ply\"><string name=\"filename\" value=\"m.ply\"/></shape>";
    let read = |text: String| scene("silent-ply", shape, &[("m.ply", text.as_bytes())]).map(all);
    assert_eq!(read(ply("", "", "", ["", ""], ["", ""])), Ok(Vec::new()));
    for (property, row) in [
        ("property float what\n", " 1"),
        ("property list uchar int what\n", " 2 1 1"),
        ("property uchar red\n", " 1"),
        ("property float nx\n", " 1"),
        ("property float u\n", " 1"),
        ("property float confidence\nproperty float u\nproperty float v\n", " 1 2 3"),
        ("property list uchar float x0\n", " 0"),
        ("property float u\nproperty float v\nproperty float s\nproperty float t\n", " 1 2 3 4"),
    ] {
        check("PLY", property, read(ply("", property, "", [row, row], ["", ""])), 0);
        check("PLY", property, read(ply("", "", property, ["", ""], [row, row])), 0);
    }
    for header in
        ["element edge 1\nproperty int a\n", "what\n", "property float a\n", "obj_info\u{0}x\nwhat 1\n"]
    {
        check("PLY", header, read(ply(header, "", "", ["7\n", ""], ["", ""])), 0);
    }
    let after = ply("", "", "", ["", ""], ["", ""])
        .replace("end_header", "element edge 1\nproperty int a\nend_header")
        + "5\n";
    check("PLY", "an element at the end", read(after), 0);
    check("PLY", "bytes at the end", read(ply("", "", "", ["", ""], ["", ""]) + "5\n"), 0);
    let texcoord = "property list uchar float texcoord\n";
    check(
        "PLY",
        "a short list of texture coordinates",
        read(ply("", "", texcoord, ["", ""], [" 6 0 0 1 0 1 1", " 2 0 0"])),
        0,
    );
    let numbered = "property int texnumber\n";
    check("PLY", "numbers of pictures", read(ply("", "", numbered, ["", ""], [" 0", " 1"])), 0);

    // serialized: flags, and bytes after the mesh.
    let shape = "<shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/></shape>";
    let read = |bytes: Vec<u8>| scene("silent-serialized", shape, &[("m.serialized", &bytes)]).map(all);
    assert_eq!(read(serialized(0x1003, &[], &[])), Ok(Vec::new()));
    for flag in (0..32).map(|bit| 1_u32 << bit).filter(|flag| ![1, 2, 0x1000, 0x2000].contains(flag)) {
        check("serialized", &format!("flag {flag:#x}"), read(serialized(0x1000 | flag, &[], &[])), 0);
    }
    check("serialized", "bytes after the triangles", read(serialized(0x1000, &[1, 2, 3], &[])), 0);
    println!("{positions} positions");
    assert!(positions > 250, "{positions}");
}

/// Corners without normals get those of the faces around them; the others keep theirs.
#[test]
fn normals_are_made_where_there_are_none() {
    let obj = format!("{SQUARE}vn 0 1 1\nf 1//1 2//1 3//1\nf 1 3 4\n");
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>";
    let loaded = scene("some-normals", shape, &[("m.obj", obj.as_bytes())]).unwrap();
    let found = mesh(&loaded.desc);
    assert_eq!((found.normals[0], found.normals[3]), (Vec3::new(0.0, 1.0, 1.0).normalize(), Vec3::Z));
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
}

/// The faces that are left out count, and so do those that the tracer drops.
#[test]
fn faces_have_the_numbers_of_their_file() {
    let text = format!("{SQUARE}f 1 1 2\nf 1 2 3\nf 2 2 2\nf 2 3 3\nf 1 3 4\n");
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>";
    let loaded = scene("numbers", &format!("{shape}{shape}"), &[("m.obj", text.as_bytes())]).unwrap();
    assert_eq!(mesh(&loaded.desc).numbers, [1, 4]);
    let prepared = pointillist::tracer::Scene::prepare(&loaded.desc).unwrap();
    for (x, number) in [(0.001, 1), (-0.001, 4)] {
        let ray = Ray::new(Vec3::new(x, -x, 5.0), Vec3::NEG_Z);
        assert_eq!(prepared.index_in_shape(&prepared.first(&ray).expect("a hit")), number);
    }
}
