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

    /// The same when the lines have moved behind `base` others.
    pub(super) fn moved(self, base: u32) -> Self {
        if self.is_of_lines() { Self(self.0 + base) } else { self }
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
    pub(super) fn new(lines: Vec<Line>) -> Self {
        assert!(lines.len() < Child::LIMIT, "{} lines are more than a reference can count", lines.len());
        Self { lines }
    }

    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// `ROWS` rows from the first of `line`.
    ///
    /// # Safety
    ///
    /// There must be so many: a node has eight, a block those of its kind.
    #[inline(always)]
    pub(super) unsafe fn rows<const ROWS: usize>(&self, line: usize) -> &[Row; ROWS] {
        debug_assert!(line + ROWS.div_ceil(2) <= self.lines.len());
        // SAFETY: the caller's; a line is two rows without padding.
        unsafe { &*self.lines.as_ptr().add(line).cast::<[Row; ROWS]>() }
    }

    /// Where a node or block begins; for what is neither, an address not to be read.
    #[inline(always)]
    pub(super) fn address(&self, child: Child) -> *const Line {
        self.lines.as_ptr().wrapping_add(child.line())
    }
}
