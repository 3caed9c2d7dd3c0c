//! Rendering space: world space with its origin near the shapes (pbrt-v4, §5.1.1).
//!
//! Paths are traced in single precision, which resolves a point to 6e-8 of its distance from the origin. A scene that lies far from
//! the origin of its file is therefore moved there in double precision when it is prepared; cameras move with it, and what is
//! reported in world space moves back.

use std::borrow::Cow;

use glam::{DAffine3, DVec3};

use super::SceneDesc;
use super::desc::{LightDesc, ProjectorDesc, ShapeDesc, ShapeKind, SpotDesc};

/// A scene stays where it is unless its nearest point is farther from the origin than this many times its size: up to there
/// two bits of its coordinates are lost.
const FAR: f64 = 4.0;

impl SceneDesc {
    /// Chooses [`SceneDesc::origin`]: the middle of all shapes where they are far from the origin of world space, else that.
    pub fn place_origin(&mut self) {
        self.origin = self.bounds().map_or(DVec3::ZERO, |[low, high]| {
            let nearest = DVec3::ZERO.clamp(low, high);
            let is_far = nearest.abs().max_element() > FAR * (high - low).max_element();
            if is_far { 0.5 * (low + high) } else { DVec3::ZERO }
        });
    }

    /// The description in rendering space, whose origin is [`SceneDesc::origin`].
    pub fn in_rendering_space(&self) -> Cow<'_, SceneDesc> {
        if self.origin == DVec3::ZERO {
            return Cow::Borrowed(self);
        }
        let mut moved = SceneDesc { origin: DVec3::ZERO, ..self.clone() };
        moved.camera.to_world.translation -= self.origin;
        for shape in &mut moved.shapes {
            shape.to_world.translation -= self.origin;
        }
        for light in &mut moved.lights {
            match light {
                LightDesc::Point { position, .. } | LightDesc::Spot(SpotDesc { position, .. }) => {
                    *position -= self.origin;
                }
                LightDesc::Projector(ProjectorDesc { to_world, .. }) => to_world.translation -= self.origin,
                LightDesc::Constant { .. }
                | LightDesc::Map { .. }
                | LightDesc::SunSky(_)
                | LightDesc::Directional { .. } => (),
            }
        }
        Cow::Owned(moved)
    }

    /// The corners of a box around all shapes that are somewhere, world space.
    fn bounds(&self) -> Option<[DVec3; 2]> {
        let groups: Vec<Option<[DVec3; 2]>> = self
            .groups
            .iter()
            .map(|group| around(group.shapes.iter().filter_map(|shape| self.bounds_of(shape, &[]))))
            .collect();
        around(self.shapes.iter().filter_map(|shape| self.bounds_of(shape, &groups)))
    }

    /// A box around a shape in the space that it is placed in; `groups` are those of the groups that instances show.
    fn bounds_of(&self, shape: &ShapeDesc, groups: &[Option<[DVec3; 2]>]) -> Option<[DVec3; 2]> {
        let unit = [DVec3::NEG_ONE, DVec3::ONE];
        let boxed = match &shape.kind {
            ShapeKind::Rectangle | ShapeKind::Disk => [unit[0].with_z(0.0), unit[1].with_z(0.0)],
            ShapeKind::Cube => unit,
            ShapeKind::Sphere { center, radius } => unit.map(|corner| *center + corner * *radius),
            ShapeKind::Cylinder { p0, p1, radius } => {
                [p0.min(*p1) - radius.abs(), p0.max(*p1) + radius.abs()]
            }
            ShapeKind::Mesh(id) => {
                let positions = &self.meshes.get(id.0 as usize)?.positions;
                around(positions.iter().filter(|p| p.is_finite()).map(|p| [p.as_dvec3(); 2]))?
            }
            ShapeKind::Curves(curves) => {
                let points = curves.points.iter().filter(|p| p.is_finite());
                around(points.map(|p| [p.truncate().as_dvec3(); 2]))?
            }
            ShapeKind::Instance(id) => (*groups.get(id.0 as usize)?)?,
        };
        transformed(shape.to_world, boxed)
    }
}

/// The box around boxes; `None` around nothing.
fn around(boxes: impl Iterator<Item = [DVec3; 2]>) -> Option<[DVec3; 2]> {
    boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}

/// A box around the image of a box, if that is finite.
fn transformed(to_world: DAffine3, [low, high]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let center = to_world.transform_point3(0.5 * (low + high));
    let half = to_world.matrix3.abs() * (0.5 * (high - low));
    (center.is_finite() && half.is_finite()).then(|| [center - half, center + half])
}
