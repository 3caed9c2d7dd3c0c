//! Path tracing and its parts: closed forms, sampling against densities, samplers, photon maps, effects.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod adaptive;
mod bidirectional;
mod both_ends;
mod bsdf;
mod bumps;
mod camera;
mod casters;
mod cells;
mod choice;
mod coats;
mod curves;
mod dispersion;
mod effects_check;
mod effects_plan;
mod empirical;
mod envmap;
mod geometry;
mod instances;
mod kernels;
mod largest;
mod light_choice;
mod light_groups;
mod lights;
mod line_of_sight;
mod media;
mod media_temperature;
mod microfacet;
mod path;
mod photon;
mod photon_publish;
mod photons;
mod pick;
mod prepare;
mod principled;
mod prism;
mod rough;
mod rough_plastic;
mod sampler_nets;
mod sampler_sequence;
mod stereo;
mod textured_lights;
mod textures;
mod thin_film;
mod vcm;
mod witness;
