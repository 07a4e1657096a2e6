//! Residual conditions to conjunctive normal form.

use crate::error::{Error, File, Place};
use crate::ground::evaluate::{AtomId, Failure, Residual};
use crate::lifted::Rational;
use crate::pddl::ast::Span;
use crate::quantity::Linear;

/// A conjunction of literals, clauses and comparisons.
#[derive(Debug, Clone, Default)]
pub(crate) struct GroundCondition {
    pub(crate) literals: Vec<(AtomId, bool)>,
    pub(crate) clauses: Vec<Vec<(AtomId, bool)>>,
    pub(crate) comparisons: Vec<(Linear<Rational>, bool)>,
}

/// Conjunctive normal form; `Failure::Undefined` if the condition is false.
pub(crate) fn condition(parts: &[Residual]) -> Result<GroundCondition, Failure> {
    let mut condition = GroundCondition::default();
    for part in parts {
        conjoin(part, &mut condition)?;
    }
    condition.literals.sort_unstable();
    condition.literals.dedup();
    condition.clauses.sort_unstable();
    condition.clauses.dedup();
    let contradictory = condition.literals.windows(2).any(|pair| pair[0].0 == pair[1].0);
    if contradictory { Err(Failure::Undefined) } else { Ok(condition) }
}

fn conjoin(residual: &Residual, condition: &mut GroundCondition) -> Result<(), Failure> {
    match residual {
        Residual::True => {}
        Residual::False => return Err(Failure::Undefined),
        Residual::And(parts) => {
            for part in parts {
                conjoin(part, condition)?;
            }
        }
        Residual::Literal { atom, positive } => condition.literals.push((*atom, *positive)),
        Residual::Compare { linear, strict, .. } => condition.comparisons.push((linear.clone(), *strict)),
        Residual::Or(_) => {
            for clause in clauses(residual)? {
                match clause[..] {
                    [] => return Err(Failure::Undefined),
                    [literal] => condition.literals.push(literal),
                    _ => condition.clauses.push(clause),
                }
            }
        }
    }
    Ok(())
}

/// The clauses of a condition, by distribution; tautologies are left out.
fn clauses(residual: &Residual) -> Result<Vec<Vec<(AtomId, bool)>>, Failure> {
    const LIMIT: usize = 10_000;
    match residual {
        Residual::True => Ok(Vec::new()),
        Residual::False => Ok(vec![Vec::new()]),
        Residual::Literal { atom, positive } => Ok(vec![vec![(*atom, *positive)]]),
        Residual::And(parts) => {
            let mut all = Vec::new();
            for part in parts {
                all.extend(clauses(part)?);
            }
            Ok(all)
        }
        Residual::Or(parts) => {
            let mut product: Vec<Vec<(AtomId, bool)>> = vec![Vec::new()];
            for part in parts {
                let more = clauses(part)?;
                let pairs = product.iter().flat_map(|left| more.iter().map(move |right| (left, right)));
                let mut next = Vec::new();
                for (left, right) in pairs {
                    let mut clause: Vec<_> = left.iter().chain(right).copied().collect();
                    clause.sort_unstable();
                    clause.dedup();
                    if clause.windows(2).all(|pair| pair[0].0 != pair[1].0) {
                        next.push(clause);
                    }
                    if next.len() > LIMIT {
                        return Err(Failure::Error(unsupported_disjunction(None)));
                    }
                }
                product = next;
            }
            Ok(product)
        }
        Residual::Compare { place, .. } => Err(Failure::Error(unsupported_disjunction(Some(*place)))),
    }
}

fn unsupported_disjunction(place: Option<Place>) -> Error {
    let nowhere = Place { file: File::Domain, span: Span::default() };
    Error::Unsupported {
        construct: "a numeric comparison (or thousands of alternatives) inside a disjunction".into(),
        instead: "one action for each alternative".into(),
        place: place.unwrap_or(nowhere),
    }
}
