//! Four wavelengths to a path. Without them all that is seen has one white, and every path carries its wavelengths.

use std::sync::Arc;

use glam::Vec4;

use crate::scene::SceneDesc;
use crate::scene::desc::LightDesc;
use crate::spectrum::dispersion::SODIUM_D;
use crate::spectrum::{Spectrum, White};

use super::dispersion;
use super::entry::{Entry, Reason, by, possible, says};
use super::kinds::is_colored;
use super::used::Used;

pub(super) const ENTRY: Entry = Entry {
    name: "wavelengths",
    at_run_time: "whether the prepared scene has a white, once per path (RenderContext::wavelengths)",
    find: |used, _| match colors(used) {
        Ok(found) => Ok(found),
        Err(_) if used.desc.integrator.spectral => says("forced on: nothing has a colour"),
        Err(Some(_)) => Err("every surface is grey, and all lights have one white"),
        Err(None) => Err("nothing emits"),
    },
    refusal: possible,
    without: grey,
    with: |desc| {
        desc.integrator.spectral = true;
        true
    },
};

/// Whatever makes values differ from wavelength to wavelength: a surface, an index, the light. Else the white of all light, if
/// there is any.
pub(super) fn colors(used: &Used) -> Result<Reason, Option<White>> {
    if let Ok(found) = by(used.material(is_colored), "depends on the wavelength", "") {
        return Ok(found);
    }
    let mut shining = used.emitters();
    let Some((first, place)) = shining.next() else { return Err(None) };
    if first.is_none() {
        return Ok(("a light is neither D65 nor equal at all wavelengths".to_string(), place));
    }
    match shining.find(|(white, _)| *white != first) {
        Some((_, place)) => Ok(("lights differ in colour".to_string(), place)),
        None => Err(first),
    }
}

/// Greys as light as the colours are under D65, lights of their luminance, indices at the sodium line.
fn grey(desc: &mut SceneDesc) {
    desc.integrator.spectral = false;
    if colors(&Used::of(desc)).is_err() {
        return;
    }
    for bsdf in &mut desc.bsdfs {
        let parts = bsdf.parts_mut();
        [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(dispersion::at_sodium);
        [parts.albedo, parts.reflection, parts.transmission].into_iter().flatten().for_each(reflected);
        for index in [parts.eta, parts.k].into_iter().flatten() {
            *index = Spectrum::Constant(index.eval(Vec4::splat(SODIUM_D)).x);
        }
    }
    desc.shapes.iter_mut().filter_map(|shape| shape.emission.as_mut()).for_each(emitted);
    for light in &mut desc.lights {
        match light {
            LightDesc::Map { map, .. } => *map = Arc::new(map.grey()),
            _ => emitted(light.spectrum_mut()),
        }
    }
}

/// The grey that is as light under D65.
fn reflected(spectrum: &mut Spectrum) {
    if !spectrum.is_constant() {
        let [r, g, b] = spectrum.reflected_rgb();
        *spectrum = Spectrum::Constant((0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0));
    }
}

/// D65 of the same luminance.
fn emitted(spectrum: &mut Spectrum) {
    *spectrum = Spectrum::d65(spectrum.luminance());
}
