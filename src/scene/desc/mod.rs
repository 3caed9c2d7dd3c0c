//! The scene as plain data: what the file says after names, units and defaults are resolved.
//!
//! A description holds everything that the tracer needs and nothing that it computes. It knows of no file format: `mitsuba` and `model`
//! read into it, `edit` changes it, and nothing here imports any of them. Spectra are resolved here because only a reader
//! knows whether a colour is a reflectance or an emission.
//!
//! | file | content |
//! |---|---|
//! | `scene.rs` | [`SceneDesc`] |
//! | `ids.rs` | indices into its lists, names and places of its objects |
//! | `camera.rs` | camera and film |
//! | `stereo.rs`, `stereo_comfort.rs` | two eyes in the place of a camera; the depths that are comfortable to look at |
//! | `integrator.rs`, `integrator_kind.rs` | light transport of a scene, layers by `aov.rs`; what each method can do |
//! | `shape.rs`, `mesh.rs` | shapes, groups and curves; triangle meshes |
//! | `bsdf/` | materials, a file for each plugin or for its smooth and rough form |
//! | `light.rs` | lights that are not shapes |
//! | `medium.rs`, `phase.rs` | participating media, on which side of a shape they are, and how they scatter |
//! | `texture.rs`, `volume.rs`, `wrap.rs` | what varies over a surface or over space |
//! | `emission_texture.rs` | emission that varies |
//! | `rendering_space.rs`, `moved.rs` | the space that a scene is traced in, and the scene moved to it |
//!
//! How to add a bsdf is described in `bsdf/mod.rs`. A new light is a variant of [`LightDesc`], a function that reads it with its line in
//! the table of `mitsuba/emitter.rs`, and its half in the tracer. A new texture is a variant of
//! [`SpectrumTexture`](texture::SpectrumTexture), and a function that reads it with its line in the table of `mitsuba/texture.rs`.

pub mod aov;
mod bsdf;
mod camera;
pub mod emission_texture;
mod ids;
mod integrator;
mod integrator_kind;
mod light;
mod medium;
mod mesh;
mod moved;
mod phase;
mod rendering_space;
mod scene;
mod shape;
mod stereo;
mod stereo_comfort;
pub mod texture;
pub mod volume;
mod wrap;

pub use aov::{AovDesc, AovKind};
pub use bsdf::*;
pub use camera::{CameraDesc, Crop, FilmDesc, FovAxis, ReconstructionFilter};
pub use ids::{BsdfId, GroupId, MediumId, MeshId, Name, Names, Place};
pub use integrator::{IntegratorDesc, PhotonDesc};
pub use integrator_kind::{IntegratorKind, IntegratorTraits, LateFind, NoLight, PhotonUse};
pub use light::{LightDesc, ProjectorDesc, SpotDesc, SpotTextureDesc, SunSkyDesc};
pub use medium::{EmissionGrid, MediumDesc, MediumEmission, MediumInterface, single_scattering_albedo};
pub use mesh::{Mesh, MeshAttribute};
pub use phase::{MicroflakeDesc, MicroflakeGrid, PhaseDesc};
pub use rendering_space::RenderingSpace;
pub use scene::SceneDesc;
pub use shape::{CurveBasis, Curves, GroupDesc, ShapeDesc, ShapeKind};
pub use stereo::{ConvergenceChoice, Disparity, StereoConvergence, StereoRig, StereoRigError};
pub use stereo_comfort::{ComfortableDepth, StereoScreen};
