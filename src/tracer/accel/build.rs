//! Building the accelerator: bounding boxes of the primitives, then a BVH for each group and for the world.

use std::ops::Range;
use std::slice::from_ref;

use glam::{DAffine3, DVec3, Vec3};
use obvhs::bvh2::Bvh2;

use crate::math::float::UNIT_ROUNDOFF;
use crate::tracer::shape::{Disk, Sphere};

use super::binary::{self, PrimRef};
use super::bvh::{Accel, BvhRoot, GroupInstance};
use super::collapse::{CollapsePlan, Primitive, plan};
use super::kernels::traversals;
use super::layout::NodeRef;
use super::simd_kernel::SimdKernel;
use super::write::{ArenaBuilder, BvhWriter};

/// The primitives of an accelerator.
#[derive(Clone, Debug, Default)]
pub struct Shapes<'a> {
    /// Corners of the triangles.
    pub triangles: &'a [[Vec3; 3]],
    /// The first triangles of parallelograms, ascending; see [`Accel::new`].
    pub quads: &'a [u32],
    /// Disks.
    pub disks: Vec<Disk>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
}

/// Primitives in a space of their own that are visible through instances only: ranges of the lists of triangles, disks and
/// spheres. Primitives in no group are in world space.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PrimitiveGroup {
    /// Triangles.
    pub triangles: Range<u32>,
    /// Disks.
    pub disks: Range<u32>,
    /// Spheres.
    pub spheres: Range<u32>,
}

/// A group placed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the group.
    pub group: u32,
    /// The group's space to world space. It must be invertible.
    pub to_world: DAffine3,
}

impl Accel {
    /// Builds the BVH. Every coordinate must be finite and below 1e12 in magnitude, and every triangle must have an area.
    /// [`Scene::prepare`] drops the others.
    ///
    /// `quads` lists, in ascending order, each triangle `abc` whose successor `acd` completes a parallelogram: the two are
    /// tested as one, and a hit on either is reported for the first, with barycentric weights in its plane.
    ///
    /// [`Scene::prepare`]: crate::tracer::Scene::prepare
    pub fn new(triangles: &[[Vec3; 3]], quads: &[u32], disks: Vec<Disk>, spheres: Vec<Sphere>) -> Self {
        Self::with_instances(Shapes { triangles, quads, disks, spheres }, &[], &[])
    }

    /// As [`Accel::new`], with groups of primitives and their instances. Ids are those of the lists in `shapes`, groups
    /// included. A group's ranges contain both triangles of a parallelogram or neither.
    pub fn with_instances(shapes: Shapes, groups: &[PrimitiveGroup], instances: &[Instance]) -> Self {
        let kernel = SimdKernel::best();
        let mut arena = ArenaBuilder::default();
        let in_world =
            |of: fn(&PrimitiveGroup) -> &Range<u32>, all: usize| gaps(groups.iter().map(of), all as u32);
        let triangles = in_world(|g| &g.triangles, shapes.triangles.len());
        let disks = in_world(|g| &g.disks, shapes.disks.len());
        let spheres = in_world(|g| &g.spheres, shapes.spheres.len());
        let roots: Vec<BvhRoot> = groups
            .iter()
            .map(|g| {
                let mut input = BvhInput::default();
                input.add(&shapes, [&g.triangles, &g.disks, &g.spheres].map(from_ref));
                input.build(shapes.triangles, &mut arena)
            })
            .collect();
        let mut input = BvhInput::default();
        input.add(&shapes, [&triangles, &disks, &spheres]);
        for (index, instance) in instances.iter().enumerate() {
            let root = &roots[instance.group as usize];
            if root.root != NodeRef::END {
                input.push(Primitive::Instance(index as u32), instance_bounds(instance, root));
            }
        }
        let world = input.build(shapes.triangles, &mut arena);
        let placed = |i: &Instance| GroupInstance { group: i.group, to_group: i.to_world.inverse() };
        Accel {
            arena: arena.finish(),
            world,
            groups: roots,
            instances: instances.iter().map(placed).collect(),
            first_disk: shapes.triangles.len() as u32,
            disks: shapes.disks,
            spheres: shapes.spheres,
            kernel,
            traversal: traversals(kernel),
        }
    }

    /// Uses `kernel` from now on. Returns false, and changes nothing, if this processor does not support it.
    #[must_use]
    pub fn set_kernel(&mut self, kernel: SimdKernel) -> bool {
        let available = kernel.is_available();
        if available {
            (self.kernel, self.traversal) = (kernel, traversals(kernel));
        }
        available
    }
}

/// The parts of `0..all` that are in none of `taken`.
fn gaps<'a>(taken: impl Iterator<Item = &'a Range<u32>>, all: u32) -> Vec<Range<u32>> {
    let mut taken: Vec<_> = taken.filter(|r| !r.is_empty()).collect();
    taken.sort_unstable_by_key(|r| r.start);
    let ends = std::iter::once(0).chain(taken.iter().map(|r| r.end));
    let starts = taken.iter().map(|r| r.start).chain(std::iter::once(all));
    ends.zip(starts).map(|(from, to)| from..to).filter(|r| !r.is_empty()).collect()
}

/// The bounding box of an instance in world space. It is widened by a few roundoffs of the largest coordinate, for the
/// rounding of its corners and of rays transformed to the group's space.
fn instance_bounds(instance: &Instance, group: &BvhRoot) -> (Vec3, Vec3) {
    let (lo, hi) = (group.bounds.0.as_dvec3(), group.bounds.1.as_dvec3());
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 1 { hi[axis] } else { lo[axis] };
        let p = instance.to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
        (min, max) = (min.min(p), max.max(p));
    }
    let m = instance.to_world.matrix3;
    let stretch = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs();
    let local = lo.abs().max(hi.abs()).max_element();
    let room = (stretch * local + min.abs().max(max.abs())) * (8.0 * f64::from(UNIT_ROUNDOFF));
    ((min - room).as_vec3(), (max + room).as_vec3())
}

/// The primitives of one BVH and their bounding boxes.
#[derive(Default)]
struct BvhInput {
    primitives: Vec<Primitive>,
    refs: Vec<PrimRef>,
    bounds: Option<(Vec3, Vec3)>,
}

impl BvhInput {
    fn push(&mut self, primitive: Primitive, (lo, hi): (Vec3, Vec3)) {
        self.refs.push(PrimRef::new(lo, hi, self.primitives.len() as u32));
        self.primitives.push(primitive);
        self.bounds = Some(self.bounds.map_or((lo, hi), |(a, b)| (a.min(lo), b.max(hi))));
    }

    /// Adds the primitives of these ranges of triangles, disks and spheres.
    fn add(&mut self, shapes: &Shapes, [triangles, disks, spheres]: [&[Range<u32>]; 3]) {
        let more: usize = triangles.iter().map(|r| r.len()).sum();
        self.primitives.reserve(more);
        self.refs.reserve(more);
        for range in triangles {
            let first_quad = shapes.quads.partition_point(|&q| q < range.start);
            let mut quads = shapes.quads[first_quad..].iter().copied().peekable();
            let mut id = range.start;
            while id < range.end {
                let bounds = triangle_bounds(&shapes.triangles[id as usize]);
                if quads.next_if_eq(&id).is_some() && id + 1 < range.end {
                    let other = triangle_bounds(&shapes.triangles[id as usize + 1]);
                    self.push(Primitive::Quad(id), (bounds.0.min(other.0), bounds.1.max(other.1)));
                    id += 2;
                } else {
                    self.push(Primitive::Triangle(id), bounds);
                    id += 1;
                }
            }
        }
        let first_disk = shapes.triangles.len() as u32;
        let first_sphere = first_disk + shapes.disks.len() as u32;
        for i in disks.iter().cloned().flatten() {
            self.push(Primitive::Analytic(first_disk + i), shapes.disks[i as usize].bounds());
        }
        for i in spheres.iter().cloned().flatten() {
            self.push(Primitive::Analytic(first_sphere + i), shapes.spheres[i as usize].bounds());
        }
    }

    /// Builds the BVH and writes it to the arena.
    fn build(mut self, triangles: &[[Vec3; 3]], arena: &mut ArenaBuilder) -> BvhRoot {
        let Some(bounds) = self.bounds else { return BvhRoot::default() };
        let (bvh, plan) = self.binary_bvh();
        let root = BvhWriter { bvh: &bvh, plan: &plan, primitives: &self.primitives, triangles }.write(arena);
        BvhRoot::new(root, bounds)
    }

    /// The binary BVH and the plan of its collapse. Reinsertion is left out if it makes the BVH too deep for the stack.
    fn binary_bvh(&mut self) -> (Bvh2, CollapsePlan) {
        for optimized in [true, false] {
            let bvh = binary::build(&mut self.refs, optimized);
            if let Ok(plan) = plan(&bvh, &self.primitives) {
                return (bvh, plan);
            }
        }
        unreachable!("a BVH without reinsertion has at most 67 + log₂ 2^25 levels")
    }
}

fn triangle_bounds(t: &[Vec3; 3]) -> (Vec3, Vec3) {
    (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))
}
