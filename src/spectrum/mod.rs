//! Spectra: what a path carries ([`SampledSpectrum`] at [`SampledWavelengths`]) and what a scene
//! holds ([`Spectrum`], [`dispersion::Ior`], named metals).

pub mod blackbody;
mod chroma;
pub mod dispersion;
pub mod emission_map;
pub mod metals;
mod sampled;
pub mod sigmoid;
#[allow(clippy::module_inception, reason = "the file is named after its type")]
mod spectrum;
pub mod table;
mod upsample;
mod wavelengths;
mod white;

pub use emission_map::EmissionMap;
pub use sampled::SampledSpectrum;
pub use spectrum::Spectrum;
pub use wavelengths::SampledWavelengths;
pub use white::White;

/// Wavelengths carried by one path: one hero and three companions (Wilkie et al. 2014).
pub const LANES: usize = 4;

/// Shortest wavelength simulated, in nm (as Mitsuba 3).
pub const LAMBDA_MIN: f32 = 360.0;

/// Longest wavelength simulated, in nm (as Mitsuba 3).
pub const LAMBDA_MAX: f32 = 830.0;
