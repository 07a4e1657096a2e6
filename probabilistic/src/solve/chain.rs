//! A Markov chain with costs to the expected cost from each state, without iteration.
//!
//! x(i) = c(i) + Σ p(i,j) x(j). Components in topological order; inside one, states are eliminated one after the other.
//! The pivot 1 − p(i,i) is the sum of what leaves the state (Grassmann, Taksar and Heyman, Operations Research
//! 33(5), 1985), so nothing is ever subtracted: with doubles each result has a small *relative* error, however rarely
//! the chain is left.

use crate::graph::components;
use crate::mdp::dense;
use crate::number::Number;

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

    /// constant + Σ probability · value.
    pub fn apply(&self, row: usize, values: &[N]) -> N {
        self.range(row).fold(self.constants[row].clone(), |sum, at| {
            sum.plus(&self.probabilities[at].times(&values[self.columns[at] as usize]))
        })
    }

    fn clear(&mut self) {
        self.first.truncate(1);
        self.columns.clear();
        self.probabilities.clear();
        self.constants.clear();
        self.leaving.clear();
    }
}

/// Entries that elimination may touch in doubles before it is given up: chains that hang together in two dimensions fill
/// up, and are better iterated.
const ELIMINATION: u64 = 300_000_000;

/// Solves the chain in which state `i` has the row `policy[i]`, with the constants of the rows.
///
/// None if some state never leaves, or if elimination takes too long.
pub fn solve_chain<N: Number>(
    rows: &Rows<N>,
    policy: &[u32],
    constants: impl Fn(usize) -> N,
) -> Option<Vec<N>> {
    let mut chain = Rows::new();
    chain.clear();
    for row in policy {
        let row = *row as usize;
        for at in rows.range(row) {
            chain.columns.push(rows.columns[at]);
            chain.probabilities.push(rows.probabilities[at].clone());
        }
        chain.end(constants(row), rows.leaving[row].clone());
    }
    let order = components(policy.len(), |state| &chain.columns[chain.range(state as usize)]);
    let mut values = vec![N::zero(); policy.len()];
    for component in order.iter() {
        if let [state] = component {
            let state = *state as usize;
            let looping = chain.range(state).any(|at| chain.columns[at] as usize == state);
            if !looping {
                values[state] = chain.apply(state, &values);
                continue;
            }
        }
        eliminate(&chain, component, &mut values)?;
    }
    Some(values)
}

/// A state of the component under elimination.
struct Row<N> {
    /// Sorted by column (numbers inside the component).
    entries: Vec<(u32, N)>,
    constant: N,
    leaving: N,
}

fn eliminate<N: Number>(chain: &Rows<N>, component: &[u32], values: &mut [N]) -> Option<()> {
    let mut members: Vec<u32> = component.to_vec();
    members.sort_unstable();
    let local = |state: u32| members.binary_search(&state).ok();
    let mut rows: Vec<Row<N>> = Vec::with_capacity(members.len());
    let mut users: Vec<Vec<u32>> = vec![Vec::new(); members.len()];
    for (i, state) in members.iter().enumerate() {
        let state = *state as usize;
        let mut row = Row {
            entries: Vec::new(),
            constant: chain.constants[state].clone(),
            leaving: chain.leaving[state].clone(),
        };
        for at in chain.range(state) {
            let probability = &chain.probabilities[at];
            if let Some(j) = local(chain.columns[at]) {
                row.entries.push((dense(j), probability.clone()));
                users[j].push(dense(i));
            } else {
                let value = &values[chain.columns[at] as usize];
                row.constant = row.constant.plus(&probability.times(value));
                row.leaving = row.leaving.plus(probability);
            }
        }
        row.entries.sort_unstable_by_key(|(column, _)| *column);
        rows.push(row);
    }
    let order = elimination_order(&rows, &users);
    let mut done = vec![false; members.len()];
    let mut work = 0_u64;
    for pivot in &order {
        let p = *pivot as usize;
        done[p] = true;
        normalise(&mut rows[p], *pivot)?;
        let row = std::mem::replace(
            &mut rows[p],
            Row { entries: Vec::new(), constant: N::zero(), leaving: N::zero() },
        );
        for user in std::mem::take(&mut users[p]) {
            if !done[user as usize] {
                let touched = row.entries.len().saturating_add(rows[user as usize].entries.len());
                work = work.saturating_add(u64::try_from(touched).unwrap_or(u64::MAX));
                substitute(&mut rows[user as usize], *pivot, &row, user, &mut users);
            }
        }
        rows[p] = row;
        if !N::EXACT && work > ELIMINATION {
            return None;
        }
    }
    // What is left in a row refers to states that were eliminated later, whose values are known first.
    for pivot in order.iter().rev() {
        let p = *pivot as usize;
        let row = &rows[p];
        let value = row.entries.iter().fold(row.constant.clone(), |sum, (column, probability)| {
            sum.plus(&probability.times(&values[members[*column as usize] as usize]))
        });
        values[members[p] as usize] = value;
    }
    Some(())
}

/// Few entries first: rows that fill the others least. Greedy on the initial pattern.
fn elimination_order<N>(rows: &[Row<N>], users: &[Vec<u32>]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..dense(rows.len())).collect();
    order.sort_by_key(|i| rows[*i as usize].entries.len().saturating_mul(users[*i as usize].len()));
    order
}

/// Removes the loop of a row, and divides by what leaves it.
fn normalise<N: Number>(row: &mut Row<N>, own: u32) -> Option<()> {
    let Ok(at) = row.entries.binary_search_by_key(&own, |(column, _)| *column) else { return Some(()) };
    row.entries.remove(at);
    let leaves = row.entries.iter().fold(row.leaving.clone(), |sum, (_, p)| sum.plus(p));
    if leaves.is_zero() {
        return None;
    }
    for (_, probability) in &mut row.entries {
        *probability = probability.over(&leaves);
    }
    row.constant = row.constant.over(&leaves);
    row.leaving = row.leaving.over(&leaves);
    Some(())
}

/// Puts a row in the place of its state in the row of `user`.
fn substitute<N: Number>(target: &mut Row<N>, pivot: u32, row: &Row<N>, user: u32, users: &mut [Vec<u32>]) {
    let Ok(at) = target.entries.binary_search_by_key(&pivot, |(column, _)| *column) else { return };
    let (_, factor) = target.entries.remove(at);
    target.constant = target.constant.plus(&factor.times(&row.constant));
    target.leaving = target.leaving.plus(&factor.times(&row.leaving));
    for (column, probability) in &row.entries {
        let more = factor.times(probability);
        match target.entries.binary_search_by_key(column, |(known, _)| *known) {
            Ok(at) => target.entries[at].1 = target.entries[at].1.plus(&more),
            Err(at) => {
                target.entries.insert(at, (*column, more));
                users[*column as usize].push(user);
            }
        }
    }
}
