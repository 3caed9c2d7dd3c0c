//! Walks the prims of a stage: what each shows, with what it inherits.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::{DAffine3, DQuat, DVec3};
use openusd::sdf::{Path, Specifier};
use openusd::usd::{Prim, Stage};

use super::assets::StageAssets;
use super::bindings::MaterialBindings;
use super::camera::StageCamera;
use super::lights::{self, EmittedLight, StageLight};
use super::materials::{MaterialNeeds, MeshGives, StageMaterials, WrittenMaterial};
use super::mesh::{MeshValues, Polygons};
use super::place::{ItemWriter, PlacedItem, StageItem, StagePrototype};
use super::prim::{PrimReader, guarded, leads_up};
use super::primvars::{ElementCounts, Interpolation, Primvar};
use super::skel::Skeletons;
use super::{solids, strands, transform};
use crate::scene::diagnostic::shorten;
use crate::scene::limits;
use crate::scene::model::mesh_shape::MeshShape;
use crate::scene::model::surface::{EmittedRadiance, MaterialValue};
use crate::scene::model::text::SceneText;

/// Prims within prims.
const DEPTH: usize = 512;

/// Prims that any stage may have, and the bytes of its layers beyond which it may have one more for each: references can make many
/// of a few, and each that is below ten others takes 50 kB.
const PRIMS_FREE: u64 = 1 << 11;
const BYTES_FREE: u64 = 16 << 10;

/// Bytes of numbers that may be made for each byte of the layers, and beyond.
const INFLATION: u64 = 40;
const INFLATED_FREE: u64 = 16 << 20;

/// Types that show nothing themselves, or are read with what uses them.
const QUIET: &[&str] = &[
    "",
    "Xform",
    "Scope",
    "Material",
    "Shader",
    "NodeGraph",
    "GeomSubset",
    "SkelRoot",
    "Skeleton",
    "SkelAnimation",
    "BlendShape",
];

/// The properties that a prim inherits from its ancestors.
#[derive(Clone, Default)]
struct Inherited {
    to_root: DAffine3,
    /// From the stage to this place: where `!resetXformStack!` leads to.
    top: DAffine3,
    purpose: Option<String>,
    bindings: MaterialBindings,
    depth: usize,
}

/// A walk through a stage.
pub(super) struct StageWalker<'a, 't> {
    stage: Stage,
    assets: Rc<StageAssets>,
    text: &'a mut SceneText<'t>,
    materials: StageMaterials,
    skeletons: Skeletons,
    /// Prototypes by their path and what they inherit.
    prototypes: BTreeMap<String, Rc<StagePrototype>>,
    /// Mesh files by their bytes.
    files: BTreeMap<[u8; 32], String>,
    /// Solids without values of their own: their file and whether they are facets.
    solids: BTreeMap<String, (String, bool)>,
    prims: u64,
    spent: u64,
}

impl<'a, 't> StageWalker<'a, 't> {
    pub(super) fn new(stage: &Stage, assets: Rc<StageAssets>, text: &'a mut SceneText<'t>) -> Self {
        Self {
            stage: stage.clone(),
            assets,
            text,
            materials: StageMaterials::new(stage),
            skeletons: Skeletons::new(stage),
            prototypes: BTreeMap::new(),
            files: BTreeMap::new(),
            solids: BTreeMap::new(),
            prims: 0,
            spent: 0,
        }
    }

    /// Writes all that the stage shows; the number of shapes.
    pub(super) fn stage(&mut self, to_world: &DAffine3) -> Result<usize, String> {
        let mut items = Vec::new();
        let roots = guarded(|| self.stage.root_prims())?;
        let inherited = Inherited { to_root: *to_world, top: *to_world, ..Inherited::default() };
        for name in roots {
            let Ok(path) = Path::abs_root().append_path(name.as_str()) else { continue };
            self.visit(self.stage.prim(path), &inherited, &mut items)?;
        }
        let mut writer = ItemWriter::new(self.text, &mut self.materials.pictures, &self.assets);
        for PlacedItem { item, to_root } in &items {
            writer.write(item, to_root)?;
        }
        let (shapes, flat) = (writer.shapes, writer.flat);
        if flat > 0 {
            self.text.note(format!("{flat} prims are scaled to nothing, or by no number: they are left out"));
        }
        Ok(shapes)
    }

    /// Takes part of the memory that layers of this size may need.
    fn spend(&mut self, bytes: usize) -> Result<(), String> {
        self.spent += bytes as u64;
        match self.spent > INFLATED_FREE + INFLATION * self.assets.bytes_read() {
            true => {
                Err("its meshes are far larger than its files: it names the same data too often".to_owned())
            }
            false => Ok(()),
        }
    }

    /// Gathers what a prim and those below it show.
    fn visit(&mut self, prim: Prim, above: &Inherited, items: &mut Vec<PlacedItem>) -> Result<(), String> {
        self.prims += 1;
        if self.prims > PRIMS_FREE + self.assets.bytes_read().saturating_sub(BYTES_FREE) {
            return Err(
                "it has far more prims than its files are long: references make too many of a few".to_owned()
            );
        }
        let place = prim.path().as_str().to_owned();
        if !leads_up(prim.path()) {
            self.text.tell("a prim whose name is no name is left out", &place);
            return Ok(());
        }
        if above.depth > DEPTH {
            self.text.tell(format!("prims more than {DEPTH} levels deep are left out"), &place);
            return Ok(());
        }
        // Classes and overs of nothing show nothing by themselves.
        let specifier = guarded(|| prim.specifier()).ok().flatten();
        let active = guarded(|| prim.is_active()).unwrap_or(false);
        if !active || !matches!(specifier, Some(Specifier::Def)) {
            return Ok(());
        }
        if guarded(|| prim.has_clips()).unwrap_or(false) {
            self.text.tell("value clips are not played", &place);
        }
        let reader = PrimReader::new(prim);
        if reader.word("visibility").is_some_and(|word| word == "invisible") {
            return Ok(());
        }
        let (local, resets) = transform::local(&reader);
        let outer = if resets { above.top } else { above.to_root };
        let mut inherited = Inherited { to_root: outer * local, depth: above.depth + 1, ..above.clone() };
        if let Some(purpose) = reader.word("purpose") {
            inherited.purpose = Some(purpose);
        }
        inherited.bindings = above.bindings.with(&reader);
        if guarded(|| reader.prim.is_instance()).unwrap_or(false)
            && let Ok(Some(prototype)) = guarded(|| reader.prim.prototype())
        {
            let item = self.instance(&reader, prototype.as_str(), &inherited)?;
            items.push(PlacedItem { item, to_root: inherited.to_root });
            reader.finish(self.text);
            return Ok(());
        }
        if reader.kind == "PointInstancer" {
            self.point_instancer(&reader, &inherited, items)?;
            reader.finish(self.text);
            return Ok(());
        }
        let shown = inherited.purpose.as_deref().is_none_or(|p| p != "proxy" && p != "guide");
        if shown {
            self.show(&reader, &inherited, items)?;
        }
        let children = guarded(|| reader.prim.children());
        if shown {
            reader.finish(self.text);
        }
        for child in children? {
            self.visit(child, &inherited, items)?;
        }
        Ok(())
    }

    /// The prototype of an instance, read at the first of them.
    fn instance(
        &mut self,
        prim: &PrimReader,
        path: &str,
        inherited: &Inherited,
    ) -> Result<StageItem, String> {
        let purpose = inherited.purpose.as_deref().unwrap_or("");
        let key = format!("{path} {purpose} {}", inherited.bindings.key());
        if let Some(known) = self.prototypes.get(&key) {
            return Ok(StageItem::Prototype(Rc::clone(known)));
        }
        let inner = Inherited { to_root: DAffine3::IDENTITY, top: DAffine3::IDENTITY, ..inherited.clone() };
        let mut items = Vec::new();
        if !["", "Xform", "Scope"].contains(&prim.kind.as_str()) {
            self.show(prim, &inner, &mut items)?;
        }
        for child in guarded(|| prim.prim.children())? {
            self.visit(child, &inner, &mut items)?;
        }
        let prototype = Rc::new(StagePrototype::new(prim.name(), items));
        self.prototypes.insert(key, Rc::clone(&prototype));
        Ok(StageItem::Prototype(prototype))
    }

    /// Gathers the instances of a `PointInstancer`.
    fn point_instancer(
        &mut self,
        prim: &PrimReader,
        inherited: &Inherited,
        items: &mut Vec<PlacedItem>,
    ) -> Result<(), String> {
        if inherited.purpose.as_deref().is_some_and(|p| p == "proxy" || p == "guide") {
            return Ok(());
        }
        let mut prototypes = Vec::new();
        for path in prim.targets("prototypes") {
            let purpose = inherited.purpose.as_deref().unwrap_or("");
            let key = format!("{path} as point {purpose} {}", inherited.bindings.key());
            let known = self.prototypes.get(&key).cloned();
            let prototype = match known {
                Some(known) => known,
                None => {
                    let inner = Inherited {
                        to_root: DAffine3::IDENTITY,
                        top: DAffine3::IDENTITY,
                        ..inherited.clone()
                    };
                    let mut parts = Vec::new();
                    self.visit(self.stage.prim(path.clone()), &inner, &mut parts)?;
                    let name = path.as_str().rsplit('/').next().unwrap_or_default();
                    let new = Rc::new(StagePrototype::new(name, parts));
                    self.prototypes.insert(key, Rc::clone(&new));
                    new
                }
            };
            prototypes.push(prototype);
        }
        let indices = prim.integers("protoIndices").unwrap_or_default();
        let positions = prim.tuples("positions").unwrap_or_default();
        let turns = ["orientationsf", "orientations"].map(|name| prim.tuples(name));
        let [fine, coarse] = turns;
        let orientations = fine.filter(|all| all.len() == indices.len()).or(coarse).unwrap_or_default();
        let scales = prim.tuples("scales").unwrap_or_default();
        let ids = prim.integers("ids").unwrap_or_default();
        let hidden: std::collections::BTreeSet<i64> =
            prim.integers("invisibleIds").unwrap_or_default().into_iter().collect();
        for (name, have) in [("positions", &positions), ("orientations", &orientations), ("scales", &scales)]
        {
            if have.len() != indices.len() && (have.len() > 0 || name == "positions") {
                prim.fault(format!("`{name}` of a PointInstancer has not an element for each instance"));
            }
        }
        self.spend(128 * indices.len().min(positions.len()))?;
        for (i, index) in indices.iter().enumerate() {
            if hidden.contains(&ids.get(i).copied().unwrap_or(i as i64)) {
                continue;
            }
            let Some(position) = positions.get::<3>(i) else { break };
            let Some(prototype) = usize::try_from(*index).ok().and_then(|i| prototypes.get(i)) else {
                prim.fault("a PointInstancer names prototypes that there are not");
                continue;
            };
            let q = orientations.get::<4>(i).unwrap_or([1.0, 0.0, 0.0, 0.0]).map(f64::from);
            let turn = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
            let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
            let scale = scales.get::<3>(i).map_or(DVec3::ONE, |v| DVec3::from(v.map(f64::from)));
            let place =
                DAffine3::from_scale_rotation_translation(scale, turn, DVec3::from(position.map(f64::from)));
            let item = StageItem::Prototype(Rc::clone(prototype));
            items.push(PlacedItem { item, to_root: inherited.to_root * place });
        }
        Ok(())
    }

    /// Gathers what a prim shows itself.
    fn show(
        &mut self,
        prim: &PrimReader,
        inherited: &Inherited,
        items: &mut Vec<PlacedItem>,
    ) -> Result<(), String> {
        let to_root = inherited.to_root;
        let mut add = |item: StageItem| items.push(PlacedItem { item, to_root });
        match prim.kind.as_str() {
            "Mesh" => {
                let posed = self.skeletons.posed(prim);
                if let Some(mesh) = Polygons::read(prim, posed) {
                    for shape in self.mesh(prim, &mesh, inherited, true)? {
                        add(StageItem::Mesh(Rc::new(shape)));
                    }
                }
            }
            kind if solids::KINDS.contains(&kind) => {
                for shape in self.solid(prim, inherited)? {
                    add(StageItem::Mesh(Rc::new(shape)));
                }
            }
            "Points" => {
                prim.used("doubleSided");
                if let Some((mesh, faces)) = strands::points(prim) {
                    for shape in self.points(prim, &mesh, faces, inherited)? {
                        add(StageItem::Mesh(Rc::new(shape)));
                    }
                }
            }
            "BasisCurves" => {
                prim.used("doubleSided");
                if let Some(curves) = strands::curves(prim) {
                    self.spend(curves.text.len())?;
                    let material = self.plain_material(prim, inherited);
                    let name = format!("{}-{}.txt", prim.name(), self.files.len());
                    let file = self.text.file(&name, curves.text.into_bytes());
                    self.files.insert(*blake3::hash(name.as_bytes()).as_bytes(), file.clone());
                    add(StageItem::Curves(Rc::new([curves.plugin.to_owned(), file, material.id])));
                }
            }
            "Camera" => add(StageItem::Camera(Rc::new(StageCamera::read(prim)))),
            kind if lights::KINDS.contains(&kind) => add(StageItem::Light(Rc::new(StageLight::read(prim)))),
            "Material" | "Shader" | "NodeGraph" | "GeomSubset" => {
                // Their material reads them, and tells.
                let names: Vec<String> = prim.names().map(str::to_owned).collect();
                names.iter().for_each(|name| prim.used(name));
            }
            "Skeleton" | "SkelAnimation" | "BlendShape" => {
                let names: Vec<String> = prim.names().map(str::to_owned).collect();
                names.iter().for_each(|name| prim.used(name));
            }
            kind if QUIET.contains(&kind) => {
                prim.used("skel:skeleton");
                prim.used("skel:animationSource");
            }
            kind => {
                let names: Vec<String> = prim.names().map(str::to_owned).collect();
                names.iter().for_each(|name| prim.used(name));
                prim.fault(format!("a prim of the type `{}` is not shown", shorten(kind)));
            }
        }
        Ok(())
    }

    /// The shape of a solid. Equal ones without values of their own are one file, which is made once.
    fn solid(&mut self, prim: &PrimReader, inherited: &Inherited) -> Result<Vec<MeshShape>, String> {
        let shines = prim.schemas().iter().any(|name| name == "MeshLightAPI");
        let is_plain = !shines && !prim.names().any(|name| name.starts_with("primvars:"));
        let key = solids::key(prim);
        if let Some((file, flat)) = self.solids.get(&key).filter(|_| is_plain).cloned() {
            prim.used("orientation");
            let double_sided = prim.truth("doubleSided") == Some(true);
            let material = inherited.bindings.material(prim.prim.path()).map(str::to_owned);
            let counts = ElementCounts { faces: 0, points: 0, corners: 0 };
            let (_, written) = self.dressed(prim, material.as_deref(), counts, double_sided);
            return Ok(vec![written.shape(file, flat)]);
        }
        let shapes = self.mesh(prim, &solids::read(prim), inherited, false)?;
        if let ([shape], true) = (shapes.as_slice(), is_plain) {
            self.solids.insert(key, (shape.file.clone(), shape.flat));
        }
        Ok(shapes)
    }

    /// The parts of a mesh, one for each material.
    fn mesh(
        &mut self,
        prim: &PrimReader,
        mesh: &Polygons,
        inherited: &Inherited,
        has_subsets: bool,
    ) -> Result<Vec<MeshShape>, String> {
        let light = prim.schemas().iter().any(|name| name == "MeshLightAPI").then(|| {
            let emitted = EmittedLight::read(prim, 1.0);
            if emitted.normalize {
                prim.fault("`inputs:normalize` of a mesh that shines is not used");
            }
            prim.used("light:materialSyncMode");
            emitted.rgb
        });
        let own = inherited.bindings.material(prim.prim.path()).map(str::to_owned);
        let mut groups: Vec<(Option<String>, Option<Vec<bool>>)> = Vec::new();
        if has_subsets {
            groups = self.subsets(prim, mesh, inherited);
        }
        if groups.is_empty() {
            groups.push((own, None));
        } else {
            let mut rest = vec![true; mesh.counts.len()];
            for (_, faces) in &groups {
                faces.iter().flatten().zip(&mut rest).for_each(|(taken, rest)| *rest &= !taken);
            }
            if rest.contains(&true) {
                groups.push((own, Some(rest)));
            }
        }
        let double_sided = prim.truth("doubleSided") == Some(true);
        let mut shapes = Vec::new();
        for (material, faces) in groups {
            let (values, mut written) =
                self.dressed(prim, material.as_deref(), mesh.elements(), double_sided);
            let chosen =
                |face: usize| faces.as_ref().is_none_or(|all| all.get(face).copied().unwrap_or(false));
            let (file, uncut) = mesh.ply(&values, &chosen);
            if uncut > 0 {
                prim.fault("large concave polygons are cut as if they were convex");
            }
            let Some(bytes) = file else { continue };
            if let Some(rgb) = light {
                written.emission =
                    Some(EmittedRadiance { value: MaterialValue::Rgb(rgb), both_sides: double_sided });
            }
            let file = self.file(prim.name(), bytes)?;
            shapes.push(written.shape(file, mesh.flat));
        }
        Ok(shapes)
    }

    /// The balls of a `Points`, whose colours are one for each point.
    fn points(
        &mut self,
        prim: &PrimReader,
        mesh: &Polygons,
        faces: usize,
        inherited: &Inherited,
    ) -> Result<Vec<MeshShape>, String> {
        let balls = mesh.counts.len() / faces.max(1);
        let counts = ElementCounts { faces: balls, points: balls, corners: balls };
        let material = inherited.bindings.material(prim.prim.path()).map(str::to_owned);
        let (mut values, written) = self.dressed(prim, material.as_deref(), counts, false);
        let per_ball = mesh.points.len() / balls.max(1);
        for primvar in [&mut values.uvs, &mut values.colors, &mut values.opacities].into_iter().flatten() {
            primvar.repeat(per_ball, balls);
        }
        let (Some(bytes), _) = mesh.ply(&values, &|_| true) else { return Ok(Vec::new()) };
        let file = self.file(prim.name(), bytes)?;
        Ok(vec![written.shape(file, false)])
    }

    /// The name of a mesh file; equal ones are kept once.
    fn file(&mut self, name: &str, bytes: Vec<u8>) -> Result<String, String> {
        let hash = *blake3::hash(&bytes).as_bytes();
        if let Some(known) = self.files.get(&hash) {
            return Ok(known.clone());
        }
        self.spend(bytes.len())?;
        let file = self.text.file(&format!("{name}-{}.ply", self.files.len()), bytes);
        self.files.insert(hash, file.clone());
        Ok(file)
    }

    /// The materials of the subsets of faces of a mesh.
    fn subsets(
        &mut self,
        prim: &PrimReader,
        mesh: &Polygons,
        inherited: &Inherited,
    ) -> Vec<(Option<String>, Option<Vec<bool>>)> {
        let mut groups = Vec::new();
        for child in guarded(|| prim.prim.children()).unwrap_or_default() {
            let subset = PrimReader::new(child);
            if subset.kind != "GeomSubset" {
                continue;
            }
            let family = subset.word("familyName").unwrap_or_default();
            let element = subset.word("elementType").unwrap_or_else(|| "face".to_owned());
            let indices = subset.integers("indices").unwrap_or_default();
            let bindings = inherited.bindings.with(&subset);
            if family != "materialBind" && bindings.key() == inherited.bindings.key() {
                // It selects faces for something else.
                continue;
            }
            if element != "face" {
                subset.fault("a subset of other elements than faces is not used");
            } else {
                let mut faces = vec![false; mesh.counts.len()];
                let mut unknown = false;
                for index in indices {
                    match usize::try_from(index).ok().and_then(|i| faces.get_mut(i)) {
                        Some(face) => *face = true,
                        None => unknown = true,
                    }
                }
                if unknown {
                    subset.fault("a subset names faces that there are not");
                }
                groups.push((bindings.material(subset.prim.path()).map(str::to_owned), Some(faces)));
            }
            subset.finish(self.text);
        }
        groups
    }

    /// The values of a mesh that its material reads, and its material as it is written.
    fn dressed(
        &mut self,
        prim: &PrimReader,
        material: Option<&str>,
        counts: ElementCounts,
        double_sided: bool,
    ) -> (MeshValues, WrittenMaterial) {
        let needs = material.and_then(|path| self.materials.needs(path, self.text));
        let has_material = needs.is_some();
        // Colours for display are for what has no material.
        let needs = needs.unwrap_or_else(|| MaterialNeeds {
            uv: None,
            color: Some("displayColor".to_owned()),
            opacity: Some("displayOpacity".to_owned()),
        });
        let read = |name: &Option<String>, width: std::ops::RangeInclusive<usize>| {
            let name = name.as_ref()?;
            Primvar::read(prim, &format!("primvars:{name}"), width, Interpolation::Constant, counts)
        };
        let uvs = read(&needs.uv, 2..=3);
        if needs.uv.is_some() && uvs.is_none() {
            prim.fault("a mesh has not the texture coordinates that its material asks for");
        }
        // Most materials do not read the coordinates and colours of the surface, which is no reason for a note.
        ["primvars:displayColor", "primvars:displayOpacity"].iter().for_each(|name| prim.used(name));
        if needs.uv.is_none() {
            prim.used("primvars:st");
        }
        let colors = read(&needs.color, 3..=4);
        let opacities = read(&needs.opacity, 1..=1);
        let single = |primvar: &Option<Primvar>| {
            let constant = primvar.as_ref().filter(|p| p.interpolation == Interpolation::Constant)?;
            constant.values.get::<3>(0)
        };
        let (mut color, mut opacity) = (None, 1.0);
        let (mut colors, mut opacities) = (colors, opacities);
        if !has_material {
            if let Some(rgb) = single(&colors) {
                (color, colors) = (Some(rgb.map(|v| v.max(0.0))), None);
            }
            if let Some([a, ..]) = single(&opacities) {
                (opacity, opacities) = (a, None);
            }
        }
        let gives = MeshGives {
            uv: uvs.is_some(),
            color: colors.is_some(),
            opacity: opacities.is_some(),
            double_sided: has_material && double_sided,
        };
        let written = match material.filter(|_| has_material) {
            Some(path) => self.materials.written(path, gives, &self.assets, self.text),
            None => self.materials.paint(gives, color, opacity, self.text),
        };
        (MeshValues { uvs, colors, opacities }, written)
    }

    /// The material of what has no vertices: without textures, in one colour.
    fn plain_material(&mut self, prim: &PrimReader, inherited: &Inherited) -> WrittenMaterial {
        let material = inherited.bindings.material(prim.prim.path()).map(str::to_owned);
        let counts = ElementCounts { faces: 0, points: 0, corners: 0 };
        let known = material.as_deref().is_some_and(|path| self.materials.needs(path, self.text).is_some());
        ["primvars:st", "primvars:displayOpacity"].iter().for_each(|name| prim.used(name));
        match material.filter(|_| known) {
            Some(path) => {
                prim.used("primvars:displayColor");
                self.materials.written(&path, MeshGives::default(), &self.assets, self.text)
            }
            None => {
                let name = "primvars:displayColor";
                let color = Primvar::read(prim, name, 3..=3, Interpolation::Constant, counts);
                let color = color.and_then(|color| color.values.get::<3>(0));
                self.materials.paint(MeshGives::default(), color, 1.0, self.text)
            }
        }
    }
}

const _: () = assert!(limits::MESH_TRIANGLES < u32::MAX as usize);
