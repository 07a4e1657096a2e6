//! A Markov chain with costs to the expected cost from each state, without iteration.
//!
//! x(i) = c(i) + Σ p(i,j) x(j). Components in topological order; inside one, states are eliminated one after the other.
//! The pivot 1 − p(i,i) is the sum of what leaves the state (Grassmann, Taksar and Heyman, Operations Research
//! 33(5), 1985), so nothing is ever subtracted: with doubles each result has a small *relative* error, however rarely
//! the chain is left.
//!
//! How small follows from two facts. A step of elimination computes each entry of what remains by a few sums, products and
//! quotients of positive numbers, so that it is the exact step from entries that are off by a factor near 1. And a value
//! is a quotient of two polynomials with positive coefficients whose degree is the number of states that remain (the
//! matrix-tree theorem; O'Cinneide, Numerische Mathematik 73, 1996), so that such factors come out once for each state, above and
//! below.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::graph::components;
use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::work::Work;

/// No number.
pub const NONE: u32 = u32::MAX;

/// Rows of a chain: where a state leads inside, what it costs, and with which probability it leaves for good.
#[derive(Debug, Clone, Default)]
pub struct Rows<N> {
    /// Where each row starts in `columns`, and the end.
    pub first: Vec<u32>,
    /// Targets of the rows.
    pub columns: Vec<u32>,
    /// Their probabilities.
    pub probabilities: Vec<N>,
    /// The cost of each row, values of the states outside included.
    pub constants: Vec<N>,
    /// The probability of leaving for good.
    pub leaving: Vec<N>,
}

impl<N: Number> Rows<N> {
    /// No rows.
    pub fn new() -> Self {
        Self {
            first: vec![0],
            ..Self {
                first: vec![],
                columns: vec![],
                probabilities: vec![],
                constants: vec![],
                leaving: vec![],
            }
        }
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.constants.len()
    }

    /// The entries of a row.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.first[row] as usize..self.first[row + 1] as usize
    }

    /// Ends the row that is being written.
    pub fn end(&mut self, constant: N, leaving: N) {
        self.first.push(dense(self.columns.len()));
        self.constants.push(constant);
        self.leaving.push(leaving);
    }

    /// Writes a row, whose entries are told, in the place `to`, which is at or before its own, with the loop at `own` divided
    /// out. False, and nothing is written, if it never leaves. Rows behind keep their ends, and not their beginnings.
    pub fn keep_unlooped(
        &mut self,
        row: usize,
        entries: std::ops::Range<usize>,
        to: usize,
        own: u32,
    ) -> bool {
        let mut end = self.first[to] as usize;
        let (begin, mut loops, mut leaves) = (end, false, self.leaving[row].clone());
        for at in entries {
            if self.columns[at] == own {
                loops = true;
                continue;
            }
            leaves = leaves.plus(&self.probabilities[at]);
            self.columns[end] = self.columns[at];
            self.probabilities.swap(end, at);
            end = end.saturating_add(1);
        }
        if leaves.is_zero() {
            return false;
        }
        self.constants.swap(to, row);
        self.leaving.swap(to, row);
        if loops {
            let parts = self.probabilities[begin..end].iter_mut();
            for part in parts.chain([&mut self.constants[to], &mut self.leaving[to]]) {
                *part = part.over(&leaves);
            }
        }
        self.first[to.saturating_add(1)] = dense(end);
        true
    }

    /// Forgets all but so many rows.
    pub fn truncate(&mut self, rows: usize) {
        let end = self.first[rows] as usize;
        self.first.truncate(rows.saturating_add(1));
        self.columns.truncate(end);
        self.probabilities.truncate(end);
        self.constants.truncate(rows);
        self.leaving.truncate(rows);
    }

    /// constant + Σ probability · value.
    pub fn apply(&self, row: usize, values: &[N]) -> N {
        self.range(row).fold(self.constants[row].clone(), |sum, at| {
            sum.plus(&self.probabilities[at].times(&values[self.columns[at] as usize]))
        })
    }
}

/// Entries that elimination may touch in doubles before it is given up: chains that hang together in two dimensions fill
/// up, and are better iterated.
const ELIMINATION: u64 = 300_000_000;

/// Values of a chain.
pub struct Solved<N> {
    /// For each state its value.
    pub values: Vec<N>,
    /// How far each can be from the truth, relative to the value, given rows whose entries are rounded once or twice; infinite
    /// where products became too small for doubles, zero where arithmetic is exact.
    pub relative: Vec<f64>,
}

/// Doubles below are so small that products of them lose digits.
const LOST: f64 = 1e-290;

/// A chain: the rows that a policy takes.
pub struct Chain<'a, N> {
    /// All rows.
    pub rows: &'a Rows<N>,
    /// For each state its row, or [`NONE`] where nothing happens any more.
    pub policy: &'a [u32],
    /// The cost of each row, in place of what it says itself; all others cost nothing.
    pub costs: Option<N>,
}

impl<N: Number> Chain<'_, N> {
    fn range(&self, state: usize) -> std::ops::Range<usize> {
        match self.policy[state] {
            NONE => 0..0,
            row => self.rows.range(row as usize),
        }
    }

    fn targets(&self, state: usize) -> &[u32] {
        &self.rows.columns[self.range(state)]
    }

    fn transitions(&self, state: usize) -> impl ExactSizeIterator<Item = (u32, &N)> {
        let range = self.range(state);
        self.rows.columns[range.clone()].iter().copied().zip(&self.rows.probabilities[range])
    }

    fn constant(&self, state: usize) -> N {
        match (self.policy[state], &self.costs) {
            (NONE, _) => N::zero(),
            (_, Some(costs)) => costs.clone(),
            (row, None) => self.rows.constants[row as usize].clone(),
        }
    }

    fn leaving(&self, state: usize) -> N {
        match self.policy[state] {
            NONE => N::one(),
            row => self.rows.leaving[row as usize].clone(),
        }
    }

    /// Solves it; none if some state never leaves, or if elimination takes too long.
    pub fn solve(&self, work: &mut Work) -> Option<Solved<N>> {
        let order = components(self.policy.len(), |state| self.targets(state as usize));
        let mut values = vec![N::zero(); self.policy.len()];
        let mut relative = vec![0.0_f64; self.policy.len()];
        for component in order.iter() {
            let before = if N::EXACT { 0.0 } else { self.worst_outside(component, &relative) };
            if let [state] = component {
                let state = *state as usize;
                if self.targets(state).iter().all(|target| *target as usize != state) {
                    let terms = self.transitions(state);
                    let width = terms.len();
                    let value = terms.fold(self.constant(state), |sum, (target, probability)| {
                        sum.plus(&probability.times(&values[target as usize]))
                    });
                    work.spend(&value, width)?;
                    values[state] = value;
                    relative[state] = before + rounding::<N>(1, width);
                    continue;
                }
            }
            let Precision { widest, lost } = eliminate(self, component, &mut values, work)?;
            let own = if lost { f64::INFINITY } else { rounding::<N>(component.len(), widest) };
            for state in component {
                relative[*state as usize] = before + own;
            }
        }
        Some(Solved { values, relative })
    }

    /// The greatest relative error of what a component leads to.
    fn worst_outside(&self, component: &[u32], relative: &[f64]) -> f64 {
        let targets = component.iter().flat_map(|state| self.targets(*state as usize));
        targets.fold(0.0, |worst, target| worst.max(relative[*target as usize]))
    }
}

/// The relative error of eliminating so many states, in rows of so many entries.
///
/// The step with m states left is off by a factor of 1 ± (w + 4)u in each entry, which a value has 2m times; all of them
/// together are below n(n + 1)(w + 4)u, the rounding of the first entries and the way back below another 4n(w + 4)u. The unit
/// u is half of the epsilon, so that this is twice as much.
fn rounding<N: Number>(states: usize, widest: usize) -> f64 {
    let n = count(states) + 4.0;
    if N::EXACT { 0.0 } else { n * n * (count(widest) + 8.0) * f64::EPSILON }
}

/// A state of the component under elimination.
struct Row<N> {
    /// Sorted by column (numbers inside the component).
    entries: Vec<(u32, N)>,
    constant: N,
    leaving: N,
}

/// What an elimination's error depends on.
struct Precision {
    /// The greatest number of entries that a row had.
    widest: usize,
    /// Whether products became too small for doubles.
    lost: bool,
}

/// The values of a component.
fn eliminate<N: Number>(
    chain: &Chain<'_, N>,
    component: &[u32],
    values: &mut [N],
    budget: &mut Work,
) -> Option<Precision> {
    let mut members: Vec<u32> = component.to_vec();
    members.sort_unstable();
    let local = |state: u32| members.binary_search(&state).ok();
    let mut rows: Vec<Row<N>> = Vec::with_capacity(members.len());
    let mut users: Vec<Vec<u32>> = vec![Vec::new(); members.len()];
    for (i, state) in members.iter().enumerate() {
        let state = *state as usize;
        let mut row =
            Row { entries: Vec::new(), constant: chain.constant(state), leaving: chain.leaving(state) };
        for (target, probability) in chain.transitions(state) {
            if let Some(j) = local(target) {
                row.entries.push((dense(j), probability.clone()));
                users[j].push(dense(i));
            } else {
                row.constant = row.constant.plus(&probability.times(&values[target as usize]));
                row.leaving = row.leaving.plus(probability);
            }
        }
        row.entries.sort_unstable_by_key(|(column, _)| *column);
        rows.push(row);
    }
    let mut done = vec![false; members.len()];
    let (mut work, mut lost) = (0_u64, false);
    let mut widest = rows.iter().map(|row| row.entries.len()).max().unwrap_or(0);
    let mut order = Vec::with_capacity(members.len());
    let mut queue: BinaryHeap<Reverse<(usize, u32)>> =
        (0..dense(rows.len())).map(|state| Reverse((fill(&rows, &users, state), state))).collect();
    while let Some(Reverse((cost, pivot))) = queue.pop() {
        let p = pivot as usize;
        // What was cheap may have become dear.
        users[p].retain(|user| !done[*user as usize]);
        let now = fill(&rows, &users, pivot);
        if now > cost {
            queue.push(Reverse((now, pivot)));
            continue;
        }
        order.push(pivot);
        done[p] = true;
        normalise(&mut rows[p], pivot, budget)?;
        let row = std::mem::replace(
            &mut rows[p],
            Row { entries: Vec::new(), constant: N::zero(), leaving: N::zero() },
        );
        for user in std::mem::take(&mut users[p]) {
            if !done[user as usize] {
                let touched = row.entries.len().saturating_add(rows[user as usize].entries.len());
                work = work.saturating_add(u64::try_from(touched).unwrap_or(u64::MAX));
                lost |= substitute(&mut rows[user as usize], pivot, &row, user, &mut users, budget)?;
                widest = widest.max(rows[user as usize].entries.len());
            }
        }
        rows[p] = row;
        if !N::EXACT && work > ELIMINATION {
            return None;
        }
    }
    budget.touch(work);
    // What is left in a row refers to states that were eliminated later, whose values are known first.
    for pivot in order.iter().rev() {
        let p = *pivot as usize;
        let row = &rows[p];
        let value = row.entries.iter().fold(row.constant.clone(), |sum, (column, probability)| {
            sum.plus(&probability.times(&values[members[*column as usize] as usize]))
        });
        budget.spend(&value, row.entries.len().saturating_add(1))?;
        values[members[p] as usize] = value;
    }
    Some(Precision { widest, lost })
}

/// The entries that eliminating a state touches (Markowitz, Management Science 3(3), 1957): those with the fewest go first.
fn fill<N>(rows: &[Row<N>], users: &[Vec<u32>], state: u32) -> usize {
    rows[state as usize].entries.len().saturating_mul(users[state as usize].len())
}

/// Removes the loop of a row, and divides by what leaves it.
fn normalise<N: Number>(row: &mut Row<N>, own: u32, budget: &mut Work) -> Option<()> {
    let Ok(at) = row.entries.binary_search_by_key(&own, |(column, _)| *column) else { return Some(()) };
    row.entries.remove(at);
    let leaves = row.entries.iter().fold(row.leaving.clone(), |sum, (_, p)| sum.plus(p));
    if leaves.is_zero() {
        return None;
    }
    for (_, probability) in &mut row.entries {
        *probability = probability.over(&leaves);
        budget.spend(probability, 1)?;
    }
    budget.spend(&leaves, row.entries.len().saturating_add(2))?;
    row.constant = row.constant.over(&leaves);
    row.leaving = row.leaving.over(&leaves);
    Some(())
}

/// Puts a row in the place of its state in the row of `user`; whether a product became too small for doubles.
fn substitute<N: Number>(
    target: &mut Row<N>,
    pivot: u32,
    row: &Row<N>,
    user: u32,
    users: &mut [Vec<u32>],
    budget: &mut Work,
) -> Option<bool> {
    let Ok(at) = target.entries.binary_search_by_key(&pivot, |(column, _)| *column) else {
        return Some(false);
    };
    let (_, factor) = target.entries.remove(at);
    let mut lost = false;
    target.constant = target.constant.plus(&factor.times(&row.constant));
    let leaving = factor.times(&row.leaving);
    lost |= !N::EXACT && !row.leaving.is_zero() && leaving.to_f64() < LOST;
    target.leaving = target.leaving.plus(&leaving);
    for (column, probability) in &row.entries {
        let more = factor.times(probability);
        lost |= !N::EXACT && more.to_f64() < LOST;
        budget.spend(&more, 2)?;
        match target.entries.binary_search_by_key(column, |(known, _)| *known) {
            Ok(at) => target.entries[at].1 = target.entries[at].1.plus(&more),
            Err(at) => {
                target.entries.insert(at, (*column, more));
                users[*column as usize].push(user);
            }
        }
    }
    budget.spend(&target.constant, 2)?;
    budget.spend(&target.leaving, 2)?;
    Some(lost)
}
