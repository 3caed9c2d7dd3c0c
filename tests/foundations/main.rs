//! The modules `color`, `spectrum` and `image`: profiles, tables, upsampling, files, comparison.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod icc;
mod image_compare;
mod image_files;
mod spectrum_mitsuba;
mod spectrum_rgb;
mod spectrum_sampling;
