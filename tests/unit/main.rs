//! Tests of single modules: `tests/unit/a/b.rs` tests `src/a/b.rs`; `planted.rs` tests parts of a benchmark.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod client {
    mod compiled_effects;
    mod dither;
    mod effect_list;
    mod filter;
    mod glare {
        mod fourier;
    }
    mod lod;
    mod reference {
        mod curves;
        mod fold;
        mod mips;
        mod reconstruct;
    }
    mod retained;
    mod state;
    mod stereo;
    mod window {
        mod keys;
        mod statistics;
    }
}
mod color {
    mod cie;
    mod oklab;
    mod pq;
    mod profile;
    mod srgb;
}
mod image {
    mod compare {
        mod flip;
        mod metrics;
        mod variance;
    }
    mod bitmap;
    mod data_uri;
    mod exr;
    mod grid;
    mod ktx2;
    mod layer;
    mod stereo;
}
mod math {
    mod distribution;
    mod erf;
    mod float;
    mod frame;
    mod pdf;
    mod random;
    mod warp;
}
mod planted;
mod spectrum {
    mod blackbody;
    mod emission_map;
    mod metals;
    #[allow(clippy::module_inception, reason = "it is named after the module that it tests")]
    mod spectrum;
    mod table;
    mod white;
}
mod stream {
    mod rejections;
    mod replicate;
}
mod study {
    mod analysis;
    mod error;
    mod format;
    mod interval;
    mod prediction;
    mod replicates;
}
mod tracer {
    mod bsdf {
        mod dielectric;
        mod fresnel;
        mod share;
    }
    mod integrator {
        mod check;
    }
    mod light {
        mod sphere;
        mod surfaces;
    }
    mod mis;
    mod photon_map {
        mod photon;
        mod schedule;
    }
    mod sampler {
        mod branch;
        mod scramble;
    }
}
