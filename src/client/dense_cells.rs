//! Dense cells of a batch: samples that fall between the same four texel centres become at most four samples.
//!
//! A batch is summed in `f32`. Where thousands of its samples fall into one texel of a large film, equal ones round alike: 65,536 of
//! 0.1 are off by 6e-4. The splat filters are linear in the position between two texel centres, so a sample draws exactly what four
//! samples at the centres around it draw, weighted bilinearly. The four are summed over the samples of a dense cell in `f64` and
//! rounded once. That is also faster than to draw them one by one. The variance is not linear: it takes the samples as they are.

use std::collections::BTreeMap;

use crate::client::settings::{CHUNK_SAMPLES, FilmSpec, SplatFilter, Summation};
use crate::color::Xyz;
use crate::stream::Sample;

/// Most samples of one stream in a cell and slot of the batch that are not merged: 288 additions to a texel if its neighbours have as
/// many, and twice as many where a batch has several chunks: those that came before the cell was found dense stay as they are.
/// A batch that covers its slots evenly has at most [`ADDS_PER_SUM`](crate::client::filter::ADDS_PER_SUM)/36 = 1.8 in a cell,
/// so that pictures of even density are not merged.
const DENSE: u32 = 8;

/// Bits of an entry that hold its sample count; the rest hold the batch number.
const COUNT_BITS: u32 = 20;

/// A cell whose entry exceeds the limit.
#[derive(Default)]
struct Cell {
    /// Number of its samples.
    count: u32,
    /// Sums of `[x, y, z, |w|]` at the left top, right top, left bottom and right bottom centre.
    corners: [[f64; 4]; 4],
}

/// Finds the dense cells of a batch of one stream and merges their samples.
#[derive(Default)]
pub struct Merger {
    /// Per hash entry: number of samples in its cells and, above [`COUNT_BITS`], the number of the batch it belongs to; entries of earlier
    /// batches count as 0. The table has as many entries as a batch has samples. Colliding cells only look denser than they are.
    counts: Vec<u32>,
    /// Number of the batch, from 1 on.
    batch: u32,
    /// Cells of entries above the limit, by row and column.
    cells: BTreeMap<[u32; 2], Cell>,
    extent: [u32; 2],
    filter: SplatFilter,
    /// Largest sample count of a cell that is not dense.
    limit: u32,
    /// Largest sample count of any entry.
    fullest: u32,
}

impl Merger {
    /// Begins with a batch for this film, of which all samples are counted, chunk by chunk. Sums of one float, which are kept to show
    /// what the second costs, are not merged; neither are filters of a size of their own, which are not linear.
    pub fn begin(&mut self, spec: &FilmSpec) {
        let linear = !matches!(spec.filter, SplatFilter::Scaled(_));
        self.limit = if linear && spec.sums == Summation::TwoFloat {
            DENSE.saturating_mul(spec.batch_slots())
        } else {
            u32::MAX
        };
        (self.extent, self.filter, self.fullest) = (spec.padded_extent(), spec.filter, 0);
        self.cells.clear();
        self.batch += 1;
        let entries = spec.batch_capacity().next_power_of_two();
        if self.counts.len() != entries || self.batch >> (32 - COUNT_BITS) != 0 {
            self.counts.clear();
            self.counts.resize(entries, 0);
            self.batch = 1;
        }
    }

    /// Counts a sample at this position in padded texels, inside the target.
    #[inline]
    pub fn count(&mut self, p: [f32; 2]) {
        let entry = self.entry(self.cell(p));
        let count = (self.counted(entry) + 1).min((1 << COUNT_BITS) - 1);
        self.counts[entry] = self.batch << COUNT_BITS | count;
        self.fullest = self.fullest.max(count);
    }

    /// Whether a cell may be dense, once all samples of a chunk were counted. If so, every sample must then be passed to
    /// [`confirm`](Self::confirm).
    #[inline]
    pub fn found(&self) -> bool {
        self.fullest > self.limit
    }

    /// Whether a cell may hold a whole chunk of samples. The batch must then end, because the sums of deviations use all of its samples.
    pub fn is_full(&self) -> bool {
        self.fullest as usize >= CHUNK_SAMPLES
    }

    /// Counts a sample in its exact cell, since cells may share an entry. Cells that reach into the border of the padded target lack some
    /// of the four centres; no pixel of the picture is within their reach.
    pub fn confirm(&mut self, p: [f32; 2]) {
        let cell = self.cell(p);
        let whole = self.filter == SplatFilter::Box || (0..2).all(|i| (1..self.extent[i]).contains(&cell[i]));
        if whole && self.counted(self.entry(cell)) > self.limit {
            self.cells.entry([cell[1], cell[0]]).or_default().count += 1;
        }
    }

    /// Whether the sample at this position is in a dense cell.
    pub fn is_dense(&self, p: [f32; 2]) -> bool {
        let [column, row] = self.cell(p);
        self.counted(self.entry([column, row])) > self.limit
            && self.cells.get(&[row, column]).is_some_and(|cell| cell.count > self.limit)
    }

    /// Adds a sample of a dense cell.
    pub fn add(&mut self, p: [f32; 2], sample: &Sample) {
        let cell = self.cell(p);
        let t = match self.filter {
            SplatFilter::Box => [0.0; 2],
            _ => [0, 1].map(|i| f64::from(p[i]) + 0.5 - f64::from(cell[i])),
        };
        let Xyz { x, y, z } = sample.xyz;
        let value = [x, y, z, sample.w.abs()].map(f64::from);
        let corners = &mut self.cells.entry([cell[1], cell[0]]).or_default().corners;
        for (k, corner) in corners.iter_mut().enumerate() {
            let weight =
                (if k & 1 == 0 { 1.0 - t[0] } else { t[0] }) * (if k & 2 == 0 { 1.0 - t[1] } else { t[1] });
            corner.iter_mut().zip(value).for_each(|(sum, value)| *sum += value * weight);
        }
    }

    /// Takes the merged samples and resets the sums. Their `uv` are texel centres in padded texels.
    pub fn take(&mut self) -> Vec<Sample> {
        // Neighbouring cells share their centres.
        let mut centres = BTreeMap::<[u32; 2], [f64; 4]>::new();
        let last = u32::from(self.filter != SplatFilter::Box);
        let dense = std::mem::take(&mut self.cells).into_iter().filter(|(_, cell)| cell.count > self.limit);
        for ([row, column], cell) in dense {
            for (k, corner) in cell.corners.iter().enumerate().filter(|(k, _)| last == 1 || *k == 0) {
                let at = [row + (k >> 1) as u32 - last, column + (k & 1) as u32 - last];
                centres.entry(at).or_default().iter_mut().zip(corner).for_each(|(sum, value)| *sum += value);
            }
        }
        let sample = |([row, column], sum): ([u32; 2], [f64; 4])| {
            let [x, y, z, w] = sum.map(|v| v as f32);
            Sample { uv: [column, row].map(|i| i as f32 + 0.5), xyz: Xyz::new(x, y, z), w }
        };
        centres.into_iter().map(sample).collect()
    }

    /// Splits a batch of one stream into samples outside of dense cells and merged samples; `None` if no cell is dense.
    pub fn split<'s>(&mut self, spec: &FilmSpec, samples: &'s [Sample]) -> Option<[Vec<Sample>; 2]> {
        let placed = || {
            let place = |sample: &'s Sample| (spec.texel_position(sample.uv), sample);
            samples.iter().map(place).filter(|(p, _)| spec.holds(*p))
        };
        self.begin(spec);
        placed().for_each(|(p, _)| self.count(p));
        if !self.found() {
            return None;
        }
        placed().for_each(|(p, _)| self.confirm(p));
        let mut single = Vec::new();
        for (p, sample) in placed() {
            match self.is_dense(p) {
                true => self.add(p, sample),
                false => single.push(*sample),
            }
        }
        Some([single, self.take()])
    }

    /// The cell of a position in padded texels: the texel for the box, and otherwise the square between four centres, the
    /// right bottom one of which is the centre of texel `cell`.
    #[inline]
    fn cell(&self, p: [f32; 2]) -> [u32; 2] {
        let shift = if self.filter == SplatFilter::Box { 0.0 } else { 0.5 };
        p.map(|p| (p + shift) as u32)
    }

    /// Number of samples of the present batch in an entry.
    #[inline]
    fn counted(&self, entry: usize) -> u32 {
        let count = self.counts[entry];
        // Branch-free: a branch would wait for the load from a large table.
        let is_present = u32::from(count >> COUNT_BITS == self.batch);
        count & ((1 << COUNT_BITS) - 1) & is_present.wrapping_neg()
    }

    /// Hash-table entry of a cell. Neighbouring cells have different entries.
    #[inline]
    fn entry(&self, [column, row]: [u32; 2]) -> usize {
        (column.wrapping_add(row.wrapping_mul(40_503)) as usize) & (self.counts.len() - 1)
    }
}
