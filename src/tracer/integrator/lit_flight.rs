//! Equiangular distances: next-event estimation to a point light from a medium, at a distance along a flight that is chosen with a density
//! proportional to 1/r² (Kulla and Fajardo, *Importance Sampling Techniques for Path Tracing in Participating Media*, EGSR 2012, §4.1).
//!
//! A free flight ends seldom near the light, where 1/r² is large: with it alone the variance is infinite. Both strategies find the same path,
//! and the weights of [`wavelength_mis`](crate::tracer::wavelength_mis) depend on the path alone, so that their MIS weights are those of the hero:
//! with the balance heuristic both contribute what the free flight alone would, times the weight of that.
//!
//! It pays where 1/r² varies along the flight more than the density of free flights, within a quarter of a free path of the light. Elsewhere the
//! light is not sampled so, which spares a shadow ray.
//!
//! The density of a flight must be known, as it is in a homogeneous medium, and the distance to the next surface must not depend on
//! where the flight ends. One piece of each flight is lit so: the first in a homogeneous medium that scatters.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::tracer::Scene;
use crate::tracer::bsdf::Scattering;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{LightSample, PointChoice};
use crate::tracer::light_groups::LightCredits;
use crate::tracer::medium::FlightPiece;
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::FlightNumbers;
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;

use super::direct_lighting::PathState;

/// A light is near that is closer to the flight than so many mean free paths of the hero. From 1/10 to 2, this had the least variance at equal
/// time in rooms of fog (tools/README.md).
const NEAR: f64 = 0.25;

/// The least angle, in radians, that a flight takes up seen from a light that is sampled along it: the rounding of angles is far below that.
const LEAST_ANGLE: f64 = 1e-6;

/// The rounding error of a point on a ray, over its coordinates and distance.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// A piece of a flight along which a point light is sampled, and the walk before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitFlight {
    before: Walk<false>,
    piece: FlightPiece,
    /// That of the hero.
    extinction: f32,
}

/// The distances along a ray, seen from a point.
#[derive(Clone, Copy, Debug)]
struct Equiangular {
    /// Distance along the ray of the place next to the point.
    nearest: f64,
    /// Distance of the point from there.
    height: f64,
    /// Angles at the point between the directions to that place and to the beginning and the end of the ray.
    angles: [f64; 2],
}

impl Equiangular {
    /// Those up to `end` along `direction`, of unit length; `None` where the ray goes through the point, or all but away from it.
    fn new(origin: Vec3, direction: Vec3, end: f32, point: Vec3) -> Option<Self> {
        let (to, direction) = ((point - origin).as_dvec3(), direction.as_dvec3());
        let nearest = to.dot(direction);
        let height = (to - direction * nearest).length();
        let angle = |t: f64| (t - nearest).atan2(height);
        let angles = [angle(0.0), angle(f64::from(end))];
        (height > 0.0 && angles[1] - angles[0] > LEAST_ANGLE).then_some(Self { nearest, height, angles })
    }

    /// The least distance of the point from the ray up to `end`.
    fn least_distance(&self, end: f64) -> f64 {
        self.height.hypot(self.nearest - self.nearest.clamp(0.0, end))
    }

    /// The distance chosen by `u` in [0, 1).
    fn sample(&self, u: f64) -> f64 {
        let [first, last] = self.angles;
        self.nearest + self.height * (first + u * (last - first)).tan()
    }

    /// The density of the distance `t`.
    fn pdf(&self, t: f64) -> f64 {
        let [first, last] = self.angles;
        let along = t - self.nearest;
        self.height / ((last - first) * (self.height * self.height + along * along))
    }
}

impl LitFlight {
    /// The piece of a flight of a walk, which was `before` there; `None` where its density is not known or nothing is scattered.
    pub(super) fn new(scene: &Scene, before: Walk<false>, piece: FlightPiece) -> Option<Self> {
        let extinction = piece.hero_extinction(scene.media()?, &before.lambda)?;
        Some(Self { before, piece, extinction })
    }

    /// True where the walk is scattered on this piece.
    pub(super) fn scatters(&self) -> bool {
        self.piece.scatters()
    }

    /// The equiangular distances along this piece; `None` where that lies so that free flights do as well, and the light is not sampled so.
    fn distances(&self, point: &PointChoice) -> Option<Equiangular> {
        let FlightPiece { origin, direction, end, .. } = self.piece;
        let distances = Equiangular::new(origin, direction, end, point.position)?;
        let near = distances.least_distance(end.into()) * f64::from(self.extinction) < NEAR;
        near.then_some(distances)
    }

    /// The MIS weight of next-event estimation at the end of the flight for `sample`, of the point light `light`.
    #[inline]
    pub(super) fn mis_weight(&self, scene: &Scene, light: u32, sample: &LightSample) -> f32 {
        let Some(point) = scene.lights().points().and_then(|points| points.of_light(light)) else {
            return 1.0;
        };
        let Some(distances) = self.distances(&point) else { return 1.0 };
        self.weight_at(self.piece.length, sample.pdf, &distances, &point)
    }

    /// The balance heuristic at the distance `t`, where a free flight ends and then samples the light with the density `pdf`, against the choice of
    /// the light first and an equiangular distance then.
    fn weight_at(&self, t: f32, pdf: PdfW, distances: &Equiangular, point: &PointChoice) -> f32 {
        let density = self.extinction * (-self.extinction * t).exp();
        let flight = f64::from(density) * f64::from(pdf.0);
        let equiangular = distances.pdf(t.into()) * f64::from(point.probability);
        // The density of a flight underflows at an optical depth of 87, from where nothing comes.
        if flight > 0.0 { (flight / (flight + equiangular)) as f32 } else { 0.0 }
    }

    /// Adds the light of a point light that is scattered on this piece first, at an equiangular distance, to `path`.
    pub(super) fn add_direct<B: Scattering>(
        &self,
        scene: &Scene,
        path: &mut PathState<B::Credits>,
        numbers: FlightNumbers,
    ) {
        let lights = scene.lights();
        let (Some(points), Some(media)) = (lights.points(), scene.media()) else { return };
        let FlightPiece { origin, direction, end, medium, .. } = self.piece;
        let point = points.choose(numbers.light_choice);
        let Some(distances) = self.distances(&point) else { return };
        let t = distances.sample(numbers.distance.into()) as f32;
        // A point that rounds to beyond the surface would be lit from there.
        let rounding = ROUNDING * (origin.abs().max_element() + t);
        if !(t >= 0.0 && t + rounding < end) {
            return;
        }
        let Some(walk) = self.before.scattered_on(&self.piece, media, t) else { return };
        let hit = SurfaceInteraction::in_medium(origin + direction * t, -direction, t);
        let vertex = SurfaceVertex::<B>::new(scene, hit, &walk.lambda, medium);
        let light = point.light;
        let Some(sample) = lights.sample_of(light, vertex.light_context()) else { return };
        let mut scattered = path.alone(Walk { depth: walk.depth + 1, ..walk });
        scattered.wavelength_weight = walk.wavelength_weight();
        let weight = self.weight_at(t, sample.pdf, &distances, &point);
        let value = scattered.unoccluded_contribution(lights, &vertex, light, &sample, weight);
        if let Some(value) = value {
            let factor = vertex.light_factor(scene, light, &sample, (&walk).into());
            let (from, visible) = (hit.point.p, factor.max_element());
            B::record(|| PathEvent::Light { from, light, sample, value, visible });
            path.radiance += value * factor;
            path.credits.add(lights, light, value * factor);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The density is that of the samples: over equal steps of `u` its integral grows by equal steps, up to 1 at the end, from beside the
    /// light, far from it, and where a ray has no end.
    #[test]
    fn distances_have_their_density() {
        for (point, end) in [
            (Vec3::new(0.3, 0.0, 1.0), 2.0),
            (Vec3::new(1e-4, 0.0, 1.0), 2.0),
            (Vec3::new(2.0, 1.0, -3.0), 5.0),
            (Vec3::new(0.5, 0.0, 4.0), f32::INFINITY),
        ] {
            let distances =
                Equiangular::new(Vec3::ZERO, Vec3::Z, end, point).expect("the point is beside the ray");
            let places: Vec<f64> = (0..=1000).map(|i| distances.sample(f64::from(i) * 1e-3)).collect();
            assert!(places[0].abs() < 1e-6, "{}", places[0]);
            assert!(end.is_infinite() || (places[1000] - f64::from(end)).abs() < 1e-6, "{}", places[1000]);
            let mut checked = 0;
            for (a, b) in places.iter().zip(&places[1..]) {
                let middle = 0.5 * (a + b);
                // Where a step is short enough for Simpson's rule.
                if b - a < 0.1 * (distances.height + (middle - distances.nearest).abs()) {
                    let mean = (distances.pdf(*a) + 4.0 * distances.pdf(middle) + distances.pdf(*b)) / 6.0;
                    assert!(((b - a) * mean - 1e-3).abs() < 1e-6, "{a} to {b}: {}", (b - a) * mean);
                    checked += 1;
                }
            }
            assert!(checked > 900, "{checked}");
        }
        assert!(
            Equiangular::new(Vec3::ZERO, Vec3::Z, 2.0, Vec3::Z).is_none(),
            "the ray goes through the light"
        );
    }
}
