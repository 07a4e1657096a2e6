//! Resolves the initial state and the timed initial literals.

use rustc_hash::FxHashSet;

use crate::error::File;
use crate::lifted::{
    Arguments, Event, Function, FunctionId, ObjectId, Predicate, PredicateId, Rational, Term, Time,
};
use crate::normalize::names::{Names, Scope};
use crate::number::dense;
use pddl::ast::{self, Name};

/// Returns the initial facts in file order without duplicates, and the initial values of functions.
#[allow(clippy::type_complexity)]
pub(super) fn initial_state(
    names: &mut Names,
    problem: &ast::Problem,
) -> (Vec<(PredicateId, Arguments)>, Vec<(FunctionId, Arguments, Rational)>) {
    let (mut facts, mut values) = (Vec::new(), Vec::new());
    let mut stated = FxHashSet::default();
    for element in &problem.init {
        match element {
            ast::InitialElement::Fact(atom) => {
                let fact = (names.predicate(&atom.predicate, File::Problem), objects(names, atom));
                if stated.insert(fact.clone()) {
                    facts.push(fact);
                }
            }
            ast::InitialElement::NegatedFact(_) | ast::InitialElement::Timed(..) => {}
            ast::InitialElement::Value(atom, number, _) => {
                let number = Rational::from_big(number.clone());
                values.push((names.function(&atom.predicate, File::Problem), objects(names, atom), number));
            }
        }
    }
    (facts, values)
}

/// Creates the auxiliary symbols for time if there are timed events. Their names contain a space, so no name in
/// a PDDL file can equal them. Without timed events, the returned ids refer to no symbol.
#[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
pub(super) fn time(names: &mut Names, events: &[Event]) -> Time {
    let time = Time {
        clock: FunctionId(dense(names.functions.len())),
        moment: FunctionId(dense(names.functions.len() + 1)),
        phase: PredicateId(dense(names.predicates.len())),
        first_phase: ObjectId(dense(names.objects.len())),
        waited: PredicateId(dense(names.predicates.len() + 1)),
    };
    if !events.is_empty() {
        let predicate = |name, arity| Predicate {
            name: Name::new(name),
            arity,
            fluent: true,
            derived: false,
            running: false,
        };
        let function = |name| Function { name: Name::new(name), fluent: true, partial: false };
        names.functions.extend([function("the clock"), function("a moment")]);
        names.predicates.extend([predicate("the phase", 1), predicate("has waited", 0)]);
        names.objects.extend((0..=events.len()).map(|number| Name::new(&format!("phase {number}"))));
    }
    time
}

/// Returns the timed initial literals grouped by time, in chronological order. Literals of equal time keep
/// their file order, so that the last one about an atom takes effect.
pub(super) fn events(names: &mut Names, problem: &ast::Problem) -> Vec<Event> {
    let mut events: Vec<Event> = Vec::new();
    for element in &problem.init {
        let ast::InitialElement::Timed(time, atom, holds, _) = element else { continue };
        let time = Rational::from_big(time.clone());
        let change = (names.predicate(&atom.predicate, File::Problem), objects(names, atom), *holds);
        let position = events.partition_point(|event| event.time < time);
        match events.get_mut(position).filter(|event| event.time == time) {
            Some(event) => event.changes.push(change),
            None => events.insert(position, Event { time, changes: vec![change] }),
        }
    }
    events
}

fn objects(names: &mut Names, atom: &ast::Atom) -> Box<[ObjectId]> {
    let terms = names.terms(atom, &mut Scope::new(File::Problem));
    terms
        .iter()
        .filter_map(|term| if let Term::Object(object) = term { Some(*object) } else { None })
        .collect()
}
