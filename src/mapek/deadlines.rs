//! Deadlines: time passed to what becomes of effects without acknowledgement and actions without a report.
//!
//! Nothing here measures time: it is looked at with each line, a tick among them. A robot that does not report something is not
//! waited for: of a robot that never acknowledged a reconfiguration by its number no acknowledgement is expected, and an action is
//! brought to an end only where reports of it have stopped, or where the robot has reported the start of others.

use std::time::Duration;

use crate::mapek::answer::{Answer, Command, Effect, OverdueOutcome};
use crate::mapek::beliefs::{Beliefs, Running};
use crate::mapek::effects::cancel;
use crate::mapek::settings::Settings;
use crate::number;

/// Reconfigurations that count as failed since they were not acknowledged after they had been repeated.
pub(super) type Expired = Vec<u64>;

/// Repeats or gives up what is overdue, and says so.
pub(super) fn overdue(beliefs: &mut Beliefs, settings: &Settings, answers: &mut Vec<Answer>) -> Expired {
    if settings.deadline.is_zero() {
        return Expired::new();
    }
    let expired = effects(beliefs, settings.deadline, answers);
    action(beliefs, settings, answers);
    expired
}

/// Effects that the robot should have acknowledged.
fn effects(beliefs: &mut Beliefs, deadline: Duration, answers: &mut Vec<Answer>) -> Expired {
    let mut expired = Expired::new();
    if !beliefs.receipts.are_sent() {
        return expired;
    }
    let now = beliefs.now;
    for (number, wait) in &mut beliefs.waits {
        let Some(effect) = beliefs.outstanding.get(number) else { continue };
        let waited = now.saturating_sub(wait.since);
        // The request of an action has a deadline of its own.
        if waited < deadline || matches!(effect.command, Command::Request { .. }) {
            continue;
        }
        let is_hopeless = wait.repeats > 0 && matches!(effect.command, Command::Reconfigure { .. });
        let outcome = if is_hopeless { OverdueOutcome::Failed } else { OverdueOutcome::Repeated };
        answers.push(Answer::Overdue {
            effect: Some(*number),
            action: effect.action,
            seconds: waited.as_secs(),
            outcome,
        });
        if is_hopeless {
            expired.push(*number);
        } else {
            (wait.since, wait.repeats) = (now, wait.repeats.saturating_add(1));
            answers.push(Answer::Effect(Effect { repeated: true, ..effect.clone() }));
        }
    }
    expired
}

/// The action under way, of which something should have been heard.
fn action(beliefs: &mut Beliefs, settings: &Settings, answers: &mut Vec<Answer>) {
    let Some(running) = beliefs.running.as_mut().filter(|own| !own.cancelling && !own.suspended) else {
        return;
    };
    let limit = limit(running, settings);
    let silence = beliefs.now.saturating_sub(running.heard);
    if silence < limit.saturating_mul(running.overdue.saturating_add(1)) {
        return;
    }
    running.overdue = running.overdue.saturating_mul(2).max(1);
    let (action, request) = (running.action, running.request);
    let is_unheard = beliefs.outstanding.contains_key(&request);
    let is_first = running.overdue == 1;
    let is_expected =
        if is_unheard { beliefs.reports_actions || beliefs.receipts.are_sent() } else { running.progressed };
    let outcome = match (is_first, is_unheard, is_expected) {
        (true, true, true) => OverdueOutcome::Repeated,
        (false, _, true) => OverdueOutcome::Cancelled,
        _ => OverdueOutcome::Waiting,
    };
    let seconds = silence.as_secs();
    answers.push(Answer::Overdue { effect: is_unheard.then_some(request), action, seconds, outcome });
    match outcome {
        OverdueOutcome::Repeated => {
            let effect = beliefs.outstanding.get(&request).cloned();
            answers.extend(effect.map(|effect| Answer::Effect(Effect { repeated: true, ..effect })));
        }
        OverdueOutcome::Cancelled => {
            let running = running.clone();
            let because = format!("nothing was heard of action {action} for {seconds} s");
            cancel(beliefs, running, because, answers);
        }
        OverdueOutcome::Failed | OverdueOutcome::Waiting => {}
    }
}

/// How long nothing need be heard of an action.
fn limit(running: &Running, settings: &Settings) -> Duration {
    let expected = number::to_f64(&running.step.duration) * settings.time_unit.seconds();
    let limit = Duration::try_from_secs_f64(expected * settings.deadline_factor).unwrap_or(Duration::MAX);
    limit.max(settings.deadline)
}
