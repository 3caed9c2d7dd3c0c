//! The command palette: every binding of the key table that is a command, searched by words.

use egui::{Align2, Context, Id, Key, Modifiers, Order, RichText, ScrollArea, TextEdit, Window};

use crate::client::window::action::{Action, UserAction};
use crate::client::window::keys::{BoundAction, KeyBinding, KeyTable};
use crate::client::window::panel::style;

/// Width of the palette, points.
const WIDTH: f32 = 340.0;

/// Visible rows.
const ROWS: f32 = 12.0;

/// State of the palette: query, and selected command.
#[derive(Clone, Debug, Default)]
pub struct CommandPalette {
    /// Whether it is shown.
    pub is_open: bool,
    /// Text typed so far.
    query: String,
    /// Index of the selected command among the matches.
    chosen: usize,
}

impl CommandPalette {
    /// Opens the palette, empty, or closes it.
    pub fn toggle(&mut self) {
        *self = Self { is_open: !self.is_open, ..Self::default() };
    }
}

/// A command that matches what was typed.
struct Match<T> {
    meaning: String,
    keys: &'static str,
    action: UserAction<T>,
}

/// Commands of a binding.
fn commands<T: Clone>(binding: &KeyBinding<T>) -> Vec<Match<T>> {
    let one = |action| vec![Match { meaning: capitalised(binding.meaning), keys: binding.keys, action }];
    match &binding.action {
        BoundAction::Action(action) => one(action.clone()),
        BoundAction::AtCursor(action) => one(UserAction::Window(Action::AskPlace(*action))),
        BoundAction::ToolAtCursor(action) => one(UserAction::AskPlace(action.clone())),
        BoundAction::Each(all) => {
            let each = |(name, action): &(String, T)| {
                let action = UserAction::Tool(action.clone());
                Match { meaning: name.clone(), keys: binding.keys, action }
            };
            all.iter().map(each).collect()
        }
        BoundAction::Described => Vec::new(),
    }
}

/// Commands that match the query, best first.
fn matches<T: Clone>(keys: &KeyTable<T>, query: &str) -> Vec<Match<T>> {
    let all = keys.bindings().flat_map(commands);
    let mut found: Vec<_> =
        all.filter_map(|command| Some((rank(&command.meaning, query)?, command))).collect();
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, command)| command).collect()
}

/// Rank of a command, smaller is better: every word of the query must begin a word of the command or occur within one; `None` otherwise.
fn rank(meaning: &str, query: &str) -> Option<usize> {
    let meaning = meaning.to_lowercase();
    let word = |word: &str| {
        let begins = meaning.split(|c: char| !c.is_alphanumeric()).position(|w| w.starts_with(word));
        begins.or_else(|| meaning.contains(word).then_some(100))
    };
    query.to_lowercase().split_whitespace().try_fold(0, |sum, w| Some(sum + word(w)?))
}

/// Draws the palette if open; returns the chosen action.
pub(super) fn show<T: Clone>(
    ctx: &Context,
    palette: &mut CommandPalette,
    keys: &KeyTable<T>,
) -> Option<UserAction<T>> {
    if !palette.is_open {
        return None;
    }
    let found = matches(keys, &palette.query);
    let pressed = |key: Key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    if pressed(Key::ArrowDown) {
        palette.chosen += 1;
    }
    if pressed(Key::ArrowUp) {
        palette.chosen = palette.chosen.saturating_sub(1);
    }
    palette.chosen = palette.chosen.min(found.len().saturating_sub(1));
    let (enter, escape) = (pressed(Key::Enter), pressed(Key::Escape));
    // The key that opens the palette also closes it.
    let closes = escape || ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::K));
    let mut action = found.get(palette.chosen).filter(|_| enter).map(|command| command.action.clone());
    let window =
        Window::new("Commands").collapsible(false).resizable(false).title_bar(false).order(Order::Foreground);
    let window = window.fade_in(false).fade_out(false).anchor(Align2::CENTER_TOP, [0.0, 40.0]);
    window.show(ctx, |ui| {
        ui.set_width(WIDTH.min(ctx.content_rect().width() - 32.0));
        let field =
            TextEdit::singleline(&mut palette.query).id(Id::new("command")).desired_width(f32::INFINITY);
        let field = ui.add(field.hint_text("Type a part of a command"));
        field.request_focus();
        if field.changed() {
            palette.chosen = 0;
        }
        let height = ROWS * (ui.spacing().interact_size.y + ui.spacing().item_spacing.y);
        ScrollArea::vertical().max_height(height).show(ui, |ui| {
            ui.set_min_width(ui.available_width());
            if found.is_empty() {
                ui.colored_label(style::DIM, "No command has these words.");
            }
            for (i, command) in found.iter().enumerate() {
                ui.horizontal(|ui| {
                    let row = ui.selectable_label(i == palette.chosen, &command.meaning);
                    if i == palette.chosen {
                        row.scroll_to_me(None);
                    }
                    if row.clicked() {
                        action = Some(command.action.clone());
                    }
                    ui.label(RichText::new(command.keys).small().color(style::ACCENT));
                });
            }
        });
    });
    if action.is_some() || enter || closes {
        palette.toggle();
    }
    action.filter(|action| !matches!(action, UserAction::Window(Action::TogglePalette)))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    use crate::client::window::action::CursorAction;

    #[test]
    fn commands_are_found_by_parts_of_their_words() {
        let keys = KeyTable::<Infallible>::new(Vec::new());
        let first = |query: &str| match matches(&keys, query).first().map(|command| command.action.clone()) {
            Some(UserAction::Window(action)) => Some(action),
            _ => None,
        };
        assert_eq!(first("zoom"), Some(Action::AskPlace(CursorAction::ZoomIn)));
        assert_eq!(first("open"), Some(Action::OpenDialog));
        assert_eq!(first("save exr"), Some(Action::SaveExr));
        assert_eq!(first("EXR sav"), Some(Action::SaveExr));
        assert_eq!(first("full"), Some(Action::ToggleFullscreen));
        assert_eq!(first("no such thing"), None);
        assert!(matches(&keys, "").len() > 20);
    }
}
