//! `thindielectric`: a pane too thin to shift what is behind it.

use super::dielectric;
use crate::scene::desc::{DielectricDesc, ThinDielectricDesc};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::params::Params;
use crate::scene::mitsuba::reader::Reader;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<ThinDielectricDesc, SceneError> {
    let DielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance } =
        dielectric::smooth(reader, params)?;
    Ok(ThinDielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance })
}
