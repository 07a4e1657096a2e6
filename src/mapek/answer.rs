//! What the loop answers: conclusions, plans and effects, one JSON object each, in the format `metaplan-events/1`.

use num_rational::BigRational;
use serde_json::{Map, Value, json};

use super::number;
use super::step::PlannedStep;
use crate::knowledge::{Contradiction, Fault};

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
    /// The goal holds; nothing is to be done.
    GoalReached,
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

/// A design that has become available, or is available no more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DesignChange {
    /// Its local name.
    pub design: String,
    /// Whether it is available from now on.
    pub available: bool,
    /// The rules and facts that rule it out.
    pub because: Vec<String>,
}

/// An objective whose status has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
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
    /// A suspended action goes on.
    Resume,
}

impl Command {
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
        matches!(self, Self::Cancel { .. } | Self::Suspend { .. } | Self::Resume)
    }
}

impl Answer {
    /// The answer as an object of the format.
    pub fn to_json(&self) -> Value {
        match self {
            Self::Inferred { designs, objectives } => json!({
                "answer": "inferred",
                "designs": designs.iter().map(DesignChange::to_json).collect::<Vec<_>>(),
                "objectives": objectives.iter().map(ObjectiveChange::to_json).collect::<Vec<_>>(),
            }),
            Self::Unconcluded { fault } => {
                let part = |part: fn(&Fault) -> &String| fault.as_ref().map(part);
                json!({
                    "answer": "unconcluded",
                    "code": part(|fault| &fault.code),
                    "message": part(|fault| &fault.message),
                    "rule": part(|fault| &fault.rule),
                })
            }
            Self::Contradicted { contradictions } => {
                let object = |own: &Contradiction| json!({ "violated": own.violated, "facts": own.facts });
                let contradictions: Vec<Value> = contradictions.iter().map(object).collect();
                json!({ "answer": "contradicted", "contradictions": contradictions })
            }
            Self::PlanRequested { because } => json!({ "answer": "plan_requested", "because": because }),
            Self::PlanFound { cost, optimal, steps } => json!({
                "answer": "plan_found",
                "cost": number::to_json(cost),
                "optimal": optimal,
                "steps": steps.iter().map(PlannedStep::to_json).collect::<Vec<_>>(),
            }),
            Self::PlanKept { because } => json!({ "answer": "plan_kept", "because": because }),
            Self::PlanNone { status, because, blocking } => {
                json!({ "answer": "plan_none", "status": status, "because": because, "blocking": blocking })
            }
            Self::Effect(effect) => effect.to_json(),
            Self::GoalReached => json!({ "answer": "goal_reached" }),
            Self::Duplicate { sequence } => json!({ "answer": "duplicate", "seq": sequence }),
            Self::Stale { sequence, mark } => {
                let because = format!(
                    "too many numbers are missing: of those up to {mark} it is not known any more which were seen"
                );
                json!({ "answer": "stale", "seq": sequence, "because": because })
            }
            Self::Error { code, message } => json!({ "answer": "error", "code": code, "message": message }),
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

impl DesignChange {
    fn to_json(&self) -> Value {
        json!({ "design": self.design, "available": self.available, "because": self.because })
    }
}

impl ObjectiveChange {
    fn to_json(&self) -> Value {
        json!({ "objective": self.objective, "statuses": self.statuses, "because": self.because })
    }
}

impl Effect {
    /// The effect as an object of the format.
    pub fn to_json(&self) -> Value {
        let mut object = match &self.command {
            Command::Reconfigure { function, from, to } => {
                json!({ "answer": "reconfigure", "function": function, "from": from, "to": to })
            }
            Command::Request { step } => {
                let mut object = step.to_json();
                object["answer"] = json!("request_action");
                let name = object["action"].take();
                object["name"] = name;
                object
            }
            Command::Cancel { because } => json!({ "answer": "cancel_action", "because": because }),
            Command::Suspend { because } => json!({ "answer": "suspend_action", "because": because }),
            Command::Resume => json!({ "answer": "resume_action" }),
        };
        object["action"] = json!(self.action);
        object["effect"] = json!(self.number);
        if self.repeated {
            object["repeated"] = json!(true);
        }
        if !self.supersedes.is_empty() {
            object["supersedes"] = json!(self.supersedes);
        }
        // The kind of the answer comes first.
        let fields = object.as_object_mut().map(std::mem::take).unwrap_or_default();
        let (kind, rest): (Map<_, _>, Map<_, _>) = fields.into_iter().partition(|(name, _)| name == "answer");
        Value::Object(kind.into_iter().chain(rest).collect())
    }
}
