//! Every material from every direction.

use std::thread;

use glam::Vec3;

use pointillist::tracer::bsdf::ScatteringModel;

use super::cases::{Case, Energy, all, bounds};
use super::quadrature::{Fault, Means, examine};
use super::textbook::Textbook;
use super::{INCIDENCES, direction};
use crate::Row;
use crate::support::bsdfs::BSDFS;

/// A material, a direction to it, and what was found.
struct Finding {
    case: Case,
    incidence: f64,
    behind: bool,
    /// How many cases are this one.
    count: usize,
    result: Result<Means, Fault>,
}

/// Examines every case from everywhere, or what stands in its place.
fn findings<B: ScatteringModel>(cases: &[Case], bsdf: impl Fn(&Case) -> B + Sync) -> Vec<Finding> {
    // Roughnesses below the least are that one: the same material need not be examined again.
    let mut unique: Vec<(String, &Case, usize)> = Vec::new();
    for case in cases {
        let all = format!("{case:?}");
        match unique.iter_mut().find(|(name, ..)| *name == all) {
            Some((_, _, count)) => *count += 1,
            None => unique.push((all, case, 1)),
        }
    }
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let part = |thread: usize| {
        let mut found: Vec<Finding> = Vec::new();
        for (_, case, count) in unique.iter().skip(thread).step_by(threads) {
            for behind in [false, true].into_iter().take(1 + usize::from(case.transmits)) {
                for incidence in INCIDENCES {
                    let wo = direction(incidence);
                    let wo: Vec3 = if behind { wo.with_z(-wo.z) } else { wo };
                    let result = examine(&bsdf(case), case, wo, bounds(case, wo));
                    found.push(Finding { case: (*case).clone(), incidence, behind, count: *count, result });
                }
            }
        }
        found
    };
    thread::scope(|scope| {
        let part = &part;
        let parts: Vec<_> = (0..threads).map(|i| scope.spawn(move || part(i))).collect();
        parts.into_iter().flat_map(|part| part.join().unwrap()).collect()
    })
}

/// The share of findings with a fault; the faults of each material are printed.
fn share(name: &str, findings: &[Finding]) -> f64 {
    let mut models: Vec<_> = findings.iter().map(|f| f.case.model).collect();
    models.dedup();
    models.sort_unstable();
    models.dedup();
    for model in models {
        let of_model = || findings.iter().filter(|f| f.case.model == model);
        let faults: Vec<_> = of_model().filter(|f| f.result.is_err()).collect();
        if faults.is_empty() {
            continue;
        }
        println!("{name}, {model}: {} of {} fail", faults.len(), of_model().count());
        for Finding { case, incidence, behind, result, .. } in faults.iter().take(12) {
            let (alpha, index) = (case.alpha.refract, case.index);
            println!(
                "    roughness {alpha:e}, index {index}, {incidence}°, behind {behind}: {:?}",
                result.as_ref().err()
            );
        }
    }
    count(&mut findings.iter().filter(|f| f.result.is_err())) as f64 / count(&mut findings.iter()) as f64
}

/// How many cases these are.
fn count(findings: &mut dyn Iterator<Item = &Finding>) -> usize {
    findings.map(|f| f.count).sum()
}

/// How far what a material returns is from what it may.
fn excess(findings: &[Finding]) -> f64 {
    let of = |f: &Finding| {
        let wo = direction(f.incidence);
        let [least, most] = bounds(&f.case, if f.behind { wo.with_z(-wo.z) } else { wo });
        match f.result {
            Ok(Means { value, delta, .. }) => (value + delta - most).max(least - value - delta).max(0.0),
            Err(Fault::Energy(returned)) => (returned - most).max(least - returned).max(0.0),
            Err(_) => f64::INFINITY,
        }
    };
    findings.iter().map(of).fold(0.0, f64::max)
}

/// Every material × roughness 0 … 1 × index 1 … 200 × incidence 0 … 89.9999°, from both sides where light passes: samples and evaluations
/// are finite for random numbers from 0 to 1 − 2⁻²⁴ and agree, the density is 1 in all within 1e-3 (with the probability of
/// deltas and of paths that end), weights have the integral of the values as their mean, and energy is within its bounds: all that
/// arrives where nothing is lost, what facets return by one scattering where they are GGX's, in double precision. None may fail.
#[test]
fn n1_n9_n17_every_material() {
    let cases = all();
    let found = findings(&cases, |case| case.bsdf);
    let glass: Vec<_> = cases.into_iter().filter(|case| case.model == "roughdielectric").collect();
    let textbook = |case: &Case| Textbook { alpha: case.alpha.refract as f32, eta: case.index };
    let naive = findings(&glass, textbook);
    let textbook = share("textbook", &naive);
    Row {
        case: &format!(
            "N1 N9 N17 materials × roughness × index × incidence, {} cases",
            count(&mut found.iter())
        ),
        measure: "share that fails",
        figure: share("renderer", &found),
        naive: ("rough glass by Walter et al. in single precision", textbook),
        bound: 0.0,
    }
    .check();
    let lossless = |f: &&Finding| !matches!(f.case.energy, Energy::AtMost(most) if most > 1.0);
    let white: Vec<_> = found.into_iter().filter(|f| lossless(&f)).collect();
    Row {
        case: "N1 white furnace over all of them that conserve energy",
        measure: "largest error of what returns, beside what a single scattering loses",
        figure: excess(&white),
        naive: ("rough glass by Walter et al. in single precision", excess(&naive)),
        bound: 1e-3,
    }
    .check();
}

/// The widths of lobes and the energy that a model returns are known for each model alone: what has no case is not examined.
#[test]
fn every_plugin_has_a_case() {
    let cases = all();
    for plugin in BSDFS.iter().map(|entry| entry.plugin) {
        let has_case = cases.iter().any(|case| case.model.split(',').next() == Some(plugin));
        assert!(has_case, "tests/stability/bsdf/cases.rs: add a case for `{plugin}` to the list of `all`");
    }
}
