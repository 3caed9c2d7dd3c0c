//! What all media along a line of sight do together, without chance: for the layers beside a picture, and for the features that steer the noise
//! filter. Paths fly and connect vertices by [`flight`](super::flight) instead.

use glam::DVec4;

use crate::spectrum::SampledWavelengths;
use crate::tracer::Scene;
use crate::tracer::accel::Ray;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::opacity::{MOST_PASSED, past};

use super::grid::{MarchSteps, TrackedRay};
use super::{Coefficients, Media, Medium, MediumIndex, MediumKind};

/// Where no more light than this comes through, nothing further on is looked at.
const OPAQUE: f64 = 1e-6;

/// The parts of a line of sight that lie in media, up to the first surface.
#[derive(Debug, Default)]
pub(in crate::tracer) struct LineOfSight<'a> {
    media: Option<&'a Media>,
    pieces: Vec<LinePiece>,
}

/// A part of a line of sight within one medium.
#[derive(Clone, Copy, Debug)]
struct LinePiece {
    medium: MediumIndex,
    /// Begins where the part begins.
    ray: Ray,
    /// Distance of that from where the line begins.
    start: f32,
    /// May be infinite.
    length: f32,
}

/// What the media on a line of sight do at the wavelengths of a path. Distances count from where the line begins.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracer) struct LineMedia {
    /// Transmittance T from the beginning to the end.
    pub(in crate::tracer) transmittance: DVec4,
    /// ∫ σₛ T dt: the share of light seen that is scattered on the line first, when equal light comes from everywhere.
    pub(in crate::tracer) scattered: DVec4,
    /// ∫ t σₛ T dt: the same, times the distance at which it is scattered.
    pub(in crate::tracer) moment: DVec4,
}

impl Scene {
    /// The first surface along `ray`, of unit direction, at which `ends` says so, given how much of it is there, and the media on the way to it,
    /// or on all the way where there is none. `ray`, which begins in `medium`, then begins behind what it has passed, and `medium` is that in which it
    /// comes to its end.
    pub(in crate::tracer) fn look(
        &self,
        ray: &mut Ray,
        medium: &mut MediumIndex,
        ends: impl Fn(&Ray, &SurfaceInteraction, f32) -> bool,
    ) -> (Option<SurfaceInteraction>, LineOfSight<'_>) {
        let mut line = LineOfSight { media: self.media(), pieces: Vec::new() };
        let Some(media) = line.media else { return (self.walk(ray, ends), line) };
        let (origin, mut passed) = (ray.origin, 0);
        loop {
            let at = self.first(ray);
            if media.get(*medium).is_some() {
                let length = at.map_or(ray.t_max, |at| at.hit.t);
                line.pieces.push(LinePiece {
                    medium: *medium,
                    ray: *ray,
                    start: ray.origin.distance(origin),
                    length,
                });
            }
            let Some(at) = at else { return (None, line) };
            if ends(ray, &at, self.opacity(&at)) || passed == MOST_PASSED {
                return (Some(at), line);
            }
            let beside = self.beside(media, &at, ray.direction);
            if let Some(other) = beside.iter().find(|other| ends(ray, other, self.opacity(other))) {
                return (Some(*other), line);
            }
            passed += 1;
            *medium = media.behind_all(&at, &beside, ray.direction, *medium);
            *ray = past(ray, &at);
        }
    }
}

impl LineOfSight<'_> {
    /// True where nothing on it depends on the wavelength.
    pub(in crate::tracer) fn is_grey(&self) -> bool {
        let grey = |piece: &LinePiece| self.media?.get(piece.medium).map(|medium| medium.is_grey);
        self.pieces.iter().all(|piece| grey(piece).unwrap_or(true))
    }

    /// What the media on it do at the wavelengths of a path.
    pub(in crate::tracer) fn media(&self, lambda: &SampledWavelengths, steps: MarchSteps) -> LineMedia {
        let mut seen = LineMedia::NONE;
        self.pieces.iter().for_each(|piece| self.add_piece(piece, lambda, steps, &mut seen));
        seen
    }

    /// The medium in which less than this `share` of the light is left, on average over the wavelengths, and not before, and the ray within it
    /// from where the line came into it; `None` if that much is left in the end.
    pub(in crate::tracer) fn medium_that_leaves(
        &self,
        share: f64,
        lambda: &SampledWavelengths,
        steps: MarchSteps,
    ) -> Option<(MediumIndex, Ray)> {
        let mut seen = LineMedia::NONE;
        let mut ends_there = |piece: &LinePiece| {
            self.add_piece(piece, lambda, steps, &mut seen);
            0.25 * seen.transmittance.element_sum() < share
        };
        let end = self.pieces.iter().take_while(|piece| !ends_there(piece)).count();
        let medium = self.pieces.get(end)?.medium;
        // What is passed within a medium parts pieces, too.
        let inside = self.pieces[..=end].iter().rev().take_while(|piece| piece.medium == medium);
        inside.last().map(|piece| (medium, piece.ray))
    }

    /// Adds to `seen` what the medium of a piece does.
    fn add_piece(
        &self,
        piece: &LinePiece,
        lambda: &SampledWavelengths,
        steps: MarchSteps,
        seen: &mut LineMedia,
    ) {
        let LinePiece { medium, ray, start, length } = *piece;
        let Some(Medium { kind, phase, .. }) = self.media.and_then(|media| media.get(medium)) else { return };
        let area = phase.along(ray.direction);
        match kind {
            MediumKind::Homogeneous(medium) => seen.add(start, length, &medium.at(lambda, area.most())),
            MediumKind::Grid(grid) => {
                let tracked = TrackedRay { ray, end: length, area, lambda };
                grid.march(&tracked, steps, |[from, to], coefficients| {
                    seen.add(start + from, to - from, &coefficients);
                    seen.transmittance.max_element() < OPAQUE
                });
            }
        }
    }
}

impl LineMedia {
    /// Of a line of length 0.
    const NONE: Self = Self { transmittance: DVec4::ONE, scattered: DVec4::ZERO, moment: DVec4::ZERO };

    /// Adds a part with these coefficients everywhere, which begins at the distance `start`.
    fn add(&mut self, start: f32, length: f32, coefficients: &Coefficients) {
        let (start, length) = (f64::from(start), f64::from(length));
        for lane in 0..4 {
            let extinction = f64::from(coefficients.extinction[lane]);
            // ∞ · 0 would be NaN.
            if extinction <= 0.0 {
                continue;
            }
            let depth = extinction * length;
            let scattered = self.transmittance[lane] * f64::from(coefficients.albedo[lane]);
            let met = -(-depth).exp_m1();
            self.scattered[lane] += scattered * met;
            self.moment[lane] += scattered * (start * met + first_moment(depth) / extinction);
            self.transmittance[lane] *= (-depth).exp();
        }
    }
}

/// ∫₀ˣ u e⁻ᵘ du = 1 − (1 + x) e⁻ˣ.
fn first_moment(x: f64) -> f64 {
    if x < 1e-3 {
        // The difference would cancel.
        x * x * (0.5 - x * (1.0 / 3.0 - x * 0.125))
    } else if x < f64::INFINITY {
        1.0 - (1.0 + x) * (-x).exp()
    } else {
        1.0
    }
}
