//! Oracle of a simulation: checks the demands of [`crate`], except the comparison of states in (e).

use std::collections::{BTreeMap, BTreeSet};

use metaplan::mapek::{Answer, Command, Effect, Loop, OverdueOutcome};
use serde_json::Value;

use crate::robot::{Action, Robot};
use crate::schedule::Message;
use crate::{DESIGNS, FUNCTION, GOAL};

#[derive(Debug, Default)]
pub struct Judge {
    /// Components that have failed according to the delivered reports.
    failed: BTreeSet<String>,
    /// Designs whose reconfiguration failed or was abandoned, without a later report about the
    /// design.
    refused: BTreeSet<String>,
    requested: BTreeMap<u64, Effect>,
    superseded: BTreeSet<u64>,
    given_up: BTreeSet<u64>,
    belief: Belief,
    /// Whether an outdated observation has determined the believed design. No loop can detect this,
    /// because observations have no time stamp.
    is_misled: bool,
    /// Failed reconfigurations after which the loop has observed the design of the function.
    observed_failures: BTreeSet<u64>,
    /// Value of `is_misled` when the last reconfiguration was acknowledged.
    was_misled: bool,
    started: BTreeSet<u64>,
    progressed: BTreeSet<u64>,
    /// Action that the loop waits for although its deadline has passed.
    awaited: Option<u64>,
    ended: BTreeSet<u64>,
    plan: Plan,
    /// Failed component that the moving robot uses, and the number of consecutive steps with this motion.
    forbidden: Option<(&'static str, u64)>,
}

/// Last decision of the loop about plans. `None` has the reason.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Plan {
    #[default]
    Open,
    Reached,
    None(&'static str),
}

impl Judge {
    /// Records an event line that was delivered to the loop. Lines that the loop has not accepted are
    /// ignored.
    pub fn record_event(&mut self, event: &Value, is_taken: bool, robot: &Robot) {
        if !is_taken {
            return;
        }
        let component = event["component"].as_str().unwrap_or_default().to_owned();
        let (effect, action) = (event["effect"].as_u64(), event["action"].as_u64());
        match event["event"].as_str().unwrap_or_default() {
            "component_status" if event["status"] == "FALSE" => {
                self.failed.insert(component);
            }
            "component_status" => {
                self.failed.remove(&component);
            }
            "acknowledged" => {
                let last = self.belief.last.as_ref().map(|last| last.effect);
                self.belief.acknowledge(effect.unwrap_or_default());
                if self.belief.last.as_ref().map(|last| last.effect) != last {
                    self.was_misled = self.is_misled;
                }
            }
            "reconfiguration_failed" => {
                self.is_misled |=
                    self.was_misled && self.belief.last.as_ref().map(|last| last.effect) == effect;
                self.refused.extend(self.belief.record_failure(effect.unwrap_or_default()));
            }
            "design_status" => {
                self.refused.remove(event["design"].as_str().unwrap_or_default());
            }
            "configuration_observed" => {
                let design = event["design"].as_str().map(ToOwned::to_owned);
                // After an outdated report that there is no design, the loop requests the design again, unless an earlier
                // outdated observation has changed its decision.
                self.is_misled = (design.is_some() || self.is_misled) && design != robot.design;
                let latest = self.requested.last_key_value().map_or(0, |(number, _)| *number);
                self.belief.observe(design, latest);
                if self.belief.is_settled() && self.belief.design == robot.design {
                    self.observed_failures.extend(&robot.refused);
                }
            }
            "action_started" | "action_progress" => {
                self.started.extend(action);
                self.progressed.extend(action.filter(|_| event["event"] == "action_progress"));
                self.belief.confirm_before_request(action.unwrap_or_default(), &self.requested);
            }
            "action_succeeded" => {
                self.belief.confirm_before_request(action.unwrap_or_default(), &self.requested);
                self.ended.extend(action);
            }
            "action_failed" | "action_cancelled" => self.ended.extend(action),
            _ => {}
        }
        self.is_misled &= self.belief.design != robot.design;
    }

    pub fn note(&mut self, answer: &Answer) {
        match answer {
            Answer::Effect(effect) => {
                self.superseded.extend(&effect.supersedes);
                if self.requested.insert(effect.number, effect.clone()).is_none()
                    && let Command::Reconfigure { to, .. } = &effect.command
                {
                    self.belief.request(effect.number, to);
                }
                if matches!(effect.command, Command::Request { .. }) && !effect.repeated {
                    (self.plan, self.awaited) = (Plan::Open, None);
                }
            }
            Answer::GoalReached => self.plan = Plan::Reached,
            Answer::PlanNone { status, .. } => self.plan = Plan::None(status),
            Answer::PlanFound { .. } => self.plan = Plan::Open,
            Answer::Overdue { effect, action, outcome, .. } => {
                self.awaited = Some(*action).filter(|_| *outcome == OverdueOutcome::Waiting);
                if *outcome == OverdueOutcome::Cancelled && !self.started.contains(action) {
                    self.belief.design = None;
                }
                if matches!(outcome, OverdueOutcome::Failed | OverdueOutcome::Cancelled) {
                    self.given_up.extend(*effect);
                }
                if *outcome == OverdueOutcome::Failed {
                    self.refused.extend(effect.and_then(|effect| self.belief.give_up(effect)));
                }
            }
            _ => {}
        }
    }

    fn forbids(&self, design: &str) -> Option<&'static str> {
        let components =
            DESIGNS.iter().find(|entry| entry.0 == design).map(|entry| entry.1).unwrap_or_default();
        components.iter().find(|component| self.failed.contains(**component)).copied()
    }

    /// Demands (a) and (g), after the arrival of all outstanding effects and then of all effects in transit. (a): no
    /// action moves without a design, with a design that the delivered reports forbid, or with another design than the
    /// requested one. (g): an action that the loop lets continue does not stand still. Nothing is checked while the
    /// loop is misled by an outdated observation.
    pub fn intended_motion<'a>(
        &self,
        robot: &Robot,
        control: &Loop,
        messages: impl Iterator<Item = &'a Message>,
    ) -> Result<(), String> {
        let beliefs = control.beliefs();
        if self.is_misled {
            return Ok(());
        }
        let mut robot_then = robot.prospect();
        // The loop cannot know of a failure before its report arrives, unless it has observed the design since.
        let is_observed = self.belief.is_settled() && self.belief.design == robot.design;
        let is_unknown = |number: &u64| {
            !self.belief.failed.contains(number) && !self.observed_failures.contains(number) && !is_observed
        };
        let unknown = robot.refused.iter().filter(|number| is_unknown(number));
        for effect in unknown.filter_map(|number| self.requested.get(number)) {
            robot_then.carry_out(effect);
        }
        let on_their_way: BTreeMap<u64, &Effect> = messages
            .filter_map(|message| match message {
                Message::Effect(effect) => Some((effect.number, effect)),
                Message::Event(_) => None,
            })
            .collect();
        // Worst order of arrival: outdated effects arrive last, unless an earlier effect has superseded them.
        for effect in beliefs.outstanding().chain(on_their_way.into_values()) {
            let is_moot =
                self.ended.contains(&effect.action) && !matches!(effect.command, Command::Reconfigure { .. });
            robot_then.processed.extend(&effect.supersedes);
            if robot_then.processed.insert(effect.number) && !is_moot {
                robot_then.carry_out(effect);
            }
        }
        let Some(action) = robot_then.action.as_ref().filter(|action| !self.ended.contains(&action.number))
        else {
            return Ok(());
        };
        let goes_on = beliefs.running().is_some_and(|(number, _)| number == action.number)
            && !beliefs.suspended()
            && !beliefs.cancelling()
            && !control.has_agenda();
        if !action.is_moving() {
            // After a restart, a robot without a design waits for a design, and the report of the restart may
            // be lost.
            return if goes_on && (action.suspended || !robot.has_lost_design) {
                Err(format!("(g) action {} stands still, and is to go on: {action:?}", action.number))
            } else {
                Ok(())
            };
        }
        let Some(design) = &robot_then.design else {
            return Err(format!("(a) action {} goes on without a design", action.number));
        };
        if let Some(component) = self.forbids(design) {
            return Err(format!(
                "(a) action {} goes on with {design}, which needs {component}",
                action.number
            ));
        }
        let given = beliefs.running().filter(|(number, _)| *number == action.number && !beliefs.cancelling());
        match given.and_then(|(_, step)| step.design(FUNCTION)) {
            Some(given) if given != design => {
                Err(format!("(a) action {} goes on with {design}, and was given {given}", action.number))
            }
            _ => Ok(()),
        }
    }

    /// Demand (f): if a line makes the design of the running action unusable, the answers before
    /// planning contain a safe effect: a change to the best other design, suspension or
    /// cancellation. No effect is needed if the best design is already on its way or in use.
    /// `before` is the running action before the line, with its design.
    pub fn reaction(
        &self,
        before: Option<(u64, String)>,
        control: &Loop,
        answers: &[Answer],
    ) -> Result<(), String> {
        let Some((action, design)) = before else { return Ok(()) };
        let is_lost = self.forbids(&design).is_some() || self.refused.contains(&design);
        if !is_lost || self.ended.contains(&action) {
            return Ok(());
        }
        let mut effects = answers.iter().filter_map(|answer| match answer {
            Answer::Effect(effect) if effect.action == action && !effect.repeated => Some(&effect.command),
            _ => None,
        });
        // Designs are ordered by decreasing cost.
        let available = control.beliefs().available();
        let best = DESIGNS
            .iter()
            .map(|design_name| design_name.0)
            .rfind(|design_name| available.contains(*design_name));
        let is_safe = effects.any(|command| match command {
            Command::Suspend { .. } | Command::Cancel { .. } => true,
            Command::Reconfigure { to, .. } => Some(to.as_str()) == best,
            _ => false,
        });
        let beliefs = control.beliefs();
        let has_best = beliefs.running().and_then(|(_, step)| step.design(FUNCTION)) == best;
        // A reconfiguration to the best design may already be in transit, or the function may still have the
        // best design after a failure.
        let is_on_its_way = beliefs.pending().any(|(_, to)| Some(to) == best);
        let is_there = self.belief.is_settled() && self.belief.design.as_deref() == best;
        if is_safe || best.is_some() && has_best && (is_on_its_way || is_there) {
            Ok(())
        } else {
            Err(format!(
                "(f) action {action} has lost {design}, and no safe effect follows; best is {best:?}"
            ))
        }
    }

    /// Demand (e): after a restart of the loop, the last reconfiguration is requested again at once if it is
    /// unanswered.
    pub fn repeated(&self, answers: &[Answer]) -> Result<(), String> {
        let numbers: BTreeSet<u64> =
            answers.iter().filter_map(Answer::effect).map(|effect| effect.number).collect();
        match self.belief.pending.keys().find(|number| !numbers.contains(number)) {
            Some(number) => Err(format!("(e) effect {number} is not repeated after a restart")),
            None => Ok(()),
        }
    }

    /// Demand (h): after planning, an action is suspended only if no design is available or no plan exists.
    pub fn standstill(&self, control: &Loop) -> Result<(), String> {
        let beliefs = control.beliefs();
        let is_possible = DESIGNS.iter().any(|(design, _)| beliefs.available().contains(*design));
        let is_still = beliefs.suspended() && !beliefs.cancelling();
        if is_still && is_possible && !matches!(self.plan, Plan::None(_)) {
            return Err(format!("(h) an action stands still with {:?}", beliefs.available()));
        }
        Ok(())
    }

    /// Demand (a): the robot moves with a forbidden design for at most `bound` consecutive steps; `None` is no limit.
    pub fn motion(&mut self, robot: &Robot, bound: Option<u64>) -> Result<(), String> {
        let is_moving = robot.action.as_ref().is_some_and(Action::is_moving);
        let forbidden = robot.design.as_ref().filter(|_| is_moving).and_then(|design| self.forbids(design));
        let before = self.forbidden.filter(|before| Some(before.0) == forbidden).map_or(0, |before| before.1);
        self.forbidden = forbidden.map(|component| (component, before + 1));
        match (self.forbidden, bound) {
            (Some((component, steps)), Some(bound)) if steps > bound => Err(format!(
                "(a) the robot has moved for {steps} steps with {:?}, which needs {component}",
                robot.design
            )),
            _ => Ok(()),
        }
    }

    /// Demand (b): the believed design follows from the messages. A believed design is the actual
    /// one if it is certain and no message about designs is in transit. The actual design is not
    /// compared where no loop could know it.
    pub fn configuration<'a>(
        &self,
        robot: &Robot,
        control: &Loop,
        mut messages: impl Iterator<Item = &'a Message>,
    ) -> Result<(), String> {
        let believed = control.beliefs().configuration().get(FUNCTION);
        if believed != self.belief.design.as_ref() {
            return Err(format!("(b) believed {believed:?}, by the messages {:?}", self.belief.design));
        }
        let is_on_its_way = messages.any(|message| match message {
            Message::Effect(effect) => {
                matches!(effect.command, Command::Reconfigure { .. })
                    && !robot.processed.contains(&effect.number)
            }
            Message::Event(event) => {
                let is_about_designs = ["acknowledged", "reconfiguration_failed", "configuration_observed"];
                is_about_designs.iter().any(|kind| event["event"] == *kind)
            }
        });
        // An abandoned reconfiguration can be carried out after an observation, and its acknowledgement can be lost.
        let is_late = self.given_up.contains(&robot.configured.1)
            && self.belief.superseded.contains_key(&robot.configured.1);
        // If the report of a restart is lost, the loop cannot know that the function has no design.
        let is_unknowable = self.is_misled || robot.has_lost_design || is_late;
        let is_certain = self.belief.is_settled() && !is_on_its_way && !is_unknowable;
        match believed {
            // According to the table, an uncertain design is not believed.
            Some(_) if is_certain && believed != robot.design.as_ref() => {
                Err(format!("(b) believed {believed:?}, actual {:?}", robot.design))
            }
            _ => Ok(()),
        }
    }

    /// Returns `true` if the robot should have reported more about an action by now, judging by the kinds of
    /// reports that have already been delivered.
    fn is_report_due(&self, action: u64) -> bool {
        if self.started.contains(&action) {
            self.progressed.contains(&action)
        } else {
            !self.started.is_empty()
        }
    }

    /// Demand (c): each effect was carried out, superseded, abandoned with a report, or implied by
    /// a report. Effects of ended actions are exempt unless they are reconfigurations. This is not
    /// checked for a robot that has never acknowledged an effect.
    ///
    /// Demand (d): the goal is reached, or no design can be used and no plan exists. The loop may
    /// also have stopped after three failures of one step, or wait for reports that the robot never
    /// sends.
    pub fn at_the_end(&self, robot: &Robot) -> Result<(), String> {
        let is_open = |(number, effect): &(&u64, &Effect)| {
            let is_moot =
                self.ended.contains(&effect.action) && !matches!(effect.command, Command::Reconfigure { .. });
            let is_closed = robot.processed.contains(number)
                || self.superseded.contains(number)
                || self.given_up.contains(number)
                || self.belief.implied.contains(number);
            // No acknowledgements are expected from a robot that has never acknowledged anything to the loop.
            !is_closed && !is_moot && self.belief.has_receipts
        };
        let open: Vec<&u64> = self.requested.iter().filter(is_open).map(|(number, _)| number).collect();
        if !open.is_empty() {
            return Err(format!("(c) effects {open:?} were neither carried out nor given up"));
        }
        let mut designs = DESIGNS.iter().map(|(design, _)| *design);
        let is_possible =
            designs.any(|design| self.forbids(design).is_none() && !self.refused.contains(design));
        match self.plan {
            Plan::Reached if robot.place == GOAL && robot.action.is_none() => Ok(()),
            Plan::Reached => Err(format!("(d) the goal is reached, but the robot is at {}", robot.place)),
            // One step has failed three times in a row and is not tried again until something changes.
            Plan::None("failed") => Ok(()),
            Plan::None("unsolvable") if !is_possible => Ok(()),
            // The loop waits for a robot that has forgotten its action if the robot never sends the missing reports.
            Plan::Open if self.awaited.is_some_and(|action| !self.is_report_due(action)) => Ok(()),
            plan => Err(format!("(d) the last decision is {plan:?}; a plan is possible: {is_possible}")),
        }
    }
}

/// The last reconfiguration that was carried out, according to the delivered messages.
#[derive(Debug)]
struct Last {
    effect: u64,
    design: String,
    /// Previous design, and the number of the reconfiguration that had set it, if known.
    before: Option<(String, Option<u64>)>,
}

/// Design that the loop must believe, derived from the messages by the table of `docs/reference/events.md`.
///
/// The author of this code had read `src/mapek/acknowledge.rs`, so both can contain the same misreading of
/// the table. Only the comparison with the robot's actual design is independent of the loop.
#[derive(Debug, Default)]
struct Belief {
    design: Option<String>,
    /// Whether any effect was acknowledged.
    has_receipts: bool,
    /// Last requested reconfiguration, if unanswered: number and design.
    pending: BTreeMap<u64, String>,
    /// Earlier unanswered reconfigurations, which were superseded or abandoned.
    superseded: BTreeMap<u64, String>,
    /// Last reconfiguration that was carried out, according to an acknowledgement or an implying
    /// report.
    last: Option<Last>,
    greatest: u64,
    /// Reconfigurations up to this number may have been carried out before or after an observation of the
    /// design.
    crossed: u64,
    /// Reconfigurations that count as carried out because a later report implies them. None is
    /// added after the first acknowledgement.
    implied: BTreeSet<u64>,
    failed: BTreeSet<u64>,
    /// Superseded reconfigurations up to this number precede an observation of the design, so they leave no
    /// uncertainty.
    settled: u64,
}

impl Belief {
    fn is_settled(&self) -> bool {
        self.pending.is_empty() && self.superseded.range(self.settled + 1..).next().is_none()
    }

    fn request(&mut self, effect: u64, to: &str) {
        self.superseded.append(&mut self.pending);
        self.pending.insert(effect, to.to_owned());
    }

    fn acknowledge(&mut self, effect: u64) {
        self.has_receipts = true;
        self.confirm(effect);
    }

    fn confirm(&mut self, effect: u64) {
        let unanswered = self.pending.remove(&effect);
        let Some(to) = unanswered.or_else(|| self.superseded.remove(&effect)) else { return };
        let is_before_known = self.superseded.range(..effect).next().is_none();
        self.superseded.retain(|number, _| *number > effect);
        if effect < self.greatest {
            return;
        }
        self.greatest = effect;
        if self.crossed >= effect {
            self.design = None;
            self.last = Some(Last { effect, design: to, before: None });
        } else {
            let before = self.design.replace(to.clone()).filter(|before| is_before_known && *before != to);
            let source = self.last.take().filter(|last| before.as_ref() == Some(&last.design));
            let before = before.map(|before| (before, source.map(|last| last.effect)));
            self.last = Some(Last { effect, design: to, before });
        }
    }

    /// Confirms the unanswered reconfiguration before the request of an action, because a report of
    /// this action implies it. Has no effect after the first acknowledgement.
    fn confirm_before_request(&mut self, action: u64, requested: &BTreeMap<u64, Effect>) {
        let is_request =
            |effect: &&Effect| effect.action == action && matches!(effect.command, Command::Request { .. });
        let request = requested.values().find(is_request).map_or(0, |effect| effect.number);
        let implied: Vec<u64> = self.pending.range(..request).map(|(number, _)| *number).collect();
        for effect in implied {
            if !self.has_receipts {
                self.implied.insert(effect);
                self.confirm(effect);
            }
        }
    }

    /// Records the failure of a reconfiguration. Returns its design, which then counts as
    /// unrealisable. Returns `None` if the reconfiguration is neither unanswered nor the last one
    /// carried out.
    fn record_failure(&mut self, effect: u64) -> Option<String> {
        self.failed.insert(effect);
        if let Some(design) = self.pending.remove(&effect).or_else(|| self.superseded.remove(&effect)) {
            // If the function was observed with this design, the reconfiguration had been carried out.
            self.design.take_if(|design_before| *design_before == design);
            return Some(design);
        }
        if let Some(last) = &mut self.last {
            last.before.take_if(|before| before.1 == Some(effect));
        }
        let Last { design, before, .. } = self.last.take_if(|last| last.effect == effect)?;
        if self.design.as_ref() == Some(&design) {
            self.design = before.as_ref().map(|before| before.0.clone());
        }
        // The previous reconfiguration can fail, too.
        self.last = before.and_then(|(design, effect)| Some(Last { effect: effect?, design, before: None }));
        Some(design)
    }

    /// Abandons a reconfiguration, which the robot may still carry out. Returns its design, or `None` if the
    /// reconfiguration is not pending.
    fn give_up(&mut self, effect: u64) -> Option<String> {
        let to = self.pending.remove(&effect)?;
        self.design = None;
        self.superseded.insert(effect, to.clone());
        Some(to)
    }

    fn observe(&mut self, design: Option<String>, latest: u64) {
        let is_news = self.design != design;
        match self.pending.last_key_value().map(|(_, to)| to.clone()) {
            None => {
                // Superseded reconfigurations may still be in transit.
                let last = self.superseded.last_key_value().map_or(0, |(number, _)| *number);
                (self.settled, self.crossed) = (self.settled.max(last), self.crossed.max(last));
            }
            pending => {
                if (is_news || design.is_none()) && design != pending {
                    self.crossed = latest;
                }
            }
        }
        self.design = design;
    }
}
