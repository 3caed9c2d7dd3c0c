//! Where the boundaries of media are: whether one may go through a box, as around a lamp or around the points at which the rays of a camera
//! begin. There are several media in that box then. Or whether one may lie upon another surface.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfId, ShapeDesc, ShapeKind};

/// Most triangles that are kept. A boundary of more counts as if it filled its bounding box.
const MOST_FACES: usize = 1 << 18;

/// Most triangles of a boundary that are asked for every surface whether they touch it.
const FEW_FACES: usize = 1 << 10;

/// Lengths below this share of the coordinates are none: rounding moves surfaces, and points at which rays begin, by less.
const ACCURACY: f32 = 32.0 * f32::EPSILON;

/// Vertices beyond this are not traced.
const FARTHEST: f64 = 1e12;

/// The smallest and the largest coordinates of a bounding box.
type Bounds = [Vec3; 2];

/// The boundaries of a scene, in rendering space.
#[derive(Clone, Debug, Default)]
pub(super) struct Boundaries {
    all: Arc<[Boundary]>,
    /// For each surface, whether it lets light through and another shape that is a boundary may touch it.
    touched: Arc<[bool]>,
}

/// The boundary that one shape is.
#[derive(Debug)]
struct Boundary {
    /// Index of the shape; of the instance that shows it.
    shape: usize,
    bounds: Bounds,
    extent: BoundaryExtent,
}

/// Where a boundary is within its bounds.
#[derive(Debug)]
enum BoundaryExtent {
    Triangles(Box<[[Vec3; 3]]>),
    Sphere {
        center: Vec3,
        radius: f32,
    },
    /// Anywhere.
    Unknown,
}

impl Boundaries {
    /// Those of a description in rendering space.
    pub(super) fn of(desc: &SceneDesc) -> Self {
        let (mut all, mut left) = (Vec::new(), MOST_FACES);
        for (i, shape) in desc.shapes.iter().enumerate() {
            let around = match shape.kind {
                ShapeKind::Instance(_) => shape.to_world,
                _ => DAffine3::IDENTITY,
            };
            for part in desc.parts(shape).iter().filter(|part| part.medium_interface.is_transition()) {
                let Some(bounds) = bounds_of(desc, part, around) else { continue };
                all.push(Boundary { shape: i, bounds, extent: extent_of(desc, part, around, &mut left) });
            }
        }
        let touch = |(i, shape): (usize, &ShapeDesc)| {
            if !transmits(desc, shape.bsdf) {
                return false;
            }
            let bounds = bounds_of(desc, shape, DAffine3::IDENTITY);
            bounds.is_some_and(|bounds| all.iter().any(|other| other.shape != i && other.may_touch(bounds)))
        };
        let of_shapes = desc.shapes.iter().enumerate().map(touch);
        // Wherever instances show them.
        let of_groups = desc.groups.iter().flat_map(|group| &group.shapes);
        let of_groups = of_groups.map(|shape| !all.is_empty() && transmits(desc, shape.bsdf));
        let touched = of_shapes.chain(of_groups).collect();
        Self { all: all.into(), touched }
    }

    /// True where a boundary goes through this box, but for rounding.
    pub(super) fn cut(&self, area: Bounds) -> bool {
        self.all.iter().any(|boundary| boundary.cuts(area))
    }

    /// True where this surface lets light through and another shape that is a boundary may touch it.
    #[inline]
    pub(super) fn touched(&self, surface: u32) -> bool {
        self.touched.get(surface as usize).is_some_and(|touched| *touched)
    }

    /// A point in the middle of each.
    pub(super) fn middles(&self) -> impl Iterator<Item = Vec3> {
        self.all.iter().map(|boundary| 0.5 * (boundary.bounds[0] + boundary.bounds[1]))
    }
}

impl Boundary {
    /// As [`cuts`](Self::cuts), which takes too long for all surfaces where triangles are many: then by the bounds alone.
    fn may_touch(&self, area: Bounds) -> bool {
        match &self.extent {
            BoundaryExtent::Triangles(triangles) if triangles.len() > FEW_FACES => meet(self.bounds, area),
            _ => self.cuts(area),
        }
    }

    fn cuts(&self, area: Bounds) -> bool {
        meet(self.bounds, area)
            && match &self.extent {
                BoundaryExtent::Triangles(triangles) => {
                    triangles.iter().any(|corners| triangle_cuts(corners, area))
                }
                BoundaryExtent::Sphere { center, radius } => {
                    let [low, high] = area;
                    let near = rounding([self.bounds, area]);
                    let nearest = center.clamp(low, high).distance(*center);
                    let farthest = (*center - low).abs().max((high - *center).abs()).length();
                    nearest <= radius + near && farthest >= radius - near
                }
                BoundaryExtent::Unknown => true,
            }
    }
}

/// True for a material that lets light through, or a part of which does.
fn transmits(desc: &SceneDesc, id: BsdfId) -> bool {
    let Some(bsdf) = desc.bsdfs.get(id.0 as usize) else { return false };
    bsdf.transmits() || bsdf.nested().into_iter().any(|id| transmits(desc, id))
}

/// A length that rounding may add or take, of what lies in these boxes.
fn rounding(boxes: [Bounds; 2]) -> f32 {
    boxes.as_flattened().iter().fold(0.0, |most: f32, p| most.max(p.abs().max_element())) * ACCURACY
}

/// True where two boxes have a point in common, but for rounding.
fn meet(a: Bounds, b: Bounds) -> bool {
    let near = rounding([a, b]);
    a[0].cmple(b[1] + near).all() && b[0].cmple(a[1] + near).all()
}

/// False where a triangle does not reach into a box: by their bounds, and by the side of its plane on which the box lies.
fn triangle_cuts(corners: &[Vec3; 3], area: Bounds) -> bool {
    let [a, b, c] = *corners;
    let bounds = [a.min(b).min(c), a.max(b).max(c)];
    if !meet(bounds, area) {
        return false;
    }
    let near = f64::from(rounding([bounds, area]));
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let [low, high] = area.map(|p| p.as_dvec3());
    let n = (b - a).cross(c - a);
    n.dot(0.5 * (low + high) - a).abs() <= n.abs().dot(0.5 * (high - low) + near)
}

/// The bounding box of a shape in a space that `around` takes to rendering space; `None` where there is nothing of it.
pub(super) fn bounds_of(desc: &SceneDesc, shape: &ShapeDesc, around: DAffine3) -> Option<Bounds> {
    let to_world = shape.to_world;
    let placed = |p: DVec3| around.transform_point3(to_world.transform_point3(p));
    let cube = |center: DVec3, half: f64| corners().map(move |corner| center + corner * half);
    match &shape.kind {
        ShapeKind::Mesh(id) => {
            let mesh = desc.meshes.get(id.0 as usize)?;
            enclosing(mesh.positions.iter().map(|p| placed(p.as_dvec3())))
        }
        ShapeKind::Cube => enclosing(corners().map(placed)),
        ShapeKind::Disk | ShapeKind::Rectangle => enclosing(corners().map(|p| placed(p.with_z(0.0)))),
        ShapeKind::Sphere { .. } => {
            let (center, radius) = sphere(shape)?;
            enclosing(cube(center, radius).map(|p| around.transform_point3(p)))
        }
        ShapeKind::Cylinder { p0, p1, radius } => {
            let ends = [p0, p1].into_iter();
            enclosing(ends.flat_map(|end| cube(*end, radius.abs())).map(placed))
        }
        ShapeKind::Curves(curves) => {
            let points = curves.points.iter().map(|p| p.as_dvec4());
            let thick = points.flat_map(|p| cube(to_world.transform_point3(p.truncate()), p.w.abs()));
            enclosing(thick.map(|p| around.transform_point3(p)))
        }
        ShapeKind::Instance(_) => None,
    }
}

/// Where a shape is within its bounds, with `left` triangles at most, which are taken from that.
fn extent_of(desc: &SceneDesc, shape: &ShapeDesc, around: DAffine3, left: &mut usize) -> BoundaryExtent {
    let place = around * shape.to_world;
    let placed = |p: DVec3| place.transform_point3(p).as_vec3();
    let triangles: Box<[[Vec3; 3]]> = match &shape.kind {
        ShapeKind::Disk | ShapeKind::Rectangle => face(2, 0.0).map(|corners| corners.map(placed)).into(),
        ShapeKind::Cube => {
            let faces = (0..3).flat_map(|axis| [face(axis, -1.0), face(axis, 1.0)]).flatten();
            faces.map(|corners| corners.map(placed)).collect()
        }
        ShapeKind::Mesh(id) => match desc.meshes.get(id.0 as usize) {
            Some(mesh) if mesh.triangles.len() <= *left => {
                let position = |i: u32| Some(placed(mesh.positions.get(i as usize)?.as_dvec3()));
                let corners = |[a, b, c]: &[u32; 3]| Some([position(*a)?, position(*b)?, position(*c)?]);
                mesh.triangles.iter().filter_map(corners).collect()
            }
            _ => return BoundaryExtent::Unknown,
        },
        ShapeKind::Sphere { .. } if around == DAffine3::IDENTITY => {
            return sphere(shape).map_or(BoundaryExtent::Unknown, |(center, radius)| {
                BoundaryExtent::Sphere { center: center.as_vec3(), radius: radius as f32 }
            });
        }
        _ => return BoundaryExtent::Unknown,
    };
    *left = left.saturating_sub(triangles.len());
    BoundaryExtent::Triangles(triangles)
}

/// Centre and radius of a sphere in the space that it is placed in. It stays one: the mean scale is used.
fn sphere(shape: &ShapeDesc) -> Option<(DVec3, f64)> {
    let ShapeKind::Sphere { center, radius } = shape.kind else { return None };
    let scale = shape.to_world.matrix3.determinant().abs().cbrt();
    Some((shape.to_world.transform_point3(center), radius.abs() * scale))
}

/// The corners of the cube from −1 to 1.
fn corners() -> impl Iterator<Item = DVec3> {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
    (0..8).map(move |i| DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)))
}

/// Both triangles of the square from −1 to 1 across an axis, at this place of it.
fn face(axis: usize, at: f64) -> [[DVec3; 3]; 2] {
    let corner = |x: f64, y: f64| {
        let mut p = [at; 3];
        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (x, y);
        DVec3::from_array(p)
    };
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

fn enclosing(points: impl Iterator<Item = DVec3>) -> Option<Bounds> {
    let usable = points.filter(|p| p.abs().max_element() <= FARTHEST);
    let [low, high] = usable.map(|p| [p; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
    Some([low.as_vec3(), high.as_vec3()])
}
