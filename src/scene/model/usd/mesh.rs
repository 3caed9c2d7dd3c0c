//! Meshes: polygons with their values as mesh files, one for each material.

use std::collections::HashMap;

use glam::{Mat3, Vec3};

use super::polygons::PolygonCutter;
use super::prim::PrimReader;
use super::primvars::{ElementCounts, Interpolation, MeshCorner, Primvar};
use super::skel::PosedMesh;
use super::values::Tuples;
use crate::scene::limits;
use crate::scene::model::text::{PlyVertices, ply_with_opacities};

/// Attributes that shape the smooth surface of a cage.
const OF_SUBDIVISION: &[&str] = &[
    "interpolateBoundary",
    "faceVaryingLinearInterpolation",
    "triangleSubdivisionRule",
    "cornerIndices",
    "cornerSharpnesses",
    "creaseIndices",
    "creaseLengths",
    "creaseSharpnesses",
];

/// Polygons with their points.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygons {
    pub(super) points: Vec<Vec3>,
    /// Corners of each face.
    pub(super) counts: Vec<u32>,
    /// The point of each corner.
    pub(super) corners: Vec<u32>,
    /// Faces that are not shown.
    pub(super) holes: Vec<bool>,
    /// Faces go around with the clock.
    pub(super) left_handed: bool,
    /// Neither normals nor a smooth surface: facets.
    pub(super) flat: bool,
    /// Has normals of its own, so that none are made.
    pub(super) normals: Option<Primvar>,
}

/// The values of the corners of a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshValues {
    pub(super) uvs: Option<Primvar>,
    pub(super) colors: Option<Primvar>,
    pub(super) opacities: Option<Primvar>,
}

impl Polygons {
    /// Reads a `Mesh`, in its pose if it has one; nothing where it has no faces.
    pub(super) fn read(prim: &PrimReader, posed: Option<PosedMesh>) -> Option<Self> {
        let points = prim.tuples("points").filter(|points| points.width == 3);
        let at_rest = points.unwrap_or_default().all::<3>();
        let (points, turns) = match posed {
            Some(posed) => (posed.points, Some(posed.turns)),
            None => (at_rest.iter().map(|p| Vec3::from(*p)).collect(), None),
        };
        let counts = prim.integers("faceVertexCounts").unwrap_or_default();
        let indices = prim.integers("faceVertexIndices").unwrap_or_default();
        let scheme = prim.word("subdivisionScheme").unwrap_or_else(|| "catmullClark".to_owned());
        let left_handed = prim.word("orientation").is_some_and(|word| word == "leftHanded");
        let holes = prim.integers("holeIndices").unwrap_or_default();
        OF_SUBDIVISION.iter().for_each(|name| prim.used(name));
        if counts.len() > limits::MESH_TRIANGLES || points.len() > limits::MESH_VERTICES {
            prim.fault("a mesh has more faces or points than can be read: it is left out");
            return None;
        }
        let mut mesh = Self { points, left_handed, ..Self::default() };
        let (mut at, mut broken) = (0_usize, 0);
        for count in counts {
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            let Some(face) = at.checked_add(count).and_then(|end| indices.get(at..end)) else {
                prim.fault("the faces of a mesh have more corners than are listed: the others are left out");
                break;
            };
            at += count;
            let usable = face.iter().all(|i| usize::try_from(*i).is_ok_and(|i| i < mesh.points.len()));
            broken += usize::from(!usable);
            mesh.counts.push(count as u32);
            mesh.holes.push(!usable);
            mesh.corners.extend(face.iter().map(|i| if usable { *i as u32 } else { 0 }));
        }
        if broken > 0 {
            prim.fault("faces that name points that there are not are left out");
        }
        for hole in holes {
            if let Some(hidden) = usize::try_from(hole).ok().and_then(|i| mesh.holes.get_mut(i)) {
                *hidden = true;
            }
        }
        if mesh.counts.is_empty() || mesh.points.is_empty() {
            prim.fault("a mesh without faces is left out");
            return None;
        }
        let elements = mesh.elements();
        let mut normals = None;
        for name in ["primvars:normals", "normals"] {
            let read = Primvar::read(prim, name, 3..=3, Interpolation::Vertex, elements);
            normals = normals.or(read);
        }
        if let (Some(primvar), Some(turns)) = (&normals, turns) {
            normals = Some(mesh.turned(primvar, &turns));
        }
        if scheme != "none" {
            prim.fault("a subdivision surface is shown as its control mesh with smooth normals");
            normals = normals.or_else(|| Some(mesh.smooth_normals()));
        }
        mesh.flat = normals.is_none();
        mesh.normals = normals;
        Some(mesh)
    }

    /// The numbers of elements.
    pub(super) fn elements(&self) -> ElementCounts {
        ElementCounts { faces: self.counts.len(), points: self.points.len(), corners: self.corners.len() }
    }

    /// Normals as the pose turns them, one for each corner.
    fn turned(&self, normals: &Primvar, turns: &[Mat3]) -> Primvar {
        let (mut values, mut corner) = (Vec::with_capacity(3 * self.corners.len()), 0);
        for (face, count) in self.counts.iter().enumerate() {
            for _ in 0..*count {
                let point = self.corners[corner] as usize;
                let normal =
                    normals.values.get(normals.index(MeshCorner { face, point, corner })).unwrap_or_default();
                let turn = turns.get(point).copied().unwrap_or(Mat3::IDENTITY);
                values.extend((turn * Vec3::from(normal)).normalize_or(Vec3::Y).to_array());
                corner += 1;
            }
        }
        Primvar::of(Tuples::new(3, values), Interpolation::FaceVarying)
    }

    /// Normals of the points: those of the faces by their areas.
    fn smooth_normals(&self) -> Primvar {
        let mut sums = vec![Vec3::ZERO; self.points.len()];
        let mut at = 0;
        for count in &self.counts {
            let face = &self.corners[at..at + *count as usize];
            at += *count as usize;
            let Some(first) = face.first().map(|i| self.points[*i as usize]) else { continue };
            let normal: Vec3 = face
                .windows(2)
                .map(|pair| {
                    (self.points[pair[0] as usize] - first).cross(self.points[pair[1] as usize] - first)
                })
                .sum();
            let normal = if self.left_handed { -normal } else { normal };
            face.iter().for_each(|i| sums[*i as usize] += normal);
        }
        let values = sums.iter().flat_map(|n| n.normalize_or(Vec3::Y).to_array()).collect();
        Primvar::of(Tuples::new(3, values), Interpolation::Vertex)
    }

    /// The faces of `chosen` as a PLY file, or nothing where none is a surface. The second is the number of concave polygons that
    /// were cut as if they were convex.
    pub(super) fn ply(
        &self,
        values: &MeshValues,
        chosen: &dyn Fn(usize) -> bool,
    ) -> (Option<Vec<u8>>, usize) {
        let mut builder = PlyBuilder::new(self, values);
        let mut cutter = PolygonCutter::new();
        let (mut at, mut cut, mut polygon) = (0, Vec::new(), Vec::new());
        for (face, count) in self.counts.iter().enumerate() {
            let first = at;
            at += *count as usize;
            if self.holes.get(face).copied().unwrap_or(false) || !chosen(face) {
                continue;
            }
            polygon.clear();
            polygon.extend(self.corners[first..at].iter().map(|i| self.points[*i as usize]));
            cut.clear();
            cutter.cut(&polygon, &mut cut);
            for triangle in &cut {
                let [a, b, c] = triangle.map(|i| polygon[i as usize]);
                if a == b || b == c || c == a {
                    continue;
                }
                let [a, b, c] = triangle.map(|i| {
                    let corner = first + i as usize;
                    builder.vertex(MeshCorner { face, point: self.corners[corner] as usize, corner })
                });
                builder.triangles.push(if self.left_handed { [a, c, b] } else { [a, b, c] });
            }
        }
        (builder.finish(), cutter.uncut)
    }
}

/// Gathers the vertices of a mesh file.
struct PlyBuilder<'a> {
    mesh: &'a Polygons,
    values: &'a MeshValues,
    /// Vertices by their point, where all else follows from it.
    of_points: Option<Vec<u32>>,
    /// Otherwise by their point and the numbers of their values.
    known: HashMap<[u32; 5], u32>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 3]>,
    opacities: Vec<f32>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> PlyBuilder<'a> {
    fn new(mesh: &'a Polygons, values: &'a MeshValues) -> Self {
        let all = [&mesh.normals, &values.uvs, &values.colors, &values.opacities];
        let by_point = all
            .iter()
            .filter_map(|primvar| primvar.as_ref())
            .all(|primvar| matches!(primvar.interpolation, Interpolation::Vertex | Interpolation::Constant));
        Self {
            mesh,
            values,
            of_points: by_point.then(|| vec![u32::MAX; mesh.points.len()]),
            known: HashMap::new(),
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            opacities: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// The number of the vertex of a corner.
    fn vertex(&mut self, at: MeshCorner) -> u32 {
        let next = self.positions.len() as u32;
        let index = |primvar: &Option<Primvar>| primvar.as_ref().map_or(0, |primvar| primvar.index(at));
        let MeshValues { uvs, colors, opacities } = self.values;
        let [normal, uv, color, opacity] =
            [index(&self.mesh.normals), index(uvs), index(colors), index(opacities)];
        match &mut self.of_points {
            Some(vertices) => match &mut vertices[at.point] {
                known if *known != u32::MAX => return *known,
                new => *new = next,
            },
            None => {
                let key = [at.point, normal, uv, color, opacity].map(|i| i as u32);
                let known = *self.known.entry(key).or_insert(next);
                if known != next {
                    return known;
                }
            }
        }
        self.positions.push(self.mesh.points[at.point].to_array());
        let get = |primvar: &Option<Primvar>, i: usize| primvar.as_ref().and_then(|p| p.values.get::<3>(i));
        if self.mesh.normals.is_some() {
            let normal = Vec3::from(get(&self.mesh.normals, normal).unwrap_or_default());
            self.normals.push(normal.normalize_or(Vec3::Y).to_array());
        }
        if uvs.is_some() {
            let [u, v, _] = get(uvs, uv).unwrap_or_default();
            // Pictures have v downwards here.
            self.uvs.push([u, 1.0 - v]);
        }
        if colors.is_some() {
            self.colors.push(get(colors, color).unwrap_or_default().map(|v| v.max(0.0)));
        }
        if opacities.is_some() {
            self.opacities.push(get(opacities, opacity).unwrap_or_default()[0].clamp(0.0, 1.0));
        }
        next
    }

    fn finish(self) -> Option<Vec<u8>> {
        if self.triangles.is_empty() {
            return None;
        }
        let vertices = PlyVertices {
            positions: &self.positions,
            normals: &self.normals,
            uvs: &self.uvs,
            colors: &self.colors,
        };
        Some(ply_with_opacities(&vertices, &self.opacities, &self.triangles))
    }
}
