//! `thindielectric`: a pane too thin to shift what is behind it.

use super::dielectric;
use super::{Params, Reader};
use crate::scene::desc::{DielectricDesc, ThinDielectricDesc};
use crate::scene::diagnostic::SceneError;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<ThinDielectricDesc, SceneError> {
    let DielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance } =
        dielectric::smooth(reader, params)?;
    Ok(ThinDielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance })
}
