//! Numbered camera bookmarks, stored in a file beside the scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use miette::{Result, miette};

use crate::client::window::navigation::Pose;
use crate::image::write::atomically;

/// Camera bookmarks of one scene.
#[derive(Debug, Default)]
pub struct CameraBookmarks {
    /// `SCENE.views.json`.
    file: PathBuf,
    views: BTreeMap<u8, Pose>,
    /// The file exists but could not be parsed, so it must not be overwritten.
    is_foreign: bool,
}

impl CameraBookmarks {
    /// Reads the bookmarks stored beside this scene.
    ///
    /// # Errors
    ///
    /// If the file exists but cannot be read, returns no bookmarks and a message that names it.
    pub fn beside(scene: &Path) -> (Self, Option<String>) {
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

    /// Numbers in use.
    pub fn numbers(&self) -> Vec<u8> {
        self.views.keys().copied().collect()
    }

    /// Stores a pose under a number; returns a message.
    ///
    /// # Errors
    ///
    /// When the file cannot be written. The bookmark is then kept for this session only.
    pub fn keep(&mut self, number: u8, pose: Pose) -> Result<String> {
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
    pub fn get(&self, number: u8) -> Result<Pose> {
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
        assert_eq!((problem, again.numbers(), again.get(3).expect("kept")), (None, vec![3], pose));
        std::fs::write(folder.path().join("room.views.json"), "{\n  3").expect("a file");
        let (none, problem) = CameraBookmarks::beside(&scene);
        let mut none = none;
        assert!(none.numbers().is_empty() && none.keep(1, pose).is_err(), "it is not written over");
        let text = std::fs::read_to_string(folder.path().join("room.views.json")).expect("the file");
        assert_eq!(text, "{\n  3");
        let problem = problem.expect("a message");
        assert!(problem.contains("room.views.json:2:"), "{problem}");
    }
}
