//! Distributions of microfacet normals: Beckmann and GGX, each with its masking and its visible normals.
//!
//! Semantics are those of Mitsuba 3's `MicrofacetDistribution`: roughness per axis, at least [`MIN_ALPHA`]; Smith's
//! masking, separable (G = G₁·G₁). Beckmann's G₁ is the exact one; Mitsuba's is a rational fit up to 0.35 % off, and
//! then the density of a sample is off by as much.
//!
//! Masking comes as the *cross-section* of the facets in direction v, σ(v) = ∫ D(m) ⟨v, m⟩ dm = |cos θ| / G₁(v)
//! (Heitz, *Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs*, JCGT 3(2), 2014, eq. 14). Unlike
//! G₁ / cos θ it is never 0/0 at grazing angles, and every formula of the rough materials is shorter in it.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::erf::{erf, erf_inv};
use crate::math::warp;
use crate::scene::desc::texture::TexturePoint;
use crate::scene::desc::{AlphaTexture, Facets, Roughness};

/// The smoothest that a rough surface can be; smaller values are this one, as in Mitsuba.
pub const MIN_ALPHA: f32 = 1e-4;

/// 1/√π.
const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// A lobe narrower than this, 64 units in the last place of a direction, is one direction: values at rounded directions would be off by
/// more than some per cent at its edge, and their integral by a thousandth.
const NARROWEST: f32 = 64.0 / 16_777_216.0;

/// Below this D·cos θ is nothing: it keeps 0/0 out of the far tail.
const NOTHING: f32 = 1e-20;

/// A distribution of facet normals around +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    facets: Facets,
    alpha: Vec2,
}

impl Microfacet {
    /// The distribution of this roughness.
    #[inline]
    pub fn new(roughness: Roughness) -> Self {
        let alpha = Vec2::from_array(roughness.alpha).max(Vec2::splat(MIN_ALPHA));
        Self { facets: roughness.facets, alpha }
    }

    /// The distribution at a point of a surface: this one, or one whose roughness varies.
    #[inline]
    pub fn textured(&self, alpha: Option<&AlphaTexture>, at: &TexturePoint) -> Self {
        match alpha {
            None => *self,
            Some(alpha) => Self::new(Roughness { facets: self.facets, alpha: alpha.at(at) }),
        }
    }

    /// D(m) per steradian, normalised: ∫ D(m) cos θₘ dm = 1. 0 below the horizon.
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let s2 = (m.truncate() / self.alpha).length_squared();
        let (z2, scale) = (m.z * m.z, PI * self.alpha.x * self.alpha.y);
        let d = match self.facets {
            Facets::Beckmann => (-s2 / z2).exp() / (scale * z2 * z2),
            Facets::Ggx => {
                let q = s2 + z2;
                1.0 / (scale * q * q)
            }
        };
        // Refuses NaN, too.
        if d * m.z > NOTHING { d } else { 0.0 }
    }

    /// Cross-section σ(v) = |cos θ| / G₁(v) of the facets seen from the unit direction `v`, on either side; > 0.
    #[inline]
    pub fn cross_section(&self, v: Vec3) -> f32 {
        let (z, s2) = (v.z.abs(), (v.truncate() * self.alpha).length_squared());
        match self.facets {
            Facets::Beckmann => {
                let s = s2.sqrt();
                let a = z / s;
                0.5 * (z * (1.0 + erf(a)) + s * FRAC_1_SQRT_PI * (-a * a).exp())
            }
            Facets::Ggx => 0.5 * (z + (z * z + s2).sqrt()),
        }
    }

    /// Smith's G₁(v): the share of the facets facing `v` that nothing hides.
    #[inline]
    pub fn g1(&self, v: Vec3) -> f32 {
        v.z.abs() / self.cross_section(v)
    }

    /// Whether single precision tells apart the directions of a lobe to which a mirrored pair belongs, whose sum is `half`. A direction rounded
    /// by ε turns the normal of that sum by ε / |`half`|, and the lobe is as wide as α. A pair that is not resolved belongs to
    /// a delta: `sample` finds it, and `eval` has nothing for it.
    ///
    /// That concerns reflections within 1.1° of a surface of α = 1e-4, refraction by an index of 1.0003 for α < .013, and not much else.
    #[inline]
    pub fn resolves(&self, half: Vec3) -> bool {
        resolves(half, self.alpha.min_element())
    }

    /// The same of a refracted pair, `half` being the sum of both directions with the index of `wi`'s side over that of `wo`'s, `eta`, as a
    /// factor of `wi`. The cosine to the facet must not be lost either: where indices are close, it is the edge-on facets that bend most.
    #[inline]
    pub fn resolves_refraction(&self, half: Vec3, wo: Vec3, eta: f32) -> bool {
        (half.length() * self.alpha.min_element()).min(half.dot(wo).abs()) > NARROWEST * eta.max(1.0)
    }

    /// A facet normal as it is seen from the unit direction `wo` (above the horizon), with density
    /// D(m) ⟨wo, m⟩ / σ(wo) per steradian.
    #[inline]
    pub fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        // The surface stretched until its roughness is 1.
        let w = (wo.truncate() * self.alpha).extend(wo.z).normalize();
        let m = match self.facets {
            Facets::Beckmann => beckmann_visible(w, u),
            Facets::Ggx => ggx_visible(w, u),
        };
        (m.truncate() * self.alpha).extend(m.z).normalize_or(Vec3::Z)
    }
}

/// [`Microfacet::resolves`] for any distribution of this width.
#[inline]
pub(super) fn resolves(half: Vec3, alpha: f32) -> bool {
    half.length() * alpha > NARROWEST
}

/// `wo` + η `wi`, which is along the normal of the facet that refracts `wi` to `wo`, and points into the denser medium. The sum of the
/// directions themselves is exact where they are nearly opposite.
#[inline]
pub(super) fn refracting_half(wo: Vec3, wi: Vec3, eta: f32) -> Vec3 {
    (wo + wi) + wi * (eta - 1.0)
}

/// The normal of that facet, above the horizon.
#[inline]
pub(super) fn refracting_normal(half: Vec3) -> Vec3 {
    half.normalize_or_zero() * 1f32.copysign(half.z)
}

/// How far a facet bends light: wo + η wi = −m · bend, η cos θₜ − cos θₒ, without their difference; `through` is
/// [`fresnel::through`](super::fresnel::through). The solid angle of facets per solid angle of refracted directions is η · `through` / bend² (Walter et al., eq. 17).
#[inline]
pub(super) fn bend(cos: f32, eta: f32, through: f32) -> f32 {
    (eta - 1.0) * (eta + 1.0) / (cos + through)
}

/// Visible normal (any length) of GGX with roughness 1: half-way between `w` and a point of the spherical cap of
/// reflections (Dupuy and Benyoub, *Sampling Visible GGX Normals with Spherical Caps*, 2023). With the cap's radius
/// from the unit disk, height and radius are sums and products of what is not negative: nothing cancels.
#[inline]
fn ggx_visible(w: Vec3, u: [f32; 2]) -> Vec3 {
    let (d, top) = (warp::disk(u), 1.0 + w.z);
    let height = top * (1.0 - d.length_squared()).max(0.0);
    // The reflected direction has the height 1 − r²·top, and this radius over r.
    let radius = (w.truncate().length_squared() + top * height).sqrt();
    (d * radius + w.truncate()).extend(height)
}

/// Visible normal (any length) of Beckmann with roughness 1, by slopes: across `w` they are Gaussian, along it the
/// distribution is inverted (Heitz and d'Eon, *Importance Sampling Microfacet-Based BSDFs using the Distribution of
/// Visible Normals*, EGSR 2014, §4).
#[inline]
fn beckmann_visible(w: Vec3, u: [f32; 2]) -> Vec3 {
    let sin = w.truncate().length();
    let along = if sin > 0.0 { w.truncate() / sin } else { Vec2::X };
    // The middle of the cell of 2⁻²⁴ keeps the slope finite.
    let across = erf_inv(2.0 * u[1] - (1.0 - 1.0 / 16_777_216.0));
    let slope = along * beckmann_slope(w.z / sin, u[0]) + along.perp() * across;
    Vec3::new(-slope.x, -slope.y, 1.0)
}

/// Solves F(b) = u·F(a) for the slope b along the view, where a = cot θ and F(b) ∝ a (1 + erf b) + e^(−b²)/√π is
/// the share of the visible facets with slopes up to b (those beyond a face away).
///
/// In t = erf b, F rises and is concave: Newton's steps come from the left without overshooting, except the
/// first one, which the bracket holds. Scaled by max(1, a), so that both the normal and the grazing view are finite.
fn beckmann_slope(a: f32, u: f32) -> f32 {
    const STEPS: usize = 16;
    const LOWEST: f32 = -1.0 + 1.0 / 16_777_216.0;
    let (linear, bell) = if a > 1.0 { (1.0, FRAC_1_SQRT_PI / a) } else { (a, FRAC_1_SQRT_PI) };
    let highest = erf(a);
    let total = linear * (1.0 + highest) + bell * (-a * a).exp();
    // The exact solution for the grazing view, where the curve bends most; there erf a = 0.
    let mut t = highest - (1.0 + highest) * erf((-u.max(1e-12).ln()).sqrt());
    let (mut low, mut high) = (LOWEST, highest.min(-LOWEST));
    for _ in 0..STEPS {
        t = if t > low && t < high { t } else { 0.5 * (low + high) };
        let b = erf_inv(t);
        let off = linear * (1.0 + t) + bell * (-b * b).exp() - u * total;
        if off.abs() < 1e-6 * total {
            break;
        }
        if off < 0.0 {
            low = t
        } else {
            high = t
        }
        // dF/dt, with d(e^(−b²))/dt = −b √π.
        t -= off / (linear - bell * b / FRAC_1_SQRT_PI);
    }
    erf_inv(t.clamp(LOWEST, -LOWEST))
}
