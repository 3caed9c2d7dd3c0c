//! Scenes in code and means over them, for the tests of the tracer.

#![allow(dead_code, unused_imports, reason = "every test file uses its own part")]

mod random;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use pointillist::color::Xyz;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};
pub use random::Random;

/// A scene without anything in it: the camera at the origin looks along +z, 1° wide.
pub fn empty() -> SceneDesc {
    SceneDesc {
        files: Vec::new(),
        camera: look(DVec3::ZERO, DVec3::Z, 1.0),
        film: FilmDesc { width: 64, height: 64, crop: None, rfilter: None },
        integrator: IntegratorDesc {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
        },
        samples_per_pixel: None,
        bsdfs: Vec::new(),
        meshes: Vec::new(),
        names: Names::default(),
        shapes: Vec::new(),
        lights: Vec::new(),
    }
}

/// A camera at `from` that looks along `direction`.
pub fn look(from: DVec3, direction: DVec3, fov: f64) -> CameraDesc {
    let z = direction.normalize();
    let x = z.any_orthonormal_vector();
    CameraDesc {
        to_world: DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), from),
        fov,
        fov_axis: FovAxis::X,
        principal_point_offset: DVec2::ZERO,
        near_clip: 0.0,
        far_clip: 1e30,
        aperture_radius: 0.0,
        focus_distance: 0.0,
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
    BsdfDesc::Diffuse { reflectance: Spectrum::Constant(albedo) }
}

/// Glass that reflects and transmits all.
pub fn glass(int_ior: Ior) -> BsdfDesc {
    let one = || Spectrum::Constant(1.0);
    BsdfDesc::Dielectric {
        int_ior,
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: one(),
        specular_transmittance: one(),
    }
}

/// Adds a shape; `emission` > 0 makes it a light.
pub fn shape(desc: &mut SceneDesc, kind: ShapeKind, to_world: DAffine3, (bsdf, emission): (BsdfId, f32)) {
    desc.shapes.push(ShapeDesc {
        id: None,
        place: Place::default(),
        kind,
        to_world,
        flip_normals: false,
        bsdf,
        emission: (emission > 0.0).then_some(Spectrum::Constant(emission)),
    });
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
    PathTracer::new(Arc::new(prepare(desc)), camera, &desc.integrator, 1, UvWindow::PICTURE)
}

/// Keeps every camera sample's luminance.
#[derive(Default)]
pub struct Luminances(pub Vec<f32>);

impl SampleSink for Luminances {
    fn camera(&mut self, _: [f32; 2], value: Xyz, weight: f32) {
        assert!(value.is_finite() && weight == 1.0);
        self.0.push(value.y);
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {
        panic!("path tracing has no light stream");
    }
}

/// The luminance of `n` paths.
pub fn luminances(desc: &SceneDesc, n: u64) -> Vec<f32> {
    let tracer = tracer(desc);
    let mut sink = Luminances::default();
    (0..n).for_each(|i| tracer.trace(i, &mut (), &mut sink));
    sink.0
}

/// Mean luminance over `n` paths and its standard error as if they were independent (the sequence does better).
pub fn mean(desc: &SceneDesc, n: u64) -> (f64, f64) {
    let all = luminances(desc, n);
    let mean = all.iter().map(|&y| f64::from(y)).sum::<f64>() / n as f64;
    let variance = all.iter().map(|&y| (f64::from(y) - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    (mean, (variance / n as f64).sqrt())
}

/// Asserts that the mean luminance is `expected` within 4 standard errors and within `tolerance` (relative).
pub fn assert_mean(desc: &SceneDesc, expected: f64, tolerance: f64, what: &str) {
    let (found, error) = mean(desc, 1 << 17);
    let off = (found - expected).abs();
    assert!(
        off <= 4.0 * error + 1e-5 * expected && off <= tolerance * expected,
        "{what}: {found} ± {error} instead of {expected}"
    );
}
