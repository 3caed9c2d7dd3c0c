//! A made-up run for the tests, with a case of every verdict.

use std::path::PathBuf;

use crate::regress::case_times::{CaseTimes, PassTime};
use crate::regress::judgement::{JudgedTest, Judgement};
use crate::regress::run_report::{CaseReport, CaseVerdict, RunReport};
use crate::regress::timing::{CaseTiming, TimedFigure};

fn case(name: &str, verdict: CaseVerdict, sentence: &str, judgement: Option<Judgement>) -> CaseReport {
    CaseReport {
        name: name.into(),
        scene: format!("scenes/{name}.xml").into(),
        method: "path".into(),
        device: "llvmpipe (LLVM 15.0.6, 256 bits), Mesa 22.3.6".into(),
        command: ["pointillist", "render", "my scene.xml", "--spp", "64"].map(String::from).to_vec(),
        verdict,
        sentence: sentence.into(),
        judgement,
        tolerance: "exact".into(),
        renderings: 4,
        spp: 64,
        seconds: 1.25,
        picture: None,
        reference: None,
        log: None,
        times: None,
        timing: None,
    }
}

fn judgement(red: [f64; 2], p_value: f64, changed: bool, detectable: f64) -> Judgement {
    Judgement {
        changed,
        undecided: false,
        p_value,
        tests: vec![
            JudgedTest { name: "brightness".into(), statistic: 8.3, p_value, place: None },
            JudgedTest {
                name: "areas of 8×8 pixels".into(),
                statistic: 4.1,
                p_value: 0.4,
                place: Some([8, 16]),
            },
        ],
        brightness: [red, [1.0, 6e-4], [1.0, 7e-4]],
        detectable,
        detectable_area: 0.03,
    }
}

/// Times of renderings, with two passes of a GPU.
pub fn times() -> CaseTimes {
    let pass = |name: &str, milliseconds| PassTime { name: name.into(), milliseconds };
    CaseTimes {
        seconds: 0.25,
        paths_per_trace_second: Some(614_000.0),
        passes: vec![pass("fold", 0.125), pass("splat", 1.5)],
    }
}

/// A case that became slower by 30 % in its rendering.
pub fn slower() -> CaseTiming {
    let figure = TimedFigure::of_pairs("rendering", &[[1.3, 1.0]; 5], 0.01);
    CaseTiming::of_figures(["<other>", "1234"], 5, figure.into_iter().collect(), &[])
}

/// A case whose red became brighter by 0.5 %.
pub fn changed() -> CaseReport {
    let judgement = judgement([1.005, 6e-4], 2e-9, true, 0.002);
    case("cornell", CaseVerdict::Changed, "Red is brighter by 0.5 %.", Some(judgement))
}

/// A case that changed, one within noise, one broken and one with the same bits.
pub fn report() -> RunReport {
    let equal = judgement([1.0003, 9e-4], 0.61, false, 0.0032);
    RunReport {
        version: "0.1.0".into(),
        folder: PathBuf::from("tests/regress"),
        started: "2026-11-30T22:05:07Z".into(),
        seconds: 5.5,
        false_alarm: 0.01,
        fail_on_slower: None,
        cases: vec![
            changed(),
            case("prism", CaseVerdict::EqualWithinNoise, "No difference beyond noise.", Some(equal)),
            case("fog", CaseVerdict::Broken, "The program ended with exit code 101 & “panic”.", None),
            case("mirror", CaseVerdict::SameBits, "Every bit is that of the reference.", None),
        ],
    }
}

/// Text that tries to break out of every format.
pub const HOSTILE: &str = "<script>alert('x')</script>]]>&\"%,:\u{0}\u{1b}[31m\n::error::\u{fffe}";
