//! React: from what has changed to a safe effect for the action under way, before anything is planned.
//!
//! An action that has lost a design, or of which the rest cannot be done any more, gets other available designs if the validator
//! accepts what is left of it with them; otherwise it is suspended. No search is involved: each configuration of the one action is
//! tried once. Planning decides afterwards what is best.

use num_rational::BigRational;
use pddl::ast::Direction;

use crate::mapek::analyze::Findings;
use crate::mapek::answer::{Answer, Command};
use crate::mapek::ask::Ask;
use crate::mapek::beliefs::{Beliefs, Running};
use crate::mapek::effects::{effect, reconfigure};
use crate::mapek::live::first_steps;
use crate::mapek::monitor::Changes;
use crate::mapek::settings::{SafeReaction, Settings};
use crate::mapek::step::PlannedStep;

/// Asks for a safe effect if the action under way cannot go on as it is.
pub(super) fn react(
    beliefs: &mut Beliefs,
    settings: &Settings,
    findings: &Findings,
    changes: &mut Changes,
    answers: &mut Vec<Answer>,
) {
    let running = beliefs.running.clone().filter(|own| !own.cancelling && !own.suspended);
    let Some(mut running) = running else { return };
    // A design may be a condition of an action without being a part of its configuration.
    let facts = changes.facts || !findings.lost.is_empty();
    let Some(reason) = trouble(beliefs, &running, facts) else { return };
    let other = match settings.safe_reaction {
        SafeReaction::Reconfigure => other_designs(beliefs, &running),
        SafeReaction::Suspend => None,
    };
    if let Some(step) = other {
        running.step = step;
        reconfigure(beliefs, &mut running, answers);
    } else {
        let because = format!("{reason}; it stands still until it is decided what becomes of it");
        effect(beliefs, running.action, Command::Suspend { because }, answers);
        (running.suspended, running.provisional) = (true, true);
    }
    beliefs.running = Some(running);
    changes.upset.push(reason);
}

/// Reason why an action cannot go on as it is; `facts` says whether its conditions may have changed.
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

/// The action with those available designs with which what is left of it can be done at least cost; of equal ones the first.
fn other_designs(beliefs: &Beliefs, running: &Running) -> Option<PlannedStep> {
    let problem = beliefs.filled();
    let ask = Ask {
        mission: &beliefs.mission,
        problem: &problem,
        running: Some(running),
        old: None,
        stay_close: false,
    };
    let is_available =
        |step: &PlannedStep| step.configuration.iter().all(|(_, design)| beliefs.is_available(design));
    let metric = problem.metric.as_ref();
    let is_maximized = metric.is_some_and(|metric| metric.direction == Direction::Maximize);
    let worth = |cost: BigRational| if is_maximized { -cost } else { cost };
    let steps = first_steps(&ask)?.into_iter().filter(|(step, _)| is_available(step));
    steps.map(|(step, first)| (worth(first.metric), step)).min_by(|a, b| a.0.cmp(&b.0)).map(|(_, step)| step)
}
