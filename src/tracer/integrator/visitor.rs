//! The integrator of a method that is known at run time only: the one place that makes a type of an
//! [`IntegratorKind`](crate::scene::desc::IntegratorKind).

use crate::scene::desc::IntegratorKind;

use super::Integrator;
use super::bidirectional::BidirectionalTracer;
use super::context::RenderContext;
use super::depth::DepthTracer;
use super::particle::ParticleTracer;
use super::path::PathTracer;
use super::photon::{PhotonTracer, SeesPhotons};
use super::vcm::VcmTracer;

/// Something to do with an integrator, whichever it is: code that is compiled for each.
pub trait IntegratorVisitor: Sized {
    /// The result.
    type Output;

    /// Does it with an integrator whose samples depend on nothing but their index, or on photons that are traced in a fixed order.
    fn visit<I: Integrator + From<RenderContext>>(self) -> Self::Output;

    /// Does it with an integrator whose samples see photons.
    fn visit_with_photons<I: Integrator + From<RenderContext> + SeesPhotons>(self) -> Self::Output {
        self.visit::<I>()
    }
}

/// Calls `visitor` for the integrator of this method.
pub fn visit<V: IntegratorVisitor>(kind: IntegratorKind, visitor: V) -> V::Output {
    match kind {
        IntegratorKind::Path | IntegratorKind::Auto => visitor.visit::<PathTracer>(),
        IntegratorKind::Light => visitor.visit::<ParticleTracer>(),
        IntegratorKind::Bidirectional => visitor.visit::<BidirectionalTracer>(),
        IntegratorKind::Photon => visitor.visit_with_photons::<PhotonTracer>(),
        IntegratorKind::Vcm => visitor.visit_with_photons::<VcmTracer>(),
        IntegratorKind::Depth => visitor.visit::<DepthTracer>(),
    }
}
