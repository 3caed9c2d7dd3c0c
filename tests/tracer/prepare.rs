//! From description to scene: what is dropped, which side is the front, what is an error.

use std::sync::Arc;

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::light::LightSampleContext;
use pointillist::tracer::{PrepareError, Scene};

/// Unusable triangles are counted and reported; the power of their light remains right.
#[test]
fn unusable_triangles_are_dropped_and_told() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut positions = good.to_vec();
    positions.extend([Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::splat(1e30), Vec3::X * 2.0]);
    let triangles = vec![[0, 1, 2], [0, 1, 3], [0, 1, 4], [5, 1, 2], [0, 0, 1], [0, 1, 6], [0, 1, 99]];
    desc.meshes.push(Arc::new(Mesh { positions, triangles, ..Mesh::default() }));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::IDENTITY, m, 1.0);
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)), m, 1.0);
    shape(&mut desc, sphere(DVec3::ZERO, 0.0), DAffine3::IDENTITY, m, 1.0);
    let scene = prepare(&desc);
    assert!(scene.notices().iter().any(|n| n.contains("6 primitives")), "{:?}", scene.notices());
    assert_eq!(scene.lights().len(), 1);
    let at = LightSampleContext { p: Vec3::new(0.2, 0.2, 1.0), n: -Vec3::Z, through: false, glossy: false };
    let (light, sample) = scene.lights().sample(at, 0.999_999_9, [0.3, 0.3]).expect("in front");
    assert_eq!(light, 0);
    assert!(sample.pdf.0 > 0.0);
}

/// The camera and shapes name media that exist. What is nowhere is not prepared, whatever is wrong with it.
#[test]
fn media_that_are_named_exist_and_others_do_not_count() {
    let isotropic = || PhaseDesc::Isotropic;
    let blend = |phases| PhaseDesc::Blend { weight: 0.5, phases: Box::new(phases) };
    let wide = (0..PhaseDesc::MOST_PARTS).fold(isotropic(), |phase, _| blend([phase, isotropic()]));
    let mut desc = empty();
    let haze = medium(&mut desc, 0.1, 0.5, PhaseDesc::Isotropic);
    let refused = medium(&mut desc, 0.1, 0.5, wide);
    desc.camera.medium = Some(haze);
    assert!(prepare(&desc).media().is_some(), "the second medium is nowhere");
    desc.camera.medium = Some(refused);
    let is_refused =
        |desc: &SceneDesc| matches!(Scene::prepare(desc), Err(PrepareError::PhaseFunction { .. }));
    assert!(is_refused(&desc));
    // A group counts where an instance shows it.
    desc.camera.medium = Some(haze);
    boundary(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, refused);
    let hidden = desc.shapes.pop().expect("just added");
    desc.groups.push(GroupDesc { id: None, place: Place::default(), shapes: vec![hidden] });
    assert!(!is_refused(&desc));
    shape(&mut desc, ShapeKind::Instance(GroupId(0)), DAffine3::IDENTITY, BsdfId::NONE, 0.0);
    assert!(is_refused(&desc));
    desc.shapes.clear();
    boundary(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, haze);
    let id = MediumId(7);
    desc.camera.medium = Some(id);
    assert_eq!(Scene::prepare(&desc).err(), Some(PrepareError::UnknownMedium { id }));
}

/// A mesh of which every seventh triangle holds NaN, an infinity or a number beyond all use: the others are hit as if
/// those were not there.
#[test]
fn unusable_vertices_hide_nothing() {
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e13, f32::MAX];
    let at = |i: u32| Vec3::new(i as f32, (i % 5) as f32, (i % 3) as f32);
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    let mut mesh = Mesh::default();
    for i in 0..700u32 {
        let mut corners = [at(i), at(i) + Vec3::X * 0.9, at(i) + Vec3::Y * 0.9];
        if i % 7 == 3 {
            corners[i as usize % 3][i as usize / 3 % 3] = bad[i as usize / 7 % bad.len()];
        }
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    desc.meshes.push(Arc::new(mesh));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), DAffine3::IDENTITY, m, 0.0);
    let scene = prepare(&desc);
    assert!(scene.notices().iter().any(|n| n.contains("100 primitives")), "{:?}", scene.notices());
    for i in 0..700 {
        let ray = Ray::new(at(i) + Vec3::new(0.2, 0.3, 4.0), -Vec3::Z);
        let z = scene.closest(&ray).map(|h| h.point.p.z);
        assert_eq!(z, (i % 7 != 3).then_some((i % 3) as f32), "triangle {i}");
    }
}

/// The density of a light sample equals the density that a ray hits that point, for every kind of light. An even sky has nothing that
/// exceeds its mean: it is left to the rays that materials send.
#[test]
fn sample_and_pdf_are_pairs() {
    let mut desc = empty();
    let m = material(&mut desc, grey(0.5));
    let turned = DAffine3::from_axis_angle(DVec3::X, PI) * DAffine3::from_scale(DVec3::new(0.3, 0.4, 1.0));
    let at = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 2.0)) * turned;
    shape(&mut desc, ShapeKind::Rectangle, at(-3.0), m, 1.0);
    shape(&mut desc, ShapeKind::Disk, at(0.0), m, 2.0);
    shape(
        &mut desc,
        sphere(DVec3::ZERO, 1.0),
        at(3.0) * DAffine3::from_scale(DVec3::new(4.0, 3.0, 1.2) * 0.1),
        m,
        3.0,
    );
    let positions = vec![Vec3::ZERO, Vec3::Y, Vec3::X];
    desc.meshes.push(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }));
    shape(
        &mut desc,
        ShapeKind::Mesh(MeshId(0)),
        DAffine3::from_translation(DVec3::new(6.0, 0.0, 2.0)),
        m,
        1.0,
    );
    environment(&mut desc);
    let scene = prepare(&desc);
    let lit = LightSampleContext { p: Vec3::new(0.3, 0.1, 0.0), n: Vec3::Z, through: false, glossy: false };
    let mut random = Random(9);
    let mut seen = [0; 5];
    for _ in 0..20_000 {
        let u = [random.f64() as f32, random.f64() as f32];
        let Some((light, sample)) = scene.lights().sample(lit, random.f64(), u) else { continue };
        let hit = scene.closest(&Ray::new(lit.p, sample.wi));
        if hit.and_then(|h| h.light) != sample.target.map(|_| light) {
            continue; // Another light in front, or the last ulp of an edge.
        }
        seen[light as usize] += 1;
        let pdf = scene.lights().pdf(light, lit, sample.wi, hit.as_ref().map(|h| &h.point));
        assert!((pdf.0 / sample.pdf.0 - 1.0).abs() < 1e-4, "light {light}: {pdf:?} {:?}", sample.pdf);
    }
    let [surfaces @ .., sky] = seen;
    assert!(surfaces.iter().all(|&n| n > 20) && sky == 0, "{seen:?}");
    assert_eq!(scene.lights().pdf(4, lit, Vec3::Z, None).0, 0.0);
}

/// Fronts as Mitsuba 3.9 has them (asked of it): +z and outwards survive a mirroring transform, a sphere's do not.
#[test]
fn fronts_under_mirroring_and_flipping() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let unit = || sphere(DVec3::ZERO, 1.0);
    for (kind, turns) in
        [(ShapeKind::Cube, false), (unit(), true), (ShapeKind::Disk, false), (ShapeKind::Rectangle, false)]
    {
        for (to_world, mirrored) in [(DAffine3::IDENTITY, false), (mirror, true)] {
            for flip in [false, true] {
                let mut desc = empty();
                let m = material(&mut desc, grey(0.5));
                shape(&mut desc, kind.clone(), to_world, m, 0.0);
                desc.shapes[0].flip_normals = flip;
                let ray = Ray::new(Vec3::new(0.1, 0.2, 5.0), -Vec3::Z);
                let hit = prepare(&desc).closest(&ray).expect("hit");
                let front = (flip != (turns && mirrored)) != (hit.point.ng.z > 0.0);
                assert!(front, "{kind:?}, mirrored {mirrored}, flipped {flip}: {}", hit.point.ng);
            }
        }
    }
}

/// A coarse ball with smooth normals: lit as a ball, nothing through its back, never more than its albedo.
#[test]
fn smooth_normals_keep_the_furnace() {
    let (rings, sectors) = (12u32, 24u32);
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..sectors {
            let (theta, phi) =
                (PI * f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(sectors));
            let p = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).as_vec3();
            mesh.positions.push(p);
            mesh.normals.push(p);
            if i < rings {
                let (a, b) = (i * sectors + j, i * sectors + (j + 1) % sectors);
                mesh.triangles.extend([[a, a + sectors, b + sectors], [a, b + sectors, b]]);
            }
        }
    }
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 30.0;
    desc.meshes.push(Arc::new(mesh));
    let m = material(&mut desc, grey(0.8));
    let far = DAffine3::from_translation(DVec3::Z * 3.0);
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), far, m, 0.0);
    environment(&mut desc);
    let (found, _) = mean(&desc, 1 << 16);
    assert!((0.76..0.801).contains(&found), "{found}");
}

#[test]
fn inconsistent_descriptions_are_errors() {
    let error = |change: fn(&mut SceneDesc)| {
        let mut desc = empty();
        let m = material(&mut desc, grey(0.5));
        shape(&mut desc, ShapeKind::Disk, DAffine3::IDENTITY, m, 0.0);
        change(&mut desc);
        Scene::prepare(&desc).expect_err("inconsistent")
    };
    assert!(matches!(
        error(|d| d.shapes[0].bsdf = BsdfId(7)),
        PrepareError::UnknownMaterial { id: BsdfId(7) }
    ));
    let mesh = error(|d| d.shapes[0].kind = ShapeKind::Mesh(MeshId(3)));
    assert!(matches!(mesh, PrepareError::UnknownMesh { .. }) && mesh.to_string().contains("mesh 3"));
    let nested =
        error(|d| d.bsdfs[0] = BsdfDesc::TwoSided(TwoSidedDesc { front: BsdfId(0), back: BsdfId(0) }));
    assert!(matches!(nested, PrepareError::NestedTwoSided { .. }));
}
