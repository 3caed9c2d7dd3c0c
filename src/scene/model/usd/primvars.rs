//! Values on a mesh: which value each corner of each face has (`UsdGeomPrimvar`).

use super::prim::PrimReader;
use super::values::{self, Tuples};
use crate::scene::diagnostic::shorten;

/// How the values of a primvar lie on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// One for all.
    Constant,
    /// One for each face.
    Uniform,
    /// One for each point; `varying` is the same on polygons.
    Vertex,
    /// One for each corner of each face.
    FaceVarying,
}

/// Values with the number of that of each element.
#[derive(Clone, Debug)]
pub(super) struct Primvar {
    pub(super) values: Tuples,
    indices: Option<Vec<u32>>,
    pub(super) interpolation: Interpolation,
}

/// How many elements of each kind a mesh has.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementCounts {
    pub(super) faces: usize,
    pub(super) points: usize,
    pub(super) corners: usize,
}

/// A corner: its face, its point, and its number among all corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshCorner {
    pub(super) face: usize,
    pub(super) point: usize,
    pub(super) corner: usize,
}

impl Primvar {
    /// Reads the attribute `name`, of whose elements each has `width` numbers; one that does not fit the mesh is told and not used.
    pub(super) fn read(
        prim: &PrimReader,
        name: &str,
        width: std::ops::RangeInclusive<usize>,
        default: Interpolation,
        counts: ElementCounts,
    ) -> Option<Self> {
        let values = prim.tuples(name)?;
        if values.len() == 0 {
            return None;
        }
        let plain = shorten(name);
        if !width.contains(&values.width) {
            prim.fault(format!(
                "`{plain}` has not as many numbers for each element as it needs: it is not used"
            ));
            return None;
        }
        let word = prim.metadata(name, "interpolation").and_then(|value| values::word(&value));
        let interpolation = match word.as_deref() {
            None => default,
            Some("constant") => Interpolation::Constant,
            Some("uniform") => Interpolation::Uniform,
            Some("vertex" | "varying") => Interpolation::Vertex,
            Some("faceVarying") => Interpolation::FaceVarying,
            Some(other) => {
                prim.fault(format!(
                    "`{plain}` has the unknown interpolation `{}`: it is not used",
                    shorten(other)
                ));
                return None;
            }
        };
        let size = prim.metadata(name, "elementSize").as_ref().and_then(values::doubles);
        if size.is_some_and(|size| size != [1.0]) {
            prim.fault(format!("`{plain}` has several values for each element: it is not used"));
            return None;
        }
        let indices = prim.integers(&format!("{name}:indices"));
        let indices: Option<Option<Vec<u32>>> = indices.map(|all| {
            let known = |i: &i64| usize::try_from(*i).ok().filter(|i| *i < values.len()).map(|i| i as u32);
            all.iter().map(known).collect()
        });
        if matches!(indices, Some(None)) {
            prim.fault(format!("`{plain}:indices` names values that there are not: it is not used"));
            return None;
        }
        let indices = indices.flatten();
        let have = indices.as_ref().map_or(values.len(), Vec::len);
        let need = match interpolation {
            Interpolation::Constant => 1,
            Interpolation::Uniform => counts.faces,
            Interpolation::Vertex => counts.points,
            Interpolation::FaceVarying => counts.corners,
        };
        if have < need || (interpolation != Interpolation::Constant && have != need) {
            prim.fault(format!("`{plain}` has not a value for each element of its mesh: it is not used"));
            return None;
        }
        Some(Self { values, indices, interpolation })
    }

    /// The number of the value of a corner.
    pub(super) fn index(&self, at: MeshCorner) -> usize {
        let element = match self.interpolation {
            Interpolation::Constant => 0,
            Interpolation::Uniform => at.face,
            Interpolation::Vertex => at.point,
            Interpolation::FaceVarying => at.corner,
        };
        self.indices.as_ref().map_or(element, |all| all.get(element).map_or(0, |i| *i as usize))
    }
}

impl Primvar {
    /// Values that were made here, one for each element.
    pub(super) fn of(values: Tuples, interpolation: Interpolation) -> Self {
        Self { values, indices: None, interpolation }
    }
}

impl Primvar {
    /// One value for each of `count` points becomes one for each of the `times` points that are made of it.
    pub(super) fn repeat(&mut self, times: usize, count: usize) {
        if self.interpolation == Interpolation::Constant {
            return;
        }
        let element =
            |i: usize| self.indices.as_ref().map_or(i as u32, |all| all.get(i).copied().unwrap_or(0));
        self.indices = Some((0..count).flat_map(|i| std::iter::repeat_n(element(i), times)).collect());
        self.interpolation = Interpolation::Vertex;
    }
}
