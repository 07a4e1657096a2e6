//! Compiles a rule into join plans: one plan for each relation, negation or aggregate in the body, one for each
//! head atom, for rederivation, and one for the first evaluation. A plan is a list of steps.
//!
//! A plan starts from a row of one atom (its seed), or from the empty match, and extends partial matches by one
//! atom at a time. The order is greedy. Tests come as soon as their variables are bound, then the atom with the
//! smallest expected number of matches.

use crate::aggregate::Function;
use crate::builtin::BuiltIn;
use crate::cost::Costs;
use crate::limits::Budget;
use crate::source::Source;
use crate::store::{RelationId, Store, state};
use crate::symbol::{Symbol, Symbols};

/// State bits of the rows that are invisible to plans that derive facts.
pub(crate) const HIDDEN: u8 = state::FREE | state::PENDING | state::DOOMED;

#[derive(Clone, Default, Debug)]
pub(crate) struct Pattern {
    /// Columns that bind a variable, each with the number of the variable.
    pub binds: Vec<(usize, u16)>,
    /// Columns that must equal an operand: a constant, or a variable that is already bound.
    pub checks: Vec<(usize, Source)>,
}

impl Pattern {
    /// Returns `true` if a row has the constants of the pattern, so that it may start a match. Variables
    /// are not compared.
    pub fn may_fit(&self, row: &[Symbol]) -> bool {
        self.checks.iter().all(|&(column, source)| match source {
            Source::Constant(symbol) => row[column] == symbol,
            Source::Variable(_) => true,
        })
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Step {
    /// Extends a match by the rows that contain `key` in the columns of `index` and fit `pattern`. The key
    /// is in ascending order of the columns; without an index, all rows are visited. Ignores rows with a state
    /// bit of `skip` and, if `is_link`, rows that the rule itself derived.
    Join {
        relation: RelationId,
        skip: u8,
        index: Option<usize>,
        key: Vec<Source>,
        pattern: Pattern,
        is_link: bool,
    },
    /// Tests that a relation contains a row; all columns are bound. `skip` and `is_link` exclude rows as for
    /// [`Step::Join`].
    Contains {
        relation: RelationId,
        skip: u8,
        key: Vec<Source>,
        is_link: bool,
    },
    /// Tests that a relation does not contain a row; all columns are bound.
    Absent {
        relation: RelationId,
        key: Vec<Source>,
    },
    Test {
        built_in: BuiltIn,
        arguments: Vec<Source>,
        negated: bool,
    },
    Compute {
        built_in: BuiltIn,
        result: u16,
        arguments: Vec<Source>,
    },
    Solve {
        built_in: BuiltIn,
        arguments: Vec<Source>,
        known: Vec<bool>,
    },
    Equate {
        variable: u16,
        source: Source,
    },
    /// Computes an aggregate over the rows of `matches` whose first columns equal `group`. The result
    /// binds a variable (`binds`) or is compared with an operand.
    Aggregate {
        matches: RelationId,
        function: Function,
        index: Option<usize>,
        group: Vec<Source>,
        result: Source,
        binds: bool,
    },
    Compare {
        comparison: Comparison,
        left: Source,
        right: Source,
    },
}

/// Comparison of two symbols. Under equality, names are compared by their representatives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Comparison {
    Same,
    /// Negation as failure of `Same`.
    NotSame,
    /// Certain difference under the unique name assumption.
    Different,
    /// Negation as failure of `Different`.
    NotDifferent,
    /// Condition that the two terms in the head of an equality rule are neither identical nor literals that may have
    /// the same value. It avoids trivial conclusions `sameAs(x, x)`. Unlike [`Self::Different`], it also holds for
    /// fresh individuals.
    Guard,
}

impl Comparison {
    pub fn holds(self, symbols: &Symbols, left: Symbol, right: Symbol) -> bool {
        match self {
            Self::Same => left == right,
            Self::NotSame => left != right,
            Self::Different => symbols.differ(left, right),
            Self::NotDifferent => !symbols.differ(left, right),
            Self::Guard => symbols.are_distinct(left, right),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Number of the compiled rule.
    pub rule: u32,
    pub seed: Pattern,
    /// `true` if only links (rows that the rule itself did not derive) can be seeds, see
    /// [`Lowered::is_closure`].
    pub seed_is_link: bool,
    pub steps: Vec<Step>,
}

#[derive(Clone, Debug)]
pub(crate) struct Template {
    pub relation: RelationId,
    pub arguments: Vec<Source>,
}

#[derive(Clone, Debug)]
pub(crate) struct Lowered {
    /// Position of the rule in the program.
    pub rule: usize,
    /// Number of variables of a match, at least 1.
    pub width: usize,
    pub heads: Vec<Template>,
    pub body: Vec<Condition>,
    /// `true` if the rule states only that a relation is transitive: `r(?x, ?y) ^ r(?y, ?z) -> r(?x, ?z)`. Its second
    /// atom is then matched only with *links*, i.e. rows that this rule did not derive. Every conclusion is a chain
    /// of links, and is found once for each possible last link instead of once for each name in the middle.
    pub is_closure: bool,
}

impl Lowered {
    pub fn compares_names(&self) -> bool {
        self.body.iter().any(|condition| matches!(condition, Condition::Compare(Comparison::NotSame, ..)))
    }

    pub fn is_transitivity(heads: &[Template], body: &[Condition]) -> bool {
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

#[derive(Clone, Debug)]
pub(crate) enum Condition {
    Relation(RelationId, Vec<Source>),
    Not(RelationId, Vec<Source>),
    BuiltIn(BuiltIn, Vec<Source>),
    NotBuiltIn(BuiltIn, Vec<Source>),
    Aggregate {
        matches: RelationId,
        function: Function,
        group: Vec<Source>,
        result: Source,
    },
    /// Both operands are equal. Binds an operand that is an unbound variable.
    Same(Source, Source),
    /// A comparison of bound operands.
    Compare(Comparison, Source, Source),
}

impl Condition {
    pub fn relation(&self) -> Option<RelationId> {
        match self {
            Self::Relation(relation, _) | Self::Not(relation, _) => Some(*relation),
            Self::Aggregate { matches, .. } => Some(*matches),
            Self::BuiltIn(..) | Self::NotBuiltIn(..) | Self::Same(..) | Self::Compare(..) => None,
        }
    }
}

#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Bound(pub Vec<bool>);

impl Bound {
    pub fn is_bound(&self, source: Source) -> bool {
        match source {
            Source::Constant(_) => true,
            Source::Variable(number) => self.0[usize::from(number)],
        }
    }

    pub fn bound_flags(&self, sources: &[Source]) -> Vec<bool> {
        sources.iter().map(|&source| self.is_bound(source)).collect()
    }

    pub fn are_bound(&self, sources: &[Source]) -> bool {
        sources.iter().all(|&source| self.is_bound(source))
    }

    pub fn bind(&mut self, number: u16) {
        self.0[usize::from(number)] = true;
    }

    fn pattern(&mut self, columns: impl Iterator<Item = (usize, Source)>) -> Pattern {
        let mut pattern = Pattern::default();
        let (known, unknown): (Vec<_>, Vec<_>) = columns.partition(|&(_, source)| self.is_bound(source));
        pattern.checks = known;
        for (column, source) in unknown {
            match source {
                Source::Variable(number) if !self.is_bound(source) => {
                    // A variable may occur in two columns: the first one binds it, the second one is
                    // checked.
                    self.bind(number);
                    pattern.binds.push((column, number));
                }
                _ => pattern.checks.push((column, source)),
            }
        }
        pattern
    }
}

pub(crate) struct Planner<'a> {
    /// Store, to which the planner adds the indexes that the plans need.
    pub store: &'a mut Store,
    pub lowered: &'a Lowered,
    pub number: u32,
    pub costs: &'a Costs,
    pub budget: &'a Budget,
}

impl Planner<'_> {
    /// Creates a plan that starts from a row of the body condition at `position`. Returns `None` if the plan
    /// cannot be completed.
    ///
    /// If `exactly_once`, the conditions before `position` match no fresh rows (rows in the delta of the
    /// current round). A match with several fresh rows is then found only from the first of them.
    pub fn start_at_condition(&mut self, position: usize, exactly_once: bool) -> Option<Plan> {
        let fresh_from = if exactly_once { position } else { 0 };
        match &self.lowered.body[position] {
            Condition::Relation(_, sources) | Condition::Not(_, sources) => {
                self.plan(sources.clone(), Some(position), fresh_from)
            }
            // The row only identifies the group with a change. A step of the plan computes the aggregate.
            Condition::Aggregate { group, .. } => self.plan(group.clone(), None, fresh_from),
            _ => None,
        }
    }

    pub fn start_at_head(&mut self, head: usize) -> Option<Plan> {
        self.plan(self.lowered.heads[head].arguments.clone(), None, 0)
    }

    pub fn start_at_nothing(&mut self) -> Option<Plan> {
        self.plan(Vec::new(), None, 0)
    }

    /// Creates a plan that starts from a row with the operands `seed`, which is the row of condition `skip` if given.
    /// Conditions before `fresh_from` match no fresh rows. Returns `None` if planning is interrupted, or if a
    /// condition remains unbound, which [`crate::safety::check`] rules out.
    fn plan(&mut self, seed: Vec<Source>, skip: Option<usize>, fresh_from: usize) -> Option<Plan> {
        if !self.budget.visit(1, self.number) {
            return None;
        }
        let mut bound = Bound(vec![false; self.lowered.width]);
        let seed = bound.pattern(seed.into_iter().enumerate());
        let seed_is_link = self.is_link(skip);
        let mut remaining: Vec<usize> = (0..self.lowered.body.len()).filter(|&p| Some(p) != skip).collect();
        let mut steps = Vec::new();
        while !remaining.is_empty() {
            if !self.budget.visit(remaining.len() as u64, self.number) {
                return None;
            }
            let is_aggregate = |p: usize| matches!(self.lowered.body[p], Condition::Aggregate { .. });
            let ready = |p: usize| is_ready(&self.lowered.body[p], &bound);
            // Tests come before aggregates, because an aggregate is more expensive.
            let test = remaining.iter().position(|&p| ready(p) && !is_aggregate(p));
            let ready = test.or_else(|| remaining.iter().position(|&p| ready(p)));
            let chosen = ready.or_else(|| self.cheapest(&remaining, &bound))?;
            let position = remaining.remove(chosen);
            let hidden = if position < fresh_from { HIDDEN | state::FRESH } else { HIDDEN };
            steps.push(self.step(position, hidden, &mut bound));
        }
        Some(Plan { rule: self.number, seed, seed_is_link, steps })
    }

    fn is_link(&self, position: Option<usize>) -> bool {
        self.lowered.is_closure && position == Some(1)
    }

    /// Returns the index within `remaining` of the relation condition with the fewest expected matches;
    /// `None` without a relation condition.
    fn cheapest(&self, remaining: &[usize], bound: &Bound) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for (index, &position) in remaining.iter().enumerate() {
            if let Condition::Relation(relation, sources) = &self.lowered.body[position] {
                let cost = self.expected_matches(*relation, sources, bound);
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, index));
                }
            }
        }
        best.map(|(_, index)| index)
    }

    fn expected_matches(&self, relation: RelationId, sources: &[Source], bound: &Bound) -> f64 {
        self.costs.matches(relation, (0..sources.len()).filter(|&column| bound.is_bound(sources[column])))
    }

    fn step(&mut self, position: usize, skip: u8, bound: &mut Bound) -> Step {
        let is_link = self.is_link(Some(position));
        match &self.lowered.body[position] {
            Condition::Relation(relation, sources) if bound.are_bound(sources) => {
                Step::Contains { relation: *relation, skip, key: sources.clone(), is_link }
            }
            Condition::Relation(relation, sources) => {
                let is_known = |column: &usize| bound.is_bound(sources[*column]);
                let columns: Vec<usize> = (0..sources.len()).filter(is_known).collect();
                let mask = columns.iter().fold(0, |mask, column| mask | 1 << column);
                // Few rows of a transitive relation are links (rows that the rule itself did not derive). An index
                // for links omits the other rows, because visiting them would take most of the time.
                let excluded_rule = is_link.then_some(self.number);
                let index =
                    (mask != 0).then(|| self.store.get_mut(*relation).index_without(mask, excluded_rule));
                let key = columns.iter().map(|&column| sources[column]).collect();
                let open_columns =
                    sources.iter().copied().enumerate().filter(|(column, _)| mask & (1 << column) == 0);
                Step::Join {
                    relation: *relation,
                    skip,
                    index,
                    key,
                    pattern: bound.pattern(open_columns),
                    is_link,
                }
            }
            Condition::Not(relation, sources) => Step::Absent { relation: *relation, key: sources.clone() },
            Condition::BuiltIn(built_in, sources) => built_in_step(*built_in, sources, bound),
            Condition::NotBuiltIn(built_in, sources) => {
                Step::Test { built_in: *built_in, arguments: sources.clone(), negated: true }
            }
            Condition::Aggregate { matches, function, group, result } => {
                // The columns of the group are the first ones of a match row.
                let mask = (0..group.len()).fold(0, |mask, column| mask | 1 << column);
                let index = (mask != 0).then(|| self.store.get_mut(*matches).index(mask));
                let binds = !bound.is_bound(*result);
                if let Source::Variable(number) = *result {
                    bound.bind(number);
                }
                let (matches, function, result) = (*matches, *function, *result);
                Step::Aggregate { matches, function, index, group: group.clone(), result, binds }
            }
            Condition::Same(left, right) => match (*left, *right) {
                (Source::Variable(variable), source) | (source, Source::Variable(variable))
                    if !bound.is_bound(Source::Variable(variable)) =>
                {
                    bound.bind(variable);
                    Step::Equate { variable, source }
                }
                (left, right) => Step::Compare { comparison: Comparison::Same, left, right },
            },
            Condition::Compare(comparison, left, right) => {
                Step::Compare { comparison: *comparison, left: *left, right: *right }
            }
        }
    }
}

fn built_in_step(built_in: BuiltIn, sources: &[Source], bound: &mut Bound) -> Step {
    let known = bound.bound_flags(sources);
    for source in sources {
        if let Source::Variable(number) = *source {
            bound.bind(number);
        }
    }
    match (known.iter().position(|known| !known), sources.first()) {
        (None, _) => Step::Test { built_in, arguments: sources.to_vec(), negated: false },
        (Some(0), Some(&Source::Variable(result))) if built_in.is_function() => {
            Step::Compute { built_in, result, arguments: sources[1..].to_vec() }
        }
        _ => Step::Solve { built_in, arguments: sources.to_vec(), known },
    }
}

/// Returns `true` if a condition can be evaluated without extending the match by rows of a relation.
fn is_ready(condition: &Condition, bound: &Bound) -> bool {
    match condition {
        Condition::Same(left, right) => bound.is_bound(*left) || bound.is_bound(*right),
        Condition::BuiltIn(built_in, sources) => built_in.binds(&bound.bound_flags(sources)),
        Condition::Aggregate { group, .. } => bound.are_bound(group),
        Condition::Relation(_, sources) | Condition::Not(_, sources) | Condition::NotBuiltIn(_, sources) => {
            bound.are_bound(sources)
        }
        Condition::Compare(_, left, right) => bound.is_bound(*left) && bound.is_bound(*right),
    }
}
