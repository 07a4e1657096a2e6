//! Normalisation: converts the syntax tree to a lifted task. Names become ids, negation is moved inwards, and
//! the conditions and effects of durative actions are separated by time.
//!
//! The syntax trees must have passed `pddl::check`. Unsupported features, such as variable durations on which
//! effects depend, are rejected here with their source locations.

mod condition;
pub mod duration;
pub mod events;
mod fluents;
mod initial;
mod names;
pub mod undefined_fluents;
pub mod zero_duration;

use crate::error::{Errors, File, Place};
use crate::lifted::{Axiom, DurationChoice, Formula, Lifted, Metric, Schema};
use names::{Names, Scope};
use pddl::ast::{self, ConditionTime, EffectTime};

/// Normalises a domain and a problem for sequential execution. The `objectives`, in lexicographic order,
/// replace the metric of the problem; if empty, the metric is used.
///
/// # Errors
/// Returns the unsupported constructs and undeclared names that normalisation finds, with their source
/// locations.
pub fn normalize(
    domain: &ast::Domain,
    problem: &ast::Problem,
    objectives: &[ast::Metric],
) -> Result<Lifted, Errors> {
    named(Names::new(domain, problem), (domain, problem), objectives)
}

/// Normalises a domain and a problem like [`normalize`], but the planner may choose variable durations. Each
/// variable duration becomes an auxiliary numeric function ([`duration::CHOSEN`]), and its bounds become
/// conditions.
///
/// # Errors
/// See [`normalize`].
pub fn normalize_freely(
    domain: &ast::Domain,
    problem: &ast::Problem,
    objectives: &[ast::Metric],
) -> Result<Lifted, Errors> {
    let mut names = Names::new(domain, problem);
    names.is_free = true;
    named(names, (domain, problem), objectives)
}

fn named(
    mut names: Names,
    (domain, problem): (&ast::Domain, &ast::Problem),
    objectives: &[ast::Metric],
) -> Result<Lifted, Errors> {
    let written = if objectives.is_empty() { problem.metric.as_slice() } else { objectives };
    let metrics: Vec<_> = (0..)
        .zip(written)
        .map(|(index, metric)| {
            let file = if objectives.is_empty() { File::Problem } else { File::Objective(index) };
            Metric {
                direction: metric.direction,
                expression: condition::expression(&mut names, &metric.expression, &mut Scope::new(file)),
                place: Place { file, span: metric.span },
            }
        })
        .collect();
    let has_events = problem.init.iter().any(|element| matches!(element, ast::InitialElement::Timed(..)));
    // With timed events, a longer duration may replace a wait, so the shortest duration is not always best.
    let longest = if has_events { None } else { duration::rewards_time(&metrics) };
    let schemas = domain.actions.iter().zip(0..);
    let schemas = schemas.map(|(action, index)| schema(&mut names, longest, action, index)).collect();
    let axioms = domain.derived.iter().map(|axiom| self::axiom(&mut names, axiom)).collect();
    let (mut facts, values) = initial::initial_state(&mut names, problem);
    let events = initial::events(&mut names, problem);
    let mut scope = Scope::new(File::Problem);
    let goal = condition::condition(&mut names, &problem.goal, true, &mut scope);
    if !names.errors.is_empty() {
        return Err(names.errors.into());
    }
    let time = initial::time(&mut names, &events);
    if !events.is_empty() {
        facts.push((time.phase, [time.first_phase].into()));
    }
    let mut lifted = Lifted {
        objects: names.objects,
        predicates: names.predicates,
        functions: names.functions,
        schemas,
        axioms,
        facts,
        values,
        events,
        time,
        goal,
        goal_variables: scope.bound as usize,
        metrics,
    };
    fluents::mark_fluents(&mut lifted);
    let errors = duration::changing_at_end(domain, &lifted);
    if errors.is_empty() { Ok(lifted) } else { Err(errors.into()) }
}

fn schema(names: &mut Names, longest: Option<bool>, action: &ast::Action, index: u32) -> Schema {
    let mut scope = Scope::new(File::Domain);
    let mut schema = Schema {
        name: action.identifier.name.clone(),
        parameters: names.parameters(&action.parameters, &mut scope),
        variables: 0,
        start_condition: Formula::truth(),
        start_effects: Vec::new(),
        middle_condition: Formula::truth(),
        over_all: Formula::truth(),
        at_end: Formula::truth(),
        end_effects: Vec::new(),
        duration: None,
        choice: DurationChoice::None,
        joint: None,
        action: index,
        place: scope.place(action.span),
    };
    match &action.body {
        ast::ActionBody::Instantaneous { precondition, effect } => {
            schema.start_condition = condition::condition(names, precondition, true, &mut scope);
            condition::effect(names, effect, &mut scope, &mut schema.end_effects);
        }
        ast::ActionBody::Durative { duration, conditions, effects } => {
            let mut middle = Vec::new();
            let (mut over_all, mut at_end) = (Vec::new(), Vec::new());
            let signature = (&action.identifier.name, schema.parameters.len());
            let (chosen, mut start, choice) =
                duration::duration(names, (duration, action.span), signature, longest, &mut scope);
            (schema.duration, schema.choice) = (Some(chosen), choice);
            for (time, condition) in conditions {
                let formula = condition::condition(names, condition, true, &mut scope);
                match time {
                    ConditionTime::OverAll => over_all.push(formula.clone()),
                    ConditionTime::AtEnd => at_end.push(formula.clone()),
                    ConditionTime::AtStart => {}
                }
                if *time == ConditionTime::AtStart { &mut start } else { &mut middle }.push(formula);
            }
            (schema.start_condition, schema.middle_condition) = (Formula::And(start), Formula::And(middle));
            (schema.over_all, schema.at_end) = (Formula::And(over_all), Formula::And(at_end));
            for (time, effect) in effects {
                let target = match time {
                    EffectTime::AtStart => &mut schema.start_effects,
                    EffectTime::AtEnd => &mut schema.end_effects,
                };
                condition::effect(names, effect, &mut scope, target);
            }
        }
    }
    schema.variables = scope.bound as usize;
    schema
}

fn axiom(names: &mut Names, axiom: &ast::Derived) -> Axiom {
    let mut scope = Scope::new(File::Domain);
    let parameters = names.parameters(&axiom.head.parameters, &mut scope);
    let predicate = names.predicate(&axiom.head.identifier, File::Domain);
    let condition = condition::condition(names, &axiom.condition, true, &mut scope);
    Axiom { predicate, parameters, variables: scope.bound as usize, condition }
}
