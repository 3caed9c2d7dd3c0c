//! Names, capabilities and help of the light transport methods. Outside of the tracer only `render/method.rs` (photon maps, and the method that
//! finds missing light), the aliases in `scene/mitsuba/integrator.rs`, and the words of `explain` and `study` name single ones.
//!
//! The other modules ask a method for its [traits](IntegratorKind::traits). A new one is a variant of [`IntegratorKind`] and a constant below;
//! how it traces stands in `tracer/integrator`, which says what else it takes.

use clap::ValueEnum;

/// The methods the program has. The comments are the help of `--integrator`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, serde::Serialize, serde::Deserialize)]
pub enum IntegratorKind {
    /// Path tracing: from the camera, with next-event estimation at each vertex.
    #[default]
    Path,
    /// Particle tracing: from the lights, each vertex connected to the camera. Nothing is seen in mirrors or glass, and media do not shine.
    Light,
    /// Bidirectional path tracing: subpaths from both ends, connected at every vertex.
    Bidirectional,
    /// One-pass photon mapping: final gathering from photons that light paths leave. It converges: its blur shrinks as it goes.
    Photon,
    /// Vertex connection and merging: bidirectional path tracing, but caustics seen in mirrors and through glass are found by
    /// photons. Their blur shrinks as it goes; all else is unbiased.
    Vcm,
    /// No light: the distance to the first surface, as grey.
    Depth,
    /// The method that suits the scene, chosen by a short trial of each; the program says why. Path tracing until then.
    Auto,
}

/// The name and the capabilities of a method.
#[derive(Debug)]
pub struct IntegratorTraits {
    /// Its name on the command line and in files.
    pub name: &'static str,
    /// Plugins of scene files that are this method with all of its parameters.
    pub plugins: &'static [&'static str],
    /// Its name within a sentence.
    pub title: &'static str,
    /// The paths that it traces, within a sentence: a plural.
    pub traces: &'static str,
    /// The automatic choice tries it, and the window offers it.
    pub is_candidate: bool,
    /// Paths per index, from the camera and from lights to the camera: which of the two streams it fills, and how fast.
    pub paths_per_index: [u64; 2],
    /// Its use of photons.
    pub photons: PhotonUse,
    /// The method whose paths it traces; what it adds to them are photons.
    pub extends: Option<IntegratorKind>,
    /// It finds what is seen in mirrors and through glass.
    pub finds_deltas: bool,
    /// It finds light that leaves along normals only.
    pub finds_beams: bool,
    /// It finds light that media emit: its camera paths fly through them.
    pub finds_emissive_media: bool,
    /// The light that other methods may find sooner.
    pub finds_late: LateFind,
    /// Why the paths behind a pixel cannot be drawn, if so.
    pub hides_paths: Option<&'static str>,
    /// The quantity that its picture shows, if that is not light.
    pub no_light: Option<NoLight>,
}

/// The use that a method makes of photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonUse {
    /// It has none.
    None,
    /// All light that was spread, and caustics: the whole picture is blurred, and all samples share one map.
    Gathered,
    /// Caustics that it finds by chance only.
    Merged,
}

/// The light that a method may find later than others do. Each kind includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LateFind {
    /// It shows no light, or is none yet.
    Nothing,
    /// Small lights in mirrors and glass.
    Highlights,
    /// Caustics seen in mirrors and glass.
    SeenCaustics,
    /// Whatever bidirectional path tracing finds.
    Indirect,
}

/// The quantity that the picture of a method shows in place of light.
#[derive(Debug)]
pub struct NoLight {
    /// In a word or two, a plural.
    pub shows: &'static str,
    /// The remark of the reader of scene files.
    pub remark: &'static str,
    /// The help: what to do instead.
    pub help: &'static str,
}

const PATH: IntegratorTraits = IntegratorTraits {
    name: "path",
    plugins: &["path", "volpath", "volpathmis"],
    title: "path tracing",
    traces: "camera paths",
    is_candidate: true,
    paths_per_index: [1, 0],
    photons: PhotonUse::None,
    extends: None,
    finds_deltas: true,
    finds_beams: false,
    finds_emissive_media: true,
    finds_late: LateFind::Indirect,
    hides_paths: None,
    no_light: None,
};

const LIGHT: IntegratorTraits = IntegratorTraits {
    name: "light",
    // Mitsuba's name comes first.
    plugins: &["ptracer", "light"],
    title: "particle tracing",
    traces: "particles",
    paths_per_index: [0, 1],
    finds_deltas: false,
    finds_beams: true,
    finds_emissive_media: false,
    hides_paths: Some("particle tracing has no paths from the camera"),
    ..PATH
};

const BIDIRECTIONAL: IntegratorTraits = IntegratorTraits {
    name: "bidirectional",
    plugins: &["bidirectional"],
    title: "bidirectional path tracing",
    traces: "paths from both ends",
    paths_per_index: [8, 4],
    finds_beams: true,
    finds_late: LateFind::SeenCaustics,
    ..PATH
};

const PHOTON: IntegratorTraits = IntegratorTraits {
    name: "photon",
    plugins: &["photon"],
    title: "photon mapping",
    traces: "photons",
    photons: PhotonUse::Gathered,
    finds_beams: true,
    finds_late: LateFind::Highlights,
    hides_paths: Some("photon mapping gathers photons of all paths: its paths are not drawn"),
    ..PATH
};

const VCM: IntegratorTraits = IntegratorTraits {
    name: "vcm",
    plugins: &["vcm"],
    title: "vertex connection and merging",
    traces: "vertex connection and merging",
    photons: PhotonUse::Merged,
    extends: Some(IntegratorKind::Bidirectional),
    finds_late: LateFind::Highlights,
    ..BIDIRECTIONAL
};

const DEPTH: IntegratorTraits = IntegratorTraits {
    name: "depth",
    plugins: &["depth"],
    title: "distances",
    is_candidate: false,
    finds_late: LateFind::Nothing,
    no_light: Some(NoLight {
        shows: "distances",
        remark: "the picture shows distances as grey, in units of the scene",
        help: "distances beside a picture: an integrator `aov`, or --aov depth",
    }),
    ..PATH
};

/// The traits that hold until the method is chosen.
const AUTO: IntegratorTraits = IntegratorTraits {
    name: "auto",
    plugins: &["auto"],
    is_candidate: false,
    finds_late: LateFind::Nothing,
    ..PATH
};

impl IntegratorKind {
    /// The capabilities of the method.
    pub const fn traits(self) -> &'static IntegratorTraits {
        match self {
            Self::Path => &PATH,
            Self::Light => &LIGHT,
            Self::Bidirectional => &BIDIRECTIONAL,
            Self::Photon => &PHOTON,
            Self::Vcm => &VCM,
            Self::Depth => &DEPTH,
            Self::Auto => &AUTO,
        }
    }

    /// All methods, in the order of the help.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::value_variants().iter().copied()
    }

    /// The methods that the automatic choice tries.
    pub fn candidates() -> impl Iterator<Item = Self> {
        Self::all().filter(|kind| kind.traits().is_candidate)
    }

    /// The method's name on the command line and in files.
    pub const fn name(self) -> &'static str {
        self.traits().name
    }

    /// True for the methods whose camera paths gather photons.
    pub const fn has_photons(self) -> bool {
        !matches!(self.traits().photons, PhotonUse::None)
    }

    /// True for the methods that show light.
    pub const fn shows_light(self) -> bool {
        self.traits().no_light.is_none()
    }

    /// Whether it fills the camera stream and the light stream.
    pub const fn streams(self) -> [bool; 2] {
        let [camera, light] = self.traits().paths_per_index;
        [camera > 0, light > 0]
    }

    /// Paths of an index as they are counted: from the camera, if there are such.
    pub const fn paths_per_index(self) -> u64 {
        let [camera, light] = self.traits().paths_per_index;
        if camera > 0 { camera } else { light }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_command_line() {
        for kind in IntegratorKind::all() {
            let value = kind.to_possible_value().expect("no method is hidden");
            assert_eq!((value.get_name(), kind.traits().plugins.contains(&kind.name())), (kind.name(), true));
        }
    }
}
