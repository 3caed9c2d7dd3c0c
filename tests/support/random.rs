//! Random numbers for tests, the same in every run.

use glam::DVec3;

/// Numbers in [0, 1) that do not repeat soon.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = self.0 ^ (self.0 >> 33);
        ((x.wrapping_mul(0xff51_afd7_ed55_8ccd)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// As [`Random::next`] with the precision of the sampler; below 1.
    pub fn unit(&mut self) -> f32 {
        (self.next() * 16_777_216.0).floor() as f32 / 16_777_216.0
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0;
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                return v.normalize();
            }
        }
    }
}
