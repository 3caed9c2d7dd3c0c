//! The tracer as its parts see it: its settings, and how many subpaths an index has.

use crate::scene::desc::IntegratorKind;
use crate::tracer::integrator::RenderContext;

/// Subpaths from the camera in one index.
pub const CAMERA_SUBPATHS: u64 = IntegratorKind::Bidirectional.traits().paths_per_index[0];

/// Subpaths from lights in one index.
pub const LIGHT_SUBPATHS: u64 = IntegratorKind::Bidirectional.traits().paths_per_index[1];

/// Traces subpaths from either end and connects them.
#[derive(Clone, Debug)]
pub struct BidirectionalTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
}

impl From<RenderContext> for BidirectionalTracer {
    fn from(context: RenderContext) -> Self {
        Self { context }
    }
}
