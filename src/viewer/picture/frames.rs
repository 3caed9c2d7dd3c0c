//! When and from what the picture is repainted, and how it is presented.

use std::time::{Duration, Instant};

use crate::client::film::VulkanFilm;
use crate::client::lod::level_of_detail;
use crate::client::pacing::{FramePlan, PacingInput};
use crate::client::window::host::PanelDrawing;
use crate::client::window::viewport::Viewport;
use crate::client::{ClientError, Reconstruction, Settings};
use crate::denoise::noise_filter::FilteredFrame;
use crate::gpu::FrameNumber;
use crate::image::stereo::StereoLayout;
use crate::stream::BLOCK_SAMPLES;
use crate::viewer::picture::{LastRepaint, LivePicture, Painted, ShownFrame};
use crate::viewer::screen::{Canvas, PictureParts, PictureSource, Screen};
use crate::viewer::session::RenderSession;

/// After an edit, how long to wait for a reprojection of the last picture before one of the first samples is shown instead.
const FIRST_WAIT: Duration = Duration::from_millis(40);

/// The same, for the second picture.
const NEXT_WAIT: Duration = Duration::from_millis(150);

/// Number of paths without any sample, and time since the edit, after which a black picture is shown.
const BLACK_PATHS: u64 = 4096;
const BLACK_AFTER: Duration = Duration::from_millis(500);

impl LivePicture {
    /// How the picture is composed of those of two eyes; `None` for one eye.
    pub fn layout(&self, settings: &Settings) -> Option<StereoLayout> {
        self.film().filter(|film| film.has_right_eye()).map(|_| settings.stereo)
    }

    /// Most layers of the window's images; one before there is a window.
    pub fn most_layers(&mut self) -> u32 {
        self.screen.as_mut().and_then(Screen::swapchain).map_or(1, |swapchain| swapchain.most_layers())
    }

    /// Plans the frame.
    pub fn plan(&mut self, session: &RenderSession, settings: &Settings, now: Instant) -> FramePlan {
        if let Some(screen) = &mut self.screen {
            screen.begin_frame();
            self.pacer.set_lead(screen.leads());
        }
        let run = session.run_spec();
        let mut filter = self.look_at_filter(run, settings);
        // Noisy pictures are shown until the first denoised one.
        let of_first = |frames: Vec<&FilteredFrame>| frames.first().map(|frame| frame.samples);
        let mut filtered = self.filtered_frames(run, settings).and_then(of_first);
        let mut is_fresh = self.filter.fresh;
        // Released regions are denoised once more, from all of their samples.
        for region in self.regions.released_mut() {
            let is_ready = region.look_at_filter(settings, &mut self.pacer, &mut self.filter_time);
            if is_ready && region.filtered(settings) != Some(region.samples()) {
                region.filter_now();
            }
            is_fresh |= region.filter.fresh;
        }
        if let Some(region) = self.regions.traced_mut() {
            filter = region.look_at_filter(settings, &mut self.pacer, &mut self.filter_time);
            filtered = region.filtered(settings);
            is_fresh |= region.filter.fresh;
        }
        if self.film().is_some_and(VulkanFilm::is_background_ready) {
            self.repaint = true;
        }
        let longest_wait = if self.unseen { FIRST_WAIT } else { NEXT_WAIT };
        let waits = self.filter.is_reprojecting() && session.elapsed() < longest_wait;
        let (last, samples) = (&self.last_repaint, self.traced_samples());
        let growth = match last.samples {
            last if last == samples => 1.0,
            0 => f64::INFINITY,
            last => samples as f64 / last as f64,
        };
        let situation = PacingInput {
            since_edit: now - self.last_edit,
            since_repaint: now - last.at,
            lod: level_of_detail(&run.film, self.samples()),
            growth,
            shown_detail: last.detail,
            due: !waits && self.unseen || self.repaint || is_fresh,
            waiting: session.fill().0 * BLOCK_SAMPLES,
            // In index order only full batches are rasterised.
            batched: if run.deterministic { 0 } else { self.film().map_or(0, VulkanFilm::waiting) },
            capacity: self.film().map_or(0, VulkanFilm::batch_capacity),
            coarse: self.is_coarse(),
            streams: self.film().map_or(0, |film| film.allocated_streams().map(u32::from).iter().sum()),
            filter: filter && filtered.is_some(),
        };
        let mut plan = self.pacer.plan(&situation);
        if filter && !situation.due {
            // A repaint follows each denoised picture; the first and the last are denoised as soon as possible.
            let soon = filtered.is_none() || !self.running && filtered != Some(samples);
            let due = filtered.is_some() && std::mem::take(&mut plan.repaint);
            match self.regions.traced_mut() {
                Some(region) if due || soon => region.filter_now(),
                None if (due || soon) && !self.filter.is_busy() => self.filter_now(),
                _ => {}
            }
        }
        plan.repaint &= situation.due || !waits;
        if run.deterministic {
            plan.samples = plan.samples.max(run.film.batch_capacity());
        }
        plan
    }

    /// Whether a frame with this plan shows something.
    pub fn wants_show(&self, plan: &FramePlan, panel_is_due: bool) -> bool {
        self.show || (!self.hidden && (plan.repaint || panel_is_due))
    }

    /// Asks for a swapchain image to draw into.
    pub fn acquire(&mut self) -> Result<Canvas, ClientError> {
        let Some(screen) = &mut self.screen else { return Ok(Canvas::Hidden) };
        let canvas = screen.acquire()?;
        self.hidden = canvas == Canvas::Hidden;
        // A pending redraw stays pending if no image is available.
        self.show |= matches!(canvas, Canvas::Later(_));
        Ok(canvas)
    }

    /// Requests a last repaint once the render has ended and the film has all of its samples.
    pub fn hear_end(&mut self, session: &RenderSession) {
        if session.is_through() && self.kept.caught_up() && std::mem::take(&mut self.running) {
            self.repaint = true;
            tracing::info!("the render has ended");
        }
    }

    /// Whether there is a picture to show, of the present epoch or the last one of the previous.
    pub fn has_picture(&mut self) -> bool {
        self.film_mut().is_some_and(|film| film.painted().is_some()) || self.is_known()
    }

    /// Whether the film shows the present epoch: it has samples, or enough paths without one that it counts as black.
    fn is_known(&self) -> bool {
        let is_black = self.counts().paths() >= BLACK_PATHS && self.since_edit() >= BLACK_AFTER;
        self.samples() > 0 || is_black
    }

    /// Repaints if the plan or a request says so, draws the panel over the picture and presents. The frame `began` with the run of the
    /// panel.
    pub fn show(
        &mut self,
        session: &RenderSession,
        plan: &FramePlan,
        settings: &Settings,
        viewport: &Viewport,
        panel: Option<&mut PanelDrawing>,
        began: Instant,
    ) -> Result<ShownFrame, ClientError> {
        let samples = self.samples();
        // In index order only whole batches are rasterised, so that the sums equal those of a headless render.
        let partial = !session.run_spec().deterministic || session.is_complete();
        let ready = if partial {
            self.is_known()
        } else {
            samples >= session.run_spec().film.batch_capacity() as u64
        };
        let repaint = plan.repaint || self.repaint;
        if repaint && settings.reconstruction == Reconstruction::None {
            // In the view of single texels, coarse sums would show texels that are not the picture's, however few samples there are.
            self.sharpen()?;
        }
        let is_filtered = repaint && self.filtered_frames(session.run_spec(), settings).is_some();
        if partial && ready && repaint && !is_filtered {
            self.flush()?;
        } else if repaint {
            // Sums of regions and groups are never restricted to whole batches.
            self.rasterise(VulkanFilm::settle)?;
        }
        let frames = self.filter.shown_of_eyes(session.run_spec(), settings).filter(|_| is_filtered);
        let frames = frames.unwrap_or_default();
        let pictures: Vec<_> = frames.iter().map(|frame| frame.shown.xyz()).collect();
        let detail = match is_filtered {
            true => Some(1),
            false => (ready && repaint).then_some(plan.detail),
        };
        let samples = match (self.regions.traced(), frames.first()) {
            (Some(region), _) => region.samples(),
            (None, Some(frame)) => frame.samples,
            (None, None) => samples,
        };
        let source = match is_filtered {
            true => Some(PictureSource::Filtered(&pictures)),
            false if self.mix.is_mixing() && !settings.view.is_error() => detail.map(PictureSource::Mix),
            false => detail.map(PictureSource::Film),
        };
        let number = match &mut self.screen {
            Some(screen) => {
                let parts = PictureParts { regions: &mut self.regions, mix: &mut self.mix };
                screen.show(settings, source, parts, viewport, panel)?
            }
            None => FrameNumber::default(),
        };
        self.show = false;
        // The previous picture was shown again: this repaint is still due.
        let detail = detail.filter(|_| !self.film().is_some_and(VulkanFilm::has_given_up));
        if let Some(detail) = detail {
            let film = session.run_spec().film;
            // A coarse picture needs less memory: it does not replace a state that is known to fit.
            let is_new = |painted: &Painted| {
                let differs = !painted.is_of(&film, settings);
                if detail == 1 { differs || painted.detail > 1 } else { differs && painted.detail > 1 }
            };
            let has_right_eye = self.layout(settings).is_some();
            if self.painted.as_ref().is_none_or(is_new) {
                self.painted = Some(Painted { settings: settings.clone(), film, has_right_eye, detail });
            }
            self.failures = 0;
            if std::mem::take(&mut self.unseen) {
                self.filter.prepare();
            }
            self.repaint = false;
            self.filter.fresh = false;
            self.last_repaint = LastRepaint { at: began, samples, detail };
        }
        Ok(ShownFrame { number, began, samples, detail, filtered: is_filtered })
    }
}
