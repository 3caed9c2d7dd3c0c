//! Instances of groups against the same shapes written out one by one: hits, rays that leave, pictures; and what of a
//! group takes part in a scene.

use std::sync::Arc;

use crate::support::agreement::{Method, Plan, measure};
use crate::support::scenes::*;
use crate::support::welch;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use pointillist::image::compare::z_test;
use pointillist::scene::desc::texture::BitmapTexture;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::effects::{Effect, decide};
use pointillist::tracer::{PrepareError, Scene};

/// A ball of 80 triangles with normals at its corners, or of facets, and with texture coordinates.
fn ball(smooth: bool) -> Mesh {
    let (rings, steps) = (5, 9);
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..=steps {
            let (u, v) = (j as f32 / steps as f32, i as f32 / rings as f32);
            let (a, b) = (u * std::f32::consts::TAU, v * std::f32::consts::PI);
            mesh.positions.push(Vec3::new(b.sin() * a.cos(), b.sin() * a.sin(), b.cos()));
            mesh.uvs.push(Vec2::new(u + 0.3 * v, v));
        }
    }
    for i in 0..rings {
        for j in 0..steps {
            let [a, b] = [i * (steps + 1) + j, (i + 1) * (steps + 1) + j];
            mesh.triangles.extend((i + 1 < rings).then_some([a, b, b + 1]));
            mesh.triangles.extend((i > 0).then_some([a, b + 1, a + 1]));
        }
    }
    mesh.normals = if smooth { mesh.positions.clone() } else { Vec::new() };
    mesh
}

fn brushed() -> BsdfDesc {
    BsdfDesc::RoughConductor(RoughConductorDesc {
        eta: Spectrum::Constant(0.2),
        k: Spectrum::Constant(3.0),
        specular_reflectance: Spectrum::Constant(0.9).into(),
        roughness: Roughness { facets: Facets::Ggx, alpha: [0.1, 0.4] },
        alpha: None,
    })
}

fn member(kind: ShapeKind, to_world: DAffine3, bsdf: BsdfId) -> ShapeDesc {
    let (id, place) = (None, Place::default());
    ShapeDesc {
        id,
        place,
        kind,
        to_world,
        flip_normals: false,
        bsdf,
        emission: None,
        emission_profile: Default::default(),
        medium_interface: Default::default(),
    }
}

fn instance(desc: &mut SceneDesc, group: u32, to_world: DAffine3) {
    desc.shapes.push(member(ShapeKind::Instance(GroupId(group)), to_world, BsdfId::NONE));
}

fn group(desc: &mut SceneDesc, shapes: Vec<ShapeDesc>) {
    desc.groups.push(GroupDesc { id: None, place: Place::default(), shapes });
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

fn scale(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(x, y, z))
}

/// A rotation about no axis of the scene.
fn turned(angle: f64) -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.7).normalize(), angle))
}

/// Two groups, one with a bit of everything and one without spheres, which only a similarity leaves spheres; shown six times,
/// mirrored, turned, stretched and sheared. Two shapes of the scene itself and a lamp.
fn several() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -14.0, 5.0), DVec3::new(0.0, 14.0, -4.0), 45.0);
    let [white, dark] = [0.7, 0.3].map(|albedo| material(&mut desc, grey(albedo)));
    let [metal, clear] = [brushed(), glass(Ior::Constant(1.5))].map(|m| material(&mut desc, m));
    let sides = material(&mut desc, BsdfDesc::TwoSided(TwoSidedDesc { front: white, back: metal }));
    desc.meshes.extend([ball(true), ball(false)].map(Arc::new));
    shape(&mut desc, ShapeKind::Rectangle, at(0.0, 0.0, -1.6) * scale(9.0, 9.0, 1.0), white, 0.0);
    let plain = |mesh, white, dark| {
        vec![
            member(ShapeKind::Mesh(MeshId(mesh)), at(0.0, 0.0, 0.0), metal),
            member(ShapeKind::Mesh(MeshId(1)), at(2.0, 0.0, 0.0) * turned(0.4), white),
            member(ShapeKind::Disk, at(0.0, 1.5, 0.5) * turned(1.0), sides),
            member(ShapeKind::Rectangle, at(-1.5, 0.0, 0.5) * turned(2.0) * scale(0.6, 0.9, 1.0), white),
            ShapeDesc {
                flip_normals: true,
                ..member(ShapeKind::Rectangle, at(-1.5, 0.0, 0.5) * turned(2.0) * scale(0.6, 0.9, 1.0), dark)
            },
            member(ShapeKind::Cube, at(0.0, -1.4, 0.0) * scale(0.4, 0.4, 0.7), metal),
        ]
    };
    let mut all = plain(0, white, dark);
    all.push(member(sphere(DVec3::new(1.5, 1.5, 0.0), 0.5), turned(0.3), clear));
    all.push(member(sphere(DVec3::new(-1.2, -1.4, 0.1), 0.6), DAffine3::IDENTITY, metal));
    // Between stretched corners, normals are others than between corners that are stretched: no smooth ones here.
    group(&mut desc, plain(1, dark, white));
    group(&mut desc, all);
    instance(&mut desc, 1, at(-3.0, 2.0, 0.0));
    instance(&mut desc, 1, at(3.0, 2.0, 0.0) * turned(2.5) * scale(-0.8, 0.8, 0.8));
    shape(&mut desc, sphere(DVec3::new(0.0, 5.0, 0.0), 1.0), DAffine3::IDENTITY, dark, 0.0);
    instance(&mut desc, 0, at(-3.0, -2.0, 0.0) * turned(0.5) * scale(0.7, 1.2, 0.4));
    instance(&mut desc, 0, at(3.0, -2.5, 0.3) * scale(0.5, -1.0, 0.8) * turned(0.9));
    instance(&mut desc, 0, at(0.0, -3.0, 0.0) * scale(-0.5, 0.5, 0.7) * turned(-2.0) * scale(1.0, 1.0, -1.3));
    instance(&mut desc, 1, at(0.0, 1.0, 2.0) * scale(0.5, 0.5, 0.5));
    let lamp = at(1.0, -3.0, 7.0) * DAffine3::from_rotation_x(2.9) * scale(1.5, 1.5, 1.0);
    shape(&mut desc, ShapeKind::Rectangle, lamp, dark, 9.0);
    environment(&mut desc);
    desc
}

/// The same without groups. Says to which shape of the original each belongs.
fn written_out(desc: &SceneDesc) -> (SceneDesc, Vec<u32>) {
    let mut out = SceneDesc { shapes: Vec::new(), groups: Vec::new(), ..desc.clone() };
    let mut from = Vec::new();
    for (i, shape) in desc.shapes.iter().enumerate() {
        let is_instance = matches!(shape.kind, ShapeKind::Instance(_));
        let place = if is_instance { shape.to_world } else { DAffine3::IDENTITY };
        for part in desc.parts(shape) {
            // A transform of its own turns these inside out where it mirrors; that of an instance nothing.
            let turns = match part.kind {
                ShapeKind::Sphere { .. } => true,
                ShapeKind::Mesh(id) => desc.meshes[id.0 as usize].normals.is_empty(),
                _ => false,
            };
            let flip = turns && place.matrix3.determinant() < 0.0;
            let (to_world, flip_normals) = (place * part.to_world, part.flip_normals != flip);
            out.shapes.push(ShapeDesc { to_world, flip_normals, ..part.clone() });
            from.push(i as u32);
        }
    }
    (out, from)
}

/// Materials by surface of the prepared scene.
fn bsdfs(desc: &SceneDesc) -> Vec<BsdfId> {
    desc.shapes.iter().chain(desc.groups.iter().flat_map(|g| &g.shapes)).map(|s| s.bsdf).collect()
}

#[test]
fn hits_are_those_of_the_shapes_written_out() {
    let desc = several();
    let (flat, from) = written_out(&desc);
    let (scene, reference) = (prepare(&desc), prepare(&flat));
    let of = (bsdfs(&desc), bsdfs(&flat));
    let mut random = Random(11);
    let (mut met, mut differ, mut brushed) = (0, 0, 0);
    for _ in 0..60_000 {
        let target =
            DVec3::new(random.f64() * 10.0 - 5.0, random.f64() * 8.0 - 4.0, random.f64() * 3.0 - 1.0);
        let origin = target + random.direction() * 12.0;
        let ray = Ray::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
        let (a, b) = match (scene.closest(&ray), reference.closest(&ray)) {
            (None, None) => continue,
            (Some(a), Some(b)) => (a, b),
            _ => {
                differ += 1;
                continue;
            }
        };
        met += 1;
        // Past an edge the one may meet what the other misses.
        if a.point.p.distance(b.point.p) > 1e-4 {
            differ += 1;
            continue;
        }
        assert_eq!(of.0[a.surface as usize], of.1[b.surface as usize]);
        assert_eq!((a.smooth, a.light, a.wo), (b.smooth, b.light, b.wo));
        assert!(a.point.ng.dot(b.point.ng) > 1.0 - 1e-5, "{:?} {:?}", a.point, b.point);
        assert!(a.n.dot(b.n) > 1.0 - 1e-4, "{} {}", a.n, b.n);
        let (x, y) = (scene.surface_material(&a), reference.surface_material(&b));
        assert!(x.frame.n.dot(y.frame.n) > 1.0 - 1e-4);
        assert_eq!(format!("{:?}", x.material), format!("{:?}", y.material));
        let pick = scene.pick(&ray).expect("as before");
        assert_eq!((pick.shape, pick.position), (from[b.surface as usize], a.point.p.as_dvec3()));
        if of.0[a.surface as usize] == BsdfId(2) {
            brushed += 1;
            assert!(x.frame.s.dot(y.frame.s).abs() > 1.0 - 1e-3, "{:?} {:?}", x.frame, y.frame);
        }
        assert!(a.point.error.max_element() < 1e-4, "{:?}", a.point);
    }
    assert!(met > 20_000 && brushed > 3000, "{met} {brushed}");
    assert!(f64::from(differ) < 1e-3 * f64::from(met), "{differ} of {met}");
}

/// Normals are interpolated in the group and then taken to the world by the inverse transpose, as Mitsuba does.
#[test]
fn smooth_normals_are_those_of_the_group() {
    let mut desc = empty();
    let m = material(&mut desc, brushed());
    desc.meshes.push(Arc::new(ball(true)));
    group(&mut desc, vec![member(ShapeKind::Mesh(MeshId(0)), DAffine3::IDENTITY, m)]);
    instance(&mut desc, 0, DAffine3::IDENTITY);
    let reference = prepare(&desc);
    let place = at(1.0, 2.0, 3.0) * turned(0.7) * scale(0.4, -3.0, 1.5);
    desc.shapes[0].to_world = place;
    let scene = prepare(&desc);
    let mut random = Random(3);
    for _ in 0..1000 {
        let (from, d) = (random.direction() * 5.0, random.direction());
        let d = (d * 0.7 - from).normalize();
        let there =
            (place.transform_point3(from).as_vec3(), place.transform_vector3(d).normalize().as_vec3());
        let here = reference.closest(&Ray::new(from.as_vec3(), d.as_vec3()));
        let (Some(a), Some(b)) = (here, scene.closest(&Ray::new(there.0, there.1))) else { continue };
        let p = place.transform_point3(a.point.p.as_dvec3()).as_vec3();
        if p.distance(b.point.p) > 1e-4 {
            continue; // beside an edge
        }
        let n = |v: Vec3| (place.matrix3.inverse().transpose() * v.as_dvec3()).normalize().as_vec3();
        assert!(n(a.point.ng).distance(b.point.ng) < 1e-4 && n(a.n).distance(b.n) < 1e-3);
        let frame = scene.surface_material(&b).frame;
        assert!(frame.s.dot(frame.n).abs() < 1e-5 && b.smooth);
    }
}

/// What leaves a convex surface outwards does not meet it again, and what enters it does: far from the origin, tiny, flat.
#[test]
fn rays_leave_and_enter() {
    let unit = || DAffine3::IDENTITY;
    let places = [
        unit(),
        at(1e4, -3e3, 7e3) * turned(1.0) * scale(-1e-2, 1e-2, 2e-2),
        turned(0.3) * scale(1e-3, 50.0, 1.0),
        at(5.0, 6.0, 7.0) * scale(1e6, 1e6, -1e6),
        scale(1e-7, 1e-7, 3e-7),
    ];
    let mut random = Random(5);
    for kind in [ShapeKind::Mesh(MeshId(0)), ShapeKind::Cube, sphere(DVec3::ZERO, 1.0)] {
        // Also far from the origin of the group.
        for inside in [unit(), at(300.0, -200.0, 100.0)] {
            for place in places {
                let mut desc = empty();
                let m = material(&mut desc, grey(0.5));
                desc.meshes.push(Arc::new(ball(false)));
                group(&mut desc, vec![member(kind.clone(), inside, m)]);
                instance(&mut desc, 0, place);
                let (scene, to_world) = (prepare(&desc), place * inside);
                let (mut tried, mut wrong) = (0, 0);
                for _ in 0..2000 {
                    let from = to_world.transform_point3(random.direction() * 20.0).as_vec3();
                    let to = to_world.transform_point3(random.direction() * 0.9).as_vec3();
                    let ray = Ray::new(from, (to - from).normalize());
                    let Some(hit) = scene.closest(&ray) else { continue };
                    assert!(hit.point.ng.dot(ray.direction) < 0.0, "seen from outside");
                    let d = to_world.transform_vector3(random.direction()).normalize().as_vec3();
                    let out = hit.point.ng.dot(d) > 0.0;
                    // Grazing rays may go either way by rounding.
                    if hit.point.ng.dot(d).abs() < 1e-4 {
                        continue;
                    }
                    tried += 1;
                    wrong += u32::from(out && scene.closest(&hit.spawn(d)).is_some());
                }
                assert!(tried > 500, "{kind:?} {place:?}: {tried}");
                assert_eq!(wrong, 0, "{kind:?} {inside:?} {place:?} of {tried}");
            }
        }
    }
}

/// In every pixel and in the mean, by two methods, both sides with their variances.
#[test]
fn pictures_are_those_of_the_shapes_written_out() {
    let desc = several();
    let (flat, _) = written_out(&desc);
    let plan = Plan { side: 8, paths_per_pixel: 128, seeds: 16, window: UvWindow::PICTURE };
    for (a, b) in [(Method::Path, Method::Bidirectional), (Method::Bidirectional, Method::Path)] {
        let (a, b) = (measure(&desc, a, plan), measure(&flat, b, plan));
        let test = z_test(&a, &b, 0.01).expect("equal sizes");
        println!("{test:?}");
        for i in 0..a.mean.len() {
            let (t, freedom) = welch::t((a.mean[i], a.variance[i]), (b.mean[i], b.variance[i]), 0.0, 16.0);
            let p = welch::p_value(t, freedom);
            assert!(p > 1e-4 / a.mean.len() as f64, "pixel {i}: t = {t}, p = {p}");
        }
        let off = (test.mean_ratio - 1.0).abs();
        assert!(off <= 4.0 * test.mean_ratio_error && test.mean_ratio_error < 0.01, "{test:?}");
    }
}

/// Only what is shown takes part: in the plan of effects, the size of the scene and its finish.
#[test]
fn groups_that_nothing_shows_take_no_part() {
    let mut desc = empty();
    let [white, clear] = [grey(0.7), glass(Ior::Constant(1.5))].map(|m| material(&mut desc, m));
    shape(&mut desc, ShapeKind::Cube, DAffine3::IDENTITY, white, 0.0);
    desc.meshes.push(Arc::new(ball(true)));
    let far = at(1000.0, 0.0, 0.0);
    let shapes = vec![
        member(sphere(DVec3::ZERO, 1.0), far, clear),
        member(ShapeKind::Mesh(MeshId(0)), far, white),
        member(ShapeKind::Disk, far, white),
    ];
    group(&mut desc, shapes);
    group(&mut desc, vec![member(ShapeKind::Disk, DAffine3::IDENTITY, white)]);
    instance(&mut desc, 1, at(0.0, 0.0, 2.0));
    environment(&mut desc);
    let on = |desc: &SceneDesc, effect| {
        decide(desc, IntegratorKind::Path).into_iter().any(|d| d.effect == effect && d.on)
    };
    let effects = [Effect::Transmission, Effect::Deltas, Effect::SmoothNormals];
    assert!(effects.iter().all(|f| !on(&desc, *f)));
    let reach = |desc: &SceneDesc| prepare(desc).accel().bounds().1.x;
    assert!(reach(&desc) < 1.1, "{}", reach(&desc));
    instance(&mut desc, 0, at(-900.0, 0.0, 0.0));
    assert!(effects.iter().all(|f| on(&desc, *f)));
    assert!((reach(&desc) - 101.0).abs() < 0.1, "{}", reach(&desc));
}

/// Texture coordinates and derivatives of an instance are those of the shape written out.
#[test]
fn parametrizations_are_those_of_the_shapes_written_out() {
    let cylinder =
        ShapeKind::Cylinder { p0: DVec3::new(0.1, 0.0, -1.0), p1: DVec3::new(0.0, 0.2, 1.0), radius: 0.7 };
    let kinds = [
        sphere(DVec3::new(0.1, 0.2, 0.0), 1.1),
        ShapeKind::Disk,
        cylinder,
        ShapeKind::Rectangle,
        ShapeKind::Cube,
        ShapeKind::Mesh(MeshId(0)),
    ];
    let place = at(1.0, 2.0, 3.0) * turned(0.7) * scale(0.4, 0.4, 0.4);
    for kind in kinds {
        let mut shown = empty();
        shown.meshes.push(Arc::new(ball(true)));
        let inner = material(&mut shown, grey(0.5));
        let normals = BitmapTexture::of_eight_bits(1, vec![[128, 128, 255]; 2], true);
        let bump = BumpDesc { bsdf: inner, flip_invalid_normals: true, use_shadowing_function: true };
        let bumpy = material(&mut shown, NormalMapDesc { normals, bump }.into());
        let mut out = shown.clone();
        group(&mut shown, vec![member(kind.clone(), turned(0.3), bumpy)]);
        instance(&mut shown, 0, place);
        out.shapes.push(member(kind.clone(), place * turned(0.3), bumpy));
        let [shown, out] = [shown, out].map(|desc| prepare(&desc));
        let (mut random, mut met) = (Random(5), 0);
        for _ in 0..2000 {
            let (from, d) = (random.direction() * 3.0, random.direction() * 0.4);
            let from = place.transform_point3(from);
            let d = (place.transform_point3(d) - from).normalize();
            let ray = Ray::new(from.as_vec3(), d.as_vec3());
            let (Some(a), Some(b)) = (shown.closest(&ray), out.closest(&ray)) else { continue };
            let [a, b] = [(&shown, a), (&out, b)].map(|(scene, hit)| scene.surface_material(&hit).context);
            let uv = (a.texture.uv - b.texture.uv).abs();
            // Angles are the same up to whole turns.
            let off = uv.min((1.0 - uv).abs()).max_element();
            let derivatives = a.dp_du.distance(b.dp_du) + a.dp_dv.distance(b.dp_dv);
            // Beside an edge the one may meet another face.
            if a.ng.distance(b.ng) < 1e-3 {
                assert!(off < 2e-4, "{kind:?}: {} {}", a.texture.uv, b.texture.uv);
                assert!(derivatives < 2e-3 && a.dp_dv != Vec3::ZERO, "{kind:?}: {a:?} {b:?}");
                met += 1;
            }
        }
        assert!(met > 100, "{kind:?}: {met}");
    }
}

/// A changed material of a group keeps the geometry; a moved instance does not.
#[test]
fn materials_of_groups_can_be_edited() {
    let mut desc = several();
    let scene = prepare(&desc);
    let ray = Ray::new(Vec3::new(-1.0, 2.0, 9.0), -Vec3::Z);
    let seen = |scene: &Scene| {
        let hit = scene.closest(&ray).expect("the second ball of the first instance");
        (hit.point.p, format!("{:?}", scene.surface_material(&hit).material))
    };
    desc.bsdfs[0] = grey(0.1);
    let edited = scene.edited(&desc).expect("valid");
    assert!(std::ptr::eq(scene.accel(), edited.accel()));
    assert_eq!(seen(&edited), seen(&prepare(&desc)));
    assert!(seen(&edited).0 == seen(&scene).0 && seen(&edited).1 != seen(&scene).1);
    desc.shapes[1].to_world.translation.z += 0.25;
    let moved = scene.edited(&desc).expect("valid");
    assert!(!std::ptr::eq(scene.accel(), moved.accel()));
    assert!((seen(&moved).0.z - seen(&scene).0.z - 0.25).abs() < 1e-5);
    desc.groups[1].shapes[1].flip_normals = true;
    assert!(!std::ptr::eq(moved.accel(), moved.edited(&desc).expect("valid").accel()));
}

#[test]
fn what_cannot_be_prepared_is_told() {
    let error = |change: fn(&mut SceneDesc)| {
        let mut desc = several();
        change(&mut desc);
        Scene::prepare(&desc).map(|_| ()).expect_err("refused")
    };
    let unknown = error(|d| d.shapes[1].kind = ShapeKind::Instance(GroupId(7)));
    assert_eq!(unknown, PrepareError::UnknownGroup { id: GroupId(7), place: Place::default() });
    let lamp = error(|d| d.groups[0].shapes[0].emission = Some(Spectrum::Constant(1.0)));
    assert!(lamp.to_string().contains("it emits"), "{lamp}");
    let nested = error(|d| d.groups[0].shapes[0].kind = ShapeKind::Instance(GroupId(1)));
    assert!(nested.to_string().contains("it is an instance"), "{nested}");
    assert!(matches!(
        error(|d| d.groups[1].shapes[0].bsdf = BsdfId(99)),
        PrepareError::UnknownMaterial { .. }
    ));
    let mesh = error(|d| d.groups[1].shapes[0].kind = ShapeKind::Mesh(MeshId(9)));
    assert!(matches!(mesh, PrepareError::UnknownMesh { .. }));

    // Only what cannot be shown is left out.
    for bad in [scale(1.0, 0.0, 1.0), at(1e13, 0.0, 0.0), at(f64::NAN, 0.0, 0.0), scale(1e13, 1e13, 1e13)] {
        let mut desc = several();
        desc.shapes[1].to_world = bad;
        let scene = prepare(&desc);
        assert!(scene.notices().iter().any(|n| n.contains("this instance has no inverse")), "{bad:?}");
        let ray = Ray::new(Vec3::new(3.0, 2.0, 9.0), -Vec3::Z);
        assert_eq!(scene.pick(&ray).map(|p| p.shape), prepare(&several()).pick(&ray).map(|p| p.shape));
    }
}
