//! The displayed value of a pixel, and the paths that contributed to it, traced again with recording enabled.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use miette::{IntoDiagnostic, Result};

use crate::client::lod::level_of_detail;
use crate::client::retained::RetainedSamples;
use crate::client::zones;
use crate::color::Xyz;
use crate::gpu::Region;
use crate::job::{Job, StopFlag};
use crate::render::method;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::{IntegratorKind, IntegratorTraits, MediumId, SceneDesc};
use crate::scene::edit::medium_name;
use crate::stream::{SampleSink, UvWindow};
use crate::study::error_tile::TILE;
use crate::tracer::camera::CameraLines;
use crate::tracer::integrator::{IntegratorVisitor, RenderContext, Replicated, visit};
use crate::tracer::medium::MediumIndex;
use crate::tracer::record::{PathEvent, Trail, recorded};
use crate::tracer::{Camera, Integrator, Scene};
use crate::viewer::editor::SceneEditor;
use crate::viewer::panel::CursorPlace;
use crate::viewer::picture::LivePicture;
use crate::viewer::session::RenderSession;
use crate::viewer::tools::inspector::tab::{
    LOUPE, PathSegment, PixelPaths, PixelReading, SPECTRUM_BINS, SegmentKind, WAVELENGTHS,
};

/// Most paths of a pixel that are traced again.
const MOST_PATHS: usize = 512;

/// Number of further path indices through the pixel, for its spectrum.
const SPECTRUM_INDICES: u64 = 1024;

/// Most paths that are drawn; the brightest are chosen.
const MOST_DRAWN: usize = 24;

/// Length of a line towards a light at infinity, in units of the path's last segment.
const FAR: f32 = 4.0;

/// The last clicked pixel and its paths.
#[derive(Default)]
pub struct PixelStudy {
    /// Traces the paths again.
    job: Option<Job<PixelPaths>>,
    paths: Option<Arc<PixelPaths>>,
}

impl PixelStudy {
    /// Discards the paths after scene or camera have changed.
    pub fn clear(&mut self) {
        (self.job, self.paths) = (None, None);
    }

    /// Begins to trace again the paths behind a pixel, as far as their samples are retained.
    ///
    /// # Errors
    ///
    /// When the camera is invalid, or no thread can be started.
    pub fn begin(
        &mut self,
        pixel: [u32; 2],
        session: &RenderSession,
        picture: &LivePicture,
        editor: &SceneEditor,
    ) -> Result<()> {
        self.clear();
        let mut run = session.run_spec().clone();
        let IntegratorTraits { extends, hides_paths, .. } = run.integrator.traits();
        let hides_paths = match run.stereo {
            Some(_) => &Some("the numbers of paths are those of two eyes: without stereo a click draws them"),
            None => hides_paths,
        };
        let note = match (hides_paths, extends) {
            (Some(why), _) => *why,
            (None, Some(connected)) => {
                run.integrator = *connected;
                "without the photons that were merged"
            }
            (None, None) => "",
        };
        let has_paths = hides_paths.is_none();
        let size = session.size();
        let indices = match has_paths {
            true => indices(picture.kept(), run.integrator, pixel, size),
            false => PixelIndices::default(),
        };
        let (scene, camera, window) = (editor.scene(), editor.seeing_camera(size)?, session.window());
        let media = media_names(editor.desc());
        let trace = move |stop: &StopFlag| {
            let scene = Arc::new(Scene::clone(&scene).recorded());
            let context = method::render_context(&run, scene.clone(), camera.clone(), window);
            let mut study = PathCollector::new(pixel, &scene, &camera, size);
            for &(index, subpath) in indices.list.iter().take_while(|_| !stop.is_set()) {
                study.add(&run, &context, index, subpath);
            }
            let within = method::render_context(&run, scene, camera.clone(), window_of(pixel, size));
            // Paths of any other method would not be the ones that made the picture.
            let count = if has_paths { SPECTRUM_INDICES } else { 0 };
            for index in (0..count).take_while(|_| !stop.is_set()) {
                study.add_to_spectrum(&run, &within, index);
            }
            PixelPaths { known: indices.known, note, ..study.finish(&media) }
        };
        self.job = Some(Job::start("the inspector", trace).into_diagnostic()?);
        Ok(())
    }

    /// Whether paths are being traced.
    pub fn is_busy(&self) -> bool {
        self.job.is_some()
    }

    /// Takes over traced paths; true if there are new ones.
    pub fn take(&mut self) -> bool {
        let Some(paths) = Job::take(&mut self.job) else { return false };
        self.paths = paths.inspect_err(|panic| tracing::error!("{panic}")).ok().map(Arc::new);
        true
    }

    /// Paths of the last clicked pixel.
    pub fn paths(&self) -> Option<Arc<PixelPaths>> {
        self.paths.clone()
    }
}

/// The pixel at a place; `None` outside of the picture.
fn pixel_of(place: DVec2, size: [u32; 2]) -> Option<[u32; 2]> {
    let inside = place.cmpge(DVec2::ZERO).all() && place.cmplt(DVec2::from(size.map(f64::from))).all();
    inside.then(|| place.to_array().map(|at| at as u32))
}

/// Displayed value under the cursor, and what the picture has there; `None` before there is a picture.
pub fn reading(
    at: CursorPlace,
    session: &RenderSession,
    picture: &mut LivePicture,
    editor: &SceneEditor,
    exposure: f32,
) -> Option<PixelReading> {
    let size = session.size();
    let [shown_pixel, pixel] = [pixel_of(at.shown, size)?, pixel_of(at.picture, size)?];
    // A square around it, clipped to the picture.
    let low = shown_pixel.map(|at| at.saturating_sub(LOUPE));
    let high = [0, 1].map(|i| (shown_pixel[i] + LOUPE + 1).min(size[i]));
    let region = Region { origin: low, extent: [high[0] - low[0], high[1] - low[1]] };
    let shown = picture.shown(region).ok().flatten()?;
    let place = |x: u32, y: u32| ((y - low[1]) * region.extent[0] + x - low[0]) as usize;
    let middle = place(shown_pixel[0], shown_pixel[1]);
    let side = 2 * LOUPE + 1;
    let loupe = (0..side * side).map(|i| {
        let [x, y] = [shown_pixel[0] + i % side, shown_pixel[1] + i / side];
        let [x, y] = [x.checked_sub(LOUPE)?, y.checked_sub(LOUPE)?];
        let inside = x < high[0] && y < high[1];
        inside.then(|| shown.displayed[place(x, y)].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))
    });
    let film = session.run_spec().film;
    let counts = picture.counts();
    let pick = editor.pick(at.picture.to_array(), size);
    let desc = editor.desc();
    let error = picture.observer.as_ref().and_then(|observer| {
        let state = observer.state();
        let (columns, values) = &state.map;
        let tile = pixel[1] as usize / TILE * columns + pixel[0] as usize / TILE;
        values.get(tile).copied().filter(|error| error.is_finite())
    });
    Some(PixelReading {
        pixel,
        xyz: shown.xyz[middle],
        stops: Some((exposure * shown.xyz[middle][1] / zones::middle() as f32).log2())
            .filter(|s| s.is_finite()),
        displayed: shown.displayed[middle],
        samples: f64::from(picture.weight_at(pixel)),
        error,
        lods: [counts.camera_samples, counts.light_samples].map(|n| level_of_detail(&film, n)),
        object: pick.as_ref().map(|pick| crate::scene::edit::shape_name(desc, pick.shape)),
        material: pick.as_ref().and_then(|pick| crate::scene::edit::material_name(desc, pick.shape)),
        distance: pick.map(|pick| f64::from(pick.distance)),
        loupe: loupe.collect(),
    })
}

/// Path indices that have a camera sample in a pixel.
#[derive(Default)]
struct PixelIndices {
    /// Index, and number of its camera subpath.
    list: Vec<(u64, usize)>,
    /// Total number of known paths, including those beyond `list`.
    known: u64,
}

/// Finds the path indices behind a pixel among the retained samples: within a block, camera samples are stored in the order of their paths.
/// If a block filled up in the middle of an index, the remaining samples begin the next block.
fn indices(kept: &RetainedSamples, method: IntegratorKind, pixel: [u32; 2], size: [u32; 2]) -> PixelIndices {
    let per_index = method.paths_per_index();
    let mut found = PixelIndices::default();
    // Number of camera samples in the previous block, by index.
    let mut sent = HashMap::new();
    kept.each(|[samples, _], first, paths| {
        let camera = || samples.iter().filter(|sample| sample.w > 0.0);
        let before = sent.remove(&first).unwrap_or(0);
        let unfinished = (before + camera().count() as u64).checked_sub(paths.camera);
        // One sample per path; if some were rejected, samples cannot be assigned to paths.
        let Some(unfinished) = unfinished.filter(|unfinished| *unfinished <= per_index) else { return };
        if unfinished > 0 {
            sent.insert(first + paths.camera / per_index, unfinished);
        }
        for (rank, sample) in camera().enumerate() {
            let inside = (0..2).all(|i| (sample.uv[i] * size[i] as f32).floor() == pixel[i] as f32);
            if inside {
                found.known += 1;
                if found.list.len() < MOST_PATHS {
                    let rank = before + rank as u64;
                    found.list.push((first + rank / per_index, (rank % per_index) as usize));
                }
            }
        }
    });
    found
}

/// Collects the events of recorded paths.
struct PathCollector {
    pixel: [u32; 2],
    size: Vec2,
    /// `None` for a camera that shows lines as curves: paths are not drawn then.
    lines: Option<CameraLines>,
    eye: Vec3,
    paths: Vec<TracedPath>,
    /// Radiance by wavelength, summed over this number of paths.
    spectrum: Vec<f64>,
    summed: u64,
    has_colour: bool,
}

/// A camera path: its contribution and its vertices.
struct TracedPath {
    luminance: f32,
    segments: Vec<PathSegment>,
    /// Where it is scattered in media, as far as that is before the camera, and in which.
    scatterings: Vec<([f32; 2], MediumIndex)>,
}

impl PathCollector {
    fn new(pixel: [u32; 2], scene: &Scene, camera: &Camera, size: [u32; 2]) -> Self {
        Self {
            pixel,
            size: Vec2::from(size.map(|n| n as f32)),
            lines: camera.lines(),
            eye: camera.position(),
            paths: Vec::new(),
            spectrum: vec![0.0; SPECTRUM_BINS],
            summed: 0,
            has_colour: scene.white().is_none(),
        }
    }

    /// Traces an index and keeps its camera subpath of this number.
    fn add(&mut self, run: &RunSpec, context: &RenderContext, index: u64, number: usize) {
        let events = trace_recorded(run, context, index);
        let begins = |event: &&PathEvent| matches!(event, PathEvent::Begins(path) if !path.from_light);
        let starts: Vec<usize> =
            events.iter().enumerate().filter(|(_, event)| begins(event)).map(|(i, _)| i).collect();
        let Some(&start) = starts.get(number) else { return };
        let mut path = TracedPath { luminance: 0.0, segments: Vec::new(), scatterings: Vec::new() };
        let (mut trail, mut last) = (Trail::default(), None);
        for event in &events[start..] {
            match event {
                PathEvent::Meets(carried, hit) if !carried.from_light => {
                    let p = hit.point.p;
                    let from = trail.meets(carried, p).unwrap_or(p + hit.wo * p.distance(self.eye));
                    self.draw(&mut path, [from, p], SegmentKind::Path);
                    if hit.is_in_medium()
                        && let Some([at, _]) = self.on_picture([p; 2])
                    {
                        path.scatterings.push((at, carried.medium));
                    }
                    last = Some(p.distance(from));
                }
                PathEvent::Light { from, sample, value, visible, .. }
                    if *visible > 0.0 && value.0.max_element() > 0.0 =>
                {
                    let far = last.map(|length| *from + sample.wi * (FAR * length));
                    let Some(to) = sample.target.or(far) else { continue };
                    self.draw(&mut path, [*from, to], SegmentKind::Light);
                }
                PathEvent::Connection { camera, light, value, visible }
                    if *visible > 0.0 && value.0.max_element() > 0.0 =>
                {
                    self.draw(&mut path, [*camera, *light], SegmentKind::Light);
                }
                PathEvent::Estimate { lambda, radiance } => {
                    path.luminance = lambda.to_xyz(*radiance).y;
                    break;
                }
                _ => {}
            }
        }
        self.paths.push(path);
    }

    /// Traces an index all of whose paths pass through the pixel.
    fn add_to_spectrum(&mut self, run: &RunSpec, context: &RenderContext, index: u64) {
        for event in trace_recorded(run, context, index) {
            let PathEvent::Estimate { lambda, radiance } = event else { continue };
            self.summed += 1;
            for lane in 0..4 {
                let pdf = lambda.pdf()[lane];
                if let Some(bin) = bin(lambda.lambda()[lane]).filter(|_| pdf > 0.0) {
                    self.spectrum[bin] += f64::from(radiance.0[lane] * 0.25 / pdf);
                }
            }
        }
    }

    fn draw(&self, path: &mut TracedPath, ends: [Vec3; 2], kind: SegmentKind) {
        if let Some([from, to]) = self.on_picture(ends) {
            path.segments.push(PathSegment { from, to, kind });
        }
    }

    /// Both ends of a line segment in pixels of the picture; `None` behind the camera.
    fn on_picture(&self, ends: [Vec3; 2]) -> Option<[[f32; 2]; 2]> {
        Some(self.lines?.segment(ends)?.map(|at| (at * self.size).to_array()))
    }

    /// The collected paths and spectrum. `media`: the names of all media.
    fn finish(mut self, media: &[String]) -> PixelPaths {
        let count = self.paths.len();
        let per_bin = (WAVELENGTHS[1] - WAVELENGTHS[0]) / SPECTRUM_BINS as f64;
        let scale = 1.0 / (self.summed.max(1) as f64 * per_bin);
        self.spectrum.iter_mut().for_each(|bin| *bin *= scale);
        self.paths.sort_by(|a, b| b.luminance.total_cmp(&a.luminance));
        let lit = self.paths.iter().filter(|path| path.luminance > 0.0).count();
        self.paths.truncate(MOST_DRAWN);
        let scatterings: Vec<_> = self.paths.iter().flat_map(|path| &path.scatterings).collect();
        let times =
            |id: u32| scatterings.iter().filter(|(_, medium)| medium.id() == Some(MediumId(id))).count();
        let media = media.iter().enumerate().map(|(i, name)| (name.clone(), times(i as u32)));
        PixelPaths {
            pixel: self.pixel,
            traced: count,
            lit,
            spectrum: if self.has_colour && self.summed > 0 { self.spectrum } else { Vec::new() },
            segments: self.paths.iter().flat_map(|path| path.segments.iter().copied()).collect(),
            scatterings: scatterings.iter().map(|(at, _)| *at).collect(),
            media: media.filter(|(_, count)| *count > 0).collect(),
            ..PixelPaths::default()
        }
    }
}

/// The names of all media of a scene.
fn media_names(desc: &SceneDesc) -> Vec<String> {
    (0..desc.media.len() as u32).map(|i| medium_name(desc, MediumId(i))).collect()
}

/// Traces an index again in a scene that [records](Scene::recorded); returns the events on its paths.
fn trace_recorded(run: &RunSpec, context: &RenderContext, index: u64) -> Vec<PathEvent> {
    recorded(|| visit(run.integrator, EventsOnly { run, context, index }))
}

/// Traces an index for the events on its paths.
struct EventsOnly<'a> {
    run: &'a RunSpec,
    context: &'a RenderContext,
    index: u64,
}

impl IntegratorVisitor for EventsOnly<'_> {
    type Output = ();

    fn visit<I: Integrator + From<RenderContext>>(self) {
        let tracer = Replicated::new(self.context, self.run.replicated, I::from);
        tracer.trace(self.index, &mut Default::default(), &mut Discarded);
    }
}

/// Sink that drops samples, for paths traced only for their events.
struct Discarded;

impl SampleSink for Discarded {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// The part of the screen, in `[0, 1)²`, that a pixel covers.
fn window_of(pixel: [u32; 2], size: [u32; 2]) -> UvWindow {
    let corner = |i: usize, by: u32| (pixel[i] + by) as f32 / size[i] as f32;
    UvWindow { min: [corner(0, 0), corner(1, 0)], max: [corner(0, 1), corner(1, 1)] }
}

/// Spectral bin of a wavelength in nm; `None` outside the displayed range.
fn bin(lambda: f32) -> Option<usize> {
    let at = (f64::from(lambda) - WAVELENGTHS[0]) / (WAVELENGTHS[1] - WAVELENGTHS[0]);
    (0.0..1.0).contains(&at).then_some((at * SPECTRUM_BINS as f64) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::load;
    use crate::render::options::SceneOptions;
    use crate::stream::{BlockSink, DrainOrder, Epoch, LANE_BLOCKS, REPLICATES, lanes};
    use crate::tracer::integrator::{BidirectionalTracer, PathTracer};

    const SIZE: [u32; 2] = [6, 5];

    /// Samples of the first indices of a picture, as the window retains them.
    fn kept<I: Integrator + From<RenderContext>>(context: &RenderContext, count: u64) -> RetainedSamples {
        let (mut writers, mut lanes) = lanes(1, LANE_BLOCKS);
        lanes.hub().run(Some(Epoch(1)));
        lanes.follow(Epoch(1), DrainOrder::Arrival);
        let mut sink = BlockSink::new(writers.remove(0));
        sink.start(Epoch(1), UvWindow::PICTURE);
        let tracer = Replicated::new(context, REPLICATES > 1, I::from);
        let mut scratch = Default::default();
        let mut kept = RetainedSamples::with_room(1 << 16, 1 << 10);
        for index in 0..count {
            sink.begin_path(index);
            tracer.trace(index, &mut scratch, &mut sink);
            sink.end_path(tracer.paths_per_index());
        }
        sink.flush();
        lanes.drain(usize::MAX, |block| _ = kept.push(block));
        kept
    }

    /// Every path found behind a pixel, traced again, yields the value of its retained sample.
    #[test]
    fn the_paths_of_a_pixel_are_those_that_made_it() {
        let source = SceneOptions::of("scenes/cornell_spheres.xml".into());
        let input = load::load(&source).expect("a scene");
        let desc = &input.loaded.desc;
        let (scene, camera) =
            (Arc::new(Scene::prepare(desc).expect("valid")), Camera::of(desc).expect("valid"));
        for kind in [IntegratorKind::Path, IntegratorKind::Bidirectional] {
            let mut run = input.run(&source, "cpu".to_string());
            (run.integrator, run.replicated) = (kind, true);
            (run.film.width, run.film.height) = (SIZE[0], SIZE[1]);
            let context = |scene| method::render_context(&run, scene, camera.clone(), UvWindow::PICTURE);
            let kept = match kind {
                IntegratorKind::Path => kept::<PathTracer>(&context(scene.clone()), 3000),
                _ => kept::<BidirectionalTracer>(&context(scene.clone()), 400),
            };
            let recorded = Arc::new(Scene::clone(&scene).recorded());
            let context = context(recorded.clone());
            for pixel in [[0, 0], [3, 2], [5, 4]] {
                let mut wanted = Vec::new();
                kept.each(|[samples, _], _, _| {
                    let inside =
                        |uv: [f32; 2]| (0..2).all(|i| (uv[i] * SIZE[i] as f32).floor() == pixel[i] as f32);
                    wanted.extend(samples.iter().filter(|s| s.w > 0.0 && inside(s.uv)).map(|s| s.xyz.y));
                });
                let found = indices(&kept, kind, pixel, SIZE);
                assert!(found.known > 20 && found.known == wanted.len() as u64, "{kind:?} {pixel:?}");
                let mut paths = PathCollector::new(pixel, &recorded, &camera, SIZE);
                for (&(index, subpath), wanted) in found.list.iter().zip(wanted) {
                    paths.add(&run, &context, index, subpath);
                    let got = paths.paths.last().expect("a path").luminance;
                    assert!(
                        (got - wanted).abs() <= 1e-5 * wanted.abs().max(1.0),
                        "{kind:?} {index}: {got}, {wanted}"
                    );
                }
                assert!(paths.paths.iter().any(|path| path.segments.len() > 1));
            }
        }
    }

    /// Segments begin at the vertex before, whatever boundaries lie between, and vertices in media are marked and named.
    #[test]
    fn paths_in_fog_have_no_gaps() {
        let source = SceneOptions::of("scenes/fog.xml".into());
        let input = load::load(&source).expect("a scene");
        let desc = &input.loaded.desc;
        let (scene, camera) =
            (Arc::new(Scene::prepare(desc).expect("valid").recorded()), Camera::of(desc).expect("valid"));
        let mut run = input.run(&source, "cpu".to_string());
        (run.film.width, run.film.height) = (SIZE[0], SIZE[1]);
        for kind in [IntegratorKind::Path, IntegratorKind::Bidirectional] {
            run.integrator = kind;
            let context = method::render_context(&run, scene.clone(), camera.clone(), UvWindow::PICTURE);
            let mut paths = PathCollector::new([3, 2], &scene, &camera, SIZE);
            // Later paths split into branches.
            (0..100).chain(1 << 14..(1 << 14) + 100).for_each(|index| paths.add(&run, &context, index, 0));
            for path in &paths.paths {
                let segments = path.segments.iter().filter(|segment| segment.kind == SegmentKind::Path);
                let segments: Vec<_> = segments.collect();
                // The first begins at the camera, where the near clip plane cuts it. The whole room is before that.
                for (i, segment) in segments.iter().enumerate().skip(1) {
                    let begins = |before: &&PathSegment| before.to == segment.from;
                    assert!(segments[..i].iter().any(begins), "{kind:?}: {segments:?}");
                }
            }
            let shown = paths.finish(&media_names(desc));
            let [(name, count)] = shown.media.as_slice() else { panic!("{kind:?}: {:?}", shown.media) };
            assert_eq!((name.as_str(), *count), ("medium \"fog\"", shown.scatterings.len()), "{kind:?}");
            assert!(*count > 0, "{kind:?}");
        }
    }
}
