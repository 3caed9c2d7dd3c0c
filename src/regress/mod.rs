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
//! | `sequential.rs` | how often a case is looked at, and what each look may spend of the probability of a false alarm |
//! | `statistics/` | areas, noise of a single picture, differences in units of their errors, permutations of renderings |
//! | `run_report.rs` | the result of a run: data of all reports |
pub mod evidence;
pub mod judgement;
pub mod plan;
pub mod run_report;
pub mod sequential;
mod statistics;
