//! The witness: an inductive over-approximation of the reachable states. It consists of the atoms
//! that may hold, an interval for each number, and possibly mutex groups (`exclusive`). It contains
//! the initial state and is closed under all action instances, under the delete relaxation [1],
//! [2].
//!
//! The witness is computed as a least fixpoint with widening of intervals [3]. Its check visits all
//! instances once and does not depend on the computation of the witness.
//!
//! [1] J. Hoffmann: The Metric-FF planning system, JAIR 20, 2003 (relaxed reachability with
//! intervals).
//! [2] S. Eriksson, G. Röger, M. Helmert: Unsolvability certificates for classical planning,
//! ICAPS 2017 (inductive sets).
//! [3] P. Cousot, R. Cousot: Abstract interpretation, POPL 1977.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use crate::faithful::case::Case;
use crate::faithful::exclusive::{self, Group};
use crate::faithful::formula::{Formula, Known, Structure};
use crate::faithful::key::{CLOCK, Key};
use crate::faithful::linear::{Interval, Linear};
use crate::faithful::relation::Relation;
use crate::faithful::verdict::{Cause, Difference};
use crate::faithful::world::World;
use crate::integer::MAX_DIGITS;

pub(super) const WITNESS_FORMAT: &str = "metaplan-witness/1";

/// Widening threshold: when an end of an interval has moved this number of times, it becomes
/// unbounded.
const WIDENING_THRESHOLD: u32 = 8;

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WitnessFile {
    format: String,
    atoms: Vec<String>,
    /// Lower and upper bound of each fluent that actions change; `null` means unbounded, as does a
    /// missing entry. Static fluents are not listed: they keep their initial values.
    numbers: Vec<(String, Option<String>, Option<String>)>,
    /// Mutex groups (atoms of which at most one holds) in addition to the variables of the task.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    exclusive: Vec<Vec<String>>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Invariant {
    atoms: Relation,
    /// The interval of each numeric fluent; a single value for a static fluent. A fluent without an
    /// entry is unbounded.
    numbers: FxHashMap<Key, Interval>,
    pub(super) exclusive: Vec<Group>,
}

impl Invariant {
    /// Creates the witness that contains only the initial state. The clock is unbounded.
    pub(super) fn initial(world: &World<'_>) -> Self {
        let atoms = world.initial_atoms().filter(|key| world.changes(key.0)).collect();
        let values = world.initial_values().filter(|(key, _)| key.0 != CLOCK);
        let numbers = values.map(|(key, value)| (key.clone(), Interval::point(value))).collect();
        Self { atoms, numbers, exclusive: Vec::new() }
    }

    pub(super) fn read(world: &World<'_>, text: &str) -> Result<Self, Difference> {
        let form = |reason: String| Difference::WitnessForm { reason };
        let written: WitnessFile = serde_json::from_str(text).map_err(|error| form(error.to_string()))?;
        if written.format != WITNESS_FORMAT {
            return Err(form(format!("format `{}`, where `{WITNESS_FORMAT}` is expected", written.format)));
        }
        let key = |text: &String| {
            world.written(text).ok_or_else(|| form(format!("{text} is nothing of the files")))
        };
        let number = |text: Option<String>| {
            let read = |text: String| {
                if text.len() > MAX_DIGITS {
                    return Err(form(format!(
                        "a fraction of {} characters, more than {MAX_DIGITS}",
                        text.len()
                    )));
                }
                let is_fraction = text.bytes().all(|byte| byte.is_ascii_digit() || b"-/".contains(&byte));
                let parsed = if is_fraction { text.parse::<BigRational>().ok() } else { None };
                parsed.ok_or_else(|| form(format!("{text} is not a fraction")))
            };
            text.map(read).transpose()
        };
        let mut witness = Self::default();
        for atom in &written.atoms {
            witness.atoms.insert(key(atom)?);
        }
        for (fluent, low, high) in written.numbers {
            let interval = Interval { low: number(low)?, high: number(high)? };
            if witness.numbers.insert(key(&fluent)?, interval).is_some() {
                return Err(form(format!("{fluent} has two intervals")));
            }
        }
        for group in &written.exclusive {
            let group: Group = group.iter().map(key).collect::<Result<_, _>>()?;
            if !exclusive::holds_initially(world, &group) {
                let words: Vec<String> = group.iter().map(|key| world.show(key)).collect();
                return Err(Difference::Exclusive { atoms: words.join(" or ") });
            }
            witness.exclusive.push(group);
        }
        let first = Self::initial(world);
        let missing = first.atoms.atoms().find(|key| !witness.atoms.contains(key));
        let outside = witness
            .numbers
            .iter()
            .find(|(key, interval)| first.numbers.get(*key).is_none_or(|own| !interval.contains(own)))
            .map(|(key, _)| key);
        if let Some(key) = missing.or(outside) {
            return Err(Difference::Witness { what: world.show(key) });
        }
        let constants = first.numbers.into_iter().filter(|(key, _)| !world.changes(key.0));
        witness.numbers.extend(constants);
        Ok(witness)
    }

    pub(super) fn write(&self, world: &World<'_>) -> String {
        let mut atoms: Vec<String> = self.atoms.atoms().map(|key| world.show(key)).collect();
        atoms.sort_unstable();
        let end = |end: &Option<BigRational>| end.as_ref().map(ToString::to_string);
        let number = |(key, own): (&Key, &Interval)| (world.show(key), end(&own.low), end(&own.high));
        let bounded = self
            .numbers
            .iter()
            .filter(|(key, own)| world.changes(key.0) && (own.low.is_some() || own.high.is_some()));
        let mut numbers: Vec<_> = bounded.map(number).collect();
        numbers.sort_unstable();
        let group = |group: &Group| group.iter().map(|key| world.show(key)).collect();
        let exclusive = self.exclusive.iter().map(group).collect();
        let written = WitnessFile { format: WITNESS_FORMAT.to_owned(), atoms, numbers, exclusive };
        serde_json::to_string(&written).unwrap_or_default()
    }

    pub(super) fn may_hold(&self, key: &Key) -> bool {
        self.atoms.contains(key)
    }

    pub(super) fn rows(&self, predicate: u32, place: Option<(usize, u32)>) -> impl Iterator<Item = &Key> {
        self.atoms.rows(predicate, place)
    }

    pub(super) fn count(&self, predicate: u32, place: Option<(usize, u32)>) -> usize {
        self.atoms.count(predicate, place)
    }

    pub(super) fn fluent(&self, key: Key) -> Linear {
        match self.numbers.get(&key).and_then(Interval::value) {
            Some(value) => Linear::constant(value.clone()),
            None => Linear::fluent(key),
        }
    }

    /// Replaces each fluent of an expression whose interval is a single value by this value.
    pub(super) fn settled(&self, linear: &Linear) -> Linear {
        let mut sum = Linear::constant(linear.constant.clone());
        for (key, factor) in &linear.factors {
            sum = sum.plus(&self.fluent(key.clone()), factor);
        }
        sum
    }

    /// Returns the condition that an expression is at least 0, or greater than 0 if `strict`. The
    /// result is a truth value if the intervals decide the condition.
    pub(super) fn compare(&self, linear: &Linear, strict: bool) -> Formula {
        let linear = self.settled(linear);
        let range = linear.range(|key| self.numbers.get(key));
        let fails = |number: &BigRational| number.is_negative() || strict && number.is_zero();
        if range.high.as_ref().is_some_and(fails) {
            Formula::truth(false)
        } else if range.low.as_ref().is_some_and(|low| !fails(low)) {
            Formula::truth(true)
        } else {
            Formula::Compare(linear, strict)
        }
    }

    fn range(&self, linear: &Linear, known: &Known) -> Interval {
        let mut range = linear.range(|key| self.numbers.get(key));
        for (own, _) in &known.comparisons {
            let Some(ratio) = linear.ratio_to(own) else { continue };
            let end = &linear.constant - &own.constant * &ratio;
            if ratio.is_positive() {
                if range.low.as_ref().is_none_or(|low| *low < end) {
                    range.low = Some(end);
                }
            } else if range.high.as_ref().is_none_or(|high| *high > end) {
                range.high = Some(end);
            }
        }
        range
    }

    pub(super) fn added<'c>(structure: &'c Structure, case: &'c Case) -> impl Iterator<Item = &'c Key> {
        let at_end = case
            .effects
            .iter()
            .filter(|(guard, _, holds)| *holds && case.known.decide(structure, guard) != Some(false));
        let deleted =
            |key: &Key| case.effects.iter().any(|(guard, own, holds)| own == key && !holds && guard.is(true));
        let at_start = case.truths.iter().filter(move |(key, holds)| **holds && !deleted(key));
        at_end.map(|(_, key, _)| key).chain(at_start.map(|(key, _)| key))
    }

    /// Checks that the witness contains all states after a case, and that the case preserves the
    /// mutex groups.
    pub(super) fn admits(
        &self,
        world: &World<'_>,
        structure: &Structure,
        case: &Case,
    ) -> Result<(), Difference> {
        let mut added = Self::added(structure, case);
        let new = added.find(|key| !self.atoms.contains(key));
        let outside = || {
            case.changes.iter().find_map(|(key, after)| {
                let interval = self.numbers.get(key)?;
                (!interval.contains(&self.range(after, &case.known))).then_some(key)
            })
        };
        if let Some(key) = new.or_else(outside) {
            return Err(Difference::Witness { what: world.show(key) });
        }
        let mut groups = exclusive::concerned(case, &self.exclusive);
        match groups.find(|group| !exclusive::keeps(structure, &|key| self.may_hold(key), case, group)) {
            Some(group) => {
                let words: Vec<String> = group.iter().map(|key| world.show(key)).collect();
                Err(Difference::Exclusive { atoms: words.join(" or ") })
            }
            None => Ok(()),
        }
    }
}

pub(super) struct Widening {
    pub(super) invariant: Invariant,
    /// Number of moves of each end of an interval (`true`: upper end).
    moves: FxHashMap<(Key, bool), u32>,
}

impl Widening {
    pub(super) fn new(world: &World<'_>) -> Self {
        Self { invariant: Invariant::initial(world), moves: FxHashMap::default() }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "fewer moves than passes over the task")]
    pub(super) fn include(&mut self, structure: &Structure, case: &Case) -> bool {
        let mut news = false;
        for key in Invariant::added(structure, case) {
            if !self.invariant.atoms.contains(key) {
                news |= self.invariant.atoms.insert(key.clone());
            }
        }
        for (key, after) in &case.changes {
            let range = self.invariant.range(after, &case.known);
            let Some(own) = self.invariant.numbers.get_mut(key) else { continue };
            let mut moved = |upper: bool, own: &mut Option<BigRational>, other: Option<BigRational>| {
                let Some(end) = own.as_ref() else { return };
                let outside =
                    other.as_ref().is_none_or(|other| if upper { other > end } else { other < end });
                if outside {
                    let count = self.moves.entry((key.clone(), upper)).or_default();
                    *count += 1;
                    *own = other.filter(|_| *count < WIDENING_THRESHOLD);
                    news = true;
                }
            };
            moved(false, &mut own.low, range.low);
            moved(true, &mut own.high, range.high);
        }
        news
    }
}

pub(super) fn too_many_rounds(limit: usize) -> Cause {
    Cause::TooMany { what: "rounds in search of a witness".into(), limit }
}
