//! Measures the speed of every part, as tables. `tools/bench` runs the usual ones; `--help` lists them all.
//!
//! `cargo run --release --example benchmarks -- PART --help` says what a part takes.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod abort;
mod adaptive;
mod after_edit;
mod client;
mod common;
mod edges;
mod edits;
mod energy;
mod fireflies;
mod largest;
mod late;
mod latency;
mod live;
mod loading;
#[path = "../meshes/mod.rs"]
#[allow(dead_code, reason = "colours and the sky are for pictures")]
mod meshes;
mod methods;
mod photon_bias;
mod photons;
mod planted;
mod rays;
mod replicates;
mod sampler;
mod server;
mod share;
mod soak;
mod soak_window;
mod stereo;
mod support;
mod textures;
mod tracer;
mod trial_costs;
mod turns;
mod vertices;
mod viewer;

/// Measures the speed of one part.
#[derive(Parser)]
#[command(name = "benchmarks")]
struct Arguments {
    #[command(subcommand)]
    part: Part,
}

#[derive(Subcommand)]
enum Part {
    /// The time from `abort` to standstill in every scene, by path tracing and photon mapping; p99 must stay below 5 ms
    Abort(abort::Arguments),
    /// Error of adaptive sampling at equal CPU time over that of even sampling, one thread, in turn
    Adaptive(adaptive::Arguments),
    /// Samples on screen 33 ms to 3 s after a move of the camera, over those that the tracer alone makes in that time
    AfterEdit(after_edit::Arguments),
    /// The passes of the Vulkan client and their references on the CPU
    Client(client::Arguments),
    /// Error, bias and pictures with fireflies reweighted and without
    Fireflies(fireflies::Arguments),
    /// Rays at the edges of closed meshes, and rays that leave surfaces: how many of 10^7 go where no ray can
    Edges(edges::Arguments),
    /// Milliseconds from an edit of a colour or of a place to a scene that can be traced
    Edits(edits::Arguments),
    /// The energy audit of every scene of `scenes/` by every method: what is emitted is absorbed or escapes
    Energy(energy::Arguments),
    /// The share of the largest sample of a pixel in its sum, by method
    Largest(largest::Arguments),
    /// How often the warning that light is still being found was right
    Late(late::Arguments),
    /// The time from synthetic input to changed pixels, measured from outside the program
    Latency(latency::Arguments),
    /// A window on a tracer elsewhere beside one with its own: latency, samples after a move, samples per second; memory under edits
    Live(live::Arguments),
    /// Time and memory of reading and preparing a mesh of 1.6 million triangles, by format
    Loading(loading::Arguments),
    /// Error times CPU time of the methods of light transport, one thread, in turn
    Methods(methods::Arguments),
    /// Bias of photon mapping against the number of samples
    PhotonBias(photon_bias::Arguments),
    /// Cost of the photon map against its size, and its throughput with one and two threads
    Photons(photons::Arguments),
    /// Planted changes in the scenes of a regression manifest: how many are found against what is stated, and false alarms of runs without
    Planted(planted::Arguments),
    /// Rays per second of the tracer's tree, beside Embree 3 and obvhs's compressed tree
    Rays(rays::Arguments),
    /// How true the stated errors of replicates are, and what they cost
    Replicates(replicates::Arguments),
    /// Nanoseconds per path of the sampler
    Sampler,
    /// Nanoseconds per path of server and stream around an empty integrator
    Server,
    /// Samples per second with the window open over those of tracing alone
    Share(share::Arguments),
    /// Server, stream and film under edits, aborts, resizes, reloads, lost devices, exhausted memory, bad samples, slow clients, full disks and
    /// workers that panic: memory, counts of samples and pictures must not notice
    Soak(soak::Arguments),
    /// Memory, stalls and latency of the viewer under a user who never rests
    SoakWindow(soak_window::Arguments),
    /// The price of the second eye: processor time and error of both eyes by one tracer over those of one camera alone, in turn
    Stereo(stereo::Arguments),
    /// The price of textures: time of a path with them over that of one without, on the same geometry
    Textures(textures::Arguments),
    /// Paths per second, rays per path and noise of path tracing alone, one thread
    Tracer(tracer::Arguments),
    /// Traces or paints for as many milliseconds as each line of standard input says; see `tools/effects.py`
    Turns(turns::Arguments),
    /// Events and processor time of a path of each method, as JSON: what the costs of `--integrator auto` are fitted to
    TrialCosts(trial_costs::Arguments),
    /// Vertices, light samples and processor time of a camera path of path tracing, as JSON; `tools/other_scenes` asks for it
    Vertices(vertices::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().part {
        Part::Abort(arguments) => abort::run(&arguments),
        Part::Adaptive(arguments) => adaptive::run(&arguments),
        Part::AfterEdit(arguments) => after_edit::run(&arguments),
        Part::Client(arguments) => client::run(&arguments),
        Part::Fireflies(arguments) => fireflies::run(&arguments),
        Part::Edges(arguments) => edges::run(&arguments),
        Part::Edits(arguments) => edits::run(&arguments),
        Part::Energy(arguments) => energy::run(&arguments),
        Part::Largest(arguments) => largest::run(&arguments),
        Part::Late(arguments) => late::run(&arguments),
        Part::Latency(arguments) => latency::run(&arguments),
        Part::Live(arguments) => live::run(&arguments),
        Part::Loading(arguments) => loading::run(&arguments),
        Part::Methods(arguments) => methods::run(&arguments),
        Part::PhotonBias(arguments) => photon_bias::run(&arguments),
        Part::Photons(arguments) => photons::run(&arguments),
        Part::Planted(arguments) => planted::run(&arguments),
        Part::Rays(arguments) => rays::run(&arguments),
        Part::Replicates(arguments) => replicates::run(&arguments),
        Part::Sampler => sampler::run(),
        Part::Server => server::run(),
        Part::Share(arguments) => share::run(&arguments),
        Part::Soak(arguments) => soak::run(&arguments),
        Part::SoakWindow(arguments) => soak_window::run(&arguments),
        Part::Stereo(arguments) => stereo::run(&arguments),
        Part::Textures(arguments) => textures::run(&arguments),
        Part::Tracer(arguments) => tracer::run(&arguments),
        Part::Turns(arguments) => turns::run(&arguments),
        Part::TrialCosts(arguments) => trial_costs::run(&arguments),
        Part::Vertices(arguments) => vertices::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("benchmarks: {error}");
            ExitCode::FAILURE
        }
    }
}
