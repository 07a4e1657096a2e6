//! Derivations of facts, and violations of integrity constraints.

use std::fmt;

use crate::fact::Fact;
use crate::rule::RuleIdentity;
use crate::symbol::{Symbol, Symbols};

/// A derivation: each fact that it rests on once, so that its size is that of the facts involved, not of the tree
/// that repeats them.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Derivation {
    /// The first is the fact asked for; supports come after what they support.
    pub steps: Vec<DerivationStep>,
}

/// A fact and what makes it hold.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DerivationStep {
    /// What holds.
    pub fact: Fact,
    /// By what.
    pub reason: Reason,
}

/// What makes a fact hold.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Reason {
    /// It is stated.
    Asserted,
    /// The same holds of other names of the individuals.
    Equality {
        /// The positions in [`Derivation::steps`] of that fact and of the pairs of names; for a pair of names, of the
        /// pairs between them.
        supports: Vec<usize>,
    },
    /// A rule concludes it.
    Rule {
        /// Which rule.
        identity: RuleIdentity,
        /// The rule's variables and their values, those of aggregates' own left out; variables are named without
        /// question mark.
        bindings: Vec<(String, Symbol)>,
        /// For each relation atom of the body, in order, the position of its fact in [`Derivation::steps`].
        supports: Vec<usize>,
        /// For each negated atom of the body, in order, the fact that does not hold.
        absent: Vec<Fact>,
        /// For each aggregate of the body, in order, what it ran over.
        aggregates: Vec<Aggregated>,
    },
}

/// The value of an aggregate and the matches that it comes from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Aggregated {
    /// The value.
    pub result: Symbol,
    /// For each match the positions in [`Derivation::steps`] of the facts that its relation atoms found.
    pub matches: Vec<Vec<usize>>,
}

/// Something that must not hold, and does.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Violation {
    /// What is violated.
    pub cause: Cause,
    /// The facts that together violate it.
    pub supports: Vec<Fact>,
}

/// What a [`Violation`] violates.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Cause {
    /// A rule with an empty head.
    Constraint(RuleIdentity),
    /// A literal whose lexical form its datatype forbids.
    IllTyped(Symbol),
    /// A literal that would be the same as another literal or as an individual.
    Clash,
}

impl Cause {
    /// Prints what is violated in a line without its end: the label of a constraint or where it stands, or a sentence.
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
            Cause::Constraint(RuleIdentity { label: Some(label), .. }) => f.write_str(label),
            Cause::Constraint(identity) => write!(f, "{identity}"),
            Cause::IllTyped(literal) => {
                write!(f, "the datatype of {} forbids its value", self.symbols.value(*literal))
            }
            Cause::Clash => f.write_str("a literal is not the same as another literal or as an individual"),
        }
    }
}

impl Violation {
    /// Prints what is violated and the facts that violate it together, in a line without its end.
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
    /// Prints the derivation as an indented tree, a fact a line with its reason; what was printed before is not
    /// explained again.
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
                    let matched =
                        aggregates.iter().rev().flat_map(|aggregate| aggregate.matches.iter().rev());
                    stack.extend(matched.flat_map(|found| found.iter().rev().map(|&at| (at, depth + 2))));
                    stack.extend(supports.iter().rev().map(|&support| (support, depth + 1)));
                }
            }
        }
        Ok(())
    }
}
