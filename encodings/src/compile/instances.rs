//! Objects by type, and conditions with objects for variables.

use pddl::TypeHierarchy;
use pddl::ast::{Atom, Condition, Domain, Expression, Name, Problem, Term, TypeExpression, TypedName};

use super::terms::identifier;

/// The objects of a task, each with the types of its declarations.
pub(super) struct Objects<'t> {
    types: TypeHierarchy,
    objects: Vec<(&'t Name, Vec<&'t TypeExpression>)>,
}

/// What stands for a variable, innermost last.
pub(super) type Binding = Vec<(Name, Term)>;

impl<'t> Objects<'t> {
    pub(super) fn of(domain: &'t Domain, problem: &'t Problem) -> Self {
        let mut objects: Vec<(&Name, Vec<&TypeExpression>)> = Vec::new();
        let mut places = rustc_hash::FxHashMap::default();
        for entry in domain.constants.iter().chain(&problem.objects) {
            let place = *places.entry(&entry.identifier.name).or_insert(objects.len());
            if place == objects.len() {
                objects.push((&entry.identifier.name, Vec::new()));
            }
            objects[place].1.push(&entry.r#type);
        }
        Self { types: TypeHierarchy::of(domain), objects }
    }

    /// The objects of a type.
    pub(super) fn members(&self, wanted: &TypeExpression) -> impl Iterator<Item = &'t Name> {
        let fits = |types: &[&TypeExpression]| types.iter().any(|given| self.types.fits(given, wanted));
        self.objects.iter().filter(move |(_, types)| fits(types)).map(|(name, _)| *name)
    }

    /// All ways to bind some variables, each added to a binding.
    pub(super) fn bindings(&self, variables: &[TypedName], binding: &Binding) -> Vec<Binding> {
        let mut all = vec![binding.clone()];
        for variable in variables {
            let members: Vec<&Name> = self.members(&variable.r#type).collect();
            let extended = all.iter().flat_map(|binding| {
                members.iter().map(|object| {
                    let mut longer = binding.clone();
                    longer.push((
                        variable.identifier.name.clone(),
                        Term::Constant(identifier(object.as_str())),
                    ));
                    longer
                })
            });
            all = extended.collect();
        }
        all
    }
}

/// A condition with objects for its variables. The variables of its own quantifiers get names that no action uses; `fresh` counts them.
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

fn atom_instance(atom: &Atom, binding: &Binding) -> Atom {
    let arguments = atom.arguments.iter().map(|argument| term(argument, binding)).collect();
    Atom { arguments, ..atom.clone() }
}

pub(super) fn term(written: &Term, binding: &Binding) -> Term {
    let Term::Variable(variable) = written else { return written.clone() };
    let bound = binding.iter().rev().find(|(name, _)| *name == variable.name);
    bound.map_or_else(|| written.clone(), |(_, term)| term.clone())
}

fn expression(written: &Expression, binding: &Binding) -> Expression {
    match written {
        Expression::Fluent(atom) => Expression::Fluent(atom_instance(atom, binding)),
        Expression::Operation(operation, operands, span) => {
            let operands = operands.iter().map(|operand| expression(operand, binding)).collect();
            Expression::Operation(*operation, operands, *span)
        }
        other => other.clone(),
    }
}
