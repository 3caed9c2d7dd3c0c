//! Random numbers for tests, tools and the layers beside a picture, the same in every run. Paths draw from `tracer::sampler` instead.

use glam::{DVec3, Vec3};

use super::bits::{GOLDEN, mix};

/// A sequence of uniform random numbers that any seed may start: SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let bits = mix(self.0);
        self.0 = self.0.wrapping_add(GOLDEN);
        bits
    }

    /// The next number in [0, 1), a multiple of 2⁻²⁴ as the sampler gives them.
    pub fn f32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// The next number in [0, 1), a multiple of 2⁻⁵³.
    pub fn f64(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// The next number from `low` to below `high`.
    pub fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.f32()
    }

    /// The next whole number below `n`, 0 when `n` is 0. Its bias is `n` / 2⁶⁴.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % (n as u64).max(1)) as usize
    }

    /// A point, uniform in the unit cube.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.f32(), self.f32(), self.f32())
    }

    /// A direction, uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.f64(), self.f64(), self.f64()) * 2.0 - 1.0;
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                return v.normalize();
            }
        }
    }
}
