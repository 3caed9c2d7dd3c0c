//! Camera moves: inverses, invariants, hostile poses.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use pointillist::client::window::navigation::{Gesture, Pose};
use pointillist::math::random::Random;

/// Random poses and gestures.
struct RandomMoves(Random);

impl RandomMoves {
    fn unit(&mut self) -> f64 {
        self.0.f64()
    }

    fn within(&mut self, reach: f64) -> f64 {
        (2.0 * self.unit() - 1.0) * reach
    }

    fn point(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.within(reach), self.within(reach), self.within(reach))
    }

    fn pose(&mut self) -> Pose {
        let (eye, target, up) = (self.point(10.0), self.point(10.0), self.point(1.0).normalize());
        Pose { eye, target, up, fov: 2.0 + 170.0 * self.unit(), mirrored: self.unit() < 0.2 }
    }

    fn gesture(&mut self) -> Gesture {
        let by = DVec2::new(self.within(1.0), self.within(1.0));
        match (self.unit() * 7.0) as u32 {
            0 => Gesture::Orbit(by),
            1 => Gesture::Pan(by),
            2 => Gesture::Dolly(by.x * 10.0),
            3 => Gesture::Fly(by.extend(by.x)),
            4 => Gesture::Look(by),
            5 => Gesture::Fov(by.x * 60.0),
            _ => Gesture::Focus(self.point(10.0)),
        }
    }
}

fn front() -> Pose {
    Pose { eye: DVec3::Z * 4.0, target: DVec3::ZERO, up: DVec3::Y, fov: 60.0, mirrored: false }
}

/// Where a point is seen, fractions of the window from its centre, right and down.
fn seen(pose: &Pose, point: DVec3, shape: DVec2) -> DVec2 {
    let local = pose.to_world().inverse().transform_point3(point);
    let half = shape * (0.5 * pose.fov.to_radians()).tan();
    DVec2::new(-local.x, -local.y) / local.z / half * 0.5
}

fn assert_near(a: &Pose, b: &Pose, bound: f64) {
    let scale = a.distance();
    assert!(a.eye.distance(b.eye) < bound * scale, "{a:?}\n{b:?}");
    assert!(a.target.distance(b.target) < bound * scale, "{a:?}\n{b:?}");
}

#[test]
fn the_transform_goes_there_and_back() {
    let mut random = RandomMoves(Random(1));
    for _ in 0..2000 {
        let pose = random.pose();
        let matrix = pose.to_world();
        assert!((matrix.matrix3.determinant().abs() - 1.0).abs() < 1e-12);
        assert_eq!(matrix.matrix3.determinant() < 0.0, pose.mirrored);
        assert!((matrix.matrix3.transpose() * matrix.matrix3).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        let again = Pose::of(&matrix, pose.fov, pose.distance());
        assert!(again.to_world().abs_diff_eq(matrix, 1e-9), "{pose:?}");
        assert_near(&again, &pose, 1e-12);
    }
}

#[test]
fn mitsubas_camera_looks_along_z_with_x_to_the_left() {
    // The identity: eye at the origin, looks along +z, up is +y, and +x is at the left of the picture.
    let pose = Pose::of(&DAffine3::IDENTITY, 90.0, 2.0);
    assert_eq!((pose.eye, pose.target, pose.up), (DVec3::ZERO, DVec3::Z * 2.0, DVec3::Y));
    assert!(seen(&pose, DVec3::new(1.0, 0.0, 2.0), DVec2::ONE).x < 0.0);
    assert!(pose.to_world().abs_diff_eq(DAffine3::IDENTITY, 1e-15));
    // Flying right decreases x.
    assert!(pose.apply(Gesture::Fly(DVec3::X)).eye.x < 0.0);
}

#[test]
fn a_tilted_level_camera_keeps_the_worlds_up() {
    let down = DVec3::new(3.0, -2.0, 5.0).normalize();
    for up in [DVec3::Y, DVec3::Z] {
        let left = up.cross(down).normalize();
        let matrix = DAffine3::from_mat3(DMat3::from_cols(left, down.cross(left), down));
        let pose = Pose::of(&matrix, 40.0, 3.0);
        assert_eq!(pose.up, up);
        assert!(pose.to_world().abs_diff_eq(matrix, 1e-12));
    }
    // A rolled one keeps its own.
    let rolled = DAffine3::from_mat3(DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(0.2));
    let pose = Pose::of(&rolled, 40.0, 3.0);
    assert!(pose.up.distance(rolled.matrix3.y_axis) < 1e-12);
}

#[test]
fn the_scene_follows_the_cursor_when_orbiting() {
    let near = DVec3::Z;
    for mirrored in [false, true] {
        let pose = Pose { mirrored, ..front() };
        let right = pose.apply(Gesture::Orbit(DVec2::new(0.1, 0.0)));
        assert!(seen(&right, near, DVec2::ONE).x > 0.01, "mirrored {mirrored}");
        let down = pose.apply(Gesture::Orbit(DVec2::new(0.0, 0.1)));
        assert!(seen(&down, near, DVec2::ONE).y > 0.01 && down.eye.y > 0.0);
        // Looking goes the other way: what was seen moves against the cursor.
        let look = pose.apply(Gesture::Look(DVec2::new(0.1, 0.1)));
        let moved = seen(&look, pose.target, DVec2::ONE);
        assert!(moved.x < -0.01 && moved.y < -0.01, "{moved} mirrored {mirrored}");
        assert_eq!(look.eye, pose.eye);
    }
}

#[test]
fn orbiting_and_looking_keep_the_distance_and_never_turn_over() {
    let mut random = RandomMoves(Random(2));
    for _ in 0..300 {
        let start = random.pose();
        let mut pose = start;
        for step in 0..200 {
            let by = DVec2::new(random.within(0.5), random.within(2.0));
            let next = pose.apply(if step % 2 == 0 { Gesture::Orbit(by) } else { Gesture::Look(by) });
            assert!((next.distance() / start.distance() - 1.0).abs() < 1e-11);
            let up = next.to_world().matrix3.y_axis;
            assert!(up.dot(next.up) > 0.0, "over the pole: {next:?}");
            pose = next;
        }
    }
}

#[test]
fn at_the_pole_a_sideways_drag_still_turns_and_nothing_jumps() {
    let mut pose = front();
    for _ in 0..100 {
        pose = pose.apply(Gesture::Orbit(DVec2::new(0.0, 0.1)));
    }
    let before = pose.to_world().matrix3;
    let after = pose.apply(Gesture::Orbit(DVec2::new(1e-4, 1e-4))).to_world().matrix3;
    assert!(before.abs_diff_eq(after, 1e-3), "{before} {after}");
    let turned = pose.apply(Gesture::Orbit(DVec2::new(0.25, 0.0))).to_world().matrix3;
    assert!(before.y_axis.dot(turned.y_axis) < 0.8);
    // And it comes back from there.
    let back = pose.apply(Gesture::Orbit(DVec2::new(0.0, -0.4)));
    assert!(back.eye.y < 3.9 && back.eye.x.abs() < 1e-9, "{back:?}");
}

#[test]
fn panning_keeps_the_point_under_the_cursor() {
    let mut random = RandomMoves(Random(3));
    for _ in 0..1000 {
        let pose = random.pose();
        let shape = DVec2::new(0.5 + random.unit(), 0.5 + random.unit());
        let at = DVec2::new(random.within(0.5), random.within(0.5));
        // A point in the plane of the target, found by its place in the picture.
        let half = shape * (0.5 * pose.fov.to_radians()).tan() * pose.distance();
        let local = DVec3::new(-2.0 * at.x * half.x, -2.0 * at.y * half.y, pose.distance());
        let point = pose.to_world().transform_point3(local);
        let by = DVec2::new(random.within(0.5), random.within(0.5));
        let moved = pose.apply_in(Gesture::Pan(by), shape);
        let error = seen(&moved, point, shape) - (at + by);
        assert!(error.length() < 1e-9, "{error} {pose:?}");
        assert_near(&moved.apply_in(Gesture::Pan(-by), shape), &pose, 1e-12 * (1.0 + half.length()));
    }
}

#[test]
fn dolly_is_inverted_and_never_passes_the_target() {
    let mut random = RandomMoves(Random(4));
    for _ in 0..500 {
        let pose = random.pose();
        let steps = random.within(40.0);
        let there = pose.apply(Gesture::Dolly(steps));
        assert_near(&there.apply(Gesture::Dolly(-steps)), &pose, 1e-8);
        assert_eq!(there.target, pose.target);
        let mut near = pose;
        for _ in 0..300 {
            near = near.apply(Gesture::Dolly(50.0));
        }
        let turned = (near.target - near.eye).normalize().dot((pose.target - pose.eye).normalize());
        assert!(near.is_usable() && turned > 0.999_999, "{near:?}");
    }
}

#[test]
fn the_field_of_view_has_bounds_and_a_files_own_survives() {
    let pose = front();
    assert_eq!(pose.apply(Gesture::Fov(500.0)).fov, 175.0);
    assert_eq!(pose.apply(Gesture::Fov(-500.0)).fov, 1.0);
    let narrow = Pose { fov: 0.4, ..pose };
    assert_eq!(narrow.apply(Gesture::Fov(-1.0)).fov, 0.4);
    assert_eq!(narrow.apply(Gesture::Fov(2.0)).fov, 2.4);
}

#[test]
fn focus_puts_the_point_in_the_middle() {
    let point = DVec3::new(1.0, 0.5, -2.0);
    let pose = front().apply(Gesture::Focus(point));
    assert_eq!((pose.eye, pose.target), (front().eye, point));
    assert!(seen(&pose, point, DVec2::ONE).length() < 1e-12);
    // Right below: half a degree beside it, with the heading of before.
    let below = front().apply(Gesture::Focus(DVec3::new(0.0, -3.0, 4.0)));
    assert!((below.distance() - 3.0).abs() < 1e-12);
    assert!(below.to_world().matrix3.y_axis.dot(DVec3::NEG_Z) > 0.999);
}

#[test]
fn a_power_of_two_scales_every_move_exactly() {
    let mut random = RandomMoves(Random(5));
    for _ in 0..200 {
        let start = random.pose();
        for exponent in [-20, 20] {
            let scale = f64::powi(2.0, exponent);
            let (mut a, mut b) =
                (start, Pose { eye: start.eye * scale, target: start.target * scale, ..start });
            for _ in 0..20 {
                let gesture = random.gesture();
                let scaled = match gesture {
                    Gesture::Focus(p) => Gesture::Focus(p * scale),
                    other => other,
                };
                (a, b) = (a.apply(gesture), b.apply(scaled));
                assert_eq!((a.eye * scale, a.target * scale, a.fov), (b.eye, b.target, b.fov), "{gesture:?}");
            }
        }
    }
}

#[test]
fn hostile_poses_and_gestures_change_nothing_or_stay_usable() {
    let mut random = RandomMoves(Random(6));
    let odd = [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e308, -1e300, 1e-308, 0.0, 1e6];
    for _ in 0..3000 {
        let mut pick = || odd[(random.unit() * odd.len() as f64) as usize];
        let (a, b, c) = (pick(), pick(), pick());
        let (d2, d3) = (DVec2::new(a, b), DVec3::new(a, b, c));
        for gesture in [
            Gesture::Orbit(d2),
            Gesture::Pan(d2),
            Gesture::Dolly(a),
            Gesture::Fly(d3),
            Gesture::Look(d2),
            Gesture::Fov(a),
            Gesture::Focus(d3),
        ] {
            let next = front().apply(gesture);
            assert!(next.is_usable() && next.to_world().is_finite(), "{gesture:?} {next:?}");
        }
        let broken = Pose { eye: d3, target: DVec3::new(b, c, a), up: DVec3::new(c, a, b), ..front() };
        let next = broken.apply(Gesture::Orbit(DVec2::splat(0.1)));
        assert!(next.is_usable() || !broken.is_usable());
    }
    // Up along the view: some picture, no NaN, and a drag leads out.
    for scale in [1e-6, 1.0, 1e6] {
        let pose = Pose { eye: DVec3::Y * scale, target: DVec3::ZERO, ..front() };
        assert!(pose.to_world().is_finite());
        let out = pose.apply(Gesture::Orbit(DVec2::new(0.0, -0.3)));
        assert!(out.eye.y < 0.9 * scale && (out.distance() / scale - 1.0).abs() < 1e-12);
    }
}
