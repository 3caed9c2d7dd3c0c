//! Which vertices of camera and light subpaths are connected: a few of all pairs, chosen by their importance.
//!
//! The importance of a pair is an estimate of what it would contribute. A connection that is made stands for those that are
//! not: its contribution is divided by its probability, so that expected values and weights are those of full
//! connection. relMSE at equal time (scaled to 512 × 512 and 20 CPU seconds, `benchmarks methods`), the first six with one light subpath to each camera subpath:
//!
//! | connections of a camera subpath | Cornell box | with glass and mirror | lit from a cove |
//! |---|---|---|---|
//! | all | .0096 | .0248 | .0585 |
//! | all, light subpaths ended early by roulette | .0085 | .0232 | .0721 |
//! | one, uniformly chosen | .0189 | .0261 | – |
//! | four, uniformly chosen | .0101 | .0222 | .1312 |
//! | one, by importance | .0111 | .0216 | .1035 |
//! | six, by importance | .0076 | .0211 | .0489 |
//! | **six, by importance, of four light subpaths to eight camera subpaths** | **.0052** | **.0172** | **.0362** |
//!
//! Where all light that matters comes through a lens (`scenes/caustic.xml`) half as many light subpaths cost: .039 against
//! .032 with all connections and one light subpath each.

use glam::{Vec3, Vec4};

use crate::spectrum::SampledSpectrum;
use crate::stream::{FaultyValue, MAX_VALUE, faults};
use crate::tracer::bsdf::Scattering;
use crate::tracer::record::PathEvent;
use crate::tracer::subpath::{SubpathVertex, VertexScattering};

use super::strategies::{PathContribution, connection_weight};
use super::{BidirectionalTracer, LIGHT_SUBPATHS};

/// Mean number of connections of one camera subpath.
const CONNECTIONS: f32 = 6.0;

/// A connection is small if it contributes less than this share of the mean. Small ones are made at random, in proportion.
const SMALL: f32 = 0.25;

/// One over the number of light subpaths.
const SHARE: f32 = 1.0 / LIGHT_SUBPATHS as f32;

/// Least MIS weight of an importance: the true weight may be larger than what is known of it.
const LEAST_WEIGHT: f32 = 0.01;

/// Greatest importance.
const GREATEST: f32 = 1e30;

/// A vertex that can be connected.
#[derive(Clone, Copy, Debug)]
pub struct ConnectableVertex<B> {
    /// What of it the importance of a pair depends on, close together in memory.
    summary: DiffuseSummary,
    vertex: SubpathVertex<B>,
}

/// What the importance of a pair needs of a diffuse vertex.
#[derive(Clone, Copy, Debug)]
struct DiffuseSummary {
    p: Vec3,
    /// Shading normal; what lies behind gets nothing.
    n: Vec3,
    /// Throughput times BRDF.
    throughput: Vec4,
    /// 1 / (π · density).
    spread: f32,
    depth: u32,
    diffuse: bool,
}

impl<B: Scattering> ConnectableVertex<B> {
    #[inline(always)]
    pub(super) fn new(vertex: SubpathVertex<B>) -> Self {
        let surface = &vertex.surface;
        let (throughput, diffuse) = match surface.bsdf.as_diffuse() {
            Some(b) if surface.wo.z > 0.0 => {
                ((vertex.throughput * b.albedo).0 * std::f32::consts::FRAC_1_PI, true)
            }
            // Seen from behind it is black.
            Some(_) => (Vec4::ZERO, true),
            None => (Vec4::ZERO, false),
        };
        let spread = std::f32::consts::FRAC_1_PI / vertex.mis.fwd;
        let (p, n, depth) = (surface.hit.point.p, surface.frame.n, vertex.depth);
        Self { summary: DiffuseSummary { p, n, throughput, spread, depth, diffuse }, vertex }
    }
}

/// About what a pair would contribute if nothing occludes it: exact but for its MIS weight, of which the larger part is known.
#[inline]
fn importance<B: Scattering>(camera: &ConnectableVertex<B>, light: &ConnectableVertex<B>) -> f32 {
    let (a, b) = (&camera.summary, &light.summary);
    if !(a.diffuse && b.diffuse) {
        return general_importance(&camera.vertex, &light.vertex);
    }
    let offset = b.p - a.p;
    let (ca, cb) = (offset.dot(a.n), -offset.dot(b.n));
    if !(ca > 0.0 && cb > 0.0) {
        return 0.0;
    }
    let inverse = 1.0 / offset.length_squared();
    let g = ca * cb * inverse * inverse;
    let (x, y) = (g * a.spread, g * b.spread);
    let weight = 1.0 / (1.0 + x * x + y * y);
    let importance = g * a.throughput.dot(b.throughput) * weight.max(LEAST_WEIGHT);
    // An infinite density times nothing. The edge itself tells what is wrong, if anything is, and all other pairs keep theirs.
    if importance.is_nan() {
        return general_importance(&camera.vertex, &light.vertex);
    }
    // Bounded, so that the sum of all importances is finite however close two vertices are.
    importance.min(GREATEST)
}

#[cold]
fn general_importance<B: Scattering>(camera: &SubpathVertex<B>, light: &SubpathVertex<B>) -> f32 {
    let Some(edge) = ConnectionEdge::new(camera, light) else { return 0.0 };
    (edge.value.0.element_sum() * edge.weight(camera, light).max(LEAST_WEIGHT)).min(GREATEST)
}

/// The edge between two vertices, which scatter to each other.
struct ConnectionEdge {
    at_camera: VertexScattering,
    at_light: VertexScattering,
    /// 1 over its squared length.
    inverse: f32,
    /// Unit direction from the camera's vertex to the light's.
    d: Vec3,
    /// What it contributes if nothing occludes it, without MIS weights.
    value: SampledSpectrum,
}

impl ConnectionEdge {
    #[inline]
    fn new<B: Scattering>(camera: &SubpathVertex<B>, light: &SubpathVertex<B>) -> Option<Self> {
        let offset = light.surface.hit.point.p - camera.surface.hit.point.p;
        let inverse = 1.0 / offset.length_squared();
        let d = offset * inverse.sqrt();
        let at_camera = camera.scatter_to::<false>(d)?;
        let at_light = light.scatter_to::<true>(-d)?;
        let value = camera.throughput * at_camera.value * light.throughput * at_light.value * inverse;
        if !value.is_within(MAX_VALUE) {
            faults::raise(FaultyValue::Connection, value.into(), Some(camera.surface.hit.surface), None);
            return None;
        }
        (!value.is_black()).then_some(Self { at_camera, at_light, inverse, d, value })
    }

    #[inline]
    fn weight<B: Scattering>(&self, camera: &SubpathVertex<B>, light: &SubpathVertex<B>) -> f32 {
        connection_weight(&camera.mis, &self.at_camera, &light.mis, &self.at_light, self.inverse)
    }
}

/// Works out the importance of every pair and returns their sum. Pairs that make paths of more than `longest` segments have none.
#[inline(always)]
fn find_importances<B: Scattering>(
    camera: &[ConnectableVertex<B>],
    light: &[ConnectableVertex<B>],
    importances: &mut Vec<f32>,
    longest: u32,
) -> f32 {
    importances.clear();
    let mut total = 0.0;
    for camera in camera {
        let room = longest - camera.summary.depth;
        for light in light {
            let fits = light.summary.depth < room;
            let importance = if fits { importance(camera, light) } else { 0.0 };
            total += importance;
            importances.push(importance);
        }
    }
    total
}

impl BidirectionalTracer {
    /// s ≥ 2, t ≥ 2: adds about [`CONNECTIONS`] connections between these vertices of a camera subpath and of the light subpaths, each
    /// made with a probability in proportion to its importance (and fewer, where what was found otherwise is large beside
    /// that), by systematic sampling with the one number `u`.
    #[inline(always)]
    pub(super) fn add_connections<B: Scattering>(
        &self,
        path: &mut PathContribution,
        camera: &[ConnectableVertex<B>],
        light: &[ConnectableVertex<B>],
        importances: &mut Vec<f32>,
        u: f32,
    ) {
        let total = find_importances(camera, light, importances, self.context.longest());
        if total <= 0.0 {
            return;
        }
        // An infinite sum makes 0 of the scale, with which nothing would be connected.
        let brightness = path.radiance.0.element_sum();
        let scale = (CONNECTIONS / (total + brightness / SHARE)).max(f32::MIN_POSITIVE);
        let typical = SMALL * SHARE / scale;
        let mut sum = u;
        for (camera, row) in camera.iter().zip(importances.chunks_exact(light.len())) {
            for (light, &importance) in light.iter().zip(row) {
                let probability = (scale * importance).min(1.0);
                sum += probability;
                if sum >= 1.0 && importance > 0.0 {
                    sum -= 1.0;
                    // Where a pair was chosen, what is left over is uniform up to its probability.
                    let (factor, u) = (SHARE / probability, sum / probability);
                    self.add_connection(path, &camera.vertex, &light.vertex, factor, typical, u);
                }
            }
        }
    }

    /// Makes a connection, whose contribution has this factor, over its probability and the number of light subpaths. One that turns
    /// out to contribute less than `typical`, a sum over the wavelengths, is made only in proportion to that, by the number `u`.
    #[inline]
    fn add_connection<B: Scattering>(
        &self,
        path: &mut PathContribution,
        camera: &SubpathVertex<B>,
        light: &SubpathVertex<B>,
        factor: f32,
        typical: f32,
        u: f32,
    ) {
        let Some(edge) = ConnectionEdge::new(camera, light) else { return };
        let mut value = edge.value * (edge.weight(camera, light) * factor);
        let probability = value.0.element_sum() / typical;
        if u >= probability {
            return;
        }
        value *= 1.0 / probability.min(1.0);
        if !value.is_within(MAX_VALUE) {
            return faults::raise(
                FaultyValue::Connection,
                value.into(),
                Some(camera.surface.hit.surface),
                None,
            );
        }
        let share = self.context.scene.connected(&camera.surface.hit, &light.surface.hit, edge.d);
        B::record(|| PathEvent::Connection {
            camera: camera.surface.hit.point.p,
            light: light.surface.hit.point.p,
            value,
            visible: share,
        });
        if share > 0.0 {
            let wavelength_mis = camera
                .wavelength_mis
                .and(edge.at_camera.wavelength_mis)
                .and(light.wavelength_mis)
                .and(edge.at_light.wavelength_mis);
            path.radiance += value * (wavelength_mis.weight() * share);
        }
    }
}
