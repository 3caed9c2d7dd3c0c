//! Part 3, continued: options of `render` against a render without them, with the same method and time.

use std::sync::Arc;
use std::time::Duration;

use miette::Result;

use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::pictures::{difference, linear};
use crate::cmd::study::renderer::{RenderLimit, StudyRender, StudyRenderer};
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::image::Grid;
use crate::render::process;
use crate::render::run_spec::RunSpec;
use crate::scene::light_groups::{each, emitters, of_sources};
use crate::study::Interval;
use crate::study::data::OptionPrice;
use crate::study::measurement::Measurement;

/// Least and greatest seconds of each render.
const SECONDS: [f64; 2] = [0.5, 10.0];

/// Overhead in seconds for film and judging: constant, and per pixel.
const OVERHEAD: [f64; 2] = [0.3, 3e-6];

/// Least samples per pixel; the pilot of an adaptive render takes four.
const LEAST_SAMPLES: f64 = 8.0;

/// Default threshold of `--reweight-fireflies`.
const KAPPA: f32 = 1.0;

/// The options, in order of measurement.
const NAMES: [&str; 4] = ["--adaptive", "--denoise", "--reweight-fireflies", "--light-groups"];

/// Whether all options have been measured.
pub fn is_complete(folder: &StudyFolder) -> bool {
    folder.has(|m| matches!(m, Measurement::Option(price) if price.name == NAMES[3]))
}

/// Figures of one render.
struct Shown {
    /// Error estimated from its replicates, for options that only redistribute samples.
    stated: Option<Interval>,
    /// Error against the reference, for options that add bias.
    against: Option<Interval>,
    flip: f64,
    paths: f64,
}

/// Measures the options that the method supports, as far as the time allows.
pub fn options(session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    if is_complete(&session.folder) {
        return Ok(());
    }
    // A trial soon reaches many samples per pixel, at which the options differ.
    let film = session.renderer.trial.unwrap_or(session.renderer.run.film);
    let run = RunSpec { seed: SEED, film, ..session.chosen() };
    let texels: f64 = film.padded_extent().map(f64::from).iter().product();
    let overhead = OVERHEAD[0] + OVERHEAD[1] * texels;
    // One render without options, and one with each except the noise filter, which is applied to the first.
    let seconds = (budget.left() / NAMES.len() as f64 - overhead).min(SECONDS[1]);
    let rates = crate::cmd::study::converge::runs(&session.folder);
    let rates = rates.filter(|m| m.method == run.integrator.name() && m.seconds > 0.1);
    let rate = rates.map(|m| m.paths as f64 / m.seconds).fold(0.0, f64::max);
    if seconds < SECONDS[0].max(LEAST_SAMPLES * texels / rate.max(1e-9)) {
        return Ok(());
    }
    let StudySession { renderer, judge, .. } = &mut *session;
    let Some(reference) = judge.shown_on(renderer, &film) else { return Ok(()) };
    let limit = RenderLimit::Time(Duration::from_secs_f64(seconds));
    budget.say("a render without options");
    let plain = session.renderer.trace(&run, limit)?;
    if plain.driven.interrupted {
        return Ok(());
    }
    let without = shown(session, &plain, &reference)?;
    let keep = |session: &mut StudySession, name: &str, with: Shown, samples: bool| {
        let pair =
            if name == NAMES[0] { [with.stated, without.stated] } else { [with.against, without.against] };
        let error = pair[0].zip(pair[1]).and_then(|(with, without)| with.ratio(&without));
        session.folder.keep(Measurement::Option(OptionPrice {
            name: name.to_string(),
            method: run.integrator.name().to_string(),
            seconds,
            size: [film.width, film.height],
            paths: samples.then(|| with.paths / without.paths.max(1.0)),
            error,
            flip: Some([with.flip, without.flip]),
        }))
    };
    if let Some((picture, rgb)) = session.renderer.filtered(&film, &plain)? {
        let settings = session.renderer.settings.clone();
        let flip = difference(&linear(&picture, &settings), &reference).0;
        let rgb = Grid::from_rows(plain.rgb.width(), plain.rgb.height(), rgb);
        let against = rgb.and_then(|rgb| session.judge.error_of(&rgb)).map(|found| found[0]);
        keep(session, NAMES[1], Shown { stated: None, against, flip, paths: without.paths }, false)?;
    }
    drop(plain);
    let kind = run.integrator;
    let others = [
        (NAMES[0], kind.streams()[0], RunSpec { adaptive: true, ..run.clone() }),
        (NAMES[2], true, RunSpec { reweighted: Some(KAPPA), ..run.clone() }),
    ];
    for (name, possible, run) in others {
        if !possible || process::is_interrupted() || budget.left() < seconds + overhead {
            continue;
        }
        budget.say(&format!("a render with {name}"));
        let traced = session.renderer.trace(&run, limit)?;
        if traced.driven.interrupted {
            return Ok(());
        }
        let with = shown(session, &traced, &reference)?;
        keep(session, name, with, true)?;
    }
    if process::is_interrupted() || budget.left() < seconds {
        return Ok(());
    }
    budget.say("a render with --light-groups");
    match grouped(&mut session.renderer, &run, limit)? {
        Some(paths) => session.folder.keep(Measurement::Option(OptionPrice {
            name: NAMES[3].to_string(),
            method: kind.name().to_string(),
            seconds,
            size: [film.width, film.height],
            paths: Some(paths / without.paths.max(1.0)),
            ..OptionPrice::default()
        })),
        None => Ok(()),
    }
}

/// Error and FLIP of the last render.
fn shown(session: &mut StudySession, traced: &StudyRender, reference: &Grid<[f32; 3]>) -> Result<Shown> {
    let settings = session.renderer.settings.clone();
    let picture = linear(&session.renderer.show(&settings)?, &settings);
    Ok(Shown {
        stated: traced.estimate().map(|stated| stated.relative[1]),
        against: session.judge.error_of(&traced.rgb).map(|found| found[0]),
        flip: difference(&picture, reference).0,
        paths: traced.data.counts.paths() as f64,
    })
}

/// Number of paths in the same time with a picture for each emitter; `None` in a scene without emitters.
fn grouped(renderer: &mut StudyRenderer, run: &RunSpec, limit: RenderLimit) -> Result<Option<f64>> {
    let emitters = emitters(&renderer.desc);
    if emitters.is_empty() {
        return Ok(None);
    }
    let groups = each(emitters, &renderer.scene.lights().power_shares());
    let scene = Arc::new(renderer.scene.with_light_groups(&of_sources(&groups), groups.len()));
    renderer.trace_grouped(run, scene, groups, limit).map(|traced| Some(traced.data.counts.paths() as f64))
}

/// Seed of these renders, different from all runs of the methods.
const SEED: u32 = 0x0a71;
