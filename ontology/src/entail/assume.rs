//! Assumes and proves that an individual is in a class expression.

use rules::{Delta, Engine, Error, Fact, Literal, Symbols};

use super::prover::{
    ProofResult, Prover, contradiction, edge, explain, literal, member, monotone, same, symbol, value,
    with_facts,
};
use crate::lower::lower;
use crate::owl::{AnnotatedAxiom, Axiom, Bound, ClassExpression, Iri, ObjectPropertyExpression, Ontology};
use crate::vocab::owl;

/// Upper limit on the number of cases of an assumption; each case is a copy of the engine.
const MAX_CASES: usize = 64;

impl Prover {
    /// Assumes that an individual is in a class, in copies of the engine: one for each case of a disjunction.
    /// `next` is the number of the last fresh name. Parts of the class that rules cannot express, or that would
    /// lead to more than [`MAX_CASES`] cases, are not assumed, so that a proof remains sound.
    pub(super) fn assume(
        engine: &Engine,
        class: &ClassExpression,
        individual: &Iri,
        next: &mut usize,
    ) -> Result<Vec<Engine>, Error> {
        use ClassExpression as C;
        let mut copy = engine.clone();
        let fact = match class {
            C::Class(iri) => member(&mut copy, iri, individual),
            C::HasValue(property, object) => edge(&mut copy, property, individual, object),
            C::HasSelf(property) => edge(&mut copy, property, individual, individual),
            C::DataHasValue(property, object) => value(&mut copy, property, individual, literal(object)),
            C::IntersectionOf(classes) => {
                let mut cases = vec![copy];
                for class in classes {
                    cases = Self::assume_in_each(cases, class, individual, next)?;
                }
                return Ok(cases);
            }
            C::UnionOf(classes) if classes.len() <= MAX_CASES => {
                let mut cases = Vec::new();
                for class in classes {
                    cases.extend(Self::assume(&copy, class, individual, next)?);
                    if cases.len() > MAX_CASES {
                        return Ok(vec![copy]);
                    }
                }
                return Ok(cases);
            }
            C::OneOf(names) if names.len() <= MAX_CASES => {
                let assume_equal = |name: &Iri| {
                    let mut copy = copy.clone();
                    let fact = same(&mut copy, individual, name);
                    with_facts(&copy, [fact])
                };
                return names.iter().map(assume_equal).collect();
            }
            C::SomeValuesFrom(property, filler) => {
                return Self::witnesses(&copy, property, 1, filler, individual, next);
            }
            C::Cardinality(Bound::Min, n @ 1..=8, property, filler) => {
                return Self::witnesses(&copy, property, *n, filler, individual, next);
            }
            C::Cardinality(Bound::Exact, n @ 1..=8, property, filler) => {
                let at_most = C::Cardinality(Bound::Max, *n, property.clone(), filler.clone());
                let copy = by_rules(&copy, &at_most, individual)?;
                return Self::witnesses(&copy, property, *n, filler, individual, next);
            }
            C::DataSomeValuesFrom(property, _) | C::DataCardinality(Bound::Min, 1, property, _) => {
                *next += 1;
                value(&mut copy, property, individual, Literal::fresh(*next))
            }
            other => return Ok(vec![by_rules(&copy, other, individual)?]),
        };
        Ok(vec![with_facts(&copy, [fact])?])
    }

    /// Assumes in each case that an individual is in a class. Returns the given cases if there would be more than
    /// [`MAX_CASES`].
    fn assume_in_each(
        cases: Vec<Engine>,
        class: &ClassExpression,
        individual: &Iri,
        next: &mut usize,
    ) -> Result<Vec<Engine>, Error> {
        let mut extended = Vec::new();
        for case in &cases {
            extended.extend(Self::assume(case, class, individual, next)?);
            if extended.len() > MAX_CASES {
                return Ok(cases);
            }
        }
        Ok(extended)
    }

    /// Assumes that `individual` has `count` pairwise different fresh values of a property, all in the class
    /// `filler`. Returns one engine for each case.
    fn witnesses(
        engine: &Engine,
        property: &ObjectPropertyExpression,
        count: u32,
        filler: &ClassExpression,
        individual: &Iri,
        next: &mut usize,
    ) -> Result<Vec<Engine>, Error> {
        let mut copy = engine.clone();
        let group = *next + 1;
        let names: Vec<Iri> = (0..count)
            .map(|_| {
                *next += 1;
                Symbols::fresh_name(Some(group), *next).into()
            })
            .collect();
        let mut facts: Vec<Fact> =
            names.iter().map(|name| edge(&mut copy, property, individual, name)).collect();
        facts.extend(pairwise_different(&mut copy, &names));
        let mut cases = vec![with_facts(&copy, facts)?];
        for name in &names {
            cases = Self::assume_in_each(cases, filler, name, next)?;
        }
        Ok(cases)
    }

    /// Proves that an individual is in a class. Contradictory assumptions prove everything.
    pub(super) fn is_in(
        engine: &Engine,
        class: &ClassExpression,
        individual: &Iri,
        next: &mut usize,
    ) -> ProofResult {
        use ClassExpression as C;
        if let Some(reason) = contradiction(engine) {
            return Ok(Some(format!("the assumption contradicts itself: {reason}\n")));
        }
        let mut copy = engine.clone();
        let goal = match class {
            C::Class(iri) if &**iri == owl::THING => {
                return Ok(Some("everything is in owl:Thing\n".to_owned()));
            }
            C::Class(iri) => member(&mut copy, iri, individual),
            C::HasValue(property, object) => edge(&mut copy, property, individual, object),
            C::HasSelf(property) => edge(&mut copy, property, individual, individual),
            C::DataHasValue(property, object) => value(&mut copy, property, individual, literal(object)),
            C::IntersectionOf(classes) => {
                let mut reasons = String::new();
                for class in classes {
                    match Self::is_in(&copy, class, individual, next)? {
                        Some(reason) => reasons += &reason,
                        None => return Ok(None),
                    }
                }
                return Ok(Some(reasons));
            }
            C::UnionOf(classes) => {
                return first_proof(classes, |class| Self::is_in(&copy, class, individual, next));
            }
            C::OneOf(names) => {
                return first_proof(names, |name| {
                    let goal = same(&mut copy, individual, name);
                    Ok(explain(&copy, &goal))
                });
            }
            C::ComplementOf(class) => {
                // Refutation: the individual is in the complement if membership in the class is contradictory.
                let cases = Self::assume(&copy, class, individual, next)?;
                return Ok(refuted(&cases));
            }
            C::AllValuesFrom(property, filler) => {
                // A fresh value represents all values.
                *next += 1;
                let name = Self::fresh(*next);
                let fact = edge(&mut copy, property, individual, &name);
                return Self::is_in(&with_facts(&copy, [fact])?, filler, &name, next);
            }
            C::SomeValuesFrom(property, filler) | C::Cardinality(Bound::Min, 1, property, filler) => {
                let values = values(&mut copy, property, individual);
                return first_proof(&values, |value| Self::is_in(&copy, filler, value, next));
            }
            C::Cardinality(Bound::Min, 0, ..) => return Ok(Some("nothing has fewer than none\n".to_owned())),
            // Refutation: `n` + 1 different values are contradictory.
            C::Cardinality(Bound::Max, n @ 0..=8, property, filler) => {
                let cases = Self::witnesses(&copy, property, n + 1, filler, individual, next)?;
                return Ok(refuted(&cases));
            }
            C::Cardinality(Bound::Exact, n, property, filler) => {
                let [at_least, at_most] = [Bound::Min, Bound::Max]
                    .map(|bound| C::Cardinality(bound, *n, property.clone(), filler.clone()));
                return Self::is_in(&copy, &C::IntersectionOf(vec![at_least, at_most]), individual, next);
            }
            C::DataCardinality(Bound::Max, n @ 0..=8, property, _) => {
                let facts = (0..=*n).map(|_| {
                    *next += 1;
                    value(&mut copy, property, individual, Literal::distinct(*next))
                });
                let facts: Vec<Fact> = facts.collect();
                return Ok(refuted(&[with_facts(&copy, facts)?]));
            }
            _ => return Ok(None),
        };
        Ok(explain(&copy, &goal))
    }
}

pub(super) fn values(engine: &mut Engine, property: &ObjectPropertyExpression, individual: &Iri) -> Vec<Iri> {
    let subject = symbol(engine, individual);
    let (ObjectPropertyExpression::Property(iri) | ObjectPropertyExpression::Inverse(iri)) = property;
    let predicate = symbol(engine, iri);
    let forward = matches!(property, ObjectPropertyExpression::Property(_));
    let pattern = if forward { [Some(subject), None] } else { [None, Some(subject)] };
    let name = |symbol| engine.symbols().value(symbol).as_name().map(Iri::from);
    engine.matching(predicate, &pattern).filter_map(|row| name(row[usize::from(forward)])).collect()
}

pub(super) fn first_proof<T>(attempts: &[T], mut prove: impl FnMut(&T) -> ProofResult) -> ProofResult {
    for attempt in attempts {
        if let Some(reason) = prove(attempt)? {
            return Ok(Some(reason));
        }
    }
    Ok(None)
}

pub(super) fn refuted(cases: &[Engine]) -> Option<String> {
    let reasons: Option<Vec<String>> = cases.iter().map(contradiction).collect();
    Some(format!("the opposite is impossible: {}\n", reasons?.join("; and ")))
}

pub(super) fn pairwise_different(engine: &mut Engine, names: &[Iri]) -> Vec<Fact> {
    let different = symbol(engine, owl::DIFFERENT_FROM);
    let names: Vec<_> = names.iter().map(|name| symbol(engine, name)).collect();
    let pairs = names
        .iter()
        .enumerate()
        .flat_map(|(index, first)| names[index + 1..].iter().map(move |second| [*first, *second]));
    pairs.map(|pair| Fact::new(different, pair)).collect()
}

fn by_rules(engine: &Engine, class: &ClassExpression, individual: &Iri) -> Result<Engine, Error> {
    let mut engine = monotone(engine)?;
    let axiom = Axiom::ClassAssertion(class.clone(), individual.clone());
    let axioms = vec![AnnotatedAxiom { axiom, annotations: Vec::new() }];
    let lowered = lower(&Ontology { axioms, ..Ontology::default() }, engine.symbols_mut());
    let old = engine.program().rules.clone();
    let is_new =
        |rule: &rules::Rule| !old.iter().any(|other| other.head == rule.head && other.body == rule.body);
    let mut new: Vec<rules::Rule> = lowered.program.rules.into_iter().filter(is_new).collect();
    for rule in &mut new {
        // Distinguishes these rules from those of the knowledge base.
        rule.identity.source = "urn:metaplan:assumed".into();
    }
    if !new.is_empty() {
        engine.add_rules(new).map_err(|errors| errors.into_vec().remove(0))?;
    }
    engine.apply(Delta { insert: lowered.facts, delete: Vec::new() })?;
    Ok(engine)
}
