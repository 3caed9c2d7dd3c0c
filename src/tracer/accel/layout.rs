//! How the tree lies in memory: one run of cache lines, nodes and blocks of primitives as a walk meets them.
//!
//! Everything is eight wide; a row is eight numbers of 32 bits. A node takes four lines: six rows of planes (`x_lo x_hi y_lo y_hi
//! z_lo z_hi`), a row of references, a row left free, with a lane for each child. A block holds up to eight polygons:
//!
//! | block | rows | lines |
//! |---|---|---|
//! | of triangles that share vertices, at most 16 | x, y, z of eight, of eight more; a byte per triangle for each corner, the vertex's number; ids | 4 |
//! | of triangles | x, y, z by triangle for each of 3 corners; ids | 5 |
//! | of parallelograms | x, y, z by parallelogram for each of 4 corners; ids | 7 |
//!
//! In a mesh eight neighbours have nine or ten vertices, so most blocks are of the first kind, and a vertex is put into the
//! space of the ray once instead of once for every triangle around it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Children of a node, primitives of a block.
pub(super) const WIDTH: usize = 8;

/// One number for each lane.
pub(super) type Row = [f32; WIDTH];

/// A cache line.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Line(pub(super) [Row; 2]);

/// Lines of a node.
pub(super) const NODE_LINES: usize = 4;

/// The row of a node that holds the references.
pub(super) const CHILDREN: usize = 6;

/// Rows of a block of polygons of `N` corners: corners by axis, then ids.
pub(super) const fn block_rows(corners: usize) -> usize {
    3 * corners + 1
}

/// Most vertices of a block that shares them.
pub(super) const MAX_SHARED: usize = 2 * WIDTH;

/// Rows of a block that shares vertices: two times eight vertices by axis, numbers of corners, ids.
pub(super) const SHARED_ROWS: usize = 8;

/// The row of a block that shares vertices that holds the numbers of corners.
pub(super) const NUMBERS: usize = 6;

/// A reference to a node (its first line) or to a leaf: bit 31 marks a leaf, bits 30 to 28 its kind, and the rest is the
/// first line of its block, or the index of what stands elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

const LEAF: u32 = 1 << 31;
const KIND: u32 = 7 << KIND_SHIFT;
const KIND_SHIFT: u32 = 28;

/// What a leaf holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaf {
    /// A block of triangles that share vertices, at this line.
    Shared(usize),
    /// A block of triangles.
    Triangles(usize),
    /// A block of parallelograms.
    Quads(usize),
    /// The disk or sphere of this primitive id.
    Analytic(u32),
    /// The instance of this index.
    Instance(u32),
}

impl Child {
    /// Instead of a leaf: nothing is left to visit.
    pub(super) const END: Child = Child(u32::MAX);
    /// Lines, ids and indices stay below.
    pub(super) const LIMIT: usize = 1 << KIND_SHIFT;

    pub(super) fn to_node(line: usize) -> Self {
        debug_assert!(line < Self::LIMIT);
        Self(line as u32)
    }

    pub(super) fn to_leaf(leaf: Leaf) -> Self {
        let (kind, rest) = match leaf {
            Leaf::Shared(line) => (0, line as u32),
            Leaf::Triangles(line) => (1, line as u32),
            Leaf::Quads(line) => (2, line as u32),
            Leaf::Analytic(prim) => (3, prim),
            Leaf::Instance(index) => (4, index),
        };
        debug_assert!((rest as usize) < Self::LIMIT);
        Self(LEAF | kind << KIND_SHIFT | rest)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    /// The first line of a node or block.
    #[inline(always)]
    pub(super) fn line(self) -> usize {
        (self.0 & !(LEAF | KIND)) as usize
    }

    /// True when it refers to lines.
    fn is_of_lines(self) -> bool {
        !self.is_leaf() || (self.0 & KIND) >> KIND_SHIFT < 3
    }

    #[inline(always)]
    pub(super) fn leaf(self) -> Leaf {
        match (self.0 & KIND) >> KIND_SHIFT {
            0 => Leaf::Shared(self.line()),
            1 => Leaf::Triangles(self.line()),
            2 => Leaf::Quads(self.line()),
            3 => Leaf::Analytic(self.line() as u32),
            _ => Leaf::Instance(self.line() as u32),
        }
    }
}

/// The lines of a tree. References in them are to nodes and blocks that lie in them whole.
#[derive(Debug, Default)]
pub(super) struct Arena {
    lines: Vec<Line>,
}

impl Arena {
    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// `ROWS` rows from the first of `line`.
    #[inline(always)]
    pub(super) fn rows<const ROWS: usize>(&self, line: usize) -> &[Row; ROWS] {
        debug_assert!(line + ROWS.div_ceil(2) <= self.lines.len());
        // SAFETY: references are made by `Draft` alone, with the line where it wrote a node or block of this many rows,
        // and neither lines nor references change afterwards; a line is two rows without padding.
        unsafe { &*self.lines.as_ptr().add(line).cast::<[Row; ROWS]>() }
    }

    /// Where a node or block begins; for what is neither, an address not to be read.
    #[inline(always)]
    pub(super) fn address(&self, child: Child) -> *const Line {
        self.lines.as_ptr().wrapping_add(child.line())
    }
}

/// Lines as they are written: references count from the first of them.
#[derive(Default)]
pub(super) struct Draft {
    lines: Vec<Line>,
    /// Where nodes begin.
    nodes: Vec<u32>,
}

impl Draft {
    /// Makes room for a node, to be filled by [`Draft::fill`]; returns its line.
    pub(super) fn node(&mut self) -> usize {
        let line = self.lines.len();
        self.nodes.push(line as u32);
        self.add(2 * NODE_LINES);
        line
    }

    /// Writes the node at `line`. Lanes without a child are inside out.
    pub(super) fn fill(&mut self, line: usize, children: &[(Vec3, Vec3, Child)]) {
        let rows: &mut [Row] = bytemuck::cast_slice_mut(&mut self.lines[line..line + NODE_LINES]);
        for axis in 0..3 {
            rows[2 * axis] = [f32::INFINITY; WIDTH];
            rows[2 * axis + 1] = [f32::NEG_INFINITY; WIDTH];
        }
        rows[CHILDREN] = [f32::from_bits(Child::END.0); WIDTH];
        for (lane, (lo, hi, child)) in children.iter().enumerate() {
            for axis in 0..3 {
                rows[2 * axis][lane] = lo[axis];
                rows[2 * axis + 1][lane] = hi[axis];
            }
            rows[CHILDREN][lane] = f32::from_bits(child.0);
        }
    }

    /// Changes one child of the node at `line`.
    pub(super) fn set_child(&mut self, line: usize, lane: usize, child: Child) {
        self.lines[line + CHILDREN / 2].0[CHILDREN % 2][lane] = f32::from_bits(child.0);
    }

    /// Writes a block of at most eight triangles and their ids, the smallest that holds them.
    pub(super) fn triangles(&mut self, triangles: &[([Vec3; 3], u32)]) -> Leaf {
        let mut vertices: Vec<Vec3> = Vec::with_capacity(3 * WIDTH);
        let mut numbers = [[0u8; WIDTH]; 3];
        for (lane, (corners, _)) in triangles.iter().enumerate() {
            for (numbers, p) in numbers.iter_mut().zip(corners) {
                // The same bits: 0 and −0 differ where a product would show it.
                let known = vertices.iter().position(|v| bytemuck::bytes_of(v) == bytemuck::bytes_of(p));
                numbers[lane] = known.unwrap_or(vertices.len()) as u8;
                if known.is_none() {
                    vertices.push(*p);
                }
            }
        }
        if vertices.len() > MAX_SHARED {
            return Leaf::Triangles(self.polygons(triangles));
        }
        let line = self.lines.len();
        let rows = self.add(SHARED_ROWS);
        for (i, v) in vertices.iter().enumerate() {
            for axis in 0..3 {
                rows[i / WIDTH * 3 + axis][i % WIDTH] = v[axis];
            }
        }
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut rows[NUMBERS]);
        bytes[..3 * WIDTH].copy_from_slice(numbers.as_flattened());
        put_ids(&mut rows[NUMBERS + 1], triangles.iter().map(|t| t.1));
        Leaf::Shared(line)
    }

    /// Writes a block of at most eight polygons and their ids. Empty lanes are points, never hit.
    pub(super) fn polygons<const N: usize>(&mut self, polygons: &[([Vec3; N], u32)]) -> usize {
        let line = self.lines.len();
        let rows = self.add(block_rows(N));
        for (lane, (corners, _)) in polygons.iter().enumerate() {
            for (vertex, corner) in corners.iter().enumerate() {
                for axis in 0..3 {
                    rows[3 * vertex + axis][lane] = corner[axis];
                }
            }
        }
        put_ids(&mut rows[3 * N], polygons.iter().map(|p| p.1));
        line
    }

    fn add(&mut self, rows: usize) -> &mut [Row] {
        let line = self.lines.len();
        self.lines.resize(line + rows.div_ceil(2), Line::default());
        bytemuck::cast_slice_mut(&mut self.lines[line..])
    }

    /// Puts `others` behind, each with its root; returns the roots as they are called here.
    pub(super) fn append(&mut self, others: Vec<(Draft, Child)>) -> Vec<Child> {
        self.lines.reserve_exact(others.iter().map(|(draft, _)| draft.lines.len()).sum());
        others
            .into_iter()
            .map(|(draft, root)| {
                let base = self.lines.len() as u32;
                self.lines.extend_from_slice(&draft.lines);
                for line in draft.nodes.iter().map(|n| n + base) {
                    for child in &mut self.lines[line as usize + CHILDREN / 2].0[CHILDREN % 2] {
                        *child = f32::from_bits(Child(child.to_bits()).moved(base).0);
                    }
                }
                self.nodes.extend(draft.nodes.iter().map(|n| n + base));
                root.moved(base)
            })
            .collect()
    }

    pub(super) fn finish(self) -> Arena {
        assert!(self.lines.len() < Child::LIMIT, "{} lines are more than a reference can count", self.lines.len());
        Arena { lines: self.lines }
    }
}

impl Child {
    fn moved(self, base: u32) -> Self {
        if self.is_of_lines() { Self(self.0 + base) } else { self }
    }
}

fn put_ids(row: &mut Row, ids: impl Iterator<Item = u32>) {
    *row = [f32::from_bits(u32::MAX); WIDTH];
    for (lane, id) in row.iter_mut().zip(ids) {
        *lane = f32::from_bits(id);
    }
}
