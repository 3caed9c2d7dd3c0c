//! The distance to what is seen first: no light transport at all.

use crate::color::Xyz;
use crate::spectrum::White;
use crate::stream::{PathCounts, SampleSink};

use super::{Integrator, RenderContext};

/// Shows the distance of the first surface from the near clip plane along the ray, in world units, as grey; nothing is black. As Mitsuba's
/// `depth` in its RGB mode.
#[derive(Clone, Debug)]
pub struct DepthTracer {
    /// Scene, view and settings.
    pub context: RenderContext,
    /// XYZ of the grey whose linear red, green and blue are 1.
    grey: Xyz,
}

impl Integrator for DepthTracer {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let RenderContext { camera, scene, .. } = &self.context;
        let start = self.context.screen.start(index);
        let numbers = self.context.sampler(start.index).camera();
        let uv = self.context.place(numbers.screen);
        let ray = camera.ray(uv, numbers.lens);
        let seen = ray.and_then(|ray| scene.closest(&ray).map(|hit| hit.point.p.distance(ray.origin)));
        let distance = seen.map_or(0.0, |distance| scene.space().world_length(distance));
        out.camera(uv.map(|c| c as f32), self.grey * distance, start.weight);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}

impl From<RenderContext> for DepthTracer {
    fn from(context: RenderContext) -> Self {
        let lambda = White::D65.wavelengths();
        let white = White::D65.spectrum().sample(&lambda);
        Self { context, grey: lambda.to_xyz(white) }
    }
}
