//! Comparison of pictures: error figures, each with its map, and a statistical test of equality.
//!
//! | figure | of | says |
//! |---|---|---|
//! | [`rel_mse()`] | scene-linear RGB | squared error in units of the reference's luminance; what noise is measured by |
//! | [`smape()`] | scene-linear RGB | error in units of both; a firefly counts no more than any wrong pixel |
//! | [`flip()`] | displayed RGB | how much a person sees when the two alternate |
//! | [`delta_e()`] | displayed RGB | distance of colours, pixel by pixel |
//! | [`relative_standard_error`] | a [`Measured`] | how noisy one picture is, without a reference |
//! | [`z_test`] | two [`Measured`] | whether two pictures may have the same expectation |
//!
//! Scene-linear pictures are Rec.709. *Displayed* ones are linear sRGB in [0, 1] after a tone curve, which is the
//! caller's; a pixel that is not finite stays so there, and counts as wrong in every figure instead of being hidden:
//! each says how. Maps have the pictures' size, rows from the top. Pictures without pixels have errors of 0.

mod delta_e;
mod flip;
mod measured;
mod normal;
mod picture;
mod pixels;
mod rel_mse;
mod smape;
mod standard_error;
mod z;

pub use delta_e::{DeltaE, delta_e};
pub use flip::{Flip, PIXELS_PER_DEGREE, flip};
pub use measured::Measured;
pub use normal::critical_value;
pub use picture::Picture;
pub use pixels::{Worst, luminance, worst};
pub use rel_mse::{RelMse, rel_mse, rel_mse_map};
pub use smape::{Smape, smape};
pub use standard_error::{RelativeStandardError, relative_standard_error};
pub use z::{ZTest, z_map, z_test};
