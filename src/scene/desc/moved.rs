//! Chooses the rendering space of a scene by bounding boxes, and transforms the description to it.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::bsdf::BsdfDesc;
use super::light::{LightDesc, ProjectorDesc, SpotDesc};
use super::rendering_space::{RenderingSpace, STRAY, enclosing, exponent, median};
use super::scene::SceneDesc;
use super::shape::{Curves, ShapeDesc, ShapeKind};

impl SceneDesc {
    /// Chooses [`SceneDesc::space`]: its origin is the centre of all shapes if they are far from that of world space, and its scale
    /// follows from their sizes.
    pub fn place(&mut self) {
        self.space = RenderingSpace::around(self.boxes().into_iter());
    }

    /// Bounding box of all shapes in world space; `None` where there are none.
    pub(crate) fn bounds(&self) -> Option<[DVec3; 2]> {
        enclosing(self.boxes().into_iter())
    }

    /// Bounding boxes of the shapes.
    fn boxes(&self) -> Vec<[DVec3; 2]> {
        let groups = self.boxes_of_groups();
        self.shapes.iter().filter_map(|shape| self.bounds_of(shape, &groups)).collect()
    }

    /// The description in rendering space, except the spectra of its lights ([`LightDesc::spectrum_in`]) and its camera.
    pub fn in_rendering_space(&self) -> SceneDesc {
        let (space, mut moved) = (self.space, self.clone());
        moved.space = RenderingSpace::WORLD;
        let spaces: Vec<_> = self
            .groups
            .iter()
            .map(|group| {
                let boxes: Vec<_> = group.shapes.iter().filter_map(|s| self.bounds_of(s, &[])).collect();
                RenderingSpace::around(boxes.into_iter())
            })
            .collect();
        for (group, space) in moved.groups.iter_mut().zip(&spaces) {
            group.shapes.iter_mut().for_each(|shape| take(space, shape));
        }
        for shape in &mut moved.shapes {
            take(&space, shape);
            if let ShapeKind::Instance(id) = shape.kind
                && let Some(group) = spaces.get(id.0 as usize)
            {
                shape.to_world *= group.inverse_transform();
            }
        }
        moved.move_materials(&space);
        for light in &mut moved.lights {
            match light {
                LightDesc::Point { position, .. } | LightDesc::Spot(SpotDesc { position, .. }) => {
                    *position = space.point(*position);
                }
                LightDesc::Projector(ProjectorDesc { to_world, .. }) => {
                    to_world.translation = space.point(to_world.translation);
                }
                LightDesc::Constant { .. }
                | LightDesc::Map { .. }
                | LightDesc::SunSky(_)
                | LightDesc::Directional { .. } => (),
            }
        }
        moved
    }

    /// The description with only its materials and media in rendering space.
    pub(crate) fn with_materials_in_rendering_space(&self) -> SceneDesc {
        let mut moved = self.clone();
        moved.move_materials(&self.space);
        moved
    }

    /// Transforms lengths and positions in materials and media from world space to `space`, also for surfaces within groups: theirs are
    /// those of the world, too.
    fn move_materials(&mut self, space: &RenderingSpace) {
        for bsdf in &mut self.bsdfs {
            // Heights are lengths.
            if let BsdfDesc::BumpMap(bump) = bsdf {
                bump.scale = space.length(bump.scale);
            }
            bsdf.for_each_volume(|volume| *volume = Arc::new(volume.placed(space)));
        }
        self.media.iter_mut().for_each(|medium| medium.place(space));
    }

    /// Bounding box of a shape (an index into [`SceneDesc::shapes`]) in object space, or of the group of an instance; `None` if it is empty.
    pub fn object_bounds(&self, shape: u32) -> Option<[DVec3; 2]> {
        let shape = self.shapes.get(shape as usize)?;
        let groups = match shape.kind {
            ShapeKind::Instance(_) => self.boxes_of_groups(),
            _ => Vec::new(),
        };
        self.bounds_of(&ShapeDesc { to_world: DAffine3::IDENTITY, ..shape.clone() }, &groups)
    }

    /// Bounding box of each group, in the space of the group.
    fn boxes_of_groups(&self) -> Vec<Option<[DVec3; 2]>> {
        let around = |shapes: &[ShapeDesc]| enclosing(shapes.iter().filter_map(|s| self.bounds_of(s, &[])));
        self.groups.iter().map(|group| around(&group.shapes)).collect()
    }

    /// Bounding box of a shape in the space that it is placed in; `groups` are the boxes of the groups, for instances.
    fn bounds_of(&self, shape: &ShapeDesc, groups: &[Option<[DVec3; 2]>]) -> Option<[DVec3; 2]> {
        let unit = [DVec3::NEG_ONE, DVec3::ONE];
        let boxed = match &shape.kind {
            ShapeKind::Rectangle | ShapeKind::Disk => [unit[0].with_z(0.0), unit[1].with_z(0.0)],
            ShapeKind::Cube => unit,
            ShapeKind::Sphere { center, radius } => unit.map(|corner| *center + corner * *radius),
            ShapeKind::Cylinder { p0, p1, radius } => {
                [p0.min(*p1) - radius.abs(), p0.max(*p1) + radius.abs()]
            }
            ShapeKind::Mesh(id) => of_points(self.meshes.get(id.0 as usize)?.positions.iter().copied())?,
            ShapeKind::Curves(curves) => of_points(curves.points.iter().map(|p| p.truncate()))?,
            ShapeKind::Instance(id) => (*groups.get(id.0 as usize)?)?,
        };
        transformed_box(shape.to_world, boxed)
    }
}

/// Moves a shape from world space to `space`.
fn take(space: &RenderingSpace, shape: &mut ShapeDesc) {
    shape.to_world = space.transform() * shape.to_world;
    // Radii are those of world space, wherever a transform takes the control points.
    if let ShapeKind::Curves(curves) = &mut shape.kind
        && space.scale != 1.0
    {
        let points = curves.points.iter().map(|p| p.truncate().extend(space.length(p.w))).collect();
        *curves = Arc::new(Curves { points, ..Curves::clone(curves) });
    }
}

/// Bounding box of the finite points, except outliers ([`STRAY`]).
fn of_points(points: impl Iterator<Item = Vec3> + Clone) -> Option<[DVec3; 2]> {
    let finite = points.filter(|p| p.is_finite());
    let size = |p: Vec3| exponent(f64::from(p.abs().max_element()));
    let typical = median(finite.clone().map(size)).unwrap_or_default();
    let usual = finite.filter(|p| size(*p) <= typical + STRAY);
    let [low, high] = usual.map(|p| [p; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    Some([low.as_dvec3(), high.as_dvec3()])
}

/// Bounding box of a transformed box, if that is finite.
fn transformed_box(to_world: DAffine3, [low, high]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let center = to_world.transform_point3(0.5 * (low + high));
    let half = to_world.matrix3.abs() * (0.5 * (high - low));
    (center.is_finite() && half.is_finite()).then(|| [center - half, center + half])
}
