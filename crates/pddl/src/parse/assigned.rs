//! No two values for one term: what an action has to ask of the state so that its assignments agree.

use rustc_hash::FxHashMap;

use crate::ast::{Atom, Condition, EffectTime, Expression, Identifier, Name, Term, TypedName};

use super::Parser;
use super::fluents::Assigned;

/// What variables are called instead.
type Renaming = FxHashMap<Name, Identifier>;

impl Parser<'_> {
    /// What has to hold so that no two assignments give different values to one term.
    pub(super) fn one_value_each(&mut self, assigned: &[Assigned]) -> Vec<(EffectTime, Condition)> {
        let mut needs = Vec::new();
        for (place, first) in assigned.iter().enumerate() {
            // Its variables must not capture those of another one.
            let first = &if first.variables.is_empty() { first.clone() } else { self.copy(first) };
            if !first.gives_one_value() {
                let second = self.copy(first);
                needs.extend(agree(first, &second).map(|need| (first.time, need)));
            }
            for second in &assigned[place..][1..] {
                if first.time == second.time && first.function.name == second.function.name {
                    let second = self.copy(second);
                    needs.extend(agree(first, &second).map(|need| (first.time, need)));
                }
            }
        }
        needs
    }

    /// The same assignment with variables of its own.
    fn copy(&mut self, assigned: &Assigned) -> Assigned {
        let mut renaming = Renaming::default();
        let mut renamed = |variables: &[TypedName]| -> Vec<TypedName> {
            let rename = |own: &TypedName| {
                let identifier = self.new_variable(own.identifier.span);
                renaming.insert(own.identifier.name.clone(), identifier.clone());
                TypedName { identifier, r#type: own.r#type.clone() }
            };
            variables.iter().map(rename).collect()
        };
        let (variables, values) = (renamed(&assigned.variables), renamed(&assigned.values));
        let mut copy = Assigned { variables, values, ..assigned.clone() };
        copy.arguments.iter_mut().chain(&mut copy.value).for_each(|own| term(own, &renaming));
        copy.conditions.iter_mut().for_each(|own| condition(own, &renaming));
        copy
    }
}

impl Assigned {
    /// Whether no two of its instances concern one term: each variable is an argument.
    fn gives_one_value(&self) -> bool {
        let is_argument = |variable: &TypedName| {
            self.arguments.iter().any(
                |term| matches!(term, Term::Variable(identifier) if identifier.name == variable.identifier.name),
            )
        };
        self.variables.iter().all(is_argument)
    }
}

/// That two assignments do not take place together, concern different terms, or give the same value; none if that is plain.
fn agree(first: &Assigned, second: &Assigned) -> Option<Condition> {
    let equal =
        |left: &Term, right: &Term| Condition::Equal(left.clone(), right.clone(), first.function.span);
    let mut premises: Vec<_> = first.conditions.iter().chain(&second.conditions).cloned().collect();
    for (left, right) in first.arguments.iter().zip(&second.arguments) {
        match same(left, right) {
            Some(true) => {}
            Some(false) => return None,
            None => premises.push(equal(left, right)),
        }
    }
    let conclusion = match (&first.value, &second.value) {
        (None, None) => return None,
        (Some(left), Some(right)) if same(left, right) == Some(true) => return None,
        (Some(left), Some(right)) => equal(left, right),
        _ => Condition::Or(Vec::new()),
    };
    let need = Condition::Imply(Box::new(Condition::And(premises)), Box::new(conclusion));
    let all = [&first.variables, &first.values, &second.variables, &second.values];
    let variables: Vec<_> = all.into_iter().flatten().cloned().collect();
    Some(if variables.is_empty() { need } else { Condition::ForAll(variables, Box::new(need)) })
}

/// Whether two terms are the same object, if that is known.
fn same(left: &Term, right: &Term) -> Option<bool> {
    match (left, right) {
        (Term::Constant(left), Term::Constant(right)) => Some(left.name == right.name),
        (Term::Variable(left), Term::Variable(right)) if left.name == right.name => Some(true),
        _ => None,
    }
}

fn term(own: &mut Term, renaming: &Renaming) {
    if let Term::Variable(identifier) = own
        && let Some(new) = renaming.get(&identifier.name)
    {
        *identifier = new.clone();
    }
}

fn atom(own: &mut Atom, renaming: &Renaming) {
    own.arguments.iter_mut().for_each(|argument| term(argument, renaming));
}

fn condition(own: &mut Condition, renaming: &Renaming) {
    match own {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                condition(part, renaming);
            }
        }
        Condition::Not(inner) => condition(inner, renaming),
        Condition::Imply(premise, conclusion) => {
            condition(premise, renaming);
            condition(conclusion, renaming);
        }
        Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
            let mut renaming = renaming.clone();
            for own in variables {
                renaming.remove(&own.identifier.name);
            }
            condition(body, &renaming);
        }
        Condition::Atom(own) => atom(own, renaming),
        Condition::Equal(left, right, _) => {
            term(left, renaming);
            term(right, renaming);
        }
        Condition::Compare(_, left, right, _) => {
            expression(left, renaming);
            expression(right, renaming);
        }
    }
}

fn expression(own: &mut Expression, renaming: &Renaming) {
    match own {
        Expression::Fluent(own) => atom(own, renaming),
        Expression::Operation(_, operands, _) => {
            for operand in operands {
                expression(operand, renaming);
            }
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
