//! `ward` of version 0.6: an elliptic lobe over a diffuse part, as measured from brushed metal and varnished wood.

use super::roughness::ReadRoughness;
use super::values::{color, warn_of_more_than_one};
use super::{Params, Reader};
use crate::scene::desc::{Facets, WardDesc, WardVariant};
use crate::scene::diagnostic::SceneError;

pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<WardDesc, SceneError> {
    params.default("variant", "balanced");
    let variant = match params.string("variant")?.map(|name| name.to_lowercase()).as_deref() {
        None | Some("balanced") => WardVariant::Balanced,
        Some("ward") => WardVariant::Ward,
        Some("ward-duer") => WardVariant::Duer,
        Some(_) => {
            let found = params.error("variant", "there is no such variant of Ward's model");
            return Err(found.help("it is `ward`, `ward-duer` or `balanced`").error());
        }
    };
    let ReadRoughness { roughness, alpha } = ReadRoughness::along_tangents(reader, params, Facets::Beckmann)?;
    let specular_reflectance = color(reader, params, "specular_reflectance", 0.2)?;
    let diffuse_reflectance = color(reader, params, "diffuse_reflectance", 0.5)?;
    warn_of_more_than_one(params, &specular_reflectance, &diffuse_reflectance);
    params.without_effect(&["specular_sampling_weight"]);
    Ok(WardDesc { variant, specular_reflectance, diffuse_reflectance, roughness, alpha })
}
