//! Translates SWRL rules to derived predicates.
//!
//! Variables keep their names. PDDL heads admit variables only, so a constant in a head becomes a parameter with an
//! equality condition. Numeric comparisons become predicates over the objects that represent the numbers. `sameAs`
//! and `differentFrom` become (in)equality, because PDDL has unique names.

use std::collections::BTreeMap;

use ontology::vocab::{local_name, swrlb};
use ontology::{Argument, Atom, ClassExpression, Iri, ObjectPropertyExpression, Rule};
use pddl::ast::{Condition, Derived, Name, Span, Term};

use super::names::{self, EQUAL, LESS};
use super::syntax::{atom, axiom, exists, variable};
use super::terms::{Terms, is_bottom, is_top};

/// PDDL names for the variables of a rule. Different variables have different names.
#[derive(Default)]
struct Variables {
    names: BTreeMap<Iri, String>,
}

impl Variables {
    fn name(&mut self, iri: &Iri) -> String {
        if let Some(name) = self.names.get(iri) {
            return name.clone();
        }
        let plain = names::plain(iri).to_string();
        let is_used = |name: &str| self.names.values().any(|other| other.eq_ignore_ascii_case(name));
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|name| !is_used(name));
        let name = free.unwrap_or(plain);
        self.names.insert(iri.clone(), name.clone());
        name
    }
}

/// Translates a rule to derived predicates, one for each atom of the rule's head.
pub(super) fn derived(rule: &Rule, terms: &mut Terms) -> Result<Vec<Derived>, String> {
    if rule.head.is_empty() {
        return Err("it concludes nothing".to_owned());
    }
    let mut variables = Variables::default();
    let mut body = Vec::new();
    for atom in &rule.body {
        body.extend(condition(atom, &mut variables, terms)?);
    }
    let heads = rule.head.iter().map(|head| conclude(head, &body, &mut variables, terms));
    heads.collect()
}

fn conclude(
    head: &Atom,
    body: &[Condition],
    variables: &mut Variables,
    terms: &mut Terms,
) -> Result<Derived, String> {
    let (iri, arguments) = match head {
        Atom::Class(ClassExpression::Class(class), own) if !is_top(class) && !is_bottom(class) => {
            (class, vec![own])
        }
        Atom::ObjectProperty(ObjectPropertyExpression::Property(property), own, other)
        | Atom::ObjectProperty(ObjectPropertyExpression::Inverse(property), other, own)
        | Atom::DataProperty(property, own, other) => (property, vec![own, other]),
        _ => return Err("its head is neither of a named class nor of a property".to_owned()),
    };
    let plain = terms.plain(iri, arguments.len())?;
    let (mut parameters, mut equal) = (Vec::<String>::new(), Vec::new());
    for argument in arguments {
        let value = term(argument, variables, terms);
        let parameter = match &value {
            Term::Variable(parameter)
                if !parameters.iter().any(|other| *other == parameter.name.as_str()) =>
            {
                parameter.name.to_string()
            }
            Term::Variable(parameter) | Term::Constant(parameter) => {
                // A name of another variable would be captured.
                let is_used = |name: &str| {
                    let mut names = variables.names.values().chain(&parameters);
                    names.any(|other| other.eq_ignore_ascii_case(name))
                };
                let mut numbered =
                    (parameters.len() + 1..).map(|number| format!("{}_{number}", parameter.name));
                let free = numbered.find(|name| !is_used(name));
                let parameter = free.unwrap_or_else(|| parameter.name.to_string());
                equal.push(Condition::Equal(variable(&parameter), value, Span::default()));
                parameter
            }
        };
        parameters.push(parameter);
    }
    let bound: Vec<String> =
        variables.names.values().filter(|name| !parameters.contains(name)).cloned().collect();
    let bound: Vec<&str> = bound.iter().map(String::as_str).collect();
    let parameters: Vec<&str> = parameters.iter().map(String::as_str).collect();
    let inner = exists(&bound, Condition::And(body.to_vec()));
    equal.push(inner);
    let condition = if equal.len() == 1 { equal.remove(0) } else { Condition::And(equal) };
    Ok(axiom(names::inferred(&plain), &parameters, condition))
}

fn term(argument: &Argument, variables: &mut Variables, terms: &mut Terms) -> Term {
    match argument {
        Argument::Variable(iri) => variable(&variables.name(iri)),
        Argument::Individual(iri) => Term::Constant(terms.individual(iri).into()),
        Argument::Literal(literal) => Term::Constant(terms.literal(literal).into()),
    }
}

/// Translates a body atom of a rule. Returns `None` for an atom of `owl:Thing`, to which every individual
/// belongs. Returns an error with the reason if the atom has no translation.
fn condition(
    stated: &Atom,
    variables: &mut Variables,
    terms: &mut Terms,
) -> Result<Option<Condition>, String> {
    let mut pair = |left: &Argument, right: &Argument, terms: &mut Terms| {
        [term(left, variables, terms), term(right, variables, terms)]
    };
    let condition = match stated {
        Atom::Class(ClassExpression::Class(class), individual) => {
            let individual = term(individual, variables, terms);
            if is_top(class) {
                return Ok(None);
            }
            if is_bottom(class) {
                return Err("its body requires an individual of owl:Nothing".to_owned());
            }
            terms.inferred(class, vec![individual])?
        }
        Atom::ObjectProperty(ObjectPropertyExpression::Property(property), own, other)
        | Atom::ObjectProperty(ObjectPropertyExpression::Inverse(property), other, own)
        | Atom::DataProperty(property, own, other) => {
            let arguments = pair(own, other, terms).to_vec();
            terms.inferred(property, arguments)?
        }
        Atom::SameIndividual(left, right) => {
            let [left, right] = pair(left, right, terms);
            Condition::Equal(left, right, Span::default())
        }
        Atom::DifferentIndividuals(left, right) => {
            let [left, right] = pair(left, right, terms);
            Condition::Not(Box::new(Condition::Equal(left, right, Span::default())))
        }
        Atom::BuiltIn(iri, arguments) => {
            let [left, right] = &arguments[..] else {
                return Err(format!("PDDL has no form for the built-in `{}`", local_name(iri)));
            };
            let [left, right] = pair(left, right, terms);
            comparison(iri, &left, &right)?
        }
        Atom::Class(..) => return Err("it asks for a class expression".to_owned()),
        Atom::DataRange(..) => return Err("it asks for a data range".to_owned()),
    };
    Ok(Some(condition))
}

fn comparison(iri: &str, left: &Term, right: &Term) -> Result<Condition, String> {
    let relation = |name: &str, left: &Term, right: &Term| {
        Condition::Atom(atom(Name::new(name), vec![left.clone(), right.clone()]))
    };
    let name = iri.strip_prefix(swrlb::NS).unwrap_or(iri);
    Ok(match name {
        "lessThan" => relation(LESS, left, right),
        "greaterThan" => relation(LESS, right, left),
        "equal" => {
            let identical = Condition::Equal(left.clone(), right.clone(), Span::default());
            Condition::Or(vec![identical, relation(EQUAL, left, right)])
        }
        "notEqual" => {
            let identical = Condition::Equal(left.clone(), right.clone(), Span::default());
            let either = [identical, relation(EQUAL, left, right)];
            Condition::And(either.map(|condition| Condition::Not(Box::new(condition))).into())
        }
        "lessThanOrEqual" => Condition::Or(vec![relation(LESS, left, right), relation(EQUAL, left, right)]),
        "greaterThanOrEqual" => {
            Condition::Or(vec![relation(LESS, right, left), relation(EQUAL, left, right)])
        }
        _ => return Err(format!("PDDL has no form for the built-in `{}`", local_name(iri))),
    })
}
