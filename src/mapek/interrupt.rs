//! Decides whether the action under way continues, is suspended, or is cancelled, if it may have to be interrupted.
//!
//! Cancelling an action loses its progress. Therefore, the mission is planned twice: beginning with the remaining part
//! of the action, and as if the action had been cancelled. The action is cancelled if only the second plan is found,
//! or if the second plan is better by at least the minimum benefit; otherwise the first plan is adopted if it is found.
//! If neither plan is found, the action is suspended until suitable designs are available again, unless it can continue with
//! its current designs. Robots that cannot suspend an action report that it was cancelled.

use num_rational::BigRational;

use crate::mapek::ask::Outcome;
use crate::number;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Interruption {
    None,
    Cancel {
        because: String,
    },
    /// Suspends the action for `reason`. The other fields describe the missing plan without the action.
    Suspend {
        reason: String,
        status: &'static str,
        because: String,
        blocking: Vec<String>,
    },
}

/// Decides about the action under way, given the `reason` why it may have to be interrupted. `going_on` is the plan
/// that continues the action, and `without` the plan after its cancellation. `can_go_on` is `true` if the current
/// designs of the action are available and its remainder is executable. `gained` is the benefit of cancelling, if it is
/// sufficient.
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
                because: format!("{reason}; cancelling the action improves the metric by {gained}"),
            }
        }),
        (Some(_), None) => Interruption::None,
        (None, Some(_)) => Interruption::Cancel {
            because: format!("{reason}; {}", no_continuation(can_go_on, going_on.proved)),
        },
        (None, None) if can_go_on => Interruption::None,
        (None, None) => {
            let no_plan = if without.proved {
                "no plan exists without the action"
            } else {
                "no plan without the action was found"
            };
            let status = if going_on.proved && without.proved { "unsolvable" } else { "unknown" };
            let reason = format!("{reason}; {}, and {no_plan}", no_continuation(can_go_on, going_on.proved));
            // The reason is that of the plan whose absence is not proved, if there is one.
            let missing = if without.proved && !going_on.proved { going_on.clone() } else { without };
            Interruption::Suspend { reason, status, because: missing.because, blocking: missing.blocking }
        }
    }
}

/// Returns the reason not to continue the action. Claims the absence of plans only if it is `proved`.
fn no_continuation(can_go_on: bool, proved: bool) -> &'static str {
    match (can_go_on, proved) {
        (true, true) => "no plan exists that continues the action",
        (true, false) => "no plan that continues the action was found",
        (false, true) => "no other design can be used",
        (false, false) => "no plan with another design was found",
    }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::{Interruption, weigh};
    use crate::mapek::ask::Outcome;

    fn outcome(is_plan: bool, proved: bool) -> Outcome {
        Outcome {
            steps: is_plan.then(Vec::new),
            cost: BigRational::default(),
            proved,
            was_proved: false,
            because: "nothing serves".to_owned(),
            blocking: vec!["fd_a".to_owned()],
        }
    }

    fn check(can_go_on: bool, goes_on: bool, without: bool, gained: Option<i64>, expected: &Interruption) {
        let gained = gained.map(|gained| BigRational::from_integer(gained.into()));
        let decision =
            weigh("it is lost", can_go_on, &outcome(goes_on, true), outcome(without, true), gained);
        assert_eq!(&decision, expected, "{can_go_on} {goes_on} {without}");
    }

    #[test]
    fn an_action_is_interrupted_with_a_benefit_or_if_no_plan_continues_it() {
        let cancel = |because: &str| Interruption::Cancel { because: format!("it is lost; {because}") };
        let suspend = Interruption::Suspend {
            reason: "it is lost; no other design can be used, and no plan exists without the action"
                .to_owned(),
            status: "unsolvable",
            because: "nothing serves".to_owned(),
            blocking: vec!["fd_a".to_owned()],
        };
        check(false, true, true, None, &Interruption::None);
        check(false, true, true, Some(3), &cancel("cancelling the action improves the metric by 3"));
        check(false, true, false, None, &Interruption::None);
        check(false, false, true, None, &cancel("no other design can be used"));
        check(true, false, true, None, &cancel("no plan exists that continues the action"));
        check(true, false, false, None, &Interruption::None);
        check(false, false, false, None, &suspend);
    }

    #[test]
    fn plans_that_were_not_found_are_not_said_to_be_impossible() {
        let decide = |can_go_on, without| {
            weigh("it is lost", can_go_on, &outcome(false, false), outcome(without, false), None)
        };
        for (can_go_on, expected) in [
            (false, "it is lost; no plan with another design was found"),
            (true, "it is lost; no plan that continues the action was found"),
        ] {
            let because = expected.to_owned();
            assert_eq!(decide(can_go_on, true), Interruption::Cancel { because });
        }
        let suspend = |reason: &str| Interruption::Suspend {
            reason: format!("it is lost; no plan with another design was found, and {reason}"),
            status: "unknown",
            because: "nothing serves".to_owned(),
            blocking: vec!["fd_a".to_owned()],
        };
        assert_eq!(decide(false, false), suspend("no plan without the action was found"));
        // A plan that continues the action may exist, whatever the reasons against a plan without the action.
        let proof =
            Outcome { because: "all is lost".to_owned(), blocking: Vec::new(), ..outcome(false, true) };
        let decision = weigh("it is lost", false, &outcome(false, false), proof, None);
        assert_eq!(decision, suspend("no plan exists without the action"));
    }
}
