//! The triangles of a scene: corners and normals of vertices that triangles share, and 32 bytes for each triangle.

use std::ops::Range;

use glam::Vec3;

use crate::memory::collect_in_huge_pages;

use super::accel::TriangleSource;
use super::primitives::{NONE, PrimRecord};
use super::shape::Triangle;

/// A triangle. Hits are incoherent, so that all of it lies in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Face {
    /// Indices of its vertices.
    corners: [u32; 3],
    /// Unit geometric normal.
    n: Vec3,
    /// Index into the surfaces, with [`SMOOTH`] if the vertices have normals.
    surface: u32,
    /// Index into the extras, or [`NONE`].
    extra: u32,
}

const _: () = assert!(size_of::<Face>() == 32);

impl Face {
    /// True if its vertices have normals.
    #[inline(always)]
    pub(super) fn is_smooth(&self) -> bool {
        self.surface & SMOOTH != 0
    }
}

/// The bit of [`Face::surface`] of a triangle with vertex normals.
const SMOOTH: u32 = 1 << 31;

/// Properties that few triangles have.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceExtra {
    /// Index into the lights, or [`NONE`].
    pub(super) light: u32,
    /// Index into the backs, or [`NONE`].
    pub(super) back: u32,
}

/// All triangles, by primitive id.
#[derive(Debug, Default)]
pub(super) struct Faces {
    list: Vec<Face>,
    /// Of vertices, by index.
    positions: Vec<Vec3>,
    /// Of vertices: by index plus the shift of the surface, modulo 2³².
    normals: Vec<Vec3>,
    /// By surface; those without normals may have none.
    shifts: Vec<u32>,
    extras: Vec<FaceExtra>,
    /// Triangles from which on the number in the file exceeds the index in the shape by another amount, in order. Nearly always empty.
    gaps: Vec<(u32, u32)>,
}

/// Vertices that were added for a shape.
#[derive(Clone, Debug)]
pub(super) struct ShapeVertices {
    /// Index of the first.
    pub(super) first: u32,
    normals: Range<usize>,
}

impl Faces {
    #[inline(always)]
    pub(super) fn get(&self, prim: u32) -> Option<&Face> {
        self.list.get(prim as usize)
    }

    #[inline(always)]
    pub(super) fn triangle(&self, face: &Face) -> Triangle {
        let [p0, p1, p2] = self.corners_of(face);
        Triangle { p0, e1: p1 - p0, e2: p2 - p0, n: face.n }
    }

    /// The triangle with this id, which must exist.
    pub(super) fn triangle_at(&self, prim: usize) -> Triangle {
        self.triangle(&self.list[prim])
    }

    #[inline(always)]
    fn corners_of(&self, face: &Face) -> [Vec3; 3] {
        face.corners.map(|v| self.positions[v as usize])
    }

    #[inline(always)]
    pub(super) fn record(&self, face: &Face) -> PrimRecord {
        let extra = match face.extra {
            NONE => FaceExtra { light: NONE, back: NONE },
            extra => self.extras[extra as usize],
        };
        PrimRecord { surface: face.surface & !SMOOTH, light: extra.light, back: extra.back }
    }

    /// The number of a triangle in the file of its shape. Shapes are added one after the other.
    pub(super) fn number(&self, prim: u32) -> Option<u32> {
        let surface = |face: &Face| face.surface & !SMOOTH;
        let own = surface(self.get(prim)?);
        let first = self.list.partition_point(|face| surface(face) < own) as u32;
        let before = &self.gaps[..self.gaps.partition_point(|gap| gap.0 <= prim)];
        let gap = before.last().filter(|gap| gap.0 >= first).map_or(0, |gap| gap.1);
        Some(prim - first + gap)
    }

    /// Gives the last triangle its number in the file of its shape, whose first triangle is `first`.
    pub(super) fn number_last(&mut self, first: usize, number: u32) {
        let last = self.list.len() - 1;
        let gap = number.saturating_sub((last - first) as u32);
        let known = self.gaps.last().filter(|known| known.0 as usize >= first).map_or(0, |known| known.1);
        if gap != known {
            self.gaps.push((last as u32, gap));
        }
    }

    /// The shading normal of a smooth triangle at a point with these barycentric weights; `None` where it is 0.
    #[inline(always)]
    pub(super) fn shading_normal(&self, face: &Face, uv: [f32; 2]) -> Option<Vec3> {
        let shift = self.shifts[(face.surface & !SMOOTH) as usize];
        let [a, b, c] = face.corners.map(|v| self.normals[v.wrapping_add(shift) as usize]);
        (a * (1.0 - uv[0] - uv[1]) + b * uv[0] + c * uv[1]).try_normalize()
    }

    /// Adds vertices of the shape `surface`, with a normal each or none.
    pub(super) fn add_vertices(
        &mut self,
        surface: u32,
        positions: impl IntoIterator<Item = Vec3>,
        normals: impl IntoIterator<Item = Vec3>,
    ) -> ShapeVertices {
        let (first, before) = (self.positions.len() as u32, self.normals.len());
        self.positions.extend(positions);
        self.normals.extend(normals);
        if self.normals.len() > before {
            self.shifts.resize(surface as usize + 1, 0);
            self.shifts[surface as usize] = (before as u32).wrapping_sub(first);
        }
        ShapeVertices { first, normals: before..self.normals.len() }
    }

    /// The position of a vertex.
    pub(super) fn position(&self, vertex: u32) -> Option<Vec3> {
        self.positions.get(vertex as usize).copied()
    }

    /// The normal of a vertex of a shape, if it has one.
    pub(super) fn normal(&self, of: &ShapeVertices, vertex: u32) -> Option<Vec3> {
        let i = of.normals.start + (vertex.checked_sub(of.first)?) as usize;
        self.normals.get(i).filter(|_| i < of.normals.end).copied()
    }

    /// Adds a triangle of vertices that were added, with its unit normal.
    pub(super) fn push(&mut self, corners: [u32; 3], n: Vec3, surface: u32, smooth: bool) {
        let surface = surface | if smooth { SMOOTH } else { 0 };
        self.list.push(Face { corners, n, surface, extra: NONE });
    }

    /// Light and back of the triangle `prim`, to be changed.
    pub(super) fn extra_mut(&mut self, prim: usize) -> &mut FaceExtra {
        let face = &mut self.list[prim];
        if face.extra == NONE {
            face.extra = self.extras.len() as u32;
            self.extras.push(FaceExtra { light: NONE, back: NONE });
        }
        &mut self.extras[face.extra as usize]
    }

    /// The vertices of the last triangle.
    pub(super) fn last_corners(&self) -> Option<[u32; 3]> {
        self.list.last().map(|face| face.corners)
    }

    /// Moves what rays read into huge pages, where the system provides them.
    pub(super) fn into_huge_pages(mut self) -> Self {
        self.list = collect_in_huge_pages(self.list.into_iter());
        self.positions = collect_in_huge_pages(self.positions.into_iter());
        self.normals = collect_in_huge_pages(self.normals.into_iter());
        self
    }
}

impl TriangleSource for Faces {
    #[inline(always)]
    fn count(&self) -> usize {
        self.list.len()
    }

    fn corners(&self, id: usize) -> [Vec3; 3] {
        self.corners_of(&self.list[id])
    }
}
