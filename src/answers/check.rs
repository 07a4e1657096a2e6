//! JSON answers of `metaplan check`: for one property, and for several properties or values of constants.

use std::collections::BTreeMap;

use probabilistic::check::{Answer, Listed, Outcome, Report};
use schemars::JsonSchema;
use serde::Serialize;

const CHECK: &str = "metaplan-check/1";

const CHECKS: &str = "metaplan-checks/1";

/// The value of a property, the size of the model, and the running time.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CheckAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CHECK))]
    format: &'static str,
    /// The property, as it was given.
    property: &'a str,
    /// Name of the property in the file of properties.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    /// Values of the constants that are varied.
    #[serde(skip_serializing_if = "Option::is_none")]
    constants: Option<BTreeMap<&'a str, &'a str>>,
    #[serde(flatten)]
    found: Found,
    /// Size of the model, and running time.
    statistics: SizePart,
}

/// Answers for several properties, or for several values of constants.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChecksAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CHECKS))]
    format: &'static str,
    /// One answer for each property and each combination of values of the constants, except those in
    /// `refused`.
    answers: Vec<CheckAnswer<'a>>,
    /// Properties without an answer.
    refused: Vec<RefusedPart<'a>>,
}

/// A property that has no answer.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RefusedPart<'a> {
    /// The property, as it was given.
    property: &'a str,
    /// Name of the property in the file of properties; null if it has none.
    name: Option<&'a str>,
    /// Reasons why the property has no answer.
    messages: Vec<String>,
}

/// The fields that depend on the kind of property.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
enum Found {
    Value(ValuePart),
    Truth {
        #[serde(flatten)]
        value: Option<ValuePart>,
        /// Whether the property holds; null if the bounds do not decide it.
        holds: Option<bool>,
    },
    Range {
        /// Minimum over the states.
        least: ValuePart,
        /// Maximum over the states.
        greatest: ValuePart,
    },
    States {
        /// The states of the set.
        states: Vec<StatePart>,
    },
    Front {
        /// Vertices of the Pareto front, each with a value for each of the two properties.
        vertices: Vec<[ValuePart; 2]>,
    },
    Constrained {
        #[serde(flatten)]
        value: ValuePart,
        /// Value of the best randomised policy.
        randomised: ValuePart,
        /// Value of the best deterministic policy.
        deterministic: ProvedPart,
    },
}

/// A value with bounds. If it is infinite or undefined, as given by `status`, `value`, `lower` and
/// `upper` are null. `exact` is a fraction, `inf`, or null.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ValuePart {
    /// `finite`, `infinite`, or `undefined` (no policy within the bound of `multi` was found).
    status: &'static str,
    /// The value; null if it is infinite or undefined.
    value: Option<f64>,
    /// Lower bound on the value; null if it is infinite or undefined.
    lower: Option<f64>,
    /// Upper bound on the value; null if it is infinite, undefined, or not bounded.
    upper: Option<f64>,
    /// The value as a fraction; `inf` if it is infinite, null if it was not computed exactly.
    exact: Option<String>,
}

/// A state, given by the values of its variables, with its result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatePart {
    /// Values of the variables.
    state: BTreeMap<String, i64>,
    /// Whether the property holds in the state; absent if its values are numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    holds: Option<bool>,
    #[serde(flatten)]
    value: Option<ValuePart>,
}

/// A value, and whether it is proved to be optimal.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ProvedPart {
    #[serde(flatten)]
    value: ValuePart,
    /// Whether it is proved that no deterministic policy is better (in doubles: by more than the bounds permit).
    proved: bool,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SizePart {
    /// Number of explored states: all reachable states, or fewer if they decide the property.
    states: usize,
    /// Number of choices in all states.
    choices: usize,
    /// Number of transitions of all choices.
    transitions: usize,
    /// Number of states without a choice, to which a loop was added.
    deadlocks: usize,
    /// Running times of the stages.
    milliseconds: DurationPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct DurationPart {
    /// Exploration of the model.
    build: f64,
    /// Computation of the value.
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
