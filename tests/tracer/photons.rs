//! Photons for tests: arrivals that can be told apart.

use glam::Vec3;
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::photon_map::{Arrival, ArrivalSite};

/// An arrival at `position` whose first lane of flux is `mark`.
pub fn arrival(position: Vec3, mark: f32) -> Arrival {
    Arrival {
        position,
        direction: Vec3::Z,
        site: ArrivalSite::Surface(Vec3::Z),
        flux: SampledSpectrum(glam::Vec4::new(mark, 0.0, 0.0, 0.0)),
        wavelengths: 7,
        hero_only: false,
        depth: 2,
        group: 0,
    }
}
