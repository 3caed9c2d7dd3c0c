//! Regression renders: every case of a manifest is rendered, and judged against its reference with statistics instead of a threshold.
//!
//! A *case* is a scene rendered by one method on one device. It is rendered several times with independent seeds; the spread of these
//! renderings is the only source of its variances, so that neither the correlation of quasi-Monte Carlo points within a picture nor that
//! of neighbouring pixels by the splat filter enters. What they say together is the case's [`evidence::Evidence`]. A reference is the
//! evidence of an earlier run on disk, or that of another program rendered in the same run.
//!
//! | files | what |
//! |---|---|
//! | `plan.rs`, `manifest.rs` | what is rendered, as plain data; read from `regress.toml` or found by convention |
//! | `evidence.rs`, `judgement.rs` | mean, variance and areas of several renderings; whether two of them have the same expectation, and what would have been noticed |
//! | `run_report.rs`, `report/` | the result of a run: data of all reports; the reports: terminal, JUnit, annotations, HTML page, history |
pub mod evidence;
pub mod judgement;
pub mod plan;
pub mod report;
pub mod run_report;
