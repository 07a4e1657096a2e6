//! What `metaplan check` answers.

use std::collections::BTreeMap;

use probabilistic::check::{Answer, Listed, Outcome, Report};
use schemars::JsonSchema;
use serde::Serialize;

/// A value of a property, its policy's size, and what it took.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CheckAnswer<'a> {
    format: &'static str,
    property: &'a str,
    /// Its name in a file of properties.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    /// The values of the constants that have several.
    #[serde(skip_serializing_if = "Option::is_none")]
    constants: Option<BTreeMap<&'a str, &'a str>>,
    #[serde(flatten)]
    found: Found,
    statistics: SizePart,
}

/// What several properties, or several values of constants, are answered with.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChecksAnswer<'a> {
    format: &'static str,
    answers: Vec<CheckAnswer<'a>>,
    /// Properties without an answer.
    refused: Vec<RefusedPart<'a>>,
}

/// A property that has no answer.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RefusedPart<'a> {
    property: &'a str,
    name: Option<&'a str>,
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
        least: ValuePart,
        greatest: ValuePart,
    },
    States {
        states: Vec<StatePart>,
    },
    Front {
        vertices: Vec<[ValuePart; 2]>,
    },
    Constrained {
        #[serde(flatten)]
        value: ValuePart,
        randomised: ValuePart,
        deterministic: ProvedPart,
    },
}

/// A value: `value`, `lower` and `upper` are null where it is infinite or undefined, which `status` says; `exact` is a fraction,
/// `inf`, or null.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ValuePart {
    status: &'static str,
    value: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
    exact: Option<String>,
}

/// A state, by the values of its variables, with its value or whether the property holds in it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatePart {
    state: BTreeMap<String, i64>,
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
    proved: bool,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SizePart {
    states: usize,
    choices: usize,
    transitions: usize,
    deadlocks: usize,
    milliseconds: DurationPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct DurationPart {
    build: f64,
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
        let found = match &report.outcome {
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
        Self { format: "metaplan-check/1", property, name, constants, found, statistics }
    }

    /// The same with the name of the property, and with the values of constants that have several.
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
    /// The answers that there are, in their order.
    pub fn new(answers: Vec<CheckAnswer<'a>>) -> Self {
        Self { format: "metaplan-checks/1", answers, refused: Vec::new() }
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
