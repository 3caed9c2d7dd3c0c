//! Which vertices of camera and light subpaths are connected: a few of all pairs, by what they promise.
//!
//! Every pair that is made stands for those that are not: what it gives is divided by its probability, so that expected
//! values and weights are those of full connection. relMSE at equal time (scaled to 512 × 512 and 20 CPU seconds,
//! `tools/bench_methods`), the first six with one light subpath to each camera subpath:
//!
//! | connections of a camera subpath | Cornell box | with glass and mirror | lit from a cove |
//! |---|---|---|---|
//! | all | .0096 | .0248 | .0585 |
//! | all, light subpaths ended early by roulette | .0085 | .0232 | .0721 |
//! | one, uniformly chosen | .0189 | .0261 | – |
//! | four, uniformly chosen | .0101 | .0222 | .1312 |
//! | one, by its promise | .0111 | .0216 | .1035 |
//! | six, by their promise | .0076 | .0211 | .0489 |
//! | **six, by their promise, of four light subpaths to eight camera subpaths** | **.0052** | **.0172** | **.0362** |
//!
//! Where all light that matters comes through a lens (`scenes/caustic.xml`) half as many light subpaths cost: .039 against
//! .032 with all connections and one light subpath each.

use glam::{Vec3, Vec4};

use crate::spectrum::SampledSpectrum;
use crate::tracer::bsdf::Scattering;
use crate::tracer::subpath::{Scattered, Vertex};

use super::BidirectionalTracer;
use super::found::Found;
use super::weight::{self, Edge};

/// Connections of one camera subpath, about.
const CONNECTIONS: f32 = 6.0;

/// What a connection gives counts as little below this share of what one gives on average.
const SMALL: f32 = 0.25;

/// Least weight that is promised: the true one may be larger than what is known of it.
const LEAST: f32 = 0.01;

/// A vertex that can be connected.
#[derive(Clone, Copy, Debug)]
pub struct End<B> {
    /// What of it the promise of a pair needs, close together.
    sketch: Sketch,
    vertex: Vertex<B>,
}

/// A diffuse vertex in few words.
#[derive(Clone, Copy, Debug)]
struct Sketch {
    p: Vec3,
    /// Shading normal; what lies behind gets nothing.
    n: Vec3,
    /// Throughput times what it scatters.
    carried: Vec4,
    /// 1 / (π · density).
    spread: f32,
    depth: u32,
    diffuse: bool,
}

impl<B: Scattering> End<B> {
    pub(super) fn new(vertex: Vertex<B>) -> Self {
        let (carried, diffuse) = match vertex.bsdf.as_diffuse() {
            Some(b) if vertex.wo.z > 0.0 => {
                ((vertex.throughput * b.albedo()).0 * std::f32::consts::FRAC_1_PI, true)
            }
            // Seen from behind it is black.
            Some(_) => (Vec4::ZERO, true),
            None => (Vec4::ZERO, false),
        };
        let spread = std::f32::consts::FRAC_1_PI / vertex.chain.fwd;
        let (p, n, depth) = (vertex.hit.point.p, vertex.frame.n, vertex.depth);
        Self { sketch: Sketch { p, n, carried, spread, depth, diffuse }, vertex }
    }
}

/// About what a pair would give, the visibility apart: exact but for its weight, of which the larger part is known.
#[inline]
fn promise<B: Scattering>(eye: &End<B>, light: &End<B>) -> f32 {
    let (a, b) = (&eye.sketch, &light.sketch);
    if !(a.diffuse && b.diffuse) {
        return promise_of_any(&eye.vertex, &light.vertex);
    }
    let offset = b.p - a.p;
    let (ca, cb) = (offset.dot(a.n), -offset.dot(b.n));
    if !(ca > 0.0 && cb > 0.0) {
        return 0.0;
    }
    // Bounded, so that the sum of all promises is finite however close two vertices are.
    let inverse = (1.0 / offset.length_squared()).min(1e18);
    let g = ca * cb * inverse * inverse;
    let (x, y) = (g * a.spread, g * b.spread);
    let weight = 1.0 / (1.0 + x * x + y * y);
    g * a.carried.dot(b.carried) * weight.max(LEAST)
}

#[cold]
fn promise_of_any<B: Scattering>(eye: &Vertex<B>, light: &Vertex<B>) -> f32 {
    let Some(pair) = Pair::of(eye, light) else { return 0.0 };
    pair.value_sum() * pair.weight(eye, light).max(LEAST)
}

/// How a chosen connection counts.
struct Connection {
    /// Over its probability and the number of light subpaths.
    factor: f32,
    /// Sum over the wavelengths from which on it is made for certain.
    typical: f32,
    /// In [0, 1).
    u: f32,
}

/// Two vertices and what they scatter to each other.
struct Pair {
    at_eye: Scattered,
    at_light: Scattered,
    inverse: f32,
    d: Vec3,
    value: SampledSpectrum,
}

impl Pair {
    #[inline]
    fn of<B: Scattering>(eye: &Vertex<B>, light: &Vertex<B>) -> Option<Self> {
        let offset = light.hit.point.p - eye.hit.point.p;
        let inverse = 1.0 / offset.length_squared();
        let d = offset * inverse.sqrt();
        let at_eye = eye.scatter_to::<false>(d)?;
        let at_light = light.scatter_to::<true>(-d)?;
        let value = eye.throughput * at_eye.value * light.throughput * at_light.value * inverse;
        let usable = !value.is_black() && value.is_finite();
        usable.then_some(Self { at_eye, at_light, inverse, d, value })
    }

    fn value_sum(&self) -> f32 {
        self.value.0.element_sum()
    }

    #[inline]
    fn weight<B: Scattering>(&self, eye: &Vertex<B>, light: &Vertex<B>) -> f32 {
        let edge = Edge { eye: &self.at_eye, light: &self.at_light, inverse: self.inverse };
        weight::connected(&eye.chain, &light.chain, &edge)
    }
}

/// The vertices that one camera subpath can be connected with, and where the promises of the pairs go.
pub(super) struct Pool<'a, B> {
    pub(super) eyes: &'a [End<B>],
    pub(super) lights: &'a [End<B>],
    pub(super) promises: &'a mut Vec<f32>,
    /// One over the number of light subpaths.
    pub(super) share: f32,
}

impl<B: Scattering> Pool<'_, B> {
    /// Works out the promise of every pair that makes no path of more than `longest` segments; their sum.
    #[inline]
    fn survey(&mut self, longest: u32) -> f32 {
        self.promises.clear();
        let mut total = 0.0;
        for eye in self.eyes {
            let room = longest - eye.sketch.depth;
            for light in self.lights {
                let fits = light.sketch.depth < room;
                let promise = if fits { promise(eye, light) } else { 0.0 };
                total += promise;
                self.promises.push(promise);
            }
        }
        total
    }
}

impl BidirectionalTracer {
    /// s ≥ 2, t ≥ 2: connects about [`CONNECTIONS`] pairs, each with a probability in proportion to what it promises (and
    /// fewer, where what was found otherwise is large beside that), by systematic sampling with the one number `u`.
    #[inline]
    pub(super) fn connect_some<B: Scattering>(&self, found: &mut Found, mut pool: Pool<B>, u: f32) {
        let total = pool.survey(self.context.longest());
        if total.is_nan() || total <= 0.0 {
            return;
        }
        let Pool { eyes, lights, promises, share } = pool;
        // An infinite sum makes 0 of the scale, with which nothing would be connected.
        let scale = (CONNECTIONS / (total + found.brightness() / share)).max(f32::MIN_POSITIVE);
        let typical = SMALL * share / scale;
        let mut sum = u;
        for (eye, row) in eyes.iter().zip(promises.chunks_exact(lights.len())) {
            for (light, &promise) in lights.iter().zip(row) {
                let chance = (scale * promise).min(1.0);
                sum += chance;
                if sum >= 1.0 && promise > 0.0 {
                    sum -= 1.0;
                    // Where a pair was chosen, what is left over is uniform up to its chance.
                    let connection = Connection { factor: share / chance, typical, u: sum / chance };
                    self.connect(found, (&eye.vertex, &light.vertex), connection);
                }
            }
        }
    }

    /// Makes a connection, unless it is found to give little: then only in proportion to that.
    #[inline]
    fn connect<B: Scattering>(
        &self,
        found: &mut Found,
        (eye, light): (&Vertex<B>, &Vertex<B>),
        connection: Connection,
    ) {
        let Connection { factor, typical, u } = connection;
        let Some(pair) = Pair::of(eye, light) else { return };
        let mut value = pair.value * (pair.weight(eye, light) * factor);
        let chance = value.0.element_sum() / typical;
        if u >= chance {
            return;
        }
        value *= 1.0 / chance.min(1.0);
        if value.is_finite()
            && !value.is_black()
            && self.context.scene.connected(&eye.hit, &light.hit, pair.d)
        {
            let wavelength_mis = eye
                .wavelength_mis
                .and(pair.at_eye.wavelength_mis)
                .and(light.wavelength_mis)
                .and(pair.at_light.wavelength_mis);
            found.radiance += value * wavelength_mis.weight();
        }
    }
}
