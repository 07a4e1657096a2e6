//! Enumerates objects by type, and substitutes objects for the variables of conditions.

use crate::limits::Limits;
use pddl::TypeHierarchy;
use pddl::ast::{Atom, Condition, Domain, Expression, Name, Problem, Term, TypeExpression, TypedName};

use super::simplify::identifier;

pub(super) struct Objects<'t> {
    types: TypeHierarchy,
    all: Vec<(&'t Name, Vec<&'t TypeExpression>)>,
    limits: &'t Limits,
}

/// Terms assigned to variables. The innermost variable comes last and shadows earlier variables with an equal
/// name.
pub(super) type Binding = Vec<(Name, Term)>;

impl<'t> Objects<'t> {
    pub(super) fn of(domain: &'t Domain, problem: &'t Problem, limits: &'t Limits) -> Self {
        let mut objects: Vec<(&Name, Vec<&TypeExpression>)> = Vec::new();
        let mut places = rustc_hash::FxHashMap::default();
        for entry in domain.constants.iter().chain(&problem.objects) {
            let place = *places.entry(&entry.identifier.name).or_insert(objects.len());
            if place == objects.len() {
                objects.push((&entry.identifier.name, Vec::new()));
            }
            objects[place].1.push(&entry.r#type);
        }
        Self { types: TypeHierarchy::of(domain), all: objects, limits }
    }

    pub(super) fn members(&self, wanted: &TypeExpression) -> impl Iterator<Item = &'t Name> {
        let fits = |types: &[&TypeExpression]| types.iter().any(|given| self.types.fits(given, wanted));
        self.all.iter().filter(move |(_, types)| fits(types)).map(|(name, _)| *name)
    }

    /// Returns every extension of `binding` by objects for `variables`. The iterator stops early if a limit
    /// is reached, so callers must check the limits afterwards.
    pub(super) fn bindings(
        &self,
        variables: &[TypedName],
        binding: &Binding,
    ) -> impl Iterator<Item = Binding> + use<'t> {
        let names = variables.iter().map(|variable| variable.identifier.name.clone());
        let members = variables.iter().map(|variable| self.members(&variable.r#type).collect());
        let (names, members): (Vec<Name>, Vec<Vec<&'t Name>>) = (names.collect(), members.collect());
        let sizes: Vec<usize> = members.iter().map(Vec::len).collect();
        let first = sizes.iter().all(|size| *size > 0).then(|| vec![0; sizes.len()]);
        let positions = std::iter::successors(first, move |last| following(last, &sizes));
        let outer = binding.clone();
        self.limits.watch(positions).map_while(Result::ok).map(move |positions| {
            let objects = members.iter().zip(positions).map(|(objects, position)| objects[position]);
            let constants = objects.map(|object| Term::Constant(identifier(object.as_str())));
            outer.iter().cloned().chain(names.iter().cloned().zip(constants)).collect()
        })
    }
}

fn following(positions: &[usize], sizes: &[usize]) -> Option<Vec<usize>> {
    let mut next = positions.to_vec();
    for (position, size) in next.iter_mut().zip(sizes).rev() {
        *position = position.saturating_add(1);
        if *position < *size {
            return Some(next);
        }
        *position = 0;
    }
    None
}

/// Returns the condition with its free variables replaced by their terms in `binding`. Quantified variables
/// get new names that no action uses; `fresh` is the counter for these names.
#[expect(clippy::arithmetic_side_effects, reason = "as many bindings were pushed as are taken off")]
pub(super) fn instance(condition: &Condition, binding: &mut Binding, fresh: &mut u64) -> Condition {
    use Condition as C;
    match condition {
        C::And(parts) => C::And(parts.iter().map(|part| instance(part, binding, fresh)).collect()),
        C::Or(parts) => C::Or(parts.iter().map(|part| instance(part, binding, fresh)).collect()),
        C::Not(inner) => C::Not(Box::new(instance(inner, binding, fresh))),
        C::Imply(premise, conclusion) => {
            let premise = instance(premise, binding, fresh);
            C::Imply(Box::new(premise), Box::new(instance(conclusion, binding, fresh)))
        }
        C::Exists(variables, body) | C::ForAll(variables, body) => {
            let mut renamed = variables.clone();
            for variable in &mut renamed {
                let name = format!("{} {fresh}", variable.identifier.name);
                *fresh = fresh.saturating_add(1);
                let old = std::mem::replace(&mut variable.identifier, identifier(&name));
                binding.push((old.name, Term::Variable(variable.identifier.clone())));
            }
            let body = Box::new(instance(body, binding, fresh));
            binding.truncate(binding.len() - renamed.len());
            if matches!(condition, C::Exists(..)) {
                C::Exists(renamed, body)
            } else {
                C::ForAll(renamed, body)
            }
        }
        C::Atom(atom) => C::Atom(atom_instance(atom, binding)),
        C::Equal(left, right, span) => C::Equal(term(left, binding), term(right, binding), *span),
        C::Compare(operator, left, right, span) => {
            C::Compare(*operator, expression(left, binding), expression(right, binding), *span)
        }
    }
}

pub(super) fn atom_instance(atom: &Atom, binding: &Binding) -> Atom {
    let arguments = atom.arguments.iter().map(|argument| term(argument, binding)).collect();
    Atom { arguments, ..atom.clone() }
}

pub(super) fn term(written: &Term, binding: &Binding) -> Term {
    let Term::Variable(variable) = written else { return written.clone() };
    let bound = binding.iter().rev().find(|(name, _)| *name == variable.name);
    bound.map_or_else(|| written.clone(), |(_, term)| term.clone())
}

pub(super) fn expression(written: &Expression, binding: &Binding) -> Expression {
    match written {
        Expression::Fluent(atom) => Expression::Fluent(atom_instance(atom, binding)),
        Expression::Operation(operation, operands, span) => {
            let operands = operands.iter().map(|operand| expression(operand, binding)).collect();
            Expression::Operation(*operation, operands, *span)
        }
        other => other.clone(),
    }
}
