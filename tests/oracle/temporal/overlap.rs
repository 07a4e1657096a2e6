//! Overlapping actions: a plan is executed at its exact times, and the best value of all plans on a grid of times is computed.
//!
//! **The grid is complete** where the separation is the unit u, and durations and times of events are multiples of u. Take any valid plan
//! and round every start down to the grid: t becomes u·floor(t/u). Durations stay, so ends are rounded down likewise.
//! (1) What interferes was at least u apart, and so it is still (floor(x + 1) = floor(x) + 1, and floor is monotonous); happenings that come
//! to one time were less than u apart, so no two of them interfere: they can be executed together, in any order, with the
//! same result, and none of them changes what another one reads. (2) With events likewise: T <= t just if T <= floor(t) for T on the grid, so
//! each happening has the same events before it. (3) The states after the groups of happenings are some of the states of before, and a
//! state that now lies strictly between start and end of an action did so before: over-all conditions hold. (4) The state in the end is the same, and the last end is not later. So rounding
//! makes no plan invalid and none worse, if the metric does not reward time.
//!
//! A node of the search is a state, the running actions with what remains of each, and the time on the grid, which no longer
//! matters after the last event. From one tick to the next any actions start that do not interfere with each other, with what
//! ends, and with the event, also such as are running. The same again at the same tick makes a difference only to what is added to a number or multiplied with it:
//! otherwise both starts, and both ends, have the effects of one.

use std::collections::HashMap;

use super::best::{Schedule, judged};
use super::execute::{goal, value};
use super::graph::{Graph, Way};
use super::happening::{Change, End, Happening, Obstacle, State, World, fit};
use super::model::{Body, Condition, Effect, Operation, Q, q};
use super::reduce::Reduction;
use crate::judge::Truth;

const INTERFERES: Obstacle = Obstacle::Blocked("happenings that interfere are too close");

/// The condition over all of an instance with a duration, with its objects.
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

/// Executes a plan at its times: the value, or why it is none.
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
    let mut done: Vec<(Q, Option<usize>, Happening)> =
        world.events.iter().map(|(time, event)| (*time, None, event.clone())).collect();
    for clock in clocks {
        for (_, event) in world.events.iter().filter(|(time, _)| *time == clock) {
            state = event.apply(&state)?;
        }
        let before = state.clone();
        for (time, number, end) in times.iter().filter(|(time, ..)| *time == clock) {
            let (instance, _, length) = plan[*number];
            if *end != End::Finish && duration(world, instance, &before)? != length {
                return Err(Obstacle::Blocked("the duration is another"));
            }
            let happening = world.happening(instance, *end, &before)?;
            let close = |(at, other, written): &(Q, Option<usize>, Happening)| {
                let apart = if at > time { at - time } else { time - at };
                *other != Some(*number) && apart < separation && written.interferes(&happening)
            };
            if done.iter().any(close) {
                return Err(INTERFERES);
            }
            state = happening.apply(&state)?;
            done.push((*time, Some(*number), happening));
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

/// How often an instance may start at one tick before the oracle gives up.
const COPIES: usize = 3;

/// State, running instances with their remaining ticks, tick.
type Node = (State, Vec<(usize, i64)>, i64);

struct Search<'w> {
    world: &'w World,
    unit: Q,
    reduction: Reduction,
    /// The first tick after all events.
    late: i64,
    numbers: HashMap<Node, usize>,
    nodes: Vec<Node>,
    graph: Graph,
    /// What starts at the tick of an edge, and of a last step.
    starts: Vec<Vec<(usize, i64)>>,
    last_starts: Vec<Vec<(usize, i64)>>,
    open: bool,
}

/// What is true of a task whose times are multiples of the separation, as far as so many nodes show it.
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
    let mut begun = state.clone();
    for (_, event) in world.events.iter().filter(|(time, _)| *time == q(0)) {
        begun = event.apply(&begun).expect("events change atoms");
    }
    let goal = world.holds(&world.task.goal, &begun, &[]) == Ok(true);
    let empty = search.reduction.rest(&begun).ok().filter(|_| goal);
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
    let schedule = |way: &Way| search.scheduled(way);
    judged(world, search.graph.optimum(), empty, search.open, &schedule, &|plan| execute(world, plan, unit))
}

/// What happens at one tick.
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
        let mut at = Tick { happenings: Vec::new(), running: Vec::new(), starts: Vec::new(), ended: false };
        let time = self.unit * q(tick);
        for (_, event) in self.world.events.iter().filter(|(at, _)| *at == time) {
            state = event.apply(&state).expect("events change atoms");
            at.happenings.push(event.clone());
        }
        for (instance, remaining) in running {
            if remaining > 0 {
                at.running.push((instance, remaining));
                continue;
            }
            at.ended = true;
            match self.world.happening(instance, End::Finish, &state) {
                Ok(end) if at.happenings.iter().all(|other| !other.interferes(&end)) => {
                    at.happenings.push(end);
                }
                Err(Obstacle::TooLarge) => return self.open = true,
                _ => return,
            }
        }
        self.choose(from, &state, 0, &at);
    }

    /// Whether a happening changes a number of the state by what it was before.
    fn counts(&self, happening: &Happening) -> bool {
        let relative = |change: &Change| {
            matches!(change, Change::Add(by) if *by != q(0))
                || matches!(change, Change::Scale(by) if *by != q(1))
        };
        happening.changes.iter().any(|(at, change)| relative(change) && self.reduction.keeps(*at))
    }

    /// Whether the end of an instance may change a number of the state by what it was before.
    fn counts_at_end(&self, instance: usize) -> bool {
        fn changed(effects: &[Effect], found: &mut Vec<usize>) {
            for effect in effects {
                match effect {
                    Effect::Change(Operation::Assign, ..) | Effect::Add(_) | Effect::Delete(_) => {}
                    Effect::Change(_, fluent, _) => found.push(fluent.function),
                    Effect::When(_, parts) | Effect::Forall(_, parts) => changed(parts, found),
                }
            }
        }
        let mut found = Vec::new();
        if let Body::Durative { end, .. } = &self.world.task.actions[self.world.instances[instance].0].body {
            changed(&end.effects, &mut found);
        }
        found.iter().any(|function| {
            let after = self.world.values.get(function + 1).copied();
            let after = after.unwrap_or(self.world.initial.values.len());
            (self.world.values[*function]..after).any(|at| self.reduction.keeps(at))
        })
    }

    /// Starts further instances, from a number on.
    fn choose(&mut self, from: usize, state: &State, first: usize, tick: &Tick) {
        for instance in first..self.world.instances.len() {
            let Ok(lasts) = duration(self.world, instance, state) else { continue };
            if lasts < q(0) {
                continue;
            }
            let end = if lasts == q(0) { End::Both } else { End::Start };
            match self.world.happening(instance, end, state) {
                Ok(happening) if tick.happenings.iter().all(|other| !other.interferes(&happening)) => {
                    let mut more = tick.clone();
                    let ticks = (lasts / self.unit).to_integer();
                    more.happenings.push(happening);
                    more.starts.push((instance, ticks));
                    more.ended |= ticks == 0;
                    if ticks > 0 {
                        more.running.push((instance, ticks));
                    }
                    let counts =
                        |it: &Happening| self.counts(it) || ticks > 0 && self.counts_at_end(instance);
                    let again = more.happenings.last().is_some_and(|it| !it.interferes(it) && counts(it));
                    let copies = more.starts.iter().filter(|(other, _)| *other == instance).count();
                    self.open |= again && copies == COPIES;
                    let next = if again && copies < COPIES { instance } else { instance + 1 };
                    self.choose(from, state, next, &more);
                }
                Err(Obstacle::TooLarge) => self.open = true,
                _ => {}
            }
        }
        if self.finish(from, state, tick) == Err(Obstacle::TooLarge) {
            self.open = true;
        }
    }

    /// All that happens at the tick is chosen.
    fn finish(&mut self, from: usize, state: &State, tick: &Tick) -> Result<(), Obstacle> {
        let mut after = state.clone();
        // The event has been applied, and again it makes no difference: nothing interferes with it.
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
            let rest = fit(cost + self.reduction.rest(&after)?)?;
            self.graph.goals.push((from, rest));
            self.last_starts.push(tick.starts.clone());
        }
        let running = tick.running.iter().map(|(instance, remaining)| (*instance, remaining - 1)).collect();
        let number = self.nodes[from].2 + 1;
        let to = self.node((after, running, number));
        if to != from {
            let cost = fit(cost + self.reduction.time * self.unit)?;
            self.graph.edges.push((from, to, cost));
            self.starts.push(tick.starts.clone());
        }
        Ok(())
    }

    fn scheduled(&self, (edges, goal): &Way) -> Schedule {
        let ticks = edges.iter().map(|edge| &self.starts[*edge]).chain([&self.last_starts[*goal]]);
        let mut plan = Vec::new();
        for (tick, starts) in ticks.enumerate() {
            let time = self.unit * q(tick as i64);
            plan.extend(starts.iter().map(|(instance, ticks)| (*instance, time, self.unit * q(*ticks))));
        }
        plan
    }
}
