//! Stages of USD: geometry, transforms, instances, cameras, and how layers are composed. What is right is by Pixar's `usd-core` 26.11
//! where it is not a closed form.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use pointillist::scene::desc::{FovAxis, LightDesc, ShapeKind};
use pointillist::scene::{Loaded, SceneDesc, load};
use pointillist::tracer::Camera;

/// Writes files into a folder of this test alone; returns the path of the first.
pub fn write(test: &str, files: &[(&str, &[u8])]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("usd").join(test);
    std::fs::create_dir_all(&folder).unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes).unwrap());
    folder.join(files[0].0)
}

/// A stage of these prims: the scene, and what is told.
pub fn stage(test: &str, prims: &str) -> (SceneDesc, Vec<String>) {
    layered(test, &[("stage.usda", &format!("#usda 1.0\n(\n    upAxis = \"Y\"\n)\n{prims}"))])
}

/// A stage of these layers, of which the first is the root.
pub fn layered(test: &str, layers: &[(&str, &str)]) -> (SceneDesc, Vec<String>) {
    let files: Vec<_> = layers.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
    let Loaded { desc, warnings } = load(&write(test, &files), &[]).unwrap_or_else(|e| panic!("{e:?}"));
    (desc, warnings.iter().map(ToString::to_string).collect())
}

/// A triangle with what else is in its braces.
pub fn triangle(name: &str, more: &str) -> String {
    format!(
        "def Mesh \"{name}\" {{\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n \
         point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n uniform token subdivisionScheme = \"none\"\n{more}\n}}\n"
    )
}

/// The corners of all triangles in the world, shape by shape.
pub fn world(desc: &SceneDesc) -> Vec<Vec<DVec3>> {
    let part = |shape: &pointillist::scene::desc::ShapeDesc| -> Vec<DVec3> {
        let instance = matches!(shape.kind, ShapeKind::Instance(_));
        desc.parts(shape)
            .iter()
            .flat_map(|part| {
                let ShapeKind::Mesh(id) = part.kind else { return Vec::new() };
                let to_world = if instance { shape.to_world * part.to_world } else { part.to_world };
                let mesh = &desc.meshes[id.0 as usize];
                let corners = mesh.triangles.iter().flatten().map(|i| mesh.positions[*i as usize]);
                corners.map(|p| to_world.transform_point3(p.as_dvec3())).collect()
            })
            .collect()
    };
    desc.shapes.iter().map(part).collect()
}

fn close(a: DVec3, b: [f64; 3]) -> bool {
    a.distance(DVec3::from(b)) < 1e-5
}

/// The crate would look for what is above such a name without end.
#[test]
fn prims_whose_names_are_none_are_left_out_or_refused() {
    for name in ["a}", "a.b c", "a}.b", ".", "a{b}c"] {
        let nested = format!("def Xform \"{name}\" {{\n{}\n}}\n", triangle("inner", ""));
        let text = format!("#usda 1.0\n{}{nested}", triangle("whole", ""));
        // The crate refuses some of them itself.
        match load(&write("names", &[("stage.usda", text.as_bytes())]), &[]) {
            Ok(loaded) => assert!(!loaded.desc.shapes.is_empty(), "{name}"),
            Err(error) => assert!(error.to_string().contains("not valid USD"), "{name}: {error}"),
        }
    }
    let (desc, told) = stage("names", &(triangle("whole", "") + &triangle("a}b", "")));
    assert!(desc.shapes.len() == 1 && told.iter().any(|words| words.contains("a}b")), "{told:?}");
}

/// Places that `UsdGeomXformCache` of usd-core gives for the same file.
#[test]
fn operations_of_a_transform_follow_each_other() {
    let (desc, warnings) = stage(
        "transforms",
        &format!(
            "def Xform \"a\" {{\n double3 xformOp:translate = (1, 2, 3)\n float3 xformOp:rotateXYZ = (10, 20, 30)\n \
             float3 xformOp:scale = (1, 2, 3)\n float3 xformOp:translate:pivot = (0.5, 0, 0)\n \
             uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:translate:pivot\", \"xformOp:rotateXYZ\", \
             \"xformOp:scale\", \"!invert!xformOp:translate:pivot\"]\n{}}}\n\
             def Xform \"b\" {{\n quatf xformOp:orient = (0.5, 0.5, 0.5, 0.5)\n \
             matrix4d xformOp:transform = ((1,0,0,0),(0,1,0,0),(0,0,1,0),(7,8,9,1))\n \
             uniform token[] xformOpOrder = [\"xformOp:orient\", \"xformOp:transform\"]\n{}}}\n",
            triangle("t", ""),
            triangle(
                "t",
                " float xformOp:rotateZ = 90\n uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:rotateZ\"]"
            ),
        ),
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let places = world(&desc);
    let expected = EXPECTED_PLACES;
    for (corner, place) in places[0].iter().zip(expected) {
        assert!(close(*corner, place), "{corner} {place:?}");
    }
    // The stack begins anew: a quarter turn takes x to y.
    assert!(close(places[1][1], [0.0, 1.0, 0.0]), "{:?}", places[1]);
}

/// By usd-core: the corners of the triangle in `a`.
const EXPECTED_PLACES: [[f64; 3]; 3] = [
    [1.093_101_159_325_313, 1.765_076_844_803_523, 3.171_010_071_662_834],
    [1.906_898_840_674_686_7, 2.234_923_155_196_477, 2.828_989_928_337_165_3],
    [0.211_161_938_265_548_3, 3.530_205_083_322_294_4, 3.497_361_893_995_903_7],
];

#[test]
fn a_stage_with_z_up_is_turned() {
    let text = format!("#usda 1.0\n(\n upAxis = \"Z\"\n metersPerUnit = 0.01\n)\n{}", triangle("t", ""));
    let (desc, warnings) = layered("z-up", &[("stage.usda", &text)]);
    assert!(warnings.is_empty(), "{warnings:?}");
    // y of the stage leads away from who looks along it.
    assert!(close(world(&desc)[0][2], [0.0, 0.0, -1.0]), "{:?}", world(&desc));
}

/// A pentagon that is not convex, a hole, and corners that go around with the clock.
#[test]
fn polygons_are_cut() {
    let mesh = |more: &str| {
        format!(
            "def Mesh \"m\" {{\n int[] faceVertexCounts = [5, 3]\n int[] faceVertexIndices = [0, 1, 2, 3, 4, 0, 1, 2]\n \
             point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0)]\n \
             uniform token subdivisionScheme = \"none\"\n{more}\n}}\n"
        )
    };
    let area = |desc: &SceneDesc| -> f64 {
        let corners = &world(desc)[0];
        corners.chunks(3).map(|t| 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).z).sum()
    };
    let (desc, warnings) = stage("polygons", &mesh(" int[] holeIndices = [1]"));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(desc.meshes[0].triangles.len(), 3);
    assert!((area(&desc) - 10.0).abs() < 1e-9, "16 less the notch of 6: {}", area(&desc));
    let (desc, _) = stage("polygons-left", &mesh(" uniform token orientation = \"leftHanded\""));
    assert!((area(&desc) + 18.0).abs() < 1e-9, "{}", area(&desc));
}

/// Texture coordinates of each interpolation, with and without indices; v goes upwards in USD and downwards here.
#[test]
fn primvars_lie_on_faces_points_and_corners() {
    let mesh = |st: &str| {
        format!(
            "def Mesh \"m\" {{\n int[] faceVertexCounts = [3, 3]\n int[] faceVertexIndices = [0, 1, 2, 2, 1, 3]\n \
             point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]\n uniform token subdivisionScheme = \"none\"\n \
             rel material:binding = </M>\n{st}\n}}\n{}",
            super::usd_materials::material(
                "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>",
                "wrong.png"
            )
        )
    };
    let uvs = |test: &str, st: &str| -> Vec<[f32; 2]> {
        let files = [("stage.usda", format!("#usda 1.0\n{}", mesh(st))), ("wrong.png", String::new())];
        let path = write(
            test,
            &[("stage.usda", files[0].1.as_bytes()), ("wrong.png", &super::usd_materials::png())],
        );
        let Loaded { desc, warnings } = load(&path, &[]).unwrap_or_else(|e| panic!("{e:?}"));
        assert!(warnings.is_empty(), "{warnings:?}");
        let mesh = &desc.meshes[0];
        mesh.triangles
            .iter()
            .flatten()
            .map(|i| mesh.uvs[*i as usize])
            .map(|uv: Vec2| [uv.x, 1.0 - uv.y])
            .collect()
    };
    let four = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let of = |corners: [usize; 6]| corners.map(|i| four[i]).to_vec();
    let values = "texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1), (1, 1)]";
    assert_eq!(uvs("st-vertex", &format!("{values} (interpolation = \"vertex\")")), of([0, 1, 2, 2, 1, 3]));
    assert_eq!(uvs("st-varying", &format!("{values} (interpolation = \"varying\")")), of([0, 1, 2, 2, 1, 3]));
    assert_eq!(
        uvs(
            "st-corners",
            &format!(
                "{values} (interpolation = \"faceVarying\")\n int[] primvars:st:indices = [3, 2, 1, 0, 1, 2]"
            )
        ),
        of([3, 2, 1, 0, 1, 2])
    );
    assert_eq!(
        uvs(
            "st-faces",
            &format!("{values} (interpolation = \"uniform\")\n int[] primvars:st:indices = [1, 2]")
        ),
        of([1, 1, 1, 2, 2, 2])
    );
    assert_eq!(uvs("st-one", "float2[] primvars:st = [(1, 1)]"), of([3; 6]));
}

/// Points of a cage have the normals of its faces by their areas; a mesh that is none is faceted; its own normals count.
#[test]
fn normals_are_made_for_subdivision_surfaces_alone() {
    let roof = |more: &str| {
        format!(
            "def Mesh \"m\" {{\n int[] faceVertexCounts = [4, 4]\n int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2]\n \
             point3f[] points = [(-1, 0, 1), (0, 1, 1), (0, 1, -1), (-1, 0, -1), (1, 0, 1), (1, 0, -1)]\n{more}\n}}\n"
        )
    };
    let (desc, warnings) = stage("cage", &roof(""));
    let ridge = desc.meshes[0].positions.iter().position(|p| *p == Vec3::new(0.0, 1.0, 1.0)).unwrap();
    let (desc_normal, down) = (desc.meshes[0].normals[ridge], Vec3::NEG_Y);
    assert!(desc_normal.distance(-down) < 1e-5 || desc_normal.distance(down) < 1e-5, "{desc_normal}");
    assert!(warnings.len() == 1 && warnings[0].contains("control mesh"), "{warnings:?}");
    let (desc, warnings) = stage("facets", &roof(" uniform token subdivisionScheme = \"none\""));
    assert!(desc.meshes[0].normals.is_empty() && warnings.is_empty(), "{warnings:?}");
    let own = " uniform token subdivisionScheme = \"none\"\n normal3f[] normals = [(1, 0, 0)] (interpolation = \"constant\")";
    let (desc, _) = stage("own-normals", &roof(own));
    assert!(desc.meshes[0].normals.iter().all(|n| *n == Vec3::X));
}

/// Volumes of solids by the divergence theorem over their triangles.
#[test]
fn solids_have_their_volumes() {
    use std::f64::consts::PI;
    for (kind, more, volume) in [
        ("Sphere", "double radius = 2", 4.0 / 3.0 * PI * 8.0),
        ("Cube", "double size = 3", 27.0),
        ("Cylinder", "double height = 3\n double radius = 2\n uniform token axis = \"X\"", PI * 12.0),
        ("Cone", "double height = 3\n double radius = 2\n uniform token axis = \"Y\"", PI * 4.0),
        ("Capsule", "double height = 3\n double radius = 1", PI * (3.0 + 4.0 / 3.0)),
    ] {
        let (desc, warnings) =
            stage(&format!("solid-{kind}"), &format!("def {kind} \"s\" {{\n {more}\n}}\n"));
        assert!(warnings.is_empty(), "{kind}: {warnings:?}");
        let corners = &world(&desc)[0];
        let measured: f64 = corners.chunks(3).map(|t| t[0].dot(t[1].cross(t[2])) / 6.0).sum();
        assert!((measured / volume - 1.0).abs() < 5e-3, "{kind}: {measured} {volume}");
        let [lo, hi] = corners
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
        assert!((lo + hi).length() < 1e-5, "{kind}: {lo} {hi}");
    }
}

/// Invisible prims, inactive ones, guides, proxies, classes and overs are not shown.
#[test]
fn what_is_not_to_be_seen_is_not_shown() {
    let at = |name: &str, x: i32, more: &str| {
        triangle(
            name,
            &format!(
                " double3 xformOp:translate = ({x}, 0, 0)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n{more}"
            ),
        )
    };
    let text = [
        at("seen", 1, " uniform token purpose = \"render\""),
        at("invisible", 2, " token visibility = \"invisible\""),
        at("proxy", 3, " uniform token purpose = \"proxy\""),
        at("guide", 4, " uniform token purpose = \"guide\""),
        at("inactive", 5, "").replace("\"inactive\" {", "\"inactive\" (active = false) {"),
        at("class", 6, "").replace("def Mesh", "class Mesh"),
        at("over", 7, "").replace("def Mesh", "over Mesh"),
        format!("def Xform \"hidden\" {{\n token visibility = \"invisible\"\n{}}}\n", at("below", 8, "")),
    ]
    .concat();
    let (desc, warnings) = stage("seen", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(world(&desc).iter().map(|corners| corners[0].x).collect::<Vec<_>>(), [1.0]);
}

/// Two instances of a reference share a group; a nested instance is in it, too.
#[test]
fn instances_are_groups() {
    let model = format!(
        "#usda 1.0\n(\n defaultPrim = \"Model\"\n)\ndef Xform \"Model\" {{\n{}def Xform \"in\" (instanceable = true\n \
         references = @part.usda@) {{\n double3 xformOp:translate = (0, 0, 5)\n \
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n}}\n",
        triangle("t", "")
    );
    let part =
        format!("#usda 1.0\n(\n defaultPrim = \"P\"\n)\ndef Xform \"P\" {{\n{}}}\n", triangle("p", ""));
    let instance = |name: &str, x: i32| {
        format!(
            "def Xform \"{name}\" (instanceable = true\n references = @model.usda@) {{\n \
             double3 xformOp:translate = ({x}, 0, 0)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n"
        )
    };
    let root = format!("#usda 1.0\n{}{}", instance("a", 10), instance("b", 20));
    let (desc, warnings) =
        layered("instances", &[("stage.usda", &root), ("model.usda", &model), ("part.usda", &part)]);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(
        (desc.groups.len(), desc.shapes.len(), desc.meshes.len()),
        (1, 2, 1),
        "equal meshes are kept once"
    );
    let firsts: Vec<[DVec3; 2]> = world(&desc).iter().map(|corners| [corners[0], corners[3]]).collect();
    let at = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 5.0)];
    assert_eq!(firsts, [at(10.0), at(20.0)]);
}

/// Positions, orientations, scales and hidden instances of a PointInstancer. Its prototypes are not shown themselves.
#[test]
fn point_instancers_show_their_prototypes() {
    let text = format!(
        "def PointInstancer \"i\" {{\n rel prototypes = [</i/a>, </i/b>]\n int[] protoIndices = [0, 1, 0, 1]\n \
         point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]\n \
         quath[] orientations = [(1, 0, 0, 0), (0.70711, 0, 0, 0.70711), (1, 0, 0, 0), (1, 0, 0, 0)]\n \
         float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1), (1, 1, 1)]\n int64[] ids = [7, 8, 9, 10]\n \
         int64[] invisibleIds = [9]\n double3 xformOp:translate = (0, 0, 1)\n \
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n{}{}}}\n",
        triangle("a", ""),
        triangle(
            "b",
            " double3 xformOp:translate = (0, 1, 0)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]"
        ),
    );
    let (desc, warnings) = stage("point-instancer", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    let firsts: Vec<DVec3> = world(&desc).iter().map(|corners| corners[0]).collect();
    let expected = [[1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [4.0, 1.0, 1.0]];
    for (first, expected) in firsts.iter().zip(expected) {
        assert!(first.distance(DVec3::from(expected)) < 1e-2, "{first} {expected:?}");
    }
    assert_eq!(firsts.len(), 3);
}

/// Sublayers, references, payloads and variants from other files; the chosen variant counts.
#[test]
fn layers_are_composed() {
    let shape = |size: i32| format!("def Cube \"c\" {{\n double size = {size}\n}}\n");
    let model = format!(
        "#usda 1.0\n(\n defaultPrim = \"M\"\n)\ndef Xform \"M\" (\n variants = {{ string size = \"big\" }}\n \
         prepend variantSets = \"size\"\n) {{\n variantSet \"size\" = {{\n \"small\" {{\n{}}}\n \"big\" {{\n{}}}\n }}\n}}\n",
        shape(1),
        shape(8)
    );
    let below =
        "#usda 1.0\ndef Xform \"r\" (payload = @model.usda@) {\n}\ndef Cube \"own\" {\n double size = 4\n}\n";
    let root = "#usda 1.0\n(\n subLayers = [@below.usda@]\n)\nover \"own\" {\n double size = 2\n}\n\
                def Xform \"s\" (references = @model.usda@\n variants = { string size = \"small\" }) {\n}\n";
    let (desc, warnings) =
        layered("composed", &[("stage.usda", root), ("below.usda", below), ("model.usda", &model)]);
    assert!(warnings.is_empty(), "{warnings:?}");
    let mut sizes: Vec<f64> =
        world(&desc).iter().map(|corners| 2.0 * corners.iter().map(|p| p.x).fold(0.0, f64::max)).collect();
    sizes.sort_by(f64::total_cmp);
    assert_eq!(sizes, [1.0, 2.0, 8.0]);
}

/// A camera of Maya's default aperture; its offsets; a lens; parallel rays.
#[test]
fn cameras_see_by_their_apertures() {
    let camera = |more: &str| {
        format!(
            "{}def Camera \"c\" {{\n float focalLength = 50\n float horizontalAperture = 36\n float verticalAperture = 24\n \
             float2 clippingRange = (0.5, 90)\n double3 xformOp:translate = (1, 2, 3)\n \
             uniform token[] xformOpOrder = [\"xformOp:translate\"]\n{more}\n}}\n",
            triangle("t", "")
        )
    };
    let (desc, warnings) = stage("camera", &camera(""));
    assert!(warnings.is_empty(), "{warnings:?}");
    let seen = &desc.camera;
    let fov = seen.perspective().unwrap().fov;
    assert!((fov - 2.0 * (18.0_f64 / 50.0).atan().to_degrees()).abs() < 1e-9, "{fov}");
    assert_eq!(
        (seen.perspective().unwrap().fov_axis, seen.near_clip, seen.far_clip),
        (FovAxis::X, 0.5, 90.0)
    );
    assert_eq!((desc.film.width, desc.film.height), (1080, 720));
    assert!(close(seen.to_world.transform_vector3(DVec3::Z), [0.0, 0.0, -1.0]));
    assert!(close(seen.to_world.translation, [1.0, 2.0, 3.0]));
    let (desc, _) = stage("lens", &camera(" float fStop = 2\n float focusDistance = 7"));
    // 50 tenths of a unit over 2, halved.
    assert!((desc.camera.lens_radius() - 1.25).abs() < 1e-9, "{}", desc.camera.lens_radius());
    assert_eq!(desc.camera.perspective().unwrap().lens.focus_distance, 7.0);
    // The film reaches a quarter of its width farther to the right and an eighth of its height farther up.
    let moved = " float horizontalApertureOffset = 9\n float verticalApertureOffset = 3";
    for (name, more) in [("shift", ""), ("shift-parallel", "\n token projection = \"orthographic\"")] {
        let (desc, warnings) = stage(name, &camera(&format!("{moved}{more}")));
        assert!(warnings.is_empty(), "{warnings:?}");
        let eye = Camera::of(&desc).unwrap();
        let ahead = desc.space.point(DVec3::new(1.0, 2.0, -7.0));
        let seen = eye.screen_position(ahead).unwrap();
        assert!((seen.x - 0.25).abs() < 1e-6 && (seen.y - 0.625).abs() < 1e-6, "{name}: {seen}");
    }
    let (desc, _) = stage("parallel", &camera(" token projection = \"orthographic\""));
    assert!(desc.camera.is_orthographic());
    let half = desc.camera.to_world.transform_vector3(DVec3::X).length();
    assert!((half - 1.8).abs() < 1e-9, "{half}");
}

/// A stage without a camera and lights has those of all models.
#[test]
fn a_stage_alone_has_a_sky_and_is_framed() {
    let (desc, warnings) = stage("alone", "def Sphere \"s\" {\n double radius = 3\n}\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!(matches!(desc.lights[0], LightDesc::Map { .. }), "a sky");
    let distance = desc.camera.to_world.translation.length();
    assert!((5.0..30.0).contains(&distance), "{distance}");
}

/// The first time is shown where there is no default, and that is told.
#[test]
fn animations_are_told_and_shown_at_their_first_time() {
    let text = triangle(
        "t",
        " double3 xformOp:translate.timeSamples = { 5: (5, 0, 0), 9: (9, 0, 0) }\n \
         uniform token[] xformOpOrder = [\"xformOp:translate\"]",
    );
    let (desc, warnings) = stage("animated", &text);
    assert!(close(world(&desc)[0][0], [5.0, 0.0, 0.0]), "{:?}", world(&desc));
    assert!(warnings.len() == 1 && warnings[0].contains("animations are not played"), "{warnings:?}");
}

/// Each missing layer is told once, and the rest is shown; layers in a circle are no endless loop.
#[test]
fn missing_and_circular_layers_are_told() {
    let missing =
        "def Xform \"a\" (references = @gone.usda@) {\n}\ndef Xform \"b\" (references = @gone.usda@) {\n}\n";
    let (desc, warnings) = stage("missing", &format!("{missing}{}", triangle("t", "")));
    assert_eq!(desc.shapes.len(), 1);
    assert!(warnings.len() == 1 && warnings[0].contains("gone.usda"), "{warnings:?}");
    let circle =
        format!("#usda 1.0\ndef Xform \"a\" (references = @stage.usda@</a>) {{\n{}}}\n", triangle("t", ""));
    let (desc, warnings) = layered("circle", &[("stage.usda", &circle)]);
    assert_eq!(desc.shapes.len(), 1);
    assert!(warnings.len() == 1 && warnings[0].contains("back to itself"), "{warnings:?}");
}

/// Numbers may begin with their point, as Pixar's reader has it; words and paths stay as they are.
#[test]
fn numbers_begin_with_a_point() {
    let (desc, warnings) =
        stage("points", "def Cube \"c\" (doc = \"x .5 (.5\") {\n double size = .5 # .5\n}\n");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(world(&desc)[0].iter().map(|p| p.x).fold(0.0, f64::max), 0.25);
}

/// The place of a fault of the text.
#[test]
fn faults_of_the_text_have_a_line_and_a_column() {
    let path = write(
        "fault",
        &[("stage.usda", b"#usda 1.0\n\ndef Mesh \"m\" {\n    int[] faceVertexCounts = [3, x]\n}\n")],
    );
    let error = load(&path, &[]).expect_err("a fault");
    let shown = format!("{:?}", miette::Report::new(error));
    assert!(shown.contains("stage.usda:4:"), "{shown}");
}

/// Points and normals as `UsdSkel.BakeSkinning` of usd-core gives them for the same file.
#[test]
fn a_skeleton_bends_its_mesh() {
    let unit = "(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)";
    let joints = format!("[({unit}, (0, 0, 0, 1)), ({unit}, (0, 1, 0, 1))]");
    let text = format!(
        "def SkelRoot \"r\" (prepend apiSchemas = [\"SkelBindingAPI\"]) {{\n double3 xformOp:translate = (0, 0, 1)\n \
         uniform token[] xformOpOrder = [\"xformOp:translate\"]\n rel skel:skeleton = </r/s>\n \
         rel skel:animationSource = </r/a>\n\
         def Skeleton \"s\" {{\n uniform token[] joints = [\"a\", \"a/b\"]\n uniform matrix4d[] bindTransforms = {joints}\n \
         uniform matrix4d[] restTransforms = {joints}\n}}\n\
         def SkelAnimation \"a\" {{\n uniform token[] joints = [\"a/b\"]\n \
         float3[] translations.timeSamples = {{ 1: [(0, 1, 0)], 5: [(9, 9, 9)] }}\n \
         quatf[] rotations.timeSamples = {{ 1: [(0.70710678, 0, 0, 0.70710678)] }}\n half3[] scales = [(1, 1, 1)]\n}}\n\
         def Mesh \"m\" (prepend apiSchemas = [\"SkelBindingAPI\"]) {{\n int[] faceVertexCounts = [3]\n \
         int[] faceVertexIndices = [0, 1, 2]\n point3f[] points = [(0, 0, 0), (1, 2, 0), (0, 2, 0)]\n \
         normal3f[] normals = [(0, 0, 1), (1, 0, 0), (0, 0, 1)] (interpolation = \"vertex\")\n \
         uniform token subdivisionScheme = \"none\"\n \
         matrix4d primvars:skel:geomBindTransform = ({unit}, (0.5, 0, 0, 1))\n \
         int[] primvars:skel:jointIndices = [0, 1, 0, 1, 1, 0] (elementSize = 2\n interpolation = \"vertex\")\n \
         float[] primvars:skel:jointWeights = [1, 0, 0.5, 0.5, 1, 0] (elementSize = 2\n interpolation = \"vertex\")\n \
         double3 xformOp:translate = (5, 5, 5)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]\n}}\n}}\n"
    );
    let (desc, warnings) = stage("skel", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    let corners = &world(&desc)[0];
    let expected = [[0.5, 0.0, 1.0], [0.25, 2.25, 1.0], [-1.0, 1.5, 1.0]];
    assert!(corners.iter().zip(expected).all(|(a, b)| close(*a, b)), "{corners:?}");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let normal = desc.meshes[0].normals[1];
    assert!(normal.distance(Vec3::new(half, half, 0.0)) < 1e-5, "{normal}");
}
