//! Derived facts of a state: the least fixpoint of the axioms, stratum by stratum, by semi-naive evaluation \[1\].
//!
//! A new fact is joined with the other conditions of each axiom that mentions its predicate. That is not possible where an axiom mentions
//! a predicate of its own stratum under a negation, an implication or a universal quantifier. The instances of such an axiom wait for
//! the facts that were missing when they were evaluated.
//!
//! \[1\] F. Bancilhon, R. Ramakrishnan: An amateur's introduction to recursive query processing strategies, SIGMOD 1986.

use std::cell::RefCell;
use std::collections::hash_map::Entry;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ast::{Atom, Condition, Derived, Domain, Expression, Name, TypedName};
use crate::strata::Strata;

use super::effects::Ground;
use super::evaluate::{Bindings, Evaluator};
use super::world::{Arguments, State, Symbol, World};

/// The axioms of predicates that may depend on each other.
#[derive(Debug, Default)]
pub(super) struct Stratum<'p> {
    /// The predicates.
    own: FxHashSet<&'p Name>,
    axioms: Vec<Axiom<'p>>,
    /// By predicate of the stratum: where the axioms mention it.
    occurrences: FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
}

/// An axiom.
#[derive(Debug)]
struct Axiom<'p> {
    derived: &'p Derived,
    /// Those parts of its condition, by address, that mention a predicate of the stratum where new facts cannot be joined.
    opaque: FxHashSet<*const Condition>,
}

/// An atom in the condition of an axiom, below conjunctions, disjunctions and existential quantifiers only.
#[derive(Debug)]
struct Occurrence<'p> {
    /// The position of the axiom.
    axiom: usize,
    atom: &'p Atom,
    /// The variables of the quantifiers around the atom, outermost first.
    variables: Vec<&'p [TypedName]>,
    /// The conjunctions around the atom, with the position of the conjunct that contains the atom.
    conjunctions: Vec<(&'p [Condition], usize)>,
}

/// The strata of a domain, lowest first. Axioms through their own negation have no strata; the checker
/// refuses them, and here they all come into one.
#[expect(clippy::arithmetic_side_effects, reason = "levels are at most the number of predicates")]
pub(super) fn strata(domain: &Domain) -> Vec<Stratum<'_>> {
    let levels = Strata::of(domain).ok();
    let mut strata: Vec<Stratum<'_>> = Vec::new();
    for derived in &domain.derived {
        let name = &derived.head.identifier.name;
        let level = levels.as_ref().and_then(|levels| levels.level(name)).unwrap_or(0);
        if strata.len() <= level {
            strata.resize_with(level + 1, Stratum::default);
        }
        strata[level].own.insert(name);
        strata[level].axioms.push(Axiom { derived, opaque: FxHashSet::default() });
    }
    for stratum in &mut strata {
        let Stratum { own, axioms, occurrences } = stratum;
        for (axiom, Axiom { derived, opaque }) in axioms.iter_mut().enumerate() {
            let derived = *derived;
            let mut walk = Walk {
                axiom,
                derived,
                own: &*own,
                variables: Vec::new(),
                conjunctions: Vec::new(),
                occurrences: &mut *occurrences,
                opaque,
            };
            walk.visit(&derived.condition);
        }
    }
    strata
}

/// All predicates and functions in the conditions of axioms.
pub(super) fn read_by_axioms(domain: &Domain) -> FxHashSet<&Name> {
    let mut names = FxHashSet::default();
    for axiom in &domain.derived {
        names_in(&axiom.condition, &mut |name| {
            names.insert(name);
        });
    }
    names
}

/// A walk through the condition of an axiom.
struct Walk<'w, 'p> {
    axiom: usize,
    derived: &'p Derived,
    own: &'w FxHashSet<&'p Name>,
    variables: Vec<&'p [TypedName]>,
    conjunctions: Vec<(&'p [Condition], usize)>,
    occurrences: &'w mut FxHashMap<&'p Name, Vec<Occurrence<'p>>>,
    opaque: &'w mut FxHashSet<*const Condition>,
}

impl<'p> Walk<'_, 'p> {
    /// Notes the occurrences of predicates of the stratum. Returns `true` if there is one with which new facts cannot be joined.
    fn visit(&mut self, condition: &'p Condition) -> bool {
        let mut is_opaque = false;
        match condition {
            Condition::And(parts) => {
                for (position, part) in parts.iter().enumerate() {
                    self.conjunctions.push((parts, position));
                    is_opaque |= self.visit(part);
                    self.conjunctions.pop();
                }
            }
            Condition::Or(parts) => parts.iter().for_each(|part| is_opaque |= self.visit(part)),
            Condition::Exists(variables, body) if !self.hides(variables) => {
                self.variables.push(variables);
                is_opaque = self.visit(body);
                self.variables.pop();
            }
            Condition::Atom(atom) if self.own.contains(&atom.predicate.name) => {
                let occurrence = Occurrence {
                    axiom: self.axiom,
                    atom,
                    variables: self.variables.clone(),
                    conjunctions: self.conjunctions.clone(),
                };
                self.occurrences.entry(&atom.predicate.name).or_default().push(occurrence);
            }
            other => names_in(other, &mut |name| is_opaque |= self.own.contains(name)),
        }
        if is_opaque {
            self.opaque.insert(std::ptr::from_ref(condition));
        }
        is_opaque
    }

    /// Returns `true` if one of some variables has the name of a variable around them.
    fn hides(&self, variables: &[TypedName]) -> bool {
        let around = self.variables.iter().copied().chain([&self.derived.head.parameters[..]]).flatten();
        let around: FxHashSet<&Name> = around.map(|entry| &entry.identifier.name).collect();
        variables.iter().any(|entry| around.contains(&entry.identifier.name))
    }
}

/// Facts of a stratum that were missing in an evaluation. If none of them is derived, the result stays as it is.
#[derive(Debug)]
pub(super) struct Trace<'e, 'p> {
    own: &'e FxHashSet<&'p Name>,
    facts: RefCell<Vec<Ground>>,
    /// Predicates all of whose facts were read.
    predicates: RefCell<Vec<Symbol>>,
}

impl Trace<'_, '_> {
    /// Notes a fact that does not hold.
    pub(super) fn missed(&self, name: &Name, fact: Ground) {
        if self.own.contains(name) {
            self.facts.borrow_mut().push(fact);
        }
    }

    /// Notes that all facts of a predicate are read.
    pub(super) fn read(&self, name: &Name, predicate: Symbol) {
        if self.own.contains(name) && !self.predicates.borrow().contains(&predicate) {
            self.predicates.borrow_mut().push(predicate);
        }
    }
}

/// Replaces the derived facts of `state` by those that follow from its other facts. An axiom whose
/// condition is undefined for some objects says nothing about them.
pub(super) fn close(world: &World<'_>, state: &mut State) {
    state.derived.clear();
    for stratum in &world.strata {
        let (agenda, instances) = (Vec::new(), Vec::new());
        let (numbers, waiting) = (FxHashMap::default(), Waiting::default());
        Closure { world, stratum, state, agenda, instances, numbers, waiting }.run();
    }
}

/// An instance of an axiom with an opaque condition, which has not been found to hold.
struct WaitingInstance {
    axiom: usize,
    arguments: Arguments,
    /// The number of its evaluations. What an earlier one has waited for is of no interest.
    evaluations: u32,
}

/// The instances that wait for facts, by their numbers, each with the number of its evaluations.
#[derive(Default)]
struct Waiting {
    facts: FxHashMap<Ground, Vec<(usize, u32)>>,
    predicates: FxHashMap<Symbol, Vec<(usize, u32)>>,
}

/// The evaluation of a stratum.
struct Closure<'c, 'p> {
    world: &'c World<'p>,
    stratum: &'c Stratum<'p>,
    state: &'c mut State,
    /// New facts whose consequences have not been derived yet.
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
            for occurrence in name.and_then(|name| stratum.occurrences.get(name)).into_iter().flatten() {
                let heads = self.heads(occurrence.axiom, Some((occurrence, arguments)));
                self.conclude(occurrence.axiom, heads);
            }
            let waiting = self.waiting.facts.remove(&fact).into_iter().flatten();
            let waiting = waiting.chain(self.waiting.predicates.remove(predicate).into_iter().flatten());
            for (number, evaluations) in waiting.collect::<Vec<_>>() {
                if self.instances[number].evaluations == evaluations {
                    self.evaluate(number);
                }
            }
            if self.world.budget.is_spent() {
                return;
            }
        }
    }

    /// The arguments for which the condition of an axiom holds, its opaque parts aside; with an occurrence, those for which it holds with
    /// the given arguments of that atom.
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
                let others = conjuncts.iter().enumerate().filter(|(other, _)| other != position);
                parts.extend(others.map(|(_, conjunct)| conjunct));
            }
        } else {
            parts.push(&derived.condition);
        }
        let mut heads = Vec::new();
        evaluator.solve(parts, 0, &mut bindings, &mut |solution, undefined| {
            let objects: Option<Arguments> =
                solution.0[..parameters].iter().map(|binding| binding.object).collect();
            if undefined.is_none() {
                heads.extend(objects);
            }
            true
        });
        heads
    }

    /// Derives heads of an axiom, or evaluates the opaque parts of its condition first.
    fn conclude(&mut self, axiom: usize, heads: Vec<Arguments>) {
        let is_opaque = !self.stratum.axioms[axiom].opaque.is_empty();
        for arguments in heads {
            if !is_opaque {
                self.insert(axiom, arguments);
                continue;
            }
            let number = self.instances.len();
            if let Entry::Vacant(entry) = self.numbers.entry((axiom, arguments.clone())) {
                entry.insert(number);
                self.instances.push(WaitingInstance { axiom, arguments, evaluations: 0 });
                self.evaluate(number);
            }
        }
    }

    /// Derives the head of an instance if the whole condition holds. Otherwise the instance waits.
    fn evaluate(&mut self, number: usize) {
        let WaitingInstance { axiom, arguments, evaluations } = &mut self.instances[number];
        *evaluations = evaluations.saturating_add(1);
        let (axiom, arguments, evaluations) = (*axiom, arguments.clone(), *evaluations);
        let derived = self.stratum.axioms[axiom].derived;
        let (facts, predicates) = (RefCell::default(), RefCell::default());
        let trace = Trace { own: &self.stratum.own, facts, predicates };
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
        for fact in trace.facts.into_inner() {
            self.waiting.facts.entry(fact).or_default().push((number, evaluations));
        }
        for predicate in trace.predicates.into_inner() {
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

/// Calls `found` with each predicate and each function of a condition.
fn names_in<'p>(condition: &'p Condition, found: &mut dyn FnMut(&'p Name)) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                names_in(part, found);
            }
        }
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
            names_in(inner, found);
        }
        Condition::Imply(premise, conclusion) => {
            names_in(premise, found);
            names_in(conclusion, found);
        }
        Condition::Atom(atom) => found(&atom.predicate.name),
        Condition::Equal(..) => {}
        Condition::Compare(_, left, right, _) => {
            functions_in(left, found);
            functions_in(right, found);
        }
    }
}

fn functions_in<'p>(expression: &'p Expression, found: &mut dyn FnMut(&'p Name)) {
    match expression {
        Expression::Fluent(atom) => found(&atom.predicate.name),
        Expression::Operation(_, operands, _) => {
            for operand in operands {
                functions_in(operand, found);
            }
        }
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
