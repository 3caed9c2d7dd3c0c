//! The plan of a run: every effect of tracer and client, whether it is on, and why. This module only joins the lists of both; they decide.

use serde::Serialize;

use crate::client::Settings;
use crate::client::effect_list::{ClientEffect, effect_list};
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::Place;
use crate::tracer::effects::{self, Effect};

/// One effect of the plan. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedEffect {
    #[serde(rename = "effect")]
    pub name: &'static str,
    /// The side that simulates it.
    pub side: EffectSide,
    pub on: bool,
    /// The object that needs the effect, or why none does.
    pub reason: String,
    /// `file:line:column` of the object that needs it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
    /// The code that makes the decision at run time.
    pub at_run_time: &'static str,
    /// Measured cost, if known.
    #[serde(flatten)]
    pub cost: Cost,
    /// The effect, if simulated by the tracer.
    #[serde(skip)]
    pub effect: Option<Effect>,
    /// Passes and images, if simulated by the client.
    #[serde(skip)]
    pub client: Option<ClientEffect>,
}

/// Side that simulates an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EffectSide {
    /// The tracer, with its paths on the CPU.
    Tracer,
    /// The client, with its passes on the device.
    Client,
}

/// Measured cost of an effect; `None` where not measured.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Cost {
    /// Fraction of the tracing time saved without the effect, or fraction of the GPU time of its passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Milliseconds of its passes per frame, or per denoised picture; median.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub milliseconds: Option<f64>,
    /// If off: milliseconds per frame that its passes would take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_on: Option<f64>,
    /// Milliseconds once per view, taken or, if off, expected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub once: Option<f64>,
    /// If off: relative increase of the path time with a small example of the effect in the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_on_share: Option<f64>,
    /// Bytes of device memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
}

/// Every effect of a run, the tracer's first. `desc`: scene as traced, with everything forced off removed.
pub fn plan(desc: &SceneDesc, run: &RunSpec, settings: &Settings) -> Vec<PlannedEffect> {
    let place = |place: Place| {
        let file = desc.files.get(place.file as usize)?;
        Some(format!("{}:{}:{}", file.display(), place.line, place.column))
    };
    let traced = effects::decide(desc, run.integrator).into_iter().map(|d| {
        let off = run.left_out().any(|name| name == d.effect.name());
        let forced = |reason| if off { "forced off by --effects".to_string() } else { reason };
        PlannedEffect {
            name: d.effect.name(),
            side: EffectSide::Tracer,
            on: d.on && !off,
            reason: forced(d.reason),
            place: d.place.filter(|_| !off).and_then(place),
            at_run_time: d.effect.at_run_time(),
            cost: Cost::default(),
            effect: Some(d.effect),
            client: None,
        }
    });
    let entries = effect_list(&run.film, settings, run.integrator.streams());
    let shown = entries.into_iter().map(|entry| PlannedEffect {
        name: entry.name,
        side: EffectSide::Client,
        on: entry.on,
        reason: entry.reason.clone(),
        place: None,
        at_run_time: entry.at_run_time,
        cost: Cost::default(),
        effect: None,
        client: Some(entry),
    });
    traced.chain(shown).collect()
}
