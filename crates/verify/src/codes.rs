//! Explanations of the message codes of this crate.

/// Codes in ascending order, each with its meaning, its cause and its remedy.
pub const CODES: &[[&str; 4]] = &[[
    "M121",
    "A certificate cannot be read.",
    "Its directory lacks files of its manifest, or has changed files.",
    "Create it again with `plan --certificate DIR`.",
]];
