//! Faults of a mesh that only its numbers show: vertices that are not numbers, triangles without area.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::file::{Count, MISSING_UV};
use crate::scene::desc::{Mesh, MeshAttribute};

/// Numbers of dropped and repaired elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Repairs {
    /// Triangles with a vertex that is not finite.
    pub(super) not_finite: Count,
    /// Triangles without area.
    pub(super) flat: Count,
    /// Texture coordinates that are not finite, set to 0.
    pub(super) bad_uvs: usize,
    /// Vertices without texture coordinates in a file that has some, set to 0.
    pub(super) missing_uvs: usize,
    /// Numbers of attributes that are not finite, set to 0.
    pub(super) bad_attributes: usize,
}

/// Drops triangles that cannot be traced and vertices that nothing uses. `line_of` gives the line of
/// a triangle by its index in the file; it may be slow, and is asked for the first fault of a kind only.
pub(super) fn repair(mesh: &mut Mesh, line_of: impl Fn(usize) -> usize) -> Repairs {
    let mut repairs = Repairs::default();
    let fault = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        if !corners.iter().all(|p| p.is_finite()) { Some(true) } else { is_flat(corners).then_some(false) }
    };
    let (mut attributes, mut rows) = (std::mem::take(&mut mesh.attributes), Vec::new());
    // Most meshes have no fault, and several threads look for one.
    if mesh.triangles.par_iter().any(|triangle| fault(triangle).is_some()) {
        let mut kept = Vec::with_capacity(mesh.triangles.len());
        rows.reserve_exact(mesh.triangles.len());
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            match fault(triangle) {
                Some(true) => repairs.not_finite.add(|| line_of(i)),
                Some(false) => repairs.flat.add(|| line_of(i)),
                None => {
                    kept.push(*triangle);
                    rows.push(i as u32);
                }
            }
        }
        mesh.triangles = kept;
        attributes.iter_mut().filter(|a| a.is_of_faces()).for_each(|a| gather_rows(a, &rows));
        mesh.numbers = rows;
    }
    for value in attributes.iter_mut().flat_map(|attribute| &mut attribute.values).filter(|v| !v.is_finite())
    {
        *value = 0.0;
        repairs.bad_attributes += 1;
    }
    mesh.attributes = attributes;
    compact(mesh);
    for uv in mesh.uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *if *uv == MISSING_UV { &mut repairs.missing_uvs } else { &mut repairs.bad_uvs } += 1;
        *uv = Vec2::ZERO;
    }
    repairs
}

/// True when twice the area is no normal number of single precision: nothing can be divided by it.
fn is_flat(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let twice_area = (b - a).cross(c - a).length();
    !(twice_area as f32).is_normal()
}

/// Removes vertices that no triangle uses.
fn compact(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    if used.iter().all(|u| *u) {
        return;
    }
    const UNUSED: u32 = u32::MAX;
    let mut new_index = vec![UNUSED; mesh.positions.len()];
    let mut order: Vec<u32> = Vec::with_capacity(mesh.positions.len());
    for v in mesh.triangles.iter_mut().flatten() {
        let slot = &mut new_index[*v as usize];
        if *slot == UNUSED {
            *slot = order.len() as u32;
            order.push(*v);
        }
        *v = *slot;
    }
    mesh.positions = gather(&mesh.positions, &order);
    mesh.normals = gather(&mesh.normals, &order);
    mesh.uvs = gather(&mesh.uvs, &order);
    mesh.attributes.iter_mut().filter(|a| !a.is_of_faces()).for_each(|a| gather_rows(a, &order));
}

/// Keeps these rows of an attribute.
fn gather_rows(attribute: &mut MeshAttribute, order: &[u32]) {
    let MeshAttribute { channels, values, .. } = attribute;
    *values = order.iter().flat_map(|&i| &values[i as usize * *channels..][..*channels]).copied().collect();
}

/// `values[order[i]]`; stays empty if it is.
fn gather<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { order.iter().map(|&i| values[i as usize]).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_triangles_and_their_vertices_go() {
        let p = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mut mesh = Mesh {
            positions: vec![
                p(f32::NAN, 0.0),
                p(0.0, 0.0),
                p(1.0, 0.0),
                p(0.0, 1.0),
                p(2.0, 0.0),
                p(1e-30, 0.0),
                p(0.0, 1e-30),
            ],
            uvs: vec![Vec2::NAN; 7],
            triangles: vec![[0, 1, 2], [1, 2, 4], [1, 2, 3], [1, 1, 2], [1, 5, 6]],
            ..Mesh::default()
        };
        let repairs = repair(&mut mesh, |i| 10 + i);
        assert_eq!(repairs.not_finite, Count { times: 1, first_line: 10 });
        assert_eq!(repairs.flat, Count { times: 3, first_line: 11 });
        assert_eq!((mesh.triangles, mesh.numbers), (vec![[0, 1, 2]], vec![2]));
        assert_eq!(mesh.positions, [p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)]);
        assert_eq!((mesh.uvs, repairs.bad_uvs), (vec![Vec2::ZERO; 3], 3));
    }

    #[test]
    fn small_and_large_triangles_stay() {
        for scale in [1e-18_f32, 1e-6, 1.0, 1e6, 1e18] {
            let mut mesh = Mesh {
                positions: vec![Vec3::ZERO, Vec3::X * scale, Vec3::Y * scale],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            repair(&mut mesh, |_| 1);
            assert!(mesh.triangles.len() == 1 && mesh.numbers.is_empty(), "{scale}");
        }
    }
}
