//! The two questions a tracer asks of geometry: what is hit first, and is anything in between.
//!
//! `build` goes through these steps: a binary tree with the surface area heuristic, improved by obvhs (`binary`); which of its nodes
//! become nodes of eight children or leaves (`plan`); the lines of memory (`collapse`, `layout`). `kernels` walks them: one
//! body, compiled for each kind of processor, chosen once (`dispatch`). obvhs's own walk drops hits nearer than 1e-4 and its triangle
//! test is not watertight. Triangles and parallelograms stand in blocks of eight; spheres, disks and instances are leaves of
//! their own. An instance shows a group, which is a tree of its own among the same lines.
//!
//! Primitive ids: `0 .. triangles` are triangles, then disks, then spheres, each in the caller's order.
//!
//! Of hits at the same distance the one with the lowest id is reported: no answer depends on the order of the walk.

mod binary;
mod build;
mod collapse;
mod dispatch;
mod draft;
mod kernels;
mod layout;
mod pages;
mod plan;
mod ray;
mod tree;

use std::ops::Range;

use glam::{DAffine3, Vec3};

use crate::tracer::shape::{Disk, Sphere};

use kernels::Walks;
use tree::Tree;

pub use dispatch::Kernel;
pub(super) use pages::in_large_pages;
pub use ray::{Hit, PrimRange, Ray};

/// Primitives in a space of their own that are only seen through instances: ranges of the lists of triangles, disks and
/// spheres. Primitives in no group stand in the world.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// Triangles.
    pub triangles: Range<u32>,
    /// Disks.
    pub disks: Range<u32>,
    /// Spheres.
    pub spheres: Range<u32>,
}

/// A group shown in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the group.
    pub group: u32,
    /// The group's space to the world's; invertible.
    pub to_world: DAffine3,
}

/// Geometry prepared for the two questions.
#[derive(Debug, Default)]
pub struct Accel {
    tree: Tree,
    kernel: Kernel,
}

impl Accel {
    /// Builds the tree. Every coordinate must be finite and below 1e12 in magnitude, and every triangle must
    /// have an area; [`Scene::prepare`] drops the others.
    ///
    /// `quads` names, in ascending order, each triangle `abc` whose successor `acd` makes a parallelogram of it: the
    /// two are tested as one, and a hit on either is reported for the first, with weights in its plane.
    ///
    /// [`Scene::prepare`]: crate::tracer::Scene::prepare
    pub fn new(triangles: &[[Vec3; 3]], quads: &[u32], disks: Vec<Disk>, spheres: Vec<Sphere>) -> Self {
        Self::with_instances((triangles, quads), disks, spheres, (&[], &[]))
    }

    /// As [`Accel::new`], with groups of primitives and their instances. Ids are those of the lists as they are, groups
    /// included; a group's ranges hold both triangles of a parallelogram or none.
    pub fn with_instances(
        (triangles, quads): (&[[Vec3; 3]], &[u32]),
        disks: Vec<Disk>,
        spheres: Vec<Sphere>,
        (groups, instances): (&[Group], &[Instance]),
    ) -> Self {
        build::build(build::Shapes { triangles, quads, disks, spheres }, groups, instances)
    }

    /// Bytes of nodes, polygons and instances, as walked.
    pub fn bytes(&self) -> usize {
        size_of_val(self.tree.arena.lines()) + size_of_val(&self.tree.instances[..])
    }

    /// How rays are walked.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Walks rays by `kernel` from now on; false, and nothing changes, where this processor lacks what it needs.
    #[must_use]
    pub fn set_kernel(&mut self, kernel: Kernel) -> bool {
        let able = kernel.is_available();
        if able {
            (self.kernel, self.tree.walks) = (kernel, Walks::of(kernel));
        }
        able
    }

    /// Corners of the box around everything; both zero for an empty scene.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.tree.world.bounds
    }

    /// The nearest hit with `0 < t < ray.t_max`, or `None`; of several at the same distance the one with the lowest id (then the
    /// lowest instance). A ray hits nothing that is not finite, starts beyond 1e18 or has a direction shorter than 5e-12; in the test of
    /// boxes a component of the direction below 1e-18 counts as that.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.tree.closest(ray)
    }

    /// `ray` in the space of the group that `instance` shows, as it was walked; distances stay.
    ///
    /// # Panics
    ///
    /// When there is no such instance.
    pub fn seen(&self, instance: u32, ray: &Ray) -> Ray {
        self.tree.instances[instance as usize].seen(ray)
    }

    /// True when anything but the primitives of `skip` is hit with `0 < t < ray.t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, skip: PrimRange) -> bool {
        self.tree.occluded(ray, skip)
    }
}
