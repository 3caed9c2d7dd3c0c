//! The energy audit of a render: what paths carry away from where they begin is absorbed where they end, or leaves the scene.
//!
//! The books of every path that a method traces are kept by its record. What a surface absorbs of what arrives is not taken from how
//! the path goes on, or the books would always be balanced: it is what remains after light scattered in directions of the audit's own
//! choice, by the material's value there and not by the weight of a sample. Only what a smooth interface or mirror reflects and
//! refracts has no value in a direction; a sample of its own stands for it. A medium absorbs, where a path is scattered in it, the share
//! that its albedo leaves of what arrives: all flights together must lose nothing else.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::math::warp;
use pointillist::scene::desc::{MediumDesc, SceneDesc};
use pointillist::spectrum::{SampledSpectrum, Spectrum};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::bsdf::{BsdfSample, InMedia, Scattering, ScatteringModel};
use pointillist::tracer::integrator::{BidirectionalTracer, ParticleTracer, PhotonTracer, RenderContext};
use pointillist::tracer::record::{CarriedLight, PathEvent, recorded};
use pointillist::tracer::vertex::SurfaceVertex;
use pointillist::tracer::wavelength_mis::WavelengthMis;
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use super::agreement::Method;
use super::welch;

/// Sums of luminance over the paths from one end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Books {
    /// What paths begin with.
    pub emitted: f64,
    /// What remains at surfaces and in media.
    pub absorbed: f64,
    /// What leaves the scene, or was followed as far as the scene allows.
    pub escaped: f64,
}

impl Books {
    /// Emitted and found nowhere.
    pub fn missing(&self) -> f64 {
        self.emitted - self.absorbed - self.escaped
    }
}

/// Keeps the books of paths from the camera and from lights.
pub struct Audit {
    pub camera: Books,
    pub light: Books,
    /// Smooth transparent interfaces are known to absorb nothing of the flux of light paths.
    pub clear: bool,
    /// The single-scattering albedo of each medium, the same everywhere in it.
    albedos: Vec<Spectrum>,
    random: Random,
}

impl Audit {
    pub fn new(seed: u64, clear: bool) -> Self {
        let (camera, light) = (Books::default(), Books::default());
        Self { camera, light, clear, albedos: Vec::new(), random: Random(seed) }
    }

    /// The same in a scene with media.
    fn with_media_of(self, desc: &SceneDesc) -> Self {
        let albedo = |medium: &MediumDesc| {
            medium.albedo.uniform().expect("an audited medium has the same albedo everywhere").clone()
        };
        Self { albedos: desc.media.iter().map(albedo).collect(), ..self }
    }

    fn books(&mut self, from_light: bool) -> &mut Books {
        if from_light { &mut self.light } else { &mut self.camera }
    }

    fn numbers(&mut self) -> [f32; 2] {
        [self.random.f32(), self.random.f32()]
    }

    /// What goes on from `vertex`, estimated by a direction of the whole sphere and one that the material chooses, with the balance
    /// heuristic between them.
    fn scattered(&mut self, path: &CarriedLight, vertex: &SurfaceVertex<InMedia>) -> f64 {
        let [over_sphere, by_material, lobe] = [(); 3].map(|()| self.numbers());
        let bsdf = &vertex.bsdf;
        let pdf = |wi: Vec3| match path.from_light {
            true => bsdf.pdf_from_light(vertex.wo, wi),
            false => bsdf.eval(vertex.wo, wi).map_or(0.0, |(_, pdf)| pdf.0),
        };
        let share = |wi: Vec3| {
            let density = f64::from(pdf(wi)) + 0.25 * std::f64::consts::FRAC_1_PI;
            per_steradian(path, vertex, wi) / density
        };
        let sample = match path.from_light {
            true => bsdf.sample_from_light(vertex.wo, by_material, lobe[0]),
            false => bsdf.sample(vertex.wo, by_material, lobe[0]),
        };
        let chosen = match sample {
            None => 0.0,
            Some(s) if s.delta => along_delta(path, vertex, &s),
            Some(s) => share(s.wi),
        };
        share(warp::sphere(over_sphere)) + chosen
    }
}

/// Luminance of a value at the wavelengths of a path.
fn luminance(path: &CarriedLight, value: SampledSpectrum, mis: WavelengthMis) -> f64 {
    f64::from(path.lambda.to_xyz(value * mis.weight()).y)
}

/// The factor of light that a smooth normal asks for (Veach 1997, §5.3), but for the cosine that is in the material's value.
fn to_geometric<B: Scattering>(vertex: &SurfaceVertex<B>, wi: Vec3) -> f32 {
    let ng = vertex.hit.point.ng;
    (vertex.frame.to_world(wi).dot(ng) / vertex.hit.wo.dot(ng)).abs()
}

/// What goes on in the local direction `wi`.
fn per_steradian(path: &CarriedLight, vertex: &SurfaceVertex<InMedia>, wi: Vec3) -> f64 {
    let SurfaceVertex { hit, frame, bsdf, wo, .. } = vertex;
    if !hit.sides_agree(frame.to_world(wi), wo.z * wi.z < 0.0) {
        return 0.0;
    }
    let (eye, light) = if path.from_light { (wi, *wo) } else { (*wo, wi) };
    let Some((mut value, _)) = bsdf.eval(eye, light) else { return 0.0 };
    if path.from_light && !hit.is_in_medium() {
        value *= to_geometric(vertex, wi);
    }
    let dispersion =
        if bsdf.is_dispersive() { bsdf.dispersion(*wo, wi).wavelength_mis } else { WavelengthMis::ALL };
    luminance(path, path.throughput * value, path.wavelength_mis.and(dispersion))
}

/// What goes on in the only direction of `s`.
fn along_delta(path: &CarriedLight, vertex: &SurfaceVertex<InMedia>, s: &BsdfSample) -> f64 {
    let wi = vertex.frame.to_world(s.wi);
    if !vertex.hit.sides_agree(wi, s.transmitted) {
        return 0.0;
    }
    let mut value = path.throughput * s.weight;
    if path.from_light {
        value *= s.eta2;
        if vertex.hit.smooth {
            value *= to_geometric(vertex, s.wi) * (vertex.wo.z / s.wi.z).abs();
        }
    }
    match s.hero_only {
        true => {
            luminance(path, value * SampledSpectrum(Vec4::X), path.wavelength_mis.and(WavelengthMis::ALONE))
        }
        false => luminance(path, value, path.wavelength_mis),
    }
}

impl Audit {
    /// A path begins.
    pub fn begins(&mut self, path: CarriedLight) {
        self.books(path.from_light).emitted += luminance(&path, path.throughput, path.wavelength_mis);
    }

    /// A path meets a surface.
    pub fn meets(&mut self, path: CarriedLight, vertex: &SurfaceVertex<InMedia>) {
        let arrives = luminance(&path, path.throughput, path.wavelength_mis);
        if vertex.hit.is_in_medium()
            && let Some(medium) = path.medium.id()
        {
            let albedo = self.albedos[medium.0 as usize].sample(&path.lambda);
            let before = luminance(&path, SampledSpectrum(path.throughput.0 / albedo.0), path.wavelength_mis);
            self.books(path.from_light).absorbed += before - arrives;
        }
        let known = self.clear && path.from_light && vertex.bsdf.is_delta() && vertex.bsdf.transmits();
        let goes_on = if known { arrives } else { self.scattered(&path, vertex) };
        self.books(path.from_light).absorbed += arrives - goes_on;
    }

    /// A path leaves the scene, or is as long as the scene allows.
    pub fn leaves(&mut self, path: CarriedLight) {
        self.books(path.from_light).escaped += luminance(&path, path.throughput, path.wavelength_mis);
    }

    /// Enters what a path records; at its vertices the material is evaluated anew.
    fn enter(&mut self, scene: &Scene, event: &PathEvent) {
        match *event {
            PathEvent::Begins(path) => self.begins(path),
            PathEvent::Meets(path, hit) => {
                self.meets(path, &SurfaceVertex::new(scene, hit, &path.lambda, path.medium));
            }
            PathEvent::Leaves(path) => self.leaves(path),
            _ => (),
        }
    }
}

/// Takes no samples.
pub struct NoSamples;

impl SampleSink for NoSamples {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Means of [`Books`] over randomisations, for one of what is emitted.
#[derive(Clone, Copy, Debug)]
pub struct Balance {
    /// What a path begins with.
    pub emitted: f64,
    pub absorbed: f64,
    pub escaped: f64,
    /// Share of what is emitted that is found nowhere.
    pub missing: f64,
    /// Standard error of `missing`.
    pub error: f64,
}

impl Balance {
    /// The balance of some books, each of `paths` paths; `None` where nothing is emitted.
    pub fn of(books: &[Books], paths: f64) -> Option<Self> {
        let mean = |of: &dyn Fn(&Books) -> f64| welch::moments(books.iter().map(of));
        let (emitted, _) = mean(&|b| b.emitted);
        if emitted == 0.0 {
            return None;
        }
        let share = |of: &dyn Fn(&Books) -> f64| mean(of).0 / emitted;
        let (missing, variance) = mean(&Books::missing);
        Some(Self {
            emitted: emitted / paths,
            absorbed: share(&|b| b.absorbed),
            escaped: share(&|b| b.escaped),
            missing: missing / emitted,
            error: variance.sqrt() / emitted,
        })
    }

    /// What is missing, in standard errors of at least the rounding of single precision.
    pub fn distance(&self) -> f64 {
        self.missing.abs() / self.error.max(1e-6)
    }
}

/// How much is audited: indices of one randomisation, randomisations, and what is known of glass.
#[derive(Clone, Copy, Debug)]
pub struct AuditPlan {
    pub indices: u64,
    pub seeds: u32,
    pub clear: bool,
}

/// The books of a scene by a method: the balance of its paths from the camera and of those from lights. Of photon mapping it is
/// the light paths.
pub fn audit(desc: &SceneDesc, method: Method, plan: AuditPlan) -> [Option<Balance>; 2] {
    audit_of_media(desc, desc, method, plan)
}

/// The same for books that take the albedos of media from another scene.
pub fn audit_of_media(
    desc: &SceneDesc,
    albedos: &SceneDesc,
    method: Method,
    plan: AuditPlan,
) -> [Option<Balance>; 2] {
    let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid").recorded());
    let camera = Camera::of(desc).expect("the camera is valid");
    let books = |seed: u32| {
        let window = UvWindow::PICTURE;
        let context = RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, window);
        let mut audit = Audit::new(u64::from(seed), plan.clear).with_media_of(albedos);
        match method {
            Method::Path => observe(&PathTracer { context }, &scene, plan.indices, &mut audit),
            Method::Particle => observe(&ParticleTracer { context }, &scene, plan.indices, &mut audit),
            // Merging adds no subpaths to those from both ends.
            Method::Bidirectional | Method::Vcm => {
                observe(&BidirectionalTracer { context }, &scene, plan.indices, &mut audit)
            }
            Method::Photon => {
                let tracer = PhotonTracer::new(context, true);
                for path in 0..plan.indices {
                    let events = recorded(|| tracer.trace_light_path(path));
                    events.iter().for_each(|event| audit.enter(&scene, event));
                }
            }
        }
        [audit.camera, audit.light]
    };
    let half = plan.seeds / 2;
    let all = std::thread::scope(|scope| {
        let other = scope.spawn(|| (half..plan.seeds).map(books).collect::<Vec<_>>());
        let mut all: Vec<_> = (0..half).map(books).collect();
        all.extend(other.join().expect("no path panics"));
        all
    });
    [0, 1].map(|end| {
        let of_end: Vec<Books> = all.iter().map(|both| both[end]).collect();
        Balance::of(&of_end, plan.indices as f64)
    })
}

/// The first paths of a camera do not split.
const FIRST: u64 = 8192;

fn observe<I: Integrator>(tracer: &I, scene: &Scene, indices: u64, audit: &mut Audit) {
    // Light subpaths that indices share are recorded once, with the first of them: the number of indices must be whole groups.
    let mut scratch = I::Scratch::default();
    for index in FIRST..FIRST + indices {
        let events = recorded(|| tracer.trace(index, &mut scratch, &mut NoSamples));
        events.iter().for_each(|event| audit.enter(scene, event));
    }
}
