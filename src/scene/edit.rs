//! Changes made to a scene after it was read: what can be changed of an object, applying it, saving it.

use crate::scene::desc::{BsdfId, CameraDesc};

/// One value of the scene, by place in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// Factor on the emission of a shape (index into `shapes`).
    Emission(u32),
    /// Factor on a light that is not a shape (index into `lights`).
    Light(u32),
    /// Reflectance of a diffuse material, linear Rec.709.
    Reflectance(BsdfId),
    /// Interior index of refraction of a dielectric.
    IntIor(BsdfId),
}

/// A new value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NewValue {
    /// A factor on what the file says, ≥ 0.
    Scale(f64),
    /// Linear Rec.709.
    Rgb([f64; 3]),
    /// A number.
    Number(f64),
}

/// All changes against the file; at most one per target.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    /// The camera, if it was moved.
    pub camera: Option<CameraDesc>,
    /// Values in the order in which they were first changed.
    pub values: Vec<(Target, NewValue)>,
}
