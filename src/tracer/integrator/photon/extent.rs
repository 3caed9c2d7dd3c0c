//! The box that the photon map is laid out for, and how far apart photons lie in media.
//!
//! The box sets the first radius and the cells of the tree, so that it must be the box of where light goes. Nearly always that is
//! the box of the scene. But a backdrop, a ground or a sky of shapes that is a million times as large as what stands in it
//! would make the radius as large as all of that, and its last cells too large to tell photons apart.

use std::f32::consts::PI;

use glam::Vec3;

use crate::stream::faults;
use crate::tracer::integrator::RenderContext;
use crate::tracer::photon_map::{PhotonBatch, PhotonLayer};

use super::light_paths::trace_light_paths;
use super::tracer::PhotonPaths;

/// Light paths that tell where light goes.
const SCOUTS: u64 = 256;

/// A scene's box with a side of more than so many times that of the box of its light is not taken. An ordinary
/// scene may be some tens of times as large: `prism.xml`, most of whose photons lie in a spectrum, is more than 8 times.
const TOO_LARGE: f32 = 1024.0;

/// Photons in media from which others lie about as far away as around all of them.
const ASKED: usize = 64;

/// Photons in whose ball the density around a photon is taken.
const NEAR: usize = 16;

/// What a few light paths tell about a scene.
#[derive(Debug)]
pub(super) struct Extent {
    /// The box of the photons: that of the scene and of most photons in media, or where it is far larger than that of most photons, the latter.
    pub(super) bounds: [Vec3; 2],
    /// Photons in media, of [`SCOUTS`] light paths.
    in_media: Vec<Vec3>,
}

impl Extent {
    /// Traces a few light paths.
    pub(super) fn of(context: &RenderContext) -> Self {
        let mut batch = PhotonBatch::default();
        trace_light_paths(context, PhotonPaths::Whole, 0..SCOUTS, &mut batch);
        // Faults are raised again when the same paths are traced for the map.
        faults::take();
        let positions: Vec<Vec3> = batch.positions().collect();
        let layers = [PhotonLayer::VolumeGlobal, PhotonLayer::VolumeCaustic];
        let in_media: Vec<Vec3> =
            layers.into_iter().flat_map(|layer| batch.positions_of(layer)).copied().collect();
        let (mut lo, mut hi) = context.scene.accel().bounds();
        // A medium without a boundary goes on where the shapes end.
        if let Some([low, high]) = middle(&in_media) {
            let rest = 0.125 * (high - low).max_element();
            (lo, hi) = (lo.min(low - rest), hi.max(high + rest));
        }
        Self { bounds: photon_box((lo, hi), &positions), in_media }
    }

    /// How many photons of `paths` light paths lie within `radius` of a flight of this length in a medium, about.
    pub(super) fn photons_around(&self, length: f32, radius: f32, paths: u64) -> f32 {
        let Some(near) = self.spacing(NEAR, paths) else { return 0.0 };
        let density = 0.75 * NEAR as f32 / (PI * near * near * near);
        density * PI * radius * radius * length
    }

    /// The median radius of the balls in which `count` photons of `paths` light paths lie around a photon in a medium; `None` where the few
    /// light paths here leave too few to tell.
    pub(super) fn spacing(&self, count: usize, paths: u64) -> Option<f32> {
        let step = (self.in_media.len() / ASKED).max(1);
        let mut distances = Vec::with_capacity(self.in_media.len());
        let mut radii: Vec<f32> = self
            .in_media
            .iter()
            .step_by(step)
            .filter_map(|p| {
                distances.clear();
                distances.extend(self.in_media.iter().map(|q| p.distance_squared(*q)));
                // The first of them is the photon itself.
                (distances.len() > count).then(|| *distances.select_nth_unstable_by(count, f32::total_cmp).1)
            })
            .collect();
        let middle = radii.len() / 2;
        (!radii.is_empty()).then(|| {
            let (_, radius2, _) = radii.select_nth_unstable_by(middle, f32::total_cmp);
            radius2.sqrt() * (SCOUTS as f32 / paths as f32).cbrt()
        })
    }
}

/// The box of these photons, which lie in this box.
fn photon_box((lo, hi): (Vec3, Vec3), positions: &[Vec3]) -> [Vec3; 2] {
    // Between these lie 80 % of the photons along each axis.
    let Some([low, high]) = middle(positions) else { return [lo, hi] };
    let (center, side) = (0.5 * (low + high), (high - low).max_element());
    if !(side > 0.0 && ((hi - center).max(center - lo)).max_element() > 0.5 * TOO_LARGE * side) {
        return [lo, hi];
    }
    // The whole width of what is lit evenly.
    let rest = 0.125 * side;
    [(low - rest).max(lo), (high + rest).min(hi)]
}

/// The lowest and highest decile along each axis; `None` of too few points.
fn middle(points: &[Vec3]) -> Option<[Vec3; 2]> {
    let mut deciles = [Vec3::ZERO; 2];
    let mut values = Vec::with_capacity(points.len());
    for axis in 0..3 {
        values.clear();
        values.extend(points.iter().map(|p| p[axis]));
        for (decile, place) in deciles.iter_mut().zip([points.len() / 10, points.len() * 9 / 10]) {
            if place + 1 >= values.len() {
                return None;
            }
            decile[axis] = *values.select_nth_unstable_by(place, f32::total_cmp).1;
        }
    }
    Some(deciles)
}
