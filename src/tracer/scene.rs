//! The prepared scene: what a path asks of it.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::scene::SceneDesc;

use super::accel::{Accel, Hit, PrimRange, Ray};
use super::bsdf::Sides;
use super::interaction::SurfaceInteraction;
use super::light::{LightSample, Lights};
use super::material::Material;
use super::prepare::backs::Back;
use super::prepare::{PrepareError, prepare};
use super::shape::{Disk, Sphere, SurfacePoint, Triangle};

/// Marks the absence of a light or of normals in a record.
pub(super) const NONE: u32 = u32::MAX;

/// A primitive's own record.
#[derive(Clone, Copy, Debug)]
pub(super) struct PrimRecord {
    /// Index into the surfaces.
    pub(super) surface: u32,
    /// Index into the lights, or [`NONE`].
    pub(super) light: u32,
    /// Index into the vertex normals, or [`NONE`].
    pub(super) normals: u32,
    /// Index into the backs where another primitive lies back to back with it, or [`NONE`].
    pub(super) back: u32,
}

/// A scene ready for tracing: immutable, shared by all workers. It holds no camera: that is the integrator's, so
/// that moving it or changing the size of the picture leaves the scene as it is.
#[derive(Debug)]
pub struct Scene {
    pub(super) accel: Accel,
    pub(super) triangles: Vec<Triangle>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    /// By primitive id.
    pub(super) prims: Vec<PrimRecord>,
    /// Shading normals of the smooth triangles.
    pub(super) normals: Vec<[Vec3; 3]>,
    /// What lies on the back of a primitive, in the same place.
    pub(super) backs: Vec<Back>,
    /// Materials by side of every surface; the primitives of one shape share one.
    pub(super) surfaces: Vec<Sides>,
    pub(super) materials: Vec<Material>,
    pub(super) lights: Lights,
    pub(super) notices: Vec<String>,
}

impl Scene {
    /// Makes `desc` ready for tracing: world space, tree, lights, materials.
    ///
    /// What cannot be traced but does no harm (triangles without area, coordinates that are not finite or beyond
    /// 1e12) is dropped, counted and told in [`Scene::notices`].
    ///
    /// # Errors
    ///
    /// [`PrepareError`] when an id points nowhere, or materials form a circle.
    pub fn prepare(desc: &SceneDesc) -> Result<Scene, PrepareError> {
        prepare(desc)
    }

    /// What the user should know about the scene, one sentence each.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The lights.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// The geometry.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// What `ray` (of unit direction) meets first.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.accel.closest(ray).map(|hit| self.interaction(ray, &hit))
    }

    /// True when nothing stands between `from` and the light of `sample`.
    #[inline]
    pub fn visible(&self, from: &SurfaceInteraction, light: u32, sample: &LightSample) -> bool {
        match sample.target {
            Some(target) => !self.accel.occluded(&from.spawn_to(target, sample.wi), self.lights.prims(light)),
            None => !self.accel.occluded(&from.spawn(sample.wi), PrimRange::NONE),
        }
    }

    /// The material of a hit and the frame it is evaluated in.
    #[inline]
    pub fn material(&self, hit: &SurfaceInteraction) -> (&Material, Frame) {
        let (material, frame) = self.surfaces[hit.surface as usize].facing(hit.frame, hit.wo);
        (&self.materials[material as usize], frame)
    }

    #[inline]
    fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let mut record = self.prims[hit.prim as usize];
        let id = hit.prim as usize;
        let mut point = match self.triangles.get(id) {
            Some(triangle) => triangle.point(hit.uv),
            None => self.analytic_point(ray, hit),
        };
        let smooth = record.normals != NONE;
        let mut n =
            if smooth { self.shading_normal(record.normals, hit.uv).unwrap_or(point.ng) } else { point.ng };
        if record.back != NONE && ray.direction.dot(point.ng) > 0.0 {
            let Back { surface, light } = self.backs[record.back as usize];
            (record.surface, record.light) = (surface, light);
            (point.ng, n) = (-point.ng, -n);
        }
        SurfaceInteraction {
            point,
            frame: Frame::new(n),
            wo: -ray.direction,
            surface: record.surface,
            light: (record.light != NONE).then_some(record.light),
            smooth,
        }
    }

    #[inline(never)]
    fn analytic_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let i = hit.prim as usize - self.triangles.len();
        match self.disks.get(i) {
            Some(disk) => disk.point(ray, hit.t),
            None => self.spheres[i - self.disks.len()].point(ray, hit.t),
        }
    }

    #[inline]
    fn shading_normal(&self, normals: u32, uv: [f32; 2]) -> Option<Vec3> {
        let [a, b, c] = self.normals[normals as usize];
        (a * (1.0 - uv[0] - uv[1]) + b * uv[0] + c * uv[1]).try_normalize()
    }
}
