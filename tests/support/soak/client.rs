//! The film on a Vulkan device, which is filled anew from retained samples when the device is lost, memory is exhausted or the size changes.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use pointillist::client::film::VulkanFilm;
use pointillist::client::retained::RetainedSamples;
use pointillist::client::{
    ClientError, DisplayImage, Film, FilmData, FilmSpec, Reconstruction, Settings, SplatFilter, VarianceForm,
};
use pointillist::color::Profile;
use pointillist::gpu::{DeviceCall, DeviceChoice, Gpu, GpuOptions};
use pointillist::image::png::{self, Transfer};
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

use super::SoakReport;

/// The size of pictures that are compared.
pub const COMPARED: [u32; 2] = [61, 47];

/// Samples that are retained: those of a picture that is compared fit.
const RETAINED: usize = 1 << 20;

/// The display's half.
pub struct SoakClient {
    validation: bool,
    gpu: Arc<Gpu>,
    film: VulkanFilm,
    pub retained: RetainedSamples,
    size: [u32; 2],
    /// Samples that the film should have.
    pub fed: u64,
    messages: usize,
}

fn spec([width, height]: [u32; 2]) -> FilmSpec {
    let (filter, variance) = (SplatFilter::Gaussian, Some(VarianceForm::Product));
    FilmSpec { width, height, filter, variance, sums: Default::default() }
}

fn open(validation: bool) -> Arc<Gpu> {
    let options = GpuOptions { validation, ..GpuOptions::default() };
    Gpu::with_options(&DeviceChoice::Best, options).expect("a Vulkan device; validation needs its layer")
}

impl SoakClient {
    pub fn new(validation: bool) -> Self {
        let gpu = open(validation);
        let film = VulkanFilm::new(gpu.clone(), spec(COMPARED)).expect("a film");
        let retained = RetainedSamples::with_room(RETAINED, 1 << 15);
        Self { validation, gpu, film, retained, size: COMPARED, fed: 0, messages: 0 }
    }

    /// A new epoch.
    pub fn clear(&mut self) {
        self.film.clear();
        self.retained.clear();
        self.fed = 0;
    }

    /// A new film of this size, to be fed anew.
    pub fn resize(&mut self, size: [u32; 2], report: &mut SoakReport) {
        self.size = size;
        self.renew(report);
    }

    /// A new film after an error; on a new device if the old one is lost.
    fn recover(&mut self, error: &ClientError, report: &mut SoakReport) {
        self.gpu.faults().fail_after(DeviceCall::Allocation, u64::MAX);
        if matches!(error, ClientError::Gpu(gpu) if gpu.is_device_lost()) {
            report.did("device replaced");
            self.messages += self.gpu.validation_messages().len();
            self.gpu = open(self.validation);
        } else {
            report.did("film made anew after an error");
        }
        self.renew(report);
    }

    fn renew(&mut self, report: &mut SoakReport) {
        for _ in 0..3 {
            match VulkanFilm::new(self.gpu.clone(), spec(self.size)) {
                Ok(film) => {
                    self.film = film;
                    self.retained.rewind();
                    self.fed = 0;
                    return;
                }
                Err(error) if matches!(&error, ClientError::Gpu(gpu) if gpu.is_device_lost()) => {
                    self.gpu = open(self.validation);
                }
                Err(error) => return report.fault(format!("no film of {:?}: {error}", self.size)),
            }
        }
        report.fault("no film on three devices".to_owned());
    }

    /// Gives the film what it lacks, as often as it takes.
    pub fn feed(&mut self, report: &mut SoakReport) {
        for _ in 0..50 {
            match self.try_feed() {
                Ok(()) => return,
                Err(error) => self.recover(&error, report),
            }
        }
        report.fault("the film cannot be fed".to_owned());
    }

    fn try_feed(&mut self) -> Result<(), ClientError> {
        while let Some(([samples, _], _, paths)) = self.retained.feed() {
            self.fed += samples.len() as u64;
            self.film.count_paths(paths);
            self.film.add(samples)?;
        }
        Ok(())
    }

    /// Gives the film samples that are not retained.
    pub fn add(&mut self, samples: &[Sample], paths: PathCounts, report: &mut SoakReport) {
        self.film.count_paths(paths);
        self.fed += samples.len() as u64;
        if let Err(error) = self.film.add(samples) {
            // They are lost with the film.
            self.recover(&error, report);
            self.feed(report);
        }
    }

    /// Samples that the film has counted.
    pub fn counted(&self) -> u64 {
        let counts = self.film.counts();
        counts.camera_samples + counts.light_samples
    }

    /// The picture, which must be there whatever happens.
    pub fn display(&mut self, dice: &mut Random, report: &mut SoakReport) -> Option<DisplayImage> {
        let reconstruction = [
            Reconstruction::Gaussian,
            Reconstruction::CatmullRom,
            Reconstruction::Mipmap,
            Reconstruction::None,
        ][dice.below(4)];
        let settings = Settings { reconstruction, vm: [0.0, 0.5, 1.0][dice.below(3)], ..Settings::default() };
        for _ in 0..20 {
            match self.film.display(&settings) {
                Ok(picture) => return Some(picture),
                Err(error) => self.recover(&error, report),
            }
            self.feed(report);
        }
        report.fault("no picture".to_owned());
        None
    }

    /// The sums.
    pub fn develop(&mut self, report: &mut SoakReport) -> FilmData {
        for _ in 0..20 {
            match self.film.develop() {
                Ok(data) => return data,
                Err(error) => self.recover(&error, report),
            }
            self.feed(report);
        }
        report.fault("no sums".to_owned());
        FilmData::default()
    }

    /// Something happens to the device, the disk or the client's time.
    pub fn suffer(&mut self, dice: &mut Random, full_disk: Option<&Path>, report: &mut SoakReport) {
        match dice.below(10) {
            0 => {
                report.did("device lost");
                self.gpu.lose_after(dice.below(6) as u64);
            }
            1 => {
                report.did("memory of the device exhausted");
                self.gpu.faults().fail_after(DeviceCall::Allocation, dice.below(30) as u64);
                self.display(dice, report);
                self.gpu.faults().fail_after(DeviceCall::Allocation, u64::MAX);
            }
            2 => {
                report.did("slow client");
                std::thread::sleep(Duration::from_millis(dice.below(150) as u64));
            }
            3 => {
                if let (Some(folder), Some(picture)) = (full_disk, self.display(dice, report)) {
                    report.did("saved to a full disk");
                    save(&folder.join("picture.png"), &picture, report);
                }
            }
            _ => {
                report.did("displayed");
                self.display(dice, report);
            }
        }
    }

    pub fn validation_messages(&self) -> usize {
        self.messages + self.gpu.validation_messages().len()
    }
}

/// Saving to a full disk is an error, and what stood there is as before.
fn save(path: &Path, picture: &DisplayImage, report: &mut SoakReport) {
    let profile = Profile::srgb();
    let DisplayImage { width, height, .. } = *picture;
    let shown = png::PngPicture {
        width,
        height,
        rgb: &picture.rgb,
        transfer: Transfer::Srgb,
        primaries: profile.primaries,
    };
    let before = std::fs::read(path).ok();
    if png::write(path, shown, &[]).is_ok() {
        report.fault(format!("a picture was written to a full disk: {}", path.display()));
    }
    if std::fs::read(path).ok() != before {
        report.fault("what stood on the full disk has changed".to_owned());
    }
}
