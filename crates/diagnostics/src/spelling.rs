//! Spelling suggestions: finds the known name that is most similar to an unknown name.

/// Returns the name in `known` with the smallest edit distance to `written`; among equally similar names, the
/// first one. Returns `None` if no name is similar enough.
///
/// Case does not matter, and a different order of the words counts as one edit. The maximum distance is a third
/// of the letters of `written`, rounded down, but at least 1 and at most 3. For a single letter it is 0,
/// because any other letter has the distance 1.
pub fn nearest<'n>(written: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let written = written.to_lowercase();
    let limit = match written.chars().count() {
        0 | 1 => 0,
        length => (length / 3).clamp(1, 3),
    };
    let mut best: Option<(usize, &str)> = None;
    for name in known {
        let distance = distance(&written, &name.to_lowercase());
        if distance <= limit && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, name));
        }
    }
    best.map(|(_, name)| name)
}

/// Returns the optimal string alignment distance, in which a transposition of neighbours is one edit. Names
/// with the same words in another order have distance 1; names of very different lengths have distance
/// `usize::MAX`.
fn distance(left: &str, right: &str) -> usize {
    // Each of at most 3 edits changes the length by at most four bytes.
    if left.len().abs_diff(right.len()) > 12 {
        return usize::MAX;
    }
    if left != right && words(left) == words(right) {
        return 1;
    }
    strsim::osa_distance(left, right)
}

fn words(name: &str) -> Vec<&str> {
    let mut words: Vec<_> = name.split(['_', '-']).filter(|word| !word.is_empty()).collect();
    words.sort_unstable();
    words
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn similar_names_are_suggested() {
        let known = ["fd_available", "robot_at", "at", "fd_solves_f"];
        let cases = [
            ("fd_availabel", Some("fd_available")),
            ("available_fd", Some("fd_available")),
            ("FD_SOLVE_F", Some("fd_solves_f")),
            ("ta", Some("at")),
            ("zz", None),
            ("a", None),
            ("battery", None),
        ];
        for (written, expected) in cases {
            assert_eq!(nearest(written, known), expected, "{written}");
        }
    }
}
