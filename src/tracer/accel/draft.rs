//! Writing nodes and blocks.

use glam::Vec3;

use super::layout::{
    Arena, CHILDREN, Child, Leaf, Line, MAX_SHARED, NODE_LINES, NUMBERS, Row, SHARED_ROWS, WIDTH, block_rows,
};
use super::pages::ask_for_large_pages;

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
        self.lines.reserve(others.iter().map(|(draft, _)| draft.lines.len()).sum());
        ask_for_large_pages(self.lines.spare_capacity_mut());
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
        Arena::new(self.lines)
    }
}

fn put_ids(row: &mut Row, ids: impl Iterator<Item = u32>) {
    *row = [f32::from_bits(u32::MAX); WIDTH];
    for (lane, id) in row.iter_mut().zip(ids) {
        *lane = f32::from_bits(id);
    }
}
