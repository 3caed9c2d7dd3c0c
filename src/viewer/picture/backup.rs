//! A copy of the film's sums in main memory, which survives the loss of the device.

use std::time::{Duration, Instant};

use crate::client::film::VulkanFilm;
use crate::client::{ClientError, Film, FilmData};
use crate::job::Job;

/// Shortest interval between two copies; one takes a tenth of a second of bus time at 4K.
const INTERVAL: Duration = Duration::from_secs(10);

/// A copy is made once the number of samples has grown by this factor since the last.
const GROWTH: f64 = 1.25;

/// The last copy of an epoch's sums, and the copy in progress.
#[derive(Default)]
pub struct SumsBackup {
    data: Option<FilmData>,
    pending: Option<Job<Result<FilmData, ClientError>>>,
    begun: Option<Instant>,
    /// Samples in the copy begun last.
    samples: u64,
}

impl SumsBackup {
    /// Discards all copies for another epoch or film.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Begins another copy when it is due and the film has more samples than are `kept`; takes over a finished one. A failed copy is
    /// skipped, since the next may succeed.
    ///
    /// # Errors
    ///
    /// Those of rasterising the batch.
    pub fn update(&mut self, film: &mut VulkanFilm, kept: usize, now: Instant) -> Result<(), ClientError> {
        self.arrive();
        let samples = film.counts().samples();
        let is_due = self.begun.is_none_or(|begun| now - begun >= INTERVAL)
            && samples as f64 >= GROWTH * self.samples.max(kept as u64) as f64;
        if film.is_summed_on_host() || film.is_coarse() || self.pending.is_some() || !is_due {
            return Ok(());
        }
        let copy = film.begin_backup()?;
        // If no thread can be started, there is no copy.
        self.pending = Job::start("a copy of the sums", move |_| copy.wait()).ok();
        (self.begun, self.samples) = (Some(now), samples);
        Ok(())
    }

    /// Takes over a finished copy.
    fn arrive(&mut self) {
        if let Some(copy) = Job::take(&mut self.pending) {
            let copy = copy.inspect_err(|panic| tracing::error!("{panic}"));
            self.data = copy.ok().and_then(Result::ok).or(self.data.take());
        }
    }

    /// The last copy, if it has more samples than are `kept`.
    pub fn take(&mut self, kept: usize) -> Option<FilmData> {
        self.arrive();
        let data = self.data.take();
        self.clear();
        data.filter(|data| data.counts.samples() > kept as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::FilmSpec;
    use crate::color::Xyz;
    use crate::gpu::{DeviceChoice, Gpu};
    use crate::stream::Sample;

    /// Copies are made when due and contain all samples until then; a copy with no more samples than are retained is not used.
    #[test]
    fn copies_follow_the_film() {
        let gpu = Gpu::new(&DeviceChoice::Best).expect("a driver (Debian: mesa-vulkan-drivers)");
        let spec = FilmSpec {
            width: 64,
            height: 48,
            filter: Default::default(),
            variance: Some(Default::default()),
            sums: Default::default(),
        };
        let mut film = VulkanFilm::new(gpu, spec).expect("a film");
        let (mut backup, start) = (SumsBackup::default(), Instant::now());
        let sample = Sample { uv: [0.4, 0.6], xyz: Xyz::new(1.0, 1.0, 1.0), w: 1.0 };
        let mut step = |backup: &mut SumsBackup, samples: usize, seconds: u64| {
            film.add(&vec![sample; samples]).expect("add");
            while backup.pending.as_ref().is_some_and(|job| !job.is_finished()) {
                std::thread::yield_now();
            }
            backup.update(&mut film, 100, start + Duration::from_secs(seconds)).expect("the device");
        };
        step(&mut backup, 110, 0);
        assert!(backup.pending.is_none(), "hardly more than what is kept");
        step(&mut backup, 90, 1);
        assert!(backup.pending.is_some());
        step(&mut backup, 100, 5);
        assert!(backup.pending.is_none(), "too early for another");
        assert_eq!(backup.data.as_ref().map(|data| data.counts.camera_samples), Some(200));
        step(&mut backup, 0, 12);
        step(&mut backup, 0, 13);
        let copy = backup.take(100).expect("a copy");
        assert_eq!(copy.counts.camera_samples, 300);
        let sum: f32 = copy.camera.iter().map(|texel| texel[3]).sum();
        assert!((sum - 300.0).abs() < 1e-2, "{sum}");
        assert!(backup.take(100).is_none());
        step(&mut backup, 0, 14);
        step(&mut backup, 0, 15);
        assert!(backup.take(300).is_none(), "all of them are kept");
    }
}
