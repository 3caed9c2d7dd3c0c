//! The loop: one frame in the paper's order (§4.2, Figure 1), and what begins an epoch, replaces the film or ends the loop.

use std::time::{Duration, Instant};

use glam::DVec2;
use miette::Result;
use winit::dpi::PhysicalSize;

use crate::client::pacing::FramePlan;
use crate::client::{CHUNK_SAMPLES, ClientError, ColorOutput, FilmSpec, OptionNames};
use crate::denoise::noise_filter::EpochView;
use crate::gpu::Swapchain;
use crate::render::process::tell;
use crate::viewer::Viewer;
use crate::viewer::loading::window_size;
use crate::viewer::outline::OutlineKey;
use crate::viewer::picture::Painted;
use crate::viewer::screen::{Canvas, Screen, is_device_lost};
use crate::viewer::session::TracerNews;

/// How soon the loop looks again while the device or first samples are waited for.
const SOON: Duration = Duration::from_millis(1);

/// How long it sleeps at most: signals from outside are heard then.
const IDLE: Duration = Duration::from_millis(100);

/// An epoch that is not shown may be cut off by the next edit after this long: a scene that is too slow for its first picture
/// must not hold the camera.
const PATIENCE: Duration = Duration::from_millis(250);

/// Another method is considered when nothing has been edited for this long.
const REST: Duration = Duration::from_millis(500);

/// The selected object is outlined when nothing has been edited for this long.
const STILL: Duration = Duration::from_millis(60);

/// Time between two looks at the display that the window is on: not every window system says when it is another one.
const DISPLAY_LOOK: Duration = Duration::from_secs(1);

/// How long the first picture may fail: there is none to go back to.
const FIRST_PATIENCE: Duration = Duration::from_secs(5);

/// How long the window system may take to give the window a size that was asked for.
const RESIZING: Duration = Duration::from_millis(400);

/// Samples that are taken at once while there is no device.
const AHEAD: usize = CHUNK_SAMPLES;

impl Viewer {
    /// Messages, read samples, rasterise, repaint, swap. A frame that is tried again reads no samples.
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
        if shows && self.picture.is_freshly_filtered() && !self.session.run_spec().deterministic {
            // It is shown before more samples are read.
            plan.samples = 0;
        }
        if !self.picture.is_frozen() && !is_retry {
            self.picture.mend(self.session.run_spec());
            self.leave_lost_parts();
            match self.paused {
                // A film that was replaced meanwhile gets what is kept.
                Some(_) => self.picture.read_kept(plan.samples)?,
                None => self.picture.read_samples(&mut self.session, plan.samples, begin)?,
            }
            if plan.flush {
                self.picture.flush()?;
            }
        }
        self.picture.hear_end(&self.session);
        self.auto_exposure(begin);
        // A film of another size has no picture yet: the panel is not to wait for one for long.
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

    /// Opens a device where there is none; until then samples are kept.
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

    /// Goes on with the whole picture where the film of the region is gone (another size, another device), or an error has cost samples of it;
    /// ends a mix of lights of which samples were lost.
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

    /// Ends the mix of lights, for which there is no room.
    fn end_mix(&mut self) {
        self.picture.mix.end();
        self.say("the light mix ends: the device has no room for the films of the groups".to_owned());
        if let Err(error) = self.session.set_light_groups(Vec::new()) {
            self.fail(error);
        }
        self.edited();
    }

    /// Shows the picture in tev, where that is asked for: when it is due, or as the `last` one.
    pub(super) fn send_to_tev(&mut self, last: bool) -> Result<(), ClientError> {
        match &mut self.options.tev {
            Some(tev) if last || tev.is_due(self.picture.counts()) => {
                self.picture.send_to_tev(tev, &self.options.name, &self.session)
            }
            _ => Ok(()),
        }
    }

    /// Lets the exposure follow the light of the scene, where it may.
    fn auto_exposure(&mut self, now: Instant) {
        let controls = &mut self.panel.controls;
        if !controls.auto_exposure {
            return self.light.start_from(controls.settings.exposure);
        }
        let metered = self.picture.metered().filter(|_| !self.picture.is_frozen());
        if let Some(exposure) = self.light.step(metered, now) {
            controls.settings.exposure = exposure;
            self.picture.expose();
        }
    }

    /// Does what is due: actions, camera, epoch, frame.
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
        self.outline_selection();
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
        // Until its first picture the window opens; that time has a figure of its own.
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

    /// Takes over the rate of the display that the window is on, unless the user asks for one. Not before the first frame, or the window
    /// has moved, does the window system always know.
    fn follow_display(&mut self, now: Instant) {
        if self.options.budget.is_some() || now < self.look_at_display {
            return;
        }
        self.look_at_display = now + DISPLAY_LOOK;
        if let Some(budget) = self.picture.screen.as_ref().and_then(Screen::frame_length) {
            self.picture.pacer.set_budget(budget);
        }
    }

    /// Has the outline of the selected object traced, once the view has come to rest.
    fn outline_selection(&mut self) {
        if self.outline.take() {
            self.refresh();
        }
        let (size, epoch) = (self.session.size(), self.session.epoch());
        self.panel.has_outline = self.editor.selected().is_some();
        self.panel.has_region = self.dragged.is_some() || self.session.is_in_region();
        let key = self.editor.selected().map(|shape| OutlineKey { shape, epoch, size });
        if self.outline.follows(key) {
            return;
        }
        let Some(key) = key else { return self.outline.clear() };
        let rests = !self.session.is_stale() && self.picture.is_seen() && self.picture.since_edit() > STILL;
        if let Some(camera) = self.editor.camera(size).ok().filter(|_| rests) {
            self.outline.begin(key, self.editor.scene(), camera);
        }
    }

    /// When the loop must look again.
    pub(super) fn next_look(&mut self, now: Instant) -> Instant {
        let busy = !self.picture.is_idle();
        if self.metrics.awaits_edit() || (busy && now >= self.clock.next()) {
            return now + SOON;
        }
        let still = self.loader.is_none()
            && (self.session.is_through() || self.paused.is_some())
            && !self.session.is_stale()
            && self.saves.is_empty()
            && !self.editor.is_preparing()
            && self.awaited.is_none()
            && self.picture.is_settled()
            && !self.light.is_changing()
            && !self.inspector.is_busy()
            && !self.outline.is_busy()
            && !self.comparison.is_busy()
            && !self.panel.is_busy();
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

    /// Acquires an image of the window to draw into, and makes the film that is asked for where there is another. False when there is
    /// nothing to draw into now.
    fn make_ready(&mut self) -> Result<bool, ClientError> {
        self.match_output();
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
        self.panel.set_sizes(area, self.session.size());
        Ok(true)
    }

    /// Opens or closes the dock.
    pub(super) fn toggle_panel(&mut self) {
        self.panel.controls.layout.is_open ^= true;
        self.keep_picture();
    }

    /// Gives the window the size in which the picture keeps its area after the dock has changed. Where the window system does not let
    /// it, the picture takes what there is.
    pub(super) fn keep_picture(&mut self) {
        let area = self.panel.viewport.area().as_uvec2();
        let Some(screen) = &self.picture.screen else { return };
        let wanted = PhysicalSize::new(area.x + self.panel.dock_pixels(&screen.window), area.y);
        if self.ask_size(wanted) {
            self.awaited = Some(Instant::now() + RESIZING);
        }
    }

    /// Asks for a window in which a picture of this size is shown as it is, as far as there is room.
    pub(super) fn ask_room(&mut self, size: [u32; 2]) {
        let Some(screen) = &self.picture.screen else { return };
        self.ask_size(window_size(&screen.window, size, self.panel.dock_pixels(&screen.window)));
    }

    /// Asks for a window of another size, unless it fills the screen; returns whether it did.
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

    /// The part of the window beside the dock, physical pixels.
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
            self.panel.run(&window, &data);
            self.picture.aim(self.panel.target());
        }
        let panel_time = begin.elapsed();
        let (settings, viewport, drawing) = self.panel.shown();
        let shown = self.picture.show(&self.session, plan, settings, viewport, drawing, begin)?;
        self.picture.pacer.panel(panel_time);
        if self.metrics.presented == 0 {
            self.look_at_display = begin;
        }
        self.metrics.presented(&shown);
        self.errors.succeed();
        Ok(())
    }

    /// Learns how long the device's passes took, and records times if asked for.
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

    /// Traces again after a pause.
    pub(super) fn go_on(&mut self) {
        if let Some(since) = self.paused.take() {
            self.picture.stood_still(since.elapsed());
        }
    }

    /// Notes an edit of scene or camera.
    pub(super) fn edited(&mut self) {
        let now = Instant::now();
        self.go_on();
        self.inspector.clear();
        self.session.edited();
        self.picture.edited(now);
        self.panel.edited();
        self.metrics.edit(now);
    }

    /// Begins the next epoch with the present scene, camera and size. The old picture stays until the new one is there.
    pub(super) fn restart(&mut self) -> Result<()> {
        self.session.begin(&self.editor)?;
        let view = EpochView { scene: self.editor.scene(), camera: self.editor.camera(self.session.size())? };
        self.picture.begin_epoch(self.session.run_spec(), view, &self.panel.controls.settings);
        self.panel.begin_epoch();
        self.metrics.epoch();
        Ok(())
    }

    /// Chooses the method anew where that is asked for.
    pub(super) fn choose_method(&mut self) -> Result<()> {
        if self.session.is_in_region() {
            return Ok(());
        }
        let at_rest = self.picture.since_edit() > REST;
        let is_chosen = self.session.choose(&self.editor, at_rest)?;
        // What is known of the last picture says nothing of the next one, and a picture that has ended stays.
        let goes_on =
            at_rest && !self.session.is_stale() && !self.session.is_through() && self.paused.is_none();
        let late = self.picture.observer.as_ref().filter(|_| goes_on).map(|observer| observer.state().late);
        if is_chosen || late.is_some_and(|late| self.session.change_over(&late)) {
            self.refresh();
        }
        Ok(())
    }

    /// Makes a film of this size and of the chosen filter, where there is another. Where only the scale has changed the epoch goes on:
    /// the new film is filled from kept samples, which know no resolution. Another shape is another camera, a new epoch.
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
            // Its paths were drawn for the size before.
            self.inspector.clear();
        }
        self.film_changed(before);
        Ok(())
    }

    /// Begins another epoch where the kept samples are not those of the film that there is now.
    fn film_changed(&mut self, before: FilmSpec) {
        let cross = |a: u32, b: u32| u64::from(a) * u64::from(b);
        let [width, height] = self.session.size();
        let same_shape = cross(before.width, height) == cross(before.height, width);
        // In order of index a film holds whole batches from the first on.
        // Groups of lights are not kept.
        let is_mix = self.picture.mix.is_on();
        if !same_shape || is_mix || !self.session.covers_film() || self.session.run_spec().deterministic {
            self.edited();
        }
    }

    /// Sets the colours of the window to those that are asked for, or to 8 bits where it does not offer them.
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

    /// Shows the same samples in another way, after the display controls have changed; another filter needs another film.
    pub(super) fn controls_changed(&mut self) {
        self.picture.request_repaint();
        self.set_picture_size(self.session.size());
    }

    /// Makes a film of this size, where there is another.
    pub(super) fn set_picture_size(&mut self, size: [u32; 2]) {
        if let Err(error) = self.refit(size) {
            self.recover(error);
        }
        // The mouse is over the picture of this size from now on.
        let area = self.panel.viewport.area().as_uvec2().to_array();
        self.panel.set_sizes(area, self.session.size());
    }

    /// Deals with an error of a frame that a new device would have, too, such as too little memory: goes back to the film of the
    /// last picture, or else to its settings, whichever was changed since. Where neither was, it is tried again once; then the
    /// picture stays as it is, without new samples, until something is changed. Before the first picture there is nothing to go
    /// back to: it is tried again for a while.
    fn step_back(&mut self, error: ClientError) {
        let now = Instant::now();
        let is_known = self.errors.has_failed();
        self.clock.set(self.errors.fail(now, &error));
        let Some(Painted { settings, film }) = self.picture.painted.clone() else {
            if self.errors.lasts(now) > FIRST_PATIENCE {
                return self.fail(miette::Report::from_err(error));
            }
            if !is_known {
                self.say(format!("{error}; trying again for {FIRST_PATIENCE:.0?}"));
            }
            return;
        };
        let asked = self.session.run_spec().film;
        let asked = FilmSpec { filter: self.panel.controls.filter, ..asked };
        let kept = if film != asked {
            self.session.set_film(film);
            self.panel.controls.filter = film.filter;
            match self.picture.go_back(self.session.run_spec()) {
                Ok(was_made) => {
                    if was_made {
                        self.film_changed(asked);
                    }
                    format!("the picture keeps its {}×{} pixels and its filter", film.width, film.height)
                }
                Err(_) => {
                    // The film is the one that was asked for, and there is room for no other.
                    self.session.set_film(asked);
                    self.panel.controls.filter = asked.filter;
                    if is_known {
                        return;
                    }
                    "trying again".to_string()
                }
            }
        } else if self.panel.controls.settings != settings {
            self.panel.controls.settings = settings;
            self.picture.request_repaint();
            "the display settings are again those of the last picture".to_string()
        } else if self.picture.is_frozen() {
            // This was told; the window is drawn again as soon as it can be.
            return self.picture.request_show();
        } else {
            match self.picture.note_failure() {
                true => "the picture stays as it is until something is changed".to_string(),
                false => "trying again".to_string(),
            }
        };
        self.say(format!("{error}; {kept}"));
        self.refresh();
    }

    /// Deals with an error of a frame: a lost device is replaced, and the tracer goes on meanwhile.
    fn recover(&mut self, error: ClientError) {
        if self.picture.gpu().is_none() {
            // No device could be opened for too long.
            return self.fail(miette::Report::from_err(error));
        }
        if !is_device_lost(&error) {
            return self.step_back(error);
        }
        if let Err(error) = self.picture.lose_device(error) {
            return self.fail(miette::Report::from_err(error));
        }
        self.metrics.forget_device();
        self.clock.set(Instant::now());
    }

    /// Ends the loop for this reason; the first one counts.
    pub(super) fn fail(&mut self, error: miette::Report) {
        if self.outcome.is_ok() {
            self.outcome = Err(error);
        }
        self.quit = true;
    }
}
