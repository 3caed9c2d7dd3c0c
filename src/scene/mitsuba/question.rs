//! The questions that readers of plugins ask about parameters: `tools/plugins` records them to document which parameters each plugin has.

use super::document::ElementId;

/// A question about one parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Whether it is given.
    Given,
    /// Its value, written as one of these elements.
    Value(&'static [&'static str]),
    /// The name of a file with this ending.
    File(String),
    /// Its default, which the reader states.
    Default(String),
    /// Whether to remark that it has no effect.
    Idle,
    /// Children with this tag, whatever their names.
    Nested,
}

/// The questions so far: plugin, parameter and question.
pub(crate) type Questions = std::sync::Mutex<Vec<(ElementId, &'static str, Question)>>;
