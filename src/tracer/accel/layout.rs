//! The memory layout: one array of cache lines that contains nodes and leaf blocks in the order of traversal.
//!
//! Everything is eight lanes wide. A row is eight numbers of 32 bits, a line is two rows. A node takes four lines: six rows of
//! planes (`x_lo x_hi y_lo y_hi z_lo z_hi`), a row of child references and an unused row, with one lane for each child. A
//! leaf block holds up to eight polygons:
//!
//! | block | rows | lines |
//! |---|---|---|
//! | triangles with at most 16 shared vertices | x, y, z of eight vertices, and of eight more; for each corner a byte per triangle, its vertex; ids | 4 |
//! | triangles | x, y, z by triangle for each of 3 corners; ids | 5 |
//! | parallelograms | x, y, z by parallelogram for each of 4 corners; ids | 7 |
//!
//! In a mesh eight adjacent triangles have nine or ten vertices, so most blocks are of the first kind, and each vertex is
//! transformed to the space of the ray once instead of once for every triangle around it.

use bytemuck::{Pod, Zeroable};

/// Children of a node, and primitives of a block.
pub(super) const WIDTH: usize = 8;

/// One number for each lane: a row.
pub(super) type F32x8 = [f32; WIDTH];

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct CacheLine(pub(super) [F32x8; 2]);

pub(super) const NODE_LINES: usize = 4;

/// The row of a node with the child references.
pub(super) const CHILD_ROW: usize = 6;

/// Rows of a block of polygons with `corners` corners: the coordinates of each corner, then ids.
pub(super) const fn block_rows(corners: usize) -> usize {
    3 * corners + 1
}

/// Most vertices of a block of triangles with shared vertices.
pub(super) const MAX_SHARED: usize = 2 * WIDTH;

/// Rows of such a block: twice the coordinates of eight vertices, the vertices of the corners, ids.
pub(super) const SHARED_ROWS: usize = 8;

/// The row of such a block with the vertices of the corners.
pub(super) const CORNER_ROW: usize = 6;

/// A reference to a node (its first line) or to a leaf. Bit 31 marks a leaf, bits 30 to 28 hold its kind, and the other bits
/// the first line of its block, or the id or index of a primitive that is stored elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NodeRef(pub(super) u32);

const LEAF: u32 = 1 << 31;
const KIND: u32 = 7 << KIND_SHIFT;
const KIND_SHIFT: u32 = 28;

/// The content of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaf {
    /// A block of triangles with shared vertices, at this line.
    Shared(usize),
    /// A block of triangles, at this line.
    Triangles(usize),
    /// A block of parallelograms, at this line.
    Quads(usize),
    /// The disk or sphere of this primitive id.
    Analytic(u32),
    /// The instance of this index.
    Instance(u32),
}

impl NodeRef {
    /// A leaf reference that marks the end of the traversal, and an absent child.
    pub(super) const END: NodeRef = NodeRef(u32::MAX);
    /// Lines, ids and indices are smaller.
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

    /// The same reference after the lines have moved by `base` lines.
    pub(super) fn offset(self, base: u32) -> Self {
        let is_of_lines = !self.is_leaf() || (self.0 & KIND) >> KIND_SHIFT < 3;
        if is_of_lines { Self(self.0 + base) } else { self }
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

/// The memory of all nodes and blocks. Every reference in it is to a node or block that lies in it completely.
#[derive(Debug, Default)]
pub(super) struct Arena {
    lines: Vec<CacheLine>,
}

impl Arena {
    pub(super) fn new(lines: Vec<CacheLine>) -> Self {
        assert!(lines.len() < NodeRef::LIMIT, "{} lines are more than a reference can count", lines.len());
        Self { lines }
    }

    pub(super) fn lines(&self) -> &[CacheLine] {
        &self.lines
    }

    /// The first `ROWS` rows from `line` on.
    ///
    /// # Safety
    ///
    /// They must exist: a node has eight rows, a block those of its kind.
    #[inline(always)]
    pub(super) unsafe fn rows<const ROWS: usize>(&self, line: usize) -> &[F32x8; ROWS] {
        debug_assert!(line + ROWS.div_ceil(2) <= self.lines.len());
        // SAFETY: the caller ensures that the rows exist, and a line is two rows without padding.
        unsafe { &*self.lines.as_ptr().add(line).cast::<[F32x8; ROWS]>() }
    }

    /// The address of a node or block, for prefetching. For other leaves it must not be read.
    #[inline(always)]
    pub(super) fn address(&self, child: NodeRef) -> *const CacheLine {
        self.lines.as_ptr().wrapping_add(child.line())
    }
}
