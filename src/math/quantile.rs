//! Quantiles by nearest rank (ISO 3534: values that occur).

/// The least value that at least the part `p` of the values, given in ascending order, do not exceed; `None` of no values.
pub fn nearest_rank<T: Copy>(ascending: &[T], p: f64) -> Option<T> {
    let rank = (p * ascending.len() as f64).ceil() as usize;
    ascending.get(rank.clamp(1, ascending.len().max(1)) - 1).copied()
}
