//! The render session: server and lanes, specification of the render, and method. It runs one render after another, each with its own
//! epoch.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{Result, miette};

use crate::client::window::statistics::RecentValues;
use crate::client::{FilmSpec, SplatFilter};
use crate::denoise::steering::{NEEDLESS_FROM, STEERED_SAMPLES};
use crate::gpu::{DeviceInfo, DeviceKind};
use crate::remote::{Health, TracerStatus};
use crate::render::method::{self, Chooser, RenderOrder};
use crate::render::rejected::RejectedReport;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::IntegratorKind;
use crate::scene::light_groups::{self, LightGroup};
use crate::stream::{
    Block, CHUNK, DrainOrder, Drained, Epoch, Event, FinishReason, Lanes, REPLICATES, Rejections, UvWindow,
};
use crate::study::LateLight;
use crate::tracer::sampler::cells::ScreenCells;
use crate::tracer::screen::{ScreenDensity, ScreenSampling};
use crate::tracer::{Camera, Scene};
use crate::viewer::editor::SceneEditor;
use crate::viewer::tracers::Tracers;

/// Number of abort times that are kept.
const ABORTS: usize = 4096;

/// A change in the state of a remote tracer.
pub struct TracerNews {
    pub message: String,
    /// Whether the tracer is failing from now on.
    pub ill: bool,
}

/// Camera paths that follow a density over the screen.
struct SteeredPaths {
    density: Arc<ScreenDensity>,
    /// Their indices: whole chunks of every replicate.
    indices: Range<u64>,
}

/// The server, its lanes, and the render in progress.
pub struct RenderSession {
    /// Specification of the render: scene file, size, method, seed.
    run: RunSpec,
    /// Size requested by the command line or the scene; the film may have been resized since.
    asked_size: [u32; 2],
    /// The method that the scene or the command line asks for; `None` for the automatic choice.
    asked_method: Option<IntegratorKind>,
    chooser: Chooser,
    /// Local threads or remote tracers.
    pub tracers: Tracers,
    lanes: Lanes,
    epoch: Epoch,
    /// Number of paths after which a render ends; `None` for no limit.
    paths: Option<u64>,
    /// Screen window that the samples of the whole picture cover.
    window: UvWindow,
    /// One past the largest index of the whole picture that has arrived. Indices below it that were in flight when a region was begun are
    /// never traced.
    reached: u64,
    /// Number of indices of the whole picture that have arrived.
    arrived: u64,
    /// Whether indices below `reached` may be missing.
    has_gaps: bool,
    /// Whether a region is traced instead of the whole picture.
    in_region: bool,
    /// Camera paths of this epoch that follow a density over the screen, if any.
    steered: Option<SteeredPaths>,
    /// Number of epochs with steered paths.
    pub steered_epochs: u64,
    /// Rejected values of the whole picture from before its order was changed, or a region was traced.
    rejected: Rejections,
    /// Light groups that are traced separately.
    groups: Vec<LightGroup>,
    /// Whether scene or camera have changed since the epoch began.
    stale: bool,
    /// How the render ended, once it has.
    ended: Option<FinishReason>,
    /// Whether it has ended and every block was taken.
    through: bool,
    began: Instant,
    /// The last cancelled epoch, and when it was cancelled.
    cut: Option<(Epoch, Instant)>,
    /// Milliseconds from cancelling an epoch until the last worker has left it.
    pub aborts: RecentValues,
    /// Index of the first path that panicked, and its message.
    pub panicked: Option<(u64, String)>,
    /// Whether that path has been reported.
    panic_reported: bool,
    /// Per remote tracer, whether a failure has been reported.
    ill: Vec<bool>,
    /// How tracer and display share the CPU, for the user; empty until the device is known.
    pub processor_sharing: String,
}

impl RenderSession {
    /// A session of started tracers and their lanes. With `choose`, the method is chosen anew whenever the view has changed and come to
    /// rest.
    pub fn new(run: RunSpec, choose: bool, tracers: Tracers, lanes: Lanes, paths: Option<u64>) -> Self {
        Self {
            asked_size: [run.film.width, run.film.height],
            asked_method: (!choose).then_some(run.integrator),
            run,
            chooser: Chooser::new(choose),
            tracers,
            lanes,
            epoch: Epoch(0),
            paths,
            window: UvWindow::PICTURE,
            reached: 0,
            arrived: 0,
            has_gaps: false,
            in_region: false,
            steered: None,
            steered_epochs: 0,
            rejected: Rejections::default(),
            groups: Vec::new(),
            stale: true,
            ended: None,
            through: false,
            began: Instant::now(),
            cut: None,
            aborts: RecentValues::new(ABORTS),
            panicked: None,
            panic_reported: false,
            ill: Vec::new(),
            processor_sharing: String::new(),
        }
    }

    /// Replaces the scene from the next epoch on; the device stays, and so does the film unless the scene requests another size than the
    /// last one. `digest` identifies the scene to remote tracers.
    pub fn replace(&mut self, run: RunSpec, choose: bool, digest: Option<String>) {
        let asked = [run.film.width, run.film.height];
        let [width, height] = if asked == self.asked_size { self.size() } else { asked };
        let (film, device) =
            (FilmSpec { width, height, ..self.run.film }, std::mem::take(&mut self.run.device));
        self.asked_size = asked;
        self.asked_method = (!choose).then_some(run.integrator);
        // The next epoch has the eyes of the editor.
        self.run = RunSpec { film, device, stereo: self.run.stereo, ..run };
        self.tracers.replace_scene(digest);
        self.groups = Vec::new();
        (self.chooser, self.stale) = (Chooser::new(choose), true);
    }

    /// Specification of the render, with the present size and splat filter of the film.
    pub fn run_spec(&self) -> &RunSpec {
        &self.run
    }

    /// Size of the picture, physical pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.run.film.width, self.run.film.height]
    }

    /// Records that the film has another size or filter.
    pub fn set_film(&mut self, film: FilmSpec) {
        self.run.film = film;
    }

    /// Traces these light groups separately from the next epoch on; an empty list traces only the whole picture.
    ///
    /// # Errors
    ///
    /// With remote tracers, which cannot separate groups.
    pub fn set_light_groups(&mut self, groups: Vec<LightGroup>) -> Result<()> {
        if self.tracers.server().is_none() {
            return Err(miette!(
                "lights are mixed on this machine only: without --connect it traces the scene itself"
            ));
        }
        self.run.light_groups = (!groups.is_empty()).then(|| light_groups::text(&groups));
        self.groups = groups;
        Ok(())
    }

    /// Takes over the forced effects of the editor.
    pub fn set_effects(&mut self, editor: &SceneEditor) {
        self.run.effects = editor.forced().to_vec();
        self.run.photons = editor.desc().integrator.photons;
    }

    /// Records the display device, and how it shares the CPU with the tracing threads.
    ///
    /// There are as many threads as cores (or as the user asks for), at background priority. A discrete or integrated GPU leaves the
    /// CPU to them: the loop needs little. If the device is the CPU (lavapipe), its driver draws on all cores at once, so that an edit
    /// is shown soonest, and the tracer runs in between.
    pub fn set_device(&mut self, device: &DeviceInfo) {
        self.run.device = device.name.clone();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.tracers.threads();
        self.processor_sharing = if self.tracers.server().is_none() {
            format!("traced elsewhere; the display has the {cores} cores of this machine")
        } else if device.kind == DeviceKind::Cpu {
            format!(
                "{threads} threads trace on {cores} cores while the display leaves them: it draws on the processor"
            )
        } else {
            format!("{threads} threads trace on {cores} cores; the display has a device of its own")
        };
    }

    /// Selects the method of this name, or the automatic choice by a trial in the scene. Returns whether the render must restart.
    pub fn set_method(&mut self, name: Option<&str>) -> bool {
        let named = name.and_then(|name| IntegratorKind::candidates().find(|kind| kind.name() == name));
        self.chooser = Chooser::new(named.is_none());
        self.run.auto = None;
        named.is_some_and(|kind| std::mem::replace(&mut self.run.integrator, kind) != kind)
    }

    /// Returns to the method and the size of picture that the scene or the command line asks for; returns that size.
    pub fn start_over(&mut self) -> [u32; 2] {
        self.set_method(self.asked_method.map(|kind| kind.name()));
        self.asked_size
    }

    /// Whether the choice of the method is automatic.
    pub fn chooses_method(&self) -> bool {
        self.chooser.wanted
    }

    /// Records a change of scene or camera: a new epoch must begin.
    pub fn edited(&mut self) {
        (self.stale, self.chooser.stale) = (true, true);
    }

    /// Whether a new epoch must begin.
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// With the automatic choice, starts choosing the method once a changed view has come to rest, and takes over a finished choice. The
    /// present method is used until then, so that nothing blocks. Returns true when a choice was made.
    pub fn choose(&mut self, editor: &SceneEditor, at_rest: bool) -> Result<bool> {
        let chosen = self.chooser.take();
        let made = chosen.is_some();
        if let Some(chosen) = chosen {
            self.stale |= self.run.integrator != chosen.kind;
            self.run.integrator = chosen.kind;
            self.run.auto = Some(chosen);
            method::tell_choice(&self.run);
        }
        let first = self.run.auto.is_none();
        if self.chooser.wanted && self.chooser.stale && (first || at_rest) {
            let camera = editor.camera(self.size())?;
            self.chooser.begin(&self.run, &editor.scene(), &camera);
        }
        Ok(made)
    }

    /// With the automatic choice, switches to a method that finds the light which the picture lacks. Returns whether it did; the next epoch
    /// begins with it.
    pub fn change_over(&mut self, late: &LateLight) -> bool {
        let changes = self.chooser.change_over(&mut self.run, late);
        if changes {
            self.stale = true;
            method::tell_choice(&self.run);
        }
        changes
    }

    /// Begins the next epoch at once with the editor's scene and camera. Blocks of the previous epoch are dropped on arrival.
    pub fn begin(&mut self, editor: &SceneEditor) -> Result<()> {
        self.run.stereo = editor.rig();
        (self.window, self.stale) = (self.wanted_window(), false);
        (self.reached, self.arrived, self.has_gaps, self.steered) = (0, 0, false, None);
        self.rejected = Rejections::default();
        self.trace_whole(editor)?;
        self.began = Instant::now();
        Ok(())
    }

    /// Traces a region of the picture from now on, seen through `camera` as `run` specifies. The samples of the whole picture stay valid;
    /// [`resume`](Self::resume) continues it.
    ///
    /// # Errors
    ///
    /// With remote tracers, which always begin with the first index.
    pub fn trace_region(&mut self, editor: &SceneEditor, run: &RunSpec, camera: Camera) -> Result<()> {
        if self.tracers.server().is_none() {
            return Err(miette!(
                "regions are traced on this machine only: without --connect it traces the scene itself"
            ));
        }
        if !self.in_region {
            self.leave_gap();
        }
        let (epoch, window) = (self.next_epoch(), widest_window(run.film));
        let order = order(editor.scene(), camera, 0..u64::MAX, window, epoch);
        self.tracers.render_region(run, order)?;
        self.lanes.follow(epoch, DrainOrder::Arrival);
        (self.in_region, self.ended, self.through) = (true, None, false);
        Ok(())
    }

    /// Notes that the present order of the whole picture ends before all of its paths have arrived.
    fn leave_gap(&mut self) {
        self.rejected.merge(&self.tracers.rejections());
        self.has_gaps |= !self.run.deterministic;
    }

    /// The window over which camera paths of this epoch may be steered. `None` where all are even: with remote tracers, photon maps, which would begin anew,
    /// light groups, two eyes or one randomisation, and in index order.
    pub fn steerable(&self) -> Option<UvWindow> {
        let RunSpec { integrator, deterministic, replicated, stereo, .. } = &self.run;
        let [has_camera_paths, _] = integrator.streams();
        let is_possible = has_camera_paths
            && !integrator.has_photons()
            && *replicated
            && !deterministic
            && stereo.is_none()
            && self.groups.is_empty()
            && self.tracers.server().is_some();
        is_possible.then_some(self.window)
    }

    /// Traces the next camera paths of the whole picture in proportion to this density, and then goes on evenly. Returns whether it does: not
    /// when another epoch is due, while a region is traced, after the end, and where there are many samples already.
    pub fn steer(&mut self, editor: &SceneEditor, density: Arc<ScreenDensity>) -> Result<bool> {
        let UvWindow { min, max } = self.window;
        let texels: f64 = (0..2).map(|i| f64::from(self.size()[i]) * f64::from(max[i] - min[i])).product();
        let indices_of = |per_pixel: f32| {
            (f64::from(per_pixel) * texels / self.run.integrator.paths_per_index() as f64) as u64
        };
        let is_over = self.stale || self.in_region || self.ended.is_some();
        if is_over || self.steered.is_some() || self.reached >= indices_of(NEEDLESS_FROM) {
            return Ok(false);
        }
        // Whole chunks of every replicate.
        let grain = CHUNK * REPLICATES as u64;
        let first = self.reached.next_multiple_of(grain);
        let indices = first..first + indices_of(STEERED_SAMPLES).next_multiple_of(grain);
        self.steered = Some(SteeredPaths { density, indices });
        self.steered_epochs += 1;
        self.leave_gap();
        self.trace_whole(editor)?;
        Ok(true)
    }

    /// How camera paths of the whole picture are distributed over the screen.
    fn sampling(&self) -> ScreenSampling {
        let Some(SteeredPaths { density, indices }) = &self.steered else { return ScreenSampling::Even };
        let own = |index: u64| index / REPLICATES as u64 * self.run.integrator.paths_per_index();
        let cells = ScreenCells::of_picture(self.size(), &self.window);
        ScreenSampling::steered(density.clone(), own(indices.start)..own(indices.end), self.run.seed, &cells)
    }

    /// Resumes the whole picture after a region that was traced for this long.
    pub fn resume(&mut self, editor: &SceneEditor, after: Duration) -> Result<()> {
        self.began += after;
        self.trace_whole(editor)
    }

    /// Traces the whole picture from the first index that has not arrived.
    fn trace_whole(&mut self, editor: &SceneEditor) -> Result<()> {
        let eyes = if self.run.stereo.is_some() { editor.eyes(self.size())? } else { None };
        let (camera, right_eye) = match eyes {
            Some([left, right]) => (left, Some(right)),
            None => (editor.camera(self.size())?, None),
        };
        let (epoch, first) = (self.next_epoch(), self.reached);
        let paths = self.paths.map_or(u64::MAX - first, |paths| {
            paths.saturating_sub(self.arrived.saturating_mul(self.run.integrator.paths_per_index()))
        });
        let scene = match self.groups.as_slice() {
            [] => editor.scene(),
            groups => {
                let sources = light_groups::of_sources(groups);
                Arc::new(editor.scene().with_light_groups(&sources, groups.len()))
            }
        };
        let range = first..first.saturating_add(paths);
        let order = order(scene, camera, range, self.window, epoch);
        let order = RenderOrder { right_eye, sampling: self.sampling(), ..order };
        self.tracers.render(&self.run, order, editor.edits())?;
        let drain_order = match self.run.deterministic {
            true => DrainOrder::Index { first },
            false => DrainOrder::Arrival,
        };
        self.lanes.follow(epoch, drain_order);
        (self.in_region, self.ended, self.through) = (false, None, false);
        Ok(())
    }

    /// Cancels the present epoch and begins the next.
    fn next_epoch(&mut self) -> Epoch {
        self.cut = (self.ended.is_none() && self.epoch != Epoch(0)).then(|| (self.epoch, Instant::now()));
        self.epoch = self.epoch.next();
        self.epoch
    }

    /// Reads the server's events.
    pub fn hear_server(&mut self) {
        while let Some(Event::Finished { epoch, reason, at }) = self.tracers.event() {
            if let FinishReason::Panicked { index, message } = &reason {
                self.panicked.get_or_insert_with(|| (*index, message.clone()));
            }
            if epoch == self.epoch {
                self.ended = Some(reason);
            }
            if let Some((_, then)) = self.cut.take_if(|(cut, _)| *cut == epoch) {
                self.aborts.push((at.saturating_duration_since(then).as_secs_f64() * 1e3) as f32);
            }
        }
    }

    /// The first path that panicked and its message, once.
    pub fn new_panic(&mut self) -> Option<(u64, String)> {
        let reported = std::mem::replace(&mut self.panic_reported, self.panicked.is_some());
        self.panicked.clone().filter(|_| !reported)
    }

    /// State changes of remote tracers since the last call.
    pub fn news_of_tracers(&mut self) -> Vec<TracerNews> {
        let status = self.tracers.status();
        self.ill.resize(status.len(), false);
        let mut news = Vec::new();
        for (was_ill, TracerStatus { address, health, words, .. }) in self.ill.iter_mut().zip(status) {
            let ill = health == Health::Ill;
            if ill != std::mem::replace(was_ill, ill) {
                let message = match ill {
                    true => {
                        format!("tracer {address}: {words}; the picture stays, and gets better more slowly")
                    }
                    false => format!("tracer {address} is there again"),
                };
                news.push(TracerNews { message, ill });
            }
        }
        news
    }

    /// Hands over waiting blocks, at most `budget` samples. Never blocks.
    pub fn drain(&mut self, budget: usize, mut take: impl FnMut(&Block)) -> Drained {
        let (in_region, reached, arrived) = (self.in_region, &mut self.reached, &mut self.arrived);
        let drained = self.lanes.drain(budget, |block| {
            let header = &block.header;
            if !in_region {
                *reached = (header.first_index + header.index_count).max(*reached);
                *arrived += header.index_count;
            }
            take(block);
        });
        self.through = self.ended.is_some() && self.lanes.is_drained();
        drained
    }

    /// The present epoch.
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// Screen window that the samples of the whole picture cover.
    pub fn window(&self) -> UvWindow {
        self.window
    }

    /// Blocks until a block or an event arrives, at most `timeout`.
    pub fn wait(&mut self, timeout: Duration) {
        self.lanes.wait(timeout);
    }

    /// Whether indices before the last ones may be missing from the whole picture, because a region was traced in between or paths were steered.
    pub fn has_gaps(&self) -> bool {
        self.has_gaps
    }

    /// Whether a region is traced and not the whole picture.
    pub fn is_in_region(&self) -> bool {
        self.in_region
    }

    /// Stops the render; samples already sent remain valid.
    pub fn abort(&self) {
        self.tracers.abort();
    }

    /// Whether the samples of this epoch cover a film of the present size and filter.
    pub fn covers_film(&self) -> bool {
        let (has, wants) = (&self.window, self.wanted_window());
        (0..2).all(|i| has.min[i] <= wants.min[i] && has.max[i] >= wants.max[i])
    }

    /// Screen window that samples must cover for a film of the present size. In index order it is exactly that of a headless render;
    /// otherwise it suffices for every splat filter, so that changing the filter needs no new samples.
    fn wanted_window(&self) -> UvWindow {
        let spec = self.run.film;
        if self.run.deterministic { spec.window() } else { widest_window(spec) }
    }

    /// Whether the render has ended and all of its blocks were taken.
    pub fn is_through(&self) -> bool {
        self.through
    }

    /// Whether every path of the whole picture was traced.
    pub fn is_complete(&self) -> bool {
        !self.in_region && self.through && self.ended == Some(FinishReason::Complete)
    }

    /// Time since the present epoch began.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Rejected values of the whole picture so far.
    pub fn rejected(&self, editor: &SceneEditor) -> RejectedReport {
        let mut rejections = self.rejected.clone();
        if !self.in_region {
            rejections.merge(&self.tracers.rejections());
        }
        let mut report = RejectedReport::new(&self.run, editor.desc(), &editor.scene(), &rejections);
        if let Some(SteeredPaths { indices, .. }) = &self.steered {
            for example in report.examples.iter_mut().filter(|example| indices.contains(&example.index)) {
                example.replay = STEERED_REPLAY.to_owned();
            }
        }
        report
    }

    /// Samples that the tracer has sent since the start.
    pub fn traced(&self) -> u64 {
        self.tracers.traced()
    }

    /// Blocks in the lanes, and their capacity.
    pub fn fill(&self) -> (usize, usize) {
        let fill = self.lanes.fill();
        (fill.blocks, fill.capacity)
    }
}

/// In the place of a command that traces a steered path again.
const STEERED_REPLAY: &str =
    "a path that a move of the camera has steered cannot be traced by itself: without --steer there are none";

/// Screen window that suffices for every splat filter.
fn widest_window(film: FilmSpec) -> UvWindow {
    FilmSpec { filter: SplatFilter::Gaussian, ..film }.window()
}

/// A render order with an even distribution of paths.
fn order(
    scene: Arc<Scene>,
    camera: Camera,
    range: Range<u64>,
    window: UvWindow,
    epoch: Epoch,
) -> RenderOrder {
    RenderOrder {
        scene,
        camera,
        right_eye: None,
        range,
        window,
        epoch,
        sampling: Default::default(),
        check: None,
    }
}
