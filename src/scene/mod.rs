//! What is in a scene file, as plain data with ids.

pub mod desc;

pub use desc::SceneDesc;
