//! Splits durative actions into starts and ends: a lifted task in which each schema is a single happening.
//!
//! A durative action becomes two instantaneous operators, the *snap actions* of Fox and Long \[1\].
//! An atom that holds while the action runs links both. The over-all condition becomes a third
//! schema that never happens; the search checks its condition while the action runs. An action of
//! duration 0 is one happening without an over-all condition. Timed initial literals become a
//! sequence of schemas without parameters.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, section 8.

use task::compile::is_hidden;
use task::error::{File, Place};
use task::lifted::configuration::{SlotParameter, conjuncts, design_parameters, is_static};
use task::lifted::{
    Bound, Change, DurationChoice, Effect, Event, Expression, Formula, FunctionId, Lifted, ObjectId,
    Predicate, PredicateId, Rational, Schema, Term,
};
use task::number::dense;

use crate::concurrent::duration_fluents::{Timer, depends_on_state, with_zero_duration};
use pddl::ast::{Assignment, Comparison, Name, Span};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Half {
    Start,
    /// The over-all condition; no happening.
    OverAll,
    End,
    /// The whole action: instantaneous or of duration 0.
    Whole,
    Timed(usize),
    /// Auxiliary operator that makes every value of a chosen duration reachable in the relaxed
    /// task; no happening.
    Choice,
    /// Preference or trajectory constraint, checked on a plan; no happening.
    Judge,
}

/// Prefix of the names of atoms that mark running actions. Names in PDDL files contain no
/// parentheses, so no clash is possible.
pub(super) const UNDER_WAY: &str = "((running) ";

#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// Index of the schema of the domain; `usize::MAX` for timed initial literals.
    pub(super) schema: usize,
    pub(super) half: Half,
}

pub(super) struct Split {
    pub(super) lifted: Lifted,
    pub(super) schemas: Vec<Schema>,
    pub(super) origins: Vec<Origin>,
    pub(super) designs: Vec<Vec<SlotParameter>>,
    pub(super) events: Vec<Event>,
    /// Functions whose values are state-dependent or chosen durations.
    pub(super) durations: Vec<FunctionId>,
    /// Per schema of the domain: `true` if the planner chooses its duration.
    pub(super) chosen: Vec<bool>,
    /// Per schema of the domain: static divisor of its duration. The duration is the value of the
    /// duration fluent, divided by this expression. `None` for no division.
    pub(super) divisors: Vec<Option<Expression>>,
    /// `false` if the split task may lose optimal plans, because a duration was fixed although the planner could
    /// choose it, or because durations are chosen and a condition contains a strict comparison.
    pub(super) is_exact: bool,
    /// `false` if lower bounds and unreachability in the split task need not hold for every plan,
    /// because the split task omits durations or conditions that plans can have.
    pub(super) is_bounded: bool,
}

/// Splits a task into happenings. `solves` names the predicates that relate designs to the
/// functions that they solve.
pub(super) fn split(mut lifted: Lifted, solves: &[Name]) -> Split {
    let mut schemas = std::mem::take(&mut lifted.schemas);
    let (mut durations, mut divisors, mut chosen) = (Vec::new(), Vec::new(), Vec::new());
    let events = std::mem::take(&mut lifted.events);
    let (mut origins, mut designs) = (Vec::new(), Vec::new());
    let waited = lifted.time.waited;
    if !events.is_empty() {
        // A plan must end with the end of an action, not with a timed initial literal. The literals
        // after time 0 therefore add `waited`, and ends delete it. An action without effects may
        // thus be useful to extend the plan beyond a literal.
        let done = Formula::Literal { positive: false, predicate: waited, terms: Vec::new() };
        let goal = std::mem::replace(&mut lifted.goal, Formula::truth());
        lifted.goal = Formula::And(vec![goal, done]);
    }
    for (index, schema) in schemas.iter_mut().enumerate() {
        let duration = schema.duration.as_ref().filter(|duration| depends_on_state(&lifted, duration));
        let duration = duration.cloned();
        let timer = duration.map(|duration| Timer::new(&mut lifted, schema, &duration));
        chosen.push(timer.as_ref().is_some_and(Timer::is_chosen));
        divisors.push(timer.as_ref().and_then(|timer| timer.divisor.clone()));
        // Happening of duration 0. It reads the state before, not the duration fluent.
        let mut instant = schema.clone();
        if let Some(timer) = &timer {
            durations.push(timer.function);
            if timer.is_chosen() {
                instant = with_zero_duration(schema, timer.function);
            } else {
                *schema = timer.with_end(schema);
            }
        }
        let slot_parameters = design_parameters(&lifted, schema, solves);
        for (half, mut part) in parts(&mut lifted, (schema, &instant), timer.as_ref()) {
            if !events.is_empty() && matches!(half, Half::End | Half::Whole) {
                part.end_effects.push(effect(Change::Delete(waited, Vec::new())));
            }
            part.action = dense(lifted.schemas.len());
            lifted.schemas.push(part);
            origins.push(Origin { schema: index, half });
            designs.push(slot_parameters.clone());
        }
    }
    for (index, event) in events.iter().enumerate() {
        let schema = timed(&lifted, dense(index), event);
        lifted.schemas.push(schema);
        origins.push(Origin { schema: usize::MAX, half: Half::Timed(index) });
        designs.push(Vec::new());
    }
    let (is_exact, is_bounded) = (true, true);
    Split { lifted, schemas, origins, designs, events, durations, chosen, divisors, is_exact, is_bounded }
}

fn effect(change: Change) -> Effect {
    Effect { bound: Vec::<Bound>::new(), condition: Formula::truth(), change }
}

fn literal(predicate: PredicateId, terms: &[Term]) -> Formula {
    Formula::Literal { positive: true, predicate, terms: terms.to_vec() }
}

/// Returns the happenings of an action. `instant` is the action with duration 0.
fn parts(
    lifted: &mut Lifted,
    (schema, instant): (&Schema, &Schema),
    timer: Option<&Timer>,
) -> Vec<(Half, Schema)> {
    let instantaneous = |condition: Vec<Formula>, effects: Vec<Effect>| Schema {
        start_condition: Formula::And(condition),
        start_effects: Vec::new(),
        middle_condition: Formula::truth(),
        over_all: Formula::truth(),
        at_end: Formula::truth(),
        end_effects: effects,
        duration: None,
        ..schema.clone()
    };
    let Some(duration) = &schema.duration else {
        let half = if is_hidden(schema.name.as_str()) { Half::Judge } else { Half::Whole };
        return vec![(half, schema.clone())];
    };
    let constant = if let Expression::Number(number) = duration { Some(number) } else { None };
    let zero = &Rational::from_integer(0);
    let compare = |comparison| {
        Formula::Compare(comparison, duration.clone(), Expression::Number(zero.clone()), schema.place)
    };
    let choice = timer.and_then(|timer| timer.relaxed_increase(schema));
    let mut happenings = Vec::new();
    let may_be_instant = choice.is_none() || !assigns_twice(instant);
    if may_be_instant && constant.is_none_or(|number| number == zero) {
        let mut condition = vec![instant.start_condition.clone(), instant.at_end.clone()];
        // The bounds of a chosen duration are conditions at the start.
        condition.extend(choice.is_none().then(|| compare(Comparison::Equal)));
        let effects = instant.start_effects.iter().chain(&instant.end_effects).cloned().collect();
        happenings.push((Half::Whole, instantaneous(condition, effects)));
    }
    if constant == Some(zero) {
        return happenings;
    }
    let parameters: Vec<Term> = (0..dense(schema.parameters.len())).map(Term::Parameter).collect();
    let running = symbol(lifted, &format!("(running) {}", schema.name), parameters.len(), true);
    let later = [&schema.over_all, &schema.at_end].into_iter().flat_map(conjuncts);
    let settled: Vec<Formula> = later.filter(|conjunct| is_static(lifted, conjunct)).cloned().collect();
    let changing: Vec<&Formula> =
        conjuncts(&schema.over_all).into_iter().filter(|conjunct| !is_static(lifted, conjunct)).collect();

    let mut condition = vec![schema.start_condition.clone()];
    condition.extend((constant.is_none() && choice.is_none()).then(|| compare(Comparison::Greater)));
    condition.extend(settled);
    let choice = choice.map(|choice| instantaneous(settled_of(lifted, &condition), vec![choice]));
    happenings.extend(choice.map(|choice| (Half::Choice, choice)));
    let mut effects = schema.start_effects.clone();
    effects.push(effect(Change::Add(running, parameters.clone())));
    effects.extend(timer.and_then(|timer| timer.set(schema)));
    let fixed = schema.duration.clone().filter(|_| timer.is_none());
    happenings.push((Half::Start, Schema { duration: fixed, ..instantaneous(condition, effects) }));

    let mut condition = vec![literal(running, &parameters), schema.at_end.clone()];
    condition.extend(timer.and_then(|timer| timer.is_set(schema)));
    if !changing.is_empty() {
        let held = symbol(lifted, &format!("held {}", schema.name), parameters.len(), false);
        let over_all_conjuncts =
            [literal(running, &parameters)].into_iter().chain(changing.into_iter().cloned()).collect();
        let change = effect(Change::Add(held, parameters.clone()));
        happenings.push((Half::OverAll, instantaneous(over_all_conjuncts, vec![change])));
        condition.push(literal(held, &parameters));
    }
    let mut effects = schema.end_effects.clone();
    effects.push(effect(Change::Delete(running, parameters)));
    effects.extend(timer.map(|timer| timer.clear(schema)));
    happenings.push((Half::End, instantaneous(condition, effects)));
    happenings
}

/// Returns `true` if the start and the end unconditionally assign the same number. At duration 0,
/// they then interfere, so the action cannot be executed.
fn assigns_twice(schema: &Schema) -> bool {
    let is_certain = |effect: &Effect| {
        effect.bound.is_empty() && matches!(&effect.condition, Formula::And(parts) if parts.is_empty())
    };
    let assigned = |effect: &Effect| match &effect.change {
        Change::Assign { assignment: Assignment::Assign, function, terms, .. } if is_certain(effect) => {
            Some((*function, terms.clone()))
        }
        _ => None,
    };
    let mut at_start = schema.start_effects.iter().filter_map(assigned);
    at_start.any(|number| schema.end_effects.iter().filter_map(assigned).any(|candidate| candidate == number))
}

fn settled_of(lifted: &Lifted, conditions: &[Formula]) -> Vec<Formula> {
    let conjuncts_of_all = conditions.iter().flat_map(conjuncts);
    conjuncts_of_all.filter(|conjunct| is_static(lifted, conjunct)).cloned().collect()
}

/// Schema of the timed initial literals of one event. The phase atoms enforce the order of the
/// events.
#[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
fn timed(lifted: &Lifted, index: u32, event: &Event) -> Schema {
    let phase = |number: u32| vec![Term::Object(ObjectId(lifted.time.first_phase.0 + number))];
    let mut changes: Vec<(PredicateId, &[ObjectId], bool)> = Vec::new();
    for (predicate, arguments, holds) in &event.changes {
        changes.retain(|(changed, objects, _)| (changed, *objects) != (predicate, arguments));
        changes.push((*predicate, arguments, *holds));
    }
    let mut effects: Vec<Effect> = changes
        .into_iter()
        .map(|(predicate, arguments, holds)| {
            let terms = arguments.iter().map(|object| Term::Object(*object)).collect();
            effect(if holds { Change::Add(predicate, terms) } else { Change::Delete(predicate, terms) })
        })
        .collect();
    // A plan without actions ends at time 0, so literals at this time do not extend it.
    if event.time.is_positive() {
        effects.push(effect(Change::Add(lifted.time.waited, Vec::new())));
    }
    effects.push(effect(Change::Delete(lifted.time.phase, phase(index))));
    effects.push(effect(Change::Add(lifted.time.phase, phase(index + 1))));
    Schema {
        name: Name::new("timed initial literals"),
        parameters: Vec::new(),
        variables: 0,
        start_condition: literal(lifted.time.phase, &phase(index)),
        start_effects: Vec::new(),
        middle_condition: Formula::truth(),
        over_all: Formula::truth(),
        at_end: Formula::truth(),
        end_effects: effects,
        duration: None,
        choice: DurationChoice::None,
        joint: None,
        action: dense(lifted.schemas.len()),
        place: Place { file: File::Problem, span: Span::default() },
    }
}

fn symbol(lifted: &mut Lifted, name: &str, arity: usize, running: bool) -> PredicateId {
    let id = PredicateId(dense(lifted.predicates.len()));
    let name = Name::new(name);
    lifted.predicates.push(Predicate { name, arity, fluent: true, derived: false, running });
    id
}
