//! Places the shapes, lights and cameras that prims show, alone or in instances.

use std::cell::RefCell;
use std::rc::Rc;

use glam::DAffine3;

use super::assets::StageAssets;
use super::camera::StageCamera;
use super::lights::StageLight;
use super::textures::StagePictures;
use crate::scene::model::mesh_shape::MeshShape;
use crate::scene::model::text::SceneText;

/// Items of a stage after all instances are followed; instances in instances can be many from a few bytes.
const ITEMS: usize = 1 << 22;

/// A shape, light or camera that a prim shows.
#[derive(Clone)]
pub(super) enum StageItem {
    Mesh(Rc<MeshShape>),
    /// A file of curves: its plugin, its name, and its bsdf.
    Curves(Rc<[String; 3]>),
    Light(Rc<StageLight>),
    Camera(Rc<StageCamera>),
    Prototype(Rc<StagePrototype>),
}

/// An item with its transform to what it is in.
#[derive(Clone)]
pub(super) struct PlacedItem {
    pub(super) item: StageItem,
    pub(super) to_root: DAffine3,
}

/// Items that are shown at several places.
pub(super) struct StagePrototype {
    pub(super) name: String,
    pub(super) items: Vec<PlacedItem>,
    /// The id of its shape group, as soon as it is written.
    group: RefCell<Option<String>>,
}

impl StagePrototype {
    pub(super) fn new(name: &str, items: Vec<PlacedItem>) -> Self {
        Self { name: name.to_owned(), items, group: RefCell::default() }
    }
}

/// Whether a transform shows anything.
fn is_usable(to_world: &DAffine3) -> bool {
    to_world.is_finite() && to_world.matrix3.determinant().is_normal()
}

/// Writes items; counts them.
pub(super) struct ItemWriter<'a, 't> {
    pub(super) text: &'a mut SceneText<'t>,
    pub(super) pictures: &'a mut StagePictures,
    pub(super) assets: &'a StageAssets,
    items: usize,
    /// Shapes that were written.
    pub(super) shapes: usize,
    /// Items that are scaled to nothing.
    pub(super) flat: usize,
}

impl<'a, 't> ItemWriter<'a, 't> {
    pub(super) fn new(
        text: &'a mut SceneText<'t>,
        pictures: &'a mut StagePictures,
        assets: &'a StageAssets,
    ) -> Self {
        Self { text, pictures, assets, items: 0, shapes: 0, flat: 0 }
    }

    fn count(&mut self) -> Result<(), String> {
        self.items += 1;
        match self.items > ITEMS {
            true => Err(format!("its instances show more than {ITEMS} things")),
            false => Ok(()),
        }
    }

    /// Writes an item at its place in the world.
    pub(super) fn write(&mut self, item: &StageItem, to_world: &DAffine3) -> Result<(), String> {
        self.count()?;
        if !is_usable(to_world) {
            self.flat += 1;
            return Ok(());
        }
        match item {
            StageItem::Prototype(prototype) => return self.instance(prototype, to_world),
            StageItem::Light(light) => light.write(self.text, to_world, self.pictures, self.assets),
            StageItem::Camera(camera) => camera.write(self.text, to_world),
            shape => self.shape(shape, to_world),
        }
        Ok(())
    }

    fn shape(&mut self, item: &StageItem, to_world: &DAffine3) {
        self.shapes += 1;
        match item {
            StageItem::Mesh(mesh) => {
                self.text.lit |= mesh.emission.is_some();
                mesh.write(self.text, to_world);
            }
            StageItem::Curves(file) => {
                let [plugin, file, bsdf] = file.as_ref();
                self.text.shape(plugin, file, bsdf, |text| {
                    if *to_world != DAffine3::IDENTITY {
                        text.transform("to_world", to_world);
                    }
                });
            }
            _ => {}
        }
    }

    /// Writes an instance: shapes by a group; lights, cameras and what shines alone, since groups hold none of these.
    fn instance(&mut self, prototype: &Rc<StagePrototype>, to_world: &DAffine3) -> Result<(), String> {
        let known = prototype.group.borrow().clone();
        let id = match known {
            Some(id) => id,
            None => {
                let id = self.group(prototype)?;
                *prototype.group.borrow_mut() = Some(id.clone());
                id
            }
        };
        if !id.is_empty() {
            self.shapes += 1;
            self.text.object("shape", "instance", &[], |text| {
                text.transform("to_world", to_world);
                text.reference(&id);
            });
        }
        self.alone(prototype, to_world)
    }

    /// Writes what of a prototype is in no group.
    fn alone(&mut self, prototype: &StagePrototype, to_world: &DAffine3) -> Result<(), String> {
        for PlacedItem { item, to_root } in &prototype.items {
            self.count()?;
            let placed = *to_world * *to_root;
            match item {
                StageItem::Prototype(inner) => self.alone(inner, &placed)?,
                item if !is_grouped(item) => self.write(item, &placed)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Writes the group of a prototype; its id, empty where it has nothing for a group.
    fn group(&mut self, prototype: &StagePrototype) -> Result<String, String> {
        let mut parts = Vec::new();
        self.gather(prototype, &DAffine3::IDENTITY, &mut parts)?;
        if parts.is_empty() {
            return Ok(String::new());
        }
        let id = self.text.id(&prototype.name);
        // `object` takes a closure of the text alone.
        self.text.object("shape", "shapegroup", &[("id", &id)], |text| {
            let mut inner = ItemWriter::new(text, self.pictures, self.assets);
            parts.iter().for_each(|PlacedItem { item, to_root }| inner.shape(item, to_root));
        });
        Ok(id)
    }

    /// The items of a prototype and of those in it that belong to a group.
    fn gather(
        &mut self,
        prototype: &StagePrototype,
        to_root: &DAffine3,
        parts: &mut Vec<PlacedItem>,
    ) -> Result<(), String> {
        for placed in &prototype.items {
            self.count()?;
            let at = *to_root * placed.to_root;
            match &placed.item {
                StageItem::Prototype(inner) => self.gather(inner, &at, parts)?,
                item if is_grouped(item) && is_usable(&at) => {
                    parts.push(PlacedItem { item: item.clone(), to_root: at });
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Whether a group can hold an item.
fn is_grouped(item: &StageItem) -> bool {
    match item {
        StageItem::Mesh(mesh) => mesh.emission.is_none(),
        StageItem::Curves(_) => true,
        _ => false,
    }
}
