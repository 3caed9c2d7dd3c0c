//! Nothing in a USD file is ignored without a word: attributes, types and shaders that are not known are told with their places.

use super::usd::{stage, triangle};
use super::usd_materials::material;

/// Types of prims whose attributes are read.
const KINDS: &[&str] = &[
    "Xform",
    "Scope",
    "Mesh",
    "Sphere",
    "Cube",
    "Cylinder",
    "Cone",
    "Capsule",
    "Plane",
    "BasisCurves",
    "Points",
    "Camera",
    "DistantLight",
    "SphereLight",
    "RectLight",
    "DiskLight",
    "CylinderLight",
    "DomeLight",
    "PointInstancer",
];

#[test]
fn an_unknown_attribute_of_each_type_is_told() {
    for kind in KINDS {
        let text = format!(
            "{}def {kind} \"p\" {{\n float unheardOf = 1\n rel unheardOfToo = </t>\n}}\n",
            triangle("t", " float primvars:unheardOf = 1")
        );
        let (_, warnings) = stage(&format!("words-{kind}"), &text);
        for name in ["`unheardOf`", "`unheardOfToo`"] {
            let told = warnings.iter().any(|w| w.contains(name) && w.contains("/p"));
            assert!(told, "{kind} {name}: {warnings:?}");
        }
        assert!(
            warnings.iter().any(|w| w.contains("primvars:unheardOf") && w.contains("/t")),
            "{warnings:?}"
        );
    }
}

#[test]
fn unknown_types_are_told_once_with_their_number() {
    let text = format!(
        "{}def Unheard \"a\" {{\n float x = 1\n}}\ndef Unheard \"b\" {{\n}}\ndef Volume \"v\" {{\n}}\n",
        triangle("t", "")
    );
    let (desc, warnings) = stage("words-types", &text);
    assert_eq!(desc.shapes.len(), 1);
    assert!(warnings.iter().any(|w| w.contains("`Unheard`") && w.contains("/a and 1 more")), "{warnings:?}");
    assert!(warnings.iter().any(|w| w.contains("`Volume`")) && warnings.len() == 2, "{warnings:?}");
}

#[test]
fn unknown_shaders_and_their_inputs_are_told() {
    let mesh = triangle("t", " rel material:binding = </M>\n texCoord2f[] primvars:st = [(0, 0)]");
    let inputs = "color3f inputs:diffuseColor.connect = </M/N.outputs:out>\n float inputs:unheardOf = 1\n float inputs:occlusion = 0.5\n \
                  float inputs:displacement = 0.5";
    let text = material(inputs, "none.png").replace(
        "def Shader \"T\"",
        "def Shader \"N\" {\n uniform token info:id = \"UnheardNoise\"\n}\ndef Shader \"T\"",
    );
    let (_, warnings) = stage("words-shaders", &format!("{mesh}{text}"));
    for name in ["`UnheardNoise`", "`inputs:unheardOf`", "`inputs:occlusion`", "`inputs:displacement`"] {
        assert!(warnings.iter().any(|w| w.contains(name)), "{name}: {warnings:?}");
    }
    let (_, warnings) = stage(
        "words-surface",
        &format!("{mesh}{}", material("", "none.png").replace("UsdPreviewSurface", "UnheardSurface")),
    );
    assert!(warnings.iter().any(|w| w.contains("`UnheardSurface`") && w.contains("/M")), "{warnings:?}");
}
