//! Mitsuba's `.vol`: values on a grid of points.
//!
//! A `.vol` is little-endian: `VOL`, the version 3 as a byte, the encoding (1 for float32, 2 for float16, 3 for bytes from 0 to 1), the
//! numbers of points along x, y and z and of channels as `i32`, a box as six `f32`, and the values, channels fastest and z slowest.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use half::f16;

use crate::scene::desc::volume::VolumeGrid;
use crate::scene::limits;

/// A grid read from a file.
pub(crate) struct GridFile {
    pub(super) grid: Arc<VolumeGrid>,
    /// The first three channels and the others, of six.
    pub(super) halves: Option<[Arc<VolumeGrid>; 2]>,
    /// How many channels the file has.
    pub(super) channels: usize,
    /// The box of the file.
    pub(super) bounds: [DVec3; 2],
    /// Bytes behind the last value.
    pub(super) rest: usize,
}

/// The grids of a scene by their files.
pub(crate) type Grids = std::collections::BTreeMap<PathBuf, Arc<GridFile>>;

/// A number of bytes for messages.
fn size(bytes: u128) -> String {
    match bytes {
        0..0x10_0000 => format!("{bytes} bytes"),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
        _ => format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30)),
    }
}

/// The grid of a `.vol`.
pub(super) fn parse(bytes: &[u8]) -> Result<GridFile, String> {
    let (magic, header) = bytes.split_at_checked(4).ok_or("this file is too short")?;
    let &[b'V', b'O', b'L', version] = magic else { return Err("this is no `.vol`".to_owned()) };
    if version != 3 {
        return Err(format!("a `.vol` of version {version} is not supported"));
    }
    let (header, values) = header.split_at_checked(44).ok_or("this file ends in its header")?;
    let words: Vec<[u8; 4]> = header.as_chunks::<4>().0.to_vec();
    let integer = |i: usize| i32::from_le_bytes(words[i]);
    let width = match integer(0) {
        1 => 4,
        2 => 2,
        3 => 1,
        4 => return Err("grids of directions (encoding 4) are not supported".to_owned()),
        other => return Err(format!("{other} is no encoding of a `.vol`")),
    };
    let counts = [1, 2, 3, 4].map(integer);
    let [x, y, z, channels] = counts;
    let sizes = counts.map(|n| usize::try_from(n).ok().filter(|n| *n > 0));
    let [Some(nx), Some(ny), Some(nz), Some(n)] = sizes else {
        return Err(format!("a grid of {x} × {y} × {z} points with {channels} channels is none"));
    };
    // Four numbers of 31 bits, and of four bytes each, are no overflow here.
    let count = [nx, ny, nz, n].into_iter().map(|n| n as u128).product::<u128>();
    let needed =
        |bytes: u128| format!("{x} × {y} × {z} points with {channels} channels need {}", size(bytes));
    let wanted = usize::try_from(count * width as u128).ok();
    let Some(used) = wanted.and_then(|wanted| values.get(..wanted)) else {
        let there = size(values.len() as u128);
        return Err(format!("{} of values, and the file has {there}", needed(count * width as u128)));
    };
    // As long as they are in the file they may take a byte each.
    if count > limits::TOTAL_TEXELS as u128 {
        let most = limits::TOTAL_TEXELS;
        return Err(format!("{} of memory: a scene has at most {most} texels", needed(count * 4)));
    }
    let numbers: Vec<f32> = match width {
        4 => used.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        2 => used.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
        _ => used.iter().map(|b| f32::from(*b) / 255.0).collect(),
    };
    let corner =
        |first: usize| DVec3::from([0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(words[first + axis]))));
    let rest = values.len() - used.len();
    let half = |first: usize| {
        let values = numbers.chunks_exact(6).flat_map(|point| &point[first..first + 3]).copied().collect();
        Arc::new(VolumeGrid::new([nx, ny, nz], 3, values))
    };
    let halves = (n == 6).then(|| [half(0), half(3)]);
    let grid = Arc::new(VolumeGrid::new([nx, ny, nz], n, numbers));
    Ok(GridFile { grid, halves, channels: n, bounds: [corner(5), corner(8)], rest })
}
