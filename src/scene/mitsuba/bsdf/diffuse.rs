//! `diffuse`: Lambert's cosine law.

use super::values::color;
use super::{Params, Reader};
use crate::scene::desc::DiffuseDesc;
use crate::scene::diagnostic::SceneError;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<DiffuseDesc, SceneError> {
    Ok(DiffuseDesc { reflectance: color(reader, params, "reflectance", 0.5)? })
}
