//! Survey and trials of several methods beside each other.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;

/// Maps the values of several methods beside each other, if there are several `threads`. Those whose paths panic are left out then: they will
/// panic again in the render, where it is reported.
pub(super) fn each<T: Send, R: Send>(values: Vec<T>, threads: usize, map: impl Fn(T) -> R + Sync) -> Vec<R> {
    if threads < 2 {
        return values.into_iter().map(map).collect();
    }
    let mapped = |value| catch_unwind(AssertUnwindSafe(|| map(value))).ok();
    values.into_par_iter().filter_map(mapped).collect()
}
