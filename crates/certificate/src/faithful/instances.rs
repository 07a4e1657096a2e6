//! Enumerates the action instances for which the static atoms among the conjuncts of the condition
//! hold: joins these atoms, then adds all objects of the right types for the other parameters.

use rustc_hash::FxHashMap;

use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use num_traits::Signed as _;
use pddl::ast::{Action, ActionBody, Arithmetic, Atom, Condition, ConditionTime, Expression, Name, Term};

pub(super) const INSTANCE_LIMIT: usize = 400_000;
/// Upper limit on the total number of arguments of all instances, which then take 256 MB.
pub(super) const ARGUMENT_LIMIT: usize = 1 << 26;
const POLL_INTERVAL: usize = 1 << 10;

type Binding<'b> = FxHashMap<&'b Name, u32>;

/// Returns the argument lists of all instances of an action whose static positive conjuncts hold. Fails if
/// there are too many instances, or if `stop` returns `true`.
pub(super) fn of(
    world: &World<'_>,
    action: &Action,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Vec<u32>>, Cause> {
    let mut atoms = Vec::new();
    match &action.body {
        ActionBody::Instantaneous { precondition, .. } => conjuncts(precondition, &mut atoms),
        ActionBody::Durative { conditions, .. } => {
            // Conditions over all do not apply to an instance with the duration 0.
            let is_positive = action.body.has_positive_duration(|expression| is_positive(world, expression));
            for (time, condition) in conditions {
                if is_positive || *time != ConditionTime::OverAll {
                    conjuncts(condition, &mut atoms);
                }
            }
        }
    }
    let is_static = |atom: &&Atom| {
        let symbol = world.symbol(&atom.predicate.name);
        symbol.is_ok_and(|symbol| !world.changes(symbol) && world.rules(symbol).is_none())
    };
    let mut open: Vec<&Atom> = atoms.into_iter().filter(is_static).collect();
    let mut partial: Vec<Binding<'_>> = vec![Binding::default()];
    while !open.is_empty() {
        // Atoms with a constant or a bound parameter are joined first, so that the join does not become a
        // Cartesian product. Among them, the atom with the fewest unbound arguments is next. Ties are broken by
        // the number of facts.
        let join_cost = |atom: &Atom| {
            let names = partial.first();
            let unknown = |term: &&Term| match term {
                Term::Variable(identifier) => names.is_none_or(|own| !own.contains_key(&identifier.name)),
                Term::Constant(_) => false,
            };
            let unknown = atom.arguments.iter().filter(unknown).count();
            let connected = unknown < atom.arguments.len() || atom.arguments.is_empty();
            let rows = world.symbol(&atom.predicate.name).map_or(0, |symbol| world.count(symbol, None));
            (!connected, unknown, rows)
        };
        let best = (0..open.len()).min_by_key(|at| join_cost(open[*at])).unwrap_or(0);
        let atom = open.swap_remove(best);
        let mut longer = Vec::new();
        for binding in &partial {
            extend(world, atom, binding, &mut longer)?;
            if stop() {
                return Err(Cause::Stopped);
            }
            if are_too_many(longer.len(), action) {
                return Err(too_many(action.identifier.name.as_str()));
            }
        }
        partial = longer;
    }
    let mut instances = Vec::new();
    // All partial bindings bind the same parameters.
    let mut typed = Vec::new();
    for parameter in &action.parameters {
        let is_bound = partial.first().is_none_or(|own| own.contains_key(&parameter.identifier.name));
        typed.push(if is_bound { Vec::new() } else { world.objects_of(&parameter.r#type) });
        if stop() {
            return Err(Cause::Stopped);
        }
    }
    for binding in &partial {
        complete(world, action, (binding, &typed), stop, &mut instances)?;
    }
    instances.sort_unstable();
    instances.dedup();
    Ok(instances)
}

/// Returns `true` if the value of an expression is certainly above 0 or undefined, whatever its parameters are.
fn is_positive(world: &World<'_>, expression: &Expression) -> bool {
    match expression {
        Expression::Number(number, _) => number.is_positive(),
        Expression::Fluent(atom) => world.symbol(&atom.predicate.name).is_ok_and(|symbol| {
            let mut values = world.initial_values().filter(|(key, _)| key.0 == symbol);
            !world.changes(symbol) && values.all(|(_, value)| value.is_positive())
        }),
        Expression::Operation(Arithmetic::Add | Arithmetic::Multiply | Arithmetic::Divide, parts, _) => {
            parts.iter().all(|part| is_positive(world, part))
        }
        _ => false,
    }
}

pub(super) fn conjuncts<'c>(condition: &'c Condition, atoms: &mut Vec<&'c Atom>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| conjuncts(part, atoms)),
        Condition::Atom(atom) => atoms.push(atom),
        _ => {}
    }
}

pub(super) fn too_many(name: &str) -> Cause {
    Cause::TooMany { what: format!("instances of {name}"), limit: INSTANCE_LIMIT }
}

fn extend<'b>(
    world: &World<'_>,
    atom: &'b Atom,
    binding: &Binding<'b>,
    longer: &mut Vec<Binding<'b>>,
) -> Result<(), Cause> {
    let predicate = world.symbol(&atom.predicate.name)?;
    let object_of = |term: &Term| world.bound(term, binding);
    let place = atom.arguments.iter().enumerate().find_map(|(place, term)| Some((place, object_of(term)?)));
    'rows: for row in world.rows(predicate, place) {
        if row.len() != atom.arguments.len() {
            continue;
        }
        let mut next = binding.clone();
        for (term, object) in atom.arguments.iter().zip(row) {
            match (world.bound(term, &next), term) {
                (Some(bound), _) if bound == *object => {}
                (None, Term::Variable(identifier)) => {
                    next.insert(&identifier.name, *object);
                }
                _ => continue 'rows,
            }
        }
        longer.push(next);
    }
    Ok(())
}

/// Adds the instances that extend a binding. `typed` contains the objects of the right type for
/// each unbound parameter.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
fn complete(
    world: &World<'_>,
    action: &Action,
    (binding, typed): (&Binding<'_>, &[Vec<u32>]),
    stop: &dyn Fn() -> bool,
    instances: &mut Vec<Vec<u32>>,
) -> Result<(), Cause> {
    let mut choices: Vec<&[u32]> = Vec::new();
    for (parameter, typed) in action.parameters.iter().zip(typed) {
        choices.push(match binding.get(&parameter.identifier.name) {
            Some(object) if world.is_of(*object, &parameter.r#type) => std::slice::from_ref(object),
            Some(_) => &[],
            None => typed,
        });
    }
    if choices.iter().any(|own| own.is_empty()) {
        return Ok(());
    }
    // Enumerates all combinations like an odometer; the last parameter changes fastest.
    let mut places = vec![0; choices.len()];
    loop {
        if are_too_many(instances.len(), action) {
            return Err(too_many(action.identifier.name.as_str()));
        }
        if instances.len().is_multiple_of(POLL_INTERVAL) && stop() {
            return Err(Cause::Stopped);
        }
        instances.push(choices.iter().zip(&places).map(|(own, place)| own[*place]).collect());
        let Some(at) = (0..choices.len()).rev().find(|at| places[*at] + 1 < choices[*at].len()) else {
            return Ok(());
        };
        places[at] += 1;
        places[at + 1..].fill(0);
    }
}

fn are_too_many(instances: usize, action: &Action) -> bool {
    instances > INSTANCE_LIMIT || instances.saturating_mul(action.parameters.len()) > ARGUMENT_LIMIT
}
