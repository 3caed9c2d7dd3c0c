//! A medium whose coefficients vary in space: grids. Free flights are sampled by delta tracking (Woodcock et al. 1965), transmittances estimated
//! by ratio tracking (Novák, Selle and Jarosz 2014, *Residual Ratio Tracking for Estimating Attenuation in Participating Media*), both
//! against upper bounds of the extinction that are constant in each box of a coarse grid (Szirmay-Kalos, Tóth and Magdics 2011, *Free Path
//! Sampling in High Resolution Inhomogeneous Participating Media*).

use std::sync::Arc;

use glam::{Affine3A, DAffine3, DVec3, Vec3, Vec3A, Vec4};

use crate::math::random::Random;
use crate::math::slab::clip;
use crate::scene::desc::MediumDesc;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::scene::desc::volume::VolumeTexture;
use crate::spectrum::{SampledWavelengths, Spectrum};
use crate::tracer::accel::Ray;

use super::Coefficients;
use super::phase_field::AreaAlong;

/// Points of a grid along each side of a box with one bound.
const POINTS_PER_BOX: usize = 8;

/// Most boxes along an axis.
const MOST_BOXES: usize = 128;

/// From this transmittance on an estimate goes on with a tenth of the probability and ten times the weight.
const SMALL_TRANSMITTANCE: f32 = 0.02;

/// Most tentative collisions of a flight, and of an estimate. It bounds the time in media whose bounds are far above what is there.
const MOST_COLLISIONS: u32 = 1 << 22;

/// Steps of a march through a medium whose extinction is the same everywhere, and the optical depth that they reach; one more step leads on.
const UNIFORM_STEPS: usize = 32;
const UNIFORM_DEPTH: f32 = 16.0;

/// Most steps of a march within one box.
const MOST_STEPS: usize = 4096;

/// How finely a march follows coefficients on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::tracer) enum MarchSteps {
    /// A step for each cell between points of the grid: optical depths are exact where extinction is grey, but for rounding.
    Cells,
    /// Two steps for each box with one bound: optical depths are about right, in a fraction of the time.
    Boxes,
}

/// A medium on grids.
#[derive(Clone, Debug)]
pub(super) struct GridMedium {
    extinction: Extinction,
    /// Factor on it, which includes the unit of length of rendering space.
    scale: f32,
    albedo: SpectrumTexture,
    bounds: BoundGrid,
}

/// σₜ over the scale of a medium.
#[derive(Clone, Debug)]
enum Extinction {
    Uniform(Spectrum),
    Grid(Arc<VolumeTexture>),
}

/// Upper bounds of the extinction, in boxes of the unit cube of its grid.
#[derive(Clone, Debug)]
struct BoundGrid {
    /// Rendering space to the unit cube; `None` for an extinction that is the same everywhere.
    to_unit: Option<Affine3A>,
    count: [usize; 3],
    bounds: Box<[f32]>,
}

/// A part of a ray with one upper bound of the extinction.
#[derive(Clone, Copy, Debug)]
struct BoundedPiece {
    start: f32,
    end: f32,
    bound: f32,
}

/// A ray through a medium, of unit direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrackedRay<'a> {
    pub(super) ray: Ray,
    /// The distance up to which it is in the medium.
    pub(super) end: f32,
    /// The projected area of the particles, seen along it.
    pub(super) area: AreaAlong<'a>,
    pub(super) lambda: &'a SampledWavelengths,
}

/// What a tentative collision was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Collision {
    /// Distance from the beginning of the flight.
    pub(super) t: f32,
    /// Where it is.
    pub(super) p: Vec3,
    /// The probability with which each lane meets a particle.
    pub(super) real: Vec4,
    /// The logarithms of the densities with which each lane would have decided so; 0 where all have the same.
    pub(super) density: Vec4,
    /// The albedo, where the path scatters.
    pub(super) albedo: Option<Vec4>,
}

impl GridMedium {
    /// The medium of a description in rendering space.
    pub(super) fn new(desc: &MediumDesc) -> Self {
        let scale = desc.scale as f32;
        let (extinction, bounds) = match &desc.sigma_t {
            SpectrumTexture::Volume(grid) => (Extinction::Grid(grid.clone()), BoundGrid::of(grid, scale)),
            other => {
                let spectrum = other.mean();
                let bounds =
                    BoundGrid { to_unit: None, count: [1; 3], bounds: [spectrum.max() * scale].into() };
                (Extinction::Uniform(spectrum), bounds)
            }
        };
        Self { extinction, scale, albedo: desc.albedo.clone(), bounds }
    }

    /// True where each wavelength has an extinction of its own.
    pub(super) fn is_chromatic(&self) -> bool {
        match &self.extinction {
            Extinction::Uniform(spectrum) => !spectrum.is_constant(),
            Extinction::Grid(grid) => !grid.is_grey(),
        }
    }

    /// An upper bound of σₜ everywhere.
    pub(super) fn largest_extinction(&self) -> f32 {
        self.bounds.bounds.iter().copied().fold(0.0, f32::max)
    }

    /// The extinction at a point, which lies within its grid.
    #[inline]
    fn extinction_at(&self, p: Vec3, lambda: &SampledWavelengths) -> Vec4 {
        let extinction = match (&self.extinction, &self.bounds.to_unit) {
            (Extinction::Grid(grid), Some(to_unit)) => {
                let rgb = grid.coefficient(to_unit.transform_point3(p));
                if grid.is_grey() { Vec4::splat(rgb[0]) } else { colored(rgb, lambda) }
            }
            (Extinction::Uniform(spectrum), _) => spectrum.sample(lambda).0,
            (Extinction::Grid(_), None) => Vec4::ZERO,
        };
        extinction * self.scale
    }

    /// The extinction infinitely far away: that of a grid is 0.
    pub(super) fn extinction_at_infinity(&self, lambda: &SampledWavelengths) -> Vec4 {
        match &self.extinction {
            Extinction::Uniform(spectrum) => spectrum.sample(lambda).0 * self.scale,
            Extinction::Grid(_) => Vec4::ZERO,
        }
    }

    /// The albedo at a point.
    pub(super) fn albedo_at(&self, p: Vec3, lambda: &SampledWavelengths) -> Vec4 {
        let point = TexturePoint { p, ..TexturePoint::default() };
        self.albedo.sample(&point, lambda).0.clamp(Vec4::ZERO, Vec4::ONE)
    }

    /// Tracks a ray: takes tentative collisions at the optical depth `depth` of the bound, and after each at a new one by `random`, until one
    /// scatters.
    pub(super) fn track(
        &self,
        tracked: &TrackedRay<'_>,
        depth: &mut f64,
        random: &mut Random,
        mut take: impl FnMut(Collision),
    ) -> bool {
        let TrackedRay { ray, end, area, lambda } = tracked;
        let (chromatic, mut collisions) = (self.is_chromatic(), 0);
        let most = match &self.extinction {
            Extinction::Uniform(spectrum) => spectrum.sample(lambda).max_element() * self.scale,
            Extinction::Grid(_) => f32::INFINITY,
        };
        self.bounds.walk(ray, *end, |piece| {
            let piece = BoundedPiece { bound: piece.bound.min(most) * area.most(), ..piece };
            if piece.bound <= 0.0 {
                return false;
            }
            let bound = f64::from(piece.bound);
            let mut t = f64::from(piece.start);
            loop {
                let next = t + *depth / bound;
                if next >= f64::from(piece.end) || collisions == MOST_COLLISIONS {
                    *depth -= bound * (f64::from(piece.end) - t);
                    return false;
                }
                collisions += 1;
                t = next;
                *depth = -(-random.f64()).ln_1p();
                let p = ray.origin + ray.direction * t as f32;
                let extinction = self.extinction_at(p, lambda) * area.at(p);
                let extinction = extinction.min(Vec4::splat(piece.bound));
                let scatters = random.f32() * piece.bound < extinction.x;
                let density = match chromatic {
                    true if scatters => extinction.ln(),
                    true => (piece.bound - extinction).ln(),
                    false => Vec4::ZERO,
                };
                let albedo = scatters.then(|| self.albedo_at(p, lambda));
                let real = extinction / piece.bound;
                take(Collision { t: t as f32, p, real, density, albedo });
                if scatters {
                    return true;
                }
            }
        })
    }

    /// An estimate of the transmittance of a ray.
    pub(super) fn transmittance(&self, tracked: &TrackedRay<'_>, random: &mut Random) -> Vec4 {
        let TrackedRay { ray, end, area, lambda } = tracked;
        if let Extinction::Uniform(spectrum) = &self.extinction
            && !area.varies()
        {
            let extinction = spectrum.sample(lambda).0 * (self.scale * area.most());
            // ∞ · 0 would be NaN.
            return Vec4::select(extinction.cmpgt(Vec4::ZERO), (-extinction * *end).exp(), Vec4::ONE);
        }
        let (mut transmittance, mut collisions) = (Vec4::ONE, 0);
        self.bounds.walk(ray, *end, |piece| {
            let (mut t, bound) = (piece.start, piece.bound * area.most());
            if bound <= 0.0 {
                return false;
            }
            loop {
                t += -(-random.f32()).ln_1p() / bound;
                if t >= piece.end || collisions == MOST_COLLISIONS {
                    return false;
                }
                collisions += 1;
                let p = ray.origin + ray.direction * t;
                let extinction = self.extinction_at(p, lambda) * area.at(p);
                transmittance *= (1.0 - extinction / bound).max(Vec4::ZERO);
                let most = transmittance.max_element();
                if most < SMALL_TRANSMITTANCE {
                    let survives = random.f32() < 0.1;
                    transmittance = if survives { transmittance * 10.0 } else { Vec4::ZERO };
                    if !survives {
                        return true;
                    }
                }
            }
        });
        transmittance
    }

    /// Marches along `ray`, of unit direction, up to the distance `end`: calls `visit` with the beginning, the end and the coefficients of each
    /// half of a step until it returns true. Nothing is left to chance. Steps are where there is anything, and in their order.
    ///
    /// Coefficients are those at the nodes of Gauss's rule of two points, so that optical depths are exact for polynomials up to the third degree,
    /// as trilinear interpolation is along a line.
    pub(super) fn march(
        &self,
        tracked: &TrackedRay<'_>,
        steps: MarchSteps,
        mut visit: impl FnMut([f32; 2], Coefficients) -> bool,
    ) {
        let TrackedRay { ray, end, area, lambda } = tracked;
        let at = |t: f32| {
            let p = ray.origin + ray.direction * t;
            let extinction = self.extinction_at(p, lambda) * area.at(p);
            Coefficients { extinction, albedo: self.albedo_at(p, lambda) }
        };
        let mut step = |start: f32, end: f32| {
            if end == f32::INFINITY {
                return visit([start, end], at(start));
            }
            let (middle, node) = (0.5 * (start + end), 0.5 * GAUSS_NODE * (end - start));
            visit([start, middle], at(middle - node)) || visit([middle, end], at(middle + node))
        };
        let mut ends = Vec::new();
        self.bounds.walk(ray, *end, |piece| {
            ends.clear();
            self.step_ends(ray, piece, steps, &mut ends);
            ends.retain(|t| *t > piece.start && *t < piece.end);
            ends.sort_by(f32::total_cmp);
            ends.push(piece.end);
            let mut start = piece.start;
            ends.iter().any(|&end| step(std::mem::replace(&mut start, end), end))
        });
    }

    /// Adds where steps of a march end within `piece`, in any order; places outside of it are to be left out.
    fn step_ends(&self, ray: &Ray, piece: BoundedPiece, steps: MarchSteps, ends: &mut Vec<f32>) {
        match (&self.extinction, &self.bounds.to_unit) {
            (Extinction::Uniform(_), _) => {
                let reach = (piece.end - piece.start).min(UNIFORM_DEPTH / piece.bound);
                let share = |i: usize| i as f32 / UNIFORM_STEPS as f32;
                ends.extend((1..=UNIFORM_STEPS).map(|i| piece.start + reach * share(i)));
            }
            (Extinction::Grid(grid), Some(to_unit)) if steps == MarchSteps::Cells => {
                let size = Vec3::from_array(grid.size().map(|n| n as f32));
                let origin = to_unit.transform_point3(ray.origin) * size - grid.first_point();
                let direction = to_unit.transform_vector3(ray.direction) * size;
                for axis in 0..3 {
                    let [from, to] = [piece.start, piece.end].map(|t| origin[axis] + direction[axis] * t);
                    let planes = from.min(to).ceil() as i64..=from.max(to).floor() as i64;
                    let at = |plane: i64| (plane as f32 - origin[axis]) / direction[axis];
                    ends.extend(planes.take(MOST_STEPS).map(at));
                }
            }
            (Extinction::Grid(_), _) => ends.push(0.5 * (piece.start + piece.end)),
        }
    }
}

/// 1 / √3.
const GAUSS_NODE: f32 = 0.577_350_27;

/// The spectrum of an extinction with these values for red, green and blue.
#[inline]
fn colored(rgb: [f32; 3], lambda: &SampledWavelengths) -> Vec4 {
    let most = rgb[0].max(rgb[1]).max(rgb[2]);
    if most <= 0.0 {
        return Vec4::ZERO;
    }
    Spectrum::textured_rgb(Vec3A::from_array(rgb) / most, lambda).0 * most
}

impl BoundGrid {
    fn of(grid: &VolumeTexture, scale: f32) -> Self {
        let count = grid.size().map(|n| n.div_ceil(POINTS_PER_BOX).clamp(1, MOST_BOXES));
        // Rounding of an interpolation must not exceed a bound.
        let bounds = grid
            .bounds_of_coefficients(count)
            .into_iter()
            .map(|bound| (bound * scale * (1.0 + 1e-5)).min(1e30));
        Self { to_unit: Some(single(grid.to_grid())), count, bounds: bounds.collect() }
    }

    /// Calls `visit` with the pieces of `ray`, of unit direction, up to the distance `end`, in their order, until it returns true: boxes in
    /// which there is anything. True if `visit` has returned that.
    #[inline]
    fn walk(&self, ray: &Ray, end: f32, mut visit: impl FnMut(BoundedPiece) -> bool) -> bool {
        let Some(to_unit) = &self.to_unit else {
            let piece = BoundedPiece { start: 0.0, end, bound: self.bounds[0] };
            return piece.bound > 0.0 && visit(piece);
        };
        let count = Vec3::from_array(self.count.map(|n| n as f32));
        // Boxes have sides of 1 here; distances along the ray stay what they are.
        let origin = to_unit.transform_point3(ray.origin) * count;
        let direction = to_unit.transform_vector3(ray.direction) * count;
        let inverse = direction.recip();
        let [enter, leave] = clip(origin, inverse, [Vec3::ZERO, count], [0.0, end]);
        if enter >= leave {
            return false;
        }
        let first = origin + direction * enter;
        let mut cell =
            [0, 1, 2].map(|axis| (first[axis].floor() as i64).clamp(0, self.count[axis] as i64 - 1));
        let mut start = enter;
        loop {
            let (mut axis, mut next) = (3, leave);
            for i in 0..3 {
                let plane = cell[i] + i64::from(direction[i] > 0.0);
                let t = (plane as f32 - origin[i]) * inverse[i];
                if direction[i] != 0.0 && t < next {
                    (axis, next) = (i, t);
                }
            }
            // Rounding may put a plane a little behind the last one.
            let piece_end = next.max(start);
            let index =
                (cell[2] as usize * self.count[1] + cell[1] as usize) * self.count[0] + cell[0] as usize;
            let piece = BoundedPiece { start, end: piece_end, bound: self.bounds[index] };
            if piece.bound > 0.0 && piece.end > piece.start && visit(piece) {
                return true;
            }
            if axis == 3 {
                return false;
            }
            start = piece_end;
            cell[axis] += if direction[axis] > 0.0 { 1 } else { -1 };
            if !(0..self.count[axis] as i64).contains(&cell[axis]) {
                return false;
            }
        }
    }
}

fn single(transform: &DAffine3) -> Affine3A {
    let column = |v: DVec3| v.as_vec3();
    let m = transform.matrix3;
    Affine3A::from_cols(
        column(m.x_axis).into(),
        column(m.y_axis).into(),
        column(m.z_axis).into(),
        column(transform.translation).into(),
    )
}
