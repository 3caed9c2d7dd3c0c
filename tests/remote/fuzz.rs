//! A million messages of noise and of proper messages that were changed: refused or read, never believed beyond their bounds.

use pointillist::math::bits::mix;
use pointillist::remote::blocks::{self, PartedBlock};
use pointillist::remote::message::{
    Ended, FRAME_HEADER, FileStart, Kind, Refusal, RejectedValues, Request, Side, ToTracer, ToViewer, Welcome,
};
use pointillist::stream::{Block, Epoch, FinishReason, Sample};

use crate::held_memory;

const MESSAGES: u64 = 1_000_000;

/// One frame of every kind, with the side that sends it.
fn proper() -> Vec<(Side, Vec<u8>)> {
    let request = Request {
        epoch: 7,
        seed: 3,
        paths: Some(9),
        compressed: true,
        finest: 512,
        order: "{\"size\":[1,2]}".into(),
    };
    let (mut payload, mut block) = (Vec::new(), Block::default());
    block.restart(Epoch(3), 1024);
    for i in 0..20 {
        block.push(Sample {
            uv: [0.05 * i as f32, 0.5],
            xyz: pointillist::color::Xyz::new(1.0, 2.0, 3.0),
            w: 1.0,
        });
    }
    blocks::begin(&mut payload, Epoch(3));
    for compressed in [false, true] {
        assert!(PartedBlock::new(&block, compressed).write(&mut payload, 4000));
    }
    let to_tracer = [
        ToTracer::Render(request),
        ToTracer::Abort,
        ToTracer::Credit(77),
        ToTracer::Ping(1 << 40),
        ToTracer::Fetch,
    ];
    let to_viewer = [
        ToViewer::Welcome(Welcome::default()),
        ToViewer::Samples(&payload),
        ToViewer::Ended(Ended { epoch: 3, reason: FinishReason::Complete }),
        ToViewer::Pong(5),
        ToViewer::Refused(Refusal { epoch: 0, why: "busy".into() }),
        ToViewer::Rejected(RejectedValues::default()),
        ToViewer::File(FileStart { path: "a/b.xml".into(), length: 3 }),
        ToViewer::FilePart(&[9; 100]),
        ToViewer::FilesEnd,
    ];
    let mut frames = Vec::new();
    for message in to_tracer {
        frames.push((Side::Viewer, Vec::new()));
        message.write(&mut frames.last_mut().unwrap().1);
    }
    for message in to_viewer {
        frames.push((Side::Tracer, Vec::new()));
        message.write(&mut frames.last_mut().unwrap().1);
    }
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
