//! Materials as shapes and other materials refer to them: each is read once.

use super::{BsdfDesc, PLUGINS, STAND_INS};
use crate::scene::desc::{BsdfId, Name};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::scene::mitsuba::{ElementId, Params, Reader};

/// The material of an element; read once however often it is referred to.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<BsdfId, SceneError> {
    if let Some(&known) = reader.known.bsdfs.get(&id) {
        return Ok(known);
    }
    let element = reader.document.element(id);
    if reader.known.open_bsdfs.contains(&id) || reader.known.open_bsdfs.len() >= limits::REFERENCE_DEPTH {
        let message = "this material contains itself, or too many others within each other";
        return Err(reader.document.error(FindingKind::Reference, element.span, message));
    }
    let params = Params::new(reader.document, id)?;
    reader.known.open_bsdfs.push(id);
    let plugin = match STAND_INS.iter().find(|(known, _)| *known == params.plugin()) {
        Some((_, plugin)) => Ok(*plugin),
        None => {
            let others: Vec<&str> = STAND_INS.iter().map(|(known, _)| *known).collect();
            reader.plugin(&params, PLUGINS, &others)
        }
    };
    let read = plugin.and_then(|plugin| plugin(reader, &params));
    reader.known.open_bsdfs.pop();
    let bsdf = match read {
        Ok(bsdf) => {
            reader.finish(params);
            bsdf
        }
        unread => reader.or_instead(unread, "it is magenta", |_| BsdfDesc::magenta())?,
    };
    let name = reader.name(id);
    let new = push(reader, bsdf, name);
    reader.known.bsdfs.insert(id, new);
    Ok(new)
}

/// The material of a shape that names none: grey, or black if it emits, as Mitsuba.
pub(crate) fn default(reader: &mut Reader<'_>, emits: bool) -> BsdfId {
    if let Some(known) = reader.known.default_bsdfs[usize::from(emits)] {
        return known;
    }
    let new = push(reader, BsdfDesc::grey(if emits { 0.0 } else { 0.5 }), Name::default());
    reader.known.default_bsdfs[usize::from(emits)] = Some(new);
    new
}

fn push(reader: &mut Reader<'_>, bsdf: BsdfDesc, name: Name) -> BsdfId {
    reader.lists.names.bsdfs.push(name);
    reader.lists.bsdfs.push(bsdf);
    BsdfId(reader.lists.bsdfs.len() as u32 - 1)
}
