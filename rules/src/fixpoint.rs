//! Executes join plans of rules: a fixed program of crepe (a Datalog compiler) interprets their steps.
//!
//! A block is a list of matches of a rule's body. The tuples of the program contain the numbers of blocks instead of
//! matches, so that crepe's bookkeeping costs nothing per match, and the store is never copied. `Match` holds blocks of
//! matches, each with the number of plan steps that were executed; `Head` holds blocks of complete matches. A step
//! consumes a block and returns a new block. It reads the store, to which the program has a reference.
//!
//! A small block passes several steps at once, because crepe's bookkeeping would take longer than the steps. In a
//! typical update, each plan starts from one or two matches, which pass all steps before the program would start.

use std::cell::RefCell;
use std::hash::{BuildHasherDefault, Hash, Hasher};
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHasher};
use smallvec::{SmallVec, smallvec};

use crate::aggregate::Function;
use crate::fact::Arguments;
use crate::limits::Budget;
use crate::literal::Literal;
use crate::plan::{HIDDEN, Pattern, Plan, Step};
use crate::source::Source;
use crate::store::{Relation, RelationId, Row, Store, state};
use crate::symbol::{Symbol, Symbols};

pub(crate) type PlanId = u32;

#[derive(Clone, Debug)]
pub(crate) struct Seed {
    pub plan: PlanId,
    pub start: Start,
}

#[derive(Clone, Debug)]
pub(crate) enum Start {
    Nothing,
    /// Start rows of a relation: a range of [`Round::rows`].
    Rows {
        relation: RelationId,
        from: u32,
        to: u32,
    },
    /// Partial matches deferred by an earlier run; `step` is the next step of the plan.
    Matches {
        step: u32,
        bindings: Vec<Symbol>,
    },
}

/// Number of matches after which a join step defers the remaining matches of its input block.
const BLOCK_MATCHES: usize = 1 << 16;

/// Maximum number of partial matches in a small block. A small block executes several steps of the rule's join
/// plan at once, without returning to crepe between them.
const SMALL_MATCHES: usize = 64;

/// Complete matches of a plan: `bindings` contains the values of all variables, one match after the
/// other.
#[derive(Debug)]
pub(crate) struct Matches {
    pub plan: PlanId,
    pub bindings: Vec<Symbol>,
}

pub(crate) struct Round<'a> {
    pub store: &'a Store,
    pub plans: &'a [Plan],
    /// Number of variables per match, indexed by compiled rule.
    pub widths: &'a [usize],
    pub symbols: RefCell<&'a mut Arc<Symbols>>,
    pub rows: &'a [Row],
    /// `true` while invalid derivations are searched. Joins then match all rows of the store: those that held before
    /// the update, and newer ones.
    pub retracting: bool,
    pub budget: &'a Budget,
    pub blocks: RefCell<Vec<Vec<Symbol>>>,
    pub buffers: &'a Buffers,
    /// Matches deferred to bound memory, for later runs.
    pub deferred: RefCell<Vec<Seed>>,
}

type BlockId = u32;

#[derive(Debug, Default)]
pub(crate) struct Buffers(RefCell<Vec<Vec<Symbol>>>);

/// Maximum capacity, in symbols, of a buffer that is used again.
const BUFFER_SYMBOLS: usize = 1 << 10;
const MAX_BUFFERS: usize = 16;

impl Buffers {
    fn take(&self, capacity: usize) -> Vec<Symbol> {
        let mut buffer = self.0.borrow_mut().pop().unwrap_or_default();
        buffer.reserve(capacity);
        buffer
    }

    pub fn put(&self, mut buffer: Vec<Symbol>) {
        let mut buffers = self.0.borrow_mut();
        if buffer.capacity() <= BUFFER_SYMBOLS && buffers.len() < MAX_BUFFERS {
            buffer.clear();
            buffers.push(buffer);
        }
    }
}

mod program {

    use crate::fixpoint::{BlockId, Handle, PlanId};
    use crepe::crepe;

    crepe! {
        @input
        pub struct Reads<'a>(pub Handle<'a>);
        @input
        pub struct Start(pub PlanId, pub u32, pub BlockId);

        struct Match(PlanId, u32, BlockId);

        @output
        pub struct Head(pub PlanId, pub BlockId);

        Match(plan, step, block) <- Start(plan, step, block);
        Match(plan, next, extended) <-
            Match(plan, step, block), Reads(round), let Some((next, extended)) = round.extend(plan, step, block);
        Head(plan, block) <- Match(plan, step, block), Reads(round), (round.is_complete(plan, step));
    }
}

/// Reference to a [`Round`] that can be a value in a tuple of the crepe program. Compared and hashed by
/// address, because crepe requires equality and a hash of its values.
#[derive(Clone, Copy)]
pub(crate) struct Handle<'a>(&'a dyn Evaluate);

/// Operations of a round that the crepe program calls. `extend` returns the next step and the number of the
/// extended block. It returns `None` if no match remains, the plan is complete, or the budget is exhausted.
trait Evaluate {
    fn extend(&self, plan: PlanId, step: u32, block: BlockId) -> Option<(u32, BlockId)>;
    fn is_complete(&self, plan: PlanId, step: u32) -> bool;
}

impl Handle<'_> {
    fn address(&self) -> *const () {
        std::ptr::from_ref(self.0).cast()
    }

    fn extend(&self, plan: PlanId, step: u32, block: BlockId) -> Option<(u32, BlockId)> {
        self.0.extend(plan, step, block)
    }

    fn is_complete(&self, plan: PlanId, step: u32) -> bool {
        self.0.is_complete(plan, step)
    }
}

impl PartialEq for Handle<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.address() == other.address()
    }
}

impl Eq for Handle<'_> {}

impl Hash for Handle<'_> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.address().hash(state);
    }
}

/// Evaluates the plans from their seeds. Returns the complete matches, ordered by plan and block number.
/// Partial matches that are postponed to bound the memory are added to [`Round::deferred`]. If the budget is
/// exhausted, matches are missing.
pub(crate) fn run(round: &Round, seeds: &[Seed]) -> Vec<Matches> {
    let (mut heads, mut partial) = (Vec::new(), Vec::new());
    for seed in seeds {
        let first = if let Start::Matches { step, .. } = seed.start { step } else { 0 };
        let Some((step, block)) = round.pass(seed.plan, first, round.seed(seed)) else { continue };
        if round.is_complete(seed.plan, step) {
            heads.push((seed.plan, block));
        } else {
            partial.push(program::Start(seed.plan, step, block));
        }
    }
    if !partial.is_empty() {
        let mut runtime = program::Crepe::new();
        runtime.extend([program::Reads(Handle(round))]);
        runtime.extend(partial);
        let (complete,) = runtime.run_with_hasher::<BuildHasherDefault<FxHasher>>();
        heads.extend(complete.into_iter().map(|head| (head.0, head.1)));
    }
    // crepe's output has no defined order.
    heads.sort_unstable();
    let matches = |(plan, block)| Matches { plan, bindings: round.take(block) };
    heads.into_iter().map(matches).collect()
}

impl Evaluate for Round<'_> {
    fn extend(&self, plan: PlanId, step: u32, block: BlockId) -> Option<(u32, BlockId)> {
        if self.is_complete(plan, step) {
            return None;
        }
        let block = self.take(block);
        self.pass(plan, step + 1, self.extend_block(plan, step, block)?)
    }

    fn is_complete(&self, plan: PlanId, step: u32) -> bool {
        self.plans[plan as usize].steps.len() == step as usize
    }
}

impl Round<'_> {
    fn take(&self, block: BlockId) -> Vec<Symbol> {
        std::mem::take(&mut self.blocks.borrow_mut()[block as usize])
    }

    /// Stores a block that has reached `step` of its plan. Returns the step reached and the block number, or
    /// `None` if no match remains or the budget is exhausted. A small block first passes as many steps as
    /// possible.
    fn pass(&self, plan: PlanId, mut step: u32, mut block: Vec<Symbol>) -> Option<(u32, BlockId)> {
        let (steps, width) = (self.plans[plan as usize].steps.len(), self.width(&self.plans[plan as usize]));
        while (step as usize) < steps && !block.is_empty() && block.len() <= SMALL_MATCHES * width {
            block = self.extend_block(plan, step, block)?;
            step += 1;
        }
        if block.is_empty() {
            self.buffers.put(block);
            return None;
        }
        let mut blocks = self.blocks.borrow_mut();
        blocks.push(block);
        Some((step, blocks.len() as BlockId - 1))
    }

    fn width(&self, plan: &Plan) -> usize {
        self.widths[plan.rule as usize]
    }

    fn seed(&self, seed: &Seed) -> Vec<Symbol> {
        let plan = &self.plans[seed.plan as usize];
        let empty: SmallVec<[Symbol; 16]> = smallvec![Symbol(0); self.width(plan)];
        match &seed.start {
            Start::Nothing => empty.into_vec(),
            Start::Matches { bindings, .. } => bindings.clone(),
            Start::Rows { relation, from, to } => {
                let relation = self.store.get(*relation);
                let mut block = self.buffers.take(self.width(plan) * (to - from) as usize);
                for &row in &self.rows[*from as usize..*to as usize] {
                    if plan.seed_is_link && relation.record(row).rule == plan.rule {
                        continue;
                    }
                    extend_match(&mut block, &empty, relation.row(row), &plan.seed);
                }
                block
            }
        }
    }

    /// Applies a step of a plan to a block, and returns the matches that pass, extended by their new
    /// bindings. A join with too many results defers the remaining matches of the block. Returns `None` if
    /// the plan has no such step, or if the budget does not cover the block; no match if the budget is exhausted
    /// within the step.
    fn extend_block(&self, plan: PlanId, step: u32, block: Vec<Symbol>) -> Option<Vec<Symbol>> {
        let (id, number) = (plan, step);
        let plan = &self.plans[id as usize];
        let step = plan.steps.get(number as usize)?;
        let width = self.width(plan);
        if !self.budget.spend((block.len() / width) as u64, plan.rule) {
            return None;
        }
        Some(match step {
            Step::Join { relation, skip, index, key, pattern, is_link } => {
                let (relation, index) = (self.store.get(*relation), *index);
                let lookup = Lookup { relation, skip: *skip, index, key, pattern, is_link: *is_link };
                let (extended, done) = self.join(&lookup, &block, width, plan.rule);
                if done < block.len() {
                    let start = Start::Matches { step: number, bindings: block[done..].to_vec() };
                    self.deferred.borrow_mut().push(Seed { plan: id, start });
                }
                self.buffers.put(block);
                extended
            }
            Step::Contains { relation, skip, key, is_link } => {
                let (relation, skip) = (self.store.get(*relation), self.visibility(*skip));
                let fits = |row: Row| {
                    relation.state(row) & skip == 0 && !(*is_link && relation.record(row).rule == plan.rule)
                };
                retain(block, width, |bound| find(relation, key, bound).is_some_and(fits))
            }
            // The test could lose matches, because a row that was absent before the update may be in the store now.
            // Superfluous matches do no harm: `retract` compares them with the recorded derivations.
            Step::Absent { .. } if self.retracting => block,
            Step::Absent { relation, key } => {
                let relation = self.store.get(*relation);
                let is_doomed = |row: Row| relation.state(row) & state::DOOMED != 0;
                retain(block, width, |bound| find(relation, key, bound).is_none_or(is_doomed))
            }
            Step::Test { built_in, arguments, negated } => {
                let symbols = self.symbols.borrow();
                retain(block, width, |bound| {
                    let values = literals(&symbols, arguments, bound);
                    values.is_some_and(|values| built_in.holds(&values)) != *negated
                })
            }
            Step::Compute { built_in, result, arguments } => {
                self.compute(block, width, (*result, plan.rule), |symbols, bound| {
                    built_in.compute(&literals(symbols, arguments, bound)?)
                })
            }
            Step::Solve { built_in, arguments, known } => {
                self.solve(&block, width, plan.rule, *built_in, (arguments, known))
            }
            Step::Aggregate { matches, function, index, group, result, binds } => {
                let group = Group { relation: self.store.get(*matches), index: *index, key: group };
                self.aggregate(block, width, *function, &group, (*result, *binds, plan.rule))
            }
            Step::Equate { variable, source } => {
                let mut block = block;
                for bound in block.chunks_exact_mut(width) {
                    bound[usize::from(*variable)] = resolve(*source, bound);
                }
                block
            }
            Step::Compare { comparison, left, right } => {
                let symbols = self.symbols.borrow();
                retain(block, width, |bound| {
                    comparison.holds(&symbols, resolve(*left, bound), resolve(*right, bound))
                })
            }
        })
    }

    /// Returns the state bits of the rows that a step skips: normally `skip`. While retracting, only unused
    /// rows are skipped, because every row that held before the update must be visible.
    fn visibility(&self, skip: u8) -> u8 {
        if self.retracting { state::FREE } else { skip }
    }

    /// Extends each match of a block by the rows that fit, until there are about [`BLOCK_MATCHES`] matches.
    /// Returns the extended matches and the length of the processed part of the block. If the budget is
    /// exhausted, returns no match, and the whole block counts as processed.
    fn join(&self, lookup: &Lookup, block: &[Symbol], width: usize, rule: u32) -> (Vec<Symbol>, usize) {
        let (relation, skip) = (lookup.relation, self.visibility(lookup.skip));
        let mut extended = self.buffers.take(block.len());
        let mut key = [Symbol(0); 32];
        for (position, bound) in block.chunks_exact(width).enumerate() {
            if extended.len() > BLOCK_MATCHES * width {
                return (extended, position * width);
            }
            let before = extended.len();
            let mut visited = 0;
            let mut visit = |row: Row| {
                visited += 1;
                if relation.state(row) & skip == 0 && !(lookup.is_link && relation.record(row).rule == rule) {
                    extend_match(&mut extended, bound, relation.row(row), lookup.pattern);
                }
            };
            if let Some(index) = lookup.index {
                for (slot, source) in key.iter_mut().zip(lookup.key) {
                    *slot = resolve(*source, bound);
                }
                relation.lookup(index, &key[..lookup.key.len()]).for_each(&mut visit);
            } else {
                // Without key columns, all rows are candidates.
                (0..relation.bound()).for_each(&mut visit);
            }
            let steps = ((extended.len() - before) / width) as u64;
            if !self.budget.spend(steps, rule) || !self.budget.visit(visited, rule) {
                return (Vec::new(), block.len());
            }
        }
        (extended, block.len())
    }

    /// Computes an aggregate for each match, and binds its result (if `binds`) or keeps only the matches with
    /// an equal result. Drops the matches for which the aggregate has no value. While retracting, the
    /// aggregate ranges over the rows before the update. Returns no match if the evaluation has to stop.
    fn aggregate(
        &self,
        mut block: Vec<Symbol>,
        width: usize,
        function: Function,
        group: &Group,
        (result, binds, rule): (Source, bool, u32),
    ) -> Vec<Symbol> {
        let skip = if self.retracting { state::FREE | state::NEW } else { HIDDEN };
        let visible = |row: &Row| group.relation.state(*row) & skip == 0;
        let mut end = 0;
        // Matches often share a group.
        let mut cache: FxHashMap<Arguments, Option<Symbol>> = FxHashMap::default();
        for start in (0..block.len()).step_by(width) {
            let bound = &mut block[start..start + width];
            let key: Arguments = group.key.iter().map(|&source| resolve(source, bound)).collect();
            let mut visited = 0;
            let value = *cache.entry(key).or_insert_with_key(|key| {
                let mut symbols = self.symbols.borrow_mut();
                let rows = |row| {
                    visited += 1;
                    group.relation.row(row)
                };
                let value = match group.index {
                    Some(index) => {
                        let members = group.relation.lookup(index, key).filter(visible);
                        function.evaluate(members.map(rows), &symbols)
                    }
                    None => function.evaluate(group.relation.scan().filter(visible).map(rows), &symbols),
                };
                value.map(|value| intern(&mut symbols, value))
            });
            if !self.budget.spend(visited, rule) {
                return Vec::new();
            }
            let Some(value) = value else { continue };
            match result {
                Source::Variable(number) if binds => bound[usize::from(number)] = value,
                source if resolve(source, bound) != value => continue,
                _ => {}
            }
            block.copy_within(start..start + width, end);
            end += width;
        }
        block.truncate(end);
        block
    }

    /// Binds the variable `result` of each match to the value of `function`. Drops the matches for which the
    /// function is undefined. Returns no match if the evaluation has to stop.
    fn compute(
        &self,
        mut block: Vec<Symbol>,
        width: usize,
        (result, rule): (u16, u32),
        function: impl Fn(&Symbols, &[Symbol]) -> Option<Literal>,
    ) -> Vec<Symbol> {
        let mut symbols = self.symbols.borrow_mut();
        let mut end = 0;
        for start in (0..block.len()).step_by(width) {
            let Some(value) = function(&symbols, &block[start..start + width]) else { continue };
            let symbols_before = symbols.len();
            block[start + usize::from(result)] = intern(&mut symbols, value);
            let computed = symbols.as_literal(block[start + usize::from(result)]);
            if symbols.len() > symbols_before && !self.budget.spend_on_value(computed, rule) {
                return Vec::new();
            }
            block.copy_within(start..start + width, end);
            end += width;
        }
        block.truncate(end);
        block
    }
}

/// Clones a shared interner only if the value has no symbol yet.
pub(crate) fn intern(symbols: &mut Arc<Symbols>, value: Literal) -> Symbol {
    symbols.find_literal(&value).unwrap_or_else(|| Arc::make_mut(symbols).literal(value))
}

/// Group of an aggregate: the rows of a relation whose first columns equal a key.
struct Group<'a> {
    relation: &'a Relation,
    index: Option<usize>,
    key: &'a [Source],
}

struct Lookup<'a> {
    relation: &'a Relation,
    skip: u8,
    index: Option<usize>,
    key: &'a [Source],
    pattern: &'a Pattern,
    /// `true` if rows that the rule itself derived are skipped; see [`crate::plan::Lowered::is_closure`].
    is_link: bool,
}

fn extend_match(block: &mut Vec<Symbol>, bound: &[Symbol], row: &[Symbol], pattern: &Pattern) {
    // A variable may occur twice in the row, so the columns are checked only after all variables are bound.
    let start = block.len();
    block.extend_from_slice(bound);
    let extended = &mut block[start..];
    for &(column, variable) in &pattern.binds {
        extended[usize::from(variable)] = row[column];
    }
    if pattern.checks.iter().any(|&(column, source)| resolve(source, extended) != row[column]) {
        block.truncate(start);
    }
}

pub(crate) fn resolve(source: Source, bound: &[Symbol]) -> Symbol {
    match source {
        Source::Variable(number) => bound[usize::from(number)],
        Source::Constant(symbol) => symbol,
    }
}

fn find(relation: &Relation, key: &[Source], bound: &[Symbol]) -> Option<Row> {
    let mut arguments = [Symbol(0); 32];
    for (slot, &source) in arguments.iter_mut().zip(key) {
        *slot = resolve(source, bound);
    }
    relation.find(&arguments[..key.len()])
}

fn literals<'s>(
    symbols: &'s Symbols,
    sources: &[Source],
    bound: &[Symbol],
) -> Option<SmallVec<[&'s Literal; 4]>> {
    sources.iter().map(|&source| symbols.as_literal(resolve(source, bound))).collect()
}

fn retain(mut block: Vec<Symbol>, width: usize, test: impl Fn(&[Symbol]) -> bool) -> Vec<Symbol> {
    let mut end = 0;
    for start in (0..block.len()).step_by(width) {
        if test(&block[start..start + width]) {
            block.copy_within(start..start + width, end);
            end += width;
        }
    }
    block.truncate(end);
    block
}
