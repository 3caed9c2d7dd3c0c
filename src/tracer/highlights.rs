//! Highlights: lamps that the camera sees over mirrors and glass alone, where they are small.
//!
//! A small lamp in a curved mirror or in glass covers a fraction of a pixel. Only camera paths find it, perhaps one in thousands of those
//! through that pixel; photons and connections cannot, because a delta has no other direction. An estimate from samples does not include it until one
//! has hit it. Its approximate position and brightness follow from a few chains of deltas, if the last direction of each is widened to a cone
//! (path space regularization, Kaplanyan and Dachsbacher 2013): a lamp inside the cone covers the fraction of the picture's cell that
//! its solid angle is of the cone's. The half angle of the cone is the change of direction over a cell, or over a pixel where cells are smaller,
//! estimated from two neighbouring chains (Igehy 1999, *Tracing Ray Differentials*). So the highlight is blurred by about that, whether the mirror is
//! flat or a small ball.
//!
//! Highlights that are blurred already are not found: chains go through the middle of the lens, and rough surfaces have none.

use std::f64::consts::TAU;

use glam::Vec3;

use crate::math::random::Random;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::Highlight;

use super::Scene;
use super::accel::Ray;
use super::bsdf::{Bsdf, ScatteringModel};
use super::integrator::RenderContext;
use super::interaction::SurfaceInteraction;
use super::light::{LightSample, LightSampleContext};
use super::medium::MediumIndex;
use super::specular_chain::is_followed;
use super::vertex::SurfaceVertex;

/// Most deltas of a chain.
const LONGEST: u32 = 12;

/// Chains that show less of the light at their end are not followed: what glass reflects once at each of two surfaces shows .0016.
const LEAST_VALUE: f32 = 0.01;

/// Where the wavelengths of all chains begin.
const WAVELENGTHS: f32 = 0.15;

/// Places beside one are so far away, in pixels.
const BESIDE: f64 = 1.0 / 16.0;

/// Half the angle of a cone at least and at most, radians: rays within a pixel of a flat mirror differ by no less, and much farther from the direction of
/// the chain the lamp may be hidden, or seen in another area.
const CONE: [f32; 2] = [1e-3, 0.45];

/// Places in all areas together, about, that are looked at first: areas in which no chain begins, nor in those around them, are looked at no more.
const FIRST_PLACES: usize = 131_072;

/// Most samples of lamps for each chain.
const MOST_LAMPS: usize = 4;

/// Finds the highlights of a picture.
#[derive(Debug)]
pub(super) struct HighlightFinder {
    context: RenderContext,
    /// The wavelengths of all chains.
    lambda: SampledWavelengths,
    /// Pixels of the picture.
    size: [u32; 2],
    /// Pixels along a side of an area.
    side: u32,
    /// The areas in which chains may begin.
    areas: Vec<usize>,
    /// Samples of lamps for each chain.
    lamps: usize,
}

/// A chain on its way.
struct ChainStart {
    /// A number for the surfaces that it has met and what it did there.
    chain: u64,
    steps: u32,
    value: SampledSpectrum,
    /// The same as the eye sees it, without what refraction does to radiance.
    eye_value: f32,
}

/// Where a chain leaves its last vertex.
#[derive(Clone, Copy)]
struct ChainEnd {
    /// The number of the chain: the same surfaces, met in the same way, have the same.
    chain: u64,
    hit: SurfaceInteraction,
    /// Unit direction.
    wi: Vec3,
    /// The share of the light from there that reaches the camera.
    value: SampledSpectrum,
    /// The probability that a path follows this chain.
    chance: f32,
}

/// A point of a light.
struct SampledLamp {
    light: u32,
    sample: LightSample,
}

/// One light in one area, seen by chains over the same surfaces.
struct ShownLamp {
    area: usize,
    /// The number of the chains.
    chain: u64,
    /// The number of the source of light.
    source: u32,
    highlight: Highlight,
}

impl HighlightFinder {
    /// Looks for highlights in the picture of `context`, of `size` pixels, in areas of `side` pixels squared.
    pub fn new(context: RenderContext, size: [u32; 2], side: u32) -> Self {
        let lights = context.scene.lights();
        let lamps = lights.len().min(MOST_LAMPS);
        let lambda = context.wavelengths(WAVELENGTHS);
        let mut finder = Self { context, lambda, size, side, areas: Vec::new(), lamps };
        finder.areas = finder.areas_with_chains();
        finder
    }

    /// Pixels of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// In how many areas there may be highlights.
    pub fn areas(&self) -> usize {
        self.areas.len()
    }

    fn areas_with_chains(&self) -> Vec<usize> {
        let [columns, rows] = self.size.map(|n| n.div_ceil(self.side) as usize);
        // What a medium leaves of a highlight is not looked for.
        if self.lamps == 0 || self.context.scene.media().is_some() {
            return Vec::new();
        }
        let cells = ((FIRST_PLACES / (columns * rows).max(1)).isqrt() as u32).clamp(1, self.side / 2);
        let mut random = Random(0);
        let mut has_chains = |area: &usize| {
            let places = self.places(*area, cells, &mut random);
            places.into_iter().any(|place| !self.chains_from(place).is_empty())
        };
        let mut is_near = vec![false; columns * rows];
        for area in (0..columns * rows).filter(&mut has_chains) {
            let around = |at: usize, len: usize| at.saturating_sub(1)..(at + 2).min(len);
            for row in around(area / columns, rows) {
                around(area % columns, columns).for_each(|column| is_near[row * columns + column] = true);
            }
        }
        (0..columns * rows).filter(|area| is_near[*area]).collect()
    }

    /// A random place in each of `cells`² cells of an area, in pixels, but none beyond the picture.
    fn places(&self, area: usize, cells: u32, random: &mut Random) -> Vec<[f64; 2]> {
        let columns = self.size[0].div_ceil(self.side);
        let first = [area as u32 % columns, area as u32 / columns].map(|at| f64::from(at * self.side));
        let cell = f64::from(self.side) / f64::from(cells);
        let all = (0..cells).flat_map(|y| (0..cells).map(move |x| [x, y]));
        let place =
            |at: [u32; 2]| [0, 1].map(|axis| first[axis] + cell * (f64::from(at[axis]) + random.f64()));
        let is_within =
            |place: &[f64; 2]| place.iter().zip(self.size).all(|(at, size)| *at < f64::from(size));
        all.map(place).filter(is_within).collect()
    }

    /// All highlights, from chains that begin at one place in each of `cells`² cells of every area.
    pub fn find(&self, cells: u32) -> Vec<Highlight> {
        let mut random = Random(u64::from(self.context.seed) << 32 | u64::from(cells));
        let cell = f64::from(self.side) / f64::from(cells);
        let mut found = Vec::new();
        for &area in &self.areas {
            for place in self.places(area, cells, &mut random) {
                self.add_shown(place, cell, area, &mut random, &mut found);
            }
        }
        found.sort_by_key(|shown| (shown.area, shown.chain, shown.source));
        let sum = |all: &[ShownLamp]| {
            let mut sum = Highlight { area: all[0].area, ..Highlight::default() };
            for Highlight { light, pixels, chance, .. } in all.iter().map(|shown| &shown.highlight) {
                (sum.light, sum.pixels, sum.chance) =
                    (sum.light + light, sum.pixels + pixels, sum.chance + chance);
            }
            sum
        };
        let is_same =
            |a: &ShownLamp, b: &ShownLamp| (a.area, a.chain, a.source) == (b.area, b.chain, b.source);
        found.chunk_by(is_same).map(sum).collect()
    }

    /// Adds the lamps that chains from a place show, in pixels, which stands for a cell of so many pixels to a side.
    fn add_shown(
        &self,
        place: [f64; 2],
        cell: f64,
        area: usize,
        random: &mut Random,
        found: &mut Vec<ShownLamp>,
    ) {
        // The chains from the places beside it are traced where one of them may show a lamp.
        let mut beside: Option<[Vec<ChainEnd>; 2]> = None;
        for end in &self.chains_from(place) {
            for number in 0..self.lamps {
                let Some(lamp) = self.lamp_near(end, number, random) else { continue };
                let beside = beside.get_or_insert_with(|| {
                    [[BESIDE, 0.0], [0.0, BESIDE]]
                        .map(|[x, y]| self.chains_from([place[0] + x, place[1] + y]))
                });
                let turn = |ends: &Vec<ChainEnd>| {
                    let same = ends.iter().find(|other| other.chain == end.chain);
                    same.map_or(f32::INFINITY, |other| other.wi.distance(end.wi) / BESIDE as f32)
                };
                // A cone of a pixel would miss what is seen elsewhere in a larger cell.
                let over_cell = turn(&beside[0]).hypot(turn(&beside[1])) * cell.max(1.0) as f32;
                let cone = over_cell.clamp(CONE[0], CONE[1]);
                let source = self.context.scene.lights().source(lamp.light);
                let highlight = self.highlight(end, cone, lamp, cell * cell);
                let shown = |highlight| ShownLamp {
                    area,
                    chain: end.chain,
                    source,
                    highlight: Highlight { area, ..highlight },
                };
                found.extend(highlight.map(shown));
            }
        }
    }

    /// The ends of all chains from a place in the picture, in pixels.
    fn chains_from(&self, place: [f64; 2]) -> Vec<ChainEnd> {
        let uv = [place[0] / f64::from(self.size[0]), place[1] / f64::from(self.size[1])];
        let Some(ray) = self.context.camera.ray(uv, [0.5; 2]) else { return Vec::new() };
        let start = ChainStart { chain: 0, steps: 0, value: SampledSpectrum::splat(1.0), eye_value: 1.0 };
        let mut ends = Vec::new();
        self.follow(&ray, &start, &mut ends);
        ends
    }

    /// Adds the ends of all chains along `ray`.
    fn follow(&self, ray: &Ray, chain: &ChainStart, ends: &mut Vec<ChainEnd>) {
        let scene: &Scene = &self.context.scene;
        // The lamp is behind one segment more.
        if chain.steps >= LONGEST || chain.steps + 2 > self.context.longest() {
            return;
        }
        let Some(hit) = scene.closest(ray).filter(|hit| hit.light.is_none()) else { return };
        let vertex = SurfaceVertex::<Bsdf>::new(scene, hit, &self.lambda, MediumIndex::VACUUM);
        for lobe in vertex.bsdf.delta_lobes(vertex.wo).iter().flatten() {
            let wi = vertex.frame.to_world(lobe.wi);
            let next = ChainStart {
                chain: (chain.chain ^ u64::from(hit.surface) << 1 ^ u64::from(lobe.transmitted))
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15),
                steps: chain.steps + 1,
                value: chain.value * lobe.weight,
                eye_value: chain.eye_value * lobe.weight.max_element() * lobe.eta2,
            };
            // False for NaN.
            let counts = next.eye_value >= LEAST_VALUE && vertex.hit.sides_agree(wi, lobe.transmitted);
            if counts {
                let ChainStart { chain: number, value, eye_value, .. } = next;
                let chance = if is_followed(chain.steps, eye_value, lobe) { 1.0 } else { eye_value };
                ends.push(ChainEnd { chain: number, hit, wi, value, chance });
                self.follow(&hit.spawn(wi), &next, ends);
            }
        }
    }

    /// A point of a lamp in the largest cone around the end of a chain, which stands for all that `number` chooses among.
    fn lamp_near(&self, end: &ChainEnd, number: usize, random: &mut Random) -> Option<SampledLamp> {
        let n = if end.hit.n.dot(end.wi) < 0.0 { -end.hit.n } else { end.hit.n };
        let at = LightSampleContext { p: end.hit.point.p, n, through: false, glossy: false };
        let choice = (number as f64 + random.f64()) / self.lamps as f64;
        let (light, sample) = self.context.scene.lights().sample(at, choice, [random.f32(), random.f32()])?;
        // False for NaN.
        let is_near = !sample.delta && sample.pdf.0 > 0.0 && sample.wi.dot(end.wi) > CONE[1].cos();
        is_near.then_some(SampledLamp { light, sample })
    }

    /// The highlight of a lamp in a cell of so many pixels, if the cone of this half angle around the end of the chain contains the light sample.
    fn highlight(
        &self,
        end: &ChainEnd,
        cone: f32,
        SampledLamp { light, sample }: SampledLamp,
        cell: f64,
    ) -> Option<Highlight> {
        if sample.wi.dot(end.wi) <= cone.cos() {
            return None;
        }
        let lights = self.context.scene.lights();
        let emitted = lights.spectrum(light, sample.target.unwrap_or_default(), sample.wi, &self.lambda);
        let open = self.context.scene.visible(&end.hit, light, &sample);
        let radiance = self.lambda.to_xyz(end.value * emitted * (open * sample.scale));
        // Pixels for each steradian of the lamp; 1 − cos without cancellation.
        let density = cell / (TAU * 2.0 * (0.5 * f64::from(cone)).sin().powi(2));
        // All samples of a lamp cover together what it does.
        let pixels = density / (f64::from(sample.pdf.0) * self.lamps as f64);
        let seen = f64::from(radiance.y) * pixels;
        let chance = pixels * f64::from(end.chance);
        (seen > 0.0 && seen.is_finite()).then_some(Highlight { area: 0, light: seen, pixels, chance })
    }
}
