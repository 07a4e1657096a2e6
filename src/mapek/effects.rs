//! What is asked of the managed system, and what the knowledge base hears of it: which functions are objectives now, and which
//! designs are grounded for them.

use std::collections::BTreeSet;

use crate::mapek::analyze::{analyze, contradict};
use crate::mapek::answer::{Answer, Command, Effect};
use crate::mapek::beliefs::{Beliefs, Running, Wait};
use crate::mapek::step::PlannedStep;

/// Upper limit on the effects that one effect names as superseded.
const MAX_SUPERSEDED: usize = 64;

/// The goal holds: nothing is to be done any more.
pub(super) fn finish(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) {
    beliefs.reached = true;
    beliefs.plan = None;
    objectives(beliefs, None, answers);
    answers.push(Answer::GoalReached);
}

/// Requests an action, with its configuration.
pub(super) fn request(beliefs: &mut Beliefs, step: PlannedStep, answers: &mut Vec<Answer>) {
    beliefs.actions += 1;
    let action = beliefs.actions;
    let mut running = Running {
        action,
        instructed: step.configuration.clone(),
        step,
        progress: num_rational::BigRational::from_integer(0.into()),
        cancelling: false,
        suspended: false,
        provisional: false,
        request: 0,
        heard: beliefs.now,
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

/// Gives functions the designs of an action, and the knowledge base its objectives.
///
/// An action may still wait for designs that it was told to use. If it gets others it is told so, also where its functions have
/// them already.
pub(super) fn reconfigure(beliefs: &mut Beliefs, running: &mut Running, answers: &mut Vec<Answer>) {
    let may_wait = !running.suspended && (!running.started || running.resumed);
    for pair in &running.step.configuration {
        let (function, design) = pair;
        if beliefs.expected(function) != Some(design) || may_wait && !running.instructed.contains(pair) {
            let from = beliefs.configuration.get(function).cloned();
            let command = Command::Reconfigure { function: function.clone(), from, to: design.clone() };
            effect(beliefs, running.action, command, answers);
        }
    }
    running.instructed.clone_from(&running.step.configuration);
    objectives(beliefs, Some(&running.step), answers);
}

/// Asks the managed system for something.
pub(super) fn effect(beliefs: &mut Beliefs, action: u64, command: Command, answers: &mut Vec<Answer>) {
    beliefs.effects += 1;
    let number = beliefs.effects;
    let outstanding = &mut beliefs.outstanding;
    let is_replaced = |old: &Effect| command.replaces(&old.command, old.action == action);
    let replaced: Vec<u64> =
        outstanding.values().filter(|old| is_replaced(old)).map(|old| old.number).collect();
    // An effect may arrive after the one that has superseded it has been superseded in turn: all of them are named.
    let mut supersedes: BTreeSet<u64> = replaced.iter().copied().collect();
    supersedes
        .extend(replaced.iter().filter_map(|number| outstanding.get(number)).flat_map(|old| &old.supersedes));
    if let Command::Reconfigure { function, .. } = &command {
        supersedes.extend(beliefs.receipts.unanswered(function));
    }
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

/// Makes the functions of a step, and no others, the objectives of the knowledge base, grounded as the step says.
pub(super) fn objectives(beliefs: &mut Beliefs, step: Option<&PlannedStep>, answers: &mut Vec<Answer>) {
    let mission = &beliefs.mission;
    let mut wanted = step.map_or_else(Vec::new, |step| step.configuration.clone());
    wanted.retain(|(_, design)| !mission.decides_on(design));
    let Some(knowledge) = beliefs.mission.knowledge_mut() else { return };
    if let Err(error) = knowledge.pursue_in_time(&wanted) {
        answers.push(Answer::Error { code: error.code.clone(), message: error.message.clone() });
    }
    contradict(beliefs, answers);
    analyze(beliefs, answers);
}

/// Asks for a safe end of the action under way.
pub(super) fn cancel(beliefs: &mut Beliefs, running: Running, because: String, answers: &mut Vec<Answer>) {
    beliefs.plan = None;
    effect(beliefs, running.action, Command::Cancel { because }, answers);
    beliefs.running = Some(Running { cancelling: true, ..running });
}

/// Asks the action under way to stand still.
pub(super) fn suspend(beliefs: &mut Beliefs, running: Running, reason: &str, answers: &mut Vec<Answer>) {
    beliefs.plan = None;
    beliefs.stuck = true;
    if !running.suspended {
        let because = format!("{reason}; no other design serves, and there is no plan without it");
        effect(beliefs, running.action, Command::Suspend { because }, answers);
    }
    beliefs.running = Some(Running { suspended: true, provisional: false, ..running });
}

/// Lets a suspended action go on.
pub(super) fn resume_suspended(beliefs: &mut Beliefs, running: &mut Running, answers: &mut Vec<Answer>) {
    running.provisional = false;
    if std::mem::take(&mut running.suspended) {
        (running.heard, running.overdue) = (beliefs.now, 0);
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

    /// The commands among the answers, each in a word.
    fn words(answers: &[Answer]) -> Vec<String> {
        let word = |command: &Command| match command {
            Command::Reconfigure { function, from, to } => format!("{function} {from:?} {to}"),
            Command::Request { step } => step.action.clone(),
            Command::Cancel { .. } => "cancel".to_owned(),
            other => format!("{other:?}"),
        };
        answers.iter().filter_map(Answer::effect).map(|effect| word(&effect.command)).collect()
    }

    #[test]
    fn designs_come_before_the_action_that_needs_them() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let mut beliefs = Beliefs::new(Setup::read(&manifest).expect("the mission is read").mission);
        let step = |design: &str| PlannedStep {
            action: "move".to_owned(),
            arguments: vec!["wp1".to_owned(), "wp2".to_owned(), design.to_owned()],
            written: 3,
            configuration: vec![("f_localization".to_owned(), design.to_owned())],
            duration: BigRational::default(),
            cost: BigRational::default(),
        };
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
