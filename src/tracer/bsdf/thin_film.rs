//! Interference in a film on facets (Born and Wolf, *Principles of Optics*, §1.6.4): light that its two faces reflect, again and again,
//! adds up by amplitude. Belcour and Barla (*A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence*,
//! SIGGRAPH 2017) integrate this over three channels; here each path has its wavelengths.

use std::f32::consts::PI;

use glam::Vec4;

use crate::scene::desc::ThinFilmDesc;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::SampledWavelengths;

use super::fresnel;

/// Least distance of a reflectance at normal incidence from 1, as root: beyond it no index of a transparent medium reflects so much.
const MOST_ROOT: f32 = 0.999;

/// A film at the wavelengths of a path.
#[derive(Clone, Copy, Debug, Default)]
pub struct ThinFilm {
    /// Share of the facets that it covers.
    weight: f32,
    /// Its index over that of the outside, at least 1.
    eta: f32,
    /// 4 π thickness / λ.
    turns: Vec4,
}

impl ThinFilm {
    /// A film of this thickness in nm; `lambda` in nm.
    pub fn new(weight: f32, eta: f32, thickness: f32, lambda: Vec4) -> Self {
        Self { weight, eta, turns: 4.0 * PI * thickness / lambda }
    }

    /// The film of a description at a point; none covers nothing.
    pub(super) fn of(desc: Option<&ThinFilmDesc>, at: &TexturePoint, lambda: &SampledWavelengths) -> Self {
        let Some(film) = desc else { return Self::default() };
        let (weight, thickness) = (film.weight.scalar(at).clamp(0.0, 1.0), film.thickness.scalar(at));
        Self::new(weight, film.eta, thickness.max(0.0), lambda.lambda())
    }

    /// It covers nothing.
    #[inline]
    pub(super) fn is_absent(&self) -> bool {
        self.weight == 0.0
    }

    /// The reflectance of facets of `bare` reflectance where the film covers them, per lane. `cos`: cosine outside; `base`: index of what
    /// is under the film over that of the outside.
    pub(super) fn over(&self, bare: Vec4, cos: f32, base: Vec4) -> Vec4 {
        bare + (self.reflectance(cos, base) - bare) * self.weight
    }

    /// The reflectance of what is covered, for unpolarised light, per lane: Airy's sum. 1 where what is under the film reflects all.
    pub fn reflectance(&self, cos: f32, base: Vec4) -> Vec4 {
        let film = Vec4::splat(self.eta);
        // n cos θ outside, in the film and under it, by Snell's law.
        let sin2 = (1.0 - cos) * (1.0 + cos);
        let (outer, inner2) = (Vec4::splat(cos), base * base - sin2);
        let middle = Vec4::splat(fresnel::through(cos, self.eta).unwrap_or(0.0));
        let inner = inner2.max(Vec4::ZERO).map(f32::sqrt);
        // cos of the phase between neighbouring reflections.
        let phase = (self.turns * middle).map(f32::cos);
        let sum = |first: Vec4, second: Vec4| {
            let (both, cross) = (first * second, 2.0 * first * second * phase);
            let divisor = 1.0 + both * both + cross;
            // Both faces reflect all where light grazes.
            let all = divisor.cmple(Vec4::splat(f32::MIN_POSITIVE));
            Vec4::select(all, Vec4::ONE, (first * first + second * second + cross) / divisor)
        };
        // Amplitudes: across the plane of incidence by n cos θ, within it by (cos θ) / n.
        let amplitude =
            |a: Vec4, b: Vec4| Vec4::select((a + b).cmpgt(Vec4::ZERO), (a - b) / (a + b), Vec4::ONE);
        let across = sum(amplitude(outer, middle), amplitude(middle, inner));
        let [film2, base2] = [film * film, base * base];
        let within = sum(amplitude(film2 * outer, middle), amplitude(base2 * middle, film2 * inner));
        let total = inner2.cmple(Vec4::ZERO) | outer.cmple(Vec4::ZERO);
        let mean = (0.5 * (across + within)).clamp(Vec4::ZERO, Vec4::ONE);
        Vec4::select(total, Vec4::ONE, mean)
    }
}

/// The index of a transparent medium that reflects this much at normal incidence, per lane: what stands for a metal under a film.
pub(super) fn index_of(at_normal: Vec4) -> Vec4 {
    let root = at_normal.max(Vec4::ZERO).map(f32::sqrt).min(Vec4::splat(MOST_ROOT));
    (1.0 + root) / (1.0 - root)
}
