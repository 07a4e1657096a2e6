//! Start and end of an action that takes no time are one happening: if they interfere, the action cannot be executed [1].
//!
//! [1] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, sections 7 and 8 (no moving targets).

use std::collections::BTreeSet;

use crate::certificate::faithful::formula::Formula;
use crate::certificate::faithful::linear::Linear;
use crate::certificate::faithful::meaning::Moment;
use crate::certificate::faithful::world::Key;
use pddl::ast::Assignment;

/// What an end of an action reads for certain: what is left of its conditions once everything static is decided.
#[derive(Default)]
struct Reads<'r> {
    atoms: BTreeSet<&'r Key>,
    fluents: BTreeSet<&'r Key>,
}

impl<'r> Reads<'r> {
    fn new(condition: &'r Formula, moment: &'r Moment) -> Self {
        let mut reads = Self::default();
        reads.formula(condition);
        for (guard, ..) in &moment.atoms {
            reads.formula(guard);
        }
        for (guard, _, _, value) in &moment.numbers {
            reads.formula(guard);
            if let Some(value) = value {
                reads.linear(value);
            }
        }
        reads
    }

    fn formula(&mut self, formula: &'r Formula) {
        match formula {
            Formula::All(parts) | Formula::Any(parts) => parts.iter().for_each(|part| self.formula(part)),
            Formula::Atom(key, _) => {
                self.atoms.insert(key);
            }
            Formula::Compare(linear, _) => self.linear(linear),
        }
    }

    fn linear(&mut self, linear: &'r Linear) {
        self.fluents.extend(linear.factors.keys());
    }
}

/// Whether two ends of an action interfere for certain, whatever the state.
pub(super) fn interfere(left: (&Formula, &Moment), right: (&Formula, &Moment)) -> bool {
    one_way(left, right) || one_way(right, left) || same_number(left.1, right.1)
}

/// Whether one changes what the other reads, or adds what the other deletes.
fn one_way((_, changing): (&Formula, &Moment), (condition, other): (&Formula, &Moment)) -> bool {
    let reads = Reads::new(condition, other);
    let certain = changing.atoms.iter().filter(|(guard, ..)| guard.is(true));
    let deletes =
        |key: &Key| other.atoms.iter().any(|(guard, own, holds)| own == key && !holds && guard.is(true));
    let mut certain = certain.map(|(_, key, holds)| (key, *holds));
    let mut numbers = changing.numbers.iter().filter(|(guard, ..)| guard.is(true));
    certain.any(|(key, holds)| reads.atoms.contains(key) || holds && deletes(key))
        || numbers.any(|(_, _, key, _)| reads.fluents.contains(key))
}

/// Whether both change a number otherwise than by adding to it, or by scaling it.
fn same_number(left: &Moment, right: &Moment) -> bool {
    let way = |kind: Assignment| match kind {
        Assignment::Assign => None,
        Assignment::Increase | Assignment::Decrease => Some(true),
        Assignment::ScaleUp | Assignment::ScaleDown => Some(false),
    };
    left.numbers.iter().filter(|(guard, ..)| guard.is(true)).any(|(_, kind, key, _)| {
        let mut others = right.numbers.iter().filter(|(guard, _, own, _)| own == key && guard.is(true));
        others.any(|(_, other, ..)| way(*kind).is_none() || way(*kind) != way(*other))
    })
}
