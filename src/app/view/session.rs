//! The server's side of the window: one render after another, each with an epoch of its own.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::method::{self, RenderOrder};
use crate::app::run_spec::RunSpec;
use crate::client::window::statistics::Recent;
use crate::server::{Priority, Server};
use crate::stream::block::Block;
use crate::stream::control::{Epoch, Event, Finish};
use crate::stream::ordered::Cursor;
use crate::stream::{Drained, Lanes, UvWindow};
use crate::tracer::{Camera, Scene};

/// Abort times that are kept.
const ABORTS: usize = 4096;

/// The server, its lanes, and the render in progress.
pub struct Session {
    server: Server,
    lanes: Lanes,
    epoch: Epoch,
    /// Where an ordered drain stands.
    cursor: Cursor,
    /// Paths of a render; `None` is no end.
    paths: Option<u64>,
    deterministic: bool,
    /// Where the samples of this epoch lie.
    window: UvWindow,
    /// The render has ended, and how.
    ended: Option<Finish>,
    /// It has ended and every block was taken.
    through: bool,
    began: Instant,
    /// The epoch that was cut off last, and when.
    cut: Option<(Epoch, Instant)>,
    /// Milliseconds from cutting an epoch off until its last worker has left it.
    pub aborts: Recent,
    /// Samples of earlier epochs.
    traced_before: u64,
    /// The first path that panicked.
    panicked: Option<(u64, String)>,
    /// Photons, which outlast a move of the camera.
    photons: Option<method::Photons>,
}

impl Session {
    /// Starts the threads, in the background of the window; they sleep until the first render.
    ///
    /// # Errors
    ///
    /// When the system gives no threads.
    pub fn start(threads: usize, paths: Option<u64>, deterministic: bool) -> Result<Self> {
        let (server, lanes) = Server::start_with(threads, Priority::Background).into_diagnostic()?;
        server.set_cost_map(true);
        let epoch = Epoch(0);
        Ok(Self {
            server,
            lanes,
            epoch,
            cursor: Cursor::new(epoch, 0),
            paths,
            deterministic,
            window: UvWindow::PICTURE,
            ended: None,
            through: false,
            began: Instant::now(),
            cut: None,
            aborts: Recent::new(ABORTS),
            traced_before: 0,
            panicked: None,
            photons: None,
        })
    }

    /// An edit: the next epoch begins at once, and blocks of the last one will be dropped on arrival.
    ///
    /// # Errors
    ///
    /// When the server has ended.
    pub fn render(
        &mut self,
        run: &RunSpec,
        (scene, camera): (Arc<Scene>, Camera),
        window: UvWindow,
    ) -> Result<()> {
        self.traced_before += self.server.stats().total().samples;
        self.cut = (self.ended.is_none() && self.epoch != Epoch(0)).then(|| (self.epoch, Instant::now()));
        self.epoch = self.epoch.next();
        let range = 0..self.paths.unwrap_or(u64::MAX);
        let order = RenderOrder { scene, camera, range, window, epoch: self.epoch, check: None };
        method::start(&self.server, run, order, &mut self.photons)?;
        self.cursor = Cursor::new(self.epoch, 0);
        self.window = window;
        (self.ended, self.through, self.began) = (None, false, Instant::now());
        Ok(())
    }

    /// Hears what the server has to say; returns the first path that panicked, once.
    pub fn events(&mut self) -> Option<(u64, String)> {
        let mut news = None;
        while let Some(Event::Finished { epoch, why, at }) = self.server.event() {
            if let Finish::Panicked { index, message } = &why
                && self.panicked.is_none()
            {
                self.panicked = Some((*index, message.clone()));
                news = self.panicked.clone();
            }
            if epoch == self.epoch {
                self.ended = Some(why);
            }
            if let Some((_, then)) = self.cut.take_if(|(cut, _)| *cut == epoch) {
                self.aborts.push((at.saturating_duration_since(then).as_secs_f64() * 1e3) as f32);
            }
        }
        news
    }

    /// Hands over waiting blocks, `budget` samples at most; blocks of older epochs are dropped. Never waits.
    pub fn drain(&mut self, budget: usize, take: impl FnMut(&Block)) -> Drained {
        let drained = if self.deterministic {
            self.lanes.drain_ordered(&mut self.cursor, budget, take)
        } else {
            self.lanes.drain(self.epoch, budget, take)
        };
        // The event was read before the lanes: every block had been committed by then.
        self.through = self.ended.is_some() && drained.blocks == 0 && self.lanes.fill().blocks == 0;
        drained
    }

    /// Sleeps until a block or an event is there, at most `timeout`.
    pub fn wait(&mut self, timeout: Duration) {
        if self.deterministic {
            self.lanes.wait_ordered(&self.cursor, timeout);
        } else {
            self.lanes.wait(timeout);
        }
    }

    /// Stops the render; what has been sent remains valid.
    pub fn abort(&self) {
        self.server.abort();
    }

    /// True when the samples of this epoch cover this window.
    pub fn covers(&self, window: &UvWindow) -> bool {
        let inside = |i: usize| self.window.min[i] <= window.min[i] && self.window.max[i] >= window.max[i];
        inside(0) && inside(1)
    }

    /// The render has ended and every block of it was taken.
    pub fn is_through(&self) -> bool {
        self.through
    }

    /// Every path of the range was traced.
    pub fn is_complete(&self) -> bool {
        self.through && self.ended == Some(Finish::Complete)
    }

    /// The path that panicked first, and what it said.
    pub fn panicked(&self) -> Option<&(u64, String)> {
        self.panicked.as_ref()
    }

    /// The server, for a capture of its spans.
    pub fn server(&self) -> &Server {
        &self.server
    }

    /// Time since the present epoch began.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Samples that the tracer has sent since the start.
    pub fn traced(&self) -> u64 {
        self.traced_before + self.server.stats().total().samples
    }

    /// Blocks in the lanes, and how many fit.
    pub fn fill(&self) -> (usize, usize) {
        let fill = self.lanes.fill();
        (fill.blocks, fill.capacity)
    }

    /// Tracing threads.
    pub fn threads(&self) -> usize {
        self.server.threads()
    }
}
