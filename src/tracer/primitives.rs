//! The primitives of a scene: everything that stays the same when materials and lights are edited.

use glam::{Vec2, Vec3};

use crate::math::frame::Frame;

use super::accel::{Accel, Hit, Ray};
use super::interaction::SurfaceInteraction;
use super::placement::Placement;
use super::shape::{Cylinder, Disk, Sphere, SurfacePoint, Triangle};
use super::tangents::Tangents;
use super::texture_coordinates::TextureCoordinates;

/// The index that marks an absent light, normal or back in a record.
pub(super) const NONE: u32 = u32::MAX;

/// Indices of the properties of a primitive.
#[derive(Clone, Copy, Debug)]
pub(super) struct PrimRecord {
    /// Index into the surfaces.
    pub(super) surface: u32,
    /// Index into the lights, or [`NONE`].
    pub(super) light: u32,
    /// Index into the vertex normals, or [`NONE`].
    pub(super) normals: u32,
    /// Index into the backs, if another primitive lies back to back with this one, or [`NONE`].
    pub(super) back: u32,
}

/// The primitive on the back of another one. It is not in the accelerator: rays that hit the other one from that side see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Back {
    /// Index into the surfaces.
    pub(super) surface: u32,
    /// Index into the lights, or [`NONE`].
    pub(super) light: u32,
}

/// A triangle with its record. Hits are incoherent, so both share one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Face {
    pub(super) triangle: Triangle,
    pub(super) record: PrimRecord,
}

const _: () = assert!(size_of::<Face>() == 64);

/// The primitives of all shapes, in world space or in the space of their group.
#[derive(Debug)]
pub(super) struct Primitives {
    pub(super) accel: Accel,
    /// Triangles by primitive id: they come first.
    pub(super) faces: Vec<Face>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) cylinders: Vec<Cylinder>,
    /// Records of disks, then of spheres, then of cylinders.
    pub(super) round: Vec<PrimRecord>,
    /// Shading normals of the smooth triangles.
    pub(super) normals: Vec<[Vec3; 3]>,
    /// Primitives on the backs of others, in the same place.
    pub(super) backs: Vec<Back>,
    /// Tangents by surface. Empty if nothing is brushed.
    pub(super) tangents: Vec<Tangents>,
    /// Texture coordinates by surface. Empty if nothing is textured.
    pub(super) uvs: Vec<TextureCoordinates>,
    /// Placements by instance.
    pub(super) placements: Vec<Placement>,
}

impl Primitives {
    /// The surface interaction at `hit` of `ray`, in world space.
    #[inline(always)]
    pub(super) fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        match hit.instance {
            Hit::DIRECT => self.local_interaction(ray, hit),
            instance => self.instance_interaction(ray, hit, instance),
        }
    }

    /// The surface interaction with a primitive of the group that `instance` shows.
    #[inline(never)]
    fn instance_interaction(&self, ray: &Ray, hit: &Hit, instance: u32) -> SurfaceInteraction {
        let place = &self.placements[instance as usize];
        let inside = self.local_interaction(&self.accel.ray_in_instance(instance, ray), hit);
        let n = place.normal(inside.frame.n);
        let along = self.tangents.get(inside.surface as usize).and_then(|t| t.along(hit.prim, &inside.point));
        SurfaceInteraction {
            point: place.point(&inside.point),
            frame: along.map_or_else(|| Frame::new(n), |along| Frame::along(n, place.along(along))),
            wo: -ray.direction,
            ..inside
        }
    }

    /// The surface interaction in the space of the primitive, which is also that of `ray`.
    #[inline(always)]
    fn local_interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let (mut point, mut record) = match self.faces.get(hit.prim as usize) {
            Some(face) => (face.triangle.point(hit.uv), face.record),
            None => self.round_point(ray, hit),
        };
        let uv = match self.uvs.get(record.surface as usize) {
            Some(coordinates) => coordinates.at(hit, &point),
            None => Vec2::ZERO,
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
            frame: if self.tangents.is_empty() {
                Frame::new(n)
            } else {
                self.frame(record.surface, hit, &point, n)
            },
            wo: -ray.direction,
            uv,
            surface: record.surface,
            light: (record.light != NONE).then_some(record.light),
            smooth,
        }
    }

    /// The shading frame with normal `n` in a scene with brushed surfaces.
    #[inline(never)]
    fn frame(&self, surface: u32, hit: &Hit, point: &SurfacePoint, n: Vec3) -> Frame {
        match &self.tangents[surface as usize] {
            Tangents::Any => Frame::new(n),
            tangents => tangents.frame(hit.prim, point, n),
        }
    }

    #[inline(never)]
    fn round_point(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, PrimRecord) {
        let i = hit.prim as usize - self.faces.len();
        let point = match self.disks.get(i) {
            Some(disk) => disk.point(ray, hit.t),
            None => match self.spheres.get(i - self.disks.len()) {
                Some(sphere) => sphere.point(ray, hit.t),
                None => self.cylinders[i - self.disks.len() - self.spheres.len()].point(ray, hit.t),
            },
        };
        (point, self.round[i])
    }

    #[inline]
    fn shading_normal(&self, normals: u32, uv: [f32; 2]) -> Option<Vec3> {
        let [a, b, c] = self.normals[normals as usize];
        (a * (1.0 - uv[0] - uv[1]) + b * uv[0] + c * uv[1]).try_normalize()
    }
}
