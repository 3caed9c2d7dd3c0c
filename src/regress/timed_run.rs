//! Renders a case by turns with this program and another, and reads the times.

use std::path::{Path, PathBuf};

use super::case_run::CaseRunner;
use super::case_times::RenderingTimes;
use super::plan::RegressCase;
use super::renderings::{CaseRenderings, CaseStop};
use super::sequential::Looks;
use super::timing::{CaseTiming, TimedFigure};
use crate::render::process;

/// The other program, and how often both render.
#[derive(Clone, Debug)]
pub struct TimingOptions {
    /// The other program: an absolute path.
    pub against: PathBuf,
    /// Pairs of renderings at first.
    pub pairs: u32,
    /// Most pairs where the intervals are wide.
    pub most_pairs: u32,
}

/// Times of one rendering in seconds, by their names, in the order of a report.
type Times = Vec<(String, f64)>;

/// Times a case that this program renders. `device` is that of its pictures: where there is none, no passes of a GPU are timed.
///
/// A case that one of the programs does not render is [`TimingVerdict::Untimed`](super::timing::TimingVerdict::Untimed).
///
/// # Errors
/// Only when Ctrl-C was pressed.
pub fn time_case(
    runner: &CaseRunner<'_>,
    case: &RegressCase,
    options: &TimingOptions,
    device: &str,
) -> Result<CaseTiming, CaseStop> {
    let against = options.against.display().to_string();
    let hash = runner.hashes.file(&options.against);
    let other = [against.as_str(), hash.as_str()];
    match measure(runner, case, options, device) {
        Ok((pairs, figures, missing)) => Ok(CaseTiming::of_figures(other, pairs, figures, &missing)),
        Err(CaseStop::Broken(reason)) => Ok(CaseTiming::failed(other, reason)),
        Err(CaseStop::Interrupted) => Err(CaseStop::Interrupted),
    }
}

/// Renders pairs until every figure is decided or narrow: their number, the figures, and what not all renderings report.
fn measure(
    runner: &CaseRunner<'_>,
    case: &RegressCase,
    options: &TimingOptions,
    device: &str,
) -> Result<(u32, Vec<TimedFigure>, Vec<String>), CaseStop> {
    let place = tempfile::tempdir().map_err(CaseStop::broken)?;
    let log = runner.results.join(format!("{}.log", case.name));
    let programs = [runner.program, &options.against].map(|program| {
        let renderings = CaseRenderings::new(runner.plan, case, program, [place.path(), &log], "timed");
        let has_passes = device != "cpu" && renderings.captures_passes();
        TimedProgram { renderings, name: program, place: place.path(), has_passes }
    });
    // Both have read their files and compiled their pipelines once.
    for program in &programs {
        program.times(0)?;
    }
    let looks = Looks::of(options.pairs, options.most_pairs);
    let level = looks.level(runner.plan.false_alarm / runner.plan.cases.len().max(1) as f64);
    let mut pairs: Vec<[Times; 2]> = Vec::new();
    let mut found = (0, Vec::new(), Vec::new());
    for count in looks.renderings {
        for seed in found.0..count {
            // A B, B A, A B, …
            let [a, b] = &programs;
            pairs.push(if seed % 2 == 0 {
                [a.times(seed)?, b.times(seed)?]
            } else {
                let second = b.times(seed)?;
                [a.times(seed)?, second]
            });
        }
        let (figures, missing) = figures(&pairs, level);
        let is_open = figures.iter().any(TimedFigure::is_open);
        found = (count, figures, missing);
        if !is_open {
            break;
        }
    }
    Ok(found)
}

/// The figures that all renderings of all pairs report, and the names of those that only some do. The probability of a false alarm of the case is
/// divided by their number.
fn figures(pairs: &[[Times; 2]], level: f64) -> (Vec<TimedFigure>, Vec<String>) {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in pairs.iter().flatten().flatten() {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let time = |times: &Times, name: &str| Some(times.iter().find(|(known, _)| known == name)?.1);
    let each = level / names.len().max(1) as f64;
    let (mut figures, mut missing) = (Vec::new(), Vec::new());
    for name in names {
        let all: Option<Vec<[f64; 2]>> =
            pairs.iter().map(|[now, other]| Some([time(now, name)?, time(other, name)?])).collect();
        match all.and_then(|all| TimedFigure::of_pairs(name, &all, each)) {
            Some(figure) => figures.push(figure),
            None => missing.push(name.to_owned()),
        }
    }
    (figures, missing)
}

/// One of the two programs.
struct TimedProgram<'a> {
    renderings: CaseRenderings,
    name: &'a Path,
    place: &'a Path,
    has_passes: bool,
}

impl TimedProgram<'_> {
    /// Renders once.
    fn times(&self, seed: u32) -> Result<Times, CaseStop> {
        if process::is_interrupted() {
            return Err(CaseStop::Interrupted);
        }
        let [output, report, capture] =
            ["exr", "json", "csv"].map(|end| self.place.join("timed").with_extension(end));
        // What an earlier rendering left would be taken for this one's.
        for old in [&output, &report, &capture].into_iter().filter(|old| old.exists()) {
            std::fs::remove_file(old).map_err(CaseStop::broken)?;
        }
        let mut words = self.renderings.words(seed, &output, &report);
        if self.has_passes {
            words.extend(["--gpu-timings".to_owned(), capture.display().to_string()]);
        }
        let process = self.renderings.run(seed, &words, &output).map_err(|stop| match stop {
            CaseStop::Broken(reason) => {
                CaseStop::Broken(format!("cannot be timed with {}: {reason}", self.name.display()))
            }
            CaseStop::Interrupted => stop,
        })?;
        let RenderingTimes { render, paths_per_trace_second, passes, .. } =
            RenderingTimes::read(process, &report, &capture);
        let all = [
            ("tracing a path", paths_per_trace_second.map(f64::recip)),
            ("rendering", render),
            ("the whole process", Some(process)),
        ];
        let mut times: Times =
            all.into_iter().filter_map(|(name, time)| Some((name.to_owned(), time?))).collect();
        times.extend(passes.into_iter().map(|(name, time)| (format!("GPU pass {name}"), time)));
        Ok(times)
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::process::Command;

    use super::*;
    use crate::regress::manifest::read_plan;
    use crate::regress::provenance::FileHashes;
    use crate::regress::timing::TimingVerdict;

    /// A program that writes what a render of this device would, and says in `calls` that it was called.
    fn program(folder: &Path, name: &str, script: &str) -> PathBuf {
        let path = folder.join(name);
        let text = format!(
            "#!/bin/sh\nwhile [ $# -gt 0 ]; do case $1 in -o) picture=$2;; --json) report=$2;; --gpu-timings) passes=$2;; esac; shift; done\n\
             echo {name} >> '{}'\n: > \"$picture\"\n{script}\n",
            folder.join("calls").display()
        );
        // A file that another thread's child still holds open for writing cannot be started: a process of its own writes it.
        let made = Command::new("/bin/sh")
            .args(["-c", "printf %s \"$1\" > \"$0\" && chmod 755 \"$0\"", &path.display().to_string(), &text])
            .status();
        assert!(made.is_ok_and(|status| status.success()));
        path
    }

    fn report(speed: f64, seconds: f64) -> String {
        format!(
            "echo '{{\"paths_per_trace_second\": {speed}, \"seconds\": {{\"render\": {seconds}}}}}' > \"$report\""
        )
    }

    /// Times the case of a folder with two scripts.
    fn timed(scripts: [&str; 2], device: &str) -> (CaseTiming, Vec<String>) {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.xml"), "<scene version=\"3.0.0\"/>").expect("a scene");
        let plan = read_plan(folder.path(), None).expect("a plan");
        let [own, other] = [("own", scripts[0]), ("other", scripts[1])]
            .map(|(name, script)| program(folder.path(), name, script));
        let runner = CaseRunner {
            plan: &plan,
            results: folder.path(),
            program: &own,
            seed_base: None,
            hashes: &FileHashes::default(),
        };
        let options = TimingOptions { against: other, pairs: 8, most_pairs: 8 };
        let timing = time_case(&runner, &plan.cases[0], &options, device).expect("not interrupted");
        let calls = std::fs::read_to_string(folder.path().join("calls")).unwrap_or_default();
        (timing, calls.lines().map(String::from).collect())
    }

    fn figure<'a>(timing: &'a CaseTiming, name: &str) -> &'a TimedFigure {
        timing.figures.iter().find(|figure| figure.name == name).expect("a figure")
    }

    #[test]
    fn the_slower_program_is_told_by_its_reports_and_the_order_alternates() {
        let (timing, calls) = timed([&report(1e5, 3.0), &report(2e5, 2.0)], "cpu");
        assert_eq!(timing.verdict, TimingVerdict::Slower, "{timing:?}");
        assert!((figure(&timing, "tracing a path").ratio.value - 2.0).abs() < 1e-9, "{timing:?}");
        assert!((figure(&timing, "rendering").ratio.value - 1.5).abs() < 1e-9, "{timing:?}");
        assert!(timing.sentence.contains("tracing a path +100"), "{}", timing.sentence);
        // One of each is not measured.
        let order: Vec<&str> = calls.iter().map(String::as_str).collect();
        let wanted = ["own", "other", "own", "other", "other", "own", "own", "other", "other", "own"];
        assert_eq!(order[..10], wanted);
        assert_eq!(order.len(), 18);
    }

    #[test]
    fn a_program_that_sleeps_is_slower_as_a_process() {
        let sleeps = format!("sleep 0.2; {}", report(1e5, 1.0));
        let (timing, _) = timed([&sleeps, &report(1e5, 1.0)], "cpu");
        assert_eq!(figure(&timing, "the whole process").verdict(), TimingVerdict::Slower, "{timing:?}");
        assert_eq!(figure(&timing, "rendering").verdict(), TimingVerdict::AsFast);
        let (timing, _) = timed([&report(1e5, 1.0), &sleeps], "cpu");
        assert_eq!(timing.verdict, TimingVerdict::Faster, "{timing:?}");
    }

    #[test]
    fn passes_of_the_gpu_are_timed_by_their_medians() {
        let script = |splat: u32| {
            let rows: String =
                [1, splat, 9_000_000].map(|ns| format!("1,splat,0,100,{}\\n", 100 + ns)).concat();
            format!(
                "{}; printf '# a comment\\nframe,scope,depth,start_ns,end_ns\\n{rows}' > \"$passes\"",
                report(1e5, 1.0)
            )
        };
        let (timing, _) = timed([&script(3000), &script(2000)], "some GPU");
        let splat = figure(&timing, "GPU pass splat");
        assert!((splat.ratio.value - 1.5).abs() < 1e-9 && splat.verdict() == TimingVerdict::Slower);
        assert!((splat.seconds[0] - 3e-6).abs() < 1e-15, "{splat:?}");
        // Only one of the programs has the pass.
        let (timing, _) = timed([&script(3000), &report(1e5, 1.0)], "some GPU");
        assert!(timing.sentence.contains("GPU pass splat"), "{}", timing.sentence);
        assert!(timing.figures.iter().all(|figure| figure.name != "GPU pass splat"));
    }

    #[test]
    fn a_program_that_fails_is_told() {
        let (timing, _) = timed([&report(1e5, 1.0), "echo its words >&2; exit 3"], "cpu");
        assert_eq!((timing.verdict, timing.pairs), (TimingVerdict::Untimed, 0));
        assert!(
            timing.sentence.contains("other: the rendering with seed 0 ended with exit code 3: its words"),
            "{timing:?}"
        );
    }
}
