//! Broken media: each is read, or refused with a place.

use pointillist::scene::load_str;

use crate::corrupt::{Broken, NUMBERS};
use crate::guard::{folder, guarded, outcome, write};
use crate::messages::{assert_has_place, render};
use pointillist::tracer::{Camera, Scene};

/// Pieces of media in wrong places.
const PIECES: &[&str] = &[
    "<medium type=\"homogeneous\"/>",
    "<medium type=\"heterogeneous\" id=\"smoke\">",
    "</medium>",
    "<ref id=\"milk\"/>",
    "<ref name=\"interior\" id=\"milk\"/>",
    "<ref name=\"exterior\" id=\"smoke\"/>",
    "<phase type=\"hg\"/>",
    "<phase type=\"blendphase\">",
    "<phase type=\"tabphase\"><string name=\"values\" value=\"nan, -1, 1e39\"/></phase>",
    "<phase type=\"sggx\"><volume name=\"S\" type=\"constvolume\"><string name=\"value\" value=\"1, 1, 1, nan, 9, -9\"/></volume></phase>",
    "<phase type=\"sggx\"><volume name=\"S\" type=\"gridvolume\"><string name=\"filename\" value=\"grid.vol\"/></volume></phase>",
    "<volume name=\"sigma_t\" type=\"gridvolume\"><string name=\"filename\" value=\"nothing.vol\"/></volume>",
    "<volume name=\"albedo\" type=\"constvolume\"><float name=\"value\" value=\"-1\"/></volume>",
    "<string name=\"material\" value=\"skimmilk\"/>",
    "<float name=\"scale\" value=\"1e30\"/>",
    "<rgb name=\"radiance\" value=\"1e38, -1, inf\"/>",
    "<float name=\"temperature\" value=\"1e10\"/>",
    "<volume name=\"temperature\" type=\"gridvolume\"><string name=\"filename\" value=\"grid.vol\"/></volume>",
    "<float name=\"temperature_scale\" value=\"nan\"/>",
];

const SCENE: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="6"/></integrator>
  <medium type="homogeneous" id="milk"><rgb name="sigma_t" value="1, 2, 3"/><rgb name="radiance" value="3, 2, 1"/><float name="albedo" value="0.9"/><float name="scale" value="2"/>
    <phase type="blendphase"><float name="weight" value="0.25"/><phase type="hg"><float name="g" value="0.8"/></phase>
      <phase type="rayleigh"/></phase></medium>
  <medium type="heterogeneous" id="smoke"><volume name="sigma_t" type="gridvolume"><string name="filename" value="grid.vol"/>
      <transform name="to_world"><scale x="1" y="2" z="3"/><rotate y="1" angle="30"/></transform></volume>
    <volume name="albedo" type="constvolume"><rgb name="value" value="0.5, 0.6, 0.7"/></volume>
    <volume name="temperature" type="gridvolume"><string name="filename" value="grid.vol"/></volume>
    <float name="temperature_scale" value="1800"/><float name="emission_scale" value="0.5"/>
    <phase type="sggx"><volume name="S" type="constvolume"><string name="value" value="0.9, 0.5, 0.2, 0.1, -0.2, 0.05"/></volume></phase></medium>
  <medium type="homogeneous" id="spectral"><phase type="tabphase"><string name="values" value="0.5, 1, 0, 3"/></phase><spectrum name="sigma_s" value="400:0.1, 700:9"/><spectrum name="sigma_a" value="1"/></medium>
  <sensor type="perspective"><ref name="medium" id="milk"/><transform name="to_world"><lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/></transform></sensor>
  <shape type="sphere"><bsdf type="null"/><ref name="interior" id="smoke"/><ref name="exterior" id="milk"/></shape>
  <shape type="cube"><transform name="to_world"><translate x="3"/></transform><bsdf type="null"/><ref name="interior" id="spectral"/></shape>
  <shape type="cube"><transform name="to_world"><translate x="5"/></transform><medium name="interior" type="homogeneous"><string name="material" value="ketchup"/></medium></shape>
  <emitter type="constant"/>
</scene>
"#;

/// A grid of 2 × 2 × 2 points with these values.
fn grid(values: [f32; 8]) -> Vec<u8> {
    let mut bytes = header(1, [2, 2, 2]);
    values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

/// The header of a grid with one channel.
fn header(encoding: i32, size: [i32; 3]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    [encoding, size[0], size[1], size[2], 1].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
    [0f32, 0.0, 0.0, 1.0, 1.0, 1.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

#[test]
fn a_thousand_broken_media() {
    let folder = folder("broken_media");
    write(&folder, "grid.vol", &grid([1.0; 8]));
    write(&folder, "scene.xml", SCENE.as_bytes());
    assert_eq!(outcome(&folder, "the whole scene"), Ok(()));
    let [refused, read] = Broken {
        folder: &folder,
        file: "scene.xml",
        whole: SCENE.as_bytes(),
        pieces: PIECES,
        seed: 20_261_130,
        most_changes: 3,
        places: &["scene.xml"],
        lenient: false,
    }
    .thousand();
    assert!(refused > 500 && read > 20, "{refused} refused, {read} read");
}

/// Reads and prepares a scene of one shape with this medium; the rendered message if it is refused.
fn prepared(medium: &str) -> Result<(), String> {
    let text = format!(
        "<scene version='3.0.0'><integrator type='volpath'/><sensor type='perspective'/><emitter type='constant'/>\
         <shape type='sphere'><bsdf type='null'/>{medium}</shape></scene>"
    );
    guarded(&medium.chars().take(200).collect::<String>(), move || {
        let desc = load_str("medium.xml", &text, &[]).map_err(|e| render(&e))?.desc;
        Camera::of(&desc).map_err(|e| e.to_string())?;
        Scene::prepare(&desc).map(|_| ()).map_err(|e| e.to_string())
    })
}

fn refused(medium: &str, words: &str) {
    let shown = prepared(medium).expect_err(medium);
    assert_has_place(medium, &shown, &["medium.xml"]);
    assert!(shown.contains(words), "{medium}: {shown}");
}

/// Every number in every place where a medium has one.
#[test]
fn hostile_numbers_of_media() {
    let homogeneous =
        |inside: String| format!("<medium name='interior' type='homogeneous'>{inside}</medium>");
    let (mut read, mut refused) = (0, 0);
    for number in NUMBERS {
        for inside in [
            format!("<float name='sigma_t' value='{number}'/>"),
            format!("<float name='albedo' value='{number}'/>"),
            format!("<float name='radiance' value='{number}'/>"),
            format!("<float name='temperature' value='{number}'/>"),
            format!(
                "<float name='temperature' value='1'/><float name='temperature_scale' value='{number}'/>"
            ),
            format!("<float name='temperature' value='2e3'/><float name='emission_scale' value='{number}'/>"),
            format!(
                "<volume name='temperature' type='constvolume'><float name='value' value='{number}'/></volume>"
            ),
            format!("<float name='scale' value='{number}'/>"),
            format!("<float name='sigma_s' value='{number}'/><float name='sigma_a' value='1'/>"),
            format!("<rgb name='sigma_t' value='1, {number}, 1'/>"),
            format!("<spectrum name='sigma_t' value='400:1, 500:{number}'/>"),
            format!("<phase type='hg'><float name='g' value='{number}'/></phase>"),
            format!("<phase type='tabphase'><string name='values' value='1, {number}, 1'/></phase>"),
            format!(
                "<phase type='sggx'><volume name='S' type='constvolume'><string name='value' value='1, 1, {number}, 0, 0, 0'/></volume></phase>"
            ),
            format!(
                "<phase type='sggx'><volume name='S' type='constvolume'><string name='value' value='1, 1, 1, 0, {number}, 0'/></volume></phase>"
            ),
            format!(
                "<phase type='blendphase'><float name='weight' value='{number}'/><phase type='isotropic'/><phase type='hg'/></phase>"
            ),
            format!(
                "<volume name='sigma_t' type='constvolume'><float name='value' value='{number}'/></volume>"
            ),
        ] {
            match prepared(&homogeneous(inside)) {
                Ok(()) => read += 1,
                Err(_) => refused += 1,
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(refused > 100 && read > 20, "{refused} refused, {read} read");
    let milk = |inside: &str| homogeneous(inside.to_owned());
    refused_all(&[
        (milk("<float name='sigma_t' value='nan'/>"), "number"),
        (milk("<float name='sigma_t' value='-1'/>"), ""),
        (milk("<float name='sigma_t' value='1e39'/>"), ""),
        (milk("<float name='albedo' value='2'/>"), ""),
        (milk("<float name='temperature' value='0'/>"), "above 0 K"),
        (milk("<float name='temperature' value='-1'/>"), "above 0 K"),
        (milk("<float name='temperature' value='2e9'/>"), "1e9 K"),
        (milk("<float name='temperature' value='inf'/>"), "number"),
        (
            milk("<float name='temperature' value='9'/><float name='temperature_scale' value='-1'/>"),
            "`temperature`",
        ),
        (
            milk("<float name='temperature' value='9'/><float name='emission_scale' value='1e13'/>"),
            "emission",
        ),
        (milk("<phase type='hg'><float name='g' value='1'/></phase>"), "mean cosine"),
        (milk("<phase type='tabphase'><string name='values' value='nan, -1, 1e39'/></phase>"), "number"),
        (milk("<phase type='sggx'/>"), "needs `S`"),
        (milk("<phase type='hg'><float name='g' value='-1'/></phase>"), "mean cosine"),
        (milk("<string name='material' value='nothing'/>"), "no medium is known"),
    ]);
}

fn refused_all(cases: &[(String, &str)]) {
    cases.iter().for_each(|(medium, words)| refused(medium, words));
}

/// Phase functions within each other, and media and phase functions that refer to themselves.
#[test]
fn nested_and_circular_media() {
    let phase = |phase: &str| format!("<medium name='interior' type='homogeneous'>{phase}</medium>");
    let open = "<phase type='blendphase'><float name='weight' value='.5'/><phase type='isotropic'/>";
    let deep = |depth: usize| open.repeat(depth) + "<phase type='isotropic'/>" + &"</phase>".repeat(depth);
    assert_eq!(prepared(&phase(&deep(2))), Ok(()));
    refused(&phase(&deep(1000)), "");
    // By references, elements need not lie within each other.
    let chain = |length: usize, last: &str| {
        let link = |i: usize| {
            let next = if i + 1 < length { format!("p{}", i + 1) } else { last.to_owned() };
            format!(
                "<phase type='blendphase' id='p{i}'><float name='weight' value='.5'/><phase type='isotropic'/><ref id='{next}'/></phase>"
            )
        };
        let links: String = (0..length).map(link).collect();
        format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><phase type='isotropic' id='end'/>{links}\
             <shape type='sphere'><medium name='interior' type='homogeneous'><ref id='p0'/></medium></shape></scene>"
        )
    };
    let outcome = |what: &str, text: String| {
        guarded(what, move || load_str("medium.xml", &text, &[]).map(|_| ()).map_err(|e| render(&e)))
    };
    assert_eq!(outcome("a short chain", chain(3, "end")), Ok(()));
    let cases =
        [("a chain of 1000", chain(1000, "end")), ("itself", chain(1, "p0")), ("a circle", chain(5, "p0"))];
    for (what, text) in cases {
        let shown = outcome(what, text).expect_err(what);
        assert_has_place(what, &shown, &["medium.xml"]);
    }
    for inside in [
        "<medium type='homogeneous' id='m'><ref id='m'/></medium>",
        "<medium type='homogeneous' id='m'><ref name='phase' id='m'/></medium>",
        "<medium type='heterogeneous' id='m'><ref name='sigma_t' id='m'/></medium>",
        "<medium type='homogeneous' id='m'><medium type='homogeneous'/></medium>",
    ] {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{inside}\
             <shape type='sphere'><ref name='interior' id='m'/></shape></scene>"
        );
        if let Err(shown) = outcome(inside, text) {
            assert_has_place(inside, &shown, &["medium.xml"]);
        }
    }
}

/// Files of grids that do not exist, are none, hold hostile numbers or say that they are larger than memory.
#[test]
fn hostile_grids_of_media() {
    let folder = folder("hostile_media");
    let scene = |name: &str, file: &str| {
        format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/><shape type=\"cube\"><bsdf type=\"null\"/>\
             <medium name=\"interior\" type=\"heterogeneous\"><volume name=\"{name}\" type=\"gridvolume\">\
             <string name=\"filename\" value=\"{file}\"/></volume></medium></shape></scene>"
        )
    };
    for file in ["nothing.vol", ".", "/dev/zero", "/dev/null", "scene.xml", ""] {
        for name in ["sigma_t", "temperature"] {
            write(&folder, "scene.xml", scene(name, file).as_bytes());
            let shown = outcome(&folder, file).expect_err(file);
            assert_has_place(file, &shown, &["scene.xml"]);
        }
    }
    let hostile = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, f32::MIN, 1e-45, -0.0];
    write(&folder, "grid.vol", &grid(hostile));
    for name in ["temperature", "sigma_t"] {
        write(&folder, "scene.xml", scene(name, "grid.vol").as_bytes());
        assert_eq!(outcome(&folder, "hostile values"), Ok(()));
    }
    // Numbers of points without values: refused by what they need, before that is taken.
    for (size, encoding, words) in [
        ([1024; 3], 1, "4.0 GiB"),
        ([1024; 3], 3, "1.0 GiB"),
        ([i32::MAX; 3], 1, "points"),
        ([i32::MAX, 1, 1], 2, "4.0 GiB"),
    ] {
        write(&folder, "grid.vol", &header(encoding, size));
        let shown = outcome(&folder, "a large header").expect_err("no values");
        assert_has_place("a large header", &shown, &["scene.xml"]);
        assert!(shown.contains(words), "{size:?}: {shown}");
    }
}
