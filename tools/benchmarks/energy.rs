//! The energy audit of every scene by every method: see `tests/support/audit.rs`.

use std::path::PathBuf;

use pointillist::scene::load;

use super::common::{Outcome, timed};
use super::support::agreement::Method;
use super::support::audit::{AuditPlan, audit};

/// Which scenes, and how exactly.
#[derive(clap::Args)]
pub struct Arguments {
    /// Indices of one randomisation; a bidirectional index has 8 camera paths and 4 light paths
    #[arg(long, default_value_t = 16384)]
    indices: u64,
    /// Randomisations
    #[arg(long, default_value_t = 32)]
    seeds: u32,
    /// Scene files; all of `scenes/` by default
    scenes: Vec<PathBuf>,
}

/// Standard errors of 32 randomisations by which the books may be off.
const DISTANCE: f64 = 4.0;

/// Prints the table.
///
/// # Errors
///
/// A scene cannot be read, or books are not balanced.
pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { indices, seeds, .. } = *arguments;
    let mut scenes = arguments.scenes.clone();
    if scenes.is_empty() {
        for entry in std::fs::read_dir("scenes")? {
            let path = entry?.path();
            let inner = path.join("scene.xml");
            scenes.extend(inner.exists().then_some(inner));
            scenes.extend(path.extension().is_some_and(|e| e == "xml").then_some(path));
        }
        scenes.sort();
    }
    println!("| scene | method | from | emitted | absorbed | escaped | missing | ± | standard errors | s |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut unbalanced = Vec::new();
    for path in &scenes {
        let desc = load(path, &[])?.desc;
        for method in [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon] {
            // A bidirectional index is several paths.
            let indices = if method == Method::Bidirectional { indices.div_ceil(8) } else { indices };
            let (both, seconds) = timed(|| audit(&desc, method, AuditPlan { indices, seeds, clear: false }));
            for (from, balance) in ["camera", "light"].into_iter().zip(both) {
                let Some(b) = balance else { continue };
                println!(
                    "| {} | {method:?} | {from} | {:.4e} | {:.4} | {:.4} | {:+.1e} | {:.0e} | {:.1} | {seconds:.1} |",
                    path.display(),
                    b.emitted,
                    b.absorbed,
                    b.escaped,
                    b.missing,
                    b.error,
                    b.distance()
                );
                if b.distance() > DISTANCE || !b.distance().is_finite() {
                    unbalanced.push(format!("{} by {method:?} from the {from}", path.display()));
                }
            }
        }
    }
    match unbalanced.as_slice() {
        [] => Ok(()),
        _ => Err(format!("the books are not balanced: {}", unbalanced.join(", ")).into()),
    }
}
