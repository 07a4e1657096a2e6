//! Forward pruning: relaxed reachability over ground operators and axioms.

use rustc_hash::FxHashMap;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::GroundLiteral;
use crate::ground::vocabulary::task::GroundTask;
use crate::limits::Interrupted;

/// Removes operators, rules and conditional effects that are unreachable in the delete relaxation, and
/// deletions of unreachable atoms. `initially` holds the initial truth value of each atom. Returns, for each
/// atom, whether it is reachable.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "what is missing is counted before it is reached, each time once; indices of axioms come after those of operators"
)]
pub(super) fn forward(task: &mut GroundTask<'_>, initially: &[bool]) -> Result<Vec<bool>, Interrupted> {
    let limits = task.world.limits;
    let axioms = &task.axioms;
    let operators = task.operators.iter().map(|operator| &operator.condition);
    let conditions = operators.chain(axioms.iter().map(|axiom| &axiom.body));
    let mut readers: FxHashMap<AtomId, Vec<usize>> = FxHashMap::default();
    let mut missing = Vec::with_capacity(task.operators.len() + axioms.len());
    let mut reached = initially.to_vec();
    let mut open: Vec<usize> = Vec::new();
    for item in limits.watch(conditions.enumerate()) {
        let (index, condition) = item?;
        // Negative literals are ignored: atoms are never deleted in the relaxation.
        let needs = condition.literals.iter().filter(|(atom, positive)| *positive && !reached[atom.index()]);
        let count = needs.map(|(atom, _)| readers.entry(*atom).or_default().push(index)).count();
        missing.push(count);
        if count == 0 {
            open.push(index);
        }
    }
    let mut pulse = limits.pulse();
    while let Some(index) = open.pop() {
        pulse.beat()?;
        let mut reach = |atom: AtomId| {
            if std::mem::replace(&mut reached[atom.index()], true) {
                return;
            }
            for reader in readers.get(&atom).into_iter().flatten() {
                missing[*reader] -= 1;
                if missing[*reader] == 0 {
                    open.push(*reader);
                }
            }
        };
        match task.operators.get(index) {
            Some(operator) => {
                // Conditional effects are assumed to occur; this is sound and only weakens the pruning.
                let conditional = operator.conditional.iter().flat_map(|effect| &effect.adds);
                operator.adds.iter().chain(conditional).for_each(|atom| reach(*atom));
            }
            None => reach(axioms[index - task.operators.len()].head),
        }
    }
    let mut keep = missing.iter().map(|count| *count == 0);
    task.operators.retain(|_| keep.next().unwrap_or(true));
    task.axioms.retain(|_| keep.next().unwrap_or(true));
    // Clauses are ignored above. A clause without a reachable literal makes its operator inapplicable.
    let possible = |&(atom, positive): &GroundLiteral| !positive || reached[atom.index()];
    task.operators
        .retain(|operator| operator.condition.clauses.iter().all(|clause| clause.iter().any(possible)));
    for operator in &mut task.operators {
        operator.deletes.retain(|atom| reached[atom.index()]);
        operator.conditional.retain(|effect| effect.condition.iter().all(possible));
        for effect in &mut operator.conditional {
            effect.deletes.retain(|atom| reached[atom.index()]);
        }
    }
    Ok(reached)
}
