//! Reads phase functions.

use super::document::ElementId;
use super::params::Params;
use super::question::Question;
use super::reader::{PluginTable, Reader, Role};
use super::{value, volume};
use crate::scene::desc::PhaseDesc;
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::spectrum::Spectrum;

/// Every `<phase type="…">`.
pub(super) const PLUGINS: PluginTable<PhaseDesc> = &[
    ("isotropic", |_, _| Ok(PhaseDesc::Isotropic)),
    ("hg", henyey_greenstein),
    ("rayleigh", |_, _| Ok(PhaseDesc::Rayleigh)),
    ("tabphase", tabulated),
    ("sggx", microflakes),
    ("blendphase", blend),
];

impl Reader<'_> {
    /// The phase function of an element; in a lenient run the isotropic one in place of one that is not supported.
    pub(super) fn phase(&mut self, id: ElementId) -> Result<PhaseDesc, SceneError> {
        let open = &mut self.known.open_phases;
        if open.contains(&id) || open.len() >= limits::REFERENCE_DEPTH {
            let message = "this phase function contains itself, or too many others within each other";
            let span = self.document.element(id).span;
            return Err(self.document.error(FindingKind::Reference, span, message));
        }
        let params = Params::new(self.document, id)?;
        self.known.open_phases.push(id);
        let read = self.plugin(&params, PLUGINS, &[]).and_then(|plugin| plugin(self, &params));
        self.known.open_phases.pop();
        if read.is_ok() {
            self.finish(params);
        }
        self.or_instead(read, "it is isotropic", |_| PhaseDesc::Isotropic)
    }
}

fn henyey_greenstein(_: &mut Reader<'_>, params: &Params<'_>) -> Result<PhaseDesc, SceneError> {
    mean_cosine(params, 0.8).map(|g| PhaseDesc::HenyeyGreenstein { g })
}

/// The parameter `g`.
pub(super) fn mean_cosine(params: &Params<'_>, default: f64) -> Result<f64, SceneError> {
    let g = params.float_or("g", default)?;
    if (g as f32).abs() < 1.0 {
        return Ok(g);
    }
    let found = params.error("g", "the mean cosine of a phase function lies between -1 and 1");
    Err(found.help("0 scatters in all directions alike, and numbers above it forwards").error())
}

fn tabulated(_: &mut Reader<'_>, params: &Params<'_>) -> Result<PhaseDesc, SceneError> {
    let Some(text) = params.string("values")? else {
        let found = params.fault(FindingKind::Missing, "a `tabphase` needs `values`, its table");
        return Err(found
            .help("add <string name=\"values\" value=\"0.5, 1, 2\"/>, from backwards to forwards")
            .error());
    };
    let refused = |message: String| {
        let found = params.error("values", message);
        let help = "values are at equal steps of the cosine of the scattering angle, from -1, which is backwards, to 1";
        Err(found.help(help).error())
    };
    let values = match value::numbers(&text) {
        Ok(values) => values,
        Err(message) => return refused(message),
    };
    if let Some(negative) = values.iter().find(|v| **v < 0.0) {
        return refused(format!("{negative} is negative, which no density can be"));
    }
    match values.len() {
        0 | 1 => refused("a table has two values at least".to_owned()),
        n if n > PhaseDesc::MOST_VALUES => {
            refused(format!("this table has {n} values, and at most {} are read", PhaseDesc::MOST_VALUES))
        }
        _ if values.iter().all(|v| *v == 0.0) => refused("all values of this table are 0".to_owned()),
        _ => Ok(PhaseDesc::Tabulated { values: values.into() }),
    }
}

fn microflakes(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PhaseDesc, SceneError> {
    params.ask("S", || Question::Value(&["volume"]));
    let help = "add <volume name=\"S\" type=\"gridvolume\"> with a `.vol` of six channels: Sxx, Syy, Szz, Sxy, Sxz and Syz";
    let Some(id) = params.get_id("S") else {
        let message = "an `sggx` needs `S`, the matrix of its microflakes";
        return Err(params.fault(FindingKind::Missing, message).help(help).error());
    };
    if reader.document.element(id).tag.name != "volume" {
        return Err(params.error("S", "`S` is a <volume> of six numbers").help(help).error());
    }
    Ok(PhaseDesc::Microflakes(volume::microflakes(reader, id)?))
}

fn blend(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<PhaseDesc, SceneError> {
    let [first, second] = *params.objects("phase").as_slice() else {
        return Err(params.fault(FindingKind::Parameter, "a blend is made of two phase functions").error());
    };
    let weight = weight(reader, params)?;
    let phases = Box::new([reader.phase(first.0)?, reader.phase(second.0)?]);
    let has_microflakes = phases.iter().any(|phase| matches!(phase, PhaseDesc::Microflakes(_)));
    let blend = PhaseDesc::Blend { weight, phases };
    if parts(&blend) > PhaseDesc::MOST_PARTS {
        let message = format!("this phase function is made of more than {} others", PhaseDesc::MOST_PARTS);
        return Err(params.fault(FindingKind::Limit, message).error());
    }
    if has_microflakes {
        let message = "microflakes in a blend hide what is behind them by their projected area, which Mitsuba leaves out";
        params.note(params.type_fault(message).advice());
    }
    Ok(blend)
}

/// The number of phase functions that one is made of.
fn parts(phase: &PhaseDesc) -> usize {
    match phase {
        PhaseDesc::Blend { phases, .. } => phases.iter().map(parts).sum(),
        _ => 1,
    }
}

/// The share of the second phase function of a blend.
fn weight(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<f64, SceneError> {
    params.ask("weight", || Question::Value(&["float", "volume"]));
    let Some(id) = params.get_id("weight") else {
        let message = "a blend needs `weight`, the share of its second phase function";
        let found = params.fault(FindingKind::Missing, message);
        return Err(found.help("add <float name=\"weight\" value=\"0.5\"/>").error());
    };
    let element = reader.document.element(id);
    let varies = |what: &str| {
        let message = format!("the `weight` of a blend is one number here, and not a {what}");
        let found = reader.document.finding(FindingKind::Plugin, element.span_of("type"), message);
        found.help("give a number: <float name=\"weight\" value=\"0.5\"/>").error()
    };
    let weight = match (element.tag.name, element.value("type")) {
        ("volume", Some("gridvolume")) => return Err(varies("`gridvolume`")),
        ("volume", _) => match volume::read(reader, id, Role::Unbounded)? {
            SpectrumTexture::Uniform(Spectrum::Constant(v)) => f64::from(v),
            _ => return Err(varies("colour")),
        },
        _ => params.float("weight")?.unwrap_or_default(),
    };
    if (0.0..=1.0).contains(&weight) {
        return Ok(weight);
    }
    Err(params.error("weight", "the share of the second phase function is from 0 to 1").error())
}
