//! A plan to the course of its numbers: what each function is after each happening, and what conditions demand of it.
//!
//! For pictures of a plan that [`validate`](super::validate()) has found right. Effects take place by the same rules; whether conditions hold
//! is not judged again.

use num_rational::BigRational;
use rustc_hash::FxHashSet;

use crate::ast::{Comparison, Condition, ConditionTime, Domain, EffectTime, Expression, Problem};

use super::advance::metric;
use super::effects::{Changes, Ground};
use super::evaluate::{Bindings, Evaluator};
use super::execute::Execution;
use super::happening::Part;
use super::options::Options;
use super::plan::PlanText;
use super::running::{Running, conditions, is_durative};
use super::step::{self, Step};
use super::targets::{changeable, changeable_values};
use super::verdict::Violation;
use super::world::{Symbol, World};

/// The course of all numbers that actions can change.
#[derive(Debug, Clone, Default)]
pub struct Course {
    /// What they are before the plan, by function, sorted: `(battery)`.
    pub initial: Vec<(String, BigRational)>,
    /// Starts and ends of actions, in the order of time.
    pub moments: Vec<CourseMoment>,
    /// What the goal demands of them.
    pub goal: Vec<NumberBound>,
}

/// The start or the end of an action, or both of one that takes no time.
#[derive(Debug, Clone)]
pub struct CourseMoment {
    /// The step of the plan, from 0.
    pub step: usize,
    /// In the domain's time unit.
    pub time: BigRational,
    /// Whether the action ends here.
    pub is_end: bool,
    /// The functions that it changes, and what they are now, sorted.
    pub values: Vec<(String, BigRational)>,
    /// What its conditions demand of numbers, here and until it ends.
    pub bounds: Vec<NumberBound>,
    /// The value of the problem's metric if the plan ended now. `None` without a metric, or where it is undefined.
    /// For example, a metric that counts violated preferences is undefined before the end.
    pub metric: Option<BigRational>,
}

/// What a condition demands of a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NumberBound {
    /// The function: `(battery)`.
    pub number: String,
    /// How it has to compare with the bound.
    pub relation: Comparison,
    /// The bound.
    pub bound: BigRational,
}

/// Follows the numbers through a plan. A step without a start begins when the one before it ends.
///
/// # Errors
/// A step is not an action of the domain, or an effect is undefined.
pub fn course(domain: &Domain, problem: &Problem, plan: &PlanText) -> Result<Course, Box<Violation>> {
    let world = World::new(domain, problem, &|| false);
    let texts = plan.steps.iter().zip(1..);
    let steps: Vec<Step<'_>> = texts.map(|(text, number)| step::resolve(&world, number, text)).collect();
    let mut starts: Vec<usize> = (0..steps.len()).collect();
    starts
        .sort_by(|left, right| steps[*right].text.start.cmp(&steps[*left].text.start).then(right.cmp(left)));
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
        let ending =
            (0..running.len()).min_by(|left, right| running[*left].1.end.cmp(&running[*right].1.end));
        let end = ending.map(|at| &running[at].1.end);
        let ends_first = match (end, starts.last().map(|next| &steps[*next].text.start)) {
            (None, None) => break,
            (None, Some(_)) => false,
            (Some(_), None) => true,
            (Some(end), Some(start)) => start.as_ref().is_none_or(|start| end <= start),
        };
        if let Some(at) = ending.filter(|_| ends_first) {
            let (index, ended) = running.remove(at);
            follower.end(index, &ended)?;
        } else if let Some(next) = starts.pop() {
            let started = follower.start(next, &steps[next])?;
            running.extend(started.map(|started| (next, started)));
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
    /// Starts a step; none where it has ended at once.
    fn start(&mut self, index: usize, step: &'e Step<'p>) -> Result<Option<Running<'e, 'p>>, Box<Violation>> {
        let time = step.text.start.clone().unwrap_or_else(|| self.clock.clone());
        self.execution.pass(&time, true);
        let begun = self.execution.begin(step, &time);
        let running = begun.or_else(|_| self.execution.begin_anyway(step, &time))?;
        let mut bounds = self.bounds(&running, ConditionTime::AtStart);
        bounds.extend(self.bounds(&running, ConditionTime::OverAll));
        let mut values = self.happen(&running, EffectTime::AtStart, &time)?;
        let is_whole = running.first_part() == Part::Whole;
        if is_whole && is_durative(&running.instance) {
            bounds.extend(self.bounds(&running, ConditionTime::AtEnd));
            values.extend(self.happen(&running, EffectTime::AtEnd, &time)?);
        }
        if is_whole {
            self.clock.clone_from(&time);
        }
        self.note(CourseMoment { step: index, time, is_end: is_whole, values, bounds, metric: None });
        Ok((!is_whole).then_some(running))
    }

    fn end(&mut self, index: usize, running: &Running<'e, 'p>) -> Result<(), Box<Violation>> {
        let time = running.end.clone();
        self.execution.pass(&time, true);
        let bounds = self.bounds(running, ConditionTime::AtEnd);
        let values = self.happen(running, EffectTime::AtEnd, &time)?;
        self.clock.clone_from(&time);
        self.note(CourseMoment { step: index, time, is_end: true, values, bounds, metric: None });
        Ok(())
    }

    /// Adds a moment, after its effects, with the metric then.
    fn note(&mut self, moment: CourseMoment) {
        let metric = metric(self.execution.world, &self.execution.state, &moment.time);
        self.course.moments.push(CourseMoment { metric, ..moment });
    }

    /// Lets effects take place; the numbers that they change.
    fn happen(
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
        let mut found = Vec::new();
        for condition in conditions(&running.instance, when) {
            self.demands(&evaluator, condition, &running.instance.bindings, &mut found);
        }
        found
    }

    fn goal(&mut self, problem: &'p Problem) {
        let mut found = Vec::new();
        let evaluator = self.execution.evaluator(None);
        self.demands(&evaluator, &problem.goal, &Bindings::default(), &mut found);
        self.course.goal = found;
    }

    /// What a condition demands by itself of functions that actions change: comparisons, by themselves or in conjunctions.
    fn demands(
        &self,
        evaluator: &Evaluator<'_, 'p>,
        condition: &'p Condition,
        bindings: &Bindings<'p>,
        found: &mut Vec<NumberBound>,
    ) {
        let mut parts = vec![condition];
        while let Some(part) = parts.pop() {
            match part {
                Condition::And(more) => parts.extend(more.iter().rev()),
                Condition::Compare(relation, left, right, _) => {
                    let own = self.demand(evaluator, left, *relation, right, bindings);
                    found.extend(
                        own.or_else(|| self.demand(evaluator, right, relation.mirrored(), left, bindings)),
                    );
                }
                _ => {}
            }
        }
    }

    fn demand(
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
