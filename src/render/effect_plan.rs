//! The plan of a run lists every effect of tracer and client, whether it is on, and why. This module only joins the lists of both
//! halves; they decide.

use serde::Serialize;

use crate::client::Settings;
use crate::client::effect_list::{ClientEffect, effect_list};
use crate::render::run_spec::RunSpec;
use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};
use crate::tracer::effects::{self, Effect};

/// One effect of the plan. The names of the fields are the keys in JSON.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedEffect {
    #[serde(rename = "effect")]
    pub name: &'static str,
    /// The side that simulates it.
    pub side: EffectSide,
    pub on: bool,
    /// The object that calls for it, or why nothing does.
    pub reason: String,
    /// `file:line:column` of the object that calls for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
    /// The code that decides it while the program runs.
    pub at_run_time: &'static str,
    /// Its measured cost, if it was measured.
    #[serde(flatten)]
    pub cost: Cost,
    /// The effect, if the tracer simulates it.
    #[serde(skip)]
    pub effect: Option<Effect>,
    /// Its passes and images, if the client simulates it.
    #[serde(skip)]
    pub client: Option<ClientEffect>,
}

/// Who simulates an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EffectSide {
    /// The tracer, with its paths on the CPU.
    Tracer,
    /// The client, with its passes on the device.
    Client,
}

/// The measured cost of an effect. A figure is `None` where it was not measured.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Cost {
    /// Share of the tracing time that is saved without it, or of the device's time that its passes take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Milliseconds of its passes per frame, or of a picture that it filters, median.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub milliseconds: Option<f64>,
    /// Milliseconds per frame that its passes would take, where it is off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_on: Option<f64>,
    /// Milliseconds that it takes, or would take, once per view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub once: Option<f64>,
    /// How much longer paths would take with a small example of it, as a share of the present time, where it is off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_on_share: Option<f64>,
    /// Bytes of device memory that it holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
}

/// Every effect of a run, the tracer's first. `desc` is what is traced, with everything that is forced off already gone.
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
    let entries = effect_list(&run.film, settings, streams(run.integrator));
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

/// Whether a method fills the camera stream, and whether it fills the light stream.
pub fn streams(kind: IntegratorKind) -> [bool; 2] {
    match kind {
        IntegratorKind::Light => [false, true],
        IntegratorKind::Bidirectional | IntegratorKind::Vcm => [true, true],
        IntegratorKind::Path | IntegratorKind::Photon | IntegratorKind::Depth | IntegratorKind::Auto => {
            [true, false]
        }
    }
}
