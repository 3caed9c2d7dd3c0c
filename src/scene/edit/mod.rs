//! Changes made to a scene after it was read: what can be changed of an object, applying it, saving it.
//!
//! ```text
//! SceneDesc as read ─ editable ─▶ Editable { label, target, value } ─ the panel ─▶ Edits::set
//!        └──────────── Edits::apply ─▶ SceneDesc as edited ─ tracer::Scene::edited ─▶ Scene
//! Edits::write ─▶ XML: <sensor> <include> <edit>… ─ scene::load ─▶ the same SceneDesc
//! ```
//!
//! Edits are always applied to the description as it was read, so that nothing drifts and undoing is removing.
//! What there is to edit is one table, [`target::PARAMETERS`]: a [`Target`] is one variant and one line of it. No material
//! of this program is rough yet; roughness will be such a line.

mod apply;
pub(crate) mod objects;
mod save;
mod sensor;
pub(crate) mod target;

pub use apply::Edits;
pub use objects::{Editable, editable, light_name, lights, shape_name};
pub use save::SaveError;
pub use target::{EditError, NewValue, Target};
