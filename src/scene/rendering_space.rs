//! Rendering space: world space with its origin near the shapes (pbrt-v4, §5.1.1), in a unit of their size.
//!
//! Paths are traced in single precision, which resolves a point to 6e-8 of its distance from the origin, and whose squares and
//! reciprocals of areas end at 1e38. A scene that lies far from the origin of its file is therefore moved there in double precision when it
//! is prepared, and every scene is scaled by a power of two until its shapes have sizes around 1. Cameras, point lights and the heights of bump maps go with it, and
//! what is reported in world space goes back. The power rounds nothing: a scene that is scaled by another one has the same picture, bit for
//! bit. The spaces of groups are chosen likewise.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::SceneDesc;
use super::desc::{BsdfDesc, Curves, LightDesc, ProjectorDesc, ShapeDesc, ShapeKind, SpotDesc};
use crate::spectrum::Spectrum;

/// A scene stays where it is unless its nearest point is farther from the origin than this many times its size: up to there
/// two bits of its coordinates are lost.
const FAR: f64 = 4.0;

/// Binary logarithm of the size over that of most others from which on a point or a shape has no part in the choice: it is one that the
/// tracer leaves out.
const STRAY: i32 = 40;

/// The scale is from 2^−48 to 2^48, so that intensities, which go with its square, stay in single precision.
const LARGEST_EXPONENT: i32 = 48;

/// Where rendering space lies in world space, and its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderingSpace {
    /// Its origin, in world space.
    pub origin: DVec3,
    /// What a length of 1 in world space is here: a power of two.
    pub scale: f64,
}

impl RenderingSpace {
    /// World space itself.
    pub const WORLD: Self = Self { origin: DVec3::ZERO, scale: 1.0 };

    /// A point of world space in this space.
    pub fn point(&self, p: DVec3) -> DVec3 {
        (p - self.origin) * self.scale
    }

    /// A length of world space in this space.
    pub fn length(&self, length: f32) -> f32 {
        (f64::from(length) * self.scale) as f32
    }

    /// A point of this space in world space.
    pub fn world_point(&self, p: Vec3) -> DVec3 {
        self.origin + p.as_dvec3() / self.scale
    }

    /// A length of this space in world space.
    pub fn world_length(&self, length: f32) -> f32 {
        (f64::from(length) / self.scale) as f32
    }

    /// What [`LightDesc::spectrum`] is here: the intensity of a point goes with the square of lengths.
    pub fn spectrum(&self, light: &LightDesc) -> Spectrum {
        let is_point =
            matches!(light, LightDesc::Point { .. } | LightDesc::Spot(_) | LightDesc::Projector(_));
        match is_point && self.scale != 1.0 {
            true => light.spectrum().scaled((self.scale * self.scale) as f32),
            false => light.spectrum().clone(),
        }
    }

    /// A space for these boxes.
    fn around(boxes: impl Iterator<Item = [DVec3; 2]> + Clone) -> Self {
        let size = |[low, high]: [DVec3; 2]| exponent((high - low).max_element());
        let sizes = boxes.clone().map(size);
        let Some(typical) = median(sizes) else { return Self::WORLD };
        let scale = 2f64.powi(-typical.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT));
        let origin =
            enclosing(boxes.filter(|b| size(*b) <= typical + STRAY)).map_or(DVec3::ZERO, |[low, high]| {
                let nearest = DVec3::ZERO.clamp(low, high);
                let is_far = nearest.abs().max_element() > FAR * (high - low).max_element();
                if is_far { 0.5 * (low + high) } else { DVec3::ZERO }
            });
        Self { origin, scale }
    }

    /// The transform from world space.
    fn transform(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.origin)
    }

    /// The transform to world space.
    pub(super) fn inverse_transform(&self) -> DAffine3 {
        DAffine3 { translation: self.origin, ..DAffine3::from_scale(DVec3::splat(1.0 / self.scale)) }
    }

    /// Moves a shape from world space to this space.
    fn take(&self, shape: &mut ShapeDesc) {
        shape.to_world = self.transform() * shape.to_world;
        // Radii are those of world space, wherever a transform takes the control points.
        if let ShapeKind::Curves(curves) = &mut shape.kind
            && self.scale != 1.0
        {
            let points = curves.points.iter().map(|p| p.truncate().extend(self.length(p.w))).collect();
            *curves = Arc::new(Curves { points, ..Curves::clone(curves) });
        }
    }
}

impl SceneDesc {
    /// Chooses [`SceneDesc::space`]: its origin in the middle of all shapes where they are far from that of world space, and its scale by
    /// their sizes.
    pub fn place(&mut self) {
        let groups = self.boxes_of_groups();
        let boxes: Vec<_> = self.shapes.iter().filter_map(|shape| self.bounds_of(shape, &groups)).collect();
        self.space = RenderingSpace::around(boxes.into_iter());
    }

    /// The description in rendering space, but for the spectra of its lights ([`RenderingSpace::spectrum`]) and its camera.
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
            group.shapes.iter_mut().for_each(|shape| space.take(shape));
        }
        for shape in &mut moved.shapes {
            space.take(shape);
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

    /// The description with its materials in rendering space, and all else where it was.
    pub(crate) fn with_materials_in_rendering_space(&self) -> SceneDesc {
        let mut moved = self.clone();
        moved.move_materials(&self.space);
        moved
    }

    /// Takes what materials know of world space to `space`, wherever a surface lies: on what an instance shows, too.
    fn move_materials(&mut self, space: &RenderingSpace) {
        for bsdf in &mut self.bsdfs {
            // Heights are lengths.
            if let BsdfDesc::BumpMap(bump) = bsdf {
                bump.scale = space.length(bump.scale);
            }
            bsdf.for_each_volume(|volume| *volume = Arc::new(volume.placed(space)));
        }
    }

    /// A box around a shape (an index into [`SceneDesc::shapes`]) in object space, or around what an instance shows; `None` where it is empty.
    pub fn object_bounds(&self, shape: u32) -> Option<[DVec3; 2]> {
        let shape = self.shapes.get(shape as usize)?;
        let groups = match shape.kind {
            ShapeKind::Instance(_) => self.boxes_of_groups(),
            _ => Vec::new(),
        };
        self.bounds_of(&ShapeDesc { to_world: DAffine3::IDENTITY, ..shape.clone() }, &groups)
    }

    /// A box around the shapes of each group, in the space of the group.
    fn boxes_of_groups(&self) -> Vec<Option<[DVec3; 2]>> {
        let around = |shapes: &[ShapeDesc]| enclosing(shapes.iter().filter_map(|s| self.bounds_of(s, &[])));
        self.groups.iter().map(|group| around(&group.shapes)).collect()
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
            ShapeKind::Mesh(id) => of_points(self.meshes.get(id.0 as usize)?.positions.iter().copied())?,
            ShapeKind::Curves(curves) => of_points(curves.points.iter().map(|p| p.truncate()))?,
            ShapeKind::Instance(id) => (*groups.get(id.0 as usize)?)?,
        };
        transformed_box(shape.to_world, boxed)
    }
}

/// The exponent of a finite number; −1023 of 0.
fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52 & 0x7ff) as i32) - 1023
}

/// The median of exponents, without those of 0; `None` of none.
fn median(exponents: impl Iterator<Item = i32>) -> Option<i32> {
    let mut counts = [0usize; 2048];
    exponents.filter(|e| *e > -1023).for_each(|e| counts[(e + 1023) as usize & 2047] += 1);
    let half = counts.iter().sum::<usize>().div_ceil(2);
    let mut below = 0;
    let at = counts.iter().position(|count| {
        below += count;
        below >= half && below > 0
    })?;
    Some(at as i32 - 1023)
}

/// A box around points that are finite, without those that are far beyond most others.
fn of_points(points: impl Iterator<Item = Vec3> + Clone) -> Option<[DVec3; 2]> {
    let finite = points.filter(|p| p.is_finite());
    let size = |p: Vec3| exponent(f64::from(p.abs().max_element()));
    let typical = median(finite.clone().map(size)).unwrap_or_default();
    let usual = finite.filter(|p| size(*p) <= typical + STRAY);
    let [low, high] = usual.map(|p| [p; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    Some([low.as_dvec3(), high.as_dvec3()])
}

/// The box around boxes; `None` around nothing.
fn enclosing(boxes: impl Iterator<Item = [DVec3; 2]>) -> Option<[DVec3; 2]> {
    boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}

/// A box around the image of a box, if that is finite.
fn transformed_box(to_world: DAffine3, [low, high]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let center = to_world.transform_point3(0.5 * (low + high));
    let half = to_world.matrix3.abs() * (0.5 * (high - low));
    (center.is_finite() && half.is_finite()).then(|| [center - half, center + half])
}
