//! One frame, in the paper's order (§4.2, Figure 1).

use std::time::{Duration, Instant};

use crate::app::view::screen::Screen;
use crate::app::view::viewer::Viewer;
use crate::client::pacing::{FramePlan, Situation};
use crate::client::{BATCH_CAPACITY, ClientError};
use crate::gpu::Readiness;
use crate::stream::block::BLOCK_SAMPLES;

/// After an edit the loop waits this long for samples before it looks at messages again.
const FIRST_SAMPLES_WAIT: Duration = Duration::from_millis(4);

/// Samples that make a first picture: LoD shows the scene from few.
const FIRST_SAMPLES: u64 = 512;

impl Viewer {
    /// Messages, read samples, rasterise, repaint, swap.
    ///
    /// # Errors
    ///
    /// What device, film or surface say.
    pub fn frame(&mut self) -> Result<(), ClientError> {
        let begin = Instant::now();
        if let Some((index, message)) = self.session.events() {
            self.say(format!("path {index} panicked and the render has ended: {message}; please report it"));
        }
        if self.screen.as_mut().and_then(Screen::film).is_some_and(|film| film.has_arrived()) {
            self.pending.repaint = true;
        }
        let plan = self.plan_frame(begin);
        let wanted = plan.repaint || self.pending.show || self.panel_due(begin);
        let shown = wanted && (!self.pending.hidden || self.pending.show) && self.make_ready()?;
        self.take(&plan, begin)?;
        if plan.flush
            && let Some(screen) = &mut self.screen
        {
            screen.flush()?;
        }
        if self.session.is_through() && self.kept.caught_up() && std::mem::take(&mut self.pending.end) {
            self.pending.repaint = true;
            tracing::info!("the render has ended");
        }
        if shown && self.has_picture() {
            self.show(&plan)?;
        }
        self.measure(begin);
        Ok(())
    }

    /// What this frame does.
    fn plan_frame(&mut self, now: Instant) -> FramePlan {
        let (then, samples, shown_detail) = self.clock.repainted;
        let counts = self.counts();
        let total = counts.camera_samples + counts.light_samples;
        let spec = self.spec();
        let [width, height] = spec.padded_extent().map(f64::from);
        let lod = (total > 0).then(|| 0.5 * (width * height / total as f64).log2() as f32);
        let situation = Situation {
            since_edit: now - self.clock.edited,
            since_repaint: now - then,
            lod,
            growth: if samples == 0 { f64::INFINITY } else { total as f64 / samples as f64 },
            shown_detail,
            due: self.pending.unseen || self.pending.repaint,
            waiting: self.session.fill().0 * BLOCK_SAMPLES,
            // In order of index only full batches are rasterised.
            batched: if self.plan.run.deterministic { 0 } else { self.batched() },
        };
        let mut plan = self.pacer.plan(&situation);
        if self.plan.run.deterministic {
            plan.samples = plan.samples.max(BATCH_CAPACITY);
        }
        plan
    }

    /// An image of the window to draw into, and a film of its size. False when there is nothing to draw into now.
    fn make_ready(&mut self) -> Result<bool, ClientError> {
        self.match_output();
        let Some(screen) = &mut self.screen else { return Ok(false) };
        let (readiness, extent) = screen.acquire()?;
        self.pending.hidden = matches!(readiness, Readiness::Hidden);
        match readiness {
            Readiness::Ready => {}
            Readiness::Busy | Readiness::Hidden => return Ok(false),
            Readiness::SurfaceLost => {
                screen.replace_surface()?;
                tracing::info!("the surface was lost and replaced");
                return Ok(false);
            }
        }
        if let Some(extent) = extent {
            self.refit(extent)?;
        }
        Ok(true)
    }

    /// Reads samples and gives them to the film: kept ones first where the film is behind. After an edit it waits a moment
    /// for the first ones.
    fn take(&mut self, plan: &FramePlan, begin: Instant) -> Result<(), ClientError> {
        self.read(plan.samples)?;
        while self.pending.unseen && !self.session.is_through() && self.samples() < FIRST_SAMPLES {
            let left = FIRST_SAMPLES_WAIT.saturating_sub(begin.elapsed());
            if left.is_zero() {
                break;
            }
            self.session.wait(left);
            self.session.events();
            self.read(plan.samples)?;
        }
        Ok(())
    }

    /// Reads `budget` samples.
    ///
    /// # Errors
    ///
    /// What the film says.
    pub fn read(&mut self, budget: usize) -> Result<(), ClientError> {
        let Some(film) = self.screen.as_mut().and_then(Screen::film) else {
            // Without a film samples are kept as long as there is room; then workers park.
            self.read_ahead(budget);
            return Ok(());
        };
        let mut left = budget;
        while left > 0
            && let Some((samples, first_index, paths)) = self.kept.feed()
        {
            film.count_paths(paths);
            film.add(samples)?;
            if let Some(observer) = &self.observer {
                observer.samples(first_index, paths, samples);
            }
            left = left.saturating_sub(samples.len());
            self.figures.rasterised += samples.len() as u64;
        }
        if !self.kept.caught_up() {
            self.read_ahead(budget);
            return Ok(());
        }
        let (kept, observer, mut failed) = (&mut self.kept, &self.observer, None);
        let drained = self.session.drain(left.max(1024), |block| {
            kept.push(block);
            if failed.is_none() {
                film.count_paths(block.header.paths);
                failed = film.add(block.samples()).err();
                if let Some(observer) = observer {
                    observer.block(block);
                }
            }
        });
        self.figures.rasterised += drained.samples as u64;
        failed.map_or(Ok(()), Err)
    }

    /// Takes samples from the lanes for later, so that the tracer need not wait for a film that is behind.
    fn read_ahead(&mut self, budget: usize) {
        let mut left = budget;
        while left > 0 && self.kept.has_room() {
            let kept = &mut self.kept;
            let drained = self.session.drain(1024, |block| {
                kept.push_for_later(block);
            });
            if drained.blocks == 0 {
                break;
            }
            left = left.saturating_sub(drained.samples.max(1));
        }
    }

    /// Samples on the film.
    pub fn samples(&mut self) -> u64 {
        let counts = self.counts();
        counts.camera_samples + counts.light_samples
    }

    /// Samples that the film has and has not rasterised.
    fn batched(&mut self) -> usize {
        self.screen.as_mut().and_then(Screen::film).map_or(0, |film| film.waiting())
    }

    /// True when there is something to show that belongs to the present epoch, or the last picture of the one before.
    fn has_picture(&mut self) -> bool {
        let painted =
            self.screen.as_mut().and_then(Screen::film).is_some_and(|film| film.painted().is_some());
        painted || self.samples() > 0
    }

    /// Rasterises what was read, repaints if the plan says so, and swaps.
    fn show(&mut self, plan: &FramePlan) -> Result<(), ClientError> {
        let begin = Instant::now();
        let samples = self.samples();
        // In order of index only whole batches are rasterised, so that the sums are those of a headless render.
        let partial = !self.plan.run.deterministic || self.session.is_complete();
        let ready = if partial { samples > 0 } else { samples >= BATCH_CAPACITY as u64 };
        let repaint = (ready && (plan.repaint || self.pending.repaint)).then_some(plan.detail);
        self.run_panel(begin);
        let panel_time = begin.elapsed();
        let overlay = self.has_overlay();
        let Some(screen) = &mut self.screen else { return Ok(()) };
        if partial && repaint.is_some() {
            screen.flush()?;
        }
        let panel = self.ui.as_mut().filter(|_| overlay);
        screen.show(&self.controls.settings, repaint, panel.map(|ui| &mut ui.triangles))?;
        let number = screen.last();
        self.pacer.panel(panel_time);
        self.pending.show = false;
        if let Some(detail) = repaint {
            self.pending.unseen = false;
            let shows = self.figures.statistics.shown();
            self.pending.repaint = false;
            self.clock.repainted = (begin, samples, detail);
            self.figures.paints.push_back(detail);
            self.figures.presented(number, begin, shows);
        } else {
            self.figures.presented(number, begin, None);
        }
        Ok(())
    }

    /// Learns what the device's frames have cost.
    fn measure(&mut self, begin: Instant) {
        let Some(gpu) = self.screen.as_ref().and_then(Screen::gpu).cloned() else { return };
        self.figures.learn(&gpu.take_timings(), &mut self.pacer);
        if let Some(capture) = &mut self.capture {
            let written = capture.client("frame", begin).and_then(|()| capture.frame(self.session.server()));
            if let Err(error) = written {
                self.capture = None;
                self.fail(error);
            }
        }
    }
}
