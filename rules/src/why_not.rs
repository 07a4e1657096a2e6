//! Why a fact does not hold: for each rule that could conclude it, the nearest its body comes to being satisfied.
//!
//! A body is searched depth first for the binding that leaves the fewest atoms unsatisfied (missing facts weigh more
//! than failed tests), and among those the one whose failing comparisons miss by the least; the search gives up on
//! improving after a fixed number of nodes.

use std::fmt;

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};

use crate::aggregate::Function;
use crate::builtin::BuiltIn;
use crate::engine::Engine;
use crate::fact::Fact;
use crate::literal::{Decimal, Literal};
use crate::plan::{Condition, Lowered};
use crate::rule::{Aggregate, RuleIdentity, Variable};
use crate::source::Source;
use crate::store::RelationId;
use crate::symbol::{Symbol, Symbols};

/// Nodes visited per rule before the best binding so far is taken.
const SEARCH_LIMIT: usize = 20_000;

/// A rule that could conclude a fact, and what is in its way.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NearMiss {
    /// Which rule.
    pub identity: RuleIdentity,
    /// The rule's variables, named without question mark, and the values that satisfy most; `None` where an obstacle
    /// leaves a variable open.
    pub bindings: Vec<(String, Option<Symbol>)>,
    /// The facts that satisfy part of the body.
    pub supports: Vec<Fact>,
    /// The atoms that are not satisfied. Tests whose variables are open are left out.
    pub obstacles: Vec<Obstacle>,
}

/// A body atom that is not satisfied.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Obstacle {
    /// No such fact holds.
    Missing {
        /// Class, property or relation.
        predicate: Symbol,
        /// `None` where any value would do.
        arguments: Vec<Option<Symbol>>,
    },
    /// A fact holds that must not.
    Present(Fact),
    /// A built-in is false.
    False {
        /// Which.
        built_in: BuiltIn,
        /// Its arguments; the result of a function comes first, `None` where it is undefined
        /// or a value that occurs nowhere.
        arguments: Vec<Option<Symbol>>,
        /// How far two numbers that are compared lie apart, exactly.
        gap: Option<BigRational>,
    },
    /// An aggregate has another value, or none.
    Aggregate {
        /// Which.
        aggregate: Aggregate,
        /// The value that it would have to have; `None` where any would do.
        wanted: Option<Symbol>,
        /// The value that it has.
        found: Option<Literal>,
        /// How far two numbers lie apart, exactly.
        gap: Option<BigRational>,
    },
    /// Two terms are, or are not, the same although they must not, or must.
    Equality {
        /// The first.
        left: Symbol,
        /// The second.
        right: Symbol,
        /// Whether they would have to be the same.
        wanted: bool,
    },
}

impl Obstacle {
    /// Prints what is missing or wrong, in a line without its end.
    pub fn display<'a>(&'a self, symbols: &'a Symbols) -> impl fmt::Display + 'a {
        DisplayObstacle { obstacle: self, symbols }
    }
}

struct DisplayObstacle<'a> {
    obstacle: &'a Obstacle,
    symbols: &'a Symbols,
}

impl DisplayObstacle<'_> {
    fn arguments(&self, arguments: &[Option<Symbol>]) -> String {
        let name = |symbol: &Option<Symbol>| match symbol {
            Some(symbol) => self.symbols.value(*symbol).to_string(),
            None => "?".to_string(),
        };
        arguments.iter().map(name).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for DisplayObstacle<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.obstacle {
            Obstacle::Missing { predicate, arguments } => {
                write!(f, "missing {}({})", self.symbols.value(*predicate), self.arguments(arguments))
            }
            Obstacle::Present(fact) => write!(f, "but {}", fact.display(self.symbols)),
            Obstacle::False { built_in, arguments, gap } => {
                write!(f, "{}({}) is false", built_in.name(), self.arguments(arguments))?;
                match gap {
                    Some(gap) => write!(f, ", by {}", Decimal::from_rational(gap)),
                    None => Ok(()),
                }
            }
            Obstacle::Aggregate { aggregate, wanted, found, gap } => {
                match found {
                    Some(found) => write!(f, "{} is {found}", aggregate.name())?,
                    None => write!(f, "there is no {}", aggregate.name())?,
                }
                if let Some(wanted) = wanted {
                    write!(f, ", not {}", self.symbols.value(*wanted))?;
                }
                match gap {
                    Some(gap) => write!(f, ", by {}", Decimal::from_rational(gap)),
                    None => Ok(()),
                }
            }
            Obstacle::Equality { left, right, wanted } => {
                let verb = if *wanted { "is not" } else { "is the same as" };
                write!(f, "{} {verb} {}", self.symbols.value(*left), self.symbols.value(*right))
            }
        }
    }
}

impl Engine {
    /// For each rule head that could be this fact, in the order of rules, how near its body comes to being satisfied.
    /// Empty where the fact holds, or where no rule could conclude it.
    pub fn why_not(&self, fact: &Fact) -> Vec<NearMiss> {
        let relation = self.store.find(fact.predicate, fact.arguments.len());
        let Some(relation) = relation.filter(|_| !self.holds(fact)) else { return Vec::new() };
        let normal = self.equality.as_ref().map(|equality| equality.normal(fact));
        let fact = normal.as_ref().unwrap_or(fact);
        let mut misses = Vec::new();
        for lowered in &self.network.rules {
            for head in lowered.heads.iter().filter(|head| head.relation == relation) {
                let mut bound = vec![None; lowered.width];
                if unify(&head.arguments, &fact.arguments, &mut bound) {
                    misses.extend(self.near_miss(lowered, bound));
                }
            }
        }
        misses
    }

    fn near_miss(&self, lowered: &Lowered, bound: Vec<Option<Symbol>>) -> Option<NearMiss> {
        let mut search = Search { engine: self, lowered, visited: 0, best: None };
        search.visit(State { bound, rest: (0..lowered.body.len()).collect(), ..State::default() });
        let best = search.best?;
        let rule = &self.program.rules[lowered.rule];
        let variables = (0..rule.variable_count()).map(|number| Variable(number as u16));
        let bindings = variables.map(|v| (rule.variable_name(v), best.bound[usize::from(v.0)])).collect();
        let (supports, obstacles) = (best.supports, best.obstacles);
        Some(NearMiss { identity: rule.identity.clone(), bindings, supports, obstacles })
    }
}

/// A partial binding and what it leaves unsatisfied.
#[derive(Clone, Default)]
struct State {
    bound: Vec<Option<Symbol>>,
    rest: Vec<usize>,
    supports: Vec<Fact>,
    obstacles: Vec<Obstacle>,
    distance: f64,
}

impl State {
    fn is_better_than(&self, other: &Self) -> bool {
        (self.weight(), self.distance) < (other.weight(), other.distance)
    }

    /// A missing fact weighs as much as two failed tests, because it hides the tests on what it would bind.
    fn weight(&self) -> usize {
        let weigh = |obstacle: &Obstacle| if matches!(obstacle, Obstacle::Missing { .. }) { 2 } else { 1 };
        self.obstacles.iter().map(weigh).sum()
    }
}

struct Search<'a> {
    engine: &'a Engine,
    lowered: &'a Lowered,
    visited: usize,
    best: Option<State>,
}

impl Search<'_> {
    fn visit(&mut self, mut state: State) {
        self.visited += 1;
        let hopeless = self.best.as_ref().is_some_and(|best| !state.is_better_than(best));
        if hopeless || self.is_over() {
            return;
        }
        let Some(at) = self.next(&state) else {
            self.best = Some(state);
            return;
        };
        let position = state.rest.remove(at);
        match &self.lowered.body[position] {
            Condition::Relation(relation, sources) => self.branch(&state, *relation, sources),
            other => {
                self.test(other, &mut state);
                self.visit(state);
            }
        }
    }

    fn is_over(&self) -> bool {
        self.best.is_some() && self.visited > SEARCH_LIMIT
    }

    /// The next condition: a test whose values are known, then the relation with the most columns known, then what is
    /// left.
    fn next(&self, state: &State) -> Option<usize> {
        let score = |position: usize| {
            let known =
                |sources: &[Source]| sources.iter().filter(|&&s| value(s, &state.bound).is_some()).count();
            match &self.lowered.body[position] {
                Condition::Relation(_, sources) => 1 + known(sources),
                Condition::Not(_, sources) if known(sources) == sources.len() => 100,
                Condition::BuiltIn(built_in, sources) => {
                    let known: Vec<bool> =
                        sources.iter().map(|&s| value(s, &state.bound).is_some()).collect();
                    if built_in.binds(&known) { 100 } else { 0 }
                }
                Condition::Aggregate { group, .. } if known(group) == group.len() => 100,
                Condition::Same(a, b) if known(&[*a, *b]) > 0 => 100,
                Condition::Different(a, b) if known(&[*a, *b]) == 2 => 100,
                _ => 0,
            }
        };
        (0..state.rest.len()).rev().max_by_key(|&at| score(state.rest[at]))
    }

    /// Tries every row that fits, then none.
    fn branch(&mut self, state: &State, relation: RelationId, sources: &[Source]) {
        let Some(predicate) = self.engine.store.get(relation).predicate else { return };
        let arguments: Vec<Option<Symbol>> =
            sources.iter().map(|&source| value(source, &state.bound)).collect();
        let mut rows: Vec<&[Symbol]> = self.engine.matching_rows(predicate, &arguments).collect();
        rows.sort_unstable();
        for row in rows {
            if self.is_over() {
                break;
            }
            let mut longer = state.clone();
            if unify(sources, row, &mut longer.bound) {
                longer.supports.push(Fact::new(predicate, row.iter().copied()));
                self.visit(longer);
            }
        }
        let mut without = state.clone();
        without.obstacles.push(Obstacle::Missing { predicate, arguments });
        self.visit(without);
    }

    fn test(&self, condition: &Condition, state: &mut State) {
        match condition {
            Condition::Not(relation, sources) => {
                let arguments: Option<Vec<Symbol>> =
                    sources.iter().map(|&s| value(s, &state.bound)).collect();
                let predicate = self.engine.store.get(*relation).predicate;
                if let (Some(arguments), Some(predicate)) = (arguments, predicate) {
                    let fact = Fact::new(predicate, arguments);
                    if self.engine.row_state(&fact).is_some() {
                        state.obstacles.push(Obstacle::Present(fact));
                    }
                }
            }
            Condition::BuiltIn(built_in, sources) => self.built_in(*built_in, sources, state),
            Condition::Same(left, right) => match (value(*left, &state.bound), value(*right, &state.bound)) {
                (Some(left), Some(right)) if left != right => {
                    state.obstacles.push(Obstacle::Equality { left, right, wanted: true });
                }
                (Some(known), None) => bind(*right, known, &mut state.bound),
                (None, Some(known)) => bind(*left, known, &mut state.bound),
                _ => {}
            },
            Condition::Different(left, right) => {
                if let (Some(left), Some(right)) = (value(*left, &state.bound), value(*right, &state.bound))
                    && !self.engine.symbols.differ(left, right)
                {
                    state.obstacles.push(Obstacle::Equality { left, right, wanted: false });
                }
            }
            Condition::Aggregate { matches, function, group, result } => {
                let group: Option<Vec<Symbol>> = group.iter().map(|&s| value(s, &state.bound)).collect();
                if let Some(group) = group {
                    self.aggregate(*matches, *function, &group, *result, state);
                }
            }
            Condition::Relation(..) => {}
        }
    }

    fn aggregate(
        &self,
        matches: RelationId,
        function: Function,
        group: &[Symbol],
        result: Source,
        state: &mut State,
    ) {
        let symbols = &self.engine.symbols;
        let found = function.of(self.engine.group(matches, group).map(|(_, row)| row), symbols);
        let wanted = value(result, &state.bound);
        let known = found.as_ref().and_then(|found| symbols.find_literal(found));
        match (wanted, known) {
            (None, Some(known)) => bind(result, known, &mut state.bound),
            (Some(wanted), Some(known)) if wanted == known => {}
            _ => {
                let number = |literal: &Literal| literal.as_rational();
                let wanted_number = wanted.and_then(|wanted| symbols.as_literal(wanted)).and_then(number);
                let gap = found.as_ref().and_then(number).zip(wanted_number).map(|(a, b)| (a - b).abs());
                state.distance += gap.as_ref().and_then(ToPrimitive::to_f64).unwrap_or(0.0);
                let aggregate = function.aggregate;
                state.obstacles.push(Obstacle::Aggregate { aggregate, wanted, found, gap });
            }
        }
    }

    fn built_in(&self, built_in: BuiltIn, sources: &[Source], state: &mut State) {
        let symbols = &self.engine.symbols;
        let arguments: Vec<Option<Symbol>> = sources.iter().map(|&s| value(s, &state.bound)).collect();
        let literal = |symbol: &Option<Symbol>| symbol.and_then(|symbol| symbols.as_literal(symbol));
        if !built_in.binds(&arguments.iter().map(Option::is_some).collect::<Vec<_>>()) {
            return;
        }
        let known = |symbol: &Option<Symbol>| match symbol {
            Some(_) => literal(symbol).map(Some),
            None => Some(None),
        };
        let values: Option<Vec<Option<&Literal>>> = arguments.iter().map(known).collect();
        let open: Vec<Source> =
            sources.iter().zip(&arguments).filter(|(_, known)| known.is_none()).map(|(&s, _)| s).collect();
        // Of several ways the first that the knowledge has values for.
        for solution in values.iter().flat_map(|values| built_in.solve(values)) {
            let found: Option<Vec<Symbol>> =
                solution.iter().map(|value| symbols.find_literal(value)).collect();
            let mut bound = state.bound.clone();
            if found.is_some_and(|found| unify(&open, &found, &mut bound)) {
                state.bound = bound;
                return;
            }
        }
        let gap = match values.as_deref() {
            Some([Some(left), Some(right)]) => {
                left.as_rational().zip(right.as_rational()).map(|(left, right)| (left - right).abs())
            }
            _ => None,
        };
        state.distance += gap.as_ref().and_then(ToPrimitive::to_f64).unwrap_or(0.0);
        state.obstacles.push(Obstacle::False { built_in, arguments, gap });
    }
}

fn value(source: Source, bound: &[Option<Symbol>]) -> Option<Symbol> {
    match source {
        Source::Constant(symbol) => Some(symbol),
        Source::Variable(number) => bound[usize::from(number)],
    }
}

fn bind(source: Source, symbol: Symbol, bound: &mut [Option<Symbol>]) {
    if let Source::Variable(number) = source {
        bound[usize::from(number)] = Some(symbol);
    }
}

/// Binds the variables of terms to a row's values; `false` where they do not fit.
fn unify(sources: &[Source], row: &[Symbol], bound: &mut [Option<Symbol>]) -> bool {
    sources.iter().zip(row).all(|(&source, &symbol)| {
        let known = value(source, bound);
        bind(source, symbol, bound);
        known.is_none_or(|known| known == symbol)
    })
}
