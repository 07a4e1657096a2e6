//! Converts conditions, effects and expressions to printable lists.

use num_rational::BigRational;

use crate::ast::{
    Arithmetic, Assignment, Atom, Condition, ConditionTime, DurationConstraint, Effect, EffectTime,
    Expression, Term, TypeExpression, TypedName,
};
use crate::number::to_decimal;

use super::layout::{Doc, list, text};

pub(super) fn term(term: &Term) -> Doc {
    match term {
        Term::Variable(identifier) => text(format!("?{}", identifier.name)),
        Term::Constant(identifier) => text(identifier.name.as_str()),
    }
}

pub(super) fn atom(atom: &Atom) -> Doc {
    list(atom.predicate.name.as_str(), 1, atom.arguments.iter().map(term))
}

pub(super) fn number(value: &BigRational) -> Doc {
    match to_decimal(value) {
        Some(decimal) => text(decimal),
        None => text(format!("(/ {} {})", value.numer(), value.denom())),
    }
}

pub(super) fn expression(value: &Expression) -> Doc {
    match value {
        Expression::Number(value, _) => number(value),
        Expression::Fluent(fluent) => atom(fluent),
        Expression::Duration(_) => text("?duration"),
        Expression::TotalTime(_) => text("(total-time)"),
        Expression::Operation(operation, operands, _) => {
            let symbol = match operation {
                Arithmetic::Add => "+",
                Arithmetic::Subtract => "-",
                Arithmetic::Multiply => "*",
                Arithmetic::Divide => "/",
            };
            list(symbol, 1, operands.iter().map(expression))
        }
    }
}

pub(super) fn variables(entries: &[TypedName]) -> Doc {
    text(format!("({})", typed("?", entries).join(" ")))
}

pub(super) fn condition(tree: &Condition) -> Doc {
    match tree {
        Condition::And(parts) => list("and", 1, parts.iter().map(condition)),
        Condition::Or(parts) => list("or", 1, parts.iter().map(condition)),
        Condition::Not(inner) => list("not", 1, [condition(inner)]),
        Condition::Imply(premise, conclusion) => {
            list("imply", 1, [condition(premise), condition(conclusion)])
        }
        Condition::Exists(entries, body) => list("exists", 2, [variables(entries), condition(body)]),
        Condition::ForAll(entries, body) => list("forall", 2, [variables(entries), condition(body)]),
        Condition::Atom(fact) => atom(fact),
        Condition::Equal(left, right, _) => list("=", 1, [term(left), term(right)]),
        Condition::Compare(operator, left, right, _) => {
            list(operator.symbol(), 1, [expression(left), expression(right)])
        }
    }
}

pub(super) fn effect(tree: &Effect) -> Doc {
    match tree {
        Effect::And(parts) => list("and", 1, parts.iter().map(effect)),
        Effect::Add(fact) => atom(fact),
        Effect::Delete(fact) => list("not", 1, [atom(fact)]),
        Effect::ForAll(entries, body) => list("forall", 2, [variables(entries), effect(body)]),
        Effect::When(premise, body) => list("when", 1, [condition(premise), effect(body)]),
        Effect::Assign(kind, target, value, _) => {
            let head = match kind {
                Assignment::Assign => "assign",
                Assignment::Increase => "increase",
                Assignment::Decrease => "decrease",
                Assignment::ScaleUp => "scale-up",
                Assignment::ScaleDown => "scale-down",
            };
            list(head, 1, [atom(target), expression(value)])
        }
    }
}

pub(super) fn timed_condition((time, tree): &(ConditionTime, Condition)) -> Doc {
    let (head, when) = match time {
        ConditionTime::AtStart => ("at", "start"),
        ConditionTime::OverAll => ("over", "all"),
        ConditionTime::AtEnd => ("at", "end"),
    };
    list(head, 2, [text(when), condition(tree)])
}

pub(super) fn timed_effect((time, tree): &(EffectTime, Effect)) -> Doc {
    list("at", 2, [text(when(*time)), effect(tree)])
}

fn when(time: EffectTime) -> &'static str {
    match time {
        EffectTime::AtStart => "start",
        EffectTime::AtEnd => "end",
    }
}

pub(super) fn duration(constraints: &[DurationConstraint]) -> Doc {
    let constraint = |constraint: &DurationConstraint| {
        let bound = [text("?duration"), expression(&constraint.expression)];
        let bound = list(constraint.operator.symbol(), 1, bound);
        match constraint.time {
            EffectTime::AtStart => bound,
            EffectTime::AtEnd => list("at", 2, [text(when(EffectTime::AtEnd)), bound]),
        }
    };
    match constraints {
        [] => text("()"),
        [single] => constraint(single),
        constraints => list("and", 1, constraints.iter().map(constraint)),
    }
}

/// Formats a typed list: one text for each group of successive names of equal type, each name with `prefix`.
/// The type `object` may be omitted only at the end, because a type applies to all preceding untyped names.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
pub(super) fn typed(prefix: &str, entries: &[TypedName]) -> Vec<String> {
    let bare_from =
        entries.iter().rposition(|entry| !entry.r#type.alternatives.is_empty()).map_or(0, |last| last + 1);
    let group_of = |entry: &TypedName| type_text(&entry.r#type);
    let (typed, bare) = entries.split_at(bare_from);
    let names = |group: &[TypedName]| -> String {
        let names: Vec<_> = group.iter().map(|entry| format!("{prefix}{}", entry.identifier.name)).collect();
        names.join(" ")
    };
    // Grouping keeps long object lists short.
    let groups = typed.chunk_by(|left, right| group_of(left) == group_of(right));
    let mut lines: Vec<_> =
        groups.map(|group| format!("{} - {}", names(group), group_of(&group[0]))).collect();
    if !bare.is_empty() {
        lines.push(names(bare));
    }
    lines
}

pub(crate) fn type_text(r#type: &TypeExpression) -> String {
    let names: Vec<_> = r#type.alternatives.iter().map(|name| name.name.as_str()).collect();
    match names.as_slice() {
        [] => "object".to_owned(),
        [single] => (*single).to_owned(),
        alternatives => format!("(either {})", alternatives.join(" ")),
    }
}
