//! The `temporal` library in its basic mode: durations, shifted moments, and Allen's relations between instants and
//! periods.
//!
//! A moment is an `xsd:date`, an `xsd:dateTime`, or the text of either. A text without a time zone may be truncated
//! after the year, month, day, hour or minute (`1998-12-02T12`); the missing parts have their smallest values. The text
//! of a date has no time zone. Moments are compared
//! by *granules*: years, months, days, hours, minutes, seconds or milliseconds. For example, 1999-12-31 and
//! 2000-01-01 differ by one year at the granularity of years. Moments with a time zone are converted to UTC. A moment
//! with a time zone and one without are incomparable. `now` is not supported, because conclusions from it would
//! change without a change of facts. An operation on a period takes the two instants that bound it as second and
//! third argument.

use std::cmp::Ordering;

use num_bigint::BigInt;
use num_traits::ToPrimitive;

use crate::builtin::custom::Definition;
use crate::literal::{Decimal, Duration, Literal, Moment, MomentKind, XSD};

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Granularity {
    Years,
    Months,
    Days,
    Hours,
    Minutes,
    Seconds,
    Milliseconds,
}

use Granularity as G;

impl Granularity {
    fn from_literal(literal: &Literal) -> Option<Self> {
        let Literal::String(name) = literal else { return None };
        Some(match name.to_ascii_lowercase().as_str() {
            "years" => G::Years,
            "months" => G::Months,
            "days" => G::Days,
            "hours" => G::Hours,
            "minutes" => G::Minutes,
            "seconds" => G::Seconds,
            "milliseconds" => G::Milliseconds,
            _ => return None,
        })
    }

    /// Returns the number of the granule (year, month, …) that contains a moment, counted from a fixed
    /// origin. `None` if the number exceeds the range of `i64`.
    fn granule(self, moment: &Moment) -> Option<i64> {
        let ([year, month, _], _) = moment.in_utc().calendar();
        let per_second = match self {
            G::Years => return Some(year),
            G::Months => return Some(year * 12 + month),
            G::Days => (1, 86_400),
            G::Hours => (1, 3600),
            G::Minutes => (1, 60),
            G::Seconds => (1, 1),
            G::Milliseconds => (1000, 1),
        };
        let seconds = moment.seconds().to_rational();
        let granules = seconds * BigInt::from(per_second.0) / BigInt::from(per_second.1);
        granules.floor().to_integer().to_i64()
    }

    fn duration(self, count: i64) -> Option<Duration> {
        let seconds = |unit: i64| Some(Duration::new(0, Decimal::from(count.checked_mul(unit)?)));
        match self {
            G::Years => Some(Duration::new(count.checked_mul(12)?, Decimal::from(0))),
            G::Months => Some(Duration::new(count, Decimal::from(0))),
            G::Days => seconds(86_400),
            G::Hours => seconds(3600),
            G::Minutes => seconds(60),
            G::Seconds => seconds(1),
            G::Milliseconds => Some(Duration::new(0, Decimal::new(count.into(), 3))),
        }
    }
}

/// Converts an argument to a moment: a date, a date with time, or the (possibly truncated) text of either. A truncated
/// literal of these datatypes is ill-typed, but accepted. Returns `None` for other literals.
fn moment(literal: &Literal) -> Option<Moment> {
    let text = match literal {
        Literal::Moment(moment) if moment.kind() != MomentKind::Time => return Some(moment.clone()),
        Literal::String(text) => text,
        Literal::IllTyped { lexical, datatype }
            if ["date", "dateTime"].iter().any(|local| datatype.strip_prefix(XSD) == Some(local)) =>
        {
            lexical
        }
        _ => return None,
    };
    let missing = match text.trim().len() {
        4 => "-01-01T00:00:00",
        7 => "-01T00:00:00",
        10 => "T00:00:00",
        13 => ":00:00",
        16 => ":00",
        _ => "",
    };
    let whole = format!("{}{missing}", text.trim());
    match Literal::parse(&whole, Some(&format!("{XSD}dateTime")), None) {
        Literal::Moment(moment) => Some(moment),
        _ => None,
    }
}

fn comparable(moments: &[Moment]) -> bool {
    moments.windows(2).all(|pair| pair[0].zone_text().is_empty() == pair[1].zone_text().is_empty())
}

/// Returns the distance of two moments in units of a granularity, the third argument. Returns `None` for incomparable
/// moments, for other arguments, and if the number of a granule exceeds the range of `i64`.
fn difference(arguments: &[&Literal]) -> Option<i64> {
    let [from, to, granularity] = arguments else { return None };
    let (granularity, moments) = (Granularity::from_literal(granularity)?, [moment(from)?, moment(to)?]);
    let [from, to] = [granularity.granule(&moments[0])?, granularity.granule(&moments[1])?];
    if comparable(&moments) { to.checked_sub(from)?.checked_abs() } else { None }
}

struct DurationFunction;

struct AddFunction;

/// `temporal:durationLessThan` and related tests: compares a number with the number of granules between two
/// moments.
struct DurationComparison {
    iri: &'static str,
    orders: &'static [Ordering],
    negated: bool,
}

/// A test of one of Allen's interval relations (or `intersects`), possibly negated, between an instant and an instant
/// or period.
struct AllenRelation {
    iri: &'static str,
    relation: fn(Period, Period) -> bool,
    negated: bool,
}

/// First and last granule of a period.
type Period = (i64, i64);

impl Definition for DurationFunction {
    fn iri(&self) -> &'static str {
        "http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#duration"
    }

    fn accepts(&self, count: usize) -> bool {
        count == 4
    }

    fn is_function(&self) -> bool {
        true
    }

    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        difference(arguments).map(Literal::integer)
    }
}

impl Definition for AddFunction {
    fn iri(&self) -> &'static str {
        "http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#add"
    }

    fn accepts(&self, count: usize) -> bool {
        count == 4
    }

    fn is_function(&self) -> bool {
        true
    }

    /// Returns an `xsd:date` for an `xsd:date` and a granularity of days or coarser, and an `xsd:dateTime`
    /// otherwise.
    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        let [from, count, granularity] = arguments else { return None };
        let granularity = Granularity::from_literal(granularity)?;
        let count = count.as_rational().filter(num_rational::Ratio::is_integer)?.to_integer().to_i64()?;
        let from = moment(from)?;
        let from = if granularity > G::Days { from.as_date_time() } else { from };
        from.later(&granularity.duration(count)?).map(Literal::Moment)
    }
}

impl Definition for DurationComparison {
    fn iri(&self) -> &'static str {
        self.iri
    }

    fn accepts(&self, count: usize) -> bool {
        count == 4
    }

    fn holds(&self, arguments: &[&Literal]) -> bool {
        let [wanted, bounds @ ..] = arguments else { return false };
        let order = difference(bounds).and_then(|count| wanted.compare(&Literal::integer(count)));
        order.is_some_and(|order| self.orders.contains(&order) != self.negated)
    }
}

impl Definition for AllenRelation {
    fn iri(&self) -> &'static str {
        self.iri
    }

    fn accepts(&self, count: usize) -> bool {
        (2..=4).contains(&count)
    }

    fn holds(&self, arguments: &[&Literal]) -> bool {
        periods(arguments).is_some_and(|(first, second)| (self.relation)(first, second) != self.negated)
    }
}

/// Parses the arguments of an Allen relation: an instant, then an instant or the two bounds of a period, then
/// an optional granularity (by default milliseconds). Returns the two operands as periods of granules; `None`
/// if the arguments are invalid or incomparable, or if the period ends before it starts.
fn periods(arguments: &[&Literal]) -> Option<(Period, Period)> {
    let (granularity, moments) = match arguments.split_last()? {
        (last, others) if others.len() >= 2 => match Granularity::from_literal(last) {
            Some(granularity) => (granularity, others),
            None => (G::Milliseconds, arguments),
        },
        _ => (G::Milliseconds, arguments),
    };
    let moments = moments.iter().map(|literal| moment(literal)).collect::<Option<Vec<_>>>()?;
    if !comparable(&moments) {
        return None;
    }
    let granules = moments.iter().map(|m| granularity.granule(m)).collect::<Option<Vec<_>>>()?;
    let bounded = |from: i64, to: i64| (from <= to).then_some((from, to));
    match granules[..] {
        [first, second] => Some(((first, first), (second, second))),
        [first, from, to] => Some(((first, first), bounded(from, to)?)),
        _ => None,
    }
}

fn contains(a: Period, b: Period) -> bool {
    b.0 >= a.0 && b.1 <= a.1
}

fn meets(a: Period, b: Period) -> bool {
    b.0.checked_sub(a.1) == Some(1)
}

fn overlaps(a: Period, b: Period) -> bool {
    a.0 <= b.0 && a.1 <= b.1 && a.1 >= b.0
}

macro_rules! table {
    ($kind:ident { $($local:literal $negated:literal => $field:ident: $value:expr,)* }) => {
        &[$($kind {
            iri: concat!("http://swrl.stanford.edu/ontologies/built-ins/3.3/temporal.owl#", $local),
            negated: $negated,
            $field: $value,
        },)*]
    };
}

static DURATION_COMPARISONS: &[DurationComparison] = table!(DurationComparison {
    "durationLessThan" false => orders: &[Ordering::Less],
    "durationLessThanOrEqualTo" false => orders: &[Ordering::Less, Ordering::Equal],
    "durationEqualTo" false => orders: &[Ordering::Equal],
    "durationGreaterThan" false => orders: &[Ordering::Greater],
    "durationGreaterThanOrEqualTo" false => orders: &[Ordering::Greater, Ordering::Equal],
    "notDurationLessThan" true => orders: &[Ordering::Less],
    "notDurationLessThanOrEqualTo" true => orders: &[Ordering::Less, Ordering::Equal],
    "notDurationEqualTo" true => orders: &[Ordering::Equal],
    "notDurationGreaterThan" true => orders: &[Ordering::Greater],
    "notDurationGreaterThanOrEqualTo" true => orders: &[Ordering::Greater, Ordering::Equal],
});

static ALLEN_RELATIONS: &[AllenRelation] = table!(AllenRelation {
    "equals" false => relation: |a, b| a == b,
    "before" false => relation: |a, b| a.1 < b.0,
    "after" false => relation: |a, b| a.0 > b.1,
    "meets" false => relation: meets,
    "metBy" false => relation: |a, b| meets(b, a),
    "overlaps" false => relation: overlaps,
    "overlappedBy" false => relation: |a, b| overlaps(b, a),
    "contains" false => relation: contains,
    "during" false => relation: |a, b| contains(b, a) && a != b,
    "starts" false => relation: |a, b| a.0 == b.0 && a.1 < b.1,
    "startedBy" false => relation: |a, b| a.0 == b.0 && b.1 < a.1,
    "finishes" false => relation: |a, b| a.0 > b.0 && a.1 == b.1,
    "finishedBy" false => relation: |a, b| b.0 > a.0 && a.1 == b.1,
    "intersects" false => relation: |a, b| a.0 <= b.1 && b.0 <= a.1,
    "notEquals" true => relation: |a, b| a == b,
    "notBefore" true => relation: |a, b| a.1 < b.0,
    "notAfter" true => relation: |a, b| a.0 > b.1,
    "notMeets" true => relation: meets,
    "notMetBy" true => relation: |a, b| meets(b, a),
    "notOverlaps" true => relation: overlaps,
    "notOverlappedBy" true => relation: |a, b| overlaps(b, a),
    "notContains" true => relation: contains,
    "notDuring" true => relation: |a, b| contains(b, a) && a != b,
    "notStarts" true => relation: |a, b| a.0 == b.0 && a.1 < b.1,
    "notStartedBy" true => relation: |a, b| a.0 == b.0 && b.1 < a.1,
    "notFinishes" true => relation: |a, b| a.0 > b.0 && a.1 == b.1,
    "notFinishedBy" true => relation: |a, b| b.0 > a.0 && a.1 == b.1,
    "notIntersects" true => relation: |a, b| a.0 <= b.1 && b.0 <= a.1,
});

pub(super) fn all() -> Vec<&'static dyn Definition> {
    let mut definitions: Vec<&'static dyn Definition> = vec![&DurationFunction, &AddFunction];
    definitions.extend(DURATION_COMPARISONS.iter().map(|definition| definition as &dyn Definition));
    definitions.extend(ALLEN_RELATIONS.iter().map(|definition| definition as &dyn Definition));
    definitions
}
