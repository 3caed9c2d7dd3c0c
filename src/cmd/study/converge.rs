//! Parts 1 and 2: compares the methods by successive halving. All get short renders; those that are significantly slower get no more, and
//! the remaining time goes to the best two.
//!
//! Trials come first: small pictures of the same view, which reach many more samples per pixel in the same time, so that their errors are
//! known ([`time_model`](crate::study::time_model)). Full-size pictures follow, which are displayed and judged.

use std::fmt::Display;
use std::time::{Duration, Instant};

use miette::Result;

use crate::client::FilmSpec;
use crate::cmd::args::study::Peer;
use crate::cmd::study::folder::StudyFolder;
use crate::cmd::study::renderer::RenderLimit;
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::image::Grid;
use crate::image::compare::Picture;
use crate::render::process::tell;
use crate::render::run_spec::RunSpec;
use crate::render::{predictions, process};
use crate::scene::desc::IntegratorKind;
use crate::study::analysis::by_method;
use crate::study::data::{DroppedMethod, TimeToError};
use crate::study::format::significant;
use crate::study::measurement::{FIGURES, Measurement, RenderMeasurement};
use crate::study::method_curve::prices;
use crate::study::time_model::{SizeTransfer, at_least, is_hopeless};

/// Fraction of the time for trials.
const TRIALS: f64 = 0.6;

/// Seconds of the first trial, and of the first full-size picture.
const FIRST: [f64; 2] = [0.3, 1.0];

/// Ratio of the durations of consecutive rounds.
const LONGER: f64 = 3.0;

/// Fraction of the time for the first pictures of every method.
const PREVIEWS: f64 = 0.15;

/// Least samples per pixel of a full-size picture, so that its error is known.
const LEAST_SAMPLES: f64 = 1.3;

/// Seconds of the longest render.
const LONGEST: f64 = 600.0;

/// Error targets named in the answer.
const ASKED: [f64; 2] = [0.05, 0.01];

/// Number of methods in the last rounds.
const LAST: usize = 2;

/// Approximate seconds per pixel for judging a full-size picture at the end.
const JUDGING: f64 = 1.5e-6;

/// The methods of a study and its time.
struct Contest<'a> {
    session: &'a mut StudySession,
    budget: &'a TimeBudget,
    /// Methods still measured.
    alive: Vec<IntegratorKind>,
    /// Overhead in seconds besides the render itself, of a trial and of a full-size picture.
    overhead: [f64; 2],
    /// Number of full-size pictures to judge at the end.
    pictures: usize,
}

/// Measures `methods` until the budget is spent.
pub fn converge(session: &mut StudySession, methods: Vec<IntegratorKind>, budget: &TimeBudget) -> Result<()> {
    let mut contest = Contest { session, budget, alive: methods, overhead: [0.05, 0.3], pictures: 0 };
    contest.previews()?;
    contest.trials()?;
    contest.pictures()?;
    let left = || budget.left();
    let StudySession { renderer, folder, judge, .. } = contest.session;
    budget.say("judging the pictures");
    judge.finish(renderer, folder, &left)
}

impl Contest<'_> {
    /// Seconds left for renders.
    fn left(&self) -> f64 {
        let texels = self.session.renderer.texels();
        self.budget.left() - self.pictures as f64 * JUDGING * texels
    }

    fn is_over(&self) -> bool {
        process::is_interrupted() || self.left() <= 0.0
    }

    /// Pictures after 1/30 and 1/3 s, as far as a small part of the time allows.
    fn previews(&mut self) -> Result<()> {
        let film = self.session.renderer.run.film;
        let texels = self.session.renderer.texels();
        let each: f64 =
            FIGURES[..2].iter().map(|seconds| seconds + self.overhead[1] + JUDGING * texels).sum();
        if self.alive.len() as f64 * each > PREVIEWS * self.left() {
            return Ok(());
        }
        for seconds in &FIGURES[..2] {
            self.round(&self.alive.clone(), film, *seconds)?;
        }
        Ok(())
    }

    /// Rounds of trials, each longer than the last.
    fn trials(&mut self) -> Result<()> {
        let Some(film) = self.session.renderer.trial else { return Ok(()) };
        let end = (1.0 - TRIALS) * self.left();
        // Long enough for some samples per pixel at the speed measured so far.
        let [width, height] = film.padded_extent().map(f64::from);
        let mut seconds = FIRST[0].max(self.seconds_for(LEAST_SAMPLES, width * height).min(3.0));
        while !self.is_over() && seconds <= LONGEST {
            let fit = ((self.left() - end) / (seconds + self.overhead[0])) as usize;
            let wanted = self.ranked();
            let number = if fit >= wanted.len() { wanted.len() } else { LAST.min(wanted.len()) };
            if fit < number {
                break;
            }
            self.round(&wanted[..number], film, seconds)?;
            self.drop_hopeless()?;
            seconds *= LONGER;
        }
        Ok(())
    }

    /// Rounds of full-size pictures; the last one takes the remaining time.
    fn pictures(&mut self) -> Result<()> {
        let film = self.session.renderer.run.film;
        let mut seconds = FIRST[1].max(self.seconds_for(LEAST_SAMPLES, self.session.renderer.texels()));
        let mut last = 0.0;
        while !self.is_over() && seconds <= LONGEST {
            let wanted = self.ranked();
            let left = self.left();
            let judging = JUDGING * self.session.renderer.texels();
            let fits =
                |n: usize, share: f64| n as f64 * (seconds + self.overhead[1] + judging) <= share * left;
            // All methods only if that leaves time for the best.
            let number = (1..=wanted.len()).rev().find(|&n| fits(n, if n > LAST { 0.4 } else { 1.0 }));
            let Some(number) = number.filter(|n| *n >= LAST.min(wanted.len()) || last == 0.0) else {
                let both = LAST.min(wanted.len());
                let rest = left / both as f64 - self.overhead[1] - judging;
                // The remaining time is used for a picture if it is not much shorter than the last.
                if rest >= 0.7 * last && rest > 0.2 {
                    self.round(&wanted[..both], film, rest)?;
                }
                break;
            };
            self.round(&wanted[..number], film, seconds)?;
            self.drop_hopeless()?;
            (last, seconds) = (seconds, LONGER * seconds);
        }
        Ok(())
    }

    /// Seconds in which the fastest method reaches this many samples per pixel in a picture of this many texels; 0 if no speed is known.
    fn seconds_for(&self, samples: f64, texels: f64) -> f64 {
        let rates = self
            .runs()
            .filter(|run| !run.peer && run.seconds > 0.02)
            .map(|run| run.paths as f64 / run.seconds);
        let rate = rates.fold(0.0, f64::max);
        if rate > 0.0 { samples * texels / rate } else { 0.0 }
    }

    /// Renders each of these methods once, unless done already.
    fn round(&mut self, methods: &[IntegratorKind], film: FilmSpec, seconds: f64) -> Result<()> {
        for &kind in methods {
            let is_trial = film != self.session.renderer.run.film;
            let same = |run: &&RenderMeasurement| {
                run.method == kind.name()
                    && run.is_trial == is_trial
                    && run.size == [film.width, film.height]
                    && run.budget == seconds
            };
            if self.is_over() || self.runs().any(|run| same(&run)) {
                continue;
            }
            let start = Instant::now();
            self.render(kind, film, seconds)?;
            let overhead = &mut self.overhead[usize::from(!is_trial)];
            *overhead = 0.5 * (*overhead + (start.elapsed().as_secs_f64() - seconds).max(0.0));
            self.pictures += usize::from(!is_trial);
        }
        Ok(())
    }

    fn render(&mut self, kind: IntegratorKind, film: FilmSpec, seconds: f64) -> Result<()> {
        // Every render of a method gets a different seed.
        let seed = 1 + self.runs().filter(|run| run.method == kind.name()).count() as u32;
        let StudySession { renderer, folder, judge, .. } = &mut *self.session;
        let run = RunSpec { film, ..renderer.run(kind, seed) };
        let is_trial = film != renderer.run.film;
        let what = if is_trial { format!(" at {}×{}", film.width, film.height) } else { String::new() };
        self.budget.say(&format!("{}{what} for {} s", kind.name(), significant(seconds, 2)));
        let traced = renderer.trace(&run, RenderLimit::Time(Duration::from_secs_f64(seconds)))?;
        if traced.driven.interrupted {
            return Ok(());
        }
        if !is_trial {
            predictions::log(&run, &traced.predictions);
        }
        let run = judge.take(renderer, &run, traced, seconds)?;
        folder.keep(Measurement::Run(Box::new(run)))
    }

    fn runs(&self) -> impl Iterator<Item = &RenderMeasurement> {
        runs(&self.session.folder)
    }

    /// Times to the error targets of every method still measured.
    fn standings(&self) -> Vec<(IntegratorKind, Vec<TimeToError>)> {
        let runs: Vec<&RenderMeasurement> = self.runs().filter(|run| !run.peer).collect();
        let methods = by_method(&runs);
        let film = &self.session.renderer.run.film;
        let priced =
            |i: usize| prices(&methods[i], &SizeTransfer::for_method(i, &methods, [film.width, film.height]));
        let of = |kind: &IntegratorKind| {
            let own = methods.iter().position(|runs| runs[0].method == kind.name());
            (*kind, own.map(priced).unwrap_or_default())
        };
        self.alive.iter().map(of).collect()
    }

    /// The methods still measured, fastest first. Methods without a known error follow the fastest: on a busy machine a short render may
    /// have too few samples.
    fn ranked(&self) -> Vec<IntegratorKind> {
        let time = |prices: &[TimeToError]| {
            let known = prices.iter().filter_map(|price| price.seconds).map(|seconds| seconds.expected());
            // Times to different targets rank methods alike, but not all methods have all of them.
            let (sum, count) = known.fold((0.0, 0.0), |(sum, n), value| (sum + value.ln(), n + 1.0));
            (count > 0.0).then_some(sum / count)
        };
        let standings = self.standings();
        let timed = standings.iter().filter_map(|(kind, prices)| Some((*kind, time(prices)?)));
        let mut timed: Vec<(IntegratorKind, f64)> = timed.collect();
        timed.sort_by(|a, b| a.1.total_cmp(&b.1));
        let is_timed = |kind: &IntegratorKind| timed.iter().any(|(other, _)| other == kind);
        let unknown = self.alive.iter().copied().filter(|kind| !is_timed(kind));
        let mut ranked: Vec<IntegratorKind> = timed.iter().take(1).map(|(kind, _)| *kind).collect();
        ranked.extend(unknown);
        ranked.extend(timed.iter().skip(1).map(|(kind, _)| *kind));
        ranked
    }

    /// Drops methods that are significantly slower than another to either error target.
    fn drop_hopeless(&mut self) -> Result<()> {
        let standings = self.standings();
        let mut dropped = Vec::new();
        for (kind, prices) in &standings {
            let faster = |(other, theirs): &(IntegratorKind, Vec<TimeToError>)| {
                let asked = prices.iter().zip(theirs).filter(|(own, _)| ASKED.contains(&own.error));
                let times: Vec<_> = asked.filter_map(|(own, other)| own.seconds.zip(other.seconds)).collect();
                let all = other != kind
                    && !times.is_empty()
                    && times.iter().all(|(own, other)| is_hopeless(own, other));
                all.then(|| {
                    times.iter().map(|(own, other)| at_least(own, other)).fold(f64::INFINITY, f64::min)
                })
                .map(|factor| (*other, factor))
            };
            let best = standings.iter().filter_map(faster).max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((best, factor)) = best {
                let (best, factor) = (best.name(), significant(factor, 2));
                let reason = format!("takes at least {factor} times as long as {best}");
                self.budget.say(&format!("{} {reason}: no more of it", kind.name()));
                dropped.push(DroppedMethod { method: kind.name().to_string(), reason });
            }
        }
        self.alive.retain(|kind| !dropped.iter().any(|dropped| dropped.method == kind.name()));
        dropped.into_iter().try_for_each(|dropped| self.session.folder.keep(Measurement::Dropped(dropped)))
    }
}

/// The renders of a study so far.
pub fn runs(folder: &StudyFolder) -> impl Iterator<Item = &RenderMeasurement> {
    folder.measurements.iter().filter_map(|measured| match measured {
        Measurement::Run(run) => Some(run.as_ref()),
        _ => None,
    })
}

/// Paths per second of a method in its longest render so far; 0 if there is none.
pub fn speed(folder: &StudyFolder, method: IntegratorKind) -> f64 {
    let own = runs(folder).filter(|run| !run.peer && run.method == method.name() && run.seconds > 0.0);
    let longest = own.max_by(|a, b| a.seconds.total_cmp(&b.seconds));
    longest.map_or(0.0, |run| run.paths as f64 / run.seconds)
}

/// Measures the errors of pictures by other programs.
pub fn peers(session: &mut StudySession, peers: &[Peer]) -> Result<()> {
    let StudySession { renderer, folder, judge, .. } = session;
    for peer in peers {
        let failed = |error: &dyn Display| miette::miette!("--peer {}: {error}", peer.name);
        let mut picture = Picture::read(&peer.file, None).map_err(|error| failed(&error))?;
        let black = blacken(&mut picture.rgb);
        if black > 0 {
            tell(&format!("note: --peer {}: {black} pixels are not finite; they count as black", peer.name));
        }
        let judged = judge.peer(renderer, &picture.rgb).map_err(|error| failed(&error))?;
        folder.keep(Measurement::Run(Box::new(RenderMeasurement {
            method: peer.name.clone(),
            peer: true,
            budget: peer.seconds,
            seconds: peer.seconds,
            ..judged
        })))?;
    }
    Ok(())
}

/// Sets non-finite pixels to black and counts them.
fn blacken(rgb: &mut Grid<[f32; 3]>) -> usize {
    let bad = rgb.pixels_mut().iter_mut().filter(|rgb| !rgb.iter().all(|c| c.is_finite()));
    bad.map(|rgb| *rgb = [0.0; 3]).count()
}
