//! Texture coordinates of the corners of faces: vertices become several where their faces disagree.

use std::collections::HashMap;

use glam::Vec2;

use super::file::MISSING_UV;
use crate::scene::desc::Mesh;

/// Gives the corners of the triangles these texture coordinates; where they are [`MISSING_UV`], vertices keep their own.
pub(super) fn split(mesh: &mut Mesh, uvs: &[[Vec2; 3]]) {
    let own = std::mem::take(&mut mesh.uvs);
    let count = mesh.positions.len();
    // The first texture coordinates of each vertex; those that differ from it are looked up.
    let mut first: Vec<Option<[u32; 2]>> = vec![None; count];
    let mut others: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
    let mut sources: Vec<u32> = Vec::new();
    mesh.uvs = vec![MISSING_UV; count];
    for (triangle, uvs) in mesh.triangles.iter_mut().zip(uvs) {
        for (corner, uv) in triangle.iter_mut().zip(uvs) {
            let vertex = *corner as usize;
            let uv = if *uv == MISSING_UV { own.get(vertex).copied().unwrap_or(*uv) } else { *uv };
            let bits = uv.to_array().map(f32::to_bits);
            match first[vertex] {
                None => {
                    first[vertex] = Some(bits);
                    mesh.uvs[vertex] = uv;
                }
                Some(known) if known == bits => {}
                Some(_) => {
                    *corner = *others.entry((*corner, bits)).or_insert_with(|| {
                        sources.push(vertex as u32);
                        mesh.uvs.push(uv);
                        mesh.uvs.len() as u32 - 1
                    });
                }
            }
        }
    }
    append(&mut mesh.positions, &sources);
    append(&mut mesh.normals, &sources);
    for attribute in mesh.attributes.iter_mut().filter(|attribute| !attribute.is_of_faces()) {
        let n = attribute.channels;
        attribute.values.reserve_exact(n * sources.len());
        for &source in &sources {
            attribute.values.extend_from_within(source as usize * n..(source as usize + 1) * n);
        }
    }
}

/// Appends copies of these vertices; stays empty if it is.
fn append<T: Copy>(values: &mut Vec<T>, sources: &[u32]) {
    if !values.is_empty() {
        values.reserve_exact(sources.len());
        sources.iter().for_each(|&source| values.push(values[source as usize]));
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::desc::MeshAttribute;

    #[test]
    fn vertices_split_at_seams_only() {
        let uv = |u: f32| Vec2::new(u, 0.5);
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 2, 3]],
            attributes: vec![MeshAttribute {
                name: "vertex_a".into(),
                channels: 1,
                values: vec![0.0, 1.0, 2.0, 3.0],
            }],
            ..Mesh::default()
        };
        split(
            &mut mesh,
            &[[uv(0.0), uv(1.0), uv(2.0)], [uv(0.0), uv(5.0), MISSING_UV], [uv(0.0), uv(5.0), uv(7.0)]],
        );
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 4, 3], [0, 4, 5]]);
        assert_eq!(mesh.uvs, [uv(0.0), uv(1.0), uv(2.0), MISSING_UV, uv(5.0), uv(7.0)]);
        assert_eq!((mesh.positions[4], mesh.positions[5]), (Vec3::Y, Vec3::Z));
        assert_eq!(mesh.attributes[0].values, [0.0, 1.0, 2.0, 3.0, 2.0, 3.0]);
    }
}
