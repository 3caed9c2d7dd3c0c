//! Properties of JSON objects whose types [`grammar`](super::grammar) has checked: what is missing has its default.

use serde_json::Value;

/// A number as a finite one.
fn finite(v: f64) -> f32 {
    v.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// The number `name`.
pub(super) fn number(object: &Value, name: &str, default: f32) -> f32 {
    object[name].as_f64().map_or(default, finite)
}

/// The number `name`, from 0 to 1.
pub(super) fn share(object: &Value, name: &str, default: f32) -> f32 {
    number(object, name, default).clamp(0.0, 1.0)
}

/// The numbers `name`.
pub(super) fn numbers<const N: usize>(object: &Value, name: &str, default: [f32; N]) -> [f32; N] {
    let Some(list) = object[name].as_array() else { return default };
    std::array::from_fn(|i| list.get(i).and_then(Value::as_f64).map_or(default[i], finite))
}

/// The numbers `name`, each from 0 to 1.
pub(super) fn shares<const N: usize>(object: &Value, name: &str, default: [f32; N]) -> [f32; N] {
    numbers(object, name, default).map(|v| v.clamp(0.0, 1.0))
}

/// The index or whole number `name`.
pub(super) fn index(object: &Value, name: &str) -> Option<usize> {
    object[name].as_u64().and_then(|i| usize::try_from(i).ok())
}

/// The extension `name` of an object; null if it has none.
pub(super) fn extension<'a>(object: &'a Value, name: &str) -> &'a Value {
    &object["extensions"][name]
}
