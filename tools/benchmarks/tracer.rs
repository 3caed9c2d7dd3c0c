//! Speed of the tracer alone, one thread: camera paths per second of CPU time, rays per path, time per ray.
//! The machine may be busy: the best of several short runs is what counts.

use std::hint::black_box;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};

use pointillist::color::Xyz;
use pointillist::math::frame::Frame;
use pointillist::scene::desc::RenderingSpace;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::accel::{PrimRange, Ray};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, Integrator, PathTracer, Sampler, Scene};

use super::common::{Outcome, thread_seconds};

/// How long to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// CPU seconds of one run
    #[arg(default_value_t = 1.0)]
    seconds: f64,
    /// Runs, of which the best counts
    #[arg(default_value_t = 5)]
    runs: u32,
}

struct Sum(f64, u64);

impl SampleSink for Sum {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0 += f64::from(value.y);
        self.1 += 1;
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// Measures the Cornell box with blocks and with spheres.
pub fn run(arguments: &Arguments) -> Outcome {
    for spheres in [false, true] {
        let desc = cornell_box(spheres);
        let scene = Scene::prepare(&desc)?;
        let camera = Camera::of(&desc)?;
        let context = RenderContext::new(Arc::new(scene), camera, &desc.integrator, 1, UvWindow::PICTURE);
        let tracer = PathTracer { context };
        let name = if spheres { "Cornell box, mirror and glass sphere" } else { "Cornell box" };
        let (mut best, mut sum) = (0f64, Sum(0.0, 0));
        for _ in 0..arguments.runs {
            best = best.max(paths_per_second(&tracer, arguments.seconds, &mut sum));
        }
        println!("{name}: {:.3} M paths/s, mean Y {:.5}", best / 1e6, sum.0 / sum.1 as f64);
        rays(&tracer.context);
        noise(&tracer, 16);
    }
    camera_rays(cornell_box(false), arguments.runs)
}

/// CPU time of a camera ray, by projection.
fn camera_rays(mut desc: SceneDesc, runs: u32) -> Outcome {
    const RAYS: u32 = 1_000_000;
    let stereo = StereoDesc { interocular: 0.1, eyes: StereoEyes::OverUnder };
    let panoramas = [
        ("spherical", ProjectionDesc::Spherical),
        ("cube map", ProjectionDesc::CubeMap(CubeLayout::Block)),
        ("omnidirectional stereo", ProjectionDesc::Stereo(stereo)),
    ];
    let own = ("perspective", desc.camera.projection.clone());
    for (name, projection) in std::iter::once(own).chain(panoramas) {
        desc.camera.projection = projection;
        let camera = Camera::of(&desc)?;
        let mut best = f64::INFINITY;
        for _ in 0..runs {
            let start = thread_seconds();
            for i in 0..RAYS {
                // The generalised golden ratio in two dimensions spreads the places evenly.
                let uv = [0.754_877_666, 0.569_840_291].map(|step| (f64::from(i) * step).fract());
                black_box(camera.ray(uv, [0.5; 2]));
            }
            best = best.min(thread_seconds() - start);
        }
        println!("camera ray, {name}: {:.1} ns", best / f64::from(RAYS) * 1e9);
    }
    Ok(())
}

/// A picture of 512 × 512 sums, box filter.
struct Picture(Vec<Xyz>);

const SIZE: usize = 512;

impl SampleSink for Picture {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, _: f32) {
        let [x, y] = uv.map(|c| ((c * SIZE as f32) as usize).min(SIZE - 1));
        self.0[y * SIZE + x] += value;
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// relMSE = mean((x − ref)² / (ref_Y² + 0.01)) of linear RGB from the difference of two randomisations, whose
/// errors are independent: half the mean square difference, with their mean for the reference.
fn noise(tracer: &PathTracer, per_pixel: u64) {
    let start = thread_seconds();
    let [a, b] = [11, 12].map(|seed| {
        let tracer = PathTracer { context: RenderContext { seed, ..tracer.context.clone() } };
        let mut picture = Picture(vec![Xyz::BLACK; SIZE * SIZE]);
        let n = per_pixel * (SIZE * SIZE) as u64;
        (0..n).for_each(|i| tracer.trace(i, &mut (), &mut picture));
        picture.0
    });
    let seconds = (thread_seconds() - start) / 2.0;
    let rgb = pointillist::color::Profile::srgb().from_xyz;
    let (mut sum, mut luminance) = (0.0, 0.0);
    for (a, b) in a.iter().zip(&b) {
        let [a, b] = [a, b].map(|c| glam::Vec3::new(c.x, c.y, c.z) / per_pixel as f32);
        let y = 0.5 * (a.y + b.y);
        let d = rgb * (a - b);
        sum += f64::from(d.length_squared() / 3.0 * 0.5 / (y * y + 0.01));
        luminance += f64::from((a.y - b.y).powi(2) * 0.5 / (y * y + 0.01));
    }
    let [relative, luminance] = [sum, luminance].map(|s| s / (SIZE * SIZE) as f64);
    println!(
        "  {per_pixel} per pixel: relMSE {relative:.5} (of Y {luminance:.5}), times CPU seconds {:.4}",
        relative * seconds
    );
}

fn paths_per_second(tracer: &PathTracer, seconds: f64, sum: &mut Sum) -> f64 {
    let (start, first) = (thread_seconds(), sum.1);
    while thread_seconds() - start < seconds {
        for _ in 0..4096 {
            tracer.trace(sum.1, &mut (), sum);
        }
    }
    (sum.1 - first) as f64 / (thread_seconds() - start)
}

/// Time of the two questions on rays that bounce around the scene.
fn rays(RenderContext { scene, camera, .. }: &RenderContext) {
    let mut rays = Vec::new();
    for i in 0..100_000 {
        let sampler = Sampler::at(i, 7);
        let mut ray = camera.ray(sampler.camera().screen, [0.5; 2]).unwrap();
        for depth in 0..4 {
            let Some(hit) = scene.closest(&ray) else { break };
            let side = if hit.wo.dot(hit.n) < 0.0 { -1.0 } else { 1.0 };
            let d = pointillist::math::warp::cosine_hemisphere(sampler.vertex(depth).bsdf) * side;
            ray = hit.spawn(Frame::new(hit.n).to_world(d));
            rays.push(ray);
        }
    }
    let mut line = Vec::new();
    for (name, ask) in [("closest", closest as fn(&Scene, &Ray) -> bool), ("occluded", occluded)] {
        let mut best = f64::INFINITY;
        for _ in 0..20 {
            let start = thread_seconds();
            let hits = rays.iter().filter(|r| ask(scene, r)).count();
            best = best.min((thread_seconds() - start) * 1e9 / rays.len() as f64);
            assert!(hits <= rays.len());
        }
        line.push(format!("{name} {best:.1} ns"));
    }
    println!("  bounce rays: {}", line.join(", "));
}

fn closest(scene: &Scene, ray: &Ray) -> bool {
    scene.accel().closest(ray).is_some()
}

fn occluded(scene: &Scene, ray: &Ray) -> bool {
    scene.accel().occluded(&Ray { t_max: 1.0, ..*ray }, PrimRange::NONE)
}

/// The Cornell box as Mitsuba's own example has it: two units wide, light of 0.46 × 0.38 under the ceiling.
fn cornell_box(spheres: bool) -> SceneDesc {
    let diffuse = |rgb| BsdfDesc::Diffuse(DiffuseDesc { reflectance: Spectrum::reflectance_rgb(rgb).into() });
    let one = || Spectrum::Constant(1.0);
    let glass = BsdfDesc::Dielectric(DielectricDesc {
        int_ior: Ior::Constant(1.5),
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: one().into(),
        specular_transmittance: one().into(),
    });
    let mirror = BsdfDesc::Conductor(ConductorDesc {
        eta: Spectrum::Constant(0.0),
        k: one(),
        specular_reflectance: one().into(),
    });
    let place = Place::default();
    let shape = |kind: ShapeKind, to_world: DAffine3, bsdf: u32| ShapeDesc {
        id: None,
        place,
        kind,
        to_world,
        flip_normals: false,
        bsdf: BsdfId(bsdf),
        emission: None,
        emission_profile: Default::default(),
        medium_interface: Default::default(),
    };
    let turn = |axis: DVec3, degrees: f64| DAffine3::from_axis_angle(axis, degrees.to_radians());
    let wall = |at: DVec3, turned: DAffine3, bsdf| {
        shape(ShapeKind::Rectangle, DAffine3::from_translation(at) * turned, bsdf)
    };
    let mut shapes = vec![
        wall(-DVec3::Y, turn(DVec3::X, -90.0), 0),
        wall(DVec3::Y, turn(DVec3::X, 90.0), 0),
        wall(-DVec3::Z, DAffine3::IDENTITY, 0),
        wall(DVec3::X, turn(DVec3::Y, -90.0), 1),
        wall(-DVec3::X, turn(DVec3::Y, 90.0), 2),
    ];
    let mut light = shape(
        ShapeKind::Rectangle,
        DAffine3::from_translation(DVec3::new(0.0, 0.99, 0.01))
            * turn(DVec3::X, 90.0)
            * DAffine3::from_scale(DVec3::new(0.23, 0.19, 0.19)),
        0,
    );
    light.emission = Some(Spectrum::emission_rgb([18.387, 13.9873, 6.75357]));
    shapes.push(light);
    if spheres {
        let ball = |x: f64, z: f64, bsdf| {
            let kind = ShapeKind::Sphere { center: DVec3::new(x, -0.6, z), radius: 0.4 };
            shape(kind, DAffine3::IDENTITY, bsdf)
        };
        shapes.extend([ball(-0.45, -0.3, 4), ball(0.45, 0.3, 3)]);
    } else {
        let block = |at: DVec3, degrees, size: DVec3| {
            let m = DAffine3::from_translation(at) * turn(DVec3::Y, degrees) * DAffine3::from_scale(size);
            shape(ShapeKind::Cube, m, 0)
        };
        shapes.push(block(DVec3::new(0.335, -0.7, 0.38), -17.0, DVec3::splat(0.3)));
        shapes.push(block(DVec3::new(-0.33, -0.4, -0.28), 18.25, DVec3::new(0.3, 0.61, 0.3)));
    }
    SceneDesc {
        files: Vec::new(),
        camera: CameraDesc {
            projection: ProjectionDesc::Perspective(PerspectiveDesc {
                fov: 39.3077,
                fov_axis: FovAxis::Smaller,
                lens: LensDesc::PINHOLE,
                distortion: None,
            }),
            to_world: DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.9)) * turn(DVec3::Y, 180.0),
            principal_point_offset: DVec2::ZERO,
            near_clip: 0.001,
            far_clip: 100.0,
            medium: None,
            place,
        },
        film: FilmDesc { width: 512, height: 512, crop: None, rfilter: None },
        integrator: IntegratorDesc::default(),
        samples_per_pixel: None,
        bsdfs: vec![
            diffuse([0.885809, 0.698859, 0.666422]),
            diffuse([0.105421, 0.37798, 0.076425]),
            diffuse([0.570068, 0.0430135, 0.0443706]),
            glass,
            mirror,
        ],
        meshes: Vec::new(),
        names: Names::default(),
        space: RenderingSpace::WORLD,
        groups: Vec::new(),
        shapes,
        lights: Vec::new(),
        media: Vec::new(),
    }
}
