//! Explanations of absent facts: for each rule that could derive a fact, the binding of its body that comes nearest
//! to satisfying the body.
//!
//! A depth-first branch-and-bound search finds the binding with the lowest weight of unsatisfied atoms (a
//! missing fact weighs more than a failed test). Ties are broken by the total numeric gap of failed built-ins and
//! aggregates. After a fixed number of nodes, the search ends as soon as it has a binding.

use std::fmt;

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};

use crate::aggregate::Function;
use crate::builtin::BuiltIn;
use crate::engine::Engine;
use crate::fact::Fact;
use crate::literal::{Decimal, Literal};
use crate::plan::{Comparison, Condition, Lowered};
use crate::rule::{Aggregate, RuleIdentity, Variable};
use crate::source::Source;
use crate::store::RelationId;
use crate::symbol::{Symbol, Symbols};

/// Number of nodes after which the search for one rule head ends, as soon as it has found a binding.
const SEARCH_LIMIT: usize = 20_000;

/// A rule that could derive a fact, with the unsatisfied part of its body.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NearMiss {
    /// Identity of the rule.
    pub identity: RuleIdentity,
    /// Variables of the rule, named without question mark, with their values in the best binding. `None` for a
    /// variable that an obstacle leaves unbound, or that is local to an aggregate.
    pub bindings: Vec<(String, Option<Symbol>)>,
    /// Facts that satisfy atoms of the body in the best binding.
    pub supports: Vec<Fact>,
    /// Unsatisfied atoms, without tests that have unbound variables.
    pub obstacles: Vec<Obstacle>,
}

/// An unsatisfied body atom.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Obstacle {
    /// A required fact does not hold.
    Missing {
        /// Class, property or relation.
        predicate: Symbol,
        /// Arguments of the missing fact; `None` for an argument that may have any value.
        arguments: Vec<Option<Symbol>>,
    },
    /// A negated fact holds.
    Present(Fact),
    /// A built-in is false.
    False {
        /// The built-in.
        built_in: BuiltIn,
        /// Arguments of the built-in; a function has its result first. An argument without a value, such
        /// as the result of a function that is undefined or not interned, is `None`.
        arguments: Vec<Option<Symbol>>,
        /// Exact absolute difference of the arguments, if the built-in has two and both are finite numbers;
        /// otherwise `None`.
        gap: Option<BigRational>,
    },
    /// A negated built-in is true.
    True {
        /// The built-in.
        built_in: BuiltIn,
        /// Arguments of the built-in.
        arguments: Vec<Symbol>,
    },
    /// An aggregate has another value than the required one, no value, or a value that the interner lacks.
    Aggregate {
        /// The aggregate.
        aggregate: Aggregate,
        /// Required value; `None` if none is required.
        wanted: Option<Symbol>,
        /// Actual value; `None` if the aggregate has no value.
        found: Option<Literal>,
        /// Exact absolute difference of the required and the actual value; `None` unless both are finite numbers.
        gap: Option<BigRational>,
    },
    /// Two terms must differ, but are equal or not known to differ; or they must be equal or possibly equal, but are
    /// not.
    Equality {
        /// First term.
        left: Symbol,
        /// Second term.
        right: Symbol,
        /// `true` if the terms must be equal or possibly equal, `false` if they must differ.
        wanted: bool,
    },
}

impl Obstacle {
    /// Formats the obstacle as one line, without a line break.
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
            Obstacle::True { built_in, arguments } => {
                let arguments: Vec<Option<Symbol>> = arguments.iter().copied().map(Some).collect();
                write!(f, "{}({}) is true", built_in.name(), self.arguments(&arguments))
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
    /// Returns the nearest miss of each rule head that unifies with the fact: the binding of the rule body with the
    /// lowest weight of unsatisfied atoms that a limited search finds. Empty if the fact holds, or if no rule head
    /// unifies with it.
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
        search.run(State { bound, open_conditions: (0..lowered.body.len()).collect(), ..State::default() });
        let best = search.best?;
        let rule = &self.program.rules[lowered.rule];
        let variables = (0..rule.variable_count()).map(|number| Variable(number as u16));
        let bindings = variables.map(|v| (rule.variable_name(v), best.bound[usize::from(v.0)])).collect();
        let (supports, obstacles) = (best.supports, best.obstacles);
        Some(NearMiss { identity: rule.identity.clone(), bindings, supports, obstacles })
    }
}

#[derive(Clone, Default)]
struct State {
    bound: Vec<Option<Symbol>>,
    open_conditions: Vec<usize>,
    supports: Vec<Fact>,
    obstacles: Vec<Obstacle>,
    distance: f64,
}

impl State {
    fn is_better_than(&self, other: &Self) -> bool {
        (self.weight(), self.distance) < (other.weight(), other.distance)
    }

    /// Returns the weight of the unsatisfied atoms. A missing fact weighs as much as two failed tests,
    /// because it hides the tests of its unbound variables.
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

/// The alternatives for a relation atom: each remaining row, and finally the missing fact.
struct Branch<'a> {
    state: State,
    predicate: Symbol,
    sources: &'a [Source],
    arguments: Vec<Option<Symbol>>,
    rows: std::vec::IntoIter<&'a [Symbol]>,
}

impl Branch<'_> {
    fn next_match(&mut self) -> Option<State> {
        for row in self.rows.by_ref() {
            let mut extended = self.state.clone();
            if unify(self.sources, row, &mut extended.bound) {
                extended.supports.push(Fact::new(self.predicate, row.iter().copied()));
                return Some(extended);
            }
        }
        None
    }

    fn unmatched(mut self) -> State {
        let (predicate, arguments) = (self.predicate, self.arguments);
        self.state.obstacles.push(Obstacle::Missing { predicate, arguments });
        self.state
    }
}

impl<'a> Search<'a> {
    /// Searches depth-first. The stack is explicit, because a body can have thousands of atoms.
    fn run(&mut self, start: State) {
        let mut branches: Vec<Branch<'a>> = self.visit(start).into_iter().collect();
        while let Some(mut branch) = branches.pop() {
            if self.is_over() {
                return;
            }
            let state = match branch.next_match() {
                Some(state) => {
                    branches.push(branch);
                    state
                }
                None => branch.unmatched(),
            };
            branches.extend(self.visit(state));
        }
    }

    /// Evaluates conditions up to the next relation atom and returns its alternatives. Returns `None` if there are no
    /// further conditions, or if the state cannot improve on the best one.
    fn visit(&mut self, mut state: State) -> Option<Branch<'a>> {
        loop {
            self.visited += 1;
            let cannot_improve = self.best.as_ref().is_some_and(|best| !state.is_better_than(best));
            if cannot_improve || self.is_over() {
                return None;
            }
            let Some(at) = self.next(&state) else {
                self.best = Some(state);
                return None;
            };
            let position = state.open_conditions.remove(at);
            match &self.lowered.body[position] {
                Condition::Relation(relation, sources) => return self.branch(state, *relation, sources),
                other => self.test(other, &mut state),
            }
        }
    }

    fn is_over(&self) -> bool {
        self.best.is_some() && self.visited > SEARCH_LIMIT
    }

    /// Returns the position in `open_conditions` of the next condition to visit. The order of preference is:
    /// a test with bound arguments, the relation with the most bound columns, any other condition.
    fn next(&self, state: &State) -> Option<usize> {
        let score = |position: usize| {
            let bound_count =
                |sources: &[Source]| sources.iter().filter(|&&s| value(s, &state.bound).is_some()).count();
            match &self.lowered.body[position] {
                Condition::Relation(_, sources) => 1 + bound_count(sources),
                Condition::Not(_, sources) | Condition::NotBuiltIn(_, sources)
                    if bound_count(sources) == sources.len() =>
                {
                    100
                }
                Condition::BuiltIn(built_in, sources) => {
                    let bound_flags: Vec<bool> =
                        sources.iter().map(|&s| value(s, &state.bound).is_some()).collect();
                    if built_in.binds(&bound_flags) { 100 } else { 0 }
                }
                Condition::Aggregate { group, .. } if bound_count(group) == group.len() => 100,
                Condition::Same(a, b) if bound_count(&[*a, *b]) > 0 => 100,
                Condition::Compare(_, a, b) if bound_count(&[*a, *b]) == 2 => 100,
                _ => 0,
            }
        };
        // `max_by_key` returns the last of several maxima; because of `rev`, this is the first condition.
        (0..state.open_conditions.len()).rev().max_by_key(|&at| score(state.open_conditions[at]))
    }

    fn branch(&self, state: State, relation: RelationId, sources: &'a [Source]) -> Option<Branch<'a>> {
        let predicate = self.engine.store.get(relation).predicate?;
        let arguments: Vec<Option<Symbol>> =
            sources.iter().map(|&source| value(source, &state.bound)).collect();
        let mut rows: Vec<&[Symbol]> = self.engine.matching_rows(predicate, &arguments).collect();
        // A fixed order makes the explanation reproducible.
        rows.sort_unstable();
        Some(Branch { state, predicate, sources, arguments, rows: rows.into_iter() })
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
                (Some(symbol), None) => bind(*right, symbol, &mut state.bound),
                (None, Some(symbol)) => bind(*left, symbol, &mut state.bound),
                _ => {}
            },
            Condition::NotBuiltIn(built_in, sources) => {
                let symbols = &self.engine.symbols;
                let arguments: Option<Vec<Symbol>> =
                    sources.iter().map(|&s| value(s, &state.bound)).collect();
                let Some(arguments) = arguments else { return };
                let values: Option<Vec<&Literal>> =
                    arguments.iter().map(|&symbol| symbols.as_literal(symbol)).collect();
                if values.is_some_and(|values| built_in.holds(&values)) {
                    state.obstacles.push(Obstacle::True { built_in: *built_in, arguments });
                }
            }
            Condition::Compare(comparison, left, right) => {
                if let (Some(left), Some(right)) = (value(*left, &state.bound), value(*right, &state.bound))
                    && !comparison.holds(&self.engine.symbols, left, right)
                {
                    let wanted = *comparison == Comparison::NotDifferent;
                    state.obstacles.push(Obstacle::Equality { left, right, wanted });
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
        let found = function.evaluate(self.engine.group(matches, group).map(|(_, row)| row), symbols);
        let wanted = value(result, &state.bound);
        let interned = found.as_ref().and_then(|found| symbols.find_literal(found));
        match (wanted, interned) {
            (None, Some(interned)) => bind(result, interned, &mut state.bound),
            (Some(wanted), Some(interned)) if wanted == interned => {}
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
        let as_input = |symbol: &Option<Symbol>| match symbol {
            Some(_) => literal(symbol).map(Some),
            None => Some(None),
        };
        let values: Option<Vec<Option<&Literal>>> = arguments.iter().map(as_input).collect();
        let open: Vec<Source> = sources
            .iter()
            .zip(&arguments)
            .filter(|(_, argument)| argument.is_none())
            .map(|(&s, _)| s)
            .collect();
        // Uses the first solution whose values are interned, because only such values can occur in facts.
        for solution in values.iter().flat_map(|values| built_in.solve(values)) {
            let interned: Option<Vec<Symbol>> =
                solution.iter().map(|value| symbols.find_literal(value)).collect();
            let mut bound = state.bound.clone();
            if interned.is_some_and(|interned| unify(&open, &interned, &mut bound)) {
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

/// Binds the operands that are unbound variables to the values of a row. Returns `false` if another
/// operand differs from its value in the row.
fn unify(sources: &[Source], row: &[Symbol], bound: &mut [Option<Symbol>]) -> bool {
    sources.iter().zip(row).all(|(&source, &symbol)| {
        let previous = value(source, bound);
        bind(source, symbol, bound);
        previous.is_none_or(|previous| previous == symbol)
    })
}
