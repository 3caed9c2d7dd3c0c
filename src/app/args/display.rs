//! Options that say how the picture is shown.

use clap::{Args, ValueEnum};

use super::values::{kernel, non_negative, positive, profile, view_angle};
use crate::client::{Adaptation, Dither, Glare, Kernel, Masking, Reconstruction, Settings, ToneCurve, View};

/// Display controls: none of them changes the samples.
#[derive(Args, Clone, Debug)]
pub struct DisplayArgs {
    /// Reconstruction of the displayed picture.
    #[arg(long, value_name = "KIND", default_value = "gaussian")]
    pub reconstruct: ReconstructArg,

    /// Where the Gaussian of --reconstruct ends: its radius R, 1 to 4 texels in halves, and the exponent E of the window
    /// 1 − smoothstep(0, R, d)^E, 1 to 64 or none.
    #[arg(long, value_name = "R,E", default_value = "2.5,8", value_parser = kernel)]
    pub kernel: Kernel,

    /// Noise masking strength Vm, 0 is off.
    #[arg(long, value_name = "X", default_value_t = Settings::default().vm, value_parser = non_negative)]
    pub vm: f32,

    /// How noise is masked where --vm is above 0.
    #[arg(long, value_name = "KIND", default_value = "low-pass")]
    pub masking: MaskingArg,

    /// What is shown: the picture, or the relative standard error of a stream as grey (white is 100 %).
    #[arg(long, value_name = "WHAT", default_value = "picture")]
    pub show: ShowArg,

    /// Tone curve.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub curve: CurveArg,

    /// What hides the steps of 8 bits.
    #[arg(long, value_name = "KIND", default_value = "none")]
    pub dither: DitherArg,

    /// Brightness B of the tone curve.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,

    /// Contrast C of the tone curve.
    #[arg(long, value_name = "C", default_value_t = Settings::default().contrast, value_parser = positive)]
    pub contrast: f32,

    /// Display gamma G.
    #[arg(long, value_name = "G", default_value_t = Settings::default().gamma, value_parser = positive)]
    pub gamma: f32,

    /// Display profile: srgb, display-p3, rec2020, or the file of an ICC matrix profile, whose tone curves replace --gamma.
    #[arg(long, value_name = "NAME|FILE", default_value = "srgb", value_parser = profile)]
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
            kernel: self.kernel,
            vm: self.vm,
            masking: self.masking.into(),
            view: self.show.into(),
            curve: self.curve.into(),
            dither: self.dither.into(),
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

/// An option with a closed set of values, each standing for one of the client's.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident for $target:ident { $($(#[$variant_doc:meta])* $variant:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)*
        }

        impl From<$name> for $target {
            fn from(choice: $name) -> Self {
                match choice {
                    $($name::$variant => $target::$variant,)*
                }
            }
        }
    };
}

choice! {
    /// `--reconstruct`.
    ReconstructArg for Reconstruction {
        /// Windowed Gaussian blur on two mip levels.
        Gaussian,
        /// Catmull–Rom spline on two mip levels.
        CatmullRom,
        /// Hardware mip-mapping.
        Mipmap,
        /// The texel as it is.
        None,
    }
}

choice! {
    /// `--masking`.
    MaskingArg for Masking {
        /// A wider blur.
        LowPass,
        /// Averages over neighbours whose difference is explained by noise; below 4 samples per pixel as low-pass.
        Bilateral,
    }
}

choice! {
    /// `--show`.
    ShowArg for View {
        /// The picture.
        Picture,
        /// Relative standard error of the camera stream.
        CameraVariance,
        /// Relative standard error of the light stream.
        LightVariance,
    }
}

choice! {
    /// `--curve`.
    CurveArg for ToneCurve {
        /// 1 − exp(−(B·Y)^C) on luminance.
        Paper,
        /// Khronos PBR Neutral: base colours as they are.
        PbrNeutral,
        /// AgX: film-like, highlights lose their colour.
        #[value(name = "agx")]
        AgX,
    }
}

choice! {
    /// `--dither`.
    DitherArg for Dither {
        /// Plain rounding.
        None,
        /// 8×8 matrix.
        Ordered,
        /// Blue noise.
        BlueNoise,
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
