//! `pointillist replay`: traces one path again and prints all of its events.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::Vec3;
use miette::{IntoDiagnostic, Result};

use crate::cmd::args::ReplayArgs;
use crate::color::Xyz;
use crate::render::load;
use crate::render::method;
use crate::render::rejected;
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::edit::medium_name;
use crate::spectrum::SampledSpectrum;
use crate::stream::rejections::fault_of_sample;
use crate::stream::{SampleSink, replicate};
use crate::tracer::integrator::{IntegratorVisitor, RenderContext, Replicated, SeesPhotons, visit};
use crate::tracer::record::{PathEvent, Trail, recorded};
use crate::tracer::{Camera, Integrator, Scene};

/// Runs the subcommand.
///
/// # Errors
///
/// When the scene cannot be read, or an option does not fit the method.
pub fn replay(args: &ReplayArgs) -> Result<()> {
    let input = load::load(&args.source)?;
    let desc = &input.loaded.desc;
    let camera = Camera::of(desc).into_diagnostic()?;
    let mut run = input.run(&args.source, String::new());
    run.replicated = args.replicates > 1;
    let scene = load::prepare(Scene::prepare, desc, args.source.simd)?;
    let scene = Arc::new(scene);
    method::choose(&mut run, &scene, &camera, args.source.threads());
    if !run.integrator.has_photons() && (args.generations.is_some() || args.light_path.is_some()) {
        return Err(miette::miette!(
            help = "leave them away, or give --integrator photon or vcm",
            "--generations and --light-path are of photons, and the method is {}",
            run.integrator.name()
        ));
    }
    let trace = |scene: Arc<Scene>| {
        let context = method::render_context(&run, scene, camera.clone(), run.film.window());
        let mut samples = Samples::default();
        let events = recorded(|| {
            visit(run.integrator, TracedAgain { args, run: &run, context: &context, out: &mut samples });
        });
        (samples, events)
    };
    // The rendering code decides whether the value is wrong; the recording code tells why.
    let (samples, raised) = trace(scene.clone());
    let scene =
        Arc::into_inner(scene).ok_or_else(|| miette::miette!("the scene is still in use"))?.recorded();
    let scene = Arc::new(scene);
    let (_, events) = trace(scene.clone());
    let part =
        if run.replicated { format!(", randomisation {}", replicate(args.index).0) } else { String::new() };
    println!("index {}{part} of seed {}, {}", args.index, run.seed, run.integrator.name());
    let mut report =
        PathReport { desc, scene: &scene, text: String::new(), vertices: 0, trail: Trail::default() };
    events.iter().for_each(|event| report.tell(event));
    print!("{}", report.text);
    samples.0.iter().for_each(|sample| println!("{sample}"));
    let faults: Vec<String> = raised
        .iter()
        .filter_map(|event| if let PathEvent::Fault(fault) = event { Some(fault) } else { None })
        .map(|fault| rejected::describe(desc, &scene, fault))
        .chain(samples.1)
        .collect();
    match faults.is_empty() {
        true => println!("nothing was rejected"),
        false => faults.iter().for_each(|fault| println!("rejected: {fault}")),
    }
    Ok(())
}

/// Traces the index again with the method of a run.
struct TracedAgain<'a> {
    args: &'a ReplayArgs,
    run: &'a RunSpec,
    context: &'a RenderContext,
    out: &'a mut Samples,
}

impl IntegratorVisitor for TracedAgain<'_> {
    type Output = ();

    fn visit<I: Integrator + From<RenderContext>>(self) {
        let Self { args, run, context, out } = self;
        let tracer = Replicated::new(context, run.replicated, I::from);
        tracer.trace(args.index, &mut Default::default(), out);
    }

    /// Traces a path with the photon map it has read, or one of the light paths that stored its photons.
    fn visit_with_photons<I: Integrator + From<RenderContext> + SeesPhotons>(self) {
        let Self { args, run, context, out } = self;
        let make = |context| match (I::from(context), args.generations) {
            (tracer, Some(generations)) => tracer.seeing(generations),
            (tracer, None) => tracer,
        };
        let tracer = Replicated::new(context, run.replicated, make);
        match args.light_path {
            Some(number) => {
                let part = if run.replicated { replicate(args.index).0 } else { 0 };
                tracer.parts[part].photons().trace_light_path(number);
            }
            None => tracer.trace(args.index, &mut Default::default(), out),
        }
    }
}

/// Samples of a path as text lines, and those that a render would reject.
#[derive(Default)]
struct Samples(Vec<String>, Vec<String>);

impl Samples {
    fn add(&mut self, stream: &str, uv: [f32; 2], Xyz { x, y, z }: Xyz, weight: f32) {
        let line = format!("{stream} sample at ({}, {}): XYZ {x:e} {y:e} {z:e}", uv[0], uv[1]);
        let fault = fault_of_sample(uv, Xyz { x, y, z }, weight);
        self.1.extend(fault.map(|(part, cause)| format!("{} {}: {line}", part.describe(), cause.describe())));
        self.0.push(line);
    }
}

impl SampleSink for Samples {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.add("camera", uv, value * weight, weight);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.add("light", uv, value, 1.0);
    }
}

/// Formats the events of a path.
struct PathReport<'a> {
    desc: &'a SceneDesc,
    scene: &'a Scene,
    text: String,
    vertices: u32,
    trail: Trail,
}

impl PathReport<'_> {
    fn tell(&mut self, event: &PathEvent) {
        let line = match event {
            PathEvent::Begins(path) => {
                self.vertices = 0;
                self.trail.clear();
                let end = if path.from_light { "a light" } else { "the camera" };
                return self.line(&format!("from {end} with throughput {}", spectrum(path.throughput)));
            }
            PathEvent::Leaves(path) => {
                format!("leaves the scene with throughput {}", spectrum(path.throughput))
            }
            PathEvent::Meets(path, hit) => {
                self.vertices += 1;
                let lambda = path.lambda.lambda().to_array();
                let [x, y, z] = self.scene.space().world_point(hit.point.p).to_array();
                let from = self.trail.meets(path, hit.point.p);
                let length = from.map_or(hit.hit.t, |from| from.distance(hit.point.p));
                let wavelengths = lambda.map(|l| format!("{l:.2}")).join(" ");
                self.line(&format!(
                    "{}  {}\n      at ({x}, {y}, {z}), distance {}, normal {}, shading normal {}\n      back along {}, wavelengths {wavelengths} nm",
                    self.vertices,
                    match hit.known_surface() {
                        Some(surface) => rejected::surface(self.desc, surface),
                        None => path.medium.id().map_or_else(
                            || "scattered in a medium".to_owned(),
                            |id| format!("scattered in {}", medium_name(self.desc, id)),
                        ),
                    },
                    self.scene.space().world_length(length),
                    vector(hit.point.ng),
                    vector(hit.n),
                    vector(hit.wo)
                ));
                return;
            }
            PathEvent::Evaluated { wo, wi, value } => {
                let value = value
                    .map_or("nothing".to_owned(), |(f, pdf)| format!("{} density {:e}", spectrum(f), pdf.0));
                format!("evaluated from {} to {}: {value}", vector(*wo), vector(*wi))
            }
            PathEvent::Sampled { wo, u, lobe, sample } => {
                let what = match sample {
                    None => "the path ends".to_owned(),
                    Some(s) => {
                        let kind = if s.delta { "delta, " } else { "" };
                        let side = if s.transmitted { "transmitted" } else { "reflected" };
                        let (weight, pdf) = (spectrum(s.weight), s.pdf.0);
                        format!("{kind}{side} to {}, weight {weight} density {pdf:e}", vector(s.wi))
                    }
                };
                format!("sampled from {} by ({}, {}; {lobe}): {what}", vector(*wo), u.x, u.y)
            }
            PathEvent::Light { from, light, sample, value, visible } => format!(
                "light sample of {} from ({}) along {}: density {:e}, contributes {}, visible {visible}",
                rejected::light(self.desc, self.scene, *light),
                self.scene.space().world_point(*from),
                vector(sample.wi),
                sample.pdf.0,
                spectrum(*value)
            ),
            PathEvent::Throughput(value) => format!("goes on with throughput {}", spectrum(*value)),
            PathEvent::Radiance(value) => format!("hit a light: radiance so far {}", spectrum(*value)),
            PathEvent::Gathered { photons, area, xyz } => {
                let unit = f64::from(self.scene.space().world_length(1.0));
                let area = f64::from(*area) * unit * unit;
                format!(
                    "gathered {photons} photons on {area:e}: XYZ so far {:e} {:e} {:e}",
                    xyz.x, xyz.y, xyz.z
                )
            }
            PathEvent::ToCamera { uv, value } => {
                format!("connected to the camera at ({}, {}): {}", uv[0], uv[1], spectrum(*value))
            }
            PathEvent::Connection { camera, light, value, visible } => {
                let [a, b] = [camera, light].map(|p| self.scene.space().world_point(*p));
                format!("connected ({a}) to ({b}): contributes {}, visible {visible}", spectrum(*value))
            }
            PathEvent::Estimate { lambda, radiance } => {
                let lambda = lambda.lambda().to_array().map(|l| format!("{l:.2}")).join(" ");
                format!("the path has found {} at {lambda} nm", spectrum(*radiance))
            }
            PathEvent::Fault(fault) => {
                format!("REJECTED: {}", rejected::describe(self.desc, self.scene, fault))
            }
        };
        self.line(&format!("      {line}"));
    }

    fn line(&mut self, line: &str) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{line}");
    }
}

fn vector(v: Vec3) -> String {
    format!("({}, {}, {})", v.x, v.y, v.z)
}

fn spectrum(s: SampledSpectrum) -> String {
    let [a, b, c, d] = s.0.to_array();
    format!("[{a:e} {b:e} {c:e} {d:e}]")
}
