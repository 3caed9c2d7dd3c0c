//! A run without a window and without a command line: from options to a film, its pictures and its report.
//!
//! | files | what |
//! |---|---|
//! | `options.rs` | what is asked for, as plain data: the command line is read into it |
//! | `load.rs`, `device.rs`, `edited_scene.rs`, `warnings.rs` | the scene and the device; a scene with edits; what is said of the scene |
//! | `run_spec.rs`, `method.rs`, `effect_plan.rs`, `remote_order.rs` | what a run is made of; its method of light transport; its effects; the same for a tracer elsewhere |
//! | `batch.rs`, `batch/in_memory.rs`, `checks.rs` | a render from start to end; its picture without a file; options that exclude each other |
//! | `drive.rs`, `adaptive.rs`, `progress.rs`, `watch.rs` | from the lanes to the film; its adaptive stages; its progress bar; a caller that watches it |
//! | `films.rs`, `film_writer.rs`, `observed.rs`, `predictions.rs` | the films of a render; where samples are added up; what the accounts of a run begin with; the log of predicted times |
//! | `outputs.rs`, `live_outputs.rs`, `layers.rs`, `light_groups.rs`, `tev.rs` | files of pictures; snapshots on the way; layers beside the picture; pictures by groups of lights; the viewer tev |
//! | `stereo.rs`, `stereo_outputs.rs`, `stereo_error.rs` | two eyes; files of their pictures; their stated errors |
//! | `figures.rs`, `report.rs`, `rejected.rs`, `effect_price.rs` | figures as JSON and on standard output; those of a render; rejected values in words; what each effect costs |
//! | `state/` | renders in parts: their files, their sum |
//! | `timings.rs`, `trace.rs`, `pipelines.rs`, `process.rs`, `calendar.rs` | `--gpu-timings`; compiled pipelines on disk; signals and standard error; dates |

pub mod adaptive;
pub mod batch;
pub mod calendar;
pub mod checks;
pub mod device;
pub mod drive;
pub mod edited_scene;
pub mod effect_plan;
pub mod effect_price;
pub mod figures;
pub mod film_writer;
pub mod films;
pub mod forced;
pub mod layers;
pub mod light_groups;
pub mod live_outputs;
pub mod load;
pub mod method;
pub mod observed;
pub mod options;
pub mod outputs;
pub mod pipelines;
pub mod predictions;
pub mod process;
pub mod progress;
pub mod rejected;
pub mod remote_order;
pub mod report;
pub mod run_spec;
pub mod state;
pub mod stereo;
pub mod stereo_error;
pub mod stereo_outputs;
pub mod tev;
pub mod timings;
pub mod trace;
pub mod warnings;
pub mod watch;
