//! Converts conditions, effects and expressions of the syntax tree to lifted ones, and resolves their names
//! to ids.

use crate::lifted::configuration::formula_terms;
use crate::lifted::{Bound, Change, Effect, Expression, Formula, Rational, Term};
use crate::normalize::names::{Duration, Names, Scope};
use pddl::ast;
use rustc_hash::FxHashSet;

/// Converts a condition to negation normal form and resolves its names. Converts the negation of the
/// condition if `positive` is `false`.
pub(super) fn condition(
    names: &mut Names,
    written: &ast::Condition,
    positive: bool,
    scope: &mut Scope,
) -> Formula {
    use ast::Condition as C;
    let junction = |parts| if positive { Formula::And(parts) } else { Formula::Or(parts) };
    let any = |parts| if positive { Formula::Or(parts) } else { Formula::And(parts) };
    match written {
        C::And(parts) => junction(parts.iter().map(|part| condition(names, part, positive, scope)).collect()),
        C::Or(parts) => any(parts.iter().map(|part| condition(names, part, positive, scope)).collect()),
        C::Not(inner) => condition(names, inner, !positive, scope),
        C::Imply(premise, conclusion) => any(vec![
            condition(names, premise, !positive, scope),
            condition(names, conclusion, positive, scope),
        ]),
        C::ForAll(variables, body) | C::Exists(variables, body) => {
            let universal = matches!(written, C::ForAll(..)) == positive;
            let bound = names.quantify(variables, scope);
            let body = condition(names, body, positive, scope);
            scope.pop(variables.len());
            quantified(universal, bound, body)
        }
        C::Atom(atom) => {
            let predicate = names.predicate(&atom.predicate, scope.file);
            Formula::Literal { positive, predicate, terms: names.terms(atom, scope) }
        }
        C::Equal(left, right, _) => {
            Formula::Equal { positive, left: names.term(left, scope), right: names.term(right, scope) }
        }
        C::Compare(comparison, left, right, span) => {
            let (left, right) = (expression(names, left, scope), expression(names, right, scope));
            let formula = Formula::Compare(*comparison, left, right, scope.place(*span));
            if positive { formula } else { formula.negated() }
        }
    }
}

/// Builds a quantified condition. Variables that the body does not use are dropped, unless their type is
/// empty.
fn quantified(universal: bool, mut bound: Vec<Bound>, body: Formula) -> Formula {
    let mut used = FxHashSet::default();
    formula_terms(&body, &mut |term| {
        if let Term::Parameter(variable) = term {
            used.insert(variable);
        }
    });
    bound.retain(|variable| variable.candidates.is_empty() || used.contains(&variable.variable));
    match (bound.is_empty(), universal) {
        (true, _) => body,
        (false, true) => Formula::ForAll(bound, Box::new(body)),
        (false, false) => Formula::Exists(bound, Box::new(body)),
    }
}

pub(super) fn effect(names: &mut Names, written: &ast::Effect, scope: &mut Scope, out: &mut Vec<Effect>) {
    let change = match written {
        ast::Effect::And(parts) => return parts.iter().for_each(|part| effect(names, part, scope, out)),
        ast::Effect::ForAll(variables, inner) => {
            let bound = names.quantify(variables, scope);
            let first = out.len();
            effect(names, inner, scope, out);
            scope.pop(variables.len());
            for effect in &mut out[first..] {
                effect.bound.splice(0..0, bound.iter().cloned());
            }
            return;
        }
        ast::Effect::When(premise, inner) => {
            let condition = condition(names, premise, true, scope);
            let first = out.len();
            effect(names, inner, scope, out);
            for effect in &mut out[first..] {
                let outer_condition = std::mem::replace(&mut effect.condition, Formula::truth());
                effect.condition = Formula::And(vec![condition.clone(), outer_condition]);
            }
            return;
        }
        ast::Effect::Add(atom) => {
            Change::Add(names.predicate(&atom.predicate, scope.file), names.terms(atom, scope))
        }
        ast::Effect::Delete(atom) => {
            Change::Delete(names.predicate(&atom.predicate, scope.file), names.terms(atom, scope))
        }
        ast::Effect::Assign(assignment, atom, value, span) => Change::Assign {
            assignment: *assignment,
            function: names.function(&atom.predicate, scope.file),
            terms: names.terms(atom, scope),
            expression: expression(names, value, scope),
            place: scope.place(*span),
        },
    };
    out.push(Effect { bound: Vec::new(), condition: Formula::truth(), change });
}

pub(super) fn expression(names: &mut Names, written: &ast::Expression, scope: &mut Scope) -> Expression {
    use ast::Arithmetic as Op;
    match written {
        ast::Expression::Number(number, _) => Expression::Number(Rational::from_big(number.clone())),
        ast::Expression::Fluent(atom) => {
            let function = names.function(&atom.predicate, scope.file);
            Expression::Function(function, names.terms(atom, scope), scope.place(atom.span))
        }
        ast::Expression::Duration(span) => match &scope.duration {
            Duration::Fixed(duration) => duration.clone(),
            Duration::Open => {
                names.unsupported(
                    "`?duration` where the duration is not fixed",
                    "one `(= ?duration …)` in `:duration`, or plan with `--concurrent`",
                    scope.file,
                    *span,
                );
                Expression::Number(Rational::from_integer(0))
            }
            Duration::Instantaneous => {
                let instead = "a number: the action has no duration here";
                names.unsupported("`?duration`", instead, scope.file, *span);
                Expression::Number(Rational::from_integer(0))
            }
        },
        ast::Expression::TotalTime(_) => Expression::TotalTime,
        ast::Expression::Operation(op, operands, span) => {
            let place = scope.place(*span);
            let mut operands: Vec<_> =
                operands.iter().map(|operand| expression(names, operand, scope)).collect();
            match op {
                Op::Add => Expression::Sum(operands),
                Op::Multiply => Expression::Product(operands, place),
                Op::Subtract => {
                    let negated = operands.split_off(usize::from(operands.len() > 1));
                    operands.extend(negated.into_iter().map(|operand| Expression::Negate(Box::new(operand))));
                    Expression::Sum(operands)
                }
                Op::Divide => operands
                    .into_iter()
                    .reduce(|left, right| Expression::Quotient(Box::new(left), Box::new(right), place))
                    .unwrap_or(Expression::Sum(Vec::new())),
            }
        }
    }
}
