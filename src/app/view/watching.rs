//! The error of the picture and the maps over it: from the observer and the server to the panel.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::Result;

use crate::app::error_report::ErrorReport;
use crate::app::observer::{Beside, Observer};
use crate::app::predictions;
use crate::app::run_spec::RunSpec;
use crate::app::view::viewer::Viewer;
use crate::client::window::panel::{ErrorReadout, MapReadout, Overlay, Scale, Show};
use crate::scene::desc::IntegratorKind;
use crate::server::{COST_CELLS, CostMap};
use crate::study::error::TILE;
use crate::study::prediction::course;
use crate::study::words::{duration, percent, round_percent, when};
use crate::study::{Interval, Quantity, State, Target};

/// The map of costs is drawn anew this often: each time is a texture to be sent.
const REFRESH: Duration = Duration::from_secs(1);

/// Timed paths per cell, in the mean, before the map of costs says more than chance.
const ENOUGH: u64 = 4;

/// What was made for the panel last, to be made anew only from something new.
#[derive(Default)]
pub struct Maps {
    state: Arc<State>,
    error: Option<Arc<MapReadout>>,
    cost: Option<(Instant, Arc<MapReadout>)>,
}

impl Viewer {
    /// Starts the thread that watches the error, where the render is divided into replicates.
    ///
    /// # Errors
    ///
    /// When the system refuses a thread.
    pub fn start_watching(&mut self) -> Result<()> {
        if self.plan.run.replicated {
            let target = Some(self.target());
            self.observer = Some(Observer::start(&self.plan.run, target, Beside::Window)?);
        }
        Ok(())
    }

    /// What somebody chose in the panel.
    fn target(&self) -> Target {
        Target { error: self.controls.target, at: Quantity::P95 }
    }

    /// Tells the observer that the film begins anew: with another render, or with the same one.
    pub fn watch(&mut self, another: bool) {
        let run = RunSpec { film: self.spec(), ..self.plan.run.clone() };
        if another {
            self.maps.cost = None;
        }
        match (&mut self.observer, another) {
            (Some(observer), true) => observer.begin(&run),
            (Some(observer), false) => observer.begin_again(&run),
            (None, _) => {}
        }
    }

    /// Tells the observer what was chosen in the panel.
    pub fn aim(&mut self) {
        let target = Some(self.target());
        if let Some(observer) = &mut self.observer {
            observer.aim(target);
        }
    }

    /// What is known of the last picture; what came of the predictions is logged. For the end.
    pub fn last_error(&self) -> Option<ErrorReport> {
        let observer = self.observer.as_ref()?;
        let (state, kept) = observer.end();
        predictions::log(&RunSpec { film: self.spec(), ..self.plan.run.clone() }, &kept);
        ErrorReport::new(&state, &self.plan.run, (observer.target(), Quantity::P95), state.reached)
    }

    /// The error for the panel.
    pub fn error(&self) -> Option<Arc<ErrorReadout>> {
        let observer = self.observer.as_ref()?;
        let (state, seconds) = (observer.state(), observer.elapsed().as_secs_f64());
        Some(Arc::new(error_readout(&state, self.controls.target, (seconds, self.session.is_through()))))
    }

    /// What is to be laid over the picture.
    pub fn overlay(&mut self, now: Instant) -> Overlay {
        match self.controls.show {
            Show::Picture => Overlay::None,
            Show::ErrorMap => self.error_overlay(),
            Show::CostMap => self.cost_overlay(now),
        }
    }

    fn error_overlay(&mut self) -> Overlay {
        let Some(observer) = &self.observer else {
            return Overlay::Missing(
                "no error map: the picture has one randomisation only (--replicates 1)".into(),
            );
        };
        let state = observer.state();
        if !Arc::ptr_eq(&state, &self.maps.state) {
            self.maps.error = error_map(&state, self.size).map(Arc::new);
            self.maps.state = state;
        }
        match &self.maps.error {
            Some(map) => Overlay::Map(map.clone()),
            None => Overlay::Missing("no error map yet: after 4 samples per pixel".into()),
        }
    }

    fn cost_overlay(&mut self, now: Instant) -> Overlay {
        let missing = match self.plan.run.integrator {
            IntegratorKind::Light => "no cost map: paths do not start at the picture",
            IntegratorKind::Bidirectional => "no cost map: paths from eight places are traced at once",
            _ => "no cost map yet: no path was timed",
        };
        if matches!(self.plan.run.integrator, IntegratorKind::Light | IntegratorKind::Bidirectional) {
            return Overlay::Missing(missing.into());
        }
        if let Some((then, map)) = &self.maps.cost
            && now - *then < REFRESH
        {
            return Overlay::Map(map.clone());
        }
        match cost_map(&self.session.server().cost_map()) {
            Some(map) => {
                let map = Arc::new(map);
                self.maps.cost = Some((now, map.clone()));
                Overlay::Map(map)
            }
            None => Overlay::Missing(missing.into()),
        }
    }
}

/// What the panel shows of a state, `seconds` after the render began.
fn error_readout(state: &State, target: f64, (seconds, ended): (f64, bool)) -> ErrorReadout {
    let Some(last) = state.looks.last() else {
        let words = "not known yet: after 4 samples per pixel".to_owned();
        return ErrorReadout { words, seconds, ..ErrorReadout::default() };
    };
    let error = state.figures.relative[Quantity::P95.index()].value;
    let said = state.prediction.filter(|said| said.target == target && !ended);
    let goal = round_percent(target);
    let words = match said {
        _ if error <= target => {
            let at = crate::study::prediction::reached(&state.looks, target, f64::NEG_INFINITY)
                .unwrap_or(last.seconds);
            format!("{goal} reached after {}", duration(at))
        }
        Some(said) if said.seconds.high > seconds => {
            format!("{goal} in about {}", when(seconds, said.seconds))
        }
        Some(_) => format!("{goal} is due"),
        None if ended => format!("the render ended before {goal}"),
        None => format!("{goal}: not known when"),
    };
    let until = said.map_or(last.seconds, |said| said.seconds.value);
    ErrorReadout {
        now: Some(state.figures.relative.map(in_words)),
        looks: state.looks.iter().map(|look| [look.seconds, look.error]).collect(),
        fit: course(&state.looks, until),
        due: said.map(|said| [said.seconds.value, said.seconds.low, said.seconds.high]),
        words,
        seconds,
    }
}

/// Value and interval: `2.31 %` and `2.19–2.44 %`.
fn in_words(figure: Interval) -> [String; 2] {
    let [value, low, high] = [figure.value, figure.low, figure.high].map(percent);
    [value, format!("{}–{high}", low.trim_end_matches(" %"))]
}

/// The map of the last look; `None` before the first.
fn error_map(state: &State, size: [u32; 2]) -> Option<MapReadout> {
    let (columns, values) = &state.map;
    let rows = values.len().checked_div(*columns).filter(|rows| *rows > 0)?;
    let p95 = state.figures.relative[Quantity::P95.index()].value;
    // Round, so that colours stay where they are for a while.
    let top = round_up(2.0 * p95);
    let cells = |i: usize| f64::from(size[i]) / TILE as f64;
    Some(MapReadout {
        grid: [*columns, rows],
        cells: [cells(0), cells(1)],
        values: values.clone(),
        scale: Scale { low: 0.01 * top, high: top, logarithmic: true },
        show: Show::ErrorMap,
        shares: Vec::new(),
    })
}

/// Microseconds per path; `None` before enough was timed.
fn cost_map(map: &CostMap) -> Option<MapReadout> {
    if map.counts.iter().sum::<u64>() < ENOUGH * (COST_CELLS * COST_CELLS) as u64 {
        return None;
    }
    let micros = |(seconds, count): (&f64, &u64)| if *count > 0 { seconds * 1e6 } else { f64::NAN };
    let values: Vec<f64> = map.seconds.iter().zip(&map.counts).map(micros).collect();
    let mut known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    // A single path that was long by chance must not darken all others.
    let high = known.get(known.len() * 98 / 100).or(known.last()).copied()?;
    Some(MapReadout {
        grid: [COST_CELLS; 2],
        cells: [COST_CELLS as f64; 2],
        values,
        scale: Scale { low: 0.0, high: round_up(high), logarithmic: false },
        shares: map.shares(),
        show: Show::CostMap,
    })
}

/// The next of 1, 2 and 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.max(1e-12).log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| value <= step * decade * 1.000_001);
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Interval;
    use crate::study::curve::Look;
    use crate::study::error::Figures;
    use crate::study::prediction::Prediction;

    fn state() -> State {
        let look = |i: i32| {
            let samples = 1e5 * 1.25f64.powi(i);
            Look { seconds: samples / 1e5, samples, error: 0.1 * (samples / 1e5).powf(-0.6), deviation: 0.02 }
        };
        let looks: Vec<Look> = (0..8).map(look).collect();
        let error = looks[7].error;
        let seconds = Interval { value: 52.0, low: 46.0, high: 65.0 };
        State {
            figures: Figures { relative: [Interval::exact(error); 3], ..Figures::default() },
            prediction: Some(Prediction { at: looks[7].seconds, error, target: 0.01, seconds }),
            looks,
            map: (2, vec![0.1; 6]),
            ..State::default()
        }
    }

    #[test]
    fn the_panel_says_what_is_known() {
        let nothing = error_readout(&State::default(), 0.01, (0.5, false));
        assert_eq!((nothing.words.as_str(), nothing.now), ("not known yet: after 4 samples per pixel", None));
        let state = state();
        let said = error_readout(&state, 0.01, (10.0, false));
        assert_eq!(said.words, "1 % in about 42 s (90 %: 36–55 s)");
        assert_eq!((said.due, said.looks.len()), (Some([52.0, 46.0, 65.0]), 8));
        assert!((said.fit[said.fit.len() - 1][0] - 52.0).abs() < 1e-9);
        assert_eq!(error_readout(&state, 0.01, (70.0, false)).words, "1 % is due");
        assert_eq!(error_readout(&state, 0.01, (70.0, true)).words, "the render ended before 1 %");
        assert_eq!(error_readout(&state, 0.1, (10.0, false)).words, "10 % reached after 1.0 s");
        // Until the observer has heard of another target.
        assert_eq!(error_readout(&state, 0.005, (10.0, false)).words, "0.5 %: not known when");
    }

    #[test]
    fn maps_have_round_scales() {
        assert_eq!([0.07, 0.1, 0.11, 3.0, 7.0].map(round_up), [0.1, 0.1, 0.2, 5.0, 10.0]);
        let map = error_map(&state(), [15, 20]).expect("a look");
        assert_eq!((map.grid, map.cells), ([2, 3], [15.0 / 8.0, 2.5]));
        assert!(error_map(&State::default(), [15, 20]).is_none());
        assert!(cost_map(&CostMap::default()).is_none());
        let n = COST_CELLS * COST_CELLS;
        let mut costs = CostMap { seconds: vec![2e-6; n], counts: vec![9; n] };
        (costs.seconds[3], costs.counts[5]) = (1e-3, 0);
        let map = cost_map(&costs).expect("enough");
        assert!(map.scale.high == 2.0 && map.values[5].is_nan() && (map.values[0] - 2.0).abs() < 1e-9);
    }
}
