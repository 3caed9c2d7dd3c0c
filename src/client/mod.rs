//! The client: point samples become a picture (paper §4.2, §4.3).
//!
//! # From a sample in a lane to the screen
//!
//! This module knows neither lanes nor the server: `render` and `viewer` drain the lanes and pass the samples on.
//!
//! 1. They give blocks of samples to [`Film::add`]. A film on a device copies them into chunks, which a thread of its own sorts and puts
//!    into vertex buffers, the camera's and the light's samples apart ([`upload`], [`sorting`]).
//! 2. A full batch, or [`Film::flush`], is rasterised: **splat** draws every sample as a filter-shaped sprite into the batch
//!    image, **fold** adds that image to the two-float sums `[X, Y, Z, W]`.
//! 3. **variance** draws the same samples again: squared deviations of luminance from the mean.
//! 4. A repaint builds **mips** of both, and takes the level of detail log₄(P/S) of each stream ([`lod`]). The light stream's sums are
//!    **filtered adaptively** instead: where samples are few their light is spread further ([`reference::adaptive_filter`]).
//! 5. **reconstruct** raises the level of detail where the variance asks for it (strength `Vm`), reads both streams through
//!    a windowed Gaussian on two levels, normalises, and adds light stream · Lw.
//! 6. **glare**, if it is on, convolves the picture with the eye's point-spread function.
//! 7. The **post-processes** that are asked for change it, XYZ to XYZ ([`post_process`]).
//! 8. **tonemap**: Y' = 1 − exp(−(B·Y)^C), matrix P, desaturation at constant luminance, gamma G, dither.
//! 9. [`Film::display`] reads the encoded picture back; a window instead calls [`film::VulkanFilm::paint`] and copies the
//!    encoded image into the acquired image of its [`Swapchain`](crate::gpu::Swapchain). [`Film::develop`] hands out the
//!    sums as they are, and [`develop::linear_rgb`] makes the scene-linear picture of them.
//!
//! # Ownership
//!
//! A film owns its batch, its sums and everything derived from them: [`film::VulkanFilm`] on a device, [`reference::ReferenceFilm`] on the
//! CPU. The program owns the film: in the window, `viewer/screen.rs` holds it beside the swapchain, and `viewer/picture.rs` holds the
//! [`retained`] samples, from which it fills a film of another size, or full-resolution sums after the coarse ones of a moving picture
//! ([`film`]). Values of [`Settings`] may change from one repaint to the next; another [`FilmSpec`] needs another film.
//!
//! # Where to look
//!
//! | module | what |
//! |---|---|
//! | [`cascades`] | fireflies reweighted, where that is asked for |
//! | [`wavelet`], [`oidn`] | the noise filters of what is displayed: our own, and Open Image Denoise where it is installed |
//! | [`film`], [`sample_sums`], [`upload`], [`sorting`], [`raster`], [`pass`] | the Vulkan film, its sums, its batches and its passes; [`pass`] says how to add one, [`pass::images`] counts bytes per pixel, [`memory`] adds them up, [`traffic`] those that passes move |
//! | [`mod@reference`] | the same in plain Rust: the definition of every pass |
//! | [`post_process`] | passes from picture to picture, each with its reference, its parameters and its options |
//! | [`filter`], [`dense_cells`], [`lod`], [`state`], [`dither`], [`glare`] | what a film and its reference share |
//! | [`settings`], [`compiled_effects`], [`effect_list`] | what the user sets, what is compiled in for it, and the list that people read |
//! | [`stereo`] | the display pictures of both eyes as one |
//! | [`zones`] | luminance in false colours, marks of what is clipped |
//! | [`layout`] | push constants, member by member as in the shaders |
//! | [`pacing`] | how the time of a frame is split between samples and repaints |
//! | [`retained`], [`background`], [`light_meter`] | samples that outlive a film; tables that are made on another thread; the light of the first samples |
//! | [`window`] | input, camera navigation and the panel |

pub mod background;
pub mod cascades;
pub mod compiled_effects;
pub mod dense_cells;
pub mod develop;
pub mod dither;
pub mod effect_list;
pub mod error;
pub mod film;
pub mod filter;
pub mod glare;
pub mod layout;
pub mod light_meter;
pub mod lod;
pub mod memory;
pub mod oidn;
pub mod pacing;
pub mod pass;
pub mod post_process;
pub mod raster;
pub mod readback;
pub mod reference;
pub mod retained;
pub mod sample_sums;
pub mod settings;
pub mod sorting;
pub mod state;
pub mod stereo;
pub mod traffic;
pub mod upload;
pub mod wavelet;
pub mod window;
pub mod zones;

pub use error::ClientError;
pub use readback::Readback;
pub use settings::*;

use std::any::Any;

use crate::stream::{PathCounts, Sample};

/// A film and the passes that fill and show it. Its errors are those of [`ClientError`]: an image cannot be made, the settings
/// need what the film does not keep, or the device fails.
pub trait Film {
    /// Copies samples to the batch; a full batch is rasterised at once or, on a device, with a later call, without waiting for it.
    ///
    /// Samples that [`accepts`](filter::accepts) refuses are dropped; the stream should not carry them.
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError>;

    /// Counts paths that were started, whether or not they gave samples.
    fn count_paths(&mut self, paths: PathCounts);

    /// Rasterises all samples: splat, fold, variance. Waits until they are sorted into vertex buffers, but not for their drawing.
    fn flush(&mut self) -> Result<(), ClientError>;

    /// Forgets everything: a new epoch.
    fn clear(&mut self);

    /// Whether [`display`](Self::display) and [`develop`](Self::develop) leave a batch that is not full where it is, so that the sums
    /// stay those of whole batches; it is then not in the picture. A film whose sums do not depend on batches ignores it.
    fn keep_batch(&mut self, _keep: bool) {}

    /// The numbers of samples and paths received since the last [`clear`](Self::clear).
    fn counts(&self) -> FilmCounts;

    /// The picture as a viewer shows it; rasterises the batch first and waits for the GPU.
    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError>;

    /// The sums, cropped to the picture; rasterises the batch first and waits for the GPU.
    fn develop(&mut self) -> Result<FilmData, ClientError>;

    /// As [`display`](Self::display), without waiting for the GPU.
    fn begin_display(&mut self, settings: &Settings) -> Result<Readback<DisplayImage>, ClientError> {
        self.display(settings).map(Readback::ready)
    }

    /// As [`develop`](Self::develop), without waiting for the GPU.
    fn begin_develop(&mut self) -> Result<Readback<FilmData>, ClientError> {
        self.develop().map(Readback::ready)
    }

    /// Share of the light that the last picture lacks because fireflies were reweighted; `None` where they are not.
    fn withheld(&self) -> Option<f64> {
        None
    }

    /// This film as its own type, if it can do more than this trait says: `of` of [`VulkanFilm`](film::VulkanFilm::of) and of
    /// [`ExactFilm`](reference::ExactFilm::of) ask for theirs.
    fn as_any(&mut self) -> Option<&mut dyn Any> {
        None
    }
}
