//! Datalog rules for action schemas and derived predicates, used by relaxed reachability.

use rules::{Atom, Symbol};

use crate::error::Error;
use crate::ground::relaxed_reachability::relaxed::{
    Candidates, ReachabilityProgramBuilder, free, with_bound,
};
use crate::lifted::configuration::{SlotParameter, atoms, conjuncts};
use crate::lifted::{Axiom, Change, Effect, Formula, Lifted, PredicateId, Schema, Term};
use crate::number::dense;

pub(super) fn add_axiom(relaxed: &mut ReachabilityProgramBuilder<'_>, axiom: &Axiom) -> Result<(), Error> {
    let parameters: Vec<u32> = (0..dense(axiom.parameters.len())).collect();
    let candidates: Candidates =
        parameters.iter().copied().zip(axiom.parameters.iter().map(|p| p.candidates.clone())).collect();
    let is_static = !relaxed.lifted.predicates[axiom.predicate.index()].fluent;
    let mut body = relaxed.types(&parameters, &candidates);
    relaxed.body(&axiom.condition, &candidates, is_static, &mut body)?;
    let head =
        relaxed.atom(axiom.predicate, &parameters.iter().map(|p| Term::Parameter(*p)).collect::<Vec<_>>());
    relaxed.rule(vec![head], body);
    Ok(())
}

pub(super) fn add_schema(
    relaxed: &mut ReachabilityProgramBuilder<'_>,
    schema: &Schema,
    slots: &[SlotParameter],
) -> Result<(Symbol, Vec<u32>), Error> {
    let number = relaxed.fresh("applicable");
    let is_slot = |parameter: &u32| slots.iter().any(|slot| slot.parameter == *parameter);
    let parameters: Vec<u32> = (0..dense(schema.parameters.len())).collect();
    let core: Vec<u32> = parameters.iter().copied().filter(|p| !is_slot(p)).collect();
    let candidates: Candidates =
        parameters.iter().copied().zip(schema.parameters.iter().map(|p| p.candidates.clone())).collect();
    let needs = needs(relaxed.lifted, schema);

    let mut body = relaxed.types(&core, &candidates);
    for slot in slots {
        let slot_conditions: Vec<_> =
            needs.iter().filter(|formula| slots_in(formula, slots) == [slot.parameter]).collect();
        let mut other_parameters: Vec<u32> =
            slot_conditions.iter().flat_map(|formula| free(formula)).filter(|p| !is_slot(p)).collect();
        other_parameters.sort_unstable();
        other_parameters.dedup();
        let mut ranging = other_parameters.clone();
        ranging.push(slot.parameter);
        let mut fits = relaxed.types(&ranging, &candidates);
        for formula in slot_conditions {
            relaxed.body(formula, &candidates, false, &mut fits)?;
        }
        let relation = relaxed.fresh("slot");
        body.push(ReachabilityProgramBuilder::relation(relation, &other_parameters));
        relaxed.rule(vec![ReachabilityProgramBuilder::relation(relation, &other_parameters)], fits);
    }
    // Conditions over several slots are ignored, which relaxes the problem further.
    for formula in needs.iter().filter(|formula| slots_in(formula, slots).is_empty()) {
        relaxed.body(formula, &candidates, false, &mut body)?;
    }
    relaxed.rule(vec![ReachabilityProgramBuilder::relation(number, &core)], body);
    add_effects(relaxed, schema, ReachabilityProgramBuilder::relation(number, &core), &candidates)?;
    Ok((number, core))
}

fn add_effects(
    relaxed: &mut ReachabilityProgramBuilder<'_>,
    schema: &Schema,
    applicable: Atom,
    candidates: &Candidates,
) -> Result<(), Error> {
    let mut plain = Vec::new();
    for Effect { bound, condition, change } in schema.start_effects.iter().chain(&schema.end_effects) {
        let Change::Add(predicate, terms) = change else { continue };
        let head = relaxed.atom(*predicate, terms);
        if bound.is_empty() && conjuncts(condition).is_empty() {
            plain.push(head);
            continue;
        }
        let (variables, candidates) = with_bound(candidates, bound);
        let mut body = vec![applicable.clone()];
        body.extend(relaxed.types(&variables, &candidates));
        relaxed.body(condition, &candidates, false, &mut body)?;
        relaxed.rule(vec![head], body);
    }
    if !plain.is_empty() {
        relaxed.rule(plain, vec![applicable]);
    }
    Ok(())
}

fn slots_in(formula: &Formula, slots: &[SlotParameter]) -> Vec<u32> {
    free(formula)
        .into_iter()
        .filter(|variable| slots.iter().any(|slot| slot.parameter == *variable))
        .collect()
}

/// Returns the conjuncts that must hold for every instance of the schema. Conjuncts of the middle condition that start
/// effects may make true are omitted: if a start effect adds atoms, these are the conjuncts that mention the predicate
/// of such an atom or a derived predicate.
fn needs<'a>(lifted: &Lifted, schema: &'a Schema) -> Vec<&'a Formula> {
    let provided: Vec<_> = schema
        .start_effects
        .iter()
        .filter_map(
            |effect| if let Change::Add(predicate, _) = effect.change { Some(predicate) } else { None },
        )
        .collect();
    let middle = conjuncts(&schema.middle_condition);
    let middle = middle
        .into_iter()
        .filter(|formula| provided.is_empty() || !mentions_fluent(lifted, formula, &provided));
    conjuncts(&schema.start_condition).into_iter().chain(middle).collect()
}

fn mentions_fluent(lifted: &Lifted, formula: &Formula, predicates: &[PredicateId]) -> bool {
    let mut is_mentioned = false;
    atoms(formula, &mut |predicate| {
        is_mentioned |= predicates.contains(&predicate) || lifted.predicates[predicate.index()].derived;
    });
    is_mentioned
}
