//! The primitives that an accelerator is built from.

use std::fmt::Debug;
use std::ops::Range;

use glam::{DAffine3, Vec3};

use crate::tracer::curve::CurvePiece;
use crate::tracer::shape::{Cylinder, Disk, Sphere};

/// Triangles by id.
pub trait TriangleSource: Debug + Sync {
    /// Their number.
    fn count(&self) -> usize;

    /// The corners of triangle `id`, which must exist.
    fn corners(&self, id: usize) -> [Vec3; 3];
}

impl TriangleSource for Vec<[Vec3; 3]> {
    fn count(&self) -> usize {
        self.len()
    }

    fn corners(&self, id: usize) -> [Vec3; 3] {
        self[id]
    }
}

/// The primitives of an accelerator.
#[derive(Clone, Debug)]
pub struct Shapes<'a> {
    /// The triangles.
    pub triangles: &'a dyn TriangleSource,
    /// In ascending order each triangle `abc` whose successor `acd` completes a parallelogram: the two are tested as one, and a
    /// hit on either is reported for the first, with barycentric weights in its plane.
    pub quads: &'a [u32],
    /// Disks.
    pub disks: Vec<Disk>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Cylinders.
    pub cylinders: Vec<Cylinder>,
    /// Pieces of curves.
    pub curves: Vec<CurvePiece>,
}

impl Default for Shapes<'_> {
    fn default() -> Self {
        static NO_TRIANGLES: Vec<[Vec3; 3]> = Vec::new();
        let (disks, spheres, cylinders, curves) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { triangles: &NO_TRIANGLES, quads: &[], disks, spheres, cylinders, curves }
    }
}

/// Primitives in a space of their own that are visible through instances only: ranges of the lists of triangles, disks,
/// spheres and cylinders. Primitives in no group are in world space.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PrimitiveGroup {
    /// Triangles.
    pub triangles: Range<u32>,
    /// Disks.
    pub disks: Range<u32>,
    /// Spheres.
    pub spheres: Range<u32>,
    /// Cylinders.
    pub cylinders: Range<u32>,
    /// Pieces of curves.
    pub curves: Range<u32>,
}

/// A group placed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the group.
    pub group: u32,
    /// The group's space to world space. It must be invertible.
    pub to_world: DAffine3,
}
