//! Numeric trace of a plan: the new values of functions at each start and end of an action, and the bounds
//! that conditions impose.
//!
//! Used for charts of plans that [`validate`](super::validate()) has accepted. Effects are applied by the same rules;
//! conditions are not enforced.

use num_rational::BigRational;
use rustc_hash::FxHashSet;

use crate::ast::{Comparison, Condition, ConditionTime, Domain, EffectTime, Expression, Problem};

use super::effects::{Changes, Ground};
use super::evaluate::{Bindings, Evaluator, metric};
use super::execute::Execution;
use super::happening::Part;
use super::options::Options;
use super::plan::PlanText;
use super::running::{Running, is_durative};
use super::step::{self, Step, conditions};
use super::targets::{changeable, changeable_values};
use super::verdict::Violation;
use super::world::{Symbol, World};

/// Trace of all numeric functions that actions can change.
#[derive(Debug, Clone, Default)]
pub struct Course {
    /// Values of the functions before the plan, sorted by function. A function is written as in `(battery)`.
    pub initial: Vec<(String, BigRational)>,
    /// Starts and ends of actions, in chronological order.
    pub moments: Vec<CourseMoment>,
    /// Bounds on numeric functions that the goal imposes.
    pub goal: Vec<NumberBound>,
}

/// Start or end of an action, or both if the action takes no time.
#[derive(Debug, Clone)]
pub struct CourseMoment {
    /// Index of the step in the plan, from 0.
    pub step: usize,
    /// Time, in the domain's time unit.
    pub time: BigRational,
    /// Whether the action ends at this moment.
    pub is_end: bool,
    /// Changed functions with their new values, sorted.
    pub values: Vec<(String, BigRational)>,
    /// Bounds on numeric functions that the action's conditions impose at this moment. The bounds at the start
    /// include those of the over-all conditions.
    pub bounds: Vec<NumberBound>,
    /// Metric value if the plan ended now, with the present time as `total-time`. `None` without a metric or if the
    /// value is undefined; a metric that counts violated preferences is always undefined here.
    pub metric: Option<BigRational>,
}

/// Bound that a condition imposes on a numeric function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NumberBound {
    /// Function: `(battery)`.
    pub number: String,
    /// Required relation between the function and the bound.
    pub relation: Comparison,
    /// Value of the bound.
    pub bound: BigRational,
}

/// Executes a plan and records the numbers. If a step has no start time, every step begins when the preceding step
/// ends, as in [`validate`](super::validate()).
///
/// # Errors
/// Returns a violation if a step is not an action of the domain, or if its effects are undefined or
/// conflict. Also if its duration is missing, negative or undefined, or violates a constraint at start.
pub fn course(domain: &Domain, problem: &Problem, plan: &PlanText) -> Result<Course, Box<Violation>> {
    let world = World::new(domain, problem, &|| false);
    let texts = plan.steps.iter().zip(1..);
    let steps: Vec<Step<'_>> = texts.map(|(text, number)| step::resolve(&world, number, text)).collect();
    let is_timed = steps.iter().all(|step| step.text.start.is_some());
    let stated = |index: usize| steps[index].text.start.as_ref().filter(|_| is_timed);
    let mut starts: Vec<usize> = (0..steps.len()).collect();
    starts.sort_by(|left, right| stated(*right).cmp(&stated(*left)).then(right.cmp(left)));
    let options = Options::default();
    let mut follower = Follower {
        execution: Execution::new(&world, &options),
        changeable: changeable(&world),
        course: Course::default(),
        clock: BigRational::default(),
    };
    follower.course.initial = changeable_values(&world, &follower.execution.state);
    let mut running: Vec<(usize, Running<'_, '_>)> = Vec::new();
    loop {
        let next_end =
            (0..running.len()).min_by(|left, right| running[*left].1.end.cmp(&running[*right].1.end));
        let end = next_end.map(|position| &running[position].1.end);
        // At equal times ends precede starts. A step without a start time waits for the end of a running
        // action.
        let ends_first = match (end, starts.last().map(|next_step| stated(*next_step))) {
            (None, None) => break,
            (None, Some(_)) => false,
            (Some(_), None) => true,
            (Some(end), Some(start)) => start.is_none_or(|start| end <= start),
        };
        if let Some(position) = next_end.filter(|_| ends_first) {
            let (index, running_action) = running.remove(position);
            follower.end(index, &running_action)?;
        } else if let Some(next_step) = starts.pop() {
            let new_action = follower.start(next_step, &steps[next_step], stated(next_step))?;
            running.extend(new_action.map(|new_action| (next_step, new_action)));
        }
    }
    follower.goal(problem);
    Ok(follower.course)
}

struct Follower<'e, 'p> {
    execution: Execution<'e, 'p>,
    changeable: FxHashSet<Symbol>,
    course: Course,
    clock: BigRational,
}

impl<'e, 'p> Follower<'e, 'p> {
    /// Starts a step at the time `stated`, or without a stated time at the last end of an action.
    /// Returns `None` if the action takes no time and has already ended.
    fn start(
        &mut self,
        index: usize,
        step: &'e Step<'p>,
        stated: Option<&BigRational>,
    ) -> Result<Option<Running<'e, 'p>>, Box<Violation>> {
        let time = stated.unwrap_or(&self.clock).clone();
        self.execution.apply_events_until(&time, true);
        // The schema whose conditions hold is preferred. The effects are shown even if no schema is
        // applicable.
        let checked = self.execution.begin(step, &time);
        let running = checked.or_else(|_| self.execution.begin_anyway(step, &time))?;
        let mut bounds = self.bounds(&running, ConditionTime::AtStart);
        bounds.extend(self.bounds(&running, ConditionTime::OverAll));
        let mut values = self.apply_effects(&running, EffectTime::AtStart, &time)?;
        let is_whole = running.first_part() == Part::Whole;
        if is_whole && is_durative(&running.instance) {
            bounds.extend(self.bounds(&running, ConditionTime::AtEnd));
            values.extend(self.apply_effects(&running, EffectTime::AtEnd, &time)?);
        }
        if is_whole {
            self.clock.clone_from(&time);
        }
        self.note(CourseMoment { step: index, time, is_end: is_whole, values, bounds, metric: None });
        Ok((!is_whole).then_some(running))
    }

    fn end(&mut self, index: usize, running: &Running<'e, 'p>) -> Result<(), Box<Violation>> {
        let time = running.end.clone();
        self.execution.apply_events_until(&time, true);
        let bounds = self.bounds(running, ConditionTime::AtEnd);
        let values = self.apply_effects(running, EffectTime::AtEnd, &time)?;
        self.clock.clone_from(&time);
        self.note(CourseMoment { step: index, time, is_end: true, values, bounds, metric: None });
        Ok(())
    }

    fn note(&mut self, moment: CourseMoment) {
        let metric = metric(self.execution.world, &self.execution.state, &moment.time);
        self.course.moments.push(CourseMoment { metric, ..moment });
    }

    fn apply_effects(
        &mut self,
        running: &Running<'e, 'p>,
        when: EffectTime,
        time: &BigRational,
    ) -> Result<Vec<(String, BigRational)>, Box<Violation>> {
        let changes: Changes = self.execution.changes(running, when, time)?;
        let targets: Vec<_> = changes.numeric.keys().cloned().collect();
        self.execution.apply(running.step, time, changes)?;
        let state = &self.execution.state;
        let value = |target: &Ground| {
            Some((self.execution.world.show(target.0, &target.1), state.values.get(target)?.clone()))
        };
        let mut values: Vec<_> = targets.iter().filter_map(value).collect();
        values.sort();
        Ok(values)
    }

    fn bounds(&self, running: &Running<'e, 'p>, when: ConditionTime) -> Vec<NumberBound> {
        let evaluator = self.execution.evaluator(Some(&running.duration));
        let mut bounds = Vec::new();
        for condition in conditions(&running.instance, when) {
            self.collect_bounds(&evaluator, condition, &running.instance.bindings, &mut bounds);
        }
        bounds
    }

    fn goal(&mut self, problem: &'p Problem) {
        let mut bounds = Vec::new();
        let evaluator = self.execution.evaluator(None);
        self.collect_bounds(&evaluator, &problem.goal, &Bindings::default(), &mut bounds);
        self.course.goal = bounds;
    }

    /// Appends the bounds that a condition imposes on functions that actions can change. Considers only comparisons
    /// that have such a function alone on one side, and that are the condition itself or one of its conjuncts.
    fn collect_bounds(
        &self,
        evaluator: &Evaluator<'_, 'p>,
        condition: &'p Condition,
        bindings: &Bindings<'p>,
        bounds: &mut Vec<NumberBound>,
    ) {
        let mut parts = vec![condition];
        while let Some(part) = parts.pop() {
            match part {
                Condition::And(conjuncts) => parts.extend(conjuncts.iter().rev()),
                Condition::Compare(relation, left, right, _) => {
                    let bound = self.bound(evaluator, left, *relation, right, bindings);
                    bounds.extend(
                        bound.or_else(|| self.bound(evaluator, right, relation.mirrored(), left, bindings)),
                    );
                }
                _ => {}
            }
        }
    }

    fn bound(
        &self,
        evaluator: &Evaluator<'_, 'p>,
        number: &Expression,
        relation: Comparison,
        bound: &Expression,
        bindings: &Bindings<'p>,
    ) -> Option<NumberBound> {
        let Expression::Fluent(atom) = number else { return None };
        let symbol = self.execution.world.symbol(&atom.predicate.name);
        let arguments = evaluator.arguments(atom, bindings).filter(|_| self.changeable.contains(&symbol))?;
        let bound = evaluator.value(bound, bindings).ok()?;
        Some(NumberBound { number: self.execution.world.show(symbol, &arguments), relation, bound })
    }
}
