//! Which material a prim has: `material:binding` of it and of those above it (`UsdShadeMaterialBindingAPI`).

use std::rc::Rc;

use openusd::sdf::Path;
use openusd::usd::{Collection, MembershipQuery};

use super::prim::{PrimReader, guarded};
use super::values;

/// Purposes in the order in which they are asked: the material for pictures, that for all, that for previews.
const PURPOSES: [&str; 3] = ["full", "", "preview"];

/// A binding of a prim.
#[derive(Clone)]
struct MaterialBinding {
    purpose: &'static str,
    material: String,
    /// It counts for prims below it that have their own.
    stronger: bool,
    /// Only these prims have it.
    members: Option<Rc<MembershipQuery>>,
}

/// The bindings from the root to a prim.
#[derive(Clone, Default)]
pub(super) struct MaterialBindings(Rc<Vec<MaterialBinding>>);

impl MaterialBindings {
    /// Those of a prim below these.
    pub(super) fn with(&self, prim: &PrimReader) -> Self {
        let names: Vec<String> =
            prim.names().filter(|name| name.starts_with("material:binding")).map(str::to_owned).collect();
        let mut own = Vec::new();
        for name in &names {
            let targets = prim.targets(name);
            let rest = name.trim_start_matches("material:binding").trim_start_matches(':');
            let words: Vec<&str> = rest.split(':').filter(|word| !word.is_empty()).collect();
            let (purpose, collection) = match words.as_slice() {
                ["collection", purpose, _] => (*purpose, true),
                ["collection", _] => ("", true),
                [purpose] => (*purpose, false),
                [] => ("", false),
                _ => continue,
            };
            let Some(purpose) = PURPOSES.iter().find(|known| **known == purpose) else {
                prim.fault("a material for another purpose than `full` and `preview` is not used");
                continue;
            };
            let stronger = guarded(|| {
                prim.prim
                    .stage()
                    .attribute(prim.prim.relationship(name.as_str()).path().clone())
                    .get_metadata("bindMaterialAs")
            });
            let stronger = stronger.ok().flatten().and_then(|value| values::word(&value));
            let stronger = stronger.as_deref() == Some("strongerThanDescendants");
            let material = |path: &Path| path.as_str().to_owned();
            match (collection, targets.as_slice()) {
                (false, [path, ..]) => {
                    own.push(MaterialBinding { purpose, material: material(path), stronger, members: None });
                }
                (true, [members, path]) => {
                    let query = collection_of(members)
                        .map(|collection| guarded(|| collection.compute_membership_query(prim.prim.stage())));
                    match query {
                        Some(Ok(query)) => {
                            let members = Some(Rc::new(query));
                            own.push(MaterialBinding {
                                purpose,
                                material: material(path),
                                stronger,
                                members,
                            });
                        }
                        _ => prim.fault("a material is bound to a collection that cannot be read"),
                    }
                }
                (true, _) => prim.fault("a material is bound to no collection"),
                (false, []) => {}
            }
        }
        if own.is_empty() {
            return self.clone();
        }
        // At one prim a collection counts before a binding of its own; the last of the list is asked first.
        own.sort_by_key(|binding| binding.members.is_some());
        Self(Rc::new(self.0.iter().cloned().chain(own).collect()))
    }

    /// The path of the material of the prim at `path`.
    pub(super) fn material(&self, path: &Path) -> Option<&str> {
        let fits = |binding: &&MaterialBinding| {
            binding.members.as_ref().is_none_or(|members| members.is_path_included(path))
        };
        for purpose in PURPOSES {
            let mut winner = None;
            for binding in self.0.iter().rev().filter(|binding| binding.purpose == purpose).filter(fits) {
                if winner.is_none() || binding.stronger {
                    winner = Some(binding.material.as_str());
                }
            }
            if winner.is_some() {
                return winner;
            }
        }
        None
    }

    /// A key that is the same for equal lists only.
    pub(super) fn key(&self) -> String {
        let names: Vec<&str> = self.0.iter().map(|binding| binding.material.as_str()).collect();
        names.join(" ")
    }
}

/// The collection that a path like `/prim.collection:name` names.
fn collection_of(path: &Path) -> Option<Collection> {
    let (prim, name) = path.split_property()?;
    Some(Collection::new(prim, name.strip_prefix("collection:")?))
}
