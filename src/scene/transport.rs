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

/// The methods the program has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Whichever of the others suits the scene; path tracing until that is known.
    Auto,
    /// Path tracing from the camera with next-event estimation.
    Path,
    /// Particle tracing: paths from lights, connected to the camera.
    Light,
    /// Bidirectional path tracing.
    Bidirectional,
    /// One-pass photon mapping: light paths leave photons, paths from the camera gather them.
    Photon,
}
