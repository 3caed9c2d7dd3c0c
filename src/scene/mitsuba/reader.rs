//! Walks over a scene's elements and hands each plugin to the function that reads it.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::document::{Document, ElementId};
use super::expand::Expanded;
use super::params::Params;
use super::shape::MeshKey;
use super::source::Span;
use super::spectrum::Role;
use super::tags::TagKind;
use super::value::shorten;
use super::{Loaded, edit, emitter, integrator, sensor, shape, suggest};
use crate::scene::bsdf;
use crate::scene::desc::{
    BsdfDesc, BsdfId, GroupDesc, GroupId, IntegratorDesc, LightDesc, Mesh, MeshId, Name, Names, Place,
    SceneDesc, ShapeDesc,
};
use crate::scene::diagnostic::{FindingKind, SceneError, SceneWarning};
use crate::scene::limits;
use crate::spectrum::Spectrum;

/// The plugins of one group: the name of each and the function that reads it.
pub(crate) type PluginTable<T> = &'static [(&'static str, PluginReader<T>)];

/// Reads one plugin with its parameters.
pub(crate) type PluginReader<T> = fn(&mut Reader<'_>, &Params<'_>) -> Result<T, SceneError>;

/// Reads a scene: the lists of its description so far, and what is needed to add to them.
pub(crate) struct Reader<'d> {
    /// The elements.
    pub(crate) document: &'d Document,
    /// The lists of the description.
    pub(crate) lists: SceneLists,
    /// Objects that were read before, and sizes so far.
    pub(crate) known: Known,
    sensor: Option<sensor::Sensor>,
    integrator: Option<IntegratorDesc>,
    samples: Option<u64>,
    /// Changes, in the order of the file.
    edits: Vec<ElementId>,
    warnings: Vec<SceneWarning>,
    /// Warnings beyond [`limits::WARNINGS`], which are only counted.
    more_warnings: usize,
}

/// The lists of a [`SceneDesc`].
#[derive(Default)]
pub(crate) struct SceneLists {
    pub(crate) bsdfs: Vec<BsdfDesc>,
    pub(crate) meshes: Vec<Arc<Mesh>>,
    pub(crate) shapes: Vec<ShapeDesc>,
    pub(crate) groups: Vec<GroupDesc>,
    pub(crate) lights: Vec<LightDesc>,
    pub(crate) names: Names,
}

/// Objects that references share, by the element or file they come from, and sizes that have limits.
#[derive(Default)]
pub(crate) struct Known {
    pub(crate) bsdfs: BTreeMap<ElementId, BsdfId>,
    /// Materials of shapes that name none: those that do not emit, those that do.
    pub(crate) default_bsdfs: [Option<BsdfId>; 2],
    /// Materials being read, to see cycles.
    pub(crate) open_bsdfs: Vec<ElementId>,
    /// Meshes by file and options, so that each file is read once.
    pub(crate) meshes: BTreeMap<MeshKey, MeshId>,
    pub(crate) groups: BTreeMap<ElementId, GroupId>,
    pub(crate) spectra: BTreeMap<(ElementId, Role), Spectrum>,
    /// Triangles of all meshes.
    pub(crate) mesh_triangles: usize,
    /// Bytes of all mesh files.
    pub(crate) mesh_bytes: u64,
    /// Bytes of all spectrum files.
    pub(crate) spectrum_bytes: usize,
}

/// The scene that an expanded document describes.
pub(crate) fn read((document, warnings): Expanded) -> Result<Loaded, SceneError> {
    let mut reader = Reader {
        document: &document,
        lists: SceneLists::default(),
        known: Known::default(),
        sensor: None,
        integrator: None,
        samples: None,
        edits: Vec::new(),
        warnings,
        more_warnings: 0,
    };
    reader.version();
    for &id in &document.element(ElementId(0)).children {
        reader.top_level(id)?;
    }
    reader.done()
}

impl Reader<'_> {
    /// Keeps a warning.
    pub(crate) fn warn(&mut self, warning: SceneWarning) {
        if self.warnings.len() < limits::WARNINGS {
            self.warnings.push(warning);
        } else {
            self.more_warnings += 1;
        }
    }

    /// Closes a plugin: takes its warnings, with one for each parameter nobody asked for.
    pub(crate) fn finish(&mut self, params: Params<'_>) {
        for warning in params.finish() {
            self.warn(warning);
        }
    }

    /// Line and column of a span.
    pub(crate) fn place(&self, span: Span) -> Place {
        self.document.sources.place(span)
    }

    /// The id and place of an element.
    pub(crate) fn name(&self, id: ElementId) -> Name {
        let element = self.document.element(id);
        Name { id: element.value("id").map(str::to_owned), place: self.place(element.span) }
    }

    /// Finds the plugin of an element in the table of its group.
    ///
    /// # Errors
    ///
    /// A name that is neither in the table nor read elsewhere is an error; `others` are suggested, too.
    pub(crate) fn plugin<P: Copy>(
        &self,
        params: &Params<'_>,
        table: &[(&'static str, P)],
        others: &[&str],
    ) -> Result<P, SceneError> {
        let found = table.iter().find(|(name, _)| *name == params.plugin());
        found.map(|(_, plugin)| *plugin).ok_or_else(|| {
            let names: Vec<&str> = table.iter().map(|p| p.0).chain(others.iter().copied()).collect();
            self.unknown_plugin(params, &names)
        })
    }

    /// An error: no plugin of this name.
    pub(crate) fn unknown_plugin(&self, params: &Params<'_>, known: &[&str]) -> SceneError {
        let (tag, name) = (params.element().tag.name, params.plugin());
        let (span, message) =
            (params.element().span_of("type"), format!("there is no {tag} `{}`", shorten(name)));
        let found = self.document.finding(FindingKind::Plugin, span, message);
        found.help(suggest::hint(name, known)).error()
    }

    /// The format is that of Mitsuba 2 and 3; older files use other names.
    fn version(&mut self) {
        let root = self.document.element(ElementId(0));
        let (span, message) = match root.attribute("version") {
            None => {
                (root.span, "the scene does not say which version of the format it is written in".to_owned())
            }
            Some(a) if matches!(a.value.split('.').next(), Some("2" | "3")) => return,
            Some(a) => {
                (a.span, format!("version `{}` is not known", a.value.chars().take(32).collect::<String>()))
            }
        };
        let found = self.document.finding(FindingKind::Value, span, message);
        self.warn(found.help("this reader knows versions 2 and 3: <scene version=\"3.0.0\">").warning());
    }

    fn top_level(&mut self, id: ElementId) -> Result<(), SceneError> {
        let element = self.document.element(id);
        match (element.tag.kind, element.tag.name) {
            (TagKind::Object, "shape") => shape::read(self, id),
            (TagKind::Object, "bsdf") => bsdf::read(self, id).map(|_| ()),
            (TagKind::Object, "emitter") => emitter::read(self, id),
            (TagKind::Object, "sensor") => self.sensor(id),
            (TagKind::Object, "integrator") => {
                let read = integrator::read(self, id)?;
                if self.integrator.replace(read).is_some() {
                    self.second(element.span, "integrator", "the last one counts");
                }
                Ok(())
            }
            (TagKind::Edit, _) => {
                self.edits.push(id);
                Ok(())
            }
            // A spectrum with an id is read where it is referred to.
            (TagKind::Value, "spectrum") if element.attribute("id").is_some() => Ok(()),
            (TagKind::Ref, _) => {
                super::params::follow(self.document, element)?;
                self.second(element.span, "reference", "a reference outside of a plugin does nothing");
                Ok(())
            }
            (_, name) => {
                let message = format!("<{name}> is not supported at this place");
                let found = self.document.finding(FindingKind::Plugin, element.span, message);
                Err(found.help("a scene holds shapes, bsdfs, emitters, a sensor and an integrator").error())
            }
        }
    }

    fn sensor(&mut self, id: ElementId) -> Result<(), SceneError> {
        let span = self.document.element(id).span;
        if let Some(first) = &self.sensor {
            if first.camera.place.file == span.file {
                self.second(span, "sensor", "the first one counts");
            } else {
                // What an including file puts in front is meant to count: so the viewer saves a camera.
                let message = "the sensor in front of the include counts, not this one";
                let found = self.document.finding(FindingKind::Parameter, span, message);
                self.warn(found.advice());
            }
            return Ok(());
        }
        let read = sensor::read(self, id)?;
        self.samples = read.samples;
        self.sensor = Some(read);
        Ok(())
    }

    fn second(&mut self, span: Span, what: &str, help: &str) {
        let found = self.document.finding(FindingKind::Parameter, span, format!("another {what}"));
        self.warn(found.help(help).warning());
    }

    fn done(mut self) -> Result<Loaded, SceneError> {
        let root = self.document.element(ElementId(0)).span;
        let Some(sensor) = self.sensor.take() else {
            let found = self.document.finding(FindingKind::Missing, root, "the scene has no sensor");
            return Err(found.help("add <sensor type=\"perspective\">").error());
        };
        if self.lists.lights.is_empty() && self.lists.shapes.iter().all(|s| s.emission.is_none()) {
            let found =
                self.document.finding(FindingKind::Missing, root, "the scene has no light: it will be black");
            self.warn(
                found.help("add <emitter type=\"constant\"/>, or an area emitter in a shape").warning(),
            );
        }
        shape::unseen(&mut self);
        if self.more_warnings > 0 {
            let message = format!("{} more warnings are not shown", self.more_warnings);
            self.warnings.push(self.document.finding(FindingKind::Limit, root, message).warning());
        }
        let SceneLists { bsdfs, meshes, shapes, groups, lights, names } = self.lists;
        let mut desc = SceneDesc {
            files: self.document.sources.paths(),
            camera: sensor.camera,
            film: sensor.film,
            integrator: self.integrator.unwrap_or_default(),
            samples_per_pixel: self.samples,
            bsdfs,
            meshes,
            shapes,
            groups,
            lights,
            names,
        };
        edit::apply(self.document, &mut desc, &self.edits)?;
        Ok(Loaded { desc, warnings: self.warnings })
    }
}
