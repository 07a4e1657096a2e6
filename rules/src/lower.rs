//! Lowers rules to conditions and head templates over relations. The atoms of an aggregate become a separate rule,
//! which derives one row for each match. The rows are in a relation without a name; the first columns are the
//! variables of the group, the others the local variables.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::aggregate::Function;
use crate::plan::{Comparison, Condition, Lowered, Template};
use crate::rule::{Atom, Rule, Term, Variable};
use crate::safety::{Scope, binding, bound_variables};
use crate::source::Source;
use crate::store::{RelationId, Store};
use crate::symbol::{Symbol, Symbols};
use crate::vocabulary::{DIFFERENT_FROM, SAME_AS};

/// Lowers rules in which [`crate::safety::check`] finds no error.
pub(crate) struct Lowering<'a> {
    symbols: &'a mut Symbols,
    store: &'a mut Store,
    constraints: &'a mut Vec<(RelationId, usize)>,
    /// Relations without a name (matches of constraints and aggregates) that are in use.
    used: FxHashSet<RelationId>,
    /// Maps each arity to the number from which the next unused relation without a name is searched.
    first_candidates: FxHashMap<usize, u32>,
    pub lowered: Vec<Lowered>,
}

fn sources(terms: &[Term]) -> Vec<Source> {
    terms.iter().copied().map(Source::from).collect()
}

fn columns(variables: &[u16]) -> Vec<Source> {
    variables.iter().copied().map(Source::Variable).collect()
}

impl<'a> Lowering<'a> {
    pub fn new(
        symbols: &'a mut Symbols,
        store: &'a mut Store,
        constraints: &'a mut Vec<(RelationId, usize)>,
        used: FxHashSet<RelationId>,
    ) -> Self {
        Self {
            symbols,
            store,
            constraints,
            used,
            first_candidates: FxHashMap::default(),
            lowered: Vec::new(),
        }
    }

    pub fn rule(&mut self, position: usize, rule: &Rule) {
        let width = rule.variable_count().max(1);
        let guard = match rule.head[..] {
            [Atom::Same(left, right)] => Some(Atom::Different(left, right)),
            _ => None,
        };
        let mut body: Vec<Option<Condition>> =
            rule.body.iter().map(|atom| self.condition(atom, guard.as_ref())).collect();
        for scope in binding(rule).scopes {
            body[scope.position] = self.aggregate(position, rule, &scope, &body);
        }
        let body: Vec<Condition> = body.into_iter().flatten().collect();
        let mut heads: Vec<Template> = rule.head.iter().filter_map(|atom| self.template(atom)).collect();
        // The matches of a constraint are stored, so that violations can be listed and retracted.
        if rule.head.is_empty() {
            let variables = (0..).zip(bound_variables(rule)).filter(|&(_, is_bound)| is_bound);
            let variables: Vec<u16> = variables.map(|(number, _)| number).collect();
            let relation = self.anonymous(variables.len());
            heads.push(Template { relation, arguments: columns(&variables) });
            self.constraints.push((relation, position));
        }
        let is_closure = Lowered::is_transitivity(&heads, &body);
        self.lowered.push(Lowered { rule: position, width, heads, body, is_closure });
    }

    fn anonymous(&mut self, arity: usize) -> RelationId {
        let first_candidate = self.first_candidates.entry(arity).or_default();
        let relation = self.store.anonymous(arity, *first_candidate, |id| self.used.contains(&id));
        *first_candidate = relation.0 + 1;
        self.used.insert(relation);
        relation
    }

    fn relation(&mut self, predicate: Symbol, terms: &[Term]) -> RelationId {
        self.store.relation(predicate, terms.len())
    }

    /// Lowers a body atom. The atom `guard`, if there is one, becomes [`Comparison::Guard`]. Returns `None` for an
    /// aggregate.
    fn condition(&mut self, atom: &Atom, guard: Option<&Atom>) -> Option<Condition> {
        let compare = |comparison, left: &Term, right: &Term| {
            Condition::Compare(comparison, (*left).into(), (*right).into())
        };
        Some(match atom {
            Atom::Relation { predicate, arguments } => {
                Condition::Relation(self.relation(*predicate, arguments), sources(arguments))
            }
            Atom::Not { predicate, arguments } => {
                Condition::Not(self.relation(*predicate, arguments), sources(arguments))
            }
            Atom::BuiltIn { built_in, arguments } => Condition::BuiltIn(*built_in, sources(arguments)),
            Atom::Same(left, right) => Condition::Same((*left).into(), (*right).into()),
            Atom::Different(left, right) if guard == Some(atom) => compare(Comparison::Guard, left, right),
            Atom::Different(left, right) => compare(Comparison::Different, left, right),
            Atom::NotBuiltIn { built_in, arguments } => Condition::NotBuiltIn(*built_in, sources(arguments)),
            Atom::NotSame(left, right) => compare(Comparison::NotSame, left, right),
            Atom::NotDifferent(left, right) => compare(Comparison::NotDifferent, left, right),
            Atom::Aggregate { .. } => return None,
        })
    }

    fn template(&mut self, atom: &Atom) -> Option<Template> {
        let (predicate, terms) = match atom {
            Atom::Relation { predicate, arguments } => (*predicate, arguments.clone()),
            Atom::Same(left, right) => (self.symbols.name(SAME_AS), vec![*left, *right]),
            Atom::Different(left, right) => (self.symbols.name(DIFFERENT_FROM), vec![*left, *right]),
            _ => return None,
        };
        Some(Template { relation: self.relation(predicate, &terms), arguments: sources(&terms) })
    }

    fn aggregate(
        &mut self,
        position: usize,
        rule: &Rule,
        scope: &Scope,
        outer_conditions: &[Option<Condition>],
    ) -> Option<Condition> {
        let Atom::Aggregate { aggregate, result, body } = &rule.body[scope.position] else { return None };
        let variables = [scope.group.as_slice(), &scope.locals].concat();
        let matches = self.anonymous(variables.len());
        let mut conditions: Vec<Condition> =
            body.iter().filter_map(|atom| self.condition(atom, None)).collect();
        // Outer conditions bind the variables that the aggregate's own atoms leave open.
        conditions.extend(scope.context.iter().filter_map(|&at| outer_conditions[at].clone()));
        let heads = vec![Template { relation: matches, arguments: columns(&variables) }];
        let width = rule.variable_count().max(1);
        self.lowered.push(Lowered { rule: position, width, heads, body: conditions, is_closure: false });
        let value = match aggregate.value() {
            Some(Term::Variable(Variable(number))) => {
                Source::Variable(variables.iter().position(|&v| v == number)? as u16)
            }
            Some(Term::Constant(symbol)) => Source::Constant(symbol),
            None => Source::Variable(0),
        };
        let function = Function { aggregate: *aggregate, value };
        Some(Condition::Aggregate {
            matches,
            function,
            group: columns(&scope.group),
            result: (*result).into(),
        })
    }
}
