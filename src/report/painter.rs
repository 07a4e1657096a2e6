//! Draws the remaining plan of a running loop as HTML for a part of a page.

use num_rational::BigRational;
use pddl::ast::Condition;
use planner::{Plan, Step};

use crate::mapek::{Outlook, PlannedStep};
use crate::mission::Mission;
use crate::report::plan::drawn;
use crate::report::positions::Positions;
use crate::report::seen::{Designs, Scene, known_designs};

/// Maximum number of steps in a picture. Further steps are only counted.
const MAX_STEPS: usize = 500;

/// Draws remaining plans of a loop. The designs of the mission and the coordinates of places do not
/// change.
#[derive(Debug, Clone)]
pub struct Painter {
    designs: Designs,
    positions: Positions,
}

impl Painter {
    /// Creates the painter for plans of a mission.
    pub fn new(mission: &Mission, positions: Positions) -> Self {
        Self { designs: known_designs(mission), positions }
    }

    /// Returns HTML for the remaining plan, or for its first 500 steps: timeline, curves and map. The page needs the
    /// style sheet [`picture::STYLE`].
    pub fn part(&self, outlook: &Outlook) -> String {
        let later = outlook.steps.len().saturating_sub(MAX_STEPS);
        let mut problem = outlook.problem.clone();
        if later > 0 {
            // A prefix of the plan need not reach the goal.
            problem.goal = Condition::And(Vec::new());
        }
        let scene = Scene {
            domain: &outlook.domain,
            problem: &problem,
            positions: &self.positions,
            designs: &self.designs,
        };
        let mut picture = drawn(scene, &plan(&outlook.steps[..outlook.steps.len() - later]));
        if later > 0 {
            picture.verdict = format!("The next {MAX_STEPS} steps; {later} more follow.");
        }
        picture.part()
    }
}

fn plan(steps: &[PlannedStep]) -> Plan {
    let mut now = BigRational::default();
    let mut timed = |step: &PlannedStep| {
        let start = now.clone();
        now += &step.duration;
        Step {
            action: step.action.clone(),
            arguments: step.arguments.clone(),
            configuration: step.configuration.clone(),
            reconfigured: Vec::new(),
            start: start.into(),
            duration: step.duration.clone().into(),
            cost: step.cost.clone().into(),
        }
    };
    let steps: Vec<Step> = steps.iter().map(&mut timed).collect();
    let cost = steps.iter().map(|step| step.cost.to_rational()).sum::<BigRational>();
    Plan { steps, cost: cost.into() }
}
