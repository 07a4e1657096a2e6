//! The temporal part of a search node: an incrementally propagated simple temporal network \[1\].
//!
//! The times of a sequence of happenings and the constraints between them form a simple temporal network. Later
//! happenings only add lower bounds: not before a time, and not within the separation of a time. The network
//! therefore keeps, for each kind of access to each atom, only the latest time as a lower bound. Starts of
//! running actions are *time points* that can still be delayed, together with the happenings that depend on
//! them, so that an end meets its constraints. An end fixes its time point at the earliest possible time.
//! Happenings that do not interfere are not ordered by their position in the sequence \[2\].
//!
//! Times are sums over the happenings of a sequence: fewer than 2^32 terms, each below 2^91 (a duration plus the
//! separation). Missing upper bounds (`Int::MAX`) take no part in arithmetic.
//!
//! \[1\] R. Dechter, I. Meiri, J. Pearl: Temporal constraint networks, Artificial Intelligence 49, 1991.
//! \[2\] A. Coles, A. Coles, M. Fox, D. Long: Forward-chaining partial-order planning, ICAPS 2010.

mod compare;
mod pack;

use task::number::{Int, dense};

use crate::concurrent::time::{TimeExpression, TimePoint, place};

/// A kind of access to an atom or a number.
pub(super) type Key = u32;

/// The start of an action under way: at its float and this much later.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RunningAction {
    pub(super) instance: u32,
    pub(super) float: TimePoint,
    pub(super) offset: Int,
    pub(super) duration: Int,
    /// Of an action with a condition over all that several happenings can keep up together: the last of them.
    last: Option<TimeExpression>,
}

#[derive(Debug, Clone)]
struct Start {
    lower: TimeExpression,
    /// The start is not after this.
    upper: Int,
}

/// The times that matter in a node of the search.
#[derive(Debug, Clone)]
pub(super) struct SimpleTemporalNetwork {
    /// Ascending by key.
    entries: Vec<(Key, TimeExpression)>,
    /// When variables got their values, ascending by variable; those of the initial state have no entry.
    changed: Vec<(u32, TimeExpression)>,
    floats: Vec<Start>,
    /// Ascending by instance; of one instance in the order in which its runs have started, and end.
    opens: Vec<RunningAction>,
    /// The time at which all must happen until each condition over all holds again.
    group: Option<(TimePoint, Int)>,
    /// Negative if nothing has happened.
    latest: TimeExpression,
    /// The time of the last timed initial literals; negative before.
    floor: Int,
}

/// Whether a happening is a start, an end, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Start,
    End,
    Whole,
}

/// A happening, as far as its time is concerned.
pub(super) struct Happening<'h> {
    pub(super) kind: Kind,
    pub(super) instance: u32,
    /// Of the instance, if it starts.
    pub(super) duration: Int,
    /// It lies this much after the last access of these kinds.
    pub(super) after: &'h [(Key, Int)],
    pub(super) marks: &'h [Key],
    /// Whether the instance has a condition over all that several happenings can keep up together.
    pub(super) joint: bool,
    /// Whether this happening writes what such a condition of an instance reads.
    pub(super) touches: &'h dyn Fn(u32) -> bool,
    /// The variables that get another value.
    pub(super) changes: &'h [u32],
    /// Whether every condition over all holds afterwards.
    pub(super) settled: bool,
}

/// Timed initial literals, as far as their time is concerned.
pub(super) struct Event<'h> {
    pub(super) time: Int,
    /// They lie this much after the last access of these kinds.
    pub(super) after: &'h [(Key, Int)],
    pub(super) marks: &'h [Key],
    /// The variables that get another value.
    pub(super) changes: &'h [u32],
    /// Whether every condition over all holds afterwards.
    pub(super) settled: bool,
}

impl SimpleTemporalNetwork {
    pub(super) fn opens(&self) -> &[RunningAction] {
        &self.opens
    }

    /// Whether a condition over all does not hold, and something else must happen at once.
    pub(super) fn unsettled(&self) -> bool {
        self.group.is_some()
    }

    /// How many runs of an instance are under way.
    pub(super) fn runs(&self, instance: u32) -> u32 {
        dense(self.opens.iter().filter(|open| open.instance == instance).count())
    }

    /// The time of the last timed initial literals; negative before.
    pub(super) fn floor(&self) -> Int {
        self.floor
    }

    /// Whether timed initial literals took place after everything else, with nothing under way.
    pub(super) fn waits(&self) -> bool {
        self.opens.is_empty() && self.floor > self.latest()
    }

    /// Whether timed initial literals to come lie far enough after the accesses that they interfere with, if everything so far
    /// happens as early as it can.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn are_apart(&self, time: Int, after: &[(Key, Int)]) -> bool {
        after.iter().all(|(key, by)| self.entry(*key).is_none_or(|entry| entry.base + by <= time))
    }

    /// Whether everything so far has happened by some time, as nothing of it can be put off.
    pub(super) fn finishes_by(&self, time: Int) -> bool {
        self.latest.lags.is_empty() && self.latest() <= time
    }

    /// When nothing has happened yet.
    pub(super) fn new() -> Self {
        Self {
            entries: Vec::new(),
            changed: Vec::new(),
            floats: Vec::new(),
            opens: Vec::new(),
            group: None,
            latest: TimeExpression::constant(-1),
            floor: -1,
        }
    }

    /// The least time at which everything so far has happened.
    pub(super) fn latest(&self) -> Int {
        self.latest.base.max(0)
    }

    /// The least time at which an action under way has started.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn start(&self, open: &RunningAction) -> Int {
        self.floats[place(open.float)].lower.base + open.offset
    }

    /// The least time at which a variable got its value; none if it has had it from the beginning.
    pub(super) fn changed(&self, variable: u32) -> Option<Int> {
        self.change(variable).map(|time| time.base)
    }

    fn change(&self, variable: u32) -> Option<&TimeExpression> {
        let position = self.changed.binary_search_by_key(&variable, |(own, _)| *own).ok()?;
        Some(&self.changed[position].1)
    }

    fn entry(&self, key: Key) -> Option<&TimeExpression> {
        let position = self.entries.binary_search_by_key(&key, |(own, _)| *own).ok()?;
        Some(&self.entries[position].1)
    }

    /// The clocks after a happening; none if no time is left for it.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn after(&self, happening: &Happening<'_>) -> Option<Self> {
        let mut next = self.clone();
        let mut lower = TimeExpression::constant(self.floor.max(0));
        for (key, by) in happening.after {
            if let Some(time) = self.entry(*key) {
                lower.delay_to(time, *by);
            }
        }
        for open in &self.opens {
            if let Some(last) = open.last.as_ref().filter(|_| (happening.touches)(open.instance)) {
                lower.delay_to(last, 0);
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
                    Some((other, at)) if other == float => (at == end).then_some((other, at))?,
                    Some((other, at)) => {
                        next.merge_time_points(float, other, at - end)?;
                        (other, at)
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

    /// The end of the action under way at a position will lie after accesses so far. None if no time is left for it.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn expect_end(&mut self, position: usize, after: &[(Key, Int)]) -> Option<()> {
        let RunningAction { float, offset, duration, .. } = self.opens[position];
        let end = offset + duration;
        let mut lower = TimeExpression::constant(0);
        for (key, by) in after {
            let Some(time) = self.entry(*key) else { continue };
            let known = &self.floats[place(float)].lower;
            let is_known = time.base + by - end <= known.base
                && time.lags.iter().all(|(other, lag)| {
                    let by = lag + by - end;
                    (*other == float && by <= 0) || known.lag(*other).is_some_and(|known| by <= known)
                });
            if !is_known {
                lower.delay_to(time, *by);
            }
        }
        if lower == TimeExpression::constant(0) {
            Some(())
        } else {
            self.tighten_lower_bound(float, &lower, end)
        }
    }

    /// A moment that is not before `lower`: the one at which all must happen, or a new one.
    fn moment(&mut self, lower: TimeExpression, group: Option<(TimePoint, Int)>) -> Option<(TimePoint, Int)> {
        if let Some((float, offset)) = group {
            self.tighten_lower_bound(float, &lower, offset)?;
            return Some((float, offset));
        }
        self.floats.push(Start { lower, upper: Int::MAX });
        Some((self.last_float(), 0))
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a float was pushed before")]
    fn last_float(&self) -> TimePoint {
        TimePoint::try_from(self.floats.len() - 1).expect("invariant: fewer actions under way than operators")
    }

    fn open(&mut self, (instance, duration): (u32, Int), float: TimePoint, offset: Int) {
        let position = self.opens.partition_point(|open| open.instance <= instance);
        self.opens.insert(position, RunningAction { instance, float, offset, duration, last: None });
    }

    /// The time that lies so much after a float.
    fn at(&self, float: TimePoint, offset: Int) -> TimeExpression {
        let mut time = self.floats[place(float)].lower.shifted(offset);
        time.put_off_after(float, offset);
        time
    }

    fn note(&mut self, happening: &Happening<'_>, time: &TimeExpression) {
        for key in happening.marks {
            match self.entries.binary_search_by_key(key, |(own, _)| *own) {
                Ok(position) => self.entries[position].1.delay_to(time, 0),
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
            let mut own = self.opens.iter_mut().rev();
            let started = own.find(|open| open.instance == happening.instance);
            started.expect("invariant: it has just started").last = Some(time.clone());
        }
        self.latest.delay_to(time, 0);
    }

    fn set_changed(&mut self, variable: u32, time: TimeExpression) {
        match self.changed.binary_search_by_key(&variable, |(own, _)| *own) {
            Ok(position) => self.changed[position].1 = time,
            Err(position) => self.changed.insert(position, (variable, time)),
        }
    }

    /// All times apart from those of the floats.
    fn times(&mut self) -> impl Iterator<Item = &mut TimeExpression> {
        let entries = self.entries.iter_mut().map(|(_, time)| time);
        let changed = self.changed.iter_mut().map(|(_, time)| time);
        let lasts = self.opens.iter_mut().filter_map(|open| open.last.as_mut());
        entries.chain(changed).chain(lasts).chain([&mut self.latest])
    }

    /// From now on, so much after a float is not before `lower`. None if that cannot be.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    fn tighten_lower_bound(&mut self, float: TimePoint, lower: &TimeExpression, offset: Int) -> Option<()> {
        let mut bound = lower.shifted(-offset);
        if bound.forget(float).is_some_and(|lag| lag > 0) {
            return None;
        }
        let before = bound.clone();
        for (other, lag) in &before.lags {
            let mut further = self.floats[place(*other)].lower.shifted(*lag);
            if further.forget(float).is_some_and(|lag| lag > 0) {
                return None;
            }
            bound.delay_to(&further, 0);
        }
        self.floats[place(float)].lower.delay_to(&bound, 0);
        let own = self.floats[place(float)].lower.clone();
        for time in self.times() {
            if let Some(lag) = time.lag(float) {
                time.delay_to(&own, lag);
            }
        }
        for index in 0..self.floats.len() {
            let other = &mut self.floats[index];
            if let Some(lag) = other.lower.lag(float) {
                let mut further = own.shifted(lag);
                if further.forget(dense(index)).is_some_and(|lag| lag > 0) {
                    return None;
                }
                other.lower.delay_to(&further, 0);
            }
        }
        self.propagate_upper_bounds()
    }

    /// What is before something that has to be before some time has to be before it, too. None if that cannot be.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    fn propagate_upper_bounds(&mut self) -> Option<()> {
        for _ in 0..self.floats.len() {
            for index in 0..self.floats.len() {
                let Start { lower, upper } = self.floats[index].clone();
                for (other, lag) in lower.lags.iter().filter(|_| upper < Int::MAX) {
                    let known = &mut self.floats[place(*other)].upper;
                    *known = (*known).min(upper - lag);
                }
            }
        }
        self.floats.iter().all(|start| start.lower.base <= start.upper).then_some(())
    }

    /// One float is another one and so much more.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    fn merge_time_points(&mut self, float: TimePoint, other: TimePoint, by: Int) -> Option<()> {
        let Start { mut lower, upper } = self.floats[place(float)].clone();
        let target = &mut self.floats[place(other)];
        if upper < Int::MAX {
            target.upper = target.upper.min(upper - by);
        }
        if target.lower.forget(float).is_some_and(|lag| lag + by > 0) {
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
                if further.forget(dense(index)).is_some_and(|lag| lag > 0) {
                    return None;
                }
                start.lower.delay_to(&further, 0);
            }
        }
        for open in self.opens.iter_mut().filter(|open| open.float == float) {
            (open.float, open.offset) = (other, open.offset + by);
        }
        self.propagate_upper_bounds()
    }

    /// Forgets floats that nothing hangs on, and numbers the others in the order of the actions under way.
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
        let mut floats: Vec<Start> = order.iter().map(|float| self.floats[place(*float)].clone()).collect();
        for start in &mut floats {
            start.lower.renumber(&numbers);
        }
        self.floats = floats;
        let renamed = |float: TimePoint| numbers[place(float)].unwrap_or(float);
        for open in &mut self.opens {
            open.float = renamed(open.float);
        }
        self.group = self.group.map(|(float, offset)| (renamed(float), offset));
    }

    /// The clocks after timed initial literals: nothing so far was after them, and nothing from now on is before. None if that cannot be.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    pub(super) fn timed(&self, event: &Event<'_>) -> Option<Self> {
        let mut next = self.clone();
        next.bound(&self.latest, event.time)?;
        for (key, by) in event.after {
            if let Some(time) = self.entry(*key) {
                next.bound(time, event.time - by)?;
            }
        }
        let now = TimeExpression::constant(event.time);
        next.floor = event.time;
        for key in event.marks {
            match next.entries.binary_search_by_key(key, |(own, _)| *own) {
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
            next.group = Some((next.last_float(), 0));
        }
        if event.settled {
            next.group = None;
        }
        next.propagate_upper_bounds()?;
        next.compact();
        Some(next)
    }

    /// A time is not after some moment. None if that cannot be.
    #[expect(clippy::arithmetic_side_effects, reason = "fewer than 2^32 happenings, less than 2^91 apart")]
    fn bound(&mut self, time: &TimeExpression, moment: Int) -> Option<()> {
        for (float, lag) in &time.lags {
            let upper = &mut self.floats[place(*float)].upper;
            *upper = (*upper).min(moment - lag);
        }
        (time.base <= moment).then_some(())
    }
}
