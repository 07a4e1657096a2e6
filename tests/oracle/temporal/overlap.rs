//! Concurrent plans: execution at exact times, and the best value of all plans with start times on a grid.
//!
//! **The grid is complete** if the separation is the unit u, and durations and times of events are multiples of u. Proof: take any valid
//! plan and round each start time t down to the grid, u·floor(t/u). Durations do not change, so ends are rounded down in the same way.
//! (1) Interfering happenings were at least u apart and still are, as floor(x + 1) = floor(x) + 1 and floor is monotonic. Happenings that
//! now coincide were less than u apart, so they do not interfere: no happening changes a fact or number that another one reads, and they
//! can be executed together, in any order, with the same result. (2) For events at T on the grid, T <= t if and only if T <= floor(t). So
//! the same events precede each happening. (3) Each state after a group of coinciding happenings also occurred in the original plan, and
//! a state that is now strictly between start and end of an action was so before. So over-all conditions hold. (4) The final state is the
//! same and the last end is not later. So the rounded plan is valid, and not worse if the metric does not reward time.
//!
//! A node of the search consists of a state, the running actions with their remaining durations, and the time on the grid (capped after
//! the last event, as it is irrelevant from there on). At each tick any set of actions can start that do not interfere with each other,
//! with ending actions and with the event. Several runs of one action can overlap. Several starts of one action at one tick
//! matter only if it increases or scales a number: otherwise the starts together, and the ends together, have the effects of one.

use std::collections::HashMap;

use super::best::{Schedule, judged};
use super::execute::{goal, value};
use super::graph::{Graph, Path};
use super::happening::{Change, End, Happening, Obstacle, State, World, fit};
use super::model::{Body, Condition, Effect, Operation, Q, q};
use super::reduce::Reduction;
use crate::judge::Truth;

const INTERFERES: Obstacle = Obstacle::Blocked("happenings that interfere are too close");

fn over_all(world: &World, instance: usize) -> Option<(&Condition, &[usize])> {
    let (action, objects) = &world.instances[instance];
    match &world.task.actions[*action].body {
        Body::Durative { over_all, .. } => Some((over_all, objects)),
        Body::Instantaneous(_) => None,
    }
}

fn duration(world: &World, instance: usize, state: &State) -> Result<Q, Obstacle> {
    let (action, objects) = &world.instances[instance];
    match &world.task.actions[*action].body {
        Body::Durative { duration, .. } => world.value(duration, state, objects),
        Body::Instantaneous(_) => Ok(q(0)),
    }
}

pub fn execute(world: &World, plan: &[(usize, Q, Q)], separation: Q) -> Result<Q, Obstacle> {
    let mut times: Vec<(Q, usize, End)> = Vec::new();
    for (number, (_, start, length)) in plan.iter().enumerate() {
        if *start < q(0) {
            return Err(Obstacle::Blocked("an action starts before 0"));
        }
        if *length == q(0) {
            times.push((*start, number, End::Both));
        } else {
            times.push((*start, number, End::Start));
            times.push((*start + length, number, End::Finish));
        }
    }
    let last = times.iter().map(|(time, ..)| *time).max().unwrap_or(q(0));
    let events = world.events.iter().map(|(time, _)| *time).filter(|time| *time <= last);
    let mut clocks: Vec<Q> = times.iter().map(|(time, ..)| *time).chain(events).collect();
    clocks.sort_unstable();
    clocks.dedup();
    let mut state = world.initial.clone();
    let mut happened: Vec<(Q, Option<usize>, Happening)> =
        world.events.iter().map(|(time, event)| (*time, None, event.clone())).collect();
    for clock in clocks {
        for (_, event) in world.events.iter().filter(|(time, _)| *time == clock) {
            state = event.apply(&state)?;
        }
        // All happenings of one time are evaluated in the state after the events of this time.
        let before = state.clone();
        for (time, number, end) in times.iter().filter(|(time, ..)| *time == clock) {
            let (instance, _, length) = plan[*number];
            if *end != End::Finish && duration(world, instance, &before)? != length {
                return Err(Obstacle::Blocked("the duration is another"));
            }
            let happening = world.happening(instance, *end, &before)?;
            let is_too_close =
                |(other_time, other_number, other_happening): &(Q, Option<usize>, Happening)| {
                    let distance = if other_time > time { other_time - time } else { time - other_time };
                    *other_number != Some(*number)
                        && distance < separation
                        && other_happening.interferes(&happening)
                };
            if happened.iter().any(is_too_close) {
                return Err(INTERFERES);
            }
            state = happening.apply(&state)?;
            happened.push((*time, Some(*number), happening));
        }
        for (instance, start, length) in
            plan.iter().filter(|(_, start, length)| *start <= clock && clock < start + length)
        {
            let (condition, objects) = over_all(world, *instance).expect("it lasts");
            debug_assert!(*start + length > clock, "it runs");
            if !world.holds(condition, &state, objects)? {
                return Err(Obstacle::Blocked("a condition over all does not hold"));
            }
        }
    }
    goal(world, &state)?;
    value(world, &state, last, plan.len())
}

/// Maximum number of starts of one instance at one tick. If a plan could need more, the answer is open.
const MAX_COPIES: usize = 3;

/// Node of the search: state, running instances with their remaining ticks, and current tick.
type Node = (State, Vec<(usize, i64)>, i64);

struct Search<'w> {
    world: &'w World,
    unit: Q,
    reduction: Reduction,
    /// The first tick after all events. Later ticks are equivalent to it.
    late: i64,
    numbers: HashMap<Node, usize>,
    nodes: Vec<Node>,
    graph: Graph,
    /// For each edge, the instances that start at its tick, with their durations in ticks.
    starts: Vec<Vec<(usize, i64)>>,
    /// For each final step, the instances that start at its tick, with their durations in ticks.
    last_starts: Vec<Vec<(usize, i64)>>,
    /// Whether the graph is incomplete.
    open: bool,
}

/// Returns the correct answer for a task whose times are multiples of `unit`, which is also the separation.
/// If the search would exceed `cap` nodes, the answer is open, or that there is no best value.
pub fn best(world: &World, unit: Q, cap: usize) -> Truth {
    let reduction = Reduction::new(world);
    let late = world.events.last().map_or(0, |(time, _)| (time / unit).to_integer() + 1);
    let mut search = Search {
        world,
        unit,
        reduction,
        late,
        numbers: HashMap::new(),
        nodes: Vec::new(),
        graph: Graph::default(),
        starts: Vec::new(),
        last_starts: Vec::new(),
        open: false,
    };
    let (state, _) =
        search.reduction.reduce(world.initial.clone()).expect("the generator's numbers are small");
    let mut after_events = state.clone();
    for (_, event) in world.events.iter().filter(|(time, _)| *time == q(0)) {
        after_events = event.apply(&after_events).expect("events change atoms");
    }
    let goal_holds = world.holds(&world.task.goal, &after_events, &[]) == Ok(true);
    let empty = search.reduction.remaining_metric(&after_events).ok().filter(|_| goal_holds);
    search.node((state, Vec::new(), 0));
    let mut next = 0;
    while next < search.nodes.len() {
        if search.nodes.len() > cap {
            search.open = true;
            break;
        }
        search.expand(next);
        next += 1;
    }
    search.graph.nodes = search.nodes.len();
    let schedule = |path: &Path| search.scheduled(path);
    judged(world, search.graph.optimum(), empty, search.open, &schedule, &|plan| execute(world, plan, unit))
}

#[derive(Clone)]
struct Tick {
    happenings: Vec<Happening>,
    running: Vec<(usize, i64)>,
    starts: Vec<(usize, i64)>,
    ended: bool,
}

impl Search<'_> {
    fn node(&mut self, (state, mut running, tick): Node) -> usize {
        running.sort_unstable();
        let node = (state, running, tick.min(self.late));
        if let Some(number) = self.numbers.get(&node) {
            return *number;
        }
        self.nodes.push(node.clone());
        self.numbers.insert(node, self.nodes.len() - 1);
        self.nodes.len() - 1
    }

    fn expand(&mut self, from: usize) {
        let (mut state, running, tick) = self.nodes[from].clone();
        let mut current =
            Tick { happenings: Vec::new(), running: Vec::new(), starts: Vec::new(), ended: false };
        let time = self.unit * q(tick);
        for (_, event) in self.world.events.iter().filter(|(current, _)| *current == time) {
            state = event.apply(&state).expect("events change atoms");
            current.happenings.push(event.clone());
        }
        for (instance, remaining) in running {
            if remaining > 0 {
                current.running.push((instance, remaining));
                continue;
            }
            // If an action cannot end, the node is a dead end.
            current.ended = true;
            match self.world.happening(instance, End::Finish, &state) {
                Ok(end) if current.happenings.iter().all(|happening| !happening.interferes(&end)) => {
                    current.happenings.push(end);
                }
                Err(Obstacle::TooLarge) => return self.open = true,
                _ => return,
            }
        }
        self.choose(from, &state, 0, &current);
    }

    /// Returns `true` if a happening increases or scales a relevant number, so that its repetition makes a
    /// difference.
    fn is_cumulative(&self, happening: &Happening) -> bool {
        let relative = |change: &Change| {
            matches!(change, Change::Add(by) if *by != q(0))
                || matches!(change, Change::Scale(by) if *by != q(1))
        };
        happening.changes.iter().any(|(at, change)| relative(change) && self.reduction.keeps(*at))
    }

    fn has_cumulative_end(&self, instance: usize) -> bool {
        fn collect_relative(effects: &[Effect], functions: &mut Vec<usize>) {
            for effect in effects {
                match effect {
                    Effect::Change(Operation::Assign, ..) | Effect::Add(_) | Effect::Delete(_) => {}
                    Effect::Change(_, fluent, _) => functions.push(fluent.function),
                    Effect::When(_, parts) | Effect::Forall(_, parts) => collect_relative(parts, functions),
                }
            }
        }
        let mut functions = Vec::new();
        if let Body::Durative { end, .. } = &self.world.task.actions[self.world.instances[instance].0].body {
            collect_relative(&end.effects, &mut functions);
        }
        functions.iter().any(|function| {
            let next_offset = self.world.values.get(function + 1).copied();
            let next_offset = next_offset.unwrap_or(self.world.initial.values.len());
            (self.world.values[*function]..next_offset).any(|at| self.reduction.keeps(at))
        })
    }

    /// Starts further instances, with numbers from `first` on, in all combinations.
    fn choose(&mut self, from: usize, state: &State, first: usize, tick: &Tick) {
        for instance in first..self.world.instances.len() {
            let Ok(length) = duration(self.world, instance, state) else { continue };
            if length < q(0) {
                continue;
            }
            let end = if length == q(0) { End::Both } else { End::Start };
            match self.world.happening(instance, end, state) {
                Ok(happening) if tick.happenings.iter().all(|earlier| !earlier.interferes(&happening)) => {
                    let mut extended = tick.clone();
                    let ticks = (length / self.unit).to_integer();
                    extended.happenings.push(happening);
                    extended.starts.push((instance, ticks));
                    extended.ended |= ticks == 0;
                    if ticks > 0 {
                        extended.running.push((instance, ticks));
                    }
                    let makes_difference = |happening: &Happening| {
                        self.is_cumulative(happening) || ticks > 0 && self.has_cumulative_end(instance)
                    };
                    let is_repeatable = extended.happenings.last().is_some_and(|happening| {
                        !happening.interferes(happening) && makes_difference(happening)
                    });
                    let copies = extended.starts.iter().filter(|(started, _)| *started == instance).count();
                    self.open |= is_repeatable && copies == MAX_COPIES;
                    let next = if is_repeatable && copies < MAX_COPIES { instance } else { instance + 1 };
                    self.choose(from, state, next, &extended);
                }
                Err(Obstacle::TooLarge) => self.open = true,
                _ => {}
            }
        }
        if self.finish(from, state, tick) == Err(Obstacle::TooLarge) {
            self.open = true;
        }
    }

    fn finish(&mut self, from: usize, state: &State, tick: &Tick) -> Result<(), Obstacle> {
        let mut after = state.clone();
        // The events have been applied already. Applying them again is harmless, because nothing at this tick
        // interferes with them.
        for happening in &tick.happenings {
            after = happening.apply(&after)?;
        }
        for (instance, _) in &tick.running {
            let (condition, objects) = over_all(self.world, *instance).expect("it lasts");
            if !self.world.holds(condition, &after, objects)? {
                return Ok(());
            }
        }
        let (after, cost) = self.reduction.reduce(after)?;
        if tick.ended && tick.running.is_empty() && self.world.holds(&self.world.task.goal, &after, &[])? {
            let final_cost = fit(cost + self.reduction.remaining_metric(&after)?)?;
            self.graph.goals.push((from, final_cost));
            self.last_starts.push(tick.starts.clone());
        }
        let running = tick.running.iter().map(|(instance, remaining)| (*instance, remaining - 1)).collect();
        let number = self.nodes[from].2 + 1;
        let target = self.node((after, running, number));
        let cost = fit(cost + self.reduction.time * self.unit)?;
        // After all events, a tick that changes nothing leads back to its node. Such an edge matters only if
        // each repetition improves the value.
        if target != from || cost < Q::from_integer(0) {
            self.graph.edges.push((from, target, cost));
            self.starts.push(tick.starts.clone());
        }
        Ok(())
    }

    fn scheduled(&self, (edges, goal): &Path) -> Schedule {
        let ticks = edges.iter().map(|edge| &self.starts[*edge]).chain([&self.last_starts[*goal]]);
        let mut plan = Vec::new();
        for (tick, starts) in ticks.enumerate() {
            let time = self.unit * q(tick as i64);
            plan.extend(starts.iter().map(|(instance, ticks)| (*instance, time, self.unit * q(*ticks))));
        }
        plan
    }
}
