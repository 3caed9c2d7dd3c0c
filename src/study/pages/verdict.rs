//! Conclusions from a study, shared by all outputs so that they agree: recommended method, cost ratios between methods, most expensive
//! effect.

use crate::study::Interval;
use crate::study::data::{CurvePoint, EffectPrice, MethodResult, Stability, Study, TimeToError};
use crate::study::method_curve::FLAT;

/// Recommended method, with reasons.
pub struct Recommendation<'a> {
    /// The program's method that reaches `error` first.
    pub method: &'a MethodResult,
    /// Relative error (95 % quantile) of the comparison: 1 % if any time to it is known, else the smallest error with a known time.
    pub error: f64,
    /// Time to that error.
    pub seconds: Interval,
    /// False if the time is predicted.
    pub measured: bool,
    /// The program's second-fastest method and the ratio of its time to the winner's; no ratio if it does not reach the error.
    pub second: Option<(&'a MethodResult, Option<Interval>)>,
    /// The best other program and the ratio of its time to the winner's or, if it has no times, of the winner's efficiency to its own.
    pub peer: Option<(&'a MethodResult, Interval)>,
}

/// The program's own methods.
pub fn own(study: &Study) -> Vec<&MethodResult> {
    study.methods.iter().filter(|m| !m.peer).collect()
}

pub fn price(method: &MethodResult, error: f64) -> Option<(&TimeToError, Interval)> {
    let near = |p: &&TimeToError| p.error > 0.0 && (p.error / error).ln().abs() < 0.01;
    let price = method.prices.iter().find(near)?;
    let seconds = price.seconds?.cleaned()?;
    (seconds.value > 0.0).then_some((price, seconds))
}

/// Errors with a time in the study, in descending order, at most six.
pub fn errors(methods: &[MethodResult]) -> Vec<f64> {
    let prices = methods.iter().flat_map(|m| &m.prices);
    let mut errors: Vec<f64> = prices.map(|p| p.error).filter(|e| e.is_finite() && *e > 0.0).collect();
    errors.sort_by(|a, b| b.total_cmp(a));
    errors.dedup_by(|a, b| (*a / *b).ln().abs() < 0.01);
    errors.truncate(6);
    errors
}

/// The recommended method, or `None` if no time is known.
pub fn recommend(study: &Study) -> Option<Recommendation<'_>> {
    let own = own(study);
    let reached = |error: f64| own.iter().any(|m| price(m, error).is_some());
    let error = if reached(0.01) { 0.01 } else { *errors(&study.methods).iter().rfind(|e| reached(**e))? };
    let peers: Vec<&MethodResult> = study.methods.iter().filter(|m| m.peer).collect();
    let best_peer = ranked(&peers, error).into_iter().next();
    let ranked = ranked(&own, error);
    let (method, found) = ranked.first()?;
    let (price, seconds) = (*found)?;
    let second = ranked.get(1).map(|(m, p)| (*m, p.and_then(|(_, s)| s.ratio(&seconds))));
    let over = |(peer, found): Timed<'_>| match found {
        Some((_, theirs)) => theirs.ratio(&seconds),
        None => method.efficiency?.cleaned()?.ratio(&peer.efficiency?.cleaned()?),
    };
    let peer = best_peer.and_then(|peer| Some((peer.0, over(peer)?)));
    Some(Recommendation { method, error, seconds, measured: price.measured, second, peer })
}

/// A method with its time to an error, if known.
type Timed<'a> = (&'a MethodResult, Option<(&'a TimeToError, Interval)>);

/// Methods sorted by time to an error; those that do not reach it come last, by efficiency.
pub fn ranked<'a>(methods: &[&'a MethodResult], error: f64) -> Vec<Timed<'a>> {
    let time = |p: &Option<(&TimeToError, Interval)>| p.map_or(f64::INFINITY, |(_, s)| s.expected());
    let efficiency = |m: &MethodResult| m.efficiency.and_then(|e| e.cleaned()).map_or(0.0, |e| e.value);
    let mut ranked: Vec<_> = methods.iter().map(|m| (*m, price(m, error))).collect();
    ranked
        .sort_by(|(a, p), (b, q)| time(p).total_cmp(&time(q)).then(efficiency(b).total_cmp(&efficiency(a))));
    ranked
}

/// Name of the program's fastest method.
pub fn fastest(study: &Study) -> Option<String> {
    recommend(study).map(|a| a.method.name.clone())
}

/// Final error of a method: at the 95 % quantile if estimated from replicates, else √relMSE.
pub fn error_now(method: &MethodResult) -> Option<(Interval, f64)> {
    method.points.iter().rev().find_map(|point| Some((error_of(point)?, point.seconds)))
}

/// Additional seconds to halve the error, with the error it starts from: from the second-lowest price to the lowest if these are a factor
/// of two apart, else extrapolated from the end of the curve by its slope.
pub fn halving(method: &MethodResult) -> Option<(f64, Interval)> {
    let pair = method.prices.iter().rev().find_map(|p| {
        let from = price(method, 2.0 * p.error)?.1;
        let to = price(method, p.error)?.1;
        let more = to.value - from.value;
        let (low, high) = ((to.low - from.low).min(more).max(0.0), (to.high - from.high).max(more));
        (more > 0.0).then_some((2.0 * p.error, Interval { value: more, low, high }))
    });
    pair.or_else(|| {
        let (error, seconds) = error_now(method).filter(|_| !method.biased)?;
        let slope = method.slope?.cleaned()?;
        let longer = |slope: f64| {
            if slope < -0.01 { seconds * (2f64.powf(-1.0 / slope) - 1.0) } else { f64::INFINITY }
        };
        slope.map(longer).cleaned().map(|more| (error.value, more))
    })
}

/// The effect of the scene with the highest cost per path.
pub fn most_expensive_effect(study: &Study) -> Option<(&EffectPrice, Interval)> {
    let priced = study.effects.iter().filter(|e| e.on).filter_map(|e| Some((e, e.time?.cleaned()?)));
    priced.max_by(|(_, a), (_, b)| a.value.total_cmp(&b.value))
}

pub fn flags(method: &MethodResult) -> Vec<String> {
    let flat = method.flags.is_empty() && flat(method);
    let unflagged = flat.then(|| "slope flatter than −0.4: heavy tail or bias".to_string());
    method.flags.iter().cloned().chain(unflagged).collect()
}

/// Number of rejected samples of a method.
pub fn rejected_samples(of: &Stability) -> u64 {
    of.rejected.iter().fold(0, |n, (_, count, _)| n.saturating_add(*count))
}

/// Rejected samples and checked paths, over all methods.
pub fn rejected(study: &Study) -> (u64, u64) {
    let sum = |f: fn(&Stability) -> u64| study.stability.iter().map(f).fold(0, u64::saturating_add);
    (sum(rejected_samples), sum(|s| s.paths))
}

/// Name of the scene: the file name without directories and `.xml`.
pub fn name(study: &Study) -> String {
    let file = study.scene.rsplit(['/', '\\']).next().unwrap_or("");
    let name = file.strip_suffix(".xml").unwrap_or(file);
    if name.is_empty() { "unnamed scene".into() } else { name.into() }
}

/// Longest time of full-size pictures shared by at least two of the program's methods, or the time of the only one.
pub fn shared_seconds(study: &Study) -> Option<f64> {
    let last = |m: &MethodResult| m.points.iter().rev().find(|p| error_of(p).is_some()).map(|p| p.seconds);
    let mut ends: Vec<f64> = own(study).into_iter().filter_map(last).collect();
    ends.retain(|s| s.is_finite() && *s > 0.0);
    ends.sort_by(|a, b| b.total_cmp(a));
    ends.get(1).or(ends.first()).copied()
}

pub fn at_time(method: &MethodResult, seconds: f64) -> Option<&CurvePoint> {
    let far = |p: &&CurvePoint| (p.seconds / seconds).ln().abs();
    let timed = method.points.iter().filter(|p| p.seconds > 0.0 && p.seconds.is_finite());
    timed.min_by(|a, b| far(a).total_cmp(&far(b)))
}

/// Relative error of a point: at the 95 % quantile if estimated from replicates, else √relMSE.
pub fn error_of(point: &CurvePoint) -> Option<Interval> {
    point.relative.map_or_else(|| point.rel_mse?.root(), |relative| relative[1].cleaned())
}

/// Whether a curve is flatter than −0.4, which indicates a heavy tail, or bias.
pub fn flat(method: &MethodResult) -> bool {
    method.slope.and_then(|s| s.cleaned()).is_some_and(|s| s.value > FLAT)
}

/// Whether any point has a significant bias.
pub fn biased(method: &MethodResult) -> bool {
    method.points.iter().any(CurvePoint::is_biased)
}
