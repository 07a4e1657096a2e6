//! Intervals to rows, so that nothing lies on top of another.

/// The row of each interval, from 0; each comes into the first row that has room for it, in the order of their starts.
pub(crate) fn rows(intervals: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..intervals.len()).collect();
    order.sort_by(|left, right| intervals[*left].0.total_cmp(&intervals[*right].0).then(left.cmp(right)));
    let mut ends: Vec<f64> = Vec::new();
    let mut rows = vec![0; intervals.len()];
    for index in order {
        let (start, end) = intervals[index];
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
    fn what_overlaps_has_rows_of_its_own() {
        assert_eq!(rows(&[(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]), [0, 0, 0]);
        assert_eq!(rows(&[(0.0, 3.0), (1.0, 2.0), (2.0, 4.0), (3.0, 4.0)]), [0, 1, 1, 0]);
    }
}
