//! `pointillist regress`: regression renders of a folder of scenes.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::cmd::args::RegressArgs;
use crate::cmd::args::regress::{
    AnnotationService, RegressBisectArgs, RegressCommand, RegressFolder, RegressMergeArgs, RegressOutputs,
    RegressRunArgs, RegressUpdateArgs,
};
use crate::image::write::{atomically, check_place};
use crate::regress::bisect::{BisectOptions, BisectOutcome, BisectStep, bisect};
use crate::regress::case_run::{device, method};
use crate::regress::manifest::read_plan;
use crate::regress::merge::merge;
use crate::regress::plan::{ReferenceSource, RegressPlan};
use crate::regress::provenance::{stored, unused_references};
use crate::regress::report;
use crate::regress::run::{RegressEvent, RegressOptions, choose, run};
use crate::regress::run_report::{CaseVerdict, RunReport};
use crate::regress::timed_run::TimingOptions;
use crate::regress::timing::TimingVerdict;
use crate::regress::update::{UpdateOptions, UpdateOutcome, update};
use crate::render::figures::{is_special, print, publish};
use crate::render::process::{listen_for_interrupt, tell};
use crate::render::progress::Steps;

/// Exit code where something is broken, and for wrong options.
const BROKEN: u8 = 2;

/// Runs the subcommand. The exit code says what was found: errors of the command line and of files are 2, as broken cases are.
pub fn regress(args: &RegressArgs) -> ExitCode {
    let outcome = match &args.command {
        RegressCommand::Run(args) => run_cases(args),
        RegressCommand::Update(args) => update_references(args),
        RegressCommand::Merge(args) => merge_shards(args),
        RegressCommand::Bisect(args) => bisect_case(args),
        RegressCommand::List(args) => plan(&args.folder).map(|plan| list(&plan)),
    };
    let code = outcome.unwrap_or_else(|error| {
        tell(&format!("{error:?}"));
        BROKEN
    });
    ExitCode::from(code)
}

fn plan(folder: &RegressFolder) -> Result<RegressPlan> {
    read_plan(&folder.dir, folder.device.as_deref())
}

/// This program, for child processes: what the environment variable POINTILLIST_PROGRAM names, as the package for Python sets it, whose
/// executable is the interpreter.
fn program() -> Result<PathBuf> {
    if let Some(program) = std::env::var_os("POINTILLIST_PROGRAM") {
        return Ok(program.into());
    }
    std::env::current_exe()
        .into_diagnostic()
        .wrap_err("cannot find this program, which renders in child processes")
}

/// The file that holds the code of [`program`]: what the environment variable POINTILLIST_LIBRARY names, as the package for Python sets it.
///
/// # Errors
/// Where it names no file: results of different builds could not be told apart.
fn library() -> Result<Option<PathBuf>> {
    let Some(path) = std::env::var_os("POINTILLIST_LIBRARY").map(PathBuf::from) else { return Ok(None) };
    if !path.is_file() {
        return Err(miette::miette!(
            help = "name the library that POINTILLIST_PROGRAM loads, or unset the variable",
            "POINTILLIST_LIBRARY: there is no file {}",
            path.display()
        ));
    }
    Ok(Some(path))
}

fn run_cases(args: &RegressRunArgs) -> Result<u8> {
    let plan = plan(&args.folder)?;
    let results = results(&args.outputs, &args.folder);
    check_outputs(&args.outputs)?;
    let timing = timing(args)?;
    listen_for_interrupt();
    let options = RegressOptions {
        results: results.clone(),
        cases: args.cases.clone(),
        shard: args.shard,
        for_merge: args.for_merge,
        fresh: args.fresh,
        seed_base: args.seed_base,
        jobs: usize::from(args.jobs),
        program: program()?,
        library: library()?,
        timing,
    };
    let rounds = if options.timing.is_some() { 2 } else { 1 };
    let count = choose(&plan, &args.cases)?.len().div_ceil(args.shard.map_or(1, |shard| shard.of));
    let steps = steps(rounds * count, args.quiet);
    let mut outcome = run(&plan, &options, &|event| match event {
        RegressEvent::Begins(name) => begin(steps.as_ref(), name),
        RegressEvent::Ends(case) => {
            if case.verdict >= CaseVerdict::Changed {
                say(steps.as_ref(), &format!("{}: {}: {}", case.name, case.verdict.name(), case.sentence));
            }
            done(steps.as_ref());
        }
        RegressEvent::Times(name) => begin(steps.as_ref(), &format!("time of {name}")),
        RegressEvent::Timed(case) => {
            let notable = |verdict| matches!(verdict, TimingVerdict::Slower | TimingVerdict::Untimed);
            if let Some(timing) = case.timing.as_ref().filter(|timing| notable(timing.verdict)) {
                let verdict = timing.verdict.name();
                say(steps.as_ref(), &format!("{}: {verdict}: {}", case.name, timing.sentence));
            }
            done(steps.as_ref());
        }
    })?;
    drop(steps);
    outcome.report.fail_on_slower = args.fail_on_slower;
    // A part of a run is no point of the history.
    let is_whole = outcome.unfinished == 0 && args.shard.is_none();
    publish_report(&outcome.report, &args.outputs, &results, is_whole)?;
    if outcome.unfinished > 0 {
        tell(&format!(
            "interrupted: {} cases are not finished; the same command goes on with them",
            outcome.unfinished
        ));
        return Ok(BROKEN);
    }
    if options.timing.is_some() {
        tell_untimed(&outcome.report);
    }
    tell_time_failures(&outcome.report);
    if is_whole && args.cases.is_empty() {
        tell_unused_references(&plan, &args.folder);
    }
    if args.for_merge {
        return Ok(0);
    }
    Ok(outcome.report.exit_code())
}

/// The other program of `--time-against`.
fn timing(args: &RegressRunArgs) -> Result<Option<TimingOptions>> {
    let Some(path) = &args.time_against else { return Ok(None) };
    let against = std::path::absolute(path).into_diagnostic()?;
    if !against.is_file() {
        return Err(miette::miette!(
            help = "name the file of another pointillist, such as target/release/pointillist of another checkout",
            "--time-against {}: there is no such file",
            path.display()
        ));
    }
    Ok(Some(TimingOptions { against, pairs: args.time_pairs, most_pairs: args.most_time_pairs }))
}

/// Names references that no case is compared with, in one line: of cases that are no more. With `--device` other references may be of other
/// devices.
fn tell_unused_references(plan: &RegressPlan, folder: &RegressFolder) {
    const MOST_NAMES: usize = 5;
    let unused = unused_references(plan);
    if unused.is_empty() || folder.device.is_some() {
        return;
    }
    let names: Vec<String> = unused.iter().take(MOST_NAMES).map(|path| path.display().to_string()).collect();
    let more = match unused.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    tell(&format!(
        "no case of this manifest is compared with {}{more}: delete what nothing else needs",
        names.join(", ")
    ));
}

/// Says which cases have no times because only their own program renders them.
fn tell_untimed(report: &RunReport) {
    let untimed =
        report.cases.iter().filter(|case| case.timing.is_none() && case.verdict != CaseVerdict::Broken);
    let names: Vec<&str> = untimed.map(|case| case.name.as_str()).collect();
    if !names.is_empty() {
        tell(&format!("not timed, as other programs render them: {}", names.join(", ")));
    }
}

/// A line for each way in which `--fail-on-slower` makes cases red.
fn tell_time_failures(report: &RunReport) {
    let Some(percent) = report.fail_on_slower else { return };
    let slower = format!("certainly slower by more than {percent} %");
    for (failure, what) in [(TimingVerdict::Slower, slower.as_str()), (TimingVerdict::Untimed, "not timed")] {
        let cases = report.cases.iter().filter(|case| report.time_failure(case) == Some(failure));
        let names: Vec<&str> = cases.map(|case| case.name.as_str()).collect();
        if !names.is_empty() {
            tell(&format!("--fail-on-slower: {what}: {}", names.join(", ")));
        }
    }
}

fn bisect_case(args: &RegressBisectArgs) -> Result<u8> {
    let plan = plan(&args.folder)?;
    listen_for_interrupt();
    let options = BisectOptions {
        case: args.case.clone(),
        good: args.good.clone(),
        bad: args.bad.clone(),
        build: args.build.clone(),
        repository: args.repository.clone(),
        program: program()?,
    };
    let outcome = bisect(&plan, &options, &|commit, step| {
        let line = match step {
            None => format!("{} …", commit.name()),
            Some(BisectStep::Equal(sentence)) => format!("  equal: {sentence}"),
            Some(BisectStep::Changed(sentence)) => format!("  changed: {sentence}"),
            Some(BisectStep::Skipped(reason)) => format!("  skipped: {reason}"),
        };
        if !args.quiet {
            tell(&line);
        }
    })?;
    match outcome {
        BisectOutcome::First(commit, sentence) => {
            let text = format!(
                "{} is the first changed commit: {}\n{}: {sentence}\n",
                commit.hash, commit.subject, args.case
            );
            print(&text, "the commit");
            Ok(0)
        }
        BisectOutcome::OneOf(commits) => {
            let names: String = commits.iter().map(|commit| format!("{}\n", commit.name())).collect();
            print(
                &format!("The first changed commit is one of these; the others cannot be judged:\n{names}"),
                "the commits",
            );
            Ok(BROKEN)
        }
        BisectOutcome::Interrupted => {
            tell("interrupted: no commit is found, and nothing is left of the search");
            Ok(BROKEN)
        }
    }
}

fn merge_shards(args: &RegressMergeArgs) -> Result<u8> {
    let plan = plan(&args.folder)?;
    check_outputs(&args.outputs)?;
    let results = results(&args.outputs, &args.folder);
    let report = merge(&plan, &args.cases, &args.parts, &results, args.fail_on_slower)?;
    publish_report(&report, &args.outputs, &results, true)?;
    tell_time_failures(&report);
    if args.cases.is_empty() {
        tell_unused_references(&plan, &args.folder);
    }
    Ok(report.exit_code())
}

fn update_references(args: &RegressUpdateArgs) -> Result<u8> {
    let plan = plan(&args.folder)?;
    listen_for_interrupt();
    let options = UpdateOptions {
        cases: args.cases.clone(),
        reason: args.reason.clone().filter(|_| !args.dry_run),
        program: program()?,
    };
    let steps = steps(choose(&plan, &args.cases)?.len(), args.quiet);
    let broken = std::cell::Cell::new(false);
    let unfinished = update(&plan, &options, &|name, updated| {
        let Some(updated) = updated else { return begin(steps.as_ref(), name) };
        let word = match updated.outcome {
            UpdateOutcome::Written if args.dry_run => "would be written",
            UpdateOutcome::Written => "written",
            UpdateOutcome::Kept => "kept",
            UpdateOutcome::Broken => "broken",
        };
        broken.set(broken.get() || updated.outcome == UpdateOutcome::Broken);
        let show = || print(&format!("{name}: {word}: {}\n", updated.sentence), "what changes");
        match &steps {
            Some(steps) => steps.suspend(show),
            None => show(),
        };
        done(steps.as_ref());
    })?;
    if unfinished > 0 {
        tell(&format!("interrupted: {unfinished} references are as they were"));
    }
    Ok(if broken.get() || unfinished > 0 { BROKEN } else { 0 })
}

/// Prints a line for each case: its name, method, device, budget, and what it is compared with.
fn list(plan: &RegressPlan) -> u8 {
    let width = plan.cases.iter().map(|case| case.name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for case in &plan.cases {
        let reference = match &case.reference {
            ReferenceSource::Stored(name) => {
                let path = stored(plan, name);
                let missing = if path.exists() { "" } else { " (missing: `regress update` renders it)" };
                format!("{}{missing}", path.display())
            }
            ReferenceSource::Picture(path) => path.display().to_string(),
            ReferenceSource::Rendered { renderer, .. } => {
                format!("{}, rendered in each run", method(renderer))
            }
        };
        let size = case.size.map_or_else(|| "size of the scene".into(), |[w, h]| format!("{w}×{h}"));
        let budget = case.budget;
        text += &format!(
            "{:<width$}  {}; method {}; {}; {size}; {} to {} renderings of {} spp; {}; against {reference}\n",
            case.name,
            case.scene.display(),
            method(&case.renderer),
            device(&case.renderer),
            budget.seeds,
            budget.most_seeds,
            budget.spp,
            case.tolerance.class,
        );
    }
    print(&text, "the cases");
    0
}

fn results(outputs: &RegressOutputs, folder: &RegressFolder) -> PathBuf {
    outputs.results.clone().unwrap_or_else(|| folder.dir.join("results"))
}

/// Checks early that the files that are asked for can be written.
fn check_outputs(outputs: &RegressOutputs) -> Result<()> {
    let json = outputs.json.as_deref().filter(|path| !is_special(path));
    for path in [outputs.html.as_deref(), outputs.junit.as_deref(), json].into_iter().flatten() {
        check_place(path).into_diagnostic()?;
    }
    Ok(())
}

/// Writes all reports of a run.
fn publish_report(
    report: &RunReport,
    outputs: &RegressOutputs,
    results: &Path,
    is_whole: bool,
) -> Result<()> {
    if is_whole {
        report::record(report, results)?;
    }
    let page = outputs.html.clone().unwrap_or_else(|| results.join("index.html"));
    let html = report::html(report, results).into_diagnostic()?;
    atomically(&page, html.as_bytes()).into_diagnostic()?;
    if let Some(path) = &outputs.junit {
        atomically(path, report::junit(report).as_bytes()).into_diagnostic()?;
    }
    publish(&report::terminal(report), "the verdicts", report, outputs.json.as_deref())?;
    if outputs.annotations == Some(AnnotationService::Github) {
        print(&report::annotations(report), "the annotations");
    }
    Ok(())
}

/// A progress bar over so many steps, unless nothing is to be shown.
fn steps(count: usize, quiet: bool) -> Option<Steps> {
    (!quiet).then(|| Steps::new(count as u64))
}

fn begin(steps: Option<&Steps>, name: &str) {
    if let Some(steps) = steps {
        steps.begin(name);
    }
}

fn done(steps: Option<&Steps>) {
    if let Some(steps) = steps {
        steps.done();
    }
}

/// A line on standard error.
fn say(steps: Option<&Steps>, line: &str) {
    match steps {
        Some(steps) => steps.suspend(|| tell(line)),
        None => tell(line),
    }
}
