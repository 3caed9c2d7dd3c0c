//! Materials.

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::roughness;
use super::spectrum::{self, Role};
use crate::scene::desc::{BsdfDesc, BsdfId, Name};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::{Spectrum, dispersion::Ior, metals};

/// Reader of one material.
type Plugin = fn(&mut Reader<'_>, &Params<'_>) -> Result<BsdfDesc, SceneError>;

/// Every material.
const PLUGINS: &[(&str, Plugin)] = &[
    ("diffuse", diffuse),
    ("dielectric", dielectric),
    ("conductor", conductor),
    ("roughdielectric", rough_dielectric),
    ("roughconductor", rough_conductor),
    ("plastic", plastic),
    ("roughplastic", rough_plastic),
    ("twosided", two_sided),
];

/// The material of an element; read once however often it is referred to.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<BsdfId, SceneError> {
    if let Some(&known) = reader.known_bsdfs.get(&id) {
        return Ok(known);
    }
    let element = reader.document.element(id);
    if reader.open_bsdfs.contains(&id) || reader.open_bsdfs.len() >= limits::REFERENCE_DEPTH {
        let message = "this material contains itself, or too many others within each other";
        return Err(reader.document.finding(FindingKind::Reference, element.span, message).error());
    }
    let params = Params::new(reader.document, id)?;
    let Some((_, plugin)) = PLUGINS.iter().find(|(name, _)| *name == params.plugin()) else {
        let names: Vec<&str> = PLUGINS.iter().map(|p| p.0).collect();
        return Err(reader.unknown_plugin(&params, &names));
    };
    reader.open_bsdfs.push(id);
    let bsdf = plugin(reader, &params)?;
    reader.open_bsdfs.pop();
    reader.finish(params);
    let name = reader.name(id);
    let new = push(reader, bsdf, name);
    reader.known_bsdfs.insert(id, new);
    Ok(new)
}

/// The material of a shape that names none: grey, or black if it emits, as Mitsuba.
pub(crate) fn default(reader: &mut Reader<'_>, emits: bool) -> BsdfId {
    if let Some(known) = reader.default_bsdfs[usize::from(emits)] {
        return known;
    }
    let reflectance = Spectrum::Constant(if emits { 0.0 } else { 0.5 });
    let new = push(reader, BsdfDesc::Diffuse { reflectance }, Name::default());
    reader.default_bsdfs[usize::from(emits)] = Some(new);
    new
}

fn push(reader: &mut Reader<'_>, bsdf: BsdfDesc, name: Name) -> BsdfId {
    reader.names.bsdfs.push(name);
    reader.bsdfs.push(bsdf);
    BsdfId(reader.bsdfs.len() as u32 - 1)
}

/// A spectrum parameter of a material, with its default.
fn color(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    (name, role): (&'static str, Role),
    default: f32,
) -> Result<Spectrum, SceneError> {
    Ok(spectrum::read(reader, params, name, role)?.unwrap_or(Spectrum::Constant(default)))
}

fn diffuse(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    Ok(BsdfDesc::Diffuse { reflectance: color(reader, params, ("reflectance", Role::Reflectance), 0.5)? })
}

fn dielectric(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    Ok(BsdfDesc::Dielectric {
        int_ior: ior(params, "int_ior", "bk7")?,
        ext_ior: ior(params, "ext_ior", "air")?,
        specular_reflectance: color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?,
        specular_transmittance: color(reader, params, ("specular_transmittance", Role::Reflectance), 1.0)?,
    })
}

/// An index of refraction: a number, or the name of a medium.
fn ior(params: &Params<'_>, name: &'static str, default: &str) -> Result<Ior, SceneError> {
    let by_name = |medium: &str| {
        Ior::named(medium).ok_or_else(|| {
            let shown: String = medium.chars().take(64).collect();
            let found = params.error(name, format!("no index of refraction is known for `{shown}`"));
            found.help("give a number: <float name=\"int_ior\" value=\"1.5\"/>").error()
        })
    };
    match params.get(name).map(|e| e.tag.name) {
        None => by_name(default),
        Some("string") => by_name(&params.string(name)?.unwrap_or_default()),
        Some(_) => {
            let n = params.float(name)?.unwrap_or(1.0);
            if !is_ior(n) {
                return Err(params
                    .error(name, "an index of refraction is above 0 and not above 1000")
                    .error());
            }
            Ok(Ior::Constant(n as f32))
        }
    }
}

/// True for a number that can be an index of refraction.
pub(crate) fn is_ior(n: f64) -> bool {
    n > 0.0 && n <= 1e3
}

fn rough_dielectric(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let (int_ior, ext_ior) = (ior(params, "int_ior", "bk7")?, ior(params, "ext_ior", "air")?);
    if int_ior == ext_ior {
        let found =
            params.error("int_ior", "both sides of a rough interface have the same index of refraction");
        return Err(found.help("without a difference light goes straight through: use `dielectric`").error());
    }
    Ok(BsdfDesc::RoughDielectric {
        int_ior,
        ext_ior,
        specular_reflectance: color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?,
        specular_transmittance: color(reader, params, ("specular_transmittance", Role::Reflectance), 1.0)?,
        roughness: roughness::read(reader, params)?,
    })
}

fn conductor(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let (eta, k) = metal(reader, params)?;
    let specular_reflectance = color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?;
    Ok(BsdfDesc::Conductor { eta, k, specular_reflectance })
}

fn rough_conductor(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let (eta, k) = metal(reader, params)?;
    let specular_reflectance = color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?;
    Ok(BsdfDesc::RoughConductor { eta, k, specular_reflectance, roughness: roughness::read(reader, params)? })
}

/// The index of a metal: by name, or as `eta` and `k`.
fn metal(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<(Spectrum, Spectrum), SceneError> {
    let material = params.string("material")?;
    let given = params.has("eta") || params.has("k");
    let named = material.as_deref().filter(|m| *m != "none");
    match named {
        Some(_) if given => {
            Err(params.error("material", "either `material` or `eta` and `k`, not both").error())
        }
        Some(name) => metals::named(name).ok_or_else(|| {
            let shown: String = name.chars().take(64).collect();
            let found = params.error("material", format!("no metal `{shown}` is known"));
            found.help("give `eta` and `k`, or a name such as Au, Ag, Al, Cu, or `none`").error()
        }),
        None => Ok((
            color(reader, params, ("eta", Role::Unbounded), 0.0)?,
            color(reader, params, ("k", Role::Unbounded), 1.0)?,
        )),
    }
}

fn plastic(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    Ok(BsdfDesc::Plastic {
        int_ior: ior(params, "int_ior", "polypropylene")?,
        ext_ior: ior(params, "ext_ior", "air")?,
        diffuse_reflectance: color(reader, params, ("diffuse_reflectance", Role::Reflectance), 0.5)?,
        specular_reflectance: color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?,
        nonlinear: params.boolean("nonlinear", false)?,
    })
}

fn rough_plastic(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let (int_ior, ext_ior) = (ior(params, "int_ior", "polypropylene")?, ior(params, "ext_ior", "air")?);
    if int_ior == ext_ior {
        let found = params.error("int_ior", "a coat has another index of refraction than what is around it");
        return Err(found.help("without a coat it is `diffuse`").error());
    }
    let roughness = roughness::read(reader, params)?;
    if roughness.alpha[0] != roughness.alpha[1] {
        let found = params.error("alpha_u", "the coat of a plastic is as rough along as across");
        return Err(found.help("give one `alpha`").error());
    }
    Ok(BsdfDesc::RoughPlastic {
        int_ior,
        ext_ior,
        diffuse_reflectance: color(reader, params, ("diffuse_reflectance", Role::Reflectance), 0.5)?,
        specular_reflectance: color(reader, params, ("specular_reflectance", Role::Reflectance), 1.0)?,
        nonlinear: params.boolean("nonlinear", false)?,
        roughness,
    })
}

fn two_sided(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<BsdfDesc, SceneError> {
    let sides = params.objects("bsdf");
    let wrong = |reader: &Reader<'_>, span, m: &str| {
        Err(reader.document.finding(FindingKind::Parameter, span, m).error())
    };
    let (front, back) = match sides.as_slice() {
        [one] => (*one, *one),
        [front, back] => (*front, *back),
        [] => {
            return wrong(
                reader,
                params.span(),
                "a twosided needs a bsdf for its front, and may have one for its back",
            );
        }
        [_, _, (_, third), ..] => return wrong(reader, *third, "a twosided has one or two bsdfs"),
    };
    let mut ids = [BsdfId(0); 2];
    for (out, (id, span)) in ids.iter_mut().zip([front, back]) {
        *out = read(reader, id)?;
        match reader.bsdfs[out.0 as usize] {
            BsdfDesc::Dielectric { .. } | BsdfDesc::RoughDielectric { .. } => {
                return wrong(reader, span, "a material that lets light through has two sides already");
            }
            BsdfDesc::TwoSided { .. } => return wrong(reader, span, "this material is two-sided already"),
            _ => {}
        }
    }
    Ok(BsdfDesc::TwoSided { front: ids[0], back: ids[1] })
}
