//! The shape of a lens.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;

use crate::math::warp;
use crate::scene::desc::LensDesc;

/// An aperture that is no disk: a regular polygon, or squeezed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aperture {
    /// Radius of the circle around it.
    pub(super) radius: f64,
    /// Corners; 0 is a disk.
    blades: u32,
    /// Angle of the first corner from +x, radians.
    turn: f64,
    /// Factor on x.
    narrowing: f64,
}

impl Aperture {
    pub(super) fn new(lens: &LensDesc) -> Self {
        // x is to the left, so that counter-clockwise in the picture is from y to x.
        let turn = FRAC_PI_2 - lens.blade_rotation.to_radians();
        Self { radius: lens.radius, blades: lens.blades, turn, narrowing: 1.0 / lens.squeeze }
    }

    /// The point of the lens that two numbers in [0, 1) choose, uniform over its area; (½, ½) is its centre.
    ///
    /// A polygon: an angle within a sector of the disk becomes a point of that side, and the radius its share of the way there. Areas of
    /// sectors and triangles both grow linearly with the first and with the square of the second.
    pub(super) fn at(&self, lens: [f32; 2]) -> DVec2 {
        let on_disk = warp::disk(lens).as_dvec2();
        let on_lens = match self.blades {
            0 => on_disk,
            blades => {
                let sides = f64::from(blades);
                let along = on_disk.to_angle().rem_euclid(TAU) / TAU * sides;
                let corner = |i: f64| DVec2::from_angle(self.turn + i * TAU / sides);
                let first = along.floor();
                on_disk.length() * corner(first).lerp(corner(first + 1.0), along - first)
            }
        };
        on_lens * self.radius * DVec2::new(self.narrowing, 1.0)
    }

    /// Radius of a circle around it.
    pub(super) fn reach(&self) -> f64 {
        self.radius * self.narrowing.max(1.0)
    }
}
