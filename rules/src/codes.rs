//! Explanations of the error codes of this crate.

/// Codes in ascending order, each with its meaning, cause and remedy.
pub const CODES: &[[&str; 4]] = &[
    [
        "R101",
        "The text is not a rule.",
        "The grammar of rules is broken at the place that the message shows.",
        "Write `[name] p(?x) ^ q(?x, ?y) -> r(?y) .`; the message says what was expected.",
    ],
    [
        "R102",
        "A prefix is declared nowhere.",
        "A name such as `ex:robot` has a prefix for which the text has no `@prefix` line.",
        "Declare it before the first rule: `@prefix ex: <http://example.org/#> .`",
    ],
    [
        "R104",
        "A built-in or relation is not known.",
        "The name is misspelt, belongs to a library that is not evaluated, works on lists, or is neither a class nor a property.",
        "Take the name that the message proposes, or conclude the relation by a rule of its own.",
    ],
    [
        "R105",
        "An atom is not SWRL.",
        "The text is read as plain SWRL, which has no negation and no aggregates.",
        "Put the rule into a rule file of its own, where `not` and aggregates are read.",
    ],
    [
        "R202",
        "A variable of the head is not bound.",
        "The head has a variable that no atom of the body gives a value.",
        "Add an atom with this variable to the body, or take the variable out of the head.",
    ],
    [
        "R203",
        "A variable is tested but never bound.",
        "It occurs in negated atoms, comparisons or built-ins only, so there is nothing to test.",
        "Add a positive atom that gives the variable its values.",
    ],
    [
        "R204",
        "A built-in has the wrong number of arguments.",
        "The built-in does not take as many arguments as it is given.",
        "Give the arguments that SWRL defines for it; the first one is the result where there is one.",
    ],
    [
        "R205",
        "A head has an atom that cannot be concluded.",
        "Heads conclude classes and properties; built-ins, negation and `differentFrom` are tests.",
        "Move the atom to the body.",
    ],
    [
        "R206",
        "Negation depends on itself.",
        "A rule negates what follows, directly or by other rules, from its own conclusion.",
        "Break the circle: conclude one of the predicates without the negation.",
    ],
    [
        "R207",
        "An atom has too many arguments.",
        "The engine stores at most 32 arguments of an atom.",
        "Split the relation into several.",
    ],
    [
        "R208",
        "An aggregate depends on itself.",
        "A rule counts or sums what follows, directly or by other rules, from its own conclusion.",
        "Break the circle: aggregate something that does not depend on the result.",
    ],
    [
        "R209",
        "An aggregate stands within an aggregate.",
        "Aggregates do not nest.",
        "Conclude the inner one by a rule of its own, and aggregate its conclusion.",
    ],
    [
        "R210",
        "A regular expression cannot be used.",
        "It is ill-formed, or has a back reference or a named Unicode block, which are not supported.",
        "Correct the pattern; the message shows it. Patterns are those of XPath, without back references.",
    ],
    [
        "R301",
        "The rules do not come to an end.",
        "The budget of steps is used up; usually a rule makes new values of its own conclusions, such as `swrlb:add` in a recursion.",
        "Bound the recursion by a condition; the message names the rule and the value that it made last. `reason --step-limit` raises the budget.",
    ],
    [
        "R302",
        "A symbol is not of this engine.",
        "A library was called with a fact or rule of another engine's symbols.",
        "Make all facts and rules of an engine with the same `Symbols`.",
    ],
    [
        "R303",
        "A fact has too many arguments.",
        "The engine stores at most 32 arguments of a fact.",
        "Split the relation into several.",
    ],
    [
        "R304",
        "The evaluation was interrupted.",
        "A limit was reached, or the caller asked to stop.",
        "Raise the limit; the engine is as it was before the update.",
    ],
];
