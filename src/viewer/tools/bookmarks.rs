//! Numbered camera bookmarks, stored in a file beside the scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use egui::{Button, Ui};
use miette::{Result, miette};

use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{BoundAction, KeyBinding, ToolKey, Trigger};
use crate::client::window::navigation::Pose;
use crate::client::window::panel::{SectionPlace, style};
use crate::image::write::atomically;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// What the user can do with bookmarks, by their numbers, 1 to 9.
#[derive(Clone, Debug, PartialEq)]
pub enum BookmarkAction {
    /// Stores the present view.
    Keep(u8),
    /// Goes to the stored view.
    GoTo(u8),
}

/// Camera bookmarks of one scene.
#[derive(Debug, Default)]
pub struct CameraBookmarks {
    /// `SCENE.views.json`.
    file: PathBuf,
    views: BTreeMap<u8, Pose>,
    /// The file exists but could not be parsed, so it must not be overwritten.
    is_foreign: bool,
}

impl Tool for CameraBookmarks {
    type Action = BookmarkAction;

    fn keys() -> Vec<ToolKey<BookmarkAction>> {
        use Trigger::{Char, Ctrl};
        let each = |name: &str, action: fn(u8) -> BookmarkAction| {
            BoundAction::Each((1..=9).map(|number| (format!("{name} {number}"), action(number))).collect())
        };
        let keep = KeyBinding {
            keys: "Ctrl+1 … Ctrl+9",
            meaning: "keep this view under a number, beside the scene",
            triggers: &[
                Ctrl('1', false),
                Ctrl('2', false),
                Ctrl('3', false),
                Ctrl('4', false),
                Ctrl('5', false),
                Ctrl('6', false),
                Ctrl('7', false),
                Ctrl('8', false),
                Ctrl('9', false),
            ],
            action: each("Keep this view as", BookmarkAction::Keep),
        };
        let go = KeyBinding {
            keys: "1 … 9",
            meaning: "go to the view of this number",
            triggers: &[
                Char('1'),
                Char('2'),
                Char('3'),
                Char('4'),
                Char('5'),
                Char('6'),
                Char('7'),
                Char('8'),
                Char('9'),
            ],
            action: each("Go to view", BookmarkAction::GoTo),
        };
        let below = keep.meaning;
        vec![keep.below("the file's camera"), go.below(below)]
    }

    fn perform(&mut self, action: BookmarkAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match action {
            BookmarkAction::Keep(number) => self.keep(number, context.editor.pose()).map(Some),
            BookmarkAction::GoTo(number) => {
                let pose = self.get(number)?;
                context.has_edited |= context.editor.go_to(pose);
                Ok(None)
            }
        }
    }

    fn open_scene(&mut self, scene: &Path) -> Option<String> {
        let (bookmarks, problem) = Self::beside(scene);
        *self = bookmarks;
        problem
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<BookmarkAction>) {
        if place != SectionPlace::Files {
            return;
        }
        ui.colored_label(style::DIM, "Views of the camera (Ctrl+1 … 9 keep one):");
        ui.horizontal_wrapped(|ui| {
            for number in 1..=9 {
                let button = Button::new(number.to_string());
                if ui
                    .add_enabled(self.views.contains_key(&number), button)
                    .on_hover_text("Goes to this view")
                    .clicked()
                {
                    queue.ask(BookmarkAction::GoTo(number));
                }
            }
        });
    }
}

impl CameraBookmarks {
    /// Reads the bookmarks stored beside this scene.
    ///
    /// # Errors
    ///
    /// If the file exists but cannot be read, returns no bookmarks and a message that names it.
    fn beside(scene: &Path) -> (Self, Option<String>) {
        let file = scene.with_extension("views.json");
        let (views, problem) = match std::fs::read_to_string(&file) {
            Ok(text) => match serde_json::from_str::<BTreeMap<u8, Pose>>(&text) {
                Ok(views) => (views, None),
                Err(error) => {
                    let name = file.display();
                    let words = format!(
                        "{name}:{}:{}: these are no views of a camera: {error}",
                        error.line(),
                        error.column()
                    );
                    (BTreeMap::new(), Some(words))
                }
            },
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => (BTreeMap::new(), None),
            Err(error) => (BTreeMap::new(), Some(format!("{} cannot be read: {error}", file.display()))),
        };
        let views = views.into_iter().filter(|(number, pose)| (1..=9).contains(number) && pose.is_usable());
        (Self { views: views.collect(), is_foreign: problem.is_some(), file }, problem)
    }

    /// Stores a pose under a number; returns a message.
    ///
    /// # Errors
    ///
    /// When the file cannot be written. The bookmark is then kept for this session only.
    fn keep(&mut self, number: u8, pose: Pose) -> Result<String> {
        self.views.insert(number, pose);
        if self.is_foreign {
            let file = self.file.display();
            return Err(miette!("view {number} is kept for this session only: mend or remove {file} first"));
        }
        let text = serde_json::to_string_pretty(&self.views).map_err(|e| miette!("{e}"))?;
        atomically(&self.file, text.as_bytes())
            .map_err(|error| miette!("view {number} is kept for this session only: {error}"))?;
        Ok(format!("view {number} kept in {}", self.file.display()))
    }

    /// Pose stored under a number.
    ///
    /// # Errors
    ///
    /// When the number is unused; the message explains how to store a bookmark.
    fn get(&self, number: u8) -> Result<Pose> {
        let pose = self.views.get(&number).copied();
        pose.ok_or_else(|| miette!("no view is kept under {number}: Ctrl+{number} keeps the present one"))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn views_stay_from_session_to_session() {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("room.xml");
        let pose = Pose {
            eye: DVec3::new(0.1, 2.0, -3.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov: 41.3,
            mirrored: false,
        };
        let (mut views, problem) = CameraBookmarks::beside(&scene);
        assert!(problem.is_none() && views.get(3).is_err());
        views.keep(3, pose).expect("a file");
        let (again, problem) = CameraBookmarks::beside(&scene);
        assert_eq!(
            (problem, again.views.keys().copied().collect::<Vec<_>>(), again.get(3).expect("kept")),
            (None, vec![3], pose)
        );
        std::fs::write(folder.path().join("room.views.json"), "{\n  3").expect("a file");
        let (none, problem) = CameraBookmarks::beside(&scene);
        let mut none = none;
        assert!(none.views.is_empty() && none.keep(1, pose).is_err(), "it is not written over");
        let text = std::fs::read_to_string(folder.path().join("room.views.json")).expect("the file");
        assert_eq!(text, "{\n  3");
        let problem = problem.expect("a message");
        assert!(problem.contains("room.views.json:2:"), "{problem}");
    }

    #[test]
    fn numbers_keep_views_and_go_to_them() {
        use crate::client::window::action::UserAction;
        use crate::client::window::keys::Held;
        use crate::viewer::tools::{ToolAction, Tools};
        let keys = Tools::keys();
        let pressed = |ctrl, digit| keys.lookup(None, Some(digit), Held { ctrl, ..Held::default() });
        let action = |action| Some(BoundAction::Action(UserAction::Tool(ToolAction::Bookmarks(action))));
        assert_eq!(pressed(false, '3'), action(BookmarkAction::GoTo(3)));
        assert_eq!(pressed(true, '3'), action(BookmarkAction::Keep(3)));
        assert_eq!(pressed(true, '0'), None);
        use egui_kittest::kittest::Queryable;
        let pose = Pose { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, fov: 40.0, mirrored: false };
        let bookmarks = CameraBookmarks { views: [(2, pose)].into(), ..CameraBookmarks::default() };
        let draw = |ui: &mut Ui, (bookmarks, queue): &mut (CameraBookmarks, ActionQueue<_>)| {
            bookmarks.section(SectionPlace::Files, ui, queue);
        };
        let state = (bookmarks, ActionQueue::default());
        let mut harness = egui_kittest::Harness::builder().build_ui_state(draw, state);
        harness.run_steps(2);
        harness.get_by_label("2").click();
        harness.run_steps(2);
        harness.get_by_label("3").click();
        harness.run_steps(2);
        let taken = harness.state_mut().1.take();
        assert_eq!(taken, [UserAction::Tool(BookmarkAction::GoTo(2))], "nothing is kept under 3");
    }
}
