//! Answers of the loop: conclusions, plans and effects, one JSON object each, in the format `metaplan-events/1`.

use std::time::Duration;

use num_rational::BigRational;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

use crate::knowledge::{Contradiction, Fault};
use crate::mapek::step::{PlannedStep, configuration_to_json};
use crate::number;

/// One line of the loop's output.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Answer {
    /// The conclusions about designs and objectives have changed.
    Inferred {
        /// Designs whose availability has changed.
        designs: Vec<DesignChange>,
        /// Objectives whose status has changed.
        objectives: Vec<ObjectiveChange>,
    },
    /// The set of violated axioms and rules has changed: the knowledge has become inconsistent, consistent again, or
    /// inconsistent in another way. Observed statements and their conclusions are kept.
    Contradicted {
        /// All current contradictions; empty if the knowledge is consistent again.
        contradictions: Vec<Contradiction>,
    },
    /// The conclusions are incomplete because reasoning has exceeded its budget or was interrupted, or they are
    /// complete again. Observed statements are kept. With incomplete conclusions, no design of the knowledge base
    /// counts as available, and no action is requested.
    Unconcluded {
        /// Fault that stopped the reasoning; `None` once the conclusions are complete.
        fault: Option<Fault>,
    },
    /// Planning starts.
    PlanRequested {
        /// Reasons for planning, as sentences.
        because: Vec<String>,
    },
    /// A plan is adopted.
    PlanFound {
        /// Sum of the costs of the plan's steps, in the metric's unit.
        cost: BigRational,
        /// Whether the plan is proved optimal.
        optimal: bool,
        /// Steps of the plan. The first one is the action under way, if any.
        steps: Vec<PlannedStep>,
    },
    /// The current plan is kept.
    PlanKept {
        /// Reason, as a sentence.
        because: String,
    },
    /// Planning has found no plan that can be executed, or pauses because an action has failed repeatedly.
    PlanNone {
        /// `unsolvable` if the absence of a plan is proved, `failed` if an action has failed repeatedly, and `unknown`
        /// otherwise.
        status: &'static str,
        /// Reason, as a sentence.
        because: String,
        /// Minimal set of unavailable designs that blocks every plan, if computed. A plan would exist with any one of
        /// them and with all designs outside the set. Empty also if there is no plan even with all designs.
        blocking: Vec<String>,
    },
    /// A request to the managed system.
    Effect(Effect),
    /// An effect was not acknowledged, or no report of an action has arrived, before the deadline.
    Overdue {
        /// Number of the overdue effect. For an overdue action: its unacknowledged request or cancellation, or
        /// `None` if its request has arrived.
        effect: Option<u64>,
        /// Number of the action.
        action: u64,
        /// Seconds since the last request of the effect, or since the request, resumption or last report of the action.
        seconds: u64,
        /// Reaction of the loop.
        outcome: OverdueOutcome,
    },
    /// The goal holds, and no further action is required.
    GoalReached,
    /// A filter holds a report back. This answer is given if the number of held reports in `held` is 1, 10, 100 and so
    /// on.
    Filtered {
        /// The attribute or component, by local name.
        name: String,
        /// Reported value or status.
        value: Value,
        /// Reason for holding the report: `range`, `jump`, `hysteresis`, `debounce`, `confirm` or `heal`.
        because: &'static str,
        /// Number of reports held back since the count was last reset, for example by a believed crossing of a bound or
        /// change of a component's status.
        held: u64,
        /// Time at which the report will be believed unless another report arrives; `None` if the passage of time does
        /// not confirm the report.
        due: Option<Duration>,
    },
    /// A sensor has been silent for longer than its period.
    Silent {
        /// The attribute, by local name.
        name: String,
        /// Setting that determines the believed value from now on: `keep`, `unknown` or `worst`.
        outcome: &'static str,
        /// Believed value from now on; only with `worst`.
        value: Option<Value>,
    },
    /// The line is a duplicate and was ignored.
    Duplicate {
        /// Sequence number of the line.
        sequence: u64,
    },
    /// The line was ignored: its number is too old to decide whether it is a duplicate.
    Stale {
        /// Sequence number of the line.
        sequence: u64,
        /// Greatest sequence number that is too old.
        mark: u64,
    },
    /// The journal cannot be written and is now incomplete. The loop continues without it.
    Unrecorded {
        /// Description of the fault and its consequences.
        message: String,
    },
    /// The line, or a part of it, was refused; or the knowledge base could not be updated.
    Error {
        /// Stable code of the error, such as `M305`.
        code: String,
        /// Message, one sentence.
        message: String,
    },
}

/// Reaction to a missed deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum OverdueOutcome {
    /// The effect is requested again.
    Repeated,
    /// The reconfiguration counts as failed.
    Failed,
    /// The action is cancelled.
    Cancelled,
    /// No reaction yet. Either this is the first missed deadline, and the next one cancels the action, or the robot
    /// possibly does not send such reports at all.
    Waiting,
}

/// Availability of a design, usually reported because it has changed.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct DesignChange {
    /// Local name of the design.
    pub design: String,
    /// Whether the design is available from now on.
    pub available: bool,
    /// Rules and facts that make the design unavailable, or a message that conclusions are missing; empty if the design
    /// is available.
    pub because: Vec<String>,
}

/// An objective whose status has changed.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ObjectiveChange {
    /// Local name of the objective.
    pub objective: String,
    /// Current statuses; empty if the objective is not in error.
    pub statuses: Vec<String>,
    /// Rules and facts from which the statuses follow.
    pub because: Vec<String>,
}

/// A request to the managed system.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Number of the effect, from 1. A repetition has the number of the original.
    pub number: u64,
    /// Number of the action that the effect belongs to.
    pub action: u64,
    /// Requested operation.
    pub command: Command,
    /// Whether the effect is a repetition, so that the robot may have received it before.
    pub repeated: bool,
    /// Numbers of earlier effects that are obsolete once this effect has arrived, at most 64. The robot need not carry
    /// them out.
    pub supersedes: Vec<u64>,
}

/// Operation requested from the managed system.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Command {
    /// Changes the design of a function.
    Reconfigure {
        /// The function.
        function: String,
        /// Previous design, if known.
        from: Option<String>,
        /// New design.
        to: String,
    },
    /// Starts an action.
    Request {
        /// The action with its configuration.
        step: PlannedStep,
    },
    /// Ends an action safely.
    Cancel {
        /// Reason, as a sentence.
        because: String,
    },
    /// Suspends an action. Its progress is kept.
    Suspend {
        /// Reason, as a sentence.
        because: String,
    },
    /// Resumes a suspended action once its functions have the given designs.
    Resume {
        /// Functions with their designs, in the order of the step's parameters.
        configuration: Vec<(String, String)>,
    },
}

impl Command {
    fn kind(&self) -> &'static str {
        match self {
            Self::Reconfigure { .. } => "reconfigure",
            Self::Request { .. } => "request_action",
            Self::Cancel { .. } => "cancel_action",
            Self::Suspend { .. } => "suspend_action",
            Self::Resume { .. } => "resume_action",
        }
    }

    /// Returns `true` if this command makes the command `earlier` obsolete. `same_action` is `true` if both commands
    /// belong to the same action.
    pub(super) fn replaces(&self, earlier: &Self, same_action: bool) -> bool {
        match (self, earlier) {
            (
                Self::Reconfigure { function: new_function, .. },
                Self::Reconfigure { function: earlier_function, .. },
            ) => new_function == earlier_function,
            _ => same_action && self.controls_execution() && earlier.controls_execution(),
        }
    }

    /// Returns `true` if the command ends, suspends or resumes an action. A report of that action may have been sent
    /// before the command arrived. Therefore, such a report does not acknowledge the command.
    pub(super) fn controls_execution(&self) -> bool {
        matches!(self, Self::Cancel { .. } | Self::Suspend { .. } | Self::Resume { .. })
    }
}

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
    /// Converts the answer to a JSON object of the output format.
    pub fn to_json(&self) -> Value {
        // The serialisation cannot fail: all map keys are strings.
        serde_json::to_value(self).unwrap_or_default()
    }

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
            Self::Unrecorded { .. } => "unrecorded",
            Self::Error { .. } => "error",
        }
    }

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
                    "too many gaps in `seq`: which of the numbers up to {mark} were received is no longer recorded"
                );
                object.serialize_entry("seq", sequence)?;
                object.serialize_entry("because", &because)
            }
            Self::Unrecorded { message } => object.serialize_entry("message", message),
            Self::Error { code, message } => {
                object.serialize_entry("code", code)?;
                object.serialize_entry("message", message)
            }
        }
    }

    /// Returns the requested effect, or `None` for other answers.
    pub fn effect(&self) -> Option<&Effect> {
        match self {
            Self::Effect(effect) => Some(effect),
            _ => None,
        }
    }
}

impl Effect {
    fn fields<M: SerializeMap>(&self, object: &mut M) -> Result<(), M::Error> {
        object.serialize_entry("answer", self.command.kind())?;
        if let Command::Request { step } = &self.command {
            // As in the other effects, `action` is the number of the action. In a step of a plan,
            // it is the name of the schema, which is therefore written as `name` here.
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
