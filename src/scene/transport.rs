//! What a scene asks of light transport.

/// Light transport.
#[derive(Clone, Debug)]
pub struct IntegratorDesc {
    /// Which method.
    pub kind: IntegratorKind,
    /// Longest path in segments (1 = only what is emitted towards the camera, 2 = direct light); `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Path depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Lights are not seen directly by the camera.
    pub hide_emitters: bool,
    /// Four wavelengths are drawn for each path even where nothing has a colour.
    pub spectral: bool,
    /// Of photon mapping.
    pub photons: PhotonDesc,
}

impl Default for IntegratorDesc {
    /// What a scene without an integrator gets, as in Mitsuba.
    fn default() -> Self {
        let photons = PhotonDesc::default();
        Self {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            spectral: false,
            photons,
        }
    }
}

/// How photons are looked up; what is `None` follows from the size of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonDesc {
    /// Radius of the first lookups, m; the largest there is.
    pub initial_radius: Option<f32>,
    /// α of Knaus and Zwicker 2011 in [0, 1): r² falls as n^(α−1).
    pub alpha: Option<f64>,
    /// Photons of a lookup, at most.
    pub lookup_size: Option<u32>,
    /// Photons that only mirrors, glass and coats have met are looked up.
    pub caustics: bool,
    /// All others are gathered.
    pub gather: bool,
}

impl Default for PhotonDesc {
    fn default() -> Self {
        Self { initial_radius: None, alpha: None, lookup_size: None, caustics: true, gather: true }
    }
}

/// The methods the program has. The comments are the help of `--integrator`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum IntegratorKind {
    /// Path tracing: from the camera, with next-event estimation at each vertex.
    Path,
    /// Particle tracing: from the lights, each vertex connected to the camera. Nothing is seen in mirrors or glass.
    Light,
    /// Bidirectional path tracing: subpaths from both ends, connected at every vertex.
    Bidirectional,
    /// One-pass photon mapping: final gathering from photons that light paths leave. It converges: its blur shrinks as it goes.
    Photon,
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
        }
    }
}
