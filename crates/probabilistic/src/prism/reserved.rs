//! Reserved words of the PRISM language.

/// Keywords of PRISM, and words that only Storm reserves.
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

/// Further reserved words.
const MORE_RESERVED: [&str; 10] =
    ["R", "S", "stochastic", "system", "U", "W", "smg", "ma", "player", "endplayer"];

/// Function names. PRISM accepts them as names if no parenthesis follows; other tools do not always.
const FUNCTIONS: [&str; 6] = ["floor", "ceil", "round", "pow", "mod", "log"];

/// Returns `true` if a word cannot be a name.
pub fn is_keyword(word: &str) -> bool {
    RESERVED.contains(&word) || MORE_RESERVED.contains(&word)
}

/// Returns `true` if a word should not be a name in a model that is written for other tools.
pub fn is_reserved(word: &str) -> bool {
    is_keyword(word) || FUNCTIONS.contains(&word)
}
