//! What the codes of messages mean that this crate gives.

/// Codes in their order, each with what it means, what causes it, and what to do.
pub const CODES: &[[&str; 4]] = &[[
    "M121",
    "A certificate cannot be read.",
    "Its directory has not the files that its manifest lists, or they are changed.",
    "Write it again with `plan --certificate DIR`.",
]];
