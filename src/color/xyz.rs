//! CIE XYZ tristimulus values, the only colour that crosses the stream (paper §3.3).

use std::ops::{Add, AddAssign, Mul};

/// A CIE 1931 2° tristimulus value; `y` is luminance. Scene-linear, unbounded.
///
/// The scale is relative: a D65 white of radiance 1 (as Mitsuba's `d65` spectrum) has `y = 1`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Xyz {
    /// X.
    pub x: f32,
    /// Y, the luminance.
    pub y: f32,
    /// Z.
    pub z: f32,
}

impl Xyz {
    /// Black.
    pub const BLACK: Xyz = Xyz { x: 0.0, y: 0.0, z: 0.0 };

    /// Makes a value from its three components.
    pub const fn new(x: f32, y: f32, z: f32) -> Self {
        Self { x, y, z }
    }

    /// True when all three components are finite.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }
}

impl Add for Xyz {
    type Output = Xyz;

    fn add(self, o: Xyz) -> Xyz {
        Xyz::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl AddAssign for Xyz {
    fn add_assign(&mut self, o: Xyz) {
        *self = *self + o;
    }
}

impl Mul<f32> for Xyz {
    type Output = Xyz;

    fn mul(self, s: f32) -> Xyz {
        Xyz::new(self.x * s, self.y * s, self.z * s)
    }
}
