//! The adaptation loop: events in, adaptations out. Monitor, Analyze, Plan, Execute, over shared Knowledge \[1, 2\].
//!
//! A [`Loop`] is fed with [`Observation`]s and answers each with [`Answer`]s, some of which are [`Effect`]s: things that
//! the managed system is to do. It has no clock, no thread, no file and no global state; the same observations at
//! the same times give the same answers. [`drive`] joins it with an [`Observer`], an [`Effector`] and a [`Clock`].
//!
//! A plan is looked for when the plan at hand cannot be kept: it uses a design that is not available any more, an
//! objective is in error, an action has failed, the goal has changed, or the validator rejects the plan for the state as it
//! is (Algorithm 1 of the paper). It is also looked for when a design comes back, and adopted then if it is better by
//! the mission's minimum benefit. A design that is lost and that the plan does not use is no reason: of fewer choices none is
//! better.
//!
//! - \[1\] J. Kephart, D. Chess: The vision of autonomic computing, Computer 36, 2003.
//! - \[2\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod adapt;
mod analyze;
mod answer;
mod drive;
mod event;
mod execute;
mod interrupt;
mod knowledge;
mod live;
mod memo;
mod monitor;
pub(crate) mod number;
mod parts;
mod plan;
mod record;
mod resume;
mod sequence;
mod step;
mod watch;

use std::borrow::Cow;
use std::collections::{BTreeSet, HashSet};
use std::time::Duration;

use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use sha2::{Digest as _, Sha256};

use crate::message::Message;
use crate::mission::Mission;

pub use answer::{Answer, Command, DesignChange, Effect, ObjectiveChange};
pub use drive::{Clock, Effector, Observer, SystemClock, drive};
pub use event::{Event, Fault, LONGEST_LINE, Observation};
pub use knowledge::Knowledge;
pub use record::{Decision, Snapshot};
pub use step::PlannedStep;
pub use watch::{Planning, Watch};

pub(crate) use analyze::ruled_out;
use monitor::Changes;
pub(crate) use monitor::value_of;
use plan::Planner;
pub(crate) use resume::resume;
use resume::resumed_goal;
use sequence::Place;

/// The version of events and answers.
pub const FORMAT: &str = "metaplan-events/1";

/// How eager the loop is.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Another plan replaces one that could be kept only if its metric is better by this much, in the metric's unit.
    pub minimum_benefit: BigRational,
    /// So long must a design be available again before a better plan is looked for.
    pub settle: Duration,
    /// How long one plan may take; the best so far is used then, if there is one. Ten seconds unless said otherwise.
    pub time_limit: Option<Duration>,
    /// Whether, of plans that are as good and as long, one is chosen that has most steps of the plan at hand. The choice then
    /// depends on what has happened, and no longer on the situation alone.
    pub stay_close: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            minimum_benefit: BigRational::from_integer(0.into()),
            settle: Duration::ZERO,
            time_limit: Some(TIME_LIMIT),
            stay_close: false,
        }
    }
}

/// How long one plan may take unless said otherwise. A robot waits meanwhile.
const TIME_LIMIT: Duration = Duration::from_secs(10);

/// What follows from an observation is to be found in so many steps; see [`rules::Limits`]. A robot waits meanwhile.
const STEPS: u64 = 100_000_000;

/// So many names and values may be interned before the knowledge is made anew without what is not used any more.
const GROWTH: usize = 1024;

/// The adaptation loop of one robot.
#[derive(Debug, Clone)]
pub struct Loop {
    settings: Settings,
    knowledge: Knowledge,
    planner: Planner,
    digest: String,
    /// Attributes of the knowledge base, by local name and by IRI.
    attributes: BTreeSet<String>,
    /// Facts and functions that were found to fit the domain, as text.
    checked: HashSet<String>,
}

impl Loop {
    /// Takes charge of a mission.
    ///
    /// # Errors
    /// The mission cannot be planned for: what the knowledge base contributes does not fit the domain, or the knowledge
    /// contradicts itself.
    pub fn new(mission: Mission, settings: Settings) -> Result<Self, Vec<Message>> {
        mission.filled()?;
        let contradictions =
            mission.knowledge().map(crate::knowledge::Knowledge::contradictions).unwrap_or_default();
        if let Some(first) = contradictions.first() {
            let text =
                format!("the knowledge is inconsistent: {}: {}", first.violated, first.facts.join(", "));
            return Err(vec![Message::error("M110", text)]);
        }
        let kinds =
            mission.knowledge().map(|knowledge| knowledge.view().attribute_types()).unwrap_or_default();
        let attributes = kinds.into_iter().flat_map(|kind| [kind.iri, kind.name]).collect();
        let digest = digest(&mission, &settings);
        let planner = Planner { time_limit: settings.time_limit, ..Planner::default() };
        let mut knowledge = Knowledge::new(mission);
        if let Some(base) = knowledge.mission.knowledge_mut() {
            base.limit(STEPS);
        }
        if let Some(base) = knowledge.mission.knowledge() {
            knowledge.available = analyze::available(base);
        }
        Ok(Self { settings, knowledge, planner, digest, attributes, checked: HashSet::new() })
    }

    /// What the loop knows.
    pub fn knowledge(&self) -> &Knowledge {
        &self.knowledge
    }

    /// To look at how planning goes, from another thread.
    pub fn watch(&self) -> Watch {
        self.planner.watch.clone()
    }

    /// Makes the first plan and requests the first action.
    pub fn start(&mut self) -> Vec<Answer> {
        let mut answers = Vec::new();
        self.planner.made.clear();
        self.execute(&mut answers);
        answers
    }

    /// Takes an observation over, at a time since the start of the mission that never goes back, and says what follows.
    pub fn handle(&mut self, observation: &Observation, now: Duration) -> Vec<Answer> {
        let mut answers = Vec::new();
        // Plans that nobody has asked for are of no use to anybody.
        self.planner.made.clear();
        self.knowledge.lines += 1;
        self.knowledge.now = self.knowledge.now.max(observation.time.unwrap_or(now));
        if let Some(refusal) = observation.sequence.and_then(|sequence| self.refused(sequence)) {
            return vec![refusal];
        }
        let mut changes = Changes::default();
        let mut understood = false;
        for event in &observation.events {
            let outcome = event.clone().and_then(|event| self.monitor(&event, &mut changes));
            match outcome {
                Ok(()) => understood = true,
                Err(Fault { code, message }) => {
                    answers.push(Answer::Error { code: code.to_owned(), message });
                }
            }
        }
        if understood || changes.any() {
            if let Some(sequence) = observation.sequence {
                self.knowledge.numbers.insert(sequence);
            }
            self.adapt(changes, &mut answers);
            self.execute(&mut answers);
            self.forget();
        }
        answers
    }

    /// Why a line with this number is not taken over, if it is not.
    fn refused(&self, sequence: u64) -> Option<Answer> {
        match self.knowledge.numbers.place(sequence) {
            Place::New => None,
            Place::Seen => Some(Answer::Duplicate { sequence }),
            Place::Stale(mark) => Some(Answer::Stale { sequence, mark }),
            Place::Ahead(most) => {
                let text = format!(
                    "`seq` is {sequence}, but may be {most} at most: numbers grow from line to line, and skip a million at most"
                );
                Some(Answer::Error { code: "M307".to_owned(), message: text })
            }
        }
    }

    /// Effects that were asked for and not acknowledged, to be asked for again after a restart.
    pub fn repeat(&self) -> Vec<Answer> {
        let again = |effect: &Effect| Answer::Effect(Effect { repeated: true, ..effect.clone() });
        self.knowledge.outstanding().map(again).collect()
    }

    /// A checksum of the mission before anything has happened, to tell missions apart.
    pub(crate) fn digest(&self) -> String {
        self.digest.clone()
    }

    /// The problem as it is believed now, with what the knowledge base contributes.
    fn filled(&self) -> Problem {
        let mut problem = self.knowledge.mission.problem().clone();
        self.knowledge.mission.fill(&mut problem);
        problem
    }

    /// What is left to be done: the domain, in which the action under way comes first, and the filled problem.
    fn left(&self) -> (Cow<'_, Domain>, Problem) {
        let (domain, mut problem) = (self.knowledge.mission.domain(), self.filled());
        match &self.knowledge.running {
            Some(running) => {
                problem.goal = resumed_goal(&problem.goal);
                (Cow::Owned(resume(domain, &running.step, &running.progress)), problem)
            }
            None => (Cow::Borrowed(domain), problem),
        }
    }

    /// Makes the knowledge anew where its history takes up memory.
    fn forget(&mut self) {
        let Some(base) = self.knowledge.mission.knowledge_mut().filter(|base| base.growth() > GROWTH) else {
            return;
        };
        let statements = base.statements();
        // What was consistent and came to an end does so again.
        let _ = base.restore(&statements);
    }
}

/// Everything that decisions rest on before anything has happened: what is said and follows, the rules, the domain and the
/// problem with its settings, the bindings, how eager the loop is, and the versions of the formats.
fn digest(mission: &Mission, settings: &Settings) -> String {
    let mut problem = mission.problem().clone();
    mission.fill(&mut problem);
    let mut parts = vec![
        env!("CARGO_PKG_VERSION").to_owned(),
        FORMAT.to_owned(),
        mission.name.clone(),
        format!("{settings:?}"),
        format!("{:?}", mission.bindings()),
        pddl::print_domain(mission.domain()),
        pddl::print_problem(&problem),
    ];
    if let Some(knowledge) = mission.knowledge() {
        let engine = knowledge.engine();
        let facts: Vec<rules::Fact> = engine.facts().collect();
        parts.push(ontology::ntriples(engine.symbols(), &facts));
        parts.push(rules::print_rules(engine.program(), engine.symbols(), &rules::Prefixes::default()));
    }
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    let half = hash.finalize().iter().take(16).fold(0_u128, |sum, byte| sum << 8 | u128::from(*byte));
    format!("{half:032x}")
}
