//! Derivations of facts, and violations of integrity constraints.

use std::fmt;

use crate::fact::Fact;
use crate::rule::RuleIdentity;
use crate::symbol::{Symbol, Symbols};

/// A derivation as a directed acyclic graph: each fact occurs only once, whereas it may occur many times
/// in the corresponding tree.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Derivation {
    /// Steps of the derivation. From [`Engine::why`](crate::Engine::why), the first step is the explained fact, and
    /// every other fact comes after the first fact that it supports (breadth-first order). From
    /// [`Engine::everything`](crate::Engine::everything), supports come before the facts that they support.
    pub steps: Vec<DerivationStep>,
}

/// A fact with its reason.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DerivationStep {
    /// The fact.
    pub fact: Fact,
    /// Reason why the fact holds.
    pub reason: Reason,
}

/// Reason why a fact holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Reason {
    /// The fact is stated.
    Asserted,
    /// The corresponding fact about other names of the same individuals holds.
    Equality {
        /// Positions in [`Derivation::steps`] of the corresponding fact and of the equal pairs of names.
        /// If the explained fact is an equality: positions of the pairs on a path between its names.
        supports: Vec<usize>,
    },
    /// A rule derives the fact.
    Rule {
        /// Identity of the rule.
        identity: RuleIdentity,
        /// Pairs of the name of a variable, without question mark, and its value. Variables local to aggregates are
        /// omitted.
        bindings: Vec<(String, Symbol)>,
        /// Positions in [`Derivation::steps`] of the facts matched by the relation atoms of the body, in
        /// order.
        supports: Vec<usize>,
        /// Facts that the negated atoms of the body require to be absent, in order. Empty if the derivation comes
        /// from [`Engine::everything`](crate::Engine::everything).
        absent: Vec<Fact>,
        /// Aggregates of the body, in order. Empty if the derivation comes from
        /// [`Engine::everything`](crate::Engine::everything).
        aggregates: Vec<Aggregated>,
    },
}

/// Value of an aggregate, with its matches.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Aggregated {
    /// Value of the aggregate.
    pub result: Symbol,
    /// One entry per match: positions in [`Derivation::steps`] of the facts matched by the relation
    /// atoms of the aggregate.
    pub matches: Vec<Vec<usize>>,
}

/// A violation of an integrity constraint, of a datatype, or of the principle that a literal equals neither another
/// literal nor an individual.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Violation {
    /// Cause of the violation.
    pub cause: Cause,
    /// Facts that cause the violation together.
    pub supports: Vec<Fact>,
}

/// Kind of a [`Violation`].
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Cause {
    /// A rule with an empty head whose body holds.
    Constraint(RuleIdentity),
    /// A literal whose lexical form is invalid for its datatype.
    IllTyped(Symbol),
    /// A literal that is stated or derived to equal an individual or a certainly different literal.
    Clash,
}

impl Cause {
    /// Formats the cause of a violation as one line. A constraint is shown by its label, or by its identity
    /// if it has none; the other causes are sentences.
    pub fn display<'a>(&'a self, symbols: &'a Symbols) -> impl fmt::Display + 'a {
        DisplayCause { cause: self, symbols }
    }
}

struct DisplayCause<'a> {
    cause: &'a Cause,
    symbols: &'a Symbols,
}

impl fmt::Display for DisplayCause<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cause {
            Cause::Constraint(identity) => match identity.label_line() {
                Some(label) => f.write_str(&label),
                None => write!(f, "{identity}"),
            },
            Cause::IllTyped(literal) => {
                write!(f, "the datatype of {} forbids its value", self.symbols.value(*literal))
            }
            Cause::Clash => f.write_str("a literal is not the same as another literal or as an individual"),
        }
    }
}

impl Violation {
    /// Formats the cause and the facts of the violation as one line, without a line break.
    pub fn display<'a>(&'a self, symbols: &'a Symbols) -> impl fmt::Display + 'a {
        DisplayViolation { violation: self, symbols }
    }
}

struct DisplayViolation<'a> {
    violation: &'a Violation,
    symbols: &'a Symbols,
}

impl fmt::Display for DisplayViolation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.violation.cause.display(self.symbols))?;
        for (position, fact) in self.violation.supports.iter().enumerate() {
            write!(f, "{}{}", if position == 0 { ": " } else { ", " }, fact.display(self.symbols))?;
        }
        Ok(())
    }
}

impl Derivation {
    /// Formats the derivation of the first step as an indented tree, with one line for each fact with its reason, for
    /// each absent fact and for each aggregate. A fact that occurs again is not explained again.
    pub fn display<'a>(&'a self, symbols: &'a Symbols) -> impl fmt::Display + 'a {
        DisplayDerivation { derivation: self, symbols }
    }
}

struct DisplayDerivation<'a> {
    derivation: &'a Derivation,
    symbols: &'a Symbols,
}

impl fmt::Display for DisplayDerivation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut printed = vec![false; self.derivation.steps.len()];
        let mut stack = vec![(0, 0)];
        while let Some((position, depth)) = stack.pop() {
            let step = &self.derivation.steps[position];
            write!(f, "{:indent$}{}", "", step.fact.display(self.symbols), indent = 2 * depth)?;
            let repeated = std::mem::replace(&mut printed[position], true);
            match &step.reason {
                Reason::Asserted => writeln!(f, " is stated")?,
                Reason::Rule { .. } | Reason::Equality { .. } if repeated => writeln!(f, ", as above")?,
                Reason::Equality { supports } => {
                    writeln!(f, " by equality")?;
                    stack.extend(supports.iter().rev().map(|&support| (support, depth + 1)));
                }
                Reason::Rule { identity, supports, absent, aggregates, .. } => {
                    writeln!(f, " by rule {identity}")?;
                    for fact in absent {
                        let fact = fact.display(self.symbols);
                        writeln!(f, "{:indent$}not {fact}", "", indent = 2 * depth + 2)?;
                    }
                    for Aggregated { result, matches } in aggregates {
                        let (result, count) = (self.symbols.value(*result), matches.len());
                        writeln!(f, "{:indent$}{result} from {count} matches", "", indent = 2 * depth + 2)?;
                    }
                    let matches =
                        aggregates.iter().rev().flat_map(|aggregate| aggregate.matches.iter().rev());
                    stack.extend(
                        matches.flat_map(|facts| facts.iter().rev().map(|&support| (support, depth + 2))),
                    );
                    stack.extend(supports.iter().rev().map(|&support| (support, depth + 1)));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Cause, Violation};
    use crate::rule::RuleIdentity;
    use crate::symbol::Symbols;

    #[test]
    fn a_violation_is_one_line() {
        let identity = RuleIdentity { label: Some("first\r\nsecond".into()), ..RuleIdentity::new("file", 0) };
        assert_eq!(identity.to_string(), "file#0 (first  second)");
        let violation = Violation { cause: Cause::Constraint(identity), supports: Vec::new() };
        assert_eq!(violation.display(&Symbols::default()).to_string(), "first  second");
    }
}
