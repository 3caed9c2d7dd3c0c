//! Reads the `<subsurface type="dipole">` of version 0.6, an approximation of the light that scatters beneath the surface of a shape.
//!
//! The shape becomes what is approximated: it gets an interior medium with these coefficients and, in the place of its bsdf, a boundary with these
//! indices of refraction. A bsdf that lets light through stays. Light is followed through the medium, and parameters of the approximation have no
//! effect.

use super::bsdf::ior;
use super::document::ElementId;
use super::params::Params;
use super::reader::{Reader, SubsurfaceMedium};
use super::{medium, phase};
use crate::scene::desc::{
    BsdfDesc, BsdfId, DielectricDesc, MediumDesc, MediumId, MediumInterface, Name, PhaseDesc,
    RoughDielectricDesc, ShapeKind,
};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::Ior;

/// The only plugin that is read.
const DIPOLE: &str = "dipole";

/// The medium that version 0.6 takes where none is given.
const DEFAULT: &str = "skin1";

/// The bsdf and the media of a shape, with the boundary and the interior of its `<subsurface>`, if it has one.
pub(super) fn applied(
    reader: &mut Reader<'_>,
    shape: &Params<'_>,
    kind: &ShapeKind,
    (bsdf, interface): (BsdfId, MediumInterface),
) -> Result<(BsdfId, MediumInterface), SceneError> {
    let Some(id) = shape.object("subsurface")? else { return Ok((bsdf, interface)) };
    let plugin = reader.document.element(id).value("type").unwrap_or_default();
    let unusable = if plugin != DIPOLE {
        Some((
            "of subsurface scattering only `dipole` is read",
            "give the shape a transparent bsdf and an `interior` medium",
        ))
    } else if matches!(kind, ShapeKind::Curves(_)) {
        Some(("curves bound no medium", "give it to a mesh or another shape"))
    } else if interface.interior.is_some() {
        Some(("the shape has an `interior` medium", "remove one of both"))
    } else {
        None
    };
    if let Some((why, help)) = unusable {
        let message = format!("the subsurface `{}` is left out: {why}", shorten(plugin));
        let span = reader.document.element(id).span;
        shape.note(reader.document.finding(FindingKind::Plugin, span, message).help(help).warning());
        return Ok((bsdf, interface));
    }
    let within = match reader.known.subsurfaces.get(&id) {
        Some(known) => known.clone(),
        None => dipole(reader, id)?,
    };
    let interface = MediumInterface { interior: Some(within.interior), ..interface };
    Ok((boundary(reader, (id, bsdf), &within), interface))
}

/// Reads the medium and the indices of a dipole.
fn dipole(reader: &mut Reader<'_>, id: ElementId) -> Result<SubsurfaceMedium, SceneError> {
    let params = Params::new(reader.document, id)?;
    params.without_effect(&["irr_samples", "irr_indirect", "quality", "sample_multiplier"]);
    let [sigma_t, albedo] = if medium::COEFFICIENTS.iter().any(|name| params.has(name)) {
        medium::coefficients(reader, &params)?
    } else {
        medium::measured(&params, DEFAULT)?
    };
    let scale = medium::scale(&params)?;
    let phase = match phase::mean_cosine(&params, 0.0)? {
        0.0 => PhaseDesc::Isotropic,
        g => PhaseDesc::HenyeyGreenstein { g },
    };
    let [int_ior, ext_ior] = if params.has("int_ior") || params.has("ext_ior") {
        [ior(&params, "int_ior", "bk7")?, ior(&params, "ext_ior", "air")?]
    } else {
        let is_marble =
            params.string("material")?.is_some_and(|name| name.trim().eq_ignore_ascii_case("marble"));
        [Ior::Constant(if is_marble { 1.5 } else { 1.3 }), Ior::Constant(1.0)]
    };
    let message = "the subsurface `dipole` is rendered as a medium of the same coefficients within the shape, behind a dielectric boundary";
    let help = "the shape has to be closed; `max_depth` would count every scattering in it and does not hold in this scene";
    params.note(params.type_fault(message).help(help).advice());
    reader.finish(params);
    let name = reader.name(id);
    reader.lists.names.media.push(name);
    reader.lists.media.push(MediumDesc { sigma_t, albedo, scale, phase, emission: None });
    let interior = MediumId(reader.lists.media.len() as u32 - 1);
    let read = SubsurfaceMedium { interior, int_ior, ext_ior };
    reader.known.subsurfaces.insert(id, read.clone());
    Ok(read)
}

/// The boundary of a shape with this subsurface and this bsdf: as rough as a `roughplastic`, or smooth.
fn boundary(reader: &mut Reader<'_>, key: (ElementId, BsdfId), within: &SubsurfaceMedium) -> BsdfId {
    let (id, bsdf) = key;
    if let Some(known) = reader.known.boundaries.get(&(id, bsdf.0)) {
        return *known;
    }
    let bsdfs = &reader.lists.bsdfs;
    let surface = match &bsdfs[bsdf.0 as usize] {
        BsdfDesc::TwoSided(sides) => &bsdfs[sides.front.0 as usize],
        other => other,
    };
    if matches!(surface, BsdfDesc::Null(_)) || surface.parts().transmission.is_some() {
        return bsdf;
    }
    let SubsurfaceMedium { int_ior, ext_ior, .. } = within.clone();
    let specular_reflectance = match surface {
        BsdfDesc::Plastic(coat) => coat.specular_reflectance.clone(),
        BsdfDesc::RoughPlastic(coat) => coat.specular_reflectance.clone(),
        _ => Spectrum::Constant(1.0).into(),
    };
    let specular_transmittance = Spectrum::Constant(1.0).into();
    let new: BsdfDesc = match surface {
        BsdfDesc::RoughPlastic(coat) if int_ior != ext_ior => RoughDielectricDesc {
            int_ior,
            ext_ior,
            specular_reflectance,
            specular_transmittance,
            roughness: coat.roughness,
            alpha: None,
        }
        .into(),
        _ => DielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance }.into(),
    };
    let new = reader.push_bsdf(new, Name::default());
    reader.known.boundaries.insert((id, bsdf.0), new);
    new
}
