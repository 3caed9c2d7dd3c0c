//! The weight of each way to find a path: the power heuristic over all ways.
//!
//! [`Chain`] holds what the rest of a subpath adds; here is what the completing edge adds.

use crate::math::pdf::PdfW;
use crate::tracer::bsdf::Scattering;
use crate::tracer::chain::{self, Chain, quotient};
use crate::tracer::light::{Emission, EmissionPdf, LightSample, Origin};
use crate::tracer::subpath::{Scattered, Vertex};

use super::{BidirectionalTracer, LIGHTS_PER_CAMERA};

/// A light that was met by chance.
pub(super) struct Meeting {
    /// Density of next-event estimation from the vertex before, per steradian.
    pub(super) direct: PdfW,
    /// Densities with which a light subpath begins with this edge.
    pub(super) emission: EmissionPdf,
}

/// An edge between two subpaths.
pub(super) struct Edge<'a> {
    /// At the camera subpath's end.
    pub(super) eye: &'a Scattered,
    /// At the light subpath's end.
    pub(super) light: &'a Scattered,
    /// 1 / d².
    pub(super) inverse: f32,
}

/// s = 0: `chain` is that of the vertex on the light, or of the direction in which the scene was left.
#[inline]
pub(super) fn met(chain: &Chain, meeting: &Meeting) -> f32 {
    let Meeting { direct, emission } = meeting;
    // After a delta nothing else finds the edge, however dense.
    let one = if chain.link[0] > 0.0 { quotient(direct.0, chain.fwd_w) } else { 0.0 };
    let two = quotient(emission.vertex, chain.fwd) * chain.previous_sum(emission.next);
    chain::weight(one, two)
}

/// s = 1: `density` is with which a light subpath chooses vertex and edge, over next-event estimation's for the latter,
/// per unit of area at the vertex.
#[inline]
pub(super) fn next_event(
    chain: &Chain,
    scattered: &Scattered,
    (sample, density): (&LightSample, f32),
) -> f32 {
    let met = if sample.delta { 0.0 } else { quotient(scattered.fwd_w, sample.pdf.0) };
    chain::weight(chain.sum(density, scattered.rev_w, scattered.through), met)
}

/// s ≥ 2, t ≥ 2.
#[inline]
pub(super) fn connected(eye: &Chain, light: &Chain, edge: &Edge) -> f32 {
    let Edge { eye: a, light: b, inverse } = edge;
    let from_eye = eye.sum(b.fwd_w * a.cos * inverse, a.rev_w, a.through);
    let from_light = light.sum(a.fwd_w * b.cos * inverse, b.rev_w, b.through);
    chain::weight(from_eye, from_light)
}

/// t = 1: `density` is the camera's of the vertex, per unit of area. Of this way there are fewer samples than of the others.
#[inline]
pub(super) fn seen(light: &Chain, scattered: &Scattered, density: f32) -> f32 {
    let others = light.sum(density, scattered.rev_w, scattered.through);
    chain::weight(0.0, others / f64::from(LIGHTS_PER_CAMERA))
}

impl BidirectionalTracer {
    /// The links of the first vertex of a light subpath: the density with which next-event estimation would have chosen
    /// the light's vertex over that of the walk, for an eye on the side of the light and for one on the other side.
    pub(super) fn link_to_light<B: Scattering>(&self, vertex: &Vertex<B>, emission: &Emission) -> [f32; 2] {
        let lights = &self.context.scene.lights;
        let on = (emission.pdf.origin == Origin::Surface).then_some(&emission.from);
        [vertex.wo, -vertex.wo].map(|eye| {
            let at = vertex.lit_point(eye);
            if emission.pdf.origin == Origin::Point {
                return lights.probability(emission.light, at) / emission.pdf.vertex;
            }
            let pdf = lights.pdf(emission.light, at, (vertex.hit.wo, on));
            pdf.0 * vertex.chain.back / emission.pdf.vertex
        })
    }
}
