//! Which vertices of camera and light subpaths are connected: a few of all pairs, chosen by their importance.
//!
//! The importance of a pair is an estimate of what it would contribute. A connection that is made stands for those that are
//! not: its contribution is divided by its probability, so that expected values are those of full
//! connection. Pairs of diffuse vertices are made with all light subpaths of the group, others with those of the index. relMSE at equal time (scaled to 512 × 512 and 20 CPU seconds, `benchmarks methods`), the first six with one light subpath to each camera subpath:
//!
//! | connections of a camera subpath | Cornell box | with glass and mirror | lit from a cove |
//! |---|---|---|---|
//! | all | .0096 | .0248 | .0585 |
//! | all, light subpaths ended early by roulette | .0085 | .0232 | .0721 |
//! | one, uniformly chosen | .0189 | .0261 | – |
//! | four, uniformly chosen | .0101 | .0222 | .1312 |
//! | one, by importance | .0111 | .0216 | .1035 |
//! | six, by importance | .0076 | .0211 | .0489 |
//! | six, by importance, of four light subpaths to eight camera subpaths | .0052 | .0172 | .0362 |
//!
//! Where all light that matters comes through a lens (`scenes/caustic.xml`) half as many light subpaths cost: .039 against
//! .032 with all connections and one light subpath each.
//!
//! The last row chooses from four light subpaths, which are noisier than all that follows. So a group of indices shares its subpaths
//! ([`light_pool`](super::light_pool)): at the same number of subpaths each camera subpath has four times as many to choose from. A
//! connection is then better than its density says, and the weights count it as several samples
//! ([`CONNECTION_SAMPLES`](crate::tracer::subpath_mis::CONNECTION_SAMPLES)). relMSE at equal time again, another machine:
//!
//! | | Cornell box | with glass and mirror | lit from a cove | room behind a door |
//! |---|---|---|---|---|
//! | six, of the four light subpaths of the index | .0038 | .0132 | .0278 | .37 |
//! | six, of the 16 of its group; importances many at a time; 4 samples; splats count as .4 | .0024 | .0127 | .0257 | .24 |
//! | nine | .0023 | | .0224 | |
//! | **ten, light subpaths ended earlier by roulette** | **.0022** | **.0134** | **.0200** | **.20** |
//! | twelve | .0022 | .0144 | .0202 | .20 |
//! | ten, of the 32 of twice as many indices | .0022 | .0134 | .0199 | .20 |
//!
//! Weights without these counts make the connections of 16 subpaths 1.3 times as noisy in the box. Importances that knew what is
//! occluded would take another third from the noise of the last two scenes.

use std::ops::Range;

use glam::Vec3;

use crate::spectrum::SampledSpectrum;
use crate::stream::{FaultyValue, MAX_VALUE, faults};
use crate::tracer::accel::AvailableKernel;
use crate::tracer::bsdf::Scattering;
use crate::tracer::integrator::pair::{ForEyes, SharedVertex};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::EdgeWavelengths;
use crate::tracer::record::PathEvent;
use crate::tracer::subpath::{SubpathVertex, VertexScattering};

use super::importance::{
    CameraRow, DiffuseSummary, GREATEST, LANES, LEAST_WEIGHT, find_importances, sum_probabilities,
};
use super::light_pool::{GROUP, LightPool};
use super::strategies::{PathContribution, connection_weight};
use super::tracer::{BidirectionalTracer, LIGHT_SUBPATHS};

/// Mean number of connections of one camera subpath.
const CONNECTIONS: f32 = 10.0;

/// A connection is small if it contributes less than this share of the mean. Small ones are made at random, in proportion.
const SMALL: f32 = 0.25;

/// One over the number of light subpaths of a group.
const SHARE: f32 = 1.0 / (GROUP * LIGHT_SUBPATHS) as f32;

/// Pairs of a camera vertex and a light vertex, row by row: one row for each camera vertex.
#[derive(Debug, Default)]
pub(super) struct Candidates {
    importances: Vec<f32>,
    /// Sums of the probabilities of [`LANES`] pairs.
    sums: Vec<f32>,
    /// The light vertices of the index itself.
    own: Range<usize>,
}

impl Candidates {
    /// Begins an index, whose own light vertices stand at `own`.
    pub(super) fn begin(&mut self, own: Range<usize>) {
        self.own = own;
    }
}

#[cold]
fn general_importance<B: Scattering>(
    camera: &SubpathVertex<B>,
    shared: Option<&SharedVertex>,
    light: &SubpathVertex<B>,
) -> f32 {
    let Some(edge) = ConnectionEdge::new(camera, shared, light) else { return 0.0 };
    (edge.value.0.element_sum() * edge.weight(camera, light).max(LEAST_WEIGHT)).min(GREATEST)
}

/// True where the importance of a pair is that of two diffuse surfaces. Such pairs are made with all light subpaths of the group, others,
/// whose importances take longer, with those of the index.
#[inline(always)]
fn is_diffuse<B: Scattering>(vertex: &SubpathVertex<B>) -> bool {
    vertex.surface.bsdf.as_diffuse().is_some()
}

/// The edge between two vertices, which scatter to each other.
struct ConnectionEdge {
    at_camera: VertexScattering,
    at_light: VertexScattering,
    /// 1 over its squared length.
    inverse: f32,
    /// Unit direction from the camera's vertex to the light's.
    d: Vec3,
    /// Unoccluded contribution, without MIS weight; the greater of two eyes.
    value: SampledSpectrum,
    /// The share of each eye in it, where two share the camera's vertex.
    shares: Option<ForEyes<SampledSpectrum>>,
}

impl ConnectionEdge {
    #[inline]
    fn new<B: Scattering>(
        camera: &SubpathVertex<B>,
        shared: Option<&SharedVertex>,
        light: &SubpathVertex<B>,
    ) -> Option<Self> {
        let offset = light.surface.hit.point.p - camera.surface.hit.point.p;
        let inverse = 1.0 / offset.length_squared();
        let d = offset * inverse.sqrt();
        let (at_camera, shares) = match shared {
            None => (camera.scatter_to::<false>(d)?, None),
            Some(shared) => {
                let (scattering, shares) = shared.scatter_to(&camera.surface, d)?;
                (scattering, Some(shares))
            }
        };
        let at_light = light.scatter_to::<true>(-d)?;
        let value = camera.throughput * at_camera.value * light.throughput * at_light.value * inverse;
        if !value.is_within(MAX_VALUE) {
            faults::raise(FaultyValue::Connection, value.into(), camera.surface.hit.known_surface(), None);
            return None;
        }
        (!value.is_black()).then_some(Self { at_camera, at_light, inverse, d, value, shares })
    }

    #[inline]
    fn weight<B: Scattering>(&self, camera: &SubpathVertex<B>, light: &SubpathVertex<B>) -> f32 {
        connection_weight(&camera.mis, &self.at_camera, &light.mis, &self.at_light, self.inverse)
    }
}

/// Works out the importances of the pairs of `camera`, which two eyes may share and whose row is `out`, and returns their sum.
#[inline(always)]
fn find_row<B: Scattering>(
    kernel: AvailableKernel,
    camera: &SubpathVertex<B>,
    shared: Option<&SharedVertex>,
    (pool, own): (&LightPool<B>, Range<usize>),
    room: u32,
    out: &mut [f32],
) -> f32 {
    let mut total = 0.0;
    if is_diffuse(camera) {
        let row = CameraRow { camera: DiffuseSummary::new(camera), light: &pool.rows, room: room as f32 };
        total = find_importances(kernel, &row, out);
        if total.is_nan() {
            total = mend(camera, shared, &pool.vertices, out);
        }
    }
    for (light, importance) in pool.vertices[own.clone()].iter().zip(&mut out[own]) {
        if !(is_diffuse(camera) && is_diffuse(light)) && light.depth < room {
            *importance = GROUP as f32 * general_importance(camera, shared, light);
            total += *importance;
        }
    }
    total
}

/// Puts importances in the place of those that are no numbers, because an infinite density met nothing, and returns the sum. The edge itself
/// tells what is wrong, if anything is, and all other pairs keep theirs.
#[cold]
fn mend<B: Scattering>(
    camera: &SubpathVertex<B>,
    shared: Option<&SharedVertex>,
    light: &[SubpathVertex<B>],
    row: &mut [f32],
) -> f32 {
    for (light, importance) in light.iter().zip(&mut *row) {
        if importance.is_nan() {
            *importance = if is_diffuse(light) { general_importance(camera, shared, light) } else { 0.0 };
        }
    }
    row.iter().sum()
}

/// Sums of probabilities may be rounded: where they come this near to 1, each is added by itself.
const NEARLY_ONE: f32 = 0.9999;

impl BidirectionalTracer {
    /// s ≥ 2, t ≥ 2: adds about [`CONNECTIONS`] connections between these vertices of a camera subpath and of the light subpaths, each
    /// made with a probability in proportion to its importance (and fewer, where what was found otherwise is large beside
    /// that), by systematic sampling with the one number `u`.
    #[inline(always)]
    pub(super) fn add_connections<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        camera: &[SubpathVertex<B>],
        pool: &LightPool<B>,
        candidates: &mut Candidates,
        u: f32,
    ) {
        let shared = path.shared_vertex();
        let total = self.find_pairs(camera, shared.as_ref(), pool, candidates);
        if total <= 0.0 {
            return;
        }
        let brightness = path.brightness();
        // An infinite sum would make 0 of the scale, with which nothing is connected, and a tiny one infinity, which times nothing is no number.
        let scale = (CONNECTIONS / (total + brightness / SHARE)).clamp(f32::MIN_POSITIVE, f32::MAX);
        let typical = SMALL * SHARE / scale;
        let (stride, Candidates { importances, sums, .. }) = (pool.rows.stride(), candidates);
        sum_probabilities(self.context.scene.accel().available_kernel(), importances, scale, sums);
        let mut sum = u;
        for (lanes, probabilities) in sums.iter().enumerate() {
            if sum + probabilities < NEARLY_ONE {
                sum += probabilities;
                continue;
            }
            for pair in lanes * LANES..(lanes + 1) * LANES {
                let importance = importances[pair];
                let probability = (scale * importance).min(1.0);
                sum += probability;
                if sum >= 1.0 && importance > 0.0 {
                    sum -= 1.0;
                    let (camera, light) = (&camera[pair / stride], &pool.vertices[pair % stride]);
                    let group = if B::Credits::KEPT { pool.group(pair % stride) } else { 0 };
                    let subpaths = if is_diffuse(camera) && is_diffuse(light) { 1.0 } else { GROUP as f32 };
                    // Where a pair was chosen, what is left over is uniform up to its probability.
                    let (factor, u) = (subpaths * SHARE / probability, sum / probability);
                    let shared = shared.as_ref().filter(|_| camera.depth == 1);
                    self.add_connection(path, (camera, shared), (light, group), factor, typical, u);
                }
            }
        }
    }

    /// Works out the importance of every pair and returns their sum. Pairs that make too long a path have none.
    #[inline(always)]
    fn find_pairs<B: Scattering>(
        &self,
        camera: &[SubpathVertex<B>],
        shared: Option<&SharedVertex>,
        pool: &LightPool<B>,
        candidates: &mut Candidates,
    ) -> f32 {
        let Candidates { importances, own, .. } = candidates;
        let (kernel, stride) = (self.context.scene.accel().available_kernel(), pool.rows.stride());
        importances.clear();
        importances.resize(stride * camera.len(), 0.0);
        if stride == 0 {
            return 0.0;
        }
        let mut total = 0.0;
        for (camera, out) in camera.iter().zip(importances.chunks_exact_mut(stride)) {
            let room = self.context.longest() - camera.depth;
            let shared = shared.filter(|_| camera.depth == 1);
            total += find_row(kernel, camera, shared, (pool, own.clone()), room, out);
        }
        total
    }

    /// Adds the connection of a camera vertex, which two eyes may share, to a vertex of a light subpath, given with its group of lights. `factor` is one over the probability of the pair and the
    /// number of light subpaths. Connections that contribute less than `typical`, a sum over the wavelengths, are subject to Russian roulette by `u`.
    #[inline]
    fn add_connection<B: Scattering>(
        &self,
        path: &mut PathContribution<B::Credits>,
        (camera, shared): (&SubpathVertex<B>, Option<&SharedVertex>),
        (light, group): (&SubpathVertex<B>, u8),
        factor: f32,
        typical: f32,
        u: f32,
    ) {
        let Some(edge) = ConnectionEdge::new(camera, shared, light) else { return };
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
                camera.surface.hit.known_surface(),
                None,
            );
        }
        let wavelength_mis = camera
            .wavelength_mis
            .and(edge.at_camera.wavelength_mis)
            .and(light.wavelength_mis)
            .and(edge.at_light.wavelength_mis);
        let wavelengths = EdgeWavelengths { lambda: &path.lambda, mis: wavelength_mis };
        let factor =
            camera.surface.connection_factor(&self.context.scene, &light.surface, edge.d, wavelengths);
        B::record(|| PathEvent::Connection {
            camera: camera.surface.hit.point.p,
            light: light.surface.hit.point.p,
            value,
            visible: factor.max_element(),
        });
        if !factor.is_black() {
            let value = value * (factor * wavelength_mis.weight());
            path.add(value, edge.shares.as_ref());
            path.credits.add_to(group, value);
        }
    }
}
