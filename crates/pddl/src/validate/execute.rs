//! Building blocks of plan execution: start and end of actions, their conditions, durations and effects.

use num_rational::BigRational;
use num_traits::{Signed, Zero};

use crate::ast::{
    ActionBody, Comparison, ConditionTime, Direction, DurationConstraint, EffectTime, Expression,
    InitialElement,
};
use crate::number::show_number;
use crate::visit::Node;

use super::changeable::changeable_functions;
use super::derive::derive_facts;
use super::effects::{Changes, EffectError, Ground};
use super::evaluate::{Evaluator, Undefined, metric};
use super::explain::{undefined_text, unmet};
use super::interference::Footprint;
use super::options::Options;
use super::record::Record;
use super::running::{Running, is_durative};
use super::step::{Instance, Step, conditions, effects, unresolved};
use super::verdict::{Violation, ViolationKind};
use super::world::{State, World};

#[derive(Debug, Clone)]
pub(super) struct Execution<'e, 'p> {
    pub(super) world: &'e World<'p>,
    pub(super) options: &'e Options,
    pub(super) state: State,
    /// Future timed initial literals: time, atom, and whether the atom becomes true. Sorted by descending
    /// time, so the next one is last.
    pub(super) pending: Vec<(BigRational, Ground, bool)>,
    pub(super) last_event: Option<(BigRational, Footprint)>,
    pub(super) record: Record,
}

impl<'e, 'p> Execution<'e, 'p> {
    pub(super) fn new(world: &'e World<'p>, options: &'e Options) -> Self {
        let mut state = world.initial_state();
        derive_facts(world, &mut state);
        let mut pending: Vec<_> = world
            .problem
            .init
            .iter()
            .filter_map(|element| match element {
                InitialElement::Timed(time, atom, holds, _) => {
                    Some((time.clone(), world.ground(atom), *holds))
                }
                _ => None,
            })
            .collect();
        // Of two literals for one atom and one time, the later one in the file takes effect. The sort is
        // stable.
        pending.reverse();
        pending.sort_by(|left, right| right.0.cmp(&left.0));
        let record = Record::new(world, &state);
        Self { world, options, state, pending, last_event: None, record }
    }

    pub(super) fn evaluator<'s>(&'s self, duration: Option<&'s BigRational>) -> Evaluator<'s, 'p> {
        Evaluator { duration, ..Evaluator::new(self.world, &self.state) }
    }

    pub(super) fn next_timed(&self) -> Option<&BigRational> {
        self.pending.last().map(|(time, ..)| time)
    }

    /// Starts a step as an instance of the first schema whose duration constraints and conditions at start
    /// hold, and determines the duration. Without such a schema, returns the violation of the first schema that
    /// fits the step.
    pub(super) fn begin(
        &self,
        step: &'e Step<'p>,
        time: &BigRational,
    ) -> Result<Running<'e, 'p>, Box<Violation>> {
        if step.instances.is_empty() {
            return Err(unresolved(self.world, step, time));
        }
        let mut first_violation = None;
        for instance in &step.instances {
            match self.begin_as(step, instance, time) {
                Ok(running) => return Ok(running),
                Err(violation) => first_violation = first_violation.or(Some(violation)),
            }
        }
        Err(first_violation.unwrap_or_else(|| unresolved(self.world, step, time)))
    }

    /// Starts a step as an instance of the [likely](Self::likely_instance) schema. Conditions are not checked, but the
    /// duration is.
    pub(super) fn begin_anyway(
        &self,
        step: &'e Step<'p>,
        time: &BigRational,
    ) -> Result<Running<'e, 'p>, Box<Violation>> {
        let instance = self.likely_instance(step, time)?;
        let duration = self.duration(step, instance, time)?;
        let end = time + &duration;
        Ok(Running { step, instance: instance.clone(), start: time.clone(), duration, end })
    }

    /// Returns the instance of the first schema that [`Self::begin`] accepts. If it accepts none, returns that of the
    /// first schema that fits the step's name and objects.
    pub(super) fn likely_instance(
        &self,
        step: &'e Step<'p>,
        time: &BigRational,
    ) -> Result<&'e Instance<'p>, Box<Violation>> {
        let is_ambiguous = step.instances.len() > 1;
        let is_accepted = |instance: &&Instance<'p>| self.begin_as(step, instance, time).is_ok();
        let accepted = step.instances.iter().find(|instance| is_ambiguous && is_accepted(instance));
        accepted.or(step.instances.first()).ok_or_else(|| unresolved(self.world, step, time))
    }

    fn begin_as(
        &self,
        step: &'e Step<'p>,
        instance: &Instance<'p>,
        time: &BigRational,
    ) -> Result<Running<'e, 'p>, Box<Violation>> {
        let duration = self.duration(step, instance, time)?;
        // The duration stated in the plan may be rounded. Rounding must not turn a positive duration into
        // zero or zero into a positive duration.
        let is_rounded =
            |stated: &&BigRational| is_durative(instance) && stated.is_zero() == duration.is_zero();
        let rounded = step.text.duration.as_ref().filter(is_rounded).unwrap_or(&duration);
        let end = time + rounded;
        let running = Running { step, instance: instance.clone(), start: time.clone(), duration, end };
        // The condition may depend on the exact duration, so the check follows its computation.
        self.check(&running, ConditionTime::AtStart, time)?;
        Ok(running)
    }

    /// Determines the duration of a step: the exact value if an equality of the domain fixes it, else the
    /// value stated in the plan, else a chosen value. A stated value must satisfy all duration constraints that
    /// are known at the start, within the tolerance. Without a stated value, the value of the first equality must
    /// satisfy them.
    fn duration(
        &self,
        step: &Step<'p>,
        instance: &Instance<'p>,
        time: &BigRational,
    ) -> Result<BigRational, Box<Violation>> {
        let ActionBody::Durative { duration: constraints, .. } = &instance.action.body else {
            return Ok(BigRational::zero());
        };
        let evaluator = self.evaluator(None);
        let mut exact = None;
        let mut bounds = Vec::new();
        for constraint in constraints.iter().filter(|constraint| self.is_known_at_start(constraint)) {
            let bound = evaluator
                .value(&constraint.expression, &instance.bindings)
                .map_err(|undefined| undefined_violation(step, time, &undefined))?;
            // An equality determines the exact duration; the stated duration may be rounded.
            if constraint.operator == Comparison::Equal && exact.is_none() {
                exact = Some(bound.clone());
            }
            bounds.push((constraint.operator, bound));
        }
        if let Some(duration) = step.text.duration.as_ref().or(exact.as_ref()) {
            let slack = self.slack(exact.is_none() && duration.is_zero());
            for (operator, bound) in &bounds {
                Self::check_duration(step, time, (*operator, bound), duration, &slack)?;
            }
        }
        let duration = exact.or_else(|| step.text.duration.clone()).or_else(|| self.chosen_duration(&bounds));
        let Some(duration) = duration else {
            return Err(step.violation(
                time,
                ViolationKind::Duration,
                "the plan does not say how long this takes",
            ));
        };
        if duration.is_negative() {
            let message = format!("the duration {} is negative", show_number(&duration));
            return Err(step.violation(time, ViolationKind::Duration, message));
        }
        Ok(duration)
    }

    /// Returns `true` if a duration constraint applies at the start, or if its bound is a constant.
    fn is_known_at_start(&self, constraint: &DurationConstraint) -> bool {
        if constraint.time == EffectTime::AtStart {
            return true;
        }
        let changeable = changeable_functions(self.world.domain);
        let mut is_constant = true;
        constraint.expression.walk(&mut |node| {
            is_constant &= !matches!(node, Node::Expression(Expression::Duration(_)))
                && node.fluent().is_none_or(|function| !changeable.contains(&function.predicate.name));
        });
        is_constant
    }

    /// Returns the maximum deviation of a duration from its bounds. Rounding must not make a duration 0, because
    /// conditions over all do not apply to this duration.
    fn slack(&self, is_instant: bool) -> BigRational {
        if is_instant { BigRational::zero() } else { self.options.slack() }
    }

    /// Returns the duration that the planner chooses. `None` without [`Options::chosen_durations`], if no constraint
    /// bounds it on the side that the metric prefers, if such a bound is strict, or if a bound on the other side
    /// excludes it.
    fn chosen_duration(&self, bounds: &[(Comparison, BigRational)]) -> Option<BigRational> {
        if !self.options.chosen_durations {
            return None;
        }
        let with_operator =
            |operator| bounds.iter().filter(move |bound| bound.0 == operator).map(|bound| &bound.1);
        let (chosen, strict) = if self.rewards_time() {
            (with_operator(Comparison::LessOrEqual).min(), Comparison::Less)
        } else {
            (with_operator(Comparison::GreaterOrEqual).max(), Comparison::Greater)
        };
        let chosen = chosen.filter(|_| with_operator(strict).next().is_none())?;
        let is_allowed = bounds.iter().all(|(operator, bound)| match operator {
            Comparison::Equal => chosen == bound,
            Comparison::Less => chosen < bound,
            Comparison::LessOrEqual => chosen <= bound,
            Comparison::Greater => chosen > bound,
            Comparison::GreaterOrEqual => chosen >= bound,
        });
        is_allowed.then(|| chosen.clone())
    }

    /// Returns `true` if the metric prefers longer plans. The planner requires that the total time has a constant
    /// factor in the metric, so that two total times in one state suffice.
    fn rewards_time(&self) -> bool {
        // Violated preferences have no value before the end of the plan; the factor of the time does not depend on them.
        let complete = self.world.has_preferences().then(|| self.world.with_violations(&[], &self.state));
        let state = complete.as_ref().unwrap_or(&self.state);
        let at = |time: i32| metric(self.world, state, &BigRational::from_integer(time.into()));
        let (Some(zero), Some(one)) = (at(0), at(1)) else { return false };
        match self.world.problem.metric.as_ref().map(|metric| metric.direction) {
            Some(Direction::Minimize) => one < zero,
            Some(Direction::Maximize) => one > zero,
            None => false,
        }
    }

    fn check_duration(
        step: &Step<'p>,
        time: &BigRational,
        (operator, bound): (Comparison, &BigRational),
        stated: &BigRational,
        slack: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let (holds, sign) = match operator {
            Comparison::Equal => ((stated - bound).abs() <= *slack, "="),
            Comparison::LessOrEqual => (*stated <= bound + slack, "<="),
            Comparison::Less => (*stated < bound + slack, "<"),
            Comparison::GreaterOrEqual => (stated + slack >= *bound, ">="),
            Comparison::Greater => (stated + slack > *bound, ">"),
        };
        if holds {
            return Ok(());
        }
        let source =
            if step.text.duration.is_some() { "the plan says" } else { "an equality of the domain says" };
        let (stated, bound) = (show_number(stated), show_number(bound));
        let message = format!("{source} {stated}, but the domain requires ?duration {sign} {bound}");
        Err(step.violation(time, ViolationKind::Duration, message))
    }

    /// Checks the conditions of an action that apply at `when`; at the end also the duration
    /// constraints at end. An unsatisfied or undefined condition is a violation.
    pub(super) fn check(
        &self,
        running: &Running<'e, 'p>,
        when: ConditionTime,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let Running { step, instance, duration, .. } = running;
        let evaluator = self.evaluator(Some(duration));
        let mut bindings = instance.bindings.clone();
        let mut missing = Vec::new();
        let mut undefined = None;
        for condition in conditions(instance, when) {
            match evaluator.holds(condition, &mut bindings) {
                Ok(true) => continue,
                Ok(false) => {}
                Err(reason) => undefined = undefined.or(Some(reason)),
            }
            missing.extend(unmet(evaluator, condition, &mut bindings));
        }
        if when == ConditionTime::AtEnd {
            self.check_duration_at_end(running, time)?;
        }
        if missing.is_empty() {
            return Ok(());
        }
        let (kind, role) = match when {
            ConditionTime::AtStart if !is_durative(instance) => (ViolationKind::AtStart, "precondition"),
            ConditionTime::AtStart => (ViolationKind::AtStart, "condition at start"),
            ConditionTime::OverAll => (ViolationKind::OverAll, "condition over all"),
            ConditionTime::AtEnd => (ViolationKind::AtEnd, "condition at end"),
        };
        let reason =
            undefined.as_ref().map(|reason| format!(": {}", undefined_text(reason))).unwrap_or_default();
        let message = format!("a {role} of {} does not hold{reason}", step.show());
        // An undefined function is the cause, not the condition that reads the function.
        let kind = if undefined.is_some() { ViolationKind::Undefined } else { kind };
        Err(Box::new(Violation { unmet: missing, ..*step.violation(time, kind, message) }))
    }

    fn check_duration_at_end(
        &self,
        running: &Running<'e, 'p>,
        time: &BigRational,
    ) -> Result<(), Box<Violation>> {
        let ActionBody::Durative { duration: constraints, .. } = &running.instance.action.body else {
            return Ok(());
        };
        let slack = self.slack(running.duration.is_zero());
        for constraint in constraints.iter().filter(|constraint| constraint.time == EffectTime::AtEnd) {
            let bound = self
                .evaluator(Some(&running.duration))
                .value(&constraint.expression, &running.instance.bindings)
                .map_err(|undefined| undefined_violation(running.step, time, &undefined))?;
            let required = (constraint.operator, &bound);
            Self::check_duration(running.step, time, required, &running.duration, &slack)?;
        }
        Ok(())
    }

    pub(super) fn changes(
        &self,
        running: &Running<'e, 'p>,
        when: EffectTime,
        time: &BigRational,
    ) -> Result<Changes, Box<Violation>> {
        let mut changes = Changes::default();
        let evaluator = self.evaluator(Some(&running.duration));
        let mut bindings = running.instance.bindings.clone();
        for effect in effects(&running.instance, when) {
            evaluator
                .collect(effect, &mut bindings, &mut changes)
                .map_err(|error| self.effect_violation(running.step, time, &error))?;
        }
        Ok(changes)
    }

    /// Like [`Self::changes`], but without the effects that cannot be evaluated.
    pub(super) fn defined_changes(&self, running: &Running<'e, 'p>, when: EffectTime) -> Changes {
        let mut changes = Changes::default();
        let evaluator = self.evaluator(Some(&running.duration));
        let mut bindings = running.instance.bindings.clone();
        for effect in effects(&running.instance, when) {
            evaluator.collect_defined(effect, &mut bindings, &mut changes);
        }
        changes.retain_defined(self.world, &self.state);
        changes
    }

    /// Applies the changes of a happening to the state. Recomputes the derived facts if a changed predicate or
    /// function occurs in a condition of an axiom. Returns a violation if an increased, decreased or scaled function
    /// has no value, or if its new value is too large.
    pub(super) fn apply(
        &mut self,
        step: &Step<'p>,
        time: &BigRational,
        changes: Changes,
    ) -> Result<(), Box<Violation>> {
        // The fixpoint is expensive and is computed only if its inputs change.
        let concerns_axioms = !changes.is_neutral() && changes.concern(&self.world.read_by_axioms);
        let applied = changes.apply(self.world, &mut self.state);
        applied.map_err(|error| self.effect_violation(step, time, &error))?;
        if concerns_axioms {
            derive_facts(self.world, &mut self.state);
        }
        Ok(())
    }

    pub(super) fn effect_violation(
        &self,
        step: &Step<'p>,
        time: &BigRational,
        error: &EffectError,
    ) -> Box<Violation> {
        match error {
            EffectError::Undefined(undefined) => undefined_violation(step, time, undefined),
            EffectError::Conflict((symbol, arguments)) => {
                let function = self.world.show(*symbol, arguments);
                let message = format!("{function} is changed in two ways at once");
                step.violation(time, ViolationKind::Conflict, message)
            }
        }
    }
}

pub(super) fn undefined_violation(
    step: &Step<'_>,
    time: &BigRational,
    undefined: &Undefined,
) -> Box<Violation> {
    step.violation(time, ViolationKind::Undefined, undefined_text(undefined))
}
