//! Explanations of the error codes of this crate.

/// Codes in ascending order, each with its meaning, cause and remedy.
pub const CODES: &[[&str; 4]] = &[
    [
        "R101",
        "The text is not a rule.",
        "The text violates the grammar of rules at the position in the message.",
        "Write `[name] p(?x) ^ q(?x, ?y) -> r(?y) .`; the message says what was expected.",
    ],
    [
        "R102",
        "A prefix is not declared.",
        "The text has no `@prefix` line for the prefix of a name such as `ex:robot`.",
        "Declare it before the first rule: `@prefix ex: <http://example.org/#> .`",
    ],
    [
        "R104",
        "A built-in or relation is unknown.",
        "The name is misspelt, belongs to an unsupported library, is a built-in for lists, or is neither a class nor a property.",
        "Use the name that the message proposes, or define the relation by a separate rule.",
    ],
    [
        "R105",
        "An atom is not SWRL.",
        "The text is read as plain SWRL, which has no negation and no aggregates.",
        "Move the rule to a rule file, which supports `not` and aggregates.",
    ],
    [
        "R202",
        "A variable of the head is not bound.",
        "The head has a variable that no atom of the body binds.",
        "Add an atom with this variable to the body, or remove the variable from the head.",
    ],
    [
        "R203",
        "A variable is tested but never bound.",
        "It occurs only in negated atoms, comparisons or built-ins, which do not bind it.",
        "Add a positive atom that binds the variable.",
    ],
    [
        "R204",
        "A built-in has the wrong number of arguments.",
        "The built-in is defined for another number of arguments.",
        "Use the arguments that SWRL defines for it. The result, if any, is the first argument.",
    ],
    [
        "R205",
        "A head has an atom that cannot be concluded.",
        "Heads can contain classes, properties, `sameAs` and `differentFrom`. Built-ins, negation and aggregates are tests.",
        "Move the atom to the body.",
    ],
    [
        "R206",
        "Negation depends on itself.",
        "A rule negates a predicate that depends, directly or by other rules, on its own conclusion.",
        "Break the cycle: infer one of the predicates without negation.",
    ],
    [
        "R207",
        "An atom has too many arguments.",
        "The engine stores at most 32 arguments of an atom.",
        "Split the relation into several relations.",
    ],
    [
        "R208",
        "An aggregate depends on itself.",
        "A rule aggregates a predicate that depends, directly or by other rules, on its own conclusion.",
        "Break the cycle: aggregate a predicate that does not depend on the result.",
    ],
    [
        "R209",
        "An aggregate is nested in another one.",
        "Aggregates cannot be nested.",
        "Compute the inner aggregate in a separate rule, and aggregate its conclusion.",
    ],
    [
        "R210",
        "A regular expression cannot be used.",
        "It is ill-formed, or has an unsupported back reference or named Unicode block.",
        "Correct the pattern in the message. Patterns are those of XPath, without back references.",
    ],
    [
        "R301",
        "The step budget of the rules is exhausted.",
        "The rules have too many matches, or do not terminate. Usually a rule computes new values from its own conclusions, for example with `swrlb:add` in a recursion.",
        "Bound the recursion by a condition. The message names the rule and its last new value. `reason --step-limit` sets the budget.",
    ],
    [
        "R302",
        "A symbol belongs to another engine.",
        "The library was called with a fact or rule whose symbols belong to another engine.",
        "Create all facts and rules of an engine with the same `Symbols`.",
    ],
    [
        "R303",
        "A fact has too many arguments.",
        "The engine stores at most 32 arguments of a fact.",
        "Split the relation into several relations.",
    ],
    [
        "R304",
        "The evaluation was interrupted.",
        "A limit was reached, or the caller requested a stop.",
        "Raise the limit. The engine has the state before the update.",
    ],
];
