//! Translates conditions to Datalog rule bodies: exactly for the axioms of static derived predicates, otherwise
//! relaxed.
//!
//! A relaxed rule body is true whenever the condition can be true. It ignores negated fluents, numeric
//! comparisons, and universal quantifiers whose conditions contain fluents or comparisons. Disjunctions and
//! universal quantifiers become auxiliary relations over their free variables.

use std::collections::BTreeMap;
use std::sync::Arc;

use rules::{Atom, Fact, Rule, RuleIdentity, Symbol, Symbols, Term as RuleTerm, Variable};
use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::ground::evaluate::condition::residual;
use crate::ground::evaluate::join::each_binding;
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::partial_eval::Residual;
use crate::ground::vocabulary::reached::RelaxedReachability;
use crate::ground::vocabulary::world::World;
use crate::lifted::configuration::{formula_terms, has_numbers, is_static};
use crate::lifted::{Arguments, Bound, Formula, Lifted, ObjectId, PredicateId, Term};
use crate::limits::Limits;
use crate::number::dense;

pub(super) type Candidates = BTreeMap<u32, Arc<[ObjectId]>>;

pub(super) struct Names {
    pub(super) table: Symbols,
    pub(super) objects: Vec<Symbol>,
    pub(super) predicates: Vec<Symbol>,
}

pub(super) struct ReachabilityProgramBuilder<'a> {
    pub(super) lifted: &'a Lifted,
    limits: &'a Limits,
    names: Names,
    unreached: &'a RelaxedReachability,
    /// The values of static functions, created for the first comparison.
    world: Option<World<'a>>,
    types: FxHashMap<Arc<[ObjectId]>, Symbol>,
    facts: Vec<Fact>,
    rules: Vec<Rule>,
    relations: usize,
}

impl<'a> ReachabilityProgramBuilder<'a> {
    pub(super) fn new(lifted: &'a Lifted, unreached: &'a RelaxedReachability, limits: &'a Limits) -> Self {
        let mut table = Symbols::new();
        let objects: Vec<_> = (0..lifted.objects.len()).map(|i| table.name(&format!("object {i}"))).collect();
        let predicates: Vec<_> =
            (0..lifted.predicates.len()).map(|i| table.name(&format!("predicate {i}"))).collect();
        // The relaxation ignores time, so atoms that timed events add count as initial facts.
        let events = lifted.events.iter().flat_map(|event| &event.changes).filter(|(_, _, holds)| *holds);
        let facts = lifted
            .facts
            .iter()
            .map(|(predicate, arguments)| (predicate, arguments))
            .chain(events.map(|(predicate, arguments, _)| (predicate, arguments)))
            .map(|(predicate, arguments)| Fact {
                predicate: predicates[predicate.index()],
                arguments: arguments.iter().map(|object| objects[object.index()]).collect(),
            })
            .collect();
        let names = Names { table, objects, predicates };
        Self {
            lifted,
            limits,
            names,
            unreached,
            world: None,
            types: FxHashMap::default(),
            facts,
            rules: Vec::new(),
            relations: 0,
        }
    }

    pub(super) fn finish(self) -> (Names, Vec<Rule>, Vec<Fact>) {
        (self.names, self.rules, self.facts)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn fresh(&mut self, kind: &str) -> Symbol {
        self.relations += 1;
        self.names.table.name(&format!("{kind} {}", self.relations))
    }

    pub(super) fn types(&mut self, variables: &[u32], candidates: &Candidates) -> Vec<Atom> {
        variables
            .iter()
            .filter_map(|variable| {
                let symbol = self.candidates(candidates.get(variable)?);
                Some(Self::relation(symbol, &[*variable]))
            })
            .collect()
    }

    fn candidates(&mut self, candidates: &Arc<[ObjectId]>) -> Symbol {
        if let Some(symbol) = self.types.get(candidates) {
            return *symbol;
        }
        let symbol = self.fresh("type");
        for object in candidates.iter() {
            let arguments = std::iter::once(self.names.objects[object.index()]).collect();
            self.facts.push(Fact { predicate: symbol, arguments });
        }
        self.types.insert(candidates.clone(), symbol);
        symbol
    }

    fn term(&self, term: Term) -> RuleTerm {
        match term {
            Term::Parameter(parameter) => variable(parameter),
            Term::Object(object) => RuleTerm::Constant(self.names.objects[object.index()]),
        }
    }

    pub(super) fn atom(&self, predicate: PredicateId, terms: &[Term]) -> Atom {
        let arguments = terms.iter().map(|term| self.term(*term)).collect();
        Atom::Relation { predicate: self.names.predicates[predicate.index()], arguments }
    }

    pub(super) fn relation(predicate: Symbol, parameters: &[u32]) -> Atom {
        let arguments = parameters.iter().map(|p| variable(*p)).collect();
        Atom::Relation { predicate, arguments }
    }

    pub(super) fn rule(&mut self, head: Vec<Atom>, body: Vec<Atom>) {
        let identity = RuleIdentity::new("relaxed reachability", dense(self.rules.len()));
        self.rules.push(Rule::new(identity, head, body));
    }

    /// Appends the rule body for a condition to `out`. If `exact` is `true`, the condition must be static and
    /// is translated without relaxation; otherwise the rule body may hold for more bindings, because for
    /// example negated fluents and numeric comparisons are ignored.
    pub(super) fn body(
        &mut self,
        formula: &Formula,
        candidates: &Candidates,
        exact: bool,
        out: &mut Vec<Atom>,
    ) -> Result<(), Error> {
        self.limits.check()?;
        match formula {
            Formula::And(parts) => {
                return parts.iter().try_for_each(|part| self.body(part, candidates, exact, out));
            }
            Formula::Literal { positive, predicate, terms } => match self.atom(*predicate, terms) {
                atom if *positive => out.push(atom),
                Atom::Relation { predicate: symbol, arguments }
                    if !self.lifted.predicates[predicate.index()].fluent =>
                {
                    out.push(Atom::Not { predicate: symbol, arguments });
                }
                // The relaxation ignores negated fluents, because it never deletes atoms.
                _ => {}
            },
            Formula::Equal { positive, left, right } => {
                let (left, right) = (self.term(*left), self.term(*right));
                out.push(if *positive { Atom::Same(left, right) } else { Atom::Different(left, right) });
            }
            Formula::Exists(bound, body) => {
                let (variables, candidates) = with_bound(candidates, bound);
                out.extend(self.types(&variables, &candidates));
                self.body(body, &candidates, exact, out)?;
            }
            Formula::Or(parts) => {
                // A disjunction with a part that the relaxation ignores restricts nothing.
                if exact || !parts.iter().any(|part| self.may_be_free(part)) {
                    let relation = self.auxiliary(formula, parts, candidates, exact)?;
                    out.push(Self::relation(relation, &free(formula)));
                }
            }
            Formula::ForAll(..) => {
                // ∀x φ is translated to ¬∃x ¬φ. The negated relation must be exact, so φ must be static.
                if exact || (is_static(self.lifted, formula) && !has_numbers(formula)) {
                    let relation = self.auxiliary(formula, &[formula.negated()], candidates, true)?;
                    let arguments = free(formula).into_iter().map(variable);
                    out.push(Atom::Not { predicate: relation, arguments: arguments.collect() });
                }
            }
            Formula::Compare(..) => {
                if exact {
                    let relation = self.comparison(formula, candidates)?;
                    out.push(Self::relation(relation, &free(formula)));
                }
            }
        }
        Ok(())
    }

    /// Creates a relation over the free variables of `formula` that contains the bindings for which one of `parts` is
    /// true. If `exact` is `false`, the relation may contain further bindings.
    fn auxiliary(
        &mut self,
        formula: &Formula,
        parts: &[Formula],
        candidates: &Candidates,
        exact: bool,
    ) -> Result<Symbol, Error> {
        let relation = self.fresh("auxiliary");
        let variables = free(formula);
        for part in parts {
            let mut body = self.types(&variables, candidates);
            self.body(part, candidates, exact, &mut body)?;
            self.rule(vec![Self::relation(relation, &variables)], body);
        }
        Ok(relation)
    }

    /// Returns `true` if the relaxation ignores the condition: [`Self::body`] then adds no atom for it, except types.
    fn may_be_free(&self, formula: &Formula) -> bool {
        match formula {
            Formula::And(parts) => parts.iter().all(|part| self.may_be_free(part)),
            Formula::Or(parts) => parts.iter().any(|part| self.may_be_free(part)),
            Formula::Exists(_, body) => self.may_be_free(body),
            Formula::ForAll(..) => !is_static(self.lifted, formula) || has_numbers(formula),
            Formula::Literal { positive, predicate, .. } => {
                !positive && self.lifted.predicates[predicate.index()].fluent
            }
            Formula::Equal { .. } => false,
            Formula::Compare(..) => true,
        }
    }

    fn comparison(&mut self, formula: &Formula, candidates: &Candidates) -> Result<Symbol, Error> {
        let relation = self.fresh("comparison");
        let variables = free(formula);
        let world = self.world.get_or_insert_with(|| World::new(self.lifted, self.unreached, self.limits));
        let rows = satisfying(world, formula, &variables, candidates)?;
        for row in rows {
            let arguments = row.iter().map(|object| self.names.objects[object.index()]).collect();
            self.facts.push(Fact { predicate: relation, arguments });
        }
        Ok(relation)
    }
}

fn variable(number: u32) -> RuleTerm {
    RuleTerm::Variable(Variable(u16::try_from(number).expect("invariant: `reach` refuses more variables")))
}

#[expect(clippy::arithmetic_side_effects, reason = "variables of a condition are numbered in memory")]
fn satisfying(
    world: &mut World<'_>,
    comparison: &Formula,
    variables: &[u32],
    candidates: &Candidates,
) -> Result<Vec<Arguments>, Error> {
    let bound: Vec<_> = variables
        .iter()
        .filter_map(|v| Some(Bound { variable: *v, candidates: candidates.get(v)?.clone() }))
        .collect();
    let mut binding = vec![None; variables.iter().max().map_or(0, |v| *v as usize + 1)];
    let (mut rows, mut error) = (Vec::new(), None);
    each_binding(world, &bound, &[], &mut binding, &mut |world, binding| {
        match residual(world, comparison, binding) {
            Ok(Residual::True) => {
                rows.push(variables.iter().filter_map(|v| binding[*v as usize]).collect());
            }
            Err(Failure::Error(failure)) => error = Some(failure),
            _ => {}
        }
        error.is_none()
    })?;
    // Without the remaining rows, instances would be missing.
    error.map_or(Ok(rows), Err)
}

pub(super) fn with_bound(candidates: &Candidates, bound: &[Bound]) -> (Vec<u32>, Candidates) {
    let mut inner = candidates.clone();
    inner.extend(bound.iter().map(|b| (b.variable, b.candidates.clone())));
    (bound.iter().map(|b| b.variable).collect(), inner)
}

pub(super) fn free(formula: &Formula) -> Vec<u32> {
    fn bound_in(formula: &Formula, out: &mut Vec<u32>) {
        match formula {
            Formula::And(parts) | Formula::Or(parts) => parts.iter().for_each(|part| bound_in(part, out)),
            Formula::Exists(bound, body) | Formula::ForAll(bound, body) => {
                out.extend(bound.iter().map(|b| b.variable));
                bound_in(body, out);
            }
            _ => {}
        }
    }
    let mut bound = Vec::new();
    bound_in(formula, &mut bound);
    bound.sort_unstable();
    let mut free = Vec::new();
    formula_terms(formula, &mut |term| {
        if let Term::Parameter(variable) = term
            && bound.binary_search(&variable).is_err()
        {
            free.push(variable);
        }
    });
    free.sort_unstable();
    free.dedup();
    free
}
