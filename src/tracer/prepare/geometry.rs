//! Conversion of shapes to primitives, in world space or in the space of their group.
//!
//! Front sides follow Mitsuba. The front of a rectangle or disk is the side to which its transformed +z normal points (a
//! mirroring transform does not turn it). The front of a mesh follows from the right-hand rule on the transformed corners. The
//! front of a cube is the outside, as is that of a sphere unless the transform mirrors. `flip_normals` turns all of them. The
//! corners of a triangle are stored in the order that determines its front, so no sign has to be stored.

use glam::{DAffine3, DVec3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{Mesh, ShapeDesc, ShapeKind};
use crate::tracer::accel::PrimRange;
use crate::tracer::light::{DiskLight, Light, LightShape, ParallelogramLight, SphereLight, TriangleLight};
use crate::tracer::primitives::{NONE, PrimRecord};
use crate::tracer::shape::{Disk, Sphere, Triangle};
use crate::tracer::tangents::Tangents;

use super::PrepareError;
use super::backs::{Back, PlaceKey, Places};
use super::tangents;

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
    /// Records of the triangles. [`Geometry::finish`] appends those of disks and spheres.
    pub(super) prims: Vec<PrimRecord>,
    disk_prims: Vec<PrimRecord>,
    sphere_prims: Vec<PrimRecord>,
    pub(super) normals: Vec<[Vec3; 3]>,
    pub(super) backs: Vec<Back>,
    /// Tangents by shape; see [`Geometry::finish`].
    pub(super) tangents: Vec<Tangents>,
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
    /// Index of its spectrum, if it emits.
    spectrum: Option<u32>,
    /// Number of primitives without area or with unusable coordinates.
    dropped: usize,
    /// ∂p/∂u of each triangle, if the shape is brushed.
    along: Option<Vec<Vec3>>,
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
        let mut input = ShapeInput { shape, surface, spectrum, dropped: 0, along, first };
        match &shape.kind {
            ShapeKind::Mesh(id) => {
                let unknown = PrepareError::UnknownMesh { id: *id, place: shape.place };
                self.add_mesh(desc.meshes.get(id.0 as usize).ok_or(unknown)?, &mut input);
            }
            ShapeKind::Sphere { center, radius } => self.add_sphere(*center, *radius, &mut input),
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
        if input.dropped > 0 {
            self.notices.push(format!(
                "{}: {} primitives have no area or coordinates beyond 1e12 and were dropped",
                describe(desc, shape),
                input.dropped
            ));
        }
        Ok(())
    }

    /// Joins the lists of triangles, disks and spheres into one numbering. Drops the tangents if no shape is brushed.
    pub(super) fn finish(mut self) -> Self {
        let triangles = self.triangles.len() as u32;
        let first_sphere = triangles + self.disks.len() as u32;
        if self.tangents.iter().all(|t| matches!(t, Tangents::Any)) {
            self.tangents.clear();
        }
        self.prims.append(&mut self.disk_prims);
        self.prims.append(&mut self.sphere_prims);
        for light in &mut self.lights {
            let shift = match light.shape {
                LightShape::Disk(_) => triangles,
                LightShape::Sphere(_) => first_sphere,
                _ => 0,
            };
            light.prims = PrimRange { first: light.prims.first + shift, end: light.prims.end + shift };
        }
        self
    }

    /// Adds a light over the primitives `range` of its kind and returns its index, or [`NONE`] if the shape does not emit.
    fn light(
        &mut self,
        input: &ShapeInput,
        range: (usize, usize),
        shape: impl FnOnce() -> LightShape,
    ) -> u32 {
        let Some(spectrum) = input.spectrum else { return NONE };
        let prims = PrimRange { first: range.0 as u32, end: range.1 as u32 };
        self.lights.push(Light { shape: shape(), spectrum, prims });
        self.lights.len() as u32 - 1
    }

    /// Adds the shape as the back of the primitives `range` of its kind and returns its index.
    fn back(&mut self, input: &ShapeInput, range: (usize, usize), shape: impl FnOnce() -> LightShape) -> u32 {
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
            self.prims[front].back = self.back(input, (front, front + 1), light);
        } else if self.push_triangle(corners, input, normals) {
            let triangle = self.triangles[first];
            self.prims[first].light =
                self.light(input, (first, first + 1), || LightShape::Triangle(TriangleLight::new(triangle)));
            if face.is_some() {
                self.places.add(key, triangle.n, first);
            }
        }
    }

    /// Adds a parallelogram with its light, if it emits. The corners are in order, and the right-hand rule gives the front. If it
    /// is degenerate, one of its halves or neither is added.
    fn add_parallelogram(&mut self, [a, b, c, d]: [Vec3; 4], input: &mut ShapeInput) {
        let first = self.triangles.len();
        let key = PlaceKey::polygon([a, b, c, d]);
        let light = |n: Vec3| move || LightShape::Parallelogram(ParallelogramLight::over(a, b - a, d - a, n));
        if let Some(face) = Triangle::new([a, b, c])
            && let Some(front) = self.places.take(key, face.n)
        {
            // Hits on either half are reported for the first one.
            self.prims[front].back = self.back(input, (front, front + 2), light(face.n));
            return;
        }
        if self.push_triangle([a, b, c], input, None) && self.push_triangle([a, c, d], input, None) {
            self.quads.push(first as u32);
            let n = self.triangles[first].n;
            let light = self.light(input, (first, first + 2), light(n));
            self.prims[first].light = light;
            self.prims[first + 1].light = light;
            self.places.add(key, n, first);
        }
    }

    fn add_rectangle(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        let corner = |x: f64, y: f64| m.transform_point3(DVec3::new(x, y, 0.0)).as_vec3();
        // The front is the side of e1 × e2. A mirroring transform turns this product, but not the transformed normal.
        let mirrored = m.matrix3.determinant() < 0.0;
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let [a, b, c, d] = corners;
        let [a, b, c, d] = if mirrored != input.shape.flip_normals { [a, d, c, b] } else { [a, b, c, d] };
        self.add_parallelogram([a, b, c, d], input);
    }

    fn add_cube(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        // The outside stays outside under a mirroring transform.
        let turned = (m.matrix3.determinant() < 0.0) != input.shape.flip_normals;
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let corner = |x: f64, y: f64| {
                    let mut p = DVec3::ZERO;
                    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, x * sign, y);
                    m.transform_point3(p).as_vec3()
                };
                let [a, b, c, d] =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let [b, d] = if turned { [d, b] } else { [b, d] };
                self.add_parallelogram([a, b, c, d], input);
                self.record_tangents(input, || {
                    m.transform_vector3(tangents::of_cube_face(axis, sign)).as_vec3()
                });
            }
        }
    }

    fn add_disk(&mut self, input: &mut ShapeInput) {
        let m = input.shape.to_world;
        let axis = |v: DVec3| m.transform_vector3(v);
        let mirrored = m.matrix3.determinant() < 0.0;
        let sign = if mirrored != input.shape.flip_normals { -1.0 } else { 1.0 };
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

    /// Adds the record of a disk or sphere with its light, if it emits. Returns false if it became the back of another one.
    fn add_record(
        &mut self,
        records: fn(&mut Self) -> &mut Vec<PrimRecord>,
        key: PlaceKey,
        front: Vec3,
        input: &ShapeInput,
        light: impl FnOnce() -> LightShape,
    ) -> bool {
        if let Some(other) = self.places.take(key, front) {
            let back = self.back(input, (other, other + 1), light);
            records(self)[other].back = back;
            return false;
        }
        let i = records(self).len();
        self.places.add(key, front, i);
        let light = self.light(input, (i, i + 1), light);
        records(self).push(PrimRecord { surface: input.surface, light, normals: NONE, back: NONE });
        true
    }

    fn add_sphere(&mut self, center: DVec3, radius: f64, input: &mut ShapeInput) {
        let m: DAffine3 = input.shape.to_world;
        let determinant = m.matrix3.determinant();
        let scale = determinant.abs().cbrt();
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
        let inward = (determinant < 0.0) != input.shape.flip_normals;
        let sphere = Sphere { center, radius, inward };
        let key = PlaceKey::round(center, Vec3::splat(radius), Vec3::NAN);
        let side = if inward { -Vec3::X } else { Vec3::X };
        let light = || LightShape::Sphere(SphereLight::new(sphere));
        if self.add_record(|g| &mut g.sphere_prims, key, side, input, light) {
            self.spheres.push(sphere);
        }
    }
}
