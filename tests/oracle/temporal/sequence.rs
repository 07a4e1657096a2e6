//! Sequential plans: the graph of all plans, for the best value and for exact times.
//!
//! **The search is exact.** Let T1 < T2 < … be the times of the events. At time t all events with T <= t have been applied. (A happening
//! of an action at T itself is allowed only if it does not interfere with the event, and then their order does not matter.) A *node*
//! consists of a state S, the number k of applied events, and a *clock*: a time v, and whether the bound is strict. It represents the
//! situations (S, t) with Tk <= t < Tk+1 and t >= v (strict: t > v). *Claim: these are exactly the times at which S can hold after the
//! node's sequence of actions, with its choices of regions (below), including waiting.*
//!
//! Initially the clock is (0, not strict), and k counts the event at 0, if any. Waiting for an event is an edge to (S with the event,
//! k + 1, (Tk+1, not strict)), as every situation of the node can wait, and waiting within [Tk, Tk+1) does not change the state. For an
//! action that is applied in a node, the start s lies in the same [Tk, Tk+1), as other starts follow a waiting edge. The states during
//! the action, and whether it is executable, depend only on (1) whether s = Tk, and (2) in which of the *regions* (Tk, Tk+1), {Tk+1},
//! (Tk+1, Tk+2), … the end e = s + d lies. They determine the happenings that coincide with events, and the events strictly between
//! start and end. So for each choice the possible s are an interval: the intersection of the clock's up-set, the choice for s, and the
//! region for e minus d. If it is not empty, the times of the end are the interval plus d. With waiting in the region of the end, they
//! are the up-set of its infimum, strict if the infimum is not attained. This is the claim for the next node. By induction the claim
//! holds for all nodes. All plans are covered, because every plan makes its choices. (`s` and `t` are coupled by t <= s only, and each s
//! in the up-set has such a t.)
//!
//! The goal is tested at the ends of actions (and initially), as plans do not end with waiting. Costs of edges may be negative, so the
//! shortest path is computed by Bellman-Ford on the nodes from which a goal is reachable. A cycle of negative cost among them means that
//! there is no best value. Numbers that nothing reads and that only increase or decrease are costs of edges, not part of the state. If
//! the nodes are exhausted before the cap, the answer is exact. Otherwise it is only the value of the best plan in the partial graph.
//!
//! Times of a plan: a strict clock v becomes v + i·δ at the i-th action, with δ so small that the sum of all delays is below every gap.

use std::collections::HashMap;

use super::happening::{End, Obstacle, State, World, fit};
use super::model::{Body, Q, q};
use super::reduce::Reduction;

/// Lower bound of a time. The flag is `true` if the bound is strict.
type Clock = (Q, bool);
/// Node of the search: state, number of applied events, and clock. After the last event the clock is
/// irrelevant and set to 0.
type Node = (State, usize, Clock);

#[derive(Debug, Clone)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    /// Cost of the edge; negated if the metric is maximised.
    pub cost: Q,
    /// Instance, duration, infimum of the start, and an upper limit of the total delay. `None` for waiting.
    pub step: Option<(usize, Q, Clock, Option<Q>)>,
}

pub struct Search<'w> {
    pub world: &'w World,
    reduction: Reduction,
    pub nodes: Vec<Node>,
    numbers: HashMap<Node, usize>,
    pub edges: Vec<Edge>,
    /// Edges that reach a goal, each with the final cost.
    pub goals: Vec<(usize, Q)>,
    /// Final cost of the empty plan, if the initial state satisfies the goal.
    pub empty: Option<Q>,
    /// Whether the graph is incomplete.
    pub open: bool,
}

impl<'w> Search<'w> {
    /// Builds the graph. Stops expanding nodes when there are more than `cap` nodes.
    pub fn new(world: &'w World, cap: usize) -> Self {
        let reduction = Reduction::new(world);
        let mut search = Self {
            world,
            reduction,
            nodes: Vec::new(),
            numbers: HashMap::new(),
            edges: Vec::new(),
            goals: Vec::new(),
            empty: None,
            open: false,
        };
        let mut state = world.initial.clone();
        let mut applied = 0;
        if let Some((_, event)) = world.events.first().filter(|(time, _)| *time == q(0)) {
            state = event.apply(&state).expect("events change atoms");
            applied = 1;
        }
        let (state, _) = search.reduction.reduce(state).expect("the generator's numbers are small");
        if world.holds(&world.task.goal, &state, &[]) == Ok(true) {
            search.empty =
                search.reduction.remaining_metric(&state).ok().map(|final_cost| search.sign() * final_cost);
        }
        search.node((state, applied, (q(0), false)));
        let mut next = 0;
        while next < search.nodes.len() {
            if search.nodes.len() > cap {
                search.open = true;
                break;
            }
            search.expand(next);
            next += 1;
        }
        search
    }

    fn sign(&self) -> Q {
        if self.reduction.maximize { q(-1) } else { q(1) }
    }

    fn event_time(&self, number: usize) -> Option<Q> {
        self.world.events.get(number).map(|(time, _)| *time)
    }

    fn node(&mut self, node: Node) -> usize {
        let node = if node.1 == self.world.events.len() { (node.0, node.1, (q(0), false)) } else { node };
        if let Some(number) = self.numbers.get(&node) {
            return *number;
        }
        self.nodes.push(node.clone());
        self.numbers.insert(node, self.nodes.len() - 1);
        self.nodes.len() - 1
    }

    fn expand(&mut self, from: usize) {
        let (state, applied, clock) = self.nodes[from].clone();
        if let Some((time, event)) = self.world.events.get(applied) {
            match event.apply(&state) {
                Ok(after) => {
                    let to = self.node((after, applied + 1, (*time, false)));
                    self.edges.push(Edge { from, to, cost: q(0), step: None });
                }
                Err(_) => self.open = true,
            }
        }
        for instance in 0..self.world.instances.len() {
            // A start at the event itself and a later start are separate choices.
            let at_event = applied > 0 && applied < self.world.events.len() && !clock.1;
            let event = self.event_time(applied.wrapping_sub(1)).filter(|time| at_event && *time == clock.0);
            let starts = match event {
                Some(time) => vec![((time, false), Some(time)), ((time, true), None)],
                // After the last event, a start just after the event is as good as a start at it, and cannot
                // interfere with it.
                None if applied > 0 && applied == self.world.events.len() => vec![((q(0), true), None)],
                None => vec![(clock, None)],
            };
            for (lower, point) in starts {
                if self.action(from, instance, lower, point) == Err(Obstacle::TooLarge) {
                    self.open = true;
                }
            }
        }
    }

    /// Adds the edges of an action that starts at or after `lower`, or exactly at `point` if it is given.
    fn action(
        &mut self,
        from: usize,
        instance: usize,
        lower: Clock,
        point: Option<Q>,
    ) -> Result<(), Obstacle> {
        let (state, applied, _) = self.nodes[from].clone();
        let world = self.world;
        let (action, objects) = &world.instances[instance];
        let (duration, over_all) = match &world.task.actions[*action].body {
            Body::Instantaneous(_) => (q(0), None),
            Body::Durative { duration, over_all, .. } => {
                (world.value(duration, &state, objects)?, Some(over_all))
            }
        };
        if duration < q(0) {
            return Ok(());
        }
        let is_durative = duration > q(0);
        let start_happening =
            world.happening(instance, if is_durative { End::Start } else { End::Both }, &state)?;
        if point.is_some() && start_happening.interferes(&world.events[applied - 1].1) {
            return Ok(());
        }
        let mut state = start_happening.apply(&state)?;
        // The next event is the exclusive upper bound of the start.
        let next = self.event_time(applied);
        if !is_durative {
            let gap = next.map(|next| next - lower.0);
            self.reach((from, instance, duration), (lower, gap), state, applied);
            return Ok(());
        }
        let over_all = over_all.expect("it lasts");
        for event_count in applied.. {
            // Case 1: the end lies strictly between two events.
            if !world.holds(over_all, &state, objects)? {
                return Ok(());
            }
            let after = if event_count > applied { self.event_time(event_count - 1) } else { None };
            let before = self.event_time(event_count);
            if let Some(start_bound) = start_times(lower, point, next, duration, (after, before)) {
                match world.happening(instance, End::Finish, &state).and_then(|end| end.apply(&state)) {
                    Ok(end) => self.reach((from, instance, duration), start_bound, end, event_count),
                    Err(Obstacle::TooLarge) => self.open = true,
                    Err(Obstacle::Blocked(_)) => {}
                }
            }
            let Some((time, event)) = world.events.get(event_count) else { return Ok(()) };
            state = event.apply(&state)?;
            // Case 2: the end coincides with the next event.
            let start = time - duration;
            let allowed = point.map_or_else(
                || (start > lower.0 || start == lower.0 && !lower.1) && next.is_none_or(|next| start < next),
                |point| start == point,
            );
            if allowed {
                let end = world.happening(instance, End::Finish, &state);
                match end
                    .and_then(|end| if end.interferes(event) { Err(INTERFERES) } else { end.apply(&state) })
                {
                    Ok(end) => {
                        self.reach((from, instance, duration), ((start, false), None), end, event_count + 1);
                    }
                    Err(Obstacle::TooLarge) => self.open = true,
                    Err(Obstacle::Blocked(_)) => {}
                }
            }
        }
        Ok(())
    }

    fn reach(
        &mut self,
        (from, instance, duration): (usize, usize, Q),
        (start, gap): (Clock, Option<Q>),
        state: State,
        applied: usize,
    ) {
        let reduced = self.reduction.reduce(state).and_then(|(state, cost)| {
            let cost = fit(cost + self.reduction.time * duration + self.reduction.step)?;
            let final_cost = self.reduction.remaining_metric(&state)?;
            let goal_holds = self.world.holds(&self.world.task.goal, &state, &[]);
            Ok((state, cost * self.sign(), final_cost * self.sign(), goal_holds?))
        });
        let Ok((state, cost, final_cost, goal_holds)) = reduced else {
            self.open = true;
            return;
        };
        let slack = start.0 - self.nodes[from].2.0;
        let gap = [gap, Some(slack)].into_iter().flatten().filter(|gap| *gap > q(0)).min();
        let to = self.node((state, applied, (start.0 + duration, start.1)));
        if goal_holds {
            self.goals.push((self.edges.len(), final_cost));
        }
        self.edges.push(Edge { from, to, cost, step: Some((instance, duration, start, gap)) });
    }
}

const INTERFERES: Obstacle = Obstacle::Blocked("an event at the same time interferes");

/// Returns the infimum of the starts whose ends lie strictly between two events, with the size of the
/// interval. The starts are at or after `lower` (or exactly at `point`) and before `next`. `None` if there is
/// no such start.
fn start_times(
    lower: Clock,
    point: Option<Q>,
    next: Option<Q>,
    duration: Q,
    (after, before): (Option<Q>, Option<Q>),
) -> Option<(Clock, Option<Q>)> {
    if let Some(point) = point {
        let end = point + duration;
        let is_inside = after.is_none_or(|after| end > after) && before.is_none_or(|before| end < before);
        return is_inside.then_some(((point, false), None));
    }
    let bound = after.map(|after| after - duration).filter(|bound| *bound >= lower.0);
    let infimum = bound.map_or(lower, |bound| (bound, true));
    let upper = [next, before.map(|before| before - duration)].into_iter().flatten().min();
    let gap = upper.map(|upper| upper - infimum.0);
    gap.is_none_or(|gap| gap > q(0)).then_some((infimum, gap))
}
