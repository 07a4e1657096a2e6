//! The words that cannot be names.

/// The words that PRISM keeps for itself, and those that Storm does besides.
const RESERVED: [&str; 50] = [
    "A",
    "bool",
    "clock",
    "const",
    "csg",
    "ctmc",
    "C",
    "double",
    "dtmc",
    "E",
    "endinit",
    "endinvariant",
    "endmodule",
    "endobservables",
    "endrewards",
    "endsystem",
    "false",
    "formula",
    "filter",
    "func",
    "F",
    "global",
    "G",
    "init",
    "invariant",
    "I",
    "int",
    "label",
    "max",
    "mdp",
    "min",
    "module",
    "X",
    "nondeterministic",
    "observable",
    "observables",
    "of",
    "Pmax",
    "Pmin",
    "P",
    "pomdp",
    "popta",
    "probabilistic",
    "prob",
    "pta",
    "rate",
    "rewards",
    "Rmax",
    "Rmin",
    "true",
];

/// More of them.
const RESERVED_TOO: [&str; 10] =
    ["R", "S", "stochastic", "system", "U", "W", "smg", "ma", "player", "endplayer"];

/// Functions, which PRISM takes as names where no bracket follows; other tools do not everywhere.
const FUNCTIONS: [&str; 6] = ["floor", "ceil", "round", "pow", "mod", "log"];

/// Whether a word cannot be a name.
pub fn is_keyword(word: &str) -> bool {
    RESERVED.contains(&word) || RESERVED_TOO.contains(&word)
}

/// Whether a word should not be a name in a model that is written.
pub fn is_reserved(word: &str) -> bool {
    is_keyword(word) || FUNCTIONS.contains(&word)
}
