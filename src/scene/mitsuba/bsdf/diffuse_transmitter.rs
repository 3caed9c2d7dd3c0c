//! `difftrans` of version 0.6: a thin sheet that spreads light to its other side.

use super::values::color;
use super::{Params, Reader};
use crate::scene::desc::DiffuseTransmitterDesc;
use crate::scene::diagnostic::SceneError;

pub(super) fn read(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
) -> Result<DiffuseTransmitterDesc, SceneError> {
    Ok(DiffuseTransmitterDesc { transmittance: color(reader, params, "transmittance", 0.5)? })
}
