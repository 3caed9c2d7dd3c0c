//! `twosided`: a one-sided material for each side of a surface.

use super::{Params, Reader};
use crate::scene::desc::{BsdfDesc, BsdfId, TwoSidedDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<TwoSidedDesc, SceneError> {
    let sides = params.objects("bsdf");
    let document = reader.document;
    let wrong = |span, message: &str| Err(document.error(FindingKind::Parameter, span, message));
    let (front, back) = match sides.as_slice() {
        [one] => (*one, *one),
        [front, back] => (*front, *back),
        [] => {
            let message = "a twosided needs a bsdf for its front, and may have one for its back";
            return wrong(params.span(), message);
        }
        [_, _, (_, third), ..] => return wrong(*third, "a twosided has one or two bsdfs"),
    };
    let mut ids = [BsdfId(0); 2];
    for (out, (id, span)) in ids.iter_mut().zip([front, back]) {
        *out = reader.bsdf(id)?;
        match &reader.lists.bsdfs[out.0 as usize] {
            BsdfDesc::TwoSided(_) => return wrong(span, "this material is two-sided already"),
            bsdf if lets_through(reader, bsdf) => {
                return wrong(span, "a material that lets light through has two sides already");
            }
            _ => {}
        }
    }
    Ok(TwoSidedDesc { front: ids[0], back: ids[1] })
}

/// True for a material that transmits or has holes, or of which a part does.
fn lets_through(reader: &Reader<'_>, bsdf: &BsdfDesc) -> bool {
    let part = |id: BsdfId| lets_through(reader, &reader.lists.bsdfs[id.0 as usize]);
    let passes = matches!(bsdf, BsdfDesc::Mask(_) | BsdfDesc::Null(_));
    passes || bsdf.parts().transmission.is_some() || bsdf.nested().into_iter().any(part)
}
