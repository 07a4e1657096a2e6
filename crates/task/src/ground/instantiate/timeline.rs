//! Timed initial literals: events that occur during sequential execution.
//!
//! The semantics is that of `validate`: an action may start at any time, and waiting is free. The
//! times of the events divide the plan into *phases*: phase i is the time from event i (inclusive)
//! to event i + 1 (exclusive). The effect of an action depends only on the phases of its start and
//! end, and on whether it ends exactly at an event. An earlier start within the phases is never
//! worse, because waiting is possible. Each instance therefore becomes an operator for each
//! *window* (see `timeline_windows`), which starts as early as possible. A finite-domain variable
//! is the phase, a numeric variable the clock. A wait leads to the next event.
//!
//! If "later than" has no earliest time, the action starts a *moment* later. The moment is so short
//! that two distinct times, composed of events and durations, always differ by at least two
//! moments. Anything possible at some later time within the phase is thus possible then.
//!
//! Events change the state at their time. A start or an end that *interferes* with an event (one
//! changes a read of the other, or they set an atom to different values) cannot be at its time [1,
//! section 8.4; 2, section 2]. Otherwise it can be, and their order is irrelevant. An event at the
//! time of an end is not part of the interval of an over-all condition.
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

/// Auxiliary atoms and numeric variables for time, without names in the files.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    pub(super) clock: NumericId,
    /// Placeholder for the moment until all durations are known.
    pub(super) moment: NumericId,
    pub(super) phases: Vec<AtomId>,
    /// Atom: the last step was a wait.
    pub(super) waited: AtomId,
    /// Times of the events with the changed atoms.
    pub(super) events: Vec<(Rational, Vec<(AtomId, bool)>)>,
    /// Number of events before the start of the plan.
    pub(super) first: usize,
}

impl Timeline {
    /// Returns `None` if there are no timed events.
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

    /// Additional goal: a plan must not end with a wait.
    pub(super) fn at_rest(&self) -> Residual {
        Residual::Literal { atom: self.waited, positive: false }
    }

    /// Returns the operators that wait until the next event, one for each phase.
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

    /// Replaces the placeholder by the moment, once all durations are known. Operators that become
    /// impossible are removed.
    pub(super) fn settle(&self, operators: &mut Vec<GroundOperator>) {
        let durations = operators.iter().flat_map(|operator| {
            let tables = operator.duration.tables.iter().flat_map(|table| table.values.iter());
            tables.chain([&operator.duration.constant])
        });
        let times = self.events.iter().map(|(time, _)| time).chain(durations);
        // The moment is at most the usual separation of validators, so that no start is later than
        // necessary.
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

/// Returns the atoms that ordered changes make true and false; the last change of an atom prevails.
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
