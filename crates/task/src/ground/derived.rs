//! Simplifies derived atoms, i.e. atoms of derived predicates and auxiliary atoms that represent
//! subconditions.
//!
//! In general, derived atoms keep their rules \[1\]: their truth values are the least fixpoint of the stratified
//! rules, given the state variables. Constant derived atoms are replaced by their truth values. A derived atom with a
//! single rule that is not recursive is replaced by the rule's body where the result is still in conjunctive normal
//! form.
//!
//! \[1\] S. Thiébaux, J. Hoffmann, B. Nebel: In defense of PDDL axioms, Artificial Intelligence
//! 168, 2005.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::axiom::{GroundAxiom, components};
use crate::ground::vocabulary::condition::{GroundCondition, GroundLiteral};
use crate::ground::vocabulary::task::GroundTask;
use crate::limits::{Interrupted, Limits};
use crate::number::dense;

/// Replaces constant derived atoms by their truth values and, where possible, derived atoms with a single rule by the
/// rule's body. Removes duplicate rules, and rules, conditional effects and operators whose conditions are found to be
/// false. A goal that is found to be false is replaced by `None`.
pub fn simplify(task: &mut GroundTask<'_>) -> Result<(), Interrupted> {
    let limits = task.world.limits;
    let mut axioms = std::mem::take(&mut task.axioms);
    // A duplicate would prevent the inlining of an atom with a single rule.
    let mut distinct = FxHashSet::default();
    axioms.retain(|axiom| distinct.insert(axiom.clone()));
    fold(task, &mut axioms)?;
    let bodies = single_bodies(&axioms, limits)?;
    let mut simplified = Vec::with_capacity(axioms.len());
    for axiom in limits.watch(axioms) {
        let mut axiom = axiom?;
        if inline(&mut axiom.body, &bodies) {
            simplified.push(axiom);
        }
    }
    retain(&mut task.operators, limits, |operator| {
        for effect in &mut operator.conditional {
            effect.condition.iter_mut().for_each(|literal| rename(literal, &bodies));
            // The search for mutex groups looks literals up in these sorted lists.
            effect.condition.sort_unstable();
            effect.condition.dedup();
        }
        inline(&mut operator.condition, &bodies)
    })?;
    if task.goal.as_mut().is_some_and(|goal| !inline(goal, &bodies)) {
        task.goal = None;
    }
    task.axioms = simplified;
    Ok(())
}

/// Keeps the items for which `keep` returns `true`. At a limit, returns an error and keeps the remaining items.
fn retain<T>(
    items: &mut Vec<T>,
    limits: &Limits,
    mut keep: impl FnMut(&mut T) -> bool,
) -> Result<(), Interrupted> {
    let (mut pulse, mut outcome) = (limits.pulse(), Ok(()));
    items.retain_mut(|item| {
        outcome = outcome.and_then(|()| pulse.beat());
        outcome.is_err() || keep(item)
    });
    outcome
}

/// Replaces constant derived atoms by their truth values. In each round, only the rules that read an atom of the
/// previous round are examined.
fn fold(task: &mut GroundTask<'_>, axioms: &mut Vec<GroundAxiom>) -> Result<(), Interrupted> {
    let (world, limits) = (&task.world, task.world.limits);
    let mut rules: Vec<Option<GroundAxiom>> = std::mem::take(axioms).into_iter().map(Some).collect();
    let mut rules_of: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    let mut readers: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    let mut round: Vec<(AtomId, bool)> = Vec::new();
    for item in limits.watch(rules.iter().flatten().enumerate()) {
        let (rule, axiom) = item?;
        rules_of.entry(axiom.head).or_default().push(rule);
        for atom in axiom.body.atoms() {
            readers.entry(atom).or_default().push(rule);
        }
        if axiom.body == GroundCondition::default() {
            round.push((axiom.head, true));
        }
    }
    // A derived atom without a rule is false.
    let atoms = (0..dense(world.atoms.len())).map(AtomId);
    let has_no_rule = atoms.filter(|atom| world.is_derived(*atom) && !rules_of.contains_key(atom));
    round.extend(has_no_rule.map(|atom| (atom, false)));
    let mut rule_counts: FxHashMap<AtomId, usize> =
        rules_of.iter().map(|(head, rules)| (*head, rules.len())).collect();
    let mut truth_values: FxHashMap<AtomId, bool> = FxHashMap::default();
    while !round.is_empty() {
        let mut affected: Vec<usize> = Vec::new();
        for item in limits.watch(std::mem::take(&mut round)) {
            let (atom, value) = item?;
            if truth_values.insert(atom, value).is_none() {
                affected.extend(readers.get(&atom).into_iter().flatten());
                rules_of.get(&atom).into_iter().flatten().for_each(|rule| rules[*rule] = None);
            }
        }
        affected.sort_unstable();
        affected.dedup();
        for position in limits.watch(affected) {
            let rule = &mut rules[position?];
            let Some(axiom) = rule else { continue };
            let head = axiom.head;
            if !substitute(&mut axiom.body, &truth_values) {
                *rule = None;
                let count = rule_counts.entry(head).or_default();
                *count = count.saturating_sub(1);
                round.extend((*count == 0).then_some((head, false)));
            } else if axiom.body == GroundCondition::default() {
                round.push((head, true));
            }
        }
    }
    axioms.extend(rules.into_iter().flatten());
    retain(&mut task.operators, limits, |operator| {
        operator.conditional.retain_mut(|effect| conjunction(&mut effect.condition, &truth_values));
        substitute(&mut operator.condition, &truth_values)
    })?;
    if task.goal.as_mut().is_some_and(|goal| !substitute(goal, &truth_values)) {
        task.goal = None;
    }
    Ok(())
}

fn conjunction(literals: &mut Vec<GroundLiteral>, known: &FxHashMap<AtomId, bool>) -> bool {
    let fails =
        literals.iter().any(|(atom, positive)| known.get(atom).is_some_and(|value| value != positive));
    literals.retain(|(atom, _)| !known.contains_key(atom));
    !fails
}

fn substitute(condition: &mut GroundCondition, known: &FxHashMap<AtomId, bool>) -> bool {
    if !conjunction(&mut condition.literals, known) {
        return false;
    }
    let satisfied = |(atom, positive): &GroundLiteral| known.get(atom).is_some_and(|value| value == positive);
    condition.clauses.retain(|clause| !clause.iter().any(satisfied));
    for clause in &mut condition.clauses {
        clause.retain(|(atom, _)| !known.contains_key(atom));
    }
    if condition.clauses.iter().any(Vec::is_empty) {
        return false;
    }
    let (units, clauses) = std::mem::take(&mut condition.clauses).into_iter().partition(|c| c.len() == 1);
    condition.clauses = clauses;
    let units: Vec<Vec<GroundLiteral>> = units;
    condition.literals.extend(units.into_iter().flatten());
    condition.tidy()
}

/// Maps each non-recursive derived atom with exactly one rule to the rule's body. Such atoms in the body are
/// already inlined where [`inline`] can replace them (a negative literal is replaced only by a literal). Atoms
/// whose body contradicts itself are omitted.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
fn single_bodies(
    axioms: &[GroundAxiom],
    limits: &Limits,
) -> Result<FxHashMap<AtomId, GroundCondition>, Interrupted> {
    let mut count: FxHashMap<AtomId, usize> = FxHashMap::default();
    for axiom in axioms {
        *count.entry(axiom.head).or_default() += 1;
    }
    let mut bodies: FxHashMap<AtomId, GroundCondition> = FxHashMap::default();
    let rules: FxHashMap<AtomId, &GroundAxiom> =
        axioms.iter().filter(|axiom| count[&axiom.head] == 1).map(|axiom| (axiom.head, axiom)).collect();
    for component in limits.watch(components(axioms)) {
        let [only] = component?[..] else { continue };
        if let Some(axiom) = rules.get(&only) {
            let mut body = axiom.body.clone();
            // The body of a recursive rule cannot replace its atom.
            let depends_on_itself = body.atoms().any(|atom| atom == only);
            if !depends_on_itself && inline(&mut body, &bodies) {
                bodies.insert(only, body);
            }
        }
    }
    Ok(bodies)
}

/// Replaces atoms by the bodies of their single rules, which have no clauses (see [`GroundAxiom`]). An atom in
/// a negative literal or clause is replaced only if the body is a single literal. Returns `false` if the
/// condition then contradicts itself.
fn inline(condition: &mut GroundCondition, bodies: &FxHashMap<AtomId, GroundCondition>) -> bool {
    let mut literals = Vec::with_capacity(condition.literals.len());
    for mut literal in std::mem::take(&mut condition.literals) {
        match bodies.get(&literal.0) {
            // Only a positive literal can be replaced by a conjunction.
            Some(body) if literal.1 => {
                literals.extend(&body.literals);
                condition.comparisons.extend(body.comparisons.iter().cloned());
            }
            _ => {
                rename(&mut literal, bodies);
                literals.push(literal);
            }
        }
    }
    condition.literals = literals;
    condition.clauses.iter_mut().flatten().for_each(|literal| rename(literal, bodies));
    condition.tidy()
}

fn rename(literal: &mut GroundLiteral, bodies: &FxHashMap<AtomId, GroundCondition>) {
    if let Some(body) = bodies.get(&literal.0)
        && let [(atom, positive)] = body.literals[..]
        && body.comparisons.is_empty()
    {
        *literal = (atom, positive == literal.1);
    }
}
