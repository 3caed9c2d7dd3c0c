//! Vertex normals made from faces.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::scene::desc::Mesh;

/// Faces whose normals are in memory at once.
const FACES_AT_ONCE: usize = 1 << 17;

/// Normals at the vertices of `mesh`, in object space: the mean of the normals of the faces around a
/// vertex, each weighted by its angle there (Thürmer and Wüthrich 1998), as Mitsuba makes them for a
/// mesh without normals.
///
/// `world` is the linear part of the object-to-world transform; faces are measured in the world.
pub(super) fn from_faces(mesh: &Mesh, world: &DMat3) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let mut any = vec![DVec3::ZERO; mesh.positions.len()];
    // The weighted normals of many faces are made in parallel, and added in the order of the faces.
    let weighted = |triangle: &[u32; 3]| {
        let p = triangle.map(|v| *world * mesh.positions[v as usize].as_dvec3());
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        let weight = |i: usize| (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i]);
        (normal, [0, 1, 2].map(weight))
    };
    for triangles in mesh.triangles.chunks(FACES_AT_ONCE) {
        let faces: Vec<(DVec3, [f64; 3])> = triangles.par_iter().map(weighted).collect();
        for (triangle, (normal, weights)) in triangles.iter().zip(faces) {
            for (v, weight) in triangle.iter().zip(weights) {
                sums[*v as usize] += normal * weight;
                any[*v as usize] = normal;
            }
        }
    }
    // A normal n of the world is the image under the inverse transpose of the object's n·M.
    let to_object = world.transpose();
    let object = |(sum, any): (DVec3, DVec3)| {
        // Faces back to back cancel: any of them is as good as the other.
        let n = if sum.length() > 1e-9 && sum.is_finite() { sum } else { any };
        (to_object * n).normalize_or(DVec3::Z).as_vec3()
    };
    sums.into_par_iter().zip(any).map(object).collect()
}

/// The normal of a vertex of which the file has none, beside others that have one.
pub(super) const MISSING: Vec3 = Vec3::INFINITY;

/// Normals that were made from faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Mended {
    /// Those that had no direction.
    pub(super) bad: usize,
    /// Those that were [`MISSING`].
    pub(super) missing: usize,
}

/// Gives every normal the length 1. What cannot have it is made from faces, and counted.
pub(super) fn mend(mesh: &mut Mesh, world: &DMat3) -> Mended {
    let unit = |(i, n): (usize, &mut Vec3)| match n.as_dvec3().try_normalize() {
        Some(unit) => {
            *n = unit.as_vec3();
            None
        }
        None => Some(i),
    };
    let bad: Vec<usize> = mesh.normals.par_iter_mut().enumerate().filter_map(unit).collect();
    let mut mended = Mended::default();
    if !bad.is_empty() {
        let made = from_faces(mesh, world);
        for &i in &bad {
            *if mesh.normals[i] == MISSING { &mut mended.missing } else { &mut mended.bad } += 1;
            mesh.normals[i] = made[i];
        }
    }
    mended
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a bent square; values from Mitsuba 3.9.1 on the same file.
    fn bent() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.5), Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn agree_with_mitsuba() {
        let wanted = [
            Vec3::new(-0.235702, -0.235702, 0.942809),
            Vec3::new(0.0, -0.447214, 0.894427),
            Vec3::new(-0.235702, -0.235702, 0.942809),
            Vec3::new(-0.447214, 0.0, 0.894427),
        ];
        for (n, w) in from_faces(&bent(), &DMat3::IDENTITY).iter().zip(wanted) {
            assert!((*n - w).length() < 1e-5, "{n} {w}");
        }
    }

    #[test]
    fn mirrored_world_turns_them_around() {
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let n = from_faces(&bent(), &mirror)[1];
        // In the world the face (0,0,0), (−1,0,0), (−1,1,½) has the normal (0, ½, −1)/|…|.
        assert!((n - Vec3::new(0.0, 0.447214, -0.894427)).length() < 1e-5, "{n}");
    }

    #[test]
    fn bad_normals_are_replaced() {
        let mut mesh = bent();
        mesh.normals = vec![Vec3::Z * 3.0, MISSING, Vec3::NAN, Vec3::Z];
        assert_eq!(mend(&mut mesh, &DMat3::IDENTITY), Mended { bad: 1, missing: 1 });
        assert_eq!(mesh.normals[0], Vec3::Z);
        assert!((mesh.normals[1] - Vec3::new(0.0, -0.447214, 0.894427)).length() < 1e-5);
        assert!(mesh.normals.iter().all(|n| n.is_normalized()));
    }
}
