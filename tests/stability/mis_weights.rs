//! Weights of multiple importance sampling for densities from 1e-38 to 1e38, for 0, for infinity and for deltas.

use glam::Vec4;

use pointillist::math::pdf::PdfW;
use pointillist::math::random::Random;
use pointillist::tracer::mis::power;
use pointillist::tracer::subpath_mis::{SubpathMis, weight};
use pointillist::tracer::wavelength_mis::WavelengthMis;

use crate::Row;

/// How far some weights are from a partition of one: NaN and weights outside [0, 1] count as 1.
fn fault(weights: &[f64]) -> f64 {
    let valid = weights.iter().all(|w| (0.0..=1.0 + 1e-7).contains(w));
    if valid { (weights.iter().sum::<f64>() - 1.0).abs() } else { 1.0 }
}

/// A density log-uniform over the whole range of `f32`.
fn density(random: &mut Random) -> f32 {
    10f32.powf(random.within(-38.0, 38.5))
}

#[test]
fn n13_two_strategies() {
    let naive = |a: f32, b: f32| f64::from(a * a / (a * a + b * b));
    let ours = |a: f32, b: f32| f64::from(power(PdfW(a), PdfW(b)));
    let mut random = Random(13);
    let mut worst = [0f64; 2];
    for _ in 0..100_000 {
        let (a, b) = (density(&mut random), density(&mut random));
        for (worst, of) in worst.iter_mut().zip([&ours as &dyn Fn(f32, f32) -> f64, &naive]) {
            *worst = worst.max(fault(&[of(a, b), of(b, a)]));
        }
    }
    Row {
        case: "N13 weights of two strategies, densities from 1e-38 to 1e38",
        measure: "largest error of their sum",
        figure: worst[0],
        naive: ("a² / (a² + b²)", worst[1]),
        bound: 1e-6,
    }
    .check();
    // What has no density has no weight, what is infinitely dense has all of it, and equal infinities share.
    let limits = [0.0, f32::from_bits(1), 1.0, f32::MAX, f32::INFINITY];
    let known = |a: f32, b: f32| match (a, b) {
        _ if a == 0.0 => Some(0.0),
        _ if a == b => Some(0.5),
        _ if a == f32::INFINITY || b == 0.0 => Some(1.0),
        _ if b == f32::INFINITY => Some(0.0),
        _ => None,
    };
    let error = |of: &dyn Fn(f32, f32) -> f64| {
        let pairs = limits.iter().flat_map(|&a| limits.map(|b| (a, b)));
        let errors = pairs.filter_map(|(a, b)| {
            let error = (of(a, b) - known(a, b)?).abs();
            Some(if error.is_nan() { 1.0 } else { error })
        });
        errors.fold(0.0, f64::max)
    };
    Row {
        case: "N13 weights of two strategies, densities 0, 1e-45, ∞",
        measure: "largest error of a weight",
        figure: error(&ours),
        naive: ("a² / (a² + b²)", error(&naive)),
        bound: 0.0,
    }
    .check();
    assert!([f32::NAN].iter().all(|&n| power(PdfW(n), PdfW(1.0)) == 0.0 && power(PdfW(1.0), PdfW(n)) == 0.0));
}

/// Densities of the vertices of a path, seen from the light and from the camera; `delta[j]` tells that vertex j has one direction only.
struct PathDensities {
    light: Vec<f32>,
    camera: Vec<f32>,
    delta: Vec<bool>,
    /// Densities per steradian to densities per area.
    back: f32,
}

impl PathDensities {
    fn random(random: &mut Random, vertices: usize, range: f32) -> Self {
        let delta: Vec<bool> =
            (0..vertices).map(|j| j > 0 && j + 1 < vertices && random.f32() < 0.2).collect();
        // A Dirac density is the same from both ends. In every other path all densities are at one end of the range.
        let extreme = random.below(2) == 0;
        let mut draw = |delta: &bool| match random.within(-1.0, 1.0) {
            _ if *delta => 1.0,
            at if extreme => 10f32.powf(range.copysign(at)),
            at => 10f32.powf(range * at),
        };
        let [light, camera] = [(); 2].map(|()| delta.iter().map(&mut draw).collect());
        Self { light, camera, delta, back: [1.0, 0.25][random.below(2)] }
    }

    /// The strategies: the number of vertices from the light. A connection has no delta at either end.
    fn strategies(&self) -> Vec<usize> {
        (1..self.light.len()).filter(|&s| !self.delta[s - 1] && !self.delta[s]).collect()
    }

    /// Weights by the definition, in logarithms.
    fn exact(&self) -> Vec<f64> {
        let ln = |densities: &[f32]| densities.iter().map(|&p| f64::from(p).ln()).sum::<f64>();
        let logs = self.strategies().into_iter().map(|s| ln(&self.light[..s]) + ln(&self.camera[s..]));
        let logs: Vec<f64> = logs.collect();
        let top = logs.iter().copied().fold(f64::MIN, f64::max);
        let total: f64 = logs.iter().map(|l| (2.0 * (l - top)).exp()).sum();
        logs.iter().map(|l| (2.0 * (l - top)).exp() / total).collect()
    }

    /// Weights by the definition, in single precision.
    fn naive(&self) -> Vec<f64> {
        let product = |s: usize| self.light[..s].iter().chain(&self.camera[s..]).product::<f32>();
        let squares: Vec<f32> = self.strategies().into_iter().map(|s| product(s).powi(2)).collect();
        let total: f32 = squares.iter().sum();
        squares.iter().map(|square| f64::from(square / total)).collect()
    }

    /// Weights by the sums that both subpaths carry.
    fn carried(&self) -> Vec<f64> {
        let ends = |j: usize| (self.light[j], self.camera[j], self.delta[j]);
        let weight = |s: usize| {
            let light: Vec<_> = (0..s).map(ends).collect();
            let camera: Vec<_> = (s..self.light.len()).rev().map(ends).map(|(l, c, d)| (c, l, d)).collect();
            f64::from(weight(self.sum(&camera), self.sum(&light)))
        };
        self.strategies().into_iter().map(weight).collect()
    }

    /// S at the last vertex of a walk of (density, density from the other end, delta). Its first vertex stays where it is.
    fn sum(&self, walk: &[(f32, f32, bool)]) -> f64 {
        let (mut tail, mut last) = (0.0, 0.0);
        for n in 1..walk.len() {
            // A delta counts as 1 from both ends.
            let fwd = |j: usize| if walk[j].2 { 1.0 } else { walk[j].0 };
            let rev = |j: usize| if walk[j].2 { 1.0 } else { walk[j].1 };
            let link = |j: usize| if j == 0 || walk[j].2 || walk[j - 1].2 { 0.0 } else { 1.0 };
            let mis = SubpathMis {
                fwd: fwd(n),
                fwd_w: fwd(n),
                back: self.back,
                link: [link(n); 2],
                previous_fwd: fwd(n - 1),
                previous_link: link(n - 1),
                tail,
            };
            let rev_w = rev(n - 1) / self.back;
            last = mis.sum(rev(n), rev_w, false);
            tail = mis.previous_sum(rev_w);
        }
        last
    }
}

/// All strategies of a path of three to eight vertices, some of them deltas.
#[test]
fn n13_strategies_of_a_path() {
    // Densities to 1e±38 are log-uniform; a quotient of two must stay a number where it is divided by 1/4.
    for (case, vertices, range) in
        [("three to five vertices", 3..6, 37.0), ("six to eight vertices", 6..9, 37.0)]
    {
        let mut random = Random(14);
        let mut worst = [0f64; 2];
        for _ in 0..20_000 {
            let n = vertices.start + random.below(vertices.len());
            let path = PathDensities::random(&mut random, n, range);
            let exact = path.exact();
            if exact.is_empty() {
                continue;
            }
            let off = |weights: &[f64]| {
                let apart = weights.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                fault(weights).max(apart)
            };
            for (worst, weights) in worst.iter_mut().zip([path.carried(), path.naive()]) {
                *worst = worst.max(off(&weights));
            }
        }
        Row {
            case: &format!("N13 weights of all strategies of a path, {case}"),
            measure: "largest error of a weight or of their sum",
            figure: worst[0],
            naive: ("squares of products", worst[1]),
            bound: 1e-6,
        }
        .check();
    }
    // Nothing that a connection of no length, a delta or a density of 0 makes of the densities is NaN.
    let values = [0.0, f32::from_bits(1), 1.0, f32::MAX, f32::INFINITY, f32::NAN];
    for (a, b, link) in
        values.iter().flat_map(|a| values.iter().flat_map(move |b| values.map(|l| (*a, *b, l))))
    {
        for back in values {
            for tail in [0.0, 1.0, 1e150] {
                let (link, previous_fwd) = ([link; 2], b);
                let mis =
                    SubpathMis { fwd: a, fwd_w: a, back, link, previous_fwd, previous_link: link[0], tail };
                let w = weight(mis.sum(b, a, false), mis.previous_sum(b));
                assert!((0.0..=1.0).contains(&w), "{a} {b} {link:?} {back} {tail}: {w}");
            }
        }
    }
}

/// Two refractions of four wavelengths: the weights of the four heroes.
#[test]
fn n13_wavelengths() {
    let mut random = Random(15);
    let mut worst = [0f64; 2];
    for _ in 0..50_000 {
        let mut lanes = || Vec4::from_array([(); 4].map(|()| density(&mut random)));
        let (a, b) = (lanes(), lanes());
        let turned = |v: Vec4, h: usize| Vec4::from_array(std::array::from_fn(|i| v[(i + h) % 4]));
        // What lane j counts for, with the hero in turn each of the four.
        let ours = [0, 1, 2, 3].map(|h| {
            let (x, s) = WavelengthMis::of(turned(a, h)).unwrap();
            let (y, t) = WavelengthMis::of(turned(b, h)).unwrap();
            f64::from(0.25 * s * t * x.and(y).weight())
        });
        let product = a * b;
        let naive = [0, 1, 2, 3].map(|h| f64::from(product[h] / product.element_sum()));
        // Where the peaks of both are more than 1e30 apart no lane reaches the eye: all weights may vanish together.
        let relative = (a / a.max_element()) * (b / b.max_element());
        if relative.max_element() < 1e-29 {
            assert!(ours.iter().all(|w| (0.0..=1.0).contains(w)), "{a} {b}: {ours:?}");
            continue;
        }
        for (worst, weights) in worst.iter_mut().zip([ours, naive]) {
            *worst = worst.max(fault(&weights));
        }
    }
    Row {
        case: "N13 weights of four wavelengths after two refractions, values from 1e-38 to 1e38",
        measure: "largest error of their sum",
        figure: worst[0],
        naive: ("products over their sum", worst[1]),
        bound: 1e-6,
    }
    .check();
}
