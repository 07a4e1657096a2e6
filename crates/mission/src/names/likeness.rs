//! Fuzzy matching of names in the knowledge base and in the problem, by edit distance and common
//! words.

use std::collections::BTreeMap;

use diagnostics::nearest;

/// Minimum similarity of a matched pair, on the scale from 0 to 1 of [`likeness`]. At this value, half of the words
/// are equal.
const ALIKE: f64 = 0.5;
/// Maximum number of names of each list that [`pairs`] compares, because the time is quadratic.
const COMPARED: usize = 500;
/// Maximum number of names in a list of a message; further names are only counted.
const SHOWN: usize = 12;

/// Returns pairs of similar names, one from each list, matched greedily by descending similarity.
/// Each name occurs in at most one pair. Of each list, only the first 500 names are compared.
pub(super) fn pairs<'n>(left: &[&'n str], right: &[&'n str]) -> Vec<(&'n str, &'n str)> {
    let mut candidates: Vec<(f64, usize, usize)> = Vec::new();
    for (l, one) in left.iter().enumerate().take(COMPARED) {
        for (r, other) in right.iter().enumerate().take(COMPARED) {
            let likeness = likeness(one, other);
            if likeness >= ALIKE {
                candidates.push((likeness, l, r));
            }
        }
    }
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut used, mut matches) = ((vec![false; left.len()], vec![false; right.len()]), Vec::new());
    for (_, l, r) in candidates {
        if !used.0[l] && !used.1[r] {
            (used.0[l], used.1[r]) = (true, true);
            matches.push((l, r));
        }
    }
    matches.sort_unstable();
    matches.into_iter().map(|(l, r)| (left[l], right[r])).collect()
}

/// Returns a similarity from 0 to 1: 1 for names within the edit distance of a typing error,
/// otherwise the share of common words. An equal first word such as `fd` does not count, because it
/// only names the kind of entity.
fn likeness(one: &str, other: &str) -> f64 {
    if nearest(one, [other]).is_some() {
        return 1.0;
    }
    let (one, other) = (one.to_lowercase(), other.to_lowercase());
    let (mut one, mut other) = (words(&one), words(&other));
    if one.first() == other.first() && one.len() > 1 && other.len() > 1 {
        (one, other) = (one[1..].to_vec(), other[1..].to_vec());
    }
    let shared = one.iter().filter(|word| other.contains(word)).count();
    let count = |number: usize| u32::try_from(number).map_or(f64::MAX, f64::from);
    2.0 * count(shared) / count(one.len() + other.len()).max(1.0)
}

fn words(name: &str) -> Vec<&str> {
    name.split(['_', '-', '.']).filter(|word| !word.is_empty()).collect()
}

/// Formats pairs as entries of `[bindings.names]`. Several pairs with the same beginnings become
/// one pattern; other pairs become exact entries.
pub(super) fn entries(pairs: &[(&str, &str)]) -> Vec<String> {
    let mut heads: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let head = |pair: &(&'_ str, &'_ str)| {
        let common = ending(pair.0, pair.1);
        (pair.0.len() - common, pair.1.len() - common)
    };
    let parts: Vec<_> = pairs.iter().map(|pair| (head(pair), *pair)).collect();
    for ((left, right), pair) in &parts {
        *heads.entry((&pair.0[..*left], &pair.1[..*right])).or_default() += 1;
    }
    let mut entries = Vec::new();
    for ((left, right), pair) in &parts {
        let (one, other) = (&pair.0[..*left], &pair.1[..*right]);
        let is_pattern = heads[&(one, other)] > 1 && *left > 0 && *right > 0 && *left < pair.0.len();
        let entry = if is_pattern {
            format!("\"{one}*\" = \"{other}*\"")
        } else {
            format!("{} = \"{}\"", key(pair.0), pair.1)
        };
        if !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    entries
}

fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.chars().all(bare) { name.to_owned() } else { format!("\"{name}\"") }
}

/// Returns the length in bytes of the longest common ending that follows a separator (`_` or `-`) in both
/// names; 0 without such an ending.
fn ending(one: &str, other: &str) -> usize {
    let mut common = 0;
    for ((at, a), (_, b)) in one.char_indices().rev().zip(other.char_indices().rev()) {
        if a != b {
            break;
        }
        if a == '_' || a == '-' {
            common = one.len() - at - a.len_utf8();
        }
    }
    common
}

pub(super) fn list(names: &[&str]) -> String {
    let listed = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names.len() {
        0 => "none".to_owned(),
        count if count > SHOWN => format!("{listed} and {} more", count - SHOWN),
        _ => listed,
    }
}

#[cfg(test)]
mod tests {
    use super::{entries, pairs};

    #[test]
    fn names_that_share_words_are_pairs() {
        let left =
            ["fd_spiral_high", "fd_spiral_low", "fd_recover_thrusters", "fd_all_thrusters", "fd_cameera"];
        let right = ["fd_search_low", "fd_search_high", "fd_recover_motion", "fd_camera", "fd_follow"];
        let matches = pairs(&left, &right);
        let expected = [
            ("fd_spiral_high", "fd_search_high"),
            ("fd_spiral_low", "fd_search_low"),
            ("fd_recover_thrusters", "fd_recover_motion"),
            ("fd_cameera", "fd_camera"),
        ];
        assert_eq!(matches, expected);
        let written = [
            "\"fd_spiral_*\" = \"fd_search_*\"",
            "fd_recover_thrusters = \"fd_recover_motion\"",
            "fd_cameera = \"fd_camera\"",
        ];
        assert_eq!(entries(&matches), written);
        assert_eq!(pairs(&["fd_low", "x"], &["fd_high", ""]), []);
    }
}
