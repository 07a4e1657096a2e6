//! JSON answers of `metaplan plan`: `metaplan-plan/1`, and `metaplan-pareto/1` for several
//! objectives.

use std::time::Duration;

use planner::{
    Alternatives, Exact, Front, MetricUnbounded, Moment, Plan, PlannerPart, Point, Proof, Solution,
    Statistics, Step,
};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::mission::Blocking;
use crate::mission::numbers::MissingValue;
use crate::number::exact_to_json;

const PARETO: &str = "metaplan-pareto/1";

const PLAN: &str = "metaplan-plan/1";

/// A plan with its proof and its figures.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PlanAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = PLAN))]
    format: &'static str,
    /// The mission's name; empty for a domain and a problem.
    mission: String,
    /// `optimal`, `feasible`, `unsolvable`, `unsolvable_within_horizon` or `unknown`.
    status: &'static str,
    /// The value of the metric, in its unit; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// No plan has a better metric; null where nothing is known.
    #[schemars(with = "Option<f64>")]
    lower_bound: Option<Value>,
    /// Steps up to which all plans were considered.
    horizon: usize,
    /// What proves the status; null where nothing does.
    proof: Option<ProofPart>,
    /// For a metric without a best value `proved` or `suspected`; else null.
    unbounded: Option<&'static str>,
    /// The plan; empty where there is none.
    steps: Vec<StepPart>,
    /// What was done.
    statistics: StatisticsPart,
    /// With `--minimize`: the values by objective.
    #[serde(skip_serializing_if = "Option::is_none")]
    objectives: Option<Vec<Objective>>,
    /// With `--alternatives`, for an optimal plan: others that are as good.
    #[serde(skip_serializing_if = "Option::is_none")]
    alternatives: Option<AlternativesPart>,
    /// With `--concurrent`: when the last action ends; the metric counts it, and no step's `cost` does.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>")]
    makespan: Option<Value>,
    /// Where no plan exists, and every design together would give one: a minimal list of designs without which there is none, whatever
    /// others are available.
    #[serde(skip_serializing_if = "Option::is_none")]
    blocking: Option<Vec<String>>,
    /// Where no plan exists: numeric functions that have no value, though actions need them, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    missing_values: Option<Vec<MissingValuePart>>,
}

/// A number that is missing.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MissingValuePart {
    /// The numeric function with its arguments; of a design, the attribute and the design.
    function: String,
    /// The actions that need it.
    needed_by: Vec<String>,
    /// The design that has no estimation, where it is that.
    #[serde(skip_serializing_if = "Option::is_none")]
    design: Option<String>,
    /// The file that should have it.
    file: String,
}

/// The front of several objectives.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParetoAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = PARETO))]
    format: &'static str,
    /// The mission's name.
    mission: String,
    /// `optimal` where it is proved that there are no other points, `unsolvable` where there is no plan at all; else as for one plan.
    status: &'static str,
    /// What is minimized, as it was asked for.
    objectives: Vec<String>,
    /// The plans that none is better than in all objectives, from the best in the first objective on.
    points: Vec<PlanAnswer>,
}

/// An objective, and the value that a plan has by it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Objective {
    /// The objective, as it was asked for.
    minimize: String,
    /// Its value for this plan.
    #[schemars(with = "f64")]
    value: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case")]
enum ProofPart {
    /// No formula up to the step bound has a better plan.
    Sat {
        /// Steps up to which the formula was solved: no plan that is longer can be better.
        step_bound: usize,
        /// The program by whose word alone the formula has no model.
        #[serde(skip_serializing_if = "Option::is_none")]
        unchecked: Option<String>,
    },
    /// A lower bound is reached.
    Bound,
    /// Every state from which a better plan could go on was searched.
    Search,
    /// Not even a relaxation of the task has a plan.
    Relaxation {
        /// Why the relaxation has no plan.
        reason: String,
    },
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StepPart {
    /// The name of the action.
    action: String,
    /// All its arguments, in the order of the action's parameters.
    arguments: Vec<String>,
    /// Function to design.
    #[schemars(with = "std::collections::BTreeMap<String, String>")]
    configuration: Map<String, Value>,
    /// When it starts, in the domain's time unit.
    #[schemars(with = "f64")]
    start: Value,
    /// How long it takes; 0 for actions without duration.
    #[schemars(with = "f64")]
    duration: Value,
    /// What it adds to the metric.
    #[schemars(with = "f64")]
    cost: Value,
    /// Functions whose design differs from the one that the last step with this function used.
    reconfigured: Vec<String>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatisticsPart {
    /// Ground operators.
    operators: usize,
    /// Variables of the largest formula.
    variables: usize,
    /// Clauses of the largest formula.
    clauses: usize,
    /// Clauses by family.
    #[schemars(with = "std::collections::BTreeMap<String, usize>")]
    families: Map<String, Value>,
    /// Conflicts of the solvers, over all formulas.
    conflicts: u64,
    /// Calls of solvers, over all formulas.
    solver_calls: usize,
    /// What found the plan: `search`, `satisficing` or `sat`.
    found_by: Option<&'static str>,
    /// States whose successors were looked at, over all searches.
    expanded: u64,
    /// These successors.
    generated: u64,
    /// Those of them that were estimated.
    evaluated: u64,
    /// How often the search for a plan soon has begun anew, for a better one.
    restarts: usize,
    /// Better plans, and bounds that have risen by a hundredth, in their order.
    history: Vec<MomentPart>,
    /// What took how long.
    milliseconds: MillisecondsPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MomentPart {
    /// The metric of the best plan then; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// The bound then.
    #[schemars(with = "f64")]
    lower_bound: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MillisecondsPart {
    /// Reading files, reasoning, and filling the problem.
    read: f64,
    /// Grounding.
    ground: f64,
    /// Bounds and searches.
    search: f64,
    /// Making formulas.
    encode: f64,
    /// Solving them.
    solve: f64,
    /// The times of the history.
    history: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct AlternativesPart {
    /// The steps of each.
    plans: Vec<Vec<StepPart>>,
    /// Whether it is proved that there are no others, idle actions apart: those that cost nothing and on whose effects nothing depends.
    complete: bool,
    /// For each step, what every such plan has in common, idle actions apart; null where that is not known.
    forced: Option<Vec<ForcedPart>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ForcedPart {
    /// Whether the action of the step is the same in every such plan.
    action: bool,
    /// Functions whose design in this step is the same in every such plan.
    functions: Vec<String>,
}

/// Times of the stages before the optimizer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Preparation {
    /// Time of reading the files and of reasoning.
    pub read: Duration,
    /// Time of grounding the task.
    pub ground: Duration,
}

/// Milliseconds, to the microsecond.
pub fn milliseconds(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e6).round() / 1e3
}

impl PlanAnswer {
    /// Answer for the mission called `mission`.
    pub fn new(mission: &str, solution: &Solution, preparation: &Preparation) -> Self {
        let statistics = &solution.statistics;
        Self {
            format: PLAN,
            mission: mission.to_owned(),
            status: solution.status.as_str(),
            cost: solution.plan.as_ref().map(|plan| exact_to_json(&plan.cost)),
            lower_bound: solution.lower_bound.as_ref().map(exact_to_json),
            horizon: solution.horizon,
            proof: solution.proof.as_ref().map(|proof| ProofPart::of(proof, statistics)),
            unbounded: solution.unbounded.map(MetricUnbounded::as_str),
            steps: solution.plan.as_ref().map(steps).unwrap_or_default(),
            statistics: StatisticsPart::of(statistics, preparation),
            objectives: None,
            alternatives: None,
            makespan: None,
            blocking: None,
            missing_values: None,
        }
    }

    /// Adds the values by objective. Empty for a plan by the mission's own metric.
    #[must_use]
    pub fn with_objectives(mut self, objectives: Vec<Objective>) -> Self {
        self.objectives = Some(objectives).filter(|objectives| !objectives.is_empty());
        self
    }

    /// Adds further optimal plans.
    #[must_use]
    pub fn with_alternatives(mut self, found: Option<&Alternatives>) -> Self {
        self.alternatives = found.map(AlternativesPart::of);
        self
    }

    /// Adds the duration of a plan whose actions overlap.
    #[must_use]
    pub fn with_makespan(mut self, makespan: Option<&Exact>) -> Self {
        self.makespan = makespan.map(exact_to_json);
        self
    }

    /// Adds the unavailable designs that prevent a plan, if designs are the reason.
    #[must_use]
    pub fn with_blocking(mut self, blocking: Option<&Blocking>) -> Self {
        self.blocking = match blocking {
            Some(Blocking::Designs(designs)) => Some(designs.clone()),
            Some(Blocking::Other) | None => None,
        };
        self
    }

    /// Adds the missing numbers.
    #[must_use]
    pub fn with_missing_values(mut self, missing: &[MissingValue]) -> Self {
        let part = |value: &MissingValue| MissingValuePart {
            function: value.function.clone(),
            needed_by: value.needed_by.clone(),
            design: value.estimation.as_ref().map(|(design, _)| design.clone()),
            file: value.file.clone(),
        };
        let parts: Vec<MissingValuePart> = missing.iter().map(part).collect();
        self.missing_values = Some(parts).filter(|parts| !parts.is_empty());
        self
    }
}

impl ParetoAnswer {
    /// Answer with the points that have a plan; `objectives` are the texts of the objectives.
    pub fn new(mission: &str, objectives: &[String], front: &Front, preparation: &Preparation) -> Self {
        let solved = front.points.iter().filter(|point| point.solution.plan.is_some());
        let point = |point: &Point| {
            PlanAnswer::new(mission, &point.solution, preparation)
                .with_objectives(Objective::all(objectives, &point.values))
        };
        Self {
            format: PARETO,
            mission: mission.to_owned(),
            status: front.status.as_str(),
            objectives: objectives.to_vec(),
            points: solved.map(point).collect(),
        }
    }
}

impl Objective {
    /// Returns the values of a plan by the objectives with these texts.
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
            found_by: statistics.found_by.map(PlannerPart::as_str),
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
            each.map(|forced| ForcedPart { action: forced.action, functions: forced.functions.clone() })
                .collect()
        });
        Self { plans: found.plans.iter().map(steps).collect(), complete: found.complete, forced }
    }
}
