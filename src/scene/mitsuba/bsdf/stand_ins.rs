//! Plugins that are rendered as another material, with a remark: those that polarise light.

use super::plastic;
use crate::scene::desc::{BsdfDesc, MaskDesc};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::params::Params;
use crate::scene::mitsuba::reader::{PluginTable, Reader};
use crate::scene::mitsuba::texture;
use crate::spectrum::Spectrum;

/// Every `<bsdf type="…">` that another material stands for.
pub(crate) const STAND_INS: PluginTable<BsdfDesc> = &[
    ("pplastic", pplastic),
    ("polarizer", |reader, params| filter(reader, params, 0.5)),
    ("circular", |reader, params| filter(reader, params, 0.5)),
    ("retarder", |reader, params| filter(reader, params, 1.0)),
];

/// `roughplastic` whose reflection polarises.
fn pplastic(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let message = "light has no polarisation here: `pplastic` is rendered as `roughplastic`";
    params.note(params.type_fault(message).advice());
    Ok(plastic::rough(reader, params)?.into())
}

/// A sheet that lets a share of unpolarised light straight through, and absorbs the rest.
fn filter(reader: &mut Reader<'_>, params: &Params<'_>, share: f32) -> Result<BsdfDesc, SceneError> {
    params.default("transmittance", 1);
    let given = texture::read(reader, params, "transmittance")?;
    let transmittance = given.as_ref().map_or(1.0, |texture| texture.mean_scalar());
    if given.is_some_and(|texture| texture.varies() || !texture.is_grey()) {
        let message = "`transmittance` is one number here: its mean luminance is taken";
        params.note(params.error("transmittance", message).warning());
    }
    for name in ["theta", "delta", "left_handed"] {
        params.has(name);
    }
    let through = share * transmittance.clamp(0.0, 1.0);
    let message =
        format!("light has no polarisation here: this `{}` lets {through} of it through", params.plugin());
    params.note(params.type_fault(message).advice());
    Ok(MaskDesc { bsdf: reader.default_bsdf(true), opacity: Spectrum::Constant(1.0 - through).into() }.into())
}
