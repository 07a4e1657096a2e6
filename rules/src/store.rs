//! Store of the facts that hold: rows of symbols, with hash indexes on the columns that are looked up.
//!
//! A relation holds the facts of one predicate and arity. A row is a number. Its arguments are contiguous in one
//! vector, and its state is one byte. An index links the rows with equal key columns into a doubly linked list, so
//! that insertion and deletion take expected time O(indexes) and allocate nothing per row.

use hashbrown::HashTable;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;
use std::sync::Arc;

use crate::fact::{Arguments, Fact};
use crate::symbol::Symbol;

#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub(crate) struct RelationId(pub u32);

pub(crate) type Row = u32;

const NO_ROW: Row = Row::MAX;

pub(crate) mod state {
    pub const FREE: u8 = 1;
    /// The row is in the delta of the current semi-naive round.
    pub const FRESH: u8 = 2;
    /// The row was derived in the current round; rules cannot match it before the next round.
    pub const PENDING: u8 = 4;
    /// The row lost its support in this update. It is removed at the end of the update unless it is
    /// rederived.
    pub const DOOMED: u8 = 8;
    /// The row is stated, not only derived.
    pub const ASSERTED: u8 = 16;
    /// The row did not hold before this update.
    pub const NEW: u8 = 32;
}

/// Recorded derivation of a row: the compiled rule, and the slot of its bindings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Record {
    pub rule: u32,
    pub slot: u32,
}

impl Record {
    pub const NONE: Self = Self { rule: u32::MAX, slot: 0 };
}

/// All relations of an engine. A clone of the store shares each relation until the original or the clone
/// changes it.
#[derive(Clone, Default, Debug)]
pub(crate) struct Store {
    pub relations: Vec<Arc<Relation>>,
    by_predicate: FxHashMap<(Symbol, u32), RelationId>,
}

impl Store {
    pub fn find(&self, predicate: Symbol, arity: usize) -> Option<RelationId> {
        self.by_predicate.get(&(predicate, arity as u32)).copied()
    }

    /// Creates the relation on first use.
    pub fn relation(&mut self, predicate: Symbol, arity: usize) -> RelationId {
        if let Some(id) = self.find(predicate, arity) {
            return id;
        }
        let id = self.push(Relation::new(Some(predicate), arity));
        self.by_predicate.insert((predicate, arity as u32), id);
        id
    }

    pub fn insert_stated(&mut self, facts: Vec<Fact>) {
        for fact in facts {
            let relation = self.relation(fact.predicate, fact.arguments.len());
            let relation = self.get_mut(relation);
            if relation.find(&fact.arguments).is_none() {
                relation.insert(&fact.arguments, state::ASSERTED, Record::NONE);
            }
        }
    }

    /// Returns a relation without a predicate, for the matches of an integrity constraint or of an
    /// aggregate. Reuses an empty unused relation with a number of at least `first`, if there is one.
    pub fn anonymous(
        &mut self,
        arity: usize,
        first: u32,
        is_used: impl Fn(RelationId) -> bool,
    ) -> RelationId {
        let fits = |relation: &Relation| {
            relation.predicate.is_none() && relation.arity == arity && relation.len() == 0
        };
        let mut ids = (first..self.relations.len() as u32).map(RelationId);
        let unused = ids.find(|&id| fits(self.get(id)) && !is_used(id));
        unused.unwrap_or_else(|| self.push(Relation::new(None, arity)))
    }

    fn push(&mut self, relation: Relation) -> RelationId {
        let id = RelationId(self.relations.len() as u32);
        self.relations.push(Arc::new(relation));
        id
    }

    /// Returns the number of stored rows in any state, including the matches of constraints and aggregates.
    pub fn len(&self) -> usize {
        self.relations.iter().map(|relation| relation.len()).sum()
    }

    pub fn get(&self, id: RelationId) -> &Relation {
        &self.relations[id.0 as usize]
    }

    pub fn get_mut(&mut self, id: RelationId) -> &mut Relation {
        Arc::make_mut(&mut self.relations[id.0 as usize])
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Relation {
    /// Predicate of the facts; `None` for the matches of a constraint or an aggregate.
    pub predicate: Option<Symbol>,
    arity: usize,
    arguments: Vec<Symbol>,
    states: Vec<u8>,
    records: Vec<Record>,
    rows: HashTable<Row>,
    indexes: Vec<Index>,
    free: Vec<Row>,
}

#[derive(Clone, Debug)]
struct Index {
    columns: u32,
    /// Number of the rule whose derived rows are not in the index; `None` if all rows are in the index.
    excluded_rule: Option<u32>,
    heads: HashTable<Row>,
    next: Vec<Row>,
    previous: Vec<Row>,
}

pub(crate) fn columns(mask: u32) -> impl Iterator<Item = usize> {
    let mut remaining = mask;
    std::iter::from_fn(move || {
        let column = remaining.trailing_zeros() as usize;
        remaining &= remaining.wrapping_sub(1);
        (column < 32).then_some(column)
    })
}

// Combines the symbols first, so that the hasher runs once per key.
fn hash(key: impl Iterator<Item = Symbol>) -> u64 {
    let mut hash = 0_u64;
    for symbol in key {
        hash = (hash.rotate_left(26) ^ u64::from(symbol.0)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
    FxBuildHasher.hash_one(hash ^ (hash >> 32))
}

impl Relation {
    fn new(predicate: Option<Symbol>, arity: usize) -> Self {
        Self {
            predicate,
            arity,
            arguments: Vec::new(),
            states: Vec::new(),
            records: Vec::new(),
            rows: HashTable::new(),
            indexes: Vec::new(),
            free: Vec::new(),
        }
    }

    /// Returns the number of stored rows in any state.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn arity(&self) -> usize {
        self.arity
    }

    /// Returns an upper bound (exclusive) on the numbers of the rows in use.
    pub fn bound(&self) -> Row {
        self.states.len() as Row
    }

    pub fn row(&self, row: Row) -> &[Symbol] {
        let start = row as usize * self.arity;
        &self.arguments[start..start + self.arity]
    }

    pub fn fact(&self, row: Row) -> Option<Fact> {
        Some(Fact { predicate: self.predicate?, arguments: Arguments::from_slice(self.row(row)) })
    }

    pub fn clear_all(&mut self) {
        let indexes = std::mem::take(&mut self.indexes);
        *self = Self::new(self.predicate, self.arity);
        for index in indexes {
            self.index_without(index.columns, index.excluded_rule);
        }
    }

    pub fn state(&self, row: Row) -> u8 {
        self.states[row as usize]
    }

    pub fn set(&mut self, row: Row, bits: u8) {
        self.states[row as usize] |= bits;
    }

    pub fn clear(&mut self, row: Row, bits: u8) {
        self.states[row as usize] &= !bits;
    }

    pub fn record(&self, row: Row) -> Record {
        self.records[row as usize]
    }

    pub fn set_record(&mut self, row: Row, record: Record) {
        let old_record = std::mem::replace(&mut self.records[row as usize], record);
        let (values, arity) = (&self.arguments, self.arity);
        let row_of = |row: Row| &values[row as usize * arity..(row as usize + 1) * arity];
        // Indexes with an excluded rule depend on the record of a row.
        for index in &mut self.indexes {
            match (index.has(old_record), index.has(record)) {
                (true, false) => index.remove(row, row_of),
                (false, true) => index.insert(row, row_of),
                _ => {}
            }
        }
    }

    pub fn find(&self, arguments: &[Symbol]) -> Option<Row> {
        self.rows.find(hash(arguments.iter().copied()), |&row| self.row(row) == arguments).copied()
    }

    /// Adds a row, which must not exist yet, and returns its number.
    pub fn insert(&mut self, arguments: &[Symbol], state: u8, record: Record) -> Row {
        let row = if let Some(row) = self.free.pop() {
            let start = row as usize * self.arity;
            self.arguments[start..start + self.arity].copy_from_slice(arguments);
            self.states[row as usize] = state;
            self.records[row as usize] = record;
            row
        } else {
            self.arguments.extend_from_slice(arguments);
            self.states.push(state);
            self.records.push(record);
            self.states.len() as Row - 1
        };
        let (values, arity) = (&self.arguments, self.arity);
        let row_of = |row: Row| &values[row as usize * arity..(row as usize + 1) * arity];
        self.rows
            .insert_unique(hash(arguments.iter().copied()), row, |&row| hash(row_of(row).iter().copied()));
        for index in self.indexes.iter_mut().filter(|index| index.has(record)) {
            index.insert(row, row_of);
        }
        row
    }

    /// Removes a row. Its number may be reused.
    pub fn remove(&mut self, row: Row) {
        let (values, arity) = (&self.arguments, self.arity);
        let row_of = |row: Row| &values[row as usize * arity..(row as usize + 1) * arity];
        if let Ok(entry) = self.rows.find_entry(hash(row_of(row).iter().copied()), |&other| other == row) {
            entry.remove();
        }
        let record = self.records[row as usize];
        for index in self.indexes.iter_mut().filter(|index| index.has(record)) {
            index.remove(row, row_of);
        }
        self.states[row as usize] = state::FREE;
        self.records[row as usize] = Record::NONE;
        self.free.push(row);
    }

    pub fn has_index(&self, columns: u32) -> bool {
        self.indexes.iter().any(|index| index.columns == columns && index.excluded_rule.is_none())
    }

    pub fn index(&mut self, columns: u32) -> usize {
        self.index_without(columns, None)
    }

    /// Returns the number of the index on the columns of a bit mask that omits the rows derived by
    /// `excluded_rule`. Builds the index on first use.
    pub fn index_without(&mut self, columns: u32, excluded_rule: Option<u32>) -> usize {
        let is_same = |index: &Index| index.columns == columns && index.excluded_rule == excluded_rule;
        if let Some(position) = self.indexes.iter().position(is_same) {
            return position;
        }
        let (heads, next, previous) = (HashTable::new(), Vec::new(), Vec::new());
        let mut index = Index { columns, excluded_rule, heads, next, previous };
        let (values, arity) = (&self.arguments, self.arity);
        for row in 0..self.states.len() as Row {
            if self.states[row as usize] & state::FREE == 0 && index.has(self.records[row as usize]) {
                index.insert(row, |row| &values[row as usize * arity..(row as usize + 1) * arity]);
            }
        }
        self.indexes.push(index);
        self.indexes.len() - 1
    }

    /// Returns the index on the largest subset of the columns `bound`, and the columns of this index (bit masks).
    /// Ignores indexes without the rows that one rule has derived; `None` if no index fits.
    pub fn best_index(&self, bound: u32) -> Option<(usize, u32)> {
        let fits = |index: &Index| index.columns & !bound == 0 && index.excluded_rule.is_none();
        let usable = self.indexes.iter().enumerate().filter(|(_, index)| fits(index));
        usable
            .max_by_key(|(_, index)| index.columns.count_ones())
            .map(|(position, index)| (position, index.columns))
    }

    /// Returns the rows whose indexed columns equal `key`. The key is in ascending order of the columns.
    pub fn lookup<'a>(&'a self, index: usize, key: &[Symbol]) -> Rows<'a> {
        let index = &self.indexes[index];
        let has_key = |&row: &Row| {
            columns(index.columns).zip(key).all(|(column, &value)| self.row(row)[column] == value)
        };
        let next = index.heads.find(hash(key.iter().copied()), has_key).copied().unwrap_or(NO_ROW);
        Rows { links: &index.next, next }
    }

    pub fn scan(&self) -> impl Iterator<Item = Row> + '_ {
        (0..self.bound()).filter(|&row| self.state(row) & state::FREE == 0)
    }
}

pub(crate) struct Rows<'a> {
    links: &'a [Row],
    next: Row,
}

impl Iterator for Rows<'_> {
    type Item = Row;

    fn next(&mut self) -> Option<Row> {
        let row = self.next;
        if row == NO_ROW {
            return None;
        }
        self.next = self.links[row as usize];
        Some(row)
    }
}

impl Index {
    fn has(&self, record: Record) -> bool {
        self.excluded_rule.is_none_or(|rule| rule != record.rule)
    }

    fn key(mask: u32, row: &[Symbol]) -> impl Iterator<Item = Symbol> + '_ {
        columns(mask).map(|column| row[column])
    }

    fn insert<'a>(&mut self, row: Row, row_of: impl Fn(Row) -> &'a [Symbol]) {
        let length = row as usize + 1;
        if self.next.len() < length {
            self.next.resize(length, NO_ROW);
            self.previous.resize(length, NO_ROW);
        }
        let mask = self.columns;
        let hash_of = |row: Row| hash(Self::key(mask, row_of(row)));
        let has_key = |&head: &Row| Self::key(mask, row_of(head)).eq(Self::key(mask, row_of(row)));
        self.previous[row as usize] = NO_ROW;
        // A new row becomes the head of its list, so that no list is traversed.
        if let Some(head) = self.heads.find_mut(hash_of(row), has_key) {
            self.next[row as usize] = *head;
            self.previous[*head as usize] = row;
            *head = row;
        } else {
            self.next[row as usize] = NO_ROW;
            self.heads.insert_unique(hash_of(row), row, |&row| hash_of(row));
        }
    }

    fn remove<'a>(&mut self, row: Row, row_of: impl Fn(Row) -> &'a [Symbol]) {
        let (next, previous) = (self.next[row as usize], self.previous[row as usize]);
        if next != NO_ROW {
            self.previous[next as usize] = previous;
        }
        if previous != NO_ROW {
            self.next[previous as usize] = next;
            return;
        }
        let hash = hash(Self::key(self.columns, row_of(row)));
        if let Ok(mut entry) = self.heads.find_entry(hash, |&head| head == row) {
            if next == NO_ROW {
                entry.remove();
            } else {
                *entry.get_mut() = next;
            }
        }
    }
}
