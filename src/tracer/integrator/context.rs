//! What a method that starts paths at lights is given, and how such paths reach the camera.

use std::sync::Arc;

use crate::scene::desc::{IntegratorDesc, PhotonDesc};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, White};
use crate::stream::UvWindow;
use crate::tracer::bsdf::Scattering;
use crate::tracer::camera::CameraView;
use crate::tracer::light::{Emission, Origin};
use crate::tracer::subpath::{Scattered, Vertex};
use crate::tracer::{Camera, Scene};

/// Scene, view and settings. Depth counts as in Mitsuba: `max_depth` segments at most, so 1 shows lights only.
#[derive(Clone, Debug)]
pub struct RenderContext {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Where it is seen from.
    pub camera: Camera,
    /// Which randomisation of the sequence.
    pub seed: u32,
    /// The part of the screen to cover.
    pub window: UvWindow,
    /// Longest path in segments; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Number of segments from which roulette may end a subpath, at the latest; branches and subpaths have limits of their own
    /// (`tracer/roulette.rs`).
    pub rr_depth: u32,
    /// The camera looks through lights.
    pub hide_emitters: bool,
    /// So many places along each side of the window, spread unevenly, are all that camera paths start from: what differs
    /// between paths from one place is noise. `None`: they start from everywhere, as for any picture.
    pub places: Option<u32>,
    /// How photons are looked up, where there are any.
    pub photons: PhotonDesc,
}

/// A vertex of a light subpath as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) view: CameraView,
    pub(super) scattered: Scattered,
    /// Density over uv that it adds, before any weight.
    pub(super) value: SampledSpectrum,
}

impl RenderContext {
    /// The settings of a scene file.
    pub fn new(
        scene: Arc<Scene>,
        camera: Camera,
        desc: &IntegratorDesc,
        seed: u32,
        window: UvWindow,
    ) -> Self {
        let IntegratorDesc { max_depth, rr_depth, hide_emitters, photons, .. } = *desc;
        Self { scene, camera, seed, window, max_depth, rr_depth, hide_emitters, places: None, photons }
    }

    /// Where a camera path starts whose screen numbers are these.
    #[inline]
    pub(super) fn place(&self, screen: [f64; 2]) -> [f64; 2] {
        let UvWindow { min, max } = &self.window;
        let screen = match self.places {
            None => screen,
            Some(n) => {
                let [x, y] = screen.map(|s| (s * f64::from(n)).floor());
                // The R2 sequence over columns and rows (Roberts 2018), so that places have no period of a picture's.
                let [a, b] = [0.754_877_666_246_693, 0.569_840_290_998_053];
                [
                    (x + (a * x + b * y).fract()) / f64::from(n),
                    (y + (b * x - a * y).rem_euclid(1.0)) / f64::from(n),
                ]
            }
        };
        [0, 1].map(|i| {
            let (lo, hi) = (f64::from(min[i]), f64::from(max[i]));
            lo + (hi - lo) * screen[i]
        })
    }

    /// The wavelengths of the path with number `u`: drawn, or where nothing has a colour those of the one white.
    #[inline]
    pub(super) fn wavelengths(&self, u: f32) -> SampledWavelengths {
        self.white().unwrap_or_else(|| SampledWavelengths::sample(u))
    }

    /// The wavelengths that stand for the white of all that is seen; `None` where they are drawn.
    #[inline]
    pub(super) fn white(&self) -> Option<SampledWavelengths> {
        self.scene.white().map(White::wavelengths)
    }

    /// Longest path in segments.
    pub(super) fn longest(&self) -> u32 {
        self.max_depth.unwrap_or(u32::MAX)
    }

    /// Area of the window in uv.
    pub(super) fn window_area(&self) -> f32 {
        let UvWindow { min, max } = self.window;
        (max[0] - min[0]) * (max[1] - min[1])
    }

    /// `vertex` as the camera sees it through `lens` (in [0, 1)²), if nothing stood in between. A path has one point of the
    /// lens, chosen uniformly whichever way it is found, so that its density drops out of all weights.
    #[inline]
    pub(super) fn see<B: Scattering>(&self, vertex: &Vertex<B>, lens: [f32; 2]) -> Option<Seen> {
        if vertex.bsdf.is_delta() || self.hide_emitters && vertex.hit.light.is_some() {
            return None;
        }
        let view = self.camera.view(vertex.hit.point.p, lens, &self.window)?;
        let scattered = vertex.scatter_to::<true>(-view.direction)?;
        let counts = vertex.wavelength_mis.and(scattered.wavelength_mis).weight();
        let value = vertex.throughput * scattered.value * (counts * view.uv_per_steradian / view.distance2);
        value.is_finite().then_some(Seen { view, scattered, value })
    }

    /// True when nothing stands between the camera and a vertex that it sees.
    #[inline]
    pub(super) fn is_open<B: Scattering>(&self, vertex: &Vertex<B>, view: &CameraView) -> bool {
        let mut ray = vertex.hit.spawn_to(view.origin, -view.direction);
        if !self.hide_emitters {
            return !self.scene.occluded(&ray);
        }
        // Lights are looked through. The ray is not of unit length: each hit moves its origin.
        while let Some(hit) = self.scene.closest(&ray) {
            if hit.light.is_none() {
                return false;
            }
            ray = hit.spawn_to(view.origin, -view.direction);
        }
        true
    }

    /// How the camera sees the light itself: where, and the factor on the light's spectrum. `None` for what it cannot
    /// see, and where something stands in between.
    #[inline]
    pub(super) fn see_light(&self, emission: &Emission, lens: [f32; 2]) -> Option<(CameraView, f32)> {
        let Emission { light, from, direction, pdf } = emission;
        if self.hide_emitters {
            return None;
        }
        match pdf.origin {
            Origin::Point => None,
            Origin::Surface => {
                let view = self.camera.view(from.p, lens, &self.window)?;
                let pdf = self.scene.lights.emission_pdf(*light, from.p, -view.direction);
                let scale = pdf.cos * view.uv_per_steradian / (view.distance2 * pdf.vertex);
                let ray = from.spawn_to(view.origin, -view.direction);
                let open = scale > 0.0 && !self.scene.occluded(&ray);
                open.then_some((view, scale))
            }
            Origin::Far => {
                let view = self.camera.view_far(-*direction, lens, &self.window)?;
                let ray = self.camera.ray(view.uv.map(f64::from), lens);
                let open = self.scene.closest(&ray).is_none();
                open.then_some((view, view.uv_per_steradian / pdf.vertex))
            }
        }
    }
}
