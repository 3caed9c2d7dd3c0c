//! Pearson's test of counts against what a density says.

/// Fails when `counts` cannot come from `expected` (both per cell, same total but for what neither counts):
/// cells of fewer than 10 are pooled, and the statistic must lie below its 1 − 1e-5 quantile (Wilson and Hilferty
/// 1931). For densities with steep flanks `slack` is the relative error of `expected` that counts as none.
pub fn assert_counts(counts: &[u32], expected: &[f64], slack: f64, what: &str) {
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pool_count, mut pool) = (0.0, 0.0);
    for (&n, &e) in counts.iter().zip(expected) {
        assert!(e.is_finite() && e >= 0.0, "{what}: {e}");
        if e < 10.0 {
            pool_count += f64::from(n);
            pool += e;
            continue;
        }
        let off = ((f64::from(n) - e).abs() - slack * e).max(0.0);
        statistic += off * off / e;
        cells += 1;
    }
    if pool >= 10.0 {
        statistic += (pool_count - pool).powi(2) / pool;
        cells += 1;
    } else {
        assert!(
            pool_count <= pool + 6.0 * pool.sqrt() + 12.0,
            "{what}: {pool_count} where {pool} are expected"
        );
    }
    let k = f64::from((cells - 1).max(1));
    let c = 2.0 / (9.0 * k);
    let critical = k * (1.0 - c + 4.265 * c.sqrt()).powi(3);
    assert!(statistic < critical, "{what}: chi² {statistic:.1} of {cells} cells, {critical:.1} is the limit");
}
