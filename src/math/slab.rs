//! The part of a line that lies in a box with sides along the axes.

use glam::Vec3;

/// The part of `[start, end]` in which `origin + t · direction` lies between `min` and `max`; empty where the first is above the second. `inverse` holds
/// the reciprocals of the direction. An axis along which the line lies within a side of the box does not cut it.
#[inline]
pub fn clip(origin: Vec3, inverse: Vec3, [min, max]: [Vec3; 2], [start, end]: [f32; 2]) -> [f32; 2] {
    let (near, far) = ((min - origin) * inverse, (max - origin) * inverse);
    let (mut enter, mut leave) = (start, end);
    for (a, b) in near.to_array().into_iter().zip(far.to_array()) {
        // 0 · ∞ within a side.
        if !(a.is_nan() || b.is_nan()) {
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
    }
    [enter, leave]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_and_sides_do_not_cut() {
        let cube = [Vec3::ZERO, Vec3::ONE];
        let of = |origin: Vec3, d: Vec3| clip(origin, d.recip(), cube, [0.0, 10.0]);
        assert_eq!(of(Vec3::new(-1.0, 0.5, 0.5), Vec3::X), [1.0, 2.0]);
        assert_eq!(of(Vec3::new(-1.0, 0.0, 0.5), Vec3::X), [1.0, 2.0]);
        assert_eq!(of(Vec3::new(0.5, 0.5, 0.5), -Vec3::Y), [0.0, 0.5]);
        let [enter, leave] = of(Vec3::new(-1.0, 2.0, 0.5), Vec3::X);
        assert!(enter > leave);
    }
}
