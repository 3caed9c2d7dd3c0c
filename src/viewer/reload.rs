//! Replaces the scene in the open window: by a file that was chosen or dropped, or by a new version of the same scene.
//!
//! The old scene is shown until the new one is ready, and stays if that cannot be read. A reloaded scene keeps the camera pose,
//! display settings, switched effects, and the edits of objects that still exist, matched by name.

use std::path::PathBuf;
use std::time::Instant;

use miette::Result;

use crate::render::process::tell;
use crate::scene::desc::ConvergenceChoice;
use crate::viewer::Viewer;
use crate::viewer::light_mix::LightMix;
use crate::viewer::loader::{LoadStage, ReadyScene, SceneLoader, ViewSource, brief};
use crate::viewer::loading::title;

impl Viewer {
    /// Opens a scene or a model in this window.
    pub(super) fn open_file(&mut self, path: PathBuf) {
        let source = self.source.with_scene(path);
        self.load(source);
    }

    fn load(&mut self, source: ViewSource) {
        // What is open already is shown until all of its new version is ready.
        let previews = !self.is_open(&source);
        match SceneLoader::start(source, previews) {
            Ok(loader) => self.loader = Some(loader),
            Err(error) => self.say(error.to_string()),
        }
    }

    /// Reloads the scene when its files have changed, and shows it once loaded.
    pub(super) fn look_at_files(&mut self, now: Instant) {
        if self.watch.has_changed(now) {
            // Loading a dropped scene takes precedence.
            let dropped = self.loader.as_ref().filter(|loader| !self.is_open(&loader.source));
            if dropped.is_none() {
                self.load(self.source.clone());
            }
        }
        let Some(loader) = &mut self.loader else { return };
        if self.picture.is_seen() && !self.session.is_stale() {
            loader.note_seen();
        }
        let Some(outcome) = loader.take() else {
            let state = loader.state();
            return self.panel.host.pin(format!("{}: {}", state.name, state.what));
        };
        let (files, source) = (loader.files(), loader.source.clone());
        if !outcome.as_ref().is_ok_and(|ready| ready.stage == LoadStage::Preview) {
            self.loader = None;
        }
        let again = self.is_open(&source);
        let outcome = outcome.and_then(|ready| self.replace(ready, source));
        let (message, files) = match outcome {
            Ok(message) => {
                tell(&message);
                self.panel.host.say(message);
                (None, Some(files))
            }
            Err(error) => {
                tell(&format!("{error:?}"));
                let known = self.watch.files();
                // After an error, files that were not read before are watched too, since the mistake may be in one of them.
                let files = again.then(|| known.chain(files).collect());
                (Some(brief(&error)), files)
            }
        };
        if let Some(problem) = files.and_then(|files| self.watch.follow(files)) {
            self.say(problem);
        }
        if let Some(message) = message {
            self.panel.host.pin(message);
        }
        self.refresh();
    }

    fn is_open(&self, source: &ViewSource) -> bool {
        let [one, other] = [source, &self.source]
            .map(|source| source.args.scene.canonicalize().unwrap_or_else(|_| source.args.scene.clone()));
        one == other
    }

    /// Replaces the present scene by another; returns a message.
    fn replace(&mut self, ready: ReadyScene, source: ViewSource) -> Result<String> {
        let ReadyScene { stage, run, choose, mut editor, digest } = ready;
        let before = self.session.size();
        // Checked before anything is changed: an invalid camera is an error of the scene.
        editor.camera(before)?;
        let again = self.is_open(&source);
        let rig = self.editor.rig();
        std::mem::swap(&mut self.editor, &mut editor);
        let lost = if again { self.editor.take_over(editor) } else { 0 };
        self.session.replace(run, choose, digest);
        // Lights of another scene may have the same names by chance.
        if again {
            self.picture.mix.end()
        } else {
            self.picture.mix = LightMix::default()
        }
        self.session.set_effects(&self.editor);
        if let Some(rig) = rig {
            let size = self.session.size();
            let seen = match again {
                true => self.editor.set_rig(Some(rig)),
                // Lengths of another scene are others.
                false => self.editor.open_eyes(None, ConvergenceChoice::default(), size),
            };
            if let Err(error) = seen {
                let closed = self.with_tools(None, |tools, context| tools.stereo.close(context))?;
                self.say(format!("{closed}: {error}"));
            }
        }
        if self.session.size() != before {
            self.set_picture_size(self.session.size());
            self.ask_room(self.session.size());
        }
        self.options.name = source.name();
        self.source = source;
        if !again {
            let scene = &self.source.args.scene;
            self.preferences.opened(scene, &self.panel.controls.layout);
            self.tools.open_scene(scene).into_iter().for_each(|problem| self.say(problem));
        }
        if let Some(screen) = &self.picture.screen {
            screen.window.set_title(&title(&self.options.name));
        }
        self.edited();
        let path = self.source.args.scene.display();
        Ok(match (again, lost) {
            (false, _) if stage == LoadStage::Preview => previewed(&self.source),
            (false, _) => format!("opened {path}"),
            (true, 0) if stage == LoadStage::Rest => {
                format!("{path} is complete: all of its pictures are read")
            }
            (true, 0) => format!("read {path} again"),
            (true, 1) => format!("read {path} again; one change has lost its object and is gone"),
            (true, lost) => format!("read {path} again; {lost} changes have lost their objects and are gone"),
        })
    }
}

/// What the user is told of a preview.
pub(super) fn previewed(source: &ViewSource) -> String {
    let path = source.args.scene.display();
    format!("{path} is shown with one colour for each large picture until these are read")
}
