//! Timed initial literals: what happens by itself while actions execute one after another.
//!
//! The times of the events divide the plan into phases. A numeric variable is the clock, a finite-domain variable says
//! which phase it is, and each instance becomes one operator for every pair of phases in which it may start and end: the events
//! in between take place after its start effects and before its end effects (PDDL 2.2, section 2 [1]). A wait ends with an
//! event. An event at the time at which an action starts comes before it; one at the time at which it ends, after it.
//!
//! [1] S. Edelkamp, J. Hoffmann: PDDL2.2: the language for the classical part of IPC-4, technical report 195, 2004.

use num_traits::{One, Zero};

use crate::ground::effects::Numbers;
use crate::ground::evaluate::{AtomId, World};
use crate::ground::instantiate::GroundOperator;
use crate::ground::normal_form::GroundCondition;
use crate::ground::residual::{Residual, constant_comparison};
use crate::lifted::{Event, Rational};
use crate::quantity::{Linear, NumericId, Quantity};

/// The atoms and the numeric variable that stand for time; none of them has a name in the files.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    clock: NumericId,
    phases: Vec<AtomId>,
    /// The last thing that happened was a wait.
    waited: AtomId,
    /// For each event its time and what becomes true or false.
    events: Vec<(Rational, Vec<(AtomId, bool)>)>,
}

/// The phases in which an action starts and ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passage<'t> {
    timeline: &'t Timeline,
    from: usize,
    to: usize,
}

impl Timeline {
    /// None if nothing happens by itself.
    pub(super) fn new(world: &mut World<'_>, events: &[Event]) -> Option<Self> {
        if events.is_empty() {
            return None;
        }
        let own = &world.lifted.time;
        let (clock, phase, waited) = (own.clock, own.phase, own.waited);
        let first = own.first_phase;
        let phases = (0..=events.len() as u32)
            .map(|number| world.atom(phase, &[crate::lifted::ObjectId(first.0 + number)]))
            .collect();
        let waited = world.atom(waited, &[]);
        let clock = world.clock(clock);
        let events = events
            .iter()
            .map(|event| {
                let changes = event.changes.iter();
                let changes =
                    changes.map(|(predicate, arguments, holds)| (world.atom(*predicate, arguments), *holds));
                (event.time.clone(), changes.collect())
            })
            .collect();
        Some(Self { clock, phases, waited, events })
    }

    /// The phases in which an action of this duration can start and end.
    pub(super) fn passages(&self, duration: &Quantity<Rational>) -> impl Iterator<Item = Passage<'_>> {
        let longest = duration.tables.iter().filter_map(|table| table.values.iter().max());
        let longest = longest.fold(duration.constant.clone(), |sum, value| sum + value);
        let fits = move |from: usize, to: usize| {
            // An action that starts in a phase starts before the phase ends.
            from == to || self.events[to - 1].0.clone() - &self.events[from].0 < longest
        };
        let all =
            (0..self.phases.len()).flat_map(move |from| (from..self.phases.len()).map(move |to| (from, to)));
        all.filter(move |(from, to)| fits(*from, *to)).map(|(from, to)| Passage { timeline: self, from, to })
    }

    /// What a goal needs besides: a plan does not end with a wait.
    pub(super) fn at_rest(&self) -> Residual {
        Residual::Literal { atom: self.waited, positive: false }
    }

    /// Waiting until the next event, from each phase.
    pub(super) fn waits(&self, schema: u32) -> impl Iterator<Item = GroundOperator> + '_ {
        self.events.iter().enumerate().map(move |(phase, (time, changes))| {
            let condition =
                GroundCondition { literals: vec![(self.phases[phase], true)], ..GroundCondition::default() };
            let mut last: Vec<(AtomId, bool)> = vec![(self.phases[phase], false)];
            last.extend(changes);
            last.extend([(self.phases[phase + 1], true), (self.waited, true)]);
            let (adds, deletes) = prevailing(&last);
            GroundOperator {
                schema,
                arguments: Vec::new(),
                slots: [].into(),
                forbidden: [].into(),
                configuration: Vec::new(),
                condition,
                adds,
                deletes,
                conditional: Vec::new(),
                numeric_effects: Numbers::one(self.clock, Linear::constant(time.clone())),
                costs: Vec::new(),
                duration: Quantity::constant(Rational::zero()),
                wait: Some(time.clone()),
            }
        })
    }
}

/// The atoms that become true and false by changes in order: the last one of an atom prevails.
fn prevailing(changes: &[(AtomId, bool)]) -> (Vec<AtomId>, Vec<AtomId>) {
    let (mut adds, mut deletes) = (Vec::new(), Vec::new());
    for (atom, holds) in changes {
        adds.retain(|known| known != atom);
        deletes.retain(|known| known != atom);
        if *holds { &mut adds } else { &mut deletes }.push(*atom);
    }
    adds.sort_unstable();
    deletes.sort_unstable();
    (adds, deletes)
}

impl<'t> Passage<'t> {
    /// When an action of this duration starts and ends in these phases.
    pub(super) fn conditions(&self, duration: &Quantity<Rational>) -> Vec<Residual> {
        let Timeline { clock, phases, events, .. } = self.timeline;
        let time = |phase: usize| Linear::constant(events[phase].0.clone());
        let start = Linear::variable(*clock);
        let mut end = start.clone();
        end.quantity.add(duration);
        let mut conditions = vec![Residual::Literal { atom: phases[self.from], positive: true }];
        let mut later = |mut later: Linear<Rational>, earlier: &Linear<Rational>, strict: bool| {
            later.add(&earlier.clone().negated());
            conditions.push(
                constant_comparison(&later, strict).unwrap_or(Residual::Compare { linear: later, strict }),
            );
        };
        if self.from < events.len() {
            later(time(self.from), &start, true);
        }
        if self.to > self.from {
            later(end.clone(), &time(self.to - 1), true);
        }
        if self.to < events.len() {
            later(time(self.to), &end, false);
        }
        conditions
    }

    /// The events between the start and the end, in order.
    pub(super) fn events(&self) -> impl Iterator<Item = &'t [(AtomId, bool)]> + use<'t> {
        self.timeline.events[self.from..self.to].iter().map(|(_, changes)| &changes[..])
    }

    /// What the action changes besides its own effects.
    pub(super) fn changes(&self) -> Vec<(AtomId, bool)> {
        let phases = &self.timeline.phases;
        let mut changes = vec![(self.timeline.waited, false)];
        if self.from != self.to {
            changes.extend([(phases[self.from], false), (phases[self.to], true)]);
        }
        changes
    }

    /// The clock after an action of this duration. It stands still once nothing more happens by itself, so that states
    /// do not differ for ever.
    pub(super) fn clock(&self, duration: &Quantity<Rational>) -> (NumericId, Linear<Rational>) {
        let Timeline { clock, events, .. } = self.timeline;
        let value = match events.last() {
            Some((last, _)) if self.to == events.len() => Linear::constant(last.clone()),
            _ => Linear { coefficients: vec![(*clock, Rational::one())], quantity: duration.clone() },
        };
        (*clock, value)
    }
}
