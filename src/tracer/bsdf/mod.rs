//! Scattering at a surface point, at the wavelengths of one path.
//!
//! A [`Material`] says what a surface is made of, before the wavelengths of a path are known. A [`Bsdf`] is a material at one point and
//! at the wavelengths of one path. Both are enums that the table in `models.rs` makes from one file per model of scattering. Paths call them
//! through the trait of `scattering.rs`. [`microfacet`] and [`fresnel`] hold what several models share, and [`Sides`] says which
//! material a surface shows to which side. A [`Mixture`] is made of several of the others; it is several times as large, so that
//! scenes without one are traced by code that knows [`Unmixed`] models only.
//!
//! # Conventions
//!
//! Directions are unit vectors in the local shading space, z the front; `wo` points to where the path came from, `wi` to where it goes
//! on, both away from the surface. Values **include the cosine** of `wi`: [`ScatteringModel::eval`] is f·|cos θᵢ|, the weight of a sample
//! is f·|cos θᵢ| / pdf. Radiance is carried from light to eye, so that transmission scales by (nₒ/nᵢ)². Delta materials evaluate to
//! `None` and can only be sampled. A material that mixes a delta with another lobe evaluates only that lobe; its density
//! includes the probability of choosing the lobe. `None` from `sample` ends the path.
//!
//! # Adding a bsdf
//!
//! A bsdf is one file and one line in a table three times: its description, how that is read, and how it scatters light. For a model
//! called `Velvet`:
//!
//! 1. **Description**: `src/scene/desc/bsdf/velvet.rs` holds `VelvetDesc`, the parameters as plain data. Implement `BsdfPlugin` for it: the
//!    plugin's name, under `parts!` which parameters are an albedo, a factor, an index, `roughness` if a
//!    specular part is rough, and under `scalars` the textures that numbers are read from.
//!    [`material_class`](crate::tracer::effects::material_class) follows from these: a scene whose materials have an
//!    albedo alone is traced by code that knows [`Diffuse`] only, and one without a rough part by code that knows [`Smooth`] only.
//!    A diffuse model other than Lambert's says so by `OTHER_DIFFUSE` and is traced by code for all models. With that, colours
//!    and indices can be edited, and the plan of effects knows whether the scene needs wavelengths, dispersion, deltas and so on.
//!    Add the `mod` line and a line to the table in `src/scene/desc/bsdf/mod.rs`.
//! 2. **Reader**: `src/scene/mitsuba/bsdf/velvet.rs` reads the parameters. Add the `mod` line and a line to the table in `mod.rs`
//!    beside it, and what is special about the plugin to `tools/make/plugins/notes.rs`; `tools/plugins` writes its row in
//!    `scenes/README.md`.
//! 3. **Model**: `src/tracer/bsdf/velvet.rs` holds `VelvetMaterial`, made by `From<VelvetDesc>` (tables, integrals: whatever does not
//!    depend on the path; a type alias of the description if there is nothing to prepare), and `Velvet`, the material at the
//!    wavelengths of a path. Implement [`MaterialModel`] for the first and [`ScatteringModel`] for the second, whose flags
//!    (`is_delta`, `is_glossy`, `transmits` and so on) are false unless you say otherwise; one with deltas names them in `delta_lobes`, if it can. Add the `mod` line and a
//!    line to the table in `models.rs`: under `smooth` if the model has no rough part, else under `rough`.
//! 4. **Contract**: `sample` chooses directions with exactly the density that `eval` states, over all of its random numbers; its weight
//!    is `eval`'s value over that density. `eval` and `sample` agree on which lobe exists. Nothing but black, `None` or finite
//!    numbers leaves either. Where the model is reciprocal, f(wo, wi)/nᵢ² = f(wi, wo)/nₒ². No more light leaves than arrives.
//! 5. **Tests**: one entry in `tests/support/bsdfs.rs`. General tests read that list: sampling against density and value, reciprocity,
//!    energy and hard cases, random scenes with and without the plan of effects, white furnaces by several methods, and impossible
//!    parameters. Beside it a case in `tests/stability/bsdf/cases.rs`, which says how wide the lobes are; a scene,
//!    `scenes/plugins/bsdf_velvet.xml`, that agrees with Mitsuba (`pointillist regress run tests/mitsuba --case bsdf_velvet`), and its golden
//!    reference (`pointillist regress update tests/golden bsdf_velvet --reason …`). A test fails and says so where one of these is missing.
//!
//! [`Diffuse`] with `DiffuseDesc` is the shortest example, [`RoughPlastic`] one with a table made ahead. The smooth and the rough form
//! of one material stand in one file.

mod bump;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmitter;
pub mod fresnel;
mod lobe;
pub mod microfacet;
mod mixture;
mod models;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod recorded;
mod rough_diffuse;
mod scattering;
mod set;
mod share;
mod thin;
mod thin_film;
mod two_sided;
mod ward;

pub use bump::{BumpMaterial, Mirrors};
pub use coating::{Coating, CoatingMaterial};
pub use lobe::{Lobe, LobeOverDiffuse};
pub use microfacet::Microfacet;
pub use mixture::{MaterialPart, Mixture, MixtureMaterial, PartCoat};
pub use models::*;
pub use phong::PhongLobe;
pub use plastic::{Base, Coat, Transmittance, internal_reflectance};
pub use recorded::Recorded;
pub use scattering::{BsdfSample, DeltaLobes, MaterialEvalContext, MaterialModel, ScatteringModel};
pub use share::SurfaceShare;
pub use thin_film::ThinFilm;
pub use two_sided::Sides;
pub use ward::WardLobe;
