//! Two meshes to measure rays on, made by code: the same triangles on every machine, and no file to fetch.
//!
//! [`spheres`] is a small room that fits a cache; [`bigmesh`] a landscape that does not: ground, rocks, trees, grass and a
//! ruined temple under an open sky, triangles from millimetres to metres side by side as in real scenes.

mod landscape;
pub mod noise;
mod plants;
mod rocks;
mod room;
mod ruin;
mod terrain;

use glam::Vec3;

pub use landscape::bigmesh;
pub use room::spheres;

/// Triangles of one material.
pub struct Part {
    /// Name, as in file names.
    pub name: &'static str,
    /// Linear sRGB reflectance.
    pub colour: [f32; 3],
    /// True when normals go smoothly from face to face.
    pub smooth: bool,
    /// Corners, metres, y up.
    pub vertices: Vec<Vec3>,
    /// Three corners each, counter-clockwise from outside.
    pub faces: Vec<[u32; 3]>,
}

impl Part {
    /// A part without triangles.
    pub fn new(name: &'static str, colour: [f32; 3], smooth: bool) -> Self {
        Self { name, colour, smooth, vertices: Vec::new(), faces: Vec::new() }
    }

    /// Adds a mesh.
    pub fn add(&mut self, vertices: impl IntoIterator<Item = Vec3>, faces: &[[u32; 3]]) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.faces.extend(faces.iter().map(|f| f.map(|v| v + first)));
    }

    /// Adds a triangle of its own.
    pub fn triangle(&mut self, corners: [Vec3; 3]) {
        self.add(corners, &[[0, 1, 2]]);
    }

    /// Adds a quadrilateral of its own, corners in a round.
    pub fn quad(&mut self, corners: [Vec3; 4]) {
        self.add(corners, &[[0, 1, 2], [0, 2, 3]]);
    }

    /// Adds a block: its centre and three half edges.
    pub fn block(&mut self, centre: Vec3, [x, y, z]: [Vec3; 3]) {
        let corner = |i: u32| {
            let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            centre + x * sign(0) + y * sign(1) + z * sign(2)
        };
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            self.quad([a, b, c, d].map(corner));
        }
    }
}

/// A rectangle that shines to one side.
pub struct Light {
    /// Centre.
    pub centre: Vec3,
    /// Half edges; their cross product points where it shines.
    pub half: [Vec3; 2],
    /// Radiance, linear sRGB.
    pub radiance: [f32; 3],
}

/// A pinhole camera.
pub struct Camera {
    /// Eye.
    pub origin: Vec3,
    /// The point in the middle of the picture.
    pub target: Vec3,
    /// Angle of view of the square picture, degrees.
    pub fov: f32,
}

/// A mesh with what is needed to look at it.
pub struct Model {
    /// Name, as in file names.
    pub name: &'static str,
    /// What it is made of, the light not among it.
    pub parts: Vec<Part>,
    /// The one light.
    pub light: Light,
    /// Radiance of the sky all around, linear sRGB.
    pub sky: [f32; 3],
    /// Where it is seen from.
    pub camera: Camera,
}

impl Model {
    /// All as one list of corners and one of triangles; the last two triangles are the light.
    pub fn merged(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut all = Part::new("all", [0.0; 3], false);
        self.parts.iter().for_each(|p| all.add(p.vertices.iter().copied(), &p.faces));
        let Light { centre, half: [u, v], .. } = self.light;
        all.quad([centre - u - v, centre + u - v, centre + u + v, centre - u + v]);
        (all.vertices, all.faces)
    }
}
