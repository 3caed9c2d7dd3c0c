//! Samples that add up on the picture, from light paths.

use crate::scene::desc::IntegratorKind;

use super::entry::{Entry, says};

pub(super) const ENTRY: Entry = Entry {
    name: "light-stream",
    at_run_time: "the method: its code asks for light samples or does not",
    find: |_, kind| match kind {
        IntegratorKind::Light => says("particle tracing shows light paths to the camera"),
        IntegratorKind::Bidirectional => says("bidirectional path tracing shows light paths to the camera"),
        _ => Err("the method shows camera paths only"),
    },
    refusal: |_| Some("which streams there are is the method's: choose --integrator path or light"),
    without: |_| (),
    with: |desc| {
        desc.integrator.kind = IntegratorKind::Bidirectional;
        true
    },
};
