//! Sums of both streams on the CPU; batches are rasterised in the current thread pool.

use crate::client::dense_cells::Merger;
use crate::client::error::ClientError;
use crate::client::reference::accumulator::Accumulator;
use crate::client::reference::splat::{Bins, Sprite};
use crate::client::reference::variance::VarianceParameters;
use crate::client::settings::{CHUNK_SAMPLES, FilmData, FilmSpec};
use crate::client::state::FilmState;
use crate::stream::Sample;

/// Batches and sums of camera and light.
#[derive(Default)]
pub struct HostSums {
    streams: [HostStream; 2],
}

/// Batch of one stream, and its sums, allocated with the first sample.
#[derive(Default)]
struct HostStream {
    batch: Vec<Sample>,
    merger: Merger,
    /// All samples of the batch.
    bins: Bins,
    /// The same samples with those of dense cells merged, if there are dense cells.
    merged: Bins,
    sums: Option<Accumulator>,
}

impl HostSums {
    /// Read-only sums of camera and light stream.
    pub fn of(streams: [Option<Accumulator>; 2]) -> Self {
        Self { streams: streams.map(|sums| HostStream { sums, ..Default::default() }) }
    }

    /// Adds a sample to the batch of its stream.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.streams[usize::from(sample.w < 0.0)].batch.push(sample);
    }

    /// Sums of the camera stream (0) or the light stream (1); `None` before its first sample.
    pub fn stream(&self, stream: usize) -> Option<&Accumulator> {
        self.streams[stream].sums.as_ref().filter(|sums| !sums.is_cleared())
    }

    /// Discards batches and sums; their memory is kept.
    pub fn clear(&mut self) {
        for stream in &mut self.streams {
            stream.batch.clear();
            stream.sums.iter_mut().for_each(Accumulator::clear);
        }
    }

    /// Replaces the sums by ones read from a film of this specification, including its overscan.
    ///
    /// # Errors
    /// [`ClientError::Memory`].
    pub fn restore(&mut self, spec: &FilmSpec, data: &FilmData) -> Result<(), ClientError> {
        self.clear();
        let streams = [(&data.camera, &data.camera_variance), (&data.light, &data.light_variance)];
        for (stream, (color, variance)) in self.streams.iter_mut().zip(streams) {
            if !color.is_empty() {
                stream.sums = Some(Accumulator::restored(spec, color, variance)?);
            }
        }
        Ok(())
    }

    /// Rasterises the batches in order of arrival, and empties them.
    ///
    /// # Errors
    /// [`ClientError::Memory`]; the samples are lost, as on a device.
    pub fn raster(&mut self, state: &FilmState) -> Result<(), ClientError> {
        let outcome = self.streams.iter_mut().try_for_each(|stream| stream.raster(state));
        self.streams.iter_mut().for_each(|stream| stream.batch.clear());
        outcome
    }

    /// Copies of the sums, without the outermost `pad` texels on every side of the padded film.
    pub fn develop(&self, state: &FilmState, pad: u32) -> FilmData {
        let spec = state.spec();
        let [width, height] = spec.padded_extent().map(|n| n - 2 * pad);
        let color = |stream| self.stream(stream).map(|sums| sums.color_rows(pad)).unwrap_or_default();
        let variance = |stream| self.stream(stream).map(|sums| sums.variance_rows(pad)).unwrap_or_default();
        FilmData {
            width,
            height,
            camera: color(0),
            light: color(1),
            camera_variance: variance(0),
            light_variance: variance(1),
            luminance_scale: state.scale(),
            counts: state.counts(),
        }
    }
}

impl HostStream {
    fn raster(&mut self, state: &FilmState) -> Result<(), ClientError> {
        let spec = state.spec();
        if self.batch.is_empty() {
            return Ok(());
        }
        let p = VarianceParameters {
            filter: spec.filter,
            sums: spec.sums,
            form: spec.variance.unwrap_or_default(),
            inverse_scale: state.scale().recip(),
            samples_per_sum: CHUNK_SAMPLES.div_ceil(spec.batch_slots() as usize),
        };
        let sums = match &mut self.sums {
            Some(sums) => sums,
            empty => empty.insert(Accumulator::new(spec)?),
        };
        self.bins.fill(spec, self.batch.iter().filter_map(|sample| Sprite::place(spec, sample)));
        let split = self.merger.split(spec, &self.batch);
        let colors = match &split {
            Some([single, merged]) => {
                let sprites = single.iter().filter_map(|sample| Sprite::place(spec, sample));
                self.merged.fill(spec, sprites.chain(merged.iter().map(Sprite::merged)));
                &self.merged
            }
            None => &self.bins,
        };
        sums.add_batch(p, &self.bins, colors);
        Ok(())
    }
}
