//! Reports of a regression run: for the terminal, for a CI server, and for people with a browser.
//!
//! | file | what |
//! |---|---|
//! | `terminal.rs` | table and sentences for the terminal |
//! | `junit.rs`, `annotations.rs` | JUnit XML; workflow commands of GitHub Actions |
//! | `page.rs`, `case_section.rs`, `case_pictures.rs`, `course.rs` | one self-contained HTML page: summary and table; the section of a case; its pictures and maps; what earlier runs found |
//! | `timing_section.rs` | times of a case, and against another program: lines of text, and parts of the page |
//! | `history.rs` | what earlier runs found, a line each in `history.jsonl` of the folder of results |
//! | `wording.rs` | sentences and numbers that all of them share |
//!
//! All but the page and the history are pure, from [`RunReport`](super::run_report::RunReport) to text. Numbers that are not finite appear
//! as “—”, and no name or message of a case breaks a format.

mod annotations;
mod case_pictures;
mod case_section;
mod course;
mod history;
mod junit;
mod page;
#[cfg(test)]
mod sample;
mod terminal;
mod timing_section;
mod wording;

pub use annotations::annotations;
pub use history::record;
pub use junit::junit;
pub use page::html;
pub use terminal::{terminal, terminal_in_colors};
