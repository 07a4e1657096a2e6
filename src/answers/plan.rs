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

/// A plan with its proof and statistics.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PlanAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = PLAN))]
    format: &'static str,
    /// The mission's name; empty for a domain and a problem.
    mission: String,
    /// `optimal`, `feasible`, `unsolvable`, `unsolvable_within_horizon` or `unknown`.
    status: &'static str,
    /// Metric of the plan, in its unit; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// Bound on the metric of every plan: no plan has a better metric; null if unknown.
    #[schemars(with = "Option<f64>")]
    lower_bound: Option<Value>,
    /// Number of steps up to which better plans are excluded; 0 if no such number was determined. For
    /// an optimal plan, at least its number of steps. If `unbounded` is not null, the number of steps
    /// of the plan.
    horizon: usize,
    /// Proof that the plan is optimal, or that no plan exists; otherwise null. The status
    /// `unsolvable_within_horizon` can have none: the formulas up to `horizon` have no plan.
    proof: Option<ProofPart>,
    /// `proved` or `suspected` for a metric without a best value, else null.
    unbounded: Option<&'static str>,
    /// The plan; empty if there is none.
    steps: Vec<StepPart>,
    /// Statistics of planning.
    statistics: StatisticsPart,
    /// With `--minimize`: value of each objective.
    #[serde(skip_serializing_if = "Option::is_none")]
    objectives: Option<Vec<Objective>>,
    /// With `--alternatives`, for an optimal plan: other optimal plans.
    #[serde(skip_serializing_if = "Option::is_none")]
    alternatives: Option<AlternativesPart>,
    /// With `--concurrent`: end of the last action. The metric may include it; the `cost` of a step
    /// does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>")]
    makespan: Option<Value>,
    /// If no plan exists, but one would exist with all designs of the knowledge base: a minimal set of unavailable
    /// designs without which no plan exists, even if all other designs of the knowledge base are available.
    #[serde(skip_serializing_if = "Option::is_none")]
    blocking: Option<Vec<String>>,
    /// If no plan exists: numeric functions without a value that actions need, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    missing_values: Option<Vec<MissingValuePart>>,
}

/// A numeric function without a value that actions need.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MissingValuePart {
    /// The numeric function with its arguments; for a design, the attribute and the design.
    function: String,
    /// Actions that need the value.
    needed_by: Vec<String>,
    /// Design without an estimation, if this is the cause.
    #[serde(skip_serializing_if = "Option::is_none")]
    design: Option<String>,
    /// File that should contain the value.
    file: String,
}

/// Pareto front of two objectives.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParetoAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = PARETO))]
    format: &'static str,
    /// The mission's name.
    mission: String,
    /// `optimal` if it is proved that the front is complete, `unsolvable` if no plan exists, otherwise as for one plan.
    status: &'static str,
    /// The minimised objectives, as they were given.
    objectives: Vec<String>,
    /// The plans of the front, sorted from the best in the first objective. At a limit, the last
    /// one may not be proved optimal.
    points: Vec<PlanAnswer>,
}

/// An objective with its value for a plan.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Objective {
    /// The objective, as it was given.
    minimize: String,
    /// Value of the objective for this plan.
    #[schemars(with = "f64")]
    value: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(tag = "by", rename_all = "snake_case")]
enum ProofPart {
    /// No formula up to the step bound has a better plan.
    Sat {
        /// Number of steps up to which the formula was solved; longer plans cannot be better.
        step_bound: usize,
        /// External solver whose result "unsatisfiable" was not checked.
        #[serde(skip_serializing_if = "Option::is_none")]
        unchecked: Option<String>,
    },
    /// The cost equals a lower bound.
    Bound,
    /// Search expanded every state from which a better plan could exist.
    Search,
    /// A relaxation of the task has no plan.
    Relaxation {
        /// Reason why the relaxation has no plan.
        reason: String,
    },
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StepPart {
    /// Name of the action.
    action: String,
    /// All arguments, in the order of the action's parameters.
    arguments: Vec<String>,
    /// The design of each function.
    #[schemars(with = "std::collections::BTreeMap<String, String>")]
    configuration: Map<String, Value>,
    /// Start time, in the domain's time unit.
    #[schemars(with = "f64")]
    start: Value,
    /// Duration, in the domain's time unit; 0 for actions without duration.
    #[schemars(with = "f64")]
    duration: Value,
    /// Contribution to the metric.
    #[schemars(with = "f64")]
    cost: Value,
    /// Functions whose design differs from that in the latest earlier step with the same function.
    reconfigured: Vec<String>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StatisticsPart {
    /// Number of ground operators.
    operators: usize,
    /// Number of variables of the largest formula.
    variables: usize,
    /// Number of clauses of the largest formula.
    clauses: usize,
    /// Number of clauses in each family.
    #[schemars(with = "std::collections::BTreeMap<String, usize>")]
    families: Map<String, Value>,
    /// Number of solver conflicts over all formulas.
    conflicts: u64,
    /// Number of solver calls over all formulas.
    solver_calls: usize,
    /// Component that found the plan: `search`, `satisficing` or `sat`.
    found_by: Option<&'static str>,
    /// Number of expanded states over all searches.
    expanded: u64,
    /// Number of generated states over all searches.
    generated: u64,
    /// Number of states evaluated by a heuristic over all searches.
    evaluated: u64,
    /// Number of restarts of the satisficing search for a better plan.
    restarts: usize,
    /// Improved plans, and lower bounds that rose by more than one percent or to the cost of the plan, in
    /// order. If the metric depends on the state, a lower bound alone adds no entry.
    history: Vec<MomentPart>,
    /// Running times of the stages.
    milliseconds: MillisecondsPart,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MomentPart {
    /// Metric of the best plan at this point; null without a plan.
    #[schemars(with = "Option<f64>")]
    cost: Option<Value>,
    /// Lower bound at this point.
    #[schemars(with = "f64")]
    lower_bound: Value,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct MillisecondsPart {
    /// Reading files, reasoning, and filling the problem.
    read: f64,
    /// Grounding.
    ground: f64,
    /// Heuristics and searches.
    search: f64,
    /// Encoding of formulas.
    encode: f64,
    /// SAT solving.
    solve: f64,
    /// Times of the entries of `history`.
    history: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct AlternativesPart {
    /// Steps of each plan.
    plans: Vec<Vec<StepPart>>,
    /// Whether it is proved that there are no other optimal plans, up to idle actions. An idle action
    /// costs nothing, and nothing depends on its effects.
    complete: bool,
    /// For each step, the choices that all optimal plans share, up to idle actions; null if unknown.
    forced: Option<Vec<ForcedPart>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ForcedPart {
    /// Whether all optimal plans have the same action in this step.
    action: bool,
    /// Functions with the same design in this step in all optimal plans.
    functions: Vec<String>,
}

/// Running times of the stages before optimisation.
#[derive(Debug, Clone, Copy, Default)]
pub struct Preparation {
    /// Time of reading the files and of reasoning.
    pub read: Duration,
    /// Time of grounding the task.
    pub ground: Duration,
}

/// Converts a duration to milliseconds, with three decimals.
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

    /// Adds the value of each objective of `--minimize`. `objectives` is empty for a plan by the
    /// mission's own metric.
    #[must_use]
    pub fn with_objectives(mut self, objectives: Vec<Objective>) -> Self {
        self.objectives = Some(objectives).filter(|objectives| !objectives.is_empty());
        self
    }

    /// Adds the other optimal plans; `None` if they were not searched for.
    #[must_use]
    pub fn with_alternatives(mut self, found: Option<&Alternatives>) -> Self {
        self.alternatives = found.map(AlternativesPart::of);
        self
    }

    /// Adds the end time of the last action, for a plan whose actions may overlap.
    #[must_use]
    pub fn with_makespan(mut self, makespan: Option<&Exact>) -> Self {
        self.makespan = makespan.map(exact_to_json);
        self
    }

    /// Adds the set of unavailable designs that prevents every plan. Adds nothing if `blocking` is `None`, or if
    /// other causes prevent every plan.
    #[must_use]
    pub fn with_blocking(mut self, blocking: Option<&Blocking>) -> Self {
        self.blocking = match blocking {
            Some(Blocking::Designs(designs)) => Some(designs.clone()),
            Some(Blocking::Other) | None => None,
        };
        self
    }

    /// Adds the numeric functions without a value that actions need. Adds nothing if `missing` is empty.
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
    /// Creates the answer from the points of the Pareto front; points without a plan are omitted. `objectives` are
    /// the texts of the objectives.
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
    /// Pairs the texts of objectives with their values for one plan.
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
