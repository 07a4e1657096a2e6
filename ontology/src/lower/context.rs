//! State of the lowering, and constructors of rules and atoms that the other files of this folder use.

use std::collections::{HashMap, HashSet};

use rules::{Atom, Fact, Rule, RuleIdentity, Symbol, Symbols, Term, Variable};
use rustc_hash::FxHashMap;

use super::inclusion::Inclusions;
use crate::error::Warning;
use crate::owl::{
    Axiom, ClassExpression, DataRange, EntityKind, Iri, Literal, ObjectPropertyExpression, Ontology,
};
use crate::vocab::{local_name, owl};

/// Prefix of generated IRIs. A relation with this prefix is auxiliary, i.e. not part of the knowledge base.
pub const INTERNAL: &str = "urn:metaplan:";

/// Source in the identity of a rule that is lowered from an axiom or from OWL's own vocabulary. The label of
/// such a rule is an axiom or class expression in functional-style syntax, truncated if it is long, or a short name of
/// the rule.
pub const AXIOM_SOURCE: &str = "http://www.w3.org/2002/07/owl";

/// Semantics of the names of individuals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Equality {
    /// Two names can denote the same individual: the semantics of OWL.
    #[default]
    Owl,
    /// Different names denote different individuals: the semantics of databases and of PDDL. The knowledge is
    /// inconsistent if an axiom makes two names equal.
    UniqueNames,
    /// Different names denote different individuals, but axioms that make two names equal have no consequences. So
    /// several values of a functional object property are accepted.
    UncheckedUniqueNames,
}

pub(crate) type Conjunction = Vec<Atom>;

pub(crate) fn cross(left: &[Conjunction], right: &[Conjunction]) -> Vec<Conjunction> {
    left.iter().flat_map(|l| right.iter().map(move |r| l.iter().chain(r).cloned().collect())).collect()
}

pub(crate) struct Context<'a> {
    pub symbols: &'a mut Symbols,
    pub rules: Vec<Rule>,
    /// For each SWRL rule: index in `rules` of the first rule that was lowered from it.
    pub swrl_starts: Vec<usize>,
    pub facts: Vec<Fact>,
    pub warnings: Vec<Warning>,
    pub equality: Equality,
    pub definitions: HashMap<Iri, DataRange>,
    entities: HashSet<(EntityKind, Iri)>,
    gaps: Vec<&'static str>,
    pub inclusions: Inclusions,
    /// Names of the auxiliary relations whose rules have already been added.
    pub abbreviated: HashSet<String>,
    /// Rules of the auxiliary relations. They are not in `rules`, because several axioms and rules share a relation, and
    /// the first of them may be removed.
    pub auxiliary: Vec<Rule>,
    /// Maps the address of an IRI's text to the symbol of the IRI. Documents that are read together share equal texts,
    /// so the look-up need not read the text.
    shared: FxHashMap<*const u8, Symbol>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Variables {
    /// Names, indexed by variable number; the names of variables of SWRL rules are IRIs.
    keys: Vec<Iri>,
}

const TOO_MANY_VARIABLES: &str = "it needs more than 65,536 variables";

/// Upper limit on the number of variables of a rule, because a variable has 16 bits.
const MAX_VARIABLES: usize = 1 << 16;

impl Variables {
    /// Returns a new variable. Beyond [`MAX_VARIABLES`], numbers repeat; [`Context::rule`] then rejects the rule.
    pub(crate) fn fresh(&mut self, name: &str) -> Term {
        self.keys.push(name.into());
        Term::Variable(Variable((self.keys.len() - 1) as u16))
    }

    pub(crate) fn of_iri(&mut self, iri: &Iri) -> Term {
        match self.keys.iter().position(|key| key == iri) {
            Some(index) => Term::Variable(Variable(index as u16)),
            None => self.fresh(iri),
        }
    }

    /// Returns the names of the variables; `None` if there are more than [`MAX_VARIABLES`].
    fn names(&self) -> Option<Vec<Box<str>>> {
        let names = || self.keys.iter().map(|key| local_name(key).into()).collect();
        (self.keys.len() <= MAX_VARIABLES).then(names)
    }
}

/// Limit on the length of a rule's label, in characters: an axiom can have thousands of members.
const MAX_LABEL_CHARS: usize = 2_000;

pub(crate) fn identity(axiom: &Axiom, position: usize) -> RuleIdentity {
    labelled(axiom.to_string(), position)
}

fn labelled(mut label: String, position: usize) -> RuleIdentity {
    if let Some((end, _)) = label.char_indices().nth(MAX_LABEL_CHARS) {
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
            swrl_starts: Vec::new(),
            facts: Vec::new(),
            warnings: Vec::new(),
            equality,
            definitions: definitions.collect(),
            entities: ontology.entities.iter().cloned().collect(),
            gaps: Vec::new(),
            inclusions: Inclusions::new(ontology),
            abbreviated: HashSet::new(),
            auxiliary: Vec::new(),
            shared: FxHashMap::default(),
        }
    }

    pub(crate) fn is(&self, kind: EntityKind, iri: &Iri) -> bool {
        self.entities.contains(&(kind, iri.clone()))
    }

    pub(crate) fn entities_of_kind(&self, kind: EntityKind) -> Vec<Iri> {
        let mut iris: Vec<Iri> =
            self.entities.iter().filter(|(other, _)| *other == kind).map(|(_, iri)| iri.clone()).collect();
        iris.sort();
        iris
    }

    pub(crate) fn thing(&mut self, term: Term) -> Atom {
        self.relation(owl::THING, [term])
    }

    /// Records that a part of the current axiom or rule has no rule form. Returns an empty result, which
    /// has no consequences.
    pub(crate) fn gap<T: Default>(&mut self, reason: &'static str) -> T {
        self.gaps.push(reason);
        T::default()
    }

    pub(crate) fn take_gaps(&mut self) -> Result<(), &'static str> {
        let first = self.gaps.first().copied();
        self.gaps.clear();
        first.map_or(Ok(()), Err)
    }

    pub(crate) fn name(&mut self, iri: &str) -> Symbol {
        self.symbols.name(iri)
    }

    /// Returns the symbol of an IRI of the ontology. An IRI that occurred before is found by its address,
    /// without reading its text.
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

    pub(crate) fn relation<const N: usize>(&mut self, name: &str, arguments: [Term; N]) -> Atom {
        Atom::relation(self.symbols.name(name), arguments)
    }

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

    /// Adds the rule `body → pair[0] owl:sameAs pair[1]`. Under the unique name assumption, adds the constraint that the
    /// body does not hold for two different names, or nothing if this is not checked.
    pub(crate) fn merge(
        &mut self,
        identity: &RuleIdentity,
        pair: [Term; 2],
        body: Conjunction,
        variables: &Variables,
    ) {
        // `Different` compares symbols here. In an equality rule it is only a guard: the rule must not conclude that an
        // individual is the same as itself.
        let body = body.into_iter().chain([Atom::Different(pair[0], pair[1])]).collect();
        match self.equality {
            Equality::Owl => self.rule(identity, vec![Atom::Same(pair[0], pair[1])], body, variables),
            Equality::UniqueNames => self.rule(identity, Vec::new(), body, variables),
            Equality::UncheckedUniqueNames => {}
        }
    }

    pub(crate) fn different(&mut self, first: Term, second: Term) -> Atom {
        match self.equality {
            Equality::Owl => self.relation(owl::DIFFERENT_FROM, [first, second]),
            Equality::UniqueNames | Equality::UncheckedUniqueNames => Atom::Different(first, second),
        }
    }

    /// Returns the auxiliary relation that contains the members of a data range. Its name contains the range,
    /// so that ontologies lowered with the same symbols share it only for equal ranges.
    pub(crate) fn members_of(&mut self, range: &DataRange) -> Symbol {
        self.symbols.name(&format!("{INTERNAL}range:{range}"))
    }

    pub(crate) fn state<const N: usize>(&mut self, predicate: Symbol, arguments: [Symbol; N]) {
        self.facts.push(Fact::new(predicate, arguments));
    }

    pub(crate) fn rule(
        &mut self,
        identity: &RuleIdentity,
        head: Vec<Atom>,
        body: Conjunction,
        variables: &Variables,
    ) {
        let Some(variables) = variables.names() else { return self.gap(TOO_MANY_VARIABLES) };
        self.rules.push(Rule { identity: identity.clone(), head, body, variables });
    }

    pub(crate) fn auxiliary_rule(
        &mut self,
        class: &ClassExpression,
        head: Atom,
        body: Conjunction,
        variables: &Variables,
    ) {
        let Some(variables) = variables.names() else { return self.gap(TOO_MANY_VARIABLES) };
        let identity = labelled(class.to_string(), 0);
        self.auxiliary.push(Rule { identity, head: vec![head], body, variables });
    }

    pub(crate) fn outside(&mut self, axiom: &Axiom, partly: bool, reason: &str) {
        let (axiom, reason) = (axiom.to_string(), reason.to_owned());
        self.warnings.push(Warning::OutsideProfile { axiom, partly, reason });
    }
}
