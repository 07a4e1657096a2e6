//! What is left when an action is under way, as a domain: that action comes first, with whatever designs serve it.
//!
//! The paper plans from the state in which an action has ended. Ours plans from the state as it is, with what is left of the
//! action under way as the first step, so that its designs and all that follows are chosen together. A copy of its
//! schema has its other arguments fixed, takes what is left of its duration and its increases and decreases, and opens
//! a gate that every other action waits for. Where a condition on the start of the action mentions a value that the
//! action changes, what has been changed so far with the designs at hand counts as not yet changed: the condition asks
//! whether what is left can be done.

use num_rational::BigRational;
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Atom, Comparison, Condition, ConditionTime, Declaration,
    Domain, DurationConstraint, Effect, EffectTime, Expression, Identifier, Name, Span, Term,
};

use crate::mapek::step::PlannedStep;

/// Of the duration of an action that has done all it should and has not ended, so much is taken to be left: one part of so
/// many. Progress comes in hundredths.
const LEAST_LEFT: u32 = 1000;

/// Holds once the action under way has ended; no file has such a predicate.
pub(super) const GATE: &str = "metaplan_resumed";

/// The domain for what is left when so much of `running` is done, from 0 to 1.
pub(crate) fn resume(domain: &Domain, running: &PlannedStep, done: &BigRational) -> Domain {
    let mut gated = domain.clone();
    gated.predicates.push(Declaration { identifier: identifier(GATE), parameters: Vec::new() });
    for action in &mut gated.actions {
        require(action, Condition::Atom(gate()));
    }
    let name = Name::new(&running.action);
    let context = running.context();
    let schemas = domain.actions.iter().filter(|action| action.identifier.name == name);
    for schema in schemas.filter(|schema| schema.parameters.len() == context.len()) {
        let mut copy = schema.clone();
        shorten(&mut copy, done);
        for (parameter, value) in schema.parameters.iter().zip(&context) {
            if let Some(value) = value {
                let variable = Term::Variable(parameter.identifier.clone());
                let constant = Term::Constant(identifier(value));
                require(&mut copy, Condition::Equal(variable, constant, Span::default()));
            }
        }
        require(&mut copy, Condition::Not(Box::new(Condition::Atom(gate()))));
        open(&mut copy);
        // Of schemas with one name the first that is possible is taken.
        gated.actions.insert(0, copy);
    }
    gated
}

/// A goal that asks for the end of the action under way, too.
pub(crate) fn resumed_goal(goal: &Condition) -> Condition {
    Condition::And(vec![goal.clone(), Condition::Atom(gate())])
}

/// What is left of an action.
fn shorten(action: &mut Action, done: &BigRational) {
    let ActionBody::Durative { duration, conditions, effects } = &mut action.body else { return };
    let left = BigRational::from_integer(1.into()) - done;
    // The start and the end of what takes no time are one happening, in which one spoils what the other needs.
    let time_left = left.clone().max(BigRational::new(1.into(), LEAST_LEFT.into()));
    let whole = duration.iter().find(|constraint| constraint.operator == Comparison::Equal);
    let whole = whole.map(|constraint| constraint.expression.clone());
    let mut changes = Vec::new();
    for (_, effect) in effects.iter_mut() {
        shorten_effect(effect, &left, whole.as_ref(), &mut changes);
    }
    for (_, condition) in conditions.iter_mut().filter(|(time, _)| *time != ConditionTime::AtEnd) {
        restore_condition(condition, done, &changes);
    }
    for DurationConstraint { expression, .. } in duration {
        *expression = product(&time_left, expression.clone());
    }
}

/// Leaves so much of the increases and decreases, and notes what each whole one adds to which function.
fn shorten_effect(
    effect: &mut Effect,
    left: &BigRational,
    whole: Option<&Expression>,
    changes: &mut Vec<(Atom, Expression)>,
) {
    match effect {
        Effect::And(parts) => parts.iter_mut().for_each(|part| shorten_effect(part, left, whole, changes)),
        Effect::ForAll(_, body) | Effect::When(_, body) => shorten_effect(body, left, whole, changes),
        Effect::Assign(kind @ (Assignment::Increase | Assignment::Decrease), target, value, _) => {
            if let Some(whole) = whole {
                substitute(value, &|part| matches!(part, Expression::Duration(_)).then(|| whole.clone()));
            }
            let sign = BigRational::from_integer(if *kind == Assignment::Increase { 1 } else { -1 }.into());
            changes.push((target.clone(), product(&sign, value.clone())));
            *value = product(left, value.clone());
        }
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => {}
    }
}

/// Takes back what has been changed so far, in a condition.
fn restore_condition(condition: &mut Condition, done: &BigRational, changes: &[(Atom, Expression)]) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                restore_condition(part, done, changes);
            }
        }
        Condition::Not(body) | Condition::Exists(_, body) | Condition::ForAll(_, body) => {
            restore_condition(body, done, changes);
        }
        Condition::Imply(left, right) => {
            restore_condition(left, done, changes);
            restore_condition(right, done, changes);
        }
        Condition::Compare(_, left, right, _) => {
            let before = |part: &Expression| {
                let Expression::Fluent(atom) = part else { return None };
                let mut value = part.clone();
                for (_, change) in changes.iter().filter(|(target, _)| is_same(target, atom)) {
                    let so_far = product(done, change.clone());
                    value = Expression::Operation(Arithmetic::Subtract, vec![value, so_far], Span::default());
                }
                Some(value)
            };
            substitute(left, &before);
            substitute(right, &before);
        }
        Condition::Atom(_) | Condition::Equal(..) => {}
    }
}

/// Replaces parts of an expression; what comes in their place is not looked at again.
fn substitute(expression: &mut Expression, replace: &dyn Fn(&Expression) -> Option<Expression>) {
    if let Some(other) = replace(expression) {
        *expression = other;
    } else if let Expression::Operation(_, parts, _) = expression {
        for part in parts {
            substitute(part, replace);
        }
    }
}

fn product(factor: &BigRational, expression: Expression) -> Expression {
    let factor = Expression::Number(factor.clone(), Span::default());
    Expression::Operation(Arithmetic::Multiply, vec![factor, expression], Span::default())
}

fn is_same(left: &Atom, right: &Atom) -> bool {
    let same = |(left, right): (&Term, &Term)| match (left, right) {
        (Term::Variable(left), Term::Variable(right)) | (Term::Constant(left), Term::Constant(right)) => {
            left.name == right.name
        }
        _ => false,
    };
    left.predicate.name == right.predicate.name
        && left.arguments.len() == right.arguments.len()
        && left.arguments.iter().zip(&right.arguments).all(same)
}

fn require(action: &mut Action, more: Condition) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            let before = std::mem::replace(precondition, Condition::And(Vec::new()));
            *precondition = Condition::And(vec![before, more]);
        }
        ActionBody::Durative { conditions, .. } => conditions.push((ConditionTime::AtStart, more)),
    }
}

fn open(action: &mut Action) {
    match &mut action.body {
        ActionBody::Instantaneous { effect, .. } => {
            let before = std::mem::replace(effect, Effect::And(Vec::new()));
            *effect = Effect::And(vec![before, Effect::Add(gate())]);
        }
        ActionBody::Durative { effects, .. } => effects.push((EffectTime::AtEnd, Effect::Add(gate()))),
    }
}

fn gate() -> Atom {
    Atom { predicate: identifier(GATE), arguments: Vec::new(), span: Span::default() }
}

fn identifier(name: &str) -> Identifier {
    Identifier { name: Name::new(name), span: Span::default() }
}
