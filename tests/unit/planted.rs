//! The parts of the study of planted changes (`tools/benchmarks/planted/`) that are wrong in silence: their tests stand beside them, and the tests of
//! examples are not run.

#[path = "../../tools/benchmarks/planted/power.rs"]
mod power;
#[path = "../../tools/benchmarks/planted/spirv.rs"]
mod spirv;
