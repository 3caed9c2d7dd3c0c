//! The context of every integrator, and the connection of light path vertices to the camera.

use std::sync::Arc;

use crate::scene::desc::{IntegratorDesc, PhotonDesc};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, White};
use crate::stream::{FaultyValue, MAX_VALUE, UvWindow, faults, replicate_seed};
use crate::tracer::accel::{PrimRange, Ray};
use crate::tracer::bsdf::Scattering;
use crate::tracer::camera::CameraView;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{Emission, EmissionOrigin};
use crate::tracer::medium::{
    CameraMedium, EdgeWavelengths, FlightPiece, FreeFlight, MediumIndex, MediumSides, PathMedia,
};
use crate::tracer::opacity::meets;
use crate::tracer::record::PathEvent;
use crate::tracer::sampler::cells::ScreenCells;
use crate::tracer::screen::ScreenSampling;
use crate::tracer::subpath::{SubpathVertex, VertexScattering};
use crate::tracer::vertex::SurfaceVertex;
use crate::tracer::walk::Walk;
use crate::tracer::wavelength_mis::WavelengthMis;
use crate::tracer::{Camera, Sampler, Scene};

/// Pixels in width and height of a picture of unknown size.
const USUAL_PIXELS: [f64; 2] = [512.0, 512.0];

/// Scene, view and settings. Depth counts as in Mitsuba: a path has `max_depth` segments at most, so 1 shows lights only.
#[derive(Clone, Debug)]
pub struct RenderContext {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The camera.
    pub camera: Camera,
    /// The context of the other eye, where there are two ([`Stereo`](super::Stereo)).
    pub other_eye: Option<Box<RenderContext>>,
    /// Seed of the randomisation of the sample sequence.
    pub seed: u32,
    /// The part of the screen to cover.
    pub window: UvWindow,
    /// Longest path in segments; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Number of segments from which roulette may end a path, at the latest. Branches and subpaths have limits of their own
    /// (`tracer/roulette.rs`).
    pub rr_depth: u32,
    /// The camera looks through lights.
    pub hide_emitters: bool,
    /// If set, camera paths start only from this number of places along each side of the window, spread unevenly: what
    /// differs between paths from one place is noise. `None`, as for any picture: they start from everywhere.
    pub places: Option<u32>,
    /// How camera paths are distributed over the window; for this seed and these cells.
    pub screen: ScreenSampling,
    /// Cells of the window within which camera paths are even, about as large as the picture's pixels.
    pub cells: ScreenCells,
    /// The medium that the rays of the camera begin in.
    pub medium: MediumIndex,
    /// A boundary of media goes through the points at which they begin: each begins in the medium that lies ahead.
    pub on_boundary: bool,
    /// How photons are looked up, where there are any.
    pub photons: PhotonDesc,
}

/// A vertex of a light subpath, connected to the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraConnection {
    pub(super) view: CameraView,
    pub(super) scattering: VertexScattering,
    /// Density over uv that it adds if nothing occludes it, without any MIS weight.
    pub(super) value: SampledSpectrum,
}

impl RenderContext {
    /// The settings of a scene file, for a picture of `USUAL_PIXELS` pixels.
    pub fn new(
        scene: Arc<Scene>,
        camera: Camera,
        desc: &IntegratorDesc,
        seed: u32,
        window: UvWindow,
    ) -> Self {
        let IntegratorDesc { max_depth, rr_depth, hide_emitters, mut photons, .. } = *desc;
        photons.initial_radius = photons.initial_radius.map(|radius| scene.space().length(radius));
        let screen = ScreenSampling::Even;
        let CameraMedium { medium, on_boundary } = CameraMedium::of(&scene, &camera, &window);
        Self {
            scene,
            camera,
            other_eye: None,
            seed,
            window,
            max_depth,
            rr_depth,
            hide_emitters,
            places: None,
            screen,
            cells: ScreenCells::of_pixels(USUAL_PIXELS),
            medium,
            on_boundary,
            photons,
        }
    }

    /// The same for a picture of so many pixels in width and height: camera paths are even within each.
    pub fn of_size(self, size: [u32; 2]) -> Self {
        let cells = ScreenCells::of_picture(size, &self.window);
        // The squares of an adaptive screen are those of one division.
        Self { screen: self.screen.with_seed(self.seed, &cells), cells, ..self }
    }

    /// The same for a replicate of the picture: another randomisation of the sequence.
    pub fn of_replicate(&self, replicate: usize) -> Self {
        match replicate {
            0 => self.clone(),
            _ => self.beside(replicate_seed(self.seed, replicate)),
        }
    }

    /// The same with another seed, whose paths stand beside those of this one on the screen.
    pub(super) fn beside(&self, seed: u32) -> Self {
        let cells = self.cells.beside(self.seed);
        Self { seed, screen: self.screen.with_seed(seed, &cells), cells, ..self.clone() }
    }

    /// The same through another camera.
    pub(super) fn through(self, camera: Camera) -> Self {
        let CameraMedium { medium, on_boundary } = CameraMedium::of(&self.scene, &camera, &self.window);
        Self { camera, medium, on_boundary, ..self }
    }

    /// The other of two eyes, if paths of this one have samples of both: not where they tell of groups of lights.
    #[inline]
    pub(super) fn partner(&self) -> Option<&RenderContext> {
        self.other_eye.as_deref().filter(|_| self.scene.lights().groups().is_none())
    }

    /// The factor on light samples. Light paths are counted for both eyes, so that those of one eye stand for two where none has samples of
    /// both.
    pub(super) fn light_share(&self) -> f32 {
        if self.other_eye.is_some() && self.partner().is_none() { 2.0 } else { 1.0 }
    }

    /// The seed of the light paths that leave photons: one for both eyes, which see the same photons.
    pub(super) fn photon_seed(&self) -> u32 {
        self.other_eye.as_ref().map_or(self.seed, |other| self.seed.min(other.seed))
    }

    /// The random numbers of the camera path that begins at `index` of the sequence.
    #[inline]
    pub(super) fn sampler(&self, index: u64) -> Sampler {
        Sampler::in_cells(index, self.seed, &self.cells)
    }

    /// Maps screen numbers in [0, 1)² to the uv where a camera path starts.
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

    /// The wavelengths of a path: drawn by the number `u`, or where nothing has a colour those of the one white.
    #[inline]
    pub(in crate::tracer) fn wavelengths(&self, u: f32) -> SampledWavelengths {
        self.white().unwrap_or_else(|| SampledWavelengths::sample(u))
    }

    /// The wavelengths that stand for the one white of the scene; `None` where wavelengths are drawn.
    #[inline]
    pub(super) fn white(&self) -> Option<SampledWavelengths> {
        self.scene.white().map(White::wavelengths)
    }

    /// Longest path in segments.
    pub(in crate::tracer) fn longest(&self) -> u32 {
        self.max_depth.unwrap_or(u32::MAX)
    }

    /// Area of the window in uv.
    pub(super) fn window_area(&self) -> f32 {
        let UvWindow { min, max } = self.window;
        (max[0] - min[0]) * (max[1] - min[1])
    }

    /// True where lights are looked through: on the first segment of a camera path, if the scene asks for it.
    #[inline(always)]
    fn hides_emitters(&self, depth: u32) -> bool {
        depth == 0 && self.hide_emitters
    }

    /// The first hit of a segment of a camera path, where `depth` segments came before; `ray` then begins behind what it has passed. From an
    /// emitter it may go on ([`Scene::passes`]).
    #[inline(always)]
    pub(in crate::tracer) fn closest(&self, ray: &mut Ray, depth: u32) -> Option<SurfaceInteraction> {
        let hit = match self.hides_emitters(depth) {
            true => self.scene.hit_unlit(ray),
            false => self.scene.hit_or_emitter(ray),
        }?;
        Some(self.scene.interaction(ray, &hit))
    }

    /// The vertex that `walk` comes to along `ray`, whose direction has unit length: as [`closest`](Self::closest), or a point in a medium.
    /// `record` receives each piece of the flight, and the walk at its end.
    #[inline(always)]
    pub(super) fn next_vertex<B: Scattering>(
        &self,
        walk: &mut Walk<false>,
        ray: &mut Ray,
        flight: &mut FreeFlight,
        record: impl FnMut(&Walk<false>, FlightPiece),
    ) -> Option<SurfaceInteraction> {
        if B::Media::PRESENT && self.on_boundary && walk.depth == 0 {
            walk.medium = self.scene.medium_ahead(ray);
        }
        match self.scene.media().filter(|_| B::Media::PRESENT) {
            None => self.closest(ray, walk.depth),
            Some(media) if self.hides_emitters(walk.depth) => {
                let ends = |ray: &Ray, at: &SurfaceInteraction, opacity| {
                    at.light.is_none() && meets(ray, at, opacity)
                };
                self.scene.fly(media, walk, flight, ray, ends, record)
            }
            Some(media) => {
                let ends = |ray: &Ray, at: &SurfaceInteraction, opacity| {
                    at.emitter().is_some() || meets(ray, at, opacity)
                };
                self.scene.fly(media, walk, flight, ray, ends, record)
            }
        }
    }

    /// The medium in which a ray of the camera begins.
    pub(super) fn medium_along(&self, ray: &Ray) -> MediumIndex {
        CameraMedium { medium: self.medium, on_boundary: self.on_boundary }.along(&self.scene, ray)
    }

    /// The environment, if a segment of a camera path sees it, where `depth` segments came before.
    #[inline(always)]
    pub(super) fn environment(&self, depth: u32) -> Option<u32> {
        if self.hides_emitters(depth) { None } else { self.scene.lights().environment() }
    }

    /// Connects `vertex` to the camera through the point `lens` (in [0, 1)²), without asking what stands in between. A path
    /// has one point of the lens, chosen uniformly by every strategy, so that its density drops out of all weights.
    #[inline]
    pub(super) fn connect_to_camera<B: Scattering>(
        &self,
        vertex: &SubpathVertex<B>,
        lens: [f32; 2],
    ) -> Option<CameraConnection> {
        self.connect_in_view(vertex, self.view_of(&vertex.surface, lens)?)
    }

    /// Where the camera sees `vertex` through the point `lens`, if light paths that come there are connected to it.
    #[inline]
    pub(super) fn view_of<B: Scattering>(
        &self,
        vertex: &SurfaceVertex<B>,
        lens: [f32; 2],
    ) -> Option<CameraView> {
        if vertex.bsdf.is_delta() || self.hide_emitters && vertex.hit.light.is_some() {
            return None;
        }
        self.camera.view(vertex.hit.point.p, lens, &self.window)
    }

    /// As [`connect_to_camera`](Self::connect_to_camera), where the camera has this view of `vertex`.
    #[inline]
    pub(super) fn connect_in_view<B: Scattering>(
        &self,
        vertex: &SubpathVertex<B>,
        view: CameraView,
    ) -> Option<CameraConnection> {
        let scattering = vertex.scatter_to::<true>(-view.direction)?;
        let weight = vertex.wavelength_mis.and(scattering.wavelength_mis).weight();
        let scale = weight * view.choices * view.uv_per_steradian / view.distance2;
        let value = vertex.throughput * scattering.value * scale;
        B::record(|| PathEvent::ToCamera { uv: view.uv, value });
        if !value.is_within(MAX_VALUE) {
            let surface = vertex.surface.hit.known_surface();
            faults::raise(FaultyValue::CameraConnection, value.into(), surface, None);
            return None;
        }
        Some(CameraConnection { view, scattering, value })
    }

    /// The factor on the contribution of a connection from `vertex` to the camera: 1 where nothing stands in between and no medium either.
    #[inline]
    pub(super) fn camera_factor<B: Scattering>(
        &self,
        vertex: &SubpathVertex<B>,
        lambda: &SampledWavelengths,
        connection: &CameraConnection,
    ) -> SampledSpectrum {
        let CameraConnection { view, scattering, .. } = connection;
        let hit = &vertex.surface.hit;
        let mut ray = hit.spawn_to(view.origin, -view.direction);
        let mis = vertex.wavelength_mis.and(scattering.wavelength_mis);
        let wavelengths = EdgeWavelengths { lambda, mis };
        let medium = vertex.surface.medium_towards(-view.direction);
        if !self.hide_emitters {
            return self.scene.edge_factor::<B::Media>(medium, &ray, PrimRange::NONE, wavelengths);
        }
        // Lights are looked through.
        if let Some(media) = self.scene.media().filter(|_| B::Media::PRESENT) {
            return self.scene.unlit_edge_factor(media, medium, &ray, wavelengths);
        }
        // The ray is not of unit length: each hit moves its origin.
        while let Some(hit) = self.scene.closest(&ray) {
            if hit.light.is_none() {
                return SampledSpectrum::ZERO;
            }
            ray = hit.spawn_to(view.origin, -view.direction);
        }
        SampledSpectrum::ONE
    }

    /// The factor on light that goes along `ray`, which begins in `medium`: 1 where nothing lies on it and no medium either.
    pub(super) fn open_factor(
        &self,
        ray: &Ray,
        medium: MediumIndex,
        lambda: &SampledWavelengths,
    ) -> SampledSpectrum {
        let wavelengths = EdgeWavelengths { lambda, mis: WavelengthMis::ALL };
        self.scene.edge_factor::<MediumSides>(medium, ray, PrimRange::NONE, wavelengths)
    }

    /// Connects the light itself to the camera: the view, and the factor on the light's spectrum. `None` for what the camera
    /// cannot see, and where something stands in between.
    #[inline]
    pub(super) fn connect_light_to_camera(
        &self,
        emission: &Emission,
        lambda: &SampledWavelengths,
        lens: [f32; 2],
    ) -> Option<(CameraView, SampledSpectrum)> {
        let Emission { light, from, direction, pdf } = emission;
        if self.hide_emitters {
            return None;
        }
        match pdf.origin {
            EmissionOrigin::Beam | EmissionOrigin::Point | EmissionOrigin::Parallel => None,
            EmissionOrigin::Surface => {
                let view = self.camera.view(from.p, lens, &self.window)?;
                let pdf = self.scene.lights.emission_pdf(*light, from.p, -view.direction);
                let scale = pdf.cos * view.choices * view.uv_per_steradian / (view.distance2 * pdf.vertex);
                if scale.is_nan() || scale <= 0.0 {
                    return None;
                }
                let ray = from.spawn_to(view.origin, -view.direction);
                let factor = self.open_factor(&ray, self.scene.medium_of_light(*light, &ray), lambda) * scale;
                (!factor.is_black()).then_some((view, factor))
            }
            EmissionOrigin::Infinite => {
                let view = self.camera.view_far(-*direction, lens, &self.window)?;
                let ray = self.camera.ray_of(&view, lens)?;
                let factor = self.open_factor(&ray, self.medium_along(&ray), lambda)
                    * (view.choices * view.uv_per_steradian / pdf.vertex);
                (!factor.is_black()).then_some((view, factor))
            }
        }
    }
}
