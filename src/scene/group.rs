//! Groups: shapes that are described once and seen wherever an instance shows them.

use super::SceneDesc;
use super::desc::{Place, ShapeDesc, ShapeKind};

/// Index into [`SceneDesc::groups`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroupId(pub u32);

/// Shapes in a space of their own, Mitsuba's `shapegroup`: seen only through instances ([`ShapeKind::Instance`]).
#[derive(Clone, Debug)]
pub struct GroupDesc {
    /// `id` of the element, for messages.
    pub id: Option<String>,
    /// Where it stands in the file.
    pub place: Place,
    /// Its shapes, which neither emit nor are instances; `to_world` takes them to the space of the group.
    pub shapes: Vec<ShapeDesc>,
}

impl SceneDesc {
    /// The shapes whose surfaces are seen where `shape` stands: itself, or those of the group that it shows.
    pub fn parts<'a>(&'a self, shape: &'a ShapeDesc) -> &'a [ShapeDesc] {
        match shape.kind {
            ShapeKind::Instance(id) => self.groups.get(id.0 as usize).map_or(&[], |group| &group.shapes),
            _ => std::slice::from_ref(shape),
        }
    }

    /// Which of the groups any instance shows.
    pub fn shown(&self) -> Vec<bool> {
        let mut shown = vec![false; self.groups.len()];
        for shape in &self.shapes {
            if let ShapeKind::Instance(id) = shape.kind
                && let Some(group) = shown.get_mut(id.0 as usize)
            {
                *group = true;
            }
        }
        shown
    }

    /// Every shape that has a surface in the world, each once: those of the scene itself that are no instances, then those
    /// of the groups that are shown.
    pub fn surfaces(&self) -> impl Iterator<Item = &ShapeDesc> {
        let own = self.shapes.iter().filter(|s| !matches!(s.kind, ShapeKind::Instance(_)));
        let groups = self.groups.iter().zip(self.shown()).filter(|(_, shown)| *shown);
        own.chain(groups.flat_map(|(group, _)| &group.shapes))
    }
}
