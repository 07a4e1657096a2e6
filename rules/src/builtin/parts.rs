//! Inverse of the constructor built-ins of SWRL ([1], sections 8.5 and 8.6): splits a value into its parts.
//!
//! Without a time zone, the time zone part is the empty text. Parts of a negative duration are negative or zero, as
//! in `XPath`. A value with several decompositions is split canonically: `PT90M` into 1 hour and 30 minutes. There is
//! no solution if the known parts do not fit the canonical values of the unknown parts.
//!
//! [1] W3C Member Submission: SWRL, 2004.

use super::signature::BuiltIn;
use super::uri;
use crate::literal::{Decimal, Duration, Literal, Moment, MomentKind};

impl BuiltIn {
    /// Splits the value `whole` canonically, and returns the values of the unknown parts. Returns `None` if `whole`
    /// has the wrong kind, or if these values and the known parts together do not compose `whole`.
    pub(super) fn parts(self, whole: &Literal, parts: &[Option<&Literal>]) -> Option<Vec<Literal>> {
        let canonical = match (self, whole) {
            (Self::AnyUri, Literal::Uri(text) | Literal::String(text)) => uri::parts(text)?,
            (Self::YearMonthDuration | Self::DayTimeDuration, Literal::Duration(duration)) => {
                self.of_duration(duration)?
            }
            (Self::Date | Self::Time | Self::DateTime, Literal::Moment(moment)) => self.of_moment(moment)?,
            _ => return None,
        };
        if canonical.len() < parts.len() {
            return None;
        }
        let all_parts: Vec<&Literal> =
            parts.iter().zip(&canonical).map(|(known, part)| known.unwrap_or(part)).collect();
        // Checks the known parts by composing the value again.
        let is_consistent = self.compute(&all_parts).is_some_and(|value| value == *whole);
        let unknown = parts.iter().zip(&canonical).filter(|(known, _)| known.is_none());
        is_consistent.then(|| unknown.map(|(_, part)| part.clone()).collect())
    }

    fn of_duration(self, duration: &Duration) -> Option<Vec<Literal>> {
        if self == Self::YearMonthDuration {
            let months = duration.months();
            return Some(vec![Literal::integer(months / 12), Literal::integer(months % 12)]);
        }
        let (days, hours, minutes, seconds) = duration.clock()?;
        let [days, hours, minutes] = [days, hours, minutes].map(Literal::integer);
        Some(vec![days, hours, minutes, Literal::Decimal(seconds)])
    }

    fn of_moment(self, moment: &Moment) -> Option<Vec<Literal>> {
        let kind = match self {
            Self::Date => MomentKind::Date,
            Self::Time => MomentKind::Time,
            _ => MomentKind::DateTime,
        };
        if moment.kind() != kind {
            return None;
        }
        let ([year, month, day], clock) = moment.calendar();
        let (hours, minutes, seconds) = clock;
        let date = [year, month, day].map(Literal::integer).to_vec();
        let seconds: Decimal = seconds;
        let time = vec![Literal::integer(hours), Literal::integer(minutes), Literal::Decimal(seconds)];
        let zone = Literal::String(moment.zone_text().into());
        Some(match kind {
            MomentKind::Date => [date, vec![zone]].concat(),
            MomentKind::Time => [time, vec![zone]].concat(),
            MomentKind::DateTime => [date, time, vec![zone]].concat(),
        })
    }
}
