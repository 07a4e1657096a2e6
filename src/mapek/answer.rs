//! What the loop answers: conclusions, plans and effects, one JSON object each, in the format `metaplan-events/1`.

use std::time::Duration;

use num_rational::BigRational;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

use crate::knowledge::{Contradiction, Fault};
use crate::mapek::step::{PlannedStep, configuration_to_json};
use crate::number;

/// One line of output.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Answer {
    /// What follows has changed.
    Inferred {
        /// Designs whose availability has changed.
        designs: Vec<DesignChange>,
        /// Objectives whose status has changed.
        objectives: Vec<ObjectiveChange>,
    },
    /// What is known contradicts itself, or does so no more. What was observed stays, and so does what follows from it.
    Contradicted {
        /// All contradictions from now on; none where what is known is consistent again.
        contradictions: Vec<Contradiction>,
    },
    /// It is not known what follows from what was observed, or it is again. What was observed stays. No design counts as
    /// available meanwhile, and nothing is begun.
    Unconcluded {
        /// Why; none where it is known again.
        fault: Option<Fault>,
    },
    /// A plan is looked for.
    PlanRequested {
        /// Why, in sentences.
        because: Vec<String>,
    },
    /// A plan is adopted.
    PlanFound {
        /// What its steps add to the metric, in the metric's unit.
        cost: BigRational,
        /// Whether it is proved that no plan has a better metric.
        optimal: bool,
        /// What is to be done; the first step is the action that is under way if there is one.
        steps: Vec<PlannedStep>,
    },
    /// The plan stays as it is.
    PlanKept {
        /// Why, in a sentence.
        because: String,
    },
    /// There is no plan.
    PlanNone {
        /// `unsolvable`, `unknown` or `failed`.
        status: &'static str,
        /// Why, in a sentence.
        because: String,
        /// Designs that are not available, by which alone there is none, if it is known: with any one of them there would be a
        /// plan, were all others available, too.
        blocking: Vec<String>,
    },
    /// Something is to be done.
    Effect(Effect),
    /// An effect was not acknowledged, or nothing was heard of an action, for longer than the deadline.
    Overdue {
        /// The effect, where it is about one.
        effect: Option<u64>,
        /// The action.
        action: u64,
        /// Seconds since it was asked for, or since the last report.
        seconds: u64,
        /// What follows from it.
        outcome: OverdueOutcome,
    },
    /// The goal holds; nothing is to be done.
    GoalReached,
    /// A report is held back by a filter: the first, tenth, hundredth … one since the value or status last changed.
    Filtered {
        /// The attribute or component, by local name.
        name: String,
        /// The value or status that was reported.
        value: Value,
        /// `range`, `jump`, `hysteresis`, `debounce`, `confirm` or `heal`.
        because: &'static str,
        /// Number of reports that were held back since the last change.
        held: u64,
        /// Time at which the report will be believed if nothing else is reported, if there is one.
        due: Option<Duration>,
    },
    /// A sensor has been silent for longer than its period.
    Silent {
        /// The attribute, by local name.
        name: String,
        /// `keep`, `unknown` or `worst`.
        outcome: &'static str,
        /// The value that is believed from now on, with `worst`.
        value: Option<Value>,
    },
    /// The line was seen before and has changed nothing.
    Duplicate {
        /// Its number.
        sequence: u64,
    },
    /// The line has changed nothing: its number is so old that nobody knows whether it was seen.
    Stale {
        /// Its number.
        sequence: u64,
        /// Numbers up to this one are too old.
        mark: u64,
    },
    /// The line, or a part of it, has changed nothing.
    Error {
        /// A stable code.
        code: String,
        /// One sentence.
        message: String,
    },
}

/// What follows from a deadline that has passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum OverdueOutcome {
    /// The effect is asked for again.
    Repeated,
    /// The reconfiguration counts as failed.
    Failed,
    /// The action is to be brought to a safe end.
    Cancelled,
    /// Nothing: the robot may be one that does not report this.
    Waiting,
}

/// A design that has become available, or is available no more.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct DesignChange {
    /// Its local name.
    pub design: String,
    /// Whether it is available from now on.
    pub available: bool,
    /// The rules and facts that rule it out.
    pub because: Vec<String>,
}

/// An objective whose status has changed.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ObjectiveChange {
    /// Its local name.
    pub objective: String,
    /// Its statuses from now on; none while all is well.
    pub statuses: Vec<String>,
    /// The rules and facts that say so.
    pub because: Vec<String>,
}

/// Something that the managed system is to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its number, from 1; the same again if it has to be repeated.
    pub number: u64,
    /// The number of the action that it is about.
    pub action: u64,
    /// What is to be done.
    pub command: Command,
    /// Whether it may have been asked for before the program was started again.
    pub repeated: bool,
    /// Effects that were not acknowledged and need not be carried out any more, since this one replaces them.
    pub supersedes: Vec<u64>,
}

/// What the managed system is to do.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Command {
    /// A function gets another design.
    Reconfigure {
        /// The function.
        function: String,
        /// The design before, if there was one.
        from: Option<String>,
        /// The design from now on.
        to: String,
    },
    /// An action begins.
    Request {
        /// The action with its configuration.
        step: PlannedStep,
    },
    /// An action is brought to a safe end.
    Cancel {
        /// Why, in a sentence.
        because: String,
    },
    /// An action stands still and keeps what it has done.
    Suspend {
        /// Why, in a sentence.
        because: String,
    },
    /// A suspended action goes on as soon as its functions have these designs.
    Resume {
        /// Functions with their designs, in the order of the step.
        configuration: Vec<(String, String)>,
    },
}

impl Command {
    /// The word for it among the answers.
    fn kind(&self) -> &'static str {
        match self {
            Self::Reconfigure { .. } => "reconfigure",
            Self::Request { .. } => "request_action",
            Self::Cancel { .. } => "cancel_action",
            Self::Suspend { .. } => "suspend_action",
            Self::Resume { .. } => "resume_action",
        }
    }

    /// Whether this command makes another one, about the same action, pointless.
    pub(super) fn replaces(&self, other: &Self, same_action: bool) -> bool {
        match (self, other) {
            (Self::Reconfigure { function: own, .. }, Self::Reconfigure { function: other, .. }) => {
                own == other
            }
            _ => same_action && self.is_about_going_on() && other.is_about_going_on(),
        }
    }

    /// Whether it says if an action goes on. A report of that action may have been on its way before the command, so that
    /// it does not show that the command has arrived.
    pub(super) fn is_about_going_on(&self) -> bool {
        matches!(self, Self::Cancel { .. } | Self::Suspend { .. } | Self::Resume { .. })
    }
}

/// The answer as an object of the format.
impl Serialize for Answer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        if let Self::Effect(effect) = self {
            effect.fields(&mut object)?;
        } else {
            object.serialize_entry("answer", self.kind())?;
            self.fields(&mut object)?;
        }
        object.end()
    }
}

impl Answer {
    /// The answer as an object of the format.
    pub fn to_json(&self) -> Value {
        // Texts, numbers and lists of them are always data.
        serde_json::to_value(self).unwrap_or_default()
    }

    /// The word for what it is.
    fn kind(&self) -> &'static str {
        match self {
            Self::Inferred { .. } => "inferred",
            Self::Unconcluded { .. } => "unconcluded",
            Self::Contradicted { .. } => "contradicted",
            Self::PlanRequested { .. } => "plan_requested",
            Self::PlanFound { .. } => "plan_found",
            Self::PlanKept { .. } => "plan_kept",
            Self::PlanNone { .. } => "plan_none",
            Self::Effect(effect) => effect.command.kind(),
            Self::Overdue { .. } => "overdue",
            Self::GoalReached => "goal_reached",
            Self::Filtered { .. } => "filtered",
            Self::Silent { .. } => "silent",
            Self::Duplicate { .. } => "duplicate",
            Self::Stale { .. } => "stale",
            Self::Error { .. } => "error",
        }
    }

    /// Writes what stands behind the kind of an answer that is not an effect.
    fn fields<M: SerializeMap>(&self, object: &mut M) -> Result<(), M::Error> {
        match self {
            Self::Inferred { designs, objectives } => {
                object.serialize_entry("designs", designs)?;
                object.serialize_entry("objectives", objectives)
            }
            Self::Unconcluded { fault } => {
                let part = |part: fn(&Fault) -> &String| fault.as_ref().map(part);
                object.serialize_entry("code", &part(|fault| &fault.code))?;
                object.serialize_entry("message", &part(|fault| &fault.message))?;
                object.serialize_entry("rule", &part(|fault| &fault.rule))
            }
            Self::Contradicted { contradictions } => object.serialize_entry("contradictions", contradictions),
            Self::PlanRequested { because } => object.serialize_entry("because", because),
            Self::PlanFound { cost, optimal, steps } => {
                object.serialize_entry("cost", &number::to_json(cost))?;
                object.serialize_entry("optimal", optimal)?;
                object.serialize_entry("steps", steps)
            }
            Self::PlanKept { because } => object.serialize_entry("because", because),
            Self::PlanNone { status, because, blocking } => {
                object.serialize_entry("status", status)?;
                object.serialize_entry("because", because)?;
                object.serialize_entry("blocking", blocking)
            }
            Self::Overdue { effect, action, seconds, outcome } => {
                object.serialize_entry("effect", effect)?;
                object.serialize_entry("action", action)?;
                object.serialize_entry("seconds", seconds)?;
                object.serialize_entry("outcome", outcome)
            }
            Self::Effect(_) | Self::GoalReached => Ok(()),
            Self::Filtered { name, value, because, held, due } => {
                object.serialize_entry("name", name)?;
                object.serialize_entry("value", value)?;
                object.serialize_entry("because", because)?;
                object.serialize_entry("held", held)?;
                object.serialize_entry("due", &due.map(|due| due.as_secs_f64()))
            }
            Self::Silent { name, outcome, value } => {
                object.serialize_entry("name", name)?;
                object.serialize_entry("outcome", outcome)?;
                object.serialize_entry("value", value)
            }
            Self::Duplicate { sequence } => object.serialize_entry("seq", sequence),
            Self::Stale { sequence, mark } => {
                let because = format!(
                    "too many numbers are missing: of those up to {mark} it is not known any more which were seen"
                );
                object.serialize_entry("seq", sequence)?;
                object.serialize_entry("because", &because)
            }
            Self::Error { code, message } => {
                object.serialize_entry("code", code)?;
                object.serialize_entry("message", message)
            }
        }
    }

    /// The effect, if it is one.
    pub fn effect(&self) -> Option<&Effect> {
        match self {
            Self::Effect(effect) => Some(effect),
            _ => None,
        }
    }
}

impl Effect {
    /// Writes the effect as an object of the format.
    fn fields<M: SerializeMap>(&self, object: &mut M) -> Result<(), M::Error> {
        object.serialize_entry("answer", self.command.kind())?;
        if let Command::Request { step } = &self.command {
            // The number of the action stands where its name stands in a step.
            object.serialize_entry("action", &self.action)?;
            step.fields(object)?;
            object.serialize_entry("name", &step.action)?;
        } else {
            match &self.command {
                Command::Reconfigure { function, from, to } => {
                    object.serialize_entry("function", function)?;
                    object.serialize_entry("from", from)?;
                    object.serialize_entry("to", to)?;
                }
                Command::Cancel { because } | Command::Suspend { because } => {
                    object.serialize_entry("because", because)?;
                }
                Command::Resume { configuration } => {
                    object.serialize_entry("configuration", &configuration_to_json(configuration))?;
                }
                Command::Request { .. } => {}
            }
            object.serialize_entry("action", &self.action)?;
        }
        object.serialize_entry("effect", &self.number)?;
        if self.repeated {
            object.serialize_entry("repeated", &true)?;
        }
        if !self.supersedes.is_empty() {
            object.serialize_entry("supersedes", &self.supersedes)?;
        }
        Ok(())
    }
}
