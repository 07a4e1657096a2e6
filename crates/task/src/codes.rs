//! Error codes of the grounding stage, each with its meaning, cause and remedy.

/// Error codes in ascending order. Each entry is `[code, meaning, cause, remedy]`.
pub const CODES: &[[&str; 4]] = &[
    [
        "E301",
        "The planner does not support a construct.",
        "It can be parsed and validated, but not planned; or an expression uses a number without an initial value.",
        "The message shows what is supported instead.",
    ],
    [
        "E302",
        "Grounding has found an unknown name.",
        "The library was called with a problem that was not checked.",
        "Check the problem first (`pddl::check`). The command line always does this.",
    ],
    [
        "E303",
        "An expression is not linear, or has no value.",
        "It has a product or quotient of numbers that actions change, or a metric has the divisor 0.",
        "Use a constant factor, or split the action into cases. Correct the divisor.",
    ],
    [
        "E304",
        "Numbers are too large.",
        "A number is too large after scaling to integers, or no admissible factor scales all fractions to integers.",
        "Use fewer decimals, or other units. `plan` falls back to exact rationals if possible.",
    ],
    [
        "E305",
        "The reachability analysis refuses an action or axiom.",
        "It has more than the supported 65,535 variables.",
        "Split the action or axiom.",
    ],
    [
        "E306",
        "A limit was reached during grounding.",
        "The time or memory limit does not suffice to instantiate the actions, or Ctrl-C was pressed.",
        "Raise the limit, or use fewer objects and parameters.",
    ],
];
