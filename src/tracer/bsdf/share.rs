//! The share of a surface that a material covers, where it is blended with others or masked.

use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};

/// A product of opacities and weights, from 0 to 1. Some of them may vary over the surface.
#[derive(Clone, Debug)]
pub struct SurfaceShare {
    uniform: f32,
    varying: Vec<VaryingFactor>,
}

/// A factor that depends on the place.
#[derive(Clone, Debug)]
struct VaryingFactor {
    texture: SpectrumTexture,
    /// The factor is 1 minus the texture.
    rest: bool,
}

impl SurfaceShare {
    /// The whole surface.
    pub const ALL: Self = Self { uniform: 1.0, varying: Vec::new() };

    /// The part of this share that `texture` says.
    #[must_use]
    pub fn of(&self, texture: &SpectrumTexture) -> Self {
        self.times(texture, false)
    }

    /// The part of this share that `texture` leaves.
    #[must_use]
    pub fn rest_of(&self, texture: &SpectrumTexture) -> Self {
        self.times(texture, true)
    }

    fn times(&self, texture: &SpectrumTexture, rest: bool) -> Self {
        let mut product = self.clone();
        if texture.varies() {
            product.varying.push(VaryingFactor { texture: texture.clone(), rest });
        } else {
            let value = texture.scalar(&TexturePoint::default()).min(1.0);
            product.uniform *= if rest { 1.0 - value } else { value };
        }
        product
    }

    /// The share at a point.
    #[inline]
    pub fn at(&self, at: &TexturePoint) -> f32 {
        self.varying.iter().fold(self.uniform, |product, VaryingFactor { texture, rest }| {
            let value = texture.scalar(at).min(1.0);
            product * if *rest { 1.0 - value } else { value }
        })
    }

    /// True for a share of nothing, anywhere.
    pub fn is_none(&self) -> bool {
        self.uniform <= 0.0
    }
}

impl From<f32> for SurfaceShare {
    fn from(uniform: f32) -> Self {
        Self { uniform, varying: Vec::new() }
    }
}
