//! List of the client's effects for the user: which of them are on for given settings and streams, and why.
//!
//! This module reports the decisions of [`Effects`] and [`FilmSpec`] and makes none. The tracer has a separate list;
//! `render/effect_plan.rs` joins the two.

use crate::client::compiled_effects::Effects;
use crate::client::settings::{
    AdaptiveFilter, ColorOutput, Denoise, Dither, FilmSpec, Glare, Masking, OptionNames, Reconstruction,
    Settings, VarianceForm,
};

/// One effect of the client.
#[derive(Clone, Debug, PartialEq)]
pub struct ClientEffect {
    /// Its name.
    pub name: &'static str,
    /// Whether it is part of the picture.
    pub on: bool,
    /// The stream or option that needs it.
    pub reason: String,
    /// The mechanism that makes the decision at run time.
    pub at_run_time: &'static str,
    /// Names of its own passes in the timings.
    pub passes: &'static [&'static str],
    /// Names of other effects' passes that take longer with it.
    pub changes: &'static [&'static str],
    /// Name prefixes of the images and buffers that only this effect needs.
    pub images: &'static [&'static str],
    /// Whether [`Settings::switch`] turns it on and off.
    pub can_switch: bool,
}

/// All effects of a film that receives these `streams` (camera, light), in the order of the passes.
pub fn effect_list(spec: &FilmSpec, settings: &Settings, streams: [bool; 2]) -> Vec<ClientEffect> {
    let effects = Effects::new(settings, 1);
    let picture = !effects.view.is_error();
    let [camera, light] = streams;
    let effect = |name, on, reason: &str| ClientEffect {
        name,
        on,
        reason: reason.to_owned(),
        at_run_time: "which pipelines, images and passes there are: made on first use",
        passes: &[],
        changes: &[],
        images: &[],
        can_switch: picture && SWITCHES.contains(&name),
    };
    let constant = |name, on, reason: &str| ClientEffect {
        at_run_time: "a specialization constant of tonemap.frag",
        ..effect(name, on, reason)
    };
    // One pass draws both streams; its time is attributed to the first of them.
    let splat = |counted| -> &[&str] { if counted { &["splat"] } else { &[] } };
    let camera_reason = match camera {
        true => "the method traces paths from the camera",
        false => "no path begins at the camera: no image, no splat",
    };
    let light_reason = match light {
        true => "the method shows light paths to the camera",
        false => "no light path is shown: no image, no splat, no mips",
    };
    let variance_reason = match spec.variance {
        Some(VarianceForm::Product) => "for --vm, --show, an EXR file, or a window that may ask for them",
        Some(VarianceForm::Paper) => "in the paper's form",
        None => "no noise masking, no error view, no EXR file",
    };
    let filter = picture && settings.denoise != Denoise::Off;
    let filter_reason = match settings.denoise {
        Denoise::Wavelet if filter => {
            "--denoise wavelet: bands are kept where two halves of the samples agree; two rays per pixel find first rough surfaces"
        }
        Denoise::Oidn if filter => {
            "--denoise oidn: the network of Open Image Denoise; two rays per pixel find first rough surfaces"
        }
        _ if picture => "--denoise off: no halves are kept, no rays for features",
        _ => "--show: it is the noise that is shown",
    };
    let reproject = filter && settings.reproject;
    let reproject_reason = match reproject {
        true => {
            "the last filtered picture stands in for samples of a new view of the same scene, until they outweigh it"
        }
        false if filter => "every view begins with samples alone",
        false => "there is no filtered picture",
    };
    let steer = reproject && settings.steer && camera;
    let steer_reason = match steer {
        true => {
            "after a move of the camera the first camera paths go where the last picture shows least; with weights, so that the mean is that of even ones"
        }
        false if !reproject => "no picture is carried over to another view",
        false if !camera => "no path begins at the camera",
        false => "camera paths of a new view are even",
    };
    let masking_reason = match effects.masking {
        Some(Masking::LowPass) => "--vm above 0: a wider kernel where there is noise",
        Some(Masking::Bilateral) => "--vm above 0, --masking bilateral",
        None if picture => "--vm is 0",
        None => "--show: it is the noise that is shown",
    };
    let adaptive = light && effects.adaptive_light;
    let adaptive_reason = match settings.adaptive_filter {
        AdaptiveFilter::Off => "--adaptive-filter off: one level of detail for all of the light",
        AdaptiveFilter::Light if adaptive => {
            "--adaptive-filter light: kernels are wide where light samples are few, and end at edges"
        }
        AdaptiveFilter::Light if !light => "no light path is shown",
        AdaptiveFilter::Light if picture => "--reconstruct none: texels are copied as they are",
        AdaptiveFilter::Light => "--show: it is the noise that is shown",
    };
    let copied = picture && settings.reconstruction == Reconstruction::None;
    let reconstruction_reason = match picture {
        false => "--show: the relative standard error".to_owned(),
        true if copied => "--reconstruct none: texels are copied as they are".to_owned(),
        true => format!("--reconstruct {}", settings.reconstruction.name()),
    };
    let glare_reason = match (effects.glare, settings.glare) {
        (true, _) => "--glare",
        (false, Some(_)) => "--show: there is no light to scatter",
        (false, None) => "--glare off",
    };
    let curve_reason = match picture {
        true => format!("--curve {}", effects.curve.name()),
        false => "--show: greys are encoded as they are".to_owned(),
    };
    let (gamut, gamut_reason) = match picture {
        false => (false, "--show: no colours"),
        true if effects.output == ColorOutput::ScRgb => (false, "scRGB holds all colours"),
        true => (true, "colours that the display lacks lose saturation, not luminance"),
    };
    let post = settings.post.effects().into_iter().map(|post| ClientEffect {
        passes: post.passes,
        images: &["picture spare"],
        can_switch: picture,
        ..match picture {
            true => effect(post.name, post.on, &post.options),
            false => effect(post.name, false, "--show: it is no picture of light"),
        }
    });
    let before = [
        ClientEffect {
            passes: splat(camera),
            images: &["camera color"],
            ..effect("camera-stream", camera, camera_reason)
        },
        ClientEffect {
            passes: splat(!camera),
            changes: &["splat", "fold", "mips", "reconstruct"],
            images: &["light color"],
            ..effect("light-stream", light, light_reason)
        },
        ClientEffect {
            passes: &["fold"],
            images: &["batch color"],
            at_run_time: "every batch is folded",
            ..effect(
                "fold",
                true,
                "batches are added up as two floats, so that long renders do not stand still",
            )
        },
        ClientEffect {
            passes: &["variance"],
            images: &["camera variance", "light variance", "batch variance", "batch means"],
            ..effect("variance", spec.variance.is_some(), variance_reason)
        },
        ClientEffect {
            passes: &["mips"],
            at_run_time: "the coarsest level that the number of samples asks for",
            ..effect("mips", true, "blur where samples are few")
        },
        ClientEffect {
            passes: &["atlas", "bilateral"],
            changes: &["reconstruct"],
            images: &["atlas", "bilateral"],
            ..effect("masking", effects.masking.is_some(), masking_reason)
        },
        ClientEffect {
            passes: &["adaptive filter"],
            changes: &["mips", "reconstruct"],
            images: &["adaptive"],
            can_switch: picture && light,
            ..effect("adaptive-filter", adaptive, adaptive_reason)
        },
        ClientEffect {
            at_run_time: "a thread of its own, started with the first filtered picture; a device that sums the samples computes the wavelets",
            ..effect("noise-filter", filter, filter_reason)
        },
        ClientEffect {
            at_run_time: "the thread of the noise filter, when another view of the scene begins",
            can_switch: filter,
            ..effect("reprojection", reproject, reproject_reason)
        },
        ClientEffect {
            at_run_time: "the tracer goes on by another density once the thread of the noise filter has found it; not with photon maps, remote tracers or a light mix",
            can_switch: reproject && camera,
            ..effect("steering", steer, steer_reason)
        },
        ClientEffect {
            passes: &["reconstruct", "error view"],
            images: &["picture XYZ"],
            at_run_time: "which pipelines, images and passes there are: made on first use; a compute shader on GPUs where all pixels read the same levels",
            ..effect("reconstruction", !copied, &reconstruction_reason)
        },
        ClientEffect {
            passes: &["glare"],
            images: &["glare"],
            ..effect("glare", effects.glare, glare_reason)
        },
    ];
    let after = [
        ClientEffect {
            passes: &["tonemap"],
            images: &["picture encoded", "transfer"],
            ..constant("tone-curve", picture, &curve_reason)
        },
        constant("gamut", gamut, gamut_reason),
        ClientEffect {
            changes: &["tonemap"],
            images: &["blue noise"],
            ..constant(
                "dither",
                effects.dither != Dither::None,
                &format!("--dither {}", effects.dither.name()),
            )
        },
    ];
    before.into_iter().chain(post).chain(after).collect()
}

/// Effects with a single on/off setting, besides the post-processes.
const SWITCHES: [&str; 7] =
    ["masking", "noise-filter", "reprojection", "steering", "reconstruction", "glare", "dither"];

impl Settings {
    /// Switches an effect of [`effect_list`] on, in its simplest form, or off. Effects without a switch stay unchanged.
    pub fn switch(&mut self, name: &str, on: bool) {
        match name {
            "masking" => self.vm = if on { 1.0 } else { 0.0 },
            "adaptive-filter" if on => self.adaptive_filter = AdaptiveFilter::Light,
            "adaptive-filter" => self.adaptive_filter = AdaptiveFilter::Off,
            "noise-filter" => self.denoise = if on { Denoise::Wavelet } else { Denoise::Off },
            "reprojection" => self.reproject = on,
            "steering" => self.steer = on,
            "reconstruction" if on => self.reconstruction = Reconstruction::Gaussian,
            "reconstruction" => self.reconstruction = Reconstruction::None,
            "glare" => self.glare = on.then(Glare::default),
            "dither" if on => self.dither = Dither::Ordered,
            "dither" => self.dither = Dither::None,
            post => self.post.switch(post, on),
        }
    }
}
