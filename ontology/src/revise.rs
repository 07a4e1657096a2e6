//! Computes the delta that updates the rule engine when documents are asserted and retracted. After the
//! update, the engine holds exactly the consequences of the remaining statements and of the facts that other updates
//! have stated.
//!
//! [`Stated`] keeps the stated axioms and rules. [`lower_together`] translates them to facts and rules, once before
//! and once after the change. The engine receives the differences between the two results.
//!
//! The translations are skipped if the change consists only of assertions of named classes and properties about
//! individuals. They are needed nevertheless in the following cases. A rule derives members of `owl:Thing`, which
//! depend on all stated names. The change declares a class or property while the engine reasons about equality
//! (`owl:sameAs`). An individual of the change is also declared as a class or property. A class or property belongs
//! to the vocabulary of RDF, RDFS, XML Schema, OWL or SWRL.
//!
//! Axioms form a set: an axiom of two documents is stated once, and one retraction removes it. Declarations are
//! never retracted, because many documents repeat them.

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

/// The stated knowledge: the axioms and rules of all documents, and additional rules.
#[derive(Clone, Debug, Default)]
pub struct Stated {
    ontology: Ontology,
    /// Additional rules, which come from no document. Their names are symbols of the engine.
    rules: Vec<EngineRule>,
    equality: Equality,
}

/// A change of the stated knowledge, to be applied to an engine.
#[derive(Clone, Debug)]
pub struct Change {
    /// The stated knowledge after the change.
    pub stated: Stated,
    /// Facts to state and facts to withdraw.
    pub delta: Delta,
    /// The new rules; `None` if they do not change.
    pub program: Option<Program>,
    /// Warnings of the reader, of lowering, and about retracted statements that were not stated.
    pub warnings: Vec<Warning>,
}

impl Stated {
    /// Combines documents with additional rules. The names of the rules must be symbols of the engine.
    pub fn new(ontology: Ontology, rules: Vec<EngineRule>, equality: Equality) -> Self {
        Self { ontology, rules, equality }
    }

    /// Returns the ontology that merges all stated documents.
    pub fn ontology(&self) -> &Ontology {
        &self.ontology
    }

    /// Computes the change that asserts the documents in `asserted` and retracts the documents in
    /// `retracted`. A statement in both lists is asserted. Imports of these documents are not followed.
    ///
    /// # Errors
    /// Returns the errors of the documents, and O114 for a retracted statement with an anonymous individual.
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
        let assertions = read(asserted, &options)?;
        options.documents_before += assertions.sources.len();
        options.known.extend(assertions.entities.iter().filter(is_kind).cloned());
        let retractions = read(retracted, &options)?;
        self.change_by(&assertions, &retractions, engine)
    }

    /// Computes the change for documents that have already been read, like [`Stated::change`].
    ///
    /// # Errors
    /// Returns O114 for a retracted statement with an anonymous individual.
    pub fn change_by(
        &self,
        assertions: &Ontology,
        retractions: &Ontology,
        engine: &mut Engine,
    ) -> Result<Change, Errors> {
        let mut warnings: Vec<Warning> =
            assertions.warnings.iter().chain(&retractions.warnings).cloned().collect();
        let loaded_iris: HashSet<&Iri> =
            self.ontology.sources.iter().filter_map(|source| source.iri.as_ref()).collect();
        // An import that the knowledge base contains need not be followed.
        warnings.retain(|warning| match warning {
            Warning::ImportOfUpdate { import, .. } => !loaded_iris.contains(&Iri::from(import.as_str())),
            _ => true,
        });
        reject_anonymous(retractions)?;
        let mut stated = self.clone();
        let removed = stated.remove(retractions, engine, &mut warnings);
        stated.add(assertions);
        let change = [&assertions.axioms[..], &removed].concat();
        let is_plain = assertions.rules.is_empty()
            && retractions.rules.is_empty()
            && !self.declares(assertions, engine.program())
            && self.is_plain(&change, engine.program(), engine.symbols());
        let symbols = engine.symbols_mut();
        let mut inserted = facts(&assertions.axioms, symbols);
        let mut deleted: FxHashSet<Fact> = facts(&retractions.axioms, symbols).into_iter().collect();
        deleted.extend(facts(&removed, symbols));
        let mut program = None;
        if is_plain {
            let change = [&change[..], &retractions.axioms].concat();
            stated.keep_supported(&change, &mut deleted, symbols);
        } else {
            let [before, after] = [self, &stated].map(|stated| stated.lower(symbols));
            // Only differences reach the engine, so facts and rules that stay keep their derivations.
            let old: FxHashSet<Fact> = before.facts.into_iter().collect();
            let new: FxHashSet<Fact> = after.facts.into_iter().collect();
            inserted.extend(new.difference(&old).cloned());
            deleted.extend(old.difference(&new).cloned());
            deleted.retain(|fact| !new.contains(fact));
            let old_warnings: BTreeSet<Warning> = before.warnings.into_iter().collect();
            warnings.extend(after.warnings.into_iter().filter(|warning| !old_warnings.contains(warning)));
            program = revised_program(engine.program(), &before.program, &after.program);
        }
        inserted.sort_unstable();
        inserted.dedup();
        let mut delete: Vec<Fact> = deleted.into_iter().collect();
        delete.sort_unstable();
        warnings.sort();
        warnings.dedup();
        Ok(Change { stated, delta: Delta { insert: inserted, delete }, program, warnings })
    }

    fn lower(&self, symbols: &mut Symbols) -> Lowered {
        lower_together(&self.ontology, self.rules.clone(), self.equality, symbols)
    }

    fn add(&mut self, assertions: &Ontology) {
        fn merge<T: Ord + Clone>(target: &mut Vec<T>, items: &[T]) {
            if !items.is_empty() {
                target.extend_from_slice(items);
                target.sort();
                target.dedup();
            }
        }
        // The lists of axioms, entities and annotations are sorted sets; rules and sources keep their order.
        merge(&mut self.ontology.axioms, &assertions.axioms);
        merge(&mut self.ontology.entities, &assertions.entities);
        merge(&mut self.ontology.annotations, &assertions.annotations);
        merge(&mut self.ontology.annotation_annotations, &assertions.annotation_annotations);
        self.ontology.rules.extend_from_slice(&assertions.rules);
        self.ontology.sources.extend_from_slice(&assertions.sources);
    }

    /// Removes the statements of `retractions`, and adds a warning for each axiom and rule that was not
    /// stated. Declarations remain. Returns the removed axioms.
    fn remove(
        &mut self,
        retractions: &Ontology,
        engine: &mut Engine,
        warnings: &mut Vec<Warning>,
    ) -> Vec<AnnotatedAxiom> {
        let mut is_found: BTreeMap<Axiom, bool> =
            retractions.axioms.iter().map(|annotated| (canonical(&annotated.axiom), false)).collect();
        let mut removed = Vec::new();
        if !is_found.is_empty() {
            removed.extend(self.ontology.axioms.extract_if(.., |annotated| {
                let flag = is_found.get_mut(&canonical(&annotated.axiom));
                flag.map(|flag| *flag = true).is_some()
            }));
        }
        let missing: Vec<Axiom> =
            is_found.into_iter().filter(|(_, flag)| !flag).map(|(axiom, _)| axiom).collect();
        removed.extend(self.remove_by_value(missing, engine, warnings));
        let mut rules: Vec<(_, &Rule, bool)> =
            retractions.rules.iter().map(|rule| (content(rule), rule, false)).collect();
        self.ontology.rules.retain(|rule| {
            let rule_content = content(rule);
            let entry = rules.iter_mut().find(|(content, ..)| *content == rule_content);
            entry.map(|entry| entry.2 = true).is_none()
        });
        let missing = rules.iter().filter(|(.., is_removed)| !is_removed);
        warnings
            .extend(missing.map(|(_, rule, _)| Warning::NotStated { statement: format!("the rule {rule}") }));
        let retracted_annotations: BTreeSet<_> = retractions.annotations.iter().collect();
        self.ontology.annotations.retain(|annotation| !retracted_annotations.contains(annotation));
        let retracted_annotations: BTreeSet<_> =
            retractions.annotations.iter().map(|(subject, annotation)| (subject, annotation)).collect();
        self.ontology
            .annotation_annotations
            .retain(|(subject, annotation, _)| !retracted_annotations.contains(&(subject, annotation)));
        removed
    }

    /// Removes the assertions that state the same fact as an axiom in `missing` with differently written
    /// literals (literals are compared by value). Adds a warning for each axiom whose fact is not stated
    /// at all. Returns the removed axioms.
    fn remove_by_value(
        &mut self,
        missing: Vec<Axiom>,
        engine: &mut Engine,
        warnings: &mut Vec<Warning>,
    ) -> Vec<AnnotatedAxiom> {
        let mut removed = Vec::new();
        for axiom in missing {
            let retraction = [AnnotatedAxiom { axiom, annotations: Vec::new() }];
            let retracted_facts = facts(&retraction, engine.symbols_mut());
            let before = removed.len();
            if let [fact] = &retracted_facts[..] {
                let symbols = engine.symbols_mut();
                let states = |other: &mut AnnotatedAxiom| {
                    resembles(&retraction[0].axiom, &other.axiom)
                        && facts(std::slice::from_ref(other), symbols) == std::slice::from_ref(fact)
                };
                removed.extend(self.ontology.axioms.extract_if(.., states));
            }
            // A fact can be asserted without an axiom (by an update of the engine). It is then withdrawn
            // without a warning.
            let mut is_stated =
                !retracted_facts.is_empty() && retracted_facts.iter().all(|fact| engine.is_asserted(fact));
            if removed.len() == before && is_stated {
                // If another axiom states the fact, the fact remains, and the warning says so.
                let symbols = engine.symbols_mut();
                let related =
                    self.ontology.axioms.iter().filter(|other| resembles(&retraction[0].axiom, &other.axiom));
                let mut supports = related.flat_map(|other| facts(std::slice::from_ref(other), symbols));
                is_stated = !supports.any(|fact| retracted_facts.contains(&fact));
            }
            if removed.len() == before && !is_stated {
                warnings.push(Warning::NotStated { statement: retraction[0].axiom.to_string() });
            }
        }
        removed
    }

    /// Returns `true` if the assertions declare a new class or property, and names can be equal. The name of a class or
    /// property can also denote an individual, whose equality has rules of its own.
    fn declares(&self, assertions: &Ontology, program: &Program) -> bool {
        let is_new = |entity: &(EntityKind, Iri)| {
            entity.0 != EntityKind::NamedIndividual && self.ontology.entities.binary_search(entity).is_err()
        };
        program.equality && assertions.entities.iter().any(is_new)
    }

    /// Returns `true` if the change can be computed without a translation of the whole ontology. Then `axioms` are only
    /// assertions about individuals by named classes and properties, and no rule of `program` derives members of
    /// `owl:Thing`. The names must not belong to a reserved vocabulary, and no individual may also be declared as
    /// something else. [`Stated::declares`] covers declarations of the change itself.
    fn is_plain(&self, axioms: &[AnnotatedAxiom], program: &Program, symbols: &Symbols) -> bool {
        // The rules and facts of `owl:Thing` depend on all names that are stated.
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

    /// Removes from `deleted` the facts that a remaining axiom also states. `change` contains the
    /// changed axioms and the retracted axioms that were not stated.
    fn keep_supported(
        &self,
        change: &[AnnotatedAxiom],
        deleted: &mut FxHashSet<Fact>,
        symbols: &mut Symbols,
    ) {
        if deleted.is_empty() {
            return;
        }
        let individuals: HashSet<&Iri> =
            change.iter().flat_map(|annotated| individuals_of(&annotated.axiom)).collect();
        let related =
            self.ontology.axioms.iter().filter(|annotated| mentions_any(&annotated.axiom, &individuals));
        for annotated in related {
            for fact in facts(std::slice::from_ref(annotated), symbols) {
                deleted.remove(&fact);
            }
        }
    }
}

fn facts(axioms: &[AnnotatedAxiom], symbols: &mut Symbols) -> Vec<Fact> {
    lower_assertions(axioms, symbols)
}

fn individuals_of(axiom: &Axiom) -> Vec<&Iri> {
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

fn mentions_any(axiom: &Axiom, individuals: &HashSet<&Iri>) -> bool {
    individuals_of(axiom).into_iter().any(|individual| individuals.contains(individual))
}

fn resembles(first: &Axiom, second: &Axiom) -> bool {
    individuals_of(second).into_iter().any(|individual| individuals_of(first).contains(&individual))
}

/// Rejects retractions with anonymous individuals: a blank node of one document never denotes an individual of
/// another document.
fn reject_anonymous(retractions: &Ontology) -> Result<(), Errors> {
    let is_anonymous = |statement: &dyn Debug| format!("{statement:?}").contains(ANONYMOUS);
    let axioms =
        retractions.axioms.iter().map(|annotated| &annotated.axiom).filter(|axiom| is_anonymous(axiom));
    let rules = retractions.rules.iter().filter(|rule| is_anonymous(&(&rule.body, &rule.head)));
    let statements = axioms.map(ToString::to_string).chain(rules.map(ToString::to_string));
    Errors::unless_empty(statements.map(|statement| Error::Nameless { statement }))
}

/// Returns `program` with the rules of `before` replaced by the rules of `after`, or `None` if nothing
/// changes.
fn revised_program(program: &Program, before: &Program, after: &Program) -> Option<Program> {
    let content = |rule: &EngineRule| {
        let mut copy = rule.clone();
        if *copy.identity.source == *AXIOM_SOURCE {
            // The position of an axiom changes if another axiom is inserted before it. Its rules must keep
            // their derivations.
            copy.identity.position = 0;
        }
        copy
    };
    let old: HashSet<EngineRule> = before.rules.iter().map(content).collect();
    let new: HashSet<EngineRule> = after.rules.iter().map(content).collect();
    let is_removed = |rule: &&EngineRule| old.contains(&content(rule)) && !new.contains(&content(rule));
    let mut rules: Vec<EngineRule> = program.rules.iter().filter(|rule| !is_removed(rule)).cloned().collect();
    let kept: HashSet<EngineRule> = rules.iter().map(content).collect();
    let added =
        after.rules.iter().filter(|rule| !old.contains(&content(rule)) && !kept.contains(&content(rule)));
    rules.extend(added.cloned());
    let equality = program.equality || after.equality;
    (rules != program.rules || equality != program.equality).then_some(Program { rules, equality })
}

/// Returns the body and the head of a rule, with the variables numbered by their first occurrence. Rules
/// that differ only in variable names have equal content.
fn content(rule: &Rule) -> (Vec<Atom>, Vec<Atom>) {
    let mut variables: Vec<Iri> = Vec::new();
    let mut renumbered = |argument: &Argument| match argument {
        Argument::Variable(iri) => {
            let number = variables.iter().position(|variable| variable == iri).unwrap_or(variables.len());
            if number == variables.len() {
                variables.push(iri.clone());
            }
            Argument::Variable(number.to_string().into())
        }
        other => other.clone(),
    };
    let mut renumber_all =
        |atoms: &[Atom]| atoms.iter().map(|atom| with_arguments(atom, &mut renumbered)).collect();
    (renumber_all(&rule.body), renumber_all(&rule.head))
}

fn with_arguments(atom: &Atom, map: &mut impl FnMut(&Argument) -> Argument) -> Atom {
    match atom {
        Atom::Class(class, x) => Atom::Class(class.clone(), map(x)),
        Atom::DataRange(range, x) => Atom::DataRange(range.clone(), map(x)),
        Atom::ObjectProperty(property, x, y) => Atom::ObjectProperty(property.clone(), map(x), map(y)),
        Atom::DataProperty(property, x, y) => Atom::DataProperty(property.clone(), map(x), map(y)),
        Atom::SameIndividual(x, y) => Atom::SameIndividual(map(x), map(y)),
        Atom::DifferentIndividuals(x, y) => Atom::DifferentIndividuals(map(x), map(y)),
        Atom::BuiltIn(built_in, arguments) => {
            Atom::BuiltIn(built_in.clone(), arguments.iter().map(map).collect())
        }
    }
}

/// Returns the axiom in a canonical form. The members of sets are sorted, except in data ranges. A positive or negative
/// assertion of an inverse property becomes an assertion of the property with swapped individuals.
fn canonical(axiom: &Axiom) -> Axiom {
    fn ordered<T: Ord + Clone>(items: &[T]) -> Vec<T> {
        items.iter().cloned().collect::<BTreeSet<T>>().into_iter().collect()
    }
    let sorted_set = |classes: &[ClassExpression]| ordered(&classes.iter().map(sorted).collect::<Vec<_>>());
    match axiom {
        Axiom::SubClassOf(sub, sup) => Axiom::SubClassOf(sorted(sub), sorted(sup)),
        Axiom::EquivalentClasses(classes) => Axiom::EquivalentClasses(sorted_set(classes)),
        Axiom::DisjointClasses(classes) => Axiom::DisjointClasses(sorted_set(classes)),
        Axiom::DisjointUnion(class, parts) => Axiom::DisjointUnion(class.clone(), sorted_set(parts)),
        Axiom::EquivalentObjectProperties(properties) => {
            Axiom::EquivalentObjectProperties(ordered(properties))
        }
        Axiom::DisjointObjectProperties(properties) => Axiom::DisjointObjectProperties(ordered(properties)),
        Axiom::InverseObjectProperties(first, second) => {
            Axiom::InverseObjectProperties(first.min(second).clone(), first.max(second).clone())
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

fn sorted(class: &ClassExpression) -> ClassExpression {
    use ClassExpression as C;
    let sorted_set =
        |classes: &[C]| classes.iter().map(sorted).collect::<BTreeSet<_>>().into_iter().collect();
    match class {
        C::IntersectionOf(classes) => C::IntersectionOf(sorted_set(classes)),
        C::UnionOf(classes) => C::UnionOf(sorted_set(classes)),
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
