//! Radiance pictures (`.hdr`, `.pic`): three mantissas and one exponent per pixel, plain or run-length coded.
//!
//! The format is that of Ward, *Real Pixels*, in Arvo (ed.), *Graphics Gems II*, 1991, and of the manual of Radiance. As Mitsuba
//! does, values are those of the file: what its header says of exposure and colours is not undone ([`remarks`]).

use std::borrow::Cow;

use super::exr::{check_inflation, check_pixels};

/// Header lines with unused colour metadata, and their neutral values.
const OF_COLORS: [(&str, &[f64]); 3] = [
    ("EXPOSURE=", &[1.0]),
    ("COLORCORR=", &[1.0; 3]),
    ("PRIMARIES=", &[0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3333, 0.3333]),
];

/// Longest line of a header in bytes.
const LONGEST_LINE: usize = 4096;

/// Width, height and linear R, G, B of the file with these `bytes`, of at most `most` pixels.
pub(super) fn decode(bytes: &[u8], most: usize) -> Result<(usize, usize, Vec<[f32; 3]>), String> {
    let mut file = Bytes(bytes);
    let resolution = loop {
        let line = file.line()?;
        match line.strip_prefix("FORMAT=").map(str::trim) {
            Some("32-bit_rle_rgbe") | None => (),
            Some(other) => {
                return Err(format!("pixels of the format {other} are not read, only 32-bit_rle_rgbe"));
            }
        }
        if line.is_empty() {
            break file.line()?;
        }
    };
    let (width, height) = match *resolution.split_ascii_whitespace().collect::<Vec<_>>() {
        ["-Y", height, "+X", width] => (number(width)?, number(height)?),
        _ => return Err(format!("its pixels are in the order `{resolution}`, and only -Y … +X … is read")),
    };
    check_pixels(width, height, most)?;
    check_inflation(12 * (width as u64) * (height as u64), bytes.len())?;
    // Grows with the data in the file, not with the size promised by its header.
    let mut pixels = Vec::new();
    let mut row = vec![[0; 4]; width];
    for _ in 0..height {
        file.row(&mut row)?;
        pixels.extend(row.iter().copied().map(linear));
    }
    Ok((width, height, pixels))
}

fn number(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| format!("`{text}` is no number of pixels"))
}

/// Colour metadata in the header that is not used.
pub(super) fn remarks(bytes: &[u8]) -> Vec<String> {
    let mut file = Bytes(bytes);
    let mut remarks = Vec::new();
    while let Ok(line) = file.line()
        && !line.is_empty()
    {
        let said = OF_COLORS.iter().find_map(|(name, usual)| Some((line.strip_prefix(name)?, usual)));
        let is_usual = |(values, usual): (&str, &&[f64])| {
            let values: Vec<f64> = values.split_ascii_whitespace().filter_map(|v| v.parse().ok()).collect();
            values.len() == usual.len() && values.iter().zip(*usual).all(|(a, b)| (a - b).abs() < 2e-3)
        };
        if said.is_some_and(|said| !is_usual(said)) {
            remarks.push(format!("its line `{}`", line.trim_end()));
        }
    }
    remarks
}

/// The value of a pixel: mantissas over 256, times 2 to the exponent less 128.
fn linear([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    // Two factors, because the product reaches every exponent without leaving the range of a float in between.
    let scale = 2f32.powi(i32::from(e) - 128) * 2f32.powi(-8);
    if e == 0 { [0.0; 3] } else { [r, g, b].map(|v| f32::from(v) * scale) }
}

/// Remaining bytes of a file.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    /// The next line, without its end.
    fn line(&mut self) -> Result<Cow<'a, str>, String> {
        let end =
            self.0.iter().take(LONGEST_LINE).position(|b| *b == b'\n').ok_or("its header does not end")?;
        let (line, rest) = self.0.split_at(end);
        self.0 = &rest[1..];
        // Comments may be in any encoding.
        Ok(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or("it is cut short")?;
        self.0 = rest;
        Ok(*bytes)
    }

    /// Reads one row, in either encoding.
    fn row(&mut self, row: &mut [[u8; 4]]) -> Result<(), String> {
        match *self.0 {
            // The new encoding repeats the width, of 8 to 32 767 pixels.
            [2, 2, high, low, ..] if high < 128 && usize::from(high) << 8 | usize::from(low) == row.len() => {
                self.0 = &self.0[4..];
                (0..4).try_for_each(|component| self.component(row, component))
            }
            _ => self.pixels(row),
        }
    }

    /// New encoding: each component separately, as runs of one value and literal sequences.
    fn component(&mut self, row: &mut [[u8; 4]], component: usize) -> Result<(), String> {
        let mut at = 0;
        while at < row.len() {
            let [count] = self.take()?;
            let (count, run) = if count > 128 { (count - 128, true) } else { (count, false) };
            let end = at + usize::from(count);
            if count == 0 || end > row.len() {
                return Err("a run of its pixels does not end with its row".to_owned());
            }
            let mut value = if run { self.take()? } else { [0] };
            for pixel in &mut row[at..end] {
                if !run {
                    value = self.take()?;
                }
                pixel[component] = value[0];
            }
            at = end;
        }
        Ok(())
    }

    /// Old encoding: single pixels, where mantissas 1, 1, 1 repeat the previous pixel by the count in the exponent byte; consecutive ones
    /// are the digits of one count, lowest first.
    fn pixels(&mut self, row: &mut [[u8; 4]]) -> Result<(), String> {
        let (mut at, mut shift) = (0, 0);
        while at < row.len() {
            let pixel: [u8; 4] = self.take()?;
            let [1, 1, 1, count] = pixel else {
                row[at] = pixel;
                (at, shift) = (at + 1, 0);
                continue;
            };
            let end = at.saturating_add(usize::from(count) << shift);
            if at == 0 || shift > 16 || end > row.len() {
                return Err("a run of its pixels does not end with its row".to_owned());
            }
            let last = row[at - 1];
            row[at..end].fill(last);
            (at, shift) = (end, shift + 8);
        }
        Ok(())
    }
}
