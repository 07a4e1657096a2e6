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

/// Time since the start of the mission of the next deadline.
pub(super) fn due(beliefs: &Beliefs, settings: &Settings) -> Option<Duration> {
    if settings.deadline.is_zero() {
        return None;
    }
    let still = still_request(beliefs);
    let is_effect = |number: &u64| {
        beliefs.outstanding.get(number).is_some_and(|own| !is_request(own) || still == Some(*number))
    };
    let waits = beliefs.waits.iter().filter(|(number, _)| beliefs.receipts.are_sent() && is_effect(number));
    let effects = waits.map(|(_, wait)| wait.since.saturating_add(settings.deadline));
    let is_action = |own: &&Running| {
        !own.suspended && !own.cancelling || own.cancelling && open_cancel(beliefs).is_some()
    };
    let running = beliefs.running.as_ref().filter(is_action);
    let action = running.map(|own| own.heard.saturating_add(patience(own, settings)));
    effects.chain(action).min()
}

/// Returns `true` for the request of an action, which has a deadline of its own.
fn is_request(effect: &Effect) -> bool {
    matches!(effect.command, Command::Request { .. })
}

/// The request of the action under way, if that stands still and has acknowledged it. It is repeated like any other effect: the
/// action has no deadline then, and begins with a standstill. Before that acknowledgement the action might move.
fn still_request(beliefs: &Beliefs) -> Option<u64> {
    let running = beliefs.running.as_ref().filter(|own| own.suspended && !own.cancelling)?;
    let is_about = |effect: &Effect| effect.action == running.action && effect.command.is_about_going_on();
    let is_open = beliefs.outstanding.values().any(is_about);
    (!is_open).then_some(running.request)
}

/// Effects that the robot should have acknowledged.
fn effects(beliefs: &mut Beliefs, deadline: Duration, answers: &mut Vec<Answer>) -> Expired {
    let mut expired = Expired::new();
    if !beliefs.receipts.are_sent() {
        return expired;
    }
    let now = beliefs.now;
    let still = still_request(beliefs);
    for (number, wait) in &mut beliefs.waits {
        let Some(effect) = beliefs.outstanding.get(number) else { continue };
        let waited = now.saturating_sub(wait.since);
        if waited < deadline || is_request(effect) && still != Some(*number) {
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

/// The cancellation of the action under way, if it has to be repeated without regard to acknowledgements: of a robot that has never
/// acknowledged anything, too, the end of the action is expected.
fn open_cancel(beliefs: &Beliefs) -> Option<&Effect> {
    let running = beliefs.running.as_ref().filter(|own| own.cancelling)?;
    let is_cancel =
        |own: &&Effect| own.action == running.action && matches!(own.command, Command::Cancel { .. });
    beliefs.outstanding.values().find(is_cancel).filter(|_| !beliefs.receipts.are_sent())
}

/// The action under way, of which something should have been heard.
fn action(beliefs: &mut Beliefs, settings: &Settings, answers: &mut Vec<Answer>) {
    if let Some(cancel) = open_cancel(beliefs).cloned()
        && let Some(running) = &mut beliefs.running
    {
        let silence = beliefs.now.saturating_sub(running.heard);
        if silence >= patience(running, settings) {
            running.overdue = running.overdue.saturating_mul(2).max(1);
            let (effect, action, seconds) = (Some(cancel.number), running.action, silence.as_secs());
            answers.push(Answer::Overdue { effect, action, seconds, outcome: OverdueOutcome::Repeated });
            answers.push(Answer::Effect(Effect { repeated: true, ..cancel }));
        }
        return;
    }
    let Some(running) = beliefs.running.as_mut().filter(|own| !own.cancelling && !own.suspended) else {
        return;
    };
    let silence = beliefs.now.saturating_sub(running.heard);
    if silence < patience(running, settings) {
        return;
    }
    running.overdue = running.overdue.saturating_mul(2).max(1);
    let (action, request) = (running.action, running.request);
    let is_unheard = beliefs.outstanding.contains_key(&request);
    let is_first = running.overdue == 1;
    let is_expected = match (running.started, is_unheard) {
        (true, _) => running.progressed,
        (false, true) => beliefs.reports_actions || beliefs.receipts.are_sent(),
        (false, false) => beliefs.reports_actions,
    };
    let outcome = match (is_first, is_unheard, is_expected) {
        (true, true, true) | (_, true, false) => OverdueOutcome::Repeated,
        (false, _, true) => OverdueOutcome::Cancelled,
        _ => OverdueOutcome::Waiting,
    };
    let seconds = silence.as_secs();
    answers.push(Answer::Overdue { effect: is_unheard.then_some(request), action, seconds, outcome });
    match outcome {
        OverdueOutcome::Repeated => {
            // Of a robot that has never acknowledged anything nothing else is repeated: so are the designs that the action needs.
            let from = if beliefs.receipts.are_sent() { request } else { 0 };
            let effects = beliefs.outstanding.range(from..=request).map(|(_, effect)| effect.clone());
            answers.extend(effects.map(|effect| Answer::Effect(Effect { repeated: true, ..effect })));
        }
        OverdueOutcome::Cancelled => {
            let running = running.clone();
            let because = format!("nothing was heard of action {action} for {seconds} s");
            // An action that has never started may lack a design that its function is believed to have.
            if !running.started {
                for (function, _) in &running.step.configuration {
                    beliefs.configuration.remove(function);
                }
            }
            cancel(beliefs, running, because, answers);
        }
        OverdueOutcome::Failed | OverdueOutcome::Waiting => {}
    }
}

/// Time without a report of an action after which its next deadline has passed.
fn patience(running: &Running, settings: &Settings) -> Duration {
    limit(running, settings).saturating_mul(running.overdue.saturating_add(1))
}

/// How long nothing need be heard of an action.
fn limit(running: &Running, settings: &Settings) -> Duration {
    let expected = number::to_f64(&running.step.duration) * settings.time_unit.seconds();
    let limit = Duration::try_from_secs_f64(expected * settings.deadline_factor).unwrap_or(Duration::MAX);
    limit.max(settings.deadline)
}
