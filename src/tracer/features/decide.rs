//! Which features are on, and why.

use crate::scene::desc::{IntegratorKind, LightDesc, Place, SceneDesc};
use crate::spectrum::White;

use super::Feature;
use super::used::{
    Object, Used, disperses, focuses, is_colored, is_delta, is_glossy, known, spreads, transmits,
};

/// What is decided about one feature.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Which.
    pub feature: Feature,
    /// It is simulated.
    pub on: bool,
    /// The object that calls for it, or why nothing does.
    pub reason: String,
    /// Where that object stands in the file.
    pub place: Option<Place>,
}

/// What calls for a feature, with the place of it, or why nothing does.
type Found = Result<(String, Option<Place>), &'static str>;

/// Decides all of [`Feature::ALL`], in their order, for a scene that is traced by `kind` (`Auto` counts as `Path`).
///
/// A pure function: what is decided depends on nothing that happens while paths are traced.
pub fn decide(desc: &SceneDesc, kind: IntegratorKind) -> Vec<Decision> {
    let used = Used::of(desc);
    let of = |feature| {
        let (on, (reason, place)) = match find(&used, kind, feature) {
            Ok(found) => (true, found),
            Err(why_not) => (false, (why_not.to_string(), None)),
        };
        Decision { feature, on, reason, place }
    };
    Feature::ALL.map(of).into()
}

fn find(used: &Used, kind: IntegratorKind, feature: Feature) -> Found {
    let photons = kind == IntegratorKind::Photon;
    let by = |object: Option<Object>, why: &str, why_not| object.map(|o| words(o, why)).ok_or(why_not);
    match feature {
        Feature::LightStream => match kind {
            IntegratorKind::Light => {
                Ok(("particle tracing shows light paths to the camera".to_string(), None))
            }
            IntegratorKind::Bidirectional => {
                Ok(("bidirectional path tracing shows light paths to the camera".to_string(), None))
            }
            _ => Err("the method shows camera paths only"),
        },
        Feature::Wavelengths => colors(used).map_err(|white| match white {
            Some(_) => "every surface is grey, and all lights have one white",
            None => "nothing emits",
        }),
        Feature::Dispersion => by(
            used.material(disperses),
            "has an index that depends on the wavelength",
            "no index depends on the wavelength",
        ),
        Feature::Transmission => {
            by(used.material(transmits), "lets light through", "nothing lets light through")
        }
        Feature::Deltas => by(
            used.material(is_delta),
            "has a single direction of reflection or refraction",
            "every surface spreads light",
        ),
        Feature::Glossy => by(used.material(is_glossy), "is rough", "nothing is between a mirror and matt"),
        Feature::Environment => match used.environment() {
            Some(LightDesc::Map { place, .. }) => {
                Ok(("envmap: light from all around".to_string(), known(*place)))
            }
            Some(light) => Ok(("constant: light from all around".to_string(), known(light.place()))),
            None => Err("no light is infinitely far"),
        },
        Feature::LightChoice => lights(used),
        Feature::Lens => {
            let camera = &used.desc.camera;
            let lens =
                || (format!("the lens has a radius of {}", camera.aperture_radius), known(camera.place));
            (camera.aperture_radius > 0.0).then(lens).ok_or("the camera is a pinhole")
        }
        Feature::CausticPhotons | Feature::Gather if !photons => Err("the method has no photons"),
        Feature::CausticPhotons if !used.desc.integrator.photons.caustics => Err("forced off"),
        Feature::Gather if !used.desc.integrator.photons.gather => Err("forced off"),
        Feature::CausticPhotons => {
            by(used.material(focuses), "may focus light", "nothing mirrors or refracts light")
        }
        Feature::Gather => by(used.material(spreads), "spreads light", "nothing has a diffuse part"),
    }
}

fn words(object: Object, why: &str) -> (String, Option<Place>) {
    let Object { name, place, others } = object;
    let more = match others {
        0 => String::new(),
        n => format!(" ({n} more like it)"),
    };
    (format!("{name} {why}{more}"), place)
}

/// The one white of a scene in which nothing has a colour: all values along a path are in proportion to its spectrum.
/// `None` where [`Feature::Wavelengths`] is on, and without light.
pub fn white(desc: &SceneDesc) -> Option<White> {
    colors(&Used::of(desc)).err()?
}

/// Whatever makes values differ from wavelength to wavelength: a surface, an index, the light. Else the white of all light, if
/// there is any.
fn colors(used: &Used) -> Result<(String, Option<Place>), Option<White>> {
    if let Some(object) = used.material(is_colored) {
        return Ok(words(object, "depends on the wavelength"));
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

fn lights(used: &Used) -> Found {
    let mut all = used.emitters();
    match (all.next(), all.next()) {
        (Some(_), Some((_, second))) => Ok((format!("{} objects emit", 2 + all.count()), second)),
        (Some((_, place)), None) if used.faces() > 1 => {
            Ok((format!("the object that emits has {} faces", used.faces()), place))
        }
        (Some(_), None) => Err("one object emits"),
        (None, _) => Err("nothing emits"),
    }
}
