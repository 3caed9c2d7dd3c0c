//! The ray as the box test and the polygon test need it.

use glam::Vec3A;

use crate::tracer::accel::Ray;
use crate::tracer::accel::layout::F32x8;

use super::simd::Simd8;

/// Boxes are widened by this fraction of the reach, which is the largest distance of any coordinate from the origin of the ray
/// or from zero: 25 unit roundoffs.
///
/// To first order 15 are enough for the box test to accept every box whose polygon the polygon test would accept. In the
/// box test, one rounding each of the moved origin, of its product with the reciprocal and of the reciprocal, and one or two
/// of the other product and of the sum, which is up to twice the reach, displace a plane by 6 (by 10 for directions beyond
/// 8e37, whose reciprocals are denormal). In the polygon test, the difference (1), the shear (two for its slope, which is at
/// most 1, and one each for z and the product: 4) and the last difference, of up to twice the reach (2), displace a vertex
/// by 7. The edge functions may round to zero outside the polygon: 2. The watertightness tests fail without the widening.
const WIDEN: f32 = 1.5e-6;

/// The ray for the box test (the slab method).
pub(super) struct SlabRay<S: Simd8> {
    /// Rows of a node that hold the near and the far planes of each axis.
    near: [usize; 3],
    far: [usize; 3],
    /// Distances are `plane · inverse + offset`; the offsets hold the widening.
    inverse: [S::Floats; 3],
    offset_near: [S::Floats; 3],
    offset_far: [S::Floats; 3],
}

/// The smallest magnitude of a component of a direction in the box test: its reciprocal times any coordinate is finite.
const MIN_DIRECTION: f32 = 1e-18;

/// Prepares a ray for both tests, which share its reciprocals. `None` for a ray that cannot be traversed: it is not finite, or
/// starts beyond 1e18, where a float cannot resolve any scene, or has a direction shorter than 5e-12, which the minimum of
/// its components would change.
///
/// `extent` is the largest magnitude of a coordinate of the BVH.
#[inline(always)]
pub(super) fn prepare_ray<S: Simd8>(s: S, extent: f32, ray: &Ray) -> Option<(SlabRay<S>, ShearedRay)> {
    let (o, d) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
    let size = d.abs();
    let (from, longest) = (o.abs().max_element(), size.max_element());
    // A component that is not finite becomes NaN here, and NaN equals nothing.
    let finite = (o * 0.0 + d * 0.0).cmpeq(Vec3A::ZERO).all();
    if !(finite && from <= 1e18 && longest >= 5e-12 && ray.t_max > 0.0) {
        return None;
    }
    // A zero component becomes a huge finite reciprocal, so that no box test multiplies 0 by infinity.
    let inverse = (1.0 / size.max(Vec3A::splat(MIN_DIRECTION))).copysign(d);
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
    // The longest axis is unpredictable: arithmetic instead of branches. The next two axes follow cyclically.
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

impl<S: Simd8> SlabRay<S> {
    /// The distances at which the ray enters and leaves the boxes of a node, clamped to 0 and `t_max`. It hits the boxes that
    /// it enters no later than it leaves.
    #[inline(always)]
    pub(super) fn intersect_boxes(&self, s: S, node: &[F32x8; 8], t_max: f32) -> (S::Floats, S::Floats) {
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

/// The ray for the polygon test: the shear that makes it the z axis.
pub(super) struct ShearedRay {
    /// Axes x, y, z of the sheared space. z is the axis of the direction's largest component.
    axes: [usize; 3],
    origin: [f32; 3],
    slope: [f32; 2],
    pub(super) scale_z: f32,
}

/// One corner of the polygon of each lane, in the sheared space.
pub(super) type Corner<S> = [<S as Simd8>::Floats; 3];

impl ShearedRay {
    /// Transforms corner number `corner` of each polygon, whose coordinates are the three rows from `3 · corner` on.
    #[inline(always)]
    pub(super) fn shear<S: Simd8>(&self, s: S, rows: &[F32x8], corner: usize) -> Corner<S> {
        debug_assert!(3 * corner + 3 <= rows.len());
        // SAFETY: the axes are 0, 1 and 2 in some order, and a block has three rows for every corner.
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
