//! Undo and redo of camera moves. A drag, or a run of wheel steps, is one entry.

use std::collections::VecDeque;
use std::mem::{Discriminant, discriminant};

use glam::DVec2;

use crate::client::window::navigation::{Gesture, Pose};

/// Most entries; beyond it the oldest is forgotten.
const LONGEST: usize = 500;

/// The poses of the camera that undo and redo walk through.
#[derive(Clone, Debug)]
pub struct CameraHistory {
    home: Pose,
    poses: VecDeque<Pose>,
    /// Place of the present pose in `poses`.
    at: usize,
    /// Kind of the move that still extends the last entry.
    open: Option<Discriminant<Gesture>>,
}

impl CameraHistory {
    /// Starts at the file's pose.
    pub fn new(home: Pose) -> Self {
        Self { home, poses: VecDeque::from([home]), at: 0, open: None }
    }

    /// The present pose.
    pub fn pose(&self) -> Pose {
        self.poses[self.at]
    }

    /// The file's pose.
    pub fn home(&self) -> Pose {
        self.home
    }

    /// The same moves, with another pose of the file.
    pub fn with_home(self, home: Pose) -> Self {
        Self { home, ..self }
    }

    /// Moves the camera, in a window of this `shape` (see [`Pose::apply_in`]); returns whether anything changed. Moves of
    /// one kind are one entry until [`CameraHistory::end_move`]; flying and looking go together.
    pub fn apply(&mut self, gesture: Gesture, shape: DVec2) -> bool {
        let next = self.pose().apply_in(gesture, shape);
        if next == self.pose() {
            return false;
        }
        // The same drag flies and looks around: both extend one entry.
        let kind = match gesture {
            Gesture::Fly(_) => discriminant(&Gesture::Look(DVec2::ZERO)),
            other => discriminant(&other),
        };
        if self.open == Some(kind) {
            self.poses[self.at] = next;
        } else {
            self.push(next);
            self.open = Some(kind);
        }
        true
    }

    /// Ends the move: the next one is an entry of its own.
    pub fn end_move(&mut self) {
        self.open = None;
    }

    /// Sets the field of view, in degrees; successive calls are one entry.
    pub fn set_fov(&mut self, fov: f64) -> bool {
        let by = fov - self.pose().fov;
        self.apply(Gesture::Fov(by), DVec2::ONE)
    }

    /// Returns to the pose before the last move; `None` at the beginning.
    pub fn undo(&mut self) -> Option<Pose> {
        self.open = None;
        self.at = self.at.checked_sub(1)?;
        Some(self.pose())
    }

    /// Repeats the move that was undone last; `None` when there is none.
    pub fn redo(&mut self) -> Option<Pose> {
        self.open = None;
        if self.at + 1 >= self.poses.len() {
            return None;
        }
        self.at += 1;
        Some(self.pose())
    }

    /// Takes this pose, as an entry that can be undone; returns whether it is another one.
    pub fn go_to(&mut self, pose: Pose) -> bool {
        self.open = None;
        if pose == self.pose() || !pose.is_usable() {
            return false;
        }
        self.push(pose);
        true
    }

    /// Returns to the file's pose, as an entry that can be undone; `None` when the camera is there already.
    pub fn reset(&mut self) -> Option<Pose> {
        self.open = None;
        if self.pose() == self.home {
            return None;
        }
        self.push(self.home);
        Some(self.home)
    }

    /// Adds an entry and forgets all moves that were undone.
    fn push(&mut self, pose: Pose) {
        self.poses.truncate(self.at + 1);
        self.poses.push_back(pose);
        if self.poses.len() > LONGEST {
            self.poses.pop_front();
        }
        self.at = self.poses.len() - 1;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn start() -> CameraHistory {
        CameraHistory::new(Pose {
            eye: DVec3::Z * 4.0,
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            mirrored: false,
        })
    }

    #[test]
    fn a_drag_is_one_entry() {
        let mut history = start();
        let home = history.pose();
        for _ in 0..20 {
            assert!(history.apply(Gesture::Orbit(DVec2::new(0.01, 0.0)), DVec2::ONE));
        }
        history.end_move();
        let first = history.pose();
        history.apply(Gesture::Orbit(DVec2::new(0.01, 0.0)), DVec2::ONE);
        assert_eq!(history.undo(), Some(first));
        assert_eq!(history.undo(), Some(home));
        assert_eq!(history.undo(), None);
        assert_eq!(history.pose(), home);
        assert_eq!(history.redo(), Some(first));
    }

    #[test]
    fn kinds_are_told_apart_but_flying_and_looking() {
        let mut history = start();
        history.apply(Gesture::Dolly(1.0), DVec2::ONE);
        history.apply(Gesture::Fov(1.0), DVec2::ONE);
        assert_eq!(history.poses.len(), 3);
        history.apply(Gesture::Fly(DVec3::Z), DVec2::ONE);
        history.apply(Gesture::Look(DVec2::X * 0.1), DVec2::ONE);
        history.apply(Gesture::Fly(DVec3::Z), DVec2::ONE);
        assert_eq!(history.poses.len(), 4);
    }

    #[test]
    fn a_new_move_forgets_what_was_taken_back() {
        let mut history = start();
        for step in [1.0, 2.0, 3.0] {
            history.apply(Gesture::Dolly(step), DVec2::ONE);
            history.end_move();
        }
        history.undo();
        history.undo();
        assert_eq!((history.at, history.poses.len()), (1, 4));
        history.apply(Gesture::Pan(DVec2::X), DVec2::ONE);
        assert_eq!((history.at, history.poses.len()), (2, 3));
        assert_eq!(history.redo(), None);
        assert_eq!(history.poses.len(), 3);
    }

    #[test]
    fn reset_can_be_taken_back_and_is_idle_at_home() {
        let mut history = start();
        assert_eq!(history.reset(), None);
        history.apply(Gesture::Dolly(3.0), DVec2::ONE);
        let moved = history.pose();
        assert_eq!(history.reset(), Some(history.home()));
        assert_eq!(history.undo(), Some(moved));
    }

    #[test]
    fn nothing_happens_for_moves_without_effect() {
        let mut history = start();
        assert!(!history.apply(Gesture::Dolly(f64::NAN), DVec2::ONE));
        assert!(!history.apply(Gesture::Focus(DVec3::Z * 4.0), DVec2::ONE));
        assert_eq!((history.at, history.poses.len()), (0, 1));
        assert!(history.set_fov(50.0));
        assert!(!history.set_fov(50.0));
        assert_eq!(history.pose().fov, 50.0);
    }

    #[test]
    fn the_oldest_entries_go_first() {
        let mut history = start();
        for _ in 0..LONGEST + 50 {
            history.apply(Gesture::Orbit(DVec2::X * 0.01), DVec2::ONE);
            history.end_move();
        }
        assert_eq!(history.poses.len(), LONGEST);
        assert_eq!(std::iter::from_fn(|| history.undo()).count(), LONGEST - 1);
    }
}
