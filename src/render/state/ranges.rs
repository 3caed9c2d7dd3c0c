//! Sets of indices of the sample sequence.

use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// A set of indices as ascending ranges with gaps between them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[u64; 2]>", into = "Vec<[u64; 2]>")]
pub struct IndexRanges(Vec<Range<u64>>);

impl IndexRanges {
    /// The indices of one range.
    pub fn one(range: Range<u64>) -> Self {
        let mut ranges = Self::default();
        // An empty set has no overlap.
        let _ = ranges.add(range);
        ranges
    }

    /// The ranges.
    pub fn ranges(&self) -> &[Range<u64>] {
        &self.0
    }

    /// Number of indices.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|range| range.end - range.start).sum()
    }

    /// Adds a range; if some of its indices are present, changes nothing and returns those.
    pub fn add(&mut self, range: Range<u64>) -> Result<(), Range<u64>> {
        if range.is_empty() {
            return Ok(());
        }
        if let Some(twice) = self.common(&range) {
            return Err(twice);
        }
        let at = self.0.partition_point(|other| other.end < range.start);
        let touching = self.0[at..].iter().take_while(|other| other.start <= range.end).count();
        let touched = at..at + touching;
        let start = self.0[touched.clone()].first().map_or(range.start, |first| first.start.min(range.start));
        let end = self.0[touched.clone()].last().map_or(range.end, |last| last.end.max(range.end));
        self.0.splice(touched, std::iter::once(start..end));
        Ok(())
    }

    /// Indices common to `range` and the set, if any: those of the first overlapping range.
    pub fn common(&self, range: &Range<u64>) -> Option<Range<u64>> {
        let at = self.0.partition_point(|other| other.end <= range.start);
        let other = self.0.get(at)?;
        let common = other.start.max(range.start)..other.end.min(range.end);
        (!common.is_empty()).then_some(common)
    }

    /// Adds another set; if both have common indices, changes nothing and returns some.
    pub fn merge(&mut self, other: &Self) -> Result<(), Range<u64>> {
        if let Some(twice) = other.0.iter().find_map(|range| self.common(range)) {
            return Err(twice);
        }
        other.0.iter().try_for_each(|range| self.add(range.clone()))
    }

    /// Indices of `whole` that are not in the set.
    pub fn missing(&self, whole: Range<u64>) -> Self {
        let mut missing = Vec::new();
        let mut next = whole.start;
        for range in &self.0 {
            if range.start.min(whole.end) > next {
                missing.push(next..range.start.min(whole.end));
            }
            next = next.max(range.end);
        }
        if next < whole.end {
            missing.push(next..whole.end);
        }
        Self(missing)
    }
}

impl TryFrom<Vec<[u64; 2]>> for IndexRanges {
    type Error = &'static str;

    fn try_from(pairs: Vec<[u64; 2]>) -> Result<Self, Self::Error> {
        let mut ranges = Self::default();
        for [start, end] in pairs {
            let valid = start < end && ranges.0.last().is_none_or(|last| last.end < start);
            if !valid {
                return Err("index ranges must ascend with gaps between them");
            }
            ranges.0.push(start..end);
        }
        Ok(ranges)
    }
}

impl From<IndexRanges> for Vec<[u64; 2]> {
    fn from(ranges: IndexRanges) -> Self {
        ranges.0.into_iter().map(|range| [range.start, range.end]).collect()
    }
}

/// Formats as `0–1023, 4096–8191`; of more than five ranges the middle ones are left out.
impl fmt::Display for IndexRanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return write!(f, "none");
        }
        for (i, range) in self.0.iter().enumerate() {
            match i {
                0 => {}
                3 if self.0.len() > 5 => {
                    let rest = self.0.len() - 3;
                    return write!(f, " and {rest} ranges more");
                }
                _ => write!(f, ", ")?,
            }
            write!(f, "{}–{}", range.start, range.end - 1)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    fn of(pairs: &[[u64; 2]]) -> IndexRanges {
        IndexRanges::try_from(pairs.to_vec()).expect("valid")
    }

    #[test]
    fn ranges_that_touch_become_one_and_those_that_overlap_are_refused() {
        let mut ranges = of(&[[10, 20], [40, 50]]);
        assert_eq!(ranges.add(20..30), Ok(()));
        assert_eq!(ranges, of(&[[10, 30], [40, 50]]));
        assert_eq!(ranges.add(25..41), Err(25..30));
        assert_eq!(ranges.add(30..41), Err(40..41));
        assert_eq!(ranges.add(0..100), Err(10..30));
        assert_eq!(ranges.add(5..5), Ok(()));
        assert_eq!(ranges, of(&[[10, 30], [40, 50]]));
        assert_eq!(ranges.add(30..40), Ok(()));
        assert_eq!((ranges.clone(), ranges.count()), (of(&[[10, 50]]), 40));
        assert_eq!(ranges.merge(&of(&[[0, 5], [49, 60]])), Err(49..50));
        assert_eq!(ranges, of(&[[10, 50]]));
    }

    #[test]
    fn what_is_missing_and_what_is_there_are_the_whole() {
        let mut random = Random(11);
        for _ in 0..300 {
            let mut present = [false; 64];
            let mut ranges = IndexRanges::default();
            for _ in 0..6 {
                let start = (random.f32() * 60.0) as usize;
                let end = (start + (random.f32() * 12.0) as usize).min(64);
                let free = !present[start..end].iter().any(|there| *there);
                assert_eq!(ranges.add(start as u64..end as u64).is_ok(), free);
                if free {
                    present[start..end].fill(true);
                }
            }
            let whole = 5..(20.0 + random.f32() * 40.0) as u64;
            let missing = ranges.missing(whole.clone());
            let holds = |ranges: &IndexRanges, i| ranges.ranges().iter().any(|range| range.contains(&i));
            for i in 0..64u64 {
                assert_eq!(holds(&ranges, i), present[i as usize]);
                assert_eq!(holds(&missing, i), whole.contains(&i) && !present[i as usize]);
            }
            let pairs = Vec::from(ranges.clone());
            assert_eq!(IndexRanges::try_from(pairs), Ok(ranges));
        }
    }

    #[test]
    fn words() {
        assert_eq!(IndexRanges::default().to_string(), "none");
        assert_eq!(of(&[[0, 1024], [4096, 4097]]).to_string(), "0–1023, 4096–4096");
        let many: Vec<[u64; 2]> = (0..9).map(|i| [10 * i, 10 * i + 1]).collect();
        assert_eq!(of(&many).to_string(), "0–0, 10–10, 20–20 and 6 ranges more");
        assert!(IndexRanges::try_from(vec![[3, 3]]).is_err());
        assert!(IndexRanges::try_from(vec![[3, 5], [5, 6]]).is_err());
    }
}
