//! A window on a tracer elsewhere beside one with its own: both on this machine, in turn, seen from outside as a user sees them.
//!
//! Three figures for each: the time from input to changed pixels, the samples on screen a second after a move, and samples per second when
//! nothing is moved. `--restless` drags the camera without rest instead, and looks whether viewer or tracer grow; `--slow` looks at the
//! picture that comes over a slow link.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::common::{Outcome, quantiles};
use super::latency;
use super::soak_window::resident_kib;
use super::support::proxy::{Proxy, Weather};
use super::viewer::{Viewer, figures};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// The number of rounds
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 512)]
    side: u32,
    /// The scene file
    #[arg(default_value = "scenes/cornell.xml")]
    scene: String,
    /// Measure the picture after 10 s over links of so many bytes per second instead, with film deltas and without
    #[arg(long, value_name = "RATES", value_delimiter = ',', num_args = 0..=1, default_missing_value = "50000,200000,1000000")]
    slow: Vec<usize>,
    /// Drag the camera for so many seconds instead, with the tracer elsewhere
    #[arg(long, value_name = "SECONDS")]
    restless: Option<u64>,
}

/// `pointillist serve`; dropping it ends it.
struct Tracer {
    process: Child,
    address: String,
}

impl Tracer {
    fn start(scene: &str, threads: Option<usize>) -> Outcome<Self> {
        let mut command = Command::new("target/release/pointillist");
        command.args(["serve", scene, "--listen", "127.0.0.1:0"]).stderr(Stdio::piped());
        command.args(threads.map(|threads| format!("--threads={threads}")));
        let mut process = command.spawn()?;
        let mut said = BufReader::new(process.stderr.take().ok_or("no standard error")?);
        let mut line = String::new();
        said.read_line(&mut line)?;
        // Later lines are of no interest, but must not fill the pipe.
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        let address = line.split(" on ").nth(1).and_then(|rest| rest.split(',').next());
        let address = address.ok_or_else(|| format!("no address: {line}"))?.to_owned();
        Ok(Self { process, address })
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        let _ = self.process.kill().and_then(|()| self.process.wait());
    }
}

/// Measures both in turn.
pub fn run(arguments: &Arguments) -> Outcome {
    if let Some(seconds) = arguments.restless {
        return restless(arguments, seconds);
    }
    if !arguments.slow.is_empty() {
        return slow(arguments);
    }
    let Arguments { rounds, side, ref scene, .. } = *arguments;
    println!("{scene}, {side}x{side}: with its own tracer, and with one elsewhere on this machine");
    println!("input to changed pixels p50 p95 [ms] | samples after 1 s | samples per second, M");
    let (mut latencies, mut rates) = ([Vec::new(), Vec::new()], Vec::new());
    for _ in 0..rounds {
        let mut both = [0.0; 2];
        for elsewhere in [false, true] {
            let measured = latency_of(arguments, elsewhere)?;
            let [p50, p95] = quantiles(measured.clone(), [0.5, 0.95]);
            let [after, rate] = rates_of(arguments, elsewhere)?;
            let name = if elsewhere { "elsewhere" } else { "own" };
            println!("  {name:<9} {p50:6.1} {p95:6.1} | {after:9.0} | {:.3}", rate * 1e-6);
            latencies[usize::from(elsewhere)].extend(measured);
            both[usize::from(elsewhere)] = rate;
        }
        rates.push(both[1] / both[0]);
    }
    let [own, elsewhere] = latencies.map(|all| quantiles(all, [0.5, 0.95]));
    println!(
        "later by p50 {:.1} ms, p95 {:.1} ms; samples per second {rates:.3?} of its own",
        elsewhere[0] - own[0],
        elsewhere[1] - own[1]
    );
    Ok(())
}

fn latency_of(arguments: &Arguments, elsewhere: bool) -> Outcome<Vec<f64>> {
    let tracer = elsewhere.then(|| Tracer::start(&arguments.scene, Some(1))).transpose()?;
    let connect = tracer.iter().flat_map(|tracer| ["--connect".to_owned(), tracer.address.clone()]);
    latency::measure(arguments.side, 40, &arguments.scene, &connect.collect::<Vec<_>>())
}

/// Mean number of samples on screen a second after a move, and samples per second when nothing is moved.
fn rates_of(arguments: &Arguments, elsewhere: bool) -> Outcome<[f64; 2]> {
    let Arguments { side, ref scene, .. } = *arguments;
    let tracer = elsewhere.then(|| Tracer::start(scene, None)).transpose()?;
    let mut after = 0.0;
    let mut rate = 0.0;
    // Moves in one session, rest in another: the report has the mean of a session.
    for (moves, pause) in [(6, 1300), (1, 8000)] {
        let json = PathBuf::from("target/live.json");
        let _ = std::fs::remove_file(&json);
        let mut viewer = open(side, scene, tracer.as_ref(), &json)?;
        std::thread::sleep(Duration::from_secs(2));
        for k in 0..moves {
            drag(&viewer, side as i32 * 3 / 4, k);
            std::thread::sleep(Duration::from_millis(pause));
        }
        viewer.ask_to_end();
        viewer.process.wait()?;
        let figures = figures(&json);
        let value = |of: &serde_json::Value| of.as_f64().unwrap_or(f64::NAN);
        match moves {
            1 => rate = value(&figures["traced_samples_per_second"]),
            _ => after = value(&figures["samples_after_edit"]["1"]),
        }
    }
    Ok([after, rate])
}

fn open(side: u32, scene: &str, tracer: Option<&Tracer>, json: &Path) -> Outcome<Viewer> {
    Viewer::open([side + 64; 2], scene, |command| {
        command.args(["--size", &format!("{side}x{side}"), "--integrator", "path", "--no-panel", "--json"]);
        command.arg(json).args(tracer.iter().flat_map(|tracer| ["--connect", &tracer.address]));
    })
}

fn drag(viewer: &Viewer, at: i32, k: i32) {
    viewer.desktop.pointer(at, at);
    viewer.desktop.button(1, true);
    std::thread::sleep(Duration::from_millis(20));
    viewer.desktop.pointer(at + if k % 2 == 0 { 24 } else { -24 }, at);
    std::thread::sleep(Duration::from_millis(20));
    viewer.desktop.button(1, false);
}

/// Moves the camera in every frame; the memory of both programs in the last third of the time is compared with that in the second.
fn restless(arguments: &Arguments, seconds: u64) -> Outcome {
    let Arguments { side, ref scene, .. } = *arguments;
    let tracer = Tracer::start(scene, None)?;
    let json = PathBuf::from("target/live.json");
    let mut viewer = open(side, scene, Some(&tracer), &json)?;
    std::thread::sleep(Duration::from_secs(2));
    let (start, mut memory) = (Instant::now(), Vec::new());
    let middle = side as i32 / 2;
    viewer.desktop.pointer(middle, middle);
    viewer.desktop.button(1, true);
    let mut step = 0;
    while start.elapsed().as_secs() < seconds {
        step += 1;
        let swing = (f64::from(step) * 0.1).sin() * f64::from(side) * 0.3;
        viewer.desktop.pointer(middle + swing as i32, middle + (step % 7));
        std::thread::sleep(Duration::from_millis(16));
        if memory.len() < start.elapsed().as_secs() as usize {
            memory.push([viewer.process.id(), tracer.process.id()].map(resident_kib));
        }
    }
    viewer.desktop.button(1, false);
    viewer.ask_to_end();
    viewer.process.wait()?;
    let figures = figures(&json);
    println!("{} edits, {} epochs in {seconds} s", figures["edits"], figures["epochs"]);
    let (third, mut grows) = (memory.len() / 3, false);
    for (place, name) in ["viewer", "tracer"].into_iter().enumerate() {
        let most = |part: &[[u64; 2]]| part.iter().map(|kib| kib[place]).max().unwrap_or(0);
        let [second, last] = [&memory[third..2 * third], &memory[2 * third..]].map(most);
        let ratio = last as f64 / second as f64;
        grows |= ratio > 1.05;
        println!(
            "{name}: {} MiB at most in the second third, {} in the last, ratio {:.3}",
            second >> 10,
            last >> 10,
            ratio
        );
    }
    if grows { Err("live: memory grows by more than 5 %".into()) } else { Ok(()) }
}

/// Error of the picture after 10 s over slow links, against one of 96 samples per pixel.
fn slow(arguments: &Arguments) -> Outcome {
    let Arguments { side, ref scene, ref slow, .. } = *arguments;
    let (size, reference) = (format!("{side}x{side}"), "target/live-reference.exr");
    let program = |words: &[&str]| Command::new("target/release/pointillist").args(words).output();
    program(&[
        "render", scene, "--size", &size, "--spp", "96", "--device", "cpu", "--quiet", "-o", reference,
    ])?;
    let tracer = Tracer::start(scene, None)?;
    println!("error after 10 s (relMSE without the worst 0.1 % of pixels): samples alone, with film deltas");
    for rate in slow {
        let proxy = Proxy::start(&tracer.address);
        proxy.set(Weather::Slow(*rate));
        let mut errors = Vec::new();
        for compress in ["off", "on"] {
            let picture = std::fs::canonicalize("target")?.join(format!("live-{rate}-{compress}.exr"));
            let _ = std::fs::remove_file(&picture);
            let mut viewer = Viewer::open([side + 64; 2], scene, |command| {
                command.args(["--size", &size, "--integrator", "path", "--denoise", "off", "--no-panel"]);
                command.args(["--connect", &proxy.address, "--compress", compress, "-o"]).arg(&picture);
            })?;
            std::thread::sleep(Duration::from_secs(10));
            viewer.ask_to_end();
            viewer.process.wait()?;
            let picture = picture.display().to_string();
            let compared = program(&["compare", &picture, reference, "--metric", "trimmed"])?;
            let words = String::from_utf8_lossy(&compared.stdout).into_owned();
            let value = words.split_whitespace().skip_while(|word| *word != "trimmed").nth(1);
            errors.push(value.ok_or_else(|| format!("no error: {words}"))?.parse::<f64>()?);
        }
        println!(
            "  {rate:>9} bytes/s  {:.4}  {:.4}, {:.1} times less",
            errors[0],
            errors[1],
            errors[0] / errors[1]
        );
    }
    Ok(())
}
