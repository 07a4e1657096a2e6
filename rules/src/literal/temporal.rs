//! `xsd:dateTime`, `xsd:date`, `xsd:time` and `xsd:duration` as numbers of seconds and months, partially
//! ordered.
//!
//! A moment is a number of seconds since 1970-01-01T00:00:00 in the proleptic Gregorian calendar, converted
//! to UTC if it has a time zone. Moments with and without a time zone are comparable only if every possible
//! time zone gives the same order. The order treats one instant in two time zones as equal, but `==`
//! distinguishes the two.

use std::cmp::Ordering;
use std::fmt;

use super::datatype::XSD;
use super::decimal::{Decimal, ten_to};
use num_bigint::BigInt;
use num_traits::Zero;

const DAY: i64 = 86_400;

/// Maximum distance of a calculated moment from 1970 in days: about a billion years, far from an overflow.
const MAX_DAYS: u64 = 366_000_000_000;
/// Largest offset of a time zone from UTC, in seconds.
const ZONE_LIMIT: i64 = 14 * 3600;

/// Datatype of a [`Moment`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum MomentKind {
    /// `xsd:dateTime`.
    DateTime,
    /// `xsd:date`.
    Date,
    /// `xsd:time`, on the day 1970-01-01.
    Time,
}

/// A point in time.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Moment {
    kind: MomentKind,
    /// Seconds since 1970-01-01T00:00:00, in UTC if there is a time zone, and otherwise in local time.
    seconds: Decimal,
    /// Offset of the time zone in seconds east of UTC; `None` without a time zone.
    zone: Option<i64>,
}

/// An `xsd:duration`: a number of months and a number of seconds, which are not convertible into each other.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Duration {
    months: i64,
    seconds: Decimal,
}

impl Moment {
    pub(super) fn parse(lexical: &str, local: &str) -> Option<Self> {
        let (body, zone) = split_zone(lexical)?;
        let (kind, days, time) = match local {
            "date" => (MomentKind::Date, parse_date(body)?, None),
            "time" => (MomentKind::Time, 0, Some(body)),
            _ => {
                let (date, time) = body.split_once('T')?;
                (MomentKind::DateTime, parse_date(date)?, Some(time))
            }
        };
        if local == "dateTimeStamp" && zone.is_none() {
            return None;
        }
        let mut clock = time.map_or(Some(Decimal::from(0)), parse_clock)?;
        // A time of day has only one midnight: 24:00:00 is 00:00:00 (XML Schema 1.1, part 2, section
        // 3.3.8).
        if kind == MomentKind::Time && clock == Decimal::from(DAY) {
            clock = Decimal::from(0);
        }
        let offset = days.checked_mul(DAY)?.checked_sub(zone.unwrap_or(0))?;
        Some(Self { kind, seconds: add_seconds(&clock, offset), zone })
    }

    /// Returns the seconds since 1970-01-01T00:00:00, in UTC if the moment has a time zone, and otherwise
    /// in local time.
    pub fn seconds(&self) -> &Decimal {
        &self.seconds
    }

    /// Returns the moment plus a duration, with the same time zone; the calculation is in local time. Months are
    /// added first; a day that does not exist in the new month becomes its last day. Then seconds are added. A time
    /// of day wraps around at midnight. A date is rounded down to whole days. Returns `None` if months are added to a
    /// time of day, or if the result is about a billion years from 1970 or farther.
    pub(crate) fn later(&self, duration: &Duration) -> Option<Self> {
        let local = self.local();
        let (day, _) = split_day(&local);
        let (year, month, date) = civil_from_days(day);
        let total_months = (year.checked_mul(12)?.checked_add(month - 1)?).checked_add(duration.months)?;
        let (year, month) = (total_months.div_euclid(12), total_months.rem_euclid(12) + 1);
        // The bound keeps the calendar arithmetic far from the limits of `i64`. Months cannot be added to a
        // time of day.
        if year.abs() > 1_000_000_000 || (self.kind == MomentKind::Time && duration.months != 0) {
            return None;
        }
        let fits = |date: &i64| {
            let days = days_from_civil(year, month, *date);
            civil_from_days(days) == (year, month, *date)
        };
        let date = (1..=date).rev().find(fits)?;
        let shift = days_from_civil(year, month, date) - day;
        let seconds = add(&add_seconds(&local, shift.checked_mul(DAY)?), &duration.seconds);
        let (day, _) = split_seconds(&seconds).filter(|(day, _)| day.unsigned_abs() <= MAX_DAYS)?;
        let seconds = match self.kind {
            MomentKind::DateTime => seconds,
            MomentKind::Date => Decimal::from(day * DAY),
            MomentKind::Time => add_seconds(&seconds, -day * DAY),
        };
        let seconds = add_seconds(&seconds, -self.zone.unwrap_or(0));
        Some(Self { kind: self.kind, seconds, zone: self.zone })
    }

    fn local(&self) -> Decimal {
        add_seconds(&self.seconds, self.zone.unwrap_or(0))
    }

    /// Returns the duration `self - other` in seconds. Returns `None` if the moments differ in kind, or
    /// if only one of them has a time zone.
    pub(crate) fn since(&self, other: &Self) -> Option<Duration> {
        let comparable = self.kind == other.kind && self.zone.is_some() == other.zone.is_some();
        comparable.then(|| Duration { months: 0, seconds: add(&self.seconds, &negate(&other.seconds)) })
    }

    /// Returns the duration `self - other` in whole months, truncated toward zero. Returns `None` under the
    /// conditions of [`Moment::since`], and if [`Moment::later`] has no result.
    pub(crate) fn months_since(&self, other: &Self) -> Option<Duration> {
        let negative = self.since(other)?.seconds < Decimal::from(0);
        // The calendar months of two time zones are not comparable. As a date with time, the start of a day
        // remains exact in UTC.
        let [this, other] = [self, other].map(|moment| moment.in_utc().as_date_time());
        let (late, early) = if negative { (&other, &this) } else { (&this, &other) };
        let parts = |moment: &Self| {
            let (day, _) = split_day(&moment.local());
            let (year, month, _) = civil_from_days(day);
            year * 12 + month
        };
        // The difference of the calendar months is one too many if the last month is incomplete.
        let mut months = parts(late) - parts(early);
        let reached = early.later(&Duration { months, seconds: Decimal::from(0) })?;
        if reached.seconds > late.seconds {
            months -= 1;
        }
        Some(Duration { months: if negative { -months } else { months }, seconds: Decimal::from(0) })
    }

    pub(crate) fn calendar(&self) -> ([i64; 3], (i64, i64, Decimal)) {
        let (day, clock) = split_day(&self.local());
        let (year, month, date) = civil_from_days(day);
        let [hours, minutes] = [0, 3].map(|at| clock[at..at + 2].parse().unwrap_or(0));
        let seconds = Decimal::parse(&clock[6..]).unwrap_or(Decimal::from(0));
        ([year, month, date], (hours, minutes, seconds))
    }

    /// Returns the same instant in UTC. A moment without a time zone is unchanged.
    pub(crate) fn in_utc(&self) -> Self {
        Self { zone: self.zone.map(|_| 0), ..self.clone() }
    }

    pub(crate) fn as_date_time(&self) -> Self {
        Self { kind: MomentKind::DateTime, ..self.clone() }
    }

    pub(crate) fn zone_text(&self) -> String {
        self.zone.map(zone_text).unwrap_or_default()
    }

    /// Returns the datatype.
    pub fn kind(&self) -> MomentKind {
        self.kind
    }

    pub(super) fn datatype(&self) -> &'static str {
        match self.kind {
            MomentKind::DateTime => "http://www.w3.org/2001/XMLSchema#dateTime",
            MomentKind::Date => "http://www.w3.org/2001/XMLSchema#date",
            MomentKind::Time => "http://www.w3.org/2001/XMLSchema#time",
        }
    }
}

impl PartialOrd for Moment {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if self.kind != other.kind {
            return None;
        }
        if self.zone.is_some() == other.zone.is_some() {
            return Some(self.seconds.cmp(&other.seconds));
        }
        // A moment without a time zone lies within ±14 hours of the same local time in UTC.
        let earliest = add_seconds(&self.seconds, -ZONE_LIMIT).cmp(&other.seconds);
        let latest = add_seconds(&self.seconds, ZONE_LIMIT).cmp(&other.seconds);
        (earliest == latest && earliest != Ordering::Equal).then_some(earliest)
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (day, clock) = split_day(&self.local());
        let (year, month, date) = civil_from_days(day);
        let sign = if year < 0 { "-" } else { "" };
        let calendar = format!("{sign}{:04}-{month:02}-{date:02}", year.unsigned_abs());
        let zone = self.zone.map(zone_text).unwrap_or_default();
        match self.kind {
            MomentKind::Date => write!(f, "{calendar}{zone}"),
            MomentKind::Time => write!(f, "{clock}{zone}"),
            MomentKind::DateTime => write!(f, "{calendar}T{clock}{zone}"),
        }
    }
}

impl Duration {
    /// Parses `P1Y2M3DT4H5M6.7S`, with an optional minus sign; `local` is the name of the datatype. Returns
    /// `None` if the form is invalid for the datatype, or if a number is too large.
    pub(super) fn parse(lexical: &str, local: &str) -> Option<Self> {
        let (negative, body) = lexical.strip_prefix('-').map_or((false, lexical), |body| (true, body));
        let body = body.strip_prefix('P')?;
        let (date, time) = body.split_once('T').map_or((body, None), |(date, time)| (date, Some(time)));
        if body.is_empty() || time == Some("") {
            return None;
        }
        let (years, date) = take_field(date, 'Y')?;
        let (months, date) = take_field(date, 'M')?;
        let (days, date) = take_field(date, 'D')?;
        let (hours, time) = take_field(time.unwrap_or(""), 'H')?;
        let (minutes, time) = take_field(time, 'M')?;
        let seconds = match time.strip_suffix('S') {
            Some(text) if is_plain_decimal(text) => Decimal::parse(text)?,
            _ if time.is_empty() => Decimal::from(0),
            _ => return None,
        };
        if !date.is_empty() {
            return None;
        }
        let months = years.checked_mul(12)?.checked_add(months)?;
        let whole = days
            .checked_mul(DAY)?
            .checked_add(hours.checked_mul(3600)?)?
            .checked_add(minutes.checked_mul(60)?)?;
        let seconds = add_seconds(&seconds, whole);
        let forbidden = match local {
            "dayTimeDuration" => body.split('T').next().is_some_and(|date| date.contains(['Y', 'M'])),
            "yearMonthDuration" => body.contains(['D', 'T']),
            _ => false,
        };
        (!forbidden).then(|| {
            if negative {
                Self { months: -months, seconds: negate(&seconds) }
            } else {
                Self { months, seconds }
            }
        })
    }

    pub(crate) fn new(months: i64, seconds: Decimal) -> Self {
        Self { months, seconds }
    }

    /// Returns the years and months of the duration together, in months.
    pub fn months(&self) -> i64 {
        self.months
    }

    /// Returns the days, hours, minutes and seconds of the duration together, in seconds.
    pub fn seconds(&self) -> &Decimal {
        &self.seconds
    }

    /// Splits the seconds into days, hours, minutes and seconds, all of one sign. `None` if the whole seconds
    /// exceed the range of `i64`.
    pub(crate) fn clock(&self) -> Option<(i64, i64, i64, Decimal)> {
        let (unscaled, scale) = self.seconds.parts();
        let unit = ten_to(scale);
        let whole = i64::try_from(&unscaled / &unit).ok()?;
        let fraction = Decimal::new(unscaled % unit, scale);
        Some((whole / DAY, whole % DAY / 3600, whole % 3600 / 60, add_seconds(&fraction, whole % 60)))
    }

    pub(crate) fn negated(&self) -> Option<Self> {
        Some(Self { months: self.months.checked_neg()?, seconds: negate(&self.seconds) })
    }

    pub(super) fn is_in(&self, datatype: &str) -> bool {
        match datatype.strip_prefix(XSD) {
            Some("duration") => true,
            Some("yearMonthDuration") => self.seconds == Decimal::from(0),
            Some("dayTimeDuration") => self.months == 0,
            _ => false,
        }
    }

    pub(super) fn datatype(&self) -> &'static str {
        if self.months == 0 {
            "http://www.w3.org/2001/XMLSchema#dayTimeDuration"
        } else if self.seconds == Decimal::from(0) {
            "http://www.w3.org/2001/XMLSchema#yearMonthDuration"
        } else {
            "http://www.w3.org/2001/XMLSchema#duration"
        }
    }
}

impl PartialOrd for Duration {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let (months, seconds) = (self.months.cmp(&other.months), self.seconds.cmp(&other.seconds));
        match (months, seconds) {
            (Ordering::Equal, order) | (order, Ordering::Equal) => Some(order),
            (a, b) if a == b => Some(a),
            // A month has no fixed length. The order must be the same from four dates on (XML Schema 1.1, part
            // 2, section 3.3.6).
            _ => {
                let dates = ["1696-09-01", "1697-02-01", "1903-03-01", "1903-07-01"];
                let mut orders = dates.into_iter().map(|date| {
                    let start = Moment::parse(&format!("{date}T00:00:00Z"), "dateTime")?;
                    Some(start.later(self)?.seconds.cmp(&start.later(other)?.seconds))
                });
                let first = orders.next().flatten().filter(|order| order.is_ne())?;
                orders.all(|order| order == Some(first)).then_some(first)
            }
        }
    }
}

impl fmt::Display for Duration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let negative = self.months < 0 || self.seconds < Decimal::from(0);
        let (months, seconds) =
            (self.months.unsigned_abs(), if negative { negate(&self.seconds) } else { self.seconds.clone() });
        f.write_str(if negative { "-P" } else { "P" })?;
        if months > 0 {
            write!(f, "{}Y{}M", months / 12, months % 12)?;
        }
        if months == 0 || seconds != Decimal::from(0) {
            write!(f, "T{seconds}S")?;
        }
        Ok(())
    }
}

/// Parses a field such as `12H` for the unit `H`. Returns its number and the remaining text, or 0 and the
/// whole text if there is no field at the start. `None` if the number is missing or too large.
fn take_field(text: &str, unit: char) -> Option<(i64, &str)> {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    match text[digits..].strip_prefix(unit) {
        Some(remainder) if digits > 0 => Some((text[..digits].parse().ok()?, remainder)),
        Some(_) => None,
        None => Some((0, text)),
    }
}

/// Replaces the numbers of a moment or duration that may exceed the limits of [`Moment`] and [`Duration`] by
/// smaller ones, such that the text is valid for the datatype `local` exactly if it was valid.
pub(super) fn within_limits(lexical: &str, local: &str) -> String {
    const MAX_DIGITS: usize = 9;
    let is_duration = local.ends_with("uration");
    let (mut result, mut tail) = (String::new(), lexical);
    while let Some(start) = tail.find(|c: char| c.is_ascii_digit()) {
        let (before, digits_on) = tail.split_at(start);
        let length = digits_on.bytes().take_while(u8::is_ascii_digit).count();
        let (digits, after) = digits_on.split_at(length);
        let is_first = result.is_empty();
        result += before;
        // The fraction of a second has no limit.
        let is_long = length > MAX_DIGITS && !before.ends_with('.');
        match digits.as_bytes().first() {
            Some(_) if is_long && is_duration => result.push('1'),
            // Leap years repeat every 400 years, and 400 divides 10,000: only the last four digits matter.
            Some(b'1'..=b'9') if is_long && is_first => {
                result.push('2');
                result += &digits[length - 4..];
            }
            _ => result += digits,
        }
        tail = after;
    }
    result + tail
}

fn negate(value: &Decimal) -> Decimal {
    let (unscaled, scale) = value.parts();
    Decimal::new(-unscaled, scale)
}

fn add(left: &Decimal, right: &Decimal) -> Decimal {
    Decimal::from_rational(&(left.to_rational() + right.to_rational()))
}

fn add_seconds(value: &Decimal, whole: i64) -> Decimal {
    let (unscaled, scale) = value.parts();
    Decimal::new(unscaled + BigInt::from(whole) * ten_to(scale), scale)
}

/// Formats a time zone, given in seconds east of UTC, as `Z`, `+hh:mm` or `-hh:mm`.
pub(super) fn zone_text(zone: i64) -> String {
    let (sign, minutes) = (if zone < 0 { '-' } else { '+' }, zone.abs() / 60);
    if zone == 0 { "Z".into() } else { format!("{sign}{:02}:{:02}", minutes / 60, minutes % 60) }
}

/// Splits a lexical form into the text before the time zone, and the offset of the time zone in seconds
/// east of UTC (`None` without a time zone). Returns `None` if the time zone is invalid.
pub(super) fn split_zone(lexical: &str) -> Option<(&str, Option<i64>)> {
    if let Some(body) = lexical.strip_suffix('Z') {
        return Some((body, Some(0)));
    }
    let Some(start) = lexical.len().checked_sub(6).filter(|&start| lexical.is_char_boundary(start)) else {
        return Some((lexical, None));
    };
    let (body, zone) = lexical.split_at(start);
    // The last six characters of a date may have the form `-mm-dd`.
    let sign = match zone.as_bytes()[0] {
        b'+' => 1,
        b'-' if zone.as_bytes()[3] == b':' => -1,
        _ => return Some((lexical, None)),
    };
    let (hours, minutes) = zone[1..].split_once(':')?;
    let minutes = number(minutes, 2).filter(|&minutes| minutes < 60)?;
    let seconds = number(hours, 2)? * 3600 + minutes * 60;
    (seconds <= ZONE_LIMIT).then_some((body, Some(sign * seconds)))
}

fn is_plain_decimal(text: &str) -> bool {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    is_number(whole) && is_number(fraction)
}

fn number(text: &str, width: usize) -> Option<i64> {
    (text.len() == width && text.bytes().all(|b| b.is_ascii_digit())).then(|| text.parse().ok())?
}

/// Parses `hh:mm:ss.fff` to seconds since midnight. `24:00:00` is valid.
fn parse_clock(text: &str) -> Option<Decimal> {
    let mut parts = text.splitn(3, ':');
    let (hours, minutes, seconds) = (number(parts.next()?, 2)?, number(parts.next()?, 2)?, parts.next()?);
    let whole = seconds.split('.').next()?;
    let fraction_ok = seconds.len() == 2 || (seconds.len() > 3 && seconds.as_bytes()[2] == b'.');
    if number(whole, 2)? > 59 || minutes > 59 || !fraction_ok || seconds.contains(['e', 'E']) {
        return None;
    }
    let value = add_seconds(&Decimal::parse(seconds)?, hours * 3600 + minutes * 60);
    (value <= Decimal::from(DAY) && (hours < 24 || value == Decimal::from(DAY))).then_some(value)
}

/// Parses `-?yyyy-mm-dd`, with 4 to 9 digits of the year, to days since 1970-01-01.
fn parse_date(text: &str) -> Option<i64> {
    let (negative, unsigned) = text.strip_prefix('-').map_or((false, text), |unsigned| (true, unsigned));
    let mut parts = unsigned.splitn(3, '-');
    let (year, month, day) = (parts.next()?, number(parts.next()?, 2)?, number(parts.next()?, 2)?);
    let plain = (4..=9).contains(&year.len()) && (year.len() == 4 || !year.starts_with('0'));
    let year = number(year, year.len()).filter(|_| plain)?;
    let year = if negative { -year } else { year };
    let days = days_from_civil(year, month, day);
    // A date that does not exist, such as 02-30, is normalised to another date.
    (civil_from_days(days) == (year, month, day)).then_some(days)
}

/// Converts a date to days since 1970-01-01, by Howard Hinnant's algorithm `days_from_civil`.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year - 719_468
}

/// Converts days since 1970-01-01 to year, month and day, by Howard Hinnant's algorithm
/// `civil_from_days`.
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let (era, day_of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, day_of_year - (153 * shifted + 2) / 5 + 1)
}

/// Splits a number of seconds into whole days (rounded down) and the remaining clock time
/// `hh:mm:ss.fff`.
fn split_day(seconds: &Decimal) -> (i64, String) {
    split_seconds(seconds).unwrap_or_default()
}

/// Splits seconds like [`split_day`]. Returns `None` if the whole seconds exceed `i64`, which is
/// possible only for the sum of a moment and a duration.
fn split_seconds(seconds: &Decimal) -> Option<(i64, String)> {
    let (unscaled, scale) = seconds.parts();
    let unit = ten_to(scale);
    let (mut whole, mut fraction) = (&unscaled / &unit, &unscaled % &unit);
    if fraction < BigInt::zero() {
        whole -= 1;
        fraction += &unit;
    }
    let whole = i64::try_from(whole).ok()?;
    let clock = whole.rem_euclid(DAY);
    let tail = if scale == 0 {
        String::new()
    } else {
        format!(".{:0>width$}", fraction.to_string(), width = scale as usize)
    };
    let text = format!("{:02}:{:02}:{:02}{tail}", clock / 3600, clock / 60 % 60, clock % 60);
    Some((whole.div_euclid(DAY), text))
}
