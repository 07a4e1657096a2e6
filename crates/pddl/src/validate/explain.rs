//! Explains unsatisfied conditions: returns the conjuncts that do not hold, with their objects and numeric
//! values.

use num_rational::BigRational;

use crate::ast::{Condition, Expression, Identifier, Term, TypedName};
use crate::print::condition_text;

use super::evaluate::{Bindings, Evaluator, Undefined};
use super::verdict::Unmet;
use super::world::World;

/// Returns the conjuncts of a condition that are false or undefined. Each conjunct has the values of the numeric
/// functions that it reads, except those that depend on quantified variables.
pub(super) fn unmet<'p>(
    evaluator: Evaluator<'_, 'p>,
    condition: &'p Condition,
    bindings: &mut Bindings<'p>,
) -> Vec<Unmet> {
    if let Condition::And(parts) = condition {
        return parts.iter().flat_map(|part| unmet(evaluator, part, bindings)).collect();
    }
    if evaluator.holds(condition, bindings) == Ok(true) {
        return Vec::new();
    }
    let mut ground = condition.clone();
    substitute(&mut ground, evaluator.world, bindings, &mut Vec::new());
    let mut functions = Vec::new();
    ground.walk_fluents(&mut |atom| functions.push(atom));
    let mut values: Vec<(String, Option<BigRational>)> = Vec::new();
    for function in functions {
        // The remaining variables are quantified.
        let Some(arguments) = evaluator.arguments(function, &Bindings::default()) else { continue };
        let symbol = evaluator.world.symbol(&function.predicate.name);
        let text = evaluator.world.show(symbol, &arguments);
        // A function can occur several times in a condition.
        if values.iter().all(|(listed, _)| *listed != text) {
            values.push((text, evaluator.state.values.get(&(symbol, arguments)).cloned()));
        }
    }
    vec![Unmet { condition: condition_text(&ground), values }]
}

pub(super) fn undefined_text(undefined: &Undefined) -> String {
    match undefined {
        Undefined::Function(function) => format!("the value of {function} is needed, but it was never set"),
        Undefined::Division => "division by zero".to_owned(),
        Undefined::Size => "a number grows too large".to_owned(),
        Undefined::Place => "`?duration` and `total-time` have no value here".to_owned(),
    }
}

/// Replaces bound variables by their objects. Variables in `hidden`, which inner quantifiers bind, are kept.
fn substitute(
    condition: &mut Condition,
    world: &World<'_>,
    bindings: &Bindings<'_>,
    hidden: &mut Vec<Identifier>,
) {
    match condition {
        Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
            let outer = hidden.len();
            hidden.extend(variables.iter().map(|entry: &TypedName| entry.identifier.clone()));
            substitute(body, world, bindings, hidden);
            hidden.truncate(outer);
        }
        Condition::Atom(atom) => substitute_terms(&mut atom.arguments, world, bindings, hidden),
        Condition::Equal(left, right, _) => {
            substitute_terms(std::slice::from_mut(left), world, bindings, hidden);
            substitute_terms(std::slice::from_mut(right), world, bindings, hidden);
        }
        Condition::Compare(_, left, right, _) => {
            for side in [left, right] {
                side.change_leaves(&mut |leaf| {
                    if let Expression::Fluent(atom) = leaf {
                        substitute_terms(&mut atom.arguments, world, bindings, hidden);
                    }
                });
            }
        }
        other => other.parts_mut().for_each(|part| substitute(part, world, bindings, hidden)),
    }
}

fn substitute_terms(terms: &mut [Term], world: &World<'_>, bindings: &Bindings<'_>, hidden: &[Identifier]) {
    for term in terms {
        let Term::Variable(Identifier { name, span }) = term else { continue };
        if hidden.iter().any(|variable| variable.name == *name) {
            continue;
        }
        if let Some(object) = bindings.get(name) {
            let name = crate::ast::Name::new(world.name(object));
            *term = Term::Constant(Identifier { name, span: *span });
        }
    }
}
