//! Input data of pictures: texts and numbers, independent of their source.

/// A plan and the progress of the search that found it.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// A sentence about the plan, such as its cost and what is proved about it.
    pub verdict: String,
    /// The actions of the plan, ordered by start.
    pub steps: Vec<Step>,
    /// The quantity on the horizontal axis.
    pub axis: Axis,
    /// The cost during the plan, and each numeric fluent that the plan changes or a condition bounds.
    pub curves: Vec<Curve>,
    /// The map of the mission's places, if there is one.
    pub map: Option<Map>,
    /// The messages of the search, in chronological order.
    pub search: Vec<Progress>,
    /// All designs of the knowledge base.
    pub designs: Vec<Design>,
}

/// The quantity on the horizontal axis of a plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Axis {
    /// Time, in the time unit of the domain.
    #[default]
    Time,
    /// Steps of equal length, for sequences with an action that has no duration.
    Steps,
}

/// An action of a plan with its configuration.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// The action with its arguments; functions and designs of the configuration are omitted.
    pub label: String,
    /// Position of the start on the horizontal axis.
    pub start: f64,
    /// Position of the end on the horizontal axis.
    pub end: f64,
    /// The start, formatted as text.
    pub start_text: String,
    /// The duration, formatted as text.
    pub duration_text: String,
    /// The contribution to the metric, formatted as text.
    pub cost_text: String,
    /// The functions that the action uses, each with its design.
    pub configuration: Vec<(String, String)>,
    /// The functions whose design differs from the design at their previous use in the plan, each
    /// with the previous design.
    pub reconfigured: Vec<(String, String)>,
    /// Origin and destination if the action is a move, as indices in [`Map::places`].
    pub way: Option<(usize, usize)>,
}

/// The values of a numeric fluent, or of the cost, over a plan.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Name of the fluent, or `cost`.
    pub name: String,
    /// The changes: position on the horizontal axis, and new value. The first entry is the initial
    /// value, if the fluent has one.
    pub points: Vec<(f64, f64)>,
    /// The bounds that conditions impose on the fluent.
    pub bounds: Vec<Bound>,
}

/// A bound that a condition of an action or the goal imposes on a numeric fluent.
#[derive(Debug, Clone, Default)]
pub struct Bound {
    /// Position on the horizontal axis from which the bound applies.
    pub from: f64,
    /// Position on the horizontal axis up to which the bound applies.
    pub to: f64,
    /// The value with which the fluent is compared.
    pub value: f64,
    /// Description of the bound, such as `step 3 needs battery >= 14`.
    pub text: String,
}

/// A map: places and the ways between them.
#[derive(Debug, Clone, Default)]
pub struct Map {
    /// The places.
    pub places: Vec<Place>,
    /// Pairs of places that are connected by a way, as indices in `places`; each pair occurs once.
    pub ways: Vec<(usize, usize)>,
}

/// A place of a map.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// Name of the place.
    pub name: String,
    /// Coordinates: x increases to the right, y increases upwards. If any place of a map has none,
    /// all places of the map are laid out by the ways between them.
    pub position: Option<(f64, f64)>,
    /// Whether an object is at the place initially.
    pub is_start: bool,
    /// Whether an object must be at the place finally.
    pub is_goal: bool,
}

/// The state of a search when it sent a message.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Metric value of the best known plan, if there is one.
    pub cost: Option<f64>,
    /// Lower bound on the metric value of every plan.
    pub lower_bound: f64,
    /// Description of the state, such as `cost 8, lower bound 7`.
    pub text: String,
}

/// A function design: a way to provide a function.
#[derive(Debug, Clone, Default)]
pub struct Design {
    /// Name of the design.
    pub name: String,
    /// The names of the functions that the design provides.
    pub functions: Vec<String>,
    /// Whether the design can be selected.
    pub available: bool,
    /// Estimated quality attributes, such as `battery_usage 4`.
    pub estimations: Vec<String>,
    /// Required components and environment conditions with their states, such as `c_kinect
    /// (failed)` or `ambient_light at most 0.8 (now 0.3)`.
    pub needs: Vec<String>,
    /// The numbers of the steps of the plan that use the design, from 1.
    pub steps: Vec<usize>,
    /// Derivations that explain why the design is available or unavailable.
    pub because: Vec<Reason>,
}

/// A derivation tree of an inferred fact, or another detail.
#[derive(Debug, Clone, Default)]
pub struct Reason {
    /// The derived fact with its justification, or the detail.
    pub text: String,
    /// Derivations of the premises.
    pub supports: Vec<Reason>,
}

/// A difference between two situations or plans.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Description of the difference, in a sentence.
    pub text: String,
    /// Derivations that explain the difference.
    pub because: Vec<Reason>,
}

/// Result of checking a certificate.
#[derive(Debug, Clone, Default)]
pub struct Checked {
    /// Whether all parts of the check succeeded.
    pub verified: bool,
    /// Whether a limit ended the check, so that parts without success need not be wrong.
    pub stopped: bool,
    /// The result in a sentence.
    pub verdict: String,
    /// The parts of the check: name, whether it succeeded, and finding.
    pub parts: Vec<(String, bool, String)>,
}

/// The contents of the page about a plan.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Name of the mission.
    pub name: String,
    /// Description of the mission.
    pub description: String,
    /// Differences of the current situation from the mission's files, each in a few words.
    pub situation: Vec<String>,
    /// The plan for the situation without these differences; `None` to show only the current plan.
    pub before: Option<Plan>,
    /// The plan for the current situation.
    pub plan: Plan,
    /// Differences between the two situations and between their plans.
    pub changes: Vec<Change>,
    /// Result of checking the certificate, if there is one.
    pub checked: Option<Checked>,
}

/// The journal of an adaptation loop.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// Name of the journal.
    pub name: String,
    /// A sentence that states whether the journal is usable.
    pub verdict: String,
    /// Descriptions of the segments and snapshots, one line each.
    pub parts: Vec<String>,
    /// Errors and warnings found in the journal.
    pub messages: Vec<String>,
    /// All inputs and decisions, in chronological order.
    pub happenings: Vec<Happening>,
}

/// An input or a decision of an adaptation loop.
#[derive(Debug, Clone)]
pub struct Happening {
    /// Number of the journal record that contains the input or decision.
    pub record: u64,
    /// Time in seconds since the start of the mission.
    pub time: f64,
    /// Kind of the input or decision.
    pub kind: Kind,
    /// Description in a sentence; for an event, the received line.
    pub text: String,
    /// Derivations or other details.
    pub because: Vec<Reason>,
}

/// Kind of a [`Happening`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A line that the loop received, such as a report from the robot.
    Event,
    /// A conclusion, the failure to conclude, or a reported value that is missing or not adopted yet.
    Inference,
    /// Progress of planning: a plan was requested, found, kept, or not found, or the goal is
    /// reached.
    Plan,
    /// A command to the robot, or an objective that no design can serve.
    Effect,
    /// An input that was refused, outdated or repeated, a missed deadline, or an error.
    Refusal,
}

impl Kind {
    /// All kinds, in the order of their lanes.
    pub const ALL: [Self; 5] = [Self::Event, Self::Inference, Self::Plan, Self::Effect, Self::Refusal];

    /// Returns the plural name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Event => "events",
            Self::Inference => "inferences",
            Self::Plan => "plans",
            Self::Effect => "effects",
            Self::Refusal => "refusals",
        }
    }
}

/// The contents of a page for an answer other than a single plan, such as a Pareto front.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    /// Name of the subject of the page.
    pub name: String,
    /// Description of the subject, in a sentence.
    pub description: String,
    /// The answer, in a sentence.
    pub verdict: String,
    /// The parts of the page, in order.
    pub parts: Vec<Part>,
}

/// A part of a page.
#[derive(Debug, Clone)]
pub enum Part {
    /// A heading.
    Heading(String),
    /// A list of sentences with their derivations.
    Sentences(Vec<Change>),
    /// A scatter plot.
    Points(Points),
    /// Distributions of values, with a row for each group.
    Rows(Rows),
    /// A table: its name, its heading and its rows.
    Table(String, Vec<String>, Vec<Vec<String>>),
    /// Expandable plans, each with a title.
    Plans(Vec<(String, Plan)>),
}

/// A scatter plot with a connecting line.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Title of the plot.
    pub title: String,
    /// Names of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Vertices of the connecting line, in order; x and y.
    pub line: Vec<(f64, f64)>,
    /// The points: short name, description, x and y.
    pub points: Vec<(String, String, f64, f64)>,
}

/// A plot of the distributions of values, with a row for each group.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// Title of the plot.
    pub title: String,
    /// Name of the quantity with its unit.
    pub axis: String,
    /// The groups.
    pub groups: Vec<Group>,
}

/// A group of values, drawn as a row.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Name of the group.
    pub name: String,
    /// The values, each with a description.
    pub values: Vec<(f64, String)>,
    /// Mean of the values, and half the width of the mean's confidence interval.
    pub mean: Option<(f64, f64)>,
    /// Text for a group without values, such as `0 of 20 accomplished`.
    pub nothing: String,
}
