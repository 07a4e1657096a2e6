//! Timed initial literals: what happens by itself while actions execute one after another.
//!
//! The definition is that of `validate`: an action may start at any time, and waiting is free. The times of the events divide the plan
//! into *phases*: phase i is the time from event i (included) to event i + 1 (excluded). What an action does depends on the phases of its start and its
//! end alone, and on whether it ends at the very time of an event; an earlier start within them never hurts, because one can wait. So
//! each instance becomes one operator for each such *passage*, which starts it as early as can be. A finite-domain variable is
//! the phase, a numeric variable the clock. A wait leads to the next event.
//!
//! Where "later than" has no earliest time, the action starts a *moment* later: so short a time that no two times that
//! differ, made of events and durations, are less than two moments apart. So whatever can be done at any time after can be done then.
//!
//! Events change the state at their time. A start or an end that *interferes* with an event (one changes what the other
//! reads, or they set an atom to different values) is not at its time [1, section 8.4; 2, section 2]; one that does not may be, and
//! then their order does not matter. An event at the time of an end is no part of the interval over which a condition holds.
//!
//! [1] M. Fox, D. Long: PDDL2.1: an extension to PDDL for expressing temporal planning domains, JAIR 20, 2003.
//! [2] S. Edelkamp, J. Hoffmann: PDDL2.2: the language for the classical part of IPC-4, technical report 195, 2004.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Zero};

use crate::ground::effects::{GroundChange, Moment};
use crate::ground::evaluate::{AtomId, World};
use crate::ground::instantiate::GroundOperator;
use crate::ground::normal_form::GroundCondition;
use crate::ground::numbers::Numbers;
use crate::ground::reads::{Reads, matches};
use crate::ground::residual::{Residual, constant_comparison};
use crate::lifted::{Arguments, Event, Lifted, ObjectId, Rational};
use crate::number::dense;
use crate::quantity::{Linear, NumericId, Quantity};

/// The atoms and the numeric variables that stand for time; none of them has a name in the files.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    clock: NumericId,
    /// Stands for a moment until all durations are known.
    moment: NumericId,
    phases: Vec<AtomId>,
    /// The last thing that happened was a wait.
    waited: AtomId,
    /// For each event its time and what becomes true or false.
    events: Vec<(Rational, Vec<(AtomId, bool)>)>,
    /// How many events have taken place at the start.
    first: usize,
}

/// When an action starts and ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passage<'t> {
    timeline: &'t Timeline,
    duration: &'t Quantity<Rational>,
    /// The phases of its start and its end.
    from: usize,
    to: usize,
    start: Start,
    end: End,
}

/// What sets the time of the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Start {
    /// It is whenever the action before has ended, even at the time of an event.
    Free,
    /// The same, but later than the event that begins its phase.
    Later,
    /// A moment after that event.
    AfterEvent,
    /// So that the action ends when it has to.
    ByEnd,
    /// The same, but later than the event that begins the phase of the start.
    LaterByEnd,
}

/// Where the end lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// In its phase, later than the event that begins it; or in the phase of the start.
    Inside,
    /// At the very time of that event.
    AtEvent,
}

/// When an operator starts at the earliest, besides not before what is before it has ended.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Timing<N> {
    /// Not before this.
    pub(crate) start: Option<N>,
    /// So that it does not end before this.
    pub(crate) end: Option<N>,
}

/// Under which conditions the start and the end of an instance interfere with each event; `True` among them if always.
pub(super) struct Conflicts {
    start: Vec<Vec<Residual>>,
    end: Vec<Vec<Residual>>,
}

impl Conflicts {
    /// For what the start and the end read and change.
    pub(super) fn new(
        world: &World<'_>,
        timeline: &Timeline,
        (start, at_start): (&Reads, &Moment),
        (end, at_end): (&Reads, &Moment),
    ) -> Self {
        let all = |reads: &Reads, moment: &Moment| {
            let events = timeline.events.iter();
            events.map(|(_, changes)| interference(world, changes, reads, moment)).collect()
        };
        Self { start: all(start, at_start), end: all(end, at_end) }
    }
}

/// The conditions before a happening under which it interferes with an event.
fn interference(
    world: &World<'_>,
    event: &[(AtomId, bool)],
    reads: &Reads,
    moment: &Moment,
) -> Vec<Residual> {
    let is_read = |(atom, _): &(AtomId, bool)| {
        let (predicate, arguments) = world.atom_key(*atom);
        reads.atoms.iter().any(|pattern| matches(pattern, predicate, arguments))
    };
    if event.iter().any(is_read) {
        return vec![Residual::True];
    }
    let opposite = |change: &GroundChange| match change {
        GroundChange::Atom(atom, holds) => event.contains(&(*atom, !holds)),
        GroundChange::Number { .. } => false,
    };
    let changes = moment.changes.iter().filter(|(_, change)| opposite(change));
    changes.map(|(condition, _)| condition.clone()).collect()
}

/// Lets the events of time 0 take place in the initial state.
#[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
pub(super) fn begin(lifted: &mut Lifted) {
    let phases = (lifted.time.first_phase.0..).map(ObjectId);
    for (event, phase) in lifted.events.iter().take_while(|event| !event.time.is_positive()).zip(phases) {
        let before: (_, Arguments) = (lifted.time.phase, [phase].into());
        let after: (_, Arguments) = (lifted.time.phase, [ObjectId(phase.0 + 1)].into());
        let own = event
            .changes
            .iter()
            .map(|(predicate, arguments, holds)| ((*predicate, arguments.clone()), *holds));
        for (fact, holds) in own.chain([(before, false), (after, true)]) {
            lifted.facts.retain(|known| *known != fact);
            if holds {
                lifted.facts.push(fact);
            }
        }
    }
}

impl Timeline {
    /// None if nothing happens by itself.
    #[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
    pub(super) fn new(world: &mut World<'_>, events: &[Event]) -> Option<Self> {
        if events.is_empty() {
            return None;
        }
        let own = &world.lifted.time;
        let (clock, moment, phase, waited) = (own.clock, own.moment, own.phase, own.waited);
        let first = own.first_phase;
        let phases = (0..=dense(events.len()))
            .map(|number| world.atom(phase, &[ObjectId(first.0 + number)]))
            .collect();
        let waited = world.atom(waited, &[]);
        let (clock, moment) = (world.clock(clock), world.clock(moment));
        let first = events.iter().take_while(|event| !event.time.is_positive()).count();
        let events = events
            .iter()
            .map(|event| {
                let changes = event.changes.iter();
                let changes =
                    changes.map(|(predicate, arguments, holds)| (world.atom(*predicate, arguments), *holds));
                (event.time.clone(), changes.collect())
            })
            .collect();
        Some(Self { clock, moment, phases, waited, events, first })
    }

    /// The ways in which an action of this duration can lie in time.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn passages<'t>(
        &'t self,
        duration: &'t Quantity<Rational>,
        conflicts: &Conflicts,
    ) -> Vec<(Passage<'t>, Interference)> {
        let extreme = |pick: fn(std::slice::Iter<'t, Rational>) -> Option<&'t Rational>| {
            let own = duration.tables.iter().filter_map(|table| pick(table.values.iter()));
            own.fold(duration.constant.clone(), |sum, value| sum + value)
        };
        let (least, most) = (extreme(Iterator::min), extreme(Iterator::max));
        let mut all = Vec::new();
        for from in self.first..self.phases.len() {
            let before = from.checked_sub(1);
            let own: &[Residual] = before.map_or(&[], |event| &conflicts.start[event]);
            for to in from..self.phases.len() {
                let apart =
                    |later: usize, earlier: usize| self.events[later].0.clone() - &self.events[earlier].0;
                // It starts before its phase ends, and ends in its phase or when that begins.
                if to > from && most <= apart(to - 1, from) {
                    break;
                }
                let fits = match (before, to < self.events.len()) {
                    (Some(before), true) => least < apart(to, before),
                    (None, true) => least < self.events[to].0,
                    _ => true,
                };
                if !fits {
                    continue;
                }
                let mut add = |start, end| {
                    let passage = Passage { timeline: self, duration, from, to, start, end };
                    let at_event = matches!(start, Start::Free | Start::ByEnd);
                    let start = if at_event { own.to_vec() } else { Vec::new() };
                    let end = if end == End::AtEvent { conflicts.end[to - 1].clone() } else { Vec::new() };
                    if !start.contains(&Residual::True) && !end.contains(&Residual::True) {
                        all.push((passage, Interference { start, end }));
                    }
                };
                if own.is_empty() || from < self.events.len() {
                    add(Start::Free, End::Inside);
                }
                if !own.is_empty() {
                    add(Start::AfterEvent, End::Inside);
                    if from < self.events.len() {
                        add(Start::Later, End::Inside);
                    }
                }
                if to > from {
                    // A moment after an event is not the time of an event.
                    add(if own.is_empty() { Start::ByEnd } else { Start::LaterByEnd }, End::Inside);
                    add(Start::ByEnd, End::AtEvent);
                    if !own.is_empty() {
                        add(Start::LaterByEnd, End::AtEvent);
                    }
                }
            }
        }
        all
    }

    /// What a goal needs besides: a plan does not end with a wait.
    pub(super) fn at_rest(&self) -> Residual {
        Residual::Literal { atom: self.waited, positive: false }
    }

    /// Waiting until the next event, from each phase.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn waits(&self, schema: u32) -> impl Iterator<Item = GroundOperator> + '_ {
        self.events.iter().enumerate().skip(self.first).map(move |(phase, (time, changes))| {
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
                timing: Timing::free(),
            }
        })
    }

    /// Puts a number for the moment, now that all durations are known; operators that cannot be there any more go.
    pub(super) fn settle(&self, operators: &mut Vec<GroundOperator>) {
        let durations = operators.iter().flat_map(|operator| {
            let tables = operator.duration.tables.iter().flat_map(|table| table.values.iter());
            tables.chain([&operator.duration.constant])
        });
        let times = self.events.iter().map(|(time, _)| time).chain(durations);
        // At most the separation that validators take for granted, so that nobody waits longer than need be.
        let unit =
            times.fold(BigInt::from(1000), |unit, time| num_integer::lcm(unit, time.to_big().denom() * 2_u8));
        let moment = Rational::from_big(BigRational::new(BigInt::from(1), unit));
        let put = |linear: &mut Linear<Rational>| {
            let position = linear.coefficients.iter().position(|(variable, _)| *variable == self.moment);
            if let Some(position) = position {
                let (_, factor) = linear.coefficients.remove(position);
                linear.quantity.constant = linear.quantity.constant.clone() + factor * &moment;
            }
        };
        operators.retain_mut(|operator| {
            operator.numeric_effects.each(&mut |value| put(value));
            let mut holds = true;
            operator.condition.comparisons.retain_mut(|(linear, strict)| {
                put(linear);
                let known = constant_comparison(linear, *strict);
                holds &= known != Some(Residual::False);
                known.is_none()
            });
            for (time, later) in [&mut operator.timing.start, &mut operator.timing.end].into_iter().flatten()
            {
                if std::mem::take(later) {
                    *time = time.clone() + &moment;
                }
            }
            holds
        });
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

impl<N> Timing<N> {
    /// As soon as what is before it has ended.
    pub(crate) fn free() -> Self {
        Self { start: None, end: None }
    }
}

/// Conditions that must not hold: before the start, and before the end.
pub(super) struct Interference {
    pub(super) start: Vec<Residual>,
    pub(super) end: Vec<Residual>,
}

impl<'t> Passage<'t> {
    /// The time of the start, in terms of the clock before.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    fn start(&self) -> Linear<Rational> {
        let events = &self.timeline.events;
        match self.start {
            Start::Free | Start::Later => Linear::variable(self.timeline.clock),
            Start::AfterEvent => self.later(&events[self.from - 1].0),
            Start::ByEnd | Start::LaterByEnd => {
                let mut start = match self.end {
                    End::Inside => self.later(&events[self.to - 1].0),
                    End::AtEvent => Linear::constant(events[self.to - 1].0.clone()),
                };
                let mut duration = self.duration.clone();
                duration.scale(&-Rational::one());
                start.quantity.add(&duration);
                start
            }
        }
    }

    /// A moment after a time.
    fn later(&self, time: &Rational) -> Linear<Rational> {
        let mut later = Linear::variable(self.timeline.moment);
        later.quantity.constant = time.clone();
        later
    }

    /// When an action can start and end so.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn conditions(&self) -> Vec<Residual> {
        let Timeline { clock, phases, events, .. } = self.timeline;
        let mut conditions = vec![Residual::Literal { atom: phases[self.from], positive: true }];
        let start = self.start();
        let mut end = start.clone();
        end.quantity.add(self.duration);
        let mut less = |earlier: &Linear<Rational>, mut later: Linear<Rational>, strict: bool| {
            later.add(&earlier.clone().negated());
            conditions.push(
                constant_comparison(&later, strict).unwrap_or(Residual::Compare { linear: later, strict }),
            );
        };
        let time = |event: usize| Linear::constant(events[event].0.clone());
        if self.from < events.len() {
            // After the last event any start can be put off.
            if !matches!(self.start, Start::Free | Start::Later) {
                less(&Linear::variable(*clock), start.clone(), false);
            }
            less(&start, time(self.from), true);
            if matches!(self.start, Start::Later | Start::LaterByEnd) {
                less(&time(self.from - 1), start.clone(), true);
            }
        }
        if self.to > self.from && self.end == End::Inside {
            less(&time(self.to - 1), end.clone(), true);
        }
        if self.to < events.len() {
            less(&end, time(self.to), true);
        }
        conditions
    }

    /// The events strictly between the start and the end, in order.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn events(&self) -> impl Iterator<Item = &'t [(AtomId, bool)]> + use<'t> {
        let last = if self.end == End::AtEvent { self.to - 1 } else { self.to };
        self.timeline.events[self.from..last].iter().map(|(_, changes)| &changes[..])
    }

    /// The event at the time of the end.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn event_at_end(&self) -> Option<&'t [(AtomId, bool)]> {
        (self.end == End::AtEvent).then(|| &self.timeline.events[self.to - 1].1[..])
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

    /// The clock after the action. It stands still once nothing more happens by itself, so that states do not differ for ever.
    pub(super) fn clock(&self) -> Option<(NumericId, Linear<Rational>)> {
        let Timeline { clock, events, .. } = self.timeline;
        if self.from == events.len() {
            return None;
        }
        if self.to == events.len() {
            return events.last().map(|(last, _)| (*clock, Linear::constant(last.clone())));
        }
        let mut end = self.start();
        end.quantity.add(self.duration);
        Some((*clock, end))
    }

    /// When it starts at the earliest, each time with whether a moment later is meant.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions of phases, of which there is one more than events; there is one before an end at or after an event"
    )]
    pub(super) fn timing(&self) -> Timing<(Rational, bool)> {
        let events = &self.timeline.events;
        let by_end = matches!(self.start, Start::ByEnd | Start::LaterByEnd);
        Timing {
            start: (self.start == Start::AfterEvent).then(|| (events[self.from - 1].0.clone(), true)),
            end: by_end.then(|| (events[self.to - 1].0.clone(), self.end == End::Inside)),
        }
    }
}
