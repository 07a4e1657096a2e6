//! Consistency of assignments to object fluents: conditions under which no object fluent receives two values.

use rustc_hash::FxHashMap;

use crate::ast::{Atom, Condition, EffectTime, Expression, Identifier, Name, Term, TypedName};

use super::Parser;
use super::fluents::Assigned;

type Renaming = FxHashMap<Name, Identifier>;

impl Parser<'_> {
    pub(super) fn uniqueness_conditions(&mut self, assigned: &[Assigned]) -> Vec<(EffectTime, Condition)> {
        let mut needs = Vec::new();
        for (position, first) in assigned.iter().enumerate() {
            // Renaming apart: the variables must not capture those of the second assignment.
            let first = &if first.variables.is_empty() { first.clone() } else { self.copy(first) };
            if !first.is_functional() {
                let second = self.copy(first);
                needs.extend(consistency(first, &second).map(|need| (first.time, need)));
            }
            for second in &assigned[position..][1..] {
                if first.time == second.time && first.function.name == second.function.name {
                    let second = self.copy(second);
                    needs.extend(consistency(first, &second).map(|need| (first.time, need)));
                }
            }
        }
        needs
    }

    fn copy(&mut self, assigned: &Assigned) -> Assigned {
        let mut renaming = Renaming::default();
        let mut renamed = |variables: &[TypedName]| -> Vec<TypedName> {
            let rename = |typed_name: &TypedName| {
                let identifier = self.new_variable(typed_name.identifier.span);
                renaming.insert(typed_name.identifier.name.clone(), identifier.clone());
                TypedName { identifier, r#type: typed_name.r#type.clone() }
            };
            variables.iter().map(rename).collect()
        };
        let (variables, values) = (renamed(&assigned.variables), renamed(&assigned.values));
        let mut copy = Assigned { variables, values, ..assigned.clone() };
        copy.arguments
            .iter_mut()
            .chain(&mut copy.value)
            .for_each(|argument| rename_term(argument, &renaming));
        copy.conditions.iter_mut().for_each(|condition| rename_condition(condition, &renaming));
        copy
    }
}

impl Assigned {
    /// Returns `true` if no two instances of the assignment set the same fluent, that is, if each variable of
    /// an enclosing quantifier is an argument.
    fn is_functional(&self) -> bool {
        let is_argument = |variable: &TypedName| {
            self.arguments.iter().any(
                |term| matches!(term, Term::Variable(identifier) if identifier.name == variable.identifier.name),
            )
        };
        self.variables.iter().all(is_argument)
    }
}

/// Returns the condition that two assignments do not take place together, set different fluents, or assign
/// the same value (or both `undefined`). `None` if the condition is trivially true.
fn consistency(first: &Assigned, second: &Assigned) -> Option<Condition> {
    let equal =
        |left: &Term, right: &Term| Condition::Equal(left.clone(), right.clone(), first.function.span);
    let mut premises: Vec<_> = first.conditions.iter().chain(&second.conditions).cloned().collect();
    for (left, right) in first.arguments.iter().zip(&second.arguments) {
        match known_equality(left, right) {
            Some(true) => {}
            Some(false) => return None,
            None => premises.push(equal(left, right)),
        }
    }
    let conclusion = match (&first.value, &second.value) {
        (None, None) => return None,
        (Some(left), Some(right)) if known_equality(left, right) == Some(true) => return None,
        (Some(left), Some(right)) => equal(left, right),
        _ => Condition::Or(Vec::new()),
    };
    let need = Condition::Imply(Box::new(Condition::And(premises)), Box::new(conclusion));
    let bound_variables = [&first.variables, &first.values, &second.variables, &second.values];
    let variables: Vec<_> = bound_variables.into_iter().flatten().cloned().collect();
    Some(if variables.is_empty() { need } else { Condition::ForAll(variables, Box::new(need)) })
}

fn known_equality(left: &Term, right: &Term) -> Option<bool> {
    match (left, right) {
        (Term::Constant(left), Term::Constant(right)) => Some(left.name == right.name),
        (Term::Variable(left), Term::Variable(right)) if left.name == right.name => Some(true),
        _ => None,
    }
}

fn rename_term(term: &mut Term, renaming: &Renaming) {
    if let Term::Variable(identifier) = term
        && let Some(new) = renaming.get(&identifier.name)
    {
        *identifier = new.clone();
    }
}

fn rename_atom(atom: &mut Atom, renaming: &Renaming) {
    atom.arguments.iter_mut().for_each(|argument| rename_term(argument, renaming));
}

fn rename_condition(target: &mut Condition, renaming: &Renaming) {
    match target {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                rename_condition(part, renaming);
            }
        }
        Condition::Not(inner) => rename_condition(inner, renaming),
        Condition::Imply(premise, conclusion) => {
            rename_condition(premise, renaming);
            rename_condition(conclusion, renaming);
        }
        Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
            let mut renaming = renaming.clone();
            for variable in variables {
                renaming.remove(&variable.identifier.name);
            }
            rename_condition(body, &renaming);
        }
        Condition::Atom(atom) => rename_atom(atom, renaming),
        Condition::Equal(left, right, _) => {
            rename_term(left, renaming);
            rename_term(right, renaming);
        }
        Condition::Compare(_, left, right, _) => {
            rename_expression(left, renaming);
            rename_expression(right, renaming);
        }
    }
}

fn rename_expression(target: &mut Expression, renaming: &Renaming) {
    match target {
        Expression::Fluent(atom) => rename_atom(atom, renaming),
        Expression::Operation(_, operands, _) => {
            for operand in operands {
                rename_expression(operand, renaming);
            }
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
