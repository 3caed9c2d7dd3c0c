//! Blocks of samples as bytes: as they are, or in 12 bytes per sample, or in 16 with a weight for each.
//!
//! A payload is the epoch (u64) and one part after the other. A part is some samples of a block: a block that is longer than what may be
//! sent at once is cut, and each part has its share of the paths. All numbers are little endian.
//!
//! ```text
//! part:    first index u64, number of indices u64, camera paths u64, light paths u64, rejected u64,
//!          samples u16, form u8 (0 plain, 1 short, 2 weighed), camera weight f32
//! plain:   the sample as it is in memory, [u, v], [x, y, z, w], 6 × f32
//! short:   96 bits from the lowest: stream 1, u 20, v 20, x 18, y 19, z 18
//! weighed: a short sample and its weight f32
//! ```
//!
//! The short form keeps what a picture can show. A position is kept to 2⁻¹⁹ of the picture: 4096 pixels have 128 steps each. A colour is kept as a floating-point number without sign, with the 8 bits of an `f32`'s exponent and 10 or 11
//! of its fraction, rounded up or down by chance so that its expectation is exact: sums over many samples are not shifted, as half floats
//! would shift them, and the variance of a sample grows by less than 10⁻⁶ of its square.
//! The weight is that of all camera samples of the part, or −1 on the light stream; where weights differ each sample has its own.

use crate::color::Xyz;
use crate::math::bits::mix;
use crate::stream::{BLOCK_SAMPLES, Block, Epoch, Header, PathCounts, Sample};

use super::message::MessageError;

/// Bytes of a part before its samples.
const PART_HEADER: usize = 5 * 8 + 2 + 1 + 4;

/// Bytes of a sample in the short form.
pub const SHORT: usize = 12;

/// How the samples of a part are written; the numbers are those that are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum SampleForm {
    Plain = 0,
    Short = 1,
    Weighed = 2,
}

impl SampleForm {
    fn of(number: u8) -> Option<Self> {
        [Self::Plain, Self::Short, Self::Weighed].into_iter().find(|form| *form as u8 == number)
    }

    /// Bytes of a sample.
    fn bytes(self) -> usize {
        match self {
            Self::Plain => size_of::<Sample>(),
            Self::Short => SHORT,
            Self::Weighed => SHORT + size_of::<f32>(),
        }
    }
}

/// Largest distance of a sample from the picture, in units of the picture. Windows are smaller by far.
const FAR: f32 = 2.0;

/// Positions of the short form lie within ±`SPAN` of the middle of the picture, which contains the overscan of every film.
const SPAN: f32 = 1.0;

/// Most paths of a block that are believed.
const MOST_PATHS: u64 = 1 << 40;

const POSITION_BITS: u32 = 20;

/// Bits of x, y and z in the short form.
const COLOR_BITS: [u32; 3] = [18, 19, 18];

/// A block on its way, and how many of its samples have left.
#[derive(Debug)]
pub struct PartedBlock {
    block: Box<Block>,
    sent: usize,
    /// Weight of all camera samples, if they have the same; 0 where they differ.
    weight: f32,
    form: SampleForm,
}

impl PartedBlock {
    /// A copy of a block; `compressed`: it may be sent in the short form.
    pub fn new(block: &Block, compressed: bool) -> Self {
        let samples = block.samples();
        let weight = samples.iter().map(|s| s.w).find(|w| *w > 0.0).unwrap_or(1.0);
        let alike = samples.iter().all(|s| s.w == weight || s.w == -1.0);
        let near = |c: f32| (c - 0.5).abs() < SPAN;
        let fits = samples.iter().all(|s| s.uv.into_iter().all(near));
        let form = match (compressed && fits, alike) {
            (false, _) => SampleForm::Plain,
            (true, true) => SampleForm::Short,
            (true, false) => SampleForm::Weighed,
        };
        Self { block: Box::new(block.clone()), sent: 0, weight, form }
    }

    /// Appends the next part to a payload that may become `most` bytes long. Returns whether the block has left as a whole; where not even
    /// one sample fits nothing is appended.
    pub fn write(&mut self, payload: &mut Vec<u8>, most: usize) -> bool {
        let left = self.block.samples().len() - self.sent;
        let room = most.saturating_sub(payload.len());
        let fits = room.saturating_sub(PART_HEADER) / self.form.bytes();
        if room < PART_HEADER || fits == 0 && left > 0 {
            return false;
        }
        let (count, last) = (left.min(fits), left <= fits);
        let Header { first_index, index_count, paths, rejected, .. } = self.block.header;
        // Each part has its share of the paths: a connection may break between two of them.
        let all = self.block.samples().len().max(1) as u64;
        let until = |sent: usize, n: u64| n * sent as u64 / all;
        let share = |n: u64| if last { n } else { until(self.sent + count, n) } - until(self.sent, n);
        let counts = [index_count, paths.camera, paths.light, rejected].map(share);
        payload.extend(first_index.to_le_bytes());
        counts.iter().for_each(|n| payload.extend(n.to_le_bytes()));
        payload.extend((count as u16).to_le_bytes());
        payload.push(self.form as u8);
        payload.extend(self.weight.to_le_bytes());
        let samples = &self.block.samples()[self.sent..self.sent + count];
        if self.form == SampleForm::Plain {
            payload.extend(bytemuck::cast_slice::<Sample, u8>(samples));
        } else {
            for (place, sample) in (self.sent..).zip(samples) {
                payload.extend(shorten(sample, mix(first_index ^ (place as u64) << 48)));
                if self.form == SampleForm::Weighed {
                    payload.extend(sample.w.to_le_bytes());
                }
            }
        }
        self.sent += count;
        last
    }
}

/// Begins a payload.
pub fn begin(payload: &mut Vec<u8>, epoch: Epoch) {
    payload.clear();
    payload.extend(epoch.0.to_le_bytes());
}

/// The epoch of a payload.
///
/// # Errors
///
/// [`MessageError::Content`] where it has none.
pub fn epoch(payload: &[u8]) -> Result<Epoch, MessageError> {
    PartReader(payload).u64().map(Epoch)
}

/// Reads the parts of a payload into `block`, one after the other, and calls `take` for each. `take` may swap the block for another one.
///
/// # Errors
///
/// [`MessageError::Content`] for what is no block: too short, with samples that are [not sound](Sample::is_sound), with a weight that no
/// stream has, or with unbelievable numbers of paths. Parts before it were taken.
pub fn read(
    payload: &[u8],
    block: &mut Box<Block>,
    mut take: impl FnMut(&mut Box<Block>),
) -> Result<(), MessageError> {
    let mut reader = PartReader(payload);
    let epoch = Epoch(reader.u64()?);
    while !reader.0.is_empty() {
        block.restart(epoch, reader.u64()?);
        let index_count = reader.u64()?;
        let paths = PathCounts { camera: reader.u64()?, light: reader.u64()? };
        let rejected = reader.u64()?;
        if [index_count, paths.camera, paths.light, rejected].iter().any(|n| *n > MOST_PATHS)
            || block.header.first_index.checked_add(index_count).is_none()
        {
            return Err(wrong("the number of paths"));
        }
        block.header = Header { index_count, paths, rejected, ..block.header };
        let count = usize::from(u16::from_le_bytes(reader.take()?));
        let [form] = reader.take()?;
        let weight = f32::from_le_bytes(reader.take()?);
        let form = SampleForm::of(form).filter(|_| count <= BLOCK_SAMPLES);
        let form = form.ok_or_else(|| wrong("the number or the form of samples"))?;
        for _ in 0..count {
            let sample = match form {
                SampleForm::Plain => bytemuck::pod_read_unaligned(&reader.take::<{ size_of::<Sample>() }>()?),
                SampleForm::Short => lengthen(reader.take()?, weight),
                SampleForm::Weighed => {
                    let short = reader.take()?;
                    lengthen(short, f32::from_le_bytes(reader.take()?))
                }
            };
            let placed = sample.uv.iter().all(|c| c.abs() <= FAR);
            if !(placed && sample.is_sound() && (sample.w > 0.0 || sample.w == -1.0)) {
                return Err(wrong("a sample"));
            }
            block.push(sample);
        }
        take(block);
    }
    Ok(())
}

fn wrong(what: &str) -> MessageError {
    MessageError::Content(format!("{what} of a block"))
}

/// Reads a payload from front to back.
struct PartReader<'a>(&'a [u8]);

impl PartReader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], MessageError> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or_else(|| wrong("the end"))?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn u64(&mut self) -> Result<u64, MessageError> {
        self.take().map(u64::from_le_bytes)
    }
}

/// A sample in the short form; `random` decides its roundings.
fn shorten(sample: &Sample, random: u64) -> [u8; SHORT] {
    let mut bits = u128::from(sample.w < 0.0);
    let mut used = 1;
    let mut put = |value: u32, width: u32| {
        bits |= u128::from(value) << used;
        used += width;
    };
    for c in sample.uv {
        put(short_position(c), POSITION_BITS);
    }
    let Xyz { x, y, z } = sample.xyz;
    for (place, (value, width)) in [x, y, z].into_iter().zip(COLOR_BITS).enumerate() {
        put(short_color(value, width, (random >> (21 * place)) as u32), width);
    }
    let bytes = bits.to_le_bytes();
    std::array::from_fn(|i| bytes[i])
}

fn lengthen(bytes: [u8; SHORT], weight: f32) -> Sample {
    let mut bits = u128::from_le_bytes(std::array::from_fn(|i| bytes.get(i).copied().unwrap_or(0)));
    let mut take = |width: u32| {
        let value = (bits & ((1 << width) - 1)) as u32;
        bits >>= width;
        value
    };
    let light = take(1) == 1;
    let uv = [0, 1].map(|_| long_position(take(POSITION_BITS)));
    let [x, y, z] = COLOR_BITS.map(|width| f32::from_bits(take(width) << (31 - width)));
    Sample { uv, xyz: Xyz { x, y, z }, w: if light { -1.0 } else { weight } }
}

/// The step in which a position lies.
fn short_position(c: f32) -> u32 {
    let steps = f64::from(1u32 << POSITION_BITS);
    let at = (f64::from(c) - 0.5 + f64::from(SPAN)) / (2.0 * f64::from(SPAN)) * steps;
    (at as u32).min((1 << POSITION_BITS) - 1)
}

/// The middle of a step.
fn long_position(step: u32) -> f32 {
    let steps = f64::from(1u32 << POSITION_BITS);
    ((f64::from(step) + 0.5) / steps * 2.0 * f64::from(SPAN) - f64::from(SPAN) + 0.5) as f32
}

/// The first `width` of the 31 bits of a number from 0 on, rounded up or down by chance: the bits of floating-point numbers are in the
/// order of the numbers, and between neighbours of the short form they are linear in them.
fn short_color(value: f32, width: u32, random: u32) -> u32 {
    let lost = 31 - width;
    (value.to_bits() + (random & ((1 << lost) - 1))) >> lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::MAX_VALUE;

    fn number(random: u64) -> f32 {
        (random >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A full block; colours over many orders of magnitude.
    fn block(seed: u64, weights: &[f32]) -> Block {
        let mut block = Block::default();
        block.restart(Epoch(4), 5 * 1024);
        for i in 0..BLOCK_SAMPLES as u64 {
            let r: [f32; 5] = std::array::from_fn(|k| number(mix(seed << 32 | i << 8 | k as u64)));
            let scale = (20.0 * r[2] - 10.0).exp2();
            let xyz = Xyz { x: r[3] * scale, y: r[4] * scale, z: if i % 7 == 0 { 0.0 } else { scale } };
            block.push(Sample { uv: [1.2 * r[0] - 0.1, r[1]], xyz, w: weights[i as usize % weights.len()] });
        }
        let paths = PathCounts { camera: 700, light: 300 };
        block.header = Header { index_count: 1000, paths, rejected: 3, ..block.header };
        block
    }

    /// Sends a block in payloads of `most` bytes.
    fn through(block: &Block, compressed: bool, most: usize) -> Vec<Block> {
        let (mut sent, mut arrived) = (PartedBlock::new(block, compressed), Vec::new());
        let mut left = false;
        while !left {
            let mut payload = Vec::new();
            begin(&mut payload, block.header.epoch);
            left = sent.write(&mut payload, most);
            assert!(payload.len() <= most && payload.len() > 8, "{} bytes", payload.len());
            read(&payload, &mut Box::default(), |block| arrived.push((**block).clone())).expect("a block");
        }
        arrived
    }

    #[test]
    fn plain_blocks_arrive_as_they_are_in_any_number_of_parts() {
        for weights in [&[1.0][..], &[1.0, -1.0], &[0.25, 3.0, -1.0]] {
            let block = block(1, weights);
            for most in [100, 1000, 30_000] {
                let parts = through(&block, false, most);
                let samples: Vec<Sample> = parts.iter().flat_map(Block::samples).copied().collect();
                assert_eq!(samples, block.samples());
                let sum = |of: fn(&Header) -> u64| parts.iter().map(|part| of(&part.header)).sum::<u64>();
                let sums = [
                    sum(|h| h.index_count),
                    sum(|h| h.paths.camera),
                    sum(|h| h.paths.light),
                    sum(|h| h.rejected),
                ];
                assert_eq!(sums, [1000, 700, 300, 3]);
                assert!(
                    parts
                        .iter()
                        .all(|part| part.header.first_index == 5 * 1024 && part.header.epoch == Epoch(4))
                );
                // In proportion.
                let half = &parts[..parts.len() / 2];
                let (samples, paths) = half.iter().fold((0, 0), |(samples, paths), part| {
                    (samples + part.samples().len(), paths + part.header.paths.camera)
                });
                assert!(
                    (samples as f64 * 700.0 / 1024.0 - paths as f64).abs() < 2.0,
                    "{paths} paths of {samples}"
                );
            }
        }
    }

    /// Positions to 2⁻²⁰ of the window, colours to their last bit on either side, streams and weights exactly.
    #[test]
    fn the_short_form_keeps_what_it_promises() {
        let block = block(2, &[0.25, -1.0]);
        let parts = through(&block, true, 13_000);
        assert_eq!(parts.len(), 1, "12 bytes per sample");
        for (short, exact) in parts[0].samples().iter().zip(block.samples()) {
            assert_eq!(short.w, exact.w);
            for (a, b) in short.uv.into_iter().zip(exact.uv) {
                assert!((a - b).abs() <= 1.1 / (1 << POSITION_BITS) as f32, "{a} for {b}");
            }
            let colors = |xyz: Xyz| [xyz.x, xyz.y, xyz.z];
            for (i, (a, b)) in colors(short.xyz).into_iter().zip(colors(exact.xyz)).enumerate() {
                let last_bit = ((COLOR_BITS[i] - 8) as f32).exp2().recip();
                assert!((a - b).abs() <= b * last_bit, "{a} for {b}");
            }
        }
        // Where weights differ each sample has its own.
        let mixed = self::block(2, &[0.25, 31.0, -1.0]);
        let weights = |block: &Block| block.samples().iter().map(|s| s.w).collect::<Vec<_>>();
        assert_eq!(weights(&through(&mixed, true, 17_000)[0]), weights(&mixed));
    }

    /// Rounding has the right expectation: the mean of many roundings of one number, against its standard error.
    #[test]
    fn rounding_shifts_no_sum() {
        for (k, value) in [0.1, 1.0, 3.3, 1e-20, 7.77e5, 0.999_999_9, MAX_VALUE].into_iter().enumerate() {
            for width in COLOR_BITS {
                let n = 100_000;
                let roundings = (0..n).map(|i| {
                    let random = mix((k as u64) << 40 | u64::from(width) << 32 | i);
                    f64::from(f32::from_bits(short_color(value, width, random as u32) << (31 - width)))
                });
                let errors: Vec<f64> = roundings.map(|r| r / f64::from(value) - 1.0).collect();
                let mean = errors.iter().sum::<f64>() / n as f64;
                let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
                let z = mean / (variance / n as f64).sqrt().max(1e-12);
                assert!(z.abs() < 4.5, "{value} in {width} bits: z = {z:.1}, mean {mean:e}");
            }
        }
    }

    #[test]
    fn what_is_no_block_is_refused() {
        let mut payload = Vec::new();
        begin(&mut payload, Epoch(1));
        assert!(PartedBlock::new(&block(3, &[1.0]), false).write(&mut payload, 30_000));
        let refused = |payload: &[u8]| read(payload, &mut Box::default(), |_| {}).is_err();
        assert!(!refused(&payload));
        assert!((9..payload.len()).step_by(13).all(|n| refused(&payload[..n])), "truncated");
        let with = |at: usize, bytes: &[u8]| {
            let mut changed = payload.clone();
            changed[at..at + bytes.len()].copy_from_slice(bytes);
            refused(&changed)
        };
        let samples = 8 + PART_HEADER;
        assert!(with(8, &u64::MAX.to_le_bytes()), "indices beyond the last one");
        assert!(with(24, &(1u64 << 50).to_le_bytes()), "camera paths");
        assert!(with(48, &1025u16.to_le_bytes()), "samples");
        assert!(with(50, &[3]), "form");
        for value in [f32::NAN, f32::INFINITY, 7.0] {
            assert!(with(samples, &value.to_le_bytes()), "position {value}");
        }
        for value in [f32::NAN, -1.0, f32::INFINITY] {
            assert!(with(samples + 12, &value.to_le_bytes()), "colour {value}");
        }
        for value in [0.0f32, -2.0, f32::NAN] {
            assert!(with(samples + 20, &value.to_le_bytes()), "weight {value}");
        }
    }
}
