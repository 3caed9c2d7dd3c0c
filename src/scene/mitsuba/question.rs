//! What the readers of plugins ask of parameters, from which `documentation/` learns what a plugin has.

use super::document::ElementId;

/// What a plugin's reader wants to know of one of its parameters. Noted in a documentation run only.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Question {
    /// Whether it is given.
    Given,
    /// Its value, written as one of these elements.
    Value(&'static [&'static str]),
    /// The name of a file with this ending.
    File(String),
    /// What it is if it is not given.
    Default(String),
    /// Nothing but whether to remark that it changes nothing.
    Idle,
    /// Children with this tag, whatever their names.
    Nested,
}

/// The questions of all plugins so far: which one, about which parameter, what.
pub(crate) type Questions = std::sync::Mutex<Vec<(ElementId, &'static str, Question)>>;
