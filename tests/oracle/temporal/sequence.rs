//! Actions one after another: a plan is executed at its exact times, and the best value of all plans is computed.
//!
//! **The search is exact.** Let T1 < T2 < … be the times of the events. At time t all events with T <= t have been applied (an action's
//! happening at T itself is only allowed if it does not interfere with the event, and then their order does not matter). A *node* is
//! a state S, the number k of events applied, and a *clock*: a time v and whether it is meant strictly. It stands for the
//! situations (S, t) with Tk <= t < Tk+1 and t >= v (or t > v). *Claim: those are exactly the times at which S can be had by
//! the node's sequence of actions with its choices of regions (below), waiting included.*
//!
//! Initially the clock is (0, not strict), and k counts the event at 0, if there is one. Waiting for an event is an edge to
//! (S with the event, k + 1, (Tk+1, not strict)), as every situation of the node can wait, and no waiting within [Tk, Tk+1) changes
//! the state. For an action from a node, its start s lies in the same [Tk, Tk+1) (other starts have wait edges before them). The
//! states that the action passes, and whether it can be executed, depend only on (1) whether s = Tk, and (2) in which of
//! the *regions* (Tk, Tk+1), {Tk+1}, (Tk+1, Tk+2), … its end e = s + d lies: these say which happenings coincide with events,
//! and which events lie strictly between. So for each choice the possible s are an interval, the intersection of the clock's up-set, the
//! choice for s, and the region for e minus d. If it is not empty, the times of the end are the interval plus d, and with waiting in the
//! end's region they are the up-set of its infimum, strict if the infimum is not attained: the claim for the next node. By induction the
//! claim holds for all nodes, and all plans are covered, for every plan makes its choices. (`s` and `t` are coupled
//! by t <= s only, and every s in the up-set has such a t.)
//!
//! The goal is asked for when an action ends (and at the beginning), for plans do not end with waiting. Costs of edges may be
//! negative: Bellman-Ford on the nodes from which a goal can be reached; if there is a cycle of negative cost, there is no best value.
//! Numbers that nothing reads and that only increase are costs of edges, not part of the state. Where the nodes end before the cap,
//! the answer is exact; otherwise only what was found counts.
//!
//! Times of a plan: a strict clock v becomes v + i·δ at the i-th action, with δ so small that all of them together stay below every gap.

use std::collections::HashMap;

use super::happening::{End, Obstacle, State, World, fit};
use super::model::{Body, Q, q};
use super::reduce::Reduction;

/// A time, and whether it is meant strictly.
type Clock = (Q, bool);
/// A state, the number of events before it, the clock. After the last event time does not matter.
type Node = (State, usize, Clock);

/// How one node follows another.
#[derive(Debug, Clone)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    /// To be minimised.
    pub cost: Q,
    /// The instance with its duration, infimum of the start, and a gap that δs must stay below. None for waiting.
    pub step: Option<(usize, Q, Clock, Option<Q>)>,
}

/// The graph of a task.
pub struct Search<'w> {
    pub world: &'w World,
    reduction: Reduction,
    pub nodes: Vec<Node>,
    numbers: HashMap<Node, usize>,
    pub edges: Vec<Edge>,
    /// Edges to goals, with the value there to be minimised.
    pub goals: Vec<(usize, Q)>,
    /// The value of the empty plan, to be minimised, if it reaches the goal.
    pub empty: Option<Q>,
    /// Whether something was left out.
    pub open: bool,
}

impl<'w> Search<'w> {
    /// The nodes that are reached, up to a cap.
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
            search.empty = search.reduction.rest(&state).ok().map(|rest| search.sign() * rest);
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

    fn event_time(&self, at: usize) -> Option<Q> {
        self.world.events.get(at).map(|(time, _)| *time)
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

    /// All edges out of a node.
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
            // At the event, and after it.
            let at_event = applied > 0 && applied < self.world.events.len() && !clock.1;
            let event = self.event_time(applied.wrapping_sub(1)).filter(|time| at_event && *time == clock.0);
            let starts = match event {
                Some(time) => vec![((time, false), Some(time)), ((time, true), None)],
                // After the last event, starting just after it is as good as at it.
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

    /// An action that starts from `lower` on, or at `point` only.
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
        let lasts = duration > q(0);
        let first = world.happening(instance, if lasts { End::Start } else { End::Both }, &state)?;
        if point.is_some() && first.interferes(&world.events[applied - 1].1) {
            return Ok(());
        }
        let mut state = first.apply(&state)?;
        // Upper bound of the start, exclusive.
        let next = self.event_time(applied);
        if !lasts {
            let gap = next.map(|next| next - lower.0);
            self.reach((from, instance, duration), (lower, gap), state, applied);
            return Ok(());
        }
        let over_all = over_all.expect("it lasts");
        for ended in applied.. {
            // Ends between the event before and the next one.
            if !world.holds(over_all, &state, objects)? {
                return Ok(());
            }
            let after = if ended > applied { self.event_time(ended - 1) } else { None };
            let before = self.event_time(ended);
            if let Some(found) = start_times(lower, point, next, duration, (after, before)) {
                match world.happening(instance, End::Finish, &state).and_then(|end| end.apply(&state)) {
                    Ok(end) => self.reach((from, instance, duration), found, end, ended),
                    Err(Obstacle::TooLarge) => self.open = true,
                    Err(Obstacle::Blocked(_)) => {}
                }
            }
            let Some((time, event)) = world.events.get(ended) else { return Ok(()) };
            state = event.apply(&state)?;
            // Ends at the next event.
            let at = time - duration;
            let allowed = point.map_or_else(
                || (at > lower.0 || at == lower.0 && !lower.1) && next.is_none_or(|next| at < next),
                |point| at == point,
            );
            if allowed {
                let end = world.happening(instance, End::Finish, &state);
                match end
                    .and_then(|end| if end.interferes(event) { Err(INTERFERES) } else { end.apply(&state) })
                {
                    Ok(end) => self.reach((from, instance, duration), ((at, false), None), end, ended + 1),
                    Err(Obstacle::TooLarge) => self.open = true,
                    Err(Obstacle::Blocked(_)) => {}
                }
            }
        }
        Ok(())
    }

    /// Adds the edge of an action that ends with a state.
    fn reach(
        &mut self,
        (from, instance, duration): (usize, usize, Q),
        (start, gap): (Clock, Option<Q>),
        state: State,
        applied: usize,
    ) {
        let reduced = self.reduction.reduce(state).and_then(|(state, cost)| {
            let cost = fit(cost + self.reduction.time * duration + self.reduction.step)?;
            let rest = self.reduction.rest(&state)?;
            let goal = self.world.holds(&self.world.task.goal, &state, &[]);
            Ok((state, cost * self.sign(), rest * self.sign(), goal?))
        });
        let Ok((state, cost, rest, goal)) = reduced else {
            self.open = true;
            return;
        };
        let slack = start.0 - self.nodes[from].2.0;
        let gap = [gap, Some(slack)].into_iter().flatten().filter(|gap| *gap > q(0)).min();
        let to = self.node((state, applied, (start.0 + duration, start.1)));
        if goal {
            self.goals.push((self.edges.len(), rest));
        }
        self.edges.push(Edge { from, to, cost, step: Some((instance, duration, start, gap)) });
    }
}

const INTERFERES: Obstacle = Obstacle::Blocked("an event at the same time interferes");

/// The infimum of the starts from `lower` on (or at `point`) and before `next` whose ends lie strictly between two events; and the
/// gap above it.
fn start_times(
    lower: Clock,
    point: Option<Q>,
    next: Option<Q>,
    duration: Q,
    (after, before): (Option<Q>, Option<Q>),
) -> Option<(Clock, Option<Q>)> {
    if let Some(point) = point {
        let end = point + duration;
        let inside = after.is_none_or(|after| end > after) && before.is_none_or(|before| end < before);
        return inside.then_some(((point, false), None));
    }
    let bound = after.map(|after| after - duration).filter(|bound| *bound >= lower.0);
    let infimum = bound.map_or(lower, |bound| (bound, true));
    let upper = [next, before.map(|before| before - duration)].into_iter().flatten().min();
    let gap = upper.map(|upper| upper - infimum.0);
    gap.is_none_or(|gap| gap > q(0)).then_some((infimum, gap))
}
