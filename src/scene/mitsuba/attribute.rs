//! Mesh attributes: which of them the material of a shape asks for, and where their numbers are when a point of it is shaded.

use std::collections::BTreeSet;

use super::params::Params;
use super::reader::Reader;
use crate::scene::desc::emission_texture::EmissionProfile;
use crate::scene::desc::texture::{ATTRIBUTE_NUMBERS, AttributeLayout, SpectrumTexture};
use crate::scene::desc::{BsdfDesc, BsdfId, MeshAttribute, ShapeKind};
use crate::scene::diagnostic::{FindingKind, SceneError};

/// The attributes that the material of a shape asks for.
pub(crate) fn asked_by(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Vec<String>, SceneError> {
    let Some(id) = params.object("bsdf")? else { return Ok(Vec::new()) };
    let bsdf = reader.bsdf(id)?;
    Ok(asked(&reader.lists.bsdfs, bsdf).into_iter().collect())
}

/// The attributes that a material asks for, and all that it is made of.
fn asked(bsdfs: &[BsdfDesc], id: BsdfId) -> BTreeSet<String> {
    let bsdf = &bsdfs[id.0 as usize];
    let own = bsdf.textures().into_iter().flat_map(SpectrumTexture::attributes);
    let nested = bsdf.nested().into_iter().flat_map(|id| asked(bsdfs, id));
    own.map(|texture| texture.name.to_string()).chain(nested).collect()
}

/// Counts a shape whose material has a picture that its mesh has no texture coordinates for.
pub(crate) fn count_unmapped(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    kind: &ShapeKind,
    bsdf: BsdfId,
    emission: &EmissionProfile,
) {
    let ShapeKind::Mesh(id) = kind else { return };
    let mesh = &reader.lists.meshes[id.0 as usize];
    let unmapped = mesh.uvs.is_empty() && !mesh.triangles.is_empty();
    if unmapped && (emission.texture.is_some() || has_picture(&reader.lists.bsdfs, bsdf)) {
        reader.known.unmapped.get_or_insert((params.span(), 0)).1 += 1;
    }
}

/// True for a material with a texture over (u, v), or one that is made of such.
fn has_picture(bsdfs: &[BsdfDesc], id: BsdfId) -> bool {
    let bsdf = &bsdfs[id.0 as usize];
    let over_uv = |texture: &SpectrumTexture| {
        matches!(texture, SpectrumTexture::Bitmap(_) | SpectrumTexture::Checkerboard(_))
    };
    bsdf.bump().is_some()
        || bsdf.textures().into_iter().any(over_uv)
        || bsdf.nested().into_iter().any(|id| has_picture(bsdfs, id))
}

/// Checks that a shape has the attributes that its material asks for, and finds places for their numbers.
pub(crate) fn lay_out(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    kind: &ShapeKind,
    bsdf: BsdfId,
) -> Result<(), SceneError> {
    let names = asked(&reader.lists.bsdfs, bsdf);
    for name in &names {
        let attributes = match kind {
            ShapeKind::Mesh(id) => reader.lists.meshes[id.0 as usize].attributes.as_slice(),
            _ => &[],
        };
        let Some(attribute) = attributes.iter().find(|attribute| attribute.name == *name) else {
            let what = format!("this `{}`", params.plugin());
            let message =
                format!("a texture of this shape is the mesh attribute `{name}`, which {what} does not have");
            let help = "a `ply` has `vertex_color` by the properties red, green and blue, and `vertex_NAME` by NAME_x, or by NAME_x, \
                        NAME_y and NAME_z; an `obj` and a `serialized` may have `vertex_color`";
            return Err(params.fault(FindingKind::Missing, message).help(help).error());
        };
        let (colored, mean) = (attribute.channels == 3, mean(attribute));
        let known = &mut reader.known.attributes;
        let taken = names.iter().filter(|other| *other != name).filter_map(|other| known.get(other)).copied();
        let taken: Vec<AttributeLayout> = taken.collect();
        let fits = |layout: &AttributeLayout| {
            let free =
                range(layout).end <= ATTRIBUTE_NUMBERS && !taken.iter().any(|other| overlap(layout, other));
            free && layout.colored == colored
        };
        let layout = match known.get(name) {
            Some(layout) => Some(*layout),
            // Single numbers from the end on, so that a colour fits beside one.
            None => (0..ATTRIBUTE_NUMBERS)
                .map(|i| if colored { i } else { ATTRIBUTE_NUMBERS - 1 - i })
                .map(|first| AttributeLayout { first, colored, mean })
                .find(|layout| fits(layout)),
        };
        let Some(layout) = layout.filter(fits) else {
            let message = format!(
                "there is no room for the mesh attribute `{name}`: a material can use {ATTRIBUTE_NUMBERS} numbers of attributes, of which \
                 a colour takes three, and a name stands for one or three in the whole scene"
            );
            return Err(params.fault(FindingKind::Limit, message).error());
        };
        known.insert(name.clone(), layout);
    }
    Ok(())
}

/// Tells what was counted, and all textures where the numbers are.
pub(crate) fn finish(reader: &mut Reader<'_>) {
    if let Some((span, count)) = reader.known.unmapped {
        let more =
            if count > 1 { format!(", like those of {} more shapes", count - 1) } else { String::new() };
        let message = format!(
            "the mesh of this shape has no texture coordinates for the texture of its material{more}: each triangle shows the same part of it"
        );
        let found = reader.document.finding(FindingKind::Mesh, span, message);
        reader.warn(found.help("export the mesh with texture coordinates").warning());
    }
    let known = &reader.known.attributes;
    for bsdf in reader.lists.bsdfs.iter_mut().filter(|_| !known.is_empty()) {
        bsdf.for_each_attribute(|texture| {
            texture.layout = known.get(&*texture.name).copied().unwrap_or(AttributeLayout::UNKNOWN);
        });
    }
}

/// The places of the numbers.
fn range(layout: &AttributeLayout) -> std::ops::Range<usize> {
    layout.first..layout.first + if layout.colored { 3 } else { 1 }
}

fn overlap(a: &AttributeLayout, b: &AttributeLayout) -> bool {
    let (a, b) = (range(a), range(b));
    a.start < b.end && b.start < a.end
}

/// The mean of the values, three times where there is one.
fn mean(attribute: &MeshAttribute) -> [f32; 3] {
    let MeshAttribute { channels, values, .. } = attribute;
    let count = (values.len() / channels).max(1) as f64;
    let sum =
        |i: usize| values.iter().skip(i % channels).step_by(*channels).map(|v| f64::from(*v)).sum::<f64>();
    [0, 1, 2].map(|i| (sum(i) / count) as f32)
}
