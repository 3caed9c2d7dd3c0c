//! Glare of the observer's eye: light that cornea, lens and retina scatter beside its image (paper §4.2, step 5).
//!
//! The point-spread function is that of G. Spencer, P. Shirley, K. Zimmerman and D. P. Greenberg, "Physically-based
//! glare effects for digital images", SIGGRAPH 1995, §4.
//!
//! | file | what |
//! |---|---|
//! | [`point_spread`] | the published components f₀ … f₃, their mixtures, and the function that X, Y and Z see |
//! | [`kernel`] | the profile integrated over pixels, normalised; how much of it stays in the picture |
//! | [`fourier`] | lengths of transforms, order of their results, spectrum of a kernel |
//!
//! **In XYZ.** Each channel has a kernel of its own: f₃, the lenticular halo, has a radius proportional to wavelength,
//! and is summed over wavelength with x̄, ȳ or z̄ as weights. The light is taken as having an equal-energy spectrum,
//! since three numbers don't tell which it had: a white light gets the halo of its true colours, blue inside and red
//! outside; a coloured light gets that halo times its colour.
//!
//! **At the border.** What every pixel scatters is scaled so that all of it stays in the picture: energy is preserved
//! whatever the picture shows at its border, nothing wraps around to the other side, and no border darkens for want of
//! light from beyond it. Hence pixel `p` becomes `Σ_q K(p − q) · g(q) · I(q)` with `g(q) = 1 / Σ_p K(p − q)` over the
//! pixels `p` of the picture ([`kernel::GlareKernel::gain`]).

pub mod fourier;
pub mod kernel;
pub mod point_spread;

pub use fourier::{FourierAxis, spectrum};
pub use kernel::GlareKernel;
