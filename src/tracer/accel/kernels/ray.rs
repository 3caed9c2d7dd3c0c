//! A ray in the terms of the box test and of the polygon test.

use glam::Vec3A;

use crate::tracer::accel::Ray;
use crate::tracer::accel::layout::Row;

use super::lanes::Lanes;

/// Share of the reach (the farthest that any coordinate can be from the origin of the ray or from zero) by which boxes are widened: 25 unit roundoffs.
///
/// To first order 15 are enough, so that no box is missed whose polygon the polygon test would accept. Box test: one
/// rounding each for the moved origin, its product with the reciprocal, the reciprocal, and one or two for the other
/// product and the sum, of up to twice the reach, displace a plane by 6 (10 for directions beyond 8e37, whose reciprocals are denormal). Polygon test: difference 1, shear (two for its
/// slope, at most 1; one each for z and the product) 4, and the last difference, of up to twice the reach, 2 displace a vertex
/// by 7. Its edge functions may come out as zero outside: 2. `tests/accel/watertight.rs` holds it, and fails without.
const WIDEN: f32 = 1.5e-6;

/// A ray in the terms of the box test.
pub(super) struct SlabRay<S: Lanes> {
    /// Rows of a node that hold the near and the far planes of each axis.
    near: [usize; 3],
    far: [usize; 3],
    /// Distances are `plane · inverse + offset`; the offsets hold the widening.
    inverse: [S::Floats; 3],
    offset_near: [S::Floats; 3],
    offset_far: [S::Floats; 3],
}

/// The smallest magnitude of a component of a direction in the box test: its reciprocal times any coordinate is finite.
const FLOOR: f32 = 1e-18;

/// A ray in the terms of both tests, which share their reciprocals. `None` for one that no walk can follow: not finite, from beyond
/// 1e18, where a float cannot tell anything of a scene apart, or with a direction shorter than 5e-12.
/// Of that the floor under its components would make another direction.
///
/// `extent` is the largest magnitude of a coordinate of what is walked.
#[inline(always)]
pub(super) fn prepared<S: Lanes>(s: S, extent: f32, ray: &Ray) -> Option<(SlabRay<S>, ShearedRay)> {
    let (o, d) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
    let size = d.abs();
    let (from, longest) = (o.abs().max_element(), size.max_element());
    // What is not finite makes NaN here, and NaN equals nothing.
    let finite = (o * 0.0 + d * 0.0).cmpeq(Vec3A::ZERO).all();
    if !(finite && from <= 1e18 && longest >= 5e-12 && ray.t_max > 0.0) {
        return None;
    }
    // A zero component becomes a huge finite reciprocal, so that no box test multiplies 0 by infinity.
    let inverse = (1.0 / size.max(Vec3A::splat(FLOOR))).copysign(d);
    let shift = Vec3A::splat(WIDEN * (extent + from)).copysign(d);
    let (offset_near, offset_far) = ((-o - shift) * inverse, (shift - o) * inverse);
    let negative = d.is_negative_bitmask() as usize;
    let near = [negative & 1, 2 | (negative >> 1 & 1), 4 | (negative >> 2 & 1)];
    let slab = SlabRay {
        near,
        far: [near[0] ^ 1, near[1] ^ 1, near[2] ^ 1],
        inverse: [s.splat(inverse.x), s.splat(inverse.y), s.splat(inverse.z)],
        offset_near: [s.splat(offset_near.x), s.splat(offset_near.y), s.splat(offset_near.z)],
        offset_far: [s.splat(offset_far.x), s.splat(offset_far.y), s.splat(offset_far.z)],
    };
    // Which axis is the longest cannot be foretold: arithmetic, not branches. The next two follow in a circle.
    let z = (size.cmpeq(Vec3A::splat(longest)).bitmask().trailing_zeros() & 3) as usize;
    let (x, y) = (0b00_10_01 >> (2 * z) & 3, 0b01_00_10 >> (2 * z) & 3);
    let [o, d, inverse] = [o, d, inverse].map(|v| v.extend(0.0).to_array());
    let scale_z = inverse[z];
    let sheared = ShearedRay {
        axes: [x, y, z],
        origin: [o[x], o[y], o[z]],
        slope: [d[x] * scale_z, d[y] * scale_z],
        scale_z,
    };
    Some((slab, sheared))
}

impl<S: Lanes> SlabRay<S> {
    /// Where the ray enters and leaves the boxes of a node, within `0` and `t_max`; it meets those that it enters before it
    /// leaves.
    #[inline(always)]
    pub(super) fn through(&self, s: S, node: &[Row; 8], t_max: f32) -> (S::Floats, S::Floats) {
        let near = |axis: usize| {
            s.mul_add(s.load(&node[self.near[axis] & 7]), self.inverse[axis], self.offset_near[axis])
        };
        let far = |axis: usize| {
            s.mul_add(s.load(&node[self.far[axis] & 7]), self.inverse[axis], self.offset_far[axis])
        };
        let enter = s.max(near(0), s.max(near(1), s.max(near(2), s.splat(0.0))));
        let leave = s.min(far(0), s.min(far(1), s.min(far(2), s.splat(t_max))));
        (enter, leave)
    }
}

/// A ray in the terms of the polygon test.
pub(super) struct ShearedRay {
    /// Axes x, y, z of the sheared space; z is the longest of the direction.
    axes: [usize; 3],
    origin: [f32; 3],
    slope: [f32; 2],
    pub(super) scale_z: f32,
}

/// A corner of every lane's polygon, in the sheared space.
pub(super) type Corner<S> = [<S as Lanes>::Floats; 3];

impl ShearedRay {
    /// The corners whose coordinates stand in three rows, from row `3 · corner` on.
    #[inline(always)]
    pub(super) fn shear<S: Lanes>(&self, s: S, rows: &[Row], corner: usize) -> Corner<S> {
        debug_assert!(3 * corner + 3 <= rows.len());
        // SAFETY: axes are 0, 1 and 2 in some order, and a block has three rows for every corner.
        let [x, y, z] = unsafe {
            [
                rows.get_unchecked(3 * corner + self.axes[0]),
                rows.get_unchecked(3 * corner + self.axes[1]),
                rows.get_unchecked(3 * corner + self.axes[2]),
            ]
        };
        let z = s.sub(s.load(z), s.splat(self.origin[2]));
        let x = s.sub(s.sub(s.load(x), s.splat(self.origin[0])), s.mul(s.splat(self.slope[0]), z));
        let y = s.sub(s.sub(s.load(y), s.splat(self.origin[1])), s.mul(s.splat(self.slope[1]), z));
        [x, y, z]
    }
}
