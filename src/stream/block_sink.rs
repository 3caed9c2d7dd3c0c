//! The sink of a worker: it checks samples, fills blocks with them and sends the blocks.

use crate::color::Xyz;
use crate::stream::block::{BLOCK_SAMPLES, Block, MOST_GROUPS};
use crate::stream::control::Epoch;
use crate::stream::faults;
use crate::stream::lanes::LaneWriter;
use crate::stream::rejections::{Cause, Fault, FaultyValue, Rejected, Rejections, fault_of_sample};
use crate::stream::sample::{PathCounts, Sample, SampleSink, UvWindow};

/// Fraction of the window's extent by which a position may lie outside, because `min + u · extent` is rounded.
const WINDOW_SLACK: f32 = 1e-6;

/// Running totals of a [`BlockSink`] since [`BlockSink::start`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Indices traced to the end.
    pub indices: u64,
    /// Samples of the picture sent; those of groups of lights come in addition.
    pub samples: u64,
    /// Samples discarded because the render was stopped while the lane was full, and those of paths that were abandoned.
    pub discarded: u64,
    /// Rejected samples and contributions.
    pub rejections: Rejections,
}

/// Collects the samples of one path after another in blocks. It rejects samples that break the rules of the stream.
#[derive(Debug)]
pub struct BlockSink {
    writer: LaneWriter,
    block: Box<Block>,
    window: UvWindow,
    epoch: Epoch,
    /// The path in progress, and the number of samples in the block before it.
    index: u64,
    path_start: usize,
    /// Samples of groups of lights in order of path, which follow those of the picture when the block is sent; their number before the path
    /// in progress; the number of groups.
    parts: Vec<(u8, Sample)>,
    parts_start: usize,
    groups: usize,
    /// Part of the path was discarded, so the rest must not be sent and the path not counted.
    broken: bool,
    totals: Totals,
    blocks_sent: u64,
}

impl BlockSink {
    /// A sink that sends over `writer`. Call [`BlockSink::start`] before use.
    pub fn new(writer: LaneWriter) -> Self {
        Self {
            writer,
            block: Box::default(),
            window: UvWindow::PICTURE,
            epoch: Epoch::default(),
            index: 0,
            path_start: 0,
            parts: Vec::new(),
            parts_start: 0,
            groups: 0,
            broken: false,
            totals: Totals::default(),
            blocks_sent: 0,
        }
    }

    /// Begins a render: drops samples that were not sent, and resets the totals.
    pub fn start(&mut self, epoch: Epoch, window: UvWindow) {
        let slack = |axis: usize| WINDOW_SLACK * (window.max[axis] - window.min[axis]);
        self.window = UvWindow {
            min: [window.min[0] - slack(0), window.min[1] - slack(1)],
            max: [window.max[0] + slack(0), window.max[1] + slack(1)],
        };
        self.epoch = epoch;
        self.groups = 0;
        self.totals = Totals::default();
        self.begin_chunk(0);
    }

    /// Begins a contiguous range of indices. The block must have been flushed.
    pub fn begin_chunk(&mut self, first_index: u64) {
        self.block.restart(self.epoch, first_index);
        self.parts.clear();
        (self.path_start, self.parts_start) = (0, 0);
    }

    /// Begins path `index`, which must follow the previous path of this chunk.
    #[inline]
    pub fn begin_path(&mut self, index: u64) {
        self.index = index;
        self.path_start = self.block.samples().len();
        self.parts_start = self.parts.len();
        self.broken = false;
        debug_assert!(faults::take().is_empty(), "faults of another path");
    }

    /// Ends the path in progress and counts it.
    #[inline]
    pub fn end_path(&mut self, paths: PathCounts) {
        for raised in faults::take() {
            self.count_rejected(raised.fault, raised.light_path);
        }
        if self.broken {
            return self.abandon_path();
        }
        let header = &mut self.block.header;
        header.index_count += 1;
        header.paths.camera += paths.camera;
        header.paths.light += paths.light;
    }

    /// Drops the samples of the unfinished path that have not been sent yet.
    pub fn abandon_path(&mut self) {
        self.totals.discarded += (self.block.samples().len() - self.path_start) as u64;
        self.block.truncate(self.path_start);
        self.parts.truncate(self.parts_start);
    }

    /// Sends the block unless it is empty. Sleeps while the lane is full and the epoch may run. If the epoch has been stopped
    /// and the lane is full, the block is discarded together with its counts, and the result is `false`.
    pub fn flush(&mut self) -> bool {
        let mut sent = true;
        if !(self.block.is_empty() && self.parts.is_empty()) {
            let (header, samples) = (self.block.header, self.block.samples().len() as u64);
            if self.groups > 0 {
                self.block.append_groups(self.groups, &self.parts);
            }
            sent = self.writer.send(&mut self.block);
            self.totals.indices += header.index_count;
            self.totals.samples += if sent { samples } else { 0 };
            self.totals.discarded += if sent { 0 } else { samples };
            self.blocks_sent += 1;
            self.begin_chunk(header.first_index + header.index_count);
        }
        sent
    }

    /// The path in progress.
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Position of the first camera sample of the path in progress that has not been sent yet, or of its first sample if there
    /// is no camera sample.
    pub fn path_position(&self) -> Option<[f32; 2]> {
        let samples = self.block.samples().get(self.path_start..)?;
        let camera = samples.iter().find(|sample| sample.w > 0.0);
        camera.or(samples.first()).map(|sample| sample.uv)
    }

    /// Totals of everything that was flushed.
    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Number of flushes that had a block to send.
    #[inline]
    pub fn flushes(&self) -> u64 {
        self.blocks_sent
    }

    /// The lane.
    pub fn writer(&self) -> &LaneWriter {
        &self.writer
    }

    #[inline]
    fn push(&mut self, sample: Sample) {
        if !self.block.push(sample) && self.make_room() {
            self.block.push(sample);
        }
    }

    /// Adds a sample of the picture and its parts, which have a group each, to the same block.
    fn push_with_parts(&mut self, sample: Sample, parts: impl ExactSizeIterator<Item = (u8, Sample)>) {
        let count = self.parts.len() + parts.len();
        if self.block.reserve(count) == 0 && !self.make_room() {
            return;
        }
        self.parts.extend(parts);
        self.block.reserve(self.parts.len());
        self.block.push(sample);
    }

    /// Adds a sample of the other eye.
    fn push_of_other_eye(&mut self, sample: Sample) {
        let count = self.parts.len() + 1;
        if self.block.samples().len() + count > BLOCK_SAMPLES && !self.make_room() {
            return;
        }
        self.groups = 1;
        self.parts.push((0, sample));
        self.block.reserve(self.parts.len());
    }

    /// Sends the full block. If that is impossible the rest of the path in progress is discarded, and the result is `false`.
    #[cold]
    fn make_room(&mut self) -> bool {
        if self.broken || !self.flush() {
            self.broken = true;
            self.totals.discarded += 1;
            self.abandon_path();
        }
        !self.broken
    }

    #[cold]
    fn reject(&mut self, uv: [f32; 2], color: Xyz, weight: f32) {
        let outside = || (FaultyValue::Position, Cause::OutsideWindow);
        let (part, cause) = fault_of_sample(uv, color, weight).unwrap_or_else(outside);
        self.block.header.rejected += 1;
        self.count_rejected(Fault { cause, part, surface: None, light: None }, None);
    }

    #[cold]
    fn count_rejected(&mut self, fault: Fault, light_path: Option<u64>) {
        let generations = faults::generations();
        let rejected = Rejected { index: self.index, fault, light_path, generations };
        self.totals.rejections.add(rejected);
        self.block.rejections.add(rejected);
    }

    /// The sample of the camera stream; one that breaks the rules is rejected.
    #[inline]
    fn camera_sample(&mut self, uv: [f32; 2], value: Xyz, weight: f32) -> Option<Sample> {
        let sample = Sample { uv, xyz: value * weight, w: weight };
        if weight > 0.0 && sample.is_sound() && self.contains(uv) {
            return Some(sample);
        }
        self.reject(uv, sample.xyz, weight);
        None
    }

    /// The sample of the light stream; one that breaks the rules is rejected.
    #[inline]
    fn light_sample(&mut self, uv: [f32; 2], value: Xyz) -> Option<Sample> {
        let sample = Sample { uv, xyz: value, w: -1.0 };
        if sample.is_sound() && self.contains(uv) {
            return Some(sample);
        }
        self.reject(uv, value, 1.0);
        None
    }

    /// True if `uv` lies in the window. False for NaN.
    #[inline]
    fn contains(&self, uv: [f32; 2]) -> bool {
        let UvWindow { min, max } = self.window;
        uv[0] >= min[0] && uv[0] <= max[0] && uv[1] >= min[1] && uv[1] <= max[1]
    }
}

impl SampleSink for BlockSink {
    #[inline]
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        if let Some(sample) = self.camera_sample(uv, value, weight) {
            self.push(sample);
        }
    }

    #[inline]
    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        if let Some(sample) = self.light_sample(uv, value) {
            self.push(sample);
        }
    }

    fn camera_by_groups(&mut self, uv: [f32; 2], value: Xyz, weight: f32, parts: &[Xyz]) {
        let weighted = |value: Xyz| Sample { uv, xyz: value * weight, w: weight };
        let all = std::iter::once(value).chain(parts.iter().copied()).map(weighted);
        let unsound = all.clone().find(|sample| !sample.is_sound());
        if !(weight > 0.0 && unsound.is_none() && self.contains(uv)) {
            return self.reject(uv, unsound.map_or(value * weight, |sample| sample.xyz), weight);
        }
        self.groups = parts.len().min(MOST_GROUPS);
        let parts =
            parts[..self.groups].iter().enumerate().map(|(group, part)| (group as u8, weighted(*part)));
        self.push_with_parts(weighted(value), parts);
    }

    fn light_of_group(&mut self, uv: [f32; 2], value: Xyz, group: u8) {
        let Some(sample) = self.light_sample(uv, value) else { return };
        self.groups = self.groups.max(usize::from(group) + 1).min(MOST_GROUPS);
        self.push_with_parts(sample, std::iter::once((group, sample)));
    }

    fn camera_of_other_eye(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        if let Some(sample) = self.camera_sample(uv, value, weight) {
            self.push_of_other_eye(sample);
        }
    }

    fn light_of_other_eye(&mut self, uv: [f32; 2], value: Xyz) {
        if let Some(sample) = self.light_sample(uv, value) {
            self.push_of_other_eye(sample);
        }
    }

    fn is_wanted(&self) -> bool {
        self.writer.hub().is_running(self.epoch)
    }
}
