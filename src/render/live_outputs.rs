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
use crate::render::stereo::RightEye;
use crate::render::stereo_error::StereoEnd;
use crate::render::stereo_outputs::{EyePictures, PendingStereo};
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

    /// Writes what is due, with a right eye of both. In index order the film keeps its partial batch, so that its sums keep the same bits.
    ///
    /// # Errors
    ///
    /// When the film cannot be read. A failure to write a snapshot is only reported.
    pub fn update(
        &mut self,
        film: &mut dyn Film,
        observer: Option<&Observer>,
        mut right_eye: Option<&mut RightEye>,
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
        keep_batch(film, right_eye.as_deref_mut(), self.run.deterministic);
        let shown = if shows { self.show(film, right_eye.as_deref_mut()) } else { Ok(()) };
        let saved = if saves { self.save(film, observer, right_eye.as_deref_mut(), server) } else { Ok(()) };
        keep_batch(film, right_eye, false);
        shown.and(saved)
    }

    /// Sends the picture to tev, if requested.
    fn show(&mut self, film: &mut dyn Film, right_eye: Option<&mut RightEye>) -> Result<()> {
        let Some(tev) = &mut self.tev else { return Ok(()) };
        let sent = match right_eye {
            None => tev.send(&self.name, film),
            Some(eye) => tev.send_eyes(&self.name, [film, &mut *eye.film]),
        };
        sent.into_diagnostic()
    }

    /// Sends the complete picture and waits for pending writes.
    ///
    /// # Errors
    ///
    /// When the film cannot be read.
    pub fn finish(mut self, film: &mut dyn Film, right_eye: Option<&mut RightEye>) -> Result<()> {
        self.show(film, right_eye)
    }

    /// Takes a snapshot and writes it on another thread.
    fn save(
        &mut self,
        film: &mut dyn Film,
        observer: Option<&Observer>,
        right_eye: Option<&mut RightEye>,
        server: &Server,
    ) -> Result<()> {
        let rejections = server.stats().total().rejections;
        let mut outcome = RunEnd {
            prefix: self.run.deterministic && ExactFilm::of(film).is_some(),
            rejected: RejectedReport::new(self.run, self.desc, self.scene, &rejections).summary(),
            notes: Vec::new(),
        };
        let texels: f64 = self.run.film.padded_extent().map(f64::from).iter().product();
        let spp = (film.counts().paths() as f64 / texels) as u64;
        let state = observer.map(Observer::state);
        let write = match right_eye {
            Some(eye) => {
                let states = state.zip(eye.observer.as_ref().map(Observer::state));
                let states = states.as_ref().map(|(left, right)| [&**left, &**right]);
                let end = StereoEnd::new(outcome, states, self.args.error.is_some(), self.args.error_at);
                self.take_eyes([film, &mut *eye.film], spp, end)?
            }
            None => {
                if let Some(state) = state {
                    outcome.describe(&state, self.args.error_at);
                }
                self.take_one(film, spp, outcome)?
            }
        };
        let quiet = self.args.quiet;
        let work = move |_: &StopFlag| {
            write(&|path, written| match written {
                Ok(()) if quiet => {}
                Ok(()) => tell(&format!("snapshot: {}", path.display())),
                Err(error) => tell(&format!("no snapshot: {error}")),
            });
        };
        self.writer = Some(Job::start("writing a snapshot", work).into_diagnostic()?);
        Ok(())
    }

    /// Takes a snapshot of one picture.
    fn take_one(&self, film: &mut dyn Film, spp: u64, outcome: RunEnd) -> Result<SnapshotWriter> {
        let pictures = self.outputs.files().map(|path| {
            let snapshot = PendingSnapshot::take(path, film, &self.settings, None)?;
            Ok((snapshot_path(path, spp), snapshot))
        });
        let pictures = pictures.collect::<Result<Vec<_>>>()?;
        let (run, settings) = (self.run.clone(), self.settings.clone());
        Ok(Box::new(move |told| {
            for (path, snapshot) in pictures {
                told(&path, snapshot.write(&path, &run, &outcome, &settings));
            }
        }))
    }

    /// Takes a snapshot of the pictures of both eyes.
    fn take_eyes(&self, films: [&mut dyn Film; 2], spp: u64, end: StereoEnd) -> Result<SnapshotWriter> {
        let layout = self.args.stereo.and_then(|stereo| stereo.layout);
        let pictures = EyePictures { films, extras: Default::default(), layout };
        let pending = PendingStereo::take(self.outputs, pictures, &self.settings)?;
        let formats = self.outputs.formats().iter();
        let files: Vec<_> = formats.map(|(path, format)| (snapshot_path(path, spp), *format)).collect();
        let run = self.run.clone();
        Ok(Box::new(move |told| match pending.wait() {
            Ok(taken) => {
                for (path, format) in files {
                    told(&path, taken.write(&path, format, &run, &end));
                }
            }
            Err(error) => tell(&format!("no snapshot: {error}")),
        }))
    }
}

/// Writes the files of a snapshot, and passes on each with its outcome.
type SnapshotWriter = Box<dyn FnOnce(&dyn Fn(&Path, Result<()>)) + Send>;

/// As [`Film::keep_batch`], for one film or those of both eyes.
fn keep_batch(film: &mut dyn Film, right_eye: Option<&mut RightEye>, keep: bool) {
    film.keep_batch(keep);
    if let Some(eye) = right_eye {
        eye.film.keep_batch(keep);
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
