//! What settings and streams call for, on the client's side, and why: the list that people read.
//!
//! Nothing is decided here: [`Effects`] and [`FilmSpec`] do that for the code that runs, and this says what came of it. The tracer's
//! half is `tracer/effects`; `app/plan.rs` joins the two.

use crate::client::effects::Effects;
use crate::client::settings::{
    Dither, FilmSpec, Glare, Masking, Output, Reconstruction, Settings, ToneCurve, VarianceForm, View,
};

/// One effect of the client.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// What it is called.
    pub name: &'static str,
    /// It is part of the picture.
    pub on: bool,
    /// Which stream or option asks for it, or would.
    pub reason: &'static str,
    /// What decides it while the program runs.
    pub at_run_time: &'static str,
    /// The passes that do it alone, as timings call them.
    pub passes: &'static [&'static str],
    /// Passes of others that take longer with it.
    pub changes: &'static [&'static str],
    /// What the names of the images and buffers that only it needs begin with.
    pub images: &'static [&'static str],
    /// [`Settings::switch`] turns it on and off.
    pub can_switch: bool,
}

/// On or off, and why.
type State = (bool, &'static str);

/// What belongs to an effect: its passes, and the beginnings of the names of its images.
type Parts = (&'static [&'static str], &'static [&'static str]);

const POOL: &str = "which pipelines, images and passes there are: made on first use";
const CONSTANT: &str = "a specialization constant of tonemap.frag";

/// All effects, in the order of the passes, for a film that receives these `streams`, camera and light.
pub fn listed(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<Listed> {
    let effects = Effects::new(settings, 1);
    // Both streams are drawn by one pass: its time is the first one's.
    let first = usize::from(!streams[0]);
    let splat = |stream| if stream == first { &["splat"][..] } else { &[] };
    let of = |name, (passes, images): Parts, (on, reason): State, at_run_time| {
        let can_switch = SWITCHES.contains(&name) && effects.view == View::Picture;
        Listed { name, on, reason, at_run_time, passes, changes: changes(name), images, can_switch }
    };
    let variances = &["camera variance", "light variance", "batch variance", "batch means"];
    vec![
        of("camera-stream", (splat(0), &["camera color"]), camera(streams[0]), POOL),
        of("light-stream", (splat(1), &["light color"]), light(streams[1]), POOL),
        of("fold", (&["fold"], &["batch color"]), FOLD, "every batch is folded"),
        of("variance", (&["variance"], variances), variance(spec), POOL),
        of("mips", (&["mips"], &[]), MIPS, "the coarsest level that the number of samples asks for"),
        of("masking", (&["atlas", "bilateral"], &["atlas", "bilateral"]), masking(&effects), POOL),
        of("reconstruction", (&["reconstruct", "error view"], &["picture XYZ"]), kernel(settings), POOL),
        of("glare", (&["glare"], &["glare"]), glare(settings, &effects), POOL),
        of("tone-curve", (&["tonemap"], &["picture encoded", "transfer"]), curve(&effects), CONSTANT),
        of("gamut", (&[], &[]), gamut(&effects), CONSTANT),
        of("dither", (&[], &["blue noise"]), dither(&effects), CONSTANT),
    ]
}

/// Passes of others that take longer with an effect.
fn changes(name: &str) -> &'static [&'static str] {
    match name {
        "light-stream" => &["splat", "fold", "mips", "reconstruct"],
        "masking" => &["reconstruct"],
        "dither" => &["tonemap"],
        _ => &[],
    }
}

const FOLD: State = (true, "batches are added up as two floats, so that long renders do not stand still");
const MIPS: State = (true, "blur where samples are few");

fn camera(stream: bool) -> State {
    match stream {
        true => (true, "the method traces paths from the camera"),
        false => (false, "no path begins at the camera: no image, no splat"),
    }
}

fn light(stream: bool) -> State {
    match stream {
        true => (true, "the method shows light paths to the camera"),
        false => (false, "no light path is shown: no image, no splat, no mips"),
    }
}

fn variance(spec: &FilmSpec) -> State {
    match spec.variance {
        Some(VarianceForm::Product) => {
            (true, "for --vm, --show, an EXR file, or a window that may ask for them")
        }
        Some(VarianceForm::Paper) => (true, "in the paper's form"),
        None => (false, "no noise masking, no error view, no EXR file"),
    }
}

fn masking(effects: &Effects) -> State {
    match effects.masking {
        Some(Masking::LowPass) => (true, "--vm above 0: a wider kernel where there is noise"),
        Some(Masking::Bilateral) => (true, "--vm above 0, --masking bilateral"),
        None if effects.view == View::Picture => (false, "--vm is 0"),
        None => (false, "--show: it is the noise that is shown"),
    }
}

fn kernel(settings: &Settings) -> State {
    match settings.reconstruction {
        _ if settings.view != View::Picture => (true, "--show: the relative standard error"),
        Reconstruction::Gaussian => (true, "--reconstruct gaussian"),
        Reconstruction::CatmullRom => (true, "--reconstruct catmull-rom"),
        Reconstruction::Mipmap => (true, "--reconstruct mipmap"),
        Reconstruction::None => (false, "--reconstruct none: texels are copied as they are"),
    }
}

fn glare(settings: &Settings, effects: &Effects) -> State {
    match (effects.glare, settings.glare) {
        (true, _) => (true, "--glare"),
        (false, Some(_)) => (false, "--show: there is no light to scatter"),
        (false, None) => (false, "--glare off"),
    }
}

fn curve(effects: &Effects) -> State {
    match effects.curve {
        _ if effects.view != View::Picture => (false, "--show: greys are encoded as they are"),
        ToneCurve::Paper => (true, "--curve paper"),
        ToneCurve::PbrNeutral => (true, "--curve pbr-neutral"),
        ToneCurve::AgX => (true, "--curve agx"),
    }
}

fn gamut(effects: &Effects) -> State {
    match (effects.view, effects.output) {
        (View::Picture, Output::ScRgb) => (false, "scRGB holds all colours"),
        (View::Picture, _) => (true, "colours that the display lacks lose saturation, not luminance"),
        _ => (false, "--show: no colours"),
    }
}

fn dither(effects: &Effects) -> State {
    match effects.dither {
        Dither::None => (false, "--dither none"),
        Dither::Ordered => (true, "--dither ordered"),
        Dither::BlueNoise => (true, "--dither blue-noise"),
    }
}

/// Effects that one setting turns on and off.
const SWITCHES: [&str; 4] = ["masking", "reconstruction", "glare", "dither"];

impl Settings {
    /// Turns an effect of [`listed`] on, to its plainest kind, or off. Others stay as they are.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn on(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<&'static str> {
        listed(spec, settings, streams).into_iter().filter(|d| d.on).map(|d| d.name).collect()
    }

    const PLAIN: FilmSpec = FilmSpec {
        width: 8,
        height: 8,
        filter: crate::client::SplatFilter::Gaussian,
        variance: None,
        sums: crate::client::Summation::TwoFloat,
    };

    #[test]
    fn what_is_asked_for_is_on() {
        let always = ["fold", "mips", "reconstruction", "tone-curve", "gamut"];
        let found = on(&PLAIN, &Settings::default(), [true, false]);
        assert_eq!(found, [&["camera-stream"][..], &always].concat());
        let all = Settings {
            vm: 1.0,
            glare: Some(Glare::default()),
            dither: Dither::Ordered,
            ..Settings::default()
        };
        let spec = FilmSpec { variance: Some(VarianceForm::Product), ..PLAIN };
        assert_eq!(on(&spec, &all, [true; 2]).len(), listed(&spec, &all, [true; 2]).len());
        let error = Settings { view: View::CameraVariance, ..all };
        assert_eq!(
            on(&spec, &error, [true, false]),
            ["camera-stream", "fold", "variance", "mips", "reconstruction", "dither"]
        );
    }

    #[test]
    fn switches_switch() {
        let listed = listed(&PLAIN, &Settings::default(), [true; 2]);
        for Listed { name, on: before, .. } in listed.into_iter().filter(|l| l.can_switch) {
            let mut settings = Settings::default();
            for wanted in [!before, before] {
                settings.switch(name, wanted);
                assert_eq!(on(&PLAIN, &settings, [true; 2]).contains(&name), wanted, "{name}");
            }
        }
    }
}
