//! Data structures of OWL 2 and SWRL, with the names of the OWL 2 structural specification [1] and the SWRL
//! submission [2].
//!
//! An [`Ontology`] is the merge of one or more root documents and their imports. It is plain data in an order
//! that depends only on the documents: reading the same files twice gives equal values and equal text.
//! Anonymous individuals get IRIs (`urn:metaplan:anonymous:…`), so that every individual has an IRI.
//!
//! - [1] OWL 2 Web Ontology Language, Structural Specification and Functional-Style Syntax, W3C 2012.
//! - [2] SWRL: A Semantic Web Rule Language Combining OWL and RuleML, W3C Member Submission 2004.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::error::Warning;
use crate::read::syntax::Syntax;

/// An absolute IRI, not abbreviated.
pub type Iri = Arc<str>;

/// Prefix of the IRIs of anonymous individuals.
pub const ANONYMOUS: &str = "urn:metaplan:anonymous:";

/// Prefix of the name of an auxiliary property that represents an inverse property while horned-owl reads a
/// document.
pub(crate) const INVERSE: &str = "urn:metaplan:inverse:";

/// Prefix of the name of an auxiliary datatype that represents a data range within a data range while
/// horned-owl reads a document.
pub(crate) const RANGE: &str = "urn:metaplan:range:";

/// A literal as written. [`rules::Literal`] computes its value.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Literal {
    /// The lexical form, not canonicalised.
    pub lexical: Arc<str>,
    /// The datatype; `None` for plain literals (`xsd:string`) and for literals with a language.
    pub datatype: Option<Iri>,
    /// The language tag, for `rdf:langString` literals.
    pub language: Option<Arc<str>>,
}

/// An object property or its inverse.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ObjectPropertyExpression {
    /// A named property.
    Property(Iri),
    /// `ObjectInverseOf` a named property.
    Inverse(Iri),
}

/// Data range: a set of data values.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DataRange {
    /// All values of a datatype.
    Datatype(Iri),
    /// The values listed.
    OneOf(Vec<Literal>),
    /// The values in all of the ranges.
    IntersectionOf(Vec<DataRange>),
    /// The values in any of the ranges.
    UnionOf(Vec<DataRange>),
    /// The values outside the range.
    ComplementOf(Box<DataRange>),
    /// The values of a datatype within facets (facet IRI, bound).
    Restriction(Iri, Vec<(Iri, Literal)>),
}

/// Kind of a cardinality restriction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bound {
    /// At least n.
    Min,
    /// At most n.
    Max,
    /// Exactly n.
    Exact,
}

/// Class expression: a set of individuals.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ClassExpression {
    /// A named class.
    Class(Iri),
    /// Individuals in all of the classes.
    IntersectionOf(Vec<ClassExpression>),
    /// Individuals in any of the classes.
    UnionOf(Vec<ClassExpression>),
    /// Individuals outside the class.
    ComplementOf(Box<ClassExpression>),
    /// The individuals listed.
    OneOf(Vec<Iri>),
    /// Individuals with a property value in the class.
    SomeValuesFrom(ObjectPropertyExpression, Box<ClassExpression>),
    /// Individuals whose property values are all in the class.
    AllValuesFrom(ObjectPropertyExpression, Box<ClassExpression>),
    /// Individuals with the given property value.
    HasValue(ObjectPropertyExpression, Iri),
    /// Individuals that the property relates to themselves.
    HasSelf(ObjectPropertyExpression),
    /// Individuals with at least, at most or exactly n property values in the class.
    Cardinality(Bound, u32, ObjectPropertyExpression, Box<ClassExpression>),
    /// Individuals with a data property value in the range.
    DataSomeValuesFrom(Iri, DataRange),
    /// Individuals whose data property values are all in the range.
    DataAllValuesFrom(Iri, DataRange),
    /// Individuals with the given data property value.
    DataHasValue(Iri, Literal),
    /// Individuals with at least, at most or exactly n data property values in the range.
    DataCardinality(Bound, u32, Iri, DataRange),
}

/// A characteristic of an object property.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Characteristic {
    /// At most one value per subject.
    Functional,
    /// At most one subject per value.
    InverseFunctional,
    /// Every individual is its own value.
    Reflexive,
    /// No individual is its own value.
    Irreflexive,
    /// If x is related to y, y is related to x.
    Symmetric,
    /// If x is related to y, y is not related to x.
    Asymmetric,
    /// If x is related to y and y to z, x is related to z.
    Transitive,
}

/// A logical axiom. Names and arguments of the variants follow the structural specification.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)] // the variants are the specification's axioms, one to one
pub enum Axiom {
    SubClassOf(ClassExpression, ClassExpression),
    EquivalentClasses(Vec<ClassExpression>),
    DisjointClasses(Vec<ClassExpression>),
    DisjointUnion(Iri, Vec<ClassExpression>),
    SubObjectPropertyOf(ObjectPropertyExpression, ObjectPropertyExpression),
    SubPropertyChainOf(Vec<ObjectPropertyExpression>, ObjectPropertyExpression),
    EquivalentObjectProperties(Vec<ObjectPropertyExpression>),
    DisjointObjectProperties(Vec<ObjectPropertyExpression>),
    InverseObjectProperties(Iri, Iri),
    ObjectPropertyDomain(ObjectPropertyExpression, ClassExpression),
    ObjectPropertyRange(ObjectPropertyExpression, ClassExpression),
    ObjectPropertyCharacteristic(Characteristic, ObjectPropertyExpression),
    SubDataPropertyOf(Iri, Iri),
    EquivalentDataProperties(Vec<Iri>),
    DisjointDataProperties(Vec<Iri>),
    DataPropertyDomain(Iri, ClassExpression),
    DataPropertyRange(Iri, DataRange),
    FunctionalDataProperty(Iri),
    DatatypeDefinition(Iri, DataRange),
    HasKey(ClassExpression, Vec<ObjectPropertyExpression>, Vec<Iri>),
    SameIndividual(Vec<Iri>),
    DifferentIndividuals(Vec<Iri>),
    ClassAssertion(ClassExpression, Iri),
    ObjectPropertyAssertion(ObjectPropertyExpression, Iri, Iri),
    NegativeObjectPropertyAssertion(ObjectPropertyExpression, Iri, Iri),
    DataPropertyAssertion(Iri, Iri, Literal),
    NegativeDataPropertyAssertion(Iri, Iri, Literal),
}

/// Kind of an entity. One IRI can name entities of several kinds (punning).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EntityKind {
    /// A class.
    Class,
    /// An object property.
    ObjectProperty,
    /// A data property.
    DataProperty,
    /// An annotation property.
    AnnotationProperty,
    /// A datatype.
    Datatype,
    /// A named individual.
    NamedIndividual,
}

/// The value of an annotation.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AnnotationValue {
    /// A literal.
    Literal(Literal),
    /// An IRI or an anonymous individual.
    Iri(Iri),
}

/// An annotation: property and value.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Annotation {
    /// The annotation property.
    pub property: Iri,
    /// Value of the annotation.
    pub value: AnnotationValue,
}

/// An axiom with its annotations.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AnnotatedAxiom {
    /// The axiom.
    pub axiom: Axiom,
    /// Annotations of the axiom.
    pub annotations: Vec<Annotation>,
}

/// An argument of a rule atom.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Argument {
    /// A variable; its IRI identifies it within its rule only.
    Variable(Iri),
    /// An individual.
    Individual(Iri),
    /// A data value.
    Literal(Literal),
}

/// An atom of a SWRL rule.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Atom {
    /// The argument is in the class.
    Class(ClassExpression, Argument),
    /// The argument is in the data range.
    DataRange(DataRange, Argument),
    /// The property relates the first argument to the second.
    ObjectProperty(ObjectPropertyExpression, Argument, Argument),
    /// The first argument has the second, a data value, as a value of the property.
    DataProperty(Iri, Argument, Argument),
    /// The arguments denote the same individual.
    SameIndividual(Argument, Argument),
    /// The arguments denote different individuals.
    DifferentIndividuals(Argument, Argument),
    /// The arguments satisfy the built-in predicate.
    BuiltIn(Iri, Vec<Argument>),
}

/// A SWRL rule: if the body holds, so does the head. Variables range only over the individuals, named or anonymous, and
/// the data values that occur in the knowledge base (DL-safe) or that built-ins compute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rule {
    /// IRI of the ontology that states the rule; the document's name if the ontology has no IRI.
    pub ontology: Iri,
    /// Index of the rule in its document, from 0. Unreadable rules are counted, too.
    pub position: u32,
    /// The rule's own IRI, if it has one.
    pub iri: Option<Iri>,
    /// One of the `rdfs:label` annotations. Labels are not unique in real knowledge bases.
    pub label: Option<Arc<str>>,
    /// Value of `swrla:isRuleEnabled`, if stated. Reasoners such as Pellet ignore it.
    pub enabled: Option<bool>,
    /// All annotations, including label and `isRuleEnabled`.
    pub annotations: Vec<Annotation>,
    /// Antecedent: the conjunction of these atoms. May be empty.
    pub body: Vec<Atom>,
    /// Consequent: the conjunction of these atoms. Empty for an integrity constraint.
    pub head: Vec<Atom>,
}

/// One document that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Path of the file, or the name given for a text.
    pub name: String,
    /// The ontology IRI, if the document declares one.
    pub iri: Option<Iri>,
    /// Value of `owl:versionIRI`, if stated.
    pub version: Option<Iri>,
    /// The detected syntax.
    pub syntax: Syntax,
}

/// One or more documents and their imports, merged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ontology {
    /// Documents in reading order: the roots, then their imports, breadth-first.
    pub sources: Vec<Source>,
    /// Declared entities, and entities whose kind was inferred from their use; sorted.
    pub entities: Vec<(EntityKind, Iri)>,
    /// Logical axioms, sorted.
    pub axioms: Vec<AnnotatedAxiom>,
    /// Annotations of entities, ontologies and other IRIs (subject, annotation), sorted.
    pub annotations: Vec<(Iri, Annotation)>,
    /// Annotations of annotations: subject, annotation, annotation of the annotation; sorted.
    pub annotation_annotations: Vec<(Iri, Annotation, Annotation)>,
    /// Rules in document order.
    pub rules: Vec<Rule>,
    /// Warnings of the reader: statements that were not read or were read in another way than they are written,
    /// documents with one ontology IRI, and imports that were not followed.
    pub warnings: Vec<Warning>,
}

impl Ontology {
    /// Returns the IRI of the first document, if it declares one.
    pub fn iri(&self) -> Option<&Iri> {
        self.sources.first().and_then(|source| source.iri.as_ref())
    }

    /// Returns the SWRL rules. A rule that two ontologies state occurs twice; [`crate::lower`] removes
    /// the duplicate.
    pub fn rules(&self) -> &[Rule] {
        &self.rules
    }

    /// Returns the named individuals, sorted: declared individuals, and individuals with a class
    /// assertion.
    pub fn individuals(&self) -> BTreeSet<&Iri> {
        let typed = self.axioms.iter().filter_map(|annotated| match &annotated.axiom {
            Axiom::ClassAssertion(_, individual) if !individual.starts_with(ANONYMOUS) => Some(individual),
            _ => None,
        });
        self.entities(EntityKind::NamedIndividual).chain(typed).collect()
    }

    /// Returns the IRIs of the entities of one kind, sorted.
    pub fn entities(&self, kind: EntityKind) -> impl Iterator<Item = &Iri> {
        self.entities.iter().filter(move |(entity_kind, _)| *entity_kind == kind).map(|(_, iri)| iri)
    }
}
