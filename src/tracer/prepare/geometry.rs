//! Conversion of shapes to primitives, in world space or in the space of their group.
//!
//! Front sides follow Mitsuba. The front of a rectangle or disk is the side to which its transformed +z normal points (a
//! mirroring transform does not turn it). The front of a mesh follows from the right-hand rule on the transformed corners. The
//! front of a cube or cylinder is the outside, as is that of a sphere unless the transform mirrors. `flip_normals` turns all of them. The
//! corners of a triangle are stored in the order that determines its front, so no sign has to be stored.
//!
//! Scenes use primitives that lie back to back in exactly the same place for lights that emit on both sides. Rounding would decide
//! which of the two a ray hits, and half of the light would be lost. So the second one becomes the [`Back`] of the first.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DAffine3, DVec3, Vec2, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, Mesh, ShapeDesc, ShapeKind, SpotDesc, SunSkyDesc};
use crate::tracer::accel::PrimRange;
use crate::tracer::light::{
    ConstantLight, CylinderLight, DirectionalLight, DiskLight, EnvironmentMap, Light, LightShape,
    ParallelogramLight, PointLight, SphereLight, SpotLight, SunDisc, SunSkyLight, TriangleLight,
};
use crate::tracer::primitives::{Back, NONE, PrimRecord};
use crate::tracer::shape::{Cylinder, Disk, Sphere, Triangle};
use crate::tracer::tangents::{self, Tangents};
use crate::tracer::texture_coordinates::{self, TextureCoordinates};

use super::PrepareError;

/// Largest magnitude of a coordinate. Its square and its product with an extent stay finite.
pub(super) const MAX_COORDINATE: f32 = 1e12;

/// The primitives and lights of the shapes.
#[derive(Default)]
pub(super) struct Geometry {
    pub(super) corners: Vec<[Vec3; 3]>,
    pub(super) triangles: Vec<Triangle>,
    /// The first triangles of parallelograms.
    pub(super) quads: Vec<u32>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) cylinders: Vec<Cylinder>,
    /// Records of the triangles. [`Geometry::finish`] appends those of disks, spheres and cylinders.
    pub(super) prims: Vec<PrimRecord>,
    disk_prims: Vec<PrimRecord>,
    sphere_prims: Vec<PrimRecord>,
    cylinder_prims: Vec<PrimRecord>,
    pub(super) normals: Vec<[Vec3; 3]>,
    pub(super) backs: Vec<Back>,
    /// Tangents by shape; see [`Geometry::finish`].
    pub(super) tangents: Vec<Tangents>,
    /// Texture coordinates by shape; see [`Geometry::finish`].
    pub(super) uvs: Vec<TextureCoordinates>,
    pub(super) places: Places,
    pub(super) lights: Vec<Light>,
    /// Number of shapes so far.
    pub(super) shapes: u32,
    /// Number of emitting shapes among them. Each has a spectrum of its own, in this order.
    pub(super) emitting: u32,
    pub(super) notices: Vec<String>,
}

/// A shape that is being added.
struct ShapeInput<'a> {
    shape: &'a ShapeDesc,
    surface: u32,
    /// The front is the other side of the right-hand rule: by a transform that mirrors, or by `flip_normals`, but not by both.
    turned: bool,
    /// Index of its spectrum, if it emits.
    spectrum: Option<u32>,
    /// Number of primitives without area or with unusable coordinates.
    dropped: usize,
    /// ∂p/∂u of each triangle, if the shape is brushed.
    along: Option<Vec<Vec3>>,
    /// Texture coordinates of each triangle, if the shape is textured.
    uvs: Option<Vec<[Vec2; 3]>>,
    /// Number of triangles before the shape.
    first: usize,
}

/// Place and name of a shape, for notices.
pub(super) fn describe(desc: &SceneDesc, shape: &ShapeDesc) -> String {
    let name = shape.id.as_deref().unwrap_or("without id");
    let file = desc.files.get(shape.place.file as usize).map(|f| f.display().to_string());
    let (line, column) = (shape.place.line, shape.place.column);
    format!("{}:{line}:{column}: shape {name}", file.unwrap_or_default())
}

impl Geometry {
    /// Adds one shape.
    ///
    /// A shape that emits black is a light, too: an edit may make a light black, and the scene must then be the same as if it had
    /// been loaded so.
    pub(super) fn add(&mut self, desc: &SceneDesc, shape: &ShapeDesc) -> Result<(), PrepareError> {
        let surface = self.shapes;
        self.shapes += 1;
        let spectrum = shape.emission.is_some().then_some(self.emitting);
        self.emitting += u32::from(spectrum.is_some());
        let brushed = tangents::is_brushed(desc, shape.bsdf);
        let (first, along) = (self.triangles.len(), brushed.then(Vec::new));
        let textured = texture_coordinates::is_textured(desc, shape.bsdf);
        let uvs = textured.then(Vec::new);
        let turned = (shape.to_world.matrix3.determinant() < 0.0) != shape.flip_normals;
        let mut input = ShapeInput { shape, surface, turned, spectrum, dropped: 0, along, uvs, first };
        match &shape.kind {
            ShapeKind::Mesh(id) => {
                let unknown = PrepareError::UnknownMesh { id: *id, place: shape.place };
                self.add_mesh(desc.meshes.get(id.0 as usize).ok_or(unknown)?, &mut input);
            }
            ShapeKind::Sphere { center, radius } => self.add_sphere(*center, *radius, &mut input),
            ShapeKind::Cylinder { p0, p1, radius } => self.add_cylinder(*p0, *p1, *radius, &mut input),
            ShapeKind::Disk => self.add_disk(&mut input),
            ShapeKind::Rectangle => self.add_rectangle(&mut input),
            ShapeKind::Cube => self.add_cube(&mut input),
            // `add_groups` adds instances.
            ShapeKind::Instance(_) => (),
        }
        self.tangents.push(match input.along {
            None => Tangents::Any,
            Some(along) if along.is_empty() => tangents::of_shape(shape),
            Some(along) => Tangents::Each { first: first as u32, along },
        });
        self.uvs.push(match input.uvs {
            None => TextureCoordinates::Unused,
            Some(uvs) if uvs.is_empty() => texture_coordinates::of_shape(shape),
            Some(of) => TextureCoordinates::Triangles { first: first as u32, of },
        });
        if input.dropped > 0 {
            self.notices.push(format!(
                "{}: {} primitives have no area or coordinates beyond 1e12 and were dropped",
                describe(desc, shape),
                input.dropped
            ));
        }
        Ok(())
    }

    /// Joins the lists of triangles, disks, spheres and cylinders into one numbering. Drops the tangents if no shape is brushed.
    pub(super) fn finish(mut self) -> Self {
        let triangles = self.triangles.len() as u32;
        let first_sphere = triangles + self.disks.len() as u32;
        let first_cylinder = first_sphere + self.spheres.len() as u32;
        if self.tangents.iter().all(|t| matches!(t, Tangents::Any)) {
            self.tangents.clear();
        }
        if self.uvs.iter().all(|uvs| matches!(uvs, TextureCoordinates::Unused)) {
            self.uvs.clear();
        }
        self.prims.append(&mut self.disk_prims);
        self.prims.append(&mut self.sphere_prims);
        self.prims.append(&mut self.cylinder_prims);
        for light in &mut self.lights {
            let shift = match light.shape {
                LightShape::Disk(_) => triangles,
                LightShape::Sphere(_) => first_sphere,
                LightShape::Cylinder(_) => first_cylinder,
                _ => 0,
            };
            light.prims = PrimRange { first: light.prims.first + shift, end: light.prims.end + shift };
        }
        self
    }

    /// Adds a light that is not a shape, with the index of its spectrum, unless it is unusable or a second environment.
    pub(super) fn add_light(&mut self, desc: &LightDesc, spectrum: u32) {
        let line = desc.place().line;
        if desc.is_environment() && self.lights.iter().any(Light::is_environment) {
            let second = "a scene has one environment; this second one is ignored";
            self.notices.push(format!("line {line}: {second}"));
            return;
        }
        let finite = |v: DVec3| Some(v.as_vec3()).filter(|v| v.is_finite());
        let unit = |v: DVec3| v.as_vec3().try_normalize();
        let shape = match desc {
            LightDesc::Constant { .. } => Some(LightShape::Constant(ConstantLight)),
            LightDesc::Map { map, to_world, .. } => {
                Some(LightShape::Map(EnvironmentMap::new(map.clone(), to_world.matrix3)))
            }
            LightDesc::SunSky(SunSkyDesc { sky, to_world, sun_direction, sun_half_angle, sun, .. }) => {
                unit(*sun_direction).map(|direction| {
                    let sun = SunDisc::new(direction, sun_half_angle.to_radians(), sun.clone());
                    LightShape::SunSky(SunSkyLight::new(sky.clone(), to_world.matrix3, sun))
                })
            }
            LightDesc::Directional { direction, .. } => {
                unit(*direction).map(|direction| LightShape::Directional(DirectionalLight { direction }))
            }
            LightDesc::Spot(SpotDesc { position, axis, beam_width, cutoff_angle, .. }) => {
                let [beam, cutoff] = [*beam_width, *cutoff_angle].map(|angle| angle.to_radians() as f32);
                let usable = 0.0 <= beam && beam <= cutoff && cutoff <= std::f32::consts::PI;
                let place = finite(*position).zip(unit(*axis)).filter(|_| usable);
                place.map(|(position, axis)| LightShape::Spot(SpotLight::new(position, axis, beam, cutoff)))
            }
            LightDesc::Point { position, .. } => {
                finite(*position).map(|position| LightShape::Point(PointLight { position }))
            }
        };
        let Some(shape) = shape else {
            let nowhere = "the light's position, direction or angles are not usable; it is ignored";
            self.notices.push(format!("line {line}: {nowhere}"));
            return;
        };
        self.lights.push(Light { shape, spectrum, prims: PrimRange::NONE });
    }

    /// Adds a light over the primitives `range` of its kind and returns its index, or [`NONE`] if the shape does not emit.
    fn light(&mut self, input: &ShapeInput, range: Range<usize>, shape: impl FnOnce() -> LightShape) -> u32 {
        let Some(spectrum) = input.spectrum else { return NONE };
        let prims = PrimRange { first: range.start as u32, end: range.end as u32 };
        self.lights.push(Light { shape: shape(), spectrum, prims });
        self.lights.len() as u32 - 1
    }

    /// Adds the shape as the back of the primitives `range` of its kind and returns its index.
    fn back(&mut self, input: &ShapeInput, range: Range<usize>, shape: impl FnOnce() -> LightShape) -> u32 {
        let light = self.light(input, range, shape);
        self.backs.push(Back { surface: input.surface, light });
        self.backs.len() as u32 - 1
    }

    /// Adds a triangle whose front is the side of e1 × e2, or counts it as dropped.
    fn push_triangle(
        &mut self,
        corners: [Vec3; 3],
        input: &mut ShapeInput,
        normals: Option<[Vec3; 3]>,
    ) -> bool {
        let usable = corners.iter().all(|p| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE);
        let Some(triangle) = Triangle::new(corners).filter(|t| usable && t.area() > 0.0) else {
            input.dropped += 1;
            return false;
        };
        self.corners.push(corners);
        self.triangles.push(triangle);
        let normals = normals.map_or(NONE, |n| {
            self.normals.push(n);
            self.normals.len() as u32 - 1
        });
        self.prims.push(PrimRecord { surface: input.surface, light: NONE, normals, back: NONE });
        true
    }

    /// Records ∂p/∂u of the triangles that were added since the last call.
    fn record_tangents(&self, input: &mut ShapeInput, along: impl FnOnce() -> Vec3) {
        let Some(known) = &mut input.along else { return };
        known.resize(self.triangles.len() - input.first, along());
    }

    fn add_mesh(&mut self, mesh: &Mesh, input: &mut ShapeInput) {
        let to_world = input.shape.to_world;
        let to_normal = to_world.matrix3.inverse().transpose();
        let at = |i: u32| {
            mesh.positions.get(i as usize).map(|p| to_world.transform_point3(p.as_dvec3()).as_vec3())
        };
        let flip = input.shape.flip_normals;
        let normal = |i: u32| {
            let n = (to_normal * mesh.normals.get(i as usize)?.as_dvec3()).try_normalize()?.as_vec3();
            Some(if flip { -n } else { n })
        };
        for &[i, j, k] in &mesh.triangles {
            let (j, k) = if flip { (k, j) } else { (j, k) };
            let (Some(a), Some(b), Some(c)) = (at(i), at(j), at(k)) else {
                input.dropped += 1;
                continue;
            };
            let normals = normal(i).zip(normal(j)).zip(normal(k)).map(|((x, y), z)| [x, y, z]);
            self.push_mesh_triangle([a, b, c], normals, input);
            self.record_tangents(input, || tangents::of_triangle(mesh, [i, j, k], [a, b, c]));
            if let Some(uvs) = input.uvs.as_mut().filter(|uvs| uvs.len() < self.triangles.len() - input.first)
            {
                // Normals may have turned the front.
                let turned = self.corners.last().is_some_and(|stored| stored[1] != b);
                let corners = if turned { [i, k, j] } else { [i, j, k] };
                uvs.push(texture_coordinates::of_triangle(mesh, corners));
            }
        }
    }

    /// Adds a triangle of a mesh. Vertex normals, where given, determine the front, and are dropped on a flat face.
    fn push_mesh_triangle(&mut self, corners: [Vec3; 3], normals: Option<[Vec3; 3]>, input: &mut ShapeInput) {
        let [a, b, c] = corners;
        let (mut corners, mut normals) = (corners, normals);
        if let (Some([x, y, z]), Some(face)) = (normals, Triangle::new(corners)) {
            if face.n.dot(x + y + z) < 0.0 {
                (corners, normals) = ([a, c, b], Some([x, z, y]));
            }
            let flat = [x, y, z].iter().all(|n| n.dot(face.n).abs() > 1.0 - 1e-6);
            normals = normals.filter(|_| !flat);
        }
        let first = self.triangles.len();
        let key = PlaceKey::polygon(corners);
        // A mesh may have millions of triangles, so only emitting ones are entered into `places`.
        let face = Triangle::new(corners).filter(|_| input.spectrum.is_some());
        if let Some(face) = face
            && let Some(front) = self.places.take(key, face.n)
        {
            let light = || LightShape::Triangle(TriangleLight::new(face));
            self.prims[front].back = self.back(input, front..front + 1, light);
        } else if self.push_triangle(corners, input, normals) {
            let triangle = self.triangles[first];
            let light = || LightShape::Triangle(TriangleLight::new(triangle));
            self.prims[first].light = self.light(input, first..first + 1, light);
            if face.is_some() {
                self.places.add(key, triangle.n, first);
            }
        }
    }

    /// Adds a parallelogram with its light, if it emits: the image of the square from −1 to 1, whose corners give the front by the
    /// right-hand rule unless the shape is turned. If it is degenerate, one of its halves or neither is added.
    fn add_parallelogram(&mut self, corner: impl Fn(f64, f64) -> (Vec3, Vec2), input: &mut ShapeInput) {
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let (b, d) = if input.turned { (d, b) } else { (b, d) };
        let ([a, b, c, d], [uv_a, uv_b, uv_c, uv_d]) = ([a.0, b.0, c.0, d.0], [a.1, b.1, c.1, d.1]);
        let first = self.triangles.len();
        let key = PlaceKey::polygon([a, b, c, d]);
        let light = |n: Vec3| move || LightShape::Parallelogram(ParallelogramLight::over(a, b - a, d - a, n));
        if let Some(face) = Triangle::new([a, b, c])
            && let Some(front) = self.places.take(key, face.n)
        {
            // Hits on either half are reported for the first one.
            self.prims[front].back = self.back(input, front..front + 2, light(face.n));
            return;
        }
        let halves = [([a, b, c], [uv_a, uv_b, uv_c]), ([a, c, d], [uv_a, uv_c, uv_d])];
        let mut push = |(corners, uvs)| {
            let pushed = self.push_triangle(corners, input, None);
            if let Some(known) = input.uvs.as_mut().filter(|_| pushed) {
                known.push(texture_coordinates::of_corners(uvs));
            }
            pushed
        };
        if halves.into_iter().all(&mut push) {
            self.quads.push(first as u32);
            let n = self.triangles[first].n;
            let light = self.light(input, first..first + 2, light(n));
            self.prims[first].light = light;
            self.prims[first + 1].light = light;
            self.places.add(key, n, first);
        }
    }

    fn add_rectangle(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        let uv = |x: f64, y: f64| Vec2::new((0.5 + 0.5 * x) as f32, (0.5 + 0.5 * y) as f32);
        self.add_parallelogram(|x, y| (m.transform_point3(DVec3::new(x, y, 0.0)).as_vec3(), uv(x, y)), input);
    }

    fn add_cube(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let corner = |x: f64, y: f64| {
                    let mut p = DVec3::ZERO;
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, x * sign, y);
                    let uv = texture_coordinates::of_cube_corner(axis, sign, p);
                    (m.transform_point3(p).as_vec3(), uv)
                };
                self.add_parallelogram(corner, input);
                self.record_tangents(input, || {
                    m.transform_vector3(tangents::of_cube_face(axis, sign)).as_vec3()
                });
            }
        }
    }

    fn add_disk(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        let axis = |v: DVec3| m.transform_vector3(v);
        let sign = if input.turned { -1.0 } else { 1.0 };
        let front = axis(DVec3::X).cross(axis(DVec3::Y)) * sign;
        let (center, a, b) = (m.translation.as_vec3(), axis(DVec3::X).as_vec3(), axis(DVec3::Y).as_vec3());
        let usable =
            center.abs().max(a.abs()).max(b.abs()).max_element() <= MAX_COORDINATE && center.is_finite();
        let Some(disk) = Disk::new(center, a, b, front).filter(|d| usable && d.area() > 0.0) else {
            input.dropped += 1;
            return;
        };
        let key = PlaceKey::round(center, a, b);
        let light = || LightShape::Disk(DiskLight::new(disk));
        if self.add_record(|g| &mut g.disk_prims, key, disk.n, input, light) {
            self.disks.push(disk);
        }
    }

    /// Adds the record of a disk, sphere or cylinder with its light, if it emits. Returns false if it became the back of another one.
    fn add_record(
        &mut self,
        records: fn(&mut Self) -> &mut Vec<PrimRecord>,
        key: PlaceKey,
        front: Vec3,
        input: &ShapeInput,
        light: impl FnOnce() -> LightShape,
    ) -> bool {
        if let Some(other) = self.places.take(key, front) {
            let back = self.back(input, other..other + 1, light);
            records(self)[other].back = back;
            return false;
        }
        let i = records(self).len();
        self.places.add(key, front, i);
        let light = self.light(input, i..i + 1, light);
        records(self).push(PrimRecord { surface: input.surface, light, normals: NONE, back: NONE });
        true
    }

    fn add_sphere(&mut self, center: DVec3, radius: f64, input: &mut ShapeInput) {
        let m: DAffine3 = input.shape.to_world;
        let scale = m.matrix3.determinant().abs().cbrt();
        let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
        if columns.iter().any(|c| (c.length() - scale).abs() > 1e-4 * scale) {
            self.notices.push(format!(
                "shape at line {}: a sphere stays a sphere; its transform stretches, the mean scale is used",
                input.shape.place.line
            ));
        }
        let center = m.transform_point3(center).as_vec3();
        let radius = (radius.abs() * scale) as f32;
        let usable = center.is_finite() && center.abs().max_element() + radius <= MAX_COORDINATE;
        if !(usable && radius > 0.0) {
            input.dropped += 1;
            return;
        }
        let inward = input.turned;
        let sphere = Sphere { center, radius, inward };
        let key = PlaceKey::round(center, Vec3::splat(radius), Vec3::NAN);
        let side = if inward { -Vec3::X } else { Vec3::X };
        let light = || LightShape::Sphere(SphereLight::new(sphere));
        if self.add_record(|g| &mut g.sphere_prims, key, side, input, light) {
            self.spheres.push(sphere);
        }
    }

    fn add_cylinder(&mut self, p0: DVec3, p1: DVec3, radius: f64, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        // The frame of Mitsuba: texture coordinates begin where the first of its axes points.
        let (s, t) = (p1 - p0).normalize_or(DVec3::Z).any_orthonormal_pair();
        let axes = [s * radius, t * radius, p1 - p0].map(|v| m.transform_vector3(v).as_vec3());
        let base = m.transform_point3(p0).as_vec3();
        let inward = input.shape.flip_normals;
        let usable = |cylinder: &Cylinder| {
            let (lo, hi) = cylinder.bounds();
            lo.abs().max(hi.abs()).max_element() <= MAX_COORDINATE && cylinder.area() > 0.0
        };
        let Some(cylinder) = Cylinder::new(base, axes, inward).filter(usable) else {
            input.dropped += 1;
            return;
        };
        let key = PlaceKey::tube(base, axes);
        let side = if inward { -Vec3::X } else { Vec3::X };
        let light = || LightShape::Cylinder(CylinderLight::new(cylinder));
        if self.add_record(|g| &mut g.cylinder_prims, key, side, input, light) {
            self.cylinders.push(cylinder);
        }
    }
}

/// The exact place of a primitive: up to four points, sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct PlaceKey([[u32; 3]; 4]);

fn bits(p: Vec3) -> [u32; 3] {
    // Adding 0 turns −0 into 0.
    (p + 0.0).to_array().map(f32::to_bits)
}

impl PlaceKey {
    /// The key of a triangle or parallelogram. It does not depend on the first corner or the orientation.
    fn polygon<const N: usize>(corners: [Vec3; N]) -> Self {
        let mut points = [[u32::MAX; 3]; 4];
        for (point, corner) in points.iter_mut().zip(corners) {
            *point = bits(corner);
        }
        points.sort_unstable();
        Self(points)
    }

    /// The key of a disk with its half axes, or of a sphere with its radius.
    fn round(center: Vec3, a: Vec3, b: Vec3) -> Self {
        Self([[0, u32::MAX, 0], bits(center), bits(a), bits(b)])
    }

    /// The key of a cylinder, whose axes at the base are perpendicular to each other unless a transform stretches them.
    fn tube(base: Vec3, [a, b, axis]: [Vec3; 3]) -> Self {
        Self([[1, u32::MAX, 0], bits(base), bits(axis), bits(a + b)])
    }
}

/// Primitives by place, each with its normal. The map is never iterated, so its order does not matter.
#[derive(Debug, Default)]
pub(super) struct Places(HashMap<PlaceKey, (usize, Vec3)>);

impl Places {
    /// Finds the primitive at the same place that faces the other way, if it has no back yet, and removes it.
    fn take(&mut self, key: PlaceKey, n: Vec3) -> Option<usize> {
        let &(index, other) = self.0.get(&key)?;
        if other.dot(n) >= 0.0 {
            return None;
        }
        self.0.remove(&key);
        Some(index)
    }

    /// Adds primitive `index` of its kind, unless there is one at its place already.
    fn add(&mut self, key: PlaceKey, n: Vec3, index: usize) {
        self.0.entry(key).or_insert((index, n));
    }
}
