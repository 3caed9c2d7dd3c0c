//! The primitives of a scene: everything that stays the same when materials and lights are edited.

use glam::Vec3;

use crate::scene::desc::texture::TexturePoint;

use super::accel::{Accel, Hit, Ray, TriangleSource};
use super::bsdf::MaterialEvalContext;
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
pub(super) struct BackSurface {
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
    pub(super) backs: Vec<BackSurface>,
    /// Tangents by surface. Empty if nothing is brushed or bumpy.
    pub(super) tangents: Vec<Tangents>,
    /// Texture coordinates by surface. Empty if nothing is textured.
    pub(super) uvs: Vec<TextureCoordinates>,
    /// Placements by instance.
    pub(super) placements: Vec<Placement>,
}

impl Primitives {
    /// The number of a triangle in the file of its shape; 0 of anything else.
    pub(super) fn index_in_shape(&self, prim: u32) -> u32 {
        self.faces.number(prim).unwrap_or(0)
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
        SurfaceInteraction {
            point: place.point(&inside.point),
            n: place.normal(inside.n),
            wo: -ray.direction,
            ..inside
        }
    }

    /// The surface on the other side of the primitive at a hit, where two lie back to back, seen from behind.
    pub(super) fn other_side(&self, at: &SurfaceInteraction) -> Option<SurfaceInteraction> {
        if self.backs.is_empty() {
            return None;
        }
        let record = match self.faces.get(at.hit.prim) {
            Some(face) => self.faces.record(face),
            None => self.round[at.hit.prim as usize - self.faces.count()],
        };
        let BackSurface { surface, light } = *self.backs.get(record.back as usize)?;
        let (surface, light) =
            if at.surface == surface { (record.surface, record.light) } else { (surface, light) };
        let point = SurfacePoint { ng: -at.point.ng, ..at.point };
        let light = (light != NONE).then_some(light);
        Some(SurfaceInteraction { point, n: -at.n, surface, light, ..*at })
    }

    /// Where the group is that has the surface of `at`, if it is one of a group.
    pub(super) fn placement(&self, at: &SurfaceInteraction) -> Option<&Placement> {
        self.placements.get(at.hit.instance as usize)
    }

    /// True where some surface has a (u, v) parametrization that its material asks for: it is textured, brushed or bumpy.
    #[inline(always)]
    pub(super) fn is_parametrized(&self) -> bool {
        !(self.uvs.is_empty() && self.tangents.is_empty())
    }

    /// The point at which the material of a hit is evaluated.
    #[inline(always)]
    pub(super) fn material_context(&self, at: &SurfaceInteraction) -> MaterialEvalContext {
        let placement = self.placement(at);
        let [dp_du, dp_dv] = match self.tangents.get(at.surface as usize) {
            Some(Tangents::Any) | None => [Vec3::ZERO; 2],
            Some(tangents) => {
                let point = placement.map_or(at.point, |place| place.point_in_group(&at.point));
                tangents.at(at.hit.prim, &point)
            }
        };
        // Where only its direction counts, ∂p/∂u stays a unit vector.
        let along = |v: Vec3| match placement {
            None => v,
            Some(place) if dp_dv == Vec3::ZERO => place.along(v),
            Some(place) => place.vector(v),
        };
        MaterialEvalContext {
            n: at.n,
            ng: at.point.ng,
            dp_du: along(dp_du),
            dp_dv: along(dp_dv),
            texture: self.texture_point(at),
        }
    }

    /// Where textures are asked; 0 where nothing on the surface is textured.
    #[inline(always)]
    pub(super) fn texture_point(&self, at: &SurfaceInteraction) -> TexturePoint {
        // A back has the coordinates of its front: the primitive that was hit is that of the front.
        let surface = match self.faces.get(at.hit.prim) {
            Some(face) => self.faces.record(face).surface,
            None => self.round[at.hit.prim as usize - self.faces.count()].surface,
        };
        let Some(coordinates) = self.uvs.get(surface as usize) else { return TexturePoint::default() };
        let placement = self.placement(at);
        coordinates.at(&at.hit, at.point.p, || {
            placement.map_or(at.point.p, |place| place.point_in_group(&at.point).p)
        })
    }

    /// The surface interaction in the space of the primitive, which is also that of `ray`.
    #[inline(always)]
    fn local_interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        let (mut point, mut record, smooth) = match self.faces.get(hit.prim) {
            Some(face) => {
                let point = self.faces.triangle(face).point(hit.uv);
                (point, self.faces.record(face), face.is_smooth().then_some(face))
            }
            None => {
                let (point, record) = self.round_point(ray, hit);
                (point, record, None)
            }
        };
        let interpolated = smooth.and_then(|face| self.faces.shading_normal(face, hit.uv));
        let mut n = interpolated.unwrap_or(point.ng);
        if record.back != NONE && ray.direction.dot(point.ng) > 0.0 {
            let BackSurface { surface, light } = self.backs[record.back as usize];
            (record.surface, record.light) = (surface, light);
            (point.ng, n) = (-point.ng, -n);
        }
        SurfaceInteraction {
            point,
            n,
            wo: -ray.direction,
            hit: *hit,
            surface: record.surface,
            light: (record.light != NONE).then_some(record.light),
            smooth: smooth.is_some(),
        }
    }

    #[inline(never)]
    fn round_point(&self, ray: &Ray, hit: &Hit) -> (SurfacePoint, PrimRecord) {
        let i = hit.prim as usize - self.faces.count();
        let point = match self.disks.get(i) {
            Some(disk) => disk.point(ray),
            None => match self.spheres.get(i - self.disks.len()) {
                Some(sphere) => sphere.point(ray),
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
