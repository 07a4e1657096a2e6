//! Converts a mission without declared places to a co-adaptation process. Its places are the states of the
//! ground task, and its configurations are the combinations of designs in the arguments of actions.
//!
//! Missions that declare places and configurations are converted more directly ([`Coadaptation::new`]). For
//! other missions without timed initial literals, the reachable states of the task are enumerated, including
//! numeric values. Actions choose their designs freely, so reconfiguration costs nothing. The time of a move in
//! the process is the increase of the metric by the action.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use num_rational::BigRational;
use num_traits::{One, Zero};
use pddl::ast::{InitialElement, Name, Problem};
use pddl::validate::{PlanStep, advance};
use planner::{Limits, Step, Task, TaskState, Transition};

use crate::comparison::coadaptation::{
    Arc, Coadaptation, Configuration, Facts, Loss, Roles, Switch, Traversal, components, fits,
};
use crate::comparison::process::{Action, Valuation};
use crate::message::{Errors, Message};
use crate::mission::{Mission, Planning as _};

const MAX_STATES: usize = 50_000;

/// A mission as a process whose places are task states, with the mapping from actions of the task to moves of
/// the process.
#[derive(Debug, Clone)]
pub struct Tasked {
    /// Data of the process.
    pub coadaptation: Coadaptation,
    /// For each task state, the previous state on some path from the start, and the action between them. `None` for
    /// the start.
    origins: Vec<Option<(usize, Act)>>,
    /// For each place and each action that is executable there, the number of the arc and the configuration.
    moves: Vec<HashMap<Act, (usize, usize)>>,
}

type Act = (String, Vec<String>);

impl Tasked {
    /// Enumerates the reachable states of a mission's task. `problem` was returned by
    /// [`Mission::filled`].
    ///
    /// # Errors
    /// Constructs that the planner does not support, timed initial literals, too many states or configurations, or
    /// numbers that are too large or out of range.
    pub fn new(mission: &Mission, problem: &Problem, roles: &Roles) -> Result<Self, Errors> {
        let timed = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
        if timed {
            let text = "decision processes do not support timed initial literals";
            return Err(vec![Message::error("M127", text)].into());
        }
        let task = mission.ground(problem, &[], &Limits::none())?;
        let view = mission.knowledge().map(crate::knowledge::Knowledge::view);
        let named = |of: &dyn Fn(&ontology::tomasys::View<'_>) -> Vec<String>| {
            view.as_ref().map(of).unwrap_or_default().into_iter().collect::<BTreeSet<String>>()
        };
        let mut explorer = Explorer {
            facts: Facts::new(problem),
            roles,
            designs: named(&|view| view.function_designs().into_iter().map(|d| d.individual.name).collect()),
            functions: named(&|view| view.functions().into_iter().map(|function| function.name).collect()),
            task: &task,
            places: vec![task.start().unpaid()],
            numbers: HashMap::new(),
            configurations: Vec::new(),
            arcs: BTreeMap::new(),
            origins: vec![None],
            moves: Vec::new(),
        };
        explorer.explore()?;
        let parts = |name: &String| {
            let of = |design: &str| view.as_ref().map(|view| components(view, design)).unwrap_or_default();
            name.split('+').flat_map(of).collect()
        };
        explorer.finish(parts)
    }

    /// Returns the problem that remains in a state of the process: the mission's problem after the actions that lead
    /// to the state's place and, if the component is lost, after its loss.
    ///
    /// # Errors
    /// The mission does not fit its domain after the loss of the component, or an action cannot be executed.
    pub fn problem(&self, mission: &Mission, situation: &Valuation) -> Result<Problem, Errors> {
        let mut way = Vec::new();
        let mut place = situation.place;
        // Predecessor links give the actions in reverse order. The merged goal place of a mission whose goal holds
        // already has no link, because it is no task state.
        while let Some(Some((before, act))) = self.origins.get(place) {
            way.push(act);
            place = *before;
        }
        let (mut current, _) = mission.filled()?;
        let mut changed = mission.clone();
        if let Some(loss) = self.coadaptation.loss.as_ref().filter(|_| situation.lost) {
            changed.fail(&loss.component)?;
        }
        let (mut left, _) = changed.filled()?;
        for (action, arguments) in way.into_iter().rev() {
            let step = PlanStep {
                action: Name::new(action),
                arguments: arguments.iter().map(|name| Name::new(name)).collect(),
                start: None,
                duration: None,
                line: 0,
            };
            let done = advance(mission.domain(), &current, &step, false).map_err(|violation| {
                vec![Message::error(
                    "M128",
                    format!("a step of the process cannot be executed: {}", violation.message),
                )]
            })?;
            done.apply(&mut current.init);
            // The actions were executed before the loss, so they are applied to the changed
            // problem, too.
            done.apply(&mut left.init);
        }
        Ok(left)
    }

    /// Converts the steps of a plan to actions of the process. The plan starts in the state `situation`; steps after
    /// the goal are ignored. Returns `None` if a step before the goal is not an action of the process.
    pub fn actions(&self, situation: &Valuation, steps: &[Step]) -> Option<Vec<Action>> {
        let (mut place, mut configuration) = (situation.place, situation.configuration);
        let mut actions = Vec::new();
        for step in steps {
            if place == self.coadaptation.goal {
                break;
            }
            let (arc, needed) = *self.moves[place].get(&(step.action.clone(), step.arguments.clone()))?;
            // The process has explicit reconfigurations, which the plan does not.
            if needed != configuration {
                actions.push(Action::Change(needed));
                configuration = needed;
            }
            actions.push(Action::Move(arc));
            place = self.coadaptation.arcs[arc].to;
        }
        Some(actions)
    }
}

struct Explorer<'a> {
    facts: Facts,
    roles: &'a Roles,
    designs: BTreeSet<String>,
    functions: BTreeSet<String>,
    task: &'a Task,
    places: Vec<TaskState>,
    numbers: HashMap<TaskState, usize>,
    configurations: Vec<String>,
    arcs: BTreeMap<(usize, usize), BTreeMap<usize, Traversal>>,
    origins: Vec<Option<(usize, Act)>>,
    moves: Vec<HashMap<Act, (usize, usize)>>,
}

impl Explorer<'_> {
    fn explore(&mut self) -> Result<(), Errors> {
        let start = self.places[0].clone();
        self.numbers.insert(start, 0);
        let mut at = 0;
        while at < self.places.len() {
            if self.places.len() > MAX_STATES {
                let text = format!(
                    "the task has more than {MAX_STATES} states, too many for a process of its states"
                );
                return Err(vec![Message::error("M127", text)].into());
            }
            let state = self.places[at].clone();
            self.moves.push(HashMap::new());
            // Goal states have no successors.
            let transitions =
                if self.task.reaches_goal(&state) { Some(Vec::new()) } else { self.task.transitions(&state) };
            let transitions = transitions.ok_or_else(|| {
                vec![Message::error("M127", "the mission cannot be represented as a decision process: a number in its states grows too large")]
            })?;
            for transition in transitions {
                self.transition(at, &state, transition);
            }
            at += 1;
        }
        Ok(())
    }

    fn transition(&mut self, from: usize, state: &TaskState, transition: Transition) {
        let before = self.task.metric(state);
        let after = self.task.metric(&transition.after);
        let time = after.to_rational() - before.to_rational();
        // States that differ only in the metric are merged.
        let target = transition.after.unpaid();
        let to = self.numbers.get(&target).copied().unwrap_or_else(|| {
            self.numbers.insert(target.clone(), self.places.len());
            self.places.push(target);
            self.origins.push(Some((from, (transition.action.clone(), transition.arguments.clone()))));
            self.places.len() - 1
        });
        let (designs, arguments_without_functions): (Vec<&String>, Vec<&String>) =
            transition.arguments.iter().partition(|argument| self.designs.contains(*argument));
        let name = designs.iter().map(|design| design.as_str()).collect::<Vec<_>>().join("+");
        // Actions without designs have a configuration of their own.
        let name = if name.is_empty() { "none".to_owned() } else { name };
        let configuration =
            self.configurations.iter().position(|configuration| *configuration == name).unwrap_or_else(
                || {
                    self.configurations.push(name);
                    self.configurations.len() - 1
                },
            );
        let arguments_without_functions =
            arguments_without_functions.into_iter().filter(|argument| !self.functions.contains(*argument));
        let key: Vec<&String> = arguments_without_functions.chain(designs).collect();
        let value = |role: &str| self.facts.value(role, &key);
        let traversal = Traversal {
            time,
            energy: value(&self.roles.energy).unwrap_or_else(BigRational::zero),
            success: value(&self.roles.success).unwrap_or_else(BigRational::one),
            hit: value(&self.roles.hit).unwrap_or_else(BigRational::zero),
        };
        let by = self.arcs.entry((from, to)).or_default();
        // Of several actions with the same next place and configuration, the fastest is kept, whatever its energy and
        // risks are.
        if by.get(&configuration).is_none_or(|slower| traversal.time < slower.time) {
            by.insert(configuration, traversal);
        }
        self.moves[from].insert((transition.action, transition.arguments), (to, configuration));
    }

    /// Names the places. If exactly one atom holds in each place and the names are unique, a place
    /// is named by the objects of this atom, otherwise by a number.
    fn names(&self) -> Vec<String> {
        let strip = |atom: &str| {
            let inner = atom.trim_matches(['(', ')']);
            inner.split_once(' ').map_or(inner, |(_, arguments)| arguments).replace(' ', "_")
        };
        let name_of = |state: &TaskState| match self.task.holding(state)[..] {
            [atom] => Some(strip(atom)),
            _ => None,
        };
        let single: Option<Vec<String>> = self.places.iter().map(name_of).collect();
        let told_apart = |names: &Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
        single
            .filter(told_apart)
            .unwrap_or_else(|| (0..self.places.len()).map(|number| format!("s{number}")).collect())
    }

    fn finish(mut self, components: impl Fn(&String) -> Vec<String>) -> Result<Tasked, Errors> {
        let goals: Vec<bool> = self.places.iter().map(|place| self.task.reaches_goal(place)).collect();
        // All goal states are merged into the last place.
        let goal = self.places.len();
        let mut names = self.names();
        names.push("goal".to_owned());
        if self.configurations.is_empty() {
            self.configurations.push("none".to_owned());
        }
        let designs = self.configurations.len();
        fits(goal + 1, designs)?;
        let mut merged: BTreeMap<(usize, usize), Vec<Option<Traversal>>> = BTreeMap::new();
        for ((from, to), by) in self.arcs {
            let to = if goals[to] { goal } else { to };
            let row = merged.entry((from, to)).or_insert_with(|| vec![None; designs]);
            for (configuration, traversal) in by {
                let traversal_slot = &mut row[configuration];
                if traversal_slot.as_ref().is_none_or(|slower| traversal.time < slower.time) {
                    *traversal_slot = Some(traversal);
                }
            }
        }
        let numbers: BTreeMap<(usize, usize), usize> = merged.keys().copied().zip(0..).collect();
        let moves = self.moves.into_iter().enumerate().map(|(from, acts)| {
            let arc = |to: usize| numbers[&(from, if goals[to] { goal } else { to })];
            acts.into_iter().map(|(act, (to, configuration))| (act, (arc(to), configuration))).collect()
        });
        let free = |old: usize, new: usize| {
            (old != new).then(|| Switch {
                time: BigRational::zero(),
                energy: BigRational::zero(),
                success: BigRational::one(),
            })
        };
        let loss = self.roles.loss_component.clone().map(|component| Loss {
            component,
            rate: probabilistic::number::from_shortest_decimal(self.roles.loss_rate)
                .unwrap_or_else(BigRational::zero),
        });
        let configurations: Vec<Configuration> = self
            .configurations
            .iter()
            .map(|name| Configuration { name: name.clone(), components: components(name), available: true })
            .collect();
        let coadaptation = Coadaptation {
            start: if goals[0] { goal } else { 0 },
            goal,
            places: names,
            initial: 0,
            configurations,
            arcs: merged.into_iter().map(|((from, to), by)| Arc { from, to, by }).collect(),
            switches: (0..designs).map(|old| (0..designs).map(|new| free(old, new)).collect()).collect(),
            battery: None,
            loss,
        };
        let coadaptation = coadaptation.checked()?;
        Ok(Tasked { coadaptation, origins: self.origins, moves: moves.collect() })
    }
}
