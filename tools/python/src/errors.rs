//! Errors of the renderer as exceptions.

use miette::{Diagnostic, Report};
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    pointillist,
    SceneError,
    PyValueError,
    "A scene that cannot be read. `file`, `line` and `column` (from 1, in characters) say where, `help` what to do or is None, and `entry` is\nthe keys of a dictionary that lead to the mistake, joined by dots."
);
create_exception!(pointillist, RenderError, PyRuntimeError, "A render that failed.");

/// A scene that cannot be read, with its place.
pub fn of_scene(py: Python<'_>, error: &pointillist::scene::SceneError) -> PyErr {
    let (file, line, column) = error.location();
    let help = error.help().map(|help| help.to_string());
    let advice = help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default();
    let raised = SceneError::new_err(format!("{file}:{line}:{column}: {error}{advice}"));
    let value = raised.value(py);
    let told = value
        .setattr("file", file)
        .and_then(|()| value.setattr("line", line))
        .and_then(|()| value.setattr("column", column))
        .and_then(|()| value.setattr("help", help));
    // An exception that cannot be told its place is itself the error.
    told.err().unwrap_or(raised)
}

/// A render that failed.
pub fn of_render(report: &Report) -> PyErr {
    RenderError::new_err(sentence(report))
}

/// A value that is not accepted.
pub fn of_value(report: &Report) -> PyErr {
    PyValueError::new_err(sentence(report))
}

/// The error with its causes and its advice.
fn sentence(report: &Report) -> String {
    let causes: Vec<String> = report.chain().map(ToString::to_string).collect();
    let advice = report.help().map(|help| format!(" ({help})")).unwrap_or_default();
    causes.join(": ") + &advice
}
