//! Tracers of the window: threads of this process, or remote machines.

use std::net::ToSocketAddrs;

use miette::{IntoDiagnostic, Result};

use crate::remote::{RemoteRender, RemoteTracers, TracerAddress, TracerStatus, is_loopback};
use crate::render::method::{self, Photons, RenderOrder};
use crate::render::remote_order::{RemoteOrder, read_token};
use crate::render::run_spec::RunSpec;
use crate::scene::edit::Edits;
use crate::server::{CostMap, Priority, Server};
use crate::stream::{Event, Lanes, Rejections};
use crate::viewer::options::{Compression, TracerOptions};

/// Tracers of a window.
pub enum Tracers {
    /// Threads of this process.
    Here {
        server: Server,
        /// Photon map of photon mapping, which stays valid when the camera moves.
        photons: Option<Photons>,
        /// Samples of earlier renders.
        traced_before: u64,
    },
    /// Tracers on other machines.
    Elsewhere {
        tracers: RemoteTracers,
        /// Digest of the scene that the tracers must have.
        scene: String,
    },
}

/// Remote tracers from the command line.
///
/// # Errors
///
/// When the token file cannot be read.
pub fn addresses(options: &TracerOptions) -> Result<Vec<TracerAddress>> {
    let token = options.token_file.as_deref().map(read_token).transpose()?;
    let address = |address: &String| TracerAddress {
        address: address.clone(),
        token: token.clone(),
        compressed: match options.compress {
            Compression::On => true,
            Compression::Off => false,
            // Names that cannot be resolved are reported when connecting.
            Compression::Auto => {
                address.to_socket_addrs().is_ok_and(|mut found| found.any(|found| !is_loopback(found.ip())))
            }
        },
    };
    Ok(options.connect.iter().map(address).collect())
}

impl Tracers {
    /// Starts threads at a lower priority than the window's; they sleep until the first render.
    pub fn here(threads: usize) -> Result<(Self, Lanes)> {
        let (server, lanes) = Server::start_with(threads, Priority::Background).into_diagnostic()?;
        server.set_cost_map(true);
        Ok((Tracers::Here { server, photons: None, traced_before: 0 }, lanes))
    }

    /// Begins to connect to remote tracers of a scene with this digest.
    pub fn elsewhere(addresses: Vec<TracerAddress>, scene: String) -> Result<(Self, Lanes)> {
        let (tracers, lanes) = RemoteTracers::start(addresses).into_diagnostic()?;
        Ok((Tracers::Elsewhere { tracers, scene }, lanes))
    }

    /// The local server, for its timings.
    pub fn server(&self) -> Option<&Server> {
        match self {
            Tracers::Here { server, .. } => Some(server),
            Tracers::Elsewhere { .. } => None,
        }
    }

    /// Replaces the scene from the next render on. Remote tracers must have the scene with this digest.
    pub fn replace_scene(&mut self, digest: Option<String>) {
        match self {
            Tracers::Here { photons, .. } => *photons = None,
            Tracers::Elsewhere { scene, .. } => *scene = digest.unwrap_or_default(),
        }
    }

    /// Begins a render. `edits`: changes of camera and parameters, for remote tracers, which load the scene from its file.
    pub fn render(&mut self, run: &RunSpec, order: RenderOrder, edits: Edits) -> Result<()> {
        match self {
            Tracers::Here { server, photons, traced_before } => {
                *traced_before += server.stats().total().samples;
                method::start(server, run, order, photons).map(drop)
            }
            Tracers::Elsewhere { tracers, scene } => {
                let size = [run.film.width, run.film.height];
                let remote = RemoteOrder::new(scene.clone(), run, size, order.window, edits);
                let paths = Some(order.range.end).filter(|end| *end != u64::MAX);
                let text = serde_json::to_string(&remote).into_diagnostic()?;
                tracers.render(RemoteRender {
                    epoch: order.epoch,
                    seed: run.seed,
                    paths,
                    side: size[0].max(size[1]),
                    order: text,
                });
                Ok(())
            }
        }
    }

    /// Renders a region on local threads. The photon map of the whole picture is kept.
    pub fn render_region(&mut self, run: &RunSpec, order: RenderOrder) -> Result<()> {
        let Tracers::Here { server, traced_before, .. } = self else { return Ok(()) };
        *traced_before += server.stats().total().samples;
        method::start(server, run, order, &mut None).map(drop)
    }

    /// Stops tracing; samples already sent remain valid.
    pub fn abort(&self) {
        match self {
            Tracers::Here { server, .. } => server.abort(),
            Tracers::Elsewhere { tracers, .. } => tracers.abort(),
        }
    }

    /// The oldest unread event.
    pub fn event(&self) -> Option<Event> {
        match self {
            Tracers::Here { server, .. } => server.event(),
            Tracers::Elsewhere { tracers, .. } => tracers.event(),
        }
    }

    /// Samples traced since the start.
    pub fn traced(&self) -> u64 {
        match self {
            Tracers::Here { server, traced_before, .. } => traced_before + server.stats().total().samples,
            Tracers::Elsewhere { tracers, .. } => tracers.samples(),
        }
    }

    /// Rejected values of the present render.
    pub fn rejections(&self) -> Rejections {
        match self {
            Tracers::Here { server, .. } => server.stats().total().rejections,
            Tracers::Elsewhere { tracers, .. } => tracers.rejections(),
        }
    }

    /// Number of tracing threads, as far as known.
    pub fn threads(&self) -> usize {
        match self {
            Tracers::Here { server, .. } => server.threads(),
            Tracers::Elsewhere { tracers, .. } => tracers.threads(),
        }
    }

    /// Cost map of the present render's paths; `None` for remote tracers.
    pub fn cost_map(&self) -> Option<CostMap> {
        self.server().map(Server::cost_map)
    }

    /// Status of the remote tracers.
    pub fn status(&self) -> Vec<TracerStatus> {
        match self {
            Tracers::Here { .. } => Vec::new(),
            Tracers::Elsewhere { tracers, .. } => tracers.status(),
        }
    }
}
