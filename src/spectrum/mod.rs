//! Spectra: the values that a path carries ([`SampledSpectrum`] at [`SampledWavelengths`]) and the functions of wavelength
//! that a scene holds ([`Spectrum`], [`EmissionMap`], [`dispersion::Ior`], named metals).
//!
//! [`daylight`] evaluates the radiance of a clear sky and of the sun, [`blackbody`] that of what glows.
//!
//! A path has one hero wavelength and three companions. `upsample` turns RGB into smooth spectra; `white` serves scenes
//! without colour, whose paths all carry the spectrum of one white.

pub mod blackbody;
pub mod daylight;
pub mod dispersion;
pub mod emission_map;
pub mod metals;
mod reflectance_table;
mod sampled;
#[allow(clippy::module_inception, reason = "the file is named after its type")]
mod spectrum;
mod table;
mod upsample;
mod wavelengths;
mod white;

pub use emission_map::EmissionMap;
pub use sampled::SampledSpectrum;
pub(crate) use spectrum::BRIGHTEST;
pub use spectrum::Spectrum;
pub use table::Table;
pub use upsample::Sigmoid;
pub use wavelengths::SampledWavelengths;
pub use white::White;

/// Shortest wavelength simulated, in nm (as Mitsuba 3).
pub const LAMBDA_MIN: f32 = 360.0;

/// Longest wavelength simulated, in nm (as Mitsuba 3).
pub const LAMBDA_MAX: f32 = 830.0;
