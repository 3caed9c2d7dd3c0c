//! Walks over a scene's elements and hands each object to its group, then makes the description.

use std::collections::BTreeSet;

use super::document::{Document, Element, ElementId};
use super::expand::Expanded;
use super::prefetch::{NamedFiles, on_own_threads};
use super::prefetched::Prefetched;
use super::reader::{Known, Reader, SceneLists};
use super::source::Span;
use super::tags::TagKind;
use super::{attribute, emitter, integrator, medium, params, projection, sensor, shape, upgrade};

use crate::scene::desc::{IntegratorDesc, RenderingSpace, SceneDesc};
use crate::scene::diagnostic::{FindingKind, SceneError, SceneWarning, shorten};
use crate::scene::model;

/// A scene as read, and the changes in it that are still to be made.
pub(crate) struct SceneWithEdits {
    pub(crate) desc: SceneDesc,
    /// Warnings and remarks, in the order they were found.
    pub(crate) warnings: Vec<SceneWarning>,
    /// The elements of the file.
    pub(crate) document: Document,
    /// The `<edit>` elements, in the order of the file.
    pub(crate) edits: Vec<ElementId>,
}

/// A scene that is being read.
struct SceneWalk<'d> {
    reader: Reader<'d>,
    sensor: Option<sensor::Sensor>,
    integrator: Option<IntegratorDesc>,
    /// Changes, in the order of the file.
    edits: Vec<ElementId>,
}

/// Takes a scene in which one texel stands for each large picture, while these are yet to be read.
pub(crate) type TakePreview<'a> = &'a mut dyn FnMut(ReadElements, &Document);

/// What the elements of a document describe.
pub(crate) struct ReadElements {
    pub(crate) desc: SceneDesc,
    /// Warnings and remarks, in the order they were found.
    warnings: Vec<SceneWarning>,
    /// The `<edit>` elements, in the order of the file.
    pub(crate) edits: Vec<ElementId>,
}

/// The scene that an expanded document describes; `lenient` leaves out or replaces plugins that are not supported. If large
/// pictures take long to read, `preview` gets the scene before.
pub(crate) fn read(
    (document, warnings): Expanded,
    lenient: bool,
    preview: Option<TakePreview<'_>>,
) -> Result<SceneWithEdits, SceneError> {
    announce(&document);
    let files = NamedFiles::of(&document);
    let known = match preview.filter(|_| files.have_large_pictures()) {
        Some(take) => {
            let read = files.without_large_pictures(&document);
            let meshes = read.meshes_again();
            take(read_elements(&document, lenient, Vec::new(), read)?, &document);
            on_own_threads(|| files.read(&document, meshes))
        }
        None => files.read(&document, Prefetched::default()),
    };
    let ReadElements { desc, warnings, edits } = read_elements(&document, lenient, warnings, known)?;
    Ok(SceneWithEdits { desc, warnings, document, edits })
}

/// Reads the elements of a document, whose files were read before.
fn read_elements(
    document: &Document,
    lenient: bool,
    warnings: Vec<SceneWarning>,
    prefetched: Prefetched,
) -> Result<ReadElements, SceneError> {
    let known = Known { prefetched, ..Known::default() };
    let lists = SceneLists::default();
    let reader = Reader { document, lists, known, lenient, warnings, more_warnings: 0 };
    let mut walk = SceneWalk { reader, sensor: None, integrator: None, edits: Vec::new() };
    walk.version();
    for &id in &document.element(ElementId(0)).children {
        walk.top_level(id)?;
    }
    walk.done()
}

/// Tells those who wait how large the film is and how many files the scene names.
fn announce(document: &Document) {
    let named = |e: &Element| e.value("name") == Some("filename");
    let names: BTreeSet<&str> =
        document.elements.iter().filter(|e| named(e)).filter_map(|e| e.value("value")).collect();
    document.files.progress.tell_named(names.len() + document.sources.paths().len());
    let is_sensor = |id: &&ElementId| document.element(**id).tag.name == "sensor";
    if let Some(id) = document.element(ElementId(0)).children.iter().find(is_sensor) {
        let (lists, known) = Default::default();
        let mut aside =
            Reader { document, lists, known, lenient: true, warnings: Vec::new(), more_warnings: 0 };
        if let Ok(sensor::Sensor { film, .. }) = sensor::read(&mut aside, *id) {
            let size = film.crop.map_or([film.width, film.height], |crop| [crop.width, crop.height]);
            document.files.progress.tell_film(size);
        }
    }
}

impl SceneWalk<'_> {
    /// The format is that of Mitsuba 2 and 3; the names of older files are upgraded to it.
    fn version(&mut self) {
        let root = self.reader.document.element(ElementId(0));
        let (span, message) = match root.attribute("version") {
            None => {
                (root.span, "the scene does not say which version of the format it is written in".to_owned())
            }
            Some(a) if matches!(upgrade::major(&a.value), Some(2 | 3)) => return,
            Some(a) if upgrade::is_old(&a.value) => {
                let message =
                    format!("version {}: its names are read as those of Mitsuba 3", shorten(&a.value));
                let found = self.reader.document.finding(FindingKind::Value, a.span, message);
                let help = "meanings are Mitsuba 3's, too, where they have changed since";
                return self.reader.warn(found.help(help).advice());
            }
            Some(a) => (a.span, format!("version `{}` is not known", shorten(&a.value))),
        };
        let found = self.reader.document.finding(FindingKind::Value, span, message);
        self.reader
            .warn(found.help("this reader knows versions up to 3: <scene version=\"3.0.0\">").warning());
    }

    /// In a lenient run, what holds a plugin that is not supported is left out with a warning.
    fn leave_out(&mut self, read: Result<(), SceneError>) -> Result<(), SceneError> {
        self.reader.or_instead(read, "it is left out", |_| ())
    }

    fn top_level(&mut self, id: ElementId) -> Result<(), SceneError> {
        let element = self.reader.document.element(id);
        match (element.tag.kind, element.tag.name) {
            (TagKind::Object, "shape") => {
                let read = shape::read(&mut self.reader, id);
                self.leave_out(read)?;
                self.meter(id)
            }
            (TagKind::Object, "bsdf") => self.reader.bsdf(id).map(|_| ()),
            (TagKind::Object, "medium") => self.reader.medium(id).map(|_| ()),
            (TagKind::Object, "emitter") => {
                let read = emitter::read(&mut self.reader, id);
                self.leave_out(read)
            }
            (TagKind::Object, "sensor") => self.sensor(id),
            (TagKind::Object, "integrator") => {
                let read = integrator::read(&mut self.reader, id)?;
                if self.integrator.replace(read).is_some() {
                    self.second(element.span, "integrator", "the last one counts");
                }
                Ok(())
            }
            (TagKind::Edit, _) => {
                self.edits.push(id);
                Ok(())
            }
            // These are read where they are referred to, by their id.
            (TagKind::Value, "spectrum")
            | (
                TagKind::Object,
                "texture" | "volume" | "phase" | "subsurface" | "film" | "sampler" | "rfilter",
            ) if element.attribute("id").is_some() => Ok(()),
            (TagKind::Ref, _) => {
                params::follow(self.reader.document, element)?;
                self.second(element.span, "reference", "a reference outside of a plugin does nothing");
                Ok(())
            }
            (_, name) => {
                let message = format!("<{name}> is not supported at this place");
                let found = self.reader.document.finding(FindingKind::Plugin, element.span, message);
                Err(found
                    .help("a scene holds shapes, bsdfs, media, emitters, a sensor and an integrator")
                    .error())
            }
        }
    }

    /// Reads the sensor that stands in the shape `id`, if there is one.
    fn meter(&mut self, id: ElementId) -> Result<(), SceneError> {
        let Some(sensor) = self.reader.known.meter.as_ref().map(|meter| meter.sensor) else { return Ok(()) };
        let (element, shape) = (self.reader.document.element(sensor), self.reader.document.element(id));
        let place = match (element.value("type"), shape.value("type")) {
            (Some("irradiancemeter"), Some(shape::GROUP | shape::MERGE)) => "of a group",
            (Some("irradiancemeter"), _) => return self.sensor(sensor),
            _ => "but for an `irradiancemeter`",
        };
        let message = format!("no sensor stands in a shape {place}");
        let found = self.reader.document.finding(FindingKind::Plugin, element.span, message);
        Err(found.help("put it into the scene itself").error())
    }

    fn sensor(&mut self, id: ElementId) -> Result<(), SceneError> {
        let span = self.reader.document.element(id).span;
        if let Some(first) = &self.sensor {
            if first.camera.place.file == span.file {
                self.second(span, "sensor", "the first one counts");
            } else {
                // A sensor before an include takes precedence on purpose: the viewer saves a camera that way.
                let message = "the sensor in front of the include counts, not this one";
                let found = self.reader.document.finding(FindingKind::Parameter, span, message);
                self.reader.warn(found.advice());
            }
            return Ok(());
        }
        let mut sensor = sensor::read(&mut self.reader, id)?;
        if let Some(medium) = sensor.medium {
            sensor.camera.medium = self.reader.medium(medium)?;
        }
        self.sensor = Some(sensor);
        Ok(())
    }

    fn second(&mut self, span: Span, what: &str, help: &str) {
        let found = self.reader.document.finding(FindingKind::Parameter, span, format!("another {what}"));
        self.reader.warn(found.help(help).warning());
    }

    fn done(mut self) -> Result<ReadElements, SceneError> {
        emitter::finish(&mut self.reader)?;
        let root = self.reader.document.element(ElementId(0)).span;
        let Some(sensor) = self.sensor.take() else {
            let found = self.reader.document.finding(FindingKind::Missing, root, "the scene has no sensor");
            return Err(found.help("add <sensor type=\"perspective\">").error());
        };
        if self.reader.lists.lights.is_empty()
            && self.reader.lists.shapes.iter().all(|s| s.emission.is_none())
            && self.reader.lists.media.iter().all(|medium| medium.emission.is_none())
        {
            let found = self.reader.document.finding(
                FindingKind::Missing,
                root,
                "the scene has no light: it will be black",
            );
            self.reader.warn(
                found.help("add <emitter type=\"constant\"/>, or an area emitter in a shape").warning(),
            );
        }
        let is_model = model::ModelFormat::of(self.reader.document.sources.path(0)).is_some();
        if let Some(nothing) = self.reader.known.nothing.take_if(|_| is_model)
            && self.reader.lists.meshes.iter().all(|mesh| mesh.triangles.is_empty())
        {
            return Err(nothing);
        }
        shape::unseen(&mut self.reader);
        let mut integrator = self.integrator.take().unwrap_or_default();
        if !self.reader.known.subsurfaces.is_empty() {
            // Methods of version 0.6 that know surfaces only know what is beneath them, and count it as one scattering.
            integrator = IntegratorDesc { surfaces_only: false, max_depth: None, ..integrator };
        }
        medium::unused(&mut self.reader, sensor.camera.medium, &integrator);
        attribute::finish(&mut self.reader);
        if self.reader.more_warnings > 0 {
            let message = format!("{} more warnings are not shown", self.reader.more_warnings);
            self.reader
                .warnings
                .push(self.reader.document.finding(FindingKind::Limit, root, message).warning());
        }
        let SceneLists { bsdfs, meshes, shapes, groups, lights, media, names } = self.reader.lists;
        let mut desc = SceneDesc {
            files: self.reader.document.sources.paths(),
            camera: sensor.camera,
            film: sensor.film,
            integrator,
            samples_per_pixel: sensor.samples,
            bsdfs,
            meshes,
            shapes,
            groups,
            lights,
            media,
            names,
            space: RenderingSpace::WORLD,
        };
        if self.reader.document.unframed == Some(desc.camera.place.file) {
            model::frame(&mut desc);
        }
        if let Some(target) = self.reader.known.distant {
            let bounds = desc.bounds().unwrap_or_default();
            projection::aim(&mut desc.camera, target, bounds);
        }
        // An edited scene is traced where the original is, whatever was moved.
        desc.place();
        Ok(ReadElements { desc, warnings: self.reader.warnings, edits: self.edits })
    }
}
