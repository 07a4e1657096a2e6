//! Enumerates the bindings of quantified variables by a join over atoms that must hold.
//!
//! Quantifiers range over the product of the types of their variables, but typically most bindings fail a
//! static atom. The atoms of the quantified formula are therefore joined: the rows (argument tuples that can
//! hold) of each atom are looked up by its bound arguments. Only the remaining variables are enumerated by
//! type.

use crate::ground::vocabulary::atom::Binding;
use crate::ground::vocabulary::world::World;
use crate::lifted::{Arguments, Bound, Formula, ObjectId, PredicateId, Term};
use crate::limits::Interrupted;

/// Guard of a quantifier: an atom (predicate and terms) that must be possibly true for a binding to matter.
type Guard<'f> = (PredicateId, &'f [Term]);

/// Returns the atoms that are necessary for the body of an existential quantifier. The body is false for
/// every binding for which one of the atoms is false.
pub fn guards_of_exists(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::And(parts) => guards.extend(parts.iter().flat_map(guards_of_exists)),
        Formula::Exists(_, inner) => guards.extend(guards_of_exists(inner)),
        Formula::Literal { positive: true, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// Returns the negated atoms among the disjuncts of the body of a universal quantifier. The body is true for
/// a binding for which one of the atoms is false.
pub fn guards_of_forall(body: &Formula) -> Vec<Guard<'_>> {
    let mut guards = Vec::new();
    match body {
        Formula::Or(parts) => guards.extend(parts.iter().flat_map(guards_of_forall)),
        Formula::ForAll(_, inner) => guards.extend(guards_of_forall(inner)),
        Formula::Literal { positive: false, predicate, terms } => guards.push((*predicate, terms.as_slice())),
        _ => {}
    }
    guards
}

/// Calls `visit` with every binding of the variables in `bound` for which all guards (necessary atoms) can
/// hold, until `visit` returns `false`. Other bindings may be visited, too, because some guards are not
/// evaluated. Returns `true` if `visit` always returned `true`. Afterwards the variables are unbound, unless
/// the enumeration was interrupted.
///
/// # Errors
/// The deadline has passed or the run is interrupted.
pub fn each_binding<'a>(
    world: &mut World<'a>,
    bound: &[Bound],
    guards: &[Guard<'_>],
    binding: &mut Binding,
    visit: &mut dyn FnMut(&mut World<'a>, &mut Binding) -> bool,
) -> Result<bool, Interrupted> {
    debug_assert!(bound.is_sorted_by_key(|bound| bound.variable));
    let mut join = Join { bound, guards, is_used: vec![false; guards.len()] };
    // An explicit stack instead of recursion, because a quantifier may bind very many variables.
    let mut levels: Vec<Level> = Vec::new();
    loop {
        world.visit()?;
        match join.next_level(world, levels.last(), binding) {
            Some(level) => levels.push(level),
            None if visit(world, binding) => {}
            None => {
                for level in &mut levels {
                    level.undo(binding);
                }
                return Ok(false);
            }
        }
        // Backtrack to the innermost level with another option.
        while let Some(level) = levels.last_mut() {
            level.undo(binding);
            if join.advance(world, level, binding)? {
                break;
            }
            join.leave(level);
            levels.pop();
        }
        if levels.is_empty() {
            return Ok(true);
        }
    }
}

struct Join<'j> {
    bound: &'j [Bound],
    guards: &'j [Guard<'j>],
    /// For each guard (necessary atom): `true` while the enumeration is inside a loop over its rows.
    is_used: Vec<bool>,
}

struct Level {
    options: Options,
    fresh: Vec<u32>,
}

enum Options {
    Rows(usize, std::vec::IntoIter<Arguments>),
    Candidates(usize, usize),
}

impl Level {
    fn undo(&mut self, binding: &mut Binding) {
        for variable in self.fresh.drain(..) {
            binding[variable as usize] = None;
        }
    }
}

impl Join<'_> {
    /// Returns the next level of the search: the rows of the guard (necessary atom) with the fewest unbound
    /// variables, or else the candidates of the next variable. Returns `None` if all variables are bound.
    fn next_level(
        &mut self,
        world: &mut World<'_>,
        last: Option<&Level>,
        binding: &Binding,
    ) -> Option<Level> {
        let guard = match last {
            // Candidates are enumerated only after the rows of all usable guards (necessary atoms).
            Some(Level { options: Options::Candidates(..), .. }) => None,
            _ => self.next_guard(binding),
        };
        let options = if let Some(position) = guard {
            self.is_used[position] = true;
            let (predicate, terms) = self.guards[position];
            Options::Rows(position, world.rows(predicate, terms, binding).into_iter())
        } else {
            let first = match last {
                Some(Level { options: Options::Candidates(place, _), .. }) => *place,
                _ => 0,
            };
            let is_open = |place: &usize| binding[self.bound[*place].variable as usize].is_none();
            Options::Candidates((first..self.bound.len()).find(is_open)?, 0)
        };
        Some(Level { options, fresh: Vec::new() })
    }

    /// Returns the position of the unused guard (necessary atom) with the fewest unbound variables, or
    /// `None`. Guards without unbound variables, with unbound variables of other quantifiers, or with more
    /// than 64 terms are excluded.
    fn next_guard(&self, binding: &Binding) -> Option<usize> {
        let open_variables = |(position, (_, terms)): (usize, &Guard<'_>)| {
            let open = terms.iter().filter_map(|term| match term {
                Term::Parameter(variable) if binding[*variable as usize].is_none() => Some(*variable),
                _ => None,
            });
            // The row index represents a set of argument positions by the bits of a 64-bit word.
            let (mut count, mut joins) = (0_usize, !self.is_used[position] && terms.len() <= 64);
            for variable in open {
                count = count.saturating_add(1);
                joins &= self.find(variable).is_some();
            }
            (joins && count > 0).then_some((count, position))
        };
        self.guards.iter().enumerate().filter_map(open_variables).min().map(|(_, position)| position)
    }

    fn advance(
        &self,
        world: &mut World<'_>,
        level: &mut Level,
        binding: &mut Binding,
    ) -> Result<bool, Interrupted> {
        match &mut level.options {
            Options::Candidates(place, next) => {
                let Bound { variable, candidates } = &self.bound[*place];
                let Some(object) = candidates.get(*next) else { return Ok(false) };
                *next = next.saturating_add(1);
                binding[*variable as usize] = Some(*object);
                level.fresh.push(*variable);
                Ok(true)
            }
            Options::Rows(position, rows) => {
                let (_, terms) = self.guards[*position];
                for row in rows {
                    world.visit()?;
                    if self.fits(terms, &row, binding, &mut level.fresh) {
                        return Ok(true);
                    }
                    // A row that does not match may have bound some variables.
                    for variable in level.fresh.drain(..) {
                        binding[variable as usize] = None;
                    }
                }
                Ok(false)
            }
        }
    }

    /// Binds the unbound variables of terms to the objects of a row. Returns `false` if the row
    /// does not match.
    fn fits(&self, terms: &[Term], row: &[ObjectId], binding: &mut Binding, fresh: &mut Vec<u32>) -> bool {
        terms.iter().zip(row).all(|(term, object)| match term {
            Term::Object(constant) => constant == object,
            Term::Parameter(variable) => {
                if let Some(object_of_variable) = binding[*variable as usize] {
                    return object_of_variable == *object;
                }
                binding[*variable as usize] = Some(*object);
                fresh.push(*variable);
                self.find(*variable).is_some_and(|bound| bound.candidates.binary_search(object).is_ok())
            }
        })
    }

    fn find(&self, variable: u32) -> Option<&Bound> {
        let place = self.bound.binary_search_by_key(&variable, |bound| bound.variable).ok()?;
        self.bound.get(place)
    }

    fn leave(&mut self, level: &Level) {
        if let Options::Rows(position, _) = level.options {
            self.is_used[position] = false;
        }
    }
}
