//! A ray in the terms of the box test and of the polygon test.

use glam::Vec3A;

use crate::tracer::accel::Ray;
use crate::tracer::accel::layout::Row;

use super::lanes::Lanes;

/// Share of the reach (the farthest coordinate from ray origin or zero) by which boxes are widened: 25 unit roundoffs.
///
/// To first order 15 are enough, so that no box is missed whose polygon the polygon test would accept. Box test: one
/// rounding each for the moved origin, its product with the reciprocal, the reciprocal, and one or two for the other
/// product and the sum, of up to twice the reach, displace a plane by 6. Polygon test: difference 1, shear (two for its
/// slope, at most 1; one each for z and the product) 4, and the last difference, of up to twice the reach, 2 displace a vertex
/// by 7. Its edge functions may come out as zero outside: 2. `tests/accel_watertight.rs` holds it, and fails without.
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

/// A ray in the terms of both tests, which share their reciprocals.
#[inline(always)]
pub(super) fn prepared<S: Lanes>(s: S, (lo, hi): (Vec3A, Vec3A), ray: &Ray) -> (SlabRay<S>, ShearedRay<S>) {
    let (o, d) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
    let size = d.abs();
    // A zero component becomes a huge finite reciprocal, so that no box test multiplies 0 by infinity.
    let inverse = (1.0 / size.max(Vec3A::splat(1e-18))).copysign(d);
    let reach = (lo - o).abs().max((hi - o).abs()).max(o.abs()).max_element();
    let shift = Vec3A::splat(WIDEN * reach).copysign(d);
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
    // Arithmetic, not branches: which is the longest axis cannot be foretold.
    let z = usize::from(size.y >= size.x) + usize::from(size.z >= size.x.max(size.y)) * 2;
    let z = z.min(2);
    let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
    let (o, d, inverse) = (o.to_array(), d.to_array(), inverse.to_array());
    let scale_z = inverse[z];
    let sheared = ShearedRay {
        axes: [x, y, z],
        origin: [s.splat(o[x]), s.splat(o[y]), s.splat(o[z])],
        slope: [s.splat(d[x] * scale_z), s.splat(d[y] * scale_z)],
        scale_z: s.splat(scale_z),
    };
    (slab, sheared)
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
pub(super) struct ShearedRay<S: Lanes> {
    /// Axes x, y, z of the sheared space; z is the longest of the direction.
    axes: [usize; 3],
    origin: [S::Floats; 3],
    slope: [S::Floats; 2],
    pub(super) scale_z: S::Floats,
}

/// A corner of every lane's polygon, in the sheared space.
pub(super) type Corner<S> = [<S as Lanes>::Floats; 3];

impl<S: Lanes> ShearedRay<S> {
    /// The corner whose coordinates stand in three rows.
    #[inline(always)]
    pub(super) fn shear(&self, s: S, rows: &[Row], corner: usize) -> Corner<S> {
        debug_assert!(3 * corner + 3 <= rows.len());
        // SAFETY: axes are 0, 1 and 2 in some order, and a block has three rows for every corner.
        let [x, y, z] = unsafe {
            [
                rows.get_unchecked(3 * corner + self.axes[0]),
                rows.get_unchecked(3 * corner + self.axes[1]),
                rows.get_unchecked(3 * corner + self.axes[2]),
            ]
        };
        let z = s.sub(s.load(z), self.origin[2]);
        let x = s.sub(s.sub(s.load(x), self.origin[0]), s.mul(self.slope[0], z));
        let y = s.sub(s.sub(s.load(y), self.origin[1]), s.mul(self.slope[1], z));
        [x, y, z]
    }
}
