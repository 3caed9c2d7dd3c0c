//! Groups of shapes in spaces of their own, and the instances that place them in the world.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{GroupDesc, ShapeKind};
use crate::tracer::accel::{Instance, PrimitiveGroup, TriangleSource};
use crate::tracer::placement::Placement;
use crate::tracer::tangents::Tangents;
use crate::tracer::texture_coordinates::TextureCoordinates;

use super::coincident::CoincidentSurfaces;
use super::error::PrepareError;
use super::geometry::{Geometry, MAX_COORDINATE, describe};

/// The groups and instances of a scene.
#[derive(Default)]
pub(super) struct PreparedGroups {
    pub(super) groups: Vec<PrimitiveGroup>,
    pub(super) instances: Vec<Instance>,
    /// By instance.
    pub(super) placements: Vec<Placement>,
}

impl Geometry {
    /// Adds the instances, and the shapes of all groups that have one. Call it after the shapes of the scene itself were added:
    /// the surfaces and primitives of groups come after theirs. Groups without an instance have surfaces only.
    pub(super) fn add_groups(&mut self, desc: &SceneDesc) -> Result<PreparedGroups, PrepareError> {
        let mut shown = PreparedGroups::default();
        // The largest coordinates of each group along each axis, `None` for an empty group.
        let mut reaches = Vec::with_capacity(desc.groups.len());
        for (group, is_shown) in desc.groups.iter().zip(desc.shown()) {
            check(group)?;
            let first = self.counts();
            if is_shown {
                // Only shapes in the same space can lie back to back.
                self.coincident = CoincidentSurfaces::default();
                group.shapes.iter().try_for_each(|shape| self.add(desc, shape))?;
            } else {
                self.shapes += group.shapes.len() as u32;
                self.tangents.extend(group.shapes.iter().map(|_| Tangents::Any));
                self.uvs.extend(group.shapes.iter().map(|_| TextureCoordinates::Unused));
            }
            let end = self.counts();
            let [triangles, disks, spheres, cylinders, curves] =
                [0, 1, 2, 3, 4].map(|kind| first[kind]..end[kind]);
            let prepared = PrimitiveGroup { triangles, disks, spheres, cylinders, curves };
            reaches.push((first != end).then(|| self.reach(&prepared)));
            shown.groups.push(prepared);
        }
        self.add_instances(desc, &reaches, &mut shown)?;
        Ok(shown)
    }

    fn add_instances(
        &mut self,
        desc: &SceneDesc,
        reaches: &[Option<Vec3>],
        shown: &mut PreparedGroups,
    ) -> Result<(), PrepareError> {
        for (i, shape) in desc.shapes.iter().enumerate() {
            let ShapeKind::Instance(id) = shape.kind else { continue };
            let unknown = PrepareError::UnknownGroup { id, place: shape.place };
            // An empty group: notices about its shapes say why.
            let Some(reach) = reaches.get(id.0 as usize).ok_or(unknown)? else { continue };
            let usable = |place: &Placement| {
                let m = place.to_world;
                let far = m.matrix3.abs() * reach.as_dvec3() + m.translation.abs();
                far.cmple(DVec3::splat(f64::from(MAX_COORDINATE))).all() && has_usable_scale(m)
            };
            if let Some(place) = Placement::new(shape.to_world, i as u32).filter(usable) {
                shown.instances.push(Instance { group: id.0, to_world: place.to_world });
                shown.placements.push(place);
            } else {
                self.notices.push(format!(
                    "{}: this instance has no inverse transform, one that scales beyond 1e10, or coordinates beyond 1e12 and was dropped",
                    describe(desc, shape)
                ));
            }
        }
        Ok(())
    }

    /// Numbers of triangles, disks, spheres, cylinders and curves so far.
    fn counts(&self) -> [u32; 5] {
        [self.faces.count(), self.disks.len(), self.spheres.len(), self.cylinders.len(), self.curves.len()]
            .map(|n| n as u32)
    }

    fn reach(&self, group: &PrimitiveGroup) -> Vec3 {
        let range = |r: &std::ops::Range<u32>| r.start as usize..r.end as usize;
        let corners = range(&group.triangles).flat_map(|id| self.faces.corners(id));
        let disks = self.disks[range(&group.disks)].iter().map(|d| d.bounds());
        let spheres = self.spheres[range(&group.spheres)].iter().map(|s| s.bounds());
        let cylinders = self.cylinders[range(&group.cylinders)].iter().map(|c| c.bounds());
        let curves = self.curves[range(&group.curves)].iter().map(|c| c.bounds());
        let round = disks.chain(spheres).chain(cylinders).chain(curves).flat_map(|(lo, hi)| [lo, hi]);
        corners.chain(round).fold(Vec3::ZERO, |reach, p| reach.max(p.abs()))
    }
}

/// True if rays that are transformed to the group's space are neither too short nor too far away for the traversal.
fn has_usable_scale(to_world: DAffine3) -> bool {
    let size = |m: DMat3| m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    size(to_world.matrix3) <= MAX_SCALE && size(to_world.matrix3.inverse()) <= MAX_SCALE
}

/// The largest scale of an instance, and of its inverse.
const MAX_SCALE: f64 = 1e10;

/// Refuses shapes that cannot be part of a group.
fn check(group: &GroupDesc) -> Result<(), PrepareError> {
    for shape in &group.shapes {
        let what = if matches!(shape.kind, ShapeKind::Instance(_)) {
            "it is an instance; put what it shows into the group"
        } else if shape.emission.is_some() {
            "it emits; make it a shape of the scene itself"
        } else {
            continue;
        };
        return Err(PrepareError::InGroup { place: shape.place, what });
    }
    Ok(())
}
