//! Functions of SWRL on dates, times and durations ([1], section 8.5).
//!
//! [1] W3C Member Submission: SWRL, 2004.

use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};

use super::signature::BuiltIn;
use crate::literal::{Decimal, Duration, Literal, Moment, MomentKind, XSD};

pub(super) fn compute(built_in: BuiltIn, arguments: &[&Literal]) -> Option<Literal> {
    use BuiltIn as B;
    match built_in {
        B::YearMonthDuration | B::DayTimeDuration | B::DateTime | B::Date | B::Time => {
            construct(built_in, arguments)
        }
        _ => match arguments {
            [Literal::Duration(left), Literal::Duration(right)] => durations(built_in, left, right),
            [Literal::Duration(left), right] => scaled(built_in, left, &right.as_rational()?),
            [Literal::Moment(left), Literal::Duration(right)] => shifted(built_in, left, right),
            [Literal::Moment(left), Literal::Moment(right)] => difference(built_in, left, right),
            _ => None,
        },
    }
}

fn construct(built_in: BuiltIn, arguments: &[&Literal]) -> Option<Literal> {
    let mut texts: Vec<String> = arguments.iter().map(|argument| argument.lexical()).collect();
    let is_duration = matches!(built_in, BuiltIn::YearMonthDuration | BuiltIn::DayTimeDuration);
    let sign = if is_duration { common_sign(arguments, &mut texts)? } else { "" };
    let is_whole = |at: usize| texts[at].bytes().all(|b| b.is_ascii_digit());
    let two_digits = |at: usize| is_whole(at).then(|| format!("{:0>2}", texts[at]));
    let seconds = |at: usize| {
        let whole = texts[at].split('.').next().unwrap_or_default().len();
        format!("{}{}", "0".repeat(2_usize.saturating_sub(whole)), texts[at])
    };
    let year = || match texts[0].strip_prefix('-') {
        Some(year) => format!("-{year:0>4}"),
        None => format!("{:0>4}", texts[0]),
    };
    let date = || Some(format!("{}-{}-{}", year(), two_digits(1)?, two_digits(2)?));
    let clock = |at: usize| Some(format!("{}:{}:{}", two_digits(at)?, two_digits(at + 1)?, seconds(at + 2)));
    let zone = |at: usize| texts.get(at).map(String::as_str).unwrap_or_default();
    let (lexical, local) = match (built_in, texts.as_slice()) {
        (BuiltIn::YearMonthDuration, [years, months]) => {
            (format!("{sign}P{years}Y{months}M"), "yearMonthDuration")
        }
        (BuiltIn::DayTimeDuration, [days, hours, minutes, seconds]) => {
            (format!("{sign}P{days}DT{hours}H{minutes}M{seconds}S"), "dayTimeDuration")
        }
        (BuiltIn::Date, _) => (format!("{}{}", date()?, zone(3)), "date"),
        (BuiltIn::Time, _) => (format!("{}{}", clock(0)?, zone(3)), "time"),
        _ => (format!("{}T{}{}", date()?, clock(3)?, zone(6)), "dateTime"),
    };
    let literal = Literal::parse(&lexical, Some(&format!("{XSD}{local}")), None);
    (!literal.is_ill_typed()).then_some(literal)
}

/// Returns the common sign of all parts of a duration: `""` or `"-"` (zero has either sign). Removes
/// the sign `-` from `texts`. `None` if the signs differ or a part is not a number.
fn common_sign(arguments: &[&Literal], texts: &mut [String]) -> Option<&'static str> {
    let zero = BigRational::zero();
    let numbers = arguments.iter().map(|argument| argument.as_rational()).collect::<Option<Vec<_>>>()?;
    if numbers.iter().all(|number| *number >= zero) {
        return Some("");
    }
    for text in &mut *texts {
        *text = text.trim_start_matches('-').to_owned();
    }
    numbers.iter().all(|number| *number <= zero).then_some("-")
}

fn is_months(duration: &Duration) -> bool {
    duration.seconds() == &Decimal::from(0)
}

fn is_seconds(duration: &Duration) -> bool {
    duration.months() == 0
}

fn durations(built_in: BuiltIn, left: &Duration, right: &Duration) -> Option<Literal> {
    use BuiltIn as B;
    let months = is_months(left) && is_months(right);
    let seconds = is_seconds(left) && is_seconds(right);
    let right = match built_in {
        B::AddYearMonthDurations if months => right.clone(),
        B::SubtractYearMonthDurations if months => right.negated()?,
        B::AddDayTimeDurations if seconds => right.clone(),
        B::SubtractDayTimeDurations if seconds => right.negated()?,
        _ => return None,
    };
    let sum = left.seconds().to_rational() + right.seconds().to_rational();
    let months = left.months().checked_add(right.months())?;
    Some(Literal::Duration(Duration::new(months, Decimal::from_rational(&sum))))
}

/// Multiplies or divides a duration by a number. Months are rounded, halves up. Returns `None` for a division by 0, if
/// the built-in is for another kind of duration, and if the number of months exceeds the range of `i64`.
fn scaled(built_in: BuiltIn, duration: &Duration, factor: &BigRational) -> Option<Literal> {
    use BuiltIn as B;
    let divides = matches!(built_in, B::DivideYearMonthDuration | B::DivideDayTimeDuration);
    if divides && factor.is_zero() {
        return None;
    }
    let factor = if divides { factor.recip() } else { factor.clone() };
    let duration = match built_in {
        B::MultiplyYearMonthDuration | B::DivideYearMonthDuration if is_months(duration) => {
            let exact = BigRational::from_integer(duration.months().into()) * factor;
            let half = BigRational::new(1.into(), 2.into());
            Duration::new((exact + half).floor().to_integer().to_i64()?, Decimal::from(0))
        }
        B::MultiplyDayTimeDuration | B::DivideDayTimeDuration if is_seconds(duration) => {
            Duration::new(0, Decimal::from_rational(&(duration.seconds().to_rational() * factor)))
        }
        _ => return None,
    };
    Some(Literal::Duration(duration))
}

fn shifted(built_in: BuiltIn, moment: &Moment, duration: &Duration) -> Option<Literal> {
    use BuiltIn as B;
    let (kind, months, forward) = match built_in {
        B::AddYearMonthDurationToDateTime => (MomentKind::DateTime, true, true),
        B::SubtractYearMonthDurationFromDateTime => (MomentKind::DateTime, true, false),
        B::AddDayTimeDurationToDateTime => (MomentKind::DateTime, false, true),
        B::SubtractDayTimeDurationFromDateTime => (MomentKind::DateTime, false, false),
        B::AddYearMonthDurationToDate => (MomentKind::Date, true, true),
        B::SubtractYearMonthDurationFromDate => (MomentKind::Date, true, false),
        B::AddDayTimeDurationToDate => (MomentKind::Date, false, true),
        B::SubtractDayTimeDurationFromDate => (MomentKind::Date, false, false),
        B::AddDayTimeDurationToTime => (MomentKind::Time, false, true),
        B::SubtractDayTimeDurationFromTime => (MomentKind::Time, false, false),
        _ => return None,
    };
    let fits = if months { is_months(duration) } else { is_seconds(duration) };
    if !fits || moment.kind() != kind {
        return None;
    }
    let duration = if forward { duration.clone() } else { duration.negated()? };
    moment.later(&duration).map(Literal::Moment)
}

fn difference(built_in: BuiltIn, left: &Moment, right: &Moment) -> Option<Literal> {
    use BuiltIn as B;
    let (kind, months) = match built_in {
        B::SubtractDates => (MomentKind::Date, false),
        B::SubtractTimes => (MomentKind::Time, false),
        B::SubtractDateTimesYieldingDayTimeDuration => (MomentKind::DateTime, false),
        B::SubtractDateTimesYieldingYearMonthDuration => (MomentKind::DateTime, true),
        _ => return None,
    };
    if left.kind() != kind {
        return None;
    }
    let duration = if months { left.months_since(right) } else { left.since(right) };
    duration.map(Literal::Duration)
}
