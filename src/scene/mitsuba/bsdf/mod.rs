//! Reads materials: a file for each plugin, or for a smooth plugin and its rough form, that reads the parameters into the description of
//! the same file in `desc/bsdf/`.
//!
//! A new plugin takes such a file, its `mod` line and one line of the table below; what else it takes says `desc/bsdf/mod.rs`. A
//! function that reads a plugin asks for every parameter that the plugin has: those that it does not ask for are reported. Materials that
//! are made of others read those by [`Reader::bsdf`].

mod bump;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmitter;
mod ior;
mod mixed;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod rough_diffuse;
mod roughness;
mod stand_ins;
mod thin_dielectric;
mod thin_film;
mod two_sided;
mod values;
mod ward;

use super::document::ElementId;
use super::params::Params;
use super::reader::{PluginTable, Reader};
use crate::scene::desc::{BsdfDesc, BsdfId, BsdfPlugin, Name, NullDesc};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;

pub(super) use ior::ior;
pub(super) use stand_ins::STAND_INS;

/// Makes the table of plugins: the description of each, which has its name, and the function that reads it.
macro_rules! plugins {
    ($($desc:ident: $read:expr,)*) => {
        /// Every `<bsdf type="…">` that has a description of its own.
        pub(super) const PLUGINS: PluginTable<BsdfDesc> =
            &[$((crate::scene::desc::$desc::NAME, |reader, params| Ok($read(reader, params)?.into()))),*];
    };
}

plugins! {
    DiffuseDesc: diffuse::read,
    DielectricDesc: dielectric::smooth,
    ConductorDesc: conductor::smooth,
    RoughDielectricDesc: dielectric::rough,
    RoughConductorDesc: conductor::rough,
    PlasticDesc: plastic::smooth,
    RoughPlasticDesc: plastic::rough,
    PrincipledDesc: principled::read,
    PrincipledThinDesc: principled_thin::read,
    RoughDiffuseDesc: rough_diffuse::read,
    PhongDesc: phong::read,
    WardDesc: ward::read,
    DiffuseTransmitterDesc: diffuse_transmitter::read,
    ThinDielectricDesc: thin_dielectric::read,
    NullDesc: |_: &mut Reader<'_>, _: &Params<'_>| Ok::<_, SceneError>(NullDesc),
    BlendDesc: mixed::blend,
    MixtureDesc: mixed::mixture,
    MaskDesc: mixed::mask,
    NormalMapDesc: bump::normal_map,
    BumpMapDesc: bump::bump_map,
    CoatingDesc: coating::smooth,
    RoughCoatingDesc: coating::rough,
    TwoSidedDesc: two_sided::read,
}

impl Reader<'_> {
    /// The material of an element; read once however often it is referred to.
    pub(super) fn bsdf(&mut self, id: ElementId) -> Result<BsdfId, SceneError> {
        if let Some(&known) = self.known.bsdfs.get(&id) {
            return Ok(known);
        }
        let element = self.document.element(id);
        if self.known.open_bsdfs.contains(&id) || self.known.open_bsdfs.len() >= limits::REFERENCE_DEPTH {
            let message = "this material contains itself, or too many others within each other";
            return Err(self.document.error(FindingKind::Reference, element.span, message));
        }
        let params = Params::new(self.document, id)?;
        self.known.open_bsdfs.push(id);
        let plugin = match STAND_INS.iter().find(|(known, _)| *known == params.plugin()) {
            Some((_, plugin)) => Ok(*plugin),
            None => {
                let others: Vec<&str> = STAND_INS.iter().map(|(known, _)| *known).collect();
                self.plugin(&params, PLUGINS, &others)
            }
        };
        let read = plugin.and_then(|plugin| plugin(self, &params));
        self.known.open_bsdfs.pop();
        let bsdf = match read {
            Ok(bsdf) => {
                self.finish(params);
                bsdf
            }
            unread => self.or_instead(unread, "it is magenta", |_| BsdfDesc::magenta())?,
        };
        let name = self.name(id);
        let new = self.push_bsdf(bsdf, name);
        self.known.bsdfs.insert(id, new);
        Ok(new)
    }

    /// The material of a shape that names none: grey, or black if it emits, as Mitsuba.
    pub(super) fn default_bsdf(&mut self, emits: bool) -> BsdfId {
        if let Some(known) = self.known.default_bsdfs[usize::from(emits)] {
            return known;
        }
        let new = self.push_bsdf(BsdfDesc::grey(if emits { 0.0 } else { 0.5 }), Name::default());
        self.known.default_bsdfs[usize::from(emits)] = Some(new);
        new
    }

    pub(super) fn push_bsdf(&mut self, bsdf: BsdfDesc, name: Name) -> BsdfId {
        self.lists.names.bsdfs.push(name);
        self.lists.bsdfs.push(bsdf);
        BsdfId(self.lists.bsdfs.len() as u32 - 1)
    }
}
