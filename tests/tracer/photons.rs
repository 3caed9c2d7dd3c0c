//! Photons for tests: reproducible numbers, and arrivals that can be told apart.

use glam::Vec3;
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::photon_map::Arrival;

/// Numbers from a counter (the finaliser of splitmix64).
pub struct Numbers(pub u64);

impl Numbers {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }

    /// Uniform in the unit cube.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

/// An arrival at `position` whose first lane of flux is `mark`.
pub fn arrival(position: Vec3, mark: f32) -> Arrival {
    Arrival {
        position,
        direction: Vec3::Z,
        normal: Vec3::Z,
        flux: SampledSpectrum(glam::Vec4::new(mark, 0.0, 0.0, 0.0)),
        wavelengths: 7,
        hero_only: false,
        depth: 2,
    }
}
