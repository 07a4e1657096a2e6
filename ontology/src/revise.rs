//! Documents that are asserted and retracted, as one change of an engine: afterwards it holds what the one remaining
//! document means.
//!
//! [`Stated`] keeps what is stated, as axioms and rules. A change of it is lowered by the same code as a knowledge base that
//! is read for the first time ([`lower_together`]), before and after the change; the engine receives the rules and facts in
//! which the two differ. Facts of named classes and properties that nothing else depends on skip the lowering.
//!
//! Axioms are sets here: one that two documents state is stated once, and its retraction takes both away. Declarations
//! stay, because documents repeat them.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fmt::Debug;
use std::path::Path;

use rules::{Delta, Engine, Fact, Program, Rule as EngineRule, Symbols};
use rustc_hash::FxHashSet;

use crate::error::{Error, Errors, Warning};
use crate::lower::{AXIOM_SOURCE, Equality, Lowered, lower_assertions, lower_together};
use crate::owl::{
    ANONYMOUS, AnnotatedAxiom, Argument, Atom, Axiom, ClassExpression, EntityKind, Iri,
    ObjectPropertyExpression as Property, Ontology, Rule,
};
use crate::read::{ReadOptions, read_files};
use crate::vocab::{is_reserved, owl};

/// What is stated: documents, and rules of other origin.
#[derive(Clone, Debug, Default)]
pub struct Stated {
    ontology: Ontology,
    /// Rules of other origin; their names are among the engine's symbols.
    rules: Vec<EngineRule>,
    equality: Equality,
}

/// A change of what is stated, for an engine.
#[derive(Clone, Debug)]
pub struct Change {
    /// What is stated afterwards.
    pub stated: Stated,
    /// Facts that are stated from now on, or no more.
    pub delta: Delta,
    /// The rules, where they change.
    pub program: Option<Program>,
    /// What of the documents is not read, not used in full, or was not stated.
    pub warnings: Vec<Warning>,
}

impl Stated {
    /// The documents, with further rules, whose names are among the symbols of the engine.
    pub fn new(ontology: Ontology, rules: Vec<EngineRule>, equality: Equality) -> Self {
        Self { ontology, rules, equality }
    }

    /// The documents.
    pub fn ontology(&self) -> &Ontology {
        &self.ontology
    }

    /// The change that states what the first documents say, and no more what the second ones say. What both say is stated.
    /// Imports of these documents are not followed.
    ///
    /// # Errors
    /// All that is wrong with the documents; or O114, where one retracts a statement about an individual without a name.
    pub fn change<P: AsRef<Path>>(
        &self,
        asserted: &[P],
        retracted: &[P],
        engine: &mut Engine,
    ) -> Result<Change, Errors> {
        let is_kind = |(kind, _): &&(EntityKind, Iri)| *kind != EntityKind::NamedIndividual;
        let mut options = ReadOptions {
            allow_empty: true,
            without_imports: true,
            documents_before: self.ontology.sources.len(),
            known: self.ontology.entities.iter().filter(is_kind).cloned().collect(),
            ..ReadOptions::default()
        };
        let read = |files: &[P], options: &ReadOptions| match files {
            [] => Ok(Ontology::default()),
            files => read_files(files, options),
        };
        let come = read(asserted, &options)?;
        options.documents_before += come.sources.len();
        options.known.extend(come.entities.iter().filter(is_kind).cloned());
        let go = read(retracted, &options)?;
        self.change_by(&come, &go, engine)
    }

    /// As [`Stated::change`], for documents that have been read.
    ///
    /// # Errors
    /// O114.
    pub fn change_by(&self, come: &Ontology, go: &Ontology, engine: &mut Engine) -> Result<Change, Errors> {
        let mut warnings: Vec<Warning> = come.warnings.iter().chain(&go.warnings).cloned().collect();
        let known: HashSet<&Iri> =
            self.ontology.sources.iter().filter_map(|source| source.iri.as_ref()).collect();
        warnings.retain(|warning| match warning {
            Warning::ImportOfUpdate { import, .. } => !known.contains(&Iri::from(import.as_str())),
            _ => true,
        });
        nameless(go)?;
        let mut stated = self.clone();
        let removed = stated.remove(go, engine, &mut warnings);
        stated.add(come);
        let change = [&come.axioms[..], &removed].concat();
        let is_plain = come.rules.is_empty()
            && go.rules.is_empty()
            && self.is_plain(&change, engine.program(), engine.symbols());
        let symbols = engine.symbols_mut();
        let mut said = facts(&come.axioms, symbols);
        let mut unsaid: FxHashSet<Fact> = facts(&go.axioms, symbols).into_iter().collect();
        unsaid.extend(facts(&removed, symbols));
        let mut program = None;
        if is_plain {
            stated.keep_supported(&change, &mut unsaid, symbols);
        } else {
            let [before, after] = [self, &stated].map(|stated| stated.lower(symbols));
            let old: FxHashSet<Fact> = before.facts.into_iter().collect();
            let new: FxHashSet<Fact> = after.facts.into_iter().collect();
            said.extend(new.difference(&old).cloned());
            unsaid.extend(old.difference(&new).cloned());
            unsaid.retain(|fact| !new.contains(fact));
            let seen: BTreeSet<Warning> = before.warnings.into_iter().collect();
            warnings.extend(after.warnings.into_iter().filter(|warning| !seen.contains(warning)));
            program = exchanged(engine.program(), &before.program, &after.program);
        }
        said.sort_unstable();
        said.dedup();
        let mut delete: Vec<Fact> = unsaid.into_iter().collect();
        delete.sort_unstable();
        warnings.sort();
        warnings.dedup();
        Ok(Change { stated, delta: Delta { insert: said, delete }, program, warnings })
    }

    fn lower(&self, symbols: &mut Symbols) -> Lowered {
        lower_together(&self.ontology, self.rules.clone(), self.equality, symbols)
    }

    fn add(&mut self, come: &Ontology) {
        fn merge<T: Ord + Clone>(into: &mut Vec<T>, more: &[T]) {
            if !more.is_empty() {
                into.extend_from_slice(more);
                into.sort();
                into.dedup();
            }
        }
        merge(&mut self.ontology.axioms, &come.axioms);
        merge(&mut self.ontology.entities, &come.entities);
        merge(&mut self.ontology.annotations, &come.annotations);
        merge(&mut self.ontology.annotation_annotations, &come.annotation_annotations);
        self.ontology.rules.extend_from_slice(&come.rules);
        self.ontology.sources.extend_from_slice(&come.sources);
    }

    /// Takes away what documents say; returns the axioms that were stated. Warns of what was not.
    fn remove(
        &mut self,
        go: &Ontology,
        engine: &mut Engine,
        warnings: &mut Vec<Warning>,
    ) -> Vec<AnnotatedAxiom> {
        let mut wanted: BTreeMap<Axiom, bool> =
            go.axioms.iter().map(|annotated| (canonical(&annotated.axiom), false)).collect();
        let mut removed = Vec::new();
        if !wanted.is_empty() {
            removed.extend(self.ontology.axioms.extract_if(.., |annotated| {
                let found = wanted.get_mut(&canonical(&annotated.axiom));
                found.map(|found| *found = true).is_some()
            }));
        }
        let missing: Vec<Axiom> =
            wanted.into_iter().filter(|(_, found)| !found).map(|(axiom, _)| axiom).collect();
        removed.extend(self.remove_by_value(missing, engine, warnings));
        let mut rules: Vec<(_, &Rule, bool)> =
            go.rules.iter().map(|rule| (content(rule), rule, false)).collect();
        self.ontology.rules.retain(|rule| {
            let own = content(rule);
            let found = rules.iter_mut().find(|(content, ..)| *content == own);
            found.map(|found| found.2 = true).is_none()
        });
        let missing = rules.iter().filter(|(.., found)| !found);
        warnings
            .extend(missing.map(|(_, rule, _)| Warning::NotStated { statement: format!("the rule {rule}") }));
        let gone: BTreeSet<_> = go.annotations.iter().collect();
        self.ontology.annotations.retain(|annotation| !gone.contains(annotation));
        let gone: BTreeSet<_> =
            go.annotations.iter().map(|(subject, annotation)| (subject, annotation)).collect();
        self.ontology
            .annotation_annotations
            .retain(|(subject, annotation, _)| !gone.contains(&(subject, annotation)));
        removed
    }

    /// Takes away the assertions that state the same facts as these, in other words: literals are one by value.
    fn remove_by_value(
        &mut self,
        missing: Vec<Axiom>,
        engine: &mut Engine,
        warnings: &mut Vec<Warning>,
    ) -> Vec<AnnotatedAxiom> {
        let mut removed = Vec::new();
        for axiom in missing {
            let one = [AnnotatedAxiom { axiom, annotations: Vec::new() }];
            let wanted = facts(&one, engine.symbols_mut());
            let before = removed.len();
            if let [fact] = &wanted[..] {
                let symbols = engine.symbols_mut();
                let states = |other: &mut AnnotatedAxiom| {
                    resembles(&one[0].axiom, &other.axiom)
                        && facts(std::slice::from_ref(other), symbols) == std::slice::from_ref(fact)
                };
                removed.extend(self.ontology.axioms.extract_if(.., states));
            }
            let is_stated = !wanted.is_empty() && wanted.iter().all(|fact| engine.is_asserted(fact));
            if removed.len() == before && !is_stated {
                warnings.push(Warning::NotStated { statement: one[0].axiom.to_string() });
            }
        }
        removed
    }

    /// Whether axioms state nothing but facts, and no rule of the program is there because of which facts are stated.
    fn is_plain(&self, axioms: &[AnnotatedAxiom], program: &Program, symbols: &Symbols) -> bool {
        let thing = symbols.find_name(owl::THING);
        let concludes_thing = |rule: &EngineRule| {
            rule.head.iter().any(
                |atom| matches!(atom, rules::Atom::Relation { predicate, .. } if Some(*predicate) == thing),
            )
        };
        if thing.is_some() && program.rules.iter().any(concludes_thing) {
            return false;
        }
        let entities = self.ontology.entities.iter().filter(|(kind, _)| *kind != EntityKind::NamedIndividual);
        let kinds: HashSet<&Iri> = entities.map(|(_, iri)| iri).collect();
        axioms.iter().all(|annotated| match &annotated.axiom {
            Axiom::ClassAssertion(ClassExpression::Class(class), individual) => {
                !is_reserved(class) && !kinds.contains(individual)
            }
            Axiom::ObjectPropertyAssertion(
                Property::Property(property) | Property::Inverse(property),
                from,
                to,
            ) => !is_reserved(property) && !kinds.contains(from) && !kinds.contains(to),
            Axiom::DataPropertyAssertion(property, from, _) => {
                !is_reserved(property) && !kinds.contains(from)
            }
            _ => false,
        })
    }

    /// Takes off the facts that another axiom states, too.
    fn keep_supported(&self, change: &[AnnotatedAxiom], unsaid: &mut FxHashSet<Fact>, symbols: &mut Symbols) {
        if unsaid.is_empty() {
            return;
        }
        let about: HashSet<&Iri> = change.iter().flat_map(|annotated| about(&annotated.axiom)).collect();
        let others = self.ontology.axioms.iter().filter(|other| about_any(&other.axiom, &about));
        for other in others {
            for fact in facts(std::slice::from_ref(other), symbols) {
                unsaid.remove(&fact);
            }
        }
    }
}

/// The facts that axioms state, in no order.
fn facts(axioms: &[AnnotatedAxiom], symbols: &mut Symbols) -> Vec<Fact> {
    lower_assertions(axioms, symbols)
}

/// The individuals of an assertion.
fn about(axiom: &Axiom) -> Vec<&Iri> {
    match axiom {
        Axiom::ClassAssertion(_, individual) | Axiom::DataPropertyAssertion(_, individual, _) => {
            vec![individual]
        }
        Axiom::ObjectPropertyAssertion(_, from, to) => vec![from, to],
        Axiom::SameIndividual(individuals) | Axiom::DifferentIndividuals(individuals) => {
            individuals.iter().collect()
        }
        _ => Vec::new(),
    }
}

fn about_any(axiom: &Axiom, individuals: &HashSet<&Iri>) -> bool {
    about(axiom).into_iter().any(|individual| individuals.contains(individual))
}

/// Whether two assertions are about one individual, and may state one fact.
fn resembles(one: &Axiom, other: &Axiom) -> bool {
    about(other).into_iter().any(|individual| about(one).contains(&individual))
}

/// No document can name an individual of another document that has no name.
fn nameless(go: &Ontology) -> Result<(), Errors> {
    let is_nameless = |statement: &dyn Debug| format!("{statement:?}").contains(ANONYMOUS);
    let axioms = go.axioms.iter().map(|annotated| &annotated.axiom).filter(|axiom| is_nameless(axiom));
    let rules = go.rules.iter().filter(|rule| is_nameless(&(&rule.body, &rule.head)));
    let statements = axioms.map(ToString::to_string).chain(rules.map(ToString::to_string));
    Errors::unless_empty(statements.map(|statement| Error::Nameless { statement }))
}

/// The engine's rules after what is lowered has changed, or `None` where it has not. The place of an axiom among others
/// does not matter, so that what stays keeps its derivations.
fn exchanged(program: &Program, before: &Program, after: &Program) -> Option<Program> {
    let content = |rule: &EngineRule| {
        let mut own = rule.clone();
        if *own.identity.source == *AXIOM_SOURCE {
            own.identity.position = 0;
        }
        own
    };
    let old: HashSet<EngineRule> = before.rules.iter().map(content).collect();
    let new: HashSet<EngineRule> = after.rules.iter().map(content).collect();
    let is_gone = |rule: &&EngineRule| old.contains(&content(rule)) && !new.contains(&content(rule));
    let mut rules: Vec<EngineRule> = program.rules.iter().filter(|rule| !is_gone(rule)).cloned().collect();
    let held: HashSet<EngineRule> = rules.iter().map(content).collect();
    let come =
        after.rules.iter().filter(|rule| !old.contains(&content(rule)) && !held.contains(&content(rule)));
    rules.extend(come.cloned());
    let equality = program.equality || after.equality;
    (rules != program.rules || equality != program.equality).then_some(Program { rules, equality })
}

/// Body and head with variables numbered from the first on.
fn content(rule: &Rule) -> (Vec<Atom>, Vec<Atom>) {
    let mut seen: Vec<Iri> = Vec::new();
    let mut renamed = |argument: &Argument| match argument {
        Argument::Variable(iri) => {
            let place = seen.iter().position(|known| known == iri).unwrap_or(seen.len());
            if place == seen.len() {
                seen.push(iri.clone());
            }
            Argument::Variable(place.to_string().into())
        }
        other => other.clone(),
    };
    let mut all = |atoms: &[Atom]| atoms.iter().map(|atom| with_arguments(atom, &mut renamed)).collect();
    (all(&rule.body), all(&rule.head))
}

fn with_arguments(atom: &Atom, new: &mut impl FnMut(&Argument) -> Argument) -> Atom {
    match atom {
        Atom::Class(class, x) => Atom::Class(class.clone(), new(x)),
        Atom::DataRange(range, x) => Atom::DataRange(range.clone(), new(x)),
        Atom::ObjectProperty(property, x, y) => Atom::ObjectProperty(property.clone(), new(x), new(y)),
        Atom::DataProperty(property, x, y) => Atom::DataProperty(property.clone(), new(x), new(y)),
        Atom::SameIndividual(x, y) => Atom::SameIndividual(new(x), new(y)),
        Atom::DifferentIndividuals(x, y) => Atom::DifferentIndividuals(new(x), new(y)),
        Atom::BuiltIn(built_in, arguments) => {
            Atom::BuiltIn(built_in.clone(), arguments.iter().map(new).collect())
        }
    }
}

/// The axiom with the members of its sets in order.
fn canonical(axiom: &Axiom) -> Axiom {
    fn ordered<T: Ord + Clone>(items: &[T]) -> Vec<T> {
        items.iter().cloned().collect::<BTreeSet<T>>().into_iter().collect()
    }
    let all = |classes: &[ClassExpression]| ordered(&classes.iter().map(sorted).collect::<Vec<_>>());
    match axiom {
        Axiom::SubClassOf(sub, sup) => Axiom::SubClassOf(sorted(sub), sorted(sup)),
        Axiom::EquivalentClasses(classes) => Axiom::EquivalentClasses(all(classes)),
        Axiom::DisjointClasses(classes) => Axiom::DisjointClasses(all(classes)),
        Axiom::DisjointUnion(class, parts) => Axiom::DisjointUnion(class.clone(), all(parts)),
        Axiom::EquivalentObjectProperties(properties) => {
            Axiom::EquivalentObjectProperties(ordered(properties))
        }
        Axiom::DisjointObjectProperties(properties) => Axiom::DisjointObjectProperties(ordered(properties)),
        Axiom::InverseObjectProperties(one, other) => {
            Axiom::InverseObjectProperties(one.min(other).clone(), one.max(other).clone())
        }
        Axiom::ObjectPropertyDomain(property, class) => {
            Axiom::ObjectPropertyDomain(property.clone(), sorted(class))
        }
        Axiom::ObjectPropertyRange(property, class) => {
            Axiom::ObjectPropertyRange(property.clone(), sorted(class))
        }
        Axiom::EquivalentDataProperties(properties) => Axiom::EquivalentDataProperties(ordered(properties)),
        Axiom::DisjointDataProperties(properties) => Axiom::DisjointDataProperties(ordered(properties)),
        Axiom::DataPropertyDomain(property, class) => {
            Axiom::DataPropertyDomain(property.clone(), sorted(class))
        }
        Axiom::HasKey(class, objects, data) => Axiom::HasKey(sorted(class), ordered(objects), ordered(data)),
        Axiom::SameIndividual(individuals) => Axiom::SameIndividual(ordered(individuals)),
        Axiom::DifferentIndividuals(individuals) => Axiom::DifferentIndividuals(ordered(individuals)),
        Axiom::ClassAssertion(class, individual) => Axiom::ClassAssertion(sorted(class), individual.clone()),
        Axiom::ObjectPropertyAssertion(Property::Inverse(property), from, to) => {
            Axiom::ObjectPropertyAssertion(Property::Property(property.clone()), to.clone(), from.clone())
        }
        Axiom::NegativeObjectPropertyAssertion(Property::Inverse(property), from, to) => {
            Axiom::NegativeObjectPropertyAssertion(
                Property::Property(property.clone()),
                to.clone(),
                from.clone(),
            )
        }
        other => other.clone(),
    }
}

/// The expression with the members of its sets in order.
fn sorted(class: &ClassExpression) -> ClassExpression {
    use ClassExpression as C;
    let all = |classes: &[C]| classes.iter().map(sorted).collect::<BTreeSet<_>>().into_iter().collect();
    match class {
        C::IntersectionOf(classes) => C::IntersectionOf(all(classes)),
        C::UnionOf(classes) => C::UnionOf(all(classes)),
        C::OneOf(individuals) => {
            C::OneOf(individuals.iter().cloned().collect::<BTreeSet<_>>().into_iter().collect())
        }
        C::ComplementOf(class) => C::ComplementOf(Box::new(sorted(class))),
        C::SomeValuesFrom(property, class) => C::SomeValuesFrom(property.clone(), Box::new(sorted(class))),
        C::AllValuesFrom(property, class) => C::AllValuesFrom(property.clone(), Box::new(sorted(class))),
        C::Cardinality(bound, number, property, class) => {
            C::Cardinality(*bound, *number, property.clone(), Box::new(sorted(class)))
        }
        other => other.clone(),
    }
}
