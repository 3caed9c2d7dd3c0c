//! Flat lights: triangles, parallelograms, disks. They emit from the front, and are sampled uniformly by area, but for
//! [rectangles](super::rectangle) and [triangles](super::spherical_triangle) that are close by.

use std::convert::Infallible;

use glam::Vec3;

use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::math::frame::Frame;
use crate::math::pdf::{PdfA, PdfW};
use crate::math::warp;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::{Disk, SurfacePoint, Triangle};

use super::bounds::LightBounds;
use super::emission::{EmissionPdf, surface_pdf};
use super::rectangle::{Rectangle, SubtendedRectangle};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;
use super::spherical_triangle::SubtendedTriangle;
use super::subtended::SubtendedShape;

/// A flat surface whose points can be sampled uniformly by area.
pub trait FlatShape {
    /// The shape as seen from close by.
    type Subtended<'a>: SubtendedShape
    where
        Self: 'a;

    /// The shape as seen from `p`, where that is before its front and so close that points are sampled by solid angle.
    fn seen_from(&self, p: Vec3) -> Option<Self::Subtended<'_>>;

    /// The density of its points.
    fn area_pdf(&self) -> PdfA;

    /// The point of the numbers `u`.
    fn position(&self, u: [f32; 2]) -> Vec3;

    /// The same point with its error bound.
    fn point(&self, u: [f32; 2]) -> SurfacePoint;

    /// Unit normal of the front.
    fn normal(&self) -> Vec3;

    /// Corners of the box around it.
    fn bounding_box(&self) -> [Vec3; 2];
}

/// A flat shape that emits from its front.
#[derive(Clone, Debug)]
pub struct FlatLight<S> {
    shape: S,
    pdf: PdfA,
}

/// A triangle that emits.
pub type TriangleLight = FlatLight<Triangle>;

/// A parallelogram that emits: the image of a rectangle.
pub type ParallelogramLight = FlatLight<Parallelogram>;

/// A disk that emits.
pub type DiskLight = FlatLight<Disk>;

impl<S: FlatShape> FlatLight<S> {
    /// The light on `shape`.
    pub fn new(shape: S) -> Self {
        Self { pdf: shape.area_pdf(), shape }
    }

    fn area(&self) -> f32 {
        1.0 / self.pdf.0
    }
}

impl ParallelogramLight {
    /// The light over `corner + x·a + y·b`, x and y in [0, 1], with unit front normal `n`.
    pub fn over(corner: Vec3, a: Vec3, b: Vec3, n: Vec3) -> Self {
        Self::new(Parallelogram { corner, a, b, n, rectangle: Rectangle::new(corner, a, b, n) })
    }
}

impl<S: FlatShape> LightSource for FlatLight<S> {
    #[inline]
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        if let Some(close) = self.shape.seen_from(at.p) {
            let (target, pdf) = close.sample(u);
            let wi = (target - at.p).normalize();
            // The target is rounded: where coordinates are large it may lie in the plane of the lit point.
            let seen = -wi.dot(self.shape.normal()) > 0.0;
            return seen.then_some(LightSample { wi, target: Some(target), scale: 1.0, pdf, delta: false });
        }
        let target = self.shape.position(u);
        let to = target - at.p;
        let distance2 = to.length_squared();
        let wi = to * (1.0 / distance2.sqrt());
        let cos = -wi.dot(self.shape.normal());
        // Refuses NaN, too: the light may pass through the lit point.
        let seen = cos > 0.0;
        let pdf = self.pdf.to_solid_angle(distance2, cos);
        seen.then_some(LightSample { wi, target: Some(target), scale: 1.0, pdf, delta: false })
    }

    #[inline]
    fn pdf(&self, at: LightSampleContext, _: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        let Some(hit) = hit else { return PdfW::ZERO };
        if let Some(close) = self.shape.seen_from(at.p) {
            return close.pdf(hit.p);
        }
        let to = hit.p - at.p;
        let distance2 = to.length_squared();
        let cos = -to.dot(hit.ng) * (1.0 / distance2.sqrt());
        if cos > 0.0 { self.pdf.to_solid_angle(distance2, cos) } else { PdfW::ZERO }
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        self.area()
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        let corners = self.shape.bounding_box();
        (LightBounds::flat(corners, self.shape.normal(), power), corners)
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let from = self.shape.point(u.place);
        Some((from, Frame::new(from.ng).to_world(warp::cosine_hemisphere(u.direction))))
    }

    #[inline]
    fn emission_pdf(&self, _: Vec3, direction: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        surface_pdf(self.shape.normal(), direction, choice / self.area())
    }
}

impl FlatShape for Triangle {
    type Subtended<'a> = SubtendedTriangle;

    #[inline]
    fn seen_from(&self, p: Vec3) -> Option<SubtendedTriangle> {
        SubtendedTriangle::new(self, p)
    }

    fn area_pdf(&self) -> PdfA {
        PdfA(1.0 / self.area())
    }

    #[inline]
    fn position(&self, u: [f32; 2]) -> Vec3 {
        let (a, b) = warp::triangle(u);
        self.p0 + self.e1 * a + self.e2 * b
    }

    #[inline]
    fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let (a, b) = warp::triangle(u);
        Triangle::point(self, [a, b])
    }

    #[inline]
    fn normal(&self) -> Vec3 {
        self.n
    }

    fn bounding_box(&self) -> [Vec3; 2] {
        let Triangle { p0, e1, e2, .. } = *self;
        [p0 + e1.min(e2).min(Vec3::ZERO), p0 + e1.max(e2).max(Vec3::ZERO)]
    }
}

/// The points `corner + x·a + y·b`, x and y in [0, 1].
#[derive(Clone, Debug)]
pub struct Parallelogram {
    corner: Vec3,
    a: Vec3,
    b: Vec3,
    n: Vec3,
    /// The same, if its sides are perpendicular.
    rectangle: Option<Rectangle>,
}

impl FlatShape for Parallelogram {
    type Subtended<'a> = SubtendedRectangle<'a>;

    #[inline]
    fn seen_from(&self, p: Vec3) -> Option<SubtendedRectangle<'_>> {
        self.rectangle.as_ref()?.seen_from(p)
    }

    fn area_pdf(&self) -> PdfA {
        PdfA((1.0 / self.a.as_dvec3().cross(self.b.as_dvec3()).length()) as f32)
    }

    #[inline]
    fn position(&self, u: [f32; 2]) -> Vec3 {
        self.corner + self.a * u[0] + self.b * u[1]
    }

    #[inline]
    fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let (a, b) = (self.a * u[0], self.b * u[1]);
        let p = self.corner + (a + b);
        // As of a triangle; the corner itself may be rounded once.
        let error = (a.abs() + b.abs()) * gamma(4) + p.abs() * (2.02 * UNIT_ROUNDOFF);
        SurfacePoint { p, error, ng: self.n }
    }

    #[inline]
    fn normal(&self) -> Vec3 {
        self.n
    }

    fn bounding_box(&self) -> [Vec3; 2] {
        let low = self.a.min(Vec3::ZERO) + self.b.min(Vec3::ZERO);
        let high = self.a.max(Vec3::ZERO) + self.b.max(Vec3::ZERO);
        [self.corner + low, self.corner + high]
    }
}

impl FlatShape for Disk {
    type Subtended<'a> = Infallible;

    #[inline]
    fn seen_from(&self, _: Vec3) -> Option<Infallible> {
        None
    }

    fn area_pdf(&self) -> PdfA {
        PdfA(1.0 / self.area())
    }

    #[inline]
    fn position(&self, u: [f32; 2]) -> Vec3 {
        let xy = warp::disk(u);
        self.center + self.a * xy.x + self.b * xy.y
    }

    #[inline]
    fn point(&self, u: [f32; 2]) -> SurfacePoint {
        let xy = warp::disk(u);
        self.point_at(xy.x, xy.y)
    }

    #[inline]
    fn normal(&self) -> Vec3 {
        self.n
    }

    fn bounding_box(&self) -> [Vec3; 2] {
        self.bounds().into()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Light is sampled from the points from which it is emitted.
    #[test]
    fn positions_are_points() {
        let (corner, a, b) = (Vec3::new(1.0, -0.5, 0.3), Vec3::new(0.3, 1.5, 0.2), Vec3::new(-0.8, 0.4, 2.0));
        let triangle = Triangle::new([corner, corner + a, corner + b]).expect("a triangle");
        let disk = Disk::new(corner, a, b, DVec3::Z).expect("a disk");
        let parallelogram = Parallelogram { corner, a, b, n: a.cross(b).normalize(), rectangle: None };
        for u in [[0.1, 0.7], [0.9, 0.2], [0.45, 0.55]] {
            assert!(triangle.position(u).distance(FlatShape::point(&triangle, u).p) < 1e-6);
            assert!(disk.position(u).distance(FlatShape::point(&disk, u).p) < 1e-6);
            assert!(parallelogram.position(u).distance(parallelogram.point(u).p) < 1e-6);
        }
    }

    /// Where coordinates are a thousand times as large as a light, rounding may move its points through the plane of what it lights: no sample then,
    /// and none that leaves its back.
    #[test]
    fn a_rounded_point_is_seen_from_the_front_or_not_at_all() {
        let corner = Vec3::new(3001.7, -1999.3, 4003.1);
        let (a, b) = (Vec3::new(1.3, 0.4, -0.2), Vec3::new(-0.3, 1.0, 0.05));
        let triangle = Triangle::new([corner, corner + a, corner + b]).expect("a triangle");
        let b = triangle.n.cross(a);
        let rectangle = ParallelogramLight::over(corner, a, b, triangle.n);
        let triangle = TriangleLight::new(triangle);
        let (mut seen, mut close) = (0, 0);
        for i in 0..1000 {
            let u = [0.6180, 0.7548, 0.5698].map(|step| (i as f32 * step).fract());
            let p = corner + a * (0.5 * u[0]) + b * (0.4 * u[1]) + triangle.shape.n * (1e-3 * u[2]);
            let at = LightSampleContext { p, n: Vec3::ZERO, through: true, glossy: false };
            close +=
                u32::from(triangle.shape.seen_from(p).is_some() && rectangle.shape.seen_from(p).is_some());
            for sample in
                [triangle.sample(at, [u[1], u[2]]), rectangle.sample(at, [u[1], u[2]])].into_iter().flatten()
            {
                assert!(-sample.wi.dot(triangle.shape.n) > 0.0 && sample.pdf.0 > 0.0, "{sample:?}");
                seen += 1;
            }
        }
        assert!(seen > 100 && close > 100, "{seen} samples, {close} close by");
    }
}
