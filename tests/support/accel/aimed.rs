//! Rays at the edges and vertices of closed meshes.

use std::ops::AddAssign;

use glam::Vec3;
use rayon::prelude::*;

use pointillist::tracer::accel::{Accel, PrimRange, Ray};

use super::{Closed, Random};

/// A ray from inside at a vertex (one of four) or at a point of an edge, as exactly as single precision allows. Of
/// every fifth one component is made zero: it points anywhere, along a plane of the grid of a cube.
pub fn aimed(mesh: &[[Vec3; 3]], closed: &Closed, index: u64) -> (Ray, f32) {
    let random = &mut Random(index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let origin = (random.direction() * random.f64() * closed.inside + closed.center).as_vec3();
    let face = mesh[(random.f64() * mesh.len() as f64) as usize];
    let corner = (random.f64() * 3.0) as usize;
    let (a, b) = (face[corner % 3], face[(corner + 1) % 3]);
    let target = a + (b - a) * if index.is_multiple_of(4) { 0.0 } else { random.f64() as f32 };
    let mut ray = Ray::new(origin, (target - origin).normalize());
    if index.is_multiple_of(5) {
        ray.direction[(random.f64() * 3.0) as usize] = 0.0;
        return (ray, f32::INFINITY);
    }
    // No farther than the target by more than the edges around it: a ray that leaks out of a bay may hit another.
    let edges = a.distance(b).max(b.distance(face[(corner + 2) % 3]));
    (ray, target.distance(origin) * 1.0001 + 3.0 * edges)
}

/// The failures, and the number of rays tried.
#[derive(Clone, Copy, Debug, Default)]
pub struct Leaks {
    pub rays: u64,
    pub missed: u64,
    pub unoccluded: u64,
    pub late: u64,
}

impl AddAssign for Leaks {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.missed += other.missed;
        self.unoccluded += other.unoccluded;
        self.late += other.late;
    }
}

/// Asks for these rays from inside a closed mesh.
pub fn leaks(
    accel: &Accel,
    mesh: &[[Vec3; 3]],
    closed: &Closed,
    rays: impl ParallelIterator<Item = u64>,
) -> Leaks {
    rays.fold(Leaks::default, |mut sum, index| {
        let (ray, farthest) = aimed(mesh, closed, index);
        let hit = accel.closest(&ray);
        sum += Leaks {
            rays: 1,
            missed: u64::from(hit.is_none()),
            unoccluded: u64::from(!accel.occluded(&ray, PrimRange::NONE)),
            late: u64::from(hit.is_some_and(|h| h.t > farthest)),
        };
        sum
    })
    .reduce(Leaks::default, |mut a, b| {
        a += b;
        a
    })
}
