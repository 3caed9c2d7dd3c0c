//! Building: boxes, the binary tree, the plan, the lines.

use std::ops::Range;
use std::slice::from_ref;

use glam::{DVec3, Vec3};
use obvhs::bvh2::Bvh2;

use crate::math::float::UNIT_ROUNDOFF;
use crate::tracer::shape::{Disk, Sphere};

use super::binary::{self, Bounded};
use super::collapse::Source;
use super::dispatch::Kernel;
use super::draft::Draft;
use super::kernels::Walks;
use super::layout::Child;
use super::plan::{Item, Plan, plan};
use super::tree::{Part, Placed, Tree};
use super::{Accel, Group, Instance};

/// What an accelerator is built over.
pub(super) struct Shapes<'a> {
    pub(super) triangles: &'a [[Vec3; 3]],
    pub(super) quads: &'a [u32],
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
}

pub(super) fn build(shapes: Shapes, groups: &[Group], instances: &[Instance]) -> Accel {
    let (kernel, mut draft) = (Kernel::best(), Draft::default());
    let outside = |of: fn(&Group) -> &Range<u32>, all: usize| gaps(groups.iter().map(of), all as u32);
    let triangles = outside(|g| &g.triangles, shapes.triangles.len());
    let disks = outside(|g| &g.disks, shapes.disks.len());
    let spheres = outside(|g| &g.spheres, shapes.spheres.len());
    let parts: Vec<Part> = groups
        .iter()
        .map(|g| {
            let mut boxes = Boxes::default();
            boxes.add(&shapes, [&g.triangles, &g.disks, &g.spheres].map(from_ref));
            boxes.build(shapes.triangles, &mut draft)
        })
        .collect();
    let mut boxes = Boxes::default();
    boxes.add(&shapes, [&triangles, &disks, &spheres]);
    for (index, instance) in instances.iter().enumerate() {
        let part = &parts[instance.group as usize];
        if part.root != Child::END {
            boxes.push(Item::Instance(index as u32), placed_bounds(instance, part));
        }
    }
    let world = boxes.build(shapes.triangles, &mut draft);
    let placed = |i: &Instance| Placed { group: i.group, to_group: i.to_world.inverse() };
    let tree = Tree {
        arena: draft.finish(),
        world,
        groups: parts,
        instances: instances.iter().map(placed).collect(),
        first_disk: shapes.triangles.len() as u32,
        disks: shapes.disks,
        spheres: shapes.spheres,
        walks: Walks::of(kernel),
    };
    Accel { tree, kernel }
}

/// The parts of `0..all` that are in none of `taken`.
fn gaps<'a>(taken: impl Iterator<Item = &'a Range<u32>>, all: u32) -> Vec<Range<u32>> {
    let mut taken: Vec<_> = taken.filter(|r| !r.is_empty()).collect();
    taken.sort_unstable_by_key(|r| r.start);
    let ends = std::iter::once(0).chain(taken.iter().map(|r| r.end));
    let starts = taken.iter().map(|r| r.start).chain(std::iter::once(all));
    ends.zip(starts).map(|(from, to)| from..to).filter(|r| !r.is_empty()).collect()
}

/// The box around a group at its place, wide enough for the rounding of the box's corners and of the rays seen from the
/// group: a few roundoffs of the largest coordinate.
fn placed_bounds(instance: &Instance, part: &Part) -> (Vec3, Vec3) {
    let (lo, hi) = (part.bounds.0.as_dvec3(), part.bounds.1.as_dvec3());
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

/// Primitives on their way into a tree.
#[derive(Default)]
struct Boxes {
    items: Vec<Item>,
    boxes: Vec<Bounded>,
    bounds: Option<(Vec3, Vec3)>,
}

impl Boxes {
    fn push(&mut self, item: Item, (lo, hi): (Vec3, Vec3)) {
        self.boxes.push(Bounded::new((lo, hi), self.items.len() as u32));
        self.items.push(item);
        self.bounds = Some(self.bounds.map_or((lo, hi), |(a, b)| (a.min(lo), b.max(hi))));
    }

    /// Adds the primitives of these ranges of triangles, disks and spheres.
    fn add(&mut self, shapes: &Shapes, [triangles, disks, spheres]: [&[Range<u32>]; 3]) {
        let more: usize = triangles.iter().map(|r| r.len()).sum();
        self.items.reserve(more);
        self.boxes.reserve(more);
        for range in triangles {
            let first_quad = shapes.quads.partition_point(|&q| q < range.start);
            let mut quads = shapes.quads[first_quad..].iter().copied().peekable();
            let mut id = range.start;
            while id < range.end {
                let bounds = corners(&shapes.triangles[id as usize]);
                if quads.next_if_eq(&id).is_some() && id + 1 < range.end {
                    let other = corners(&shapes.triangles[id as usize + 1]);
                    self.push(Item::Quad(id), (bounds.0.min(other.0), bounds.1.max(other.1)));
                    id += 2;
                } else {
                    self.push(Item::Triangle(id), bounds);
                    id += 1;
                }
            }
        }
        let first_disk = shapes.triangles.len() as u32;
        let first_sphere = first_disk + shapes.disks.len() as u32;
        for i in disks.iter().cloned().flatten() {
            self.push(Item::Analytic(first_disk + i), shapes.disks[i as usize].bounds());
        }
        for i in spheres.iter().cloned().flatten() {
            self.push(Item::Analytic(first_sphere + i), shapes.spheres[i as usize].bounds());
        }
    }

    /// Builds the tree and writes it.
    fn build(mut self, triangles: &[[Vec3; 3]], draft: &mut Draft) -> Part {
        let Some(bounds) = self.bounds else { return Part::default() };
        let (bvh, plan) = self.planned();
        let root = Source { bvh: &bvh, plan: &plan, items: &self.items, triangles }.write(draft);
        Part::new(root, bounds)
    }

    /// The tree and its plan; without what makes it better where that makes it too deep to be walked.
    fn planned(&mut self) -> (Bvh2, Plan) {
        for optimized in [true, false] {
            let bvh = binary::build(&mut self.boxes, optimized);
            if let Ok(plan) = plan(&bvh, &self.items) {
                return (bvh, plan);
            }
        }
        unreachable!("a tree that was not optimised has at most 67 + log₂ 2^25 levels")
    }
}

fn corners(t: &[Vec3; 3]) -> (Vec3, Vec3) {
    (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))
}
