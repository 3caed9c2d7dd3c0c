//! A moving camera in real scenes: error against a converged picture, with and without reprojection.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::client::settings::Summation;
use crate::client::{Denoise, FilmSpec, SplatFilter};
use crate::color::Xyz;
use crate::denoise::reprojection::*;
use crate::denoise::steering::STEERED_SAMPLES;
use crate::denoise::view_filter::{FeatureGrid, ViewFilter, first_hits};
use crate::scene::SceneDesc;
use crate::scene::desc::PhotonDesc;
use crate::stream::{CHUNK, Sample, SampleSink, UvWindow};
use crate::study::Replicates;
use crate::tracer::integrator::{RenderContext, Replicated};
use crate::tracer::medium::MediumIndex;
use crate::tracer::sampler::cells::ScreenCells;
use crate::tracer::screen::{ScreenDensity, ScreenSampling};
use crate::tracer::{Integrator, PathTracer, Scene};

const SIDE: u32 = 96;

const FILM: FilmSpec = FilmSpec {
    width: SIDE,
    height: SIDE,
    filter: SplatFilter::Box,
    variance: None,
    sums: Summation::TwoFloat,
};

/// Sink that collects the samples of a chunk.
#[derive(Default)]
struct Collected(Vec<Sample>);

impl SampleSink for Collected {
    fn camera(&mut self, uv: [f32; 2], xyz: Xyz, w: f32) {
        self.0.push(Sample { uv, xyz, w });
    }

    fn light(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.0.push(Sample { uv, xyz, w: 0.0 });
    }
}

/// A scene with a camera, the sums of its samples, and the first hits of its rays.
struct Seen {
    replicates: Replicates,
    surfaces: Arc<ViewSurfaces>,
    /// First hits of a quarter of the rays.
    coarse: Arc<ViewSurfaces>,
    filter: ViewFilter,
    context: RenderContext,
    tracer: Replicated<PathTracer>,
    next: u64,
    /// Number and weight of the samples in each pixel.
    drawn: Vec<[f32; 2]>,
}

impl Seen {
    /// The scene from its own camera, turned by `degrees` about the vertical axis.
    fn new(desc: &SceneDesc, scene: &Arc<Scene>, degrees: f64, seed: u32) -> Self {
        let mut desc = desc.clone();
        desc.camera.to_world *= DAffine3::from_rotation_y(degrees.to_radians());
        Self::from_camera(&desc, scene, seed)
    }

    fn from_camera(desc: &SceneDesc, scene: &Arc<Scene>, seed: u32) -> Self {
        let camera = Camera::of(desc).unwrap();
        let hits =
            |half, step| first_hits(scene, &camera, &FILM, FeatureGrid { half, step }, &|| false).unwrap();
        let surfaces = |step| {
            let rays = FeatureGrid { half: 0, step };
            Arc::new(ViewSurfaces::new(&camera, [SIDE as usize; 2], rays, hits(0, step)).unwrap())
        };
        let filter = ViewFilter::of([&hits(0, 1), &hits(1, 1)], None).unwrap();
        let (surfaces, coarse) = (surfaces(1), surfaces(2));
        let context = RenderContext {
            scene: scene.clone(),
            camera,
            other_eye: None,
            seed,
            window: UvWindow::PICTURE,
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
            places: None,
            screen: Default::default(),
            cells: ScreenCells::of_pixels([f64::from(SIDE); 2]),
            photons: PhotonDesc::default(),
            medium: MediumIndex::VACUUM,
            on_boundary: false,
        };
        let tracer = Replicated::new(&context, true, PathTracer::from);
        let (replicates, drawn) = (Replicates::new([SIDE; 2], 1.0), vec![[0.0; 2]; (SIDE * SIDE) as usize]);
        Self { replicates, surfaces, coarse, filter, context, tracer, next: 0, drawn }
    }

    /// Steers the first samples by this density.
    fn steered(mut self, density: &Arc<ScreenDensity>) -> Self {
        let RenderContext { seed, cells, .. } = self.context;
        // Half of them in each replicate.
        let paths = (0.5 * STEERED_SAMPLES * (SIDE * SIDE) as f32) as u64;
        let screen = ScreenSampling::steered(density.clone(), 0..paths, seed, &cells);
        let context = RenderContext { screen, ..self.context.clone() };
        self.tracer = Replicated::new(&context, true, PathTracer::from);
        self.replicates.set_density_weights();
        self
    }

    /// Traces until there are this many samples per pixel.
    fn trace_to(&mut self, samples: f32) {
        let mut scratch = Default::default();
        while self.samples() < samples {
            let mut out = Collected::default();
            (self.next..self.next + CHUNK / 4)
                .for_each(|index| self.tracer.trace(index, &mut scratch, &mut out));
            for Sample { uv, w, .. } in &out.0 {
                let [x, y] = uv.map(|at| ((at * SIDE as f32) as usize).min(SIDE as usize - 1));
                let [number, weight] = &mut self.drawn[y * SIDE as usize + x];
                (*number, *weight) = (*number + 1.0, *weight + w);
            }
            self.replicates.add(self.next, crate::stream::PathCounts { camera: CHUNK / 4, light: 0 }, &out.0);
            self.next += CHUNK / 4;
        }
    }

    fn samples(&self) -> f32 {
        self.next as f32 / (SIDE * SIDE) as f32
    }

    fn halves(&self) -> HalfMeans {
        HalfMeans::of(&self.replicates).unwrap()
    }

    fn filtered(&mut self) -> FilteredPicture {
        let halves = self.halves();
        FilteredPicture::of(&self.replicates, &halves, None, &mut self.filter, Denoise::Wavelet).unwrap()
    }

    fn known(&mut self) -> KnownView {
        let worth = Grid::try_filled(SIDE as usize, SIDE as usize, self.samples()).unwrap();
        KnownView { surfaces: self.surfaces.clone(), picture: self.filtered(), worth, moves: None }
    }
}

fn scene(name: &str) -> (SceneDesc, Arc<Scene>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let desc = crate::scene::load(&path, &[]).unwrap().desc;
    let scene = Arc::new(Scene::prepare(&desc).unwrap());
    (desc, scene)
}

/// Squared difference of each pixel's displayed values: 1 − e^−v, gamma 2.2.
fn squares(picture: &FilteredPicture, reference: &FilteredPicture) -> Vec<f64> {
    let shown = |v: f32| f64::from(1.0 - (-v.max(0.0)).exp()).powf(1.0 / 2.2);
    let square = |(a, b): (f32, f32)| (shown(a) - shown(b)).powi(2);
    let pixels = picture.xyz().pixels().iter().zip(reference.xyz().pixels());
    pixels.map(|(a, b)| [(a.x, b.x), (a.y, b.y), (a.z, b.z)].into_iter().map(square).sum()).collect()
}

/// Root mean squared difference of displayed values.
fn difference(picture: &FilteredPicture, reference: &FilteredPicture) -> f64 {
    (squares(picture, reference).iter().sum::<f64>() / f64::from(3 * SIDE * SIDE)).sqrt()
}

/// Undenoised mean picture of both halves.
fn plain(halves: &HalfMeans) -> FilteredPicture {
    let mut picture = Grid::try_filled(SIDE as usize, SIDE as usize, Vec3::ZERO).unwrap();
    for (i, out) in picture.pixels_mut().iter_mut().enumerate() {
        let seen = halves.0.each_ref().map(|half| half.at(i % SIDE as usize, i / SIDE as usize));
        let sum: Vec4 = seen.into_iter().map(|half| (half.truncate() * half.w).extend(half.w)).sum();
        *out = sum.truncate() / sum.w;
    }
    picture.into()
}

/// After a cut too little is known to be displayed without samples.
#[test]
fn a_cut_begins_anew() {
    let (desc, scene) = scene("cornell.xml");
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(1.0);
    let known = before.known();
    for (degrees, is_enough) in [(0.0, true), (10.0, true), (30.0, false), (90.0, false)] {
        let after = Seen::new(&desc, &scene, degrees, 0);
        let prior = Prior::new(&known, &after.coarse).unwrap();
        assert_eq!(prior.is_enough(), is_enough, "{degrees} degrees");
        let map = SteeringMap::new(&known, &after.coarse, &UvWindow::PICTURE);
        assert_eq!(map.is_some(), is_enough, "{degrees} degrees");
    }
}

/// The sides of a surface may look different: a wall seen from the front is unknown when seen from behind.
#[test]
fn the_other_side_of_a_surface_is_not_known() {
    let (mut desc, scene) = scene("cornell.xml");
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(1.0);
    let known = before.known();
    // The camera orbits the centre of the box to where a wall is seen from outside.
    let to_middle = DAffine3::from_translation(DVec3::new(0.0, 2.75, 0.0));
    let turn = DAffine3::from_rotation_y(40f64.to_radians());
    desc.camera.to_world = to_middle * turn * to_middle.inverse() * desc.camera.to_world;
    let after = Seen::from_camera(&desc, &scene, 0).surfaces;
    let prior = Prior::new(&known, &after).unwrap();
    let mut behind = 0;
    for (i, hit) in after.hits.pixels().iter().enumerate() {
        let [x, y] = [i % SIDE as usize, i / SIDE as usize];
        let uv = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / SIDE as f32;
        if hit.distance > 0.0 && hit.normal.dot(after.lines.unwrap().line(uv).1) > 0.0 {
            behind += 1;
            assert!(prior.worth.at(x, y) == 0.0, "pixel {x}, {y}");
        }
    }
    assert!(behind > SIDE * SIDE / 10, "{behind} pixels show a wall from behind");
}

/// Reprojecting to the same view reproduces the picture, except in mirrors.
#[test]
fn a_camera_at_rest_keeps_the_picture() {
    let (desc, scene) = scene("cornell.xml");
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(4.0);
    let known = before.known();
    let again = Prior::new(&known, &before.surfaces).unwrap();
    let same = again.picture.pixels().iter().zip(known.picture.xyz().pixels());
    let off = same.filter(|(a, b)| a.distance(**b) > 1e-3 * (1.0 + b.length())).count();
    let unknown = again.worth.pixels().iter().filter(|worth| **worth == 0.0).count();
    // At edges the ray of a pixel may have hit another surface than its centre ray.
    assert!(off < (SIDE * SIDE / 50) as usize, "{off} pixels differ");
    assert!(unknown < (SIDE * SIDE / 200) as usize, "{unknown} pixels are unknown");
}

/// With few samples of the new view, reprojection is nearer to the truth than denoising alone; with many it does no harm.
fn check_turned_camera(name: &str) {
    let (desc, scene) = scene(name);
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(8.0);
    let known = before.known();
    for degrees in [2.0, 10.0] {
        let mut many = Seen::new(&desc, &scene, degrees, 9);
        many.trace_to(256.0);
        let truth = plain(&many.halves());
        let mut now = Seen::new(&desc, &scene, degrees, 1);
        let prior = Prior::new(&known, &now.coarse).unwrap();
        let seen = prior.worth.pixels().iter().filter(|worth| **worth > 0.0).count();
        let share = seen as f64 / f64::from(SIDE * SIDE);
        println!("{name}, turned by {degrees}°: {share:.2} of the pixels are known");
        let mut errors = Vec::new();
        for samples in [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 15.0] {
            now.trace_to(samples);
            let filled = difference(&prior.filled(&now.replicates).unwrap(), &truth);
            if samples < 0.1 {
                println!("  {samples:5} filled {filled:.4}");
                continue;
            }
            let filtered = now.filtered();
            let MixedView { picture: mixed, worth, moves } =
                prior.mixed(&now.halves(), &filtered, now.samples(), None).unwrap();
            assert!(moves.is_none());
            let [alone, mixed] = [filtered, mixed].map(|picture| difference(&picture, &truth));
            let worth = worth.pixels().iter().sum::<f32>() / (SIDE * SIDE) as f32;
            println!(
                "  {samples:5} filled {filled:.4}, filtered {alone:.4}, mixed {mixed:.4}, worth {worth:.2}"
            );
            errors.push(mixed / alone);
        }
        assert!(errors[0] < 0.85, "{name}, {degrees}°, .1 sample per pixel: {:.3}", errors[0]);
        assert!(errors[4] < 1.03, "{name}, {degrees}°, 15 samples per pixel: {:.3}", errors[4]);
    }
}

#[test]
fn a_camera_that_turns_keeps_what_was_known_of_matt_surfaces() {
    check_turned_camera("cornell.xml");
}

#[test]
fn a_camera_that_turns_keeps_what_was_known_of_mirror_and_glass() {
    check_turned_camera("cornell_spheres.xml");
}

#[test]
fn a_camera_that_turns_keeps_what_was_known_of_rough_metal() {
    check_turned_camera("veach_plates.xml");
}

/// After a turn, more of the first samples lie where the last picture shows nothing, with weights that make up for it.
#[test]
fn the_first_samples_go_where_nothing_is_known() {
    let (desc, scene) = scene("cornell.xml");
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(8.0);
    let known = before.known();
    let many = Seen::new(&desc, &scene, 10.0, 9);
    let prior = Prior::new(&known, &many.coarse).unwrap();
    let map = SteeringMap::new(&known, &many.coarse, &UvWindow::PICTURE).unwrap();
    let density = map.density().expect("a turn uncovers a part of the view");
    let is_hit = |i: usize| many.surfaces.hits().pixels()[i].distance > 0.0;
    let unknown: Vec<bool> =
        prior.worth.pixels().iter().enumerate().map(|(i, worth)| *worth == 0.0 && is_hit(i)).collect();
    let [mut numbers, mut weights] = [[0.0; 2]; 2];
    for seed in 1..5 {
        for is_steered in [false, true] {
            let new = Seen::new(&desc, &scene, 10.0, seed);
            let mut now = if is_steered { new.steered(density) } else { new };
            now.trace_to(1.0);
            for i in (0..unknown.len()).filter(|i| unknown[*i]) {
                numbers[usize::from(is_steered)] += f64::from(now.drawn[i][0]);
                weights[usize::from(is_steered)] += f64::from(now.drawn[i][1]);
            }
            let mismatches = now.drawn.iter().enumerate().filter(|(i, [number, weight])| {
                let pixel = [i % SIDE as usize, i / SIDE as usize];
                let worth = if is_steered { map.effective_samples(pixel, 1.0) } else { 1.0 };
                (worth * weight - number).abs() > 1e-3 * number
            });
            // Where rounding moves a sample to the next region.
            assert!(mismatches.count() < 10, "samples have the density that the map states");
        }
    }
    let [number, weight] = [numbers, weights].map(|[even, steered]| steered / even);
    println!("steered over even: number {number:.2}, weight {weight:.3}");
    assert!(number > 1.5, "{number:.2} times as many samples");
    // Three standard errors of the some 1,500 samples there.
    assert!((weight - 1.0).abs() < 0.1, "{weight:.3} times the weight");
}

/// What has been carried over often is worth less than what was traced lately, and the next move knows.
#[test]
fn old_samples_count_less() {
    let (desc, scene) = scene("cornell.xml");
    let mut before = Seen::new(&desc, &scene, 0.0, 0);
    before.trace_to(8.0);
    let (side, half) = (SIDE as usize, SIDE as usize / 2);
    let ages = (0..side * side).map(|i| if i % side < half { 40.0 } else { 0.0 }).collect();
    let known = KnownView { moves: Grid::from_rows(side, side, ages), ..before.known() };
    let again = Prior::new(&known, &before.surfaces).unwrap();
    let map = SteeringMap::new(&known, &before.coarse, &UvWindow::PICTURE).unwrap();
    // The median: more is traced along edges, where the reprojection is unsure.
    let density = |range: std::ops::Range<usize>| {
        let pixels = range.flat_map(|x| (0..side).map(move |y| [x, y]));
        let mut densities: Vec<f32> = pixels.map(|pixel| map.effective_samples(pixel, 1.0)).collect();
        densities.sort_by(f32::total_cmp);
        densities[densities.len() / 2]
    };
    let ratio = density(0..half) / density(half..side);
    // The roots of 1 / (.1 + W) for W = 4 / (1 + 41/4) and 4 / (1 + 1/4), mixed with a quarter of an even share: 2.05,
    // of whole numbers of paths.
    assert!((ratio - 2.05).abs() < 0.25, "{ratio}");
    before.trace_to(12.0);
    let (halves, filtered) = (before.halves(), before.filtered());
    let mixed = again.mixed(&halves, &filtered, before.samples(), Some(&map)).unwrap();
    let moves = mixed.moves.unwrap();
    let [old, young] = [half / 2, half + half / 2].map(|x| moves.at(x, half));
    assert!(old > 10.0 * young && old < 41.0, "{old} and {young} moves");
}
