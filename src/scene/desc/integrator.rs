//! The light transport method and its parameters.

use super::aov::AovDesc;

/// The light transport method and its parameters.
#[derive(Clone, Debug)]
pub struct IntegratorDesc {
    /// The method.
    pub kind: IntegratorKind,
    /// Longest path in segments (1 = only what is emitted towards the camera, 2 = direct light); `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Path depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Lights are not seen directly by the camera.
    pub hide_emitters: bool,
    /// Four wavelengths are drawn for each path even where nothing has a colour.
    pub spectral: bool,
    /// Parameters of photon mapping.
    pub photons: PhotonDesc,
    /// Layers that are written beside the picture.
    pub aovs: Vec<AovDesc>,
}

impl Default for IntegratorDesc {
    /// The integrator of a scene that names none, as in Mitsuba.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            spectral: false,
            photons: PhotonDesc::default(),
            aovs: Vec::new(),
        }
    }
}

/// Parameters of photon lookups; those that are `None` follow from the size of the scene.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PhotonDesc {
    /// Radius of the first lookups, m; the largest there is.
    pub initial_radius: Option<f32>,
    /// α of Knaus and Zwicker 2011 in [0, 1): r² falls as n^(α−1).
    pub alpha: Option<f64>,
    /// Photons of a lookup, at most.
    pub lookup_size: Option<u32>,
    /// Photons that only mirrors, glass and coats have met are looked up.
    pub caustics: bool,
    /// All other photons are gathered.
    pub gather: bool,
}

impl Default for PhotonDesc {
    fn default() -> Self {
        Self { initial_radius: None, alpha: None, lookup_size: None, caustics: true, gather: true }
    }
}

/// The methods the program has. The comments are the help of `--integrator`.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize, serde::Deserialize,
)]
pub enum IntegratorKind {
    /// Path tracing: from the camera, with next-event estimation at each vertex.
    #[default]
    Path,
    /// Particle tracing: from the lights, each vertex connected to the camera. Nothing is seen in mirrors or glass.
    Light,
    /// Bidirectional path tracing: subpaths from both ends, connected at every vertex.
    Bidirectional,
    /// One-pass photon mapping: final gathering from photons that light paths leave. It converges: its blur shrinks as it goes.
    Photon,
    /// Vertex connection and merging: bidirectional path tracing, but caustics seen in mirrors and through glass are found by
    /// photons. Their blur shrinks as it goes; all else is unbiased.
    Vcm,
    /// No light: the distance to the first surface, as grey.
    Depth,
    /// The method that suits the scene, chosen by a short trial of each; the program says why. Path tracing until then.
    Auto,
}

impl IntegratorKind {
    /// The method's name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            IntegratorKind::Auto => "auto",
            IntegratorKind::Path => "path",
            IntegratorKind::Light => "light",
            IntegratorKind::Bidirectional => "bidirectional",
            IntegratorKind::Photon => "photon",
            IntegratorKind::Vcm => "vcm",
            IntegratorKind::Depth => "depth",
        }
    }

    /// True for the methods whose camera paths gather photons.
    pub const fn has_photons(self) -> bool {
        matches!(self, IntegratorKind::Photon | IntegratorKind::Vcm)
    }

    /// True for the methods that connect subpaths from both ends.
    pub const fn is_bidirectional(self) -> bool {
        matches!(self, IntegratorKind::Bidirectional | IntegratorKind::Vcm)
    }
}
