//! The client: point samples become a picture (paper §4.2, §4.3).
//!
//! What a client does, in the paper's order:
//!
//! 1. [`Client::add`] copies samples into the batch, the camera and the light stream apart.
//! 2. A full batch, or [`Client::flush`], is rasterised: **splat** draws every sample as a filter-shaped
//!    sprite into a fresh image, **fold** adds the image to the two-float sums `[X, Y, Z, W]`.
//! 3. **variance** draws the same samples again: squared deviations of luminance from the mean.
//! 4. [`Client::display`] builds **mips** of both, and takes **LoD** = log₄(P/S) of each stream ([`lod`]).
//! 5. **reconstruct** raises LoD where the variance asks for it (strength `Vm`), reads both streams through
//!    a windowed Gaussian on two levels, normalises, and adds light stream · Lw.
//! 6. **tonemap**: Y' = 1 − exp(−(B·Y)^C), matrix P, desaturation at constant luminance, gamma G.
//!
//! [`Client::develop`] instead hands out the sums as they are, and [`develop::linear_rgb`] makes the
//! scene-linear picture of them. Values of [`Settings`] may change from one display to the next; what
//! [`FilmSpec`] holds may not.
//!
//! The Vulkan film is [`film`] with its passes in [`pass`]; every pass exists as plain Rust in [`mod@reference`]. What twins
//! must share stands in [`filter`], [`lod`] and [`state`].

pub mod develop;
pub mod dither;
pub mod effect_list;
pub mod effects;
pub mod error;
pub mod film;
pub mod filter;
pub mod glare;
pub mod kept;
pub mod later;
pub mod layout;
pub mod lod;
pub mod pacing;
pub mod pass;
pub mod reference;
pub mod settings;
pub mod state;
pub mod upload;
pub mod window;

pub use error::ClientError;
pub use settings::*;

use crate::client::film::VulkanFilm;
use crate::client::reference::ReferenceFilm;
use crate::stream::{PathCounts, Sample};

/// A film and the passes that fill and show it, on one device.
///
/// The closed set of back ends; the choice is made once, where the film is made.
#[expect(clippy::large_enum_variant, reason = "a program has one client, and it stays where it is")]
pub enum Client {
    /// The CPU twins.
    Reference(ReferenceFilm),
    /// A Vulkan device.
    Vulkan(VulkanFilm),
}

/// Calls the same method on whichever film it is.
macro_rules! each {
    ($client:expr, $film:ident => $call:expr) => {
        match $client {
            Client::Reference($film) => $call,
            Client::Vulkan($film) => $call,
        }
    };
}

impl Client {
    /// Copies samples into the batch; a full batch is rasterised at once.
    ///
    /// # Errors
    /// When an image cannot be made, or the device fails.
    pub fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        each!(self, film => film.add(samples))
    }

    /// Counts paths that were started, whether or not they gave samples.
    pub fn count_paths(&mut self, paths: PathCounts) {
        each!(self, film => film.count_paths(paths));
    }

    /// Rasterises what the batch holds.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn flush(&mut self) -> Result<(), ClientError> {
        each!(self, film => film.flush())
    }

    /// Forgets everything: a new epoch.
    ///
    /// # Errors
    /// When the device fails.
    pub fn clear(&mut self) -> Result<(), ClientError> {
        each!(self, film => film.clear())
    }

    /// What was received since the last [`clear`](Self::clear).
    pub fn counts(&self) -> FilmCounts {
        each!(self, film => film.counts())
    }

    /// The picture as a viewer shows it.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        each!(self, film => film.display(settings))
    }

    /// The sums, cropped to the picture.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn develop(&mut self) -> Result<FilmData, ClientError> {
        each!(self, film => film.develop())
    }
}
