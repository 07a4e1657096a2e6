//! FF heuristic with additive costs: the cost of a relaxed plan. Operators of the relaxed plan that are
//! applicable in the state are preferred.
//!
//! Costs of propositions are their h^add values \[1\], computed by Dijkstra's algorithm. The relaxed plan
//! consists of the cheapest supporters, collected backwards from the goal \[2\].
//!
//! - \[1\] B. Bonet, H. Geffner: Planning as heuristic search, Artificial Intelligence 129, 2001.
//! - \[2\] E. Keyder, H. Geffner: Heuristics for planning with action costs revisited, ECAI 2008.

use num_traits::ToPrimitive as _;
use task::task::State;
use task::task::number::TaskNumber;

use crate::satisfice::bucket_queue::Queue;
use crate::satisfice::delete_relaxation::{Gain, NO_OPERATOR, Proposition, Relaxation};

const UNREACHED: u32 = u32::MAX;
const MAX_COST: u32 = 1 << 30;
/// Upper limit on the assumed number of repetitions of an operator until a numeric comparison holds.
const MAX_REPETITIONS: f64 = 10_000.0;

#[derive(Debug, Clone, Copy)]
struct Supporter {
    node: u32,
    times: u32,
}

#[derive(Debug, Clone, Copy)]
struct NodeProgress {
    /// Number of unreached conditions.
    left: u32,
    sum: u32,
}

pub(super) struct FfHeuristic {
    costs: Vec<u32>,
    supporters: Vec<Supporter>,
    progress: Vec<NodeProgress>,
    initial_progress: Vec<NodeProgress>,
    /// Nodes without conditions.
    unconditional: Vec<u32>,
    queue: Queue,
    values: Vec<f64>,
    numbers: Vec<f64>,
    pub(super) applicable: Vec<u32>,
    pub(super) preferred: Vec<u32>,
    /// Operators that the relaxed plan repeats and that may be applicable in the state, with the
    /// number of applications.
    pub(super) repeated: Vec<(u32, u32)>,
    marked: Vec<bool>,
    marks: Vec<Proposition>,
    planned: Vec<u32>,
    in_plan: Vec<bool>,
}

impl FfHeuristic {
    pub(super) fn new<N: TaskNumber>(relaxation: &Relaxation<N>, operators: usize) -> Self {
        let lengths = relaxation.conditions.iter().map(<[Proposition]>::len);
        let initial_progress: Vec<NodeProgress> =
            lengths.map(|length| NodeProgress { left: task::number::dense(length), sum: 0 }).collect();
        let nodes = (0..).zip(&initial_progress);
        let unconditional = nodes.filter(|(_, progress)| progress.left == 0).map(|(node, _)| node).collect();
        Self {
            costs: vec![UNREACHED; relaxation.propositions],
            supporters: vec![Supporter { node: NO_OPERATOR, times: 0 }; relaxation.propositions],
            progress: initial_progress.clone(),
            initial_progress,
            unconditional,
            queue: Queue::default(),
            values: vec![0.0; relaxation.directions.len()],
            numbers: Vec::new(),
            applicable: Vec::new(),
            preferred: Vec::new(),
            repeated: Vec::new(),
            marked: vec![false; relaxation.propositions],
            marks: Vec::new(),
            planned: Vec::new(),
            in_plan: vec![false; operators],
        }
    }

    /// Returns the cost of a relaxed plan that achieves all `targets`, capped at `MAX_COST`; `None`
    /// if there is no relaxed plan. `prices` are the operator costs, each at least 1. Afterwards,
    /// `applicable` contains the operators that may be applicable in the state, and `preferred`
    /// contains some of them that belong to the relaxed plan.
    pub(super) fn estimate<N: TaskNumber>(
        &mut self,
        relaxation: &Relaxation<N>,
        prices: &[u32],
        state: &State<N>,
        targets: &[Proposition],
    ) -> Option<u32> {
        self.preferred.clear();
        self.repeated.clear();
        self.reach(relaxation, prices, state, targets);
        let is_reached = targets.iter().all(|target| self.costs[*target as usize] < UNREACHED);
        is_reached.then(|| self.relaxed_plan(relaxation, prices, targets))
    }

    fn reach<N: TaskNumber>(
        &mut self,
        relaxation: &Relaxation<N>,
        prices: &[u32],
        state: &State<N>,
        targets: &[Proposition],
    ) {
        self.costs.fill(UNREACHED);
        self.progress.copy_from_slice(&self.initial_progress);
        self.queue.clear();
        self.applicable.clear();
        let no_supporter = Supporter { node: NO_OPERATOR, times: 0 };
        for proposition in relaxation.facts(&state.values).chain(relaxation.always.iter().copied()) {
            self.put(proposition, 0, no_supporter);
        }
        self.numbers.clear();
        self.numbers.extend(state.numbers.iter().map(TaskNumber::approximate));
        for (direction, index) in relaxation.directions.iter().zip(0..) {
            let value: Option<N> = direction.value(&state.numbers);
            for (threshold, strict, proposition) in &direction.thresholds {
                // If the value overflows, the comparison is assumed to hold.
                let holds = value
                    .as_ref()
                    .is_none_or(|value| if *strict { value > threshold } else { value >= threshold });
                if holds {
                    self.put(*proposition, 0, no_supporter);
                }
            }
            let index: usize = index;
            self.values[index] = value.map_or(0.0, |value| value.approximate());
        }
        for position in 0..self.unconditional.len() {
            self.reached(relaxation, prices, self.unconditional[position], 0);
        }
        let mut missing = targets;
        while let Some((cost, proposition)) = self.queue.pop() {
            if self.costs[proposition as usize] != cost {
                continue;
            }
            // Propositions of cost 0 are always processed completely, because they determine which operators
            // are applicable.
            if cost > 0 {
                while let [target, rest @ ..] = missing
                    && self.costs[*target as usize] <= cost
                {
                    missing = rest;
                }
                if missing.is_empty() {
                    break;
                }
            }
            for node in relaxation.waiting.of(proposition) {
                let NodeProgress { left, sum } = &mut self.progress[*node as usize];
                *left = left.saturating_sub(1);
                *sum = sum.saturating_add(cost).min(MAX_COST);
                if *left == 0 {
                    let sum = *sum;
                    self.reached(relaxation, prices, *node, sum);
                }
            }
        }
    }

    fn put(&mut self, proposition: Proposition, cost: u32, supporter: Supporter) {
        let current = &mut self.costs[proposition as usize];
        if cost < *current {
            *current = cost;
            self.supporters[proposition as usize] = supporter;
            self.queue.push(cost, proposition);
        }
    }

    /// Processes a node when its last condition is reached: lowers the costs of its effects and of the
    /// numeric comparisons that it can achieve. `sum` is the sum of the costs of its conditions. If the node
    /// is the unconditional part of an operator and all conditions cost 0, the operator is added to
    /// `applicable`.
    fn reached<N: TaskNumber>(&mut self, relaxation: &Relaxation<N>, prices: &[u32], node: u32, sum: u32) {
        let operator = relaxation.operators[node as usize];
        if sum == 0 && relaxation.is_base[node as usize] {
            self.applicable.push(operator);
        }
        let price = prices.get(operator as usize).copied().unwrap_or(0);
        let cost = sum.saturating_add(price).min(MAX_COST);
        for effect in relaxation.effects.of(node) {
            self.put(*effect, cost, Supporter { node, times: 1 });
        }
        if relaxation.directions.is_empty() {
            return;
        }
        for support in &relaxation.supports[node as usize] {
            let direction = &relaxation.directions[support.direction as usize];
            let value = self.values[support.direction as usize];
            let gain = self.gain(&support.gain);
            for (threshold, _, proposition) in &direction.thresholds {
                if self.costs[*proposition as usize] == 0 {
                    continue;
                }
                let times = times(threshold.approximate() - value, gain);
                let cost = sum.saturating_add(price.saturating_mul(times)).min(MAX_COST);
                self.put(*proposition, cost, Supporter { node, times });
            }
        }
    }

    fn gain(&self, gain: &Gain) -> f64 {
        match gain {
            Gain::Constant(gain) => *gain,
            Gain::Linear(constant, terms) => {
                let terms = terms.iter().map(|(variable, factor)| factor * self.numbers[variable.index()]);
                constant + terms.sum::<f64>()
            }
            Gain::Unlimited => f64::INFINITY,
        }
    }

    fn relaxed_plan<N: TaskNumber>(
        &mut self,
        relaxation: &Relaxation<N>,
        prices: &[u32],
        targets: &[Proposition],
    ) -> u32 {
        let mut total: u32 = 0;
        for target in targets {
            if !self.marked[*target as usize] {
                self.marked[*target as usize] = true;
                self.marks.push(*target);
            }
        }
        let mut next = 0;
        while let Some(proposition) = self.marks.get(next).copied() {
            next = next.saturating_add(1);
            let Supporter { node, times } = self.supporters[proposition as usize];
            if node == NO_OPERATOR {
                continue;
            }
            let operator = relaxation.operators[node as usize];
            if operator != NO_OPERATOR {
                // An operator is counted when it is first needed, and again for each further numeric
                // comparison that needs several applications, each time with its number of applications.
                if !self.in_plan[operator as usize] || times > 1 {
                    let price = prices[operator as usize];
                    total = total.saturating_add(price.saturating_mul(times)).min(MAX_COST);
                }
                if !self.in_plan[operator as usize] {
                    self.in_plan[operator as usize] = true;
                    self.planned.push(operator);
                    if self.progress[node as usize].sum == 0 {
                        self.preferred.push(operator);
                    }
                }
                if times > 1 && self.progress[node as usize].sum == 0 {
                    self.repeated.push((operator, times));
                }
            }
            for condition in relaxation.conditions.of(node) {
                if !self.marked[*condition as usize] {
                    self.marked[*condition as usize] = true;
                    self.marks.push(*condition);
                }
            }
        }
        for mark in self.marks.drain(..) {
            self.marked[mark as usize] = false;
        }
        for operator in self.planned.drain(..) {
            self.in_plan[operator as usize] = false;
        }
        total
    }
}

/// Returns the estimated number of applications whose gains add up to at least the missing amount: at least 1
/// and at most `MAX_REPETITIONS`. If the gain is not positive in the evaluated state, it may be positive later, so
/// the maximum is returned.
fn times(missing: f64, gain: f64) -> u32 {
    if gain.is_infinite() {
        return 1;
    }
    if gain <= 0.0 {
        return MAX_REPETITIONS.to_u32().unwrap_or(u32::MAX);
    }
    (missing / gain).ceil().clamp(1.0, MAX_REPETITIONS).to_u32().unwrap_or(1)
}
