//! What follows from a study: which method to use, what a method costs against another, what is dearest.

use crate::study::Interval;
use crate::study::data::{EffectPrice, Method, Point, Price, Study};
use crate::study::interval::Z90;
use crate::study::method::FLAT;
use crate::study::pages::number::{clean, root};

/// The method to use and why.
pub struct Answer<'a> {
    /// The winner: the program's own method that is soonest at `error`.
    pub method: &'a Method,
    /// Relative error at 95 % of the picture that decided: 1 % if any method gets there, else the least that one does.
    pub error: f64,
    /// Its time to that error.
    pub seconds: Interval,
    /// False if the curve was drawn further.
    pub measured: bool,
    /// The next of its own methods and its time over the winner's; no ratio where it does not get there.
    pub second: Option<(&'a Method, Option<Interval>)>,
    /// The best of other programs and its time over the winner's, or where it has no prices the winner's efficiency over its.
    pub peer: Option<(&'a Method, Interval)>,
}

/// The price of an error, if the method has it.
pub fn price(method: &Method, error: f64) -> Option<(&Price, Interval)> {
    let near = |p: &&Price| p.error > 0.0 && (p.error / error).ln().abs() < 0.01;
    let price = method.prices.iter().find(near)?;
    let seconds = clean(price.seconds.as_ref()?)?;
    (seconds.value > 0.0).then_some((price, seconds))
}

/// Every error that has a price in the study, falling, at most six.
pub fn errors(methods: &[Method]) -> Vec<f64> {
    let prices = methods.iter().flat_map(|m| &m.prices);
    let mut errors: Vec<f64> = prices.map(|p| p.error).filter(|e| e.is_finite() && *e > 0.0).collect();
    errors.sort_by(|a, b| b.total_cmp(a));
    errors.dedup_by(|a, b| (*a / *b).ln().abs() < 0.01);
    errors.truncate(6);
    errors
}

/// The method to use, or `None` if no price is known.
pub fn answer(study: &Study) -> Option<Answer<'_>> {
    let own: Vec<&Method> = study.methods.iter().filter(|m| !m.peer).collect();
    let reached = |error: f64| own.iter().any(|m| price(m, error).is_some());
    let error = if reached(0.01) { 0.01 } else { *errors(&study.methods).iter().rfind(|e| reached(**e))? };
    let ranked = ranked(&own, error);
    let (method, found) = ranked.first()?;
    let (price, seconds) = (*found)?;
    let second = ranked.get(1).map(|(m, p)| (*m, p.and_then(|(_, s)| ratio(&s, &seconds))));
    let peers: Vec<&Method> = study.methods.iter().filter(|m| m.peer).collect();
    Some(Answer {
        method,
        error,
        seconds,
        measured: price.measured,
        second,
        peer: peer(&peers, method, error, &seconds),
    })
}

/// The methods by their time to an error; those that do not get there last, by efficiency.
pub fn ranked<'a>(methods: &[&'a Method], error: f64) -> Vec<(&'a Method, Option<(&'a Price, Interval)>)> {
    let mut ranked: Vec<_> = methods.iter().map(|m| (*m, price(m, error))).collect();
    ranked.sort_by(|(a, p), (b, q)| {
        let time = |p: &Option<(&Price, Interval)>| p.map_or(f64::INFINITY, |(_, s)| s.value);
        time(p).total_cmp(&time(q)).then(efficiency(b).total_cmp(&efficiency(a)))
    });
    ranked
}

fn efficiency(method: &Method) -> f64 {
    method.efficiency.as_ref().and_then(clean).map_or(0.0, |e| e.value)
}

fn peer<'a>(
    peers: &[&'a Method],
    winner: &Method,
    error: f64,
    seconds: &Interval,
) -> Option<(&'a Method, Interval)> {
    let (method, found) = ranked(peers, error).into_iter().next()?;
    let over = match found {
        Some((_, theirs)) => ratio(&theirs, seconds),
        None => ratio(&clean(winner.efficiency.as_ref()?)?, &clean(method.efficiency.as_ref()?)?),
    };
    Some((method, over?))
}

/// `a / b` of independent positive figures, their logarithms taken as normal.
pub fn ratio(a: &Interval, b: &Interval) -> Option<Interval> {
    let sigma = |i: &Interval| {
        let width = if i.low > 0.0 && i.high.is_finite() { (i.high / i.low).ln() } else { 0.0 };
        width / (2.0 * Z90)
    };
    let value = a.value / b.value;
    (a.value > 0.0 && b.value > 0.0 && value.is_finite())
        .then(|| Interval::of_log(value, sigma(a).hypot(sigma(b))))
}

/// The error at which a method ended: that of 95 % of the picture if its replicates tell, else the root of relMSE.
pub fn error_now(method: &Method) -> Option<(Interval, f64)> {
    let last = method.points.last()?;
    Some((error_of(last)?, last.seconds))
}

/// Seconds that halving the error takes on top: from the second-lowest price to the lowest if these are a factor of two
/// apart, else from the end of the curve by its slope. With the error from which it is reckoned.
pub fn halving(method: &Method) -> Option<(f64, Interval)> {
    let pair = method.prices.iter().rev().find_map(|p| {
        let from = price(method, 2.0 * p.error)?.1;
        let to = price(method, p.error)?.1;
        let more = to.value - from.value;
        let (low, high) = ((to.low - from.low).min(more).max(0.0), (to.high - from.high).max(more));
        (more > 0.0).then_some((2.0 * p.error, Interval { value: more, low, high }))
    });
    pair.or_else(|| {
        let (error, seconds) = error_now(method).filter(|_| !method.biased)?;
        let slope = clean(method.slope.as_ref()?)?;
        let longer = |slope: f64| {
            if slope < -0.01 { seconds * (2f64.powf(-1.0 / slope) - 1.0) } else { f64::INFINITY }
        };
        clean(&slope.map(longer)).map(|more| (error.value, more))
    })
}

/// The effect of the scene that costs most per path.
pub fn dearest(study: &Study) -> Option<(&EffectPrice, Interval)> {
    let priced = study.effects.iter().filter(|e| e.on).filter_map(|e| Some((e, clean(e.time.as_ref()?)?)));
    priced.max_by(|(_, a), (_, b)| a.value.total_cmp(&b.value))
}

/// Every flag with its method.
pub fn flags(study: &Study) -> Vec<(&str, &str)> {
    study.methods.iter().flat_map(|m| m.flags.iter().map(|f| (m.name.as_str(), f.as_str()))).collect()
}

/// Samples that were not finite, over all methods, and paths looked at.
pub fn rejected(study: &Study) -> (u64, u64) {
    study.stability.iter().fold((0u64, 0u64), |(bad, paths), s| {
        let more = s.rejected.iter().fold(0u64, |n, (_, count, _)| n.saturating_add(*count));
        (bad.saturating_add(more), paths.saturating_add(s.paths))
    })
}

/// A share of successes with its 90 % interval, after Wilson. `None` of nothing.
pub fn share(held: usize, known: usize) -> Option<Interval> {
    if known == 0 {
        return None;
    }
    let (n, z2) = (known as f64, Z90 * Z90);
    let p = held.min(known) as f64 / n;
    let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z90 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    Some(Interval { value: p, low: (middle - half).max(0.0), high: (middle + half).min(1.0) })
}

/// The scene's name: the file's, without folders and `.xml`.
pub fn name(study: &Study) -> String {
    let file = study.scene.rsplit(['/', '\\']).next().unwrap_or("");
    let name = file.strip_suffix(".xml").unwrap_or(file);
    if name.is_empty() { "unnamed scene".into() } else { name.into() }
}

/// The longest time that all of the program's own methods had.
pub fn shared_seconds(study: &Study) -> Option<f64> {
    let ends = study.methods.iter().filter(|m| !m.peer).filter_map(|m| Some(m.points.last()?.seconds));
    ends.filter(|s| s.is_finite() && *s > 0.0).min_by(f64::total_cmp)
}

/// The point of a method that is nearest to a time.
pub fn at_time(method: &Method, seconds: f64) -> Option<&Point> {
    let far = |p: &&Point| (p.seconds / seconds).ln().abs();
    let timed = method.points.iter().filter(|p| p.seconds > 0.0 && p.seconds.is_finite());
    timed.min_by(|a, b| far(a).total_cmp(&far(b)))
}

/// The relative error of a point: that of 95 % of the picture if its replicates tell, else the root of relMSE.
pub fn error_of(point: &Point) -> Option<Interval> {
    point.relative.as_ref().map_or_else(|| root(&point.rel_mse), |[_, p95, _]| clean(p95))
}

/// True where a curve is flatter than −0.4: a heavy tail, or bias.
pub fn flat(method: &Method) -> bool {
    method.slope.as_ref().and_then(clean).is_some_and(|s| s.value > FLAT)
}

/// True where a point at least is off by more than noise.
pub fn biased(method: &Method) -> bool {
    method.points.iter().any(Point::is_biased)
}
