//! Checks of the values of binary crates: their places, counts, and the values in them.

use super::crate_check::{CrateCursor, TableSizes};

/// Values in values.
const DEPTH: usize = 32;

/// A check of all values of a file.
pub(super) struct ValueCheck<'a> {
    bytes: &'a [u8],
    sizes: TableSizes,
    /// Values that may still be looked at: dictionaries may share what they hold.
    left: usize,
}

impl<'a> ValueCheck<'a> {
    pub(super) fn new(bytes: &'a [u8], sizes: TableSizes) -> Self {
        Self { bytes, sizes, left: 65_536 + bytes.len() }
    }

    fn at(&self, offset: u64) -> CrateCursor<'a> {
        CrateCursor { bytes: self.bytes, at: usize::try_from(offset).unwrap_or(usize::MAX) }
    }
}

type Checked<T> = Result<T, String>;

fn broken<T>(what: &str) -> Checked<T> {
    Err(format!("this crate (usdc) is broken: {what}"))
}

/// Bytes of a value of a type, by the number of the type; none for those that are checked otherwise.
fn width(kind: u64) -> Option<usize> {
    Some(match kind {
        1 | 2 => 1,
        3 | 4 => 4,
        5 | 6 | 9 | 56 => 8,
        7 => 2,
        8 => 4,
        10..=12 | 57 => 4,
        13 => 32,
        14 => 72,
        15 => 128,
        16 => 32,
        17 => 16,
        18 => 8,
        19 => 16,
        20 | 22 => 8,
        21 => 4,
        23 => 24,
        24 | 26 => 12,
        25 => 6,
        27 => 32,
        28 | 30 => 16,
        29 => 8,
        _ => return None,
    })
}

/// Checks a value: its type, flags and place in one number.
pub(super) fn check_value(check: &mut ValueCheck<'_>, value: u64, depth: usize) -> Checked<()> {
    let Some(left) = check.left.checked_sub(1).filter(|_| depth <= DEPTH) else {
        return broken("its values hold each other");
    };
    check.left = left;
    let kind = value >> 48 & 0xff;
    let (array, inlined, compressed) = (value >> 63 == 1, value >> 62 & 1 == 1, value >> 61 & 1 == 1);
    let payload = value & 0xffff_ffff_ffff;
    let cursor = check.at(payload);
    if array {
        if inlined {
            return broken("a list has no place");
        }
        return if payload == 0 { Ok(()) } else { list(check, cursor, kind, compressed) };
    }
    if inlined {
        let index = (payload & 0xffff_ffff) as usize;
        return match kind {
            10 if index >= check.sizes.strings => broken("a string is not there"),
            11 | 12 | 53 | 57 if index >= check.sizes.tokens => broken("a token is not there"),
            // The crate reads these from their place whatever the flag says.
            31 if payload != 0 => broken("a dictionary has no place"),
            32..=41 | 45..=50 | 54 | 55 | 58 => broken("a value that needs a place has none"),
            _ => Ok(()),
        };
    }
    let mut cursor = cursor;
    match kind {
        10 | 12 | 57 => strings(check, &mut cursor, 1),
        11 | 53 => {
            // Eight bytes are read, of which a small file may have four.
            let index = cursor.u64()?;
            if index >= check.sizes.tokens as u64 { broken("a token is not there") } else { Ok(()) }
        }
        31 => dictionary(check, &mut cursor, depth),
        32..=39 | 54 | 55 => list_operation(check, &mut cursor, kind, depth),
        40 | 41 => {
            let count = cursor.count(4)?;
            let most = if kind == 40 { check.sizes.paths } else { check.sizes.tokens };
            indices(&mut cursor, count, most)
        }
        45 => {
            let count = cursor.count(8)?;
            strings(check, &mut cursor, 2 * count)
        }
        46 => samples(check, &mut cursor, depth),
        47 => payload_arc(check, &mut cursor),
        48 => floats(check, cursor, 8, compressed),
        49 => cursor.count(16).map(|_| ()),
        50 => {
            let count = cursor.count(4)?;
            strings(check, &mut cursor, count)
        }
        58 => {
            let count = cursor.count(8)?;
            indices(&mut cursor, 2 * count, check.sizes.paths)
        }
        kind => match width(kind) {
            Some(width) => cursor.take(width).map(|_| ()),
            None => Ok(()),
        },
    }
}

/// Numbers of elements of a table.
fn indices(cursor: &mut CrateCursor<'_>, count: usize, most: usize) -> Checked<()> {
    for _ in 0..count {
        if cursor.u32()? as usize >= most {
            return broken("a value names a token or a path that is not there");
        }
    }
    Ok(())
}

fn strings(check: &ValueCheck<'_>, cursor: &mut CrateCursor<'_>, count: usize) -> Checked<()> {
    indices(cursor, count, check.sizes.strings)
}

/// Where the elements of a list begin, and how many there are.
fn length(check: &ValueCheck<'_>, cursor: &mut CrateCursor<'_>) -> Checked<usize> {
    if check.sizes.version < 5 {
        cursor.u32()?;
    }
    let count = if check.sizes.version < 7 { u64::from(cursor.u32()?) } else { cursor.u64()? };
    Ok(usize::try_from(count).unwrap_or(usize::MAX))
}

fn fits(cursor: &mut CrateCursor<'_>, count: usize, width: usize) -> Checked<()> {
    match count.checked_mul(width) {
        Some(all) => cursor.take(all).map(|_| ()),
        None => broken("a list has more elements than there are bytes"),
    }
}

fn list(check: &ValueCheck<'_>, mut cursor: CrateCursor<'_>, kind: u64, compressed: bool) -> Checked<()> {
    match kind {
        10 | 12 | 57 => {
            let count = cursor.count(4)?;
            strings(check, &mut cursor, count)
        }
        11 => {
            let count = length(check, &mut cursor)?;
            indices(&mut cursor, count, check.sizes.tokens)
        }
        3..=6 => {
            let count = length(check, &mut cursor)?;
            match compressed && check.sizes.version >= 5 && count >= 4 {
                // Those of eight bytes are read by the rule for four, as by the crate.
                true if kind <= 4 => cursor.integers(count).map(|_| ()),
                true => cursor.block(count.saturating_mul(8).saturating_add(count / 4 + 9)).map(|_| ()),
                false => fits(&mut cursor, count, if kind <= 4 { 4 } else { 8 }),
            }
        }
        7 | 8 | 9 | 56 => floats(check, cursor, width(kind).unwrap_or(8), compressed),
        kind => match width(kind) {
            Some(width) if !compressed => {
                let count = length(check, &mut cursor)?;
                fits(&mut cursor, count, width)
            }
            _ => broken("a list has a type that lists do not have"),
        },
    }
}

/// Numbers with a fraction: as they are, as whole numbers, or as those of a table.
fn floats(
    check: &ValueCheck<'_>,
    mut cursor: CrateCursor<'_>,
    width: usize,
    compressed: bool,
) -> Checked<()> {
    let count = length(check, &mut cursor)?;
    if !compressed || check.sizes.version < 6 || count < 4 {
        return fits(&mut cursor, count, width);
    }
    match cursor.u8()? {
        b'i' => cursor.integers(count).map(|_| ()),
        b't' => {
            let table = cursor.u32()?;
            fits(&mut cursor, table as usize, width)?;
            let all = cursor.integers(count)?;
            match all.iter().all(|i| (*i as u32) < table) {
                true => Ok(()),
                false => broken("a number is not in its table"),
            }
        }
        _ => broken("numbers are compressed in an unknown way"),
    }
}

/// A place that is told by its distance from the number that tells it.
fn jump(cursor: &CrateCursor<'_>) -> Checked<usize> {
    let mut here = *cursor;
    let distance = here.u64()? as i64;
    match i64::try_from(cursor.at).ok().and_then(|at| at.checked_add(distance)).map(usize::try_from) {
        Some(Ok(place)) => Ok(place),
        _ => broken("it names a place beyond its end"),
    }
}

fn dictionary(check: &mut ValueCheck<'_>, cursor: &mut CrateCursor<'_>, depth: usize) -> Checked<()> {
    let count = cursor.count(12)?;
    for _ in 0..count {
        strings(check, cursor, 1)?;
        let mut value = CrateCursor { at: jump(cursor)?, ..*cursor };
        let inner = value.u64()?;
        check_value(check, inner, depth + 1)?;
        // The next entry stands after the value.
        cursor.at = value.at;
    }
    Ok(())
}

fn samples(check: &mut ValueCheck<'_>, cursor: &mut CrateCursor<'_>, depth: usize) -> Checked<()> {
    let mut times = CrateCursor { at: jump(cursor)?, ..*cursor };
    let value = times.u64()?;
    check_value(check, value, depth + 1)?;
    let mut values = CrateCursor { at: jump(&times)?, ..times };
    let count = values.count(8)?;
    for _ in 0..count {
        let value = values.u64()?;
        check_value(check, value, depth + 1)?;
    }
    Ok(())
}

fn payload_arc(check: &ValueCheck<'_>, cursor: &mut CrateCursor<'_>) -> Checked<()> {
    strings(check, cursor, 1)?;
    indices(cursor, 1, check.sizes.paths)?;
    cursor.take(if check.sizes.version >= 8 { 16 } else { 0 }).map(|_| ())
}

/// Lists of what is explicit, added, prepended, appended, deleted and ordered, as far as the header has them.
fn list_operation(
    check: &mut ValueCheck<'_>,
    cursor: &mut CrateCursor<'_>,
    kind: u64,
    depth: usize,
) -> Checked<()> {
    let header = cursor.u8()?;
    let lists = (1..7).filter(|bit| header >> bit & 1 == 1).count();
    for _ in 0..lists {
        let size = match kind {
            37 | 39 => 8,
            _ => 4,
        };
        let count = cursor.count(size)?;
        match kind {
            32 => indices(cursor, count, check.sizes.tokens)?,
            33 | 54 => strings(check, cursor, count)?,
            34 => indices(cursor, count, check.sizes.paths)?,
            35 => {
                for _ in 0..count {
                    strings(check, cursor, 1)?;
                    indices(cursor, 1, check.sizes.paths)?;
                    cursor.take(16)?;
                    dictionary(check, cursor, depth + 1)?;
                }
            }
            55 => (0..count).try_for_each(|_| payload_arc(check, cursor))?,
            _ => fits(cursor, count, size)?,
        }
    }
    Ok(())
}
