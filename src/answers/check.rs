//! JSON answer of `metaplan check`.

use std::collections::BTreeMap;

use probabilistic::check::{Answer, Listed, Outcome, Report};
use schemars::JsonSchema;
use serde::Serialize;

const CHECK: &str = "metaplan-check/1";

const CHECKS: &str = "metaplan-checks/1";

/// A value of a property, its policy's size, and what it took.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CheckAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CHECK))]
    format: &'static str,
    /// As it was asked.
    property: &'a str,
    /// Its name in a file of properties.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    /// The values of the constants that have several.
    #[serde(skip_serializing_if = "Option::is_none")]
    constants: Option<BTreeMap<&'a str, &'a str>>,
    #[serde(flatten)]
    found: Found,
    /// The size of the model, and what it took.
    statistics: SizePart,
}

/// What several properties, or several values of constants, are answered with.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChecksAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CHECKS))]
    format: &'static str,
    /// An answer for each property and each value of the constants.
    answers: Vec<CheckAnswer<'a>>,
    /// Properties without an answer.
    refused: Vec<RefusedPart<'a>>,
}

/// A property that has no answer.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RefusedPart<'a> {
    /// As it was asked.
    property: &'a str,
    /// Its name in the file of properties; null where it has none.
    name: Option<&'a str>,
    /// Why it has no answer.
    messages: Vec<String>,
}

/// What stands in the middle, by the kind of property.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
enum Found {
    Value(ValuePart),
    Truth {
        #[serde(flatten)]
        value: Option<ValuePart>,
        /// Null where it is not decided.
        holds: Option<bool>,
    },
    Range {
        /// The least value over the states.
        least: ValuePart,
        /// The greatest value over the states.
        greatest: ValuePart,
    },
    States {
        /// Each state of the set.
        states: Vec<StatePart>,
    },
    Front {
        /// The vertices of a Pareto front: a value for each of the two properties.
        vertices: Vec<[ValuePart; 2]>,
    },
    Constrained {
        #[serde(flatten)]
        value: ValuePart,
        /// The value of the best policy, which may draw lots.
        randomised: ValuePart,
        /// The value of the best policy that does not.
        deterministic: ProvedPart,
    },
}

/// A value: `value`, `lower` and `upper` are null where it is infinite or undefined, which `status` says; `exact` is a fraction,
/// `inf`, or null.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ValuePart {
    /// `finite`, `infinite`, or `undefined` (no policy keeps the bound of `multi`).
    status: &'static str,
    /// The value; null where it is infinite or undefined.
    value: Option<f64>,
    /// It is at least this; null where it is infinite or undefined.
    lower: Option<f64>,
    /// It is at most this; null where it is infinite, undefined, or not bounded.
    upper: Option<f64>,
    /// The value as a fraction, `inf` where it is infinite, null where it was not computed exactly.
    exact: Option<String>,
}

/// A state, by the values of its variables, with its value or whether the property holds in it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatePart {
    /// Variable to value.
    state: BTreeMap<String, i64>,
    /// Whether the property holds in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    holds: Option<bool>,
    #[serde(flatten)]
    value: Option<ValuePart>,
}

/// A value, and whether it is proved to be the best.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ProvedPart {
    #[serde(flatten)]
    value: ValuePart,
    /// Whether no policy without lots is better.
    proved: bool,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SizePart {
    /// Reachable states.
    states: usize,
    /// Choices, over all states.
    choices: usize,
    /// Transitions, over all choices.
    transitions: usize,
    /// States without a choice, which got a loop.
    deadlocks: usize,
    /// What took how long.
    milliseconds: DurationPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct DurationPart {
    /// Exploring the model.
    build: f64,
    /// Computing the value.
    solve: f64,
}

impl ValuePart {
    fn of(answer: &Answer) -> Self {
        let without = |status: &'static str, exact: Option<String>| Self {
            status,
            value: None,
            lower: None,
            upper: None,
            exact,
        };
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        match answer {
            Answer::Finite(quantity) => Self {
                status: "finite",
                value: finite(quantity.value),
                lower: finite(quantity.lower),
                upper: finite(quantity.upper),
                exact: quantity.exact.as_ref().map(ToString::to_string),
            },
            Answer::Infinite => without("infinite", Some("inf".to_owned())),
            Answer::Undefined => without("undefined", None),
        }
    }
}

impl<'a> CheckAnswer<'a> {
    /// The answer to a property.
    pub fn new(property: &'a str, report: &Report) -> Self {
        let value = match &report.outcome {
            Outcome::Value(answer) => Found::Value(ValuePart::of(answer)),
            Outcome::Truth(holds, answer) => {
                Found::Truth { value: answer.as_ref().map(ValuePart::of), holds: Some(*holds) }
            }
            Outcome::Undecided(answer) => Found::Truth { value: Some(ValuePart::of(answer)), holds: None },
            Outcome::Range(least, greatest) => {
                Found::Range { least: ValuePart::of(least), greatest: ValuePart::of(greatest) }
            }
            Outcome::States(states) => Found::States {
                states: states.iter().map(|listed| StatePart::new(&report.variables, listed)).collect(),
            },
            Outcome::Front(vertices) => Found::Front {
                vertices: vertices.iter().map(|pair| pair.each_ref().map(ValuePart::of)).collect(),
            },
            Outcome::Constrained { randomised, deterministic, proved } => Found::Constrained {
                value: ValuePart::of(randomised),
                randomised: ValuePart::of(randomised),
                deterministic: ProvedPart { value: ValuePart::of(deterministic), proved: *proved },
            },
        };
        let Report { states, choices, transitions, deadlocks, build, solve, .. } = report;
        let milliseconds =
            DurationPart { build: build.as_secs_f64() * 1e3, solve: solve.as_secs_f64() * 1e3 };
        let statistics = SizePart {
            states: *states,
            choices: *choices,
            transitions: *transitions,
            deadlocks: *deadlocks,
            milliseconds,
        };
        let (name, constants) = (None, None);
        Self { format: CHECK, property, name, constants, found: value, statistics }
    }

    /// Adds the name of the property, and the values of the constants that vary.
    #[must_use]
    pub fn told(
        mut self,
        name: Option<&'a str>,
        constants: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Self {
        self.name = name;
        self.constants =
            Some(constants.into_iter().collect()).filter(|values: &BTreeMap<_, _>| !values.is_empty());
        self
    }
}

impl<'a> ChecksAnswer<'a> {
    /// Answer with the results of several properties, in order.
    pub fn new(answers: Vec<CheckAnswer<'a>>) -> Self {
        Self { format: CHECKS, answers, refused: Vec::new() }
    }

    /// Adds a property without an answer.
    pub fn refuse(&mut self, property: &'a str, name: Option<&'a str>, messages: Vec<String>) {
        self.refused.push(RefusedPart { property, name, messages });
    }
}

impl StatePart {
    fn new(variables: &[(String, bool)], listed: &Listed) -> Self {
        let names = variables.iter().map(|(name, _)| name.clone());
        Self {
            state: names.zip(listed.values.iter().copied()).collect(),
            holds: listed.truth,
            value: listed.answer.as_ref().map(ValuePart::of),
        }
    }
}
