//! Ours by each kernel, and obvhs's own compressed tree.

use std::sync::{Arc, RwLock};
use std::time::Duration;

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use pointillist::tracer::accel::{Accel, PrimRange, Ray, SimdKernel};

use super::contest::Contestant;

/// Ours by one kernel; the tree is shared by all kernels.
pub struct Ours {
    /// The tree.
    pub accel: Arc<RwLock<Accel>>,
    /// How it is walked.
    pub kernel: SimdKernel,
}

impl Contestant for Ours {
    fn name(&self) -> &'static str {
        self.kernel.name()
    }

    fn bytes(&self) -> usize {
        self.accel.read().unwrap().bytes()
    }

    fn prepare(&self) {
        assert!(self.accel.write().unwrap().set_kernel(self.kernel), "{} is available", self.kernel.name());
    }

    fn closest(&self, rays: &[Ray], found: &mut [f32]) {
        let accel = &*self.accel.read().unwrap();
        for (ray, found) in rays.iter().zip(found) {
            *found = accel.closest(ray).map_or(f32::INFINITY, |hit| hit.t);
        }
    }

    fn occluded(&self, rays: &[Ray], found: &mut [f32]) {
        let accel = &*self.accel.read().unwrap();
        for (ray, found) in rays.iter().zip(found) {
            *found = if accel.occluded(ray, PrimRange::NONE) { 0.0 } else { f32::INFINITY };
        }
    }
}

/// obvhs's compressed 8-wide tree with its own walk and triangles, these in the order of the leaves.
///
/// The walk of obvhs 0.4.0 does not enter boxes that end nearer than 1e-4: such hits are missing.
pub struct Obvhs {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Obvhs {
    /// Builds it with obvhs's medium quality.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let triangles: Vec<Triangle> = triangles
            .iter()
            .map(|t| {
                let [v0, v1, v2] = t.map(Into::into);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let tree =
            build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles =
            tree.primitive_indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        Self { tree, triangles }
    }
}

fn query(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max)
}

impl Contestant for Obvhs {
    fn name(&self) -> &'static str {
        "obvhs"
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.tree.nodes[..]) + size_of_val(&self.triangles[..])
    }

    fn closest(&self, rays: &[Ray], found: &mut [f32]) {
        for (ray, found) in rays.iter().zip(found) {
            let mut hit = RayHit::none();
            let any = self.tree.ray_traverse(query(ray), &mut hit, |ray, i| self.triangles[i].intersect(ray));
            *found = if any { hit.t } else { f32::INFINITY };
        }
    }

    fn occluded(&self, rays: &[Ray], found: &mut [f32]) {
        for (ray, found) in rays.iter().zip(found) {
            let clear = self.tree.ray_traverse_miss(query(ray), |ray, i| self.triangles[i].intersect(ray));
            *found = if clear { f32::INFINITY } else { 0.0 };
        }
    }
}
