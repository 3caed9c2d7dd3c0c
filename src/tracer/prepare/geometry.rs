//! Conversion of shapes to primitives, in world space or in the space of their group.
//!
//! Front sides follow Mitsuba. The front of a rectangle or disk is the side to which its transformed +z normal points (a
//! mirroring transform does not turn it). The front of a mesh follows from the right-hand rule on the transformed corners. The
//! front of a cube or cylinder is the outside, as is that of a sphere unless the transform mirrors. `flip_normals` turns all of them. The
//! corners of a triangle are stored in the order that determines its front, so no sign has to be stored.
//!
//! Scenes use primitives that lie back to back in exactly the same place for lights that emit on both sides. Rounding would decide
//! which of the two a ray hits, and half of the light would be lost. So the second one becomes the [`BackSurface`] of the first.

use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::scene::SceneDesc;
use crate::scene::desc::emission_texture::{EmissionProfile, EmissionTexture};
use crate::scene::desc::{CurveBasis, Curves, Mesh, ShapeDesc, ShapeKind};
use crate::tracer::accel::{PrimRange, TriangleSource};
use crate::tracer::curve::CurvePiece;
use crate::tracer::faces::{Faces, ShapeVertices};
use crate::tracer::light::{
    CylinderLight, DiskLight, EmittingSurface, FlatPatch, Light, LightShape, LuminancePyramid,
    ParallelogramLight, SphereLight, TexturedLight, TriangleLight,
};
use crate::tracer::primitives::{BackSurface, NONE, PrimRecord};
use crate::tracer::shape::{Cylinder, Disk, Sphere, Triangle, has_area};
use crate::tracer::tangents::{self, Tangents};
use crate::tracer::texture_coordinates::{self, ShapeAttributes, TextureCoordinates};

use super::coincident::{CoincidenceKey, CoincidentSurfaces};
use super::error::{MAX_PRIMITIVES, PrepareError};

/// Largest magnitude of a coordinate. Its square and its product with an extent stay finite.
pub(super) const MAX_COORDINATE: f32 = 1e12;

/// The primitives and lights of the shapes.
#[derive(Default)]
pub(super) struct Geometry {
    pub(super) faces: Faces,
    /// The first triangles of parallelograms.
    pub(super) quads: Vec<u32>,
    pub(super) disks: Vec<Disk>,
    pub(super) spheres: Vec<Sphere>,
    pub(super) cylinders: Vec<Cylinder>,
    pub(super) curves: Vec<CurvePiece>,
    /// Records of disks, spheres and cylinders; made by [`Geometry::finish`].
    pub(super) round: Vec<PrimRecord>,
    disk_prims: Vec<PrimRecord>,
    sphere_prims: Vec<PrimRecord>,
    cylinder_prims: Vec<PrimRecord>,
    curve_prims: Vec<PrimRecord>,
    pub(super) backs: Vec<BackSurface>,
    /// Tangents by shape; see [`Geometry::finish`].
    pub(super) tangents: Vec<Tangents>,
    /// Texture coordinates by shape; see [`Geometry::finish`].
    pub(super) uvs: Vec<TextureCoordinates>,
    pub(super) coincident: CoincidentSurfaces,
    pub(super) lights: Vec<Light>,
    /// Number of shapes so far.
    pub(super) shapes: u32,
    /// Number of emitting shapes among them. Each has a spectrum of its own, in this order.
    pub(super) emitting: u32,
    pub(super) notices: Vec<String>,
    /// Most cells of a face that emits by a texture.
    cells: usize,
    /// Luminances of the textures that shapes and projectors emit by.
    pyramids: Vec<Arc<LuminancePyramid>>,
}

/// Cells of all faces of a scene that emit by textures, if each face has several.
const ALL_CELLS: usize = 1 << 23;

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
    /// The attributes of the mesh, if its material asks for some.
    attributes: Option<Box<ShapeAttributes>>,
    /// Number of triangles before the shape.
    first: usize,
    /// Luminances of the texture that it emits by.
    luminances: Option<Arc<LuminancePyramid>>,
}

impl ShapeInput<'_> {
    /// The light of a face: `even`, or one on `surface`, with at most `cells` cells, that emits as the shape does.
    fn light(&self, cells: usize, even: LightShape, surface: impl FnOnce() -> EmittingSurface) -> LightShape {
        let EmissionProfile { texture, along_normal } = &self.shape.emission_profile;
        if texture.is_none() && !along_normal {
            return even;
        }
        let light = TexturedLight::new(surface(), self.luminances.as_deref(), *along_normal, cells);
        LightShape::Textured(Box::new(light))
    }
}

/// Triangles of a mesh that are in memory twice.
const TRIANGLES_AT_ONCE: usize = 1 << 16;

/// A triangle of a mesh before it is added. Vertex normals, where given, determine the front, and do not count on a flat face.
struct MeshTriangle {
    /// Indices of its vertices, which normals may turn.
    corners: [u32; 3],
    /// Where they are.
    places: [Vec3; 3],
    turned: bool,
    smooth: bool,
    /// The triangle, unless it is unusable.
    triangle: Option<Triangle>,
}

impl MeshTriangle {
    fn new(corners: [u32; 3], faces: &Faces, vertices: &ShapeVertices) -> Self {
        let places = corners.map(|i| faces.position(i).unwrap_or(Vec3::NAN));
        let mut made = Self { corners, places, turned: false, smooth: false, triangle: usable(places) };
        let normals = corners.map(|i| faces.normal(vertices, i).filter(|n| *n != Vec3::ZERO));
        if let ([Some(x), Some(y), Some(z)], Some(face)) = (normals, made.triangle) {
            if face.n.dot(x + y + z) < 0.0 {
                made.turned = true;
                made.triangle = usable([places[0], places[2], places[1]]);
            }
            made.smooth = [x, y, z].iter().any(|n| n.dot(face.n).abs() <= 1.0 - 1e-6);
        }
        made
    }

    fn turned_corners(&self) -> [u32; 3] {
        let [a, b, c] = self.corners;
        if self.turned { [a, c, b] } else { [a, b, c] }
    }
}

/// The triangle, unless it has no area or coordinates that cannot be used.
fn usable(corners: [Vec3; 3]) -> Option<Triangle> {
    let usable = corners.iter().all(|p| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE);
    Triangle::new(corners).filter(|t| usable && has_area(t.area()))
}

/// Place and name of a shape, for notices.
pub(super) fn describe(desc: &SceneDesc, shape: &ShapeDesc) -> String {
    let name = shape.id.as_deref().unwrap_or("without id");
    let file = desc.files.get(shape.place.file as usize).map(|f| f.display().to_string());
    let (line, column) = (shape.place.line, shape.place.column);
    format!("{}:{line}:{column}: shape {name}", file.unwrap_or_default())
}

impl Geometry {
    /// Empty geometry for the shapes of `desc`.
    pub(super) fn of(desc: &SceneDesc) -> Self {
        let textured = |shape: &&ShapeDesc| shape.emission_profile.texture.is_some();
        let faces: usize = desc.shapes.iter().filter(textured).map(|shape| desc.faces(shape)).sum();
        Self { cells: ALL_CELLS / faces.max(1), ..Self::default() }
    }

    /// The luminances of a texture that something emits by, made once.
    pub(super) fn luminances(&mut self, texture: &Arc<EmissionTexture>) -> Arc<LuminancePyramid> {
        let known = self.pyramids.iter().find(|pyramid| Arc::ptr_eq(pyramid.texture(), texture));
        known.cloned().unwrap_or_else(|| {
            let pyramid = Arc::new(LuminancePyramid::new(texture.clone()));
            self.pyramids.push(pyramid.clone());
            pyramid
        })
    }

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
        let (first, along) = (self.faces.count(), brushed.then(Vec::new));
        let textured = texture_coordinates::is_textured(desc, shape.bsdf);
        let uvs = textured.then(Vec::new);
        let turned = (shape.to_world.matrix3.determinant() < 0.0) != shape.flip_normals;
        let luminances = shape.emission_profile.texture.as_ref().map(|texture| self.luminances(texture));
        let mut input = ShapeInput {
            shape,
            surface,
            turned,
            spectrum,
            dropped: 0,
            along,
            uvs,
            attributes: None,
            first,
            luminances,
        };
        match &shape.kind {
            ShapeKind::Mesh(id) => {
                let unknown = PrepareError::UnknownMesh { id: *id, place: shape.place };
                let mesh = desc.meshes.get(id.0 as usize).ok_or(unknown)?;
                input.attributes = ShapeAttributes::new(desc, shape.bsdf, mesh);
                self.add_mesh(mesh, &mut input);
            }
            ShapeKind::Sphere { center, radius } => self.add_sphere(*center, *radius, &mut input),
            ShapeKind::Cylinder { p0, p1, radius } => self.add_cylinder(*p0, *p1, *radius, &mut input),
            ShapeKind::Disk => self.add_disk(&mut input),
            ShapeKind::Rectangle => self.add_rectangle(&mut input),
            ShapeKind::Cube => self.add_cube(&mut input),
            ShapeKind::Curves(curves) => self.add_curves(curves, &mut input)?,
            // `add_groups` adds instances.
            ShapeKind::Instance(_) => (),
        }
        let bump = tangents::has_bump(desc, shape.bsdf);
        self.tangents.push(match input.along {
            _ if bump && first < self.faces.count() => {
                let unmapped =
                    matches!(shape.kind, ShapeKind::Mesh(id) if desc.meshes[id.0 as usize].uvs.is_empty());
                let corners = (first..self.faces.count()).map(|i| self.faces.corners(i));
                let triangles = corners.zip(input.uvs.iter().flatten());
                let of = triangles.map(|(p, uvs)| tangents::derivatives_of_triangle(p, *uvs));
                let of = if unmapped { Vec::new() } else { of.collect() };
                Tangents::Triangles { first: first as u32, of }
            }
            _ if bump => tangents::derivatives_of_shape(shape),
            None => Tangents::Any,
            Some(along) if along.is_empty() => tangents::of_shape(shape),
            Some(along) => Tangents::Each { first: first as u32, along },
        });
        let coordinates = match input.uvs {
            None => TextureCoordinates::Unused,
            Some(uvs) if uvs.is_empty() => texture_coordinates::of_shape(shape),
            Some(of) => texture_coordinates::of_triangles(first as u32, of, input.attributes),
        };
        self.uvs.push(coordinates.placed(desc, shape.bsdf));
        if input.dropped > 0 {
            self.notices.push(format!(
                "{}: {} primitives have no area, or coordinates beyond 1e12 times the size of most shapes, and were dropped",
                describe(desc, shape),
                input.dropped
            ));
        }
        Ok(())
    }

    /// Joins the lists of triangles, disks, spheres and cylinders into one numbering. Drops the tangents if no shape is brushed.
    pub(super) fn finish(mut self) -> Self {
        let triangles = self.faces.count() as u32;
        let first_sphere = triangles + self.disks.len() as u32;
        let first_cylinder = first_sphere + self.spheres.len() as u32;
        if self.tangents.iter().all(|t| matches!(t, Tangents::Any)) {
            self.tangents.clear();
        }
        if self.uvs.iter().all(|uvs| matches!(uvs, TextureCoordinates::Unused)) {
            self.uvs.clear();
        }
        self.round.append(&mut self.disk_prims);
        self.round.append(&mut self.sphere_prims);
        self.round.append(&mut self.cylinder_prims);
        self.round.append(&mut self.curve_prims);
        for light in &mut self.lights {
            let surface =
                if let LightShape::Textured(light) = &light.shape { Some(light.surface()) } else { None };
            let shift = match (&light.shape, surface) {
                (LightShape::Disk(_), _) | (_, Some(EmittingSurface::Disk(_))) => triangles,
                (LightShape::Sphere(_), _) | (_, Some(EmittingSurface::Sphere { .. })) => first_sphere,
                (LightShape::Cylinder(_), _) | (_, Some(EmittingSurface::Cylinder(_))) => first_cylinder,
                _ => 0,
            };
            light.prims = PrimRange { first: light.prims.first + shift, end: light.prims.end + shift };
        }
        self
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
        self.backs.push(BackSurface { surface: input.surface, light });
        self.backs.len() as u32 - 1
    }

    /// Adds a triangle whose front is the side of e1 × e2, or counts it as dropped.
    fn push_triangle(&mut self, corners: [Vec3; 3], input: &mut ShapeInput) -> bool {
        let Some(triangle) = usable(corners) else {
            input.dropped += 1;
            return false;
        };
        let first = self.faces.add_vertices(input.surface, corners, []).first;
        self.faces.push([first, first + 1, first + 2], triangle.n, input.surface, false);
        true
    }

    /// Records ∂p/∂u of the triangles that were added since the last call.
    fn record_tangents(&self, input: &mut ShapeInput, along: impl FnOnce() -> Vec3) {
        let Some(known) = &mut input.along else { return };
        known.resize(self.faces.count() - input.first, along());
    }

    fn add_mesh(&mut self, mesh: &Mesh, input: &mut ShapeInput) {
        let to_world = input.shape.to_world;
        let to_normal = to_world.matrix3.inverse().transpose();
        let flip = input.shape.flip_normals;
        let position = |p: &Vec3| to_world.transform_point3(p.as_dvec3()).as_vec3();
        // Zero where there is none.
        let normal = |n: &Vec3| {
            let n = (to_normal * n.as_dvec3()).normalize_or_zero().as_vec3();
            if flip { -n } else { n }
        };
        let positions: Vec<Vec3> = mesh.positions.par_iter().map(position).collect();
        let normals: Vec<Vec3> = mesh.normals.par_iter().map(normal).collect();
        let vertices = self.faces.add_vertices(input.surface, positions, normals);
        for (chunk, triangles) in mesh.triangles.chunks(TRIANGLES_AT_ONCE).enumerate() {
            let faces = &self.faces;
            let made: Vec<MeshTriangle> = triangles
                .par_iter()
                .map(|&[i, j, k]| {
                    let corners = if flip { [i, k, j] } else { [i, j, k] };
                    MeshTriangle::new(corners.map(|i| vertices.first.saturating_add(i)), faces, &vertices)
                })
                .collect();
            for (i, made) in made.into_iter().enumerate() {
                let uv = |corners: [u32; 3]| {
                    texture_coordinates::of_triangle(mesh, corners.map(|i| i - vertices.first))
                };
                let index = chunk * TRIANGLES_AT_ONCE + i;
                self.push_mesh_triangle(&made, mesh.number(index), input, uv);
                self.record_tangents(input, || {
                    tangents::of_triangle(mesh, made.corners.map(|i| i - vertices.first), made.places)
                });
                if let Some(uvs) =
                    input.uvs.as_mut().filter(|uvs| uvs.len() < self.faces.count() - input.first)
                    && let Some(corners) = self.faces.last_corners()
                {
                    uvs.push(uv(corners));
                    if let Some(attributes) = &mut input.attributes {
                        attributes.push(corners.map(|i| i - vertices.first), index);
                    }
                }
            }
        }
    }

    /// Adds a triangle of a mesh, of this number in its file. `uv` gives the texture coordinates of corners.
    fn push_mesh_triangle(
        &mut self,
        made: &MeshTriangle,
        number: u32,
        input: &mut ShapeInput,
        uv: impl Fn([u32; 3]) -> [Vec2; 3],
    ) {
        let Some(triangle) = made.triangle else {
            input.dropped += 1;
            return;
        };
        let first = self.faces.count();
        // A mesh may have millions of triangles, so only emitting ones are entered into `coincident`.
        let key = input.spectrum.map(|_| CoincidenceKey::polygon(made.places));
        let cells = self.cells;
        let light = |input: &ShapeInput| {
            let even = LightShape::Triangle(TriangleLight::new(triangle));
            let surface = || EmittingSurface::Flat(FlatPatch::triangle(triangle, uv(made.turned_corners())));
            input.light(cells, even, surface)
        };
        if let Some(front) = key.and_then(|key| self.coincident.take(key, triangle.n)) {
            self.faces.extra_mut(front).back = self.back(input, front..front + 1, || light(input));
            return;
        }
        self.faces.push(made.turned_corners(), triangle.n, input.surface, made.smooth);
        self.faces.number_last(input.first, number);
        if let Some(key) = key {
            self.faces.extra_mut(first).light = self.light(input, first..first + 1, || light(input));
            self.coincident.add(key, triangle.n, first);
        }
    }

    /// Adds a parallelogram with its light, if it emits: the image of the square from −1 to 1, whose corners give the front by the
    /// right-hand rule unless the shape is turned. If it is degenerate, one of its halves or neither is added.
    fn add_parallelogram(&mut self, corner: impl Fn(f64, f64) -> (Vec3, Vec2), input: &mut ShapeInput) {
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let corners =
            self.coincident.in_step(&self.faces, if input.turned { [a, d, c, b] } else { [a, b, c, d] });
        let ([a, b, c, d], [uv_a, uv_b, uv_c, uv_d]) = (corners.map(|c| c.0), corners.map(|c| c.1));
        let first = self.faces.count();
        let key = CoincidenceKey::polygon([a, b, c, d]);
        let cells = self.cells;
        let light = |input: &ShapeInput, n: Vec3| {
            let half = Triangle { p0: a, e1: b - a, e2: d - a, n };
            let even = LightShape::Parallelogram(ParallelogramLight::over(a, half.e1, half.e2, n));
            let uv = [uv_a, uv_b - uv_a, uv_d - uv_a];
            input.light(cells, even, || EmittingSurface::Flat(FlatPatch::parallelogram(half, uv)))
        };
        if let Some(face) = Triangle::new([a, b, c])
            && let Some(front) = self.coincident.take(key, face.n)
        {
            // Hits on either half are reported for the first one.
            self.faces.extra_mut(front).back = self.back(input, front..front + 2, || light(input, face.n));
            return;
        }
        let halves = [([a, b, c], [uv_a, uv_b, uv_c]), ([a, c, d], [uv_a, uv_c, uv_d])];
        let mut push = |(corners, uvs)| {
            let pushed = self.push_triangle(corners, input);
            if let Some(known) = input.uvs.as_mut().filter(|_| pushed) {
                known.push(texture_coordinates::of_corners(uvs));
            }
            pushed
        };
        if halves.into_iter().all(&mut push) {
            self.quads.push(first as u32);
            let n = self.faces.triangle_at(first).n;
            let light = self.light(input, first..first + 2, || light(input, n));
            if light != NONE {
                self.faces.extra_mut(first).light = light;
                self.faces.extra_mut(first + 1).light = light;
            }
            self.coincident.add(key, n, first);
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
        let Some(disk) = Disk::new(center, a, b, front).filter(|d| usable && has_area(d.area())) else {
            input.dropped += 1;
            return;
        };
        let key = CoincidenceKey::round(center, a, b);
        let cells = self.cells;
        let light = || {
            let even = LightShape::Disk(DiskLight::new(disk));
            input.light(cells, even, || EmittingSurface::Disk(disk))
        };
        if self.add_record(|g| &mut g.disk_prims, key, disk.n, input, light) {
            self.disks.push(disk);
        }
    }

    /// Adds the record of a disk, sphere or cylinder with its light, if it emits. Returns false if it became the back of another one.
    fn add_record(
        &mut self,
        records: fn(&mut Self) -> &mut Vec<PrimRecord>,
        key: CoincidenceKey,
        front: Vec3,
        input: &ShapeInput,
        light: impl FnOnce() -> LightShape,
    ) -> bool {
        if let Some(other) = self.coincident.take(key, front) {
            let back = self.back(input, other..other + 1, light);
            records(self)[other].back = back;
            return false;
        }
        let i = records(self).len();
        self.coincident.add(key, front, i);
        let light = self.light(input, i..i + 1, light);
        records(self).push(PrimRecord { surface: input.surface, light, back: NONE });
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
        let inward = input.turned;
        let sphere = Sphere { center, radius, inward };
        if !(usable && radius > 0.0 && has_area(sphere.area())) {
            input.dropped += 1;
            return;
        }
        let key = CoincidenceKey::round(center, Vec3::splat(radius), Vec3::NAN);
        let side = if inward { -Vec3::X } else { Vec3::X };
        let cells = self.cells;
        let light = || {
            let axes = [m.matrix3, m.matrix3.inverse()];
            let even = LightShape::Sphere(SphereLight::new(sphere));
            input.light(cells, even, || EmittingSurface::Sphere { sphere, axes })
        };
        if self.add_record(|g| &mut g.sphere_prims, key, side, input, light) {
            self.spheres.push(sphere);
        }
    }

    /// Adds the pieces of curves. Their radii stay as they are in the file, as in Mitsuba.
    fn add_curves(&mut self, curves: &Curves, input: &mut ShapeInput) -> Result<(), PrepareError> {
        let ShapeDesc { to_world, flip_normals, .. } = *input.shape;
        let point = |i: usize| {
            let p = curves.points.get(i).copied().unwrap_or(Vec4::NAN).as_dvec4();
            to_world.transform_point3(p.truncate()).extend(p.w)
        };
        let segment = |start: &u32| [0, 1, 2, 3].map(|k| point(*start as usize + k));
        let cubic = curves.basis == CurveBasis::BSpline;
        let pieces = |start: &u32| if cubic { CurvePiece::pieces(&segment(start)) } else { 1 };
        let count = self.curves.len() + curves.starts.iter().map(pieces).sum::<usize>();
        if count > MAX_PRIMITIVES {
            return Err(PrepareError::TooManyPrimitives { count });
        }
        let first = self.curves.len();
        for start in &curves.starts {
            let before = self.curves.len();
            let inside = |curve: &CurvePiece| {
                let (lo, hi) = curve.bounds();
                lo.abs().max(hi.abs()).max_element() <= MAX_COORDINATE
            };
            if cubic {
                self.curves.extend(CurvePiece::cubic(&segment(start), flip_normals).filter(inside));
            } else {
                let ends = [point(*start as usize), point(*start as usize + 1)];
                self.curves.extend(CurvePiece::linear(ends, flip_normals).filter(inside));
            }
            input.dropped += usize::from(self.curves.len() == before);
        }
        let record = PrimRecord { surface: input.surface, light: NONE, back: NONE };
        self.curve_prims.extend(std::iter::repeat_n(record, self.curves.len() - first));
        if input.uvs.is_some() {
            self.notices.push(format!(
                "shape at line {}: curves have no texture coordinates here; a texture is seen at its corner",
                input.shape.place.line
            ));
        }
        Ok(())
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
            lo.abs().max(hi.abs()).max_element() <= MAX_COORDINATE && has_area(cylinder.area())
        };
        let Some(cylinder) = Cylinder::new(base, axes, inward).filter(usable) else {
            input.dropped += 1;
            return;
        };
        let key = CoincidenceKey::tube(base, axes);
        let side = if inward { -Vec3::X } else { Vec3::X };
        let cells = self.cells;
        let light = || {
            let even = LightShape::Cylinder(CylinderLight::new(cylinder));
            input.light(cells, even, || EmittingSurface::Cylinder(cylinder))
        };
        if self.add_record(|g| &mut g.cylinder_prims, key, side, input, light) {
            self.cylinders.push(cylinder);
        }
    }
}
