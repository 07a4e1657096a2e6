//! Mutex groups: sets of atoms at most one of which is true in each reachable state. They become
//! finite-domain variables.
//!
//! Invariant synthesis after Helmert \[1\]. A candidate is a set of predicates with key arguments. Each
//! predicate has at most one further argument (more for atoms of running actions), which may have any value. An
//! instance of the candidate fixes the objects of the key. For example, the candidate `(at ?robot ?place)` with
//! the key `?robot` has an instance for each robot: the atoms that place this robot. The candidate is an
//! invariant if no operator increases the number of true atoms of any instance. If an operator violates a
//! candidate, the candidate is extended by a predicate that the operator deletes. The check uses ground
//! operators, so statically impossible instances do not violate candidates.
//!
//! \[1\] M. Helmert: Concise finite-domain representations for PDDL planning tasks, Artificial
//! Intelligence 173, 2009, section 5.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::GroundLiteral;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::task::GroundTask;
use crate::lifted::{ObjectId, PredicateId};
use crate::limits::{Interrupted, Limits};

/// A predicate of an invariant candidate, with the argument positions that form the key, in key order. The
/// other arguments may have any value.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Part {
    predicate: PredicateId,
    key: Vec<usize>,
}

type Candidate = Vec<Part>;
type Key = SmallVec<[ObjectId; 4]>;

const CANDIDATE_LIMIT: usize = 500;

pub struct Group {
    /// Values of the variable: at least two atoms that belong to no other variable.
    pub(crate) atoms: Vec<AtomId>,
    /// The whole mutex group, a superset of `atoms`: at most one of its atoms is true in each reachable state. Effects
    /// on the variable are correct only in states with this property.
    pub(crate) exclusive: Vec<AtomId>,
}

/// Returns mutex groups of relevant atoms with pairwise disjoint `atoms`, in decreasing number of these
/// atoms. Not all mutex groups are found.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
pub fn groups(task: &GroundTask<'_>, relevant: &FxHashSet<AtomId>) -> Result<Vec<Group>, Interrupted> {
    let limits = task.world.limits;
    let mut instances: Vec<Vec<AtomId>> = Vec::new();
    for candidate in invariants(task, relevant)? {
        let mut by_key: BTreeMap<Key, (usize, Vec<AtomId>)> = BTreeMap::new();
        for atom in limits.watch(sorted(relevant)) {
            let atom = atom?;
            if let Some(key) = key_of(task, &candidate, atom) {
                let entry = by_key.entry(key).or_default();
                entry.0 += usize::from(task.world.is_initial(atom));
                entry.1.push(atom);
            }
        }
        // If two atoms with equal keys are initially true, the atoms with this key are not mutually exclusive.
        instances.extend(by_key.into_values().filter(|(weight, _)| *weight <= 1).map(|(_, atoms)| atoms));
    }
    cover(&instances, limits)
}

/// Greedy set cover: repeatedly selects the group with the most uncovered atoms; ties are broken by order.
fn cover(instances: &[Vec<AtomId>], limits: &Limits) -> Result<Vec<Group>, Interrupted> {
    let mut covered: FxHashSet<AtomId> = FxHashSet::default();
    let mut selected = Vec::new();
    // The number of uncovered atoms of a group only decreases. If the number stored in the heap is still
    // correct, the group has the maximum.
    let filed = |(index, atoms): (usize, &Vec<AtomId>)| (atoms.len(), Reverse(index));
    let mut open: BinaryHeap<(usize, Reverse<usize>)> = instances.iter().enumerate().map(filed).collect();
    let mut pulse = limits.pulse();
    while let Some((size, Reverse(index))) = open.pop() {
        pulse.beat()?;
        let group = &instances[index];
        let atoms: Vec<AtomId> = group.iter().filter(|atom| !covered.contains(*atom)).copied().collect();
        // A variable for a single atom needs no mutex group.
        if atoms.len() < 2 {
            continue;
        }
        if atoms.len() < size {
            open.push((atoms.len(), Reverse(index)));
            continue;
        }
        covered.extend(&atoms);
        selected.push(Group { atoms, exclusive: group.clone() });
    }
    Ok(selected)
}

fn sorted(atoms: &FxHashSet<AtomId>) -> Vec<AtomId> {
    let mut atoms_in_order: Vec<_> = atoms.iter().copied().collect();
    atoms_in_order.sort_unstable();
    atoms_in_order
}

fn key_of(task: &GroundTask<'_>, candidate: &Candidate, atom: AtomId) -> Option<Key> {
    let ((predicate, arguments), ()) = task.world.atoms.get_index(atom.index())?;
    let part = candidate.iter().find(|part| part.predicate == *predicate)?;
    Some(part.key.iter().map(|position| arguments[*position]).collect())
}

/// Returns the candidates that no operator violates. At most `CANDIDATE_LIMIT` candidates are checked. The
/// initial state is not considered.
#[expect(clippy::arithmetic_side_effects, reason = "no more than the limit on candidates")]
fn invariants(task: &GroundTask<'_>, relevant: &FxHashSet<AtomId>) -> Result<Vec<Candidate>, Interrupted> {
    let mut arities: BTreeMap<PredicateId, usize> = BTreeMap::new();
    for atom in relevant {
        if let Some(((predicate, arguments), ())) = task.world.atoms.get_index(atom.index()) {
            arities.insert(*predicate, arguments.len());
        }
    }
    let mut open: Vec<Candidate> = Vec::new();
    for (predicate, arity) in &arities {
        let positions: Vec<usize> = (0..*arity).collect();
        open.push(vec![Part { predicate: *predicate, key: positions.clone() }]);
        for counted in &positions {
            let key = positions.iter().copied().filter(|position| position != counted).collect();
            open.push(vec![Part { predicate: *predicate, key }]);
        }
    }
    let mut visited: FxHashSet<Candidate> = open.iter().cloned().collect();
    let mut accepted = Vec::new();
    let mut next = 0;
    while next < open.len() && next < CANDIDATE_LIMIT {
        let candidate = open[next].clone();
        next += 1;
        let mut broken = None;
        for operator in task.world.limits.watch(&task.operators) {
            broken = broken_by(task, &candidate, operator?);
            if broken.is_some() {
                break;
            }
        }
        match broken {
            None => accepted.push(candidate),
            Some((operator, key)) => {
                for refined in refinements(task, &candidate, operator, &key, &arities) {
                    if visited.insert(refined.clone()) {
                        open.push(refined);
                    }
                }
            }
        }
    }
    Ok(accepted)
}

struct Change<'o> {
    conditions: [&'o [GroundLiteral]; 2],
    adds: &'o [AtomId],
    deletes: &'o [AtomId],
}

impl Change<'_> {
    fn requires(&self, atom: AtomId) -> bool {
        self.conditions.iter().any(|literals| literals.binary_search(&(atom, true)).is_ok())
    }
}

/// Returns the operator with the key of an instance that it violates, or `None` if the operator preserves the
/// candidate. The operator violates an instance if it may increase the number of true atoms, or deletes an atom
/// without requiring it.
#[expect(clippy::arithmetic_side_effects, reason = "atoms of one operator are counted")]
fn broken_by<'o>(
    task: &GroundTask<'_>,
    candidate: &Candidate,
    operator: &'o GroundOperator,
) -> Option<(&'o GroundOperator, Key)> {
    let literals = &operator.condition.literals[..];
    let unconditional =
        Change { conditions: [literals, &[]], adds: &operator.adds, deletes: &operator.deletes };
    let conditional = operator.conditional.iter().map(|effect| Change {
        conditions: [literals, &effect.condition],
        adds: &effect.adds,
        deletes: &effect.deletes,
    });
    let deleted = |atom: &AtomId| {
        let mut effects = operator.conditional.iter().map(|effect| &effect.deletes);
        operator.deletes.contains(atom) || effects.any(|deletes| deletes.contains(atom))
    };
    // No change may increase the number of true atoms of a key, and no two changes may add atoms with equal
    // keys.
    let mut adding: Vec<Key> = Vec::new();
    for change in std::iter::once(unconditional).chain(conditional) {
        let mut balance: SmallVec<[(Key, i32); 4]> = SmallVec::new();
        let mut weigh = |key: Key, weight| match balance.iter_mut().find(|(entry, _)| *entry == key) {
            Some((_, sum)) => *sum += weight,
            None => balance.push((key, weight)),
        };
        // Adding an atom that is required to be true does not increase the number, unless the operator also deletes the
        // atom.
        let comes = |atom: &&AtomId| !change.requires(**atom) || deleted(atom);
        let added = change.adds.iter().filter(comes).filter_map(|atom| key_of(task, candidate, *atom));
        let added: SmallVec<[Key; 4]> = added.collect();
        added.iter().for_each(|key| weigh(key.clone(), 1));
        for atom in change.deletes {
            if let Some(key) = key_of(task, candidate, *atom) {
                // A deletion sets the variable to "none of these". This is wrong if another atom of the group
                // is true, so the deleted atom must be required.
                if !change.requires(*atom) {
                    return Some((operator, key));
                }
                weigh(key, -1);
            }
        }
        let heavy = balance.into_iter().filter(|(_, weight)| *weight > 0).map(|(key, _)| key);
        let twice = added.iter().filter(|key| adding.contains(*key)).cloned();
        if let Some(key) = heavy.chain(twice).min() {
            return Some((operator, key));
        }
        if !operator.conditional.is_empty() {
            adding.extend(added);
        }
    }
    None
}

/// Returns extensions of a violated candidate. Each extension adds the predicate of an atom that the operator deletes,
/// with the argument positions at which the atom has the objects of the key.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
fn refinements(
    task: &GroundTask<'_>,
    candidate: &Candidate,
    operator: &GroundOperator,
    key: &Key,
    arities: &BTreeMap<PredicateId, usize>,
) -> Vec<Candidate> {
    let mut refined = Vec::new();
    let conditional = operator.conditional.iter().flat_map(|effect| &effect.deletes);
    for atom in operator.deletes.iter().chain(conditional) {
        let Some(((predicate, arguments), ())) = task.world.atoms.get_index(atom.index()) else { continue };
        if candidate.iter().any(|part| part.predicate == *predicate) || !arities.contains_key(predicate) {
            continue;
        }
        let mut positions = Vec::new();
        for object in key {
            let free = (0..arguments.len()).find(|p| arguments[*p] == *object && !positions.contains(p));
            positions.extend(free);
        }
        // A predicate of the group has at most one argument outside the key. Atoms that represent running actions are
        // an exception: their arguments are all parameters of the action. From the start of the action, such an atom is
        // the value of the variable.
        let is_running = task.world.lifted.predicates.get(predicate.index()).is_some_and(|p| p.running);
        if positions.len() == key.len() && (arguments.len() <= key.len() + 1 || is_running) {
            let mut parts = candidate.clone();
            parts.push(Part { predicate: *predicate, key: positions });
            parts.sort_unstable();
            refined.push(parts);
        }
    }
    refined
}
