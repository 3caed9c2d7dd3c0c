//! Makes data: meshes, pictures side by side, and the documentation of plugins. `cargo run --release --example make -- --help`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};

#[path = "../meshes/mod.rs"]
#[allow(dead_code, reason = "the merged list is for rays")]
mod meshes;
mod mitsuba;
mod montage;
mod plugins;

/// Makes data for benchmarks and figures.
#[derive(Parser)]
#[command(name = "make")]
struct Arguments {
    #[command(subcommand)]
    what: What,
}

/// The file format of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MeshFormat {
    Ply,
    Obj,
}

#[derive(Subcommand)]
enum What {
    /// Writes the meshes of `tools/bench rays` as Mitsuba 3 scenes: spheres.xml and bigmesh.xml, with one file per material
    Meshes {
        /// The folder to write to
        folder: PathBuf,
        /// PLY is binary, little endian; OBJ is for programs that read only that
        #[arg(value_enum, default_value = "ply")]
        format: MeshFormat,
    },
    /// Joins PNG pictures of one height side by side
    Montage {
        /// The picture to write
        out: PathBuf,
        /// The pictures to join
        #[arg(required = true)]
        pictures: Vec<PathBuf>,
    },
    /// Writes the documentation of plugins: what `pointillist plugins` prints, and the tables of scenes/README.md
    Plugins,
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().what {
        What::Meshes { folder, format } => mitsuba::write(&folder, format),
        What::Montage { out, pictures } => montage::join(&out, &pictures),
        What::Plugins => document_plugins(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make: {error}");
            ExitCode::FAILURE
        }
    }
}

fn document_plugins() -> Result<(), Box<dyn std::error::Error>> {
    for (path, text) in plugins::files(&plugins::plugins()?)? {
        std::fs::write(path, text)?;
    }
    Ok(())
}
