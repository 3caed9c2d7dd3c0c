//! Undo and redo of everything the user changes, by the states before and after. A drag, or a run of wheel steps, is one entry.

use std::collections::VecDeque;

/// Most entries; beyond it the oldest is forgotten.
pub const LONGEST: usize = 2000;

/// A state, and the change that has led to it.
#[derive(Clone, Debug)]
struct HistoryEntry<S> {
    /// The change in words, such as `move of ball`; empty for the first state.
    change: String,
    state: S,
}

/// The states that undo and redo walk through. Those that share much of their data should be cheap to clone.
#[derive(Clone, Debug)]
pub struct UndoHistory<S> {
    entries: VecDeque<HistoryEntry<S>>,
    /// Place of the present state in `entries`.
    at: usize,
    /// What the last entry is a change of, while further changes of it still extend the entry.
    open: Option<String>,
}

impl<S: Clone + PartialEq> UndoHistory<S> {
    /// Starts in this state.
    pub fn new(state: S) -> Self {
        Self { entries: [HistoryEntry { change: String::new(), state }].into(), at: 0, open: None }
    }

    /// The present state.
    pub fn state(&self) -> &S {
        &self.entries[self.at].state
    }

    /// Changes the state by `change`, in words; returns false where it stays the same. Changes of one `subject` are one entry until
    /// [`end`](Self::end). Changes that were undone are forgotten.
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

    /// Ends the change: the next one is an entry of its own.
    pub fn end(&mut self) {
        self.open = None;
    }

    /// The change that [`undo`](Self::undo) would take back.
    pub fn undo_name(&self) -> Option<&str> {
        (self.at > 0).then(|| self.entries[self.at].change.as_str())
    }

    /// The change that [`redo`](Self::redo) would repeat.
    pub fn redo_name(&self) -> Option<&str> {
        self.entries.get(self.at + 1).map(|entry| entry.change.as_str())
    }

    /// Returns to the state before the last change, and names that; `None` at the beginning.
    pub fn undo(&mut self) -> Option<String> {
        self.open = None;
        let change = self.undo_name()?.to_owned();
        self.at -= 1;
        Some(change)
    }

    /// Repeats the change that was undone last, and names it; `None` when there is none.
    pub fn redo(&mut self) -> Option<String> {
        self.open = None;
        let change = self.redo_name()?.to_owned();
        self.at += 1;
        Some(change)
    }

    /// The same history of states that are translated.
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

    /// An entry that was undone is not extended, and what changes nothing is no entry.
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
