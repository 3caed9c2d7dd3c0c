//! Options that say how the picture is shown.

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

use crate::client::post_process::PostSettings;
use crate::client::{
    Adaptation, AdaptiveFilter, DisplayView, Dither, Glare, Masking, Reconstruction, ReconstructionKernel,
    Settings, ToneCurve,
};
use crate::cmd::args::values::{kernel, non_negative, positive, profile, view_angle};

/// Display options: none of them changes the samples.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Display")]
pub struct DisplayArgs {
    /// How the sums of the film become a picture.
    #[arg(long, value_name = "KIND", default_value = "gaussian")]
    pub reconstruct: Reconstruction,

    /// Support of the reconstruction's Gaussian: its radius R, 1 to 4 texels in halves, and the exponent E of the window
    /// 1 − smoothstep(0, R, d)^E, 1 to 64 or none. The default is the paper's.
    #[arg(long, value_name = "R,E", default_value = "2.5,8", value_parser = kernel)]
    pub kernel: ReconstructionKernel,

    /// Strength of noise masking, in mip levels of blur per factor 4 of excess variance; 0 is off.
    #[arg(long, value_name = "X", default_value_t = Settings::default().vm, value_parser = non_negative)]
    pub vm: f32,

    /// How noise is masked if --vm is above 0.
    #[arg(long, value_name = "KIND", default_value = "low-pass")]
    pub masking: Masking,

    /// Streams of which every sample is shown through a kernel as wide as the density of samples around it requires; they are not masked.
    ///
    /// What is light by particles is smooth early and sharp later. Files in EXR hold the sums as they are.
    #[arg(long, value_name = "STREAM", default_value = "light")]
    pub adaptive_filter: AdaptiveFilter,

    /// Show the picture, or the relative standard error of a stream as grey (white is 100 %).
    #[arg(long, value_name = "WHAT", default_value = "picture")]
    pub show: DisplayView,

    /// Tone curve; --exposure and --contrast act before each.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub curve: ToneCurve,

    /// Dithering, which hides the steps of 8 bits.
    #[arg(long, value_name = "KIND", default_value = "none")]
    pub dither: Dither,

    /// Brightness B of the tone curve [default: 1; in the window what makes the scene's mean a middle grey].
    #[arg(long, value_name = "B", value_parser = positive)]
    pub exposure: Option<f32>,

    /// Contrast C of the tone curve.
    #[arg(long, value_name = "C", default_value_t = Settings::default().contrast, value_parser = positive)]
    pub contrast: f32,

    /// Display gamma.
    #[arg(long, value_name = "G", default_value_t = Settings::default().gamma, value_parser = positive)]
    pub gamma: f32,

    /// Display profile: srgb, display-p3, rec2020, or the file of an ICC matrix profile, whose tone curves replace --gamma. PNG files hold the
    /// profile of the file.
    #[arg(long, value_name = "NAME|FILE", default_value = "srgb", value_parser = profile)]
    pub profile: crate::color::Profile,

    /// Glare of the observer's eye (Spencer et al. 1995).
    #[arg(long, value_name = "STATE", default_value = "off")]
    pub glare: GlareArg,

    /// Angle that the picture's width fills in the observer's eye, for --glare.
    #[arg(long, value_name = "DEGREES", default_value_t = Glare::default().view_angle, value_parser = view_angle)]
    pub view_angle: f32,

    #[command(flatten)]
    pub post: PostSettings,
}

impl DisplayArgs {
    /// The settings as the client takes them.
    pub fn settings(&self) -> Settings {
        Settings {
            reconstruction: self.reconstruct,
            kernel: self.kernel,
            vm: self.vm,
            masking: self.masking,
            adaptive_filter: self.adaptive_filter,
            view: self.show,
            curve: self.curve,
            dither: self.dither,
            exposure: self.exposure.unwrap_or(Settings::default().exposure),
            contrast: self.contrast,
            gamma: self.gamma,
            profile: self.profile.clone(),
            glare: self.glare.0.map(|adaptation| Glare { adaptation, view_angle: self.view_angle }),
            post: self.post.clone(),
            ..Settings::default()
        }
    }
}

/// `--glare`: off, or the state of the observer's eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GlareArg(pub Option<Adaptation>);

impl ValueEnum for GlareArg {
    fn value_variants<'a>() -> &'a [Self] {
        use Adaptation::{Mesopic, Photopic, Scotopic};
        &[Self(None), Self(Some(Photopic)), Self(Some(Mesopic)), Self(Some(Scotopic))]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match &self.0 {
            None => Some(PossibleValue::new("off").help("No glare")),
            Some(adaptation) => adaptation.to_possible_value(),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct TestCommand {
        #[command(flatten)]
        display: DisplayArgs,
    }

    /// What a post-process says of itself on the command line is read as the same.
    #[test]
    fn post_processes_are_read_as_they_are_written() {
        let plain = Settings::default().post;
        for effect in plain.effects() {
            let mut settings = Settings::default();
            settings.switch(effect.name, true);
            let options = format!("test{}", settings.post.options());
            let read = TestCommand::parse_from(options.split(' ')).display.settings();
            assert_eq!(read, settings, "{options}");
            assert!(plain != read.post && plain.options().is_empty());
        }
    }
}
