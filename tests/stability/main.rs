//! Hard cases stay numerically stable. Each test is a row of the table in `tests/README.md`: its figure holds a bound that the naive method
//! breaks on the same input, because a case that the naive method passes proves nothing.
//!
//! `cargo test --test stability -- --nocapture | grep '^|'` prints the rows.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod backdrop;
mod basis;
mod bsdf;
mod camera;
mod coats;
mod colors;
mod connections;
mod display;
mod energy;
mod environment;
mod extremes;
mod faults;
mod fireflies;
mod late;
mod light_shapes;
mod media;
mod media_grids;
mod media_places;
mod mis_weights;
mod photon_cases;
mod photons;
mod place;
mod points;
mod rays;
mod roulette;
mod sequence;
mod sink;
mod sums;
mod terminator;
mod variance;

/// A row of the table.
struct Row<'a> {
    /// What is hard.
    case: &'a str,
    /// What is measured.
    measure: &'a str,
    /// Of the renderer.
    figure: f64,
    /// Of the method that is named here.
    naive: (&'a str, f64),
    /// The largest figure that is right.
    bound: f64,
}

impl Row<'_> {
    /// Prints the row and fails if the renderer breaks the bound, or the naive method holds it.
    fn check(&self) {
        let Self { case, measure, figure, naive: (method, naive), bound } = *self;
        println!("| {case} | {measure} | {figure:.2e} | {method}: {naive:.2e} | {bound:.0e} |");
        assert!(figure <= bound, "{case}: {measure} is {figure:e}, above {bound:e}");
        assert!(
            naive.is_nan() || naive > bound,
            "{case}: {method} passes, too: {naive:e}. The case is not hard"
        );
    }
}
