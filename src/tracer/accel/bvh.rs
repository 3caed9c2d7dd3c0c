//! The finished accelerator.

use glam::{DAffine3, Vec3};

use crate::tracer::curve::CurvePiece;
use crate::tracer::shape::{Cylinder, Disk, Sphere};

use super::layout::{Arena, NodeRef};
use super::ray::{Hit, HitId, PrimRange, Ray};
use super::shapes::PrimitiveGroup;
use super::simd_kernel::{AvailableKernel, SimdKernel};

/// The root of one BVH in the arena: of the world, or of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct BvhRoot {
    /// Where the traversal begins.
    pub(super) root: NodeRef,
    /// Corners of the bounding box, both zero if there is nothing.
    pub(super) bounds: (Vec3, Vec3),
    /// The largest magnitude of a coordinate of the bounding box.
    pub(super) extent: f32,
}

impl BvhRoot {
    pub(super) fn new(root: NodeRef, bounds: (Vec3, Vec3)) -> Self {
        Self { root, bounds, extent: bounds.0.abs().max(bounds.1.abs()).max_element() }
    }
}

impl Default for BvhRoot {
    fn default() -> Self {
        Self::new(NodeRef::END, (Vec3::ZERO, Vec3::ZERO))
    }
}

/// An instance as the traversal needs it.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroupInstance {
    pub(super) group: u32,
    /// World space to the group's space.
    pub(super) to_group: DAffine3,
}

impl GroupInstance {
    /// `ray` in the group's space. Distances stay the same.
    fn transform_ray(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.to_group.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: self.to_group.transform_vector3(ray.direction.as_dvec3()).as_vec3(),
            t_max: ray.t_max,
        }
    }
}

/// The traversals, compiled for one [`AvailableKernel`]: those of an [`Accel`] can be run by this processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct TraversalFns {
    /// Replaces the given hit by the closest one of a BVH, seen through an instance, if that is closer.
    pub(super) closest: unsafe fn(&Accel, &BvhRoot, &Ray, u32, &mut Hit),
    /// The same, of anything but some primitives.
    pub(super) closest_except: unsafe fn(&Accel, &BvhRoot, &Ray, &[HitId], u32, &mut Hit),
    /// True if anything of a BVH is hit, except for some primitives.
    pub(super) occluded: unsafe fn(&Accel, &BvhRoot, &Ray, PrimRange) -> bool,
}

/// A BVH over triangles, parallelograms, disks, spheres, cylinders, curves and instances of groups of them.
#[derive(Debug)]
pub struct Accel {
    pub(super) arena: Arena,
    pub(super) world: BvhRoot,
    pub(super) groups: Vec<BvhRoot>,
    pub(super) instances: Vec<GroupInstance>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) cylinders: Vec<Cylinder>,
    pub(super) curves: Vec<CurvePiece>,
    /// The first id of a disk.
    pub(super) first_disk: u32,
    /// The first triangles of the parallelograms.
    pub(super) quads: Box<[u32]>,
    /// The primitives of each group.
    pub(super) ranges: Box<[PrimitiveGroup]>,
    /// [`ArenaBuilder::growth`](super::write::ArenaBuilder::growth) when the tree was built.
    pub(super) growth: f64,
    pub(super) kernel: AvailableKernel,
    /// The functions of `kernel`.
    pub(super) traversal: TraversalFns,
}

impl Accel {
    /// Bytes of memory that the traversal reads.
    pub fn bytes(&self) -> usize {
        size_of_val(self.arena.lines()) + size_of_val(&self.instances[..])
    }

    /// The instruction set of the traversal.
    pub fn kernel(&self) -> SimdKernel {
        self.kernel.get()
    }

    /// The same, as proof that this processor has it.
    pub(in crate::tracer) fn available_kernel(&self) -> AvailableKernel {
        self.kernel
    }

    /// Corners of the bounding box of everything, both zero for an empty scene.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.world.bounds
    }

    /// The closest hit with `0 < t < ray.t_max`, or `None`. Of several at the same distance it is the one with the lowest id
    /// (then the lowest instance). A ray hits nothing if it is not finite, starts beyond 1e18, or has a direction shorter
    /// than 5e-12. In the box test a component of the direction below 1e-18 counts as 1e-18.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        // The lowest id and instance: no hit at the same distance comes before it.
        let mut best = Hit { t: ray.t_max, prim: 0, uv: [0.0; 2], instance: 0 };
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.closest)(self, &self.world, ray, Hit::DIRECT, &mut best) };
        (best.t < ray.t_max).then_some(best)
    }

    /// As [`closest`](Self::closest), of anything but what has these [ids](Hit::id).
    pub fn closest_except(&self, ray: &Ray, skip: &[HitId]) -> Option<Hit> {
        let mut best = Hit { t: ray.t_max, prim: 0, uv: [0.0; 2], instance: 0 };
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.closest_except)(self, &self.world, ray, skip, Hit::DIRECT, &mut best) };
        (best.t < ray.t_max).then_some(best)
    }

    /// True if anything but the primitives of `skip` is hit with `0 < t < ray.t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, skip: PrimRange) -> bool {
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.occluded)(self, &self.world, ray, skip) }
    }

    /// `ray` in the space of the group that `instance` shows, with the rounding of the traversal. Distances stay the same.
    ///
    /// # Panics
    ///
    /// If there is no such instance.
    pub fn ray_in_instance(&self, instance: u32, ray: &Ray) -> Ray {
        self.instances[instance as usize].transform_ray(ray)
    }

    /// The distance to the disk, sphere, cylinder or curve `prim`, if it is hit before `t_max`.
    #[inline(never)]
    pub(super) fn intersect_analytic(&self, prim: u32, ray: &Ray, t_max: f32) -> Option<f32> {
        let i = (prim - self.first_disk) as usize;
        match self.disks.get(i) {
            Some(disk) => disk.intersect(ray, t_max),
            None => match self.spheres.get(i - self.disks.len()) {
                Some(sphere) => sphere.intersect(ray, t_max),
                None => {
                    let i = i - self.disks.len() - self.spheres.len();
                    match self.cylinders.get(i) {
                        Some(cylinder) => cylinder.intersect(ray, t_max),
                        None => self.curves.get(i - self.cylinders.len())?.intersect(ray, t_max),
                    }
                }
            },
        }
    }

    /// Replaces `best` by a closer hit in an instance, if there is one.
    #[inline(never)]
    pub(super) fn closest_in_instance(&self, index: u32, ray: &Ray, best: &mut Hit) {
        let instance = &self.instances[index as usize];
        let (group, ray) = (&self.groups[instance.group as usize], instance.transform_ray(ray));
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.closest)(self, group, &ray, index, best) };
    }

    /// Replaces `best` by a closer hit in an instance, of anything but what has the ids of `skip`.
    #[cold]
    #[inline(never)]
    pub(super) fn closest_except_in_instance(&self, index: u32, ray: &Ray, skip: &[HitId], best: &mut Hit) {
        let instance = &self.instances[index as usize];
        let (group, ray) = (&self.groups[instance.group as usize], instance.transform_ray(ray));
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.closest_except)(self, group, &ray, skip, index, best) };
    }

    /// True if anything of an instance but the primitives of `skip` is hit.
    #[inline(never)]
    pub(super) fn occluded_in_instance(&self, index: u32, ray: &Ray, skip: PrimRange) -> bool {
        let instance = &self.instances[index as usize];
        let (group, ray) = (&self.groups[instance.group as usize], instance.transform_ray(ray));
        // SAFETY: the functions are those of an `AvailableKernel`, which this processor can run.
        unsafe { (self.traversal.occluded)(self, group, &ray, skip) }
    }
}
