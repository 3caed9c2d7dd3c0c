//! The plan of a run: every effect of tracer and client, on or off, and why. Joins the two halves; decides nothing.

use serde::Serialize;

use super::facts::RunFacts;
use crate::client::{Settings, decisions};
use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};
use crate::tracer::features::{self, Feature};

/// One effect. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// Its name.
    pub effect: &'static str,
    /// Who simulates it.
    pub side: Side,
    /// It is simulated.
    pub on: bool,
    /// What calls for it, or why nothing does.
    pub reason: String,
    /// `file:line:column` of the object that calls for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
    /// What was measured, if it was.
    #[serde(flatten)]
    pub cost: Cost,
    /// The tracer's feature.
    #[serde(skip)]
    pub feature: Option<Feature>,
    /// The client's passes.
    #[serde(skip)]
    pub passes: &'static [&'static str],
    /// What the names of its images and buffers begin with.
    #[serde(skip)]
    pub images: &'static [&'static str],
}

/// Who simulates an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Paths, on the CPU.
    Tracer,
    /// Passes, on the device.
    Client,
}

/// What an effect costs; absent where it was not measured.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Cost {
    /// Share of the tracing time that is saved without it, or of the device's time that its passes take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Milliseconds of its passes per frame, median.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub milliseconds: Option<f64>,
    /// Milliseconds per frame that its passes would take, where it is off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_on: Option<f64>,
    /// Bytes of device memory that it holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
}

/// Every effect of a run, the tracer's first. `desc` is what is traced, with everything that is forced off already gone.
pub fn plan(desc: &SceneDesc, facts: &RunFacts, settings: &Settings) -> Vec<Entry> {
    let place = |place: Place| {
        let file = desc.files.get(place.file as usize)?;
        Some(format!("{}:{}:{}", file.display(), place.line, place.column))
    };
    let traced = features::decide(desc, facts.integrator).into_iter().map(|d| {
        let off = facts.effects.iter().any(|f| f.feature == d.feature && !f.on);
        let forced = |reason| if off { "forced off by --effects".to_string() } else { reason };
        Entry {
            effect: d.feature.name(),
            side: Side::Tracer,
            on: d.on && !off,
            reason: forced(d.reason),
            place: d.place.and_then(place),
            cost: Cost::default(),
            feature: Some(d.feature),
            passes: &[],
            images: &[],
        }
    });
    let shown = decisions::decisions(&facts.spec, settings, streams(facts.integrator)).into_iter();
    let shown = shown.map(|d| Entry {
        effect: d.name,
        side: Side::Client,
        on: d.on,
        reason: d.reason,
        place: None,
        cost: Cost::default(),
        feature: None,
        passes: d.passes,
        images: d.images,
    });
    traced.chain(shown).collect()
}

/// Which streams a method fills, camera and light.
pub fn streams(kind: IntegratorKind) -> [bool; 2] {
    match kind {
        IntegratorKind::Light => [false, true],
        IntegratorKind::Bidirectional => [true, true],
        IntegratorKind::Path | IntegratorKind::Photon | IntegratorKind::Auto => [true, false],
    }
}
