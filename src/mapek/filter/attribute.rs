//! Filter for the samples of one attribute: plausibility, hysteresis, debounce and staleness.
//!
//! Bounds of designs divide the values of an attribute into *cells*: within a cell, each bound is either satisfied
//! (kept) or violated (missed). A sample in the cell of the believed value is believed at once. A satisfied bound
//! counts as violated as soon as a sample violates it. A violated bound counts as satisfied only after a sample that
//! satisfies it by at least its band (a Schmitt trigger with the bound as one threshold \[1\]). Crossings of bounds are
//! debounced, each bound on its own.
//!
//! There is an exception if a lower bound of one design and an upper bound of another design are within one band of
//! each other. Each crossing then makes one of the designs unavailable. So a sample changes the cell only if it lies
//! beyond the band.
//!
//! Times are in microseconds and monotonic. Additional calls of [`AttributeFilter::elapse`] do not change the accepted
//! values.
//!
//! - \[1\] O. H. Schmitt: A thermionic trigger, Journal of Scientific Instruments 15, 1938.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::VecDeque;

use num_rational::BigRational;
use num_traits::ToPrimitive as _;
use serde_json::{Value, json};

/// A time since the start of the mission, or a duration, in microseconds.
pub(crate) type Micros = u64;

/// Side of a bound on which a design can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Least,
    Most,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Bound {
    pub value: BigRational,
    pub side: Side,
    /// Hysteresis: distance by which a sample must satisfy a violated bound before the bound counts as satisfied again,
    /// in the attribute's unit.
    pub band: BigRational,
}

/// Outcome for a sensor without a plausible sample for longer than its period.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stale {
    /// The last value stays.
    Keep,
    /// The measurement is withdrawn. The shipped rules do not violate a requirement without a measurement.
    Unknown,
    /// The value that satisfies the fewest bounds of designs.
    #[default]
    Worst,
}

impl Stale {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Keep => "keep",
            Self::Unknown => "unknown",
            Self::Worst => "worst",
        }
    }
}

/// Filter of one attribute. Any field values are valid; the default accepts every sample at once.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct AttributeFilter {
    pub bounds: Vec<Bound>,
    /// Number of the last `of` samples that must have crossed a bound before the crossing is believed; 0 and 1 disable
    /// the condition.
    pub agree: usize,
    /// Number of latest samples that `agree` considers; values below `agree` have the effect of `agree`.
    pub of: usize,
    /// Time for which all samples must have crossed a bound before the crossing is believed.
    pub debounce: Micros,
    pub minimum: Option<BigRational>,
    pub maximum: Option<BigRational>,
    /// Greatest plausible distance from the last plausible sample. A sample at a greater distance is rejected, unless
    /// it lies within this distance of the last sample rejected as a jump.
    pub jump: Option<BigRational>,
    /// Time without a plausible sample after which the sensor counts as silent; `None` for never.
    pub period: Option<Micros>,
    pub stale: Stale,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct AttributeState {
    believed: Option<BigRational>,
    /// Last plausible sample; `None` before the first sample and after silence.
    plausible: Option<BigRational>,
    /// Last sample rejected as a jump; `None` after a plausible sample.
    suspect: Option<BigRational>,
    /// Latest plausible samples, oldest first. Cleared by silence, and by a confirmed crossing if no other crossing is
    /// pending.
    recent: VecDeque<BigRational>,
    /// Crossings of the bounds, in their order; `None` for a bound that the last sample has not crossed.
    crossings: Vec<Option<Crossing>>,
    last_sample_time: Option<Micros>,
    silent: bool,
    /// Number of samples held back. Set to 0 when a crossing of a bound is confirmed, when silence sets the believed
    /// value to the worst one, and by the first sample after a withdrawal.
    pub held: u64,
}

/// Latest samples without a gap that lie on the other side of a bound than the believed value.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Crossing {
    since: Micros,
    /// The one of these samples that is nearest to the believed value, after hysteresis.
    nearest: BigRational,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hold {
    Range,
    Jump,
    Hysteresis,
    /// Samples have crossed a bound for too short a time, or too few of them agree.
    Debounce,
}

impl Hold {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Range => "range",
            Self::Jump => "jump",
            Self::Hysteresis => "hysteresis",
            Self::Debounce => "debounce",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Newly believed value: the sample, except in two cases. If the sample satisfies a violated bound by less than
    /// the bound's hysteresis, the value still violates this bound. If the crossing of a bound is not confirmed yet,
    /// the value has not crossed it.
    Accepted(BigRational),
    Held(Hold),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Elapsed {
    Accepted(BigRational),
    /// The sensor counts as silent from now on. Contains the newly believed value if the filter uses [`Stale::Worst`]
    /// and has bounds.
    Silent(Option<BigRational>),
}

impl AttributeFilter {
    /// Filters a sample. Call [`AttributeFilter::elapse`] first, so that changes with earlier due times are applied.
    pub(crate) fn sample(&self, state: &mut AttributeState, now: Micros, value: &BigRational) -> Verdict {
        let verdict = self.judge(state, now, value);
        if matches!(verdict, Verdict::Held(_)) {
            state.held += 1;
        }
        verdict
    }

    fn judge(&self, state: &mut AttributeState, now: Micros, value: &BigRational) -> Verdict {
        if !self.is_plausible(value) {
            return Verdict::Held(Hold::Range);
        }
        if self.is_jump(state, value) {
            state.suspect = Some(value.clone());
            return Verdict::Held(Hold::Jump);
        }
        state.suspect = None;
        state.plausible = Some(value.clone());
        state.last_sample_time = Some(now);
        let is_withdrawn = state.silent && self.stale == Stale::Unknown;
        state.silent = false;
        let Some(believed) = &state.believed else {
            state.believed = Some(value.clone());
            return Verdict::Accepted(value.clone());
        };
        let target = self.target(believed, value).into_owned();
        // There is no value that could stay, so the first sample after a withdrawal is not held back.
        if is_withdrawn {
            return self.accept(state, target);
        }
        state.recent.push_back(value.clone());
        while state.recent.len() > self.of.max(self.agree).max(1) {
            state.recent.pop_front();
        }
        state.crossings.resize(self.bounds.len(), None);
        for (bound, crossing) in self.bounds.iter().zip(&mut state.crossings) {
            *crossing = bound.is_crossed(believed, &target).then(|| match crossing.take() {
                None => Crossing { since: now, nearest: target.clone() },
                Some(Crossing { since, nearest }) => {
                    let is_nearer = compare(&target, &nearest) == compare(believed, &nearest);
                    Crossing { since, nearest: if is_nearer { target.clone() } else { nearest } }
                }
            });
        }
        if state.crossings.iter().all(Option::is_none) {
            if target != *value {
                return Verdict::Held(Hold::Hysteresis);
            }
            state.believed = Some(target.clone());
            return Verdict::Accepted(target);
        }
        match self.confirmed(state, now) {
            Some(target) => self.accept(state, target),
            None => Verdict::Held(Hold::Debounce),
        }
    }

    fn is_plausible(&self, value: &BigRational) -> bool {
        self.minimum.as_ref().is_none_or(|minimum| compare(value, minimum).is_ge())
            && self.maximum.as_ref().is_none_or(|maximum| compare(value, maximum).is_le())
    }

    fn is_jump(&self, state: &AttributeState, value: &BigRational) -> bool {
        let Some(jump) = &self.jump else { return false };
        let is_near = |sample: &BigRational| {
            if value > sample { value - sample <= *jump } else { sample - value <= *jump }
        };
        state.plausible.as_ref().is_some_and(|last| !is_near(last))
            && !state.suspect.as_ref().is_some_and(is_near)
    }

    /// Returns the time from which the crossing of a bound is confirmed, unless another sample arrives. `None` if too few
    /// samples agree.
    fn confirmed_from(&self, state: &AttributeState, bound: &Bound, crossing: &Crossing) -> Option<Micros> {
        let believed = state.believed.as_ref()?;
        let has_crossed = |sample: &&BigRational| bound.is_crossed(believed, &self.target(believed, sample));
        let is_agreed = self.agree <= 1 || state.recent.iter().filter(has_crossed).count() >= self.agree;
        is_agreed.then(|| crossing.since.saturating_add(self.debounce))
    }

    /// Returns the value to be believed if the crossing of a bound is confirmed at `now`: a sample, after hysteresis,
    /// that has crossed all confirmed bounds and no others.
    fn confirmed(&self, state: &AttributeState, now: Micros) -> Option<BigRational> {
        let believed = state.believed.as_ref()?;
        let mut confirmed = Vec::new();
        let mut nearest = Vec::new();
        for (bound, crossing) in self.bounds.iter().zip(&state.crossings) {
            if let Some(crossing) = crossing
                && self.confirmed_from(state, bound, crossing).is_some_and(|time| time <= now)
            {
                confirmed.push(bound);
                nearest.push(crossing.nearest.clone());
            }
        }
        if confirmed.is_empty() {
            return None;
        }
        let latest = state.recent.iter().rev().map(|sample| self.target(believed, sample).into_owned());
        let crosses_all =
            |target: &BigRational| confirmed.iter().all(|bound| bound.is_crossed(believed, target));
        // Nearer bounds are crossed whenever farther ones are, so that one of these samples has crossed no others.
        let crossed_count = |target: &BigRational| {
            self.bounds.iter().filter(|bound| bound.is_crossed(believed, target)).count()
        };
        latest.chain(nearest).filter(crosses_all).min_by_key(crossed_count)
    }

    fn accept(&self, state: &mut AttributeState, target: BigRational) -> Verdict {
        for (bound, crossing) in self.bounds.iter().zip(&mut state.crossings) {
            crossing.take_if(|crossing| !bound.is_crossed(&target, &crossing.nearest));
        }
        state.believed = Some(target.clone());
        // Samples that have crossed farther bounds still count for these.
        if state.crossings.iter().all(Option::is_none) {
            state.recent.clear();
        }
        state.held = 0;
        Verdict::Accepted(target)
    }

    pub(crate) fn due(&self, state: &AttributeState) -> Option<Micros> {
        let silent = self.silent_at(state);
        [silent, self.crossing_due(state)].into_iter().flatten().min()
    }

    fn silent_at(&self, state: &AttributeState) -> Option<Micros> {
        let period = self.period.filter(|_| !state.silent)?;
        Some(state.last_sample_time.unwrap_or(0).saturating_add(period).saturating_add(1))
    }

    /// Time at which the first change that is held will be believed.
    pub(super) fn crossing_due(&self, state: &AttributeState) -> Option<Micros> {
        let crossings = self.bounds.iter().zip(&state.crossings);
        crossings.filter_map(|(bound, crossing)| self.confirmed_from(state, bound, crossing.as_ref()?)).min()
    }

    /// Starts to measure the sensor's silence at `now`, unless the measurement has started before or a sample has
    /// arrived.
    pub(crate) fn begin(state: &mut AttributeState, now: Micros) {
        state.last_sample_time.get_or_insert(now);
    }

    /// Applies and returns the first change that is due at `now`. Must be called until the result is `None`.
    pub(crate) fn elapse(&self, state: &mut AttributeState, now: Micros) -> Option<Elapsed> {
        let due = self.due(state).filter(|due| *due <= now)?;
        if let Some(target) = self.confirmed(state, due) {
            let Verdict::Accepted(value) = self.accept(state, target) else { return None };
            return Some(Elapsed::Accepted(value));
        }
        state.silent = true;
        // A crossing before the silence does not count after it.
        state.crossings.clear();
        state.recent.clear();
        let worst = if self.stale == Stale::Worst { self.worst() } else { None };
        if let Some(worst) = &worst {
            state.believed = Some(worst.clone());
            state.held = 0;
        }
        // The first sample after silence can be far from the last one.
        state.plausible = None;
        Some(Elapsed::Silent(worst))
    }

    fn is_same_cell(&self, first: &BigRational, second: &BigRational) -> bool {
        self.bounds.iter().all(|bound| bound.keeps(first) == bound.keeps(second))
    }

    /// Returns the value to be believed after a sample, without debouncing. This is the sample, unless the sample
    /// satisfies violated bounds by less than their bands. Then a value is returned that still violates these bounds.
    fn target<'a>(&self, believed: &'a BigRational, sample: &'a BigRational) -> Cow<'a, BigRational> {
        let is_missed =
            |bound: &&Bound| !bound.keeps(believed) && bound.keeps(sample) && !bound.keeps_clearly(sample);
        let upper = self.bounds.iter().filter(|bound| bound.side == Side::Most).filter(is_missed);
        let lower = self.bounds.iter().filter(|bound| bound.side == Side::Least).filter(is_missed);
        let target = match (upper.max_by_key(|bound| &bound.value), lower.min_by_key(|bound| &bound.value)) {
            (Some(bound), _) | (None, Some(bound)) => self.beyond(bound),
            (None, None) => return Cow::Borrowed(sample),
        };
        if self.is_same_cell(&target, believed) { Cow::Borrowed(believed) } else { Cow::Owned(target) }
    }

    /// Returns a value that violates `bound`. Its distance from the bound is half the band of the bound, or half the
    /// distance to the next bound in this direction if that is less.
    fn beyond(&self, bound: &Bound) -> BigRational {
        let two = BigRational::from_integer(2.into());
        let values = self.bounds.iter().map(|neighbour| &neighbour.value);
        if bound.side == Side::Most {
            let next = values.filter(|neighbour| **neighbour > bound.value).min();
            let distance =
                next.map_or_else(|| bound.band.clone(), |next| (next - &bound.value).min(bound.band.clone()));
            &bound.value + distance / two
        } else {
            let next = values.filter(|neighbour| **neighbour < bound.value).max();
            let distance =
                next.map_or_else(|| bound.band.clone(), |next| (&bound.value - next).min(bound.band.clone()));
            &bound.value - distance / two
        }
    }

    /// Returns a value that satisfies the fewest bounds, from the lowest such cell; `None` without bounds.
    /// Cells without a plausible value do not count. A value beyond all bounds may lie outside of the plausible
    /// range, if another value of its cell does not.
    pub(crate) fn worst(&self) -> Option<BigRational> {
        let unit = BigRational::from_integer(1.into());
        let two = BigRational::from_integer(2.into());
        let mut values: Vec<&BigRational> = self.bounds.iter().map(|bound| &bound.value).collect();
        values.sort();
        values.dedup();
        let (first, last) = (*values.first()?, *values.last()?);
        // Only the plausible part of an interval between two bounds counts.
        let plausible_part = |pair: &[&BigRational]| {
            let low = self.minimum.as_ref().map_or(pair[0], |minimum| minimum.max(pair[0]));
            let high = self.maximum.as_ref().map_or(pair[1], |maximum| maximum.min(pair[1]));
            let middle = (low + high) / &two;
            (low <= high && middle > *pair[0] && middle < *pair[1]).then_some(middle)
        };
        let mut candidates: Vec<BigRational> = values.windows(2).filter_map(plausible_part).collect();
        if self.minimum.as_ref().is_none_or(|minimum| minimum < first) {
            candidates.push(first - &unit);
        }
        if self.maximum.as_ref().is_none_or(|maximum| maximum > last) {
            candidates.push(last + &unit);
        }
        candidates.extend(values.iter().copied().filter(|value| self.is_plausible(value)).cloned());
        candidates.sort();
        let kept_bounds = |value: &BigRational| self.bounds.iter().filter(|bound| bound.keeps(value)).count();
        candidates.into_iter().min_by_key(kept_bounds)
    }
}

/// Compares two numbers. Faster than [`BigRational::cmp`], which divides, if numerators and denominators fit into 64
/// bits.
pub(super) fn compare(left: &BigRational, right: &BigRational) -> Ordering {
    let parts = |number: &BigRational| Some((number.numer().to_i64()?, number.denom().to_i64()?));
    match (parts(left), parts(right)) {
        (Some((left_numerator, left_denominator)), Some((right_numerator, right_denominator))) => {
            let product = |a: i64, b: i64| i128::from(a) * i128::from(b);
            product(left_numerator, right_denominator).cmp(&product(right_numerator, left_denominator))
        }
        _ => left.cmp(right),
    }
}

impl Bound {
    pub(crate) fn keeps(&self, value: &BigRational) -> bool {
        match self.side {
            Side::Least => compare(value, &self.value).is_ge(),
            Side::Most => compare(value, &self.value).is_le(),
        }
    }

    fn is_crossed(&self, believed: &BigRational, value: &BigRational) -> bool {
        self.keeps(believed) != self.keeps(value)
    }

    pub(crate) fn keeps_clearly(&self, value: &BigRational) -> bool {
        match self.side {
            Side::Least => compare(value, &(&self.value + &self.band)).is_ge(),
            Side::Most => compare(value, &(&self.value - &self.band)).is_le(),
        }
    }
}

impl AttributeState {
    pub(crate) fn believing(value: Option<BigRational>) -> Self {
        Self { believed: value, ..Self::default() }
    }

    pub(crate) fn to_record(&self) -> Value {
        let text = |value: &Option<BigRational>| value.as_ref().map(ToString::to_string);
        let crossing = |crossing: &Option<Crossing>| {
            crossing.as_ref().map(|Crossing { since, nearest }| json!([since, nearest.to_string()]))
        };
        json!([
            text(&self.believed),
            text(&self.plausible),
            text(&self.suspect),
            self.recent.iter().map(ToString::to_string).collect::<Vec<_>>(),
            self.crossings.iter().map(crossing).collect::<Vec<_>>(),
            self.last_sample_time,
            self.silent,
            self.held
        ])
    }

    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let [believed, plausible, suspect, recent, crossings, last_sample_time, silent, held] =
            record.as_array()?.as_slice()
        else {
            return None;
        };
        let number = |value: &Value| -> Option<Option<BigRational>> {
            if value.is_null() { Some(None) } else { value.as_str()?.parse().ok().map(Some) }
        };
        let sample = |value: &Value| value.as_str()?.parse().ok();
        let crossing = |value: &Value| match value {
            Value::Null => Some(None),
            pair => Some(Some(Crossing { since: pair.get(0)?.as_u64()?, nearest: sample(pair.get(1)?)? })),
        };
        Some(Self {
            believed: number(believed)?,
            plausible: number(plausible)?,
            suspect: number(suspect)?,
            recent: recent.as_array()?.iter().map(sample).collect::<Option<_>>()?,
            crossings: crossings.as_array()?.iter().map(crossing).collect::<Option<_>>()?,
            last_sample_time: if last_sample_time.is_null() {
                None
            } else {
                Some(last_sample_time.as_u64()?)
            },
            silent: silent.as_bool()?,
            held: held.as_u64()?,
        })
    }
}
