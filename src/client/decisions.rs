//! What settings and streams call for, on the client's side, and why: the list that people read.
//!
//! Nothing is decided here: [`Effects`] and [`FilmSpec`] do that for the code that runs, and this says what came of it. The tracer's
//! half is `tracer/features`; `app/plan.rs` joins the two.

use crate::client::effects::Effects;
use crate::client::settings::{
    Dither, FilmSpec, Masking, Output, Reconstruction, Settings, ToneCurve, VarianceForm, View,
};

/// What is said about one effect of the client.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// What it is called.
    pub name: &'static str,
    /// It is part of the picture.
    pub on: bool,
    /// Which stream or option asks for it, or would.
    pub reason: String,
    /// The passes that do it alone, as timings call them.
    pub passes: &'static [&'static str],
    /// What the names of the images and buffers that only it needs begin with.
    pub images: &'static [&'static str],
}

/// All effects, in the order of the passes, for a film that receives these `streams`, camera and light.
pub fn decisions(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<Decision> {
    let effects = Effects::new(settings, 1);
    let shown = effects.view == View::Picture;
    // Both streams are drawn by one pass: its time is the first one's.
    let first = usize::from(!streams[0]);
    let splat = |stream| if stream == first { &["splat"][..] } else { &[] };
    let of = |name, (passes, images), (on, reason): (bool, &str)| Decision {
        name,
        on,
        reason: reason.to_string(),
        passes,
        images,
    };
    vec![
        of(
            "camera-stream",
            (splat(0), &["camera color"]),
            match streams[0] {
                true => (true, "the method traces paths from the camera"),
                false => (false, "no path begins at the camera: no image, no splat"),
            },
        ),
        of(
            "light-stream",
            (splat(1), &["light color"]),
            match streams[1] {
                true => (true, "the method shows light paths to the camera"),
                false => (false, "no light path is shown: no image, no splat, no mips"),
            },
        ),
        of(
            "fold",
            (&["fold"], &["batch color"]),
            (true, "batches are added up as two floats, so that long renders do not stand still"),
        ),
        of(
            "variance",
            (&["variance"], &["camera variance", "light variance", "batch variance", "batch means"]),
            match spec.variance {
                Some(VarianceForm::Product) => {
                    (true, "for --vm, --show, an EXR file, or a window that may ask for them")
                }
                Some(VarianceForm::Paper) => (true, "in the paper's form"),
                None => (false, "no noise masking, no error view, no EXR file"),
            },
        ),
        of("mips", (&["mips"], &[]), (true, "blur where samples are few")),
        of(
            "masking",
            (&["atlas", "bilateral"], &["atlas", "bilateral"]),
            match effects.masking {
                Some(Masking::LowPass) => (true, "--vm above 0: a wider kernel where there is noise"),
                Some(Masking::Bilateral) => (true, "--vm above 0, --masking bilateral"),
                None if shown => (false, "--vm is 0"),
                None => (false, "--show: it is the noise that is shown"),
            },
        ),
        of(
            "reconstruction",
            (&["reconstruct", "error view"], &["picture XYZ"]),
            match settings.reconstruction {
                _ if !shown => (true, "--show: the relative standard error"),
                Reconstruction::Gaussian => (true, "--reconstruct gaussian"),
                Reconstruction::CatmullRom => (true, "--reconstruct catmull-rom"),
                Reconstruction::Mipmap => (true, "--reconstruct mipmap"),
                Reconstruction::None => (false, "--reconstruct none: texels as they are"),
            },
        ),
        of(
            "glare",
            (&["glare"], &["glare"]),
            match (effects.glare, settings.glare) {
                (true, _) => (true, "--glare"),
                (false, Some(_)) => (false, "--show: there is no light to scatter"),
                (false, None) => (false, "--glare off"),
            },
        ),
        of(
            "tone-curve",
            (&["tonemap"], &["picture encoded", "transfer"]),
            match effects.curve {
                _ if !shown => (false, "--show: greys as they are"),
                ToneCurve::Paper => (true, "--curve paper"),
                ToneCurve::PbrNeutral => (true, "--curve pbr-neutral"),
                ToneCurve::AgX => (true, "--curve agx"),
            },
        ),
        of(
            "gamut",
            (&[], &[]),
            match (shown, effects.output) {
                (false, _) => (false, "--show: no colours"),
                (true, Output::ScRgb) => (false, "scRGB holds all colours"),
                (true, _) => (true, "colours that the display lacks lose saturation, not luminance"),
            },
        ),
        of(
            "dither",
            (&[], &["blue noise"]),
            match effects.dither {
                Dither::None => (false, "--dither none"),
                Dither::Ordered => (true, "--dither ordered"),
                Dither::BlueNoise => (true, "--dither blue-noise"),
            },
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::settings::Glare;

    fn on(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<&'static str> {
        decisions(spec, settings, streams).into_iter().filter(|d| d.on).map(|d| d.name).collect()
    }

    #[test]
    fn what_is_asked_for_is_on() {
        let plain = FilmSpec { width: 8, height: 8, filter: Default::default(), variance: None };
        let always = ["fold", "mips", "reconstruction", "tone-curve", "gamut"];
        let found = on(&plain, &Settings::default(), [true, false]);
        assert_eq!(found, [&["camera-stream"][..], &always].concat());
        let all = Settings {
            vm: 1.0,
            glare: Some(Glare::default()),
            dither: Dither::Ordered,
            ..Settings::default()
        };
        let spec = FilmSpec { variance: Some(VarianceForm::Product), ..plain };
        assert_eq!(on(&spec, &all, [true; 2]).len(), decisions(&spec, &all, [true; 2]).len());
        let error = Settings { view: View::CameraVariance, ..all };
        assert_eq!(
            on(&spec, &error, [true, false]),
            ["camera-stream", "fold", "variance", "mips", "reconstruction", "dither"]
        );
    }
}
