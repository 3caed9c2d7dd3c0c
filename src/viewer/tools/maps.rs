//! The maps of error and cost over the picture: which one the user has chosen, and how they are made.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::Ui;

use crate::accounting::observer::Observer;
use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{
    ColorScale, FalseColorMap, MapChoice, PanelData, PictureOverlay, SectionPlace, ToolPresence, choice,
};
use crate::server::{COST_CELLS, CostMap};
use crate::study::error_tile::TILE;
use crate::study::{ErrorQuantile, ErrorStatus};
use crate::viewer::session::RenderSession;
use crate::viewer::tools::tool::{ONLY_FLAT, Tool, ToolContext, ViewChange};

/// Interval at which the cost map is rebuilt, since each rebuild uploads a texture.
const REFRESH: Duration = Duration::from_secs(1);

/// Mean number of timed paths per cell from which on the cost map shows more than noise.
const ENOUGH: u64 = 4;

/// The chosen map, and the most recent maps, each of which is rebuilt only from new data.
#[derive(Default)]
pub struct MapOverlay {
    chosen: MapChoice,
    state: Arc<ErrorStatus>,
    error: Option<Arc<FalseColorMap>>,
    cost: Option<(Instant, Arc<FalseColorMap>)>,
}

impl Tool for MapOverlay {
    type Action = Infallible;

    fn forget(&mut self, change: ViewChange) {
        if change == ViewChange::Epoch {
            self.cost = None;
        }
    }

    fn update(&mut self, context: &mut ToolContext<'_>, data: &mut PanelData) {
        data.overlay = match self.chosen != MapChoice::None && context.panel.looks_around() {
            true => PictureOverlay::Missing(ONLY_FLAT.to_owned()),
            false => self.overlay(context.session, context.picture.observer.as_ref()),
        };
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, _: &mut ActionQueue<Infallible>) {
        if place == SectionPlace::LookTop {
            let kinds =
                [("None", MapChoice::None), ("Error map", MapChoice::Error), ("Cost map", MapChoice::Cost)];
            let hint = "Over the picture its relative error, or the time that paths take by region";
            choice(ui, ("Overlay", hint), &mut self.chosen, &MapChoice::default(), &kinds);
        }
    }

    fn presence(&self, _: &ToolContext<'_>) -> ToolPresence {
        if self.chosen == MapChoice::None { ToolPresence::Hidden } else { ToolPresence::Drawn }
    }
}

impl MapOverlay {
    /// The map that the user has selected, or the reason why there is none.
    fn overlay(&mut self, session: &RenderSession, observer: Option<&Observer>) -> PictureOverlay {
        let map = match (self.chosen, observer) {
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
                _ => self.cost_map(session, Instant::now()).ok_or("no cost map yet: no path was timed"),
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
    use crate::study::{ErrorEstimate, Interval};

    #[test]
    fn maps_have_round_scales() {
        assert_eq!([0.07, 0.1, 0.11, 3.0, 7.0].map(round_up), [0.1, 0.1, 0.2, 5.0, 10.0]);
        let estimate = ErrorEstimate { relative: [Interval::exact(0.03); 3], ..ErrorEstimate::default() };
        let state = ErrorStatus { estimate, map: (2, vec![0.1; 6]), ..ErrorStatus::default() };
        let map = error_map(&state, [15, 20]).expect("a checkpoint");
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
