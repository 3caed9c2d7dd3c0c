//! Options of `pointillist plugins`.

use clap::Args;

/// Options of `pointillist plugins`.
#[derive(Args, Debug)]
pub struct PluginsArgs {
    /// A kind (shape, bsdf, texture, emitter, sensor, film, rfilter, integrator, sampler, spectrum) or the name of a plugin.
    #[arg(value_name = "KIND|NAME")]
    pub which: Option<String>,
}
