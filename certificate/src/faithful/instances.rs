//! The instances of an action whose conditions on what never changes hold: a join over these, atom by atom, then the objects
//! of the types of parameters that are left.

use rustc_hash::FxHashMap;

use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use pddl::ast::{Action, ActionBody, Atom, Condition, Name, Term};

/// With more instances, nothing is checked.
pub(super) const INSTANCE_LIMIT: usize = 400_000;

/// Values of parameters so far.
type Binding<'b> = FxHashMap<&'b Name, u32>;

/// The arguments of all instances.
pub(super) fn of(
    world: &World<'_>,
    action: &Action,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Vec<u32>>, Cause> {
    let mut atoms = Vec::new();
    match &action.body {
        ActionBody::Instantaneous { precondition, .. } => conjuncts(precondition, &mut atoms),
        ActionBody::Durative { conditions, .. } => {
            for (_, condition) in conditions {
                conjuncts(condition, &mut atoms);
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
        // One with the fewest unknown parameters, so that the join does not become a product.
        let known = |atom: &Atom| {
            let names = partial.first();
            let unknown = |term: &&Term| match term {
                Term::Variable(identifier) => names.is_none_or(|own| !own.contains_key(&identifier.name)),
                Term::Constant(_) => false,
            };
            let unknown = atom.arguments.iter().filter(unknown).count();
            let connected = unknown < atom.arguments.len() || atom.arguments.is_empty();
            let rows = world.symbol(&atom.predicate.name).map_or(0, |symbol| world.rows(symbol, None).len());
            (!connected, unknown, rows)
        };
        let best = (0..open.len()).min_by_key(|at| known(open[*at])).unwrap_or(0);
        let atom = open.swap_remove(best);
        let mut longer = Vec::new();
        for binding in &partial {
            extend(world, atom, binding, &mut longer)?;
            if stop() {
                return Err(Cause::Stopped);
            }
            if longer.len() > INSTANCE_LIMIT {
                return Err(too_many(action.identifier.name.as_str()));
            }
        }
        partial = longer;
    }
    let mut instances = Vec::new();
    for binding in &partial {
        complete(world, action, binding, &mut Vec::new(), &mut instances)?;
    }
    instances.sort_unstable();
    instances.dedup();
    Ok(instances)
}

pub(super) fn conjuncts<'c>(condition: &'c Condition, atoms: &mut Vec<&'c Atom>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| conjuncts(part, atoms)),
        Condition::Atom(atom) => atoms.push(atom),
        _ => {}
    }
}

/// Says that there are too many instances of what is named.
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
    let known = |term: &Term| world.bound(term, binding);
    let place = atom.arguments.iter().enumerate().find_map(|(place, term)| Some((place, known(term)?)));
    'rows: for row in world.rows(predicate, place) {
        if row.len() != atom.arguments.len() {
            continue;
        }
        let mut next = binding.clone();
        for (term, object) in atom.arguments.iter().zip(row) {
            match (world.bound(term, &next), term) {
                (Some(own), _) if own == *object => {}
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

/// Adds the instances with all objects that fit the parameters that are left.
fn complete(
    world: &World<'_>,
    action: &Action,
    binding: &Binding<'_>,
    arguments: &mut Vec<u32>,
    instances: &mut Vec<Vec<u32>>,
) -> Result<(), Cause> {
    if instances.len() > INSTANCE_LIMIT {
        return Err(too_many(action.identifier.name.as_str()));
    }
    let Some(parameter) = action.parameters.get(arguments.len()) else {
        instances.push(arguments.clone());
        return Ok(());
    };
    let own = match binding.get(&parameter.identifier.name) {
        Some(object) if world.is_of(*object, &parameter.r#type) => vec![*object],
        Some(_) => Vec::new(),
        None => world.objects_of(&parameter.r#type),
    };
    for object in own {
        arguments.push(object);
        complete(world, action, binding, arguments, instances)?;
        arguments.pop();
    }
    Ok(())
}
