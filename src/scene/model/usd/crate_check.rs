//! Checks of binary crates (`usdc`) before the crate `openusd` reads them: it allocates what counts in a file say, follows offsets
//! and jumps as they are, and goes down a level of its stack for each dictionary in a dictionary.
//!
//! The format is that of Pixar's `crateFile.h`: a header, sections of tables (tokens, strings, fields, sets of fields, paths, specs),
//! and values anywhere, which fields name by type and offset.

use std::collections::BTreeSet;

use super::crate_values::{ValueCheck, check_value};

/// The first bytes of a crate file.
pub(super) const MAGIC: &[u8] = b"PXR-USDC";

/// Bytes that a compressed block may have for each byte of the file, and beyond: numbers in a row compress well, but a mesh has
/// points, too, which do not.
const INFLATION: usize = 32;
const INFLATED_FREE: usize = 8 << 20;

/// Parts of a path.
const DEPTH: usize = 512;

type Checked<T> = Result<T, String>;

fn broken<T>(what: &str) -> Checked<T> {
    Err(format!("this crate (usdc) is broken: {what}"))
}

/// A place in a file from where numbers are read.
#[derive(Clone, Copy)]
pub(super) struct CrateCursor<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> CrateCursor<'a> {
    pub(super) fn take(&mut self, count: usize) -> Checked<&'a [u8]> {
        let end = self.at.checked_add(count);
        match end.and_then(|end| self.bytes.get(self.at..end)) {
            Some(bytes) => {
                self.at += count;
                Ok(bytes)
            }
            None => broken("it ends within a value, or names a place beyond its end"),
        }
    }

    pub(super) fn u8(&mut self) -> Checked<u8> {
        Ok(self.take(1)?[0])
    }

    pub(super) fn u32(&mut self) -> Checked<u32> {
        Ok(u32::from_le_bytes(self.take(4)?.try_into().unwrap_or_default()))
    }

    pub(super) fn u64(&mut self) -> Checked<u64> {
        Ok(u64::from_le_bytes(self.take(8)?.try_into().unwrap_or_default()))
    }

    /// A count of elements of `size` bytes that follow.
    pub(super) fn count(&mut self, size: usize) -> Checked<usize> {
        let count = usize::try_from(self.u64()?).unwrap_or(usize::MAX);
        let left = self.bytes.len().saturating_sub(self.at);
        match count.checked_mul(size) {
            Some(all) if all <= left => Ok(count),
            _ => broken("a list has more elements than there are bytes"),
        }
    }

    /// The most bytes that a block may have when it is decompressed.
    fn most(&self) -> usize {
        self.bytes.len().saturating_mul(INFLATION).saturating_add(INFLATED_FREE)
    }

    /// A compressed block, whose size follows, of at most `size` bytes.
    pub(super) fn block(&mut self, size: usize) -> Checked<Vec<u8>> {
        if size > self.most() {
            return broken("a list is far larger than the file");
        }
        let compressed = self.count(1)?;
        let input = self.take(compressed)?;
        let Some((0, input)) = input.split_first() else {
            return broken("a compressed list has no or several parts, which is not supported");
        };
        let mut output = vec![0; size];
        match lz4_flex::block::decompress_into(input, &mut output) {
            Ok(size) => {
                output.truncate(size);
                Ok(output)
            }
            Err(_) => broken("a compressed list cannot be read"),
        }
    }

    /// Compressed whole numbers: a common difference, two bits for each number, and the other differences.
    pub(super) fn integers(&mut self, count: usize) -> Checked<Vec<i32>> {
        let codes = count.div_ceil(4);
        let most = count.checked_mul(4).and_then(|bytes| bytes.checked_add(4 + codes));
        let Some(most) = most.filter(|most| *most <= self.most()) else {
            return broken("a list is far larger than the file");
        };
        let data = self.block(most)?;
        if count == 0 {
            return Ok(Vec::new());
        }
        let mut rest = CrateCursor { bytes: &data, at: 0 };
        let common = rest.u32()? as i32;
        let codes = rest.take(codes)?;
        let (mut value, mut out) = (0_i32, Vec::with_capacity(count));
        for i in 0..count {
            let difference = match codes[i / 4] >> (2 * (i % 4)) & 3 {
                0 => common,
                1 => i32::from(rest.u8()? as i8),
                2 => i32::from(i16::from_le_bytes(rest.take(2)?.try_into().unwrap_or_default())),
                _ => rest.u32()? as i32,
            };
            value = value.wrapping_add(difference);
            out.push(value);
        }
        Ok(out)
    }
}

/// Sizes of the tables that values name elements of.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TableSizes {
    pub(super) tokens: usize,
    pub(super) strings: usize,
    pub(super) paths: usize,
    /// The minor version of the format.
    pub(super) version: u8,
}

/// Checks a crate.
///
/// # Errors
///
/// If the structure is invalid; the message says why.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut header = CrateCursor { bytes, at: MAGIC.len() };
    let version = header.take(8)?;
    if version[0] != 0 || !(4..=12).contains(&version[1]) {
        return Err(format!(
            "this crate (usdc) has the version {}.{}: versions 0.4 to 0.12 are read",
            version[0], version[1]
        ));
    }
    let mut sizes = TableSizes { version: version[1], ..TableSizes::default() };
    let contents = usize::try_from(header.u64()?).unwrap_or(usize::MAX);
    let mut contents = CrateCursor { bytes, at: contents };
    let sections = contents.count(32)?;
    if sections == 0 || sections >= 64 {
        return broken("it has no sections, or too many");
    }
    let mut known = Vec::new();
    for _ in 0..sections {
        let name = contents.take(16)?;
        let [start, _] = [contents.u64()?, contents.u64()?];
        let name = name.split(|b| *b == 0).next().unwrap_or_default();
        known.push((name, usize::try_from(start).unwrap_or(usize::MAX)));
    }
    let section = |name: &str| {
        let found = known.iter().find(|(known, _)| *known == name.as_bytes());
        found.map(|(_, start)| CrateCursor { bytes, at: *start })
    };
    let lengths = section("TOKENS").map_or(Ok(Vec::new()), tokens)?;
    sizes.tokens = lengths.len();
    sizes.strings = section("STRINGS").map_or(Ok(0), |cursor| strings(cursor, sizes.tokens))?;
    sizes.paths = section("PATHS").map_or(Ok(0), |cursor| paths(cursor, &lengths))?;
    let values = section("FIELDS").map_or(Ok(Vec::new()), |cursor| fields(cursor, sizes.tokens))?;
    let ends = section("FIELDSETS").map_or(Ok(Vec::new()), |cursor| sets(cursor, values.len()))?;
    section("SPECS").map_or(Ok(()), |cursor| specs(cursor, sizes.paths, &ends))?;
    let mut check = ValueCheck::new(bytes, sizes);
    values
        .into_iter()
        .collect::<BTreeSet<u64>>()
        .into_iter()
        .try_for_each(|value| check_value(&mut check, value, 0))
}

/// The size of a token.
#[derive(Clone, Copy)]
struct TokenSize {
    length: usize,
    /// It can be the name of a prim.
    is_name: bool,
}

/// All tokens.
fn tokens(mut cursor: CrateCursor<'_>) -> Checked<Vec<TokenSize>> {
    let count = cursor.u64()?;
    let size = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    let block = cursor.block(size)?;
    let lengths: Vec<TokenSize> = match block.strip_suffix(&[0]) {
        // A point or a slash in the name of a prim would lead the crate around in circles.
        Some(all) => all
            .split(|b| *b == 0)
            .map(|token| TokenSize {
                length: token.len(),
                is_name: token.first() == Some(&b'{') || !token.iter().any(|b| b"./".contains(b)),
            })
            .collect(),
        None => Vec::new(),
    };
    if block.len() != size || lengths.len() as u64 != count {
        return broken("its table of tokens has not as many as it says");
    }
    Ok(lengths)
}

fn strings(mut cursor: CrateCursor<'_>, tokens: usize) -> Checked<usize> {
    let count = cursor.count(4)?;
    for _ in 0..count {
        if cursor.u32()? as usize >= tokens {
            return broken("a string is no token");
        }
    }
    Ok(count)
}

/// The values of all fields.
fn fields(mut cursor: CrateCursor<'_>, tokens: usize) -> Checked<Vec<u64>> {
    let count = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    let names = cursor.integers(count)?;
    if names.iter().any(|i| usize::try_from(*i).map_or(true, |i| i >= tokens)) {
        return broken("a field has no name");
    }
    let values = cursor.block(count.saturating_mul(8))?;
    let values: Vec<u64> = values.as_chunks::<8>().0.iter().map(|v| u64::from_le_bytes(*v)).collect();
    if values.len() != count {
        return broken("a field has no value");
    }
    Ok(values)
}

/// For each entry of the sets of fields, whether it ends one.
fn sets(mut cursor: CrateCursor<'_>, fields: usize) -> Checked<Vec<bool>> {
    let count = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    let sets = cursor.integers(count)?;
    if sets.iter().any(|i| *i != -1 && usize::try_from(*i).map_or(true, |i| i >= fields)) {
        return broken("a set of fields names one that is not there");
    }
    Ok(sets.iter().map(|i| *i == -1).collect())
}

/// Checks that the paths are a tree: each entry is reached once. The number of paths.
fn paths(mut cursor: CrateCursor<'_>, tokens: &[TokenSize]) -> Checked<usize> {
    let count = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    if count > cursor.most() / 64 {
        return broken("it has far more paths than bytes");
    }
    let encoded = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    let [places, names, jumps] =
        [cursor.integers(encoded)?, cursor.integers(encoded)?, cursor.integers(encoded)?];
    let fits = |i: &i32| usize::try_from(*i).is_ok_and(|i| i < count);
    if !places.iter().all(fits) || places.len() > count {
        return broken("a path has no place");
    }
    let mut reached = vec![false; places.len()];
    let (mut bytes, mut open) = (0_usize, vec![(0_usize, 0_usize, 0_usize)]);
    if places.is_empty() {
        return Ok(count);
    }
    while let Some((mut at, mut length, mut depth)) = open.pop() {
        let mut is_root = depth == 0;
        loop {
            match reached.get_mut(at) {
                Some(seen) if !*seen => *seen = true,
                _ => return broken("its paths lead in circles"),
            }
            let own = match tokens.get(names[at].unsigned_abs() as usize) {
                _ if is_root => length + 1,
                Some(token) if token.is_name || names[at] < 0 => length + token.length + 1,
                _ => return broken("a path has no name"),
            };
            bytes += own;
            if depth > DEPTH || bytes > cursor.most() {
                return broken("its paths are far longer than the file");
            }
            let jump = jumps[at];
            let (has_child, has_sibling) = (jump > 0 || jump == -1, jump >= 0);
            if has_child {
                if has_sibling {
                    open.push((at + jump as usize, length, depth));
                }
                (length, depth) = (own, depth + 1);
            }
            if !has_child && !has_sibling {
                break;
            }
            (at, is_root) = (at + 1, false);
        }
    }
    Ok(count)
}

fn specs(mut cursor: CrateCursor<'_>, paths: usize, ends: &[bool]) -> Checked<()> {
    let count = usize::try_from(cursor.u64()?).unwrap_or(usize::MAX);
    let [of, sets, _] = [cursor.integers(count)?, cursor.integers(count)?, cursor.integers(count)?];
    let begins = |i: usize| i < ends.len() && (i == 0 || ends[i - 1]);
    let fits = of.iter().all(|i| usize::try_from(*i).is_ok_and(|i| i < paths));
    match fits && sets.iter().all(|i| usize::try_from(*i).is_ok_and(begins)) {
        true => Ok(()),
        false => broken("a spec has no path or no fields"),
    }
}
