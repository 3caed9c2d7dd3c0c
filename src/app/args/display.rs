//! Options that say how the picture is shown.

use clap::{Args, ValueEnum};

use super::parse::{non_negative, positive, profile, view_angle};
use crate::client::{Adaptation, Glare, Reconstruction, Settings};

/// Display controls: none of them changes the samples.
#[derive(Args, Clone, Debug)]
pub struct DisplayArgs {
    /// Reconstruction of the displayed picture.
    #[arg(long, value_name = "KIND", default_value = "gaussian")]
    pub reconstruct: ReconstructArg,

    /// Noise masking strength Vm, 0 is off.
    #[arg(long, value_name = "X", default_value_t = Settings::default().vm, value_parser = non_negative)]
    pub vm: f32,

    /// Brightness B of the tone curve.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,

    /// Contrast C of the tone curve.
    #[arg(long, value_name = "C", default_value_t = Settings::default().contrast, value_parser = positive)]
    pub contrast: f32,

    /// Display gamma G.
    #[arg(long, value_name = "G", default_value_t = Settings::default().gamma, value_parser = positive)]
    pub gamma: f32,

    /// Display profile.
    #[arg(long, value_name = "NAME", default_value = "srgb", value_parser = profile)]
    pub profile: crate::color::Profile,

    /// Glare of the observer's eye in this state.
    #[arg(long, value_name = "STATE", default_value = "off")]
    pub glare: GlareArg,

    /// Angle that the picture's width fills in the observer's eye, for glare.
    #[arg(long, value_name = "DEGREES", default_value_t = Glare::default().view_angle, value_parser = view_angle)]
    pub view_angle: f32,
}

impl DisplayArgs {
    /// As the client takes them.
    pub fn settings(&self) -> Settings {
        Settings {
            reconstruction: self.reconstruct.into(),
            vm: self.vm,
            exposure: self.exposure,
            contrast: self.contrast,
            gamma: self.gamma,
            profile: self.profile.clone(),
            glare: self
                .glare
                .adaptation()
                .map(|adaptation| Glare { adaptation, view_angle: self.view_angle }),
            ..Settings::default()
        }
    }
}

/// `--reconstruct`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReconstructArg {
    /// Windowed Gaussian blur on two mip levels.
    Gaussian,
    /// Catmull–Rom spline on two mip levels.
    CatmullRom,
    /// Hardware mip-mapping.
    Mipmap,
    /// The texel as it is.
    None,
}

impl From<ReconstructArg> for Reconstruction {
    fn from(kind: ReconstructArg) -> Self {
        match kind {
            ReconstructArg::Gaussian => Reconstruction::Gaussian,
            ReconstructArg::CatmullRom => Reconstruction::CatmullRom,
            ReconstructArg::Mipmap => Reconstruction::Mipmap,
            ReconstructArg::None => Reconstruction::None,
        }
    }
}

/// `--glare`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GlareArg {
    /// None.
    Off,
    /// Daylight.
    Photopic,
    /// Dusk.
    Mesopic,
    /// Night.
    Scotopic,
}

impl GlareArg {
    /// The state of the eye, `None` when off.
    fn adaptation(self) -> Option<Adaptation> {
        match self {
            GlareArg::Off => None,
            GlareArg::Photopic => Some(Adaptation::Photopic),
            GlareArg::Mesopic => Some(Adaptation::Mesopic),
            GlareArg::Scotopic => Some(Adaptation::Scotopic),
        }
    }
}
