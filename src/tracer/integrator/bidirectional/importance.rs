//! The importances of one camera vertex and all light vertices, many at a time.
//!
//! Vertices of light subpaths stand in rows, one number of each vertex in each row, so that the loops below are compiled to lanes: eight with
//! AVX2, sixteen with AVX-512. A pair takes about .5 ns there, a seventh of what one at a time takes. Every instruction set gives the same
//! bits: no product is fused with a sum, and sums have sixteen parts that are added in one order.

use glam::{Vec3, Vec4};

use crate::tracer::accel::for_kernel;
use crate::tracer::bsdf::Scattering;
use crate::tracer::subpath::SubpathVertex;
use crate::tracer::subpath_mis::CONNECTION_SAMPLES;

/// Numbers of a row that are worked out together; the length of a row is a multiple of it.
pub(super) const LANES: usize = 16;

/// Least MIS weight of an importance: the true weight may be larger than what is known of it.
pub(super) const LEAST_WEIGHT: f32 = 0.01;

/// Greatest importance, so that the sum of all is finite however close two vertices are.
pub(super) const GREATEST: f32 = 1e30;

/// The data of a diffuse vertex from which the importance of a pair is computed. The throughput of any other vertex is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DiffuseSummary {
    p: Vec3,
    /// Shading normal; what lies behind gets nothing.
    n: Vec3,
    /// Throughput times BRDF.
    throughput: Vec4,
    /// 1 / (π · density), times what the strategy in which the vertex belongs to the other subpath counts over a connection.
    spread: f32,
    /// Number of segments on the way here.
    depth: f32,
}

impl DiffuseSummary {
    #[inline(always)]
    pub(super) fn new<B: Scattering>(vertex: &SubpathVertex<B>) -> Self {
        let surface = &vertex.surface;
        // Seen from behind a diffuse surface is black.
        let throughput = match surface.bsdf.as_diffuse() {
            Some(b) if surface.wo.z > 0.0 => (vertex.throughput * b.albedo).0 * std::f32::consts::FRAC_1_PI,
            _ => Vec4::ZERO,
        };
        let link = vertex.mis.link[0] / CONNECTION_SAMPLES;
        let spread = link * std::f32::consts::FRAC_1_PI / vertex.mis.fwd;
        let (p, n) = (surface.hit.point.p, surface.frame.n);
        Self { p, n, throughput, spread, depth: vertex.depth as f32 }
    }
}

/// Numbers of [`LANES`] vertices.
type Lanes = [f32; LANES];

/// Summaries of [`LANES`] light vertices.
#[derive(Clone, Copy, Debug, Default)]
struct LightBlock {
    p: [Lanes; 3],
    n: [Lanes; 3],
    throughput: [Lanes; 4],
    spread: Lanes,
    depth: Lanes,
}

/// Summaries of light vertices, a block after the other.
#[derive(Debug, Default)]
pub(super) struct LightRows {
    blocks: Vec<LightBlock>,
    /// Number of vertices; what follows in the last block is padding of importance 0.
    vertices: usize,
}

impl LightRows {
    pub(super) fn clear(&mut self) {
        self.blocks.clear();
        self.vertices = 0;
    }

    /// Appends a vertex.
    pub(super) fn push(&mut self, summary: &DiffuseSummary) {
        let DiffuseSummary { p, n, throughput, spread, depth } = *summary;
        let lane = self.vertices % LANES;
        if lane == 0 {
            self.blocks.push(LightBlock::default());
        }
        self.vertices += 1;
        let Some(block) = self.blocks.last_mut() else { return };
        for axis in 0..3 {
            (block.p[axis][lane], block.n[axis][lane]) = (p[axis], n[axis]);
        }
        for wavelength in 0..4 {
            block.throughput[wavelength][lane] = throughput[wavelength];
        }
        (block.spread[lane], block.depth[lane]) = (spread, depth);
    }

    /// Length of a row of importances, a multiple of [`LANES`].
    pub(super) fn stride(&self) -> usize {
        self.blocks.len() * LANES
    }
}

/// The input of a row of importances: a camera vertex and all light vertices.
pub(super) struct CameraRow<'a> {
    pub(super) camera: DiffuseSummary,
    pub(super) light: &'a LightRows,
    /// Light vertices of this depth and more would make paths that are too long.
    pub(super) room: f32,
}

for_kernel! {
    /// Works out the importances of a row and returns their sum. An importance is about what the pair would contribute if nothing occludes
    /// it: exact but for its MIS weight, of which the larger part is known. NaN where an infinite density meets nothing.
    pub(super) find_importances => importances_of(row: &CameraRow<'_>, out: &mut [f32]) -> f32
}

for_kernel! {
    /// The sums, over [`LANES`] at a time, of the probabilities `scale` · importance, at most 1 each.
    pub(super) sum_probabilities => probability_sums(importances: &[f32], scale: f32, sums: &mut Vec<f32>) -> ()
}

#[inline(always)]
fn importances_of(row: &CameraRow<'_>, out: &mut [f32]) -> f32 {
    let mut sums = [0.0; LANES];
    let (out, _) = out.as_chunks_mut::<LANES>();
    for (light, out) in row.light.blocks.iter().zip(out) {
        *out = importances_of_block(&row.camera, light, row.room);
        for k in 0..LANES {
            sums[k] += out[k];
        }
    }
    sums.iter().sum()
}

#[inline(always)]
fn importances_of_block(camera: &DiffuseSummary, light: &LightBlock, room: f32) -> Lanes {
    let DiffuseSummary { p, n, throughput: a, spread, .. } = *camera;
    let LightBlock { p: q, n: m, throughput: b, .. } = light;
    let mut importances = [0.0; LANES];
    for k in 0..LANES {
        let (x, y, z) = (q[0][k] - p.x, q[1][k] - p.y, q[2][k] - p.z);
        let ca = x * n.x + y * n.y + z * n.z;
        let cb = -(x * m[0][k] + y * m[1][k] + z * m[2][k]);
        let inverse = 1.0 / (x * x + y * y + z * z);
        let g = ca * cb * inverse * inverse;
        let (u, v) = (g * spread, g * light.spread[k]);
        let weight = 1.0 / (1.0 + u * u + v * v);
        let weight = if weight < LEAST_WEIGHT { LEAST_WEIGHT } else { weight };
        let value = g * (a.x * b[0][k] + a.y * b[1][k] + a.z * b[2][k] + a.w * b[3][k]) * weight;
        let value = if value > GREATEST { GREATEST } else { value };
        let counts = (ca > 0.0) & (cb > 0.0) & (light.depth[k] < room);
        importances[k] = if counts { value } else { 0.0 };
    }
    importances
}

#[inline(always)]
fn probability_sums(importances: &[f32], scale: f32, sums: &mut Vec<f32>) {
    sums.clear();
    for lanes in importances.as_chunks::<LANES>().0 {
        let mut probabilities = [0.0; LANES];
        for k in 0..LANES {
            let probability = scale * lanes[k];
            probabilities[k] = if probability > 1.0 { 1.0 } else { probability };
        }
        // In halves, which takes four steps instead of sixteen.
        for half in [8, 4, 2, 1] {
            for k in 0..half {
                probabilities[k] += probabilities[k + half];
            }
        }
        sums.push(probabilities[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::bits::mix;
    use crate::tracer::accel::{AvailableKernel, SimdKernel};

    /// Vertices in a box of side 2, of which some look away and every seventh is not diffuse.
    fn vertices(count: u64, seed: u64) -> Vec<DiffuseSummary> {
        let number = |i: u64, k: u64| (mix(seed ^ mix(16 * i + k)) >> 40) as f32 / (1u64 << 24) as f32;
        let triple = |i: u64, k: u64| Vec3::new(number(i, k), number(i, k + 1), number(i, k + 2));
        let one = |i: u64| {
            let throughput = if i % 7 == 6 { Vec4::ZERO } else { triple(i, 6).extend(number(i, 9)) };
            let n = (triple(i, 3) - 0.5).normalize();
            let spread = 0.1 + number(i, 10);
            DiffuseSummary { p: 2.0 * triple(i, 0), n, throughput, spread, depth: (1 + i % 5) as f32 }
        };
        (0..count).map(one).collect()
    }

    /// The importance of one pair in `f64`.
    fn exact(a: &DiffuseSummary, b: &DiffuseSummary, room: f32) -> f64 {
        let offset = (b.p - a.p).as_dvec3();
        let (ca, cb) = (offset.dot(a.n.as_dvec3()), -offset.dot(b.n.as_dvec3()));
        if ca <= 0.0 || cb <= 0.0 || b.depth >= room {
            return 0.0;
        }
        let g = ca * cb / offset.length_squared().powi(2);
        let density = |spread: f32| g * f64::from(spread);
        let weight = 1.0 / (1.0 + density(a.spread).powi(2) + density(b.spread).powi(2));
        g * a.throughput.as_dvec4().dot(b.throughput.as_dvec4()) * weight.max(f64::from(LEAST_WEIGHT))
    }

    fn kernels() -> impl Iterator<Item = AvailableKernel> {
        SimdKernel::ALL.into_iter().filter_map(SimdKernel::available)
    }

    #[test]
    fn every_kernel_finds_the_importances_of_pairs() {
        for count in [0, 1, 15, 16, 17, 100] {
            let mut rows = LightRows::default();
            let light = vertices(count, 1);
            light.iter().for_each(|vertex| rows.push(vertex));
            for camera in vertices(20, 2) {
                let row = CameraRow { camera, light: &rows, room: 4.0 };
                let of = |kernel| {
                    let mut out = vec![f32::NAN; rows.stride()];
                    let sum = find_importances(kernel, &row, &mut out);
                    (sum.to_bits(), out.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
                };
                let (sum, bits) = of(SimdKernel::Scalar.available().expect("any processor runs it"));
                assert!(kernels().all(|kernel| of(kernel) == (sum, bits.clone())));
                let exact: Vec<f64> = light.iter().map(|light| exact(&camera, light, 4.0)).collect();
                let total: f64 = exact.iter().sum();
                let found: Vec<f64> = bits.iter().map(|&v| f64::from(f32::from_bits(v))).collect();
                let (found, padding) = found.split_at(light.len());
                for (found, exact) in found.iter().zip(exact) {
                    assert!((found - exact).abs() <= 1e-4 * exact + 1e-6 * total, "{found} {exact}");
                }
                assert!(padding.iter().all(|&importance| importance == 0.0));
                assert!((f64::from(f32::from_bits(sum)) - total).abs() <= 1e-4 * total);
            }
        }
    }

    #[test]
    fn probabilities_are_summed_up_to_one_each() {
        let importances: Vec<f32> = (0..64).map(|i| (i % 9) as f32 * 0.2).collect();
        for kernel in kernels() {
            let mut sums = vec![7.0];
            sum_probabilities(kernel, &importances, 0.9, &mut sums);
            assert_eq!(sums.len(), 4);
            for (sum, lanes) in sums.iter().zip(importances.chunks(LANES)) {
                let expected: f32 = lanes.iter().map(|v| (0.9 * v).min(1.0)).sum();
                assert!((sum - expected).abs() < 1e-5, "{sum} {expected}");
            }
        }
    }
}
