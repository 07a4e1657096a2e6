//! Conjunctive queries: anonymous individuals of a conclusion are existential variables.

use std::collections::BTreeMap;

use rules::{Engine, Error, Interrupt, RuleIdentity, Symbol};

use super::prover::{Answer, Prover, edge, explain, literal, member, same, value};
use crate::owl::{ANONYMOUS, Axiom, ClassExpression, Iri, ObjectPropertyExpression as Property};
use crate::vocab::owl;

const MAX_PARTIAL_ANSWERS: usize = 100_000;

/// Partial answer of a query: maps anonymous individuals of the query to individuals of the knowledge base.
type Assignment = BTreeMap<Iri, Iri>;

impl Prover {
    /// Answers a conjunctive query, whose variables are the anonymous individuals of the statements. The
    /// answer is open if none is found, or if the budget of partial answers is exhausted.
    pub(super) fn conjunctive_query(&self, statements: &[&Axiom]) -> Result<Answer, Error> {
        let mut budget = MAX_PARTIAL_ANSWERS;
        // All statements share one copy of the engine, in which only symbols are added.
        let mut engine = self.base.clone();
        let explanation = self.extend(&mut engine, &Assignment::new(), statements.to_vec(), &mut budget)?;
        Ok(match explanation {
            Some(reason) => Answer::Follows(reason),
            None if budget == 0 => Answer::Open("there are too many candidate individuals"),
            None => Answer::Open("the rules do not conclude it for any individual"),
        })
    }

    /// Extends an assignment to all statements by backtracking. The statement with the fewest unassigned
    /// individuals comes first. Returns the explanation of the first answer.
    fn extend(
        &self,
        engine: &mut Engine,
        assignment: &Assignment,
        mut statements: Vec<&Axiom>,
        budget: &mut usize,
    ) -> Result<Option<String>, Error> {
        if *budget == 0 {
            return Ok(None);
        }
        *budget -= 1;
        if engine.limits().interrupt.as_ref().is_some_and(Interrupt::is_over) {
            return Err(Error::Interrupted { rule: RuleIdentity::new("conjunctive query", 0) });
        }
        let unknown =
            |axiom: &Axiom| names(axiom).into_iter().filter(|name| is_open(assignment, name)).count();
        let Some(index) = (0..statements.len()).min_by_key(|index| {
            let complex = matches!(statements[*index], Axiom::ClassAssertion(class, _) if !matches!(class, ClassExpression::Class(_)));
            (unknown(statements[*index]), complex)
        }) else {
            return Ok(Some(String::new()));
        };
        let axiom = statements.remove(index);
        if unknown(axiom) == 0 {
            let Some(reason) = self.holds(engine, assignment, axiom)? else { return Ok(None) };
            return Ok(self.extend(engine, assignment, statements, budget)?.map(|tail| reason + &tail));
        }
        let open: Vec<Iri> = names(axiom).into_iter().filter(|name| is_open(assignment, name)).collect();
        for candidate in self.candidates(assignment, axiom, &open[0]) {
            // Recursion visits the statement again, with one variable less.
            let mut extended = assignment.clone();
            extended.insert(open[0].clone(), candidate);
            let mut pending = statements.clone();
            pending.push(axiom);
            if let Some(reason) = self.extend(engine, &extended, pending, budget)? {
                return Ok(Some(reason));
            }
        }
        Ok(None)
    }

    fn candidates(&self, assignment: &Assignment, axiom: &Axiom, name: &Iri) -> Vec<Iri> {
        let engine = &self.base;
        let symbol = |iri: &str| engine.symbols().find_name(iri);
        let constant = |iri: &Iri| -> Option<Option<Symbol>> {
            match assignment.get(iri) {
                Some(iri) => symbol(iri).map(Some),
                None if iri.starts_with(ANONYMOUS) => Some(None),
                None => symbol(iri).map(Some),
            }
        };
        let rows = |predicate: &str, pattern: Vec<Option<Symbol>>, column: usize| -> Vec<Iri> {
            let Some(predicate) = symbol(predicate) else { return Vec::new() };
            let rows = engine.matching(predicate, &pattern);
            let iri = |symbol| engine.symbols().value(symbol).as_name().map(Iri::from);
            let mut iris: Vec<Iri> = rows.filter_map(|row| iri(row[column])).collect();
            iris.sort();
            iris.dedup();
            iris
        };
        match axiom {
            Axiom::ClassAssertion(ClassExpression::Class(class), _) => rows(class, vec![None], 0),
            Axiom::ObjectPropertyAssertion(property, from, to) => {
                let (Property::Property(iri) | Property::Inverse(iri)) = property;
                let (from, to) =
                    if matches!(property, Property::Property(_)) { (from, to) } else { (to, from) };
                let (Some(first), Some(second)) = (constant(from), constant(to)) else { return Vec::new() };
                let column = usize::from(from != name);
                rows(iri, vec![first, second], column)
            }
            Axiom::DataPropertyAssertion(property, _, object) => {
                let Some(object) = engine.symbols().find_literal(&literal(object)) else { return Vec::new() };
                rows(property, vec![None, Some(object)], 0)
            }
            _ => {
                let facts = engine.facts_in_brief(1).into_iter().flat_map(|fact| fact.arguments);
                let names =
                    facts.filter_map(|symbol| engine.symbols().value(symbol).as_name().map(Iri::from));
                names.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
            }
        }
    }

    fn holds(
        &self,
        engine: &mut Engine,
        assignment: &Assignment,
        axiom: &Axiom,
    ) -> Result<Option<String>, Error> {
        let name = |iri: &Iri| assignment.get(iri).cloned().unwrap_or_else(|| iri.clone());
        Ok(match axiom {
            Axiom::ClassAssertion(ClassExpression::Class(class), individual) if &**class != owl::THING => {
                let goal = member(engine, class, &name(individual));
                explain(engine, &goal)
            }
            Axiom::ClassAssertion(class, individual) => {
                return Self::is_in(engine, class, &name(individual), &mut 0);
            }
            Axiom::ObjectPropertyAssertion(property, from, to) => {
                let goal = edge(engine, property, &name(from), &name(to));
                explain(engine, &goal)
            }
            Axiom::DataPropertyAssertion(property, from, to) => {
                let goal = value(engine, property, &name(from), literal(to));
                explain(engine, &goal)
            }
            Axiom::SameIndividual(individuals) => {
                let mut explanations = Vec::new();
                for pair in individuals.windows(2) {
                    let goal = same(engine, &name(&pair[0]), &name(&pair[1]));
                    explanations.push(explain(engine, &goal));
                }
                explanations.into_iter().collect::<Option<Vec<_>>>().map(|all| all.join("\n"))
            }
            Axiom::DifferentIndividuals(individuals) => {
                let individuals: Vec<Iri> = individuals.iter().map(name).collect();
                match self.axiom(&Axiom::DifferentIndividuals(individuals))? {
                    Answer::Follows(reason) => Some(reason),
                    Answer::Open(_) => None,
                }
            }
            _ => None,
        })
    }
}

fn is_open(assignment: &Assignment, name: &Iri) -> bool {
    name.starts_with(ANONYMOUS) && !assignment.contains_key(name)
}

fn names(axiom: &Axiom) -> Vec<Iri> {
    match axiom {
        Axiom::ClassAssertion(_, individual) | Axiom::DataPropertyAssertion(_, individual, _) => {
            vec![individual.clone()]
        }
        Axiom::ObjectPropertyAssertion(_, from, to) => vec![from.clone(), to.clone()],
        Axiom::SameIndividual(individuals) | Axiom::DifferentIndividuals(individuals) => individuals.clone(),
        _ => Vec::new(),
    }
}
