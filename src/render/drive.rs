//! Moves samples from the lanes to the client until a render is done: the client's main loop without a window.

use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::accounting::observer::Observer;
use crate::client::{ClientError, Film};
use crate::render::film_writer::FilmWriter;
use crate::render::light_groups::GroupFilms;
use crate::render::live_outputs::LiveOutputs;
use crate::render::process;
use crate::render::progress::Progress;
use crate::render::state::Recorder;
use crate::render::stereo::RightEye;
use crate::render::timings::TimingCapture;
use crate::render::watch::RenderWatch;
use crate::server::Server;
use crate::stream::block::Block;
use crate::stream::{DrainOrder, Drained, Epoch, Event, FinishReason, Lanes};
use crate::study::{ErrorQuantile, ErrorStatus};

/// Samples taken from the lanes between polls of clock, Ctrl-C and progress bar.
const BUDGET: usize = 1 << 16;

/// Parameters of draining a render.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    pub epoch: Epoch,
    /// First index of the range.
    pub first_index: u64,
    /// Rasterise in index order, so that the picture does not depend on the number of threads.
    pub deterministic: bool,
    /// Stop after this long.
    pub time: Option<Duration>,
    /// Texels of the film, to report samples per pixel.
    pub texels: f64,
    /// The error quantile that is displayed, and at which the render stops if the observer has a target.
    pub quantity: ErrorQuantile,
}

/// The outcome of draining a render.
#[derive(Clone, Debug, Default)]
pub struct DriveOutcome {
    /// Wall time from start to the last sample on the film.
    pub wall: Duration,
    /// The part of `wall` that was spent in the client.
    pub rasterise: Duration,
    /// Ctrl-C or the caller that watches ended the render.
    pub interrupted: bool,
    /// A path panicked and ended the render: its index and the panic's message.
    pub panicked: Option<(u64, String)>,
    /// Every index of the range was traced.
    pub complete: bool,
    /// Stopped because the error was small enough.
    pub reached: bool,
}

/// Consumers of a render's progress.
pub struct DriveObservers<'a, 'r> {
    pub bar: &'a Progress,
    /// Capture of `--gpu-timings`, if requested.
    pub timings: &'a mut Option<TimingCapture>,
    /// Error observer, if there is one.
    pub observer: Option<&'a Observer>,
    /// Writer of the state on disk, if any. Requires index order.
    pub recorder: Option<&'a mut Recorder>,
    /// Live display and snapshots, if any.
    pub live: Option<&'a mut LiveOutputs<'r>>,
    /// Films of light groups, if any.
    pub groups: Option<&'a mut GroupFilms>,
    /// The right eye, if the film is the left eye's.
    pub right_eye: Option<&'a mut RightEye>,
    /// The caller, if it watches.
    pub watch: Option<RenderWatch<'a>>,
}

/// Drains until the server reports that the render has finished and the lanes are empty, then rasterises the rest.
///
/// # Errors
///
/// The client's first error, after which the render is aborted. A path that panics is not an error here: the samples traced before it still
/// form a picture.
pub fn drive(
    drive: Drive,
    server: &Server,
    lanes: &mut Lanes,
    client: &mut dyn Film,
    onlookers: DriveObservers<'_, '_>,
) -> Result<DriveOutcome> {
    let DriveObservers {
        bar,
        timings,
        observer,
        mut recorder,
        mut live,
        mut groups,
        mut right_eye,
        mut watch,
    } = onlookers;
    let start = Instant::now();
    let mut driven = DriveOutcome::default();
    let order = match drive.deterministic {
        true => DrainOrder::Index { first: drive.first_index },
        false => DrainOrder::Arrival,
    };
    lanes.follow(drive.epoch, order);
    let mut aborted = false;
    loop {
        let rasterise = Instant::now();
        let onto = FilmWriter::new(client, observer)
            .with_groups(groups.as_deref_mut())
            .with_right_eye(right_eye.as_deref_mut());
        let drained =
            take(drive, lanes, onto, recorder.as_deref_mut(), &mut driven.reached).into_diagnostic()?;
        driven.rasterise += rasterise.elapsed();
        if let Some(recorder) = recorder.as_mut().filter(|recorder| recorder.is_due()) {
            recorder.save(client, observer, right_eye.as_deref_mut())?;
        }
        if let Some(live) = &mut live {
            live.update(client, observer, right_eye.as_deref_mut(), server)?;
        }
        if let Some(timings) = timings {
            if drained.blocks > 0 {
                timings.client("drain", rasterise)?;
            }
            timings.frame(Some(server))?;
        }
        let right_observer = right_eye.as_deref().and_then(|eye| eye.observer.as_ref());
        let states = [observer, right_observer].map(|observer| observer.map(Observer::state));
        let shown = worse(states.each_ref().map(Option::as_deref), drive.quantity);
        bar.update(client.counts().paths(), drive.texels, start.elapsed(), shown);
        let reached = shown.is_some() && states.iter().flatten().all(|state| state.reached);
        driven.reached |= !drive.deterministic && reached;
        if let Some(watch) = &mut watch {
            let state = shown.map(|(state, _)| state);
            driven.interrupted |= watch.look(client, state, bar.share(), start.elapsed(), drive.texels);
        }
        if lanes.is_drained() {
            break;
        }
        if drained.blocks == 0 {
            let start = Instant::now();
            lanes.wait(Duration::from_millis(20));
            note(timings, "wait for samples", start)?;
        }
        let late = drive.time.is_some_and(|limit| start.elapsed() >= limit);
        driven.interrupted |= process::is_interrupted();
        if !aborted && (late || driven.interrupted || driven.reached) {
            server.abort();
            aborted = true;
        }
    }
    while let Some(Event::Finished { epoch, reason, .. }) = server.event() {
        match reason {
            _ if epoch != drive.epoch => {}
            FinishReason::Complete => driven.complete = true,
            FinishReason::Aborted => {}
            FinishReason::Panicked { index, message } => driven.panicked = Some((index, message)),
        }
    }
    let rasterise = Instant::now();
    client.flush().into_diagnostic()?;
    groups.map_or(Ok(()), GroupFilms::flush).into_diagnostic()?;
    right_eye.as_deref_mut().map_or(Ok(()), |eye| eye.film.flush()).into_diagnostic()?;
    if let Some(recorder) = recorder {
        recorder.save(client, observer, right_eye)?;
    }
    note(timings, "flush", rasterise)?;
    driven.rasterise += rasterise.elapsed();
    driven.wall = start.elapsed();
    Ok(driven)
}

/// The status of the picture with the larger error, of those of both eyes or of one, with the quantile that it is displayed for.
fn worse(
    [left, right]: [Option<&ErrorStatus>; 2],
    at: ErrorQuantile,
) -> Option<(&ErrorStatus, ErrorQuantile)> {
    let error = |status: &ErrorStatus| status.estimate.relative[at.index()].value;
    let worse = match (left, right) {
        (Some(left), Some(right)) if error(right) > error(left) => right,
        (left, right) => left.or(right)?,
    };
    Some((worse, at))
}

/// Moves up to [`BUDGET`] samples to the client. In index order `reached` is set by the block with which the error meets its target.
fn take(
    drive: Drive,
    lanes: &mut Lanes,
    mut writer: FilmWriter<'_>,
    mut recorder: Option<&mut Recorder>,
    reached: &mut bool,
) -> std::result::Result<Drained, ClientError> {
    let observer = writer.observer();
    let goal = observer.filter(|observer| drive.deterministic && observer.target().is_some());
    let give = |block: &Block| {
        // In index order the picture ends with exactly the block that met the target.
        if drive.deterministic && *reached {
            return;
        }
        match &mut recorder {
            None => writer.block(block),
            Some(recorder) => match recorder.take(block) {
                Some(chunk) => {
                    writer.of_eyes(
                        chunk.first_index,
                        chunk.paths,
                        chunk.samples.each_ref().map(Vec::as_slice),
                    );
                }
                None => return,
            },
        }
        if goal.is_some() {
            let is_reached = |observer: &Observer| {
                observer.sync();
                observer.state().reached
            };
            // The eye with the larger error decides.
            *reached = [goal, writer.right_observer()].into_iter().flatten().all(is_reached);
        }
    };
    let drained = lanes.drain(BUDGET, give);
    writer.finish().map(|()| drained)
}

impl DriveOutcome {
    /// State before the first range of a render; complete if the range is empty.
    pub fn new(complete: bool) -> Self {
        Self { complete, ..Self::default() }
    }

    /// Adds the outcome of the next range of the same render.
    pub fn add(&mut self, next: Self) {
        *self = Self {
            wall: self.wall + next.wall,
            rasterise: self.rasterise + next.rasterise,
            panicked: self.panicked.take().or(next.panicked),
            ..next
        };
    }
}

/// Records the client's work since `start`, if timings are captured.
pub fn note(timings: &mut Option<TimingCapture>, name: &'static str, start: Instant) -> Result<()> {
    timings.as_mut().map_or(Ok(()), |timings| timings.client(name, start))
}
