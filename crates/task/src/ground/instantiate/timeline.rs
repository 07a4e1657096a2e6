//! Timed initial literals: what happens by itself while actions execute one after another.
//!
//! The definition is that of `validate`: an action may start at any time, and waiting is free. The times of the events divide the plan
//! into *phases*: phase i is the time from event i (included) to event i + 1 (excluded). What an action does depends on the phases of its start and its
//! end alone, and on whether it ends at the very time of an event; an earlier start within them never hurts, because one can wait. So
//! each instance becomes one operator for each such *passage* (see `timeline_windows`), which starts it as early as can be. A finite-domain variable is
//! the phase, a numeric variable the clock. A wait leads to the next event.
//!
//! Where "later than" has no earliest time, the action starts a *moment* later: so short a time that no two times that
//! differ, made of events and durations, are less than two moments apart. So whatever can be done at any time after can be done then.
//!
//! Events change the state at their time. A start or an end that *interferes* with an event (one changes what the other
//! reads, or they set an atom to different values) is not at its time [1, section 8.4; 2, section 2]; one that does not may be, and
//! then their order does not matter. An event at the time of an end is not part of the interval over which a condition holds.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1: an extension to PDDL for expressing temporal planning domains, JAIR 20, 2003.
//! \[2\] S. Edelkamp, J. Hoffmann: PDDL2.2: the language for the classical part of IPC-4, technical report 195, 2004.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Zero;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::GroundCondition;
use crate::ground::vocabulary::numbers::Numbers;
use crate::ground::vocabulary::operator::GroundOperator;
use crate::ground::vocabulary::partial_eval::{Residual, constant_comparison};
use crate::ground::vocabulary::world::World;
use crate::lifted::{ObjectId, Rational};
use crate::number::dense;
use crate::task::quantity::{Linear, NumericId, Quantity};
use crate::task::timing::Timing;

/// The atoms and the numeric variables that stand for time; none of them has a name in the files.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    pub(super) clock: NumericId,
    /// Stands for a moment until all durations are known.
    pub(super) moment: NumericId,
    pub(super) phases: Vec<AtomId>,
    /// The last thing that happened was a wait.
    pub(super) waited: AtomId,
    /// For each event its time and what becomes true or false.
    pub(super) events: Vec<(Rational, Vec<(AtomId, bool)>)>,
    /// How many events have taken place at the start.
    pub(super) first: usize,
}

impl Timeline {
    /// None if nothing happens by itself.
    #[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
    pub(super) fn new(world: &mut World<'_>) -> Option<Self> {
        let events = &world.lifted.events[..];
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
