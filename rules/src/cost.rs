//! Join-order statistics: expected sizes of look-ups, from samples of the relations.
//!
//! A look-up in `n` rows by columns with `d1, d2, …` distinct values is expected to match `n / min(n, d1·d2·…)` rows.
//! An empty relation is assumed to have 64 rows. A relation whose rows are yet to be derived is assumed to have as
//! many rows as the largest relation, but at least 64. Each column of a relation with an assumed number `n` of rows
//! is assumed to have `n^(1/arity)` distinct values.

use rustc_hash::FxHashSet;

use crate::store::{Relation, RelationId, Row, Store, state};

/// Approximate number of rows that are sampled per relation. Because the stride is an integer, up to twice as many
/// are sampled.
const SAMPLE: usize = 1024;
/// Assumed number of rows of an empty relation, and minimum of the assumed number for a relation that rules
/// have yet to fill.
const UNKNOWN_ROWS: usize = 64;

pub(crate) struct Costs {
    relations: Vec<(f64, Vec<f64>)>,
}

impl Costs {
    /// Samples the relations. `is_open` returns `true` for a relation that the rules have yet to fill.
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

    pub fn rows(&self, relation: RelationId) -> f64 {
        self.relations[relation.0 as usize].0
    }

    pub fn matches(&self, relation: RelationId, bound_columns: impl Iterator<Item = usize>) -> f64 {
        let (rows, distinct) = &self.relations[relation.0 as usize];
        let keys: f64 = bound_columns.map(|column| distinct[column]).product();
        rows / keys.clamp(1.0, *rows)
    }
}

/// Estimates the number of distinct values of each column from a sample of the rows. The number is
/// scaled up if more than half of the sampled values are distinct.
fn sample(relation: &Relation) -> Vec<f64> {
    let stride = (relation.bound() as usize / SAMPLE).max(1);
    let rows: Vec<Row> =
        (0..relation.bound()).step_by(stride).filter(|&row| relation.state(row) & state::FREE == 0).collect();
    let distinct = |column: usize| {
        let values: FxHashSet<_> = rows.iter().map(|&row| relation.row(row)[column]).collect();
        let share = values.len() as f64 / rows.len().max(1) as f64;
        let sampled = values.len().max(1) as f64;
        // Mostly distinct values suggest a key column, whose distinct values grow with the relation.
        if share > 0.5 { (share * relation.len() as f64).max(sampled) } else { sampled }
    };
    (0..relation.arity()).map(distinct).collect()
}
