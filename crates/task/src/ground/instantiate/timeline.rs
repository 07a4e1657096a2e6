//! Timed initial literals: events that occur during sequential execution.
//!
//! The semantics equals that of `validate`: an action may start at any time, and waiting is free. The events
//! divide the plan into *phases*: phase i is the time from event i (inclusive) to event i + 1 (exclusive),
//! where events are counted from 1. Phase 0 is the time before the first event. The effect of an action
//! depends only on the phases of its start and end, and on whether it ends exactly at an event. For fixed
//! phases, an earlier start is never worse, because waiting is possible. Each instance therefore becomes one
//! operator for each *window* (see `timeline_windows`), and the operator starts as early as possible. A
//! finite-domain variable holds the phase, and a numeric variable holds the clock. A wait operator advances to
//! the next event.
//!
//! If an action must start later than an event, there is no earliest start time. The action then starts one
//! *moment* after the event. The moment is so short that two distinct times, composed of events and
//! durations, always differ by at least two moments. Everything that is possible at some later time in the
//! phase is thus possible after one moment.
//!
//! Events change the state at their time. A start or end *interferes* with an event if one of them changes an
//! atom that the other reads, or both set an atom to different values. An interfering start or end cannot
//! occur at the time of the event [1, section 8.4; 2, section 2]. Otherwise it can, and the order of happening
//! and event is irrelevant. An over-all condition does not include an event at the time of the end.
//!
//! \[1\] M. Fox, D. Long: PDDL2.1: an extension to PDDL for expressing temporal planning domains,
//! JAIR 20, 2003.
//! \[2\] S. Edelkamp, J. Hoffmann: PDDL2.2: the language for the classical part of IPC-4, technical
//! report 195, 2004.

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

#[derive(Debug, Clone)]
pub(super) struct Timeline {
    pub(super) clock: NumericId,
    /// Placeholder variable for the length of the moment (a very short time after an event) until all
    /// durations are known.
    pub(super) moment: NumericId,
    pub(super) phases: Vec<AtomId>,
    pub(super) waited: AtomId,
    pub(super) events: Vec<(Rational, Vec<(AtomId, bool)>)>,
    /// Number of events at or before time 0.
    pub(super) first: usize,
}

impl Timeline {
    #[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
    pub(super) fn new(world: &mut World<'_>) -> Option<Self> {
        let events = &world.lifted.events[..];
        if events.is_empty() {
            return None;
        }
        let time = &world.lifted.time;
        let (clock, moment, phase, waited) = (time.clock, time.moment, time.phase, time.waited);
        let first = time.first_phase;
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

    /// Additional goal that the last step of a plan is not a wait.
    pub(super) fn at_rest(&self) -> Residual {
        Residual::Literal { atom: self.waited, positive: false }
    }

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

    /// Computes the length of the moment (a very short time after an event) from all durations and times of events,
    /// and substitutes it for the placeholder variable. Operators that become impossible are removed.
    pub(super) fn settle(&self, operators: &mut Vec<GroundOperator>) {
        let durations = operators.iter().flat_map(|operator| {
            let tables = operator.duration.tables.iter().flat_map(|table| table.values.iter());
            tables.chain([&operator.duration.constant])
        });
        let times = self.events.iter().map(|(time, _)| time).chain(durations);
        // The moment is at most 1/1000, the usual separation in validators. A longer moment would delay starts
        // unnecessarily.
        let unit =
            times.fold(BigInt::from(1000), |unit, time| num_integer::lcm(unit, time.to_big().denom() * 2_u8));
        let moment = Rational::from_big(BigRational::new(BigInt::from(1), unit));
        let substitute_moment = |linear: &mut Linear<Rational>| {
            let position = linear.coefficients.iter().position(|(variable, _)| *variable == self.moment);
            if let Some(position) = position {
                let (_, factor) = linear.coefficients.remove(position);
                linear.quantity.constant = linear.quantity.constant.clone() + factor * &moment;
            }
        };
        operators.retain_mut(|operator| {
            operator.numeric_effects.each(&mut |value| substitute_moment(value));
            let mut holds = true;
            operator.condition.comparisons.retain_mut(|(linear, strict)| {
                substitute_moment(linear);
                let truth_value = constant_comparison(linear, *strict);
                holds &= truth_value != Some(Residual::False);
                truth_value.is_none()
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
