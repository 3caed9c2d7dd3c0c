//! Which camera subpaths end in light that merging finds ([`vcm`](super::vcm)).

/// The kinds of vertices of a camera subpath, which decide whether emission that it hits next is found by merging.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Prefix {
    /// There are two vertices next to each other that are no deltas.
    Connectable,
    /// Deltas last; before them a surface with a diffuse part, if it is `merged`.
    Specular { merged: bool },
    /// No delta last: a surface with a diffuse part, or one without, or the camera.
    Spread { diffuse: bool },
}

impl Prefix {
    /// The camera alone.
    pub const CAMERA: Self = Self::Spread { diffuse: false };

    /// This prefix and one more vertex: scattering as a `delta` or not, by a surface with a `diffuse` part or without.
    #[inline]
    pub fn then(self, delta: bool, diffuse: bool) -> Self {
        match (self, delta) {
            (Self::Connectable, _) | (Self::Spread { .. }, false) => Self::Connectable,
            (Self::Spread { diffuse: merged }, true) => Self::Specular { merged },
            (Self::Specular { .. }, true) => self,
            (Self::Specular { .. }, false) => Self::Spread { diffuse },
        }
    }

    /// True where photons are gathered at the next vertex, if it has a diffuse part.
    #[inline]
    pub fn is_specular(self) -> bool {
        matches!(self, Self::Specular { .. })
    }

    /// True where merging finds the light that is hit next.
    #[inline]
    pub fn is_merged(self) -> bool {
        self == Self::Specular { merged: true }
    }
}
