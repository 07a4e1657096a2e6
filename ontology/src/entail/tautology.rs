//! Assertions that hold in every knowledge base. The engine does not store them.

use rules::{Fact, Symbols};

use crate::vocab::owl;

/// Returns the reason why an assertion holds in every knowledge base; `None` for other assertions. Such an
/// assertion relates an individual to itself by `owl:sameAs`, or has the predicate `owl:Thing`,
/// `owl:topObjectProperty` or `owl:topDataProperty`.
pub fn tautology(symbols: &Symbols, fact: &Fact) -> Option<&'static str> {
    let is_individual = |argument| symbols.value(argument).as_name().is_some();
    match (symbols.value(fact.predicate).as_name()?, &fact.arguments[..]) {
        (owl::SAME_AS, &[left, right]) if left == right => Some("everything is the same as itself"),
        (owl::THING, &[individual]) if is_individual(individual) => Some("every individual is in owl:Thing"),
        (owl::TOP_OBJECT_PROPERTY, &[left, right]) if is_individual(left) && is_individual(right) => {
            Some("owl:topObjectProperty relates all individuals")
        }
        (owl::TOP_DATA_PROPERTY, &[individual, value])
            if is_individual(individual) && !is_individual(value) =>
        {
            Some("owl:topDataProperty relates all individuals to all values")
        }
        _ => None,
    }
}
