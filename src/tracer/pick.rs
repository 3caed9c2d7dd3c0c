//! Picking: what is seen at a point of the picture, for selecting it.

use glam::DVec3;

use crate::scene::desc::MediumId;
use crate::spectrum::SampledWavelengths;

use super::Scene;
use super::accel::Ray;
use super::interaction::SurfaceInteraction;
use super::medium::{MarchSteps, MediumIndex};

/// Where more light than this gets through, a hole or a medium is looked through.
const SEEN_THROUGH: f32 = 0.5;

/// Chooses the wavelengths at which media are judged: the middle of the range, and three at equal distances.
const WAVELENGTHS: f32 = 0.5;

/// The object that is seen at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Index into [`SceneDesc::shapes`](crate::scene::SceneDesc::shapes).
    pub shape: u32,
    /// Where the ray hits it, world space.
    pub position: DVec3,
    /// Distance from the origin of the ray, which for a camera lies on its near plane.
    pub distance: f32,
}

/// The medium that hides what is behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumPick {
    /// The medium.
    pub medium: MediumId,
    /// The shape through which the ray came into it, an index into [`SceneDesc::shapes`](crate::scene::SceneDesc::shapes); `None` where the
    /// ray begins in the medium, or comes into it from a shape that does not name it.
    pub shape: Option<u32>,
}

impl Scene {
    /// The shape that is seen along `ray`; `None` where only the environment is. Of two shapes back to back in
    /// one place it is the one whose side is seen; of what a group holds, the instance that shows it. What is mostly holes is looked through, and
    /// so are media.
    pub fn pick(&self, ray: &Ray) -> Option<Pick> {
        let found = self.walk(&mut ray.clone(), |_, _, opacity| opacity >= SEEN_THROUGH)?;
        let p = found.point.p;
        let (position, distance) =
            (self.space().world_point(p), self.space().world_length(p.distance(ray.origin)));
        Some(Pick { shape: self.shape(&found), position, distance })
    }

    /// The medium that hides the surface, or the environment, that is seen along `ray`, of unit direction, which begins in `medium`: the first in
    /// which the mean transmittance over wavelengths from the beginning falls below a half; `None` where it does not.
    pub fn pick_medium(&self, ray: &Ray, mut medium: MediumIndex) -> Option<MediumPick> {
        let (_, line) = self.look(&mut ray.clone(), &mut medium, |_, _, opacity| opacity >= SEEN_THROUGH);
        let lambda = SampledWavelengths::sample(WAVELENGTHS);
        let (medium, inside) = line.medium_that_leaves(SEEN_THROUGH.into(), &lambda, MarchSteps::Cells)?;
        // It begins at the camera or just behind the boundary that the line came through.
        let entered = self.first(&Ray::new(inside.origin, -inside.direction));
        let holds = |at: &SurfaceInteraction| {
            inside.origin != ray.origin
                && self
                    .media()
                    .and_then(|media| media.interface(at.surface))
                    .is_some_and(|sides| sides.contains(&medium))
        };
        Some(MediumPick { medium: medium.id()?, shape: entered.filter(holds).map(|at| self.shape(&at)) })
    }
}
