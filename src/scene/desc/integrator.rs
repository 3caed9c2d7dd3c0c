//! The light transport method and its parameters.

use super::aov::AovDesc;
use super::integrator_kind::{IntegratorKind, PhotonUse};

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
    /// Participating media are left out, as by Mitsuba's `path`, which knows surfaces only.
    pub surfaces_only: bool,
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
            surfaces_only: false,
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

impl PhotonDesc {
    /// Whether a method with these photons blurs the picture by density estimation.
    pub fn blur(&self, kind: IntegratorKind) -> bool {
        match kind.traits().photons {
            PhotonUse::None => false,
            PhotonUse::Gathered => true,
            PhotonUse::Merged => self.caustics,
        }
    }
}

impl Default for PhotonDesc {
    fn default() -> Self {
        Self { initial_radius: None, alpha: None, lookup_size: None, caustics: true, gather: true }
    }
}
