//! Differences of snapshots from the initial snapshot of a mission. Most facts of a mission never change, so a
//! difference is much smaller than its snapshot, and facts that do not differ are not converted to JSON.

use std::collections::BTreeSet;

use pddl::ast::{Atom, InitialElement, Term};
use serde_json::{Value, json};

use crate::mapek::control::Loop;
use crate::mapek::record::{Snapshot, element_to_record, fields};

/// Initial state of a mission's loop, from which the differences of later snapshots are computed.
#[derive(Debug, Clone)]
pub struct Baseline {
    snapshot: Value,
    /// Facts of the snapshot, in its order. Timed initial literals are not part of snapshots.
    facts: Vec<InitialElement>,
}

impl Baseline {
    /// Returns the baseline of a loop that has not started.
    pub fn new(control: &Loop) -> Self {
        Self { snapshot: control.snapshot().0, facts: facts(control).cloned().collect() }
    }

    /// Returns the fields of the loop's snapshot that differ from those of the baseline, as a JSON object. The
    /// facts (`init`), if they differ, are a pair: the positions of removed initial facts, and the facts that follow
    /// the remaining ones.
    pub fn difference(&self, control: &Loop) -> Value {
        let mut changes = fields(control.beliefs());
        changes.insert("agenda".to_owned(), control.agenda_record());
        changes.retain(|name, value| self.snapshot.get(name) != Some(value));
        let (mut current, mut removed) = (facts(control).peekable(), Vec::new());
        for (position, fact) in self.facts.iter().enumerate() {
            if current.next_if(|other| have_equal_records(fact, other)).is_none() {
                removed.push(position);
            }
        }
        let added: Vec<Value> = current.filter_map(element_to_record).collect();
        if !removed.is_empty() || !added.is_empty() {
            changes.insert("init".to_owned(), json!([removed, added]));
        }
        Value::Object(changes)
    }

    /// Returns the snapshot that has this [difference](Self::difference) from the baseline. Its value is `null` if
    /// the difference is not an object.
    pub fn snapshot(&self, difference: Value) -> Snapshot {
        let mut snapshot = self.snapshot.clone();
        let (Some(fields), Value::Object(changes)) = (snapshot.as_object_mut(), difference) else {
            return Snapshot(Value::Null);
        };
        for (name, change) in changes {
            match (fields.get_mut(&name), &change[0], &change[1]) {
                (Some(Value::Array(facts)), Value::Array(removed), Value::Array(added)) if name == "init" => {
                    let removed: BTreeSet<u64> = removed.iter().filter_map(Value::as_u64).collect();
                    let mut position = 0..;
                    facts.retain(|_| position.next().is_none_or(|position| !removed.contains(&position)));
                    facts.extend(added.iter().cloned());
                }
                _ => drop(fields.insert(name, change)),
            }
        }
        Snapshot(snapshot)
    }
}

fn facts(control: &Loop) -> impl Iterator<Item = &InitialElement> {
    let init = &control.beliefs().mission().problem().init;
    init.iter().filter(|element| !matches!(element, InitialElement::Timed(..)))
}

/// Returns `true` if both elements have the same record in a snapshot. Unlike the equality of names, this
/// distinguishes upper and lower case.
fn have_equal_records(left: &InitialElement, right: &InitialElement) -> bool {
    use InitialElement::{Fact, NegatedFact, Value};
    match (left, right) {
        (Fact(left), Fact(right)) | (NegatedFact(left), NegatedFact(right)) => have_equal_words(left, right),
        (Value(left, value, _), Value(right, other, _)) => {
            // Records contain unreduced fractions: equal numbers can have different records.
            value.numer() == other.numer() && value.denom() == other.denom() && have_equal_words(left, right)
        }
        _ => false,
    }
}

fn have_equal_words(left: &Atom, right: &Atom) -> bool {
    fn word(term: &Term) -> &str {
        term.name().as_str()
    }
    left.predicate.name.as_str() == right.predicate.name.as_str()
        && left.arguments.iter().map(word).eq(right.arguments.iter().map(word))
}
