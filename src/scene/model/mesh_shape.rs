//! Meshes of models as shapes at their places.

use glam::DAffine3;

use super::surface::EmittedRadiance;
use super::text::SceneText;

/// A mesh file with its material.
#[derive(Clone)]
pub(super) struct MeshShape {
    pub(super) file: String,
    pub(super) bsdf: String,
    /// Facets: it has no normals.
    pub(super) flat: bool,
    pub(super) emission: Option<EmittedRadiance>,
    /// The medium that it bounds.
    pub(super) interior: Option<String>,
}

impl MeshShape {
    /// Writes it at this place.
    pub(super) fn write(&self, text: &mut SceneText<'_>, to_world: &DAffine3) {
        self.write_side(text, to_world, false);
        // An area light shines from one side: the other is a shape of its own at the same place.
        if self.emission.as_ref().is_some_and(|emission| emission.both_sides) {
            self.write_side(text, to_world, true);
        }
    }

    fn write_side(&self, text: &mut SceneText<'_>, to_world: &DAffine3, back: bool) {
        text.shape("ply", &self.file, &self.bsdf, |text| {
            if *to_world != DAffine3::IDENTITY {
                text.transform("to_world", to_world);
            }
            if self.flat {
                text.value("boolean", "face_normals", true);
            }
            if back {
                text.value("boolean", "flip_normals", true);
            }
            if let Some(interior) = &self.interior {
                // The normals of the back point inwards.
                text.named_reference(if back { "exterior" } else { "interior" }, interior);
            }
            if let Some(emission) = &self.emission {
                text.object("emitter", "area", &[], |text| emission.write(text));
            }
        });
    }
}
