//! The finished tree, and what a walk meets in it that is neither a node nor a block.

use glam::{DAffine3, Vec3};

use crate::tracer::shape::{Disk, Sphere};

use super::kernels::Walks;
use super::layout::{Arena, Child};
use super::{Hit, PrimRange, Ray};

/// The world, or a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// What a walk begins with.
    pub(super) root: Child,
    /// Corners of the box around everything; both zero when there is nothing.
    pub(super) bounds: (Vec3, Vec3),
    /// The largest magnitude of a coordinate of these.
    pub(super) extent: f32,
}

impl Part {
    pub(super) fn new(root: Child, bounds: (Vec3, Vec3)) -> Self {
        Self { root, bounds, extent: bounds.0.abs().max(bounds.1.abs()).max_element() }
    }
}

impl Default for Part {
    fn default() -> Self {
        Self::new(Child::END, (Vec3::ZERO, Vec3::ZERO))
    }
}

/// A group at its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) group: u32,
    /// World space to the group's.
    pub(super) to_group: DAffine3,
}

impl Placed {
    /// `ray` as the group sees it; distances stay.
    pub(super) fn seen(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.to_group.transform_point3(ray.origin.as_dvec3()).as_vec3(),
            direction: self.to_group.transform_vector3(ray.direction.as_dvec3()).as_vec3(),
            t_max: ray.t_max,
        }
    }
}

/// Everything that is walked.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub(super) arena: Arena,
    pub(super) world: Part,
    pub(super) groups: Vec<Part>,
    pub(super) instances: Vec<Placed>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    /// The first id of a disk.
    pub(super) first_disk: u32,
    pub(super) walks: Walks,
}

impl Tree {
    /// The nearest hit with `0 < t < ray.t_max`. A ray that is not finite hits nothing.
    #[inline]
    pub(super) fn closest(&self, ray: &Ray) -> Option<Hit> {
        // Nothing comes before it at the same distance.
        let mut best = Hit { t: ray.t_max, prim: 0, uv: [0.0; 2], instance: 0 };
        // SAFETY: `Accel` sets walks that the processor can run.
        unsafe { (self.walks.closest)((self, &self.world), ray, Hit::DIRECT, &mut best) };
        (best.t < ray.t_max).then_some(best)
    }

    /// True when anything but `skip` is hit with `0 < t < ray.t_max`.
    #[inline]
    pub(super) fn occluded(&self, ray: &Ray, skip: PrimRange) -> bool {
        // SAFETY: `Accel` sets walks that the processor can run.
        unsafe { (self.walks.occluded)((self, &self.world), ray, skip) }
    }

    /// Where the ray meets the disk or sphere `prim`, if that is before `t_max`.
    #[inline(never)]
    pub(super) fn analytic(&self, prim: u32, ray: &Ray, t_max: f32) -> Option<f32> {
        let i = (prim - self.first_disk) as usize;
        match self.disks.get(i) {
            Some(disk) => disk.intersect(ray, t_max),
            None => self.spheres.get(i - self.disks.len())?.intersect(ray, t_max),
        }
    }

    /// What is hit in an instance before `best`.
    #[inline(never)]
    pub(super) fn closest_in(&self, index: u32, ray: &Ray, best: &mut Hit) {
        let placed = &self.instances[index as usize];
        let (part, seen) = (&self.groups[placed.group as usize], placed.seen(ray));
        // SAFETY: `Accel` sets walks that the processor can run.
        unsafe { (self.walks.closest)((self, part), &seen, index, best) };
    }

    /// True when anything of an instance is hit.
    #[inline(never)]
    pub(super) fn occluded_in(&self, index: u32, ray: &Ray, skip: PrimRange) -> bool {
        let placed = &self.instances[index as usize];
        let (part, seen) = (&self.groups[placed.group as usize], placed.seen(ray));
        // SAFETY: `Accel` sets walks that the processor can run.
        unsafe { (self.walks.occluded)((self, part), &seen, skip) }
    }
}
