//! Indices of refraction, by number or by the name of a medium.

use crate::scene::diagnostic::{SceneError, shorten};
use crate::scene::mitsuba::params::Params;
use crate::scene::mitsuba::question::Question;
use crate::spectrum::dispersion::Ior;

/// An index of refraction: a number, or the name of a medium.
pub(crate) fn ior(params: &Params<'_>, name: &'static str, default: &str) -> Result<Ior, SceneError> {
    let by_name = |medium: &str| {
        Ior::named(medium).ok_or_else(|| {
            let message = format!("no index of refraction is known for `{}`", shorten(medium));
            let found = params.error(name, message);
            found.help("give a number: <float name=\"int_ior\" value=\"1.5\"/>").error()
        })
    };
    params.ask(name, || Question::Value(&["float", "string"]));
    params.default(name, default);
    match params.get(name).map(|e| e.tag.name) {
        None => by_name(default),
        Some("string") => by_name(&params.string(name)?.unwrap_or_default()),
        Some(_) => {
            let n = params.float(name)?.unwrap_or(1.0);
            if is_ior(n) {
                return Ok(Ior::Constant(n as f32));
            }
            Err(params.error(name, "an index of refraction is above 0 and not above 1000").error())
        }
    }
}

/// True for a number that can be an index of refraction.
pub(super) fn is_ior(n: f64) -> bool {
    n > 0.0 && n <= 1e3
}
