//! Pictures of all directions by longitude and latitude, for one place or for two eyes.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::scene::desc::{StereoDesc, StereoEyes};

use super::local_ray::{FilmImage, LocalRay, OVERSCAN};

/// Smallest sine of the angle to the poles in densities.
const LEAST_SINE: f64 = 1e-9;

/// A picture of all directions: longitude φ = 2π x and colatitude θ = π y of the film have the direction (sin φ sin θ, cos θ, −cos φ sin θ), so
/// that its middle is ahead and its edges are behind, as in the `spherical` of Mitsuba 0.6. Of directions dω it shows the area
/// dω / (2π² sin θ).
///
/// **Stereo** (Peleg, Ben-Ezra and Pritch 2001; Google, *Rendering Omni-directional Stereo Content*, 2015): rays begin at e r right(φ) with
/// right(φ) = (cos φ, 0, sin φ), e = −1 for the left and 1 for the right eye, where r is half the distance of the eyes. The area that a ray of length t
/// covers per area of the picture has the same closed form as without: of the point p = e r right + t d, the derivative by φ is
/// e r right′ + t sin θ right, and right′ is horizontal and along the ray's own azimuth. The derivative by θ is t times a unit vector
/// perpendicular to both `d` and right, in the plane of right′ and up, so that the triple product with d keeps only t sin θ right: t² sin θ. The
/// distance counts from where the ray begins.
///
/// From outside the circle a point is on one ray of each eye: with its horizontal distance ρ from the axis, the ray has the horizontal length
/// h = √(ρ² − r²), and the azimuth of the point is that of the ray turned by atan(e r / h) to the right. From inside no ray comes.
///
/// Left and right edges continue each other. Beyond a pole the picture goes on half a turn farther. Both hold up to half a film of overscan, where
/// a direction has several places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Panorama {
    /// Half the distance of the eyes.
    pub(super) radius: f64,
    eyes: Option<StereoEyes>,
}

impl Panorama {
    pub(super) const SPHERICAL: Self = Self { radius: 0.0, eyes: None };

    pub(super) fn stereo(desc: &StereoDesc) -> Self {
        Self { radius: 0.5 * desc.interocular, eyes: Some(desc.eyes) }
    }

    fn is_double(&self) -> bool {
        self.eyes == Some(StereoEyes::OverUnder)
    }

    /// The signs of the eyes that the picture shows, from top to bottom.
    fn signs(&self) -> &'static [f64] {
        match self.eyes {
            None => &[0.0],
            Some(StereoEyes::OverUnder) => &[-1.0, 1.0],
            Some(StereoEyes::Left) => &[-1.0],
            Some(StereoEyes::Right) => &[1.0],
        }
    }

    /// The eye and the place in its own film, within it, of a place of the whole film or its overscan.
    fn of_eye(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let within = |c: f64| (-OVERSCAN..1.0 + OVERSCAN).contains(&c);
        if !(within(at.x) && within(at.y)) {
            return None;
        }
        let signs = self.signs();
        let number = (self.is_double() && at.y >= 0.5) as usize;
        let mut place = DVec2::new(at.x, at.y * signs.len() as f64 - number as f64);
        if place.y < 0.0 {
            place = DVec2::new(place.x + 0.5, -place.y);
        } else if place.y > 1.0 {
            place = DVec2::new(place.x + 0.5, 2.0 - place.y);
        }
        // Overscan of half a film is as high as that of an eye.
        (0.0..=1.0).contains(&place.y).then(|| (signs[number], DVec2::new(place.x.rem_euclid(1.0), place.y)))
    }

    /// Area of the film per steradian.
    fn density(&self, sin: f64) -> f64 {
        1.0 / (2.0 * PI * PI * sin.max(LEAST_SINE) * self.signs().len() as f64)
    }

    pub(super) fn ray(&self, at: DVec2) -> Option<LocalRay> {
        let (sign, place) = self.of_eye(at)?;
        let (sin_phi, cos_phi) = (TAU * place.x).sin_cos();
        let (sin, cos) = (PI * place.y).sin_cos();
        let right = DVec3::new(cos_phi, 0.0, sin_phi);
        Some(LocalRay {
            from: right * (sign * self.radius),
            direction: DVec3::new(sin_phi * sin, cos, -cos_phi * sin),
            density: self.density(sin),
        })
    }

    /// Adds every place of the film and its overscan that shows a point of camera space, or one at infinity in that direction.
    pub(super) fn images(&self, to: DVec3, is_far: bool, mut add: impl FnMut(FilmImage)) {
        let across = DVec2::new(to.x, -to.z);
        // x = sin φ, −z = cos φ.
        let azimuth = across.x.atan2(across.y);
        for (number, sign) in self.signs().iter().enumerate() {
            let offset = if is_far { 0.0 } else { sign * self.radius };
            let square = across.length_squared() - offset * offset;
            if square < 0.0 {
                continue;
            }
            let ahead = square.sqrt();
            let phi = azimuth - offset.atan2(ahead);
            let right = DVec3::new(phi.cos(), 0.0, phi.sin());
            let (from, direction) = match is_far {
                true => (right * (sign * self.radius), to),
                false => (right * offset, to - right * offset),
            };
            let angle = ahead.atan2(to.y);
            let density = self.density(angle.sin());
            let place = DVec2::new((phi / TAU).rem_euclid(1.0), angle / PI);
            let ray = LocalRay { from, direction, density };
            let mut try_at = |x: f64, y: f64| {
                let at = DVec2::new(x, (y + number as f64) / self.signs().len() as f64);
                // Only what a ray takes back there: between the eyes the film has no overscan.
                let back = self.of_eye(at).is_some_and(|(eye, back)| {
                    let off = (back - place).abs();
                    eye == *sign && off.y < 1e-9 && off.x.min(1.0 - off.x) < 1e-9
                });
                if back {
                    add(FilmImage { at, ray });
                }
            };
            for turn in [-1.0, 0.0, 1.0] {
                try_at(place.x + turn, place.y);
                try_at(place.x + turn + 0.5, -place.y);
                try_at(place.x + turn + 0.5, 2.0 - place.y);
            }
        }
    }
}
