//! Regression renders: every case of a manifest is rendered, and judged against its reference with statistics instead of a threshold.
//!
//! A *case* is a scene rendered by one method on one device. It is rendered several times with independent seeds; the spread of these
//! renderings is the only source of its variances, so that neither the correlation of quasi-Monte Carlo points within a picture nor that
//! of neighbouring pixels by the splat filter enters. What they say together is the case's [`evidence::Evidence`]. A reference is the
//! evidence of an earlier run on disk, or that of another program rendered in the same run.
//!
//! | files | what |
//! |---|---|
//! | `plan.rs`, `manifest.rs`, `manifest/` | what is rendered, as plain data; read from `regress.toml` or found by convention |
//! | `evidence.rs`, `judgement.rs`, `statistics/` | mean, variance and areas of several renderings; whether two of them have the same expectation, and what would have been noticed |
//! | `sequential.rs` | how often a case is looked at, and what each look may spend of the probability of a false alarm |
//! | `run.rs`, `case_run.rs`, `renderings.rs`, `child.rs` | all cases; one case, as often as it takes; its renderings; one of them as a child process |
//! | `update.rs`, `merge.rs` | new references; the results of shards joined |
//! | `case_times.rs` | times of the renderings of a case, which are shown and not judged |
//! | `timing.rs`, `timed_run.rs` | ratios of times to those of another program; the interleaved renderings of both |
//! | `bisect.rs`, `bisect/` | the first revision whose picture has changed; what `git` does for it |
//! | `provenance.rs`, `sentence.rs` | hashes of scenes, programs and references, and their attributes; judgements in words |
//! | `run_report.rs`, `report/` | the result of a run: data of all reports; the reports |
//!
//! `README.md` beside this file is the guide for users, with every key of the manifest.
pub mod bisect;
pub mod case_run;
pub mod case_times;
mod child;
pub mod evidence;
pub mod judgement;
pub mod manifest;
pub mod merge;
pub mod plan;
pub mod provenance;
pub mod renderings;
pub mod report;
pub mod run;
pub mod run_report;
mod sentence;
pub mod sequential;
mod statistics;
pub mod timed_run;
pub mod timing;
pub mod update;
