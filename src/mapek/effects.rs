//! Creates effects for the managed system, and updates the objectives and groundings of the knowledge base.

use std::collections::{BTreeMap, BTreeSet};

use crate::mapek::analyze::{analyze, report_contradictions};
use crate::mapek::answer::{Answer, Command, Effect};
use crate::mapek::beliefs::{Beliefs, Running, Wait};
use crate::mapek::step::PlannedStep;

const MAX_SUPERSEDED: usize = 64;

pub(super) fn finish(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) {
    beliefs.reached = true;
    beliefs.plan = None;
    objectives(beliefs, None, answers);
    answers.push(Answer::GoalReached);
}

pub(super) fn request(beliefs: &mut Beliefs, step: PlannedStep, answers: &mut Vec<Answer>) {
    beliefs.actions += 1;
    let action = beliefs.actions;
    let mut running = Running {
        action,
        sent_configuration: step.configuration.clone(),
        step,
        progress: num_rational::BigRational::from_integer(0.into()),
        applied: BTreeMap::new(),
        cancelling: false,
        suspended: false,
        provisional: false,
        request: 0,
        last_report: beliefs.now,
        overdue: 0,
        started: false,
        progressed: false,
        resumed: false,
    };
    reconfigure(beliefs, &mut running, answers);
    effect(beliefs, action, Command::Request { step: running.step.clone() }, answers);
    running.request = beliefs.effects;
    beliefs.running = Some(running);
}

/// Requests those designs of an action that must be sent (see [`must_be_sent`]). Then makes the action's functions the
/// objectives of the knowledge base.
///
/// A requested action can still be waiting for its previous designs. Therefore, a changed design of the action is
/// requested even if the function already has it.
pub(super) fn reconfigure(beliefs: &mut Beliefs, running: &mut Running, answers: &mut Vec<Answer>) {
    for pair in &running.step.configuration {
        if must_be_sent(beliefs, running, pair) {
            let (function, design) = pair;
            let from = beliefs.configuration.get(function).cloned();
            let command = Command::Reconfigure { function: function.clone(), from, to: design.clone() };
            effect(beliefs, running.action, command, answers);
        }
    }
    running.sent_configuration.clone_from(&running.step.configuration);
    objectives(beliefs, Some(&running.step), answers);
}

/// Returns `true` if the design in `pair` (function, design) must be requested for the action under way. This is the
/// case if the function is not expected to have this design, or if the action may be waiting for another design
/// requested before.
pub(super) fn must_be_sent(beliefs: &Beliefs, running: &Running, pair: &(String, String)) -> bool {
    let may_wait = !running.suspended && (!running.started || running.resumed);
    let (function, design) = pair;
    beliefs.expected(function) != Some(design) || may_wait && !running.sent_configuration.contains(pair)
}

/// Creates the effect (request to the robot) with `command` and adds it to the answers. Removes the outstanding effects
/// that it supersedes. The new effect lists their numbers and those of earlier superseded effects that may still
/// arrive, at most [`MAX_SUPERSEDED`].
pub(super) fn effect(beliefs: &mut Beliefs, action: u64, command: Command, answers: &mut Vec<Answer>) {
    beliefs.effects += 1;
    let number = beliefs.effects;
    let outstanding = &mut beliefs.outstanding;
    let is_replaced = |old: &Effect| command.replaces(&old.command, old.action == action);
    let replaced: Vec<u64> =
        outstanding.values().filter(|old| is_replaced(old)).map(|old| old.number).collect();
    // The list contains the replaced effects and the effects that these have superseded, because the new effect may
    // arrive before any of them.
    let mut supersedes: BTreeSet<u64> = replaced.iter().copied().collect();
    supersedes
        .extend(replaced.iter().filter_map(|number| outstanding.get(number)).flat_map(|old| &old.supersedes));
    // Superseded reconfigurations without an answer may still arrive, too. A request or resumption lists them, because
    // it may arrive without the reconfiguration that supersedes them.
    match &command {
        Command::Reconfigure { function, .. } => supersedes.extend(beliefs.receipts.unanswered(function)),
        Command::Request { step: PlannedStep { configuration, .. } } | Command::Resume { configuration } => {
            let functions = configuration.iter().map(|(function, _)| function);
            supersedes
                .extend(functions.flat_map(|function| beliefs.receipts.unanswered_superseded(function)));
        }
        Command::Suspend { .. } | Command::Cancel { .. } => {}
    }
    // The list is bounded. The oldest effects have most likely arrived or been lost.
    while supersedes.len() > MAX_SUPERSEDED {
        supersedes.pop_first();
    }
    for number in &replaced {
        beliefs.waits.remove(number);
        if let Some(Command::Reconfigure { function, to, .. }) =
            outstanding.remove(number).map(|old| old.command)
        {
            beliefs.receipts.supersede(*number, function, to);
        }
    }
    beliefs.waits.insert(number, Wait { since: beliefs.now, repeats: 0 });
    let supersedes = supersedes.into_iter().collect();
    let effect = Effect { number, action, command, repeated: false, supersedes };
    outstanding.insert(number, effect.clone());
    answers.push(Answer::Effect(effect));
}

/// Makes exactly the functions of a step the objectives of the knowledge base, each grounded by the step's design. Omits
/// a function if the problem, not the knowledge base, decides whether its design is available. Without a step, removes
/// all objectives. Then analyzes the knowledge base. Adds the changes to `answers`, and also an error of the knowledge
/// base. Does nothing without a knowledge base.
pub(super) fn objectives(beliefs: &mut Beliefs, step: Option<&PlannedStep>, answers: &mut Vec<Answer>) {
    let mission = &beliefs.mission;
    let mut objectives_with_designs = step.map_or_else(Vec::new, |step| step.configuration.clone());
    objectives_with_designs.retain(|(_, design)| !mission.decides_on(design));
    let Some(knowledge) = beliefs.mission.knowledge_mut() else { return };
    if let Err(error) = knowledge.pursue_in_time(&objectives_with_designs) {
        answers.push(Answer::Error { code: error.code.clone(), message: error.message.clone() });
    }
    report_contradictions(beliefs, answers);
    analyze(beliefs, answers);
}

pub(super) fn cancel(beliefs: &mut Beliefs, running: Running, because: String, answers: &mut Vec<Answer>) {
    beliefs.plan = None;
    effect(beliefs, running.action, Command::Cancel { because }, answers);
    beliefs.running = Some(Running { cancelling: true, ..running });
}

pub(super) fn suspend(beliefs: &mut Beliefs, running: Running, because: String, answers: &mut Vec<Answer>) {
    beliefs.plan = None;
    beliefs.stuck = true;
    if !running.suspended {
        effect(beliefs, running.action, Command::Suspend { because }, answers);
    }
    beliefs.running = Some(Running { suspended: true, provisional: false, ..running });
}

pub(super) fn resume_suspended(beliefs: &mut Beliefs, running: &mut Running, answers: &mut Vec<Answer>) {
    running.provisional = false;
    if std::mem::take(&mut running.suspended) {
        (running.last_report, running.overdue) = (beliefs.now, 0);
        running.resumed = true;
        let configuration = running.step.configuration.clone();
        effect(beliefs, running.action, Command::Resume { configuration }, answers);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use num_rational::BigRational;

    use super::{cancel, finish, request};
    use crate::mapek::answer::{Answer, Command};
    use crate::mapek::beliefs::Beliefs;
    use crate::mapek::step::PlannedStep;
    use crate::setup::Setup;

    fn words(answers: &[Answer]) -> Vec<String> {
        let word = |command: &Command| match command {
            Command::Reconfigure { function, from, to } => format!("{function} {from:?} {to}"),
            Command::Request { step } => step.action.clone(),
            Command::Cancel { .. } => "cancel".to_owned(),
            other => format!("{other:?}"),
        };
        answers.iter().filter_map(Answer::effect).map(|effect| word(&effect.command)).collect()
    }

    fn beliefs() -> Beliefs {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        Beliefs::new(Setup::read(&manifest).expect("the mission is read").mission)
    }

    fn step(design: &str) -> PlannedStep {
        PlannedStep {
            action: "move".to_owned(),
            arguments: vec!["wp1".to_owned(), "wp2".to_owned(), design.to_owned()],
            written: 3,
            configuration: vec![("f_localization".to_owned(), design.to_owned())],
            duration: BigRational::default(),
            cost: BigRational::default(),
        }
    }

    /// A report about an action shows that its reconfiguration was carried out. A copy of the reconfiguration request
    /// may still be in transit, so the next reconfiguration supersedes it.
    #[test]
    fn a_reconfiguration_supersedes_the_implied_one() {
        let (mut beliefs, mut answers) = (beliefs(), Vec::new());
        request(&mut beliefs, step("fd_amcl_kinect"), &mut answers);
        beliefs.confirm_request(2);
        request(&mut beliefs, step("fd_amcl_lidar"), &mut answers);
        let superseded = |beliefs: &Beliefs| {
            let last =
                beliefs.outstanding().find(|effect| matches!(effect.command, Command::Reconfigure { .. }));
            last.map(|effect| effect.supersedes.clone())
        };
        assert_eq!(superseded(&beliefs), Some(vec![1]));
        // After the acknowledgement of effect 3, copies of earlier reconfigurations are not expected any more, so the
        // next one supersedes none.
        let _ = beliefs.acknowledge(3);
        request(&mut beliefs, step("fd_amcl_kinect"), &mut answers);
        assert_eq!(superseded(&beliefs), Some(Vec::new()));
    }

    #[test]
    fn designs_are_requested_before_their_action() {
        let mut beliefs = beliefs();
        let mut answers = Vec::new();
        request(&mut beliefs, step("fd_amcl_kinect"), &mut answers);
        assert_eq!(words(&answers), ["f_localization None fd_amcl_kinect", "move"]);
        assert_eq!(beliefs.outstanding().count(), 2);
        answers.clear();
        request(&mut beliefs, step("fd_amcl_kinect"), &mut answers);
        assert_eq!(words(&answers), ["move"], "the function has the design");
        let running = beliefs.running.clone().expect("an action is under way");
        answers.clear();
        cancel(&mut beliefs, running, "it is lost".to_owned(), &mut answers);
        assert_eq!(words(&answers), ["cancel"]);
        assert!(beliefs.cancelling());
        answers.clear();
        beliefs.running = None;
        finish(&mut beliefs, &mut answers);
        assert!(beliefs.reached() && answers.contains(&Answer::GoalReached), "{answers:?}");
    }
}
