//! Plugins of Mitsuba 3.9 that are not supported, and why: for messages, and for the list of plugins.

/// Kind of plugin, its name, and why it is not supported, with what can stand for it.
pub const UNSUPPORTED: &[(&str, &str, &str)] = &[
    ("shape", "ellipsoids", "there are no Gaussian primitives here: give a mesh"),
    ("shape", "ellipsoidsmesh", "there are no Gaussian primitives here: give a mesh"),
    ("shape", "sdfgrid", "signed distances are not traced: give a mesh"),
    ("shape", "blender", "it takes its mesh from the memory of Blender: export an `obj` or a `ply`"),
    ("bsdf", "hair", "its scattering in fibres is not built: curves take any other bsdf"),
    ("bsdf", "measured", "its tables of measurements are not read: choose `principled` or `roughconductor`"),
    (
        "bsdf",
        "measured_polarized",
        "its tables of measurements are not read: choose `principled` or `roughconductor`",
    ),
    ("emitter", "timed_sunsky", "it changes within a picture: `sunsky` has the sky of one moment"),
    (
        "integrator",
        "moment",
        "the variance of a picture is in its EXR file without it: it is rendered by `auto`",
    ),
    ("integrator", "stokes", "light has no polarisation here: it is rendered by `auto`"),
    ("integrator", "volprim_rf_basic", "there are no Gaussian primitives here: it is rendered by `auto`"),
];

/// Why a plugin of Mitsuba is not supported; `None` for one that is, or that Mitsuba does not have.
pub(crate) fn why(kind: &str, name: &str) -> Option<&'static str> {
    UNSUPPORTED.iter().find(|(k, n, _)| *k == kind && *n == name).map(|(.., why)| *why)
}
