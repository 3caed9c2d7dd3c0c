//! Opacity of vertices under `alphaMode` `MASK` (specification 2.0, §3.9.2): what is below the cutoff is not there.
//!
//! Opacity is linear within a triangle, so the part that stays is the triangle cut along a straight line. This is exact, where a
//! material could only blend.

use std::collections::BTreeMap;

use super::buffers::Buffers;

/// The vertices of a primitive; what is empty is not there.
pub(super) struct CutVertices<'v> {
    pub(super) positions: &'v mut Vec<[f32; 3]>,
    pub(super) normals: &'v mut Vec<[f32; 3]>,
    pub(super) uvs: &'v mut Vec<[f32; 2]>,
    pub(super) colors: &'v mut Vec<[f32; 3]>,
}

/// Appends the point between two entries, `t` of the way.
fn extend<const N: usize>(all: &mut Vec<[f32; N]>, [a, b]: [usize; 2], t: f32) {
    if let (Some(a), Some(b)) = (all.get(a).copied(), all.get(b).copied()) {
        all.push(std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t));
    }
}

impl CutVertices<'_> {
    /// The parts of `triangles` whose opacity is at least `cutoff`; corners that this needs are appended. `opacities`: one for each
    /// vertex. Corners that do not exist are left to the reader of the mesh.
    ///
    /// # Errors
    ///
    /// The parts need more memory than the model may have.
    pub(super) fn cut(
        &mut self,
        triangles: &[[u32; 3]],
        opacities: &[f32],
        cutoff: f32,
        buffers: &mut Buffers<'_>,
    ) -> Result<Vec<[u32; 3]>, String> {
        // The larger of zero and no number is zero.
        let height = |corner: u32| opacities.get(corner as usize).map_or(0.0, |v| v.max(0.0) - cutoff);
        // Triangles on both sides of an edge share the corner on it.
        let mut corners = BTreeMap::new();
        let mut kept = Vec::with_capacity(triangles.len());
        for triangle in triangles {
            let mut part = Vec::with_capacity(4);
            for (i, &a) in triangle.iter().enumerate() {
                let b = triangle[(i + 1) % 3];
                if height(a) >= 0.0 {
                    part.push(a);
                }
                if (height(a) >= 0.0) != (height(b) >= 0.0) {
                    let edge = [a.min(b), a.max(b)];
                    let next = self.positions.len() as u32;
                    let corner = *corners.entry(edge).or_insert(next);
                    if corner == next {
                        self.add(
                            edge.map(|v| v as usize),
                            height(edge[0]) / (height(edge[0]) - height(edge[1])),
                        );
                    }
                    part.push(corner);
                }
            }
            if let [first, rest @ ..] = part.as_slice() {
                kept.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            }
        }
        // A corner and its entry in the map.
        buffers.spend(corners.len() * (size_of::<[f32; 11]>() + 2 * size_of::<[u32; 3]>()))?;
        Ok(kept)
    }

    fn add(&mut self, edge: [usize; 2], t: f32) {
        extend(self.positions, edge, t);
        extend(self.normals, edge, t);
        extend(self.uvs, edge, t);
        extend(self.colors, edge, t);
    }
}
