//! The temporal part of a search node: an incrementally propagated simple temporal network \[1\].
//!
//! The times of a sequence of happenings and the constraints between them form a simple temporal network. A
//! later happening adds lower bounds: it takes place at or after an earlier time, or at least the separation
//! after it. The network therefore keeps only the latest time of each kind of access. Upper bounds come
//! only from timed initial literals, which earlier happenings must not follow. Happenings that must be
//! simultaneous share a *time point*. Starts of running actions are time points that can still be delayed,
//! together with the happenings that depend on them, so that an end meets its constraints. A time point
//! that is no longer needed is fixed at the earliest possible time. Happenings that do not interfere are
//! not ordered by their position in the sequence \[2\].
//!
//! Times are sums over the happenings of a sequence: fewer than 2^32 terms, each a duration plus the
//! separation, which have at most [`TimeNumber::TIME_BITS`] bits. Missing upper bounds
//! ([`TimeNumber::MAX`]) take no part in arithmetic.
//!
//! \[1\] R. Dechter, I. Meiri, J. Pearl: Temporal constraint networks, Artificial Intelligence 49, 1991.
//! \[2\] A. Coles, A. Coles, M. Fox, D. Long: Forward-chaining partial-order planning, ICAPS 2010.

mod compare;
mod pack;

use task::number::{Int, dense};

use crate::concurrent::time::{TimeExpression, TimePoint, place};
use crate::concurrent::time_number::TimeNumber;

/// Id of an access kind: a way of accessing (such as read or delete) one atom, number or design, or the end of
/// one action.
pub(super) type Key = u32;

/// A running action. The action starts `offset` after its time point `float`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RunningAction<T: TimeNumber = Int> {
    pub(super) instance: u32,
    pub(super) float: TimePoint,
    pub(super) offset: T,
    pub(super) duration: T,
    /// Time of the last happening that wrote an atom or number in the over-all condition of the
    /// action, initially its start. `None` unless several simultaneous happenings can maintain this
    /// condition jointly.
    last: Option<TimeExpression<T>>,
}

#[derive(Debug, Clone)]
struct Start<T: TimeNumber = Int> {
    lower: TimeExpression<T>,
    /// Upper bound on the time; `T::MAX` if the time is unbounded.
    upper: T,
}

#[derive(Debug, Clone)]
pub(super) struct SimpleTemporalNetwork<T: TimeNumber = Int> {
    /// Time of the latest access of each kind, sorted by key.
    entries: Vec<(Key, TimeExpression<T>)>,
    /// Time of the latest change of each goal variable and guard, sorted by variable. Other variables
    /// and those that never changed have no entry.
    changed: Vec<(u32, TimeExpression<T>)>,
    floats: Vec<Start<T>>,
    /// Running actions, sorted by instance. Runs of one instance are in the order of their starts,
    /// which is also the order of their ends.
    opens: Vec<RunningAction<T>>,
    /// If an over-all condition of a running action is violated, simultaneous happenings have to repair it:
    /// this is their time, as a time point and an offset. `None` if all these conditions hold.
    group: Option<(TimePoint, T)>,
    /// Time of the latest happening, not counting timed initial literals; -1 before the first one.
    latest: TimeExpression<T>,
    /// Time of the last timed initial literals that were applied; -1 before the first ones.
    floor: T,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Start,
    End,
    Whole,
}

pub(super) struct Happening<'h, T: TimeNumber = Int> {
    pub(super) kind: Kind,
    pub(super) instance: u32,
    /// Duration of the instance in internal time units, if the happening is a start.
    pub(super) duration: T,
    /// Access kinds that the happening must follow, each with the required distance.
    pub(super) after: &'h [(Key, T)],
    pub(super) marks: &'h [Key],
    /// `true` if several simultaneous happenings can maintain the instance's over-all condition jointly,
    /// because it has a disjunction, a comparison or a derived fact.
    pub(super) joint: bool,
    /// Returns `true` if the happening writes an atom or number in an over-all condition that several
    /// simultaneous happenings can maintain jointly. The argument is the instance with this condition.
    pub(super) touches: &'h dyn Fn(u32) -> bool,
    pub(super) changes: &'h [u32],
    /// `true` if the over-all conditions of all running actions hold after the happening.
    pub(super) settled: bool,
}

pub(super) struct Event<'h, T: TimeNumber = Int> {
    pub(super) time: T,
    pub(super) after: &'h [(Key, T)],
    pub(super) marks: &'h [Key],
    pub(super) changes: &'h [u32],
    pub(super) settled: bool,
}

impl<T: TimeNumber> SimpleTemporalNetwork<T> {
    pub(super) fn opens(&self) -> &[RunningAction<T>] {
        &self.opens
    }

    /// Returns `true` if some over-all condition is violated, so that another happening must follow
    /// at the same time.
    pub(super) fn unsettled(&self) -> bool {
        self.group.is_some()
    }

    pub(super) fn runs(&self, instance: u32) -> u32 {
        dense(self.opens.iter().filter(|open| open.instance == instance).count())
    }

    pub(super) fn floor(&self) -> T {
        self.floor
    }

    /// Returns `true` if no action is running and the last timed initial literals took place after
    /// time 0 and after all other happenings.
    pub(super) fn waits(&self) -> bool {
        self.opens.is_empty() && self.floor > self.latest()
    }

    /// Returns `true` if timed initial literals at `time` keep the required distances to the
    /// earliest times of previous accesses. `after` lists kinds of access, each with its distance.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn are_apart(&self, time: T, after: &[(Key, T)]) -> bool {
        after.iter().all(|(key, by)| self.entry(*key).is_none_or(|entry| entry.base + *by <= time))
    }

    /// Returns `true` if all happenings take place at or before `time` and no delay of a running
    /// action can delay them.
    pub(super) fn finishes_by(&self, time: T) -> bool {
        self.latest.lags.is_empty() && self.latest() <= time
    }

    pub(super) fn new() -> Self {
        Self {
            entries: Vec::new(),
            changed: Vec::new(),
            floats: Vec::new(),
            opens: Vec::new(),
            group: None,
            latest: TimeExpression::constant(T::from(-1)),
            floor: T::from(-1),
        }
    }

    /// Earliest possible time of the latest happening; 0 before the first one.
    pub(super) fn latest(&self) -> T {
        self.latest.base.max(T::ZERO)
    }

    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn start(&self, open: &RunningAction<T>) -> T {
        self.floats[place(open.float)].lower.base + open.offset
    }

    /// Earliest possible time of the latest change of a variable. Returns `None` if the variable
    /// never changed, or if its changes are not recorded: it is neither in the goal nor in
    /// `TemporalTask::guards`.
    pub(super) fn changed(&self, variable: u32) -> Option<T> {
        self.change(variable).map(|time| time.base)
    }

    pub(super) fn accesses(&self) -> impl Iterator<Item = (Key, T)> {
        self.entries.iter().map(|(key, time)| (*key, time.base))
    }

    fn change(&self, variable: u32) -> Option<&TimeExpression<T>> {
        let position = self.changed.binary_search_by_key(&variable, |(candidate, _)| *candidate).ok()?;
        Some(&self.changed[position].1)
    }

    fn entry(&self, key: Key) -> Option<&TimeExpression<T>> {
        let position = self.entries.binary_search_by_key(&key, |(candidate, _)| *candidate).ok()?;
        Some(&self.entries[position].1)
    }

    /// Returns the network after a further happening, or `None` if the constraints are
    /// inconsistent.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn after(&self, happening: &Happening<'_, T>) -> Option<Self> {
        let mut next = self.clone();
        let mut lower = TimeExpression::constant(self.floor.max(T::ZERO));
        for (key, by) in happening.after {
            if let Some(time) = self.entry(*key) {
                lower.delay_to(time, *by);
            }
        }
        for open in &self.opens {
            if let Some(last) = open.last.as_ref().filter(|_| (happening.touches)(open.instance)) {
                lower.delay_to(last, T::ZERO);
            }
        }
        let (float, offset) = match happening.kind {
            Kind::Start => {
                let (float, offset) = next.moment(lower, self.group)?;
                next.open((happening.instance, happening.duration), float, offset);
                (float, offset)
            }
            Kind::End => {
                let position = next.opens.iter().position(|open| open.instance == happening.instance)?;
                let RunningAction { float, offset, duration, .. } = next.opens.remove(position);
                let end = offset + duration;
                next.tighten_lower_bound(float, &lower, end)?;
                match self.group {
                    Some((target, at)) if target == float => (at == end).then_some((target, at))?,
                    Some((target, at)) => {
                        next.merge_time_points(float, target, at - end)?;
                        (target, at)
                    }
                    None => (float, end),
                }
            }
            Kind::Whole => next.moment(lower, self.group)?,
        };
        let time = next.at(float, offset);
        next.note(happening, &time);
        next.group = (!happening.settled).then_some((float, offset));
        next.compact();
        Some(next)
    }

    /// Constrains the end of the running action at `position` in `opens` to be far enough behind
    /// earlier accesses. `after` lists the access kinds that the end must follow, each with the
    /// required distance. Returns `None` if the network becomes inconsistent.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn expect_end(&mut self, position: usize, after: &[(Key, T)]) -> Option<()> {
        let RunningAction { float, offset, duration, .. } = self.opens[position];
        let end = offset + duration;
        let mut lower = TimeExpression::constant(T::ZERO);
        for (key, by) in after {
            let Some(time) = self.entry(*key) else { continue };
            let current = &self.floats[place(float)].lower;
            let is_implied = time.base + *by - end <= current.base
                && time.lags.iter().all(|(source, lag)| {
                    let by = *lag + *by - end;
                    (*source == float && by <= T::ZERO)
                        || current.lag(*source).is_some_and(|current| by <= current)
                });
            // Constraints that are already implied are skipped, because propagation is expensive.
            if !is_implied {
                lower.delay_to(time, *by);
            }
        }
        if lower == TimeExpression::constant(T::ZERO) {
            Some(())
        } else {
            self.tighten_lower_bound(float, &lower, end)
        }
    }

    /// Time point and offset for a happening not before `lower`. The pair is `group`, or a new time
    /// point and 0. Returns `None` if the network becomes inconsistent.
    fn moment(&mut self, lower: TimeExpression<T>, group: Option<(TimePoint, T)>) -> Option<(TimePoint, T)> {
        if let Some((float, offset)) = group {
            self.tighten_lower_bound(float, &lower, offset)?;
            return Some((float, offset));
        }
        self.floats.push(Start { lower, upper: T::MAX });
        Some((self.last_float(), T::ZERO))
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a float was pushed before")]
    fn last_float(&self) -> TimePoint {
        TimePoint::try_from(self.floats.len() - 1).expect("invariant: fewer actions under way than operators")
    }

    fn open(&mut self, (instance, duration): (u32, T), float: TimePoint, offset: T) {
        let position = self.opens.partition_point(|open| open.instance <= instance);
        self.opens.insert(position, RunningAction { instance, float, offset, duration, last: None });
    }

    fn at(&self, float: TimePoint, offset: T) -> TimeExpression<T> {
        let mut time = self.floats[place(float)].lower.shifted(offset);
        time.put_off_after(float, offset);
        time
    }

    fn note(&mut self, happening: &Happening<'_, T>, time: &TimeExpression<T>) {
        for key in happening.marks {
            match self.entries.binary_search_by_key(key, |(candidate, _)| *candidate) {
                Ok(position) => self.entries[position].1.delay_to(time, T::ZERO),
                Err(position) => self.entries.insert(position, (*key, time.clone())),
            }
        }
        for variable in happening.changes {
            self.set_changed(*variable, time.clone());
        }
        for open in &mut self.opens {
            if open.last.is_some() && (happening.touches)(open.instance) {
                open.last = Some(time.clone());
            }
        }
        if happening.kind == Kind::Start && happening.joint {
            let mut newest_first = self.opens.iter_mut().rev();
            let running = newest_first.find(|open| open.instance == happening.instance);
            running.expect("invariant: it has just running").last = Some(time.clone());
        }
        self.latest.delay_to(time, T::ZERO);
    }

    fn set_changed(&mut self, variable: u32, time: TimeExpression<T>) {
        match self.changed.binary_search_by_key(&variable, |(candidate, _)| *candidate) {
            Ok(position) => self.changed[position].1 = time,
            Err(position) => self.changed.insert(position, (variable, time)),
        }
    }

    /// All time expressions of the network except the lower bounds of time points.
    fn times(&mut self) -> impl Iterator<Item = &mut TimeExpression<T>> {
        let entries = self.entries.iter_mut().map(|(_, time)| time);
        let changed = self.changed.iter_mut().map(|(_, time)| time);
        let lasts = self.opens.iter_mut().filter_map(|open| open.last.as_mut());
        entries.chain(changed).chain(lasts).chain([&mut self.latest])
    }

    /// Constrains `float + offset` to be at least `lower`, and propagates. Returns `None` if the
    /// network becomes inconsistent.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn tighten_lower_bound(&mut self, float: TimePoint, lower: &TimeExpression<T>, offset: T) -> Option<()> {
        let mut bound = lower.shifted(-offset);
        // A positive lag of the time point after itself would be a positive cycle.
        if bound.forget(float).is_some_and(|lag| lag > T::ZERO) {
            return None;
        }
        let before = bound.clone();
        for (source, lag) in &before.lags {
            let mut further = self.floats[place(*source)].lower.shifted(*lag);
            if further.forget(float).is_some_and(|lag| lag > T::ZERO) {
                return None;
            }
            bound.delay_to(&further, T::ZERO);
        }
        self.floats[place(float)].lower.delay_to(&bound, T::ZERO);
        let new_bound = self.floats[place(float)].lower.clone();
        for time in self.times() {
            if let Some(lag) = time.lag(float) {
                time.delay_to(&new_bound, lag);
            }
        }
        for index in 0..self.floats.len() {
            let dependent = &mut self.floats[index];
            if let Some(lag) = dependent.lower.lag(float) {
                let mut further = new_bound.shifted(lag);
                if further.forget(dense(index)).is_some_and(|lag| lag > T::ZERO) {
                    return None;
                }
                dependent.lower.delay_to(&further, T::ZERO);
            }
        }
        self.propagate_upper_bounds()
    }

    /// Propagates upper bounds of time points backwards along lower bounds. Returns `None` if an
    /// upper bound falls below a lower bound.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn propagate_upper_bounds(&mut self) -> Option<()> {
        for _ in 0..self.floats.len() {
            for index in 0..self.floats.len() {
                let Start { lower, upper } = self.floats[index].clone();
                for (source, lag) in lower.lags.iter().filter(|_| upper < T::MAX) {
                    let source_upper = &mut self.floats[place(*source)].upper;
                    *source_upper = (*source_upper).min(upper - *lag);
                }
            }
        }
        self.floats.iter().all(|start| start.lower.base <= start.upper).then_some(())
    }

    /// Replaces the time point `float` by `other + by` everywhere. Returns `None` if the network
    /// becomes inconsistent.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn merge_time_points(&mut self, float: TimePoint, other: TimePoint, by: T) -> Option<()> {
        let Start { mut lower, upper } = self.floats[place(float)].clone();
        let target = &mut self.floats[place(other)];
        if upper < T::MAX {
            target.upper = target.upper.min(upper - by);
        }
        if target.lower.forget(float).is_some_and(|lag| lag + by > T::ZERO) {
            return None;
        }
        lower.forget(float);
        self.tighten_lower_bound(other, &lower, by)?;
        let at = self.at(other, by);
        for time in self.times() {
            if let Some(lag) = time.forget(float) {
                time.delay_to(&at, lag);
            }
        }
        for index in 0..self.floats.len() {
            let start = &mut self.floats[index];
            if let Some(lag) = start.lower.forget(float) {
                let mut further = at.shifted(lag);
                if further.forget(dense(index)).is_some_and(|lag| lag > T::ZERO) {
                    return None;
                }
                start.lower.delay_to(&further, T::ZERO);
            }
        }
        for open in self.opens.iter_mut().filter(|open| open.float == float) {
            (open.float, open.offset) = (other, open.offset + by);
        }
        self.propagate_upper_bounds()
    }

    /// Removes the time points that neither a running action nor `group` refers to. Renumbers the others
    /// in the order of the running actions; the time point of `group` follows if no running action has it.
    fn compact(&mut self) {
        let mut order: Vec<TimePoint> = Vec::new();
        for float in self.opens.iter().map(|open| open.float).chain(self.group.map(|(float, _)| float)) {
            if !order.contains(&float) {
                order.push(float);
            }
        }
        let mut numbers: Vec<Option<TimePoint>> = vec![None; self.floats.len()];
        for (number, float) in (0..).zip(&order) {
            numbers[place(*float)] = Some(number);
        }
        for time in self.times() {
            time.renumber(&numbers);
        }
        let mut floats: Vec<Start<T>> =
            order.iter().map(|float| self.floats[place(*float)].clone()).collect();
        for start in &mut floats {
            start.lower.renumber(&numbers);
        }
        self.floats = floats;
        let renumbered = |float: TimePoint| numbers[place(float)].unwrap_or(float);
        for open in &mut self.opens {
            open.float = renumbered(open.float);
        }
        self.group = self.group.map(|(float, offset)| (renumbered(float), offset));
    }

    /// Returns the network after timed initial literals. Earlier happenings must take place no
    /// later than the literals, and later happenings no earlier. Returns `None` if the network
    /// becomes inconsistent.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    pub(super) fn timed(&self, event: &Event<'_, T>) -> Option<Self> {
        let mut next = self.clone();
        next.bound(&self.latest, event.time)?;
        for (key, by) in event.after {
            if let Some(time) = self.entry(*key) {
                next.bound(time, event.time - *by)?;
            }
        }
        let now = TimeExpression::constant(event.time);
        next.floor = event.time;
        for key in event.marks {
            match next.entries.binary_search_by_key(key, |(candidate, _)| *candidate) {
                Ok(position) => next.entries[position].1 = now.clone(),
                Err(position) => next.entries.insert(position, (*key, now.clone())),
            }
        }
        for variable in event.changes {
            next.set_changed(*variable, now.clone());
        }
        if let Some((float, offset)) = self.group {
            next.tighten_lower_bound(float, &now, offset)?;
            let upper = &mut next.floats[place(float)].upper;
            *upper = (*upper).min(event.time - offset);
        } else if !event.settled {
            next.floats.push(Start { lower: now, upper: event.time });
            next.group = Some((next.last_float(), T::ZERO));
        }
        if event.settled {
            next.group = None;
        }
        next.propagate_upper_bounds()?;
        next.compact();
        Some(next)
    }

    /// Constrains `time` to be at most `moment`. Returns `None` if the earliest value is already
    /// later.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "sums of fewer than 2^32 times fit, see `TimeNumber::TIME_BITS`"
    )]
    fn bound(&mut self, time: &TimeExpression<T>, moment: T) -> Option<()> {
        for (float, lag) in &time.lags {
            let upper = &mut self.floats[place(*float)].upper;
            *upper = (*upper).min(moment - *lag);
        }
        (time.base <= moment).then_some(())
    }
}
