//! Reads participating media: `homogeneous`, and `heterogeneous`, whose coefficients may be grids.
//!
//! Coefficients are those of Mitsuba 3, `sigma_t` and `albedo`, or those of version 0.6: `sigma_s` and `sigma_a`, or the name of a
//! `material`. These two are turned into the former, wavelength by wavelength.

use std::collections::BTreeSet;

use super::document::ElementId;
use super::params::Params;
use super::question::Question;
use super::reader::{PluginTable, Reader, Role};
use super::{spectrum, volume};
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{
    EmissionGrid, IntegratorDesc, MediumDesc, MediumEmission, MediumId, MediumInterface, PhaseDesc, ShapeDesc,
};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::suggest;
use crate::spectrum::blackbody::HOTTEST;
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};
use glam::Vec4;

/// Every `<medium type="…">`.
pub(super) const PLUGINS: PluginTable<MediumDesc> =
    &[("homogeneous", homogeneous), ("heterogeneous", heterogeneous)];

/// The parameters by which coefficients are given, in three ways.
pub(super) const COEFFICIENTS: &[&str] = &["sigma_t", "albedo", "sigma_s", "sigma_a", "material"];

/// Media measured by Jensen, Marschner, Levoy and Hanrahan, “A Practical Model for Subsurface Light Transport” (SIGGRAPH 2001), table 1:
/// the reduced scattering coefficient and the absorption coefficient in 1/mm, each for red, green and blue.
const MATERIALS: &[(&str, [f32; 3], [f32; 3])] = &[
    ("apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    ("chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    ("chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    ("cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    ("ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ("marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    ("potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    ("skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    ("skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    ("skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    ("spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    ("wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

impl Reader<'_> {
    /// The medium of an element; read once however often it is referred to. Nothing for one that a lenient run leaves out.
    pub(super) fn medium(&mut self, id: ElementId) -> Result<Option<MediumId>, SceneError> {
        if let Some(&known) = self.known.media.get(&id) {
            return Ok(known);
        }
        let params = Params::new(self.document, id)?;
        let read = self.plugin(&params, PLUGINS, &[]).and_then(|plugin| plugin(self, &params));
        let medium = match read {
            Ok(medium) => {
                self.finish(params);
                let name = self.name(id);
                self.lists.names.media.push(name);
                self.lists.media.push(medium);
                Some(MediumId(self.lists.media.len() as u32 - 1))
            }
            Err(unread) => self.or_instead(Err(unread), "it is left out", |_| None)?,
        };
        self.known.media.insert(id, medium);
        Ok(medium)
    }

    /// The media that a shape names on its two sides.
    pub(super) fn medium_interface(&mut self, params: &Params<'_>) -> Result<MediumInterface, SceneError> {
        let mut side = |name: &'static str| {
            params.ask(name, || Question::Value(&["medium"]));
            let Some(id) = params.get_id(name) else { return Ok(None) };
            let element = self.document.element(id);
            if element.tag.name != "medium" {
                let message = format!("`{name}` is a <medium>, not a <{}>", element.tag.name);
                return Err(self.document.error(FindingKind::Parameter, element.span, message));
            }
            self.medium(id)
        };
        Ok(MediumInterface { interior: side("interior")?, exterior: side("exterior")? })
    }
}

/// Remarks on media that are nowhere, and where all are left out.
pub(crate) fn unused(reader: &mut Reader<'_>, of_camera: Option<MediumId>, integrator: &IntegratorDesc) {
    let of_shape = |shape: &ShapeDesc| [shape.medium_interface.interior, shape.medium_interface.exterior];
    let of_groups = reader.lists.groups.iter().flat_map(|group| &group.shapes);
    let shapes = reader.lists.shapes.iter().chain(of_groups);
    let used: BTreeSet<u32> = shapes.flat_map(of_shape).chain([of_camera]).flatten().map(|id| id.0).collect();
    let media = std::mem::take(&mut reader.known.media);
    if integrator.surfaces_only
        && let Some((first, _)) = media.iter().find(|(_, medium)| medium.is_some_and(|m| used.contains(&m.0)))
    {
        let span = reader.document.element(*first).span;
        let message = "media are left out: the integrator of this file knows surfaces only, in Mitsuba, too";
        let found = reader.document.finding(FindingKind::Parameter, span, message);
        reader.warn(found.help("write <integrator type=\"volpath\"/>, or --effects +media").advice());
    }
    let shines = |medium: &MediumId| {
        used.contains(&medium.0) && reader.lists.media.get(medium.0 as usize).is_some_and(MediumDesc::shines)
    };
    let shining = media.iter().find(|(_, medium)| medium.as_ref().is_some_and(shines));
    if let Some((shining, _)) = shining.filter(|_| !integrator.surfaces_only)
        && !integrator.kind.traits().finds_emissive_media
    {
        let span = reader.document.element(*shining).span;
        let message = "the integrator of this file does not find the light that this medium emits";
        let found = reader.document.finding(FindingKind::Parameter, span, message);
        reader.warn(found.help("write <integrator type=\"volpath\"/>, or --integrator path").warning());
    }
    for (element, medium) in media {
        if medium.is_some_and(|medium| !used.contains(&medium.0)) {
            let span = reader.document.element(element).span;
            let message = "no shape and no sensor refers to this medium";
            let found = reader.document.finding(FindingKind::Parameter, span, message);
            let help = "it is not seen: refer to it by <ref name=\"interior\" id=\"…\"/> in a shape";
            reader.warn(found.help(help).advice());
        }
    }
}

fn homogeneous(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MediumDesc, SceneError> {
    let medium = read(reader, params)?;
    let [sigma_t, albedo] = [&medium.sigma_t, &medium.albedo].map(SpectrumTexture::varies);
    let (radiance, temperature) = match medium.emission.as_ref().and_then(|light| light.grid.as_ref()) {
        None => (false, false),
        Some(EmissionGrid::Colors(_)) => (true, false),
        Some(EmissionGrid::Temperatures(_)) => (false, true),
    };
    let grids =
        [("sigma_t", sigma_t), ("albedo", albedo), ("radiance", radiance), ("temperature", temperature)];
    for (name, varies) in grids {
        if varies {
            let message = format!("`{name}` is a grid, and a `homogeneous` medium is the same everywhere");
            let found = params.error(name, message);
            return Err(found.help("write <medium type=\"heterogeneous\">").error());
        }
    }
    Ok(medium)
}

fn heterogeneous(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MediumDesc, SceneError> {
    let medium = read(reader, params)?;
    if !medium.sigma_t.varies() {
        let message = "the density of this medium does not vary: it fills what bounds it";
        let help = "Mitsuba cuts such a medium to the unit cube of its `sigma_t`: scale that by `to_world`, or write `homogeneous`";
        params.note(params.type_fault(message).help(help).advice());
    }
    Ok(medium)
}

fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<MediumDesc, SceneError> {
    params.without_effect(&[
        "has_spectral_extinction",
        "sample_emitters",
        "majorant_factor",
        "majorant_resolution_factor",
        "method",
        "strategy",
        "step_size",
        "medium_sampling_weight",
    ]);
    let [sigma_t, albedo] = coefficients(reader, params)?;
    let scale = scale(params)?;
    let emission = emission(reader, params)?;
    let phase = match params.object("phase")? {
        Some(id) => reader.phase(id)?,
        None => PhaseDesc::Isotropic,
    };
    Ok(MediumDesc { sigma_t, albedo, scale, phase, emission })
}

/// The light that a medium emits, which Mitsuba does not know: its radiance, or that of black bodies.
fn emission(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Option<MediumEmission>, SceneError> {
    let (radiance, temperature) = (params.has("radiance"), params.has("temperature"));
    if radiance && temperature {
        let message = "a medium has either `radiance` or `temperature`, not both";
        let help = "leave out one of them: `temperature` gives the radiance by Planck's law";
        return Err(params.error("temperature", message).help(help).error());
    }
    let of_radiance = coefficient(reader, params, "radiance", Role::Emission)?.map(|read| match read {
        SpectrumTexture::Volume(grid) => {
            MediumEmission { radiance: Spectrum::Constant(1.0), grid: Some(EmissionGrid::Colors(grid)) }
        }
        other => MediumEmission { radiance: other.mean(), grid: None },
    });
    let of_temperature = black_bodies(reader, params)?;
    let factor = factor(params, "emission_scale", "the emission")?;
    for (name, given, what) in [
        ("temperature_scale", temperature, "`temperature`"),
        ("emission_scale", radiance || temperature, "`radiance` or `temperature`"),
    ] {
        if params.has(name) && !given {
            let message = format!("`{name}` has no effect: this medium has no {what}");
            params.note(params.error(name, message).warning());
        }
    }
    let scaled =
        |light: MediumEmission| MediumEmission { radiance: light.radiance.scaled(factor as f32), ..light };
    Ok(of_radiance.or(of_temperature).map(scaled))
}

/// The light of a medium that is a black body at each point.
fn black_bodies(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Option<MediumEmission>, SceneError> {
    params.ask("temperature", || Question::Value(&["float", "volume"]));
    let scale = params.float_or("temperature_scale", 1.0)?;
    if !(scale > 0.0 && scale <= HOTTEST) {
        let message = format!("the factor on `temperature` is above 0 and not above {HOTTEST:e}");
        return Err(params.error("temperature_scale", message).error());
    }
    let Some(id) = params.get_id("temperature") else { return Ok(None) };
    let element = reader.document.element(id);
    match element.tag.name {
        "volume" => volume::black_bodies(reader, id, scale).map(Some),
        "float" | "integer" => volume::black_body(params, "temperature", scale).map(Some),
        other => {
            let message = format!("`temperature` is a <float> or a <volume>, not a <{other}>");
            let found = reader.document.finding(FindingKind::Parameter, element.span, message);
            Err(found.help("write <float name=\"temperature\" value=\"…\"/>, in K").error())
        }
    }
}

/// The factor on σₜ.
pub(super) fn scale(params: &Params<'_>) -> Result<f64, SceneError> {
    factor(params, "scale", "`sigma_t`")
}

/// The factor `name` on `what`, 1 unless given.
fn factor(params: &Params<'_>, name: &'static str, what: &str) -> Result<f64, SceneError> {
    let factor = params.float_or(name, 1.0)?;
    if !(0.0..=MediumDesc::LARGEST).contains(&factor) {
        return Err(params.error(name, format!("the factor on {what} is from 0 to 1e12")).error());
    }
    Ok(factor)
}

/// σₜ and the albedo, in whichever of the three ways they are given.
pub(super) fn coefficients(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
) -> Result<[SpectrumTexture; 2], SceneError> {
    let ways: [&[&'static str]; 3] = [&["sigma_t", "albedo"], &["sigma_s", "sigma_a"], &["material"]];
    let given = ways.map(|names| names.iter().copied().filter(|name| params.has(name)).last());
    if let [first, second, ..] = *given.into_iter().flatten().collect::<Vec<_>>() {
        let found = params.error(second, format!("a medium has either `{first}` or `{second}`, not both"));
        let help = "give `sigma_t` and `albedo`, or `sigma_s` and `sigma_a`, or the name of a `material`";
        return Err(found.help(help).error());
    }
    if params.has("material") {
        return measured(params, &params.string("material")?.unwrap_or_default());
    }
    if given[1].is_some() {
        let [scattering, absorption] =
            [uniform(reader, params, "sigma_s")?, uniform(reader, params, "sigma_a")?];
        return Ok(of_parts(&scattering, &absorption).map(SpectrumTexture::from));
    }
    params.default("sigma_t", 1);
    params.default("albedo", 0.75);
    let sigma_t = coefficient(reader, params, "sigma_t", Role::Extinction)?;
    let albedo = coefficient(reader, params, "albedo", Role::Albedo)?;
    Ok([sigma_t.unwrap_or(Spectrum::Constant(1.0).into()), albedo.unwrap_or(Spectrum::Constant(0.75).into())])
}

/// The parameter `name`: a colour, a spectrum, a number or a volume. Nothing if it is not given.
fn coefficient(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    role: Role,
) -> Result<Option<SpectrumTexture>, SceneError> {
    params.ask(name, || Question::Value(&["spectrum", "volume"]));
    let Some(id) = params.get_id(name) else { return Ok(None) };
    let read = match reader.document.element(id).tag.name {
        "volume" => Some(volume::read(reader, id, role)?),
        _ => spectrum::read(reader, params, name, role)?.map(SpectrumTexture::Uniform),
    };
    let most = read.as_ref().and_then(SpectrumTexture::uniform).map_or(0.0, Spectrum::max);
    if role != Role::Emission && f64::from(most) > MediumDesc::LARGEST {
        return Err(params.error(name, format!("`{name}` is above {:e}", MediumDesc::LARGEST)).error());
    }
    Ok(read)
}

/// A coefficient that is the same everywhere, 0 unless given.
fn uniform(reader: &mut Reader<'_>, params: &Params<'_>, name: &'static str) -> Result<Spectrum, SceneError> {
    params.default(name, 0);
    match coefficient(reader, params, name, Role::Unbounded)? {
        None => Ok(Spectrum::Constant(0.0)),
        Some(SpectrumTexture::Uniform(spectrum)) => Ok(spectrum),
        Some(_) => {
            let found = params.error(name, format!("`{name}` is a grid, and is the same everywhere here"));
            Err(found.help("give the grids as `sigma_t` and `albedo`").error())
        }
    }
}

/// σₜ and the albedo of the measured medium of this name.
pub(super) fn measured(params: &Params<'_>, name: &str) -> Result<[SpectrumTexture; 2], SceneError> {
    let found = MATERIALS.iter().find(|(known, ..)| known.eq_ignore_ascii_case(name.trim()));
    let (_, scattering, absorption) = found.ok_or_else(|| {
        let names: Vec<&str> = MATERIALS.iter().map(|(known, ..)| *known).collect();
        let found = params.error("material", format!("no medium is known as `{}`", shorten(name)));
        found.help(suggest::hint(name.trim(), &names)).error()
    })?;
    let [scattering, absorption] = [*scattering, *absorption].map(Spectrum::unbounded_rgb);
    Ok(of_parts(&scattering, &absorption).map(SpectrumTexture::from))
}

/// σₜ and the albedo of a medium with these coefficients of scattering and absorption: exact for numbers, otherwise in steps of 1 nm.
/// The albedo is 0 where both coefficients are.
fn of_parts(scattering: &Spectrum, absorption: &Spectrum) -> [Spectrum; 2] {
    let share = |s: f32, t: f32| if t > 0.0 { (s / t).min(1.0) } else { 0.0 };
    if let (Spectrum::Constant(s), Spectrum::Constant(a)) = (scattering, absorption) {
        return [s + a, share(*s, s + a)].map(Spectrum::Constant);
    }
    let points = (LAMBDA_MIN as u16..=LAMBDA_MAX as u16).map(|nm| {
        let lambda = f32::from(nm);
        let [s, a] = [scattering, absorption].map(|spectrum| spectrum.eval(Vec4::splat(lambda)).x);
        (lambda, s + a, share(s, s + a))
    });
    let (sigma_t, albedo): (Vec<_>, Vec<_>) = points.map(|(l, t, share)| ((l, t), (l, share))).unzip();
    [sigma_t, albedo].map(|points| Spectrum::table(&points).unwrap_or(Spectrum::Constant(0.0)))
}
