//! Solves a Markov chain with costs directly: computes the expected cost from each state.
//!
//! The equations are x(i) = c(i) + Σ p(i,j) x(j). Strongly connected components are solved in reverse
//! topological order. Inside a component, states are eliminated one after another. The pivot 1 − p(i,i) is
//! computed as the sum of the probabilities of leaving the state (Grassmann, Taksar and Heyman, Operations
//! Research 33(5), 1985). Hence nothing is subtracted, and each result in doubles has a small *relative* error,
//! however small the probability of leaving the chain.
//!
//! The bound on this error counts the rounding errors that can occur in a value. A value is a quotient of two
//! polynomials with positive coefficients in the entries (the matrix-tree theorem; O'Cinneide, Numerische
//! Mathematik 73, 1996), so the relative error of an entry changes it only by a small factor.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::graph::components;
use crate::mdp::dense;
use crate::number::{Number, count};
use crate::solve::work::Work;

/// Marker for the absence of a row, choice or state.
pub const NONE: u32 = u32::MAX;

/// The equations of a set of states as sparse rows, one for each choice: transitions inside the set, cost, and
/// probability of leaving the set. The set is usually a strongly connected component; merged states count as
/// one.
#[derive(Debug, Clone, Default)]
pub struct Rows<N> {
    /// Start of each row in `columns`, followed by the length of `columns`.
    pub first: Vec<u32>,
    pub columns: Vec<u32>,
    /// Probabilities of the transitions, parallel to `columns`.
    pub probabilities: Vec<N>,
    /// Cost of each row, plus the expected value of its successors outside the set.
    pub constants: Vec<N>,
    pub leaving: Vec<N>,
}

impl<N: Number> Rows<N> {
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

    pub fn len(&self) -> usize {
        self.constants.len()
    }

    /// Returns the positions of a row's entries in `columns` and `probabilities`.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the start of the next one is there, because the end is listed, too"
    )]
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.first[row] as usize..self.first[row + 1] as usize
    }

    pub fn end(&mut self, constant: N, leaving: N) {
        self.first.push(dense(self.columns.len()));
        self.constants.push(constant);
        self.leaving.push(leaving);
    }

    /// Moves the row `row`, with its entries at the positions `entries`, to the row index `to`, which is not
    /// after `row`. Also eliminates its self-loop: entries in column `loop_column` are dropped, and the
    /// remaining parts of the row are divided by the probability of not looping. Returns `false` if this
    /// probability is 0; the row `to` is then not valid.
    pub fn move_without_loop(
        &mut self,
        row: usize,
        entries: std::ops::Range<usize>,
        to: usize,
        loop_column: u32,
    ) -> bool {
        let mut end = self.first[to] as usize;
        let (begin, mut loops, mut leaves) = (end, false, self.leaving[row].clone());
        for at in entries {
            if self.columns[at] == loop_column {
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

    pub fn truncate(&mut self, rows: usize) {
        let end = self.first[rows] as usize;
        self.first.truncate(rows.saturating_add(1));
        self.columns.truncate(end);
        self.probabilities.truncate(end);
        self.constants.truncate(rows);
        self.leaving.truncate(rows);
    }

    /// Evaluates the right-hand side of a row's equation: constant + Σ probability · value.
    pub fn apply(&self, row: usize, values: &[N]) -> N {
        self.range(row).fold(self.constants[row].clone(), |sum, at| {
            sum.plus(&self.probabilities[at].times(&values[self.columns[at] as usize]))
        })
    }
}

/// Upper limit on the number of entries that elimination in doubles visits for one component. Elimination adds
/// many entries in chains like grids, which iteration solves faster.
const MAX_ELIMINATION: u64 = 300_000_000;

pub struct Solved<N> {
    /// Value (expected cost) of each state.
    pub values: Vec<N>,
    /// Upper bound on the relative error of each value, including the rounding errors of the rows' entries. Infinite if
    /// a product of probabilities may have underflowed; 0 in exact arithmetic.
    pub relative: Vec<f64>,
}

/// Products of doubles below this value may have lost digits by underflow.
const UNDERFLOW_LIMIT: f64 = 1e-290;

pub struct Chain<'a, N> {
    pub rows: &'a Rows<N>,
    /// The row of each state, or [`NONE`] if the state has no successors and no cost.
    pub policy: &'a [u32],
    /// If set, the cost of every row, instead of the constants of the rows.
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

    /// Computes the expected cost from each state of the chain until the run leaves the chain. Returns
    /// `None` if a set of states is never left, or if a limit on the work is exceeded.
    pub fn solve(&self, work: &mut Work<'_>) -> Option<Solved<N>> {
        let order = components(self.policy.len(), |state| self.targets(state as usize));
        let mut values = vec![N::zero(); self.policy.len()];
        let mut relative = vec![0.0_f64; self.policy.len()];
        for component in order.iter() {
            let inherited = if N::EXACT { 0.0 } else { self.worst_outside(component, &relative) };
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
                    relative[state] = inherited + rounding::<N>(1, width);
                    continue;
                }
            }
            let Precision { widest, lost } = eliminate(self, component, &mut values, work)?;
            let rounding_error = if lost { f64::INFINITY } else { rounding::<N>(component.len(), widest) };
            for state in component {
                relative[*state as usize] = inherited + rounding_error;
            }
        }
        Some(Solved { values, relative })
    }

    fn worst_outside(&self, component: &[u32], relative: &[f64]) -> f64 {
        let targets = component.iter().flat_map(|state| self.targets(*state as usize));
        targets.fold(0.0, |worst, target| worst.max(relative[*target as usize]))
    }
}

/// Upper bound on the relative error of the values of a component that is solved by eliminating `states`
/// states, if no row has more than `widest` entries. 0 in exact arithmetic.
///
/// Eliminating a state while m states remain changes each entry by a relative rounding error of at most (w +
/// 4)u, where w is `widest` and u is the unit roundoff. A value depends on at most 2m of these errors. The sum
/// over all m, with the errors of the initial entries and of the back substitution, is at most half of the
/// result.
fn rounding<N: Number>(states: usize, widest: usize) -> f64 {
    let n = count(states) + 4.0;
    if N::EXACT { 0.0 } else { n * n * (count(widest) + 8.0) * f64::EPSILON }
}

struct Row<N> {
    /// The entries, sorted by column. Columns are local state numbers in the component.
    entries: Vec<(u32, N)>,
    constant: N,
    leaving: N,
}

struct Precision {
    widest: usize,
    /// Whether a product of probabilities may have underflowed.
    lost: bool,
}

/// Solves the equations of a strongly connected component by elimination and writes the values of
/// its states. Returns `None` if the component is never left, or if a limit on the work is
/// exceeded.
fn eliminate<N: Number>(
    chain: &Chain<'_, N>,
    component: &[u32],
    values: &mut [N],
    budget: &mut Work<'_>,
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
        // Sorted rows permit binary search for a column.
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
        // An elimination may have increased the cost since it was queued.
        users[p].retain(|user| !done[*user as usize]);
        let current_cost = fill(&rows, &users, pivot);
        if current_cost > cost {
            queue.push(Reverse((current_cost, pivot)));
            continue;
        }
        order.push(pivot);
        done[p] = true;
        normalise(&mut rows[p], pivot, budget)?;
        // The row is moved out of the list, because the rows that use it are changed while it is
        // read.
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
        if !N::EXACT && work > MAX_ELIMINATION {
            return None;
        }
    }
    budget.touch(work);
    // Back substitution: the remaining entries of a row refer only to states that were eliminated
    // later.
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

/// Returns the estimated work of eliminating a state: the number of entries of its row, multiplied by the
/// number of rows that use the state (Markowitz, Management Science 3(3), 1957). States with the least work are
/// eliminated first.
fn fill<N>(rows: &[Row<N>], users: &[Vec<u32>], state: u32) -> usize {
    rows[state as usize].entries.len().saturating_mul(users[state as usize].len())
}

/// Eliminates the self-loop of a row: divides its other entries, its constant and its leaving
/// probability by the probability of not looping. Returns `None` if the row only loops, or if exact
/// arithmetic exceeds its budget.
fn normalise<N: Number>(row: &mut Row<N>, diagonal: u32, budget: &mut Work<'_>) -> Option<()> {
    let Ok(at) = row.entries.binary_search_by_key(&diagonal, |(column, _)| *column) else { return Some(()) };
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

/// Substitutes the row of an eliminated state `pivot` into `target`, the row of state `user`. Returns `true` if
/// a product may have underflowed, and `None` if exact arithmetic exceeds its budget.
fn substitute<N: Number>(
    target: &mut Row<N>,
    pivot: u32,
    row: &Row<N>,
    user: u32,
    users: &mut [Vec<u32>],
    budget: &mut Work<'_>,
) -> Option<bool> {
    let Ok(at) = target.entries.binary_search_by_key(&pivot, |(column, _)| *column) else {
        return Some(false);
    };
    let (_, factor) = target.entries.remove(at);
    let mut lost = false;
    target.constant = target.constant.plus(&factor.times(&row.constant));
    let leaving = factor.times(&row.leaving);
    lost |= !N::EXACT && !row.leaving.is_zero() && leaving.to_f64() < UNDERFLOW_LIMIT;
    target.leaving = target.leaving.plus(&leaving);
    for (column, probability) in &row.entries {
        let product = factor.times(probability);
        lost |= !N::EXACT && product.to_f64() < UNDERFLOW_LIMIT;
        budget.spend(&product, 2)?;
        match target.entries.binary_search_by_key(column, |(existing, _)| *existing) {
            Ok(at) => target.entries[at].1 = target.entries[at].1.plus(&product),
            Err(at) => {
                target.entries.insert(at, (*column, product));
                users[*column as usize].push(user);
            }
        }
    }
    budget.spend(&target.constant, 2)?;
    budget.spend(&target.leaving, 2)?;
    Some(lost)
}
