//! Which names of one side may stand for which of the other: by the words that they have in common.

use std::collections::BTreeMap;

use crate::message::nearest;

/// Names are alike from here on: half of their words are the same.
const ALIKE: f64 = 0.5;
/// So many names of a list are shown.
const SHOWN: usize = 12;

/// Pairs of names that are alike, the most alike first; each name is in one pair at most.
pub(super) fn pairs<'n>(left: &[&'n str], right: &[&'n str]) -> Vec<(&'n str, &'n str)> {
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for (l, one) in left.iter().enumerate() {
        for (r, other) in right.iter().enumerate() {
            let likeness = likeness(one, other);
            if likeness >= ALIKE {
                all.push((likeness, l, r));
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut taken, mut found) = ((vec![false; left.len()], vec![false; right.len()]), Vec::new());
    for (_, l, r) in all {
        if !taken.0[l] && !taken.1[r] {
            (taken.0[l], taken.1[r]) = (true, true);
            found.push((l, r));
        }
    }
    found.sort_unstable();
    found.into_iter().map(|(l, r)| (left[l], right[r])).collect()
}

/// From 0 to 1: one for names that a slip of the pen tells apart, else the share of words that both have. Words that stand
/// before all names of a kind, such as `fd`, do not count.
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

/// Pairs as entries of `[bindings.names]`: a pattern where several pairs end alike, and exact ones for the others.
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

/// A key of TOML.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.chars().all(bare) { name.to_owned() } else { format!("\"{name}\"") }
}

/// How long the last words are that two names have in common, in bytes.
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

/// Names as a list; `none` if there are none.
pub(super) fn list(names: &[&str]) -> String {
    let shown = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match names.len() {
        0 => "none".to_owned(),
        count if count > SHOWN => format!("{shown} and {} more", count - SHOWN),
        _ => shown,
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
        let found = pairs(&left, &right);
        let expected = [
            ("fd_spiral_high", "fd_search_high"),
            ("fd_spiral_low", "fd_search_low"),
            ("fd_recover_thrusters", "fd_recover_motion"),
            ("fd_cameera", "fd_camera"),
        ];
        assert_eq!(found, expected);
        let written = [
            "\"fd_spiral_*\" = \"fd_search_*\"",
            "fd_recover_thrusters = \"fd_recover_motion\"",
            "fd_cameera = \"fd_camera\"",
        ];
        assert_eq!(entries(&found), written);
        assert_eq!(pairs(&["fd_low", "x"], &["fd_high", ""]), []);
    }
}
