//! Compares the plans for a mission with policies of its decision process.

use std::time::Instant;

use pddl::ast::Problem;
use planner::{Limits, Step};

use crate::comparison::coadaptation::{Coadaptation, Roles};
use crate::comparison::compare::{Comparison, Config, Listener, compare};
use crate::comparison::planned::{NoResult, Planned, Stages};
use crate::comparison::process::{Action, Risk, Valuation};
use crate::comparison::task::Tasked;
use crate::message::Errors;
use crate::mission::{Mission, Planning as _};

/// A mission with the data of its decision process.
#[derive(Debug, Clone, Copy)]
pub struct Compared<'m> {
    /// The mission for which plans are computed.
    pub mission: &'m Mission,
    /// PDDL symbols and parameters from which the process is built.
    pub roles: &'m Roles,
    /// Data of the process.
    pub coadaptation: &'m Coadaptation,
    /// The mapping between the task's states and the process, if the problem does not declare
    /// places and configurations.
    pub tasked: Option<&'m Tasked>,
}

impl Compared<'_> {
    /// Compares plans of the planner with policies of model checking in one process.
    ///
    /// # Errors
    /// The process is too large or cannot be solved, or the planner cannot plan.
    pub fn compare(&self, config: &Config<'_>, report: &mut Listener<'_>) -> Result<Comparison, NoResult> {
        let mut planner = |situation: &Valuation| match self.tasked {
            Some(tasked) => solve(
                self.mission,
                |mission| tasked.problem(mission, situation),
                |steps| tasked.actions(situation, steps),
            ),
            None => self.plan(config.risk, *situation),
        };
        compare(self.coadaptation, config, &mut planner, report)
    }

    fn plan(&self, risk: Risk, situation: Valuation) -> Result<Planned, Errors> {
        let Self { roles, coadaptation, .. } = *self;
        let mut mission = self.mission.clone();
        mission.set(&roles.location, &coadaptation.places[situation.place])?;
        let configuration = &coadaptation.configurations[situation.configuration].name;
        mission.set(&roles.configured, configuration)?;
        if let Some(battery) = coadaptation.battery.filter(|_| risk.battery) {
            let energy = u64::from(situation.battery) * u64::from(battery.unit);
            mission.set(&roles.battery, &energy.to_string())?;
        }
        if let Some(loss) = coadaptation.loss.as_ref().filter(|_| situation.lost) {
            mission.fail(&loss.component)?;
        }
        let actions = |steps: &[Step]| {
            Some(steps.iter().filter_map(|step| action(coadaptation, &step.arguments)).collect())
        };
        solve(&mission, |mission| mission.filled().map(|(problem, _)| problem), actions)
    }
}

fn solve(
    mission: &Mission,
    problem: impl FnOnce(&Mission) -> Result<Problem, Errors>,
    actions: impl FnOnce(&[Step]) -> Option<Vec<Action>>,
) -> Result<Planned, Errors> {
    let started = Instant::now();
    let problem = problem(mission)?;
    let task = mission.ground(&problem, &[], &Limits::none())?;
    let ground = started.elapsed();
    let solution = planner::optimize(&task, &planner::Config::default(), &mut |_| {});
    let actions = solution.plan.and_then(|plan| actions(&plan.steps));
    let statistics = &solution.statistics;
    let (build, solve) = (ground + statistics.encode, statistics.search + statistics.solve);
    let extract = started.elapsed().saturating_sub(build + solve);
    Ok(Planned {
        actions,
        variables: statistics.variables as u64,
        clauses: statistics.clauses as u64,
        time: Stages { build, solve, extract },
    })
}

/// Converts the arguments of a step to an action: a move if two arguments are places, otherwise a
/// change to the last argument. `None` if no such arc or design exists.
fn action(mission: &Coadaptation, arguments: &[String]) -> Option<Action> {
    let is_equal = |a: &str, b: &str| a.eq_ignore_ascii_case(b);
    let place = |name: &String| mission.places.iter().position(|place| is_equal(place, name));
    let places: Vec<usize> = arguments.iter().filter_map(place).collect();
    if let [from, to] = places[..] {
        return mission.arcs.iter().position(|arc| (arc.from, arc.to) == (from, to)).map(Action::Move);
    }
    let design = arguments.last()?;
    mission
        .configurations
        .iter()
        .position(|configuration| is_equal(&configuration.name, design))
        .map(Action::Change)
}
