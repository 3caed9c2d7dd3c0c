//! Outputs during a render: the picture in tev, and snapshots of the output files on SIGUSR1.

use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result};

use crate::accounting::observer::Observer;
use crate::client::reference::ExactFilm;
use crate::client::{Denoise, Film, Settings};
use crate::job::{Job, StopFlag};
use crate::render::options::RenderOptions;
use crate::render::outputs::{Outputs, PendingSnapshot};
use crate::render::process;
use crate::render::process::tell;
use crate::render::rejected::RejectedReport;
use crate::render::run_spec::{RunEnd, RunSpec};
use crate::render::tev::TevLink;
use crate::scene::SceneDesc;
use crate::server::Server;
use crate::tracer::Scene;

/// Displays and saves the picture of a render in progress.
pub struct LiveOutputs<'a> {
    args: &'a RenderOptions,
    outputs: &'a Outputs,
    run: &'a RunSpec,
    desc: &'a SceneDesc,
    scene: &'a Scene,
    /// Display settings of snapshots, without the noise filter.
    settings: Settings,
    /// File name of the scene without its extension.
    name: String,
    tev: Option<TevLink>,
    /// Thread that writes the last snapshot.
    writer: Option<Job<()>>,
}

/// Inputs and outputs of a render.
pub struct LiveRender<'a> {
    pub args: &'a RenderOptions,
    pub outputs: &'a Outputs,
    pub run: &'a RunSpec,
    pub desc: &'a SceneDesc,
    pub scene: &'a Scene,
}

impl<'a> LiveOutputs<'a> {
    /// Starts the requested outputs.
    ///
    /// # Errors
    ///
    /// When no thread can be started.
    pub fn start(render: LiveRender<'a>) -> Result<Self> {
        let LiveRender { args, outputs, run, desc, scene } = render;
        let tev = args.tev.as_deref().map(TevLink::start).transpose()?;
        let settings = Settings { denoise: Denoise::Off, ..args.display.clone() };
        let name = args.source.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { args, outputs, run, desc, scene, settings, name, tev, writer: None })
    }

    /// Writes what is due. In index order the film keeps its partial batch, so that its sums keep the same bits.
    ///
    /// # Errors
    ///
    /// When the film cannot be read. A failure to write a snapshot is only reported.
    pub fn update(
        &mut self,
        film: &mut dyn Film,
        observer: Option<&Observer>,
        server: &Server,
    ) -> Result<()> {
        let counts = film.counts();
        let shows = self.tev.as_ref().is_some_and(|tev| tev.is_due(counts));
        let saves = counts.paths() > 0
            && self.writer.as_ref().is_none_or(Job::is_finished)
            && process::take_snapshot_request();
        if !shows && !saves {
            return Ok(());
        }
        film.keep_batch(self.run.deterministic);
        let shown = self
            .tev
            .as_mut()
            .filter(|_| shows)
            .map_or(Ok(()), |tev| tev.send(&self.name, film).into_diagnostic());
        let saved = if saves { self.save(film, observer, server) } else { Ok(()) };
        film.keep_batch(false);
        shown.and(saved)
    }

    /// Sends the complete picture and waits for pending writes.
    ///
    /// # Errors
    ///
    /// When the film cannot be read.
    pub fn finish(mut self, film: &mut dyn Film) -> Result<()> {
        if let Some(tev) = &mut self.tev {
            tev.send(&self.name, film).into_diagnostic()?;
        }
        Ok(())
    }

    /// Takes a snapshot and writes it on another thread.
    fn save(&mut self, film: &mut dyn Film, observer: Option<&Observer>, server: &Server) -> Result<()> {
        let rejections = server.stats().total().rejections;
        let mut outcome = RunEnd {
            prefix: self.run.deterministic && ExactFilm::of(film).is_some(),
            rejected: RejectedReport::new(self.run, self.desc, self.scene, &rejections).summary(),
            notes: Vec::new(),
        };
        if let Some(observer) = observer {
            outcome.describe(&observer.state(), self.args.error_at);
        }
        let texels: f64 = self.run.film.padded_extent().map(f64::from).iter().product();
        let spp = (film.counts().paths() as f64 / texels) as u64;
        let pictures = self.outputs.files().map(|path| {
            let snapshot = PendingSnapshot::take(path, film, &self.settings, None)?;
            Ok((snapshot_path(path, spp), snapshot))
        });
        let pictures = pictures.collect::<Result<Vec<_>>>()?;
        let (run, settings, quiet) = (self.run.clone(), self.settings.clone(), self.args.quiet);
        let write = move |_: &StopFlag| {
            for (path, snapshot) in pictures {
                match snapshot.write(&path, &run, &outcome, &settings) {
                    Ok(()) if quiet => {}
                    Ok(()) => tell(&format!("snapshot: {}", path.display())),
                    Err(error) => tell(&format!("no snapshot: {error}")),
                }
            }
        };
        self.writer = Some(Job::start("writing a snapshot", write).into_diagnostic()?);
        Ok(())
    }
}

impl Drop for LiveOutputs<'_> {
    fn drop(&mut self) {
        if let Some(writer) = self.writer.take() {
            let _ = writer.wait().inspect_err(|panic| tell(&panic.to_string()));
        }
    }
}

/// `picture-0012spp.exr` for `picture.exr` with 12 whole samples per pixel.
fn snapshot_path(path: &Path, spp: u64) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{spp:04}spp"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snapshots_stand_beside_the_picture() {
        assert_eq!(snapshot_path(Path::new("a/b.c.exr"), 12), Path::new("a/b.c-0012spp.exr"));
        assert_eq!(snapshot_path(Path::new("p.PNG"), 123_456), Path::new("p-123456spp.PNG"));
    }
}
