//! Input data of pictures: names and numbers, independent of their source.

/// A plan and the search that found it.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// The cost and its proof of optimality, in a sentence.
    pub verdict: String,
    /// Executed actions, ordered by start.
    pub steps: Vec<Step>,
    /// Quantity of the horizontal axis.
    pub axis: Axis,
    /// All numeric fluents that actions change, and the cost.
    pub curves: Vec<Curve>,
    /// The places between which an object moves, if there are any.
    pub map: Option<Map>,
    /// Progress of the search.
    pub search: Vec<Progress>,
    /// All designs of the knowledge base.
    pub designs: Vec<Design>,
}

/// Quantity of the horizontal axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Axis {
    /// Time, in the unit of the domain.
    #[default]
    Time,
    /// Steps of equal length, for actions without durations.
    Steps,
}

/// An action with its configuration.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// The action with its arguments, without functions and designs.
    pub label: String,
    /// Start on the axis.
    pub start: f64,
    /// End on the axis.
    pub end: f64,
    /// Start as text.
    pub start_text: String,
    /// Duration as text.
    pub duration_text: String,
    /// Contribution to the metric as text.
    pub cost_text: String,
    /// Functions with their designs.
    pub configuration: Vec<(String, String)>,
    /// Functions that change their design, with the former design.
    pub reconfigured: Vec<(String, String)>,
    /// Origin and destination of a move, as positions in [`Map::places`].
    pub way: Option<(usize, usize)>,
}

/// A numeric fluent over the plan.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Name of the fluent.
    pub name: String,
    /// Points of change on the axis, each with the new value. The first point is the beginning.
    pub points: Vec<(f64, f64)>,
    /// Bounds that conditions impose.
    pub bounds: Vec<Bound>,
}

/// A bound that an action or the goal imposes on a number.
#[derive(Debug, Clone, Default)]
pub struct Bound {
    /// Start on the axis.
    pub from: f64,
    /// End on the axis.
    pub to: f64,
    /// Limit with which the number is compared.
    pub value: f64,
    /// Description: `step 3 needs battery >= 14`.
    pub text: String,
}

/// Places and the ways between them.
#[derive(Debug, Clone, Default)]
pub struct Map {
    /// The places.
    pub places: Vec<Place>,
    /// Pairs of neighbouring places, each once.
    pub ways: Vec<(usize, usize)>,
}

/// A place.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// Name of the place.
    pub name: String,
    /// Coordinates, x to the right and y upwards. If they are missing, the places are laid out by
    /// their ways.
    pub position: Option<(f64, f64)>,
    /// `true` if an object is at the place initially.
    pub is_start: bool,
    /// `true` if an object must be at the place finally.
    pub is_goal: bool,
}

/// State of a search at a point in time.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Metric of the best known plan.
    pub cost: Option<f64>,
    /// Lower bound on the metric of every plan.
    pub lower_bound: f64,
    /// Both numbers as text.
    pub text: String,
}

/// A function design.
#[derive(Debug, Clone, Default)]
pub struct Design {
    /// Its name.
    pub name: String,
    /// The functions that it solves.
    pub functions: Vec<String>,
    /// `true` if the design can be selected.
    pub available: bool,
    /// Estimated values: `battery_usage 4`.
    pub estimations: Vec<String>,
    /// Requirements with their state: `c_kinect (failed)`, `ambient_light at most 0.8 (now 0.3)`.
    pub needs: Vec<String>,
    /// Numbers of the steps that use the design, from 1.
    pub steps: Vec<usize>,
    /// Derivation of its availability.
    pub because: Vec<Reason>,
}

/// Derivation of a fact.
#[derive(Debug, Clone, Default)]
pub struct Reason {
    /// The fact and its justification.
    pub text: String,
    /// Derivations of the premises.
    pub supports: Vec<Reason>,
}

/// A difference between two situations.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Description in a sentence.
    pub text: String,
    /// Derivations of the difference.
    pub because: Vec<Reason>,
}

/// Result of checking a certificate.
#[derive(Debug, Clone, Default)]
pub struct Checked {
    /// `true` if all parts hold.
    pub verified: bool,
    /// Result in a sentence.
    pub verdict: String,
    /// Parts of the check: name, success and finding.
    pub parts: Vec<(String, bool, String)>,
}

/// Contents of the page about a plan.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Name of the mission.
    pub name: String,
    /// Description of the mission.
    pub description: String,
    /// Differences from the files of the mission, each in a few words.
    pub situation: Vec<String>,
    /// The plan without these differences, if there are any.
    pub before: Option<Plan>,
    /// The plan.
    pub plan: Plan,
    /// Differences between the two plans.
    pub changes: Vec<Change>,
    /// Result of checking the certificate.
    pub checked: Option<Checked>,
}

/// Record of an adaptation loop.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// Name of the record.
    pub name: String,
    /// Usability of the record, in a sentence.
    pub verdict: String,
    /// Contents of the record, each in a sentence.
    pub parts: Vec<String>,
    /// Errors of the record.
    pub messages: Vec<String>,
    /// All events, in chronological order.
    pub happenings: Vec<Happening>,
}

/// An input or a decision of a loop.
#[derive(Debug, Clone)]
pub struct Happening {
    /// Number of the record that contains the event.
    pub record: u64,
    /// Time in seconds since the beginning.
    pub time: f64,
    /// Kind of the event.
    pub kind: Kind,
    /// Description in a sentence.
    pub text: String,
    /// Derivation or details.
    pub because: Vec<Reason>,
}

/// Kind of a [`Happening`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A report of the robot.
    Event,
    /// A change of the inferred facts.
    Inference,
    /// A plan was requested, found, kept or not found.
    Plan,
    /// A command for the robot.
    Effect,
    /// A refused or repeated input.
    Refusal,
}

impl Kind {
    /// All kinds, causes before effects.
    pub const ALL: [Self; 5] = [Self::Event, Self::Inference, Self::Plan, Self::Effect, Self::Refusal];

    /// Plural name of the kind.
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

/// Page of parts, for answers other than a single plan.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    /// Subject of the page.
    pub name: String,
    /// Subject in a sentence.
    pub description: String,
    /// Answer in a sentence.
    pub verdict: String,
    /// Contents of the page, in order.
    pub parts: Vec<Part>,
}

/// A part of a page.
#[derive(Debug, Clone)]
pub enum Part {
    /// A heading.
    Heading(String),
    /// Sentences with their derivations.
    Sentences(Vec<Change>),
    /// Scatter plot.
    Points(Points),
    /// Distributions of values, a row per group.
    Rows(Rows),
    /// A table: its name, its heading and its rows.
    Table(String, Vec<String>, Vec<Vec<String>>),
    /// Expandable plans, each with its title.
    Plans(Vec<(String, Plan)>),
}

/// Scatter plot.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Title of the plot.
    pub title: String,
    /// Names of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Vertices of the connecting line, in order.
    pub line: Vec<(f64, f64)>,
    /// Points: short name, description, coordinates.
    pub points: Vec<(String, String, f64, f64)>,
}

/// Distributions of values, a row per group.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// Title of the plot.
    pub title: String,
    /// Name of the quantity with its unit.
    pub axis: String,
    /// The groups.
    pub groups: Vec<Group>,
}

/// A group of values.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Name of the group.
    pub name: String,
    /// Values with their descriptions.
    pub values: Vec<(f64, String)>,
    /// Mean, and half the width of its confidence interval.
    pub mean: Option<(f64, f64)>,
    /// Text shown for a group without values, such as `0 of 20 accomplished`.
    pub nothing: String,
}
