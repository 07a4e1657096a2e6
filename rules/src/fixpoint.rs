//! One round of evaluation as one fixed crepe program over rules that are data.
//!
//! A change enters as `Delta`: ranges of changed rows, per plan. `Match` says that a block of partial matches has
//! passed so many steps of its plan; extending a block by the next atom is a look-up in the persistent store, which
//! the program sees by reference. `Head` is a block of complete matches. Evaluation is set-at-a-time: crepe's tuples
//! name blocks of matches, so its own bookkeeping costs nothing per match, and the store is never copied.
//!
//! A block is handed over, not shared: it is consumed by the one rule that extends it. A small block passes all steps of
//! its plan in that one rule: an update by one report starts some plans on one or two matches each, where bookkeeping for
//! each step would take longer than the steps.

use std::cell::RefCell;
use std::hash::{BuildHasherDefault, Hash, Hasher};
use std::sync::Arc;

use rustc_hash::FxHasher;

use crate::aggregate::Function;
use crate::fact::Arguments;
use crate::limits::Budget;
use crate::literal::Literal;
use crate::plan::{HIDDEN, Pattern, Plan, Step};
use crate::source::Source;
use crate::store::{Relation, RelationId, Row, Store, state};
use crate::symbol::{Symbol, Symbols};

/// A position in the plans of a round.
pub(crate) type PlanId = u32;

/// Where the evaluation of a plan starts.
#[derive(Clone, Debug)]
pub(crate) struct Seed {
    pub plan: PlanId,
    pub start: Start,
}

/// What a plan starts from.
#[derive(Clone, Debug)]
pub(crate) enum Start {
    /// One empty match.
    Nothing,
    /// Changed rows of a relation: a range of [`Round::rows`].
    Rows { relation: RelationId, from: u32, to: u32 },
    /// Partial matches that an earlier run put off.
    Matches { step: u32, bindings: Vec<Symbol> },
}

/// Partial matches that one step of one block may produce before the rest of the block is put off.
const BLOCK_MATCHES: usize = 1 << 16;

/// A block of so many partial matches is small.
const SMALL_MATCHES: usize = 64;

/// Complete matches of a plan, side by side.
#[derive(Debug)]
pub(crate) struct Matches {
    pub plan: PlanId,
    pub bindings: Vec<Symbol>,
}

/// What a round reads, and the blocks it passes along.
pub(crate) struct Round<'a> {
    pub store: &'a Store,
    pub plans: &'a [Plan],
    /// Variables per match, by compiled rule.
    pub widths: &'a [usize],
    pub symbols: RefCell<&'a mut Arc<Symbols>>,
    /// Changed rows, as ranges of [`Seed`]s.
    pub rows: &'a [Row],
    /// Whether the state before the update is asked for, of which the store holds a superset.
    pub retracting: bool,
    pub budget: &'a Budget,
    pub blocks: RefCell<Vec<Vec<Symbol>>>,
    /// What was put off to bound memory, to be evaluated by later runs.
    pub deferred: RefCell<Vec<Seed>>,
}

/// A block in [`Round::blocks`].
type BlockId = u32;

mod program {
    //! The crepe program.

    use crate::fixpoint::{BlockId, Handle, PlanId};
    use crepe::crepe;

    crepe! {
        @input
        pub struct Reads<'a>(pub Handle<'a>);
        @input
        pub struct Delta(pub u32, pub PlanId);

        struct Match(PlanId, u32, BlockId);

        @output
        pub struct Head(pub PlanId, pub BlockId);

        Match(plan, step, block) <- Delta(seed, plan), Reads(round), let Some((step, block)) = round.seed(seed);
        Match(plan, next, longer) <-
            Match(plan, step, block), Reads(round), let Some((next, longer)) = round.extend(plan, step, block);
        Head(plan, block) <- Match(plan, step, block), Reads(round), (round.is_complete(plan, step));
    }
}

/// Identity of a round, so that crepe can keep it in a relation.
#[derive(Clone, Copy)]
pub(crate) struct Handle<'a>(&'a dyn Evaluate);

trait Evaluate {
    fn seed(&self, seed: u32) -> Option<(u32, BlockId)>;
    fn extend(&self, plan: PlanId, step: u32, block: BlockId) -> Option<(u32, BlockId)>;
    fn is_complete(&self, plan: PlanId, step: u32) -> bool;
}

impl Handle<'_> {
    fn address(&self) -> *const () {
        std::ptr::from_ref(self.0).cast()
    }

    fn seed(&self, seed: u32) -> Option<(u32, BlockId)> {
        self.0.seed(seed)
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

/// Evaluates the plans from their seeds; matches come in the order of seeds.
pub(crate) fn run(round: &Round, seeds: &[Seed]) -> Vec<Matches> {
    let seeded = Seeded { round, seeds };
    let mut runtime = program::Crepe::new();
    runtime.extend([program::Reads(Handle(&seeded))]);
    runtime.extend((0..).zip(seeds).map(|(number, seed)| program::Delta(number, seed.plan)));
    let (heads,) = runtime.run_with_hasher::<BuildHasherDefault<FxHasher>>();
    let mut heads: Vec<(PlanId, BlockId)> = heads.into_iter().map(|head| (head.0, head.1)).collect();
    heads.sort_unstable();
    let matches = |(plan, block)| Matches { plan, bindings: round.take(block) };
    heads.into_iter().map(matches).collect()
}

struct Seeded<'r, 'a> {
    round: &'r Round<'a>,
    seeds: &'r [Seed],
}

impl Evaluate for Seeded<'_, '_> {
    fn seed(&self, seed: u32) -> Option<(u32, BlockId)> {
        let seed = &self.seeds[seed as usize];
        let first = if let Start::Matches { step, .. } = seed.start { step } else { 0 };
        self.round.pass(seed.plan, first, self.round.seed(seed))
    }

    fn extend(&self, plan: PlanId, step: u32, block: BlockId) -> Option<(u32, BlockId)> {
        if self.is_complete(plan, step) {
            return None;
        }
        let block = self.round.take(block);
        self.round.pass(plan, step + 1, self.round.extend(plan, step, block)?)
    }

    fn is_complete(&self, plan: PlanId, step: u32) -> bool {
        self.round.plans[plan as usize].steps.len() == step as usize
    }
}

impl Round<'_> {
    fn take(&self, block: BlockId) -> Vec<Symbol> {
        std::mem::take(&mut self.blocks.borrow_mut()[block as usize])
    }

    /// Hands a block over to the program, before a step of its plan. What is small passes the steps up to there at once, since
    /// the program's bookkeeping would take longer than the steps.
    fn pass(&self, plan: PlanId, mut step: u32, mut block: Vec<Symbol>) -> Option<(u32, BlockId)> {
        let (steps, width) = (self.plans[plan as usize].steps.len(), self.width(&self.plans[plan as usize]));
        while (step as usize) < steps && !block.is_empty() && block.len() <= SMALL_MATCHES * width {
            block = self.extend(plan, step, block)?;
            step += 1;
        }
        if block.is_empty() {
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
        let empty = vec![Symbol(0); self.width(plan)];
        match &seed.start {
            Start::Nothing => empty,
            Start::Matches { bindings, .. } => bindings.clone(),
            Start::Rows { relation, from, to } => {
                let relation = self.store.get(*relation);
                let mut block = Vec::with_capacity(self.width(plan) * (to - from) as usize);
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

    /// The matches that pass a step; none where there is no such step, or where evaluation has to stop.
    fn extend(&self, plan: PlanId, step: u32, block: Vec<Symbol>) -> Option<Vec<Symbol>> {
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
                let (longer, done) = self.join(&lookup, &block, width, plan.rule);
                if done < block.len() {
                    let start = Start::Matches { step: number, bindings: block[done..].to_vec() };
                    self.deferred.borrow_mut().push(Seed { plan: id, start });
                }
                longer
            }
            Step::Contains { relation, skip, key, is_link } => {
                let (relation, skip) = (self.store.get(*relation), self.visibility(*skip));
                let fits = |row: Row| {
                    relation.state(row) & skip == 0 && !(*is_link && relation.record(row).rule == plan.rule)
                };
                retain(block, width, |bound| find(relation, key, bound).is_some_and(fits))
            }
            Step::Absent { .. } if self.retracting => block,
            Step::Absent { relation, key } => {
                let relation = self.store.get(*relation);
                let gone = |row: Row| relation.state(row) & state::DOOMED != 0;
                retain(block, width, |bound| find(relation, key, bound).is_none_or(gone))
            }
            Step::Test { built_in, arguments } => {
                let symbols = self.symbols.borrow();
                retain(block, width, |bound| {
                    literals(&symbols, arguments, bound).is_some_and(|values| built_in.holds(&values))
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
                self.aggregate(block, width, *function, &group, (*result, *binds))
            }
            Step::Equate { variable, source } => {
                let mut block = block;
                for bound in block.chunks_exact_mut(width) {
                    bound[usize::from(*variable)] = resolve(*source, bound);
                }
                block
            }
            Step::Compare { left, right, equal: true } => {
                retain(block, width, |bound| resolve(*left, bound) == resolve(*right, bound))
            }
            Step::Compare { left, right, equal: false } => {
                let symbols = self.symbols.borrow();
                retain(block, width, |bound| symbols.differ(resolve(*left, bound), resolve(*right, bound)))
            }
        })
    }

    /// The row states to skip: when retracting, everything that held before is visible.
    fn visibility(&self, skip: u8) -> u8 {
        if self.retracting { state::FREE } else { skip }
    }

    /// Extends matches by the rows that fit them, up to about [`BLOCK_MATCHES`]; also how much of the block that took.
    fn join(&self, lookup: &Lookup, block: &[Symbol], width: usize, rule: u32) -> (Vec<Symbol>, usize) {
        let (relation, skip) = (lookup.relation, self.visibility(lookup.skip));
        let mut longer = Vec::with_capacity(block.len());
        let mut key = [Symbol(0); 32];
        for (position, bound) in block.chunks_exact(width).enumerate() {
            if longer.len() > BLOCK_MATCHES * width {
                return (longer, position * width);
            }
            let before = longer.len();
            let mut looked_at = 0;
            let mut visit = |row: Row| {
                looked_at += 1;
                if relation.state(row) & skip == 0 && !(lookup.is_link && relation.record(row).rule == rule) {
                    extend_match(&mut longer, bound, relation.row(row), lookup.pattern);
                }
            };
            if let Some(index) = lookup.index {
                for (slot, source) in key.iter_mut().zip(lookup.key) {
                    *slot = resolve(*source, bound);
                }
                relation.lookup(index, &key[..lookup.key.len()]).for_each(&mut visit);
            } else {
                (0..relation.bound()).for_each(&mut visit);
            }
            let steps = ((longer.len() - before) / width) as u64;
            if !self.budget.spend(steps, rule) || !self.budget.visit(looked_at, rule) {
                return (Vec::new(), block.len());
            }
        }
        (longer, block.len())
    }

    /// Binds or checks what an aggregate comes to; when retracting, what it came to before the update.
    fn aggregate(
        &self,
        mut block: Vec<Symbol>,
        width: usize,
        function: Function,
        group: &Group,
        (result, binds): (Source, bool),
    ) -> Vec<Symbol> {
        let skip = if self.retracting { state::FREE | state::NEW } else { HIDDEN };
        let visible = |row: &Row| group.relation.state(*row) & skip == 0;
        let (mut kept, mut last) = (0, None::<(Arguments, Option<Symbol>)>);
        for start in (0..block.len()).step_by(width) {
            let bound = &mut block[start..start + width];
            let key: Arguments = group.key.iter().map(|&source| resolve(source, bound)).collect();
            let known = last.as_ref().filter(|(other, _)| *other == key).map(|&(_, value)| value);
            let value = known.unwrap_or_else(|| {
                let mut symbols = self.symbols.borrow_mut();
                let rows = |row| group.relation.row(row);
                let value = match group.index {
                    Some(index) => {
                        let found = group.relation.lookup(index, &key).filter(visible);
                        function.of(found.map(rows), &symbols)
                    }
                    None => function.of(group.relation.scan().filter(visible).map(rows), &symbols),
                };
                value.map(|value| intern(&mut symbols, value))
            });
            last = Some((key, value));
            let Some(value) = value else { continue };
            match result {
                Source::Variable(number) if binds => bound[usize::from(number)] = value,
                source if resolve(source, bound) != value => continue,
                _ => {}
            }
            block.copy_within(start..start + width, kept);
            kept += width;
        }
        block.truncate(kept);
        block
    }

    fn compute(
        &self,
        mut block: Vec<Symbol>,
        width: usize,
        (result, rule): (u16, u32),
        function: impl Fn(&Symbols, &[Symbol]) -> Option<Literal>,
    ) -> Vec<Symbol> {
        let mut symbols = self.symbols.borrow_mut();
        let mut kept = 0;
        for start in (0..block.len()).step_by(width) {
            let Some(value) = function(&symbols, &block[start..start + width]) else { continue };
            let known = symbols.len();
            block[start + usize::from(result)] = intern(&mut symbols, value);
            let computed = symbols.as_literal(block[start + usize::from(result)]);
            if symbols.len() > known && !self.budget.spend_on_value(computed, rule) {
                return Vec::new();
            }
            block.copy_within(start..start + width, kept);
            kept += width;
        }
        block.truncate(kept);
        block
    }
}

/// The symbol of a computed value; symbols that a clone shares are copied only for a new one.
pub(crate) fn intern(symbols: &mut Arc<Symbols>, value: Literal) -> Symbol {
    symbols.find_literal(&value).unwrap_or_else(|| Arc::make_mut(symbols).literal(value))
}

/// Rows that begin with the values of a key.
struct Group<'a> {
    relation: &'a Relation,
    index: Option<usize>,
    key: &'a [Source],
}

/// The parts of a join step.
struct Lookup<'a> {
    relation: &'a Relation,
    skip: u8,
    index: Option<usize>,
    key: &'a [Source],
    pattern: &'a Pattern,
    /// See [`crate::plan::Lowered::is_closure`].
    is_link: bool,
}

/// Appends a partial match, extended by a row, where the row fits.
fn extend_match(block: &mut Vec<Symbol>, bound: &[Symbol], row: &[Symbol], pattern: &Pattern) {
    let start = block.len();
    block.extend_from_slice(bound);
    let longer = &mut block[start..];
    for &(column, variable) in &pattern.binds {
        longer[usize::from(variable)] = row[column];
    }
    if pattern.checks.iter().any(|&(column, source)| resolve(source, longer) != row[column]) {
        block.truncate(start);
    }
}

/// The value of a source under a match.
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

fn literals<'s>(symbols: &'s Symbols, sources: &[Source], bound: &[Symbol]) -> Option<Vec<&'s Literal>> {
    sources.iter().map(|&source| symbols.as_literal(resolve(source, bound))).collect()
}

/// Keeps the matches that pass a test, in place.
fn retain(mut block: Vec<Symbol>, width: usize, test: impl Fn(&[Symbol]) -> bool) -> Vec<Symbol> {
    let mut kept = 0;
    for start in (0..block.len()).step_by(width) {
        if test(&block[start..start + width]) {
            block.copy_within(start..start + width, kept);
            kept += width;
        }
    }
    block.truncate(kept);
    block
}
