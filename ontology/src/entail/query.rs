//! Statements about anonymous individuals: somebody has to be found of whom all of them hold.

use std::collections::BTreeMap;

use rules::{Error, Symbol};

use super::prover::{Answer, Prover, edge, literal, same, shown, value};
use crate::owl::{ANONYMOUS, Axiom, ClassExpression, Iri, ObjectPropertyExpression as Property};

/// So many partial answers are looked at.
const LIMIT: usize = 100_000;

/// Who the anonymous individuals are.
type Found = BTreeMap<Iri, Iri>;

impl Prover {
    /// Whether somebody is as the statements say.
    pub(super) fn pattern(&self, statements: &[&Axiom]) -> Result<Answer, Error> {
        let mut left = LIMIT;
        let found = self.extend(&Found::new(), statements.to_vec(), &mut left)?;
        Ok(match found {
            Some(reason) => Answer::Follows(reason),
            None if left == 0 => Answer::Open("too many individuals come into question"),
            None => Answer::Open("the rules do not conclude it of anybody"),
        })
    }

    /// Finds individuals for the statements that are left.
    fn extend(
        &self,
        found: &Found,
        mut left: Vec<&Axiom>,
        limit: &mut usize,
    ) -> Result<Option<String>, Error> {
        if *limit == 0 {
            return Ok(None);
        }
        *limit -= 1;
        let unknown = |axiom: &Axiom| names(axiom).into_iter().filter(|name| is_open(found, name)).count();
        let Some(at) = (0..left.len()).min_by_key(|at| {
            let complex = matches!(left[*at], Axiom::ClassAssertion(class, _) if !matches!(class, ClassExpression::Class(_)));
            (unknown(left[*at]), complex)
        }) else {
            return Ok(Some(String::new()));
        };
        let axiom = left.remove(at);
        if unknown(axiom) == 0 {
            let Some(reason) = self.holds(found, axiom)? else { return Ok(None) };
            return Ok(self.extend(found, left, limit)?.map(|rest| reason + &rest));
        }
        let open: Vec<Iri> = names(axiom).into_iter().filter(|name| is_open(found, name)).collect();
        for candidate in self.candidates(found, axiom, &open[0]) {
            let mut longer = found.clone();
            longer.insert(open[0].clone(), candidate);
            let mut again = left.clone();
            again.push(axiom);
            if let Some(reason) = self.extend(&longer, again, limit)? {
                return Ok(Some(reason));
            }
        }
        Ok(None)
    }

    /// Who may stand for a name, as far as one statement says.
    fn candidates(&self, found: &Found, axiom: &Axiom, name: &Iri) -> Vec<Iri> {
        let engine = &self.base;
        let symbol = |iri: &str| engine.symbols().find_name(iri);
        let known = |iri: &Iri| -> Option<Option<Symbol>> {
            match found.get(iri) {
                Some(iri) => symbol(iri).map(Some),
                None if iri.starts_with(ANONYMOUS) => Some(None),
                None => symbol(iri).map(Some),
            }
        };
        let rows = |predicate: &str, pattern: Vec<Option<Symbol>>, place: usize| -> Vec<Iri> {
            let Some(predicate) = symbol(predicate) else { return Vec::new() };
            let rows = engine.matching(predicate, &pattern);
            let iri = |symbol| engine.symbols().value(symbol).as_name().map(Iri::from);
            let mut all: Vec<Iri> = rows.filter_map(|row| iri(row[place])).collect();
            all.sort();
            all.dedup();
            all
        };
        match axiom {
            Axiom::ClassAssertion(ClassExpression::Class(class), _) => rows(class, vec![None], 0),
            Axiom::ObjectPropertyAssertion(property, from, to) => {
                let (Property::Property(iri) | Property::Inverse(iri)) = property;
                let (from, to) =
                    if matches!(property, Property::Property(_)) { (from, to) } else { (to, from) };
                let (Some(first), Some(second)) = (known(from), known(to)) else { return Vec::new() };
                let place = usize::from(from != name);
                rows(iri, vec![first, second], place)
            }
            Axiom::DataPropertyAssertion(property, _, object) => {
                let Some(object) = engine.symbols().find_literal(&literal(object)) else { return Vec::new() };
                rows(property, vec![None, Some(object)], 0)
            }
            _ => {
                let facts = engine.facts().flat_map(|fact| fact.arguments.to_vec());
                let names =
                    facts.filter_map(|symbol| engine.symbols().value(symbol).as_name().map(Iri::from));
                names.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
            }
        }
    }

    /// What shows a statement whose individuals are found.
    fn holds(&self, found: &Found, axiom: &Axiom) -> Result<Option<String>, Error> {
        let mut copy = self.base.clone();
        let name = |iri: &Iri| found.get(iri).cloned().unwrap_or_else(|| iri.clone());
        Ok(match axiom {
            Axiom::ClassAssertion(class, individual) => {
                return Self::is_in(&copy, class, &name(individual), &mut 0);
            }
            Axiom::ObjectPropertyAssertion(property, from, to) => {
                let goal = edge(&mut copy, property, &name(from), &name(to));
                shown(&copy, &goal)
            }
            Axiom::DataPropertyAssertion(property, from, to) => {
                let goal = value(&mut copy, property, &name(from), literal(to));
                shown(&copy, &goal)
            }
            Axiom::SameIndividual(all) => {
                let goal = same(&mut copy, &name(&all[0]), &name(&all[1]));
                shown(&copy, &goal)
            }
            Axiom::DifferentIndividuals(all) => {
                let all: Vec<Iri> = all.iter().map(name).collect();
                match self.axiom(&Axiom::DifferentIndividuals(all))? {
                    Answer::Follows(reason) => Some(reason),
                    Answer::Open(_) => None,
                }
            }
            _ => None,
        })
    }
}

fn is_open(found: &Found, name: &Iri) -> bool {
    name.starts_with(ANONYMOUS) && !found.contains_key(name)
}

/// The individuals of a statement.
fn names(axiom: &Axiom) -> Vec<Iri> {
    match axiom {
        Axiom::ClassAssertion(_, individual) | Axiom::DataPropertyAssertion(_, individual, _) => {
            vec![individual.clone()]
        }
        Axiom::ObjectPropertyAssertion(_, from, to) => vec![from.clone(), to.clone()],
        Axiom::SameIndividual(all) | Axiom::DifferentIndividuals(all) => all.clone(),
        _ => Vec::new(),
    }
}
