//! The list of the client's effects: which of them settings and streams call for, and why. People read it.
//!
//! Nothing is decided here: [`Effects`] and [`FilmSpec`] decide for the code that runs, and this reports the result. The
//! tracer has a list of its own; `app/plan.rs` joins the two.

use crate::client::effects::Effects;
use crate::client::settings::{
    ColorOutput, DisplayView, Dither, FilmSpec, Glare, Masking, OptionNames, Reconstruction, Settings,
    VarianceForm,
};

/// One effect of the client.
#[derive(Clone, Debug, PartialEq)]
pub struct ClientEffect {
    /// Its name.
    pub name: &'static str,
    /// Whether it is part of the picture.
    pub on: bool,
    /// The stream or option that asks for it, or would.
    pub reason: String,
    /// The mechanism that decides it while the program runs.
    pub at_run_time: &'static str,
    /// Its own passes, by their names in the timings.
    pub passes: &'static [&'static str],
    /// Passes of other effects that take longer with it.
    pub changes: &'static [&'static str],
    /// Prefixes of the names of the images and buffers that only it needs.
    pub images: &'static [&'static str],
    /// Whether [`Settings::switch`] turns it on and off.
    pub can_switch: bool,
}

/// The fixed properties of an effect.
struct EffectTraits {
    name: &'static str,
    passes: &'static [&'static str],
    changes: &'static [&'static str],
    images: &'static [&'static str],
    at_run_time: &'static str,
}

const MADE_ON_FIRST_USE: EffectTraits = EffectTraits {
    name: "",
    passes: &[],
    changes: &[],
    images: &[],
    at_run_time: "which pipelines, images and passes there are: made on first use",
};

const CONSTANT: EffectTraits =
    EffectTraits { at_run_time: "a specialization constant of tonemap.frag", ..MADE_ON_FIRST_USE };

/// All effects, in the order of the passes.
const EFFECTS: [EffectTraits; 11] = [
    EffectTraits {
        name: "camera-stream",
        passes: &["splat"],
        images: &["camera color"],
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "light-stream",
        passes: &["splat"],
        changes: &["splat", "fold", "mips", "reconstruct"],
        images: &["light color"],
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "fold",
        passes: &["fold"],
        images: &["batch color"],
        at_run_time: "every batch is folded",
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "variance",
        passes: &["variance"],
        images: &["camera variance", "light variance", "batch variance", "batch means"],
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "mips",
        passes: &["mips"],
        at_run_time: "the coarsest level that the number of samples asks for",
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "masking",
        passes: &["atlas", "bilateral"],
        changes: &["reconstruct"],
        images: &["atlas", "bilateral"],
        ..MADE_ON_FIRST_USE
    },
    EffectTraits {
        name: "reconstruction",
        passes: &["reconstruct", "error view"],
        images: &["picture XYZ"],
        ..MADE_ON_FIRST_USE
    },
    EffectTraits { name: "glare", passes: &["glare"], images: &["glare"], ..MADE_ON_FIRST_USE },
    EffectTraits {
        name: "tone-curve",
        passes: &["tonemap"],
        images: &["picture encoded", "transfer"],
        ..CONSTANT
    },
    EffectTraits { name: "gamut", ..CONSTANT },
    EffectTraits { name: "dither", changes: &["tonemap"], images: &["blue noise"], ..CONSTANT },
];

/// All effects of a film that receives these `streams`: camera, light.
pub fn effect_list(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<ClientEffect> {
    let effects = Effects::new(settings, 1);
    let picture = effects.view == DisplayView::Picture;
    let effect = |&EffectTraits { name, passes, changes, images, at_run_time }: &EffectTraits| {
        let (on, reason) = decision(name, spec, settings, &effects, streams);
        // One pass draws both streams: its time counts for the first of them.
        let counted = match name {
            "camera-stream" => streams[0],
            "light-stream" => !streams[0],
            _ => true,
        };
        let (passes, can_switch) = (if counted { passes } else { &[] }, SWITCHES.contains(&name) && picture);
        ClientEffect { name, on, reason, at_run_time, passes, changes, images, can_switch }
    };
    EFFECTS.iter().map(effect).collect()
}

/// Whether an effect is part of the picture, and why.
fn decision(
    name: &str,
    spec: &FilmSpec,
    settings: &Settings,
    effects: &Effects,
    streams: [bool; 2],
) -> (bool, String) {
    let picture = effects.view == DisplayView::Picture;
    let (on, reason) = match name {
        "camera-stream" if streams[0] => (true, "the method traces paths from the camera"),
        "camera-stream" => (false, "no path begins at the camera: no image, no splat"),
        "light-stream" if streams[1] => (true, "the method shows light paths to the camera"),
        "light-stream" => (false, "no light path is shown: no image, no splat, no mips"),
        "fold" => (true, "batches are added up as two floats, so that long renders do not stand still"),
        "variance" => match spec.variance {
            Some(VarianceForm::Product) => {
                (true, "for --vm, --show, an EXR file, or a window that may ask for them")
            }
            Some(VarianceForm::Paper) => (true, "in the paper's form"),
            None => (false, "no noise masking, no error view, no EXR file"),
        },
        "mips" => (true, "blur where samples are few"),
        "masking" => match effects.masking {
            Some(Masking::LowPass) => (true, "--vm above 0: a wider kernel where there is noise"),
            Some(Masking::Bilateral) => (true, "--vm above 0, --masking bilateral"),
            None if picture => (false, "--vm is 0"),
            None => (false, "--show: it is the noise that is shown"),
        },
        "reconstruction" if !picture => (true, "--show: the relative standard error"),
        "reconstruction" => match settings.reconstruction {
            Reconstruction::None => (false, "--reconstruct none: texels are copied as they are"),
            kind => return (true, format!("--reconstruct {}", kind.name())),
        },
        "glare" => match (effects.glare, settings.glare) {
            (true, _) => (true, "--glare"),
            (false, Some(_)) => (false, "--show: there is no light to scatter"),
            (false, None) => (false, "--glare off"),
        },
        "tone-curve" if picture => return (true, format!("--curve {}", effects.curve.name())),
        "tone-curve" => (false, "--show: greys are encoded as they are"),
        "gamut" if !picture => (false, "--show: no colours"),
        "gamut" if effects.output == ColorOutput::ScRgb => (false, "scRGB holds all colours"),
        "gamut" => (true, "colours that the display lacks lose saturation, not luminance"),
        _ => return (effects.dither != Dither::None, format!("--dither {}", effects.dither.name())),
    };
    (on, reason.to_string())
}

/// Effects that one setting turns on and off.
const SWITCHES: [&str; 4] = ["masking", "reconstruction", "glare", "dither"];

impl Settings {
    /// Turns an effect of [`effect_list`] on, in its plainest form, or off. Effects without a switch stay as they are.
    pub fn switch(&mut self, name: &str, on: bool) {
        match name {
            "masking" => self.vm = if on { 1.0 } else { 0.0 },
            "reconstruction" if on => self.reconstruction = Reconstruction::Gaussian,
            "reconstruction" => self.reconstruction = Reconstruction::None,
            "glare" => self.glare = on.then(Glare::default),
            "dither" if on => self.dither = Dither::Ordered,
            "dither" => self.dither = Dither::None,
            _ => (),
        }
    }
}
