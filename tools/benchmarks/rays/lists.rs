//! The rays of a mesh, the same for everybody: from the camera, from what these see, and towards the light.

use glam::Vec3;
use pointillist::math::frame::Frame;
use pointillist::math::warp::cosine_hemisphere;
use pointillist::tracer::accel::{Accel, Ray};

use pointillist::math::random::Random;

use crate::meshes::{Light, Model};

/// Pixels along a side of the picture.
const SIDE: usize = 1024;

/// What the rays are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From the camera, pixel by pixel.
    Primary,
    /// Off what the camera sees, by the cosine, in no order.
    Shuffled,
    /// The same in the order of the pixels.
    Path,
    /// From what the camera sees to points of the light, in no order.
    Shadow,
}

impl Kind {
    /// All.
    pub const ALL: [Kind; 4] = [Kind::Primary, Kind::Shuffled, Kind::Path, Kind::Shadow];

    /// Its name, as users write it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Shuffled => "shuffled",
            Kind::Path => "path",
            Kind::Shadow => "shadow",
        }
    }
}

/// Rays of every kind, in the order of [`Kind::ALL`].
pub fn rays(model: &Model, accel: &Accel, triangles: &[[Vec3; 3]]) -> [Vec<Ray>; 4] {
    let camera = &model.camera;
    let forward = (camera.target - camera.origin).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let half = (0.5 * camera.fov.to_radians()).tan();
    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|i| {
            let [x, y] = [i % SIDE, i / SIDE].map(|c| (c as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0);
            Ray::new(camera.origin, (forward + (right * x - up * y) * half).normalize())
        })
        .collect();
    let Light { centre, half: [u, v], .. } = model.light;
    let (mut path, mut shadow, mut random) = (Vec::new(), Vec::new(), Random(2));
    for ray in &primary {
        let Some(hit) = accel.closest(ray) else { continue };
        let [a, b, c] = triangles[hit.prim as usize];
        let n = (b - a).cross(c - a).normalize();
        let n = if n.dot(ray.direction) < 0.0 { n } else { -n };
        let p = ray.origin + ray.direction * hit.t;
        // Far enough off the surface for every float, and far less than any triangle is large.
        let p = p + n * (1e-5 * p.abs().max_element().max(1.0));
        let d = cosine_hemisphere([random.f32(), random.f32()]);
        path.push(Ray::new(p, Frame::new(n).to_world(d)));
        let to = centre + u * random.within(-1.0, 1.0) + v * random.within(-1.0, 1.0);
        shadow.push(Ray { origin: p, direction: to - p, t_max: 0.999 });
    }
    let mut shuffled = path.clone();
    shuffle(&mut shuffled, &mut random);
    shuffle(&mut shadow, &mut random);
    [primary, shuffled, path, shadow]
}

/// Fisher and Yates.
fn shuffle(rays: &mut [Ray], random: &mut Random) {
    for i in (1..rays.len()).rev() {
        rays.swap(i, (random.bits() % (i as u64 + 1)) as usize);
    }
}
