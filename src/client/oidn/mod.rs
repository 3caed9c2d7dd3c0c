//! Noise filter for the display: Intel's Open Image Denoise, where its library is installed.
//!
//! OIDN is a neural network for RGB pictures with albedo and normals. It is not part of this program: [`library`] searches for it when
//! requested, and nothing depends on it. Its input is the mean of both halves before the film's filter, because it expects noise that is
//! independent between pixels; pixels without samples are filled from nearby ([`input`]). Features are first filtered by networks of their
//! own, each alone, so that this one may treat them as noise-free.
//!
//! Its result has no error estimate, and does not converge to the picture without noise.

mod holes;
mod library;

use std::rc::Rc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

pub use self::holes::OidnFeatures;
use self::library::{FilterParameters, RtFilter};
pub use self::library::{NAMES, OidnDevice, OidnError, OidnLibrary, OidnVersion, VARIABLE, library};
use crate::client::wavelet::{Filtered, HalfPicture, PixelFeatures};
use crate::color::Profile;
use crate::image::Grid;

/// Installation hint.
pub const HOW_TO_GET: &str = "it comes with `pip install pyoidn`: set OIDN_LIBRARY to …/site-packages/pyoidn/oidn/lib/libOpenImageDenoise.so.2; \
    or unpack a release from openimagedenoise.org and set OIDN_LIBRARY to its lib/libOpenImageDenoise.so.2. Debian has no package (12 and 13)";

/// Trade-off between time and quality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OidnQuality {
    /// The best network.
    High,
    /// The smaller network of versions since 2.2, in about half the time. Features are filtered from the second picture on, so that the
    /// first one comes sooner.
    Balanced,
}

impl OidnQuality {
    /// The value of the parameter, if this version has it.
    fn parameter(self, version: OidnVersion) -> Option<i32> {
        let value = match self {
            OidnQuality::High => 6,
            OidnQuality::Balanced => 5,
        };
        (version >= OidnVersion(2_02_00)).then_some(value)
    }
}

/// Filter for pictures of one size with the same features; device and network are reused between pictures.
pub struct OidnFilter {
    size: [usize; 2],
    device: Rc<OidnDevice>,
    quality: Option<i32>,
    picture: RtFilter,
    features: FeatureState,
}

/// Whether the features are still unfiltered.
#[derive(PartialEq)]
enum FeatureState {
    /// Unfiltered, and to be filtered after the next picture.
    New,
    /// Unfiltered, and to be filtered before the next picture.
    Used,
    Filtered,
}

/// Indices of the images of [`OidnFilter::picture`].
const COLOR: usize = 0;
const ALBEDO: usize = 1;
const NORMAL: usize = 2;

impl OidnFilter {
    /// A filter for pictures of `size` pixels with the features of both halves, on `threads` threads.
    ///
    /// # Errors
    ///
    /// When there is no library, or memory runs out.
    pub fn new(
        size: [usize; 2],
        features: [&Grid<PixelFeatures>; 2],
        threads: usize,
        quality: OidnQuality,
    ) -> Result<Self, OidnError> {
        let device = OidnDevice::open(threads)?;
        let parameter = quality.parameter(device.version());
        let parameters = FilterParameters {
            images: &[c"color", c"albedo", c"normal"],
            flags: &[c"hdr", c"cleanAux"],
            quality: parameter,
        };
        let mut picture = RtFilter::new(&device, size, &parameters)?;
        let mut set = |image, of: fn(&PixelFeatures) -> Vec3| {
            let pairs = features[0].pixels().iter().zip(features[1].pixels());
            picture.image(image).iter_mut().zip(pairs).for_each(|(pixel, (a, b))| {
                *pixel = (0.5 * (of(a) + of(b))).to_array();
            });
        };
        set(ALBEDO, |features| features.albedo.clamp(Vec3::ZERO, Vec3::ONE));
        set(NORMAL, |features| features.normal);
        let features = if quality == OidnQuality::High { FeatureState::Used } else { FeatureState::New };
        Ok(Self { size, device, quality: parameter, picture, features })
    }

    /// Filters the features, each alone, when due.
    fn prefilter(&mut self) -> Result<(), OidnError> {
        if self.features == FeatureState::Used {
            for (image, name) in [(ALBEDO, c"albedo"), (NORMAL, c"normal")] {
                let parameters = FilterParameters { images: &[name], flags: &[], quality: self.quality };
                let mut filter = RtFilter::new(&self.device, self.size, &parameters)?;
                filter.image(0).copy_from_slice(self.picture.image(image));
                filter.execute()?;
                self.picture.image(image).copy_from_slice(filter.image(0));
            }
            self.features = FeatureState::Filtered;
        }
        if self.features == FeatureState::New {
            self.features = FeatureState::Used;
        }
        Ok(())
    }

    /// Filters a picture of this size.
    ///
    /// # Errors
    ///
    /// When the library fails or memory runs out.
    pub fn filtered(&mut self, halves: [&HalfPicture; 2]) -> Result<Filtered, OidnError> {
        let [width, height] = self.size;
        self.prefilter()?;
        let features = [ALBEDO, NORMAL].map(|image| self.picture.pixels(image));
        let input = input(halves, features).ok_or(OidnError::Memory)?;
        let color = self.picture.image(COLOR);
        color.par_iter_mut().zip(input.pixels()).for_each(|(color, rgb)| *color = rgb.to_array());
        self.picture.execute()?;
        let to_xyz = Profile::srgb().from_xyz.inverse();
        let mut picture = Grid::try_filled(width, height, Vec3::ZERO).ok_or(OidnError::Memory)?;
        let color = self.picture.pixels(COLOR);
        picture
            .pixels_mut()
            .par_iter_mut()
            .zip(color)
            .for_each(|(xyz, rgb)| *xyz = to_xyz * Vec3::from(*rgb));
        let finest = Grid::try_filled(width, height, 0.0).ok_or(OidnError::Memory)?;
        Ok(Filtered { picture, finest })
    }
}

/// Input of the network, linear Rec.709 without negative values: the mean of all samples of both halves (XYZ); pixels without samples are
/// filled from a nearby one with the same features. `None` if memory runs out.
pub fn input(halves: [&HalfPicture; 2], features: OidnFeatures<'_>) -> Option<Grid<Vec3>> {
    let from_xyz = Profile::srgb().from_xyz;
    let mut sums = Grid::try_filled(halves[0].width(), halves[0].height(), Vec4::ZERO)?;
    let [a, b] = halves.map(Grid::pixels);
    sums.pixels_mut().par_iter_mut().zip(a.par_iter().zip(b)).for_each(|(sum, (a, b))| {
        for half in [a, b].into_iter().filter(|half| half.is_finite() && half.w > 0.0) {
            *sum += (half.truncate() * half.w).extend(half.w);
        }
    });
    let mut picture = holes::fill(&sums, features)?;
    picture.pixels_mut().par_iter_mut().for_each(|pixel| *pixel = (from_xyz * *pixel).max(Vec3::ZERO));
    Some(picture)
}
