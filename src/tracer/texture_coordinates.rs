//! Texture coordinates of points on textured shapes, as Mitsuba defines them for each shape.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec2, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::texture::{AttributeLayout, SpectrumTexture, TexturePoint};
use crate::scene::desc::{AovKind, BsdfId, Mesh, MeshAttribute, ShapeDesc, ShapeKind};

use super::accel::Hit;

/// The texture coordinates of one shape.
#[derive(Debug)]
pub(super) enum TextureCoordinates {
    /// Nothing asks for them.
    Unused,
    /// Affine over each triangle: from the first primitive of the shape on, the coordinates of its first corner and the steps to the
    /// second and the third.
    Triangles {
        /// The first triangle of the shape.
        first: u32,
        /// Those of this triangle and of those that follow.
        of: Vec<[Vec2; 3]>,
        /// The attributes that the material asks for.
        attributes: Option<Box<ShapeAttributes>>,
    },
    /// Those within, and where a point lies.
    Placed(Box<TextureCoordinates>),
    /// (radius, angle / 2π) in the plane of a disk.
    Disk {
        /// World space to the disk's own.
        to_local: DMat3,
        /// Centre, world space.
        center: Vec3,
    },
    /// (azimuth / 2π, share of the length) on a cylinder.
    Cylinder {
        /// World space to that of the unit cylinder along z.
        to_local: DMat3,
        /// Centre of the first end, world space.
        base: DVec3,
    },
    /// (azimuth / 2π, angle from the pole / π) on a sphere.
    Sphere {
        /// World space to the sphere's own, for directions from the centre.
        to_local: DMat3,
        /// Centre, world space.
        center: Vec3,
    },
}

impl TextureCoordinates {
    /// These, and where a point lies, if the material of the shape asks for that.
    pub(super) fn placed(self, desc: &SceneDesc, bsdf: BsdfId) -> Self {
        if is_placed(desc, bsdf) { Self::Placed(Box::new(self)) } else { self }
    }

    /// The coordinates at `hit`, which is at `world` and in the space of the primitive at `p()`, and the attributes of the mesh.
    #[inline(always)]
    pub(super) fn at(&self, hit: &Hit, world: Vec3, p: impl FnOnce() -> Vec3) -> TexturePoint {
        let Self::Triangles { first, of, attributes } = self else { return self.of_others(hit, world, p()) };
        let i = hit.prim.checked_sub(*first).map_or(usize::MAX, |i| i as usize);
        let uv = of.get(i).map_or(Vec2::ZERO, |[uv, du, dv]| *uv + *du * hit.uv[0] + *dv * hit.uv[1]);
        let mut at = TexturePoint::from(uv);
        if let Some(attributes) = attributes {
            attributes.at(i, hit.uv, &mut at);
        }
        at
    }

    #[inline(never)]
    fn of_others(&self, hit: &Hit, world: Vec3, p: Vec3) -> TexturePoint {
        match self {
            Self::Placed(within) => TexturePoint { p: world, ..within.at(hit, world, || p) },
            _ => self.of_round(p).into(),
        }
    }

    #[inline(never)]
    fn of_round(&self, p: Vec3) -> Vec2 {
        let angle = |p: DVec3| {
            let phi = p.y.atan2(p.x) as f32;
            if phi < 0.0 { phi + TAU } else { phi }
        };
        match self {
            Self::Unused | Self::Placed(_) | Self::Triangles { .. } => Vec2::ZERO,
            Self::Disk { to_local, center } => {
                let p = *to_local * (p.as_dvec3() - center.as_dvec3());
                Vec2::new(p.truncate().length() as f32, angle(p) / TAU)
            }
            Self::Cylinder { to_local, base } => {
                let p = *to_local * (p.as_dvec3() - *base);
                Vec2::new(angle(p) / TAU, p.z as f32)
            }
            Self::Sphere { to_local, center } => {
                let d = (*to_local * (p.as_dvec3() - center.as_dvec3())).normalize_or_zero();
                Vec2::new(angle(d) / TAU, d.z.clamp(-1.0, 1.0).acos() as f32 * FRAC_1_PI)
            }
        }
    }
}

/// The attributes of a mesh that the material of a shape asks for.
#[derive(Debug)]
pub(super) struct ShapeAttributes {
    mesh: Arc<Mesh>,
    /// Indices of attributes of the mesh, and where their numbers go.
    asked: Vec<(usize, AttributeLayout)>,
    /// The triangles of the shape: indices of the vertices, in the order of their corners, and of the triangle in the mesh.
    triangles: Vec<([u32; 3], u32)>,
}

impl ShapeAttributes {
    /// Of a shape without triangles so far; `None` where its material asks for none.
    pub(super) fn new(desc: &SceneDesc, bsdf: BsdfId, mesh: &Arc<Mesh>) -> Option<Box<Self>> {
        let bsdfs = desc.made_of(bsdf);
        let textures = bsdfs.iter().flat_map(|bsdf| bsdf.textures()).flat_map(SpectrumTexture::attributes);
        let mut asked: Vec<(usize, AttributeLayout)> = Vec::new();
        for texture in textures {
            let index = mesh.attributes.iter().position(|attribute| attribute.name == *texture.name);
            let new = index.filter(|index| !asked.iter().any(|(known, _)| known == index));
            asked.extend(new.map(|index| (index, texture.layout)));
        }
        (!asked.is_empty()).then(|| Box::new(Self { mesh: mesh.clone(), asked, triangles: Vec::new() }))
    }

    /// Adds a triangle: its vertices in the order of its corners, and its index in the mesh.
    pub(super) fn push(&mut self, corners: [u32; 3], index: usize) {
        self.triangles.push((corners, index as u32));
    }

    /// The values at the point (b₁, b₂) of triangle `i` of the shape.
    fn at(&self, i: usize, [b1, b2]: [f32; 2], at: &mut TexturePoint) {
        let Some((corners, index)) = self.triangles.get(i) else { return };
        for (attribute, AttributeLayout { first, .. }) in &self.asked {
            let MeshAttribute { channels, values, .. } = &self.mesh.attributes[*attribute];
            let value = |row: u32, channel: usize| values.get(row as usize * channels + channel).copied();
            for (channel, out) in at.attributes.iter_mut().skip(*first).take(*channels).enumerate() {
                *out = if self.mesh.attributes[*attribute].is_of_faces() {
                    value(*index, channel).unwrap_or(0.0)
                } else {
                    let [a, b, c] = corners.map(|vertex| value(vertex, channel).unwrap_or(0.0));
                    a * (1.0 - b1 - b2) + b * b1 + c * b2
                };
            }
        }
    }
}

/// True if a material, or one that it is made of, has a texture or a map of normals or heights, or a layer beside the picture shows texture coordinates.
pub(super) fn is_textured(desc: &SceneDesc, id: BsdfId) -> bool {
    desc.integrator.aovs.iter().any(|aov| aov.kind == AovKind::Uv)
        || desc.made_of(id).iter().any(|bsdf| bsdf.is_textured() || bsdf.bump().is_some())
}

/// True if a material, or one that it is made of, has a texture that depends on where a surface lies.
pub(super) fn is_placed(desc: &SceneDesc, id: BsdfId) -> bool {
    desc.made_of(id).iter().any(|bsdf| bsdf.asks_place())
}

/// The coordinates of the triangles from `first` on, with the attributes that the material asks for.
pub(super) fn of_triangles(
    first: u32,
    of: Vec<[Vec2; 3]>,
    attributes: Option<Box<ShapeAttributes>>,
) -> TextureCoordinates {
    TextureCoordinates::Triangles { first, of, attributes }
}

/// The coordinates of a shape that is not made of triangles.
pub(super) fn of_shape(shape: &ShapeDesc) -> TextureCoordinates {
    let to_local = shape.to_world.matrix3.inverse();
    match shape.kind {
        ShapeKind::Disk => {
            TextureCoordinates::Disk { to_local, center: shape.to_world.translation.as_vec3() }
        }
        ShapeKind::Cylinder { p0, p1, radius } => {
            let (s, t) = (p1 - p0).normalize_or(DVec3::Z).any_orthonormal_pair();
            let axes = DMat3::from_cols(s * radius, t * radius, p1 - p0);
            let to_local = (shape.to_world.matrix3 * axes).inverse();
            TextureCoordinates::Cylinder { to_local, base: shape.to_world.transform_point3(p0) }
        }
        ShapeKind::Sphere { center, .. } => {
            TextureCoordinates::Sphere { to_local, center: shape.to_world.transform_point3(center).as_vec3() }
        }
        _ => TextureCoordinates::Unused,
    }
}

/// The coordinates of a triangle from those of its corners.
pub(super) fn of_corners([a, b, c]: [Vec2; 3]) -> [Vec2; 3] {
    [a, b - a, c - a]
}

/// The coordinates of a triangle of a mesh; barycentric where the mesh has none.
pub(super) fn of_triangle(mesh: &Mesh, triangle: [u32; 3]) -> [Vec2; 3] {
    match triangle.map(|i| mesh.uvs.get(i as usize).copied()) {
        [Some(a), Some(b), Some(c)] => of_corners([a, b, c]),
        _ => [Vec2::ZERO, Vec2::X, Vec2::Y],
    }
}

/// The coordinates of the corner `p`, of components ±1, of the cube's face whose normal is `sign` times the unit vector of `axis`.
pub(super) fn of_cube_corner(axis: usize, sign: f64, p: DVec3) -> Vec2 {
    let [u, v] = match (axis, sign > 0.0) {
        (0, true) => [p.y, -p.z],
        (0, false) => [p.y, p.z],
        (1, true) => [-p.x, -p.z],
        (1, false) => [p.z, p.x],
        (_, true) => [p.y, p.x],
        (_, false) => [-p.y, p.x],
    };
    Vec2::new((0.5 + 0.5 * u) as f32, (0.5 + 0.5 * v) as f32)
}
