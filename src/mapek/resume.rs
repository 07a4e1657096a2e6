//! Compiles the action under way into the PDDL domain, so that each plan of the remaining mission begins with the
//! remainder of this action. The designs of the remainder are open.
//!
//! The paper (see [`crate::mapek`]) plans from the state in which the action has ended. Here, planning starts in the
//! current state, with the remainder of the action as the first step. So the designs of all remaining steps are chosen
//! together. A copy of the action's schema fixes all arguments except designs. Its duration, increases and decreases
//! are scaled to the remainder. The copy adds a gate fact that all other actions require. A condition of the action may
//! mention a value that the action changes. In such conditions, except those at the end, the past changes are
//! subtracted from the value, which restores the value before the action.

use num_rational::BigRational;
use num_traits::Zero as _;
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Atom, Comparison, Condition, ConditionTime, Declaration,
    Domain, DurationConstraint, Effect, EffectTime, Expression, Identifier, Name, Span, Term,
};

use crate::mapek::step::PlannedStep;

/// Denominator of the least remaining share of a duration: an unfinished action with full progress still has
/// 1/`LEAST_LEFT` of its duration to go. The share is below the resolution of progress, 1/100.
const LEAST_LEFT: u32 = 1000;

/// Predicate that holds once the action under way has ended. Input files are assumed not to declare it.
pub(super) const GATE: &str = "metaplan_resumed";

/// Returns `domain` with the gate and, as the first action, a copy of the schema of `running` that is shortened to the
/// remainder. `done` is the completed share of `running`, from 0 to 1.
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
        // The copy requires that the gate fact does not hold, and adds this fact. So the remainder occurs exactly once.
        require(&mut copy, Condition::Not(Box::new(Condition::Atom(gate()))));
        open(&mut copy);
        // The copy comes first: if no schema of this name can start, the validator reports the violation of the copy.
        gated.actions.insert(0, copy);
    }
    gated
}

pub(crate) fn resumed_goal(goal: &Condition) -> Condition {
    Condition::And(vec![goal.clone(), Condition::Atom(gate())])
}

/// Scales the duration, increases and decreases of an action to the share that is not yet `done`. In its conditions,
/// except those at the end, each fluent that the action increases or decreases is replaced by its value before the
/// action.
fn shorten(action: &mut Action, done: &BigRational) {
    let remaining_share = BigRational::from_integer(1.into()) - done;
    let (duration, conditions, effects) = match &mut action.body {
        ActionBody::Durative { duration, conditions, effects } => (duration, conditions, effects),
        // The robot can report progress of an action without duration, too.
        ActionBody::Instantaneous { precondition, effect } => {
            if !done.is_zero() {
                let mut changes = Vec::new();
                shorten_effect(effect, &remaining_share, None, &mut changes);
                restore_condition(precondition, done, &changes);
            }
            return;
        }
    };
    // Without a duration, start and end would be one happening, in which the end effects could violate start
    // conditions.
    let time_left = remaining_share.clone().max(BigRational::new(1.into(), LEAST_LEFT.into()));
    let whole = duration.iter().find(|constraint| constraint.operator == Comparison::Equal);
    let whole = whole.map(|constraint| constraint.expression.clone());
    let mut changes = Vec::new();
    for (_, effect) in effects.iter_mut() {
        shorten_effect(effect, &remaining_share, whole.as_ref(), &mut changes);
    }
    // Conditions at the end are about the final values, which the remainder reaches.
    for (_, condition) in conditions.iter_mut().filter(|(time, _)| *time != ConditionTime::AtEnd) {
        restore_condition(condition, done, &changes);
    }
    for DurationConstraint { expression, .. } in duration {
        *expression = product(&time_left, expression.clone());
    }
}

/// Multiplies increases and decreases by `remaining_share`. Appends the unscaled change of each fluent to `changes`.
/// `whole` is the full duration, which replaces `?duration`.
fn shorten_effect(
    effect: &mut Effect,
    remaining_share: &BigRational,
    whole: Option<&Expression>,
    changes: &mut Vec<(Atom, Expression)>,
) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                shorten_effect(part, remaining_share, whole, changes);
            }
        }
        Effect::ForAll(_, body) | Effect::When(_, body) => {
            shorten_effect(body, remaining_share, whole, changes);
        }
        Effect::Assign(kind @ (Assignment::Increase | Assignment::Decrease), target, value, _) => {
            if let Some(whole) = whole {
                substitute(value, &|part| matches!(part, Expression::Duration(_)).then(|| whole.clone()));
            }
            let sign = BigRational::from_integer(if *kind == Assignment::Increase { 1 } else { -1 }.into());
            changes.push((target.clone(), product(&sign, value.clone())));
            *value = product(remaining_share, value.clone());
        }
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => {}
    }
}

/// Replaces each fluent in a condition by its value before the action: the fluent minus the share `done` of its
/// `changes`.
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

/// Replaces each subexpression for which `replace` returns an expression. Replacements are not visited.
fn substitute(expression: &mut Expression, replace: &dyn Fn(&Expression) -> Option<Expression>) {
    if let Some(replacement) = replace(expression) {
        *expression = replacement;
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
    let are_equal = |(left, right): (&Term, &Term)| match (left, right) {
        (Term::Variable(left), Term::Variable(right)) | (Term::Constant(left), Term::Constant(right)) => {
            left.name == right.name
        }
        _ => false,
    };
    left.predicate.name == right.predicate.name
        && left.arguments.len() == right.arguments.len()
        && left.arguments.iter().zip(&right.arguments).all(are_equal)
}

fn require(action: &mut Action, added: Condition) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            let before = std::mem::replace(precondition, Condition::And(Vec::new()));
            *precondition = Condition::And(vec![before, added]);
        }
        ActionBody::Durative { conditions, .. } => conditions.push((ConditionTime::AtStart, added)),
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
