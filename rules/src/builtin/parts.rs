//! Values taken apart: the parts from which a built-in of SWRL ([1], sections 8.5 and 8.6) would make a value.
//!
//! Of a date, time or moment without a time zone, the time zone is the empty text. Parts of a negative duration are negative
//! or zero, as those that `XPath` gives. What has other parts as well (`PT90M`) is taken apart into the canonical ones, but
//! known parts may be any that make the value.

use super::signature::BuiltIn;
use super::uri;
use crate::literal::{Decimal, Duration, Literal, Moment, MomentKind};

impl BuiltIn {
    /// The values of the parts that are not known, where the whole is made of them and those that are.
    pub(super) fn parts(self, whole: &Literal, parts: &[Option<&Literal>]) -> Option<Vec<Literal>> {
        let own = match (self, whole) {
            (Self::AnyUri, Literal::Uri(text) | Literal::String(text)) => uri::parts(text)?,
            (Self::YearMonthDuration | Self::DayTimeDuration, Literal::Duration(duration)) => {
                self.of_duration(duration)?
            }
            (Self::Date | Self::Time | Self::DateTime, Literal::Moment(moment)) => self.of_moment(moment)?,
            _ => return None,
        };
        if own.len() < parts.len() {
            return None;
        }
        let all: Vec<&Literal> = parts.iter().zip(&own).map(|(known, own)| known.unwrap_or(own)).collect();
        let is_made_of = self.compute(&all).is_some_and(|made| made == *whole);
        let unknown = parts.iter().zip(&own).filter(|(known, _)| known.is_none());
        is_made_of.then(|| unknown.map(|(_, own)| own.clone()).collect())
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
