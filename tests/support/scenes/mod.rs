//! Scenes in code, for the tests of the tracer.

mod chi2;
mod mean;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::sync::Arc;

use pointillist::scene::desc::RenderingSpace;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, PathTracer, Scene};

pub use chi2::assert_counts;
pub use mean::{Luminances, assert_mean, luminances, mean};
pub use pointillist::math::random::Random;

/// A scene without anything in it: the camera at the origin looks along +z, 1° wide.
pub fn empty() -> SceneDesc {
    SceneDesc {
        files: Vec::new(),
        camera: look(DVec3::ZERO, DVec3::Z, 1.0),
        film: FilmDesc { width: 64, height: 64, crop: None, rfilter: None },
        integrator: IntegratorDesc::default(),
        samples_per_pixel: None,
        bsdfs: Vec::new(),
        meshes: Vec::new(),
        names: Names::default(),
        space: RenderingSpace::WORLD,
        shapes: Vec::new(),
        groups: Vec::new(),
        lights: Vec::new(),
        media: Vec::new(),
    }
}

/// The scene where its file puts it, for rays that are given in world space.
pub fn in_world_space(desc: SceneDesc) -> SceneDesc {
    SceneDesc { space: RenderingSpace::WORLD, ..desc }
}

/// A camera at `from` that looks along `direction`.
pub fn look(from: DVec3, direction: DVec3, fov: f64) -> CameraDesc {
    let z = direction.normalize();
    let x = z.any_orthonormal_vector();
    CameraDesc {
        projection: ProjectionDesc::Perspective(PerspectiveDesc {
            fov,
            fov_axis: FovAxis::X,
            lens: LensDesc::PINHOLE,
            distortion: None,
        }),
        to_world: DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), from),
        principal_point_offset: DVec2::ZERO,
        near_clip: 0.0,
        far_clip: 1e30,
        medium: None,
        place: Place::default(),
    }
}

/// Adds a material.
pub fn material(desc: &mut SceneDesc, bsdf: BsdfDesc) -> BsdfId {
    desc.bsdfs.push(bsdf);
    BsdfId(desc.bsdfs.len() as u32 - 1)
}

/// Lambert with the same albedo at every wavelength.
pub fn grey(albedo: f32) -> BsdfDesc {
    BsdfDesc::Diffuse(DiffuseDesc { reflectance: Spectrum::Constant(albedo).into() })
}

/// Glass that reflects and transmits all.
pub fn glass(int_ior: Ior) -> BsdfDesc {
    let one = || Spectrum::Constant(1.0);
    BsdfDesc::Dielectric(DielectricDesc {
        int_ior,
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: one().into(),
        specular_transmittance: one().into(),
    })
}

/// Adds a shape; `emission` > 0 makes it a light.
pub fn shape(desc: &mut SceneDesc, kind: ShapeKind, to_world: DAffine3, bsdf: BsdfId, emission: f32) {
    desc.shapes.push(ShapeDesc {
        id: None,
        place: Place::default(),
        kind,
        to_world,
        flip_normals: false,
        bsdf,
        emission: (emission > 0.0).then_some(Spectrum::Constant(emission)),
        emission_profile: Default::default(),
        medium_interface: Default::default(),
    });
}

/// Adds a grey homogeneous medium.
pub fn medium(desc: &mut SceneDesc, sigma_t: f32, albedo: f32, phase: PhaseDesc) -> MediumId {
    let [sigma_t, albedo] = [sigma_t, albedo].map(|value| Spectrum::Constant(value).into());
    desc.media.push(MediumDesc { sigma_t, albedo, scale: 1.0, phase, emission: None });
    MediumId(desc.media.len() as u32 - 1)
}

/// Adds a boundary that light passes, with `inside` behind it.
pub fn boundary(desc: &mut SceneDesc, kind: ShapeKind, to_world: DAffine3, inside: MediumId) {
    let null = material(desc, NullDesc.into());
    shape(desc, kind, to_world, null, 0.0);
    let interface = MediumInterface { interior: Some(inside), exterior: None };
    desc.shapes.last_mut().expect("just added").medium_interface = interface;
}

/// A sphere in object space.
pub fn sphere(center: DVec3, radius: f64) -> ShapeKind {
    ShapeKind::Sphere { center, radius }
}

/// Adds an environment of radiance 1.
pub fn environment(desc: &mut SceneDesc) {
    desc.lights.push(LightDesc::Constant { radiance: Spectrum::Constant(1.0), place: Place::default() });
}

/// Prepares a scene.
pub fn prepare(desc: &SceneDesc) -> Scene {
    Scene::prepare(desc).expect("the scene is valid")
}

/// A tracer for a scene.
pub fn tracer(desc: &SceneDesc) -> PathTracer {
    let camera = Camera::of(desc).expect("the camera is valid");
    RenderContext::new(Arc::new(prepare(desc)), camera, &desc.integrator, 1, UvWindow::PICTURE).into()
}

/// A floor under a lamp that nothing can meet, with or without a `sheet` of glass of index 1 between them, which changes nothing but that
/// no light can be sampled through it. 16×16 pixels.
pub fn lamp_over_floor(sheet: bool) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -1.5, 4.0), DVec3::new(0.0, 1.5, -4.0), 30.0);
    (desc.film.width, desc.film.height) = (16, 16);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(2.5)), white, 0.0);
    if sheet {
        let clear = material(&mut desc, glass(Ior::Constant(1.0)));
        let flat = DAffine3::from_scale(DVec3::new(6.0, 6.0, 0.1));
        shape(&mut desc, ShapeKind::Cube, DAffine3::from_translation(DVec3::Z) * flat, clear, 0.0);
    }
    let intensity = Spectrum::Constant(10.0);
    let position = DVec3::new(0.5, 0.3, 2.5);
    desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
    desc
}
