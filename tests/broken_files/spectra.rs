//! A thousand broken spectrum files, lists of wavelengths and graphs of includes: each is read, or refused with a place.

use crate::corrupt::corrupt;
use crate::guard::{folder, outcome, write};
use crate::messages::assert_has_place;
use pointillist::math::random::Random;

/// Pieces of spectra in wrong places.
const PIECES: &[&str] = &[
    "400:1 ",
    "400:1:2",
    "400",
    ":",
    ",,,",
    "nan:nan",
    "1e300:1",
    "0:0",
    "-500 1\n",
    "500 1\n500 2\n",
    "700 -1\n",
    "#",
    "\n\n",
    "\u{0}",
    "é",
    "1e-400",
    "\"",
];

/// Breaks `valid` a thousand times; `scene` makes the scene and the spectrum file of each.
fn thousand(name: &str, valid: &str, scene: impl Fn(&[u8]) -> (Vec<u8>, Vec<u8>)) {
    let folder = folder(name);
    let mut random = Random(1_234);
    let (mut refused, mut read) = (0, 0);
    for i in 0..=1000 {
        let mut bytes = valid.as_bytes().to_vec();
        if i > 0 {
            (0..=random.below(3)).for_each(|_| corrupt(&mut bytes, &mut random, PIECES));
        }
        let (xml, spd) = scene(&bytes);
        write(&folder, "scene.xml", &xml);
        write(&folder, "curve.spd", &spd);
        let what = format!("{name} {i}: {}", String::from_utf8_lossy(&bytes));
        match outcome(&folder, &what) {
            Ok(()) => read += 1,
            Err(shown) => {
                assert!(i > 0, "the whole spectrum: {shown}");
                assert_has_place(&what, &shown, &["scene.xml", "curve.spd"]);
                refused += 1;
            }
        }
    }
    assert!(refused > 100 && read > 20, "{name}: {refused} refused, {read} read");
}

fn scene(spectrum: &[u8]) -> Vec<u8> {
    let before = "<scene version=\"3.0.0\">\n<sensor type=\"perspective\"/><emitter type=\"constant\">";
    [before.as_bytes(), spectrum, b"</emitter></scene>"].concat()
}

#[test]
fn a_thousand_broken_spectrum_files() {
    let valid: String =
        (0..40).map(|i| format!("{} {}\n", 360 + 12 * i, 0.5 + 0.01 * f64::from(i))).collect();
    let named = scene(b"<spectrum name=\"radiance\" filename=\"curve.spd\"/>");
    thousand("broken_spd", &format!("# nm value\n{valid}"), |bytes| (named.clone(), bytes.to_vec()));
}

#[test]
fn a_thousand_broken_lists_of_wavelengths() {
    let list: String = (0..40).map(|i| format!("{}:{} ", 360 + 12 * i, 0.5 + 0.01 * f64::from(i))).collect();
    let in_line = |bytes: &[u8]| [b"<spectrum name=\"radiance\" value=\"", bytes, b"\"/>"].concat();
    thousand("broken_inline", &list, |bytes| (scene(&in_line(bytes)), Vec::new()));
}

#[test]
fn a_thousand_broken_spectrum_plugins() {
    let plugin = "<spectrum name=\"radiance\" type=\"irregular\"><string name=\"wavelengths\" value=\"400, 500, 600, 700\"/>\
                  <string name=\"values\" value=\"1, 2, 3, 4\"/></spectrum>";
    thousand("broken_irregular", plugin, |bytes| (scene(bytes), Vec::new()));
    let plugin = "<spectrum name=\"radiance\" type=\"regular\"><float name=\"wavelength_min\" value=\"400\"/>\
                  <float name=\"wavelength_max\" value=\"700\"/><string name=\"values\" value=\"1, 2, 3, 4\"/></spectrum>";
    thousand("broken_regular", plugin, |bytes| (scene(bytes), Vec::new()));
}

/// Files that include each other at random, themselves and files that are not there.
#[test]
fn a_thousand_graphs_of_includes() {
    const FILES: usize = 6;
    let folder = folder("include_graphs");
    let mut random = Random(99);
    let (mut circles, mut missing, mut read) = (0, 0, 0);
    for i in 0..1000 {
        for file in 0..FILES {
            let include = |random: &mut Random| {
                // Mostly forward, so that some graphs have an end.
                let back = random.below(6) == 0;
                let to = if back { random.below(FILES) } else { file + 1 + random.below(FILES - file) };
                let name = if to >= FILES && random.below(8) > 0 { return String::new() } else { to };
                format!("<include filename=\"../include_graphs/part{name}.xml\"/>")
            };
            let includes: String = (0..random.below(4)).map(|_| include(&mut random)).collect();
            let body =
                if file == 0 { "<sensor type=\"perspective\"/><emitter type=\"constant\"/>" } else { "" };
            let text = format!("<scene version=\"3.0.0\">\n{body}{includes}</scene>");
            let name = if file == 0 { "scene.xml".to_owned() } else { format!("part{file}.xml") };
            write(&folder, &name, text.as_bytes());
        }
        let what = format!("graph {i}");
        match outcome(&folder, &what) {
            Ok(()) => read += 1,
            Err(shown) => {
                assert_has_place(&what, &shown, &[".xml"]);
                circles += usize::from(shown.contains("includes itself"));
                missing += usize::from(shown.contains("cannot read"));
            }
        }
    }
    assert_eq!(read + circles + missing, 1000, "{read} read, {circles} circles, {missing} missing");
    assert!(read > 100 && circles > 50 && missing > 50, "{read} read, {circles} circles, {missing} missing");
}
