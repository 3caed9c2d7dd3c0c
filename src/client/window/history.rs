//! Undo and redo of all user changes, as snapshots of the state. A drag, or a run of wheel steps, is one entry.

use std::collections::VecDeque;

/// Most entries; the oldest is dropped first.
pub const LONGEST: usize = 2000;

/// A state, and the name of the change that led to it.
#[derive(Clone, Debug)]
struct HistoryEntry<S> {
    /// Name of the change, such as `move of ball`; empty for the first state.
    change: String,
    state: S,
}

/// Undo history. States that share most of their data should be cheap to clone.
#[derive(Clone, Debug)]
pub struct UndoHistory<S> {
    entries: VecDeque<HistoryEntry<S>>,
    /// Index of the present state in `entries`.
    at: usize,
    /// Subject of the last entry while it is open, that is, while further changes of this subject extend it.
    open: Option<String>,
}

impl<S: Clone + PartialEq> UndoHistory<S> {
    /// A history that begins with this state.
    pub fn new(state: S) -> Self {
        Self { entries: [HistoryEntry { change: String::new(), state }].into(), at: 0, open: None }
    }

    /// The present state.
    pub fn state(&self) -> &S {
        &self.entries[self.at].state
    }

    /// Changes the state; `change` is the name of the change. Returns false if the state stays the same. Until [`end`](Self::end), changes
    /// of one `subject` share one entry. Undone changes are dropped.
    pub fn change(&mut self, subject: &str, change: &str, state: S) -> bool {
        if state == *self.state() {
            return false;
        }
        let entry = HistoryEntry { change: change.to_owned(), state };
        self.entries.truncate(self.at + 1);
        if self.at > 0 && self.open.as_deref() == Some(subject) {
            self.entries[self.at] = entry;
            return true;
        }
        self.entries.push_back(entry);
        if self.entries.len() > LONGEST + 1 {
            self.entries.pop_front();
        }
        self.at = self.entries.len() - 1;
        self.open = Some(subject.to_owned());
        true
    }

    /// Closes the present entry: the next change begins a new one.
    pub fn end(&mut self) {
        self.open = None;
    }

    /// Name of the change that [`undo`](Self::undo) would revert.
    pub fn undo_name(&self) -> Option<&str> {
        (self.at > 0).then(|| self.entries[self.at].change.as_str())
    }

    /// Name of the change that [`redo`](Self::redo) would repeat.
    pub fn redo_name(&self) -> Option<&str> {
        self.entries.get(self.at + 1).map(|entry| entry.change.as_str())
    }

    /// Returns to the previous state and names the reverted change; `None` at the beginning.
    pub fn undo(&mut self) -> Option<String> {
        self.open = None;
        let change = self.undo_name()?.to_owned();
        self.at -= 1;
        Some(change)
    }

    /// Repeats the change that was undone last and names it; `None` if there is none.
    pub fn redo(&mut self) -> Option<String> {
        self.open = None;
        let change = self.redo_name()?.to_owned();
        self.at += 1;
        Some(change)
    }

    /// Converts all states with `translate`, keeping the entries.
    pub fn map(self, translate: impl FnMut(S) -> S) -> Self {
        let (mut translate, Self { entries, at, .. }) = (translate, self);
        let translated = |HistoryEntry { change, state }| HistoryEntry { change, state: translate(state) };
        Self { entries: entries.into_iter().map(translated).collect(), at, open: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_one_entry() {
        let mut history = UndoHistory::new(0);
        for step in 1..=20 {
            assert!(history.change("camera", "orbit of the camera", step));
        }
        history.end();
        history.change("camera", "orbit of the camera", 21);
        history.change("ball", "move of `ball`", 22);
        assert_eq!(history.undo_name(), Some("move of `ball`"));
        let undone: Vec<String> = std::iter::from_fn(|| history.undo()).collect();
        assert_eq!(undone, ["move of `ball`", "orbit of the camera", "orbit of the camera"]);
        assert_eq!((*history.state(), history.undo_name()), (0, None));
        assert_eq!((history.redo(), *history.state()), (Some("orbit of the camera".to_owned()), 20));
    }

    #[test]
    fn a_new_change_forgets_what_was_taken_back() {
        let mut history = UndoHistory::new(0);
        for step in 1..=3 {
            history.change("a", "a", step);
            history.end();
        }
        history.undo();
        history.undo();
        assert_eq!(history.redo_name(), Some("a"));
        assert!(history.change("a", "b", 9));
        assert_eq!((history.redo(), history.undo()), (None, Some("b".to_owned())));
        assert_eq!(*history.state(), 1);
    }

    /// An undone entry is not extended, and a change without effect is no entry.
    #[test]
    fn undoing_ends_a_change() {
        let mut history = UndoHistory::new(0);
        assert!(!history.change("a", "a", 0));
        history.change("a", "a", 1);
        history.undo();
        assert!(history.change("a", "a", 2) && history.redo_name().is_none());
        history.change("a", "a", 3);
        assert_eq!((history.undo(), *history.state()), (Some("a".to_owned()), 0));
    }

    #[test]
    fn the_oldest_entries_go_first() {
        let mut history = UndoHistory::new(0);
        for step in 1..=LONGEST + 50 {
            history.change("a", "a", step);
            history.end();
        }
        assert_eq!(std::iter::from_fn(|| history.undo()).count(), LONGEST);
        assert_eq!(*history.state(), 50);
        let doubled = history.map(|state| 2 * state);
        assert_eq!((*doubled.state(), doubled.redo_name()), (100, Some("a")));
    }
}
