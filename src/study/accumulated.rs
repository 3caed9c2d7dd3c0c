//! The sums over the samples of a render, which the stated error, the noise filter and the predictions read.

use std::sync::Arc;

use crate::stream::{PathCounts, Sample};
use crate::study::apart::SamplesApart;
use crate::study::blur::{BlurSchedule, BlurredSamples};
use crate::study::exact_replicates::ExactReplicates;
use crate::study::replicates::Replicates;

/// The sums of all samples of a render so far. A clone is a snapshot: it shares the sums until more samples are added to the original, which
/// copies them first if the snapshot is still there.
#[derive(Clone, Debug)]
pub struct AccumulatedSamples {
    /// Stays empty if the render keeps exact sums.
    sums: Arc<Replicates>,
    exact: Option<Arc<ExactReplicates>>,
    /// Samples held out of each replicate, if any.
    apart: Option<Arc<SamplesApart>>,
    /// Schedule of the photon radius, and how much the samples are blurred by it.
    blurred: Option<(BlurSchedule, BlurredSamples)>,
}

impl AccumulatedSamples {
    /// Empty sums of a picture of `size` pixels, whose film's filter has this [energy](Replicates::new).
    pub fn new(size: [u32; 2], energy: f32) -> Self {
        Self { sums: Arc::new(Replicates::new(size, energy)), exact: None, apart: None, blurred: None }
    }

    /// As `self`, continuing with these exact sums.
    pub fn exact(self, sums: ExactReplicates) -> Self {
        Self { exact: Some(Arc::new(sums)), ..self }
    }

    /// From now on weights of camera samples are the inverse of their density on the screen.
    pub fn set_density_weights(&mut self) {
        Arc::make_mut(&mut self.sums).set_density_weights();
    }

    /// As `self`, for a method whose photon radius follows this schedule.
    pub fn with_blur(self, schedule: BlurSchedule) -> Self {
        Self { blurred: Some((schedule, BlurredSamples::default())), ..self }
    }

    /// Begins to hold out some of the samples of each replicate: all of those so far, or half of those to come if there are none.
    pub fn hold_out(&mut self) {
        self.apart = Some(Arc::new(match self.paths() {
            0 => SamplesApart::half_to_come(&self.sums),
            _ => SamplesApart::so_far(&self.replicates()),
        }));
    }

    /// Adds a block; see [`Replicates::add`].
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        if let Some((schedule, blurred)) = &mut self.blurred {
            blurred.add(schedule, first_index, paths);
        }
        if let Some(apart) = &mut self.apart {
            Arc::make_mut(apart).add(first_index, paths, samples);
        }
        match &mut self.exact {
            Some(exact) => Arc::make_mut(exact).add(first_index, paths, samples),
            None => Arc::make_mut(&mut self.sums).add(first_index, paths, samples),
        }
    }

    /// Whether a snapshot shares the sums, so that [`add`](Self::add) would have to copy them.
    pub fn is_shared(&self) -> bool {
        let of_exact = self.exact.as_ref().is_some_and(|exact| Arc::strong_count(exact) > 1);
        Arc::strong_count(&self.sums) > 1 || of_exact
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.sums.size()
    }

    /// Number of paths so far.
    pub fn paths(&self) -> u64 {
        self.exact.as_ref().map_or_else(|| self.sums.paths(), |exact| exact.paths())
    }

    /// The sums of the replicates; exact ones are rounded.
    pub fn replicates(&self) -> Arc<Replicates> {
        let rounded = |exact: &Arc<ExactReplicates>| Arc::new(exact.rounded().weighted_as(&self.sums));
        self.exact.as_ref().map_or_else(|| self.sums.clone(), rounded)
    }

    /// The exact sums, if the render keeps them.
    pub fn exact_sums(&self) -> Option<&ExactReplicates> {
        self.exact.as_deref()
    }

    /// The samples held out, if any.
    pub fn apart(&self) -> Option<&SamplesApart> {
        self.apart.as_deref()
    }

    /// How much the samples are blurred by the photon radius; nothing without a schedule.
    pub(super) fn blurred(&self) -> BlurredSamples {
        self.blurred.map_or_else(BlurredSamples::default, |(_, blurred)| blurred)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Xyz;

    /// Samples that both eyes share count by their weights in a state, too, whose sums are exact.
    #[test]
    fn exact_sums_know_what_weights_mean() {
        let samples = [0.25, 0.5].map(|w| Sample { uv: [0.5; 2], xyz: Xyz::new(w, w, w), w });
        let plain = AccumulatedSamples::new([4, 4], 1.0);
        let exact = plain.clone().exact(ExactReplicates::new([4, 4], 1.0, 1.0));
        let per_pixel = |mut accumulated: AccumulatedSamples, is_density: bool| {
            if is_density {
                accumulated.set_density_weights();
            }
            accumulated.add(0, PathCounts { camera: 2, light: 0 }, &samples);
            accumulated.replicates().per_pixel()
        };
        for (is_density, count) in [(true, 0.75), (false, 2.0)] {
            for accumulated in [&plain, &exact] {
                assert_eq!(per_pixel(accumulated.clone(), is_density), count / 16.0);
            }
        }
    }
}
