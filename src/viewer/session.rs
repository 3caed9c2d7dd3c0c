//! The render session: the server and its lanes, what is rendered, and the method. It runs one render after another, each with
//! an epoch of its own.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{Result, miette};

use crate::client::window::statistics::RecentValues;
use crate::client::{FilmSpec, SplatFilter};
use crate::gpu::{DeviceInfo, DeviceKind};
use crate::remote::{Health, TracerStatus};
use crate::render::method::{self, Chooser, RenderOrder};
use crate::render::rejected::RejectedReport;
use crate::render::run_spec::RunSpec;
use crate::scene::light_groups::{self, LightGroup};
use crate::stream::{Block, DrainOrder, Drained, Epoch, Event, FinishReason, Lanes, Rejections, UvWindow};
use crate::study::LateLight;
use crate::tracer::choice::CANDIDATES;
use crate::tracer::{Camera, Scene};
use crate::viewer::editor::SceneEditor;
use crate::viewer::tracers::Tracers;

/// Abort times that are kept.
const ABORTS: usize = 4096;

/// Something has changed with a tracer on another machine.
pub struct TracerNews {
    pub message: String,
    /// It is ill from now on.
    pub ill: bool,
}

/// The server, its lanes, and the render in progress.
pub struct RenderSession {
    /// What is rendered: scene file, size, method, seed.
    run: RunSpec,
    /// The size that the command line asks for, or the scene: the film may have been given another one since.
    asked_size: [u32; 2],
    chooser: Chooser,
    /// Who traces.
    pub tracers: Tracers,
    lanes: Lanes,
    epoch: Epoch,
    /// Paths of a render; `None` is no end.
    paths: Option<u64>,
    /// Where the samples of the whole picture lie.
    window: UvWindow,
    /// One past the largest index of the whole picture that has arrived. What was under way before it when a region was begun is never traced.
    reached: u64,
    /// Indices of the whole picture that have arrived.
    arrived: u64,
    /// Some before the largest may be missing.
    has_gaps: bool,
    /// A region is traced and not the whole picture.
    in_region: bool,
    /// What was rejected of the whole picture before a region was traced.
    rejected: Rejections,
    /// The groups of lights that are traced apart.
    groups: Vec<LightGroup>,
    /// Scene or camera have changed since the epoch began.
    stale: bool,
    /// How the render has ended, once it has.
    ended: Option<FinishReason>,
    /// It has ended and every block was taken.
    through: bool,
    began: Instant,
    /// The epoch that was cut off last, and when.
    cut: Option<(Epoch, Instant)>,
    /// Milliseconds from cutting an epoch off until its last worker has left it.
    pub aborts: RecentValues,
    /// The first path that panicked, and its message.
    pub panicked: Option<(u64, String)>,
    /// That path was reported.
    panic_reported: bool,
    /// Tracers on other machines of which it was told that they are ill.
    ill: Vec<bool>,
    /// How tracer and display share the processor, in words; empty until the device is known.
    pub processor_sharing: String,
}

impl RenderSession {
    /// A session of tracers that have been started, and their lanes. Where `choose` is set, the method is chosen anew whenever the view has
    /// changed and come to rest.
    pub fn new(run: RunSpec, choose: bool, tracers: Tracers, lanes: Lanes, paths: Option<u64>) -> Self {
        Self {
            asked_size: [run.film.width, run.film.height],
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

    /// Takes over another scene; the device stays, and so does the film unless the scene asks for another size than the last one did. The
    /// next epoch begins with it. `digest` is what tracers elsewhere know it by.
    pub fn replace(&mut self, run: RunSpec, choose: bool, digest: Option<String>) {
        let asked = [run.film.width, run.film.height];
        let [width, height] = if asked == self.asked_size { self.size() } else { asked };
        let (film, device) =
            (FilmSpec { width, height, ..self.run.film }, std::mem::take(&mut self.run.device));
        self.asked_size = asked;
        self.run = RunSpec { film, device, ..run };
        self.tracers.replace_scene(digest);
        self.groups = Vec::new();
        (self.chooser, self.stale) = (Chooser::new(choose), true);
    }

    /// What is rendered, with the present size and splat filter of the film.
    pub fn run_spec(&self) -> &RunSpec {
        &self.run
    }

    /// Size of the picture, physical pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.run.film.width, self.run.film.height]
    }

    /// The film has another size or filter now.
    pub fn set_film(&mut self, film: FilmSpec) {
        self.run.film = film;
    }

    /// Traces these groups of lights apart from the next epoch on; no groups trace the picture alone.
    ///
    /// # Errors
    ///
    /// Where tracers on other machines trace, which send no groups.
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

    /// Takes over the effects that the user has forced on or off.
    pub fn set_effects(&mut self, editor: &SceneEditor) {
        self.run.effects = editor.forced().to_vec();
        self.run.photons = editor.desc().integrator.photons;
    }

    /// Notes the device that draws, and how it shares the processor with the tracing threads.
    ///
    /// As many threads trace as there are cores (or as the user asks for), in the background of everything else. A device of
    /// its own leaves the processor to them: the loop needs little. Where the device is the processor (lavapipe), its driver
    /// draws on all cores at once, so that an edit is shown soonest, and the tracer has them between.
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

    /// Traces light by the method of this name, or by the one that a trial finds best for the scene. Returns whether the render must begin anew.
    pub fn set_method(&mut self, name: Option<&str>) -> bool {
        let named = name.and_then(|name| CANDIDATES.into_iter().find(|kind| kind.name() == name));
        self.chooser = Chooser::new(named.is_none());
        self.run.auto = None;
        named.is_some_and(|kind| std::mem::replace(&mut self.run.integrator, kind) != kind)
    }

    /// Whether the method is the program's choice.
    pub fn chooses_method(&self) -> bool {
        self.chooser.wanted
    }

    /// Notes that scene or camera have changed: a new epoch must begin.
    pub fn edited(&mut self) {
        (self.stale, self.chooser.stale) = (true, true);
    }

    /// Whether a new epoch must begin.
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// Chooses the method anew where that is asked for and the view has changed and come to rest; takes over what was chosen.
    /// Until then the method stays what it is, so that nothing waits for the choice. Returns true when a choice was made.
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

    /// Changes over to the method that finds the light which the picture lacks, where the method is the program's choice. Returns whether it
    /// has; the next epoch begins with it.
    pub fn change_over(&mut self, late: &LateLight) -> bool {
        let changes = self.chooser.change_over(&mut self.run, late);
        if changes {
            self.stale = true;
            method::tell_choice(&self.run);
        }
        changes
    }

    /// Begins the next epoch at once, with the editor's scene and camera. Blocks of the last one will be dropped on arrival.
    pub fn begin(&mut self, editor: &SceneEditor) -> Result<()> {
        (self.window, self.stale) = (self.wanted_window(), false);
        (self.reached, self.arrived, self.has_gaps) = (0, 0, false);
        self.rejected = Rejections::default();
        self.trace_whole(editor)?;
        self.began = Instant::now();
        Ok(())
    }

    /// Traces a region of the picture from now on, seen through `camera` as `run` says. What has arrived of the whole picture stays valid;
    /// [`resume`](Self::resume) goes on with it.
    ///
    /// # Errors
    ///
    /// Where tracers on other machines trace, which do so from the first index on.
    pub fn trace_region(&mut self, editor: &SceneEditor, run: &RunSpec, camera: Camera) -> Result<()> {
        if self.tracers.server().is_none() {
            return Err(miette!(
                "regions are traced on this machine only: without --connect it traces the scene itself"
            ));
        }
        if !self.in_region {
            self.rejected.merge(&self.tracers.rejections());
            self.has_gaps |= !self.run.deterministic;
        }
        let (epoch, window) = (self.next_epoch(), widest_window(run.film));
        let order = order(editor.scene(), camera, 0..u64::MAX, window, epoch);
        self.tracers.render_region(run, order)?;
        self.lanes.follow(epoch, DrainOrder::Arrival);
        (self.in_region, self.ended, self.through) = (true, None, false);
        Ok(())
    }

    /// Goes on with the whole picture after a region, which took so long.
    pub fn resume(&mut self, editor: &SceneEditor, after: Duration) -> Result<()> {
        self.began += after;
        self.trace_whole(editor)
    }

    /// Traces the whole picture from the first index on that has not arrived.
    fn trace_whole(&mut self, editor: &SceneEditor) -> Result<()> {
        let camera = editor.camera(self.size())?;
        let (epoch, first) = (self.next_epoch(), self.reached);
        let paths = self.paths.map_or(u64::MAX - first, |paths| {
            paths.saturating_sub(self.arrived.saturating_mul(method::paths_per_index(self.run.integrator)))
        });
        let scene = match self.groups.as_slice() {
            [] => editor.scene(),
            groups => {
                let sources = light_groups::of_sources(groups);
                Arc::new(editor.scene().with_light_groups(&sources, groups.len()))
            }
        };
        let order = order(scene, camera, first..first.saturating_add(paths), self.window, epoch);
        self.tracers.render(&self.run, order, editor.edits())?;
        let drain_order = match self.run.deterministic {
            true => DrainOrder::Index { first },
            false => DrainOrder::Arrival,
        };
        self.lanes.follow(epoch, drain_order);
        (self.in_region, self.ended, self.through) = (false, None, false);
        Ok(())
    }

    /// Cuts the present epoch off.
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

    /// What has changed with tracers on other machines.
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

    /// Hands over waiting blocks, `budget` samples at most. Never waits.
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

    /// The number of this render.
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }

    /// Where the samples of the whole picture lie.
    pub fn window(&self) -> UvWindow {
        self.window
    }

    /// Sleeps until a block or an event is there, at most `timeout`.
    pub fn wait(&mut self, timeout: Duration) {
        self.lanes.wait(timeout);
    }

    /// Whether paths before the last ones may be missing from the whole picture, because a region was traced between.
    pub fn has_gaps(&self) -> bool {
        self.has_gaps
    }

    /// Whether a region is traced and not the whole picture.
    pub fn is_in_region(&self) -> bool {
        self.in_region
    }

    /// Stops the render; what has been sent remains valid.
    pub fn abort(&self) {
        self.tracers.abort();
    }

    /// Whether the samples of this epoch cover a film of the present size and filter.
    pub fn covers_film(&self) -> bool {
        let (has, wants) = (&self.window, self.wanted_window());
        (0..2).all(|i| has.min[i] <= wants.min[i] && has.max[i] >= wants.max[i])
    }

    /// Where samples must lie for a film of the present size. Samples in index order are those of a headless render, exactly;
    /// otherwise they suffice for every splat filter, so that changing it asks for no new ones.
    fn wanted_window(&self) -> UvWindow {
        let spec = self.run.film;
        if self.run.deterministic { spec.window() } else { widest_window(spec) }
    }

    /// The render has ended and every block of it was taken.
    pub fn is_through(&self) -> bool {
        self.through
    }

    /// Every path of the whole picture was traced.
    pub fn is_complete(&self) -> bool {
        !self.in_region && self.through && self.ended == Some(FinishReason::Complete)
    }

    /// Time since the present epoch began.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// What the whole picture has rejected so far.
    pub fn rejected(&self, editor: &SceneEditor) -> RejectedReport {
        let mut rejections = self.rejected.clone();
        if !self.in_region {
            rejections.merge(&self.tracers.rejections());
        }
        RejectedReport::new(&self.run, editor.desc(), &editor.scene(), &rejections)
    }

    /// Samples that the tracer has sent since the start.
    pub fn traced(&self) -> u64 {
        self.tracers.traced()
    }

    /// Blocks in the lanes, and how many fit.
    pub fn fill(&self) -> (usize, usize) {
        let fill = self.lanes.fill();
        (fill.blocks, fill.capacity)
    }
}

/// Where samples must lie for every splat filter.
fn widest_window(film: FilmSpec) -> UvWindow {
    FilmSpec { filter: SplatFilter::Gaussian, ..film }.window()
}

/// An order for evenly distributed paths.
fn order(
    scene: Arc<Scene>,
    camera: Camera,
    range: Range<u64>,
    window: UvWindow,
    epoch: Epoch,
) -> RenderOrder {
    RenderOrder { scene, camera, range, window, epoch, sampling: Default::default(), check: None }
}
