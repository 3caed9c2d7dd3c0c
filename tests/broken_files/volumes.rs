//! Broken grids of volumes, and those that say they are larger than they are: each is read, or refused with a place.

use pointillist::math::random::Random;

use crate::corrupt::corrupt;
use crate::guard::{folder, outcome, write};
use crate::messages::assert_has_place;

/// Numbers of points that break readers.
const COUNTS: &[i32] = &[0, -1, 1, 255, 65_536, 1 << 24, i32::MAX, i32::MIN];

/// Pieces of headers in wrong places.
const PIECES: &[&str] =
    &["VOL\u{3}", "VOL\u{2}", "\u{3}\0\0\0", "\u{7f}\u{7f}\u{7f}\u{7f}", "\0\0\u{40}\u{7f}"];

/// A grid of 5 × 4 × 3 points with three channels, in each encoding.
fn grids() -> Vec<Vec<u8>> {
    let of = |encoding: i32, width: usize| {
        let mut bytes = b"VOL\x03".to_vec();
        [encoding, 5, 4, 3, 3].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        [0f32, 0.0, 0.0, 1.0, 2.0, 3.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend((0..5 * 4 * 3 * 3 * width).map(|i| if i % width + 1 == width { 0x3c } else { 7 }));
        bytes
    };
    vec![of(1, 4), of(2, 2), of(3, 1)]
}

#[test]
fn a_thousand_broken_grids() {
    let folder = folder("broken_vol");
    let scene = "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/><bsdf type=\"diffuse\">\
                 <texture type=\"volume\" name=\"reflectance\"><volume type=\"gridvolume\"><boolean name=\"use_grid_bbox\" value=\"true\"/>\
                 <string name=\"filename\" value=\"grid.vol\"/></volume></texture></bsdf></scene>";
    write(&folder, "scene.xml", scene.as_bytes());
    let mut random = Random(79);
    let (mut refused, mut read) = (0, 0);
    for valid in grids() {
        write(&folder, "grid.vol", &valid);
        assert_eq!(outcome(&folder, "whole"), Ok(()));
        for i in 0..400 {
            let mut bytes = valid.clone();
            if i % 2 == 0 {
                let at = 4 + 4 * random.below(11);
                bytes[at..at + 4].copy_from_slice(&COUNTS[random.below(COUNTS.len())].to_le_bytes());
            } else {
                (0..=random.below(3)).for_each(|_| corrupt(&mut bytes, &mut random, PIECES));
            }
            write(&folder, "grid.vol", &bytes);
            match outcome(&folder, &format!("grid {i}")) {
                Ok(()) => read += 1,
                Err(shown) => {
                    assert_has_place("a grid", &shown, &["scene.xml"]);
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 200 && read > 100, "{refused} refused, {read} read");
}
