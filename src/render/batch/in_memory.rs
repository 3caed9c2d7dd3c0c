//! A render whose picture the caller gets in memory, for programs that use this one as a library.

use std::time::Instant;

use miette::{IntoDiagnostic, Result};
use serde_json::Value;

use super::{BatchRender, Traced};
use crate::image::exr::Layers;
use crate::render::options::RenderOptions;
use crate::render::outputs::{Outputs, file_layers};
use crate::render::stereo_error::StereoEnd;
use crate::render::stereo_outputs::{EyePictures, PendingStereo};
use crate::render::watch::RenderWatcher;
use crate::render::{checks, pipelines};

/// A picture in memory.
#[derive(Clone, Debug)]
pub struct RenderedPicture {
    /// What an EXR file of the picture has: channels and attributes; of two eyes both views.
    pub layers: Layers,
    /// The report of the run, with the keys of the JSON report of `pointillist render`.
    pub report: Value,
}

/// Renders without a file; `watcher` is called at least every 20 ms while paths are traced, and may end the render. Signals stay those of the caller.
///
/// # Errors
///
/// When options exclude each other, a step of the run fails, or a path panics.
pub fn render_in_memory(args: &RenderOptions, watcher: &mut RenderWatcher<'_>) -> Result<RenderedPicture> {
    let rendered = render_to_layers(args, watcher);
    pipelines::save_kept();
    rendered
}

fn render_to_layers(args: &RenderOptions, watcher: &mut RenderWatcher<'_>) -> Result<RenderedPicture> {
    let start = Instant::now();
    let outputs = checks::check(args, |_| Ok(Outputs::in_memory()))?;
    let mut batch = BatchRender::set_up(args, &outputs, None)?;
    let traced = batch.trace(&outputs, Some(watcher))?;
    let layers = batch.layers(&outputs, &traced)?;
    batch.seconds.total = start.elapsed().as_secs_f64();
    let report = serde_json::to_value(batch.report(&outputs, &traced)).into_diagnostic()?;
    batch.check_panic(&traced)?;
    Ok(RenderedPicture { layers, report })
}

impl BatchRender<'_> {
    /// The picture with all its layers. Ends the capture of timings.
    fn layers(&mut self, outputs: &Outputs, traced: &Traced) -> Result<Layers> {
        let outcome = self.end(traced);
        let start = Instant::now();
        let [extras, right_extras] = self.extras(outputs, traced)?;
        let layers = match &mut self.right_eye {
            Some(eye) => {
                let at = self.args.error_at;
                let end = StereoEnd::new(outcome, traced.states(), self.goal.error.is_some(), at);
                let pictures = EyePictures {
                    films: [&mut *self.client, &mut *eye.film],
                    extras: [extras, right_extras],
                    layout: None,
                };
                let taken = PendingStereo::take(outputs, pictures, &self.settings)?.wait()?;
                let views = taken.views(&self.run, &end)?;
                views.ok_or_else(|| miette::miette!("the pictures of two eyes are not there"))?
            }
            None => {
                let data = self.client.develop().into_diagnostic()?;
                file_layers(&data, &self.run, &outcome, &extras.into_channels(), &self.settings)
            }
        };
        self.seconds.write = start.elapsed().as_secs_f64() - self.seconds.denoise;
        self.finish_timings(start)?;
        Ok(layers)
    }
}
