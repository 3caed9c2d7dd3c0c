//! Errors of a frame: a lost device is replaced, and what a device has no memory for is taken back.

use std::time::{Duration, Instant};

use crate::client::{ClientError, FilmSpec, Settings};
use crate::viewer::Viewer;
use crate::viewer::picture::Painted;
use crate::viewer::screen::is_device_lost;

/// How long frames may fail before the first picture, when there is no earlier state to fall back to.
const FIRST_PATIENCE: Duration = Duration::from_secs(5);

impl Viewer {
    /// Handles an error that a new device would have, too, such as out-of-memory: reverts to the film of the last picture, or else to its
    /// settings, whichever was changed since. If neither was, the frame is retried once; then the picture freezes, without new samples,
    /// until something changes. Before the first picture there is nothing to revert to, so the frame is retried for a while; the same
    /// holds while all pictures were coarse, with this film and these settings: coarse ones need less memory.
    fn step_back(&mut self, error: ClientError) {
        let now = Instant::now();
        let is_known = self.errors.has_failed();
        self.clock.set(self.errors.fail(now, &error));
        let asked = self.session.run_spec().film;
        let asked = FilmSpec { filter: self.panel.controls.filter, ..asked };
        let is_state =
            |painted: &Painted| painted.detail == 1 || !painted.is_of(&asked, &self.panel.controls.settings);
        let Some(painted) = self.picture.painted.clone().filter(is_state) else {
            if self.errors.lasts(now) > FIRST_PATIENCE {
                return self.fail(miette::Report::from_err(error));
            }
            if !is_known {
                self.say(format!("{error}; trying again for {FIRST_PATIENCE:.0?}"));
            }
            return;
        };
        // The variance depends on the number of eyes.
        let film = FilmSpec { variance: asked.variance, ..painted.film };
        let kept = if self.session.run_spec().stereo.is_some() && !painted.has_right_eye {
            // The device has no room for both eyes.
            match self.with_tools(None, |tools, context| tools.stereo.close(context)) {
                Ok(closed) => closed,
                Err(error) => return self.fail(error),
            }
        } else if film != asked {
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
                    // The film is the requested one, and memory does not suffice for another.
                    self.session.set_film(asked);
                    self.panel.controls.filter = asked.filter;
                    if is_known {
                        return;
                    }
                    "trying again".to_string()
                }
            }
        } else if !painted.is_of(&film, &self.panel.controls.settings) {
            let exposure = self.panel.controls.settings.exposure;
            self.panel.controls.settings = Settings { exposure, ..painted.settings };
            self.picture.request_repaint();
            "the display settings are again those of the last picture".to_string()
        } else if self.picture.is_frozen() {
            // The error has been reported; the window is redrawn as soon as possible.
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

    /// Handles an error of a frame: a lost device is replaced while the tracer continues.
    pub(super) fn recover(&mut self, error: ClientError) {
        if self.picture.gpu().is_none() {
            // No device could be opened in time.
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
}
