//! A moving camera in real scenes: error against a converged picture, with and without reprojection.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::client::settings::Summation;
use crate::client::{Denoise, FilmSpec, SplatFilter};
use crate::color::Xyz;
use crate::denoise::reprojection::*;
use crate::denoise::view_filter::{FeatureGrid, ViewFilter, first_hits};
use crate::scene::SceneDesc;
use crate::scene::desc::PhotonDesc;
use crate::stream::{CHUNK, Sample, SampleSink, UvWindow};
use crate::study::Replicates;
use crate::tracer::integrator::{RenderContext, Replicated};
use crate::tracer::medium::MediumIndex;
use crate::tracer::sampler::cells::ScreenCells;
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
    tracer: Replicated<PathTracer>,
    next: u64,
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
        Self { replicates: Replicates::new([SIDE; 2], 1.0), surfaces, coarse, filter, tracer, next: 0 }
    }

    /// Traces until there are this many samples per pixel.
    fn trace_to(&mut self, samples: f32) {
        let mut scratch = Default::default();
        while self.samples() < samples {
            let mut out = Collected::default();
            (self.next..self.next + CHUNK / 4)
                .for_each(|index| self.tracer.trace(index, &mut scratch, &mut out));
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
        KnownView { surfaces: self.surfaces.clone(), picture: self.filtered(), worth }
    }
}

fn scene(name: &str) -> (SceneDesc, Arc<Scene>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let desc = crate::scene::load(&path, &[]).unwrap().desc;
    let scene = Arc::new(Scene::prepare(&desc).unwrap());
    (desc, scene)
}

/// Root mean squared difference of displayed values: 1 − e^−v, gamma 2.2.
fn difference(picture: &FilteredPicture, reference: &FilteredPicture) -> f64 {
    let shown = |v: f32| f64::from(1.0 - (-v.max(0.0)).exp()).powf(1.0 / 2.2);
    let pixels = picture.xyz().pixels().iter().zip(reference.xyz().pixels());
    let squares: f64 = pixels
        .flat_map(|(a, b)| [(a.x, b.x), (a.y, b.y), (a.z, b.z)])
        .map(|(a, b)| (shown(a) - shown(b)).powi(2))
        .sum();
    (squares / f64::from(3 * SIDE * SIDE)).sqrt()
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
            let (mixed, worth) = prior.mixed(&now.halves(), &filtered, now.samples()).unwrap();
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
