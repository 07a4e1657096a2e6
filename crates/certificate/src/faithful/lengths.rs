//! Evaluates duration constraints of an action instance to an interval of durations.

use num_rational::BigRational;
use num_traits::Zero;

use crate::faithful::length::Length;
use crate::faithful::reader::Reader;
use crate::faithful::verdict::Cause;
use pddl::ast::{Comparison, DurationConstraint, EffectTime};

type End = (BigRational, bool);

impl<'r> Reader<'r> {
    /// Returns the interval of the durations that satisfy all constraints, or `None` if no duration does or if a
    /// bound is undefined. Fails if a bound depends on the state, or if a bound at end reads a function that actions
    /// change. Several possible durations are supported only if their lower bound is positive and there are no
    /// timed events.
    pub(super) fn lengths(&mut self, constraints: &'r [DurationConstraint]) -> Result<Option<Length>, Cause> {
        // Durations are never negative.
        let mut low: End = (BigRational::zero(), false);
        let mut high: Option<End> = None;
        for constraint in constraints {
            // The witness has the values between actions. Start effects may change one that the end restores.
            let mut functions = Vec::new();
            constraint.expression.walk_fluents(&mut |atom| functions.push(&atom.predicate.name));
            for function in functions.into_iter().filter(|_| constraint.time == EffectTime::AtEnd) {
                if self.world.changes(self.world.symbol(function)?) {
                    return Err(Cause::unsupported("durations at end over a function that actions change"));
                }
            }
            let Some(bound) = self.expression(&constraint.expression)? else { return Ok(None) };
            let bound =
                bound.value().ok_or_else(|| Cause::unsupported("durations that depend on the state"))?;
            let (above, below, left_out) = match constraint.operator {
                Comparison::Equal => (true, true, false),
                Comparison::GreaterOrEqual => (true, false, false),
                Comparison::Greater => (true, false, true),
                Comparison::LessOrEqual => (false, true, false),
                Comparison::Less => (false, true, true),
            };
            if above {
                low = low.max((bound.clone(), left_out));
            }
            let is_less = |(own, own_left_out): &End| (bound, !left_out) < (own, !own_left_out);
            if below && high.as_ref().is_none_or(is_less) {
                high = Some((bound.clone(), left_out));
            }
        }
        let is_empty = |(most, left_out): &End| low.0 > *most || low.0 == *most && (low.1 || *left_out);
        if high.as_ref().is_some_and(is_empty) {
            return Ok(None);
        }
        let length = Length { least: low.0, most: high.map(|(most, _)| most) };
        if length.fixed().is_none() && length.least.is_zero() {
            return Err(Cause::unsupported("chosen durations without a positive lower bound"));
        }
        if length.fixed().is_none() && !self.world.timeline.is_empty() {
            return Err(Cause::unsupported(
                "durations that are chosen where there are timed initial literals",
            ));
        }
        Ok(Some(length))
    }
}
