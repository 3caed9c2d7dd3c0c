//! The point-spread function as a picture: one number for each channel and pixel offset.

use rayon::prelude::*;

use crate::client::glare::point_spread::GlareProfile;
use crate::client::settings::Glare;
use crate::image::Grid;

/// Largest angle that the picture's width may fill, degrees: it is seen in a plane.
pub const MAX_VIEW_ANGLE: f32 = 170.0;

/// Point-spread function between pixels, for pictures of one size.
///
/// Offsets reach over the whole picture both ways. The kernel is even in both directions, so one quadrant is kept.
pub struct GlareKernel {
    /// Parts of the light of pixel 0 that pixel `(x, y)` gets, for X, Y, Z; over all offsets, of either sign, they
    /// sum to 1.
    pub quadrant: Grid<[f32; 3]>,
    /// `g`: 1 / the part of a pixel's light that stays in the picture; left upper quarter, the others are its mirror
    /// images.
    pub gain: Grid<[f32; 3]>,
    /// Whether the channels differ (the halo is coloured).
    pub chromatic: bool,
}

impl GlareKernel {
    /// The kernel for pictures of `width` × `height` pixels, both at least 1; `None` without memory for it.
    ///
    /// Angles are those of a plane that is seen perpendicularly at the centre of the picture: `tan θ = r · t`, with
    /// `t` the tangent that a pixel spans there. Pixels take their part of solid angle, `cos³θ t²`.
    pub fn new([width, height]: [usize; 2], glare: &Glare) -> Option<Self> {
        let profile = GlareProfile::new(glare.adaptation);
        let angle = glare.view_angle.clamp(1e-3, MAX_VIEW_ANGLE);
        let pixels = PixelIntegrator {
            profile: &profile,
            tangent: 2.0 * (f64::from(angle).to_radians() / 2.0).tan() / width as f64,
        };
        let mut quadrant = Grid::try_filled(width, height, [0.0f32; 3])?;
        quadrant.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                *value = pixels.part(x, y).map(|v| v as f32);
            }
        });
        let sums = prefix_sums(&quadrant)?;
        let whole = sums.at(width - 1, height - 1).map(|v| 4.0 * v);
        let scale = whole.map(|v| 1.0 / v);
        quadrant.pixels_mut().par_iter_mut().for_each(|v| *v = [0, 1, 2].map(|c| v[c] * scale[c]));
        let gain = gains(&sums, whole)?;
        Some(Self { quadrant, gain, chromatic: profile.is_chromatic() })
    }

    /// Size of the pictures that the kernel is for, in pixels.
    pub fn extent(&self) -> [usize; 2] {
        [self.quadrant.width(), self.quadrant.height()]
    }

    /// Gain `g` at a pixel.
    pub fn gain_at(&self, x: usize, y: usize) -> [f32; 3] {
        let [width, height] = self.extent();
        self.gain.at(x.min(width - 1 - x), y.min(height - 1 - y))
    }
}

/// Integrates the point-spread function over the pixels of a picture.
struct PixelIntegrator<'a> {
    profile: &'a GlareProfile,
    /// Tangent of the angle that a pixel spans at the centre.
    tangent: f64,
}

impl PixelIntegrator<'_> {
    /// Light per pixel at `r` pixels from the source.
    fn density(&self, r: f64) -> [f64; 3] {
        let tan = r * self.tangent;
        let cos2 = 1.0 / (1.0 + tan * tan);
        let area = self.tangent * self.tangent * cos2 * cos2.sqrt();
        self.profile.at(tan.atan().to_degrees()).map(|v| v * area)
    }

    /// Light that falls into the pixel at this offset: an integral over its area.
    fn part(&self, x: usize, y: usize) -> [f64; 3] {
        if x == 0 && y == 0 {
            return self.center();
        }
        let (x, y) = (x as f64, y as f64);
        let r = x.hypot(y);
        match self.parts(r) {
            0 => self.density(r),
            n => integrate_pixel([x, y], n, |x, y| self.density(x.hypot(y))),
        }
    }

    /// Subdivisions of a pixel at this distance along each side; 0 if its centre suffices.
    fn parts(&self, r: f64) -> usize {
        let tan = r * self.tangent;
        let degrees = tan.atan().to_degrees();
        let pixel = self.tangent.to_degrees() / (1.0 + tan * tan).sqrt();
        // For the power laws, subdivisions must be small relative to the distance.
        let mut n = if r < 48.0 { (12.0 / r).ceil() } else { 0.0 };
        let nearest = degrees - 0.75 * pixel;
        if nearest < 0.1 {
            n = n.max((pixel / 0.01).ceil()); // f₀ is 0.02° wide
        }
        if let Some([from, to]) = self.profile.halo_range()
            && pixel > 0.01
            && degrees + 0.75 * pixel > from
            && nearest < to
        {
            n = n.max((pixel / 0.08).ceil()); // the halo of one wavelength is 0.16° wide
        }
        n as usize
    }

    /// Light that stays in the source pixel. In polar coordinates, because the central spike may be far narrower than a pixel.
    fn center(&self) -> [f64; 3] {
        const SECTORS: usize = 64;
        let ring = |r: f64| self.density(r).map(|v| v * r);
        // Up to the inscribed circle, in steps that grow with the distance: r = s (eᵘ − 1).
        let s = 0.005f64.to_radians() / self.tangent;
        let top = (0.5 / s).ln_1p();
        let mut inside = integrate([0.0, top], 512, |u| {
            let grown = u.exp();
            ring(s * (grown - 1.0)).map(|v| v * s * grown)
        });
        // From the circle to the pixel's edge, at angles from 0 to 45°.
        let mut sum = [0.0; 3];
        let (mut last, half) = (0.5, std::f64::consts::FRAC_PI_4 / (2 * SECTORS) as f64);
        for sector in 0..SECTORS {
            for (node, weight) in GAUSS_4 {
                let edge = 0.5 / (((2 * sector + 1) as f64 + node) * half).cos();
                add(&mut inside, integrate([last, edge], 1, ring), 1.0);
                last = edge;
                add(&mut sum, inside, 8.0 * weight * half);
            }
        }
        sum
    }
}

/// Sums over all offsets `0 ≤ x' ≤ x, 0 ≤ y' ≤ y`, in which those on an axis count half: four of them, one for each
/// quadrant, then sum a rectangle about offset 0.
fn prefix_sums(quadrant: &Grid<[f32; 3]>) -> Option<Grid<[f32; 3]>> {
    let width = quadrant.width();
    let mut sums = Grid::try_filled(width, quadrant.height(), [0.0f32; 3])?;
    let mut above = vec![[0.0f64; 3]; width];
    for (y, out) in sums.pixels_mut().chunks_exact_mut(width).enumerate() {
        let mut along = [0.0f64; 3];
        for (x, (value, out)) in quadrant.row(y).iter().zip(out).enumerate() {
            let weight = if x == 0 { 0.5 } else { 1.0 } * if y == 0 { 0.5 } else { 1.0 };
            add(&mut along, value.map(f64::from), weight);
            add(&mut above[x], along, 1.0);
            *out = above[x].map(|v| v as f32);
        }
    }
    Some(sums)
}

/// Gain `g` of the left upper quarter, including the middle row and column.
fn gains(sums: &Grid<[f32; 3]>, whole: [f32; 3]) -> Option<Grid<[f32; 3]>> {
    let (width, height) = (sums.width(), sums.height());
    let mut gain = Grid::try_filled(width.div_ceil(2), height.div_ceil(2), [0.0f32; 3])?;
    gain.pixels_mut().par_chunks_mut(width.div_ceil(2)).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let (right, down) = (width - 1 - x, height - 1 - y);
            let four = [sums.at(x, y), sums.at(right, y), sums.at(x, down), sums.at(right, down)];
            *out = [0, 1, 2].map(|c| whole[c] / four.iter().map(|sum| sum[c]).sum::<f32>());
        }
    });
    Some(gain)
}

/// Nodes on `[−1, 1]` and weights of the Gauss–Legendre rule with 2 points (Abramowitz and Stegun, table 25.4): exact for
/// cubics.
const GAUSS_2: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// The same with 4 points: exact up to degree 7.
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// `∫_a^b f` for three functions at once, 4 points on each of `panels` equal parts.
fn integrate([a, b]: [f64; 2], panels: usize, f: impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
    let half = 0.5 * (b - a) / panels as f64;
    let mut sum = [0.0; 3];
    for panel in 0..panels {
        let middle = a + (2 * panel + 1) as f64 * half;
        for (node, weight) in GAUSS_4 {
            add(&mut sum, f(middle + node * half), weight * half);
        }
    }
    sum
}

/// `∬ f(x, y)` over the square of side 1 about `center`, 2×2 points on each of `n × n` equal parts.
fn integrate_pixel(center: [f64; 2], n: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> [f64; 3] {
    let half = 0.5 / n as f64;
    let at = |origin: f64, part: usize, node: f64| origin - 0.5 + ((2 * part + 1) as f64 + node) * half;
    let mut sum = [0.0; 3];
    for (row, column) in (0..n * n).map(|i| (i / n, i % n)) {
        for (v, _) in GAUSS_2 {
            for (u, _) in GAUSS_2 {
                add(&mut sum, f(at(center[0], column, u), at(center[1], row, v)), half * half);
            }
        }
    }
    sum
}

/// `sum += weight · value`.
fn add(sum: &mut [f64; 3], value: [f64; 3], weight: f64) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_exact() {
        let [a, b, c] = integrate([1.0, 3.0], 1, |x| [x.powi(7), x, 1.0]);
        assert!((a - 820.0).abs() < 1e-10 && (b - 4.0).abs() < 1e-13 && (c - 2.0).abs() < 1e-13);
        let [a, b, _] = integrate_pixel([2.0, 1.0], 3, |x, y| [x * x * y, 1.0, 0.0]);
        assert!((a - (4.0 + 1.0 / 12.0)).abs() < 1e-13 && (b - 1.0).abs() < 1e-13);
    }
}
