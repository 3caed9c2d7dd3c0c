//! Rows of frames and scopes, the clock that they are told in, and the trace made of them.

use std::collections::BTreeMap;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::common::{assert_silent, open};
use crate::support::place::{root, told};
use pointillist::client::film::VulkanFilm;
use pointillist::client::{Film, SplatFilter};
use pointillist::gpu::Gpu;
use serde_json::Value;

/// Adds a batch, shows it.
fn picture(gpu: &Arc<Gpu>) {
    let spec = crate::common::spec(64, 48, SplatFilter::Gaussian);
    let mut film = VulkanFilm::new(gpu.clone(), spec).unwrap();
    film.add(&crate::common::scene(&spec, 4000, 1, 1)).unwrap();
    film.display(&crate::common::settings(Default::default(), 0.5)).unwrap();
}

#[test]
fn timing_that_is_off_records_no_query() {
    let gpu = open(false);
    picture(&gpu);
    assert_eq!(gpu.queries_recorded(), 0);
    assert!(gpu.take_rows().rows.is_empty());
    gpu.set_timing(true);
    picture(&gpu);
    assert!(gpu.queries_recorded() > 0, "the counter counts nothing");
    assert_silent(&gpu);
}

/// Every pass has a row; children lie within their parents; frames lie between their submission and the moment when the host saw
/// them complete, on the host's clock.
#[test]
fn rows_lie_where_the_host_saw_the_frame() {
    let gpu = open(false);
    gpu.set_timing(true);
    let begun = Instant::now();
    picture(&gpu);
    let taken = gpu.take_rows();
    let info = gpu.timing_info();
    let slack = Duration::from_nanos(2 * info.deviation.expect("calibrated") as u64 + 2000);
    let names: Vec<_> = taken.rows.iter().map(|r| r.name).collect();
    for pass in ["clear", "splat", "fold", "variance", "mips", "reconstruct", "tonemap", "readback"] {
        assert!(names.contains(&pass), "no row of {pass}: {names:?}");
    }
    let mut parents: Vec<pointillist::gpu::ScopeRow> = Vec::new();
    for row in &taken.rows {
        let frame = taken.frames.iter().find(|f| f.frame == row.frame).expect("a row has a frame");
        assert!(begun <= frame.submitted && frame.submitted <= frame.seen);
        assert!(row.start + slack >= frame.submitted, "{row:?} began before {frame:?}, {info:?}");
        assert!(row.end <= frame.seen + slack, "{row:?} ended after {frame:?}, {info:?}");
        assert!(row.start <= row.end);
        parents.truncate(row.depth as usize);
        assert_eq!(parents.len(), row.depth as usize, "a level was left out at {row:?}");
        if let Some(parent) = parents.last() {
            assert!(parent.start <= row.start && row.end <= parent.end, "{row:?} leaves {parent:?}");
        }
        parents.push(*row);
    }
    assert!(taken.rows.iter().any(|r| r.depth == 1), "nothing nests: the case is too easy");
}

#[test]
fn what_cannot_be_timed_or_kept_is_counted() {
    let gpu = open(false);
    gpu.set_timing(true);
    let frame = |scopes: usize| {
        let mut frame = gpu.begin().unwrap();
        for _ in 0..scopes {
            drop(frame.cmd().scope("scope"));
        }
        gpu.wait(frame.submit().unwrap()).unwrap();
    };
    frame(200);
    let taken = gpu.take_rows();
    assert_eq!((taken.rows.len(), taken.frames[0].untimed, taken.dropped), (128, 72, 0));
    // Nobody takes 100 · 128 rows: the latest stay.
    (0..100).for_each(|_| frame(128));
    let taken = gpu.take_rows();
    assert_eq!(taken.rows.len() as u64 + taken.dropped, 12_800);
    assert!(taken.dropped > 0 && taken.rows.last().unwrap().frame == taken.frames.last().unwrap().frame);
}

/// `render --gpu-timings`: both files are whole, on one clock, and spans of a track never cross.
#[test]
fn traces_are_valid() {
    let dir = told("CARGO_TARGET_TMPDIR", env!("CARGO_TARGET_TMPDIR")).join("gpu_timing");
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    let (csv, png) = (dir.join("t.csv"), dir.join("a.png"));
    let output = Command::new(told("CARGO_BIN_EXE_pointillist", env!("CARGO_BIN_EXE_pointillist")))
        .current_dir(root())
        .args([
            "render",
            "scenes/cornell.xml",
            "--size",
            "64x64",
            "--samples",
            "200k",
            "--threads",
            "2",
            "-q",
        ])
        .args(["--device", "0", "-o", png.to_str().unwrap(), "--gpu-timings", csv.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(std::fs::read_dir(&dir).unwrap().count(), 3, "temporary files are left");

    let text = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<_> = text.lines().filter(|l| !l.starts_with('#')).collect();
    assert_eq!(rows[0], "frame,scope,depth,start_ns,end_ns");
    let trace: Value = serde_json::from_slice(&std::fs::read(dir.join("t.csv.json")).unwrap()).unwrap();
    let mut tracks: BTreeMap<(u64, u64), Vec<(f64, f64)>> = BTreeMap::new();
    let mut last = 0.0;
    for event in trace["traceEvents"].as_array().unwrap().iter().filter(|e| e["ph"] == "X") {
        let (start, length) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
        assert!(start >= last, "not sorted at {event}");
        last = start;
        let key = (event["pid"].as_u64().unwrap(), event["tid"].as_u64().unwrap());
        tracks.entry(key).or_default().push((start, start + length));
    }
    assert_eq!(tracks[&(1, 1)].len(), rows.len() - 1, "the trace has other spans than the table");
    let workers = tracks.keys().filter(|(pid, tid)| *pid == 2 && *tid > 1).count();
    assert_eq!(workers, 2, "{:?}", tracks.keys());
    for (track, spans) in &tracks {
        let mut open: Vec<f64> = Vec::new();
        for (start, end) in spans {
            open.retain(|e| *e > *start + 1e-3);
            assert!(
                open.last().is_none_or(|e| *end <= *e + 1e-3),
                "{track:?}: {start} … {end} crosses {open:?}"
            );
            open.push(*end);
        }
    }
    // The device works while the client does: its spans lie within the client's window.
    let window = |spans: &[(f64, f64)]| {
        spans.iter().fold((f64::MAX, 0.0_f64), |(a, b), (s, e)| (a.min(*s), b.max(*e)))
    };
    let (gpu, cpu) = (window(&tracks[&(1, 1)]), window(&tracks[&(2, 1)]));
    assert!(gpu.0 >= cpu.0 - 100.0 && gpu.1 <= cpu.1 + 100.0, "GPU {gpu:?}, client {cpu:?}");
}
