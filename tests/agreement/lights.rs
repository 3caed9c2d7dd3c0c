//! All methods agree on lights whose emission varies by place or direction, and on lights that stand in each other's way.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};

use crate::materials::open_room;
use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::scene::load;

/// The lights of `text`, which may name the pictures of the table scenes, over the floor with two spheres.
fn room_under(name: &str, text: &str) -> SceneDesc {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("agreement_{name}.xml"));
    let text =
        text.replace("PICTURE", root.join("scenes/plugins/emitter_area.png").to_str().expect("a path"));
    std::fs::write(&file, format!("<scene version='3.0.0'><sensor type='perspective'/>{text}</scene>"))
        .expect("a file for tests");
    let lights = load(&file, &[]).expect("valid").desc;
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    desc.lights = lights.lights;
    let first = desc.bsdfs.len() as u32;
    desc.bsdfs.extend(lights.bsdfs);
    for mut shape in lights.shapes {
        shape.bsdf.0 += first;
        desc.shapes.push(shape);
    }
    desc
}

const BITMAP: &str =
    "<texture type='bitmap' name='radiance'><string name='filename' value='PICTURE'/></texture>";

#[test]
fn textured_lamps() {
    let lamp = |plugin: &str, geometry: &str, emission: &str| {
        format!("<shape type='{plugin}'>{geometry}<emitter type='area'>{emission}</emitter></shape>")
    };
    let above = "<transform name='to_world'><rotate x='1' angle='180'/><translate x='-1' z='3'/></transform>";
    let checks = "<texture type='checkerboard' name='radiance'><rgb name='color0' value='8, 6, 2'/><rgb name='color1' value='0'/></texture>";
    let text = lamp("rectangle", above, BITMAP)
        + &lamp(
            "sphere",
            "<point name='center' x='1.5' y='-1' z='2'/><float name='radius' value='0.4'/>",
            checks,
        )
        + &lamp(
            "cylinder",
            "<point name='p0' x='-2' y='1' z='0.2'/><point name='p1' x='-2' y='1' z='2'/><float name='radius' value='0.2'/>",
            BITMAP,
        );
    assert_all_pairs("textured lamps", &room_under("lamps", &text), PLAN, PHOTONS);
}

#[test]
fn a_projector_and_a_spot_with_a_picture() {
    let picture = |name: &str| BITMAP.replace("radiance", name);
    let text = format!(
        "<emitter type='projector'><transform name='to_world'><lookat origin='1, -1, 4' target='0, 0, 0' up='0, 1, 0'/></transform>\
         <float name='fov' value='60'/><float name='scale' value='20'/>{}</emitter>\
         <emitter type='spot'><transform name='to_world'><lookat origin='-2, -2, 3' target='0, 0, 0' up='0, 1, 0'/></transform>\
         <float name='cutoff_angle' value='35'/><float name='intensity' value='50'/>{}</emitter>",
        picture("irradiance"),
        picture("texture"),
    );
    assert_all_pairs("projector and spot", &room_under("projector", &text), PLAN, PHOTONS);
}

/// An open box that shines on all its inner sides and a strip that shines beside it, one mesh: its triangles stand in each other's way.
#[test]
fn a_concave_mesh() {
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    let corner = |i: u32| {
        let [x, y] = [i & 1, i >> 1 & 1].map(|bit| bit as f32 - 0.5);
        Vec3::new(x, y, 2.2 + 0.9 * (i >> 2) as f32)
    };
    // Inwards: four walls and the lid, open below.
    let quads = [[0, 4, 5, 1], [3, 7, 6, 2], [1, 5, 7, 3], [2, 6, 4, 0], [4, 6, 7, 5]];
    let mut triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let mut positions: Vec<Vec3> = (0..8).map(corner).collect();
    positions.extend([Vec3::new(1.4, -0.5, 1.8), Vec3::new(1.4, 0.5, 1.8), Vec3::new(1.4, 0.0, 3.2)]);
    triangles.push([8, 10, 9]);
    let uvs = vec![Vec2::ZERO; positions.len()];
    desc.meshes.push(Arc::new(Mesh { positions, triangles, uvs, ..Mesh::default() }));
    let dark = material(&mut desc, grey(0.3));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::from_translation(DVec3::ZERO), dark, 4.0);
    assert_all_pairs("concave mesh", &desc, PLAN, PHOTONS);
}
