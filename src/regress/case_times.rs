//! Times of a case's renderings: every report shows them, and none judges by them.
//!
//! An absolute time says more about the machine, and about what else it does, than about the program. What is judged are ratios of
//! interleaved renderings, see [`timing`](super::timing).

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::timing::median;

/// Medians over the renderings of a case. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseTimes {
    /// Wall clock of the process of one rendering, in seconds.
    pub seconds: f64,
    /// Paths per second of one thread's tracing time; `None` where the report of the rendering does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paths_per_trace_second: Option<f64>,
    /// Passes of the GPU by their names in alphabetical order; none on the CPU, and of a device without timestamps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub passes: Vec<PassTime>,
}

/// How long a pass of the GPU takes. Field names are JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
    /// Median over the renderings of the median within each, in milliseconds.
    pub milliseconds: f64,
}

/// Times of one rendering.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderingTimes {
    /// Wall clock of the process, in seconds.
    pub process: f64,
    /// Wall clock from the first sample to the last, in seconds.
    pub render: Option<f64>,
    /// Paths per second of one thread's tracing time.
    pub paths_per_trace_second: Option<f64>,
    /// Median of each pass of the GPU in seconds, by name; passes that take no time are left out.
    pub passes: BTreeMap<String, f64>,
}

/// The part of a render's report that is read; other versions may lack any of it.
#[derive(Default, Deserialize)]
#[serde(default)]
struct ReportedTimes {
    paths_per_trace_second: Option<f64>,
    seconds: ReportedSeconds,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct ReportedSeconds {
    render: Option<f64>,
}

impl RenderingTimes {
    /// Reads what a rendering reports besides the wall clock of its process: the file of `render --json`, and the capture of
    /// `--gpu-timings`. What a file does not say, or a file that is not there, is no time.
    pub fn read(process: f64, report: &Path, capture: &Path) -> Self {
        let text = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
        let ReportedTimes { paths_per_trace_second, seconds } =
            serde_json::from_str(&text(report)).unwrap_or_default();
        let positive = |x: &f64| x.is_finite() && *x > 0.0;
        Self {
            process,
            render: seconds.render.filter(positive),
            paths_per_trace_second: paths_per_trace_second.filter(positive),
            passes: passes_of(&text(capture)),
        }
    }
}

/// The median time of each pass in a capture of `--gpu-timings`.
fn passes_of(csv: &str) -> BTreeMap<String, f64> {
    let mut passes: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for line in csv.lines().filter(|line| !line.starts_with('#')) {
        let cells: Vec<&str> = line.split(',').collect();
        let [_, name, _, start, end] = cells[..] else { continue };
        // The line of headings has no numbers.
        if let (Ok(start), Ok(end)) = (start.parse::<u64>(), end.parse::<u64>()) {
            passes.entry(name).or_default().push(end.saturating_sub(start) as f64 * 1e-9);
        }
    }
    let medians = passes.into_iter().filter_map(|(name, mut times)| {
        Some((name.to_owned(), median(&mut times).filter(|time| *time > 0.0)?))
    });
    medians.collect()
}

impl CaseTimes {
    /// The medians of what renderings report; `None` without renderings.
    pub fn of(renderings: &[RenderingTimes]) -> Option<Self> {
        let middle = |times: &mut dyn Iterator<Item = f64>| median(&mut times.collect::<Vec<_>>());
        let mut passes: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for (name, time) in renderings.iter().flat_map(|times| &times.passes) {
            passes.entry(name).or_default().push(*time);
        }
        let pass = |(name, mut times): (&str, Vec<f64>)| {
            Some(PassTime { name: name.to_owned(), milliseconds: 1e3 * median(&mut times)? })
        };
        Some(Self {
            seconds: middle(&mut renderings.iter().map(|times| times.process))?,
            paths_per_trace_second: middle(
                &mut renderings.iter().filter_map(|times| times.paths_per_trace_second),
            ),
            passes: passes.into_iter().filter_map(pass).collect(),
        })
    }

    /// The time of a pass in milliseconds.
    pub fn pass(&self, name: &str) -> Option<f64> {
        self.passes.iter().find(|pass| pass.name == name).map(|pass| pass.milliseconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendering(process: f64, passes: &[(&str, f64)]) -> RenderingTimes {
        let passes = passes.iter().map(|(name, time)| ((*name).to_owned(), *time)).collect();
        RenderingTimes { process, passes, ..RenderingTimes::default() }
    }

    #[test]
    fn files_of_a_rendering_are_read_as_far_as_they_go() {
        let folder = tempfile::tempdir().expect("a folder");
        let [report, capture] = ["report", "capture"].map(|name| folder.path().join(name));
        assert_eq!(RenderingTimes::read(2.0, &report, &capture), rendering(2.0, &[]));
        std::fs::write(&report, r#"{"paths_per_trace_second": 5e5, "seconds": {"render": 1.5}, "x": 1}"#)
            .expect("written");
        let rows = "# a comment\nframe,scope,depth,start_ns,end_ns\n\
                    1,splat,0,100,1100\n1,clear,0,7,7\n2,splat,0,100,3100\n2,splat,0,100,9000100\n# lost: 1,2,3,4,5\n";
        std::fs::write(&capture, rows).expect("written");
        let read = RenderingTimes::read(2.0, &report, &capture);
        assert_eq!((read.render, read.paths_per_trace_second), (Some(1.5), Some(5e5)));
        assert_eq!(read.passes.len(), 1, "{read:?}");
        assert!((read.passes["splat"] - 3e-6).abs() < 1e-15, "{read:?}");
        std::fs::write(&report, r#"{"paths_per_trace_second": -1, "seconds": {}}"#).expect("written");
        assert_eq!(RenderingTimes::read(2.0, &report, &capture).paths_per_trace_second, None);
    }

    #[test]
    fn a_case_has_the_medians_of_its_renderings() {
        assert_eq!(CaseTimes::of(&[]), None);
        let mut all = [
            rendering(1.0, &[("splat", 0.003), ("fold", 0.001)]),
            rendering(9.0, &[("splat", 0.001)]),
            rendering(2.0, &[("splat", 0.002)]),
        ];
        all[1].paths_per_trace_second = Some(4e5);
        let times = CaseTimes::of(&all).expect("times");
        assert_eq!((times.seconds, times.paths_per_trace_second), (2.0, Some(4e5)));
        assert_eq!(
            (times.pass("splat"), times.pass("fold"), times.pass("none")),
            (Some(2.0), Some(1.0), None)
        );
    }

    #[test]
    fn figures_that_are_not_there_are_left_out_of_json() {
        let times = CaseTimes::of(&[rendering(1.5, &[])]).expect("times");
        let text = serde_json::to_string(&times).expect("JSON");
        assert_eq!(text, r#"{"seconds":1.5}"#);
        assert_eq!(serde_json::from_str::<CaseTimes>(&text).ok(), Some(times));
    }
}
