//! The noise filter of the window: a thread that adds up both randomisations pixel by pixel, traces the features of an epoch after its first
//! picture, and filters when it is asked to. The loop goes on meanwhile.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::denoise::{FilteredPicture, ViewFilter};
use crate::client::{FilmData, FilmSpec};
use crate::stream::{PathCounts, Sample};
use crate::study::Replicates;
use crate::tracer::{Camera, Scene};

/// What an epoch shows.
#[derive(Clone)]
pub struct EpochView {
    pub scene: Arc<Scene>,
    pub camera: Camera,
}

/// A message to the thread.
enum FilterMessage {
    /// Another epoch, or another film for the same one: forget all samples.
    Begin(FilmSpec, Box<EpochView>),
    Samples {
        first_index: u64,
        paths: PathCounts,
        samples: Box<[Sample]>,
    },
    /// Trace the features.
    Prepare,
    /// Filter what there is: this many samples of the film, with its sums where they count.
    Filter(u64, Option<FilmData>),
}

/// A message, and the number of the film that it is about.
type NumberedMessage = (u64, FilterMessage);

/// A picture, and the number of its film.
struct FilterAnswer {
    number: u64,
    /// `None` without memory.
    picture: Option<FilteredPicture>,
    samples: u64,
    took: Duration,
}

/// The last filtered picture of the present film.
pub struct FilteredFrame {
    pub picture: FilteredPicture,
    /// Samples in it.
    pub samples: u64,
}

/// What loop and thread both know.
struct FilterProgress {
    /// The present film: what is about another one is not worth doing.
    number: AtomicU64,
    /// The film whose features were traced last.
    prepared: AtomicU64,
}

/// A handle to the thread; dropping it ends the thread.
pub struct NoiseFilter {
    /// `None` once the thread was told to end.
    messages: Option<Sender<NumberedMessage>>,
    answers: Receiver<FilterAnswer>,
    progress: Arc<FilterProgress>,
    thread: Option<JoinHandle<()>>,
    shown: Option<FilteredFrame>,
    /// An answer is awaited.
    busy: bool,
    /// The features of the present film were asked for.
    preparing: bool,
    /// There was no memory for the present film.
    failed: bool,
}

impl NoiseFilter {
    /// Starts the thread.
    pub fn start() -> Result<Self> {
        let (messages, inbox) = channel();
        let (outbox, answers) = channel();
        let progress =
            Arc::new(FilterProgress { number: AtomicU64::new(0), prepared: AtomicU64::new(u64::MAX) });
        let own = progress.clone();
        let thread = Builder::new().name("noise filter".into()).spawn(move || work(&inbox, &outbox, &own));
        Ok(Self {
            messages: Some(messages),
            answers,
            progress,
            thread: Some(thread.into_diagnostic()?),
            shown: None,
            busy: false,
            preparing: false,
            failed: false,
        })
    }

    /// Begins with the samples of a film of this epoch.
    pub fn begin(&mut self, film: FilmSpec, view: EpochView) {
        self.progress.number.fetch_add(1, Ordering::Relaxed);
        (self.shown, self.busy, self.preparing, self.failed) = (None, false, false, false);
        self.send(FilterMessage::Begin(film, Box::new(view)));
    }

    /// Takes a copy of the samples of a block that goes to the film.
    pub fn samples(&self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        self.send(FilterMessage::Samples { first_index, paths, samples: samples.into() });
    }

    /// The first picture is shown: features may be traced.
    pub fn prepare(&mut self) {
        self.preparing = true;
        self.send(FilterMessage::Prepare);
    }

    /// Whether a picture can be filtered.
    pub fn is_ready(&self) -> bool {
        let FilterProgress { number, prepared } = &*self.progress;
        !self.failed && number.load(Ordering::Relaxed) == prepared.load(Ordering::Relaxed)
    }

    /// Whether a picture can be filtered, now or once the features that were asked for are there.
    pub fn will_be_ready(&self) -> bool {
        self.preparing && !self.failed
    }

    /// Whether a picture is being filtered.
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Begins to filter what was given so far: `samples` samples of a film with these sums.
    pub fn filter(&mut self, samples: u64, data: Option<FilmData>) {
        self.busy = true;
        self.send(FilterMessage::Filter(samples, data));
    }

    /// The last picture.
    pub fn shown(&self) -> Option<&FilteredFrame> {
        self.shown.as_ref()
    }

    /// Takes the last picture.
    pub fn take_shown(&mut self) -> Option<FilteredFrame> {
        self.shown.take()
    }

    /// Takes over the picture that was asked for, if it is there; returns how long it took.
    pub fn poll(&mut self) -> Option<Duration> {
        self.answers.try_recv().ok().and_then(|answer| self.take(answer))
    }

    /// Waits for the picture that was asked for.
    pub fn wait(&mut self) {
        while self.busy {
            match self.answers.recv() {
                Ok(answer) => _ = self.take(answer),
                Err(_) => (self.busy, self.failed) = (false, true),
            }
        }
    }

    fn take(&mut self, answer: FilterAnswer) -> Option<Duration> {
        if answer.number != self.progress.number.load(Ordering::Relaxed) {
            return None;
        }
        (self.busy, self.failed) = (false, answer.picture.is_none());
        self.shown = answer.picture.map(|picture| FilteredFrame { picture, samples: answer.samples });
        Some(answer.took)
    }

    fn send(&self, message: FilterMessage) {
        let number = self.progress.number.load(Ordering::Relaxed);
        if let Some(messages) = &self.messages {
            // A thread that is gone has told why.
            let _ = messages.send((number, message));
        }
    }
}

impl Drop for NoiseFilter {
    fn drop(&mut self) {
        // Whatever is under way is not worth finishing.
        self.progress.number.fetch_add(1, Ordering::Relaxed);
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// One film of an epoch, as the thread knows it.
struct FilteredFilm {
    film: FilmSpec,
    view: EpochView,
    replicates: Replicates,
    filter: Option<ViewFilter>,
}

/// The thread.
fn work(inbox: &Receiver<NumberedMessage>, outbox: &Sender<FilterAnswer>, progress: &FilterProgress) {
    let mut state: Option<FilteredFilm> = None;
    while let Ok((number, message)) = inbox.recv() {
        let is_over = || progress.number.load(Ordering::Relaxed) != number;
        if is_over() {
            continue;
        }
        match (message, &mut state) {
            (FilterMessage::Begin(film, view), state) => {
                let replicates = Replicates::new([film.width, film.height], film.filter.energy());
                *state = Some(FilteredFilm { film, view: *view, replicates, filter: None });
            }
            (FilterMessage::Samples { first_index, paths, samples }, Some(state)) => {
                state.replicates.add(first_index, paths, &samples);
            }
            (FilterMessage::Prepare, Some(FilteredFilm { film, view, filter, .. })) => {
                *filter = ViewFilter::new(&view.scene, &view.camera, film, &is_over);
                if filter.is_some() {
                    progress.prepared.store(number, Ordering::Relaxed);
                }
            }
            (FilterMessage::Filter(samples, data), Some(FilteredFilm { replicates, filter, .. })) => {
                let start = Instant::now();
                let picture = filter.as_mut();
                let picture =
                    picture.and_then(|filter| FilteredPicture::of(replicates, data.as_ref(), filter));
                let _ = outbox.send(FilterAnswer { number, picture, samples, took: start.elapsed() });
            }
            (_, None) => {}
        }
    }
}
