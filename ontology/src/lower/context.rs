//! What lowering collects, and the small vocabulary in which the other files of this folder write rules.

use std::collections::{HashMap, HashSet};

use rules::{Atom, Fact, Rule, RuleIdentity, Symbol, Symbols, Term, Variable};
use rustc_hash::FxHashMap;

use super::inclusion::Inclusions;
use crate::error::Warning;
use crate::owl::{Axiom, DataRange, EntityKind, Iri, Literal, ObjectPropertyExpression, Ontology};
use crate::vocab::{local_name, owl};

/// What the names of relations start with that serve this crate only; they are not part of the knowledge base.
pub const INTERNAL: &str = "urn:metaplan:";

/// The identity's source of rules that stand for axioms; the label is then the axiom in functional-style syntax.
pub const AXIOM_SOURCE: &str = "http://www.w3.org/2002/07/owl";

/// Whether two names can stand for one individual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Equality {
    /// They can: the semantics of OWL.
    #[default]
    Owl,
    /// They cannot: the semantics of databases and of PDDL.
    UniqueNames,
}

/// Atoms that must all hold.
pub(crate) type Conjunction = Vec<Atom>;

/// Every conjunction of the first with every one of the second.
pub(crate) fn cross(left: &[Conjunction], right: &[Conjunction]) -> Vec<Conjunction> {
    left.iter().flat_map(|l| right.iter().map(move |r| l.iter().chain(r).cloned().collect())).collect()
}

/// Rules, facts and warnings so far.
pub(crate) struct Context<'a> {
    pub symbols: &'a mut Symbols,
    pub rules: Vec<Rule>,
    pub facts: Vec<Fact>,
    pub warnings: Vec<Warning>,
    pub equality: Equality,
    /// Named data ranges.
    pub definitions: HashMap<Iri, DataRange>,
    /// The IRIs of classes and of properties.
    entities: HashSet<(EntityKind, Iri)>,
    /// What is lowered now.
    pub identity: RuleIdentity,
    /// Why parts of it have no rule form.
    gaps: Vec<&'static str>,
    /// Restrictions that include others, or that others include.
    pub inclusions: Inclusions,
    /// Classes that have an auxiliary relation.
    pub abbreviated: HashSet<String>,
    /// The symbols of IRIs by where their texts lie: an ontology keeps each text once.
    shared: FxHashMap<*const u8, Symbol>,
}

/// The variables of one rule.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variables {
    /// By number; an IRI where the rule has one.
    keys: Vec<Iri>,
}

impl Variables {
    /// A new variable.
    pub(crate) fn fresh(&mut self, name: &str) -> Term {
        self.keys.push(name.into());
        Term::Variable(Variable((self.keys.len() - 1) as u16))
    }

    /// The variable of that IRI, new if there is none.
    pub(crate) fn of_iri(&mut self, iri: &Iri) -> Term {
        match self.keys.iter().position(|key| key == iri) {
            Some(index) => Term::Variable(Variable(index as u16)),
            None => self.fresh(iri),
        }
    }

    /// What to print for each.
    fn names(&self) -> Vec<Box<str>> {
        self.keys.iter().map(|key| local_name(key).into()).collect()
    }
}

/// The labels of rules are cut after so many characters: an axiom can have thousands of members.
const LONGEST_LABEL: usize = 2_000;

/// The identity of the rules of an axiom.
pub(crate) fn identity(axiom: &Axiom, position: usize) -> RuleIdentity {
    let mut label = axiom.to_string();
    if let Some((end, _)) = label.char_indices().nth(LONGEST_LABEL) {
        label.truncate(end);
        label.push('…');
    }
    RuleIdentity { source: AXIOM_SOURCE.into(), label: Some(label.into()), position: position as u32 }
}

impl<'a> Context<'a> {
    pub(crate) fn new(symbols: &'a mut Symbols, equality: Equality, ontology: &Ontology) -> Self {
        let definitions = ontology.axioms.iter().filter_map(|annotated| match &annotated.axiom {
            Axiom::DatatypeDefinition(name, range) => Some((name.clone(), range.clone())),
            _ => None,
        });
        Self {
            symbols,
            rules: Vec::new(),
            facts: Vec::new(),
            warnings: Vec::new(),
            equality,
            definitions: definitions.collect(),
            entities: ontology.entities.iter().cloned().collect(),
            identity: RuleIdentity::new(AXIOM_SOURCE, 0),
            gaps: Vec::new(),
            inclusions: Inclusions::new(ontology),
            abbreviated: HashSet::new(),
            shared: FxHashMap::default(),
        }
    }

    /// Whether an IRI names an entity of a kind.
    pub(crate) fn is(&self, kind: EntityKind, iri: &Iri) -> bool {
        self.entities.contains(&(kind, iri.clone()))
    }

    /// The entities of a kind, sorted.
    pub(crate) fn all(&self, kind: EntityKind) -> Vec<Iri> {
        let mut all: Vec<Iri> =
            self.entities.iter().filter(|(other, _)| *other == kind).map(|(_, iri)| iri.clone()).collect();
        all.sort();
        all
    }

    /// That a term is an individual.
    pub(crate) fn thing(&mut self, term: Term) -> Atom {
        self.relation(owl::THING, [term])
    }

    /// Notes that a part of what is lowered now has no rule form; what is returned for it concludes nothing.
    pub(crate) fn gap<T: Default>(&mut self, reason: &'static str) -> T {
        self.gaps.push(reason);
        T::default()
    }

    /// What had no rule form since the last call, if anything: the first reason.
    pub(crate) fn take_gaps(&mut self) -> Result<(), &'static str> {
        let first = self.gaps.first().copied();
        self.gaps.clear();
        first.map_or(Ok(()), Err)
    }

    pub(crate) fn name(&mut self, iri: &str) -> Symbol {
        self.symbols.name(iri)
    }

    /// The symbol of an IRI of the ontology, which is found without looking at its text.
    pub(crate) fn iri(&mut self, iri: &Iri) -> Symbol {
        let symbols = &mut *self.symbols;
        *self.shared.entry(iri.as_ptr()).or_insert_with(|| symbols.name(iri))
    }

    pub(crate) fn constant(&mut self, iri: &str) -> Term {
        Term::Constant(self.symbols.name(iri))
    }

    pub(crate) fn literal(&mut self, literal: &Literal) -> Symbol {
        let value =
            rules::Literal::parse(&literal.lexical, literal.datatype.as_deref(), literal.language.as_deref());
        self.symbols.literal(value)
    }

    /// `name(arguments)`.
    pub(crate) fn relation<const N: usize>(&mut self, name: &str, arguments: [Term; N]) -> Atom {
        Atom::relation(self.symbols.name(name), arguments)
    }

    /// `property(first, second)`, or the other way round for an inverse.
    pub(crate) fn property(
        &mut self,
        property: &ObjectPropertyExpression,
        first: Term,
        second: Term,
    ) -> Atom {
        match property {
            ObjectPropertyExpression::Property(iri) => self.relation(iri, [first, second]),
            ObjectPropertyExpression::Inverse(iri) => self.relation(iri, [second, first]),
        }
    }

    /// Adds that two individuals are one where `body` holds, unless every name is an individual of its own.
    pub(crate) fn merge(
        &mut self,
        identity: &RuleIdentity,
        pair: [Term; 2],
        body: Conjunction,
        variables: &Variables,
    ) {
        if self.equality == Equality::Owl {
            // The engine compares symbols here: an individual is not concluded to be the same as itself.
            let body = body.into_iter().chain([Atom::Different(pair[0], pair[1])]).collect();
            self.rule(identity, vec![Atom::Same(pair[0], pair[1])], body, variables);
        }
    }

    /// The condition that two individuals differ.
    pub(crate) fn different(&mut self, first: Term, second: Term) -> Atom {
        match self.equality {
            Equality::Owl => self.relation(owl::DIFFERENT_FROM, [first, second]),
            Equality::UniqueNames => Atom::Different(first, second),
        }
    }

    /// The relation that holds the members of a data range. It goes by the text of the range, so that two ontologies
    /// lowered into the same symbols share it where they should, and only there.
    pub(crate) fn members_of(&mut self, range: &DataRange) -> Symbol {
        self.symbols.name(&format!("{INTERNAL}range:{range}"))
    }

    /// Adds a fact.
    pub(crate) fn state<const N: usize>(&mut self, predicate: Symbol, arguments: [Symbol; N]) {
        self.facts.push(Fact::new(predicate, arguments));
    }

    /// Adds a rule.
    pub(crate) fn rule(
        &mut self,
        identity: &RuleIdentity,
        head: Vec<Atom>,
        body: Conjunction,
        variables: &Variables,
    ) {
        let variables = variables.names();
        self.rules.push(Rule { identity: identity.clone(), head, body, variables });
    }

    /// Reports an axiom, or a part of one, that is left out.
    pub(crate) fn outside(&mut self, axiom: &Axiom, partly: bool, reason: &str) {
        let (axiom, reason) = (axiom.to_string(), reason.to_owned());
        self.warnings.push(Warning::OutsideProfile { axiom, partly, reason });
    }
}
