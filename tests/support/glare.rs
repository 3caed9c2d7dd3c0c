//! Pictures for the tests of glare, and the convolution by its definition.

use glam::{DVec3, Vec3};
use pointillist::client::glare::GlareKernel;
use pointillist::client::{Adaptation, Glare};
use pointillist::image::Grid;
use pointillist::math::random::Random;

pub const ADAPTATIONS: [Adaptation; 3] = [Adaptation::Photopic, Adaptation::Mesopic, Adaptation::Scotopic];

pub fn glare(adaptation: Adaptation) -> Glare {
    Glare { adaptation, ..Glare::default() }
}

/// Noise of five decades with one very bright pixel; fixed.
pub fn noise([width, height]: [usize; 2], seed: u64) -> Grid<Vec3> {
    let mut numbers = Random(seed);
    let mut random = || numbers.f32();
    let mut pixels: Vec<Vec3> = (0..width * height)
        .map(|_| Vec3::new(random(), random(), random()) * 10f32.powf(5.0 * random() - 3.0))
        .collect();
    pixels[(height / 3) * width + width / 3] = Vec3::new(9e3, 1e4, 1.1e4);
    Grid::from_rows(width, height, pixels).expect("as many pixels")
}

/// A black picture with one pixel.
pub fn point([width, height]: [usize; 2], [x, y]: [usize; 2], value: Vec3) -> Grid<Vec3> {
    let mut pixels = vec![Vec3::ZERO; width * height];
    pixels[y * width + x] = value;
    Grid::from_rows(width, height, pixels).expect("as many pixels")
}

/// The definition: `Σ_q K(p − q) g(q) I(q)`, in double precision.
pub fn direct(picture: &Grid<Vec3>, glare: &Glare) -> Vec<DVec3> {
    let (width, height) = (picture.width(), picture.height());
    let kernel = GlareKernel::new([width, height], glare).expect("memory");
    let mut out = vec![DVec3::ZERO; width * height];
    for (q, value) in picture.pixels().iter().enumerate() {
        let (qx, qy) = (q % width, q / width);
        let light = value.as_dvec3() * DVec3::from_array(kernel.gain_at(qx, qy).map(f64::from));
        for (p, out) in out.iter_mut().enumerate() {
            let part = kernel.quadrant.at((p % width).abs_diff(qx), (p / width).abs_diff(qy));
            *out += light * DVec3::from_array(part.map(f64::from));
        }
    }
    out
}

pub fn total(pixels: &[Vec3]) -> DVec3 {
    pixels.iter().map(|v| v.as_dvec3()).sum()
}

/// The most that rounding of f32 in each of log₂ n stages may make of a [`difference`]: 10⁻⁵ of the root mean square, or 2·10⁻⁷ of the
/// brightest value where that is more.
pub fn rounding_bound(wanted: &[DVec3]) -> f64 {
    let square = wanted.iter().map(|v| v.length_squared()).sum::<f64>() / (3 * wanted.len()) as f64;
    let brightest = wanted.iter().map(|v| v.max_element()).fold(0.0, f64::max);
    (2e-7 * brightest / square.sqrt().max(f64::MIN_POSITIVE)).max(1e-5)
}

/// Largest difference of a channel, relative to the root mean square of the wanted values: what rounding in a Fourier
/// transform is measured by.
pub fn difference(got: &[Vec3], wanted: &[DVec3]) -> f64 {
    assert_eq!(got.len(), wanted.len());
    let square = wanted.iter().map(|v| v.length_squared()).sum::<f64>() / (3 * wanted.len()) as f64;
    let worst =
        got.iter().zip(wanted).map(|(g, w)| (g.as_dvec3() - *w).abs().max_element()).fold(0.0, f64::max);
    worst / square.sqrt().max(f64::MIN_POSITIVE)
}
