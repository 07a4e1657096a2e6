//! All bindings under which a condition holds: the facts propose the objects, so that quantifiers over
//! many variables do not run through all their combinations.

use crate::ast::{Atom, Condition, Expression, Name, Term, TypedName};

use super::evaluate::{Bindings, Evaluator, Undefined};
use super::world::{Arguments, Symbol};

/// Is told of a solution, with what made it undefined if it is; says whether to go on.
pub(super) type Found<'f, 'p> = &'f mut dyn FnMut(&Bindings<'p>, Option<&Undefined>) -> bool;

impl<'p> Evaluator<'_, 'p> {
    /// Finds the objects for the unbound variables with which all parts hold. Returns whether to go on.
    pub(super) fn solve(
        &self,
        parts: Vec<&'p Condition>,
        bindings: &mut Bindings<'p>,
        mut undefined: Option<Undefined>,
        found: Found<'_, 'p>,
    ) -> bool {
        let outer = bindings.0.len();
        let mut open = Vec::new();
        let mut todo = parts;
        while let Some(part) = todo.pop() {
            match part {
                Condition::And(inner) => todo.extend(inner),
                // Its variables become ours, if none of them hides another.
                Condition::Exists(variables, body)
                    if variables.iter().all(|entry| bindings.place(&entry.identifier.name).is_none()) =>
                {
                    bindings.declare(variables);
                    todo.push(body);
                }
                _ if is_bound(part, bindings) => match self.holds(part, bindings) {
                    Ok(true) => {}
                    Ok(false) => {
                        bindings.0.truncate(outer);
                        return true;
                    }
                    Err(reason) => undefined = undefined.or(Some(reason)),
                },
                _ => open.push(part),
            }
        }
        let go_on = self.branch(open, bindings, undefined, found);
        bindings.0.truncate(outer);
        go_on
    }

    /// Binds a variable in all ways that an open part allows.
    fn branch(
        &self,
        mut open: Vec<&'p Condition>,
        bindings: &mut Bindings<'p>,
        undefined: Option<Undefined>,
        found: Found<'_, 'p>,
    ) -> bool {
        if let Some((place, object)) = open.iter().find_map(|part| self.forced(part, bindings)) {
            return self.with_object(place, object, open, bindings, undefined, found);
        }
        let atoms = open.iter().enumerate().filter_map(|(index, part)| match part {
            Condition::Atom(atom) => {
                Some((self.state.count(self.world.symbol(&atom.predicate.name)), index, atom))
            }
            _ => None,
        });
        if let Some((_, index, atom)) = atoms.min_by_key(|(count, index, _)| (*count, *index)) {
            let atom: &'p Atom = atom;
            open.swap_remove(index);
            return self.by_facts(atom, &open, bindings, undefined.as_ref(), found);
        }
        if let Some(index) = open.iter().position(|part| matches!(part, Condition::Or(_))) {
            let Condition::Or(alternatives) = open.swap_remove(index) else { return true };
            return alternatives.iter().all(|alternative| {
                let parts = open.iter().copied().chain([alternative]).collect();
                self.solve(parts, bindings, undefined.clone(), found)
            });
        }
        let Some(place) = bindings.0.iter().position(|binding| binding.object.is_none()) else {
            return found(bindings, undefined.as_ref());
        };
        let r#type = bindings.0[place].r#type;
        self.world
            .objects_of(r#type)
            .all(|object| self.with_object(place, object, open.clone(), bindings, undefined.clone(), found))
    }

    fn with_object(
        &self,
        place: usize,
        object: Symbol,
        open: Vec<&'p Condition>,
        bindings: &mut Bindings<'p>,
        undefined: Option<Undefined>,
        found: Found<'_, 'p>,
    ) -> bool {
        if !self.world.is_of(object, bindings.0[place].r#type) {
            return true;
        }
        bindings.0[place].object = Some(object);
        let go_on = self.solve(open, bindings, undefined, found);
        bindings.0[place].object = None;
        go_on
    }

    /// The object that an equation with one unbound side forces.
    fn forced(&self, part: &Condition, bindings: &Bindings<'p>) -> Option<(usize, Symbol)> {
        let Condition::Equal(left, right, _) = part else { return None };
        let unbound = |term: &Term| match term {
            Term::Variable(identifier) => {
                bindings.place(&identifier.name).filter(|place| bindings.0[*place].object.is_none())
            }
            Term::Constant(_) => None,
        };
        match (unbound(left), unbound(right)) {
            (Some(place), None) => Some((place, self.term(right, bindings)?)),
            (None, Some(place)) => Some((place, self.term(left, bindings)?)),
            _ => None,
        }
    }

    /// Binds the variables of an atom as each fact of its predicate proposes.
    fn by_facts(
        &self,
        atom: &'p Atom,
        open: &[&'p Condition],
        bindings: &mut Bindings<'p>,
        undefined: Option<&Undefined>,
        found: Found<'_, 'p>,
    ) -> bool {
        for tuple in self.state.tuples(self.world.symbol(&atom.predicate.name)) {
            let mut bound = Vec::new();
            let fits = self.unify(atom, tuple, bindings, &mut bound);
            let go_on = !fits || self.solve(open.to_vec(), bindings, undefined.cloned(), found);
            for place in bound {
                bindings.0[place].object = None;
            }
            if !go_on {
                return false;
            }
        }
        true
    }

    fn unify(
        &self,
        atom: &Atom,
        tuple: &Arguments,
        bindings: &mut Bindings<'p>,
        bound: &mut Vec<usize>,
    ) -> bool {
        if atom.arguments.len() != tuple.len() {
            return false;
        }
        for (term, object) in atom.arguments.iter().zip(tuple) {
            if let Some(known) = self.term(term, bindings) {
                if known != *object {
                    return false;
                }
                continue;
            }
            let Term::Variable(identifier) = term else { return false };
            let Some(place) = bindings.place(&identifier.name) else { return false };
            if !self.world.is_of(*object, bindings.0[place].r#type) {
                return false;
            }
            bindings.0[place].object = Some(*object);
            bound.push(place);
        }
        true
    }
}

/// Whether all variables that a condition takes from outside have an object.
fn is_bound(condition: &Condition, bindings: &Bindings<'_>) -> bool {
    fn walk<'c>(condition: &'c Condition, bindings: &Bindings<'_>, inner: &mut Vec<&'c Name>) -> bool {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().all(|part| walk(part, bindings, inner))
            }
            Condition::Not(part) => walk(part, bindings, inner),
            Condition::Imply(premise, conclusion) => {
                walk(premise, bindings, inner) && walk(conclusion, bindings, inner)
            }
            Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
                let names = |entry: &'c TypedName| &entry.identifier.name;
                let outer = inner.len();
                inner.extend(variables.iter().map(names));
                let bound = walk(body, bindings, inner);
                inner.truncate(outer);
                bound
            }
            Condition::Atom(atom) => atom.arguments.iter().all(|term| term_is_bound(term, bindings, inner)),
            Condition::Equal(left, right, _) => {
                term_is_bound(left, bindings, inner) && term_is_bound(right, bindings, inner)
            }
            Condition::Compare(_, left, right, _) => {
                expression_is_bound(left, bindings, inner) && expression_is_bound(right, bindings, inner)
            }
        }
    }
    walk(condition, bindings, &mut Vec::new())
}

fn expression_is_bound(expression: &Expression, bindings: &Bindings<'_>, inner: &[&Name]) -> bool {
    match expression {
        Expression::Fluent(atom) => atom.arguments.iter().all(|term| term_is_bound(term, bindings, inner)),
        Expression::Operation(_, operands, _) => {
            operands.iter().all(|operand| expression_is_bound(operand, bindings, inner))
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => true,
    }
}

fn term_is_bound(term: &Term, bindings: &Bindings<'_>, inner: &[&Name]) -> bool {
    match term {
        Term::Variable(identifier) => {
            inner.contains(&&identifier.name) || bindings.get(&identifier.name).is_some()
        }
        Term::Constant(_) => true,
    }
}
