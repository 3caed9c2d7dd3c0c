//! `phong` of version 0.6: a lobe around the mirror direction over a diffuse part.

use super::values::{Number, color, number, warn_of_more_than_one};
use super::{Params, Reader};
use crate::scene::desc::{PhongDesc, SHARPEST_PHONG};
use crate::scene::diagnostic::SceneError;
use crate::spectrum::Spectrum;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PhongDesc, SceneError> {
    params.default("exponent", 30);
    let exponent = match number(reader, params, "exponent")? {
        None => Spectrum::Constant(30.0).into(),
        Some(Number::Varying(texture)) => texture,
        Some(Number::Uniform(v)) => {
            let most = f64::from(SHARPEST_PHONG);
            if v < 0.0 {
                return Err(params.error("exponent", "an exponent is not negative").error());
            }
            if v > most {
                let found = params.error("exponent", format!("this exponent counts as {most}"));
                params.note(found.help("a mirror is a `conductor`").warning());
            }
            Spectrum::Constant(v.min(most) as f32).into()
        }
    };
    let specular_reflectance = color(reader, params, "specular_reflectance", 0.2)?;
    let diffuse_reflectance = color(reader, params, "diffuse_reflectance", 0.5)?;
    warn_of_more_than_one(params, &specular_reflectance, &diffuse_reflectance);
    params.without_effect(&["specular_sampling_weight"]);
    Ok(PhongDesc { exponent, specular_reflectance, diffuse_reflectance })
}
