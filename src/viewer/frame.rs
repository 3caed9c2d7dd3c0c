//! The frame loop: one frame in the paper's order (§4.2, Figure 1), and the conditions that begin an epoch, replace the film or end the
//! loop. What follows an error of a frame stands in `recovery`.

use std::time::{Duration, Instant};

use glam::DVec2;
use miette::Result;
use winit::dpi::PhysicalSize;

use crate::client::pacing::FramePlan;
use crate::client::{CHUNK_SAMPLES, ClientError, ColorOutput, FilmSpec, OptionNames};
use crate::denoise::noise_filter::EpochView;
use crate::gpu::Swapchain;
use crate::job::Job;
use crate::memory::return_free_memory;
use crate::render::process::tell;
use crate::viewer::Viewer;
use crate::viewer::loader::SceneLoader;
use crate::viewer::loading::window_size;
use crate::viewer::screen::{Canvas, Screen};
use crate::viewer::session::TracerNews;
use crate::viewer::stereo;
use crate::viewer::tools::ViewChange;

/// Polling interval while waiting for the device or for the first samples.
const SOON: Duration = Duration::from_millis(1);

/// Longest sleep of the loop, so that external signals are noticed.
const IDLE: Duration = Duration::from_millis(100);

/// An epoch that has not been shown may be cut off by the next edit after this time, so that a scene too slow for its first picture does
/// not block the camera.
const PATIENCE: Duration = Duration::from_millis(250);

/// The method is reconsidered once nothing has been edited for this long.
const REST: Duration = Duration::from_millis(500);

/// Free memory is given back once nothing has been edited for this long.
const LONG_REST: Duration = Duration::from_secs(3);

/// Samples per pixel of a preview: as many as show the scene well enough for a few seconds.
const PREVIEW_SAMPLES: f64 = 2.0;

/// Interval between checks of the display that the window is on: not every window system reports a change.
const DISPLAY_LOOK: Duration = Duration::from_secs(1);

/// Longest wait for the window system to apply a requested window size.
const RESIZING: Duration = Duration::from_millis(400);

/// Samples read ahead per frame while there is no device.
const AHEAD: usize = CHUNK_SAMPLES;

impl Viewer {
    /// Messages, read samples, rasterise, repaint, swap. A retried frame reads no samples.
    fn frame(&mut self, is_retry: bool) -> Result<(), ClientError> {
        let begin = Instant::now();
        self.hear_server();
        if self.picture.gpu().is_none() {
            return self.await_device(begin);
        }
        self.leave_lost_parts();
        if self.awaited.is_some() {
            self.picture.request_show();
        }
        let mut plan = self.picture.plan(&self.session, &self.panel.controls.settings, begin);
        plan.repaint &= !self.picture.is_frozen();
        let shows = self.picture.wants_show(&plan, self.panel.is_due(begin)) && self.make_ready()?;
        if shows && self.picture.filter.fresh && !self.session.run_spec().deterministic {
            // The filtered picture is shown before more samples are read.
            plan.samples = 0;
        }
        if !self.picture.is_frozen() && !is_retry {
            self.picture.mend(self.session.run_spec());
            self.leave_lost_parts();
            // A replaced film is filled from retained samples.
            match self.paused.is_some() || self.rests_for_pictures() {
                true => self.picture.read_kept(plan.samples)?,
                false => self.picture.read_samples(&mut self.session, plan.samples, begin)?,
            }
            if plan.flush {
                self.picture.flush()?;
            }
        }
        self.steer();
        self.picture.hear_end(&self.session);
        self.with_tools(None, |tools, context| tools.frame(begin, context));
        // A film of another size has no picture yet; the panel must not wait for one for long.
        if shows && (self.picture.has_picture() || self.picture.since_edit() > PATIENCE) {
            self.show(&plan)?;
        }
        for message in self.picture.take_news(self.session.is_stale()) {
            self.say(message);
        }
        self.send_to_tev(false)?;
        self.measure(begin);
        Ok(())
    }

    /// Whether a preview shows enough: no more samples are read, so that tracer and display leave the processor to the decoding of the
    /// pictures that the scene still lacks.
    pub(super) fn rests_for_pictures(&self) -> bool {
        let [width, height] = self.session.size().map(f64::from);
        let samples = self.picture.counts().samples() as f64;
        self.loader.as_ref().is_some_and(SceneLoader::is_previewed)
            && self.picture.is_seen()
            && !self.session.is_in_region()
            && samples >= PREVIEW_SAMPLES * width * height
    }

    /// Opens a device if there is none; samples are retained until it opens.
    fn await_device(&mut self, begin: Instant) -> Result<(), ClientError> {
        if !self.picture.reopen(self.session.run_spec())? {
            self.clock.retry_at(begin + self.picture.budget());
            return match self.paused {
                Some(_) => Ok(()),
                None => self.picture.read_samples(&mut self.session, AHEAD, begin),
            };
        }
        self.metrics.forget_device();
        if let Some(gpu) = self.picture.gpu() {
            self.session.set_device(gpu.info());
            if let Some(capture) = &mut self.capture {
                capture.replace_gpu(gpu);
            }
        }
        self.clock.set(Instant::now());
        if self.session.run_spec().deterministic || self.picture.mix.is_on() {
            self.edited();
        }
        if let Err(error) = self.picture.remake_groups(self.session.run_spec()) {
            tell(&error.to_string());
            self.end_mix();
        }
        Ok(())
    }

    /// Resumes the whole picture if the region's film is gone (another size, another device) or has lost samples to an error, and ends a
    /// light mix that has lost samples.
    fn leave_lost_parts(&mut self) {
        if self.picture.regions.are_damaged() {
            self.picture.regions.clear();
            self.say("the regions have lost samples to an error of the device and are gone".to_owned());
        }
        if self.picture.mix.is_damaged() {
            self.end_mix();
        }
        if self.session.is_in_region() && self.picture.region().is_none() {
            match self.session.resume(&self.editor, Duration::ZERO) {
                Ok(()) => self.say("the region is released: the picture was made anew".to_owned()),
                Err(error) => self.fail(error),
            }
        }
    }

    /// Ends the light mix because device memory does not suffice.
    fn end_mix(&mut self) {
        self.picture.mix.end();
        self.say("the light mix ends: the device has no room for the films of the groups".to_owned());
        if let Err(error) = self.session.set_light_groups(Vec::new()) {
            self.fail(error);
        }
        self.edited();
    }

    /// Sends the picture to tev, if requested, when it is due or when it is the `last` one.
    pub(super) fn send_to_tev(&mut self, last: bool) -> Result<(), ClientError> {
        match &mut self.options.tev {
            Some(tev) if last || tev.is_due(self.picture.counts()) => {
                self.picture.send_to_tev(tev, &self.options.name, &self.session)
            }
            _ => Ok(()),
        }
    }

    /// Performs the due work: actions, camera, epoch, frame.
    pub(super) fn step(&mut self) {
        let now = Instant::now();
        if let Some(gesture) = self.panel.input.tick((now - self.tick).as_secs_f64()) {
            self.gesture(gesture);
        }
        self.tick = now;
        self.follow_display(now);
        self.look_at_files(now);
        if let Some(gpu) = self.picture.gpu().cloned() {
            let shown = self.picture.screen.as_mut().and_then(Screen::swapchain).and_then(Swapchain::shown);
            self.metrics.completed(&gpu, shown, &mut self.picture.pacer);
        }
        self.act();
        if self.with_tools(None, |tools, context| tools.poll(context)) {
            self.refresh();
        }
        self.note_tools();
        self.return_memory();
        if let Err(error) = self.choose_method() {
            return self.fail(error);
        }
        let may_cut = self.picture.is_seen() || self.session.elapsed() > PATIENCE;
        if self.session.is_stale() && may_cut {
            match self.restart() {
                Ok(()) => self.clock.set(now),
                Err(error) => return self.fail(error),
            }
        }
        let due = self.clock.next();
        if now < due || !self.picture.is_idle() {
            return;
        }
        // The window opens until its first picture; that time has a figure of its own.
        let open = self.metrics.presented > 0;
        if open {
            self.metrics.waited("for the device", now.saturating_duration_since(due.max(self.ended)));
        }
        let is_retry = self.clock.begin(now, self.picture.budget());
        let outcome = self.frame(is_retry);
        let has_failed = outcome.is_err();
        if let Err(error) = outcome {
            self.recover(error);
        }
        self.ended = Instant::now();
        if open {
            self.metrics.waited("for a frame", self.ended - now);
        }
        if self.picture.awaits_first_picture() && !self.clock.has_retry() && !has_failed {
            self.clock.set(Instant::now() + SOON);
        }
    }

    /// Gives free memory back to the system once at every rest of the user: that of pictures of another size, or of passes that are no longer
    /// shown. On a thread of its own, since the allocator looks through all that is free.
    fn return_memory(&mut self) {
        let at_rest = self.picture.since_edit() > LONG_REST;
        if at_rest && !self.has_returned_memory {
            // Without a thread the memory stays until the next rest.
            let _ = Job::start("memory", |_| return_free_memory()).map(Job::abandon);
        }
        self.has_returned_memory = at_rest;
    }

    /// Adopts the refresh rate of the display that the window is on, unless the user set one. The window system may not know it before the
    /// first frame or after the window has moved.
    fn follow_display(&mut self, now: Instant) {
        if self.options.budget.is_some() || now < self.look_at_display {
            return;
        }
        self.look_at_display = now + DISPLAY_LOOK;
        if let Some(budget) = self.picture.screen.as_ref().and_then(Screen::frame_length) {
            self.picture.pacer.set_budget(budget);
        }
    }

    /// Time of the next wake-up of the loop.
    pub(super) fn next_look(&mut self, now: Instant) -> Instant {
        let busy = !self.picture.is_idle();
        if self.metrics.awaits_edit() || (busy && now >= self.clock.next()) {
            return now + SOON;
        }
        let still = self.loader.is_none()
            && (self.session.is_through() || self.paused.is_some())
            && !self.session.is_stale()
            && !self.editor.is_preparing()
            && self.awaited.is_none()
            && self.picture.is_settled()
            && !self.tools.is_busy()
            && !self.panel.input.is_moving();
        if !still {
            return self.clock.next();
        }
        self.panel.next_run().map_or(now + IDLE, |due| due.min(now + IDLE)).max(self.clock.next())
    }

    /// Reads the server's events, and reports a path that panicked.
    fn hear_server(&mut self) {
        self.session.hear_server();
        for TracerNews { message, ill } in self.session.news_of_tracers() {
            if ill {
                tell(&message);
                self.panel.host.pin(message);
            } else {
                self.say(message);
            }
        }
        if let Some((index, message)) = self.session.new_panic() {
            let text = format!("path {index} panicked and the render has ended: {message}; please report it");
            self.say(text);
        }
    }

    /// Acquires a swapchain image and creates the requested film if it differs. False if there is no image now.
    fn make_ready(&mut self) -> Result<bool, ClientError> {
        self.match_output();
        self.match_layers();
        let extent = match self.picture.acquire()? {
            Canvas::Ready(extent) => extent,
            Canvas::Hidden => {
                self.awaited = None;
                return Ok(false);
            }
            Canvas::Later(at) => {
                self.clock.retry_at(at);
                return Ok(false);
            }
        };
        let Some(window) = self.picture.screen.as_ref().map(|screen| screen.window.clone()) else {
            return Ok(false);
        };
        self.refit(self.session.size())?;
        let area = self.panel.picture_area(&window, extent);
        if DVec2::from(area.map(f64::from)) == self.panel.viewport.area() {
            self.awaited = None;
        }
        self.awaited.take_if(|until| Instant::now() >= *until);
        let area = self.awaited.map_or(area, |_| self.panel.viewport.area().as_uvec2().to_array());
        self.set_view_sizes(area);
        Ok(true)
    }

    /// Opens or closes the dock.
    pub(super) fn toggle_panel(&mut self) {
        self.panel.controls.layout.is_open ^= true;
        self.keep_picture();
    }

    /// Resizes the window so that the picture keeps its area after the dock has changed. If the window system refuses, the picture takes
    /// the remaining area.
    pub(super) fn keep_picture(&mut self) {
        let area = self.panel.viewport.area().as_uvec2();
        let Some(screen) = &self.picture.screen else { return };
        let wanted = PhysicalSize::new(area.x + self.panel.dock_pixels(&screen.window), area.y);
        if self.ask_size(wanted) {
            self.awaited = Some(Instant::now() + RESIZING);
        }
    }

    /// Requests a window size in which a picture of this size is shown at 1:1, as far as the display allows.
    pub(super) fn ask_room(&mut self, size: [u32; 2]) {
        let Some(screen) = &self.picture.screen else { return };
        self.ask_size(window_size(&screen.window, size, self.panel.dock_pixels(&screen.window)));
    }

    /// Requests a window size, unless the window fills the screen; returns whether it did.
    fn ask_size(&mut self, wanted: PhysicalSize<u32>) -> bool {
        let Some(screen) = &self.picture.screen else { return false };
        let is_fixed = screen.window.fullscreen().is_some() || screen.window.is_maximized();
        if screen.window.inner_size() == wanted || is_fixed {
            return false;
        }
        if let Some(size) = screen.window.request_inner_size(wanted) {
            self.resized(size);
        }
        true
    }

    /// Extent of the window beside the dock, physical pixels.
    pub(super) fn picture_area(&self) -> Option<[u32; 2]> {
        let window = &self.picture.screen.as_ref()?.window;
        Some(self.panel.picture_area(window, window.inner_size().into()))
    }

    /// Runs the panel if it is due, repaints if the plan says so, and swaps.
    fn show(&mut self, plan: &FramePlan) -> Result<(), ClientError> {
        let begin = Instant::now();
        if self.panel.is_due(begin)
            && let Some(window) = self.picture.screen.as_ref().map(|screen| screen.window.clone())
        {
            let data = self.panel_data(begin);
            let asked = self.panel.run(&window, &data, &mut self.tools, &self.keys);
            self.actions.extend(asked);
            self.actions.extend(self.tools.take_actions());
            self.note_tools();
        }
        let panel_time = begin.elapsed();
        let (settings, viewport, drawing) = self.panel.shown();
        let shown = self.picture.show(&self.session, plan, settings, viewport, drawing, begin)?;
        self.picture.pacer.panel(panel_time);
        if self.metrics.presented == 0 {
            self.look_at_display = begin;
        }
        self.metrics.presented(&shown);
        // A frame that only shows the previous picture again proves nothing, unless the picture is frozen.
        if shown.detail.is_some() || self.picture.is_frozen() {
            self.errors.succeed();
        }
        Ok(())
    }

    /// Reads GPU pass timings and records them if asked for.
    fn measure(&mut self, begin: Instant) {
        let Some(gpu) = self.picture.gpu().cloned() else { return };
        let rasterised = self.picture.rasterised;
        let coarse = self.picture.is_coarse();
        self.metrics.learn(&gpu.take_timings(), rasterised, coarse, &mut self.picture.pacer);
        self.metrics.drew(self.picture.learn_host_time());
        if let Some(capture) = &mut self.capture {
            let written =
                capture.client("frame", begin).and_then(|()| capture.frame(self.session.tracers.server()));
            if let Err(error) = written {
                self.capture = None;
                self.fail(error);
            }
        }
    }

    /// Resumes after a pause.
    pub(super) fn go_on(&mut self) {
        self.with_tools(None, |_, context| context.go_on());
    }

    /// Notes an edit of scene or camera.
    pub(super) fn edited(&mut self) {
        let now = Instant::now();
        self.go_on();
        self.tools.forget(ViewChange::Edited);
        self.session.edited();
        self.picture.edited(now);
        self.metrics.edit(now);
    }

    /// Begins the next epoch with the present scene, camera and size. The old picture stays until the new one is ready.
    pub(super) fn restart(&mut self) -> Result<()> {
        self.session.begin(&self.editor)?;
        // With another number of eyes the film is another one, which must not be filled from samples of the epoch before.
        let has_both = self.picture.layout(&self.panel.controls.settings).is_some();
        if has_both != self.session.run_spec().stereo.is_some()
            && let Err(error) = self.picture.refit(self.session.run_spec())
        {
            self.recover(error);
        }
        let cameras = self.editor.cameras(self.session.size())?.into_iter();
        let views = cameras.map(|camera| EpochView { scene: self.editor.scene(), camera }).collect();
        self.picture.begin_epoch(&self.session, views, &self.panel.controls.settings)?;
        self.tools.forget(ViewChange::Epoch);
        self.metrics.epoch();
        Ok(())
    }

    /// Reconsiders the method, if the choice is automatic.
    pub(super) fn choose_method(&mut self) -> Result<()> {
        if self.session.is_in_region() {
            return Ok(());
        }
        let at_rest = self.picture.since_edit() > REST;
        let is_chosen = self.session.choose(&self.editor, at_rest)?;
        // Error estimates of the last epoch do not apply to the next, and a finished render stays as it is.
        let goes_on =
            at_rest && !self.session.is_stale() && !self.session.is_through() && self.paused.is_none();
        let observers = self.picture.observers().filter(|_| goes_on);
        let changes =
            observers.map(|observer| observer.state().late).any(|late| self.session.change_over(&late));
        if is_chosen || changes {
            self.refresh();
        }
        Ok(())
    }

    /// Creates a film of this size and of the selected filter if it differs. If only the scale has changed the epoch continues: the new
    /// film is filled from retained samples, whose positions are resolution-independent. Another aspect ratio changes the camera and begins
    /// a new epoch.
    fn refit(&mut self, [width, height]: [u32; 2]) -> Result<(), ClientError> {
        let before = self.session.run_spec().film;
        let after = FilmSpec { width, height, filter: self.panel.controls.filter, ..before };
        self.session.set_film(after);
        self.picture.refit(self.session.run_spec())?;
        if before == after {
            return Ok(());
        }
        if [before.width, before.height] != [width, height] {
            self.metrics.resizes += 1;
            self.tools.forget(ViewChange::Resized);
        }
        self.film_changed(before);
        Ok(())
    }

    /// Begins another epoch if the retained samples do not fit the new film.
    pub(super) fn film_changed(&mut self, before: FilmSpec) {
        let cross = |a: u32, b: u32| u64::from(a) * u64::from(b);
        let [width, height] = self.session.size();
        let same_shape = cross(before.width, height) == cross(before.height, width);
        // In index order a film holds whole batches from the first index on.
        // Samples of light groups are not retained.
        let is_mix = self.picture.mix.is_on();
        if !same_shape || is_mix || !self.session.covers_film() || self.session.run_spec().deterministic {
            self.edited();
        }
    }

    /// Sets the window's colour format to the requested one, or to 8 bits if unsupported.
    fn match_output(&mut self) {
        let settings = &mut self.panel.controls.settings;
        let wanted = settings.output;
        let Some(swapchain) = self.picture.screen.as_mut().and_then(Screen::swapchain) else { return };
        swapchain.set_peak(settings.peak as f32);
        if swapchain.set_output(wanted) || wanted == ColorOutput::Sdr {
            return;
        }
        let offered: Vec<_> = swapchain.outputs().iter().map(ColorOutput::label).collect();
        swapchain.set_output(ColorOutput::Sdr);
        settings.output = ColorOutput::Sdr;
        self.picture.request_repaint();
        let (wanted, offered) = (wanted.label(), offered.join(", "));
        self.say(format!(
            "warning: no {wanted} on this display, which offers {offered}; the window has 8 bits"
        ));
    }

    /// Gives the window's images a layer for each eye if the layout needs them, or takes another layout if unsupported.
    fn match_layers(&mut self) {
        let layout = self.picture.layout(&self.panel.controls.settings).unwrap_or_default();
        let Some(swapchain) = self.picture.screen.as_mut().and_then(Screen::swapchain) else { return };
        if swapchain.set_layers(stereo::layers(layout)) {
            return;
        }
        let why = stereo::refused_layout(layout, swapchain.most_layers());
        self.panel.controls.settings.stereo = layout.in_one_picture();
        self.picture.request_repaint();
        why.into_iter().for_each(|why| self.say(format!("warning: {why}")));
    }

    /// Repaints the same samples after the display controls have changed; another splat filter needs another film.
    pub(super) fn controls_changed(&mut self) {
        if self.editor.rig().is_some() {
            stereo::refused_settings(&mut self.panel.controls.settings)
                .into_iter()
                .for_each(|why| self.say(why));
        }
        self.picture.request_repaint();
        self.set_picture_size(self.session.size());
    }

    /// Creates a film of this size if it differs.
    pub(super) fn set_picture_size(&mut self, size: [u32; 2]) {
        if let Err(error) = self.refit(size) {
            self.recover(error);
        }
        // Cursor positions refer to the picture of this size from now on.
        self.set_view_sizes(self.panel.viewport.area().as_uvec2().to_array());
    }

    /// Shows the present picture, or those of both eyes, in an area of this size.
    fn set_view_sizes(&mut self, area: [u32; 2]) {
        let layout = self.picture.layout(&self.panel.controls.settings);
        self.panel.set_sizes(area, self.session.size(), layout);
    }

    /// Ends the loop for this reason; only the first call has an effect.
    pub(super) fn fail(&mut self, error: miette::Report) {
        if self.outcome.is_ok() {
            self.outcome = Err(error);
        }
        self.quit = true;
    }
}
