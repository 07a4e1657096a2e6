//! Relaxed reachability: computes the instances of each action schema that are applicable in the delete
//! relaxation.
//!
//! The lifted task becomes a Datalog program \[1\]. A schema with slots has an auxiliary relation for each slot. The
//! columns of this relation are the other parameters in the conditions on the slot; its rows are the objects for which
//! *some* design is suitable. The relation of applicable instances has no columns for slots, so its size is
//! independent of the number of their designs.
//!
//! The rules of static derived predicates are part of the program, with stratified negation and without
//! relaxation. Derived fluents are relaxed like all other fluents.
//!
//! \[1\] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial
//! Intelligence 173, 2009.

mod program;
mod relaxed;

use rules::{Engine, Program, Symbol};
use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::ground::relaxed_reachability::program::{add_axiom, add_schema};
use crate::ground::relaxed_reachability::relaxed::ReachabilityProgramBuilder;
use crate::ground::vocabulary::atom::{AtomSet, Binding};
use crate::ground::vocabulary::reached::RelaxedReachability;
use crate::lifted::configuration::SlotParameter;
use crate::lifted::{Arguments, Lifted, ObjectId, PredicateId};
use crate::limits::Limits;

/// Computes the reachable instances of all schemas, the reachable fluent atoms, and the facts of static derived
/// predicates.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
pub fn reach(
    lifted: &Lifted,
    slots: &[Vec<SlotParameter>],
    limits: &Limits,
) -> Result<RelaxedReachability, Error> {
    limits.check()?;
    let variables = lifted.schemas.iter().map(|schema| schema.variables);
    let mut variables = variables.chain(lifted.axioms.iter().map(|axiom| axiom.variables));
    // The Datalog engine uses 16-bit numbers for the variables of a rule.
    if variables.any(|count| u16::try_from(count).is_err()) {
        return Err(Error::Rules("an action or axiom with more than 65,535 variables".into()));
    }
    let unreached = RelaxedReachability::default();
    let mut relaxed = ReachabilityProgramBuilder::new(lifted, &unreached, limits);
    for axiom in &lifted.axioms {
        add_axiom(&mut relaxed, axiom)?;
    }
    let schemas =
        lifted.schemas.iter().zip(slots).map(|(schema, slots)| add_schema(&mut relaxed, schema, slots));
    let applicable: Vec<_> = schemas.collect::<Result<_, Error>>()?;
    let (symbols, rules, facts) = relaxed.finish();
    let objects: FxHashMap<Symbol, ObjectId> =
        symbols.objects.iter().copied().zip((0..).map(ObjectId)).collect();
    let within = rules::Limits { steps: u64::MAX, interrupt: Some(limits.into()) };
    let program = Program { rules, ..Program::default() };
    let engine =
        Engine::with_limits(symbols.table, program, facts, within).map_err(|errors| refusal(&errors))?;
    limits.check()?;
    let read = |row: &[Symbol]| -> Arguments {
        row.iter().filter_map(|symbol| objects.get(symbol)).copied().collect()
    };

    let (mut atoms, mut derived) = (AtomSet::default(), Vec::new());
    for (predicate, id) in lifted.predicates.iter().zip((0..).map(PredicateId)) {
        let any = vec![None; predicate.arity];
        let rows = engine.matching(symbols.predicates[id.index()], &any).map(|row| (id, read(&row)));
        match (predicate.fluent, predicate.derived) {
            (true, _) => atoms.extend(rows),
            (false, true) => derived.extend(rows),
            (false, false) => {}
        }
    }
    let mut instances = Vec::new();
    for ((schema, slots), (symbol, core)) in lifted.schemas.iter().zip(slots).zip(applicable) {
        limits.check()?;
        debug_assert_eq!(core.len() + slots.len(), schema.parameters.len());
        let any = vec![None; core.len()];
        let mut bindings: Vec<Binding> = engine
            .matching(symbol, &any)
            .map(|row| {
                let mut binding = vec![None; schema.variables];
                for (parameter, object) in core.iter().zip(read(&row).iter()) {
                    binding[*parameter as usize] = Some(*object);
                }
                binding
            })
            .collect();
        // Sorted, so that the numbers of operators are reproducible.
        bindings.sort_unstable();
        instances.push(bindings);
    }
    Ok(RelaxedReachability { instances, atoms, derived })
}

fn refusal(errors: &[rules::Error]) -> Error {
    if errors.iter().any(|error| matches!(error, rules::Error::Interrupted { .. })) {
        return Error::Interrupted;
    }
    Error::Rules(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
}
