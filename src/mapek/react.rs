//! React: after changes and before planning, reconfigures or suspends the action under way if it cannot continue
//! unchanged.
//!
//! If an action has lost a design, or its remainder is not executable, the action is reconfigured to available designs
//! for which the validator accepts the remainder. If no such designs exist, if there are too many configurations to try,
//! or if the settings say so, the action is suspended. This decision needs no search: each configuration of this one
//! action is simulated once. Planning decides later about the whole mission.

use std::collections::BTreeSet;

use num_rational::BigRational;
use pddl::ast::{Direction, Name};
use pddl::validate::may_read;

use crate::mapek::analyze::Findings;
use crate::mapek::answer::{Answer, Command};
use crate::mapek::ask::Question;
use crate::mapek::beliefs::{Beliefs, Running};
use crate::mapek::effects::{effect, reconfigure};
use crate::mapek::live::first_steps;
use crate::mapek::monitor::Changes;
use crate::mapek::settings::{SafeReaction, Settings};
use crate::mapek::step::PlannedStep;

pub(super) fn react(
    beliefs: &mut Beliefs,
    settings: &Settings,
    findings: &Findings,
    changes: &mut Changes,
    answers: &mut Vec<Answer>,
) {
    let running = beliefs.running.clone().filter(|action| !action.cancelling && !action.suspended);
    let Some(mut running) = running else { return };
    let (domain, problem) = (beliefs.mission.domain(), beliefs.mission.problem());
    let lost: BTreeSet<Name> = findings.lost.iter().map(|design| Name::new(design)).collect();
    let facts =
        changes.facts || !lost.is_empty() && may_read(domain, problem, &running.step.to_plan_step(), &lost);
    let Some(reason) = trouble(beliefs, &running, facts) else { return };
    let reconfigured = match settings.safe_reaction {
        SafeReaction::Reconfigure => other_designs(beliefs, &running),
        SafeReaction::Suspend => None,
    };
    if let Some(step) = reconfigured {
        running.step = step;
        reconfigure(beliefs, &mut running, answers);
    } else {
        let because = format!("{reason}; the action is suspended until a new decision");
        effect(beliefs, running.action, Command::Suspend { because }, answers);
        (running.suspended, running.provisional) = (true, true);
    }
    beliefs.running = Some(running);
    changes.interruptions.push(reason);
}

/// Returns the reason why the action under way cannot continue unchanged, or `None` if it can. `facts` is `true` if
/// facts in its conditions may have changed; otherwise only its designs are checked.
pub(super) fn trouble(beliefs: &Beliefs, running: &Running, facts: bool) -> Option<String> {
    let lost = running.step.configuration.iter().find(|(_, design)| !beliefs.is_available(design));
    if let Some((_, design)) = lost {
        return Some(format!("{design}, which action {} uses, is not available any more", running.action));
    }
    if !facts {
        return None;
    }
    beliefs.obstacle(running).map(|obstacle| format!("action {}: {obstacle}", running.action))
}

/// Returns the action under way with the available designs that make its remainder executable with the best metric.
/// Ties are broken by the order of designs. Returns `None` if no designs make the remainder executable, or if the
/// combinations of designs cannot be simulated (see [`first_steps`]).
fn other_designs(beliefs: &Beliefs, running: &Running) -> Option<PlannedStep> {
    let problem = beliefs.filled();
    let question = Question {
        mission: &beliefs.mission,
        problem: &problem,
        goal: beliefs.goal(),
        running: Some(running),
        old: None,
        stay_close: false,
    };
    let is_available =
        |step: &PlannedStep| step.configuration.iter().all(|(_, design)| beliefs.is_available(design));
    let metric = problem.metric.as_ref();
    let is_maximized = metric.is_some_and(|metric| metric.direction == Direction::Maximize);
    let worth = |cost: BigRational| if is_maximized { -cost } else { cost };
    let steps = first_steps(&question)?.into_iter().filter(|(step, _)| is_available(step));
    steps.map(|(step, first)| (worth(first.metric), step)).min_by(|a, b| a.0.cmp(&b.0)).map(|(_, step)| step)
}
