//! Compiles the action under way into the PDDL domain, so that each plan of the remaining mission begins with the
//! remainder of this action. The designs of the remainder are open.
//!
//! The paper (see [`crate::mapek`]) plans from the state in which the action has ended. Here, planning starts in the
//! current state, with the remainder of the action as the first step. So the designs of all remaining steps are chosen
//! together. A copy of the action's schema fixes all arguments except designs. Its duration, increases and decreases
//! are scaled to the remainder. The copy adds a gate fact that all other actions require.
//!
//! The conditions of the action, those of its effects, and the right-hand sides of its effects may mention a value that
//! the action changes. The past share of the changes is subtracted from this value, so that the remainder reads the
//! value that the whole action reads. At its start, the remainder applies the rest of the changes at start. Therefore,
//! only changes at end are subtracted in conditions over all and at end, and in effects at end.
//!
//! Whether a conditional change has taken place is unknown. Its past share is subtracted in the conditions of the
//! action, but not in its effects.

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

/// An increase or decrease by the whole action.
#[derive(Clone)]
struct NumericChange {
    fluent: Atom,
    /// Added number; negative for decreases.
    amount: Expression,
    is_conditional: bool,
}

/// Scales the duration, increases and decreases of an action to the share that is not yet `done`. In its conditions and
/// effects, subtracts the past share of the increases and decreases from each fluent.
fn shorten(action: &mut Action, done: &BigRational) {
    let remaining_share = BigRational::from_integer(1.into()) - done;
    let (duration, conditions, effects) = match &mut action.body {
        ActionBody::Durative { duration, conditions, effects } => (duration, conditions, effects),
        // The robot can report progress of an action without duration, too.
        ActionBody::Instantaneous { precondition, effect } => {
            if !done.is_zero() {
                let mut changes = Vec::new();
                shorten_effect(effect, &remaining_share, None, false, &mut changes);
                restore_condition(precondition, done, &changes);
                restore_effect(effect, done, &unconditional(&changes));
            }
            return;
        }
    };
    // Without a duration, start and end would be one happening, in which the end effects could violate start
    // conditions.
    let time_left = remaining_share.clone().max(BigRational::new(1.into(), LEAST_LEFT.into()));
    let whole = duration.iter().find(|constraint| constraint.operator == Comparison::Equal);
    let whole = whole.map(|constraint| constraint.expression.clone());
    let (mut all_changes, mut end_changes) = (Vec::<NumericChange>::new(), Vec::new());
    for (time, effect) in effects.iter_mut() {
        let mut changes = Vec::new();
        shorten_effect(effect, &remaining_share, whole.as_ref(), false, &mut changes);
        if *time == EffectTime::AtEnd {
            end_changes.extend(changes.iter().cloned());
        }
        all_changes.extend(changes);
    }
    for (time, condition) in conditions {
        let changes = if *time == ConditionTime::AtStart { &all_changes } else { &end_changes };
        restore_condition(condition, done, changes);
    }
    for (time, effect) in effects {
        let changes = if *time == EffectTime::AtStart { &all_changes } else { &end_changes };
        restore_effect(effect, done, &unconditional(changes));
    }
    for DurationConstraint { expression, .. } in duration {
        *expression = product(&time_left, expression.clone());
    }
}

/// Multiplies increases and decreases by `remaining_share`. Appends the unscaled change of each fluent to `changes`.
/// `whole` is the full duration, which replaces `?duration`. `is_conditional` states whether `effect` has a condition.
fn shorten_effect(
    effect: &mut Effect,
    remaining_share: &BigRational,
    whole: Option<&Expression>,
    is_conditional: bool,
    changes: &mut Vec<NumericChange>,
) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                shorten_effect(part, remaining_share, whole, is_conditional, changes);
            }
        }
        Effect::ForAll(_, body) => shorten_effect(body, remaining_share, whole, is_conditional, changes),
        Effect::When(_, body) => shorten_effect(body, remaining_share, whole, true, changes),
        Effect::Assign(kind @ (Assignment::Increase | Assignment::Decrease), target, value, _) => {
            if let Some(whole) = whole {
                substitute(value, &|part| matches!(part, Expression::Duration(_)).then(|| whole.clone()));
            }
            let sign = BigRational::from_integer(if *kind == Assignment::Increase { 1 } else { -1 }.into());
            let amount = product(&sign, value.clone());
            changes.push(NumericChange { fluent: target.clone(), amount, is_conditional });
            *value = product(remaining_share, value.clone());
        }
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => {}
    }
}

fn unconditional(changes: &[NumericChange]) -> Vec<NumericChange> {
    changes.iter().filter(|change| !change.is_conditional).cloned().collect()
}

/// Subtracts the share `done` of `changes` from each fluent in the conditions and right-hand sides of an effect.
fn restore_effect(effect: &mut Effect, done: &BigRational, changes: &[NumericChange]) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                restore_effect(part, done, changes);
            }
        }
        Effect::ForAll(_, body) => restore_effect(body, done, changes),
        Effect::When(condition, body) => {
            restore_condition(condition, done, changes);
            restore_effect(body, done, changes);
        }
        Effect::Assign(_, _, value, _) => restore_expression(value, done, changes),
        Effect::Add(_) | Effect::Delete(_) => {}
    }
}

/// Subtracts the share `done` of `changes` from each fluent in a condition.
fn restore_condition(condition: &mut Condition, done: &BigRational, changes: &[NumericChange]) {
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
            restore_expression(left, done, changes);
            restore_expression(right, done, changes);
        }
        Condition::Atom(_) | Condition::Equal(..) => {}
    }
}

fn restore_expression(expression: &mut Expression, done: &BigRational, changes: &[NumericChange]) {
    substitute(expression, &|part| {
        let Expression::Fluent(atom) = part else { return None };
        let mut value = part.clone();
        for change in changes.iter().filter(|change| is_same(&change.fluent, atom)) {
            let past_change = product(done, change.amount.clone());
            value = Expression::Operation(Arithmetic::Subtract, vec![value, past_change], Span::default());
        }
        Some(value)
    });
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

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::Source;
    use pddl::validate::{Advance, advance};

    use super::{GATE, resume};
    use crate::mapek::step::PlannedStep;
    use crate::mission::Mission;

    fn results(advance: &Advance) -> (Vec<String>, Vec<(String, BigRational)>) {
        let facts = advance.added.iter().map(|atom| atom.predicate.name.to_string());
        let values = advance.values.iter().map(|change| (change.text.clone(), change.after.clone()));
        (facts.filter(|name| name != GATE).collect(), values.collect())
    }

    /// Checks that the whole action adds `done`, and that its remainder after any progress has the same results.
    fn check(action: &str) {
        let domain = format!(
            "(define (domain d) (:requirements :fluents :durative-actions :conditional-effects) \
             (:predicates (done) (other)) (:functions (x) (y) (z)) {action})"
        );
        let problem =
            "(define (problem p) (:domain d) (:init (= (x) 100) (= (y) 20) (= (z) 0)) (:goal (done)))";
        let domain = pddl::parse_domain(&Source::new("d.pddl", domain)).0.expect("a domain");
        let problem = pddl::parse_problem(&Source::new("p.pddl", problem)).0.expect("a problem");
        let step = PlannedStep {
            action: "go".to_owned(),
            arguments: Vec::new(),
            written: 0,
            configuration: Vec::new(),
            duration: BigRational::default(),
            cost: BigRational::default(),
        };
        let whole = advance(&domain, &problem, &step.to_plan_step(), false).expect("it is executable");
        let expected = results(&whole);
        assert_eq!(expected.0, ["done"], "{action}");
        for percent in [0, 25, 50, 99_i32] {
            let done = BigRational::new(percent.into(), 100.into());
            let mut present = problem.clone();
            for change in whole.values.iter().filter(|change| !change.assigned) {
                let name = change.text.trim_matches(['(', ')']);
                let before = change.before.as_ref().expect("a value");
                Mission::add_to_value(&mut present, name, &((&change.after - before) * &done));
            }
            let remainder = advance(&resume(&domain, &step, &done), &present, &step.to_plan_step(), false);
            let remainder = remainder.unwrap_or_else(|error| panic!("{percent} % of {action}: {error:?}"));
            assert_eq!(results(&remainder), expected, "{percent} % of {action}");
        }
    }

    #[test]
    fn effects_of_a_remainder_read_the_values_of_the_whole_action() {
        // The condition and the right-hand sides are evaluated with x = 100.
        check(
            "(:action go :parameters () :precondition (>= (x) 95) :effect (and (decrease (x) 20) \
             (increase (y) (x)) (assign (z) (x)) (when (>= (x) 90) (done)) (when (< (x) 100) (other))))",
        );
        // The effects at start are evaluated with x = 100, those at end with x = 80 and y = 20.
        check(
            "(:durative-action go :parameters () :duration (= ?duration 10) :condition (at start (>= (x) 95)) \
             :effect (and (at start (decrease (x) 20)) (at end (decrease (y) 15)) (at end (assign (z) (y))) \
             (when (at start (< (x) 95)) (at start (other))) (when (at end (> (x) 80)) (at end (other))) \
             (when (at end (and (<= (x) 80) (>= (y) 20))) (at end (done)))))",
        );
    }

    #[test]
    fn conditions_of_a_remainder_read_the_values_of_the_whole_action() {
        // Between start and end, x is 80 and y is 20. The effects at end follow the conditions at end.
        check(
            "(:durative-action go :parameters () :duration (= ?duration 10) \
             :condition (and (at start (>= (x) 100)) (over all (<= (x) 80)) (over all (>= (y) 20)) \
             (at end (<= (x) 80)) (at end (>= (y) 20))) \
             :effect (and (at start (decrease (x) 20)) (at end (decrease (y) 15)) (at end (done))))",
        );
    }
}
