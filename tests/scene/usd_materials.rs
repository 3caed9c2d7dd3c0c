//! Materials of USD: UsdPreviewSurface, its textures, and which material a prim has.

use glam::Vec2;
use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::desc::{BsdfDesc, PrincipledDesc};
use pointillist::scene::{Loaded, SceneDesc, load};

use super::models::inner;
use super::usd::{stage, triangle, write};
pub use crate::support::models::png;

/// A material `/M` with these inputs of its surface; its texture shader `/M/T` reads `picture` by the primvar `st`.
pub fn material(inputs: &str, picture: &str) -> String {
    with_texture(inputs, picture, "")
}

fn with_texture(inputs: &str, picture: &str, more: &str) -> String {
    format!(
        "def Material \"M\" {{\n token outputs:surface.connect = </M/S.outputs:surface>\n\
         def Shader \"S\" {{\n uniform token info:id = \"UsdPreviewSurface\"\n {inputs}\n token outputs:surface\n}}\n\
         def Shader \"T\" {{\n uniform token info:id = \"UsdUVTexture\"\n asset inputs:file = @{picture}@\n \
         float2 inputs:st.connect = </M/R.outputs:result>\n{more}\n}}\n\
         def Shader \"R\" {{\n uniform token info:id = \"UsdPrimvarReader_float2\"\n string inputs:varname = \"st\"\n}}\n}}\n"
    )
}

/// A triangle with this material, its texture `picture.png` beside it: the scene and what is told.
fn shown(test: &str, material: &str) -> (SceneDesc, Vec<String>) {
    let mesh = triangle(
        "t",
        " rel material:binding = </M>\n texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1)] (interpolation = \"vertex\")\n \
         color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = \"vertex\")\n \
         float[] primvars:displayOpacity = [0.25, 0.5, 0.75] (interpolation = \"vertex\")",
    );
    let text = format!("#usda 1.0\n{mesh}{material}");
    let path = write(test, &[("stage.usda", text.as_bytes()), ("picture.png", &png())]);
    let Loaded { desc, warnings } = load(&path, &[]).unwrap_or_else(|e| panic!("{e:?}"));
    (desc, warnings.iter().map(ToString::to_string).collect())
}

fn principled(desc: &SceneDesc) -> &PrincipledDesc {
    let bsdf = inner(desc, desc.parts(&desc.shapes[0])[0].bsdf);
    let BsdfDesc::Principled(material) = bsdf else { panic!("{bsdf:?}") };
    material
}

fn rgb(texture: &SpectrumTexture) -> [f32; 3] {
    texture.uniform().unwrap_or_else(|| panic!("{texture:?}")).reflected_rgb()
}

fn near(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 5e-3)
}

/// The same numbers as in the same material of glTF.
#[test]
fn a_preview_surface_is_principled() {
    let (desc, warnings) = shown(
        "preview",
        &material(
            "color3f inputs:diffuseColor = (0.8, 0.4, 0.2)\n float inputs:metallic = 0.25\n float inputs:roughness = 0.3\n \
             float inputs:ior = 1.7\n float inputs:clearcoat = 0.5\n float inputs:clearcoatRoughness = 0.2\n \
             color3f inputs:emissiveColor = (3, 2, 1)",
            "picture.png",
        ),
    );
    let material = principled(&desc);
    let lobes = &material.lobes;
    assert!(near(rgb(&material.base_color), [0.8, 0.4, 0.2]));
    assert_eq!((lobes.metallic, lobes.roughness, lobes.eta, lobes.clearcoat), (0.25, 0.3, 1.7, 0.5));
    // α of the coat is .2².
    assert!((0.1 - 0.099 * lobes.clearcoat_gloss - 0.04).abs() < 1e-6, "{}", lobes.clearcoat_gloss);
    let emission = desc.shapes[0].emission.as_ref().expect("it shines");
    let [r, g, b] = emission.emitted_rgb();
    assert!(near([r / b, g / b, 1.0], [3.0, 2.0, 1.0]), "{r} {g} {b}");
    assert!(warnings.len() == 1 && warnings[0].contains("clearcoat"), "{warnings:?}");
    // Defaults of the specification.
    let (desc, warnings) = shown("preview-defaults", &material_of_nothing());
    let material = principled(&desc);
    assert!(near(rgb(&material.base_color), [0.18; 3]));
    assert_eq!((material.lobes.metallic, material.lobes.roughness, material.lobes.eta), (0.0, 0.5, 1.5));
    assert!(desc.shapes[0].emission.is_none() && warnings.is_empty(), "{warnings:?}");
}

fn material_of_nothing() -> String {
    material("", "picture.png")
}

/// A weak grey reflection is an index of refraction; that of gold is metal.
#[test]
fn the_specular_workflow_is_converted() {
    let specular = |test: &str, color: &str| {
        let inputs = format!(
            "color3f inputs:diffuseColor = (0, 0, 0)\n int inputs:useSpecularWorkflow = 1\n color3f inputs:specularColor = {color}"
        );
        shown(test, &material(&inputs, "picture.png")).0
    };
    let matt = specular("specular-matt", "(0.04, 0.04, 0.04)");
    assert!((principled(&matt).lobes.eta - 1.5).abs() < 1e-5);
    let gold = specular("specular-gold", "(1, 0.8, 0.3)");
    let gold = principled(&gold);
    assert!((gold.lobes.metallic - 1.0).abs() < 0.01, "{}", gold.lobes.metallic);
    assert!(rgb(&gold.base_color).iter().zip([1.0, 0.8, 0.3]).all(|(a, b)| (a - b).abs() < 0.02));
}

/// Texels: red and green above, blue and white below. USD's (0, 0) is the lower left corner.
#[test]
fn pictures_are_scaled_moved_and_turned() {
    let color = |test: &str, more: &str, at: [f32; 2]| -> [f32; 3] {
        let inputs = "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>";
        let (desc, warnings) = shown(test, &with_texture(inputs, "picture.png", more));
        assert!(warnings.is_empty(), "{warnings:?}");
        let SpectrumTexture::Bitmap(texture) = &principled(&desc).base_color else { panic!() };
        // From USD's coordinates to those here.
        let uv = texture.to_uv.transform_point2(Vec2::new(at[0], 1.0 - at[1]));
        let cell = |v: f32| (v.rem_euclid(1.0) * 2.0) as usize;
        texture.bitmap.texel(cell(uv.x), cell(uv.y))
    };
    assert_eq!(color("texture", "", [0.25, 0.75]), [1.0, 0.0, 0.0]);
    assert_eq!(color("texture-low", "", [0.25, 0.25]), [0.0, 0.0, 1.0]);
    let scaled = color(
        "texture-scale",
        " float4 inputs:scale = (0.5, 1, 1, 1)\n float4 inputs:bias = (0.25, 0, 0, 0)",
        [0.25, 0.75],
    );
    assert!((scaled[0] - 0.75).abs() < 5e-3, "{scaled:?}");
    let raw = color("texture-raw", " token inputs:sourceColorSpace = \"raw\"", [0.25, 0.75]);
    assert_eq!(raw, [1.0, 0.0, 0.0]);
    // A quarter turn against the clock takes (x, y) to (−y, x): what is asked at (.25, .25) is there at (−.25, .25).
    let text = material("color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>", "picture.png")
        .replace("</M/R.outputs:result>", "</M/X.outputs:result>")
        .replace(
            "def Shader \"R\"",
            "def Shader \"X\" {\n uniform token info:id = \"UsdTransform2d\"\n float2 inputs:in.connect = </M/R.outputs:result>\n \
             float inputs:rotation = 90\n}\ndef Shader \"R\"",
        );
    let (desc, warnings) = shown("texture-turned", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    let SpectrumTexture::Bitmap(texture) = &principled(&desc).base_color else { panic!() };
    let uv = texture.to_uv.transform_point2(Vec2::new(0.25, 0.75));
    assert!(Vec2::new(uv.x, 1.0 - uv.y).distance(Vec2::new(-0.25, 0.25)) < 1e-6, "{uv}");
}

/// Channels as numbers; alpha as opacity with a threshold.
#[test]
fn channels_are_numbers() {
    let inputs = "float inputs:roughness.connect = </M/T.outputs:g>\n float inputs:metallic.connect = </M/T.outputs:r>\n \
                  float inputs:opacity.connect = </M/T.outputs:a>\n float inputs:opacityThreshold = 0.6";
    let (desc, warnings) =
        shown("channels", &with_texture(inputs, "picture.png", " token inputs:sourceColorSpace = \"raw\""));
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::Mask(mask) = &desc.bsdfs[desc.parts(&desc.shapes[0])[0].bsdf.0 as usize] else { panic!() };
    // Red is half transparent, below the threshold.
    let opacity = |u: f32, v: f32| mask.opacity.scalar(&TexturePoint::from(Vec2::new(u, v)));
    assert_eq!((opacity(0.25, 0.25), opacity(0.75, 0.25)), (0.0, 1.0));
    let BsdfDesc::Principled(material) = inner(&desc, mask.bsdf) else { panic!() };
    let lobes = |u: f32, v: f32| material.lobes.at(&material.textures, &TexturePoint::from(Vec2::new(u, v)));
    assert_eq!((lobes(0.25, 0.25).metallic, lobes(0.75, 0.25).metallic), (1.0, 0.0));
    assert_eq!((lobes(0.25, 0.75).roughness, lobes(0.75, 0.25).roughness), (0.0, 1.0));
}

/// Colours of vertices where the material reads them, and where there is no material.
#[test]
fn colors_of_vertices_are_read() {
    let text = material("color3f inputs:diffuseColor.connect = </M/C.outputs:result>", "picture.png").replace(
        "def Shader \"R\"",
        "def Shader \"C\" {\n uniform token info:id = \"UsdPrimvarReader_float3\"\n string inputs:varname = \"displayColor\"\n}\n\
         def Shader \"R\"",
    );
    let (desc, warnings) = shown("vertex-colors", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(desc.meshes[0].attributes[0].values[..3], [1.0, 0.0, 0.0]);
    let (desc, warnings) = shown("display-colors", "");
    assert!(warnings.len() == 1, "the material is not there: {warnings:?}");
    assert_eq!(desc.meshes[0].attributes.len(), 2, "colour and opacity");
    let one = triangle("t", " color3f[] primvars:displayColor = [(0.9, 0.5, 0.1)]");
    let (desc, warnings) = stage("display-color", &one);
    assert!(warnings.is_empty(), "{warnings:?}");
    let BsdfDesc::Diffuse(paint) = inner(&desc, desc.shapes[0].bsdf) else { panic!("{:?}", desc.bsdfs) };
    assert!(near(rgb(&paint.reflectance), [0.9, 0.5, 0.1]));
}

/// The base colours of the shapes, by whose material they have.
fn reds(desc: &SceneDesc) -> Vec<f32> {
    let red = |shape: &pointillist::scene::desc::ShapeDesc| match inner(desc, shape.bsdf) {
        BsdfDesc::Principled(material) => (rgb(&material.base_color)[0] * 100.0).round() / 100.0,
        other => panic!("{other:?}"),
    };
    desc.shapes.iter().map(red).collect()
}

fn plain(name: &str, red: f32) -> String {
    format!(
        "def Material \"{name}\" {{\n token outputs:surface.connect = </{name}/S.outputs:surface>\n\
         def Shader \"S\" {{\n uniform token info:id = \"UsdPreviewSurface\"\n \
         color3f inputs:diffuseColor = ({red}, 0.5, 0.5)\n}}\n}}\n"
    )
}

/// As `UsdShadeMaterialBindingAPI.ComputeBoundMaterial` has it.
#[test]
fn the_nearest_binding_counts_unless_one_above_is_stronger() {
    let all = [plain("A", 0.1), plain("B", 0.2), plain("C", 0.3), plain("D", 0.4)].concat();
    let group =
        |name: &str, how: &str, inside: &str| format!("def Xform \"{name}\" {{\n {how}\n{inside}}}\n");
    let own = triangle("own", " rel material:binding = </B>");
    let text = [
        group("plain", "rel material:binding = </A>", &format!("{own}{}", triangle("none", ""))),
        group("strong", "rel material:binding = </A> (bindMaterialAs = \"strongerThanDescendants\")", &own),
        group("full", "rel material:binding:full = </C>\n rel material:binding = </A>", &own),
        format!(
            "def Xform \"members\" (prepend apiSchemas = [\"CollectionAPI:some\"]) {{\n rel collection:some:includes = </members/in>\n \
             rel material:binding:collection:some = [</members.collection:some>, </D>]\n rel material:binding = </A>\n{}{}}}\n",
            triangle("in", ""),
            triangle("out", "")
        ),
        all,
    ]
    .concat();
    let (desc, warnings) = stage("bindings", &text);
    let unread = warnings.iter().filter(|w| !w.contains("collection:some")).count();
    assert_eq!(unread, 0, "{warnings:?}");
    assert_eq!(reds(&desc), [0.2, 0.1, 0.1, 0.3, 0.4, 0.1]);
}

#[test]
fn subsets_of_faces_have_their_materials() {
    let subset = |name: &str, faces: &str, material: &str| {
        format!(
            "def GeomSubset \"{name}\" {{\n uniform token elementType = \"face\"\n uniform token familyName = \"materialBind\"\n \
             int[] indices = {faces}\n rel material:binding = </{material}>\n}}\n"
        )
    };
    let text = format!(
        "def Mesh \"m\" {{\n int[] faceVertexCounts = [3, 3, 3]\n int[] faceVertexIndices = [0, 1, 2, 0, 2, 3, 0, 3, 1]\n \
         point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]\n uniform token subdivisionScheme = \"none\"\n \
         rel material:binding = </C>\n{}{}}}\n{}{}{}",
        subset("a", "[0]", "A"),
        subset("b", "[2]", "B"),
        plain("A", 0.1),
        plain("B", 0.2),
        plain("C", 0.3)
    );
    let (desc, warnings) = stage("subsets", &text);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(reds(&desc), [0.1, 0.2, 0.3]);
    assert!(desc.meshes.iter().all(|mesh| mesh.triangles.len() == 1));
}

/// A missing picture is one message, and the fallback is used.
#[test]
fn a_missing_picture_is_its_fallback() {
    let inputs = "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>";
    let (desc, warnings) = shown(
        "no-picture",
        &with_texture(inputs, "gone.png", " float4 inputs:fallback = (0.1, 0.6, 0.2, 1)"),
    );
    assert!(warnings.len() == 1 && warnings[0].contains("gone.png"), "{warnings:?}");
    assert!(near(rgb(&principled(&desc).base_color), [0.1, 0.6, 0.2]));
}

/// Networks of MaterialX and MDL beside a preview surface need no word; alone they are clay, and that is told.
#[test]
fn other_networks_are_told_where_they_are_alone() {
    let alone = "def Material \"M\" {\n token outputs:mtlx:surface.connect = </M/S.outputs:out>\n\
                 def Shader \"S\" {\n uniform token info:id = \"ND_standard_surface_surfaceshader\"\n}\n}\n";
    let (_, warnings) = shown("materialx", alone);
    assert!(warnings.len() == 1 && warnings[0].contains("outputs:mtlx:surface"), "{warnings:?}");
    let both = plain("M", 0.7).replace(
        "token outputs:surface",
        "token outputs:mdl:surface.connect = </M/N.outputs:out>\n token outputs:surface",
    );
    let (desc, warnings) = shown("mdl-beside", &both);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(reds(&desc), [0.7]);
}
