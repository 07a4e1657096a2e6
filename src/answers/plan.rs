//! What `metaplan plan` answers: `metaplan-plan/1`, and for several objectives at once `metaplan-pareto/1`.

use std::time::Duration;

use encodings::{
    Alternatives, Exact, Front, Moment, Part, Plan, Point, Proof, Solution, Statistics, Step, Unbounded,
};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::mission::Blocking;
use crate::number::exact_to_json;

/// A plan with its proof and its figures.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PlanAnswer {
    format: &'static str,
    mission: String,
    status: &'static str,
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    #[schemars(with = "Option<f64>")]
    lower_bound: Option<Value>,
    horizon: usize,
    proof: Option<ProofPart>,
    unbounded: Option<&'static str>,
    steps: Vec<StepPart>,
    statistics: StatisticsPart,
    #[serde(skip_serializing_if = "Option::is_none")]
    objectives: Option<Vec<Objective>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alternatives: Option<AlternativesPart>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>")]
    makespan: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    blocking: Option<Vec<String>>,
}

/// The front of several objectives.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParetoAnswer {
    format: &'static str,
    mission: String,
    status: &'static str,
    objectives: Vec<String>,
    points: Vec<PlanAnswer>,
}

/// An objective, and the value that a plan has by it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Objective {
    minimize: String,
    #[schemars(with = "f64")]
    value: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case")]
enum ProofPart {
    Sat {
        step_bound: usize,
        /// The program by whose word alone the formula has no model.
        #[serde(skip_serializing_if = "Option::is_none")]
        unchecked: Option<String>,
    },
    Bound,
    Search,
    Relaxation {
        reason: String,
    },
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StepPart {
    action: String,
    arguments: Vec<String>,
    /// Function to design.
    #[schemars(with = "std::collections::BTreeMap<String, String>")]
    configuration: Map<String, Value>,
    #[schemars(with = "f64")]
    start: Value,
    #[schemars(with = "f64")]
    duration: Value,
    #[schemars(with = "f64")]
    cost: Value,
    reconfigured: Vec<String>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatisticsPart {
    operators: usize,
    variables: usize,
    clauses: usize,
    /// Clauses by family.
    #[schemars(with = "std::collections::BTreeMap<String, usize>")]
    families: Map<String, Value>,
    conflicts: u64,
    solver_calls: usize,
    /// What found the plan: `search`, `satisficing` or `sat`.
    found_by: Option<&'static str>,
    expanded: u64,
    generated: u64,
    evaluated: u64,
    restarts: usize,
    history: Vec<MomentPart>,
    milliseconds: MillisecondsPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MomentPart {
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    #[schemars(with = "f64")]
    lower_bound: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MillisecondsPart {
    read: f64,
    ground: f64,
    search: f64,
    encode: f64,
    solve: f64,
    /// The times of the history.
    history: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct AlternativesPart {
    plans: Vec<Vec<StepPart>>,
    complete: bool,
    forced: Option<Vec<ForcedPart>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ForcedPart {
    action: bool,
    functions: Vec<String>,
}

/// The time that was spent before the optimizer has begun.
#[derive(Debug, Clone, Copy, Default)]
pub struct Preparation {
    /// To read the files and to reason.
    pub read: Duration,
    /// To ground the task.
    pub ground: Duration,
}

/// Milliseconds, to the microsecond.
pub fn milliseconds(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e6).round() / 1e3
}

impl PlanAnswer {
    /// The answer to a mission of this name.
    pub fn new(mission: &str, solution: &Solution, preparation: &Preparation) -> Self {
        let statistics = &solution.statistics;
        Self {
            format: "metaplan-plan/1",
            mission: mission.to_owned(),
            status: solution.status.as_str(),
            cost: solution.plan.as_ref().map(|plan| exact_to_json(&plan.cost)),
            lower_bound: solution.lower_bound.as_ref().map(exact_to_json),
            horizon: solution.horizon,
            proof: solution.proof.as_ref().map(|proof| ProofPart::of(proof, statistics)),
            unbounded: solution.unbounded.map(Unbounded::as_str),
            steps: solution.plan.as_ref().map(steps).unwrap_or_default(),
            statistics: StatisticsPart::of(statistics, preparation),
            objectives: None,
            alternatives: None,
            makespan: None,
            blocking: None,
        }
    }

    /// Adds the values by objective; of a plan that was made for the mission's own metric there are none.
    #[must_use]
    pub fn with_objectives(mut self, objectives: Vec<Objective>) -> Self {
        self.objectives = Some(objectives).filter(|objectives| !objectives.is_empty());
        self
    }

    /// Adds further plans that are as good.
    #[must_use]
    pub fn with_alternatives(mut self, found: Option<&Alternatives>) -> Self {
        self.alternatives = found.map(AlternativesPart::of);
        self
    }

    /// Adds how long a plan takes whose actions overlap.
    #[must_use]
    pub fn with_makespan(mut self, makespan: Option<&Exact>) -> Self {
        self.makespan = makespan.map(exact_to_json);
        self
    }

    /// Adds the designs that keep the mission from having a plan, if it is for designs.
    #[must_use]
    pub fn with_blocking(mut self, blocking: Option<&Blocking>) -> Self {
        self.blocking = match blocking {
            Some(Blocking::Designs(designs)) => Some(designs.clone()),
            Some(Blocking::Other) | None => None,
        };
        self
    }
}

impl ParetoAnswer {
    /// The points with a plan; `objectives` are the texts of the objectives.
    pub fn new(mission: &str, objectives: &[String], front: &Front, preparation: &Preparation) -> Self {
        let solved = front.points.iter().filter(|point| point.solution.plan.is_some());
        let point = |point: &Point| {
            PlanAnswer::new(mission, &point.solution, preparation)
                .with_objectives(Objective::all(objectives, &point.values))
        };
        Self {
            format: "metaplan-pareto/1",
            mission: mission.to_owned(),
            status: front.status.as_str(),
            objectives: objectives.to_vec(),
            points: solved.map(point).collect(),
        }
    }
}

impl Objective {
    /// The values of a plan by the objectives with these texts.
    pub fn all(texts: &[String], values: &[Exact]) -> Vec<Self> {
        let pairs = texts.iter().zip(values);
        pairs.map(|(text, value)| Self { minimize: text.clone(), value: exact_to_json(value) }).collect()
    }
}

impl MomentPart {
    fn of(moment: &Moment) -> Self {
        Self {
            cost: moment.cost.as_ref().map(exact_to_json),
            lower_bound: exact_to_json(&moment.lower_bound),
        }
    }
}

fn steps(plan: &Plan) -> Vec<StepPart> {
    plan.steps.iter().map(StepPart::of).collect()
}

impl StepPart {
    fn of(step: &Step) -> Self {
        let configuration = step.configuration.iter();
        let (start, duration) = step.times();
        Self {
            action: step.action.clone(),
            arguments: step.arguments.clone(),
            configuration: configuration
                .map(|(function, design)| (function.clone(), design.clone().into()))
                .collect(),
            start: exact_to_json(&start),
            duration: exact_to_json(&duration),
            cost: exact_to_json(&step.cost),
            reconfigured: step.reconfigured.clone(),
        }
    }
}

impl ProofPart {
    fn of(proof: &Proof, statistics: &Statistics) -> Self {
        match proof {
            Proof::Sat { step_bound } => {
                Self::Sat { step_bound: *step_bound, unchecked: statistics.unchecked.clone() }
            }
            Proof::Bound => Self::Bound,
            Proof::Search => Self::Search,
            Proof::Relaxation(reason) => Self::Relaxation { reason: reason.clone() },
        }
    }
}

impl StatisticsPart {
    fn of(statistics: &Statistics, preparation: &Preparation) -> Self {
        let families = statistics.families.iter();
        Self {
            operators: statistics.operators,
            variables: statistics.variables,
            clauses: statistics.clauses,
            families: families.map(|(family, count)| ((*family).to_owned(), (*count).into())).collect(),
            conflicts: statistics.conflicts,
            solver_calls: statistics.calls,
            found_by: statistics.found_by.map(Part::as_str),
            expanded: statistics.expanded,
            generated: statistics.generated,
            evaluated: statistics.evaluated,
            restarts: statistics.restarts,
            history: statistics.history.iter().map(MomentPart::of).collect(),
            milliseconds: MillisecondsPart {
                read: milliseconds(preparation.read),
                ground: milliseconds(preparation.ground),
                search: milliseconds(statistics.search),
                encode: milliseconds(statistics.encode),
                solve: milliseconds(statistics.solve),
                history: statistics.history.iter().map(|moment| milliseconds(moment.time)).collect(),
            },
        }
    }
}

impl AlternativesPart {
    fn of(found: &Alternatives) -> Self {
        let forced = found.forced.as_ref().map(|steps| {
            let each = steps.iter();
            each.map(|own| ForcedPart { action: own.action, functions: own.functions.clone() }).collect()
        });
        Self { plans: found.plans.iter().map(steps).collect(), complete: found.complete, forced }
    }
}
