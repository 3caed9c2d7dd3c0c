//! Files of versions 0.4 to 0.6: their names become those of Mitsuba 3, by the rules of its parser.
//!
//! Its parser (version 3.9.1) turns `camelCase` into `snake_case` in the names of parameters, calls the `diffuse_reflectance` of
//! `diffuse` `reflectance`, here also that of `roughdiffuse`, and makes `to_uv` of `uoffset`, `voffset`, `uscale` and `vscale`. Values, ids and `$names` stay as they are.
//! Here also the `density` of a `heterogeneous` medium becomes `sigma_t`.
//! `<lookAt>`, which Mitsuba 3 refuses, becomes `<lookat>`. Versions before 0.4 had other cameras and lights (`<camera>` looked at
//! a mirrored world): they are not read.

use super::document::{Document, Element, ElementId, XmlAttribute};
use super::tags;

/// The parameters that became `to_uv`: name, step of the transform, its attribute. Mitsuba 3 scales last.
const UV: &[(&str, &str, &str)] = &[
    ("uoffset", "translate", "x"),
    ("voffset", "translate", "y"),
    ("uscale", "scale", "x"),
    ("vscale", "scale", "y"),
];

/// The major version, if `version` begins with one.
pub(crate) fn major(version: &str) -> Option<u32> {
    version.trim().split('.').next().and_then(|major| major.parse().ok())
}

/// True for a version before 2, in which names were in `camelCase`.
pub(crate) fn is_old(version: &str) -> bool {
    major(version).is_some_and(|major| major < 2)
}

/// The present name of an element.
pub(crate) fn element(name: &str) -> &str {
    if name == "lookAt" { "lookat" } else { name }
}

/// `toWorld` as `to_world` and `intIOR` as `int_ior`: a run of capitals after a small letter is one word, others stay.
pub(crate) fn snake_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let (mut after_small, mut in_word) = (false, false);
    for c in name.chars() {
        in_word = c.is_ascii_uppercase() && (after_small || in_word);
        if in_word && after_small {
            out.push('_');
        }
        out.push(if in_word { c.to_ascii_lowercase() } else { c });
        after_small = c.is_ascii_lowercase();
    }
    out
}

/// Gives the parameters of a plugin their present form.
pub(crate) fn plugin(document: &mut Document, id: ElementId) {
    let plugin = document.element(id);
    let renamed = match (plugin.tag.name, plugin.value("type")) {
        ("bsdf", Some("diffuse" | "roughdiffuse")) => Some(("diffuse_reflectance", "reflectance")),
        ("medium", Some("heterogeneous")) => Some(("density", "sigma_t")),
        _ => None,
    };
    let mut moved: Vec<(&str, XmlAttribute)> = Vec::new();
    let mut kept = Vec::with_capacity(plugin.children.len());
    for child in plugin.children.clone() {
        let element = &mut document.elements[child.0 as usize];
        let name = element.value("name").unwrap_or_default();
        let number = matches!(element.tag.name, "float" | "integer");
        if let Some((_, step, axis)) = UV.iter().find(|(old, ..)| *old == name && number) {
            let value = element.value("value").unwrap_or_default().to_owned();
            moved.push((step, XmlAttribute { name: axis, value, span: element.span_of("value") }));
            continue;
        }
        if let Some((_, new)) = renamed.filter(|(old, _)| *old == name) {
            element.attributes.iter_mut().filter(|a| a.name == "name").for_each(|a| a.value = new.into());
        }
        kept.push(child);
    }
    let Some(first) = moved.first().map(|(_, a)| a.span) else { return };
    let mut push = |tag: &str, attributes: Vec<XmlAttribute>, children: Vec<ElementId>| {
        let tag = tags::find(tag)?;
        document.elements.push(Element { tag, span: first, attributes, children });
        Some(ElementId(document.elements.len() as u32 - 1))
    };
    let steps = ["translate", "scale"].map(|wanted| {
        let attributes = moved.extract_if(.., |(step, _)| *step == wanted).map(|(_, attribute)| attribute);
        push(wanted, attributes.collect(), Vec::new())
    });
    let name = XmlAttribute { name: "name", value: "to_uv".into(), span: first };
    kept.extend(push("transform", vec![name], steps.into_iter().flatten().collect()));
    document.elements[id.0 as usize].children = kept;
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use super::*;
    use crate::scene::mitsuba::expand::Expander;
    use crate::scene::mitsuba::transform;

    /// The matrix is the one that Mitsuba 3.9.1 prints.
    #[test]
    fn texture_offsets_and_scales_become_a_transform() {
        let text = "<scene version=\"0.6.0\"><texture type=\"checkerboard\"><float name=\"uoffset\" value=\"1\"/>\
                    <float name=\"uscale\" value=\"4\"/><rgb name=\"color0\" value=\"1\"/><float name=\"vscale\" value=\"2\"/>\
                    </texture></scene>";
        let (document, _) = Expander::new(&[]).string(Path::new("t.xml"), text.as_bytes()).expect("valid");
        let texture = document.elements.iter().find(|e| e.tag.name == "texture").expect("given");
        let children: Vec<&Element> = texture.children.iter().map(|c| document.element(*c)).collect();
        let names: Vec<_> = children.iter().filter_map(|c| c.value("name")).collect();
        assert_eq!(names, ["color0", "to_uv"]);
        let to_uv = transform::parse(&document, children[1]).expect("valid");
        assert_eq!(to_uv.transform_point3(DVec3::new(0.5, 0.5, 0.0)), DVec3::new(6.0, 1.0, 0.0));
    }

    #[test]
    fn names_change_as_mitsubas_parser_changes_them() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("kNN", "k_nn"),
            ("maxDepth", "max_depth"),
            ("principalPointOffsetX", "principal_point_offset_x"),
            ("alphaU", "alpha_u"),
            ("A", "A"),
            ("IOR", "IOR"),
            ("ABc", "ABc"),
            ("already_new", "already_new"),
            ("größeÄ", "größeÄ"),
            ("", ""),
        ] {
            assert_eq!(snake_case(old), new);
        }
        assert!(is_old("0.6.0") && is_old("1") && !is_old("2.0.0") && !is_old("3") && !is_old("x"));
    }
}
