//! Separable design parameters: parameters of action schemas that are function designs and need not be grounded. Also
//! contains general queries on conditions and expressions, e.g. for their terms.
//!
//! In the explicit form (Metaplan paper, Listings 1 and 2), a schema has parameters `?fd` with a condition
//! `(fd_solve_f ?fd ?f)`. Such a parameter is *separable* and becomes a slot under three conditions. No fluent has it
//! as an argument. It does not occur in conditions of effects, in conditions that mix static atoms and fluents, or in
//! products and quotients with fluents. No start effect changes a number by it if a disjunction over all or at the
//! end, or the condition of an end effect, compares this number. The number of designs then does not multiply the
//! number of ground operators.

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::lifted::task::{Change, Expression, Formula, FunctionId, Lifted, PredicateId, Schema, Term};
use crate::number::dense;
use crate::task::quantity::SlotSet;
use pddl::ast::Name;

/// A design parameter of an action schema, with the function that the design solves.
#[derive(Debug, Clone, Copy)]
pub struct SlotParameter {
    pub(crate) parameter: u32,
    pub(crate) function: Term,
}

/// Returns the design parameters of a schema, in ascending order, each with its function. They occur in conjuncts
/// `(p DESIGN FUNCTION)` of the conditions at the start, over all and at the end, for the predicates p in `solves`. The
/// conjuncts are read in order; a conjunct is ignored if its design already has a role (design or function), or if its
/// function is already a design.
pub fn design_parameters(lifted: &Lifted, schema: &Schema, solves: &[Name]) -> Vec<SlotParameter> {
    let conjuncts = conjuncts(&schema.start_condition).into_iter().chain(conjuncts(&schema.middle_condition));
    let mut designs: Vec<SlotParameter> = Vec::new();
    for conjunct in conjuncts {
        if let Formula::Literal { positive: true, predicate, terms } = conjunct
            && solves.contains(&lifted.predicates[predicate.index()].name)
            && let [Term::Parameter(parameter), function] = terms[..]
            && function != Term::Parameter(parameter)
            && designs.iter().all(|slot| {
                // The function of a slot must be an object of the instance, so it must not be a design parameter.
                slot.parameter != parameter
                    && Term::Parameter(slot.parameter) != function
                    && slot.function != Term::Parameter(parameter)
            })
        {
            designs.push(SlotParameter { parameter, function });
        }
    }
    designs.sort_by_key(|slot| slot.parameter);
    designs
}

/// Returns the design parameters that are separable and become slots (see the head of this file).
pub fn slot_parameters(lifted: &Lifted, schema: &Schema, designs: &[SlotParameter]) -> Vec<SlotParameter> {
    designs.iter().filter(|design| is_separable(lifted, schema, design.parameter)).copied().collect()
}

/// Returns the conjuncts of a condition, with nested conjunctions flattened.
pub fn conjuncts(formula: &Formula) -> Vec<&Formula> {
    match formula {
        Formula::And(parts) => parts.iter().flat_map(conjuncts).collect(),
        other => vec![other],
    }
}

fn is_separable(lifted: &Lifted, schema: &Schema, parameter: u32) -> bool {
    let conditions =
        conjuncts(&schema.start_condition).into_iter().chain(conjuncts(&schema.middle_condition));
    let effects = schema.start_effects.iter().chain(&schema.end_effects);
    let is = |term: &Term| *term == Term::Parameter(parameter);
    conditions.into_iter().all(|conjunct| match conjunct {
        Formula::Compare(_, left, right, _) => {
            expression_separable(lifted, left, parameter) && expression_separable(lifted, right, parameter)
        }
        other => !mentions(other, parameter) || is_static(lifted, other),
    }) && effects.into_iter().all(|effect| {
        !mentions(&effect.condition, parameter)
            && match &effect.change {
                Change::Add(_, terms) | Change::Delete(_, terms) => !terms.iter().any(is),
                Change::Assign { terms, expression, .. } => {
                    !terms.iter().any(is) && expression_separable(lifted, expression, parameter)
                }
            }
    }) && schema.duration.as_ref().is_none_or(|duration| expression_separable(lifted, duration, parameter))
        && !may_enter_axiom(schema, parameter)
}

/// Returns `true` if the parameter may reach the body of an axiom, which has no slots. Over the state before the start,
/// a comparison contains the values that start effects add to the compared number. A comparison in a disjunction of the
/// middle, or in the condition of an end effect, may become a part of an axiom.
fn may_enter_axiom(schema: &Schema, parameter: u32) -> bool {
    schema.start_effects.iter().any(|effect| match &effect.change {
        Change::Assign { function, expression, .. } => {
            expression_mentions(expression, parameter)
                && (compares_in_disjunction(&schema.middle_condition, *function)
                    || schema.end_effects.iter().any(|end| compares(&end.condition, *function)))
        }
        Change::Add(..) | Change::Delete(..) => false,
    })
}

fn compares_in_disjunction(formula: &Formula, function: FunctionId) -> bool {
    match formula {
        Formula::And(parts) => parts.iter().any(|part| compares_in_disjunction(part, function)),
        Formula::ForAll(_, body) => compares_in_disjunction(body, function),
        Formula::Or(_) | Formula::Exists(..) => compares(formula, function),
        Formula::Literal { .. } | Formula::Equal { .. } | Formula::Compare(..) => false,
    }
}

fn compares(formula: &Formula, function: FunctionId) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(|part| compares(part, function)),
        Formula::Exists(_, body) | Formula::ForAll(_, body) => compares(body, function),
        Formula::Compare(_, left, right, _) => reads(left, function) || reads(right, function),
        Formula::Literal { .. } | Formula::Equal { .. } => false,
    }
}

fn reads(expression: &Expression, function: FunctionId) -> bool {
    match expression {
        Expression::Number(_) | Expression::TotalTime => false,
        Expression::Function(own, ..) => *own == function,
        Expression::Negate(inner) => reads(inner, function),
        Expression::Sum(parts) | Expression::Product(parts, _) => {
            parts.iter().any(|part| reads(part, function))
        }
        Expression::Quotient(left, right, _) => reads(left, function) || reads(right, function),
    }
}

/// Returns `true` if the parameter occurs only as an argument of static functions, and in no product or quotient that
/// contains a fluent.
fn expression_separable(lifted: &Lifted, expression: &Expression, parameter: u32) -> bool {
    match expression {
        Expression::Sum(parts) => parts.iter().all(|part| expression_separable(lifted, part, parameter)),
        Expression::Negate(inner) => expression_separable(lifted, inner, parameter),
        other => !expression_mentions(other, parameter) || is_static_expression(lifted, other),
    }
}

/// Returns `true` if a condition contains no fluent predicates and no fluent functions.
pub fn is_static(lifted: &Lifted, formula: &Formula) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().all(|part| is_static(lifted, part)),
        Formula::Exists(_, body) | Formula::ForAll(_, body) => is_static(lifted, body),
        Formula::Literal { predicate, .. } => !lifted.predicates[predicate.index()].fluent,
        Formula::Equal { .. } => true,
        Formula::Compare(_, left, right, _) => {
            is_static_expression(lifted, left) && is_static_expression(lifted, right)
        }
    }
}

fn is_static_expression(lifted: &Lifted, expression: &Expression) -> bool {
    match expression {
        Expression::Number(_) | Expression::TotalTime => true,
        Expression::Function(function, _, _) => !lifted.functions[function.index()].fluent,
        Expression::Negate(inner) => is_static_expression(lifted, inner),
        Expression::Sum(parts) | Expression::Product(parts, _) => {
            parts.iter().all(|part| is_static_expression(lifted, part))
        }
        Expression::Quotient(left, right, _) => {
            is_static_expression(lifted, left) && is_static_expression(lifted, right)
        }
    }
}

fn mentions(formula: &Formula, parameter: u32) -> bool {
    let mut is_mentioned = false;
    formula_terms(formula, &mut |term| is_mentioned |= term == Term::Parameter(parameter));
    is_mentioned
}

fn expression_mentions(expression: &Expression, parameter: u32) -> bool {
    let mut is_mentioned = false;
    expression_terms(expression, &mut |term| is_mentioned |= term == Term::Parameter(parameter));
    is_mentioned
}

/// Returns the positions in `slots` of all slot parameters that occur in a condition.
pub fn slots_of_formula(formula: &Formula, slots: &[SlotParameter]) -> SlotSet {
    let mut set = SmallVec::new();
    formula_terms(formula, &mut |term| insert(&mut set, term, slots));
    set
}

/// Returns the positions in `slots` of all slot parameters that occur in an expression.
pub fn slots_of_expression(expression: &Expression, slots: &[SlotParameter]) -> SlotSet {
    let mut set = SmallVec::new();
    expression_terms(expression, &mut |term| insert(&mut set, term, slots));
    set
}

fn insert(set: &mut SlotSet, term: Term, slots: &[SlotParameter]) {
    if let Term::Parameter(parameter) = term
        && let Some(position) = slots.iter().position(|slot| slot.parameter == parameter)
        && let Err(place) = set.binary_search(&dense(position))
    {
        set.insert(place, dense(position));
    }
}

/// Returns `true` if start effects of the action or timed events may change a derived predicate that the action reads
/// later: in an over-all or at-end condition, or in the condition of an end effect.
pub fn depends_on_own_start(lifted: &Lifted, schema: &Schema) -> bool {
    let (mut open, mut seen, mut numbers) = (Vec::new(), FxHashSet::default(), false);
    let conditions =
        schema.end_effects.iter().map(|effect| &effect.condition).chain([&schema.middle_condition]);
    for condition in conditions {
        atoms(condition, &mut |predicate| open.push(predicate));
    }
    open.retain(|predicate| lifted.predicates[predicate.index()].derived);
    while let Some(predicate) = open.pop() {
        for axiom in lifted.axioms.iter().filter(|axiom| axiom.predicate == predicate) {
            numbers |= has_numbers(&axiom.condition);
            atoms(&axiom.condition, &mut |below| {
                if seen.insert(below) {
                    open.push(below);
                }
            });
        }
    }
    let is_changed_by_start = schema.start_effects.iter().any(|effect| match &effect.change {
        Change::Add(predicate, _) | Change::Delete(predicate, _) => seen.contains(predicate),
        Change::Assign { .. } => numbers,
    });
    let changes = lifted.events.iter().flat_map(|event| &event.changes);
    is_changed_by_start
        || changes.into_iter().any(|(predicate, ..)| schema.duration.is_some() && seen.contains(predicate))
}

/// Returns the derived predicates that depend on themselves through a universal quantifier.
pub fn recursive_through_forall(lifted: &Lifted) -> Vec<PredicateId> {
    let depends = |from: PredicateId, on: PredicateId| {
        let (mut open, mut seen) = (vec![from], FxHashSet::default());
        while let Some(predicate) = open.pop() {
            if predicate == on {
                return true;
            }
            for axiom in lifted.axioms.iter().filter(|axiom| axiom.predicate == predicate) {
                atoms(&axiom.condition, &mut |below| {
                    if seen.insert(below) {
                        open.push(below);
                    }
                });
            }
        }
        false
    };
    let mut recursive = Vec::new();
    for axiom in &lifted.axioms {
        let mut inside = Vec::new();
        universal_atoms(&axiom.condition, &mut |predicate| inside.push(predicate));
        if inside.into_iter().any(|predicate| depends(predicate, axiom.predicate)) {
            recursive.push(axiom.predicate);
        }
    }
    recursive
}

fn universal_atoms(formula: &Formula, visit: &mut dyn FnMut(PredicateId)) {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => {
            for part in parts {
                universal_atoms(part, visit);
            }
        }
        Formula::Exists(_, body) => universal_atoms(body, visit),
        Formula::ForAll(_, body) => atoms(body, visit),
        _ => {}
    }
}

/// Calls `visit` with the predicate of every atom in a condition.
pub fn atoms(formula: &Formula, visit: &mut dyn FnMut(PredicateId)) {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => {
            for part in parts {
                atoms(part, visit);
            }
        }
        Formula::Exists(_, body) | Formula::ForAll(_, body) => atoms(body, visit),
        Formula::Literal { predicate, .. } => visit(*predicate),
        Formula::Equal { .. } | Formula::Compare(..) => {}
    }
}

/// Returns `true` if a condition contains a numeric comparison.
pub fn has_numbers(formula: &Formula) -> bool {
    match formula {
        Formula::And(parts) | Formula::Or(parts) => parts.iter().any(has_numbers),
        Formula::Exists(_, body) | Formula::ForAll(_, body) => has_numbers(body),
        Formula::Compare(..) => true,
        Formula::Literal { .. } | Formula::Equal { .. } => false,
    }
}

/// Calls `visit` with every term in a condition.
pub fn formula_terms(formula: &Formula, visit: &mut dyn FnMut(Term)) {
    match formula {
        Formula::Exists(_, body) | Formula::ForAll(_, body) => formula_terms(body, visit),
        Formula::And(parts) | Formula::Or(parts) => {
            for part in parts {
                formula_terms(part, visit);
            }
        }
        Formula::Literal { terms, .. } => terms.iter().for_each(|term| visit(*term)),
        Formula::Equal { left, right, .. } => {
            visit(*left);
            visit(*right);
        }
        Formula::Compare(_, left, right, _) => {
            expression_terms(left, visit);
            expression_terms(right, visit);
        }
    }
}

/// Calls `visit` with every term in an expression.
pub fn expression_terms(expression: &Expression, visit: &mut dyn FnMut(Term)) {
    match expression {
        Expression::Number(_) | Expression::TotalTime => {}
        Expression::Function(_, terms, _) => terms.iter().for_each(|term| visit(*term)),
        Expression::Negate(inner) => expression_terms(inner, visit),
        Expression::Sum(parts) | Expression::Product(parts, _) => {
            for part in parts {
                expression_terms(part, visit);
            }
        }
        Expression::Quotient(left, right, _) => {
            expression_terms(left, visit);
            expression_terms(right, visit);
        }
    }
}
