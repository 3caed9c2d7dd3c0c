//! Error and cost maps over the picture, and the error figures of the panel: from the observer and the server to plain data.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::accounting::observer::Observer;
use crate::client::window::panel::{
    ColorScale, ErrorSummary, FalseColorMap, MapChoice, PictureOverlay, UnfoundSummary,
};
use crate::render::method;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::IntegratorKind;
use crate::server::{COST_CELLS, CostMap};
use crate::study::error_tile::TILE;
use crate::study::format::{duration, percent, remaining, round_percent};
use crate::study::prediction::predicted_curve;
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, Interval};
use crate::viewer::session::RenderSession;

/// Interval at which the cost map is rebuilt, since each rebuild uploads a texture.
const REFRESH: Duration = Duration::from_secs(1);

/// Mean number of timed paths per cell from which on the cost map shows more than noise.
const ENOUGH: u64 = 4;

/// The most recent maps; each is rebuilt only from new data.
#[derive(Default)]
pub struct MapCache {
    state: Arc<ErrorStatus>,
    error: Option<Arc<FalseColorMap>>,
    cost: Option<(Instant, Arc<FalseColorMap>)>,
}

impl MapCache {
    /// Discards the cost map for another epoch.
    pub fn begin_epoch(&mut self) {
        self.cost = None;
    }

    /// The map that the user has selected, or the reason why there is none.
    pub fn overlay(
        &mut self,
        choice: MapChoice,
        session: &RenderSession,
        observer: Option<&Observer>,
        now: Instant,
    ) -> PictureOverlay {
        let map = match (choice, observer) {
            // The comparison builds its own maps.
            (MapChoice::None | MapChoice::Difference | MapChoice::Flip, _) => return PictureOverlay::None,
            (MapChoice::Error, None) => {
                Err("no error map: the picture has one randomisation only (--replicates 1)")
            }
            (MapChoice::Error, Some(observer)) => self
                .error_map(observer.state(), session.size())
                .ok_or("no error map yet: after 4 samples per pixel"),
            (MapChoice::Cost, _) => match session.run_spec().integrator {
                kind if !kind.streams()[0] => Err("no cost map: paths do not start at the picture"),
                kind if kind.paths_per_index() > 1 => {
                    Err("no cost map: paths from several places are traced at once")
                }
                _ if session.is_in_region() => Err("no cost map: a region is traced"),
                _ if session.tracers.server().is_none() => Err("no cost map: paths are traced elsewhere"),
                _ => self.cost_map(session, now).ok_or("no cost map yet: no path was timed"),
            },
        };
        map.map_or_else(|why| PictureOverlay::Missing(why.into()), PictureOverlay::Map)
    }

    fn error_map(&mut self, state: Arc<ErrorStatus>, size: [u32; 2]) -> Option<Arc<FalseColorMap>> {
        if !Arc::ptr_eq(&state, &self.state) {
            self.error = error_map(&state, size).map(Arc::new);
            self.state = state;
        }
        self.error.clone()
    }

    fn cost_map(&mut self, session: &RenderSession, now: Instant) -> Option<Arc<FalseColorMap>> {
        if self.cost.as_ref().is_none_or(|(made, _)| now - *made >= REFRESH) {
            self.cost =
                session.tracers.cost_map().and_then(|map| cost_map(&map)).map(|map| (now, Arc::new(map)));
        }
        self.cost.as_ref().map(|(_, map)| map.clone())
    }
}

/// The error of the picture for the panel. `ended`: the render has ended. `filtered`: error estimate of the denoised picture, if that is
/// displayed.
pub fn error_summary(
    observer: &Observer,
    run: &RunSpec,
    target: f64,
    ended: bool,
    filtered: Option<Option<&ErrorEstimate>>,
) -> ErrorSummary {
    let state = observer.state();
    let filtered = filtered.map(|error| filtered_words(error.filter(|_| run.states_filtered_error(&state))));
    let seconds = observer.elapsed().as_secs_f64();
    ErrorSummary { filtered, ..summary(&state, target, seconds, ended, run.is_blurred()) }
}

fn filtered_words(error: Option<&ErrorEstimate>) -> String {
    match error.map(|error| in_words(error.relative[ErrorQuantile::P95.index()])) {
        Some([value, interval]) => format!("{value} ({interval}) through the noise filter"),
        None => "The error through the noise filter is not known".to_owned(),
    }
}

/// The error for the panel, `seconds` after the render began.
fn summary(state: &ErrorStatus, target: f64, seconds: f64, ended: bool, blurs: bool) -> ErrorSummary {
    let Some(last) = state.checkpoints.last() else {
        let message = "not known yet: after 4 samples per pixel".to_owned();
        return ErrorSummary { message, seconds, ..ErrorSummary::default() };
    };
    let error = state.estimate.relative[ErrorQuantile::P95.index()].value;
    let said = state.prediction.filter(|said| said.target == target && !ended);
    let goal = round_percent(target);
    let message = match said {
        _ if error <= target => {
            let at = crate::study::prediction::time_reached(&state.checkpoints, target, f64::NEG_INFINITY)
                .unwrap_or(last.seconds);
            format!("{goal} reached after {}", duration(at))
        }
        Some(said) if said.seconds.high > seconds => {
            format!("{goal} in about {}", remaining(seconds, said.seconds))
        }
        Some(_) => format!("{goal} is due"),
        None if ended => format!("the render ended before {goal}"),
        None => format!("{goal}: not known when"),
    };
    let until = said.map_or(last.seconds, |said| said.seconds.value);
    ErrorSummary {
        quantiles: Some(state.estimate.relative.map(in_words)),
        filtered: None,
        checkpoints: state.checkpoints.iter().map(|c| [c.seconds, c.error]).collect(),
        fit: predicted_curve(&state.checkpoints, until, blurs),
        prediction: said.map(|said| [said.seconds.value, said.seconds.low, said.seconds.high]),
        message,
        unfound: state.late.unfound().map(|text| UnfoundSummary {
            text,
            method: state.late.kind().and_then(method::that_finds).map(IntegratorKind::name),
        }),
        warning: state.late.warning(),
        seconds,
        compared: Vec::new(),
    }
}

/// Value and interval: `2.31 %` and `2.19–2.44 %`.
fn in_words(figure: Interval) -> [String; 2] {
    let [value, low, high] = [figure.value, figure.low, figure.high].map(percent);
    [value, format!("{}–{high}", low.trim_end_matches(" %"))]
}

/// Map of the errors at the last checkpoint; `None` before the first.
fn error_map(state: &ErrorStatus, size: [u32; 2]) -> Option<FalseColorMap> {
    let (columns, values) = &state.map;
    let rows = values.len().checked_div(*columns).filter(|rows| *rows > 0)?;
    let p95 = state.estimate.relative[ErrorQuantile::P95.index()].value;
    // Rounded, so that the colour scale stays constant for a while.
    let top = round_up(2.0 * p95);
    let cells = |i: usize| f64::from(size[i]) / TILE as f64;
    Some(FalseColorMap {
        grid: [*columns, rows],
        cells: [cells(0), cells(1)],
        values: values.clone(),
        scale: ColorScale { low: 0.01 * top, high: top, logarithmic: true },
        kind: MapChoice::Error,
        shares: Vec::new(),
    })
}

/// The map of microseconds per path; `None` before enough paths were timed.
fn cost_map(map: &CostMap) -> Option<FalseColorMap> {
    if map.counts.iter().sum::<u64>() < ENOUGH * (COST_CELLS * COST_CELLS) as u64 {
        return None;
    }
    let micros = |(seconds, count): (&f64, &u64)| if *count > 0 { seconds * 1e6 } else { f64::NAN };
    let values: Vec<f64> = map.seconds.iter().zip(&map.counts).map(micros).collect();
    let mut known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    // 98th percentile: a single path that was slow by chance must not compress the scale for all others.
    let high = known.get(known.len() * 98 / 100).or(known.last()).copied()?;
    Some(FalseColorMap {
        grid: [COST_CELLS; 2],
        cells: [COST_CELLS as f64; 2],
        values,
        scale: ColorScale { low: 0.0, high: round_up(high), logarithmic: false },
        shares: map.shares(),
        kind: MapChoice::Cost,
    })
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.max(1e-12).log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| value <= step * decade * 1.000_001);
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Interval;
    use crate::study::curve::Checkpoint;
    use crate::study::error::ErrorEstimate;
    use crate::study::prediction::Prediction;

    fn state() -> ErrorStatus {
        let checkpoint = |i: i32| {
            let samples = 1e5 * 1.25f64.powi(i);
            Checkpoint {
                seconds: samples / 1e5,
                samples,
                error: 0.1 * (samples / 1e5).powf(-0.6),
                deviation: 0.02,
            }
        };
        let checkpoints: Vec<Checkpoint> = (0..8).map(checkpoint).collect();
        let error = checkpoints[7].error;
        let seconds = Interval { value: 52.0, low: 46.0, high: 65.0 };
        ErrorStatus {
            estimate: ErrorEstimate { relative: [Interval::exact(error); 3], ..ErrorEstimate::default() },
            prediction: Some(Prediction { at: checkpoints[7].seconds, error, target: 0.01, seconds }),
            checkpoints,
            map: (2, vec![0.1; 6]),
            ..ErrorStatus::default()
        }
    }

    #[test]
    fn the_panel_says_what_is_known() {
        let nothing = summary(&ErrorStatus::default(), 0.01, 0.5, false, false);
        assert_eq!(
            (nothing.message.as_str(), nothing.quantiles),
            ("not known yet: after 4 samples per pixel", None)
        );
        let state = state();
        let said = summary(&state, 0.01, 10.0, false, false);
        assert_eq!(said.message, "1 % in about 42 s (90 %: 36–55 s)");
        assert_eq!((said.prediction, said.checkpoints.len()), (Some([52.0, 46.0, 65.0]), 8));
        assert!((said.fit[said.fit.len() - 1][0] - 52.0).abs() < 1e-9);
        assert_eq!(summary(&state, 0.01, 70.0, false, false).message, "1 % is due");
        assert_eq!(summary(&state, 0.01, 70.0, true, false).message, "the render ended before 1 %");
        assert_eq!(summary(&state, 0.1, 10.0, false, false).message, "10 % reached after 1.0 s");
        // Until the observer takes over the new target.
        assert_eq!(summary(&state, 0.005, 10.0, false, false).message, "0.5 %: not known when");
    }

    #[test]
    fn maps_have_round_scales() {
        assert_eq!([0.07, 0.1, 0.11, 3.0, 7.0].map(round_up), [0.1, 0.1, 0.2, 5.0, 10.0]);
        let map = error_map(&state(), [15, 20]).expect("a checkpoint");
        assert_eq!((map.grid, map.cells), ([2, 3], [15.0 / 8.0, 2.5]));
        assert!(error_map(&ErrorStatus::default(), [15, 20]).is_none());
        assert!(cost_map(&CostMap::default()).is_none());
        let n = COST_CELLS * COST_CELLS;
        let mut costs = CostMap { seconds: vec![2e-6; n], counts: vec![9; n] };
        (costs.seconds[3], costs.counts[5]) = (1e-3, 0);
        let map = cost_map(&costs).expect("enough");
        assert!(map.scale.high == 2.0 && map.values[5].is_nan() && (map.values[0] - 2.0).abs() < 1e-9);
    }
}
