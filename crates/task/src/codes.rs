//! Error codes of this crate with meaning, cause and remedy.

/// Codes in ascending order, each with meaning, cause and remedy.
pub const CODES: &[[&str; 4]] = &[
    [
        "E301",
        "A construct cannot be planned with.",
        "It is read and can be validated, but the planner does not handle it; or a number is read that has no initial value.",
        "The message says what is accepted in its place.",
    ],
    [
        "E302",
        "A name is not known while the task is grounded.",
        "A library was called with a problem that was not checked.",
        "Check the problem first (`pddl::check`); the command line does so always.",
    ],
    [
        "E303",
        "An expression is not linear.",
        "A product or quotient of numbers that actions change is used where an exact linear one is needed.",
        "Make one of the factors a constant, or split the action by cases.",
    ],
    [
        "E304",
        "Numbers are too large.",
        "After scaling to integers, a number exceeds what the arithmetic holds, or no scale makes integers of the fractions.",
        "Write fewer decimals, or smaller units. Some searches do without: `plan` falls back to exact rationals where it can.",
    ],
    [
        "E305",
        "The reachability analysis refuses an action or axiom.",
        "It has more variables than are supported, 65,535.",
        "Split the action or axiom.",
    ],
    [
        "E306",
        "A limit was reached while the task was grounded.",
        "The limits of time or memory do not suffice to write out the actions.",
        "Raise the limit, or use fewer objects and parameters.",
    ],
];
