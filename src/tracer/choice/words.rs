//! The reason of a choice, for people.

use crate::scene::desc::IntegratorKind;

use super::decide::Rating;
use super::survey::Survey;

/// Light that a method misses is told from this share on.
const WORTH_TELLING: f64 = 0.02;

/// One sentence without its end.
pub(super) fn reason(kind: IntegratorKind, survey: &Survey, ratings: &[Rating]) -> String {
    let of = |kind: IntegratorKind| ratings.iter().find(|r| r.kind == kind);
    let (Some(path), Some(chosen)) = (of(IntegratorKind::Path), of(kind)) else {
        return "nothing else was tried".to_string();
    };
    if survey.lights == 0 || ratings.iter().all(|r| r.mean <= 0.0) {
        return "no light was found, so every method shows the same".to_string();
    }
    let mut parts = Vec::new();
    // The brightest: the others may have missed some.
    let all = ratings.iter().filter(|r| r.complete).map(|r| r.mean).fold(0.0, f64::max);
    let indirect = (1.0 - survey.direct / all).clamp(0.0, 1.0);
    parts.push(match kind == IntegratorKind::Path && indirect < 0.5 {
        true => format!("{} of what is seen arrives with one bounce or none", percent(1.0 - indirect)),
        false => format!("{} of what is seen arrives over 2 or more bounces", percent(indirect)),
    });
    if path.missed >= WORTH_TELLING && kind != IntegratorKind::Path {
        parts.push(format!("trial paths from the camera missed {} of the light", percent(path.missed)));
    }
    let mut rivals: Vec<&Rating> = ratings.iter().filter(|r| r.kind != kind && r.complete).collect();
    rivals.sort_by(|a, b| a.time().total_cmp(&b.time()));
    for rival in rivals {
        parts.push(compare(rival, rival.time() / chosen.time()));
    }
    if ratings.iter().any(|r| !r.complete) {
        let seen = percent(survey.delta_seen);
        parts.push(format!("particles alone cannot show mirrors and glass ({seen} of the picture)"));
    }
    parts.join("; ")
}

/// `ratio`: time of the rival over that of the chosen method.
fn compare(rival: &Rating, ratio: f64) -> String {
    let name = match rival.kind {
        IntegratorKind::Path | IntegratorKind::Auto => "camera paths",
        IntegratorKind::Light => "particles",
        IntegratorKind::Bidirectional => "paths from both ends",
        IntegratorKind::Photon => "photons",
    };
    match ratio {
        r if !r.is_finite() || r > 1000.0 => format!("{name} need over 1000 times as long"),
        r if r >= 10.0 => format!("{name} need {r:.0} times as long"),
        r if r >= 1.05 => format!("{name} need {r:.1} times as long"),
        r if r >= 0.95 => format!("{name} need as long"),
        r => format!("{name} would gain too little to be sure of ({:.1} times as fast)", 1.0 / r),
    }
}

fn percent(share: f64) -> String {
    match share * 100.0 {
        p if p > 0.0 && p < 1.0 => "under 1 %".to_string(),
        p if p < 100.0 && p > 99.0 => "over 99 %".to_string(),
        p => format!("{p:.0} %"),
    }
}
