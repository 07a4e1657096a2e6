//! Spelling suggestions: the declared name that is most similar to an unknown one.

/// Returns the name most similar to `written`, if any is similar enough. Of equally similar names, the first
/// is returned.
pub(crate) fn nearest<'n>(written: &str, candidates: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let written = written.to_ascii_lowercase();
    // One edit per three characters, at most three.
    let limit = match written.chars().count() {
        0 | 1 => 0,
        length => (length / 3).clamp(1, 3),
    };
    let mut best: Option<(usize, &str)> = None;
    for name in candidates {
        let distance = distance(&written, &name.to_ascii_lowercase());
        if distance <= limit && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, name));
        }
    }
    best.map(|(_, name)| name)
}

/// Edit distance between two names (optimal string alignment). A permutation of the same words counts as one
/// edit.
fn distance(left: &str, right: &str) -> usize {
    // Too different for a suggestion; saves the quadratic computation.
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
    fn the_most_similar_name_is_suggested() {
        let names = ["fd_available", "robot_at", "at", "fd_solves_f"];
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
            assert_eq!(nearest(written, names), expected, "{written}");
        }
    }
}
