//! A million messages of noise and of proper messages that were changed: refused or read, never believed beyond their bounds.

use pointillist::math::bits::mix;
use pointillist::remote::blocks;
use pointillist::remote::message::{FRAME_HEADER, Kind, Side, ToTracer, ToViewer};
use pointillist::stream::Block;

use crate::held_memory;

const MESSAGES: u64 = 1_000_000;

/// The frames of the corpus that libFuzzer begins with, and the side that sends each.
fn proper() -> Vec<(Side, Vec<u8>)> {
    let corpus = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/fuzz_targets/corpus/message");
    let files = std::fs::read_dir(corpus).unwrap().map(|entry| std::fs::read(entry.unwrap().path()).unwrap());
    let sender = |frame: &[u8]| {
        let header = *frame.first_chunk().unwrap();
        let sends = |side: &Side| Kind::of_frame(header, *side).is_ok();
        [Side::Viewer, Side::Tracer].into_iter().find(sends).unwrap()
    };
    let mut frames: Vec<_> = files.map(|frame| (sender(&frame), frame)).collect();
    // The same in every run.
    frames.sort_by(|a, b| a.1.cmp(&b.1));
    frames
}

/// Reads a frame as the other side does; true if it made sense.
fn read(sender: Side, frame: &[u8], block: &mut Box<Block>) -> bool {
    let Some((header, payload)) = frame.split_first_chunk::<FRAME_HEADER>() else { return false };
    let Ok((kind, length)) = Kind::of_frame(*header, sender) else { return false };
    assert!(length <= 1 << 20, "{kind:?}");
    let Some(payload) = payload.get(..length) else { return false };
    if sender == Side::Viewer {
        return ToTracer::read(kind, payload).is_ok();
    }
    match ToViewer::read(kind, payload) {
        Ok(ToViewer::Samples(payload)) => blocks::read(payload, block, |block| {
            assert!(block.samples().iter().all(|s| s.is_sound() && s.uv.iter().all(|c| c.abs() <= 2.0)));
        })
        .is_ok(),
        other => other.is_ok(),
    }
}

#[test]
fn a_million_messages() {
    let proper = proper();
    let (mut block, mut fine) = (Box::default(), 0);
    assert!(proper.iter().all(|(sender, frame)| read(*sender, frame, &mut block)));
    let start = held_memory::start();
    for k in 0..MESSAGES {
        let random = |i: u64| mix(k << 20 | i);
        let (sender, frame) = &proper[(random(0) % proper.len() as u64) as usize];
        let mut frame = frame.clone();
        match random(1) % 4 {
            // Noise.
            0 => frame = (0..random(2) % 64).map(|i| random(100 + i) as u8).collect(),
            // Truncated.
            1 => frame.truncate((random(2) % (frame.len() as u64 + 1)) as usize),
            // The length alone is changed.
            2 => {
                let at = 1 + (random(2) % 4) as usize;
                frame[at] = random(3) as u8;
            }
            // Some bytes are changed.
            _ => {
                for i in 0..1 + random(2) % 4 {
                    let at = (random(3 + 2 * i) % frame.len() as u64) as usize;
                    frame[at] = random(4 + 2 * i) as u8;
                }
            }
        }
        fine += u64::from(read(*sender, &frame, &mut block));
    }
    println!("{fine} of {MESSAGES} made sense");
    assert!((MESSAGES / 100..MESSAGES / 2).contains(&fine), "{fine} of {MESSAGES}");
    assert!(
        held_memory::peak_since(start) < held_memory::MOST / 4,
        "{} bytes",
        held_memory::peak_since(start)
    );
}
