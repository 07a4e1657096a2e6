//! What is drawn: names and numbers, and nothing of where they come from.

/// A plan, and what led to it.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// In one sentence: the cost, and what proves that it is the least.
    pub verdict: String,
    /// What is done, by start.
    pub steps: Vec<Step>,
    /// In which direction pictures run.
    pub axis: Axis,
    /// All numbers that actions change, and the cost.
    pub curves: Vec<Curve>,
    /// The places that something moves between, if there are any.
    pub map: Option<Map>,
    /// How the planner came to the answer.
    pub search: Vec<Progress>,
    /// All designs of the knowledge base.
    pub designs: Vec<Design>,
}

/// What runs from left to right.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Axis {
    /// Time, in the domain's unit.
    #[default]
    Time,
    /// Steps, each as long as another: where actions take no time.
    Steps,
}

/// An action with its configuration.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// The action with its arguments, without functions and designs.
    pub label: String,
    /// Where it begins on the axis.
    pub start: f64,
    /// Where it ends on the axis.
    pub end: f64,
    /// When it starts, as text.
    pub start_text: String,
    /// How long it takes, as text.
    pub duration_text: String,
    /// What it adds to the metric, as text.
    pub cost_text: String,
    /// Functions, and the design of each.
    pub configuration: Vec<(String, String)>,
    /// Functions that change their design, with the one before.
    pub reconfigured: Vec<(String, String)>,
    /// From which place to which, as positions in [`Map::places`].
    pub way: Option<(usize, usize)>,
}

/// A number over the plan.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// What it is called.
    pub name: String,
    /// Where on the axis it changes, and what it is from there on; the first at the beginning.
    pub points: Vec<(f64, f64)>,
    /// What has to hold of it.
    pub bounds: Vec<Bound>,
}

/// What an action or the goal demands of a number.
#[derive(Debug, Clone, Default)]
pub struct Bound {
    /// From where on the axis.
    pub from: f64,
    /// Until where.
    pub to: f64,
    /// The number that it is compared with.
    pub value: f64,
    /// In words: `step 3 needs battery >= 14`.
    pub text: String,
}

/// Places, and ways between them.
#[derive(Debug, Clone, Default)]
pub struct Map {
    /// The places.
    pub places: Vec<Place>,
    /// Which of them neighbour each other; each pair once.
    pub ways: Vec<(usize, usize)>,
}

/// A place.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// What it is called.
    pub name: String,
    /// Where it lies, x to the right and y upwards; places without that are laid out by their ways.
    pub position: Option<(f64, f64)>,
    /// Whether something is there in the beginning.
    pub is_start: bool,
    /// Whether something is to be there in the end.
    pub is_goal: bool,
}

/// What was known at some time of the search.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// The metric of the best plan so far.
    pub cost: Option<f64>,
    /// No plan has a better metric than this.
    pub lower_bound: f64,
    /// Both as text.
    pub text: String,
}

/// A function design.
#[derive(Debug, Clone, Default)]
pub struct Design {
    /// Its name.
    pub name: String,
    /// The functions that it solves.
    pub functions: Vec<String>,
    /// Whether it can be selected.
    pub available: bool,
    /// Estimated values: `battery_usage 4`.
    pub estimations: Vec<String>,
    /// What it needs, with its state: `c_kinect (failed)`, `ambient_light at most 0.8 (now 0.3)`.
    pub needs: Vec<String>,
    /// The steps that use it, from 1.
    pub steps: Vec<usize>,
    /// Why it is available or not.
    pub because: Vec<Reason>,
}

/// Why something holds.
#[derive(Debug, Clone, Default)]
pub struct Reason {
    /// What holds, and by what.
    pub text: String,
    /// What that rests on.
    pub supports: Vec<Reason>,
}

/// What differs between two situations.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// In a sentence.
    pub text: String,
    /// Why.
    pub because: Vec<Reason>,
}

/// What came of checking a certificate.
#[derive(Debug, Clone, Default)]
pub struct Checked {
    /// Whether all of it holds.
    pub verified: bool,
    /// In one sentence.
    pub verdict: String,
    /// Its parts: name, whether it holds, and what was found.
    pub parts: Vec<(String, bool, String)>,
}

/// All that a page about a plan shows.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// The mission's name.
    pub name: String,
    /// What it is about.
    pub description: String,
    /// What is different from the mission's files, each in a few words.
    pub situation: Vec<String>,
    /// The answer without that, if there is a difference.
    pub before: Option<Plan>,
    /// The answer.
    pub plan: Plan,
    /// What differs between the two.
    pub changes: Vec<Change>,
    /// What was verified of a certificate.
    pub checked: Option<Checked>,
}

/// What a loop did.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// What it is called.
    pub name: String,
    /// Whether it can be used, in a sentence.
    pub verdict: String,
    /// What it consists of, each in a sentence.
    pub parts: Vec<String>,
    /// What is wrong with it.
    pub messages: Vec<String>,
    /// All that happened, in the order of time.
    pub happenings: Vec<Happening>,
}

/// Something that a loop heard or decided.
#[derive(Debug, Clone)]
pub struct Happening {
    /// The record that it stands in.
    pub record: u64,
    /// When, in seconds since the beginning.
    pub time: f64,
    /// What kind of thing it is.
    pub kind: Kind,
    /// In a sentence.
    pub text: String,
    /// Why, or what belongs to it.
    pub because: Vec<Reason>,
}

/// A kind of happening.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The robot reported something.
    Event,
    /// Something follows, or does no more.
    Inference,
    /// A plan was asked for, found, kept or not found.
    Plan,
    /// The robot is to do something.
    Effect,
    /// Something was refused, or seen before.
    Refusal,
}

impl Kind {
    /// All of them, causes before what they lead to.
    pub const ALL: [Self; 5] = [Self::Event, Self::Inference, Self::Plan, Self::Effect, Self::Refusal];

    /// What several of them are called.
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

/// A page of parts, for answers that are not a single plan.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    /// What it is about.
    pub name: String,
    /// The same in a sentence.
    pub description: String,
    /// The answer in a sentence.
    pub verdict: String,
    /// What it shows, in order.
    pub parts: Vec<Part>,
}

/// A part of a page.
#[derive(Debug, Clone)]
pub enum Part {
    /// A heading.
    Heading(String),
    /// Sentences, with what they rest on.
    Sentences(Vec<Change>),
    /// Points in two directions.
    Points(Points),
    /// How values are distributed, a row for each group.
    Rows(Rows),
    /// A table: its name, its heading and its rows.
    Table(String, Vec<String>, Vec<Vec<String>>),
    /// Plans that unfold, each with its title.
    Plans(Vec<(String, Plan)>),
}

/// Points in two directions.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// What it shows.
    pub title: String,
    /// What the directions are: to the right and upwards.
    pub axes: [String; 2],
    /// The points that are joined by a line, in its order.
    pub line: Vec<(f64, f64)>,
    /// The points: a short name, what they are, and where they are.
    pub points: Vec<(String, String, f64, f64)>,
}

/// How values are distributed.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// What it shows.
    pub title: String,
    /// What the values are, with their unit.
    pub axis: String,
    /// The groups.
    pub groups: Vec<Group>,
}

/// Values that belong together.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// What they are of.
    pub name: String,
    /// Each value, and what it is of.
    pub values: Vec<(f64, String)>,
    /// Their mean, and half the width of its interval.
    pub mean: Option<(f64, f64)>,
    /// Text shown for a group without values, such as `0 of 20 accomplished`.
    pub nothing: String,
}
