//! Integrals over directions of lobes however narrow: points are chosen in the space of facet normals in double precision, for reflection
//! and for refraction, and evenly over both hemispheres; each direction counts over the sum of all densities with which it may have
//! been chosen (balance heuristic). The points are those of a lattice, as many as it takes.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use pointillist::tracer::bsdf::{BsdfSample, ScatteringModel};

use super::cases::{Case, LobeWidths};

/// The largest error of an integral that is right.
pub const EXACT: f64 = 1e-3;

/// Points at first and at most. The horizon cuts lobes off, and what a lattice makes of an edge is off by about points^−¾.
const FEWEST: u32 = 1 << 11;
const MOST: u32 = 1 << 18;

/// From this roughness on a lobe is no narrow one.
const WIDE: f64 = 0.3;
const ON_EDGE: f64 = 3.0;

/// Largest relative difference between the weight of a sample and value over density at its direction.
const WEIGHTS: f32 = 1e-2;

/// Largest quotient of the two densities of a sample: rounding a direction turns a facet by 2 % of α where
/// [`Microfacet::resolves`](pointillist::tracer::bsdf::Microfacet::resolves) allows a lobe, and at four α a Gaussian changes by 8 times that.
const DENSITIES: f32 = 1.5;

/// What is wrong with a material seen from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A number is NaN, infinite or negative.
    NotFinite,
    /// Densities, with what ends and what is delta, do not add up to 1 but to this.
    Density(f64),
    /// More light leaves than arrives, or less than single scattering loses: this much.
    Energy(f64),
    /// The mean weight of samples is not the integral of values: these two.
    Mean(f64, f64),
    /// A weight of a sample is not value over density, by this factor.
    Weight(f32),
    /// The densities of a sample and of its evaluation have this quotient.
    SampledDensity(f32),
}

/// Means over all samples of one material from one direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Means {
    /// ∫ of the density.
    pub density: f64,
    /// ∫ of the value, as energy.
    pub value: f64,
    /// Mean weight of all samples, as energy.
    pub weight: f64,
    /// That of deltas alone.
    pub delta: f64,
    /// Probability of a delta or of no sample.
    pub other: f64,
}

/// Point `i` of `count` in the unit cube: a lattice of irrational numbers (Roberts 2018) and even steps.
pub fn lattice(i: u32, count: u32) -> [f64; 3] {
    let at = |step: f64| (0.5 + step * f64::from(i + 1)).fract();
    [at(0.754_877_666_246_692_7), at(0.569_840_290_998_053_2), (f64::from(i) + 0.5) / f64::from(count)]
}

/// A number of the sequence.
pub fn number(u: f64) -> f32 {
    (((u * f64::from(1 << 24)) as u32).min((1 << 24) - 1) as f32) / (1 << 24) as f32
}

/// Density per steradian of normals whose tan θ over α is u / (1 − u): a tail heavier than that of any facets.
pub fn density_of_normals(m: DVec3, alpha: f64) -> f64 {
    let s = (m.truncate().length() / (m.z * alpha)).max(1e-12);
    if m.z > 0.0 { 1.0 / (TAU * s * (1.0 + s).powi(2) * alpha * alpha * m.z.powi(3)) } else { 0.0 }
}

/// A normal with that density.
pub fn normal(alpha: f64, u: f64, v: f64) -> DVec3 {
    let tan = alpha * u / (1.0 - u);
    let (sin_phi, cos_phi) = (TAU * v).sin_cos();
    DVec3::new(tan * cos_phi, tan * sin_phi, 1.0).normalize()
}

/// A normal of GGX, with density D cos θ.
pub fn ggx_normal(alpha: f64, u: f64, v: f64) -> DVec3 {
    let tan = alpha * (u / (1.0 - u)).sqrt();
    let (sin_phi, cos_phi) = (TAU * v).sin_cos();
    DVec3::new(tan * cos_phi, tan * sin_phi, 1.0).normalize()
}

/// How directions are chosen, seen from the side of `wo`.
struct Directions {
    wo: DVec3,
    /// As in [`Case`].
    alpha: LobeWidths,
    /// Index of the far side over that of the near side; 1 where what goes through is mirrored downwards.
    eta: f64,
    transmits: bool,
}

impl Directions {
    /// Whether lobes may be too narrow for points over the hemisphere; else those of the facets only bring in the edge that the
    /// horizon makes of them.
    fn has(&self, kind: usize) -> bool {
        let bent = (self.eta - 1.0).abs().min(1.0);
        // Facets that all stand on edge, as panes of high index have them, make a narrow lobe, too.
        let narrow = |width: f64| !(WIDE..ON_EDGE).contains(&width);
        match kind {
            0 => true,
            1 => narrow(self.alpha.mirror),
            2 => self.transmits,
            _ if self.eta == 1.0 => self.transmits && narrow(self.alpha.pane),
            _ => self.transmits && narrow(self.alpha.refract * bent),
        }
    }

    /// A direction by way `kind`: even above, mirrored, even below, refracted or let through.
    fn at(&self, kind: usize, u: f64, v: f64) -> Option<DVec3> {
        let Self { wo, alpha, eta, .. } = *self;
        let pane = kind == 3 && eta == 1.0;
        let m = match kind {
            1 => normal(alpha.mirror, u, v),
            _ if pane => normal(alpha.pane, u, v),
            _ => normal(alpha.refract, u, v),
        };
        let cos = wo.dot(m);
        let even = |side: f64| {
            let ((sin_phi, cos_phi), r) = ((TAU * v).sin_cos(), (u * (2.0 - u)).sqrt());
            DVec3::new(r * cos_phi, r * sin_phi, side * (1.0 - u))
        };
        match kind {
            0 => Some(even(1.0)),
            1 => (cos > 0.0).then(|| 2.0 * cos * m - wo),
            2 => Some(even(-1.0)),
            _ if pane => {
                let wi = 2.0 * cos * m - wo;
                (cos > 0.0).then(|| wi.with_z(-wi.z))
            }
            _ => {
                let through2 = (eta - 1.0) * (eta + 1.0) + cos * cos;
                let refracts = cos > 0.0 && through2 > 0.0;
                refracts.then(|| (m * (cos - through2.sqrt()) - wo) / eta)
            }
        }
        .filter(|wi| (wi.z > 0.0) == (kind < 2))
    }

    /// The sum of the densities of all ways.
    fn density(&self, wi: DVec3) -> f64 {
        let Self { wo, alpha, eta, .. } = *self;
        let even = 0.5 / PI;
        if wi.z > 0.0 || eta == 1.0 {
            let m = (wo + wi.with_z(wi.z.abs())).normalize();
            let narrow = self.has(if wi.z > 0.0 { 1 } else { 3 });
            let mirrored =
                density_of_normals(m, if wi.z > 0.0 { alpha.mirror } else { alpha.pane }) / (4.0 * wo.dot(m));
            return even + if narrow { mirrored } else { 0.0 };
        }
        let half = wo + wi * eta;
        let m = half.normalize_or_zero() * half.z.signum();
        let (cos, cos_i) = (wo.dot(m), -wi.dot(m));
        if cos <= 0.0 || cos_i <= 0.0 || !self.has(3) {
            return even;
        }
        even + density_of_normals(m, alpha.refract) * eta * eta * cos_i / half.length_squared()
    }
}

/// The means over this many points.
fn means(bsdf: &impl ScatteringModel, case: &Case, wo: Vec3, points: u32) -> Result<Means, Fault> {
    let side = 1f32.copysign(wo.z);
    let up = |w: Vec3| Vec3::new(w.x, w.y, w.z * side);
    let eta = if wo.z > 0.0 { case.behind } else { 1.0 / case.behind };
    let ways =
        Directions { wo: up(wo).as_dvec3().normalize(), alpha: case.alpha, eta, transmits: case.transmits };
    let mut sum = Means::default();
    for i in 0..points {
        let [u, v, lobe] = lattice(i, points);
        for kind in (0..4).filter(|kind| ways.has(*kind)) {
            let Some(wi) = ways.at(kind, u, v) else { continue };
            let Some((value, pdf)) = bsdf.eval(wo, up(wi.as_vec3())) else { continue };
            if !(value.is_finite() && value.0.min_element() >= 0.0 && pdf.0.is_finite()) {
                return Err(Fault::NotFinite);
            }
            let density = ways.density(wi);
            sum.density += f64::from(pdf.0) / density;
            sum.value += f64::from(value.0.x) / density * if wi.z < 0.0 { eta * eta } else { 1.0 };
        }
        match bsdf.sample(wo, [number(u), number(v)], number(lobe)) {
            None => sum.other += 1.0,
            Some(s) => {
                let weight = f64::from(s.weight.0.x * s.eta2);
                sum.weight += weight;
                if s.delta {
                    (sum.other, sum.delta) = (sum.other + 1.0, sum.delta + weight);
                }
            }
        }
    }
    let n = f64::from(points);
    let Means { density, value, weight, delta, other } = sum;
    Ok(Means {
        density: density / n,
        value: value / n,
        weight: weight / n,
        delta: delta / n,
        other: other / n,
    })
}

/// A sample that is not as its evaluation.
fn disagreement(bsdf: &impl ScatteringModel, wo: Vec3, s: &BsdfSample) -> Option<Fault> {
    let good = s.weight.is_finite() && s.weight.0.min_element() >= 0.0 && s.wi.is_finite();
    if !good || !s.pdf.0.is_finite() || s.pdf.0 <= 0.0 || (s.wi.length() - 1.0).abs() > 1e-5 {
        return Some(Fault::NotFinite);
    }
    if s.delta {
        return None;
    }
    let Some((value, pdf)) = bsdf.eval(wo, s.wi) else { return Some(Fault::SampledDensity(0.0)) };
    let (weight, other) = (s.weight.0.x, value.0.x / pdf.0);
    let off = (weight - other).abs() / weight.max(other).max(1e-6);
    let quotient = pdf.0 / s.pdf.0;
    if off > WEIGHTS {
        Some(Fault::Weight(other / weight))
    } else {
        (quotient.max(1.0 / quotient) > DENSITIES).then_some(Fault::SampledDensity(quotient))
    }
}

/// The means of a material seen from `wo` and what is wrong with it. `energy`: the least and the most that it may return.
pub fn examine(bsdf: &impl ScatteringModel, case: &Case, wo: Vec3, energy: [f64; 2]) -> Result<Means, Fault> {
    let last = number(1.0);
    for corner in 0..8u32 {
        let at = |bit: u32| if corner >> bit & 1 == 1 { last } else { 0.0 };
        let sample = bsdf.sample(wo, [at(0), at(1)], at(2));
        let finite = sample.is_none_or(|s| {
            s.weight.is_finite() && s.weight.0.min_element() >= 0.0 && s.wi.is_finite() && s.pdf.0.is_finite()
        });
        if !finite {
            return Err(Fault::NotFinite);
        }
    }
    for i in 0..512 {
        let [u, v, lobe] = lattice(i, 512);
        let sample = bsdf.sample(wo, [number(u), number(v)], number(lobe));
        if let Some(fault) = sample.and_then(|s| disagreement(bsdf, wo, &s)) {
            return Err(fault);
        }
    }
    let mut points = FEWEST;
    loop {
        let means = means(bsdf, case, wo, points)?;
        let (total, returned) = (means.density + means.other, means.value + means.delta);
        // NaN is no agreement.
        let agree = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance;
        let fault = if !agree(total, 1.0, EXACT) {
            Fault::Density(total)
        } else if !agree(means.weight, returned, EXACT * returned.max(1.0)) {
            Fault::Mean(means.weight, returned)
        } else if !(returned >= energy[0] - EXACT && returned <= energy[1] + EXACT) {
            Fault::Energy(returned)
        } else {
            return Ok(means);
        };
        if points >= MOST {
            return Err(fault);
        }
        points *= 2;
    }
}
