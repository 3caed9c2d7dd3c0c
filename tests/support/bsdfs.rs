//! The bsdfs that are made of no others, as general tests use them: one entry for each plugin.
//!
//! These tests make their materials of [`BSDFS`], so that a new plugin is tested by all of them once it has an entry:
//!
//! - sampling against density and value, reciprocity, energy and hard cases: `tests/tracer/bsdf.rs`;
//! - random scenes with and without the plan of effects: `tests/tracer/effects_check.rs`;
//! - white furnaces by several methods: `tests/agreement/furnace.rs`;
//! - parameters that are missing, unknown or impossible: `tests/scene/bsdfs.rs`, which also fails where a plugin has no entry here, no scene
//!   or no golden reference.

use pointillist::scene::desc::texture::TexturePoint;
use pointillist::scene::desc::{BsdfDesc, SceneDesc};
use pointillist::scene::load_str;
use pointillist::spectrum::SampledWavelengths;
use pointillist::tracer::bsdf::{Bsdf, Material, MaterialEvalContext, ScatteringModel};
use pointillist::tracer::{MaterialClass, Scene};

/// A plugin and its parameters.
pub struct BsdfEntry {
    /// Its name.
    pub plugin: &'static str,
    /// Reflectances and transmittances.
    pub colours: &'static [&'static str],
    /// Numbers from 0 to 1.
    pub shares: &'static [&'static str],
    /// Roughnesses.
    pub alphas: &'static [&'static str],
    /// Elements of which one is given at a time, if there are any, and whether it alone gives the material a colour. The first gives none.
    pub variants: &'static [(&'static str, bool)],
    /// The index behind the surface over that before it, with the first variant.
    pub index: f32,
}

/// A plugin without parameters.
const PLAIN: BsdfEntry =
    BsdfEntry { plugin: "", colours: &[], shares: &[], alphas: &[], variants: &[("", false)], index: 1.0 };

const GLASSES: &[(&str, bool)] = &[
    ("<float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>", false),
    ("<string name='int_ior' value='bk7'/>", true),
];

const INTERFACES: &[(&str, bool)] = &[
    GLASSES[0],
    GLASSES[1],
    // Nothing is bent or mirrored.
    ("<string name='int_ior' value='sf11'/><string name='ext_ior' value='sf11'/>", false),
];

const METALS: &[(&str, bool)] = &[
    ("<string name='material' value='none'/>", false),
    ("<string name='material' value='Au'/>", true),
    ("<string name='material' value='Cu'/>", true),
];

/// The plugins.
pub const BSDFS: &[BsdfEntry] = &[
    BsdfEntry { plugin: "diffuse", colours: &["reflectance"], ..PLAIN },
    BsdfEntry {
        plugin: "dielectric",
        colours: &["specular_transmittance"],
        variants: INTERFACES,
        index: 1.5,
        ..PLAIN
    },
    BsdfEntry { plugin: "conductor", colours: &["specular_reflectance"], variants: METALS, ..PLAIN },
    BsdfEntry { plugin: "plastic", colours: &["diffuse_reflectance"], variants: INTERFACES, ..PLAIN },
    BsdfEntry {
        plugin: "thindielectric",
        colours: &["specular_transmittance"],
        variants: INTERFACES,
        ..PLAIN
    },
    BsdfEntry {
        plugin: "roughconductor",
        colours: &["specular_reflectance"],
        alphas: &["alpha"],
        variants: METALS,
        ..PLAIN
    },
    BsdfEntry {
        plugin: "roughdielectric",
        colours: &["specular_transmittance"],
        alphas: &["alpha"],
        variants: GLASSES,
        index: 1.5,
        ..PLAIN
    },
    BsdfEntry { plugin: "roughplastic", colours: &["diffuse_reflectance"], alphas: &["alpha"], ..PLAIN },
    BsdfEntry {
        plugin: "principled",
        colours: &["base_color"],
        shares: &[
            "metallic",
            "roughness",
            "spec_trans",
            "sheen_tint",
            "spec_tint",
            "clearcoat",
            "sheen",
            "flatness",
        ],
        variants: &[("<float name='eta' value='1.5'/>", false)],
        index: 1.5,
        ..PLAIN
    },
    BsdfEntry {
        plugin: "principledthin",
        colours: &["base_color"],
        shares: &["roughness", "spec_trans", "diff_trans", "sheen", "spec_tint"],
        ..PLAIN
    },
    BsdfEntry { plugin: "roughdiffuse", colours: &["reflectance"], alphas: &["alpha"], ..PLAIN },
    BsdfEntry { plugin: "phong", colours: &["diffuse_reflectance", "specular_reflectance"], ..PLAIN },
    BsdfEntry {
        plugin: "ward",
        colours: &["diffuse_reflectance", "specular_reflectance"],
        shares: &["alpha_u", "alpha_v"],
        ..PLAIN
    },
    BsdfEntry { plugin: "difftrans", colours: &["transmittance"], ..PLAIN },
];

/// Plugins that are made of others, or of nothing. Tests of their own have them.
pub const MADE_OF_OTHERS: &[&str] = &[
    "null",
    "blendbsdf",
    "mixturebsdf",
    "mask",
    "normalmap",
    "bumpmap",
    "coating",
    "roughcoating",
    "twosided",
];

/// Plugins for which another one stands in.
pub const STAND_INS: &[&str] = &["pplastic", "polarizer", "circular", "retarder"];

impl BsdfEntry {
    /// The plugin with these elements in it.
    pub fn with(&self, inside: &str) -> String {
        format!("<bsdf type='{}'>{inside}</bsdf>", self.plugin)
    }

    /// The plugin with the first variant, all of its colours, shares and roughnesses at these values.
    pub fn uniform(&self, colour: f32, share: f32, alpha: f32) -> String {
        let values = [(self.colours, colour), (self.shares, share), (self.alphas, alpha)];
        let each = values.into_iter().flat_map(|(names, value)| names.iter().map(move |name| (name, value)));
        let given: String =
            each.map(|(name, value)| format!("<float name='{name}' value='{value}'/>")).collect();
        self.with(&(self.variants[0].0.to_owned() + &given))
    }

    /// The class of a scene that shows it.
    pub fn class(&self) -> MaterialClass {
        Scene::prepare(&shown(&self.uniform(0.5, 0.5, 0.3))).expect("one material").material_class()
    }
}

/// A scene that shows a material, which is the first of its list.
pub fn shown(bsdf: &str) -> SceneDesc {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='sphere'>{bsdf}</shape></scene>"
    );
    load_str("bsdf.xml", &text, &[]).expect("a valid scene").desc
}

/// The description of a material that is made of no others.
pub fn desc(bsdf: &str) -> BsdfDesc {
    shown(bsdf).bsdfs.swap_remove(0)
}

/// A material of every plugin that is not delta, each with the index behind its surface.
pub fn materials() -> impl Iterator<Item = (String, Bsdf, f32)> {
    let lambda = SampledWavelengths::sample(0.3);
    let all = BSDFS.iter().map(move |entry| {
        let material = Material::new(&desc(&entry.uniform(0.6, 0.4, 0.3))).expect("made of no others");
        let bsdf = material.bsdf(&MaterialEvalContext::flat(TexturePoint::default()), &lambda);
        (format!("{}, listed", entry.plugin), bsdf, entry.index)
    });
    all.filter(|(_, bsdf, _)| !bsdf.is_delta())
}
