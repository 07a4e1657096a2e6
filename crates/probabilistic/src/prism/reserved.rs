//! Reserved words of the PRISM language.

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

/// Further reserved words, some of Storm or of PRISM extensions.
const MORE_RESERVED: [&str; 10] =
    ["R", "S", "stochastic", "system", "U", "W", "smg", "ma", "player", "endplayer"];

/// Names of functions. PRISM accepts them as identifiers if no parenthesis follows; other tools may not.
const FUNCTIONS: [&str; 6] = ["floor", "ceil", "round", "pow", "mod", "log"];

pub fn is_keyword(word: &str) -> bool {
    RESERVED.contains(&word) || MORE_RESERVED.contains(&word)
}

/// Returns `true` if a word should not be an identifier in a model for other tools: a reserved word or a function
/// name.
pub fn is_reserved(word: &str) -> bool {
    is_keyword(word) || FUNCTIONS.contains(&word)
}
