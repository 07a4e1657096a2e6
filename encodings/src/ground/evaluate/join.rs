//! Enumeration of the objects that bound variables can stand for, driven by the facts that must hold.
//!
//! `exists` and `forall` range over products of types; most of their elements fail a static atom. So the atoms of the
//! body are joined, each looked up by the arguments that are bound already, and only what they leave open is tried.

use crate::ground::vocabulary::atom::Binding;
use crate::ground::vocabulary::world::World;
use crate::lifted::{Bound, Formula, PredicateId, Term};
use crate::limits::Interrupted;

/// An atom that must be able to hold.
type Guard<'f> = (PredicateId, &'f [Term]);

/// The atoms without which the body of an existential quantifier fails.
pub(crate) fn guards_of_exists(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::And(parts) => guards.extend(parts.iter().flat_map(guards_of_exists)),
        Formula::Exists(_, inner) => guards.extend(guards_of_exists(inner)),
        Formula::Literal { positive: true, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// The atoms without which the body of a universal quantifier holds.
pub(crate) fn guards_of_forall(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::Or(parts) => guards.extend(parts.iter().flat_map(guards_of_forall)),
        Formula::ForAll(_, inner) => guards.extend(guards_of_forall(inner)),
        Formula::Literal { positive: false, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// Calls `visit` with every binding of the variables under which all guards can hold, until it returns
/// false; the variables are unbound again afterwards, unless a limit ends it all. Returns whether `visit` never returned false.
pub(crate) fn each_binding<'a>(
    world: &mut World<'a>,
    bound: &[Bound],
    guards: &[Guard<'_>],
    binding: &mut Binding,
    visit: &mut dyn FnMut(&mut World<'a>, &mut Binding) -> bool,
) -> Result<bool, Interrupted> {
    let open = |term: &&Term, binding: &Binding| match term {
        Term::Parameter(variable) if binding[*variable as usize].is_none() => Some(*variable),
        _ => None,
    };
    let own = |variable: u32| bound.iter().any(|b| b.variable == variable);
    let useful = guards.iter().enumerate().filter_map(|(position, (_, terms))| {
        let variables: Vec<_> = terms.iter().filter_map(|term| open(&term, binding)).collect();
        let joins = !variables.is_empty() && variables.iter().all(|v| own(*v)) && terms.len() <= 64;
        joins.then_some((variables.len(), position))
    });
    let Some((_, position)) = useful.min() else {
        return each_candidate(world, bound, binding, visit);
    };
    let (predicate, terms) = guards[position];
    let rest: Vec<_> =
        guards.iter().enumerate().filter(|(i, _)| *i != position).map(|(_, guard)| *guard).collect();
    for row in world.rows(predicate, terms, binding) {
        let mut fresh = Vec::new();
        let fits = terms.iter().zip(row.iter()).all(|(term, object)| match term {
            Term::Object(constant) => constant == object,
            Term::Parameter(variable) => {
                if let Some(known) = binding[*variable as usize] {
                    return known == *object;
                }
                binding[*variable as usize] = Some(*object);
                fresh.push(*variable);
                let ranges =
                    |b: &Bound| b.variable == *variable && b.candidates.binary_search(object).is_ok();
                bound.iter().any(ranges)
            }
        });
        let go_on = !fits || each_binding(world, bound, &rest, binding, visit)?;
        for variable in fresh {
            binding[variable as usize] = None;
        }
        if !go_on {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Every object for every variable that is still open.
fn each_candidate<'a>(
    world: &mut World<'a>,
    bound: &[Bound],
    binding: &mut Binding,
    visit: &mut dyn FnMut(&mut World<'a>, &mut Binding) -> bool,
) -> Result<bool, Interrupted> {
    let Some(first) = bound.iter().find(|b| binding[b.variable as usize].is_none()) else {
        world.visit()?;
        return Ok(visit(world, binding));
    };
    for object in first.candidates.iter() {
        binding[first.variable as usize] = Some(*object);
        let go_on = each_candidate(world, bound, binding, visit)?;
        binding[first.variable as usize] = None;
        if !go_on {
            return Ok(false);
        }
    }
    Ok(true)
}
