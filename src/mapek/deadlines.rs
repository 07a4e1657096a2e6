//! Deadlines for unacknowledged effects and for actions without reports.
//!
//! Deadlines are checked at each timer and each line, including ticks and lines with refused events, but not at lines
//! that are refused for their `seq` or `time`.
//! Acknowledgements have deadlines only after the robot has first acknowledged an effect by its number. An overdue
//! action is cancelled only if the robot has sent messages of the missing kind before: progress of this action, the
//! start or progress of some action, or an acknowledgement. Every robot is expected to report the end of a cancelled
//! action.

use std::time::Duration;

use crate::mapek::answer::{Answer, Command, Effect, OverdueOutcome};
use crate::mapek::beliefs::{Beliefs, Running};
use crate::mapek::effects::cancel;
use crate::mapek::settings::Settings;
use crate::number;

/// Effect numbers of reconfigurations that count as failed, because neither the request nor its repetition was
/// acknowledged in time.
pub(super) type Expired = Vec<u64>;

/// Repeats overdue effects. For an overdue action, repeats its request, cancels it, or only reports the delay. Returns
/// the reconfigurations that count as failed. Does nothing if the deadline is 0.
pub(super) fn handle_overdue(
    beliefs: &mut Beliefs,
    settings: &Settings,
    answers: &mut Vec<Answer>,
) -> Expired {
    if settings.deadline.is_zero() {
        return Expired::new();
    }
    let expired = check_effects(beliefs, settings.deadline, answers);
    check_action(beliefs, settings, answers);
    expired
}

pub(super) fn due(beliefs: &Beliefs, settings: &Settings) -> Option<Duration> {
    if settings.deadline.is_zero() {
        return None;
    }
    let request_of_suspended = suspended_request(beliefs);
    let is_effect = |number: &u64| {
        beliefs
            .outstanding
            .get(number)
            .is_some_and(|pending| !is_request(pending) || request_of_suspended == Some(*number))
    };
    let waits = beliefs.waits.iter().filter(|(number, _)| beliefs.receipts.are_sent() && is_effect(number));
    let effects = waits.map(|(_, wait)| wait.since.saturating_add(settings.deadline));
    let has_deadline = |action: &&Running| {
        !action.suspended && !action.cancelling || action.cancelling && open_cancel(beliefs).is_some()
    };
    let running = beliefs.running.as_ref().filter(has_deadline);
    let action =
        running.map(|action| action.last_report.saturating_add(next_deadline_after(action, settings)));
    effects.chain(action).min()
}

fn is_request(effect: &Effect) -> bool {
    matches!(effect.command, Command::Request { .. })
}

/// Returns the effect number of the request of the action under way if the action is suspended and the suspension is
/// acknowledged. A suspended action has no deadline, so its request, if unacknowledged, is repeated like other effects
/// and starts the action in the suspended state. Before the suspension is acknowledged, a repeated request might start
/// the action without suspending it.
fn suspended_request(beliefs: &Beliefs) -> Option<u64> {
    let running = beliefs.running.as_ref().filter(|action| action.suspended && !action.cancelling)?;
    let is_about = |effect: &Effect| effect.action == running.action && effect.command.controls_execution();
    let is_open = beliefs.outstanding.values().any(is_about);
    (!is_open).then_some(running.request)
}

/// Repeats effects that were not acknowledged in time. Returns the reconfigurations that count as failed. Requests of
/// actions are skipped unless the action is suspended, because the deadline of the action applies to them.
fn check_effects(beliefs: &mut Beliefs, deadline: Duration, answers: &mut Vec<Answer>) -> Expired {
    let mut expired = Expired::new();
    // This robot may never acknowledge effects.
    if !beliefs.receipts.are_sent() {
        return expired;
    }
    let now = beliefs.now;
    let request_of_suspended = suspended_request(beliefs);
    for (number, wait) in &mut beliefs.waits {
        let Some(effect) = beliefs.outstanding.get(number) else { continue };
        let waited = now.saturating_sub(wait.since);
        if waited < deadline || is_request(effect) && request_of_suspended != Some(*number) {
            continue;
        }
        // Other effects than reconfigurations are repeated without end. Otherwise, for example, a cancelled action
        // might go on.
        let is_expired = wait.repeats > 0 && matches!(effect.command, Command::Reconfigure { .. });
        let outcome = if is_expired { OverdueOutcome::Failed } else { OverdueOutcome::Repeated };
        answers.push(Answer::Overdue {
            effect: Some(*number),
            action: effect.action,
            seconds: waited.as_secs(),
            outcome,
        });
        if is_expired {
            expired.push(*number);
        } else {
            (wait.since, wait.repeats) = (now, wait.repeats.saturating_add(1));
            answers.push(Answer::Effect(Effect { repeated: true, ..effect.clone() }));
        }
    }
    expired
}

/// Returns the cancellation of the action under way, if it is acknowledged or the robot has never acknowledged an effect
/// by its number. It is then repeated until the action ends, because every robot must report the end of an action.
fn open_cancel(beliefs: &Beliefs) -> Option<&Effect> {
    let running = beliefs.running.as_ref().filter(|action| action.cancelling)?;
    let is_cancel = |effect: &&Effect| {
        effect.action == running.action && matches!(effect.command, Command::Cancel { .. })
    };
    let is_awaited =
        |effect: &&Effect| beliefs.receipts.are_sent() && beliefs.waits.contains_key(&effect.number);
    beliefs.outstanding.values().find(is_cancel).filter(|effect| !is_awaited(effect))
}

fn check_action(beliefs: &mut Beliefs, settings: &Settings, answers: &mut Vec<Answer>) {
    if let Some(cancel) = open_cancel(beliefs).cloned()
        && let Some(running) = &mut beliefs.running
    {
        if let Some(seconds) = passed_deadline(running, beliefs.now, settings) {
            let (effect, action) = (Some(cancel.number), running.action);
            answers.push(Answer::Overdue { effect, action, seconds, outcome: OverdueOutcome::Repeated });
            answers.push(Answer::Effect(Effect { repeated: true, ..cancel }));
        }
        return;
    }
    let Some(running) = beliefs.running.as_mut().filter(|action| !action.cancelling && !action.suspended)
    else {
        return;
    };
    let Some(seconds) = passed_deadline(running, beliefs.now, settings) else { return };
    let (action, request) = (running.action, running.request);
    let is_unacknowledged = beliefs.outstanding.contains_key(&request);
    let is_first = running.overdue == 1;
    // A report is expected if the robot has sent a report of this kind before.
    let is_expected = match (running.started, is_unacknowledged) {
        (true, _) => running.progressed,
        (false, true) => beliefs.reports_actions || beliefs.receipts.are_sent(),
        (false, false) => beliefs.reports_actions,
    };
    let outcome = match (is_first, is_unacknowledged, is_expected) {
        (true, true, true) | (_, true, false) => OverdueOutcome::Repeated,
        (false, _, true) => OverdueOutcome::Cancelled,
        _ => OverdueOutcome::Waiting,
    };
    answers.push(Answer::Overdue { effect: is_unacknowledged.then_some(request), action, seconds, outcome });
    match outcome {
        OverdueOutcome::Repeated => {
            // For a robot that has never acknowledged an effect by its number, the effects before the request, such as
            // reconfigurations, are repeated only here.
            let from = if beliefs.receipts.are_sent() { request } else { 0 };
            let effects = beliefs.outstanding.range(from..=request).map(|(_, effect)| effect.clone());
            answers.extend(effects.map(|effect| Answer::Effect(Effect { repeated: true, ..effect })));
        }
        OverdueOutcome::Cancelled => {
            let running = running.clone();
            let because = format!("no event about action {action} arrived for {seconds} s");
            // An action that has never started may be waiting for a design that its function was wrongly believed to
            // have.
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

/// Returns the seconds since the last report of an action if its deadline has passed, and sets the next deadline;
/// `None` otherwise. The deadlines are 1, 2, 3, 5, 9, 17, … times the allowed silence after the last report, so that
/// a robot that never reports causes few messages.
fn passed_deadline(running: &mut Running, now: Duration, settings: &Settings) -> Option<u64> {
    let time_since_report = now.saturating_sub(running.last_report);
    if time_since_report < next_deadline_after(running, settings) {
        return None;
    }
    running.overdue = running.overdue.saturating_mul(2).max(1);
    Some(time_since_report.as_secs())
}

fn next_deadline_after(running: &Running, settings: &Settings) -> Duration {
    allowed_silence(running, settings).saturating_mul(running.overdue.saturating_add(1))
}

/// Time without reports after which an action is first overdue: `deadline_factor` times its expected duration, but at
/// least `settings.deadline`.
fn allowed_silence(running: &Running, settings: &Settings) -> Duration {
    let expected = number::to_f64(&running.step.duration) * settings.time_unit.seconds();
    let allowed_silence =
        Duration::try_from_secs_f64(expected * settings.deadline_factor).unwrap_or(Duration::MAX);
    allowed_silence.max(settings.deadline)
}
