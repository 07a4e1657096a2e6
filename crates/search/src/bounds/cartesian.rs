//! Cartesian abstraction refinement \[1\]: abstractions whose states are products of value sets, refined until
//! no split removes a flaw of the abstract plan, or a limit is reached.
//!
//! The abstraction starts with a single state. In each round, a cheapest abstract plan is executed in the task.
//! The first flaw is a violated precondition, a state outside the abstract state of the plan, or a missed goal.
//! The abstract state before the flaw is split to remove the flaw. A binary tree records the
//! splits, and maps states to abstract states.
//!
//! Numeric conditions, clauses, and facts of derived variables are ignored. If an abstract state does not
//! determine whether a conditional effect occurs, both outcomes are transitions. The abstraction therefore
//! admits every plan of the task.
//!
//! Goal facts and fact landmarks are subtasks, each with an abstraction of its own. A fact landmark is a fact
//! without which the goal is unreachable in the delete relaxation. A landmark is required only while it was not
//! yet achieved. Therefore, the facts that are unreachable without the landmark count as goals of its subtask.
//!
//! \[1\] J. Seipp, M. Helmert: Counterexample-guided Cartesian abstraction refinement for classical planning,
//! JAIR 62, 2018.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use task::context::Context;
use task::limits::{Interrupted, LimitPoll};
use task::number::dense;
use task::task::{Fact, Literal, Operator, Task, VariableId};

use crate::bounds::abstraction::{Abstraction, Split, SplitNode, SplitTree, StateMap, UNREACHABLE};

/// Work units for each visited transition or operator.
const WORK_PER_VISIT: u64 = 8;
/// Upper limit on the memory for the value sets of the abstract states of one abstraction, in bytes.
const MAX_SET_BYTES: usize = 1 << 26;

pub(super) struct Subtask {
    /// A state in which all these facts hold is a goal state.
    pub(super) goals: Vec<Fact>,
    /// A state in which one of these facts holds is a goal state, too.
    pub(super) unreachable: Vec<Fact>,
}

#[derive(Clone, Copy)]
pub(super) struct RefinementLimits {
    pub(super) transitions: usize,
    pub(super) work: u64,
}

struct ValueSetField {
    start: usize,
    /// Number of words; 1 if the variable shares its word with other variables.
    words: usize,
    shift: u32,
    mask: u64,
    size: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
struct Edge {
    state: u32,
    operator: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Truth {
    True,
    False,
    Unknown,
}

/// A split of an abstract state: the states in which `variable` has one of `values`, and all other states.
struct Flaw {
    state: u32,
    variable: usize,
    values: Vec<u32>,
}

struct Refinement<'a> {
    task: &'a Task,
    costs: &'a [u32],
    by_effect: &'a [Vec<u32>],
    subtask: &'a Subtask,
    fields: Vec<ValueSetField>,
    width: usize,
    /// Value sets: `width` words for each abstract state.
    sets: Vec<u64>,
    outgoing: Vec<Vec<Edge>>,
    incoming: Vec<Vec<Edge>>,
    transitions: usize,
    tree: Vec<SplitNode>,
    leaves: Vec<u32>,
    initial: u32,
    /// Lower bounds on the goal distances of abstract states.
    to_go: Vec<u32>,
    work: u64,
}

pub(super) fn operators_by_effect(task: &Task) -> Vec<Vec<u32>> {
    let mut by_effect = vec![Vec::new(); task.basic];
    for (operator, index) in task.operators.iter().zip(0..) {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        for fact in operator.effects.iter().chain(conditional) {
            let operators: &mut Vec<u32> = &mut by_effect[fact.variable.index()];
            if operators.last() != Some(&index) {
                operators.push(index);
            }
        }
    }
    by_effect
}

/// Returns the abstraction of a subtask, and the work units for its refinement. `by_effect` is the result of
/// [`operators_by_effect`].
pub(super) fn cartesian_abstraction(
    context: Context<'_>,
    costs: &[u32],
    by_effect: &[Vec<u32>],
    subtask: &Subtask,
    limits: RefinementLimits,
) -> Result<(Abstraction, u64), Interrupted> {
    let mut refinement = Refinement::new(context.task, costs, by_effect, subtask);
    refinement.refine(limits, &mut context.limits.pulse())?;
    let work = refinement.work;
    Ok((refinement.finish(), work))
}

fn value_of(facts: &[Fact], variable: usize) -> Option<u32> {
    facts.iter().find(|fact| fact.variable.index() == variable).map(|fact| fact.value)
}

#[expect(
    clippy::arithmetic_side_effects,
    reason = "counts and positions of what is in memory, and costs below `MAX_DISTANCE`"
)]
impl<'a> Refinement<'a> {
    fn new(task: &'a Task, costs: &'a [u32], by_effect: &'a [Vec<u32>], subtask: &'a Subtask) -> Self {
        let (fields, width) = fields(task);
        let mut sets = vec![0; width];
        for field in &fields {
            for value in 0..field.size {
                let (word, bit) = field.bit(value);
                sets[word] |= bit;
            }
        }
        Self {
            task,
            costs,
            by_effect,
            subtask,
            fields,
            width,
            sets,
            outgoing: vec![Vec::new()],
            incoming: vec![Vec::new()],
            transitions: 0,
            tree: vec![SplitNode::Leaf(0)],
            leaves: vec![0],
            initial: 0,
            to_go: vec![0],
            work: 0,
        }
    }

    fn refine(&mut self, limits: RefinementLimits, pulse: &mut LimitPoll<'_>) -> Result<(), Interrupted> {
        self.separate_unreachable(limits, pulse)?;
        while self.is_within(limits) {
            let Some(plan) = self.abstract_plan(pulse)? else { break };
            let Some(flaw) = self.flaw(&plan) else { break };
            self.split(&flaw);
        }
        Ok(())
    }

    fn is_within(&self, limits: RefinementLimits) -> bool {
        self.transitions < limits.transitions
            && self.work < limits.work
            && self.sets.len().saturating_mul(size_of::<u64>()) < MAX_SET_BYTES
    }

    fn finish(self) -> Abstraction {
        let states = dense(self.leaves.len());
        let goals = (0..states).filter(|state| self.is_goal(*state)).collect();
        let sources = (0..states).zip(&self.outgoing);
        let transitions = sources
            .flat_map(|(source, edges)| edges.iter().map(move |edge| (source, edge.operator, edge.state)))
            .collect();
        Abstraction::new(StateMap::Tree(SplitTree(self.tree)), self.leaves.len(), goals, transitions)
    }

    fn contains(&self, state: u32, variable: usize, value: u32) -> bool {
        let (word, bit) = self.fields[variable].bit(value);
        self.sets[state as usize * self.width + word] & bit != 0
    }

    fn intersects(&self, one: u32, other: u32, variable: usize) -> bool {
        let field = &self.fields[variable];
        let [one, other] = [one, other].map(|state| state as usize * self.width + field.start);
        (0..field.words).any(|word| self.sets[one + word] & self.sets[other + word] & field.mask != 0)
    }

    fn count(&self, state: u32, variable: usize) -> u32 {
        let field = &self.fields[variable];
        let start = state as usize * self.width + field.start;
        self.sets[start..start + field.words].iter().map(|word| (word & field.mask).count_ones()).sum()
    }

    fn is_basic(&self, fact: Fact) -> bool {
        fact.variable.index() < self.task.basic
    }

    /// Returns `true` if the abstract state may contain a goal state of the subtask.
    fn is_goal(&self, state: u32) -> bool {
        let is_in = |fact: &Fact| self.contains(state, fact.variable.index(), fact.value);
        self.subtask.goals.iter().all(is_in) || self.subtask.unreachable.iter().any(is_in)
    }

    /// Separates the states that contain a fact of `Subtask::unreachable` from the initial state, within the limits.
    fn separate_unreachable(
        &mut self,
        limits: RefinementLimits,
        pulse: &mut LimitPoll<'_>,
    ) -> Result<(), Interrupted> {
        for variable in 0..self.task.basic {
            pulse.beat()?;
            if !self.is_within(limits) {
                break;
            }
            let facts = self.subtask.unreachable.iter().filter(|fact| fact.variable.index() == variable);
            let values: Vec<u32> = facts.map(|fact| fact.value).collect();
            if !values.is_empty() && (values.len() as u64) < u64::from(self.count(self.initial, variable)) {
                self.split(&Flaw { state: self.initial, variable, values });
            }
        }
        Ok(())
    }

    /// Returns a cheapest abstract plan: operators with the abstract states they lead to. Returns `None` if no
    /// abstract goal state is reachable. Also raises `to_go`, the heuristic of this A\* search.
    fn abstract_plan(&mut self, pulse: &mut LimitPoll<'_>) -> Result<Option<Vec<Edge>>, Interrupted> {
        let mut costs = vec![UNREACHABLE; self.leaves.len()];
        let mut parents: Vec<Option<Edge>> = vec![None; self.leaves.len()];
        let mut closed: Vec<u32> = Vec::new();
        let mut open = BinaryHeap::new();
        costs[self.initial as usize] = 0;
        open.push(Reverse((self.to_go[self.initial as usize], 0, self.initial)));
        self.work += self.leaves.len() as u64 / 4;
        while let Some(Reverse((total, cost, state))) = open.pop() {
            pulse.beat()?;
            if cost > costs[state as usize] {
                continue;
            }
            if self.is_goal(state) {
                for expanded in closed {
                    let cost_to_go = total.saturating_sub(costs[expanded as usize]);
                    self.to_go[expanded as usize] = self.to_go[expanded as usize].max(cost_to_go);
                }
                return Ok(Some(self.path_to(state, &parents)));
            }
            closed.push(state);
            self.work += WORK_PER_VISIT * (self.outgoing[state as usize].len() as u64 + 2);
            self.work += self.subtask.unreachable.len() as u64 / 4;
            for edge in &self.outgoing[state as usize] {
                let through = cost.saturating_add(self.costs[edge.operator as usize]);
                if through < costs[edge.state as usize] {
                    costs[edge.state as usize] = through;
                    parents[edge.state as usize] = Some(Edge { state, operator: edge.operator });
                    let total = through.saturating_add(self.to_go[edge.state as usize]);
                    open.push(Reverse((total, through, edge.state)));
                }
            }
        }
        Ok(None)
    }

    fn path_to(&self, goal: u32, parents: &[Option<Edge>]) -> Vec<Edge> {
        let mut path = Vec::new();
        let mut state = goal;
        while state != self.initial
            && let Some(parent) = parents[state as usize]
        {
            path.push(Edge { state, operator: parent.operator });
            state = parent.state;
        }
        path.reverse();
        path
    }

    /// Returns the split for the first flaw of an abstract plan, or `None` if the plan has no flaw, or no split
    /// avoids it.
    fn flaw(&mut self, plan: &[Edge]) -> Option<Flaw> {
        let task = self.task;
        let mut values = task.initial.values[..task.basic].to_vec();
        let mut state = self.initial;
        for edge in plan {
            let operator = &task.operators[edge.operator as usize];
            self.work += WORK_PER_VISIT / 4 * values.len() as u64;
            let conditions = &operator.condition.facts;
            if conditions.iter().any(|fact| self.is_basic(*fact) && !fact.holds(&values)) {
                return self.most_refined(self.violated(conditions, &values, state));
            }
            let next = apply(operator, &values);
            let mut candidates = Vec::new();
            let mut has_deviation = false;
            for (variable, value) in next.iter().enumerate() {
                if !self.contains(edge.state, variable, *value) {
                    has_deviation = true;
                    self.explain_deviation(operator, [state, edge.state], variable, &values, &mut candidates);
                }
            }
            if has_deviation {
                return self.most_refined(candidates);
            }
            (values, state) = (next, edge.state);
        }
        // A state with an unreachable fact is a goal state, too.
        if self.subtask.unreachable.iter().any(|fact| fact.holds(&values)) {
            return None;
        }
        self.most_refined(self.violated(&self.subtask.goals, &values, state))
    }

    /// Returns the splits that separate `values` from the states in which the violated facts hold. A fact that
    /// the abstract state does not contain yields no split.
    fn violated(&self, facts: &[Fact], values: &[u32], state: u32) -> Vec<Flaw> {
        let is_separable = |fact: &&Fact| {
            let is_violated = self.is_basic(**fact) && !fact.holds(values);
            is_violated && self.contains(state, fact.variable.index(), fact.value)
        };
        let violated = facts.iter().filter(is_separable);
        violated
            .map(|fact| Flaw { state, variable: fact.variable.index(), values: vec![fact.value] })
            .collect()
    }

    /// Adds splits of the source state by which the part with `values` may lose the transition to the target state,
    /// because the operator leads to a value of `variable` outside the target state.
    fn explain_deviation(
        &self,
        operator: &Operator,
        [source, target]: [u32; 2],
        variable: usize,
        values: &[u32],
        candidates: &mut Vec<Flaw>,
    ) {
        let is_set = |fact: &Fact| fact.variable.index() == variable;
        if !operator.effects.iter().any(is_set) {
            let shared: Vec<u32> = (0..self.fields[variable].size)
                .filter(|value| {
                    self.contains(source, variable, *value) && self.contains(target, variable, *value)
                })
                .collect();
            if !shared.is_empty() && !shared.contains(&values[variable]) {
                candidates.push(Flaw { state: source, variable, values: shared });
            }
        }
        let relevant = operator.conditional.iter().filter(|effect| effect.effects.iter().any(is_set));
        for literal in relevant.flat_map(|effect| &effect.condition) {
            if self.truth(operator, literal, source) == Truth::Unknown && self.is_basic(literal.fact) {
                let Fact { variable, value } = literal.fact;
                candidates.push(Flaw { state: source, variable: variable.index(), values: vec![value] });
            }
        }
    }

    fn most_refined(&self, candidates: Vec<Flaw>) -> Option<Flaw> {
        candidates.into_iter().min_by(|a, b| {
            let share = |flaw: &Flaw| {
                let count = u64::from(self.count(flaw.state, flaw.variable));
                (count, u64::from(self.fields[flaw.variable].size))
            };
            let ((count, size), (other_count, other_size)) = (share(a), share(b));
            (count * other_size).cmp(&(other_count * size))
        })
    }

    fn truth(&self, operator: &Operator, literal: &Literal, source: u32) -> Truth {
        let variable = literal.fact.variable.index();
        if !self.is_basic(literal.fact) {
            return Truth::Unknown;
        }
        let required = value_of(&operator.condition.facts, variable);
        let is_possible = match required {
            Some(value) => value == literal.fact.value,
            None => self.contains(source, variable, literal.fact.value),
        };
        match (is_possible, required.is_some() || self.count(source, variable) == 1) {
            (false, _) => {
                if literal.positive {
                    Truth::False
                } else {
                    Truth::True
                }
            }
            (true, true) => {
                if literal.positive {
                    Truth::True
                } else {
                    Truth::False
                }
            }
            (true, false) => Truth::Unknown,
        }
    }

    /// Returns `true` if the operator may lead from the abstract state `source` to a value of the variable that
    /// the abstract state `target` contains.
    fn may_lead(&self, operator: &Operator, [source, target]: [u32; 2], variable: usize) -> bool {
        let effect = value_of(&operator.effects, variable);
        let value = effect.or_else(|| value_of(&operator.condition.facts, variable));
        let mut is_possible = match value {
            Some(value) => self.contains(target, variable, value),
            None => self.intersects(source, target, variable),
        };
        for effect in &operator.conditional {
            let Some(value) = value_of(&effect.effects, variable) else { continue };
            let truths = effect.condition.iter().map(|literal| self.truth(operator, literal, source));
            let truths: Vec<Truth> = truths.collect();
            if truths.contains(&Truth::False) {
                continue;
            }
            let is_in = self.contains(target, variable, value);
            is_possible = is_in || truths.contains(&Truth::Unknown) && is_possible;
        }
        is_possible
    }

    fn is_applicable(&self, operator: &Operator, state: u32) -> bool {
        let mut facts = operator.condition.facts.iter().filter(|fact| self.is_basic(**fact));
        facts.all(|fact| self.contains(state, fact.variable.index(), fact.value))
    }

    fn changes_match(&self, operator: &Operator, ends: [u32; 2]) -> bool {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        let mut facts = operator.effects.iter().chain(conditional);
        facts.all(|fact| self.may_lead(operator, ends, fact.variable.index()))
    }

    fn split(&mut self, flaw: &Flaw) {
        let Flaw { state, variable, ref values } = *flaw;
        let new = dense(self.leaves.len());
        let start = state as usize * self.width;
        self.sets.extend_from_within(start..start + self.width);
        let field = &self.fields[variable];
        let new_start = new as usize * self.width;
        let mut bits = vec![0_u64; field.size.div_ceil(64) as usize].into_boxed_slice();
        for word in &mut self.sets[new_start + field.start..new_start + field.start + field.words] {
            *word &= !field.mask;
        }
        for value in values {
            let (word, bit) = field.bit(*value);
            if self.sets[start + word] & bit != 0 {
                self.sets[start + word] &= !bit;
                self.sets[new_start + word] |= bit;
            }
            bits[*value as usize / 64] |= 1 << (value % 64);
        }
        debug_assert!(self.count(state, variable) > 0 && self.count(new, variable) > 0, "both parts");
        self.divide_leaf(state, new, Split { variable: dense(variable), values: bits, children: [0; 2] });
        self.rewire(state, new, variable);
        self.to_go.push(self.to_go[state as usize]);
        let value = self.task.initial.values[variable];
        if state == self.initial && self.contains(new, variable, value) {
            self.initial = new;
        }
    }

    fn divide_leaf(&mut self, state: u32, new: u32, split: Split) {
        let children = [dense(self.tree.len()), dense(self.tree.len()) + 1];
        let leaf = std::mem::replace(&mut self.leaves[state as usize], children[0]);
        self.leaves.push(children[1]);
        self.tree.extend([SplitNode::Leaf(state), SplitNode::Leaf(new)]);
        self.tree[leaf as usize] = SplitNode::Inner(Split { children, ..split });
    }

    fn rewire(&mut self, state: u32, new: u32, variable: usize) {
        let task = self.task;
        let incoming = std::mem::take(&mut self.incoming[state as usize]);
        let outgoing = std::mem::take(&mut self.outgoing[state as usize]);
        self.incoming.push(Vec::new());
        self.outgoing.push(Vec::new());
        self.transitions -= incoming.len() + outgoing.len();
        self.work += WORK_PER_VISIT
            * (2 * (incoming.len() + outgoing.len()) + 2 * self.by_effect[variable].len()) as u64;
        remove_edges(&mut self.outgoing, &incoming, state);
        remove_edges(&mut self.incoming, &outgoing, state);
        for Edge { state: source, operator } in incoming {
            for part in [state, new] {
                if self.may_lead(&task.operators[operator as usize], [source, part], variable) {
                    self.connect(source, operator, part);
                }
            }
        }
        for Edge { state: target, operator: index } in outgoing {
            let operator = &task.operators[index as usize];
            let required = value_of(&operator.condition.facts, variable);
            for part in [state, new] {
                if required.is_none_or(|value| self.contains(part, variable, value))
                    && self.may_lead(operator, [part, target], variable)
                    && (operator.conditional.is_empty() || self.changes_match(operator, [part, target]))
                {
                    self.connect(part, index, target);
                }
            }
        }
        let by_effect = self.by_effect;
        for index in &by_effect[variable] {
            let operator = &task.operators[*index as usize];
            for ends in [[state, new], [new, state]] {
                if self.is_applicable(operator, ends[0]) && self.changes_match(operator, ends) {
                    self.connect(ends[0], *index, ends[1]);
                }
            }
        }
    }

    fn connect(&mut self, source: u32, operator: u32, target: u32) {
        self.outgoing[source as usize].push(Edge { state: target, operator });
        self.incoming[target as usize].push(Edge { state: source, operator });
        self.transitions += 1;
    }
}

fn remove_edges(lists: &mut [Vec<Edge>], edges: &[Edge], state: u32) {
    let mut neighbours: Vec<u32> = edges.iter().map(|edge| edge.state).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    for neighbour in neighbours {
        lists[neighbour as usize].retain(|edge| edge.state != state);
    }
}

impl ValueSetField {
    #[expect(clippy::arithmetic_side_effects, reason = "bits of a word, and words in memory")]
    fn bit(&self, value: u32) -> (usize, u64) {
        let position = self.shift + value;
        (self.start + position as usize / 64, 1 << (position % 64))
    }
}

/// Assigns value sets of basic variables to words. A set of at most 64 values does not cross the end of a word.
/// Also returns the number of words.
#[expect(clippy::arithmetic_side_effects, reason = "bits of a word, and words in memory")]
fn fields(task: &Task) -> (Vec<ValueSetField>, usize) {
    let mut fields = Vec::with_capacity(task.basic);
    // The number of words, and the number of used bits of the last word.
    let (mut words, mut used) = (0, 64);
    for variable in VariableId::all(task.basic) {
        let size = dense(task.variables[variable.index()].values.len());
        if size > 64 {
            let count = size.div_ceil(64) as usize;
            fields.push(ValueSetField { start: words, words: count, shift: 0, mask: u64::MAX, size });
            (words, used) = (words + count, 64);
            continue;
        }
        if used + size > 64 {
            (words, used) = (words + 1, 0);
        }
        let mask = (u64::MAX >> (64 - size)) << used;
        fields.push(ValueSetField { start: words - 1, words: 1, shift: used, mask, size });
        used += size;
    }
    (fields, words)
}

/// Applies the effects of an operator to the basic variables. A conditional effect with a literal of a derived
/// variable does not occur.
fn apply(operator: &Operator, values: &[u32]) -> Vec<u32> {
    let mut next = values.to_vec();
    let is_true = |literal: &Literal| literal.fact.variable.index() < values.len() && literal.holds(values);
    let conditional = operator.conditional.iter().filter(|effect| effect.condition.iter().all(is_true));
    for fact in operator.effects.iter().chain(conditional.flat_map(|effect| &effect.effects)) {
        next[fact.variable.index()] = fact.value;
    }
    next
}
