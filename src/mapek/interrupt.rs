//! Whether the action under way goes on, is suspended, or is cancelled, when it cannot stay as it is.
//!
//! To cancel an action is to lose what it has done so far, so that it is weighed against going on. The rest of the mission is
//! planned twice: with what is left of the action as its first step, and as though the action had been cancelled. The
//! action is cancelled where nothing goes on with it, or where the mission is better without it by more than the
//! minimum benefit. Where there is neither plan, cancelling would gain nothing and lose what was done: the action is
//! suspended, and goes on when its designs, or others, are back. Robots that cannot suspend an action say that it was
//! cancelled.

use num_rational::BigRational;

use crate::mapek::ask::Outcome;
use crate::number;

/// What becomes of the action under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Interruption {
    /// It goes on.
    None,
    /// It is brought to a safe end.
    Cancel {
        /// Why, in a sentence.
        because: String,
    },
    /// It stands still, and there is no plan.
    Suspend {
        /// `unsolvable` or `unknown`.
        status: &'static str,
        /// Why there is no plan.
        because: String,
        /// Designs by which alone there is none.
        blocking: Vec<String>,
    },
}

/// Weighs the plan that begins with what is left of the action under way against the plan as though it had been cancelled, which
/// is better by `gained` if that is enough. `reason` is why the action cannot stay as it is; `can_go_on` says whether its designs
/// are available, and what is left of it can be done with them.
pub(super) fn weigh(
    reason: &str,
    can_go_on: bool,
    going_on: &Outcome,
    without: Outcome,
    gained: Option<BigRational>,
) -> Interruption {
    match (&going_on.steps, &without.steps) {
        (Some(_), Some(_)) => gained.map_or(Interruption::None, |gained| {
            let gained = number::decimal(&gained);
            Interruption::Cancel {
                because: format!("{reason}; the mission is better without it by {gained}"),
            }
        }),
        (Some(_), None) => Interruption::None,
        (None, Some(_)) => {
            let because = if can_go_on { "no plan goes on with it" } else { "no other design serves" };
            Interruption::Cancel { because: format!("{reason}; {because}") }
        }
        (None, None) if can_go_on => Interruption::None,
        (None, None) => Interruption::Suspend {
            status: if without.proved { "unsolvable" } else { "unknown" },
            because: without.because,
            blocking: without.blocking,
        },
    }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::{Interruption, weigh};
    use crate::mapek::ask::Outcome;

    /// A plan without steps, or none.
    fn outcome(is_plan: bool) -> Outcome {
        Outcome {
            steps: is_plan.then(Vec::new),
            cost: BigRational::default(),
            proved: true,
            because: "nothing serves".to_owned(),
            blocking: vec!["fd_a".to_owned()],
        }
    }

    fn check(can_go_on: bool, goes_on: bool, without: bool, gained: Option<i64>, expected: &Interruption) {
        let gained = gained.map(|gained| BigRational::from_integer(gained.into()));
        let found = weigh("it is lost", can_go_on, &outcome(goes_on), outcome(without), gained);
        assert_eq!(&found, expected, "{can_go_on} {goes_on} {without}");
    }

    #[test]
    fn an_action_is_interrupted_only_for_something() {
        let cancel = |because: &str| Interruption::Cancel { because: format!("it is lost; {because}") };
        let suspend = Interruption::Suspend {
            status: "unsolvable",
            because: "nothing serves".to_owned(),
            blocking: vec!["fd_a".to_owned()],
        };
        check(false, true, true, None, &Interruption::None);
        check(false, true, true, Some(3), &cancel("the mission is better without it by 3"));
        check(false, true, false, None, &Interruption::None);
        check(false, false, true, None, &cancel("no other design serves"));
        check(true, false, true, None, &cancel("no plan goes on with it"));
        check(true, false, false, None, &Interruption::None);
        check(false, false, false, None, &suspend);
    }
}
