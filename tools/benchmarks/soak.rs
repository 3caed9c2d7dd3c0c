//! Server, stream and film that never rest, for minutes: see `tests/support/soak`.
//!
//! The same seed makes the same choices; how long each takes, and so where in a render it comes, is up to the machine. The full disk is a small
//! one of the kernel's, mounted in a namespace of this process's own.

use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use super::common::Outcome;
use super::support::soak::{Conservation, SoakPlan, SoakReport, soak};

/// For how long, and with what.
#[derive(clap::Args)]
pub struct Arguments {
    /// Minutes in all
    #[arg(default_value_t = 30.0)]
    minutes: f64,
    /// Every choice follows from it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Tracing threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Scene files
    #[arg(long, value_delimiter = ',', default_values_t = ["cornell", "cornell_spheres", "prism", "rough"].map(|name| format!("scenes/{name}.xml")))]
    scenes: Vec<String>,
    /// Vulkan's validation layer listens
    #[arg(long)]
    validation: bool,
}

/// Largest growth of memory after warm-up.
const MEMORY_GROWTH: f64 = 1.03;

/// Names the folder of the full disk.
const FULL_DISK: &str = "POINTILLIST_FULL_DISK";

/// Soaks, and checks what must hold.
///
/// # Errors
///
/// Something went wrong, or memory grows.
pub fn run(arguments: &Arguments) -> Outcome {
    let full_disk = std::env::var_os(FULL_DISK).map(PathBuf::from);
    if full_disk.is_none() {
        // Returns only where namespaces are not to be had.
        let error = with_full_disk();
        eprintln!("soak: no full disk: {error}");
    }
    let full_disk = full_disk.filter(|folder| !folder.as_os_str().is_empty());
    let plan = SoakPlan {
        time: Duration::from_secs_f64(60.0 * arguments.minutes),
        seed: arguments.seed,
        threads: arguments.threads,
        scenes: arguments.scenes.iter().map(PathBuf::from).collect(),
        full_disk,
        validation: arguments.validation,
    };
    let mut told = 0.0;
    let report = soak(&plan, |seconds, report| {
        if seconds >= told + 30.0 {
            told = seconds;
            let memory = report.memory.last().map_or(0, |(_, kib)| kib >> 10);
            let (renders, pictures, faults) = (report.renders, report.pictures, report.faults.len());
            eprintln!(
                "{seconds:6.0} s: {renders} renders, {pictures} pictures, {faults} faults, {memory} MiB"
            );
        }
    });
    tell(&report, arguments)
}

/// Starts this program anew where a disk is full.
fn with_full_disk() -> std::io::Error {
    let folder = std::env::temp_dir().join(format!("pointillist-full-{}", std::process::id()));
    if let Err(error) = std::fs::create_dir_all(&folder) {
        return error;
    }
    let script = "mount -t tmpfs -o size=64k none \"$0\" && head -c 1000 /dev/zero > \"$0/picture.png\" \
        && { cat /dev/zero > \"$0/rest\" 2> /dev/null; exec \"$@\"; }; POINTILLIST_FULL_DISK= exec \"$@\"";
    let mut command = Command::new("unshare");
    command.args(["-rm", "sh", "-c", script]).arg(&folder);
    match std::env::current_exe() {
        Ok(program) => command.arg(program).args(std::env::args_os().skip(1)),
        Err(error) => return error,
    };
    // Every lost device starts new threads, and glibc would keep what compiling shaders once took in a pool for each: 680 MB for 82 in use.
    command.env(FULL_DISK, &folder).env("MALLOC_ARENA_MAX", "2").exec()
}

fn tell(report: &SoakReport, arguments: &Arguments) -> Outcome {
    println!("seed {}, {} minutes, {} threads", arguments.seed, arguments.minutes, arguments.threads);
    println!("| what was done | times |\n|---|---|");
    report.acts.iter().for_each(|(act, times)| println!("| {act} | {times} |"));
    let Conservation { made, rejected, discarded, sent, stale, accepted } = report.conservation;
    println!("\n| samples of {} renders | |\n|---|---|", report.renders);
    println!(
        "| made | {made} |\n| rejected | {rejected} |\n| discarded with an abort or a panic | {discarded} |"
    );
    println!(
        "| sent over the lanes | {sent} |\n| dropped by a new epoch | {stale} |\n| given to the film | {accepted} |"
    );
    println!("| unaccounted for | {} |", made as i128 - (rejected + discarded + stale + accepted) as i128);
    let minima: Vec<String> = report.memory_minima(12).iter().map(|mib| format!("{mib:.0}")).collect();
    let growth = report.memory_growth();
    println!("\nleast memory in 12 parts of the time: {} MiB", minima.join(", "));
    println!("growth from the middle third to the last: {growth:.4} (bound {MEMORY_GROWTH})");
    println!("pictures that must be those of undisturbed renders: {}", report.pictures);
    println!("longest time without progress: {:.2} s", report.longest_pause);
    println!("messages of the validation layer: {}", report.validation_messages);
    println!("faults: {}", report.faults.len());
    report.faults.iter().for_each(|fault| println!("  {fault}"));
    let lost = made != rejected + discarded + stale + accepted;
    if report.faults.is_empty() && !lost && report.validation_messages == 0 && growth <= MEMORY_GROWTH {
        Ok(())
    } else {
        Err("soak: something went wrong, or memory grows".into())
    }
}
