//! The noise filter of a displayed picture (`--denoise`): wavelets of our own, or Open Image Denoise.
//!
//! | file | what |
//! |---|---|
//! | `view_filter.rs` | the filter of one view: traces its feature buffers and filters both randomisations with them |
//! | `filtered_picture.rs` | from the samples of both randomisations to a picture without noise, and the error of that |
//! | `noise_filter.rs` | the thread of the window that does both while the tracer goes on |
//! | `reprojection.rs` | the last picture as it looks from another camera |
//! | `steering.rs` | where the first samples of another camera are traced |
//!
//! The kernels of the wavelets and the binding of the library are in `client/wavelet` and `client/oidn`.

pub mod filtered_picture;
pub mod noise_filter;
pub mod reprojection;
pub mod steering;
pub mod view_filter;
