//! Matches of a rule's body in an immutable set of facts, by nested-loop joins. Each step first evaluates the
//! atoms that are not relations (tests, built-ins, aggregates) and whose variables are bound. Then it joins the
//! relation with the fewest candidate rows.

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

const MATCH_LIMIT: usize = 1 << 21;
/// Upper limit on the number of partial matches of one body. It is much above [`MATCH_LIMIT`], because in a correct
/// derivation most partial matches can fail at a later atom. Tests use a lower limit.
const PARTIAL_MATCH_LIMIT: usize = if cfg!(test) { 1 << 16 } else { 64 * MATCH_LIMIT };

/// Values of the variables of a rule; `None` for an unbound variable.
pub(super) type Values = Vec<Option<Symbol>>;

pub(super) fn value(term: Term, values: &Values) -> Option<Symbol> {
    match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(Variable(number)) => values[usize::from(number)],
    }
}

pub(super) fn instance(predicate: Symbol, terms: &[Term], values: &Values) -> Option<Fact> {
    let arguments: Option<Vec<Symbol>> = terms.iter().map(|term| value(*term, values)).collect();
    Some(Fact::new(predicate, arguments?))
}

pub(super) struct Matcher<'m> {
    pub symbols: &'m mut Symbols,
    /// Facts in which the first name of each individual replaces its other names.
    pub facts: &'m Facts,
    pub names: &'m Names,
    pub equality: bool,
    /// `true` if a rule tested whether two names differ although names may be equal. The given facts alone
    /// then do not determine the result.
    pub compares_names: bool,
    pub too_many: bool,
}

/// Returns the variables that the aggregate at `position` shares with the other atoms of the body. Of other
/// aggregates, only the results count.
fn group(body: &[Atom], position: usize) -> Vec<Term> {
    let outer_atoms = body.iter().enumerate().filter(|(other, _)| *other != position);
    let outer_terms: BTreeSet<Term> = outer_atoms
        .flat_map(|(_, other)| match other {
            Atom::Aggregate { result, .. } => vec![*result],
            other => other.terms(),
        })
        .collect();
    let inner_terms = body[position].terms().into_iter().skip(1);
    inner_terms.filter(|term| term.as_variable().is_some() && outer_terms.contains(term)).collect()
}

impl Matcher<'_> {
    /// Returns the matches of a rule's body. If [`Matcher::too_many`] is set, matches may be missing, because the
    /// enumeration was stopped at a limit. An individual with several names is represented by its
    /// smallest name ([`Names::find`]).
    pub fn matches_of(&mut self, rule: &Rule) -> Vec<Values> {
        let mut matches = Vec::new();
        let open: Vec<usize> = (0..rule.body.len()).collect();
        self.extend(&rule.body, &open, vec![None; rule.variable_count()], &mut matches);
        matches
    }

    /// Extends `values` by the open atoms of a body, in depth-first order, and appends each complete match to
    /// `matches`. Stops at [`MATCH_LIMIT`] matches or [`PARTIAL_MATCH_LIMIT`] partial matches.
    fn extend(&mut self, body: &[Atom], open: &[usize], values: Values, matches: &mut Vec<Values>) {
        let mut states: Vec<(Rc<[usize]>, Values)> = vec![(open.into(), values)];
        let mut partial_matches = 0_usize;
        while let Some((open, values)) = states.pop() {
            self.too_many |= matches.len() >= MATCH_LIMIT || partial_matches >= PARTIAL_MATCH_LIMIT;
            if self.too_many {
                return;
            }
            if open.is_empty() {
                matches.push(values);
                continue;
            }
            let (position, next) = self.step(body, &open, values);
            partial_matches = partial_matches.saturating_add(next.len());
            let remaining: Rc<[usize]> =
                open.iter().copied().filter(|other| Some(*other) != position).collect();
            states.extend(next.into_iter().rev().map(|extended| (Rc::clone(&remaining), extended)));
        }
    }

    /// Chooses the next open atom. Returns its position and all extensions of the values by the atom;
    /// the position is `None` if no atom can be evaluated.
    fn step(&mut self, body: &[Atom], open: &[usize], values: Values) -> (Option<usize>, Vec<Values>) {
        if let Some(position) = open.iter().copied().find(|position| is_ready(body, *position, &values)) {
            let next = match &body[position] {
                Atom::BuiltIn { built_in, arguments } => self.solve(*built_in, arguments, &values),
                _ => self.filter(body, position, values).into_iter().collect(),
            };
            return (Some(position), next);
        }
        let relations = open.iter().copied().filter_map(|position| match &body[position] {
            Atom::Relation { predicate, arguments } => Some((position, *predicate, arguments)),
            _ => None,
        });
        let places = relations.map(|(position, predicate, arguments)| {
            let relation = (predicate, arguments.len());
            let bound_place =
                |(place, term): (usize, &Term)| Some((place, self.names.find(value(*term, &values)?)));
            let places = arguments.iter().enumerate().filter_map(bound_place).map(Some).chain([None]);
            let least = places.min_by_key(|place| self.facts.count(relation, *place));
            (position, relation, arguments, least.flatten())
        });
        let best = places.min_by_key(|(_, relation, _, place)| self.facts.count(*relation, *place));
        let Some((position, relation, arguments, place)) = best else { return (None, Vec::new()) };
        let rows = self.facts.rows(relation, place);
        (Some(position), rows.into_iter().filter_map(|row| self.agree(arguments, row, &values)).collect())
    }

    fn agree(&self, terms: &[Term], row: &Fact, values: &Values) -> Option<Values> {
        let mut extended = values.clone();
        for (term, symbol) in terms.iter().zip(&row.arguments) {
            match (value(*term, &extended), term) {
                (Some(assigned), _) if self.names.find(assigned) == *symbol => {}
                (None, Term::Variable(Variable(number))) => extended[usize::from(*number)] = Some(*symbol),
                _ => return None,
            }
        }
        Some(extended)
    }

    fn solve(&mut self, built_in: BuiltIn, arguments: &[Term], values: &Values) -> Vec<Values> {
        let literal = |term: &Term| match value(*term, values) {
            Some(symbol) => self.symbols.value(symbol).as_literal().map(Some),
            None => Some(None),
        };
        let Some(inputs) = arguments.iter().map(literal).collect::<Option<Vec<_>>>() else {
            return Vec::new();
        };
        let open = arguments.iter().filter(|term| value(**term, values).is_none());
        let open: Vec<Variable> = open.filter_map(|term| term.as_variable()).collect();
        let mut solutions = Vec::new();
        for solution in built_in.solve(&inputs) {
            let mut extended = values.clone();
            let agrees = open.iter().zip(solution).all(|(variable, literal)| {
                let symbol = self.symbols.literal(literal);
                *extended[usize::from(variable.0)].get_or_insert(symbol) == symbol
            });
            solutions.extend(agrees.then_some(extended));
        }
        solutions
    }

    /// Evaluates an atom that is not a relation atom. Returns the values, extended if the atom binds a
    /// variable, or `None` if the atom does not hold.
    fn filter(&mut self, body: &[Atom], position: usize, mut values: Values) -> Option<Values> {
        let bound = match &body[position] {
            Atom::Same(left, right) => match (value(*left, &values), value(*right, &values)) {
                (Some(left), Some(right)) => {
                    return (self.names.find(left) == self.names.find(right)).then_some(values);
                }
                (Some(assigned), None) => Some((*right, assigned)),
                (None, assigned) => assigned.map(|assigned| (*left, assigned)),
            },
            Atom::Aggregate { result, .. } if value(*result, &values).is_none() => {
                let outcome = self.aggregate(body, position, &values)?;
                Some((*result, self.symbols.literal(outcome)))
            }
            _ => {
                let names = self.names;
                return self.holds_at(body, position, &values, names).then_some(values);
            }
        };
        let (term, symbol) = bound?;
        let Variable(number) = term.as_variable()?;
        values[usize::from(number)] = Some(self.names.find(symbol));
        Some(values)
    }

    /// Returns `true` if an atom that is not a relation atom holds. `sameAs` uses only the equalities in `names`,
    /// i.e. those of earlier steps, but within an aggregate it uses all equalities.
    pub fn holds(&mut self, atom: &Atom, rule: &Rule, values: &Values, names: &Names) -> bool {
        let position = rule.body.iter().position(|other| std::ptr::eq(other, atom));
        position.is_some_and(|position| self.holds_at(&rule.body, position, values, names))
    }

    fn holds_at(&mut self, body: &[Atom], position: usize, values: &Values, names: &Names) -> bool {
        let find = |names: &Names, term: &Term| value(*term, values).map(|symbol| names.find(symbol));
        match &body[position] {
            Atom::Not { predicate, arguments } => instance(*predicate, arguments, values)
                .is_some_and(|fact| !self.facts.contains(&self.names.normal(&fact))),
            Atom::Same(left, right) => find(names, left).is_some() && find(names, left) == find(names, right),
            // Uses all equalities, also later ones, since the difference must hold in the whole model.
            Atom::Different(left, right) => {
                self.difference(find(self.names, left), find(self.names, right)) == Some(true)
            }
            // Also uses all equalities, because the names must be unequal in the whole model.
            Atom::NotSame(left, right) => {
                let (left, right) = (find(self.names, left), find(self.names, right));
                left.is_some() && right.is_some() && left != right
            }
            Atom::NotDifferent(left, right) => {
                self.difference(find(self.names, left), find(self.names, right)) == Some(false)
            }
            Atom::BuiltIn { built_in, arguments } => self.built_in_holds(*built_in, arguments, values),
            Atom::NotBuiltIn { built_in, arguments } => {
                arguments.iter().all(|term| value(*term, values).is_some())
                    && !self.built_in_holds(*built_in, arguments, values)
            }
            Atom::Aggregate { result, .. } => {
                let outcome = self.aggregate(body, position, values);
                outcome.is_some()
                    && outcome.as_ref() == self.literals(&[*result], values).as_deref().and_then(<[_]>::first)
            }
            Atom::Relation { .. } => false,
        }
    }

    /// Returns `true` if two symbols certainly differ; `None` if one is missing. Sets [`Matcher::compares_names`] if
    /// both are names and equality applies.
    fn difference(&mut self, left: Option<Symbol>, right: Option<Symbol>) -> Option<bool> {
        let (left, right) = (left?, right?);
        let is_name = |symbol| self.symbols.value(symbol).as_name().is_some();
        self.compares_names |= self.equality && is_name(left) && is_name(right);
        Some(self.symbols.differ(left, right))
    }

    fn built_in_holds(&self, built_in: BuiltIn, arguments: &[Term], values: &Values) -> bool {
        let literals = self.literals(arguments, values);
        literals.is_some_and(|literals| built_in.holds(&literals.iter().collect::<Vec<_>>()))
    }

    fn literals(&self, terms: &[Term], values: &Values) -> Option<Vec<Literal>> {
        let literal = |term: &Term| self.symbols.value(value(*term, values)?).as_literal().cloned();
        terms.iter().map(literal).collect()
    }

    /// Returns the value of the aggregate at `position` over the distinct matches of its atoms within the
    /// group; `None` if the aggregate has no value or a group variable is unbound.
    fn aggregate(&mut self, body: &[Atom], position: usize, values: &Values) -> Option<Literal> {
        let Atom::Aggregate { aggregate, body: inner, .. } = &body[position] else { return None };
        // Only the group is shared with the rule, so all other variables start unbound.
        let mut inner_values: Values = vec![None; values.len()];
        for Variable(number) in group(body, position).iter().filter_map(|term| term.as_variable()) {
            inner_values[usize::from(number)] = Some(self.names.find(values[usize::from(number)]?));
        }
        let mut matches = Vec::new();
        let open: Vec<usize> = (0..inner.len()).collect();
        self.extend(inner, &open, inner_values, &mut matches);
        let distinct: BTreeSet<Values> = matches.into_iter().collect();
        let row = |values: &Values| match aggregate.value() {
            None => values.first().copied().flatten().or(Some(Symbol(0))),
            Some(term) => value(term, values),
        };
        let rows: Option<Vec<Symbol>> = distinct.iter().map(row).collect();
        let function = Function { aggregate: column(*aggregate), value: Source::Variable(0) };
        function.evaluate(rows?.iter().map(std::slice::from_ref), self.symbols)
    }
}

/// Returns the aggregate with the variable 0 as its term: the only column of the rows to which the aggregate is
/// applied.
fn column(aggregate: Aggregate) -> Aggregate {
    aggregate.map(&|_| Term::Variable(Variable(0)))
}

fn is_ready(body: &[Atom], position: usize, values: &Values) -> bool {
    let is_bound = |term: &Term| value(*term, values).is_some();
    match &body[position] {
        Atom::Relation { .. } => false,
        Atom::Not { arguments, .. } | Atom::NotBuiltIn { arguments, .. } => arguments.iter().all(is_bound),
        Atom::Same(left, right) => is_bound(left) || is_bound(right),
        Atom::Different(left, right) | Atom::NotSame(left, right) | Atom::NotDifferent(left, right) => {
            is_bound(left) && is_bound(right)
        }
        Atom::BuiltIn { built_in, arguments } => {
            built_in.binds(&arguments.iter().map(is_bound).collect::<Vec<_>>())
        }
        Atom::Aggregate { .. } => group(body, position).iter().all(is_bound),
    }
}

#[cfg(test)]
mod tests {
    use crate::replay::{Fault, replay};
    use crate::{Engine, Fact, Prefixes, Program, Symbols, parse_rules};

    /// The comparisons fail, but only after all three atoms are matched in 8 million ways.
    #[test]
    fn partial_matches_are_limited() {
        let mut symbols = Symbols::new();
        let text =
            "p(?x, ?a) ^ p(?y, ?b) ^ p(?z, ?c) ^ swrlb:lessThan(?c, ?a) ^ swrlb:lessThan(?a, ?c) -> q(?x) .";
        let program = parse_rules(text, "test", &mut symbols, &Prefixes::default()).expect("rules");
        let predicate = symbols.name("p");
        let facts = (0..200).map(|number| {
            let arguments = [symbols.name(&format!("n{number}")), symbols.literal(number.into())];
            Fact::new(predicate, arguments)
        });
        let facts: Vec<Fact> = facts.collect();
        let engine = Engine::new(symbols, Program::default(), facts.clone()).expect("no rules");
        let derivation = engine.everything();
        let fault = replay(&program, &mut engine.symbols().clone(), &facts, &derivation);
        assert!(matches!(fault, Err(Fault::TooMany(_))), "{fault:?}");
    }
}
