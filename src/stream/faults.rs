//! Faults are raised like the exception flags of IEEE 754: by whatever finds a bad value, deep in a path, for who drives the paths.
//!
//! Each thread has flags of its own. [`take`] empties them after a path; without a fault it costs one load.

use std::cell::{Cell, RefCell};

use super::rejections::{Cause, Fault, FaultyValue};

/// Most faults of one path that are kept.
const MOST: usize = 64;

thread_local! {
    static RAISED: Cell<bool> = const { Cell::new(false) };
    static PENDING: RefCell<Vec<Raised>> = const { RefCell::new(Vec::new()) };
    static GENERATIONS: Cell<Option<u64>> = const { Cell::new(None) };
}

/// A fault of the path in progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raised {
    /// The fault.
    pub fault: Fault,
    /// Number of the light path of photon mapping that it was found in, if it was one.
    pub light_path: Option<u64>,
}

/// Raises the fault of a value that the caller leaves out, at a surface or from a light: one that is no number, negative or too large.
#[cold]
#[inline(never)]
pub fn raise(part: FaultyValue, values: [f32; 4], surface: Option<u32>, light: Option<u32>) {
    let negative = || values.iter().any(|v| *v < 0.0).then_some(Cause::NotPositive);
    let cause = Cause::of(&values).or_else(negative).unwrap_or(Cause::TooLarge);
    RAISED.set(true);
    PENDING.with_borrow_mut(|pending| {
        if pending.len() < MOST {
            pending.push(Raised { fault: Fault { cause, part, surface, light }, light_path: None });
        }
    });
}

/// Raises faults that were taken before.
#[inline]
pub fn raise_again(faults: &[Raised]) {
    if !faults.is_empty() {
        RAISED.set(true);
        PENDING.with_borrow_mut(|pending| {
            let room = MOST.saturating_sub(pending.len());
            pending.extend(faults.iter().take(room));
        });
    }
}

/// Says that what was raised since the last call is of this light path of photon mapping.
#[inline]
pub fn of_light_path(number: u64) {
    if RAISED.get() {
        PENDING.with_borrow_mut(|pending| {
            let new = pending.iter_mut().rev().take_while(|raised| raised.light_path.is_none());
            new.for_each(|raised| raised.light_path = Some(number));
        });
    }
}

/// Says how many generations of photons the path in progress sees.
#[inline]
pub fn sees_generations(count: u64) {
    GENERATIONS.set(Some(count));
}

/// The generations of photons that the path in progress sees, if any.
pub fn generations() -> Option<u64> {
    GENERATIONS.get()
}

/// The faults raised since the last call of [`take`].
pub fn pending() -> Vec<Raised> {
    PENDING.with_borrow(Vec::clone)
}

/// Takes the faults raised since the last call.
#[inline]
pub fn take() -> Vec<Raised> {
    match RAISED.replace(false) {
        false => Vec::new(),
        true => PENDING.with_borrow_mut(std::mem::take),
    }
}
