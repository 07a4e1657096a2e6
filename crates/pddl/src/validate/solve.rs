//! Enumerates all bindings that satisfy a condition: a conjunctive query over the facts of a state.
//!
//! Facts propose the objects of unbound variables, so that existential quantifiers over many variables do not
//! enumerate all combinations. The depth-first search has an explicit stack, because a quantifier may bind more
//! variables than the call stack has frames.

use crate::ast::{Atom, Condition, Expression, Name, Term, TypedName};

use super::evaluate::{Bindings, Evaluator, Undefined};
use super::world::{Arguments, Symbol};

/// Callback for each solution. The callback also receives the reason if the truth of the condition is undefined.
/// Returns `false` to end the search.
pub(super) type OnSolution<'f, 'p> = &'f mut dyn FnMut(&Bindings<'p>, Option<&Undefined>) -> bool;

/// Conditions that remain to be solved, and the reason if an evaluated condition was undefined.
type Goals<'p> = (Vec<&'p Condition>, Option<Undefined>);

struct Branch<'e, 'p> {
    open: Vec<&'p Condition>,
    undefined: Option<Undefined>,
    declared: usize,
    options: Choices<'e, 'p>,
    bound: Vec<usize>,
}

enum Choices<'e, 'p> {
    Objects(usize, Box<dyn Iterator<Item = Symbol> + 'e>),
    Facts(&'p Atom, Box<dyn Iterator<Item = &'e Arguments> + 'e>),
    Alternatives(std::slice::Iter<'p, Condition>),
}

impl Branch<'_, '_> {
    fn undo(&mut self, bindings: &mut Bindings<'_>) {
        for position in self.bound.drain(..) {
            bindings.0[position].object = None;
        }
        bindings.0.truncate(self.declared);
    }
}

impl<'e, 'p> Evaluator<'e, 'p> {
    /// Calls `on_solution` for each binding of the unbound variables from position `first` on for which no
    /// condition in `parts` is false. With disjunctions, a binding can occur several times. Returns `false`
    /// if the search ended early, because `on_solution` returned `false` or the budget is spent.
    pub(super) fn solve(
        &self,
        parts: Vec<&'p Condition>,
        first: usize,
        bindings: &mut Bindings<'p>,
        on_solution: OnSolution<'_, 'p>,
    ) -> bool {
        let outer = bindings.0.len();
        let mut stack: Vec<Branch<'e, 'p>> = Vec::new();
        let mut goals = Some((parts, None));
        let completed = loop {
            if let Some(goals) = goals.take()
                && let Some((open, undefined)) = self.settle(goals, bindings)
            {
                match self.choice(open, first, bindings) {
                    Some((open, options)) => {
                        let declared = bindings.0.len();
                        stack.push(Branch { open, undefined, declared, options, bound: Vec::new() });
                    }
                    None if on_solution(bindings, undefined.as_ref()) => {}
                    None => break false,
                }
            }
            if self.world.budget.is_spent() {
                break false;
            }
            let Some(branch) = stack.last_mut() else { break true };
            goals = self.next(branch, bindings);
            if goals.is_none() {
                stack.pop();
            }
        };
        // After an early end, the bindings of the open branches must be undone.
        while let Some(mut branch) = stack.pop() {
            branch.undo(bindings);
        }
        bindings.0.truncate(outer);
        completed
    }

    pub(super) fn declare(&self, variables: &'p [TypedName], bindings: &mut Bindings<'p>) {
        let first = bindings.0.len();
        bindings.declare(variables);
        for binding in &mut bindings.0[first..] {
            binding.object = self.world.only_object(binding.r#type);
        }
    }

    /// Evaluates the conditions whose variables are all bound and opens existential quantifiers. Returns the
    /// remaining conditions, or `None` if a condition is false or the budget is spent.
    fn settle(&self, (mut todo, mut undefined): Goals<'p>, bindings: &mut Bindings<'p>) -> Option<Goals<'p>> {
        let mut unsolved = Vec::new();
        while let Some(condition) = todo.pop() {
            match condition {
                Condition::And(inner) => todo.extend(inner),
                // A quantifier whose variables shadow no other ones is opened: its body joins the
                // conjunction.
                Condition::Exists(variables, body)
                    if variables.iter().all(|entry| bindings.position(&entry.identifier.name).is_none()) =>
                {
                    self.declare(variables, bindings);
                    todo.push(body);
                }
                _ if self.ignored.is_some_and(|ignored| ignored.contains(&std::ptr::from_ref(condition))) => {
                }
                _ if is_bound(condition, bindings) => match self.holds(condition, bindings) {
                    Ok(true) => {}
                    Ok(false) => return None,
                    Err(reason) => undefined = undefined.or(Some(reason)),
                },
                _ => unsolved.push(condition),
            }
            if self.world.budget.is_spent() {
                return None;
            }
        }
        Some((unsolved, undefined))
    }

    /// Chooses what to branch on. The order of preference is: an equation that determines an
    /// object, the atom with the fewest facts, a disjunction, the first unbound variable. Returns
    /// the remaining conditions and the options, or `None` if all variables are bound.
    fn choice(
        &self,
        mut open: Vec<&'p Condition>,
        first: usize,
        bindings: &Bindings<'p>,
    ) -> Option<(Vec<&'p Condition>, Choices<'e, 'p>)> {
        let world = self.world;
        // An equation with one bound side leaves a single object.
        if let Some((position, object)) = open.iter().find_map(|part| self.forced(part, bindings)) {
            let r#type = bindings.0[position].r#type;
            let object = std::iter::once(object).filter(move |object| world.is_a(*object, r#type));
            return Some((open, Choices::Objects(position, Box::new(object))));
        }
        let atoms = open.iter().enumerate().filter_map(|(index, part)| match part {
            Condition::Atom(atom) => Some((self.row_count(atom, bindings), index, atom)),
            _ => None,
        });
        // Fewest facts first keeps the search tree small. Ties are broken by position, for determinism.
        if let Some((_, index, atom)) = atoms.min_by_key(|(count, index, _)| (*count, *index)) {
            let atom: &'p Atom = atom;
            open.swap_remove(index);
            if let Some(trace) = self.trace {
                // A later fact of this predicate could be a further solution.
                trace.read(&atom.predicate.name, world.symbol(&atom.predicate.name));
            }
            let rows = self.rows(atom, bindings);
            return Some((open, Choices::Facts(atom, rows)));
        }
        if let Some(index) = open.iter().position(|part| matches!(part, Condition::Or(_)))
            && let Condition::Or(alternatives) = open.swap_remove(index)
        {
            return Some((open, Choices::Alternatives(alternatives.iter())));
        }
        // No fact restricts the remaining variables: enumerate the objects of their types.
        let position = (first..bindings.0.len()).find(|position| bindings.0[*position].object.is_none())?;
        Some((open, Choices::Objects(position, world.objects_of(bindings.0[position].r#type))))
    }

    /// Tries the next option of a branching point. Returns the conditions to solve next, or `None` after the
    /// last option or if the budget is spent.
    fn next(&self, branch: &mut Branch<'e, 'p>, bindings: &mut Bindings<'p>) -> Option<Goals<'p>> {
        branch.undo(bindings);
        let mut conditions = branch.open.clone();
        match &mut branch.options {
            Choices::Objects(position, objects) => {
                bindings.0[*position].object = Some(objects.next()?);
                branch.bound.push(*position);
            }
            Choices::Facts(atom, facts) => {
                while !self.unify(atom, facts.next()?, bindings, &mut branch.bound) {
                    for position in branch.bound.drain(..) {
                        bindings.0[position].object = None;
                    }
                    if self.world.budget.is_spent() {
                        return None;
                    }
                }
            }
            Choices::Alternatives(alternatives) => conditions.push(alternatives.next()?),
        }
        Some((conditions, branch.undefined.clone()))
    }

    fn row_count(&self, atom: &Atom, bindings: &Bindings<'p>) -> usize {
        let unindexed = || self.state.count(self.world.symbol(&atom.predicate.name));
        self.indexed_rows(atom, bindings).map_or_else(unindexed, <[Arguments]>::len)
    }

    /// Facts that an atom may match. If no plan can change the predicate and an argument is bound, only facts
    /// that agree with the atom in one bound argument are returned.
    fn rows(&self, atom: &Atom, bindings: &Bindings<'p>) -> Box<dyn Iterator<Item = &'e Arguments> + 'e> {
        match self.indexed_rows(atom, bindings) {
            Some(rows) => Box::new(rows.iter()),
            None => Box::new(self.state.tuples(self.world.symbol(&atom.predicate.name))),
        }
    }

    /// Facts that agree with the atom in one bound argument; the argument with the fewest facts is chosen.
    /// `None` if no argument is bound or if a plan can change the predicate.
    fn indexed_rows(&self, atom: &Atom, bindings: &Bindings<'p>) -> Option<&'e [Arguments]> {
        let predicate = self.world.symbol(&atom.predicate.name);
        let columns = atom.arguments.iter().enumerate();
        let columns = columns.filter_map(|(column, term)| Some((column, self.term(term, bindings)?)));
        let rows = columns.filter_map(|(column, object)| self.world.fixed_rows(predicate, column, object));
        rows.min_by_key(|rows| rows.len())
    }

    /// Returns the position of the unbound variable in an equation with one unbound side, and the object that
    /// it must have.
    fn forced(&self, part: &Condition, bindings: &Bindings<'p>) -> Option<(usize, Symbol)> {
        let Condition::Equal(left, right, _) = part else { return None };
        let unbound = |term: &Term| match term {
            Term::Variable(identifier) => {
                bindings.position(&identifier.name).filter(|position| bindings.0[*position].object.is_none())
            }
            Term::Constant(_) => None,
        };
        match (unbound(left), unbound(right)) {
            (Some(position), None) => Some((position, self.term(right, bindings)?)),
            (None, Some(position)) => Some((position, self.term(left, bindings)?)),
            _ => None,
        }
    }

    /// Unifies an atom with a fact. Appends the positions of newly bound variables to `bound`. Returns
    /// `false` on a mismatch, without undoing the bindings made before it.
    pub(super) fn unify(
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
            if let Some(value) = self.term(term, bindings) {
                if value != *object {
                    return false;
                }
                continue;
            }
            let Term::Variable(identifier) = term else { return false };
            let Some(position) = bindings.position(&identifier.name) else { return false };
            if !self.world.is_a(*object, bindings.0[position].r#type) {
                return false;
            }
            bindings.0[position].object = Some(*object);
            bound.push(position);
        }
        true
    }
}

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
