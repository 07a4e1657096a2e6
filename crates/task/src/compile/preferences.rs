//! Compiles preferences to hidden actions that evaluate the preferences after the last action of the plan.
//!
//! Each instance of a preference on the goal or a trajectory constraint gets two hidden actions. One requires
//! that the instance is satisfied; the other requires that the instance is violated, and increases the count
//! of violations. Exactly one of the two is applicable. The instances are evaluated in a fixed order, and the
//! hidden actions change only auxiliary atoms and the counts. Every plan thus has exactly one evaluation.
//! Preferences in preconditions are counted by conditional effects of their actions instead.
//!
//! If actions may overlap, executed hidden actions would extend the makespan. Each instance then gets one
//! hidden action that is never executed. Its precondition is the violation of the instance, and is evaluated
//! in the last state.

use num_rational::BigRational;
use num_traits::{One, Zero};

use pddl::ast::{
    Action, ActionBody, Assignment, Atom, Condition, Declaration, Domain, Effect, EffectTime, Expression,
    InitialElement, Name, Problem, Span,
};

use super::semantics::PlanSemantics;
use super::simplify::{all, flag, holds, not};
use super::syntax_edits::{PreferenceInstance, declare, happen, hidden, require};

/// Auxiliary atom that holds until the evaluation of preferences begins. Actions of the domain require it.
const GOING_ON: &str = "the plan goes on";

pub(super) const VIOLATION: &str = " is violated";
pub(super) const SATISFACTION: &str = " is met";

/// Atom that hidden actions add if actions may overlap. It is never true in a state of a plan, because plans do not
/// contain these actions.
const VIOLATED: &str = "a preference is violated";

/// Beginning of the names of the functions that count violations. It contains a space, so no other function has it.
const COUNT: &str = "violations of ";

pub(super) fn count(preference: &Name) -> Atom {
    flag(&format!("{COUNT}{preference}"))
}

pub(super) fn is_count(function: &Name) -> bool {
    function.as_str().starts_with(COUNT)
}

fn violate(preference: &Name) -> Effect {
    let unit = Expression::Number(BigRational::one(), Span::default());
    Effect::Assign(Assignment::Increase, count(preference), unit, Span::default())
}

/// Adds hidden actions, violation counts and counting effects for the preferences `used_preferences`. `wanted` holds
/// the instances of preferences on the goal and on trajectories.
pub(super) fn install(
    domain: &mut Domain,
    problem: &mut Problem,
    (wanted, used_preferences): (Vec<PreferenceInstance>, &[Name]),
    course: PlanSemantics<'_>,
) {
    for name in used_preferences {
        let function = count(name);
        domain.functions.push(Declaration { identifier: function.predicate.clone(), parameters: Vec::new() });
        problem.init.push(InitialElement::Value(function, BigRational::zero(), Span::default()));
    }
    for action in &mut domain.actions {
        count_preferences(action, used_preferences);
    }
    if matches!(course, PlanSemantics::Overlapping(_)) {
        look_up(domain, problem.name.span, wanted);
    } else if !wanted.is_empty() {
        follow(domain, problem, wanted);
    }
}

fn follow(domain: &mut Domain, problem: &mut Problem, wanted: Vec<PreferenceInstance>) {
    declare(domain, GOING_ON);
    problem.init.push(InitialElement::Fact(flag(GOING_ON)));
    for action in &mut domain.actions {
        require(action, EffectTime::AtStart, holds(GOING_ON));
    }
    let goal = std::mem::replace(&mut problem.goal, Condition::And(Vec::new()));
    let mut before = GOING_ON.to_owned();
    let mut first = Some(goal);
    for ((name, condition), number) in wanted.into_iter().zip(1_u64..) {
        let after = format!("{number} preferences are judged");
        declare(domain, &after);
        // The goal must hold at the first evaluation. It then also holds after the later evaluations, because
        // they change no atom of the goal.
        let ready = all([holds(&before)].into_iter().chain(first.take()));
        let pass = [Effect::Delete(flag(&before)), Effect::Add(flag(&after))];
        let met = (format!("preference {number}{SATISFACTION}"), condition.clone(), None);
        let violated = (format!("preference {number}{VIOLATION}"), not(condition), Some(violate(&name)));
        for (own, condition, cost) in [met, violated] {
            let body = ActionBody::Instantaneous {
                precondition: all([ready.clone(), condition]),
                effect: Effect::And(pass.iter().cloned().chain(cost).collect()),
            };
            domain.actions.push(hidden(&own, body, problem.name.span));
        }
        before = after;
    }
    problem.goal = holds(&before);
}

fn look_up(domain: &mut Domain, span: Span, wanted: Vec<PreferenceInstance>) {
    if !wanted.is_empty() {
        declare(domain, VIOLATED);
    }
    for ((name, condition), number) in wanted.into_iter().zip(1_u64..) {
        // An action whose only effect is a cost can be pruned. So the action also sets a flag that is false before.
        let precondition = all([not(condition), not(holds(VIOLATED))]);
        let effect = Effect::And(vec![violate(&name), Effect::Add(flag(VIOLATED))]);
        let body = ActionBody::Instantaneous { precondition, effect };
        domain.actions.push(hidden(&format!("preference {number}{VIOLATION}"), body, span));
    }
}

/// Moves the preferences in the preconditions of an action to conditional effects that count their
/// violations. Preferences that are not in `used_preferences` are dropped.
fn count_preferences(action: &mut Action, used_preferences: &[Name]) {
    let preferences = std::mem::take(&mut action.preferences);
    for preference in
        preferences.into_iter().filter(|preference| used_preferences.contains(&preference.name.name))
    {
        let condition = not(preference.condition);
        let counted = Effect::When(condition, Box::new(violate(&preference.name.name)));
        let effect = if preference.variables.is_empty() {
            counted
        } else {
            Effect::ForAll(preference.variables, Box::new(counted))
        };
        let time = match preference.time {
            pddl::ast::ConditionTime::AtEnd => EffectTime::AtEnd,
            _ => EffectTime::AtStart,
        };
        happen(action, time, effect);
    }
}
