//! Computes the state change of a single step, by the same rules as [`validate`](super::validate()).
//!
//! Used during execution: the state after each action is the initial state of the remaining problem.

use num_rational::BigRational;
use rustc_hash::FxHashMap;

use crate::ast::{
    Atom, ConditionTime, Domain, EffectTime, Identifier, InitialElement, Name, Problem, Span, Term,
};

use super::effects::{Change, Changes, Ground};
use super::evaluate::metric;
use super::execute::Execution;
use super::happening::Part;
use super::options::Options;
use super::plan::PlanStep;
use super::relevant::relevant;
use super::running::{Running, is_durative};
use super::step;
use super::verdict::Violation;
use super::world::{Arguments, State, Symbol, World};

/// Changes of one step.
#[derive(Debug, Clone)]
pub struct Advance {
    /// Facts that become true, sorted by their text. Derived facts are not included.
    pub added: Vec<Atom>,
    /// Facts that become false, sorted by their text. Derived facts are not included.
    pub deleted: Vec<Atom>,
    /// Numeric functions on which the step has an effect, sorted. A value can remain equal.
    pub values: Vec<ValueChange>,
    /// Duration of the step, in the domain's time unit.
    pub duration: BigRational,
    /// Metric value if the plan ended with the step. `None` without a metric or if the value is undefined; a metric
    /// that counts violated preferences is always undefined here.
    pub metric: Option<BigRational>,
}

/// Change of a function's value.
#[derive(Debug, Clone)]
pub struct ValueChange {
    /// Function with its arguments.
    pub function: Atom,
    /// Function as text: `(battery)`.
    pub text: String,
    /// Value before the step, if defined.
    pub before: Option<BigRational>,
    /// Value after the step.
    pub after: BigRational,
    /// Whether an `assign` effect sets the value; `false` for increases, decreases and scalings.
    pub assigned: bool,
}

/// Executes one step in the initial state of a problem. Timed initial literals are not applied. A duration that is
/// neither stated nor determined is chosen (see [`Options::chosen_durations`]).
///
/// # Errors
/// Returns the violation that prevents the step. With `forced`, conditions, duration constraints at end, and
/// interference are not checked; for example, unknown actions and conflicting effects remain errors.
pub fn advance(
    domain: &Domain,
    problem: &Problem,
    step: &PlanStep,
    forced: bool,
) -> Result<Advance, Box<Violation>> {
    let reduced = relevant(domain, problem, std::slice::from_ref(step), None);
    let world = World::new(domain, reduced.as_ref().unwrap_or(problem), &|| false);
    advance_from(&Execution::new(&world, &Options::default().with_chosen_durations(true)), step, forced)
}

/// Executes one step like [`advance`] with `forced`, but with a given duration, and without the effects that cannot be
/// evaluated, for example because a function has no value.
///
/// # Errors
/// Returns a violation if no action fits the step.
pub fn advance_defined(
    domain: &Domain,
    problem: &Problem,
    step: &PlanStep,
    duration: &BigRational,
) -> Result<Advance, Box<Violation>> {
    let reduced = relevant(domain, problem, std::slice::from_ref(step), None);
    let world = World::new(domain, reduced.as_ref().unwrap_or(problem), &|| false);
    let options = Options::default().with_chosen_durations(true);
    let initial = Execution::new(&world, &options);
    let (step, start) = (step::resolve(&world, 1, step), BigRational::default());
    let instance = initial.likely_instance(&step, &start)?.clone();
    let (duration, end) = (duration.clone(), duration.clone());
    let running = Running { step: &step, instance, start, duration, end };
    let (mut execution, mut assigned) = (initial.clone(), FxHashMap::default());
    for when in [EffectTime::AtStart, EffectTime::AtEnd] {
        let changes = execution.defined_changes(&running, when);
        note(&changes, &mut assigned);
        execution.apply(&step, &running.end, changes)?;
    }
    Ok(difference(&initial.state, &execution, assigned, running.duration))
}

/// Executes each step separately in the initial state of a problem, like [`advance`] with `forced = false`. Also
/// returns the metric value of the empty plan, like [`metric_after`] with the time 0.
pub fn advance_each(
    domain: &Domain,
    problem: &Problem,
    steps: &[PlanStep],
) -> (Option<BigRational>, Vec<Result<Advance, Box<Violation>>>) {
    let reduced = relevant(domain, problem, steps, None);
    let world = World::new(domain, reduced.as_ref().unwrap_or(problem), &|| false);
    let options = Options::default().with_chosen_durations(true);
    let initial = Execution::new(&world, &options);
    let metric = metric(&world, &initial.state, &BigRational::default());
    (metric, steps.iter().map(|step| advance_from(&initial, step, false)).collect())
}

fn advance_from(
    initial: &Execution<'_, '_>,
    step: &PlanStep,
    forced: bool,
) -> Result<Advance, Box<Violation>> {
    let world = initial.world;
    let step = step::resolve(world, 1, step);
    let mut execution = initial.clone();
    let start = BigRational::default();
    let running =
        if forced { execution.begin_anyway(&step, &start) } else { execution.begin(&step, &start) }?;
    let mut assigned = FxHashMap::default();
    // With `forced`, the end comes after the start even if the duration is 0: the effects at start have
    // already happened and cannot interfere.
    let has_two_parts = running.first_part() == Part::Start || (forced && is_durative(&running.instance));
    let parts: &[Part] = if has_two_parts { &[Part::Start, Part::End] } else { &[Part::Whole] };
    for part in parts {
        let time = if *part == Part::End { &running.end } else { &start };
        // No event or other action happens in between, so the state after the start is the state of the whole
        // interval.
        if *part == Part::End && !forced {
            execution.check(&running, ConditionTime::OverAll, &start)?;
        }
        let changes = if forced {
            let when = if *part == Part::End { EffectTime::AtEnd } else { EffectTime::AtStart };
            execution.changes(&running, when, time)?
        } else {
            execution.happening(&running, *part, time)?.changes
        };
        note(&changes, &mut assigned);
        execution.apply(&step, time, changes)?;
    }
    Ok(difference(&initial.state, &execution, assigned, running.duration))
}

/// Returns the changes from the state `before` to the state of `execution`. `assigned` contains the functions on which
/// the step has an effect, and whether the effect is an assignment.
fn difference(
    before: &State,
    execution: &Execution<'_, '_>,
    assigned: FxHashMap<Ground, bool>,
    duration: BigRational,
) -> Advance {
    let (world, after) = (execution.world, &execution.state);
    let values = assigned.into_iter().filter_map(|(target, assigned)| {
        let after = after.values.get(&target)?.clone();
        let (function, text) = (atom(world, &target), world.show(target.0, &target.1));
        Some(ValueChange { function, text, before: before.values.get(&target).cloned(), after, assigned })
    });
    let mut values: Vec<ValueChange> = values.collect();
    values.sort_by(|left, right| left.text.cmp(&right.text));
    let (added, deleted) = (facts_only_in(world, after, before), facts_only_in(world, before, after));
    let metric = metric(world, after, &duration);
    Advance { added, deleted, values, duration, metric }
}

impl Advance {
    /// Updates the initial state `init` of a problem to the state after the step.
    pub fn apply(&self, init: &mut Vec<InitialElement>) {
        // Negated facts of `:init` must not contradict the added facts.
        init.retain(|element| match element {
            InitialElement::Fact(atom) => !self.deleted.iter().any(|deleted| is_same(deleted, atom)),
            InitialElement::NegatedFact(atom) => !self.added.iter().any(|added| is_same(added, atom)),
            _ => true,
        });
        init.extend(self.added.iter().cloned().map(InitialElement::Fact));
        for change in &self.values {
            let stated = init.iter_mut().find_map(|element| match element {
                InitialElement::Value(function, value, _) if is_same(function, &change.function) => {
                    Some(value)
                }
                _ => None,
            });
            match stated {
                Some(value) => value.clone_from(&change.after),
                None => init.push(InitialElement::Value(
                    change.function.clone(),
                    change.after.clone(),
                    Span::default(),
                )),
            }
        }
    }
}

fn is_same(left: &Atom, right: &Atom) -> bool {
    left.predicate.name == right.predicate.name
        && left.arguments.iter().map(Term::name).eq(right.arguments.iter().map(Term::name))
}

/// Returns the metric value if the plan ended in the initial state of the problem after `total_time`, in the
/// domain's time unit. `None` without a metric or if the value is undefined; a metric that counts violated preferences
/// is always undefined here.
pub fn metric_after(domain: &Domain, problem: &Problem, total_time: &BigRational) -> Option<BigRational> {
    let reduced = relevant(domain, problem, &[], None);
    let world = World::new(domain, reduced.as_ref().unwrap_or(problem), &|| false);
    let options = Options::default();
    let execution = Execution::new(&world, &options);
    metric(&world, &execution.state, total_time)
}

fn note(changes: &Changes, assigned: &mut FxHashMap<Ground, bool>) {
    for (target, change) in &changes.numeric {
        let is_assignment = matches!(change, Change::Assign(_));
        *assigned.entry(target.clone()).or_default() |= is_assignment;
    }
}

fn facts_only_in(world: &World<'_>, state: &State, other: &State) -> Vec<Atom> {
    let is_new = |predicate: Symbol, arguments: &Arguments| {
        !other.facts.get(&predicate).is_some_and(|tuples| tuples.contains(arguments))
    };
    let mut facts: Vec<Ground> = Vec::new();
    for (predicate, tuples) in &state.facts {
        let new = tuples.iter().filter(|arguments| is_new(*predicate, arguments));
        facts.extend(new.map(|arguments| (*predicate, arguments.clone())));
    }
    facts.sort_by_cached_key(|(predicate, arguments)| world.show(*predicate, arguments));
    facts.iter().map(|ground| atom(world, ground)).collect()
}

fn atom(world: &World<'_>, (symbol, arguments): &Ground) -> Atom {
    let identifier = |symbol| Identifier { name: Name::new(world.name(symbol)), span: Span::default() };
    Atom {
        predicate: identifier(*symbol),
        arguments: arguments.iter().map(|argument| Term::Constant(identifier(*argument))).collect(),
        span: Span::default(),
    }
}
