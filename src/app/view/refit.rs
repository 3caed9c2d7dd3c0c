//! What happens when the picture's size, its filter, or the device under it changes: another film, filled from kept samples.

use std::time::Instant;

use miette::Result;

use crate::app::tell;
use crate::app::view::screen::{Screen, is_device_lost};
use crate::app::view::viewer::Viewer;
use crate::client::film::VulkanFilm;
use crate::client::{ClientError, Output};
use crate::gpu::ColorOutput;

/// Devices that may be lost before the viewer gives up.
const MOST_LOSSES: u32 = 1;

impl Viewer {
    /// Makes the film fit a window of this extent and the chosen filter. Where only the scale has changed the epoch goes on:
    /// the new film is filled from kept samples, which know no resolution. Another shape is another camera, a new epoch; until
    /// its first samples are there the old ones are shown, stretched, so that nothing flickers.
    ///
    /// # Errors
    ///
    /// When the film does not fit into the device.
    pub fn refit(&mut self, extent: [u32; 2]) -> Result<(), ClientError> {
        let before = std::mem::replace(&mut self.size, extent);
        let spec = self.spec();
        let Some(screen) = &mut self.screen else { return Ok(()) };
        if screen.film().is_some_and(|film| *film.spec() == spec) {
            return Ok(());
        }
        if let Err(error) = screen.replace_film(spec) {
            self.size = before;
            return Err(error);
        }
        self.rewind();
        self.pending.repaint = true;
        if before != extent {
            self.figures.resizes += 1;
        }
        let cross = |a: [u32; 2], b: [u32; 2]| u64::from(a[0]) * u64::from(b[1]);
        let same_shape = cross(before, extent) == cross(extent, before);
        let covered = self.session.covers(&self.uv_window());
        // In order of index a film holds whole batches from the first on.
        if !same_shape || !covered || self.plan.run.deterministic {
            self.edited();
        }
        Ok(())
    }

    /// The film is empty: it and its error are made anew from the samples that are kept, which know the index that they begin
    /// with and so their replicate. What the store had no room for is missing from both.
    fn rewind(&mut self) {
        self.kept.rewind();
        self.watch(false);
    }

    /// Makes the window's colours those that are asked for, or 8 bits where it does not offer them.
    pub fn match_output(&mut self) {
        let wanted = self.controls.settings.output;
        let Some(swapchain) = self.screen.as_mut().and_then(Screen::swapchain) else { return };
        if swapchain.set_output(colors(wanted)) || wanted == Output::Sdr {
            return;
        }
        let offered: Vec<_> = swapchain.outputs().into_iter().map(words).collect();
        swapchain.set_output(ColorOutput::Sdr);
        self.controls.settings.output = Output::Sdr;
        self.pending.repaint = true;
        let (wanted, offered) = (words(colors(wanted)), offered.join(", "));
        self.say(format!(
            "warning: no {wanted} on this display, which offers {offered}; the window has 8 bits"
        ));
    }

    /// Deals with an error of a frame: a lost device is replaced once, and the tracer goes on meanwhile.
    pub fn recover(&mut self, error: ClientError) {
        let losses = self.screen.as_ref().map_or(0, |screen| screen.losses[0]);
        if !is_device_lost(&error) || losses >= MOST_LOSSES {
            if let Some(screen) = self.screen.as_mut().filter(|_| is_device_lost(&error)) {
                screen.losses[0] += 1;
            }
            return self.fail(miette::Report::from_err(error));
        }
        tell(&format!("the device was lost; opening it again ({error})"));
        let spec = self.spec();
        let Some(screen) = &mut self.screen else { return };
        match screen.replace_device(spec) {
            Ok(()) => {
                self.rewind();
                self.figures.forget_device();
                let gpu = self.screen.as_ref().and_then(Screen::gpu);
                if let Some((capture, gpu)) = self.capture.as_mut().zip(gpu) {
                    capture.replace_gpu(gpu);
                }
                (self.pending.repaint, self.pending.show) = (true, true);
                self.clock.due = Instant::now();
                if self.plan.run.deterministic {
                    self.edited();
                }
            }
            Err(error) => self.fail(miette::Report::from_err(error)),
        }
    }

    /// Ends the loop for this reason; the first one counts.
    pub fn fail(&mut self, error: miette::Report) {
        if self.outcome.is_ok() {
            self.outcome = Err(error);
        }
        self.quit = true;
    }

    /// Display controls have changed: the same samples are shown in another way; another filter needs another film.
    pub fn controls_changed(&mut self) {
        self.pending.repaint = true;
        let filter = self.controls.filter;
        let film = self.screen.as_mut().and_then(Screen::film);
        if film.map(|film: &mut VulkanFilm| film.spec().filter) != Some(filter)
            && let Err(error) = self.refit(self.size)
        {
            self.recover(error);
        }
    }
}

/// The window's colours for a picture that is encoded so.
fn colors(output: Output) -> ColorOutput {
    match output {
        Output::Sdr => ColorOutput::Sdr,
        Output::ScRgb => ColorOutput::ScRgb,
        Output::Hdr10 => ColorOutput::Hdr10,
    }
}

fn words(output: ColorOutput) -> &'static str {
    match output {
        ColorOutput::Sdr => "8 bits",
        ColorOutput::ScRgb => "scRGB",
        ColorOutput::Hdr10 => "HDR10",
    }
}
