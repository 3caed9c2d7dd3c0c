//! A stream on disk comes back as it was; a damaged file is an error with a place, never a panic or a bad sample.

use pointillist::color::Xyz;
use pointillist::stream::{
    Block, Cause, Epoch, PathCounts, Player, RecordError, Recorder, Rejections, Sample,
};

fn blocks() -> Vec<Block> {
    (0..4u64)
        .map(|n| {
            let mut block = Block::default();
            block.restart(Epoch(3), 10 * n);
            for i in 0..5 * n {
                let w = if i % 2 == 0 { -1.0 } else { 0.5 };
                block.push(Sample {
                    uv: [i as f32 / 20.0, 0.5],
                    xyz: Xyz::new(i as f32, n as f32, 1e-30),
                    w,
                });
            }
            block.header.index_count = 10;
            block.header.paths = PathCounts { camera: 10, light: n };
            (0..n).for_each(|i| block.header.rejections.add(10 * n + i, Cause::ALL[i as usize]));
            block
        })
        .collect()
}

fn recorded() -> Vec<u8> {
    let mut recorder = Recorder::new(Vec::new()).expect("memory");
    blocks().iter().for_each(|block| recorder.block(block).expect("memory"));
    recorder.into_inner()
}

/// Reads to the end; checks what must hold for every sample that comes out.
fn play(bytes: &[u8]) -> Result<Vec<Block>, RecordError> {
    let mut player = Player::new(bytes)?;
    let mut blocks = Vec::new();
    while let Some(block) = player.next_block()? {
        for s in block.samples() {
            assert!(s.in_range() && s.uv[0].is_finite() && s.uv[1].is_finite());
            assert!(s.w == -1.0 || (s.w > 0.0 && s.w.is_finite()));
        }
        blocks.push(block.clone());
    }
    Ok(blocks)
}

#[test]
fn what_was_recorded_comes_back() {
    let played = play(&recorded()).expect("whole");
    assert_eq!(played.len(), 4);
    for (a, b) in played.iter().zip(blocks()) {
        assert_eq!((a.header, a.samples()), (b.header, b.samples()));
    }
}

#[test]
fn every_cut_is_noticed_except_between_blocks() {
    let bytes = recorded();
    let whole = (0..bytes.len()).filter(|&len| play(&bytes[..len]).is_ok()).count();
    assert_eq!(whole, 4, "after the magic bytes and after each block but the last");
    let error = play(&bytes[..bytes.len() - 1]).expect_err("cut").to_string();
    assert!(error.contains("block 3"), "{error}");
}

#[test]
fn flipped_bytes_never_panic_nor_let_a_bad_sample_through() {
    let bytes = recorded();
    let mut refused = 0;
    for at in 0..bytes.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut bad = bytes.clone();
            bad[at] ^= flip;
            refused += usize::from(play(&bad).is_err());
        }
    }
    assert!(refused > 100, "{refused}");
    assert!(matches!(play(b"PTSTRM\x00\x01"), Err(RecordError::Magic)));
    assert_eq!(Rejections::from_parts([0; Cause::ALL.len()], []), Rejections::default());
}
