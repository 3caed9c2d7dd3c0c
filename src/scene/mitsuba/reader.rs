//! The reader that every plugin uses: elements, the lists of the description so far, shared objects, and warnings.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::document::{Document, ElementId};
use super::grid_file::Grids;
use super::params::Params;
use super::prefetched::Prefetched;
use super::source::Span;
use super::unsupported;
use crate::image::bitmap::Bitmap;
use crate::scene::desc::emission_texture::EmissionTexture;
use crate::scene::desc::texture::{AttributeLayout, SpectrumTexture};
use crate::scene::desc::{
    BsdfDesc, BsdfId, GroupDesc, GroupId, LightDesc, MediumDesc, MediumId, Mesh, MeshId, Name, Names, Place,
    ShapeDesc, ShapeKind,
};
use crate::scene::diagnostic::{FindingKind, SceneError, SceneWarning, shorten};
use crate::scene::limits;
use crate::scene::mesh::MeshOptions;
use crate::scene::suggest;
use crate::spectrum::dispersion::Ior;
use crate::spectrum::{EmissionMap, Spectrum};

/// The plugins of one group: the name of each and the function that reads it.
pub(crate) type PluginTable<T> = &'static [(&'static str, PluginReader<T>)];

/// Reads one plugin with its parameters.
pub(crate) type PluginReader<T> = fn(&mut Reader<'_>, &Params<'_>) -> Result<T, SceneError>;

/// Reads a scene: the lists of its description so far, and what is needed to add to them.
pub(crate) struct Reader<'d> {
    pub(crate) document: &'d Document,
    pub(crate) lists: SceneLists,
    /// Objects that were read before, and sizes so far.
    pub(crate) known: Known,
    /// Plugins that are not supported are left out or replaced.
    pub(crate) lenient: bool,
    pub(crate) warnings: Vec<SceneWarning>,
    /// Warnings beyond [`limits::WARNINGS`], which are only counted.
    pub(crate) more_warnings: usize,
}

/// The lists of a [`SceneDesc`](crate::scene::SceneDesc).
#[derive(Default)]
pub(crate) struct SceneLists {
    pub(crate) bsdfs: Vec<BsdfDesc>,
    pub(crate) meshes: Vec<Arc<Mesh>>,
    pub(crate) shapes: Vec<ShapeDesc>,
    pub(crate) groups: Vec<GroupDesc>,
    pub(crate) lights: Vec<LightDesc>,
    pub(crate) media: Vec<MediumDesc>,
    pub(crate) names: Names,
}

/// The use of a spectrum, which decides what an RGB colour means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    /// A share of light in [0, 1].
    Reflectance,
    /// Radiance or intensity.
    Emission,
    /// Extinction coefficient of a medium.
    Extinction,
    /// Albedo of a medium, in [0, 1].
    Albedo,
    /// Anything else that is not negative, such as an index of refraction.
    Unbounded,
}

/// What is beneath a surface, and the indices of refraction at it.
#[derive(Clone)]
pub(crate) struct SubsurfaceMedium {
    pub(crate) interior: MediumId,
    pub(crate) int_ior: Ior,
    pub(crate) ext_ior: Ior,
}

/// A shape with a sensor that measures it.
pub(crate) struct MeteredShape {
    /// The sensor.
    pub(crate) sensor: ElementId,
    pub(crate) kind: ShapeKind,
    pub(crate) to_world: DAffine3,
    pub(crate) flip_normals: bool,
}

/// Objects that references share, by the element or file they come from, and sizes that have limits.
#[derive(Default)]
pub(crate) struct Known {
    pub(crate) bsdfs: BTreeMap<ElementId, BsdfId>,
    /// Materials of shapes that name none: those that do not emit, those that do.
    pub(crate) default_bsdfs: [Option<BsdfId>; 2],
    /// Materials being read, to see cycles.
    pub(crate) open_bsdfs: Vec<ElementId>,
    /// Media; nothing for one that was left out.
    pub(crate) media: BTreeMap<ElementId, Option<MediumId>>,
    /// Subsurfaces that are rendered as media.
    pub(crate) subsurfaces: BTreeMap<ElementId, SubsurfaceMedium>,
    /// Their boundaries, by the index of the bsdf in the place of which each is.
    pub(crate) boundaries: BTreeMap<(ElementId, u32), BsdfId>,
    /// Phase functions being read, to see cycles.
    pub(crate) open_phases: Vec<ElementId>,
    /// Merged shapes being read, for the same reason.
    pub(crate) open_merges: Vec<ElementId>,
    /// Merged shapes so far, each counted wherever it is shown.
    pub(crate) merges: usize,
    /// Meshes by file and options, so that each file is read once.
    pub(crate) meshes: BTreeMap<(PathBuf, MeshOptions), MeshId>,
    pub(crate) groups: BTreeMap<ElementId, GroupId>,
    pub(crate) textures: BTreeMap<ElementId, SpectrumTexture>,
    /// Textures being read, to see cycles.
    pub(crate) open_textures: Vec<ElementId>,
    /// Pictures of textures by file, and whether their values are raw, so that each file is read once.
    pub(crate) bitmaps: BTreeMap<(PathBuf, bool), Arc<Bitmap>>,
    pub(crate) texels: usize,
    /// Area lights of shapes.
    pub(crate) area_lights: BTreeSet<ElementId>,
    /// Those that stand outside of shapes.
    pub(crate) lone_area_lights: Vec<ElementId>,
    /// Grids of volumes.
    pub(crate) grids: Grids,
    /// Textures that shine.
    pub(crate) emission_textures: BTreeMap<ElementId, Arc<EmissionTexture>>,
    /// Their pictures, as those in `bitmaps`.
    pub(crate) emission_maps: BTreeMap<(PathBuf, bool), Arc<EmissionMap>>,
    /// Files that were read before anything asked for them.
    pub(crate) prefetched: Prefetched,
    /// Mesh attributes by name.
    pub(crate) attributes: BTreeMap<String, AttributeLayout>,
    /// The first shape whose material has a picture and whose mesh has no texture coordinates, and the number of such shapes.
    pub(crate) unmapped: Option<(Span, usize)>,
    /// The target, if it has one, of a sensor `distant`.
    pub(crate) distant: Option<Option<DVec3>>,
    /// The shape that was read last, if a sensor stands in it.
    pub(crate) meter: Option<MeteredShape>,
    /// Why the first mesh without triangles has none.
    pub(crate) nothing: Option<SceneError>,
    pub(crate) spectra: BTreeMap<(ElementId, Role), Spectrum>,
    pub(crate) mesh_triangles: usize,
    pub(crate) mesh_bytes: u64,
    pub(crate) spectrum_bytes: usize,
}

impl Reader<'_> {
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

    /// The plugin that was `read`; in a lenient run, `other` in place of an unsupported plugin, with a warning that says
    /// what is done `instead`.
    pub(crate) fn or_instead<T>(
        &mut self,
        read: Result<T, SceneError>,
        instead: &str,
        other: impl FnOnce(&mut Self) -> T,
    ) -> Result<T, SceneError> {
        match read {
            Err(e) if self.lenient && e.kind() == FindingKind::Plugin => {
                self.warn(e.tolerated(instead));
                Ok(other(self))
            }
            read => read,
        }
    }

    /// An error: no plugin of this name.
    pub(crate) fn unknown_plugin(&self, params: &Params<'_>, known: &[&str]) -> SceneError {
        let (kind, name) = (params.element().tag.name, params.plugin());
        let lenient =
            matches!(kind, "shape" | "bsdf" | "emitter" | "texture" | "volume" | "medium" | "phase");
        if let Some(why) = unsupported::why(kind, name) {
            let found = params.type_fault(format!("`{name}` is not supported: {why}"));
            return if lenient { found.help("with --lenient the rest is rendered") } else { found }.error();
        }
        let mut help = suggest::hint(name, known);
        if lenient {
            help += "; with --lenient the rest is rendered";
        }
        params.type_fault(format!("there is no {kind} `{}`", shorten(name))).help(help).error()
    }
}
