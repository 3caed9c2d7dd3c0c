//! The program on the command line: files in, files out, messages, exit codes.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod adaptive;
mod compare;
mod effects;
mod explain;
mod farm;
mod layers;
mod light_groups;
mod live;
mod oidn;
mod pipelines;
mod plugins;
mod program;
mod regress;
mod regress_bisect;
mod regress_page;
mod regress_timing;
mod render_error;
mod serve;
mod simd;
mod state;
mod stereo;
mod study;
mod warnings;
