//! Turns a rule into join plans: one per way in which a change can reach it, each an ordered list of steps.
//!
//! A plan starts from a row of one atom (its seed) and extends partial matches by one atom at a time, cheapest first:
//! tests as soon as their variables are bound, then the atom with the smallest expected number of matches, given the
//! columns bound so far and the size of its relation.

use crate::aggregate::Function;
use crate::builtin::BuiltIn;
use crate::cost::Costs;
use crate::limits::Budget;
use crate::source::Source;
use crate::store::{RelationId, Store, state};
use crate::symbol::Symbol;

/// Rows that no step of an insertion sees.
pub(crate) const HIDDEN: u8 = state::FREE | state::PENDING | state::DOOMED;

/// What a row must look like, and which variables it binds.
#[derive(Clone, Default, Debug)]
pub(crate) struct Pattern {
    /// Columns whose value binds a variable.
    pub binds: Vec<(usize, u16)>,
    /// Columns that must equal a value known by then.
    pub checks: Vec<(usize, Source)>,
}

impl Pattern {
    /// Whether a row may start a match: it has the constants where they have to be.
    pub fn may_fit(&self, row: &[Symbol]) -> bool {
        self.checks.iter().all(|&(column, source)| match source {
            Source::Constant(symbol) => row[column] == symbol,
            Source::Variable(_) => true,
        })
    }
}

/// One extension of a partial match.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    /// Rows of a relation; `index` is on the columns of `key`, in ascending order.
    Join {
        relation: RelationId,
        skip: u8,
        index: Option<usize>,
        key: Vec<Source>,
        pattern: Pattern,
        is_link: bool,
    },
    /// A row with all columns known.
    Contains { relation: RelationId, skip: u8, key: Vec<Source>, is_link: bool },
    /// No row with these columns.
    Absent { relation: RelationId, key: Vec<Source> },
    /// A built-in with all arguments known.
    Test { built_in: BuiltIn, arguments: Vec<Source> },
    /// A built-in that binds its first argument.
    Compute { built_in: BuiltIn, result: u16, arguments: Vec<Source> },
    /// A built-in that binds whatever is not known of its arguments, in any number of ways.
    Solve { built_in: BuiltIn, arguments: Vec<Source>, known: Vec<bool> },
    /// Binds a variable to a known value.
    Equate { variable: u16, source: Source },
    /// What an aggregate makes of a group: rows that agree on their first columns.
    Aggregate {
        matches: RelationId,
        function: Function,
        index: Option<usize>,
        group: Vec<Source>,
        result: Source,
        binds: bool,
    },
    /// Whether two known values are the same.
    Compare { left: Source, right: Source, equal: bool },
}

/// A seed and its extensions, up to a complete match of the rule's body.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Which compiled rule.
    pub rule: u32,
    pub seed: Pattern,
    /// Whether seeds are links, see [`Lowered::is_closure`].
    pub seed_is_link: bool,
    pub steps: Vec<Step>,
}

/// A head atom, to be filled in.
#[derive(Clone, Debug)]
pub(crate) struct Template {
    pub relation: RelationId,
    pub arguments: Vec<Source>,
}

/// A rule whose atoms name relations.
#[derive(Clone, Debug)]
pub(crate) struct Lowered {
    /// Position in the program.
    pub rule: usize,
    /// How many variables a match binds, at least 1.
    pub width: usize,
    pub heads: Vec<Template>,
    pub body: Vec<Condition>,
    /// Whether it says no more than that a relation is transitive. What it concludes are then chains of *links*, rows that
    /// were not concluded by it, so that its second condition needs links only: each conclusion is found once for each
    /// last link of a chain, and not once for each row in the middle.
    pub is_closure: bool,
}

impl Lowered {
    /// Whether heads and body are those of a transitive relation: `p(x, y), p(y, z) -> p(x, z)`.
    pub fn closes(heads: &[Template], body: &[Condition]) -> bool {
        let ([head], [Condition::Relation(first, left), Condition::Relation(second, right)]) = (heads, body)
        else {
            return false;
        };
        match (left[..].as_ref(), right[..].as_ref(), head.arguments[..].as_ref()) {
            ([Source::Variable(x), Source::Variable(y)], [middle, last], [from, to]) => {
                let (x, y) = (Source::Variable(*x), Source::Variable(*y));
                let distinct = x != y && x != *last && y != *last && matches!(last, Source::Variable(_));
                let chained = *middle == y && *from == x && to == last;
                distinct && chained && first == second && *first == head.relation
            }
            _ => false,
        }
    }
}

/// A body atom whose predicate is a relation.
#[derive(Clone, Debug)]
pub(crate) enum Condition {
    Relation(RelationId, Vec<Source>),
    Not(RelationId, Vec<Source>),
    BuiltIn(BuiltIn, Vec<Source>),
    /// The result of an aggregate over the rows of a relation that begin with the values of the group.
    Aggregate {
        matches: RelationId,
        function: Function,
        group: Vec<Source>,
        result: Source,
    },
    Same(Source, Source),
    Different(Source, Source),
}

impl Condition {
    /// The relation whose changes concern the condition.
    pub fn relation(&self) -> Option<RelationId> {
        match self {
            Self::Relation(relation, _) | Self::Not(relation, _) => Some(*relation),
            Self::Aggregate { matches, .. } => Some(*matches),
            Self::BuiltIn(..) | Self::Same(..) | Self::Different(..) => None,
        }
    }
}

/// The variables bound so far.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Bound(pub Vec<bool>);

impl Bound {
    pub fn knows(&self, source: Source) -> bool {
        match source {
            Source::Constant(_) => true,
            Source::Variable(number) => self.0[usize::from(number)],
        }
    }

    /// Which of some sources it knows.
    pub fn known(&self, sources: &[Source]) -> Vec<bool> {
        sources.iter().map(|&source| self.knows(source)).collect()
    }

    pub fn knows_all(&self, sources: &[Source]) -> bool {
        sources.iter().all(|&source| self.knows(source))
    }

    pub fn bind(&mut self, number: u16) {
        self.0[usize::from(number)] = true;
    }

    /// Matches a row against terms: known columns are checked, others bind.
    fn pattern(&mut self, columns: impl Iterator<Item = (usize, Source)>) -> Pattern {
        let mut pattern = Pattern::default();
        let (known, unknown): (Vec<_>, Vec<_>) = columns.partition(|&(_, source)| self.knows(source));
        pattern.checks = known;
        for (column, source) in unknown {
            match source {
                Source::Variable(number) if !self.knows(source) => {
                    self.bind(number);
                    pattern.binds.push((column, number));
                }
                _ => pattern.checks.push((column, source)),
            }
        }
        pattern
    }
}

/// Plans one lowered rule.
pub(crate) struct Planner<'a> {
    /// Gets the indexes that the plans look up.
    pub store: &'a mut Store,
    pub lowered: &'a Lowered,
    /// Which compiled rule the plans belong to.
    pub number: u32,
    pub costs: &'a Costs,
    pub budget: &'a Budget,
}

impl Planner<'_> {
    /// A plan that starts from a row of the condition at `position`. Conditions before it do not see fresh rows, so
    /// that each match is found from exactly one of its fresh rows.
    pub fn start_at_condition(&mut self, position: usize, exactly_once: bool) -> Option<Plan> {
        let fresh_from = if exactly_once { position } else { 0 };
        match &self.lowered.body[position] {
            Condition::Relation(_, sources) | Condition::Not(_, sources) => {
                self.plan(sources.clone(), Some(position), fresh_from)
            }
            // The rows say which group has changed; what it comes to is computed as a step.
            Condition::Aggregate { group, .. } => self.plan(group.clone(), None, fresh_from),
            _ => None,
        }
    }

    /// A plan that starts from a row of a head atom and looks for its support.
    pub fn start_at_head(&mut self, head: usize) -> Option<Plan> {
        self.plan(self.lowered.heads[head].arguments.clone(), None, 0)
    }

    /// A plan that starts from nothing.
    pub fn start_at_nothing(&mut self) -> Option<Plan> {
        self.plan(Vec::new(), None, 0)
    }

    /// `None` once the budget is spent, and where a condition stays unbound, which [`check`] rules out.
    fn plan(&mut self, seed: Vec<Source>, skip: Option<usize>, fresh_from: usize) -> Option<Plan> {
        if !self.budget.visit(1, self.number) {
            return None;
        }
        let mut bound = Bound(vec![false; self.lowered.width]);
        let seed = bound.pattern(seed.into_iter().enumerate());
        let seed_is_link = self.is_link(skip);
        let mut rest: Vec<usize> = (0..self.lowered.body.len()).filter(|&p| Some(p) != skip).collect();
        let mut steps = Vec::new();
        while !rest.is_empty() {
            if !self.budget.visit(rest.len() as u64, self.number) {
                return None;
            }
            let is_aggregate = |p: usize| matches!(self.lowered.body[p], Condition::Aggregate { .. });
            let ready = |p: usize| is_ready(&self.lowered.body[p], &bound);
            let test = rest.iter().position(|&p| ready(p) && !is_aggregate(p));
            let ready = test.or_else(|| rest.iter().position(|&p| ready(p)));
            let chosen = ready.or_else(|| self.cheapest(&rest, &bound))?;
            let position = rest.remove(chosen);
            let hidden = if position < fresh_from { HIDDEN | state::FRESH } else { HIDDEN };
            steps.push(self.step(position, hidden, &mut bound));
        }
        Some(Plan { rule: self.number, seed, seed_is_link, steps })
    }

    fn is_link(&self, position: Option<usize>) -> bool {
        self.lowered.is_closure && position == Some(1)
    }

    /// The position within `rest` of the relation with the fewest expected matches.
    fn cheapest(&self, rest: &[usize], bound: &Bound) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for (at, &position) in rest.iter().enumerate() {
            if let Condition::Relation(relation, sources) = &self.lowered.body[position] {
                let cost = self.expected_matches(*relation, sources, bound);
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, at));
                }
            }
        }
        best.map(|(_, at)| at)
    }

    fn expected_matches(&self, relation: RelationId, sources: &[Source], bound: &Bound) -> f64 {
        self.costs.matches(relation, (0..sources.len()).filter(|&column| bound.knows(sources[column])))
    }

    fn step(&mut self, position: usize, skip: u8, bound: &mut Bound) -> Step {
        let is_link = self.is_link(Some(position));
        match &self.lowered.body[position] {
            Condition::Relation(relation, sources) if bound.knows_all(sources) => {
                Step::Contains { relation: *relation, skip, key: sources.clone(), is_link }
            }
            Condition::Relation(relation, sources) => {
                let known = |column: &usize| bound.knows(sources[*column]);
                let columns: Vec<usize> = (0..sources.len()).filter(known).collect();
                let mask = columns.iter().fold(0, |mask, column| mask | 1 << column);
                // Of a closure, most rows are not links, and looking at each would cost more than all that is concluded.
                let without = is_link.then_some(self.number);
                let index = (mask != 0).then(|| self.store.get_mut(*relation).index_without(mask, without));
                let key = columns.iter().map(|&column| sources[column]).collect();
                let others =
                    sources.iter().copied().enumerate().filter(|(column, _)| mask & (1 << column) == 0);
                Step::Join { relation: *relation, skip, index, key, pattern: bound.pattern(others), is_link }
            }
            Condition::Not(relation, sources) => Step::Absent { relation: *relation, key: sources.clone() },
            Condition::BuiltIn(built_in, sources) => built_in_step(*built_in, sources, bound),
            Condition::Aggregate { matches, function, group, result } => {
                let mask = (0..group.len()).fold(0, |mask, column| mask | 1 << column);
                let index = (mask != 0).then(|| self.store.get_mut(*matches).index(mask));
                let binds = !bound.knows(*result);
                if let Source::Variable(number) = *result {
                    bound.bind(number);
                }
                let (matches, function, result) = (*matches, *function, *result);
                Step::Aggregate { matches, function, index, group: group.clone(), result, binds }
            }
            Condition::Same(left, right) => match (*left, *right) {
                (Source::Variable(variable), source) | (source, Source::Variable(variable))
                    if !bound.knows(Source::Variable(variable)) =>
                {
                    bound.bind(variable);
                    Step::Equate { variable, source }
                }
                (left, right) => Step::Compare { left, right, equal: true },
            },
            Condition::Different(left, right) => Step::Compare { left: *left, right: *right, equal: false },
        }
    }
}

/// A test, a function of the other arguments, or the more general way that gives values to any of them.
fn built_in_step(built_in: BuiltIn, sources: &[Source], bound: &mut Bound) -> Step {
    let known = bound.known(sources);
    for source in sources {
        if let Source::Variable(number) = *source {
            bound.bind(number);
        }
    }
    match (known.iter().position(|known| !known), sources.first()) {
        (None, _) => Step::Test { built_in, arguments: sources.to_vec() },
        (Some(0), Some(&Source::Variable(result))) if built_in.is_function() => {
            Step::Compute { built_in, result, arguments: sources[1..].to_vec() }
        }
        _ => Step::Solve { built_in, arguments: sources.to_vec(), known },
    }
}

/// Whether a condition that does not enumerate rows can be evaluated.
fn is_ready(condition: &Condition, bound: &Bound) -> bool {
    match condition {
        Condition::Same(left, right) => bound.knows(*left) || bound.knows(*right),
        Condition::BuiltIn(built_in, sources) => built_in.binds(&bound.known(sources)),
        Condition::Aggregate { group, .. } => bound.knows_all(group),
        Condition::Relation(_, sources) | Condition::Not(_, sources) => bound.knows_all(sources),
        Condition::Different(left, right) => bound.knows(*left) && bound.knows(*right),
    }
}
