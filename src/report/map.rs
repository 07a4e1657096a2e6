//! Infers the places of a mission, their neighbours, and the route of a plan.
//!
//! PDDL does not mark places. This module assumes that something moves if an action deletes `(p … a)` and adds
//! `(p … b)` with parameters `a` and `b` of one type. Of these types, the objects of the type that the plan
//! uses most are places. Two places are neighbours if a fact of the problem has exactly these two places among
//! its arguments. If no places are connected by facts, numeric values are used instead.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{
    Action, ActionBody, Atom, Condition, Domain, Effect, InitialElement, Name, Problem, Term, TypeExpression,
    TypedName,
};
use picture::{Map, Place, Step};
use planner::Plan;

use crate::report::seen::Scene;

struct Movement<'d> {
    action: &'d Name,
    predicate: &'d Name,
    /// Positions of the action's parameters for origin and destination.
    parameters: (usize, usize),
    r#type: &'d TypeExpression,
}

/// Returns the map of a mission that has places, otherwise `None`. Sets the origin and destination
/// of each step that is a movement.
pub(super) fn map(scene: Scene<'_>, plan: &Plan, steps: &mut [Step]) -> Option<Map> {
    let movements: Vec<Movement<'_>> = scene.domain.actions.iter().flat_map(moves).collect();
    let moving = places_of_most(scene, plan, &movements)?;
    let places = moving.places;
    let number: BTreeMap<&Name, usize> = places.iter().zip(0..).collect();
    for (planned_step, step) in plan.steps.iter().zip(steps) {
        let mut ways =
            moving.movements.iter().filter(|movement| *movement.action == Name::new(&planned_step.action));
        step.way = ways.find_map(|movement| {
            let at =
                |parameter: usize| number.get(&Name::new(planned_step.arguments.get(parameter)?)).copied();
            Some((at(movement.parameters.0)?, at(movement.parameters.1)?))
        });
    }
    let predicates: BTreeSet<&Name> = moving.movements.iter().map(|movement| movement.predicate).collect();
    let starts = scene.problem.init.iter().filter_map(|element| match element {
        InitialElement::Fact(atom) => Some(atom),
        _ => None,
    });
    let (starts, goals) = (ends(starts, &predicates), ends(goals(&scene.problem.goal), &predicates));
    let positions = scene.positions.of(scene.problem, &places);
    let place = |name: &Name| Place {
        name: name.to_string(),
        position: positions.as_ref().and_then(|positions| positions.get(name).copied()),
        is_start: starts.contains(name),
        is_goal: goals.contains(name),
    };
    Some(Map { places: places.iter().map(place).collect(), ways: ways(scene.problem, &number, &predicates) })
}

struct Moving<'d> {
    movements: Vec<&'d Movement<'d>>,
    places: Vec<Name>,
}

/// Selects the places between which the plan moves most often; of equal candidates, those with more
/// movements in the domain. Types with designs or with fewer than two objects are excluded.
fn places_of_most<'d>(scene: Scene<'_>, plan: &Plan, movements: &'d [Movement<'d>]) -> Option<Moving<'d>> {
    let designs: BTreeSet<Name> = scene.designs.keys().map(|design| Name::new(design)).collect();
    let mut kinds: BTreeMap<Vec<Name>, Vec<&'d Movement<'d>>> = BTreeMap::new();
    for movement in movements {
        let objects = objects(scene.domain, scene.problem, movement.r#type);
        // A change of designs has the form of a movement.
        if objects.len() > 1 && !objects.iter().any(|object| designs.contains(object)) {
            kinds.entry(objects).or_default().push(movement);
        }
    }
    let uses = |kind: &[&Movement<'_>]| {
        let is_movement = |name: &str| kind.iter().any(|movement| *movement.action == Name::new(name));
        plan.steps.iter().filter(|step| is_movement(&step.action)).count()
    };
    let most_used = kinds.into_iter().max_by_key(|(_, kind)| (uses(kind), kind.len()));
    most_used.map(|(places, movements)| Moving { movements, places })
}

fn moves(action: &Action) -> Vec<Movement<'_>> {
    let (mut added, mut deleted) = (Vec::new(), Vec::new());
    let mut parts: Vec<&Effect> = match &action.body {
        ActionBody::Instantaneous { effect, .. } => vec![effect],
        ActionBody::Durative { effects, .. } => effects.iter().map(|(_, effect)| effect).collect(),
    };
    while let Some(part) = parts.pop() {
        match part {
            Effect::And(more) => parts.extend(more),
            Effect::Add(atom) => added.push(atom),
            Effect::Delete(atom) => deleted.push(atom),
            _ => {}
        }
    }
    let parameter = |term: Option<&Term>| match term {
        Some(Term::Variable(variable)) => {
            action.parameters.iter().position(|parameter| parameter.identifier.name == variable.name)
        }
        _ => None,
    };
    let mut movements = Vec::new();
    for (from, to) in deleted.iter().flat_map(|from| added.iter().map(move |to| (*from, *to))) {
        let (Some(left), Some(right)) = (parameter(from.arguments.last()), parameter(to.arguments.last()))
        else {
            continue;
        };
        let types = [left, right].map(|position| &action.parameters[position].r#type);
        if left != right && same_but_last(from, to) && names(types[0]).eq(names(types[1])) {
            let (action, predicate) = (&action.identifier.name, &from.predicate.name);
            movements.push(Movement { action, predicate, parameters: (left, right), r#type: types[1] });
        }
    }
    movements
}

fn names(r#type: &TypeExpression) -> impl Iterator<Item = &Name> {
    r#type.alternatives.iter().map(|name| &name.name)
}

fn same_but_last(left: &Atom, right: &Atom) -> bool {
    let but_last = |atom: &Atom| {
        let terms = atom.arguments.iter().map(|term| term.name().clone());
        terms.take(atom.arguments.len().saturating_sub(1)).collect::<Vec<_>>()
    };
    left.predicate.name == right.predicate.name
        && left.arguments.len() == right.arguments.len()
        && but_last(left) == but_last(right)
}

fn objects(domain: &Domain, problem: &Problem, r#type: &TypeExpression) -> Vec<Name> {
    let object = Name::new("object");
    let mut below: BTreeSet<&Name> = names(r#type).collect();
    // Without a type, PDDL assumes `object`, the supertype of all types.
    let is_everything = below.is_empty() || below.contains(&object);
    loop {
        let is_below = |entry: &&TypedName| names(&entry.r#type).any(|above| below.contains(above));
        let subtypes: Vec<&Name> =
            domain.types.iter().filter(is_below).map(|entry| &entry.identifier.name).collect();
        let count = below.len();
        below.extend(subtypes);
        if below.len() == count {
            break;
        }
    }
    let has_type =
        |entry: &&TypedName| is_everything || names(&entry.r#type).any(|name| below.contains(name));
    let entries = domain.constants.iter().chain(&problem.objects).filter(has_type);
    let mut visited = BTreeSet::new();
    entries.map(|entry| entry.identifier.name.clone()).filter(|name| visited.insert(name.clone())).collect()
}

fn ends<'p>(atoms: impl Iterator<Item = &'p Atom>, predicates: &BTreeSet<&Name>) -> BTreeSet<Name> {
    let matching = atoms.filter(|atom| predicates.contains(&atom.predicate.name));
    matching.filter_map(|atom| atom.arguments.last()).map(|term| term.name().clone()).collect()
}

fn goals(goal: &Condition) -> impl Iterator<Item = &Atom> {
    let mut parts = vec![goal];
    std::iter::from_fn(move || {
        loop {
            match parts.pop()? {
                Condition::And(more) => parts.extend(more.iter().rev()),
                Condition::Atom(atom) => return Some(atom),
                _ => {}
            }
        }
    })
}

/// Returns the pairs of neighbouring places (see the head of this file), as numbers of places.
/// `moving` are the predicates that movements change, such as `robot_at`; they are ignored.
fn ways(problem: &Problem, number: &BTreeMap<&Name, usize>, moving: &BTreeSet<&Name>) -> Vec<(usize, usize)> {
    let (mut facts, mut values) = (BTreeSet::new(), BTreeSet::new());
    for element in &problem.init {
        let (atom, found) = match element {
            InitialElement::Fact(atom) => (atom, &mut facts),
            InitialElement::Value(atom, ..) => (atom, &mut values),
            _ => continue,
        };
        let places: Vec<usize> =
            atom.arguments.iter().filter_map(|term| number.get(term.name()).copied()).collect();
        if let [one, other] = places[..]
            && one != other
            && !moving.contains(&atom.predicate.name)
        {
            // Neighbourhood is symmetric in the picture.
            found.insert((one.min(other), one.max(other)));
        }
    }
    if facts.is_empty() { values } else { facts }.into_iter().collect()
}
