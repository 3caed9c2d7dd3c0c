//! Reads colours and spectra: `rgb`, `spectrum` and `float`, according to their use.
//!
//! The rules are those of Mitsuba 3.9.1 in its spectral mode: an `rgb` or a `float` of a light multiplies D65; a
//! `spectrum` is taken as it stands, also in a light, where 1 at every wavelength is the
//! equal-energy white of Y = 1, and so is a black body, in W m⁻² sr⁻¹ nm⁻¹. An `srgb` is an `rgb` on the sRGB curve.

use super::document::{Element, ElementId};
use super::params::Params;
use super::question::Question;
use super::reader::{PluginTable, Reader, Role};
use super::source::Span;
use super::value;
use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneError};
use crate::scene::limits;
use crate::spectrum::blackbody::{self, HOTTEST};
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};

/// Every `<spectrum type="…">`.
pub(super) const PLUGINS: PluginTable<Spectrum> = &[
    ("uniform", uniform),
    ("rawconstant", uniform),
    ("d65", d65),
    ("srgb", srgb),
    ("blackbody", blackbody),
    ("regular", regular),
    ("irregular", irregular),
];

/// True for an element whose `type` is one of a spectrum, which a `<texture>` may have, too.
pub(super) fn is_plugin(element: &Element) -> bool {
    PLUGINS.iter().any(|(name, _)| Some(*name) == element.value("type"))
}

/// The parameter `name` as a spectrum, or nothing if it is not given.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
    role: Role,
) -> Result<Option<Spectrum>, SceneError> {
    params.ask(name, || Question::Value(&["spectrum"]));
    let Some(id) = params.get_id(name) else { return Ok(None) };
    let element = reader.document.element(id);
    let span = element.span_of("value");
    let document = reader.document;
    let fault = |m: String| document.error(FindingKind::Value, span, m);
    let text = element.value("value").unwrap_or_default();
    let spectrum = match element.tag.name {
        "srgb" => from_rgb(value::srgb(text).map_err(fault)?, role).map_err(fault)?,
        "rgb" => {
            let rgb = value::rgb(text).map_err(fault)?;
            if text.trim_start().starts_with('#') {
                let m = "a hexadecimal colour is read as sRGB and decoded; Mitsuba 3.9 refuses it";
                params.note(reader.document.finding(FindingKind::Value, span, m).advice());
            }
            from_rgb(rgb, role).map_err(fault)?
        }
        "float" | "integer" => {
            let v = value::number(text).and_then(non_negative).map_err(fault)?;
            if role == Role::Emission { Spectrum::d65(v) } else { Spectrum::Constant(v) }
        }
        "blackbody" => {
            let factor = element.value("scale").map_or(Ok(1.0), value::number);
            let at = |name| move |m: String| document.error(FindingKind::Value, element.span_of(name), m);
            let factor = factor.and_then(non_negative).map_err(at("scale"))?;
            let temperature = value::kelvin(element.value("temperature").unwrap_or_default());
            let body = temperature.and_then(of_temperature).map_err(at("temperature"))?;
            body.scaled(factor)
        }
        "spectrum" if !text.contains(':') && value::numbers(text).is_ok_and(|v| v.len() == 3) => {
            let m = "three values are read as an RGB colour, as version 0.6 does; Mitsuba 3.9 refuses them";
            params.note(document.finding(FindingKind::Value, span, m).help("write <rgb>").advice());
            from_rgb(value::rgb(text).map_err(fault)?, role).map_err(fault)?
        }
        "spectrum" => shared(reader, id, role)?,
        "texture" if is_plugin(element) => shared(reader, id, role)?,
        other => {
            let m = format!("`{name}` is an <rgb>, <spectrum> or <float>; a <{other}> is not supported here");
            return Err(reader.document.error(FindingKind::Plugin, element.span, m));
        }
    };
    // Colours are in range already, and their bound may lie a little above them.
    let is_above = !matches!(element.tag.name, "rgb" | "srgb") && spectrum.max() > 1.0 + 1e-5;
    if role == Role::Albedo && is_above {
        let m = format!("`{name}` is above 1: this medium makes energy");
        let found = reader.document.finding(FindingKind::Value, span, m);
        return Err(found.help("an albedo is in [0, 1]").error());
    }
    if role == Role::Reflectance && is_above {
        let m = format!("`{name}` is above 1: this surface makes energy");
        let found = reader.document.finding(FindingKind::Value, span, m);
        params.note(found.help("a reflectance is in [0, 1]").warning());
    }
    Ok(Some(spectrum))
}

/// Reads a `spectrum`; once, however often it is referred to.
fn shared(reader: &mut Reader<'_>, id: ElementId, role: Role) -> Result<Spectrum, SceneError> {
    if let Some(known) = reader.known.spectra.get(&(id, role)) {
        return Ok(known.clone());
    }
    let element = reader.document.element(id);
    let spectrum = match element.attribute("type") {
        Some(_) => plugin(reader, id)?,
        None => values(reader, element)?,
    };
    if element.attribute("id").is_some() {
        reader.known.spectra.insert((id, role), spectrum.clone());
    }
    Ok(spectrum)
}

fn non_negative(v: f64) -> Result<f32, String> {
    if v < 0.0 { Err(format!("{v} is negative, which no spectrum can be")) } else { Ok(v as f32) }
}

fn from_rgb(rgb: [f64; 3], role: Role) -> Result<Spectrum, String> {
    let [r, g, b] = rgb.map(non_negative);
    let color = [r?, g?, b?];
    let is_above = color.iter().any(|v| *v > 1.0);
    match role {
        Role::Reflectance if is_above => Err("a reflectance is in [0, 1]".into()),
        Role::Albedo if is_above => Err("an albedo is in [0, 1]".into()),
        Role::Reflectance | Role::Albedo => Ok(Spectrum::reflectance_rgb(color)),
        Role::Extinction => Ok(Spectrum::extinction_rgb(color)),
        Role::Emission => Ok(Spectrum::emission_rgb(color)),
        Role::Unbounded => Ok(Spectrum::unbounded_rgb(color)),
    }
}

/// `<spectrum>` without a type: a constant, a list, or a file.
fn values(reader: &mut Reader<'_>, element: &Element) -> Result<Spectrum, SceneError> {
    let span = element.span_of(if element.attribute("value").is_some() { "value" } else { "filename" });
    let document = reader.document;
    let fault = |m: String| document.error(FindingKind::Value, span, m);
    match (element.value("value"), element.value("filename")) {
        (Some(text), None) if text.contains(':') => {
            let points = value::wavelength_list(text).map_err(fault)?;
            table(&points).map_err(fault)
        }
        (Some(text), None) => {
            let v = value::number(text).and_then(non_negative).map_err(fault)?;
            Ok(Spectrum::Constant(v))
        }
        (None, Some(name)) => file(reader, name, span),
        _ => Err(fault("a spectrum has either a `value` or a `filename`".into())),
    }
}

fn file(reader: &mut Reader<'_>, name: &str, span: Span) -> Result<Spectrum, SceneError> {
    let path = reader.document.resolve(name, span);
    let document = reader.document;
    let at = |kind, m: String| document.error(kind, span, m);
    let bytes =
        reader.document.files.read(&path, limits::SPECTRUM_BYTES).map_err(|e| at(e.kind(), e.to_string()))?;
    reader.known.spectrum_bytes += bytes.len();
    if reader.known.spectrum_bytes > limits::TOTAL_SPECTRUM_BYTES {
        let m =
            format!("the spectrum files of this scene have more than {} bytes", limits::TOTAL_SPECTRUM_BYTES);
        return Err(at(FindingKind::Limit, m));
    }
    let text = String::from_utf8_lossy(&bytes);
    let points = value::wavelength_table(&text).map_err(|(line, message)| {
        let file = path.to_string_lossy();
        let shown = text.lines().nth(line - 1).unwrap_or_default();
        let at = LineAt { file: &file, text: shown, line, column: 1, range: (0, shown.len()) };
        Finding::new(FindingKind::Value, at, message).error()
    })?;
    table(&points).map_err(|e| at(FindingKind::Value, format!("{}: {e}", path.display())))
}

/// A table with one value is not a curve; wavelengths must rise and values must not be negative.
fn table(points: &[(f64, f64)]) -> Result<Spectrum, String> {
    if points.len() < 2 {
        return Err("a spectrum has at least two wavelengths".into());
    }
    if let Some(w) = points.windows(2).find(|w| w[1].0 as f32 <= w[0].0 as f32) {
        return Err(format!("wavelengths must rise: {} follows {}", w[1].0, w[0].0));
    }
    let points: Result<Vec<(f32, f32)>, String> =
        points.iter().map(|&(l, v)| Ok((l as f32, non_negative(v)?))).collect();
    Spectrum::table(&points?).ok_or_else(|| "this table is not a spectrum".into())
}

/// `<spectrum type="…">`.
fn plugin(reader: &mut Reader<'_>, id: ElementId) -> Result<Spectrum, SceneError> {
    let params = Params::new(reader.document, id)?;
    let spectrum = reader.plugin(&params, PLUGINS, &[])?(reader, &params)?;
    reader.finish(params);
    Ok(spectrum)
}

fn uniform(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let v = params.float_or("value", 1.0)?;
    non_negative(v).map(Spectrum::Constant).map_err(|e| params.error("value", e).error())
}

/// D65, in a colour if one is given.
fn d65(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let scale = params.float_or("scale", 1.0)?;
    let white = non_negative(scale).map_err(|e| params.error("scale", e).error())?;
    match params.rgb("color")? {
        None => Ok(Spectrum::d65(white)),
        Some(rgb) => {
            let color = from_rgb(rgb.map(|v| v * scale), Role::Emission);
            color.map_err(|e| params.error("color", e).error())
        }
    }
}

/// A reflectance of a colour in linear RGB.
fn srgb(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let missing = || params.fault(FindingKind::Missing, "this spectrum needs `color`");
    let rgb = params
        .rgb("color")?
        .ok_or_else(|| missing().help("add <rgb name=\"color\" value=\"…\"/>").error())?;
    let role = if rgb.iter().any(|v| *v > 1.0) { Role::Unbounded } else { Role::Reflectance };
    from_rgb(rgb, role).map_err(|e| params.error("color", e).error())
}

/// The wavelengths that are simulated, nm.
const SEEN: [f64; 2] = [LAMBDA_MIN as f64, LAMBDA_MAX as f64];

fn blackbody(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let missing = || params.fault(FindingKind::Missing, "a black body needs `temperature`").error();
    let temperature = params.float("temperature")?.ok_or_else(missing)?;
    let low = params.float_or("wavelength_min", SEEN[0])?.max(SEEN[0]);
    let high = params.float_or("wavelength_max", SEEN[1])?.min(SEEN[1]);
    if low >= high {
        let message = "wavelengths rise from `wavelength_min` to `wavelength_max`, and some must lie from 360 to 830 nm";
        return Err(params.error("wavelength_min", message).error());
    }
    planck(temperature, [low, high]).map_err(|e| params.error("temperature", e).error())
}

/// Radiance of a black body in W m⁻² sr⁻¹ nm⁻¹ at all wavelengths that are simulated.
pub(super) fn of_temperature(temperature: f64) -> Result<Spectrum, String> {
    planck(temperature, SEEN)
}

/// Radiance of a black body in W m⁻² sr⁻¹ nm⁻¹, by Planck's law; a point for each nm.
fn planck(temperature: f64, [low, high]: [f64; 2]) -> Result<Spectrum, String> {
    if !(temperature > 0.0 && temperature <= HOTTEST) {
        return Err(format!("a temperature is above 0 K and not above {HOTTEST:e} K"));
    }
    let steps = (high - low).ceil().max(1.0);
    let point = |i: usize| {
        let nm = low + (high - low) * i as f64 / steps;
        (nm, blackbody::radiance(nm, temperature))
    };
    table(&(0..=steps as usize).map(point).collect::<Vec<_>>())
}

/// Values at equal steps from `wavelength_min` to `wavelength_max`.
fn regular(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let missing = |n| params.error(n, format!("a regular spectrum needs `{n}`")).error();
    let low = params.float("wavelength_min")?.ok_or_else(|| missing("wavelength_min"))?;
    let high = params.float("wavelength_max")?.ok_or_else(|| missing("wavelength_max"))?;
    let values = list(params, "values")?;
    let step = (high - low) / (values.len().max(2) - 1) as f64;
    let points: Vec<_> = values.iter().enumerate().map(|(i, v)| (low + step * i as f64, *v)).collect();
    table(&points).map_err(|e| params.error("values", e).error())
}

fn irregular(_: &mut Reader<'_>, params: &Params<'_>) -> Result<Spectrum, SceneError> {
    let (wavelengths, values) = (list(params, "wavelengths")?, list(params, "values")?);
    if wavelengths.len() != values.len() {
        let m = format!("{} wavelengths and {} values", wavelengths.len(), values.len());
        return Err(params.error("values", m).error());
    }
    let points: Vec<(f64, f64)> = wavelengths.into_iter().zip(values).collect();
    table(&points).map_err(|e| params.error("values", e).error())
}

fn list(params: &Params<'_>, name: &'static str) -> Result<Vec<f64>, SceneError> {
    value::numbers(&params.string(name)?.unwrap_or_default()).map_err(|e| params.error(name, e).error())
}
