//! Assigns intervals to rows such that intervals in the same row do not overlap.

/// Returns the row of each interval, from 0, by greedy interval partitioning. In the order of
/// starts, each interval is placed in the first free row.
pub(crate) fn rows(intervals: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..intervals.len()).collect();
    order.sort_by(|left, right| intervals[*left].0.total_cmp(&intervals[*right].0).then(left.cmp(right)));
    let mut ends: Vec<f64> = Vec::new();
    let mut rows = vec![0; intervals.len()];
    for index in order {
        let (start, end) = intervals[index];
        // The tolerance admits rounding errors in the times of consecutive intervals.
        let row = ends.iter().position(|taken| *taken <= start + 1e-6).unwrap_or(ends.len());
        if row == ends.len() {
            ends.push(end);
        }
        ends[row] = end;
        rows[index] = row;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::rows;

    #[test]
    fn overlapping_intervals_have_different_rows() {
        assert_eq!(rows(&[(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]), [0, 0, 0]);
        assert_eq!(rows(&[(0.0, 3.0), (1.0, 2.0), (2.0, 4.0), (3.0, 4.0)]), [0, 1, 1, 0]);
    }
}
