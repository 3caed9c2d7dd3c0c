//! Samples do not depend on the instructions that walk the rays: whole paths of every kernel, bit by bit.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};

use crate::support::scenes::{empty, environment, glass, grey, look, material, shape};
use pointillist::color::Xyz;
use pointillist::scene::desc::*;
use pointillist::scene::load;
use pointillist::spectrum::dispersion::Ior;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::accel::SimdKernel;
use pointillist::tracer::integrator::{BidirectionalTracer, PhotonTracer, RenderContext, VcmTracer};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

/// Indices of the sequence that are traced.
const INDICES: u64 = 20_000;

/// A sample as it came: its index, and the bits of u, v, X, Y, Z and of its weight; a light sample has none.
type Bits = (u64, [Option<u32>; 6]);

/// Every sample, in order.
#[derive(Default)]
struct Taken {
    index: u64,
    samples: Vec<Bits>,
    /// Those that are not black.
    lit: usize,
}

impl Taken {
    fn take(&mut self, [u, v]: [f32; 2], value: Xyz, weight: Option<f32>) {
        let all = [Some(u), Some(v), Some(value.x), Some(value.y), Some(value.z), weight];
        self.samples.push((self.index, all.map(|number| number.map(f32::to_bits))));
        self.lit += usize::from(value.y != 0.0);
    }
}

impl SampleSink for Taken {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.take(uv, value, Some(weight));
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.take(uv, value, None);
    }
}

#[derive(Clone, Copy, Debug)]
enum Method {
    Path,
    Bidirectional,
    Photon,
    Vcm,
}

fn trace<I: Integrator>(tracer: &I) -> Taken {
    let (mut taken, mut scratch) = (Taken::default(), I::Scratch::default());
    for index in 0..INDICES {
        taken.index = index;
        tracer.trace(index, &mut scratch, &mut taken);
    }
    taken
}

/// The first samples of a scene by one kernel.
fn samples(desc: &SceneDesc, method: Method, kernel: SimdKernel, seed: u32) -> Taken {
    let scene = Scene::prepare(desc).unwrap().with_kernel(kernel).unwrap();
    assert_eq!((scene.kernel(), scene.accel().kernel()), (kernel, kernel));
    let camera = Camera::of(desc).unwrap();
    let context = RenderContext::new(Arc::new(scene), camera, &desc.integrator, seed, UvWindow::PICTURE);
    // So small that each pixel is visited several times.
    let context = context.of_size([8; 2]);
    match method {
        Method::Path => trace(&PathTracer { context }),
        Method::Bidirectional => trace(&BidirectionalTracer { context }),
        // In index order, so that it does not depend on who traces what.
        Method::Photon => trace(&PhotonTracer::new(context, true)),
        Method::Vcm => trace(&VcmTracer::new(context, true)),
    }
}

fn available() -> impl Iterator<Item = SimdKernel> {
    SimdKernel::ALL.into_iter().filter(|kernel| kernel.is_available())
}

/// All kernels of this processor against the one that every processor has.
#[track_caller]
fn agree(name: &str, desc: &SceneDesc, methods: &[Method]) {
    for &method in methods {
        let scalar = samples(desc, method, SimdKernel::Scalar, 7);
        let (count, lit) = (scalar.samples.len(), scalar.lit);
        // Every index has samples, and enough of them have met something and light.
        assert!(
            count as u64 >= INDICES && lit as u64 >= INDICES / 10,
            "{name}, {method:?}: {lit} of {count}"
        );
        for kernel in available().filter(|kernel| *kernel != SimdKernel::Scalar) {
            let other = samples(desc, method, kernel, 7);
            let differs = scalar.samples.iter().zip(&other.samples).find(|(a, b)| a != b);
            assert!(differs.is_none(), "{name}, {method:?}: scalar and {}: {differs:?}", kernel.name());
            assert_eq!(other.samples.len(), count, "{name}, {method:?}: {}", kernel.name());
        }
        let names: Vec<&str> = available().map(SimdKernel::name).collect();
        println!("{name}, {method:?}: {INDICES} indices, {count} samples, {lit} lit: {}", names.join(", "));
    }
}

fn scene(name: &str) -> SceneDesc {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name), &[]).unwrap().desc
}

#[test]
fn cornell_box() {
    agree("cornell", &scene("cornell.xml"), &[Method::Path, Method::Bidirectional, Method::Photon]);
}

#[test]
fn mirror_and_glass() {
    let methods = [Method::Path, Method::Bidirectional, Method::Photon];
    agree("cornell_spheres", &scene("cornell_spheres.xml"), &methods);
}

#[test]
fn caustics() {
    let methods = [Method::Path, Method::Bidirectional, Method::Photon, Method::Vcm];
    agree("caustic", &scene("caustic.xml"), &methods);
}

#[test]
fn instances() {
    agree("instances", &scene("instances.xml"), &[Method::Path, Method::Bidirectional]);
}

/// A square from −1 to 1 in `steps`² fields, raised by `height`.
fn raised(steps: usize, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=steps {
        for j in 0..=steps {
            let uv = Vec2::new(j as f32, i as f32) / steps as f32;
            let at = 2.0 * uv - 1.0;
            mesh.positions.push(Vec3::new(at.x, at.y, height(at.x, at.y)));
            mesh.uvs.push(uv);
        }
    }
    let row = steps as u32 + 1;
    for corner in (0..steps as u32).flat_map(|i| (0..steps as u32).map(move |j| i * row + j)) {
        let [a, b, c, d] = [corner, corner + 1, corner + row + 1, corner + row];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Hills, a wavy pane of glass over them, a disk, a lamp and the sky.
fn hills() -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -5.0, 4.0), DVec3::new(0.0, 5.0, -4.0), 40.0);
    let [white, clear] = [grey(0.7), glass(Ior::Constant(1.5))].map(|m| material(&mut desc, m));
    let hill = raised(40, |x, y| 0.3 * (5.0 * x).sin() * (4.0 * y).cos());
    let pane = raised(12, |x, y| 0.05 * (9.0 * x + 2.0 * y).sin());
    desc.meshes.extend([hill, pane].map(Arc::new));
    let at = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let wide = DAffine3::from_scale(DVec3::new(2.0, 2.0, 1.0));
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), wide, white, 0.0);
    shape(&mut desc, ShapeKind::Mesh(MeshId(1)), at(0.6), clear, 0.0);
    shape(&mut desc, ShapeKind::Disk, at(0.3) * DAffine3::from_rotation_y(0.4), white, 0.0);
    shape(&mut desc, ShapeKind::Rectangle, at(5.0) * DAffine3::from_rotation_x(3.0), white, 9.0);
    environment(&mut desc);
    desc
}

#[test]
fn meshes() {
    agree("hills", &hills(), &[Method::Path, Method::Bidirectional, Method::Photon]);
}

/// What [`agree`] compares tells even small changes: another seed, and a hill that is moved by less than a pixel.
#[test]
fn the_comparison_can_tell_samples_apart() {
    let desc = hills();
    let mut moved = desc.clone();
    moved.shapes[0].to_world.translation.z += 1e-5;
    let of = |desc: &SceneDesc, seed| samples(desc, Method::Path, SimdKernel::Scalar, seed).samples;
    let first = of(&desc, 7);
    assert!(first == of(&desc, 7) && first != of(&desc, 8) && first != of(&moved, 7));
}

/// A kernel stays through edits, whether the tree is kept or built anew; while a tree is shared it stays for both.
#[test]
fn edits_keep_the_kernel() {
    let desc = hills();
    let mut painted = desc.clone();
    painted.bsdfs[0] = grey(0.2);
    let mut moved = desc.clone();
    moved.shapes[0].to_world.translation.z += 0.1;
    assert_eq!(Scene::prepare(&desc).unwrap().kernel(), SimdKernel::best());
    for kernel in available() {
        let scene = Scene::prepare(&desc).unwrap().with_kernel(kernel).unwrap();
        let edited = scene.edited(&painted).unwrap();
        assert_eq!((edited.kernel(), scene.edited(&moved).unwrap().kernel()), (kernel, kernel));
        assert_eq!(edited.with_kernel(kernel).unwrap().kernel(), kernel);
        let shares = scene.edited(&painted).unwrap();
        let other = available().find(|other| *other != kernel);
        assert!(other.is_none_or(|other| shares.with_kernel(other).is_none()));
        assert!(other.is_none_or(|other| scene.with_kernel(other).is_some_and(|s| s.kernel() == other)));
    }
    for kernel in SimdKernel::ALL.into_iter().filter(|kernel| !kernel.is_available()) {
        assert!(Scene::prepare(&desc).unwrap().with_kernel(kernel).is_none(), "{kernel:?}");
    }
}
