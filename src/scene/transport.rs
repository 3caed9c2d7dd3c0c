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
