//! Building the accelerator: bounding boxes of the primitives, then a BVH for each group and for the world.

use std::ops::Range;
use std::slice::from_ref;

use glam::{DVec3, Vec3};

use crate::math::float::UNIT_ROUNDOFF;
use crate::tracer::shape::{Cylinder, Disk, Sphere};

use super::binary::{self, PrimRef};
use super::bvh::{Accel, BvhRoot, GroupInstance};
use super::collapse::{Primitive, plan};
use super::kernels::traversals;
use super::layout::{Arena, NodeRef};
use super::shapes::{Instance, PrimitiveGroup, Shapes, TriangleSource};
use super::simd_kernel::{AvailableKernel, SimdKernel};
use super::write::{ArenaBuilder, BvhWriter};

impl Accel {
    /// Builds the BVH over `shapes`, some of them in `groups`, which `instances` show. Ids are those of the lists in `shapes`, groups
    /// included. A group's ranges contain both triangles of a parallelogram or neither.
    ///
    /// Every coordinate must be finite and below 1e12 in magnitude, and every triangle must have an area.
    /// [`Scene::prepare`](crate::tracer::Scene::prepare) drops the others.
    pub fn new(shapes: Shapes, groups: &[PrimitiveGroup], instances: &[Instance]) -> Self {
        let kernel = AvailableKernel::best();
        let mut arena = ArenaBuilder::default();
        let root = |group: &PrimitiveGroup| {
            let PrimitiveGroup { triangles, disks, spheres, cylinders, curves } = group;
            let round = [disks, spheres, cylinders, curves].map(from_ref);
            let input = BvhInput::new(&shapes, from_ref(triangles), round);
            input.build(shapes.triangles, &mut arena)
        };
        let roots: Vec<BvhRoot> = groups.iter().map(root).collect();
        let triangles = gaps(groups.iter().map(|g| &g.triangles), shapes.triangles.count());
        let disks = gaps(groups.iter().map(|g| &g.disks), shapes.disks.len());
        let spheres = gaps(groups.iter().map(|g| &g.spheres), shapes.spheres.len());
        let cylinders = gaps(groups.iter().map(|g| &g.cylinders), shapes.cylinders.len());
        let curves = gaps(groups.iter().map(|g| &g.curves), shapes.curves.len());
        let mut input = BvhInput::new(&shapes, &triangles, [&disks, &spheres, &cylinders, &curves]);
        for (index, instance) in instances.iter().enumerate() {
            let root = &roots[instance.group as usize];
            if root.root != NodeRef::END {
                let (lo, hi) = instance_bounds(instance, root);
                input.push(Primitive::Instance(index as u32), lo, hi);
            }
        }
        let world = input.build(shapes.triangles, &mut arena);
        Accel {
            growth: arena.growth(),
            quads: shapes.quads.into(),
            ranges: groups.into(),
            arena: Arena::new(arena.lines),
            world,
            groups: roots,
            instances: instances.iter().map(placed).collect(),
            first_disk: shapes.triangles.count() as u32,
            disks: shapes.disks,
            spheres: shapes.spheres,
            cylinders: shapes.cylinders,
            curves: shapes.curves,
            kernel,
            traversal: traversals(kernel),
        }
    }

    /// Uses `kernel` from now on. Returns false, and changes nothing, if this processor does not support it.
    #[must_use]
    pub fn set_kernel(&mut self, kernel: SimdKernel) -> bool {
        let available = kernel.available();
        if let Some(kernel) = available {
            (self.kernel, self.traversal) = (kernel, traversals(kernel));
        }
        available.is_some()
    }
}

/// An instance for the traversal.
pub(super) fn placed(instance: &Instance) -> GroupInstance {
    GroupInstance { group: instance.group, to_group: instance.to_world.inverse() }
}

/// The parts of `0..all` that are in none of `taken`.
fn gaps<'a>(taken: impl Iterator<Item = &'a Range<u32>>, all: usize) -> Vec<Range<u32>> {
    let mut taken: Vec<_> = taken.filter(|r| !r.is_empty()).collect();
    taken.sort_unstable_by_key(|r| r.start);
    let ends = std::iter::once(0).chain(taken.iter().map(|r| r.end));
    let starts = taken.iter().map(|r| r.start).chain(std::iter::once(all as u32));
    ends.zip(starts).map(|(from, to)| from..to).filter(|r| !r.is_empty()).collect()
}

/// The bounding box of an instance in world space. It is widened by a few roundoffs of the largest coordinate, for the
/// rounding of its corners and of rays transformed to the group's space.
pub(super) fn instance_bounds(instance: &Instance, group: &BvhRoot) -> (Vec3, Vec3) {
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
struct BvhInput {
    primitives: Vec<Primitive>,
    refs: Vec<PrimRef>,
    bounds: Option<(Vec3, Vec3)>,
}

impl BvhInput {
    fn push(&mut self, primitive: Primitive, lo: Vec3, hi: Vec3) {
        self.refs.push(PrimRef::new(lo, hi, self.primitives.len() as u32));
        self.primitives.push(primitive);
        self.bounds = Some(self.bounds.map_or((lo, hi), |(a, b)| (a.min(lo), b.max(hi))));
    }

    /// The primitives of these ranges of triangles, and of disks, spheres, cylinders and curves.
    fn new(shapes: &Shapes, triangles: &[Range<u32>], round: [&[Range<u32>]; 4]) -> Self {
        let [disks, spheres, cylinders, curves] = round;
        let count: usize = triangles.iter().map(|r| r.len()).sum();
        let (primitives, refs) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut input = Self { primitives, refs, bounds: None };
        for range in triangles {
            let first_quad = shapes.quads.partition_point(|&q| q < range.start);
            let mut quads = shapes.quads[first_quad..].iter().copied().peekable();
            let mut id = range.start;
            while id < range.end {
                let (lo, hi) = triangle_bounds(shapes.triangles.corners(id as usize));
                if quads.next_if_eq(&id).is_some() && id + 1 < range.end {
                    let other = triangle_bounds(shapes.triangles.corners(id as usize + 1));
                    input.push(Primitive::Quad(id), lo.min(other.0), hi.max(other.1));
                    id += 2;
                } else {
                    input.push(Primitive::Triangle(id), lo, hi);
                    id += 1;
                }
            }
        }
        let counts = [shapes.disks.len(), shapes.spheres.len(), shapes.cylinders.len()];
        let mut first = shapes.triangles.count() as u32;
        for (ranges, count) in
            [disks, spheres, cylinders, curves].into_iter().zip(counts.into_iter().chain([0]))
        {
            for prim in ranges.iter().cloned().flatten().map(|i| first + i) {
                let (lo, hi) = analytic_bounds(shapes, prim);
                input.push(Primitive::Analytic(prim), lo, hi);
            }
            first += count as u32;
        }
        input
    }

    /// Builds the BVH and writes it to the arena. Reinsertion is left out if it makes the BVH too deep for the stack.
    fn build(mut self, triangles: &dyn TriangleSource, arena: &mut ArenaBuilder) -> BvhRoot {
        let Some(bounds) = self.bounds else { return BvhRoot::default() };
        let planned = [true, false].into_iter().find_map(|optimized| {
            let bvh = binary::build(&mut self.refs, optimized);
            plan(&bvh, &self.primitives).ok().map(|plan| (bvh, plan))
        });
        let (bvh, plan) = planned.expect("a BVH without reinsertion has at most 67 + log₂ 2^25 levels");
        drop(self.refs);
        let root = BvhWriter { bvh: &bvh, plan: &plan, primitives: &self.primitives, triangles }.write(arena);
        BvhRoot::new(root, bounds)
    }
}

/// The box around a disk, sphere, cylinder or piece of a curve, by its primitive id.
pub(super) fn analytic_bounds(shapes: &Shapes, prim: u32) -> (Vec3, Vec3) {
    let Shapes { disks, spheres, cylinders, curves, .. } = shapes;
    let disk = prim as usize - shapes.triangles.count();
    let sphere = disk.wrapping_sub(disks.len());
    let cylinder = sphere.wrapping_sub(spheres.len());
    let of_disk = disks.get(disk).map(Disk::bounds);
    let of_sphere = || spheres.get(sphere).map(Sphere::bounds);
    let of_cylinder = || cylinders.get(cylinder).map(Cylinder::bounds);
    let bounds = of_disk.or_else(of_sphere).or_else(of_cylinder);
    bounds.unwrap_or_else(|| curves[cylinder.wrapping_sub(cylinders.len())].bounds())
}

pub(super) fn triangle_bounds(t: [Vec3; 3]) -> (Vec3, Vec3) {
    (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))
}
