//! JSON answer of `metaplan compare`, and the rows of its table.

use std::time::Duration;

use schemars::JsonSchema;
use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::comparison::{Candidate, Comparison, Costs, LossAt, LossReport, Measures};
use crate::message::Message;

const FORMAT: &str = "metaplan-compare/1";

/// Names of the start and the goal of a comparison.
pub type Pair = (String, String);

/// Names of the measures of a candidate, in the order of the table's columns.
pub const MEASURES: [&str; 12] = [
    "goal",
    "goal_with_reserve",
    "no_collision",
    "collisions",
    "time",
    "energy",
    "reconfigurations",
    "time_if_successful",
    "energy_if_successful",
    "penalised_time",
    "replans",
    "states",
];

/// Row of the table of `metaplan compare`: a candidate (a plan or policy) with its measures.
#[derive(Debug, Clone)]
pub struct Row {
    /// Start and goal of the row's comparison. `None` for the mission's own start and goal, and for added rows.
    pub pair: Option<Pair>,
    /// Kind of the candidate: `a` to `e` (see [`Candidate::kind`]), `f` for the hindsight bounds, or `+` for an added
    /// row.
    pub kind: String,
    /// Name of the candidate.
    pub name: String,
    /// Values of the measures, in the order of [`MEASURES`]. `None` if a measure is infinite or undefined, or if there
    /// is no hindsight bound on it.
    pub values: Vec<Option<f64>>,
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("kind", &self.kind)?;
        object.serialize_entry("name", &self.name)?;
        for (measure, value) in MEASURES.iter().zip(&self.values) {
            object.serialize_entry(measure, value)?;
        }
        object.end()
    }
}

fn row(pair: Option<&Pair>, kind: char, name: &str, values: Vec<Option<f64>>) -> Row {
    Row { pair: pair.cloned(), kind: kind.to_string(), name: name.to_owned(), values }
}

fn values(measures: &Measures) -> [Option<f64>; 12] {
    [
        Some(measures.goal),
        Some(measures.goal_with_reserve),
        Some(measures.no_collision),
        Some(measures.collisions),
        measures.time,
        measures.energy,
        measures.reconfigurations,
        measures.time_if_successful,
        measures.energy_if_successful,
        measures.penalised_time,
        Some(measures.replans),
        Some(measures.states as f64),
    ]
}

/// Returns one table row for each given candidate, without a row for the hindsight bounds (lower bounds from a
/// clairvoyant controller).
pub fn begun_rows(pair: Option<&Pair>, candidates: &[Candidate]) -> Vec<Row> {
    let measured = candidates
        .iter()
        .map(|candidate| row(pair, candidate.kind, &candidate.name, values(&candidate.measures).to_vec()));
    measured.collect()
}

/// Returns the table rows of a complete comparison: one for each candidate, and one for the hindsight bounds (lower
/// bounds from a clairvoyant controller).
pub fn rows(pair: Option<&Pair>, comparison: &Comparison) -> Vec<Row> {
    let mut rows = begun_rows(pair, &comparison.candidates);
    let [time, energy] = comparison.hindsight;
    let bound = |measure: &str| match measure {
        "time" => time.expected,
        // A mission that does not reach the goal costs at least the penalty.
        "penalised_time" => {
            Some(time.expected.map_or(comparison.penalty, |expected| expected.min(comparison.penalty)))
        }
        "energy" => energy.expected,
        "time_if_successful" => time.least,
        "energy_if_successful" => energy.least,
        _ => None,
    };
    let bounds = MEASURES.iter().map(|measure| bound(measure)).collect();
    rows.push(row(pair, 'f', "hindsight bound, for the goal reached", bounds));
    rows
}

/// All comparisons, or the results at the time limit.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
pub struct CompareAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Whether everything was computed before the time limit.
    complete: bool,
    /// One comparison for each pair of start and goal.
    comparisons: Vec<ComparisonAnswer>,
    /// Rows added by `--published`, in the form of candidates.
    #[schemars(with = "Vec<std::collections::BTreeMap<String, serde_json::Value>>")]
    published: &'a [Row],
    /// Reason why the answer is incomplete (M130).
    messages: &'a [Message],
}

impl<'a> CompareAnswer<'a> {
    /// Creates the answer; `published` are rows that the user adds. The answer is incomplete if
    /// there is a message.
    pub fn new(comparisons: Vec<ComparisonAnswer>, published: &'a [Row], messages: &'a [Message]) -> Self {
        let complete = messages.is_empty();
        Self { format: FORMAT, complete, comparisons, published, messages }
    }
}

/// One comparison.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
pub struct ComparisonAnswer {
    /// Start of the mission; null for the mission's own start and goal.
    start: Option<String>,
    /// Goal of the mission; null for the mission's own start and goal.
    goal: Option<String>,
    /// The compared plans and policies (`kind` `a` to `e`) and, if the comparison is complete, lower bounds (`kind`
    /// `f`). Each row has `kind`, `name` and the measures. A measure is null if it is infinite or undefined, or if
    /// there is no bound on it.
    #[schemars(with = "Vec<std::collections::BTreeMap<String, serde_json::Value>>")]
    candidates: Vec<Row>,
    #[serde(flatten)]
    figures: Option<Figures>,
    /// Whether all candidates were computed.
    complete: bool,
    /// Size, running time and memory of both approaches.
    costs: CostsPart,
}

/// The fields of a complete comparison.
#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
struct Figures {
    /// Vertices of the Pareto front of expected time and probability of success without collision.
    front: Vec<[f64; 2]>,
    /// Penalty time of a failed mission.
    penalty: f64,
    /// Additional penalised time of the plan with replanning over the best policy.
    price_of_determinism: Option<f64>,
    /// Reason why the price of determinism is zero, if this is known without computing it, else null.
    price_provably_zero: Option<&'static str>,
    /// Additional penalised time of the plan without replanning over the best policy.
    price_of_open_loop: Option<f64>,
    /// Penalised time saved by replanning.
    value_of_replanning: Option<f64>,
    /// Effect of the loss of a component; null if no component can be lost.
    loss: Option<LossPart>,
}

#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
struct LossPart {
    /// The component.
    component: String,
    /// Probability of the loss at each move.
    rate: f64,
    /// Results for each move after which the component is lost.
    steps: Vec<LossStep>,
}

#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
struct LossStep {
    /// Number of moves before the loss.
    moves: usize,
    /// Time of the plan if it can be continued unchanged, else null.
    open_loop: Option<f64>,
    /// Time with a new plan after the loss.
    replanned: Option<f64>,
    /// Time with a new policy after the loss.
    solved_again: Option<f64>,
    /// Time of the policy that takes the possible loss into account and may choose another route from the start.
    anticipated: Option<f64>,
}

#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
struct CostsPart {
    /// Number of states of the process.
    states: usize,
    /// Number of transitions of the process.
    transitions: usize,
    /// Number of planning queries.
    plans: usize,
    /// Number of variables of the largest formula.
    variables: u64,
    /// Number of clauses of the largest formula.
    clauses: u64,
    /// Number of decisions of the policies for single objectives, in all states that they reach.
    decisions: usize,
    /// Running times of the stages.
    milliseconds: Milliseconds,
    /// The greater of the following two values; null if the system does not report the memory.
    peak_memory_mb: Option<u64>,
    /// Peak memory in MB while the process was explored and solved, after the first plan. Includes memory that
    /// the planner has not released.
    process_memory_mb: Option<u64>,
    /// Peak memory in MB during the first plan.
    first_plan_memory_mb: Option<u64>,
}

#[derive(Debug, Clone, serde::Serialize, JsonSchema)]
struct Milliseconds {
    /// Exploration of the process.
    build: f64,
    /// Solution of the process.
    solve: f64,
    /// Extraction of the policy from the solution.
    extract: f64,
    /// Total time of the first plan.
    first_plan: f64,
    /// Grounding and encoding for the first plan.
    first_plan_build: f64,
    /// Search and SAT solving for the first plan.
    first_plan_solve: f64,
    /// Extraction of the first plan from the solution.
    first_plan_extract: f64,
    /// All further plans.
    more_plans: f64,
}

impl ComparisonAnswer {
    /// Creates the answer for a comparison in which all candidates were computed.
    pub fn new(pair: Option<&Pair>, comparison: &Comparison) -> Self {
        let figures = Figures {
            front: comparison.front.clone(),
            penalty: comparison.penalty,
            price_of_determinism: comparison.price_of_determinism(),
            price_provably_zero: comparison.no_price,
            price_of_open_loop: comparison.price_of_open_loop(),
            value_of_replanning: comparison.value_of_replanning(),
            loss: comparison.loss.as_ref().map(LossPart::of),
        };
        Self::of(pair, rows(pair, comparison), Some(figures), &comparison.costs)
    }

    /// Creates the answer for a comparison that was stopped by the time limit, with the candidates evaluated until
    /// then.
    pub fn begun(pair: Option<&Pair>, candidates: &[Candidate], costs: &Costs) -> Self {
        Self::of(pair, begun_rows(pair, candidates), None, costs)
    }

    fn of(pair: Option<&Pair>, candidates: Vec<Row>, figures: Option<Figures>, costs: &Costs) -> Self {
        let (start, goal) = pair.cloned().unzip();
        let complete = figures.is_some();
        Self { start, goal, candidates, figures, complete, costs: CostsPart::of(costs) }
    }
}

impl LossPart {
    fn of(loss: &LossReport) -> Self {
        let step = |step: &LossAt| LossStep {
            moves: step.moves,
            open_loop: step.open_loop,
            replanned: step.replanned,
            solved_again: step.solved_again,
            anticipated: step.anticipated,
        };
        Self {
            component: loss.component.clone(),
            rate: loss.rate,
            steps: loss.steps.iter().map(step).collect(),
        }
    }
}

impl CostsPart {
    fn of(costs: &Costs) -> Self {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        Self {
            states: costs.states,
            transitions: costs.transitions,
            plans: costs.plans,
            variables: costs.variables,
            clauses: costs.clauses,
            decisions: costs.decisions,
            milliseconds: Milliseconds {
                build: milliseconds(costs.process.build),
                solve: milliseconds(costs.process.solve),
                extract: milliseconds(costs.process.extract),
                first_plan: milliseconds(costs.first_plan.total()),
                first_plan_build: milliseconds(costs.first_plan.build),
                first_plan_solve: milliseconds(costs.first_plan.solve),
                first_plan_extract: milliseconds(costs.first_plan.extract),
                more_plans: milliseconds(costs.more_plans),
            },
            peak_memory_mb: costs.process_memory.max(costs.plan_memory),
            process_memory_mb: costs.process_memory,
            first_plan_memory_mb: costs.plan_memory,
        }
    }
}
