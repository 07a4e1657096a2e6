//! Proves axioms: the conditions of an axiom become assumptions, i.e. facts in a copy of the engine. Its
//! conclusions become goals, which the copy has to derive.

use std::collections::BTreeSet;

use rules::{Engine, Error, Fact, Literal};

use super::assume::{pairwise_different, refuted};
use super::prover::{Answer, ProofResult, Prover, edge, explain, literal, named, same, value, with_facts};
use crate::owl::{Axiom, Characteristic, ClassExpression, Iri, ObjectPropertyExpression as Property};
use crate::vocab::owl;

impl Prover {
    pub(super) fn axiom(&self, axiom: &Axiom) -> Result<Answer, Error> {
        if let Axiom::DatatypeDefinition(..) = axiom {
            return Ok(Answer::Open("definitions of datatypes are not decided"));
        }
        let reason = match self.classes(axiom)? {
            Some(reason) => Some(reason),
            None => match self.properties(axiom)? {
                Some(reason) => Some(reason),
                None => self.individuals(axiom)?,
            },
        };
        Ok(reason.map_or(Answer::Open("the rules do not conclude it"), Answer::Follows))
    }

    fn classes(&self, axiom: &Axiom) -> ProofResult {
        match axiom {
            Axiom::SubClassOf(sub, sup) => self.sub_class(sub, sup),
            Axiom::EquivalentClasses(classes) => {
                let next = classes.iter().cycle().skip(1);
                prove_all(classes.iter().zip(next), |(sub, sup)| self.sub_class(sub, sup))
            }
            Axiom::DisjointClasses(classes) => self.disjoint(classes),
            Axiom::DisjointUnion(class, parts) => {
                let (class, union) =
                    (ClassExpression::Class(class.clone()), ClassExpression::UnionOf(parts.clone()));
                let pairs = [(&class, &union), (&union, &class)];
                let equivalence = prove_all(pairs.into_iter(), |(sub, sup)| self.sub_class(sub, sup))?;
                Ok(equivalence
                    .zip(self.disjoint(parts)?)
                    .map(|(equivalence, disjoint)| equivalence + &disjoint))
            }
            Axiom::HasKey(class, objects, data) => {
                // Two fresh members with equal values of all keys must be the same individual.
                let (x, y, mut next) = (Self::fresh(0), Self::fresh(1), 2);
                let mut copy = self.monotone.clone();
                let mut facts = Vec::new();
                for property in objects {
                    next += 1;
                    let shared = Self::fresh(next);
                    facts.extend([&x, &y].map(|end| edge(&mut copy, property, end, &shared)));
                }
                for property in data {
                    next += 1;
                    facts.extend([&x, &y].map(|end| value(&mut copy, property, end, Literal::fresh(next))));
                }
                // Keys concern only individuals with a name.
                let symbols: BTreeSet<_> = facts.iter().flat_map(|fact| fact.arguments.clone()).collect();
                facts.extend(symbols.into_iter().map(|symbol| named(&mut copy, symbol)));
                let mut reasons = String::new();
                for case in Self::assume(&with_facts(&copy, facts)?, class, &x, &mut next)? {
                    for mut case in Self::assume(&case, class, &y, &mut next)? {
                        let goal = same(&mut case, &x, &y);
                        match explain(&case, &goal) {
                            Some(reason) => reasons += &reason,
                            None => return Ok(None),
                        }
                    }
                }
                Ok(Some(reasons))
            }
            _ => Ok(None),
        }
    }

    fn sub_class(&self, sub: &ClassExpression, sup: &ClassExpression) -> ProofResult {
        let (x, mut next) = (Self::fresh(0), 0);
        let mut reasons = String::new();
        for case in Self::assume(&self.monotone, sub, &x, &mut next)? {
            match Self::is_in(&case, sup, &x, &mut next)? {
                Some(reason) => reasons += &reason,
                None => return Ok(None),
            }
        }
        Ok(Some(reasons))
    }

    fn disjoint(&self, classes: &[ClassExpression]) -> ProofResult {
        let pairs = classes.iter().enumerate();
        let pairs =
            pairs.flat_map(|(index, first)| classes[index + 1..].iter().map(move |second| (first, second)));
        prove_all(pairs, |(first, second)| {
            let intersection = ClassExpression::IntersectionOf(vec![first.clone(), second.clone()]);
            let cases = Self::assume(&self.monotone, &intersection, &Self::fresh(0), &mut 0)?;
            Ok(refuted(&cases))
        })
    }

    /// Proves a property axiom: assumes the edges of `body` between fresh individuals, then proves the
    /// edge `head`. An edge consists of a property and the numbers of two fresh individuals.
    fn implies(&self, body: &[(&Property, usize, usize)], head: (&Property, usize, usize)) -> ProofResult {
        let mut copy = self.assumed(body)?;
        let (property, from, to) = head;
        let goal = edge(&mut copy, property, &Self::fresh(from), &Self::fresh(to));
        Ok(explain_or_refute(&copy, &goal))
    }

    fn assumed(&self, body: &[(&Property, usize, usize)]) -> Result<Engine, Error> {
        let mut copy = self.monotone.clone();
        let facts: Vec<Fact> = body
            .iter()
            .map(|(property, from, to)| edge(&mut copy, property, &Self::fresh(*from), &Self::fresh(*to)))
            .collect();
        with_facts(&copy, facts)
    }

    fn merges(&self, body: &[(&Property, usize, usize)], left: usize, right: usize) -> ProofResult {
        let mut copy = self.assumed(body)?;
        let goal = same(&mut copy, &Self::fresh(left), &Self::fresh(right));
        Ok(explain_or_refute(&copy, &goal))
    }

    fn properties(&self, axiom: &Axiom) -> ProofResult {
        match axiom {
            Axiom::SubObjectPropertyOf(sub, sup) => self.implies(&[(sub, 0, 1)], (sup, 0, 1)),
            Axiom::SubPropertyChainOf(chain, sup) => {
                let body: Vec<_> =
                    chain.iter().enumerate().map(|(index, link)| (link, index, index + 1)).collect();
                self.implies(&body, (sup, 0, chain.len()))
            }
            Axiom::EquivalentObjectProperties(properties) => {
                let next = properties.iter().cycle().skip(1);
                prove_all(properties.iter().zip(next), |(sub, sup)| self.implies(&[(sub, 0, 1)], (sup, 0, 1)))
            }
            Axiom::InverseObjectProperties(first, second) => {
                let [first, second] = [first, second].map(|iri| Property::Property(iri.clone()));
                let pairs = [(&first, &second), (&second, &first)];
                prove_all(pairs.into_iter(), |(sub, sup)| self.implies(&[(sub, 0, 1)], (sup, 1, 0)))
            }
            Axiom::DisjointObjectProperties(properties) => {
                let pairs = properties.iter().enumerate();
                let pairs = pairs.flat_map(|(index, p)| properties[index + 1..].iter().map(move |q| (p, q)));
                prove_all(pairs, |(p, q)| Ok(refuted(&[self.assumed(&[(p, 0, 1), (q, 0, 1)])?])))
            }
            Axiom::ObjectPropertyDomain(property, class) => {
                Self::is_in(&self.assumed(&[(property, 0, 1)])?, class, &Self::fresh(0), &mut 1)
            }
            Axiom::ObjectPropertyRange(property, class) => {
                Self::is_in(&self.assumed(&[(property, 0, 1)])?, class, &Self::fresh(1), &mut 1)
            }
            Axiom::ObjectPropertyCharacteristic(characteristic, p) => match characteristic {
                Characteristic::Functional => self.merges(&[(p, 0, 1), (p, 0, 2)], 1, 2),
                Characteristic::InverseFunctional => self.merges(&[(p, 1, 0), (p, 2, 0)], 1, 2),
                Characteristic::Symmetric => self.implies(&[(p, 0, 1)], (p, 1, 0)),
                Characteristic::Transitive => self.implies(&[(p, 0, 1), (p, 1, 2)], (p, 0, 2)),
                Characteristic::Irreflexive => Ok(refuted(&[self.assumed(&[(p, 0, 0)])?])),
                Characteristic::Asymmetric => Ok(refuted(&[self.assumed(&[(p, 0, 1), (p, 1, 0)])?])),
                Characteristic::Reflexive => {
                    let mut copy = self.monotone.clone();
                    let symbols = copy.symbols_mut();
                    let is_thing = Fact::new(symbols.name(owl::THING), [symbols.name(&Self::fresh(0))]);
                    let mut copy = with_facts(&copy, [is_thing])?;
                    let goal = edge(&mut copy, p, &Self::fresh(0), &Self::fresh(0));
                    Ok(explain(&copy, &goal))
                }
            },
            _ => self.data_properties(axiom),
        }
    }

    fn data_properties(&self, axiom: &Axiom) -> ProofResult {
        let assumed_values = |properties: &[&Iri], values: &[Literal]| -> Result<Engine, Error> {
            let mut copy = self.monotone.clone();
            let edges = properties.iter().zip(values);
            let facts: Vec<Fact> = edges
                .map(|(property, object)| value(&mut copy, property, &Self::fresh(0), object.clone()))
                .collect();
            with_facts(&copy, facts)
        };
        // One value of all properties.
        let assumed =
            |properties: &[&Iri]| assumed_values(properties, &vec![Literal::fresh(1); properties.len()]);
        let implies = |(sub, sup): (&Iri, &Iri)| -> ProofResult {
            let mut copy = assumed(&[sub])?;
            let goal = value(&mut copy, sup, &Self::fresh(0), Literal::fresh(1));
            Ok(explain_or_refute(&copy, &goal))
        };
        match axiom {
            Axiom::SubDataPropertyOf(sub, sup) => implies((sub, sup)),
            Axiom::EquivalentDataProperties(properties) => {
                prove_all(properties.iter().zip(properties.iter().cycle().skip(1)), implies)
            }
            Axiom::DisjointDataProperties(properties) => {
                let pairs = properties.iter().enumerate();
                let pairs = pairs.flat_map(|(index, p)| properties[index + 1..].iter().map(move |q| (p, q)));
                prove_all(pairs, |(p, q)| Ok(refuted(&[assumed(&[p, q])?])))
            }
            Axiom::FunctionalDataProperty(property) => {
                Ok(refuted(&[assumed_values(&[property; 2], &[1, 2].map(Literal::distinct))?]))
            }
            Axiom::DataPropertyRange(property, range) => Ok(self.range(property, range)?),
            Axiom::DataPropertyDomain(property, class) => {
                Self::is_in(&assumed(&[property])?, class, &Self::fresh(0), &mut 1)
            }
            _ => Ok(None),
        }
    }

    fn individuals(&self, axiom: &Axiom) -> ProofResult {
        let mut copy = self.base.clone();
        match axiom {
            Axiom::ClassAssertion(class, individual) => Self::is_in(&copy, class, individual, &mut 0),
            Axiom::ObjectPropertyAssertion(property, from, to) => {
                let goal = edge(&mut copy, property, from, to);
                Ok(explain(&copy, &goal))
            }
            Axiom::DataPropertyAssertion(property, from, to) => {
                let goal = value(&mut copy, property, from, literal(to));
                Ok(explain(&copy, &goal))
            }
            Axiom::NegativeObjectPropertyAssertion(property, from, to) => {
                let opposite = edge(&mut copy, property, from, to);
                Ok(refuted(&[with_facts(&copy, [opposite])?]))
            }
            Axiom::NegativeDataPropertyAssertion(property, from, to) => {
                let opposite = value(&mut copy, property, from, literal(to));
                Ok(refuted(&[with_facts(&copy, [opposite])?]))
            }
            Axiom::SameIndividual(names) => prove_all(names.windows(2), |pair| {
                let goal = same(&mut copy, &pair[0], &pair[1]);
                Ok(explain(&copy, &goal))
            }),
            Axiom::DifferentIndividuals(names) => {
                let pairs = names.iter().enumerate();
                let pairs = pairs.flat_map(|(index, x)| names[index + 1..].iter().map(move |y| (x, y)));
                prove_all(pairs, |(x, y)| {
                    let goal = pairwise_different(&mut copy, &[x.clone(), y.clone()]).remove(0);
                    if let Some(reason) = explain(&copy, &goal) {
                        return Ok(Some(reason));
                    }
                    let opposite = same(&mut copy, x, y);
                    Ok(refuted(&[with_facts(&copy, [opposite])?]))
                })
            }
            _ => Ok(None),
        }
    }
}

fn explain_or_refute(engine: &Engine, goal: &Fact) -> Option<String> {
    explain(engine, goal).or_else(|| refuted(std::slice::from_ref(engine)))
}

fn prove_all<T>(goals: impl Iterator<Item = T>, mut prove: impl FnMut(T) -> ProofResult) -> ProofResult {
    let mut reasons = String::new();
    for goal in goals {
        match prove(goal)? {
            Some(reason) => reasons += &reason,
            None => return Ok(None),
        }
    }
    Ok(Some(reasons))
}
