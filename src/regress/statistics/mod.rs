//! Statistics of two sets of renderings.
//!
//! | file | what |
//! |---|---|
//! | `areas.rs` | averages over areas of 8×8 pixels |
//! | `noise.rs` | the noise of a single picture, from the picture itself |
//! | `packing.rs` | values rounded to what their noise leaves meaningful, and areas as channels, so that references are small |
//! | `contrast.rs` | differences of averages in units of their standard errors, and what would have been noticed |
//! | `permutation.rs` | probabilities by exchanging renderings between both sets |
pub mod areas;
pub mod contrast;
pub mod noise;
pub mod packing;
pub mod permutation;
#[cfg(test)]
pub mod synthetic;
