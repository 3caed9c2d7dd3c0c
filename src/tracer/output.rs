//! Where samples leave the tracer: what an integrator has found goes to a [`SampleSink`], by groups of lights if there are groups.

use crate::color::Xyz;
use crate::stream::SampleSink;

use super::light::Lights;
use super::light_groups::{LightCredits, LightGroups};

/// Sends the camera sample at `uv` of a path that has found `value` in all, of which `credits`, once
/// [settled](LightCredits::settle), says what comes from each group of lights.
#[inline(always)]
pub(super) fn send_camera<C: LightCredits>(
    out: &mut impl SampleSink,
    lights: &Lights,
    uv: [f64; 2],
    value: Xyz,
    weight: f32,
    credits: &C,
) {
    let uv = uv.map(|c| c as f32);
    if C::KEPT {
        let count = lights.groups().map_or(0, LightGroups::count);
        out.camera_by_groups(uv, value, weight, &credits.colors()[..count]);
    } else {
        out.camera(uv, value, weight);
    }
}

/// Sends the light sample at `uv`, a density over uv, whose light comes from this group if there are groups.
#[inline]
pub(super) fn send_light(out: &mut impl SampleSink, uv: [f32; 2], value: Xyz, group: Option<u8>) {
    match group {
        Some(group) => out.light_of_group(uv, value, group),
        None => out.light(uv, value),
    }
}
