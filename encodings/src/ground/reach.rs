//! Relaxed reachability: which instances of each schema can ever become applicable if nothing is ever deleted.
//!
//! The lifted task becomes a Datalog program for the rule engine [1]. A schema with slots has one auxiliary
//! relation for each slot, which says for which other arguments *some* design fits; the designs themselves never
//! enter the relation of the schema, so its size does not depend on how many designs there are.
//!
//! Static derived predicates are rules of the same program, with stratified negation: the engine evaluates them once,
//! and from then on they are facts. Derived fluents are relaxed like everything else that changes.
//!
//! [1] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial Intelligence 173, 2009.

use rules::{Atom, Engine, Interrupt, Program, Symbol};
use rustc_hash::FxHashMap;

use crate::configuration::{SlotParameter, atoms, conjuncts, formula_terms};
use crate::error::Error;
use crate::ground::evaluate::{AtomSet, Binding};
use crate::ground::relaxed::{Builder, Candidates};
use crate::lifted::{
    Arguments, Axiom, Bound, Change, Effect, Formula, Lifted, ObjectId, PredicateId, Schema, Term,
};
use crate::limits::{Interrupted, Limits};
use crate::number::dense;

/// What relaxed reachability finds.
#[derive(Default)]
pub(crate) struct Reached {
    /// For each schema the bindings of its parameters apart from slots, ascending.
    pub(crate) instances: Vec<Vec<Binding>>,
    /// The fluent atoms that can become true.
    pub(crate) atoms: AtomSet,
    /// What follows by static derived predicates.
    pub(crate) derived: Vec<(PredicateId, Arguments)>,
}

/// Runs the relaxed task to its fixpoint.
///
/// # Errors
/// `Error::Rules` if the rule engine refuses the program, `Error::Interrupted` at a limit.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
pub(crate) fn reach(
    lifted: &Lifted,
    slots: &[Vec<SlotParameter>],
    limits: &Limits,
) -> Result<Reached, Error> {
    limits.check()?;
    let variables = lifted.schemas.iter().map(|schema| schema.variables);
    let mut variables = variables.chain(lifted.axioms.iter().map(|axiom| axiom.variables));
    if variables.any(|count| u16::try_from(count).is_err()) {
        return Err(Error::Rules("an action or axiom with more than 65,535 variables".into()));
    }
    let mut builder = Builder::new(lifted, limits);
    for axiom in &lifted.axioms {
        builder.axiom(axiom)?;
    }
    let schemas = lifted.schemas.iter().zip(slots).map(|(schema, slots)| builder.schema(schema, slots));
    let applicable: Vec<_> = schemas.collect::<Result<_, Interrupted>>()?;
    let (symbols, rules, facts) = builder.finish();
    let objects: FxHashMap<Symbol, ObjectId> =
        symbols.objects.iter().copied().zip((0..).map(ObjectId)).collect();
    let within = rules::Limits { steps: u64::MAX, interrupt: Some(interrupt(limits)) };
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
        bindings.sort_unstable();
        instances.push(bindings);
    }
    Ok(Reached { instances, atoms, derived })
}

/// What stops the rule engine.
fn interrupt(limits: &Limits) -> Interrupt {
    let limits = limits.clone();
    Interrupt::new(move || limits.reached())
}

/// Why the rule engine has no result.
fn refusal(errors: &[rules::Error]) -> Error {
    if errors.iter().any(|error| matches!(error, rules::Error::Interrupted { .. })) {
        return Error::Interrupted;
    }
    Error::Rules(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
}

impl Builder<'_> {
    /// Adds the rules of a derived predicate: exact if it is static, else relaxed.
    fn axiom(&mut self, axiom: &Axiom) -> Result<(), Interrupted> {
        let parameters: Vec<u32> = (0..dense(axiom.parameters.len())).collect();
        let candidates: Candidates =
            parameters.iter().copied().zip(axiom.parameters.iter().map(|p| p.candidates.clone())).collect();
        let is_static = !self.lifted.predicates[axiom.predicate.index()].fluent;
        let mut body = self.types(&parameters, &candidates);
        self.body(&axiom.condition, &candidates, is_static, &mut body)?;
        let head =
            self.atom(axiom.predicate, &parameters.iter().map(|p| Term::Parameter(*p)).collect::<Vec<_>>());
        self.rule(vec![head], body);
        Ok(())
    }

    /// Adds the rules of a schema; returns the relation of its instances and the parameters that it ranges over.
    fn schema(
        &mut self,
        schema: &Schema,
        slots: &[SlotParameter],
    ) -> Result<(Symbol, Vec<u32>), Interrupted> {
        let number = self.fresh("applicable");
        let is_slot = |parameter: &u32| slots.iter().any(|slot| slot.parameter == *parameter);
        let all: Vec<u32> = (0..dense(schema.parameters.len())).collect();
        let core: Vec<u32> = all.iter().copied().filter(|p| !is_slot(p)).collect();
        let candidates: Candidates =
            all.iter().copied().zip(schema.parameters.iter().map(|p| p.candidates.clone())).collect();
        let needs = needs(self.lifted, schema);

        let mut body = self.types(&core, &candidates);
        for slot in slots {
            let own: Vec<_> =
                needs.iter().filter(|formula| slots_in(formula, slots) == [slot.parameter]).collect();
            let mut others: Vec<u32> =
                own.iter().flat_map(|formula| free(formula)).filter(|p| !is_slot(p)).collect();
            others.sort_unstable();
            others.dedup();
            let mut ranging = others.clone();
            ranging.push(slot.parameter);
            let mut fits = self.types(&ranging, &candidates);
            for formula in own {
                self.body(formula, &candidates, false, &mut fits)?;
            }
            let relation = self.fresh("slot");
            body.push(Self::relation(relation, &others));
            self.rule(vec![Self::relation(relation, &others)], fits);
        }
        for formula in needs.iter().filter(|formula| slots_in(formula, slots).is_empty()) {
            self.body(formula, &candidates, false, &mut body)?;
        }
        self.rule(vec![Self::relation(number, &core)], body);
        self.effects(schema, Self::relation(number, &core), &candidates)?;
        Ok((number, core))
    }

    /// What instances add; all that they add without a condition in one rule.
    fn effects(
        &mut self,
        schema: &Schema,
        applicable: Atom,
        candidates: &Candidates,
    ) -> Result<(), Interrupted> {
        let mut plain = Vec::new();
        for Effect { bound, condition, change } in schema.start_effects.iter().chain(&schema.end_effects) {
            let Change::Add(predicate, terms) = change else { continue };
            let head = self.atom(*predicate, terms);
            if bound.is_empty() && conjuncts(condition).is_empty() {
                plain.push(head);
                continue;
            }
            let (variables, candidates) = with_bound(candidates, bound);
            let mut body = vec![applicable.clone()];
            body.extend(self.types(&variables, &candidates));
            self.body(condition, &candidates, false, &mut body)?;
            self.rule(vec![head], body);
        }
        if !plain.is_empty() {
            self.rule(plain, vec![applicable]);
        }
        Ok(())
    }
}

/// The variables that a quantifier binds, and all candidates in its scope.
pub(super) fn with_bound(candidates: &Candidates, bound: &[Bound]) -> (Vec<u32>, Candidates) {
    let mut inner = candidates.clone();
    inner.extend(bound.iter().map(|b| (b.variable, b.candidates.clone())));
    (bound.iter().map(|b| b.variable).collect(), inner)
}

/// The variables of a condition that no quantifier in it binds, ascending.
pub(super) fn free(formula: &Formula) -> Vec<u32> {
    fn bound_in(formula: &Formula, out: &mut Vec<u32>) {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => parts.iter().for_each(|part| bound_in(part, out)),
            Formula::Exists(bound, body) | Formula::ForAll(bound, body) => {
                out.extend(bound.iter().map(|b| b.variable));
                bound_in(body, out);
            }
            _ => {}
        }
    }
    let mut bound = Vec::new();
    bound_in(formula, &mut bound);
    let mut free = Vec::new();
    formula_terms(formula, &mut |term| {
        if let Term::Parameter(variable) = term
            && !bound.contains(&variable)
        {
            free.push(variable);
        }
    });
    free.sort_unstable();
    free.dedup();
    free
}

fn slots_in(formula: &Formula, slots: &[SlotParameter]) -> Vec<u32> {
    free(formula)
        .into_iter()
        .filter(|variable| slots.iter().any(|slot| slot.parameter == *variable))
        .collect()
}

/// What every instance needs before it starts: its conjuncts, apart from those of the middle condition that its own
/// start effects may provide.
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

/// Whether a condition mentions one of the given predicates, or a derived one.
fn mentions_fluent(lifted: &Lifted, formula: &Formula, predicates: &[PredicateId]) -> bool {
    let mut found = false;
    atoms(formula, &mut |predicate| {
        found |= predicates.contains(&predicate) || lifted.predicates[predicate.index()].derived;
    });
    found
}
