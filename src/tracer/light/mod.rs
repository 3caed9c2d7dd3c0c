//! Everything that emits, and how one of many lights is sampled.
//!
//! ```text
//! source      what every sort of light can do (LightSource); sample, emission and bounds are what it answers with
//! shapes      the table of the sorts of lights
//! flat sphere cylinder textured                        the sorts of lights: surfaces,
//! point spot projector                                 points,
//! directional environment sun_sky                      what is infinitely far away
//! lights      all lights of a scene: sampling one from a lit point, and the density of a direction; rays that leave lights, and
//!             their densities: how light subpaths begin
//! subtended rectangle spherical_triangle               points on flat lights that are close by
//! points      the lights that are points, among which paths in a medium choose
//! casters     what light subpaths are aimed at
//! selector    which light a point samples: one, few that are all looked at, or a tree of them
//! tree        the tree of many lights
//! ```
//!
//! Conventions: `wi` points from the lit point to the light, unit length, world space. A density is per
//! steradian at the lit point and includes the probability of choosing the light; sample and pdf are pairs:
//! [`Lights::pdf`] returns for a direction exactly what [`Lights::sample`] would have reported for it, and 0
//! where it would never have chosen it. Where each light is sampled ([`LightSampleContext::glossy`]) the probability of
//! choosing a light is 1. A delta light has the probability of its choice as density and
//! [`LightSample::delta`] set. Of an environment next-event estimation looks for a part only ([`LightSource::sought_share`]): its density is 0
//! where scattering alone finds the light. `None` means that sampling failed: no light from there.
//!
//! # Adding a light
//!
//! 1. A file here with a struct that implements [`LightSource`]: `point.rs` is the shortest, `sphere.rs` one that paths can
//!    hit, `environment.rs` has those around the scene.
//! 2. One line in the table of [`LightShape`], in `shapes.rs`. Next-event estimation, light subpaths, the choice among lights and the
//!    densities of hits then work by themselves.
//! 3. What makes one: a variant of `LightDesc` with its arms in `scene/desc/light.rs` and `scene/desc/moved.rs`; a reader and a line of
//!    `PLUGINS` in `scene/mitsuba/emitter.rs`; and an arm of `Geometry::add_light` in `tracer/prepare/lights.rs`. A shape that emits needs
//!    none of them: it is registered with its primitives in `tracer/prepare/geometry.rs`. Its position, direction and colour can be edited
//!    by lines in `scene/edit/parameters.rs`.
//! 4. Tests: `tests/tracer/lights.rs` compares the irradiance with its exact value, and samples with densities; `scenes/plugins/emitter_NAME.xml`
//!    agrees with Mitsuba (`tests/mitsuba`) and has a golden reference (`pointillist regress update tests/golden
//!    emitter_NAME`), and `tools/plugins` documents it.

mod bounds;
mod casters;
mod cylinder;
mod directional;
mod emission;
mod environment;
mod flat;
mod lights;
mod point;
mod points;
mod projector;
mod rectangle;
mod sample;
mod selector;
mod shapes;
mod source;
mod sphere;
mod spherical_triangle;
mod spot;
mod subtended;
mod sun_sky;
mod textured;
mod tree;

pub use casters::CausticCasters;
pub use cylinder::CylinderLight;
pub use directional::DirectionalLight;
pub use emission::{Emission, EmissionOrigin, EmissionPdf};
pub use environment::{ConstantLight, DirectionSampling, EnvironmentMap};
pub use flat::{DiskLight, ParallelogramLight, TriangleLight};
pub use lights::Lights;
pub use point::PointLight;
pub use points::{PointChoice, PointLights};
pub use projector::ProjectorLight;
pub use sample::{LightSample, LightSampleContext};
pub use shapes::{Light, LightShape};
pub use source::LightSource;
pub use sphere::SphereLight;
pub use spot::{SpotLight, SpotTexture};
pub use sun_sky::{SunDisc, SunSkyLight};
pub(super) use textured::LuminancePyramid;
pub use textured::{EmittingSurface, FlatPatch, TexturedLight};
