//! Reports of a run.

use std::path::Path;

use super::run_report::RunReport;
use crate::image::ImageError;

/// A table for the terminal.
pub fn terminal(_report: &RunReport) -> String {
    unreachable!("written elsewhere")
}

/// JUnit XML.
pub fn junit(_report: &RunReport) -> String {
    unreachable!("written elsewhere")
}

/// A page that needs no other file.
///
/// # Errors
/// When pictures cannot be encoded.
pub fn html(_report: &RunReport, _results: &Path) -> Result<String, ImageError> {
    unreachable!("written elsewhere")
}

/// Workflow commands of GitHub.
pub fn annotations(_report: &RunReport) -> String {
    unreachable!("written elsewhere")
}

/// Appends the run to the history in the folder of the results.
///
/// # Errors
/// When it cannot be written.
pub fn record(_report: &RunReport, _results: &Path) -> miette::Result<()> {
    unreachable!("written elsewhere")
}
