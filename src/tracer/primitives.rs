//! The primitives of a scene: everything that stays the same when materials and lights are edited.

use glam::Vec3;

use crate::scene::texture::TexturePoint;

use super::accel::{Accel, Hit, Ray, TriangleSource};
use super::curve::CurvePiece;
use super::faces::Faces;
use super::interaction::SurfaceInteraction;
use super::placement::Placement;
use super::shape::{Cylinder, Disk, Sphere, SurfacePoint};
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

/// The primitives of all shapes, in world space or in the space of their group.
#[derive(Debug)]
pub(super) struct Primitives {
    pub(super) accel: Accel,
    /// Triangles by primitive id: they come first.
    pub(super) faces: Faces,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) cylinders: Vec<Cylinder>,
    pub(super) curves: Vec<CurvePiece>,
    /// Records of disks, then of spheres, then of cylinders, then of curves.
    pub(super) round: Vec<PrimRecord>,
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
    /// The index of a triangle among those of its shape; 0 of anything else.
    pub(super) fn index_in_shape(&self, prim: u32) -> u32 {
        self.faces.first_of_shape(prim).map_or(0, |first| prim.saturating_sub(first))
    }

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
        // Where only its direction counts, ∂p/∂u stays a unit vector.
        let brushed = inside.dp_dv == Vec3::ZERO;
        let along = |v: Vec3| if brushed { place.along(v) } else { place.vector(v) };
        SurfaceInteraction {
            point: place.point(&inside.point),
            n: place.normal(inside.n),
            dp_du: along(inside.dp_du),
            dp_dv: along(inside.dp_dv),
            wo: -ray.direction,
            ..inside
        }
    }

    /// The surface interaction in the space of the primitive, which is also that of `ray`.
    #[inline(always)]
    fn local_interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let (mut point, mut record, smooth) = match self.faces.get(hit.prim) {
            Some(face) => {
                let point = self.faces.triangle(face).point(hit.uv);
                (point, self.faces.record(face), self.faces.normals_of(face))
            }
            None => {
                let (point, record) = self.round_point(ray, hit);
                (point, record, None)
            }
        };
        let texture = match self.uvs.get(record.surface as usize) {
            Some(coordinates) => coordinates.at(hit, &point),
            None => TexturePoint::default(),
        };
        let mut n = smooth.and_then(|normals| shading_normal(normals, hit.uv)).unwrap_or(point.ng);
        if record.back != NONE && ray.direction.dot(point.ng) > 0.0 {
            let Back { surface, light } = self.backs[record.back as usize];
            (record.surface, record.light) = (surface, light);
            (point.ng, n) = (-point.ng, -n);
        }
        let [dp_du, dp_dv] = match self.tangents.get(record.surface as usize) {
            Some(tangents) => tangents.at(hit.prim, &point),
            None => [Vec3::ZERO; 2],
        };
        SurfaceInteraction {
            point,
            n,
            dp_du,
            dp_dv,
            wo: -ray.direction,
            texture,
            surface: record.surface,
            light: (record.light != NONE).then_some(record.light),
            smooth: smooth.is_some(),
        }
    }

    #[inline(never)]
    fn round_point(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, PrimRecord) {
        let i = hit.prim as usize - self.faces.count();
        let point = match self.disks.get(i) {
            Some(disk) => disk.point(ray, hit.t),
            None => match self.spheres.get(i - self.disks.len()) {
                Some(sphere) => sphere.point(ray, hit.t),
                None => {
                    let i = i - self.disks.len() - self.spheres.len();
                    match self.cylinders.get(i) {
                        Some(cylinder) => cylinder.point(ray, hit.t),
                        None => self.curves[i - self.cylinders.len()].point(ray, hit.t),
                    }
                }
            },
        };
        (point, self.round[i])
    }
}

#[inline]
fn shading_normal([a, b, c]: [Vec3; 3], uv: [f32; 2]) -> Option<Vec3> {
    (a * (1.0 - uv[0] - uv[1]) + b * uv[0] + c * uv[1]).try_normalize()
}
