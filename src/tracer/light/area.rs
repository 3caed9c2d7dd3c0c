//! Flat lights that are sampled uniformly by area: triangles, parallelograms, disks. They emit from the front.

use glam::Vec3;

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::math::pdf::{PdfA, PdfW};
use crate::math::warp;
use crate::tracer::shape::{Disk, SurfacePoint, Triangle};

use super::{LightSample, LitPoint};

/// A direction to the point `q` of a flat light with front `n` and area density `pdf`; `None` from behind.
#[inline]
fn sample_flat(at: LitPoint, q: Vec3, n: Vec3, pdf: PdfA) -> Option<LightSample> {
    let to = q - at.p;
    let distance2 = to.length_squared();
    let wi = to * (1.0 / distance2.sqrt());
    let cos = -wi.dot(n);
    // Refuses NaN, too: the light may pass through the lit point.
    let seen = cos > 0.0;
    let pdf = pdf.to_solid_angle(distance2, cos);
    seen.then_some(LightSample { wi, target: Some(q), scale: 1.0, pdf, delta: false })
}

/// The density that belongs to [`sample_flat`].
#[inline]
fn pdf_flat(at: LitPoint, hit: &SurfacePoint, pdf: PdfA) -> PdfW {
    let to = hit.p - at.p;
    let distance2 = to.length_squared();
    let cos = -to.dot(hit.ng) * (1.0 / distance2.sqrt());
    if cos > 0.0 { pdf.to_solid_angle(distance2, cos) } else { PdfW::ZERO }
}

/// A triangle that emits.
#[derive(Clone, Debug)]
pub struct TriangleLight {
    triangle: Triangle,
    pdf: PdfA,
}

impl TriangleLight {
    /// The light on `triangle`.
    pub fn new(triangle: Triangle) -> Self {
        Self { pdf: PdfA(1.0 / triangle.area()), triangle }
    }

    pub(super) fn area(&self) -> f32 {
        1.0 / self.pdf.0
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let Triangle { p0, e1, e2, .. } = self.triangle;
        (p0 + e1.min(e2).min(Vec3::ZERO), p0 + e1.max(e2).max(Vec3::ZERO))
    }

    #[inline]
    pub(super) fn sample(&self, at: LitPoint, u: [f32; 2]) -> Option<LightSample> {
        let (a, b) = warp::triangle(u);
        let q = self.triangle.p0 + self.triangle.e1 * a + self.triangle.e2 * b;
        sample_flat(at, q, self.triangle.n, self.pdf)
    }

    #[inline]
    pub(super) fn pdf(&self, at: LitPoint, hit: &SurfacePoint) -> PdfW {
        pdf_flat(at, hit, self.pdf)
    }

    #[inline]
    pub(super) fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let (a, b) = warp::triangle(u);
        self.triangle.point([a, b])
    }

    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        self.triangle.n
    }
}

/// A parallelogram that emits: the image of a rectangle.
#[derive(Clone, Debug)]
pub struct ParallelogramLight {
    corner: Vec3,
    a: Vec3,
    b: Vec3,
    n: Vec3,
    pdf: PdfA,
}

impl ParallelogramLight {
    /// The light over `corner + x·a + y·b`, x and y in [0, 1], with unit front normal `n`.
    pub fn new(corner: Vec3, a: Vec3, b: Vec3, n: Vec3) -> Self {
        let area = a.as_dvec3().cross(b.as_dvec3()).length();
        Self { corner, a, b, n, pdf: PdfA((1.0 / area) as f32) }
    }

    pub(super) fn area(&self) -> f32 {
        1.0 / self.pdf.0
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let low = self.a.min(Vec3::ZERO) + self.b.min(Vec3::ZERO);
        let high = self.a.max(Vec3::ZERO) + self.b.max(Vec3::ZERO);
        (self.corner + low, self.corner + high)
    }

    #[inline]
    pub(super) fn sample(&self, at: LitPoint, u: [f32; 2]) -> Option<LightSample> {
        sample_flat(at, self.corner + self.a * u[0] + self.b * u[1], self.n, self.pdf)
    }

    #[inline]
    pub(super) fn pdf(&self, at: LitPoint, hit: &SurfacePoint) -> PdfW {
        pdf_flat(at, hit, self.pdf)
    }

    #[inline]
    pub(super) fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let (a, b) = (self.a * u[0], self.b * u[1]);
        let p = self.corner + (a + b);
        // As of a triangle; the corner itself may be rounded once.
        let error = (a.abs() + b.abs()) * gamma(4) + p.abs() * (2.02 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: self.n }
    }

    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        self.n
    }
}

/// A disk that emits.
#[derive(Clone, Debug)]
pub struct DiskLight {
    disk: Disk,
    pdf: PdfA,
}

impl DiskLight {
    /// The light on `disk`.
    pub fn new(disk: Disk) -> Self {
        Self { pdf: PdfA(1.0 / disk.area()), disk }
    }

    pub(super) fn area(&self) -> f32 {
        1.0 / self.pdf.0
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        self.disk.bounds()
    }

    #[inline]
    pub(super) fn sample(&self, at: LitPoint, u: [f32; 2]) -> Option<LightSample> {
        let xy = warp::disk(u);
        sample_flat(at, self.disk.center + self.disk.a * xy.x + self.disk.b * xy.y, self.disk.n, self.pdf)
    }

    #[inline]
    pub(super) fn pdf(&self, at: LitPoint, hit: &SurfacePoint) -> PdfW {
        pdf_flat(at, hit, self.pdf)
    }
    #[inline]
    pub(super) fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let xy = warp::disk(u);
        self.disk.point_at(xy.x, xy.y)
    }

    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        self.disk.n
    }
}
