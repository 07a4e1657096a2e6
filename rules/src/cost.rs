//! Expected sizes of look-ups, from samples of the relations, for the order of joins.
//!
//! A look-up in `n` rows by columns with `d1, d2, …` distinct values is expected to match `n / min(n, d1·d2·…)` rows.
//! A relation that is still empty, or whose rows the rules have yet to derive, counts as a cube with sides of
//! `n^(1/arity)` distinct values.

use rustc_hash::FxHashSet;

use crate::store::{Relation, RelationId, Row, Store, state};

/// Rows looked at per relation.
const SAMPLE: usize = 1024;
/// Rows that a relation counts as where nothing is known of it.
const UNKNOWN_ROWS: usize = 64;

/// Sizes of all relations, in rows, and of their columns, in distinct values.
pub(crate) struct Costs {
    relations: Vec<(f64, Vec<f64>)>,
}

impl Costs {
    /// `is_open` says which relations the rules have yet to fill.
    pub fn new(store: &Store, is_open: impl Fn(RelationId) -> bool) -> Self {
        let largest =
            store.relations.iter().map(|relation| relation.len()).max().unwrap_or(0).max(UNKNOWN_ROWS);
        let sizes = store.relations.iter().enumerate().map(|(number, relation)| {
            let rows = match relation.len() {
                _ if is_open(RelationId(number as u32)) => largest,
                0 => UNKNOWN_ROWS,
                rows => return (rows as f64, sample(relation)),
            };
            let side = (rows as f64).powf(1.0 / relation.arity().max(1) as f64);
            (rows as f64, vec![side; relation.arity()])
        });
        Self { relations: sizes.collect() }
    }

    /// Expected rows of a relation.
    pub fn rows(&self, relation: RelationId) -> f64 {
        self.relations[relation.0 as usize].0
    }

    /// Expected rows that agree on the given columns.
    pub fn matches(&self, relation: RelationId, known: impl Iterator<Item = usize>) -> f64 {
        let (rows, distinct) = &self.relations[relation.0 as usize];
        let keys: f64 = known.map(|column| distinct[column]).product();
        rows / keys.clamp(1.0, *rows)
    }
}

/// The number of distinct values of each column, scaled up where hardly any value repeats in the sample.
fn sample(relation: &Relation) -> Vec<f64> {
    let stride = (relation.bound() as usize / SAMPLE).max(1);
    let rows: Vec<Row> =
        (0..relation.bound()).step_by(stride).filter(|&row| relation.state(row) & state::FREE == 0).collect();
    let distinct = |column: usize| {
        let values: FxHashSet<_> = rows.iter().map(|&row| relation.row(row)[column]).collect();
        let share = values.len() as f64 / rows.len().max(1) as f64;
        let seen = values.len().max(1) as f64;
        if share > 0.5 { (share * relation.len() as f64).max(seen) } else { seen }
    };
    (0..relation.arity()).map(distinct).collect()
}
