//! Lists the values of an object that can be changed, and names objects for the panel and for saved files.

use crate::scene::desc::{
    BlendDesc, BsdfDesc, BsdfId, MOST_PARTS, MaskDesc, MediumId, MixtureDesc, Name, Place, SceneDesc,
    ShapeDesc, ShapeKind, TwoSidedDesc,
};
use crate::scene::limits;

use super::parameters::parameters;
use super::target::{NewValue, ObjectKind, Target};

/// A value that can be changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Editable {
    /// Label in the panel, such as `reflectance (shared by 3 shapes)`.
    pub label: String,
    /// Identifies the value.
    pub target: Target,
    /// The value in the description; 1 for a factor.
    pub value: NewValue,
}

/// The values of shape `shape` (an index into [`SceneDesc::shapes`]) that can be changed: those of its emission, and those of its
/// material on either side, and those of its media; for an instance, those of the shapes of its group. Empty for a shape that does not exist.
///
/// A material or a medium that several shapes refer to is changed for all of them; the label says so. Transforms are not listed: each shape has one.
pub fn editable(desc: &SceneDesc, shape: u32) -> Vec<Editable> {
    let Some(described) = desc.shapes.get(shape as usize) else { return Vec::new() };
    let mut all: Vec<Editable> = of(desc, ObjectKind::Shape, shape, "");
    let mut bsdfs: Vec<(BsdfId, &ShapeDesc)> = Vec::new();
    for part in desc.parts(described) {
        if bsdfs.iter().all(|(known, _)| *known != part.bsdf) {
            bsdfs.push((part.bsdf, part));
        }
    }
    let several = bsdfs.len() > 1;
    let mut seen = Vec::new();
    for (bsdf, part) in bsdfs {
        let name = if several { format!(" of {}", part_name(desc, part)) } else { String::new() };
        for (id, side) in sides(desc, bsdf) {
            // Two pairs may have a side in common.
            if !seen.contains(&id) {
                seen.push(id);
                all.extend(of(desc, ObjectKind::Bsdf, id.0, &format!("{name}{side}{}", shared(desc, id))));
            }
        }
    }
    let mut seen: Vec<MediumId> = Vec::new();
    for (id, side) in desc.parts(described).iter().flat_map(media) {
        if !seen.contains(&id) {
            seen.push(id);
            all.extend(of(desc, ObjectKind::Medium, id.0, &medium_note(desc, id, side)));
        }
    }
    all
}

/// The media that a shape names, and the side on which each is.
fn media(shape: &ShapeDesc) -> impl Iterator<Item = (MediumId, &'static str)> {
    let interface = shape.medium_interface;
    let sides = [(interface.interior, "interior"), (interface.exterior, "exterior")];
    sides.into_iter().filter_map(|(id, side)| Some((id?, side)))
}

/// ` of medium "fog" (interior, shared by 3 shapes)`.
fn medium_note(desc: &SceneDesc, id: MediumId, side: &str) -> String {
    let name = match id_of(&desc.names.media, id.0 as usize) {
        Some(name) => format!("medium \"{name}\""),
        None => "the medium".to_owned(),
    };
    let names = |shape: &&ShapeDesc| desc.parts(shape).iter().flat_map(media).any(|(named, _)| named == id);
    match desc.shapes.iter().filter(names).count() {
        0 | 1 => format!(" of {name} ({side})"),
        count => format!(" of {name} ({side}, shared by {count} shapes)"),
    }
}

/// The materials that a material is made of and that have values, with what to say of each.
fn sides(desc: &SceneDesc, bsdf: BsdfId) -> Vec<(BsdfId, &'static str)> {
    let (mut all, mut open) = (Vec::new(), vec![(bsdf, "")]);
    // Deeper than any file can nest them: ends where materials form a circle.
    for _ in 0..limits::REFERENCE_DEPTH * MOST_PARTS {
        let Some((id, what)) = open.pop() else { break };
        match desc.bsdfs.get(id.0 as usize) {
            Some(BsdfDesc::TwoSided(TwoSidedDesc { front, back })) if front == back => {
                open.push((*front, what))
            }
            Some(BsdfDesc::TwoSided(TwoSidedDesc { front, back })) => {
                open.extend([(*back, " of the back"), (*front, " of the front")]);
            }
            Some(BsdfDesc::Blend(BlendDesc { bsdfs: [first, second], .. })) => {
                all.push((id, what));
                open.extend([(*second, " of the second part"), (*first, " of the first part")]);
            }
            Some(BsdfDesc::Mixture(MixtureDesc { parts })) => {
                const PARTS: [&str; MOST_PARTS] = [
                    " of the first part",
                    " of the second part",
                    " of the third part",
                    " of the fourth part",
                ];
                all.push((id, what));
                open.extend(parts.iter().zip(PARTS).map(|((bsdf, _), what)| (*bsdf, what)).rev());
            }
            Some(BsdfDesc::Mask(MaskDesc { bsdf, .. })) => {
                all.push((id, what));
                open.push((*bsdf, what));
            }
            Some(bsdf) if let Some(bump) = bsdf.bump() => open.push((bump.bsdf, what)),
            Some(bsdf) if let Some(coat) = bsdf.coat() => {
                all.push((id, " of the coat"));
                open.push((coat.bsdf, what));
            }
            _ => all.push((id, what)),
        }
    }
    all
}

/// Names the material of one shape of several for the panel: by its `id`, else by the shape's, else by the kind of shape.
fn part_name(desc: &SceneDesc, part: &ShapeDesc) -> String {
    let id = id_of(&desc.names.bsdfs, part.bsdf.0 as usize).or(part.id.as_deref());
    id.map_or_else(|| format!("the {}", part.kind.plugin()), str::to_owned)
}

/// The values of what has no surface that could be selected: lights other than shapes, and media.
pub fn lights_and_media(desc: &SceneDesc) -> Vec<Editable> {
    let lights = (0..desc.lights.len() as u32)
        .flat_map(|i| of(desc, ObjectKind::Light, i, &format!(" of {}", light_name(desc, i))));
    let traced = |i: &usize| desc.has_media() && *i < desc.media.len();
    let media = desc.used_media().into_iter().filter(traced).flat_map(|i| {
        let id = MediumId(i as u32);
        let place = if desc.camera.medium == Some(id) { " (around the camera)" } else { "" };
        of(desc, ObjectKind::Medium, id.0, &format!(" of {}{place}", medium_name(desc, id)))
    });
    lights.chain(media).collect()
}

fn of(desc: &SceneDesc, object: ObjectKind, index: u32, note: &str) -> Vec<Editable> {
    let listed = |target: &Target| !matches!(target, Target::ToWorld(_));
    let found = parameters().filter(|p| p.object == object && listed(&(p.target)(index))).filter_map(|p| {
        let value = (p.get)(desc, index)?;
        Some(Editable { label: format!("{}{note}", p.label), target: (p.target)(index), value })
    });
    found.collect()
}

/// ` (shared by 3 shapes)` for a material that is seen on more than one.
fn shared(desc: &SceneDesc, id: BsdfId) -> String {
    let shows = |of: BsdfId| sides(desc, of).iter().any(|side| side.0 == id);
    // Scenes may have many shapes but few materials: each is asked once.
    let showing: Vec<bool> = (0..desc.bsdfs.len() as u32).map(|i| shows(BsdfId(i))).collect();
    let shows = |s: &ShapeDesc| showing.get(s.bsdf.0 as usize) == Some(&true);
    let groups: Vec<bool> = desc.groups.iter().map(|group| group.shapes.iter().any(shows)).collect();
    let shows = |s: &&ShapeDesc| match s.kind {
        ShapeKind::Instance(group) => groups.get(group.0 as usize) == Some(&true),
        _ => shows(s),
    };
    let count = desc.shapes.iter().filter(shows).count();
    if count > 1 { format!(" (shared by {count} shapes)") } else { String::new() }
}

/// Names a shape for the panel: by its `id`, else by its kind with file and line.
pub fn shape_name(desc: &SceneDesc, shape: u32) -> String {
    match desc.shapes.get(shape as usize) {
        None => format!("shape {shape}, which does not exist"),
        Some(shape) => name_of(desc, shape),
    }
}

/// Names a shape, as [`shape_name`] does.
pub fn name_of(desc: &SceneDesc, shape: &ShapeDesc) -> String {
    named(desc, shape.id.as_deref(), shape.kind.plugin(), shape.place)
}

/// Names the material of a shape: by its `id`, else by its kind with file and line; `None` for an instance, which may have several.
pub fn material_name(desc: &SceneDesc, shape: u32) -> Option<String> {
    let shape = desc.shapes.get(shape as usize)?;
    if matches!(shape.kind, ShapeKind::Instance(_)) {
        return None;
    }
    let (bsdf, at) = (desc.bsdfs.get(shape.bsdf.0 as usize)?, shape.bsdf.0 as usize);
    Some(match id_of(&desc.names.bsdfs, at) {
        Some(id) => format!("{id} ({})", bsdf.plugin()),
        None => bsdf.plugin().to_owned(),
    })
}

/// Names a medium: by its `id`, else by its kind with file and line.
pub fn medium_name(desc: &SceneDesc, id: MediumId) -> String {
    let (i, named_as) = (id.0 as usize, desc.names.media.get(id.0 as usize));
    match (id_of(&desc.names.media, i), desc.media.get(i)) {
        (Some(id), _) => format!("medium \"{id}\""),
        (None, Some(medium)) => {
            let place = named_as.map_or_else(Place::default, |name| name.place);
            format!("a medium ({})", named(desc, None, medium.plugin(), place))
        }
        (None, None) => format!("medium {i}, which does not exist"),
    }
}

/// Names a light that is not a shape for the panel.
pub fn light_name(desc: &SceneDesc, light: u32) -> String {
    match desc.lights.get(light as usize) {
        None => format!("light {light}, which does not exist"),
        Some(l) => {
            let id = id_of(&desc.names.lights, light as usize);
            named(desc, id, l.plugin(), l.place())
        }
    }
}

fn named(desc: &SceneDesc, id: Option<&str>, kind: &str, place: Place) -> String {
    if let Some(id) = id {
        return id.to_owned();
    }
    let file = desc.files.get(place.file as usize).and_then(|f| f.file_name());
    match file {
        Some(file) => format!("{kind}, {}:{}", file.to_string_lossy(), place.line),
        None => kind.to_owned(),
    }
}

/// Identifies an object in a saved file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Address<'a> {
    /// Its `id`, if it has one.
    pub(crate) id: Option<&'a str>,
    pub(crate) kind: &'static str,
    /// Count of objects of this kind in the scene.
    pub(crate) count: usize,
}

/// The address of an object, or `None` if there is none of this index.
pub(crate) fn address(desc: &SceneDesc, object: ObjectKind, index: u32) -> Option<Address<'_>> {
    let i = index as usize;
    Some(match object {
        ObjectKind::Shape => {
            let shape = desc.shapes.get(i)?;
            Address { id: shape.id.as_deref(), kind: shape.kind.plugin(), count: desc.shapes.len() }
        }
        ObjectKind::Bsdf => Address {
            id: id_of(&desc.names.bsdfs, i),
            kind: desc.bsdfs.get(i)?.plugin(),
            count: desc.bsdfs.len(),
        },
        ObjectKind::Light => Address {
            id: id_of(&desc.names.lights, i),
            kind: desc.lights.get(i)?.plugin(),
            count: desc.lights.len(),
        },
        ObjectKind::Medium => Address {
            id: id_of(&desc.names.media, i),
            kind: desc.media.get(i)?.plugin(),
            count: desc.media.len(),
        },
    })
}

/// The object of a scene that has this address, which stood at `index` in another reading of it.
pub(crate) fn find(
    desc: &SceneDesc,
    object: ObjectKind,
    wanted: Option<Address<'_>>,
    index: u32,
) -> Option<u32> {
    let wanted = wanted?;
    let count = match object {
        ObjectKind::Shape => desc.shapes.len(),
        ObjectKind::Bsdf => desc.bsdfs.len(),
        ObjectKind::Light => desc.lights.len(),
        ObjectKind::Medium => desc.media.len(),
    };
    match wanted.id {
        Some(id) => (0..count as u32).find(|i| address(desc, object, *i).is_some_and(|a| a.id == Some(id))),
        None => (address(desc, object, index)? == wanted).then_some(index),
    }
}

fn id_of(names: &[Name], i: usize) -> Option<&str> {
    names.get(i)?.id.as_deref()
}
