//! Interference between the start and the end of an action with duration 0. Start and end are then
//! one happening; if they interfere, the action cannot be executed [1].
//!
//! [1] M. Fox, D. Long: PDDL2.1, JAIR 20, 2003, sections 7 and 8 (no moving targets).

use crate::faithful::case::Moment;
use crate::faithful::formula::Formula;
use crate::faithful::reads::Reads;
use pddl::ast::Assignment;

type Half<'h> = (&'h Reads<'h>, &'h Moment);

pub(super) fn apart(left: Half<'_>, right: Half<'_>) -> Formula {
    let mut clashes = Vec::new();
    one_way(left.1, right, &mut clashes);
    one_way(right.1, left, &mut clashes);
    same_number(left.1, right.1, &mut clashes);
    Formula::junction(clashes.iter().map(Formula::negated), true)
}

/// Collects the conditions under which `changing` changes an atom or fluent that the other half
/// reads, or adds an atom that the other half deletes.
fn one_way(changing: &Moment, (reads, other): Half<'_>, clashes: &mut Vec<Formula>) {
    for (guard, key, holds) in &changing.atoms {
        if reads.atom(key) {
            clashes.push(guard.clone());
        }
        let deletes = other.atoms.iter().filter(|(_, own, kept)| *holds && !kept && own == key);
        clashes.extend(deletes.map(|(own, ..)| Formula::junction([guard.clone(), own.clone()], true)));
    }
    let numbers = changing.numbers.iter().filter(|(_, _, key, _)| reads.fluent(key));
    clashes.extend(numbers.map(|(guard, ..)| guard.clone()));
}

/// Collects the conditions under which the start and the end change the same number and the changes do not
/// commute. Increases and decreases commute with each other; so do scalings.
fn same_number(left: &Moment, right: &Moment, clashes: &mut Vec<Formula>) {
    let way = |kind: Assignment| match kind {
        Assignment::Assign => None,
        Assignment::Increase | Assignment::Decrease => Some(true),
        Assignment::ScaleUp | Assignment::ScaleDown => Some(false),
    };
    for (guard, kind, key, _) in &left.numbers {
        let conflicts = right
            .numbers
            .iter()
            .filter(|(_, other, own, _)| own == key && (way(*kind).is_none() || way(*kind) != way(*other)));
        clashes.extend(conflicts.map(|(own, ..)| Formula::junction([guard.clone(), own.clone()], true)));
    }
}
