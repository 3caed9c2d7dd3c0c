//! A thousand broken scene files and a thousand broken meshes: each is read, or refused with a place.

use std::path::Path;

use crate::guard::{folder, outcome, outcome_with, write};
use crate::messages::assert_has_place;
use pointillist::math::random::Random;

/// Numbers that break readers.
pub const NUMBERS: &[&str] = &[
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e39",
    "-1e39",
    "1e308",
    "1e999",
    "1e-999",
    "-0",
    "0",
    "4294967296",
    "2147483648",
    "-2147483649",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0x10",
    "1e",
    "",
    "++1",
    "1.5.2",
    "-1",
];

/// Pieces of XML in wrong places.
const PIECES: &[&str] = &[
    "<scene>",
    "</scene>",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?",
    "?>",
    "<!DOCTYPE a [",
    "&lt;",
    "&#0;",
    "&#x110000;",
    "&a;",
    "\"",
    "'",
    "<",
    ">",
    "/>",
    "$",
    "$$",
    "$nothing",
    "xmlns:a=\"b\"",
    "\u{0}",
    "\u{feff}",
    "\u{202e}",
    "é",
    "<shape type=\"obj\">",
    "<ref id=\"x\"/>",
    "<include filename=\"/dev/zero\"/>",
    "<include filename=\".\"/>",
    "<default name=\"\" value=\"$\"/>",
];

/// Pieces of OBJ in wrong places.
const LINES: &[&str] = &[
    "f 1 2 3",
    "f 0 0 0",
    "f -1 -2 -3",
    "f 1",
    "f 1 2",
    "f",
    "f 1//1 2/2 3",
    "f 1/2/3/4 1 1",
    "f 99999999999999999999 1 2",
    "f -9223372036854775808 1 2",
    "v",
    "v 1",
    "v nan nan nan",
    "v inf 0 0",
    "v 1e999 0 0",
    "v 1 2 3 4 5 6 7",
    "vt",
    "vt nan nan",
    "vn 0 0 0",
    "vn nan 0 0",
    "l 1 2",
    "p 1",
    "usemtl x",
    "mtllib /dev/zero",
    "g",
    "o",
    "s off",
    "#",
    "\\",
    "vp 1 2",
    "curv 0 1 1 2",
    "f 1 2 3 \\",
    "\u{0}",
];

/// One change to `bytes`.
pub fn corrupt(bytes: &mut Vec<u8>, random: &mut Random, pieces: &[&str]) {
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.below(8),
        2 => bytes[at] = random.below(256) as u8,
        3 => {
            let end = (at + 1 + random.below(40)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let end = (at + 1 + random.below(200)).min(bytes.len());
            let copy = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        5 => drop(bytes.splice(at..at, pieces[random.below(pieces.len())].bytes())),
        _ => number(bytes, at, NUMBERS[random.below(NUMBERS.len())]),
    }
    if bytes.is_empty() {
        bytes.push(b'\n');
    }
}

/// Replaces the first number after `at`.
fn number(bytes: &mut Vec<u8>, at: usize, new: &str) {
    let digit = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
    if let Some(start) = bytes[at..].iter().position(digit).map(|p| at + p) {
        let end = bytes[start..].iter().position(|b| !digit(b)).map_or(bytes.len(), |p| start + p);
        bytes.splice(start..end, new.bytes());
    }
}

/// A file of a scene, and how it is broken.
pub struct Broken<'a> {
    pub folder: &'a Path,
    /// Its name in the folder, which has `scene.xml`.
    pub file: &'a str,
    pub whole: &'a [u8],
    pub pieces: &'a [&'a str],
    pub seed: u64,
    /// A copy has from one to so many changes.
    pub most_changes: usize,
    /// Files that a message may be about.
    pub places: &'a [&'a str],
    pub lenient: bool,
}

impl Broken<'_> {
    /// Breaks a thousand copies and has each read. Returns how many were refused, with a place, and how many were read.
    pub fn thousand(&self) -> [usize; 2] {
        let mut random = Random(self.seed);
        let (mut refused, mut read) = (0, 0);
        for i in 0..1000 {
            let mut bytes = self.whole.to_vec();
            for _ in 0..=random.below(self.most_changes) {
                corrupt(&mut bytes, &mut random, self.pieces);
            }
            write(self.folder, self.file, &bytes);
            let what = format!("{} {i}: {}", self.file, String::from_utf8_lossy(&bytes));
            match outcome_with(self.folder, &what, self.lenient) {
                Ok(()) => read += 1,
                Err(shown) => {
                    assert_has_place(&what, &shown, self.places);
                    refused += 1;
                }
            }
        }
        [refused, read]
    }
}

const SCENE: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<!-- A scene with a little of everything. -->
<scene version="3.0.0">
  <default name="spp" value="16"/>
  <path value="."/>
  <include filename="part.xml"/>
  <integrator type="path"><integer name="max_depth" value="6"/><boolean name="hide_emitters" value="false"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/><string name="fov_axis" value="x"/>
    <float name="near_clip" value="0.1"/><float name="far_clip" value="100"/>
    <transform name="to_world"><lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="64"/><integer name="height" value="48"/>
      <integer name="crop_offset_x" value="3"/><integer name="crop_width" value="10"/><rfilter type="box"/>
    </film>
  </sensor>
  <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.6, 0.1, 0.1"/></bsdf>
  <bsdf type="twosided" id="both"><ref id="red"/><bsdf type="diffuse"><spectrum name="reflectance" value="400:0.1, 700:0.9"/></bsdf></bsdf>
  <alias id="red" as="crimson"/>
  <shape type="obj">
    <string name="filename" value="mesh.obj"/><ref id="crimson"/>
    <transform name="to_world"><scale x="1" y="2" z="3"/><rotate y="1" angle="30"/><translate value="1 2 3"/></transform>
  </shape>
  <shape type="sphere"><point name="center" x="0" y="1" z="0"/><float name="radius" value="0.5"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
  <shape type="rectangle"><transform name="to_world"><matrix value="1 0 0 0 0 1 0 0 0 0 1 2 0 0 0 1"/></transform>
    <emitter type="area"><rgb name="radiance" value="10"/></emitter></shape>
  <shape type="disk"><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
  <emitter type="point"><point name="position" value="0 4 0"/><spectrum name="intensity" value="5"/></emitter>
</scene>
"#;

/// A file of version 0.6 with what has changed since, and with plugins that are not supported.
const OLD: &str = r##"<?xml version="1.0" encoding="utf-8"?>
<scene version="0.6.0">
  <default name="sampleCount" value="16"/>
  <integrator type="adaptive"><integrator type="sppm"><integer name="maxDepth" value="6"/><integer name="kNN" value="9"/></integrator></integrator>
  <sensor type="thinlens">
    <string name="focalLength" value="35mm"/><float name="apertureRadius" value="0.1"/><float name="focusDistance" value="4"/>
    <transform name="toWorld"><lookAt origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/></transform>
    <sampler type="halton"><integer name="sampleCount" value="$sampleCount"/></sampler>
    <film type="ldrfilm"><integer name="width" value="64"/><float name="gamma" value="2.2"/><rfilter type="lanczos"/></film>
  </sensor>
  <medium type="homogeneous" id="fog"><phase type="hg"/></medium>
  <bsdf type="diffuse" id="red"><srgb name="diffuseReflectance" value="#802010"/></bsdf>
  <bsdf type="diffuse" id="tiles"><texture type="theirs" name="reflectance">
    <float name="uoffset" value="0.5"/><float name="uscale" value="4"/><integer name="vscale" value="2"/></texture></bsdf>
  <bsdf type="theirs" id="odd"><float name="intIOR" value="1.5"/></bsdf>
  <shape type="cube"><ref id="red"/><ref name="interior" id="fog"/></shape>
  <shape type="sphere"><boolean name="flipNormals" value="true"/><ref id="odd"/></shape>
  <shape type="theirs"><ref id="tiles"/><emitter type="area"><blackbody name="radiance" temperature="5000K" scale="0.1"/></emitter></shape>
  <emitter type="theirs"><spectrum name="intensity" value="0.1, 0.2, 0.3"/></emitter>
  <emitter type="point"><spectrum name="intensity" value="0.1, 0.2, 0.3"/></emitter>
</scene>
"##;

/// A file as the viewer saves it.
const SAVED: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
  <default name="spp" value="4"/>
  <sensor type="perspective">
    <transform name="to_world"><matrix value="1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 -3.0 0.0 0.0 0.0 1.0"/></transform>
    <float name="fov" value="33.333333333333336"/><float name="near_clip" value="0.30000000000000004"/>
    <float name="far_clip" value="1e30"/><string name="fov_axis" value="smaller"/>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
  </sensor>
  <path value="."/>
  <include filename="scene.xml"/>
  <edit object="shape" index="3" count="5" type="rectangle" name="emission_scale" value="2.0"/>
  <edit object="bsdf" id="red" name="reflectance" value="0.1, 0.2, 0.30000000000000004"/>
  <edit object="bsdf" index="4" count="7" type="dielectric" name="int_ior" value="1.8"/>
  <edit object="emitter" index="0" count="1" type="point" name="emission_scale" value="0.0"/>
</scene>
"#;

/// Pieces of edits in wrong places.
const EDITS: &[&str] = &[
    "<edit/>",
    "<edit object=\"bsdf\" id=\"red\" name=\"reflectance\" value=\"1\"/>",
    "<edit object=\"shape\" id=\"c\" name=\"emission_scale\" value=\"1\"/>",
    "<edit object=\"shape\" index=\"0\" count=\"0\" type=\"\" name=\"emission_scale\" value=\"\"/>",
    "<edit object=\"emitter\" index=\"4294967295\" count=\"1\" type=\"point\" name=\"emission_scale\" value=\"1\"/>",
    " id=\"red\"",
    " index=\"1\"",
    "<edit object=\"bsdf\">",
    "</edit>",
    "<include filename=\"saved.xml\"/>",
    "<include filename=\"scene.xml\"/>",
    "$spp",
    "\u{0}",
];

const PART: &str = "<scene version=\"3.0.0\"><shape type=\"cube\" id=\"c\"/></scene>\n";

/// A bent grid of 6 × 6 vertices with everything an OBJ file can have.
fn mesh() -> String {
    let mut text = String::from("# a grid\nmtllib a.mtl\no grid\n");
    for i in 0..36 {
        let (x, y) = (i % 6, i / 6);
        text += &format!("v {x}.5 {} {y}.25\nvt 0.{x} 0.{y}\nvn 0 1 0\n", x * y);
    }
    text += "usemtl a\ns 1\n";
    for i in (0..30).filter(|i| i % 6 != 5) {
        let (a, b, c, d) = (i + 1, i + 2, i + 8, i + 7);
        text += &match i % 3 {
            0 => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d}\n"),
            1 => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf -36/-36/-36 {c}/{c}/{c} {d}/{d}/{d}\n"),
            _ => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d} {a}/{a}/{a}\n"),
        };
    }
    text
}

#[test]
fn a_thousand_broken_scenes() {
    let folder = folder("broken_scenes");
    write(&folder, "part.xml", PART.as_bytes());
    write(&folder, "mesh.obj", mesh().as_bytes());
    write(&folder, "scene.xml", SCENE.as_bytes());
    assert_eq!(outcome(&folder, "the whole scene"), Ok(()));
    let [refused, _] = Broken {
        folder: &folder,
        file: "scene.xml",
        whole: SCENE.as_bytes(),
        pieces: PIECES,
        seed: 20_261_121,
        most_changes: 3,
        places: &["scene.xml", "part.xml", "mesh.obj"],
        lenient: false,
    }
    .thousand();
    assert!(refused > 500, "only {refused} of 1000 were refused: are they broken at all?");
}

#[test]
fn a_thousand_broken_old_scenes() {
    let folder = folder("broken_old_scenes");
    write(&folder, "scene.xml", OLD.as_bytes());
    assert_eq!(outcome_with(&folder, "the whole scene", true), Ok(()));
    assert!(outcome(&folder, "the whole scene").is_err());
    let [refused, read] = Broken {
        folder: &folder,
        file: "scene.xml",
        whole: OLD.as_bytes(),
        pieces: PIECES,
        seed: 60_606,
        most_changes: 3,
        places: &["scene.xml"],
        lenient: true,
    }
    .thousand();
    assert!(refused > 500 && read > 50, "{refused} refused, {read} read");
}

#[test]
fn a_thousand_broken_meshes() {
    let folder = folder("broken_meshes");
    write(&folder, "part.xml", PART.as_bytes());
    write(&folder, "scene.xml", SCENE.as_bytes());
    let [refused, read] = Broken {
        folder: &folder,
        file: "mesh.obj",
        whole: mesh().as_bytes(),
        pieces: LINES,
        seed: 4_711,
        most_changes: 4,
        places: &["mesh.obj"],
        lenient: false,
    }
    .thousand();
    assert!(refused > 50 && read > 50, "{refused} refused, {read} read");
}

#[test]
fn a_thousand_broken_saved_files() {
    let folder = folder("broken_saved");
    write(&folder, "part.xml", PART.as_bytes());
    write(&folder, "mesh.obj", mesh().as_bytes());
    // `outcome` reads `scene.xml`: that is the saved file here, and what it includes has another name.
    write(&folder, "original.xml", SCENE.as_bytes());
    let saved = SAVED.replace("scene.xml", "original.xml");
    write(&folder, "scene.xml", saved.as_bytes());
    assert_eq!(outcome(&folder, "the whole file"), Ok(()));
    let [refused, read] = Broken {
        folder: &folder,
        file: "scene.xml",
        whole: saved.as_bytes(),
        pieces: EDITS,
        seed: 5_050,
        most_changes: 3,
        places: &["scene.xml", "original.xml", "part.xml", "mesh.obj"],
        lenient: false,
    }
    .thousand();
    assert!(refused > 500 && read > 10, "{refused} refused, {read} read");
}
