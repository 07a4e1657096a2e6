//! Computes the derived facts of a state: the least fixpoint of the axioms, stratum by stratum, by semi-naive
//! evaluation \[1\].
//!
//! A new fact is joined with the remaining conditions of each axiom that mentions its predicate. Such a join is
//! impossible if the axiom mentions a predicate of its own stratum below a negation, an implication or a universal
//! quantifier (an *opaque* condition). The instances of such an axiom are re-evaluated when a fact arrives that was
//! missing in their last evaluation.
//!
//! \[1\] F. Bancilhon, R. Ramakrishnan: An amateur's introduction to recursive query processing strategies, SIGMOD 1986.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use crate::ast::Derived;

use super::axioms::{Axiom, Occurrence, Stratum};
use super::effects::Ground;
use super::evaluate::{Bindings, Evaluator};
use super::trace::Trace;
use super::world::{Arguments, State, Symbol, World};

/// Recomputes the derived facts of `state`. An axiom instance with an undefined condition derives nothing.
pub(super) fn derive_facts(world: &World<'_>, state: &mut State) {
    state.derived.clear();
    for stratum in &world.strata {
        let (agenda, instances) = (Vec::new(), Vec::new());
        let (numbers, waiting) = (FxHashMap::default(), Waiting::default());
        Closure { world, stratum, state, agenda, instances, numbers, waiting }.run();
    }
}

/// An instance of an axiom with an opaque condition. Until its condition holds, the instance is
/// re-evaluated when a fact arrives that was missing.
struct WaitingInstance {
    axiom: usize,
    arguments: Arguments,
    /// Number of evaluations that were made. Entries of this instance in [`Waiting`] with a smaller number are obsolete.
    evaluations: u32,
}

/// Instances to re-evaluate when a given fact, or any fact of a given predicate, is derived. Each entry
/// consists of the index in [`Closure::instances`] and the number of evaluations of the instance when the
/// entry was added. The entry is obsolete once the instance has been evaluated again.
#[derive(Default)]
struct Waiting {
    facts: FxHashMap<Ground, Vec<(usize, u32)>>,
    predicates: FxHashMap<Symbol, Vec<(usize, u32)>>,
}

struct Closure<'c, 'p> {
    world: &'c World<'p>,
    stratum: &'c Stratum<'p>,
    state: &'c mut State,
    agenda: Vec<Ground>,
    instances: Vec<WaitingInstance>,
    numbers: FxHashMap<(usize, Arguments), usize>,
    waiting: Waiting,
}

impl<'p> Closure<'_, 'p> {
    fn run(mut self) {
        for axiom in 0..self.stratum.axioms.len() {
            let heads = self.heads(axiom, None);
            self.conclude(axiom, heads);
        }
        while let Some(fact) = self.agenda.pop() {
            let (predicate, arguments) = &fact;
            let name = self.world.name_of(*predicate);
            let stratum = self.stratum;
            // Semi-naive evaluation: only solutions that use the new fact can be new.
            for occurrence in name.and_then(|name| stratum.occurrences.get(name)).into_iter().flatten() {
                let heads = self.heads(occurrence.axiom, Some((occurrence, arguments)));
                self.conclude(occurrence.axiom, heads);
            }
            let waiting = self.waiting.facts.remove(&fact).into_iter().flatten();
            let waiting = waiting.chain(self.waiting.predicates.remove(predicate).into_iter().flatten());
            for (number, evaluations) in waiting.collect::<Vec<_>>() {
                // An entry is obsolete if the instance has been evaluated again since the entry was added.
                if self.instances[number].evaluations == evaluations {
                    self.evaluate(number);
                }
            }
            if self.world.budget.is_spent() {
                return;
            }
        }
    }

    /// Returns the head arguments for which the condition of an axiom holds if its opaque parts count as true.
    /// `seed` is an atom of the condition (its occurrence) and a fact. With a seed, only solutions in which the
    /// atom is the fact are returned.
    fn heads(&self, axiom: usize, seed: Option<(&Occurrence<'p>, &Arguments)>) -> Vec<Arguments> {
        let Axiom { derived, opaque } = &self.stratum.axioms[axiom];
        let derived: &'p Derived = derived;
        let evaluator = Evaluator { ignored: Some(opaque), ..Evaluator::new(self.world, self.state) };
        let parameters = derived.head.parameters.len();
        let mut bindings = Bindings::default();
        bindings.declare(&derived.head.parameters);
        let mut parts = Vec::new();
        if let Some((occurrence, arguments)) = seed {
            occurrence.variables.iter().for_each(|variables| bindings.declare(variables));
            if !evaluator.unify(occurrence.atom, arguments, &mut bindings, &mut Vec::new()) {
                return Vec::new();
            }
            for (conjuncts, position) in &occurrence.conjunctions {
                let remaining = conjuncts.iter().enumerate().filter(|(index, _)| index != position);
                parts.extend(remaining.map(|(_, conjunct)| conjunct));
            }
        } else {
            parts.push(&derived.condition);
        }
        let mut heads = Vec::new();
        evaluator.solve(parts, 0, &mut bindings, &mut |solution, undefined| {
            let objects: Option<Arguments> =
                solution.0[..parameters].iter().map(|binding| binding.object).collect();
            // An undefined condition derives nothing.
            if undefined.is_none() {
                heads.extend(objects);
            }
            true
        });
        heads
    }

    /// Derives the heads of an axiom. If the condition has opaque parts, a head is derived only
    /// after its whole condition has been evaluated.
    fn conclude(&mut self, axiom: usize, heads: Vec<Arguments>) {
        let is_opaque = !self.stratum.axioms[axiom].opaque.is_empty();
        for arguments in heads {
            if !is_opaque {
                self.insert(axiom, arguments);
                continue;
            }
            let number = self.instances.len();
            // An instance that is already registered is evaluated again only when a missing fact arrives.
            if let Entry::Vacant(entry) = self.numbers.entry((axiom, arguments.clone())) {
                entry.insert(number);
                self.instances.push(WaitingInstance { axiom, arguments, evaluations: 0 });
                self.evaluate(number);
            }
        }
    }

    fn evaluate(&mut self, number: usize) {
        let WaitingInstance { axiom, arguments, evaluations } = &mut self.instances[number];
        *evaluations = evaluations.saturating_add(1);
        let (axiom, arguments, evaluations) = (*axiom, arguments.clone(), *evaluations);
        let derived = self.stratum.axioms[axiom].derived;
        let trace = Trace::new(&self.stratum.predicates);
        let evaluator = Evaluator { trace: Some(&trace), ..Evaluator::new(self.world, self.state) };
        let mut bindings = Bindings::default();
        bindings.declare(&derived.head.parameters);
        for (binding, object) in bindings.0.iter_mut().zip(&arguments) {
            binding.object = Some(*object);
        }
        if evaluator.holds(&derived.condition, &mut bindings) == Ok(true) {
            self.insert(axiom, arguments);
            return;
        }
        let (facts, predicates) = trace.into_parts();
        for fact in facts {
            self.waiting.facts.entry(fact).or_default().push((number, evaluations));
        }
        for predicate in predicates {
            self.waiting.predicates.entry(predicate).or_default().push((number, evaluations));
        }
    }

    fn insert(&mut self, axiom: usize, arguments: Arguments) {
        let name = &self.stratum.axioms[axiom].derived.head.identifier.name;
        let predicate = self.world.symbol(name);
        if self.state.derived.entry(predicate).or_default().insert(arguments.clone()) {
            self.agenda.push((predicate, arguments));
        }
    }
}
