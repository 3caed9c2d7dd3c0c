//! A tracer without a scene, and a viewer without a window.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use pointillist::remote::{
    Health, Host, RemoteRender, RemoteTracers, Request, Service, Token, TracerAddress, Tracing, Welcome,
    listen,
};
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{Block, DrainOrder, Epoch, Event, Lanes};

use crate::support::synthetic::{synthetic, varied};

/// How long a machine may take for what must happen.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Traces samples that name their index.
pub struct FakeHost {
    /// What viewers have asked for.
    pub requests: Mutex<Vec<Request>>,
    pub files: Vec<(String, PathBuf)>,
    /// Nothing can be traced.
    pub refuses: AtomicBool,
}

struct FakeTracing {
    host: Arc<FakeHost>,
    server: Server,
}

impl Host for FakeHost {
    fn welcome(&self) -> Welcome {
        Welcome { threads: 2, digest: "d1".into(), ..Welcome::default() }
    }

    fn open(self: Arc<Self>) -> Result<(Box<dyn Tracing>, Lanes), String> {
        let (server, lanes) = Server::start(2).unwrap();
        Ok((Box::new(FakeTracing { host: self, server }), lanes))
    }

    fn files(&self) -> Vec<(String, PathBuf)> {
        self.files.clone()
    }
}

impl Tracing for FakeTracing {
    fn render(&self, request: &Request) -> Result<(), String> {
        if request.order == "refuse" || self.host.refuses.load(Ordering::SeqCst) {
            return Err("that cannot be traced".into());
        }
        self.host.requests.lock().unwrap().push(request.clone());
        let job = RenderJob::new(synthetic(varied), 0..request.paths.unwrap_or(u64::MAX));
        self.server.render(job, Epoch(request.epoch)).map_err(|error| error.to_string())
    }

    fn abort(&self) {
        self.server.abort();
    }

    fn event(&self) -> Option<Event> {
        self.server.event()
    }
}

/// A service, where it is, and what it has logged.
pub struct Served {
    pub address: String,
    pub host: Arc<FakeHost>,
    pub log: Arc<Mutex<Vec<String>>>,
    _service: Service,
}

impl Served {
    pub fn start(token: Option<&str>) -> Self {
        Self::at("127.0.0.1:0", token, Vec::new())
    }

    pub fn at(address: &str, token: Option<&str>, files: Vec<(String, PathBuf)>) -> Self {
        let token = token.map(|text| Token::new(text).unwrap());
        let listener = listen(address, token.as_ref()).unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let host = Arc::new(FakeHost { requests: Mutex::default(), files, refuses: AtomicBool::new(false) });
        let log = Arc::<Mutex<Vec<String>>>::default();
        let lines = log.clone();
        let service =
            Service::start(listener, token, host.clone(), move |line| lines.lock().unwrap().push(line))
                .unwrap();
        Self { address, host, log, _service: service }
    }

    pub fn logged(&self) -> Vec<String> {
        self.log.lock().unwrap().clone()
    }
}

pub fn address(address: &str, token: Option<&str>) -> TracerAddress {
    let token = token.map(|text| Token::new(text).unwrap());
    TracerAddress { address: address.to_owned(), token, compressed: false }
}

/// A viewer: tracers, lanes, and what came of the present render.
pub struct FakeViewer {
    pub tracers: RemoteTracers,
    pub lanes: Lanes,
    pub epoch: Epoch,
}

impl FakeViewer {
    pub fn of(addresses: Vec<TracerAddress>) -> Self {
        let (tracers, lanes) = RemoteTracers::start(addresses).unwrap();
        Self { tracers, lanes, epoch: Epoch(0) }
    }

    pub fn render(&mut self, paths: Option<u64>) {
        self.order(paths, "{}");
    }

    pub fn order(&mut self, paths: Option<u64>, order: &str) {
        self.epoch = self.epoch.next();
        let (epoch, order) = (self.epoch, order.to_owned());
        self.tracers.render(RemoteRender { epoch, seed: 7, paths, side: 512, order });
        self.lanes.follow(epoch, DrainOrder::Arrival);
    }

    /// Drains until this holds of what came.
    #[track_caller]
    pub fn until(&mut self, mut take: impl FnMut(&Block), mut done: impl FnMut(&RemoteTracers) -> bool) {
        let start = Instant::now();
        while !done(&self.tracers) {
            assert!(start.elapsed() < PATIENCE, "{:?}", self.tracers.status());
            self.lanes.wait(Duration::from_millis(5));
            self.lanes.drain(1 << 16, &mut take);
        }
    }

    /// Drains until the number of samples that came has grown by so much.
    #[track_caller]
    pub fn receive(&mut self, samples: u64) {
        let before = self.tracers.samples();
        self.until(|_| {}, |tracers| tracers.samples() >= before + samples);
    }

    /// All samples of a render that ends.
    #[track_caller]
    pub fn all(&mut self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut ended = false;
        self.until(
            |block| blocks.push(block.clone()),
            |tracers| {
                ended |= matches!(tracers.event(), Some(Event::Finished { .. }));
                ended
            },
        );
        while !self.lanes.is_drained() {
            self.lanes.drain(1 << 16, |block| blocks.push(block.clone()));
        }
        blocks
    }

    /// Drains until one of the tracers is in this state and says this of itself.
    #[track_caller]
    pub fn hears(&mut self, place: usize, health: Health, words: &str) {
        self.hears_one_of(place, health, &[words]);
    }

    /// As [`hears`](Self::hears), where it depends on chance which of these it says.
    #[track_caller]
    pub fn hears_one_of(&mut self, place: usize, health: Health, words: &[&str]) {
        self.until(
            |_| {},
            |tracers| {
                let status = &tracers.status()[place];
                status.health == health && words.iter().any(|words| status.words.contains(words))
            },
        );
    }
}
