//! Collects the numeric functions whose values an action needs, from its conditions and effects.

use pddl::ast::{
    Action, ActionBody, Assignment, Atom, Condition, Effect, Expression, Name, Term, TypeExpression,
};

pub(super) type Binding<'a> = Vec<(&'a Name, Name)>;

pub(super) fn constants(atom: &Atom) -> Vec<Name> {
    atom.arguments.iter().map(Term::name).cloned().collect()
}

pub(super) fn object<'a>(term: &'a Term, binding: &'a Binding<'_>) -> Option<&'a Name> {
    match term {
        Term::Constant(constant) => Some(&constant.name),
        Term::Variable(variable) => {
            binding.iter().find(|(name, _)| **name == variable.name).map(|(_, object)| object)
        }
    }
}

pub(super) fn bound_arguments(atom: &Atom, binding: &Binding<'_>) -> Option<Vec<Name>> {
    atom.arguments.iter().map(|term| object(term, binding).cloned()).collect()
}

pub(super) fn grounded(atom: &Atom, binding: &Binding<'_>) -> Vec<Name> {
    bound_arguments(atom, binding).unwrap_or_default()
}

/// Returns the distinct parameters of an action that an atom mentions, or `None` if the atom
/// mentions another variable.
pub(super) fn variables_of<'a>(
    atom: &Atom,
    action: &'a Action,
) -> Option<Vec<(&'a Name, &'a TypeExpression)>> {
    let mut variables: Vec<(&Name, &TypeExpression)> = Vec::new();
    for term in &atom.arguments {
        let Term::Variable(variable) = term else { continue };
        let parameter =
            action.parameters.iter().find(|parameter| parameter.identifier.name == variable.name)?;
        if !variables.iter().any(|(name, _)| **name == variable.name) {
            variables.push((&parameter.identifier.name, &parameter.r#type));
        }
    }
    Some(variables)
}

pub(super) fn conditions(body: &ActionBody) -> Vec<&Condition> {
    match body {
        ActionBody::Instantaneous { precondition, .. } => vec![precondition],
        ActionBody::Durative { conditions, .. } => {
            conditions.iter().map(|(_, condition)| condition).collect()
        }
    }
}

pub(super) fn effects(body: &ActionBody) -> Vec<&Effect> {
    match body {
        ActionBody::Instantaneous { effect, .. } => vec![effect],
        ActionBody::Durative { effects, .. } => effects.iter().map(|(_, effect)| effect).collect(),
    }
}

pub(super) fn walk<'a>(effect: &'a Effect, visit: &mut dyn FnMut(&'a Effect)) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| walk(part, visit)),
        Effect::ForAll(_, inner) | Effect::When(_, inner) => walk(inner, visit),
        other => visit(other),
    }
}

pub(super) fn grows(action: &Action, function: &Name) -> bool {
    let mut is_changed = false;
    for effect in effects(&action.body) {
        walk(effect, &mut |effect| {
            is_changed |= matches!(effect, Effect::Assign(kind, target, ..)
                if *kind != Assignment::Assign && target.predicate.name == *function);
        });
    }
    is_changed
}

/// Returns the functions whose values an action needs in every case: in its durations, its
/// conjunctive conditions and its unconditional effects.
pub(super) fn needed(action: &Action) -> Vec<&Atom> {
    let mut functions = Vec::new();
    if let ActionBody::Durative { duration, .. } = &action.body {
        for constraint in duration {
            in_expression(&constraint.expression, &mut functions);
        }
    }
    for condition in conditions(&action.body) {
        in_condition(condition, &mut functions);
    }
    for effect in effects(&action.body) {
        in_effect(effect, &mut functions);
    }
    functions
}

pub(super) fn in_condition<'a>(condition: &'a Condition, needed: &mut Vec<&'a Atom>) {
    match condition {
        Condition::And(parts) => parts.iter().for_each(|part| in_condition(part, needed)),
        Condition::Compare(_, left, right, _) => {
            in_expression(left, needed);
            in_expression(right, needed);
        }
        _ => {}
    }
}

pub(super) fn in_effect<'a>(effect: &'a Effect, needed: &mut Vec<&'a Atom>) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| in_effect(part, needed)),
        Effect::Assign(kind, target, expression, _) => {
            needed.extend(Some(target).filter(|_| *kind != Assignment::Assign));
            in_expression(expression, needed);
        }
        _ => {}
    }
}

pub(super) fn in_expression<'a>(expression: &'a Expression, needed: &mut Vec<&'a Atom>) {
    match expression {
        Expression::Fluent(atom) => needed.push(atom),
        Expression::Operation(_, parts, _) => parts.iter().for_each(|part| in_expression(part, needed)),
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
