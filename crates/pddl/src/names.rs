//! Which of the known names somebody may have meant.

/// The known name that is most like `written`, if one is like it at all; of equally near ones the first.
pub(crate) fn nearest<'n>(written: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let written = written.to_ascii_lowercase();
    let limit = match written.chars().count() {
        0 | 1 => 0,
        length => (length / 3).clamp(1, 3),
    };
    let mut best: Option<(usize, &str)> = None;
    for name in known {
        let distance = distance(&written, &name.to_ascii_lowercase());
        if distance <= limit && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, name));
        }
    }
    best.map(|(_, name)| name)
}

/// How many edits lie between two names; the same words in another order count as one.
fn distance(left: &str, right: &str) -> usize {
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
    fn near_names_are_found() {
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
