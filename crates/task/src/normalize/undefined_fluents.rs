//! Numeric functions without an initial value, which are undefined until an action assigns a value. An action is
//! inapplicable if an effect that occurs reads an undefined function.
//!
//! If a task has such functions, numeric fluents get a guard predicate, which is true where the function has a value
//! (for exceptions, see `guard`). A comparison becomes the conjunction of itself and the guards of its functions. For
//! example, `(> (level) 3)` becomes "`(level)` has a value, and `(> (level) 3)`". A formula in negation normal form is
//! then true exactly if it is true in Kleene's three-valued logic. An effect adds a condition to its action: the
//! condition of the effect must be defined, and if it is true, all functions that the effect reads must have values.
//! This is the definition that the validator in `pddl` uses.

use rustc_hash::FxHashMap;

use crate::lifted::{
    Bound, Change, Effect, Expression, Formula, FunctionId, Lifted, Predicate, PredicateId, Schema, Term,
};
use crate::number::dense;
use pddl::ast::{Assignment, Name};

type Guards = FxHashMap<FunctionId, PredicateId>;

/// Adds guards (predicates that are true where the function has a value) to all functions that actions change, except
/// `total-cost` and those that a metric reads.
pub fn guard(lifted: &mut Lifted) {
    let guards = declare(lifted);
    for schema in &mut lifted.schemas {
        guard_schema(schema, &guards);
    }
    for axiom in &mut lifted.axioms {
        axiom.condition = guarded(&axiom.condition, &guards);
    }
    lifted.goal = guarded(&lifted.goal, &guards);
    super::fluents::mark_fluents(lifted);
}

fn declare(lifted: &mut Lifted) -> Guards {
    let mut measured = Vec::new();
    for metric in &lifted.metrics {
        functions(&metric.expression, &mut |function, _| measured.push(function));
    }
    let mut arities: FxHashMap<FunctionId, usize> = FxHashMap::default();
    for schema in &lifted.schemas {
        for effect in schema.start_effects.iter().chain(&schema.end_effects) {
            if let Change::Assign { function, terms, .. } = &effect.change {
                arities.insert(*function, terms.len());
            }
        }
    }
    let mut guards = Guards::default();
    for (id, function) in (0..).map(FunctionId).zip(&mut lifted.functions) {
        let Some(arity) = arities.get(&id).copied() else { continue };
        if measured.contains(&id) || function.name == Name::new("total-cost") {
            continue;
        }
        function.partial = true;
        guards.insert(id, PredicateId(dense(lifted.predicates.len())));
        let name = Name::new(&format!("{} has a value", function.name));
        lifted.predicates.push(Predicate { name, arity, fluent: false, derived: false, running: false });
    }
    for (function, arguments, _) in &lifted.values {
        if let Some(guard) = guards.get(function) {
            lifted.facts.push((*guard, arguments.clone()));
        }
    }
    guards
}

fn guard_schema(schema: &mut Schema, guards: &Guards) {
    let mut at_start = needs_of_all(&schema.start_effects, guards);
    if let Some(duration) = &schema.duration {
        at_start.extend(values_of(duration, guards));
    }
    let at_end = needs_of_all(&schema.end_effects, guards);
    let parts =
        [&mut schema.start_condition, &mut schema.middle_condition, &mut schema.over_all, &mut schema.at_end];
    for part in parts {
        *part = guarded(part, guards);
    }
    if schema.duration.is_some() {
        add(&mut schema.middle_condition, at_end.clone());
        add(&mut schema.at_end, at_end);
    } else {
        at_start.extend(at_end);
    }
    add(&mut schema.start_condition, at_start);
    for effects in [&mut schema.start_effects, &mut schema.end_effects] {
        let guard_effects: Vec<Effect> =
            effects.iter().filter_map(|effect| gives_value(effect, guards)).collect();
        for effect in effects.iter_mut() {
            effect.condition = guarded(&effect.condition, guards);
        }
        effects.extend(guard_effects);
    }
}

fn add(condition: &mut Formula, more: Vec<Formula>) {
    if !more.is_empty() {
        let original = std::mem::replace(condition, Formula::truth());
        *condition = Formula::And(std::iter::once(original).chain(more).collect());
    }
}

fn gives_value(effect: &Effect, guards: &Guards) -> Option<Effect> {
    let Change::Assign { assignment: Assignment::Assign, function, terms, .. } = &effect.change else {
        return None;
    };
    let change = Change::Add(*guards.get(function)?, terms.clone());
    Some(Effect { bound: effect.bound.clone(), condition: guarded(&effect.condition, guards), change })
}

fn needs_of_all(effects: &[Effect], guards: &Guards) -> Vec<Formula> {
    effects.iter().filter_map(|effect| needs(effect, guards)).collect()
}

/// Returns the condition that the effect's condition is defined and, if it is true, every value that the effect reads
/// is defined. Returns `None` if there is nothing to check.
fn needs(effect: &Effect, guards: &Guards) -> Option<Formula> {
    let mut values = Vec::new();
    if let Change::Assign { assignment, function, terms, expression, .. } = &effect.change {
        values.extend(values_of(expression, guards));
        if *assignment != Assignment::Assign {
            values.extend(has_value(*function, terms, guards));
        }
    }
    let fails = guarded(&effect.condition.negated(), guards);
    let mut parts = Vec::new();
    if compares(&effect.condition) {
        parts.push(Formula::Or(vec![guarded(&effect.condition, guards), fails.clone()]));
    }
    if !values.is_empty() {
        let is_certain = matches!(&effect.condition, Formula::And(parts) if parts.is_empty());
        let values = Formula::And(values);
        parts.push(if is_certain { values } else { Formula::Or(vec![fails, values]) });
    }
    let whole = Formula::And(parts);
    match &whole {
        Formula::And(parts) if parts.is_empty() => None,
        _ => Some(for_all(&effect.bound, whole)),
    }
}

fn for_all(bound: &[Bound], body: Formula) -> Formula {
    if bound.is_empty() { body } else { Formula::ForAll(bound.to_vec(), Box::new(body)) }
}

fn compares(formula: &Formula) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(compares),
        Formula::Exists(_, body) | Formula::ForAll(_, body) => compares(body),
        Formula::Literal { .. } | Formula::Equal { .. } => false,
        Formula::Compare(..) => true,
    }
}

fn guarded(formula: &Formula, guards: &Guards) -> Formula {
    let each = |parts: &[Formula]| parts.iter().map(|part| guarded(part, guards)).collect();
    match formula {
        Formula::And(parts) => Formula::And(each(parts)),
        Formula::Or(parts) => Formula::Or(each(parts)),
        Formula::Exists(bound, body) => Formula::Exists(bound.clone(), Box::new(guarded(body, guards))),
        Formula::ForAll(bound, body) => Formula::ForAll(bound.clone(), Box::new(guarded(body, guards))),
        Formula::Literal { .. } | Formula::Equal { .. } => formula.clone(),
        Formula::Compare(_, left, right, _) => {
            let values = values_of(left, guards).into_iter().chain(values_of(right, guards));
            Formula::And(values.chain([formula.clone()]).collect())
        }
    }
}

fn values_of(expression: &Expression, guards: &Guards) -> Vec<Formula> {
    let mut conditions = Vec::new();
    functions(expression, &mut |function, terms| conditions.extend(has_value(function, terms, guards)));
    conditions
}

fn has_value(function: FunctionId, terms: &[Term], guards: &Guards) -> Option<Formula> {
    let predicate = *guards.get(&function)?;
    Some(Formula::Literal { positive: true, predicate, terms: terms.to_vec() })
}

fn functions(expression: &Expression, found: &mut dyn FnMut(FunctionId, &[Term])) {
    match expression {
        Expression::Number(_) | Expression::TotalTime => {}
        Expression::Function(function, terms, _) => found(*function, terms),
        Expression::Sum(parts) | Expression::Product(parts, _) => {
            for part in parts {
                functions(part, found);
            }
        }
        Expression::Negate(inner) => functions(inner, found),
        Expression::Quotient(left, right, _) => {
            functions(left, found);
            functions(right, found);
        }
    }
}
