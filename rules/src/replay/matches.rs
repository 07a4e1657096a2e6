//! Matches of a rule's body among facts that do not change: atom by atom, the one with the fewest rows next, the others as
//! soon as their variables have values.

use std::collections::BTreeSet;
use std::rc::Rc;

use crate::aggregate::Function;
use crate::builtin::BuiltIn;
use crate::fact::Fact;
use crate::literal::Literal;
use crate::replay::facts::Facts;
use crate::replay::names::Names;
use crate::rule::{Aggregate, Atom, Rule, Term, Variable};
use crate::source::Source;
use crate::symbol::{Symbol, Symbols};

/// With more matches of one body, none is looked at.
const MATCH_LIMIT: usize = 1 << 21;

/// The value of each variable of a rule, where it has one.
pub(super) type Values = Vec<Option<Symbol>>;

pub(super) fn value(term: Term, values: &Values) -> Option<Symbol> {
    match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(Variable(number)) => values[usize::from(number)],
    }
}

/// A relation under values of all its variables.
pub(super) fn instance(predicate: Symbol, terms: &[Term], values: &Values) -> Option<Fact> {
    let arguments: Option<Vec<Symbol>> = terms.iter().map(|term| value(*term, values)).collect();
    Some(Fact::new(predicate, arguments?))
}

pub(super) struct Matcher<'m> {
    pub symbols: &'m mut Symbols,
    /// About the first name of each individual.
    pub facts: &'m Facts,
    pub names: &'m Names,
    /// Whether names may be one.
    pub equality: bool,
    /// Whether names that may be one were asked to differ: then there is no telling by what holds alone.
    pub names_differ: bool,
    /// Whether a body has more matches than there is room for.
    pub too_many: bool,
}

/// The variables that an aggregate takes from the other atoms of a body.
fn group(body: &[Atom], at: usize) -> Vec<Term> {
    let others = body.iter().enumerate().filter(|(other, _)| *other != at);
    let outside: BTreeSet<Term> = others
        .flat_map(|(_, other)| match other {
            Atom::Aggregate { result, .. } => vec![*result],
            other => other.terms(),
        })
        .collect();
    let own = body[at].terms().into_iter().skip(1);
    own.filter(|term| term.as_variable().is_some() && outside.contains(term)).collect()
}

impl Matcher<'_> {
    /// All matches of a rule's body, in first names.
    pub fn all(&mut self, rule: &Rule) -> Vec<Values> {
        let mut found = Vec::new();
        let open: Vec<usize> = (0..rule.body.len()).collect();
        self.extend(&rule.body, &open, vec![None; rule.variable_count()], &mut found);
        found
    }

    /// Adds all matches of the open atoms of a body that extend some values, in the order of a search in depth.
    fn extend(&mut self, body: &[Atom], open: &[usize], values: Values, found: &mut Vec<Values>) {
        let mut states: Vec<(Rc<[usize]>, Values)> = vec![(open.into(), values)];
        while let Some((open, values)) = states.pop() {
            self.too_many |= found.len() >= MATCH_LIMIT;
            if self.too_many {
                return;
            }
            if open.is_empty() {
                found.push(values);
                continue;
            }
            let (at, next) = self.step(body, &open, values);
            let rest: Rc<[usize]> = open.iter().copied().filter(|other| Some(*other) != at).collect();
            states.extend(next.into_iter().rev().map(|longer| (Rc::clone(&rest), longer)));
        }
    }

    /// The open atom that is matched next, and the values that it leads to.
    fn step(&mut self, body: &[Atom], open: &[usize], values: Values) -> (Option<usize>, Vec<Values>) {
        if let Some(at) = open.iter().copied().find(|at| is_ready(body, *at, &values)) {
            let next = match &body[at] {
                Atom::BuiltIn { built_in, arguments } => self.solve(*built_in, arguments, &values),
                _ => self.filter(body, at, values).into_iter().collect(),
            };
            return (Some(at), next);
        }
        let relations = open.iter().copied().filter_map(|at| match &body[at] {
            Atom::Relation { predicate, arguments } => Some((at, *predicate, arguments)),
            _ => None,
        });
        let places = relations.map(|(at, predicate, arguments)| {
            let relation = (predicate, arguments.len());
            let known =
                |(place, term): (usize, &Term)| Some((place, self.names.find(value(*term, &values)?)));
            let places = arguments.iter().enumerate().filter_map(known).map(Some).chain([None]);
            let least = places.min_by_key(|place| self.facts.count(relation, *place));
            (at, relation, arguments, least.flatten())
        });
        let best = places.min_by_key(|(_, relation, _, place)| self.facts.count(*relation, *place));
        let Some((at, relation, arguments, place)) = best else { return (None, Vec::new()) };
        let rows = self.facts.rows(relation, place);
        (Some(at), rows.into_iter().filter_map(|row| self.agree(arguments, row, &values)).collect())
    }

    /// The values with which a relation's terms are those of a row.
    fn agree(&self, terms: &[Term], row: &Fact, values: &Values) -> Option<Values> {
        let mut longer = values.clone();
        for (term, symbol) in terms.iter().zip(&row.arguments) {
            match (value(*term, &longer), term) {
                (Some(known), _) if self.names.find(known) == *symbol => {}
                (None, Term::Variable(Variable(number))) => longer[usize::from(*number)] = Some(*symbol),
                _ => return None,
            }
        }
        Some(longer)
    }

    /// The values with all that a built-in gives to those of its arguments that have none.
    fn solve(&mut self, built_in: BuiltIn, arguments: &[Term], values: &Values) -> Vec<Values> {
        let literal = |term: &Term| match value(*term, values) {
            Some(symbol) => self.symbols.value(symbol).as_literal().map(Some),
            None => Some(None),
        };
        let Some(given) = arguments.iter().map(literal).collect::<Option<Vec<_>>>() else {
            return Vec::new();
        };
        let open = arguments.iter().filter(|term| value(**term, values).is_none());
        let open: Vec<Variable> = open.filter_map(|term| term.as_variable()).collect();
        let mut all = Vec::new();
        for solution in built_in.solve(&given) {
            let mut longer = values.clone();
            let agrees = open.iter().zip(solution).all(|(variable, literal)| {
                let symbol = self.symbols.literal(literal);
                *longer[usize::from(variable.0)].get_or_insert(symbol) == symbol
            });
            all.extend(agrees.then_some(longer));
        }
        all
    }

    /// The values with what an atom that is not a relation adds to them; none where it does not hold.
    fn filter(&mut self, body: &[Atom], at: usize, mut values: Values) -> Option<Values> {
        let bound = match &body[at] {
            Atom::Same(left, right) => match (value(*left, &values), value(*right, &values)) {
                (Some(left), Some(right)) => {
                    return (self.names.find(left) == self.names.find(right)).then_some(values);
                }
                (Some(known), None) => Some((*right, known)),
                (None, known) => known.map(|known| (*left, known)),
            },
            Atom::Aggregate { result, .. } if value(*result, &values).is_none() => {
                let outcome = self.aggregate(body, at, &values)?;
                Some((*result, self.symbols.literal(outcome)))
            }
            _ => {
                let names = self.names;
                return self.holds_at(body, at, &values, names).then_some(values);
            }
        };
        let (term, symbol) = bound?;
        let Variable(number) = term.as_variable()?;
        values[usize::from(number)] = Some(self.names.find(symbol));
        Some(values)
    }

    /// Whether an atom of a rule's body that is not a relation holds; `names` are those that are known to be one.
    pub fn holds(&mut self, atom: &Atom, rule: &Rule, values: &Values, names: &Names) -> bool {
        let at = rule.body.iter().position(|other| std::ptr::eq(other, atom));
        at.is_some_and(|at| self.holds_at(&rule.body, at, values, names))
    }

    fn holds_at(&mut self, body: &[Atom], at: usize, values: &Values, names: &Names) -> bool {
        let find = |names: &Names, term: &Term| value(*term, values).map(|symbol| names.find(symbol));
        match &body[at] {
            Atom::Not { predicate, arguments } => instance(*predicate, arguments, values)
                .is_some_and(|fact| !self.facts.contains(&self.names.normal(&fact))),
            Atom::Same(left, right) => find(names, left).is_some() && find(names, left) == find(names, right),
            // What is different has to stay so.
            Atom::Different(left, right) => match (find(self.names, left), find(self.names, right)) {
                (Some(left), Some(right)) => {
                    let is_name = |symbol| self.symbols.value(symbol).as_name().is_some();
                    self.names_differ |= self.equality && is_name(left) && is_name(right);
                    self.symbols.differ(left, right)
                }
                _ => false,
            },
            Atom::BuiltIn { built_in, arguments } => self
                .literals(arguments, values)
                .is_some_and(|literals| built_in.holds(&literals.iter().collect::<Vec<_>>())),
            Atom::Aggregate { result, .. } => {
                let outcome = self.aggregate(body, at, values);
                outcome.is_some()
                    && outcome.as_ref() == self.literals(&[*result], values).as_deref().and_then(<[_]>::first)
            }
            Atom::Relation { .. } => false,
        }
    }

    fn literals(&self, terms: &[Term], values: &Values) -> Option<Vec<Literal>> {
        let literal = |term: &Term| self.symbols.value(value(*term, values)?).as_literal().cloned();
        terms.iter().map(literal).collect()
    }

    /// What an aggregate comes to: over each distinct match of its own atoms that agrees with its group.
    fn aggregate(&mut self, body: &[Atom], at: usize, values: &Values) -> Option<Literal> {
        let Atom::Aggregate { aggregate, body: inner, .. } = &body[at] else { return None };
        let mut own: Values = vec![None; values.len()];
        for Variable(number) in group(body, at).iter().filter_map(|term| term.as_variable()) {
            own[usize::from(number)] = Some(self.names.find(values[usize::from(number)]?));
        }
        let mut found = Vec::new();
        let open: Vec<usize> = (0..inner.len()).collect();
        self.extend(inner, &open, own, &mut found);
        let distinct: BTreeSet<Values> = found.into_iter().collect();
        let row = |values: &Values| match aggregate.value() {
            None => values.first().copied().flatten().or(Some(Symbol(0))),
            Some(term) => value(term, values),
        };
        let rows: Option<Vec<Symbol>> = distinct.iter().map(row).collect();
        let function = Function { aggregate: column(*aggregate), value: Source::Variable(0) };
        function.of(rows?.iter().map(std::slice::from_ref), self.symbols)
    }
}

/// The aggregate of the only column of rows.
fn column(aggregate: Aggregate) -> Aggregate {
    aggregate.map(&|_| Term::Variable(Variable(0)))
}

/// Whether an atom that is not a relation has values enough.
fn is_ready(body: &[Atom], at: usize, values: &Values) -> bool {
    let known = |term: &Term| value(*term, values).is_some();
    match &body[at] {
        Atom::Relation { .. } => false,
        Atom::Not { arguments, .. } => arguments.iter().all(known),
        Atom::Same(left, right) => known(left) || known(right),
        Atom::Different(left, right) => known(left) && known(right),
        Atom::BuiltIn { built_in, arguments } => {
            built_in.binds(&arguments.iter().map(known).collect::<Vec<_>>())
        }
        Atom::Aggregate { .. } => group(body, at).iter().all(known),
    }
}
