//! Microflakes with the SGGX distribution of normals (Heitz, Dupuy, Crassin and Dachsbacher, *The SGGX microflake distribution*, 2015).
//!
//! The normals are those of an ellipsoid, S = L Lᵀ, which L makes of a sphere. Area and density are lengths of vectors, and the normals
//! that are seen from a direction are those of the sphere seen from its preimage:
//!
//! ```text
//! σ(ω) = |Lᵀ ω|     D(n) = 1 / (π det L |L⁻¹ n|⁴)     n = L m / |L m|, m around Lᵀ ω with the density cos / π
//! ```

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::warp;

/// Least square of an area over the sum of those along three axes: thinner fibres and flatter flakes are made this thick.
const LEAST: f64 = 1e-8;

/// A distribution of normals, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Microflakes {
    /// The square root of the trace of S.
    scale: f32,
    /// The columns of L over that, without what is 0.
    x: Vec3,
    y: [f32; 2],
    z: f32,
}

impl Microflakes {
    /// That of S_xx, S_yy, S_zz, S_xy, S_xz and S_yz; nothing is seen of a matrix that is 0.
    pub(super) fn new(s: [f64; 6]) -> Self {
        let trace = s[0] + s[1] + s[2];
        if trace.is_nan() || trace <= 0.0 {
            return Self { scale: 0.0, x: Vec3::X, y: [1.0, 0.0], z: 1.0 };
        }
        let [xx, yy, zz, xy, xz, yz] = s.map(|v| v / trace);
        // Cholesky's factorisation.
        let a = xx.max(LEAST).sqrt();
        let (b, c) = (xy / a, xz / a);
        let d = (yy - b * b).max(LEAST).sqrt();
        let e = (yz - b * c) / d;
        let f = (zz - c * c - e * e).max(LEAST).sqrt();
        let x = Vec3::new(a as f32, b as f32, c as f32);
        Self { scale: trace.sqrt() as f32, x, y: [d as f32, e as f32], z: f as f32 }
    }

    /// Lᵀ `d` over the scale.
    #[inline]
    fn to_sphere(self, d: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(d), self.y[0] * d.y + self.y[1] * d.z, self.z * d.z)
    }

    /// The area that is seen from the unit direction `d`, per area in all: σ.
    #[inline]
    pub(super) fn projected_area(self, d: Vec3) -> f32 {
        self.scale * self.to_sphere(d).length()
    }

    /// Bound of [`Self::projected_area`].
    pub(super) fn most_area(self) -> f32 {
        self.scale * self.square().sqrt()
    }

    /// The sum of the squares of L over the scale: 1, but for what was too thin.
    fn square(self) -> f32 {
        self.x.length_squared() + self.y[0] * self.y[0] + self.y[1] * self.y[1] + self.z * self.z
    }

    /// The density per steradian of scattering from `wo` to `wi`, times the area that is seen from `wo`: D / 4 at the half vector.
    #[inline]
    pub(super) fn eval(self, wo: Vec3, wi: Vec3) -> f32 {
        let h = wo + wi;
        let x = h.x / self.x.x;
        let y = (h.y - self.x.y * x) / self.y[0];
        let z = (h.z - self.x.z * x - self.y[1] * y) / self.z;
        let ratio = h.length_squared() / Vec3::new(x, y, z).length_squared();
        let density = self.scale * (0.25 * FRAC_1_PI) * ratio * ratio / (self.x.x * self.y[0] * self.z);
        // No flake turns light straight on.
        if density.is_finite() { density } else { 0.0 }
    }

    /// The direction into which a flake that is seen from `wo` mirrors it.
    #[inline]
    pub(super) fn sample(self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let seen = self.to_sphere(wo).normalize();
        let m = Frame::new(seen).to_world(warp::cosine_hemisphere(u));
        let n = Vec3::new(
            self.x.x * m.x,
            self.x.y * m.x + self.y[0] * m.y,
            self.x.z * m.x + self.y[1] * m.y + self.z * m.z,
        );
        let n = n.normalize_or_zero();
        (2.0 * wo.dot(n) * n - wo).normalize()
    }

    /// True where the density has a peak: the flakes are far from those of a sphere.
    pub(super) fn is_peaked(self) -> bool {
        let mean = self.square() / 3.0;
        let det = self.x.x * self.y[0] * self.z;
        2.0 * det * det < mean * mean * mean
    }
}
