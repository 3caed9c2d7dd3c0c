//! The client: point samples become a picture (paper §4.2, §4.3).

pub mod settings;

pub use settings::*;
