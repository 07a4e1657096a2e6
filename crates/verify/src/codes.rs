//! Explanations of the codes of this crate's error messages.

/// The error codes in ascending order. Each entry has four parts: code, meaning, cause, remedy.
pub const CODES: &[[&str; 4]] = &[[
    "M121",
    "A certificate cannot be read.",
    "Its directory lacks files of its manifest, or has changed files.",
    "Create it again with `plan --certificate DIR`.",
]];
