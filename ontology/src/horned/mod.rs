//! Wraps horned-owl; no other module uses that crate. Normalised triples are read by horned-owl's RDF
//! reader, and its components are converted to the axioms and rules of this crate. Documents in OWL/XML or
//! functional-style syntax are first converted to triples, by a reader and the RDF writer of horned-owl
//! (`transcribe`). `owl_xml` converts functional-style documents to OWL/XML.
//!
//! horned-owl returns sets in hash order, so this module sorts the axioms, entities and annotations.
//! Triples that horned-owl assigns to no axiom or rule become warnings.

mod annotations;
mod sort;
mod stack;
mod transcribe;

use stack::with_stack;
pub(crate) use transcribe::{Fault, owl_xml, transcribe};

use std::sync::Arc;

use horned_owl::io::ParserConfiguration;
use horned_owl::io::rdf::reader::{ConcreteRcRDFOntology, IncompleteParse, OntologyParser, Term};
use horned_owl::model::{self as ho, Component, RcAnnotatedComponent, RcStr};
use rustc_hash::FxHashMap as HashMap;

use crate::contents::Parts;
use crate::error::Warning;
use crate::names::Names;
use crate::normalize::{INDIVIDUAL, ORIGIN, Origin, TRUE, VARIABLE};
use crate::owl::{
    ANONYMOUS, AnnotatedAxiom, Annotation, AnnotationValue, Argument, Atom, Axiom, Bound, Characteristic,
    ClassExpression, DataRange, EntityKind, INVERSE, Iri, Literal, ObjectPropertyExpression, RANGE, Rule,
};
use crate::vocab::{rdfs, swrla};

/// Start of the warning text about a class expression that no axiom uses; the expression follows.
pub(crate) const UNUSED_CLASS: &str = "the class expression ";

/// Reads the normalised N-Triples document of the ontology with the IRI `about`. Returns `plain`,
/// extended by the axioms, annotations, entities and rules of the document. `names` are the interned
/// IRIs of `plain`. `origins` holds the source of each rule, indexed by the number in the rule's
/// `ORIGIN` annotation.
pub(crate) fn build(
    ntriples: &[u8],
    about: &str,
    origins: &[Origin],
    plain: Parts,
    names: Names,
) -> Result<Parts, String> {
    // horned-owl recurses into lists and expressions, and can panic.
    with_stack(|| build_here(ntriples, about, origins, plain, names))?
}

fn build_here(
    ntriples: &[u8],
    about: &str,
    origins: &[Origin],
    plain: Parts,
    names: Names,
) -> Result<Parts, String> {
    let reading = || {
        let build = ho::Build::new_rc();
        let mut text = ntriples;
        let parser =
            OntologyParser::<_, RcAnnotatedComponent, ConcreteRcRDFOntology, _>::from_bufread_with_format(
                &mut text,
                ParserConfiguration::new(&build),
                oxrdfio::RdfFormat::NTriples,
            )?;
        parser.parse()
    };
    let (ontology, incomplete) = reading().map_err(|error| plain_text(&error.to_string()))?;
    let mut builder = Builder {
        ontology: about.into(),
        names,
        parts: plain,
        rules: Vec::new(),
        ranges: HashMap::default(),
    };
    let mut components = Vec::new();
    for annotated in ontology {
        match annotated.component {
            Component::DatatypeDefinition(definition) if definition.kind.0.starts_with(RANGE) => {
                builder.ranges.insert(String::from(&*definition.kind.0), definition.range);
            }
            _ => components.push(annotated),
        }
    }
    for annotated in components {
        builder.component(annotated.component, annotated.ann);
    }
    let unread = builder.leftovers(&incomplete);
    let Builder { mut parts, mut rules, names, .. } = builder;
    // Restores the document order.
    rules.sort_by_key(|(index, _)| *index);
    parts.rules =
        rules.into_iter().filter_map(|(index, rule)| Some(located(rule, origins.get(index)?))).collect();
    parts.entities.sort();
    parts.entities.dedup();
    sort::axioms(&mut parts.axioms, &names);
    parts.annotations.sort();
    parts.annotations.dedup();
    parts.annotation_annotations.sort();
    parts.annotation_annotations.dedup();
    parts.warnings.extend(unread);
    Ok(parts)
}

fn located(rule: Rule, origin: &Origin) -> Rule {
    Rule { ontology: origin.ontology.clone(), position: origin.position, iri: origin.iri.clone(), ..rule }
}

struct Builder {
    /// IRI of the first document; empty if it declares none.
    ontology: Iri,
    names: Names,
    parts: Parts,
    /// Rules, each with its index in `origins` of [`build`].
    rules: Vec<(usize, Rule)>,
    /// Data ranges within data ranges, by the names that `normalize::forms` gives them.
    ranges: HashMap<String, ho::DataRange<RcStr>>,
}

impl Builder {
    fn iri(&mut self, name: &str) -> Iri {
        self.names.iri(name)
    }

    fn iris<'a, T: std::ops::Deref<Target = ho::IRI<RcStr>> + 'a>(
        &mut self,
        items: impl IntoIterator<Item = &'a T>,
    ) -> Vec<Iri> {
        items.into_iter().map(|item| self.iri(item)).collect()
    }

    fn component(
        &mut self,
        component: Component<RcStr>,
        annotations: impl IntoIterator<Item = ho::Annotation<RcStr>>,
    ) {
        let annotations: Vec<_> =
            annotations.into_iter().map(|annotation| self.annotation(&annotation)).collect();
        match component {
            Component::Rule(rule) => self.rule(&rule, annotations),
            Component::AnnotationAssertion(assertion) => {
                let subject = self.iri(&assertion.subject);
                let annotation = self.annotation(&assertion.ann);
                self.annotate(subject, annotation, annotations);
            }
            Component::OntologyAnnotation(about) => {
                let annotation = self.annotation(&about.0);
                let subject = self.ontology.clone();
                self.parts.annotations.push((subject, annotation));
            }
            Component::SubAnnotationPropertyOf(a) => {
                self.annotate_property(&a.sub, (rdfs::SUB_PROPERTY_OF, &a.sup), annotations);
            }
            Component::AnnotationPropertyDomain(a) => {
                self.annotate_property(&a.ap, (rdfs::DOMAIN, &a.iri), annotations);
            }
            Component::AnnotationPropertyRange(a) => {
                self.annotate_property(&a.ap, (rdfs::RANGE, &a.iri), annotations);
            }
            component => {
                if let Some((kind, iri)) = entity(&component) {
                    let iri = self.iri(iri);
                    self.parts.entities.push((kind, iri));
                } else if let Some(axiom) = self.axiom(&component) {
                    self.parts.axioms.push(AnnotatedAxiom { axiom, annotations });
                }
            }
        }
    }

    fn rule(&mut self, rule: &ho::Rule<RcStr>, annotations: Vec<Annotation>) {
        let text = |property: &str| {
            annotations.iter().find(|annotation| &*annotation.property == property).and_then(|annotation| {
                match &annotation.value {
                    AnnotationValue::Literal(literal) => Some(literal.lexical.clone()),
                    AnnotationValue::Iri(_) => None,
                }
            })
        };
        let (label, enabled) = (text(rdfs::LABEL), text(swrla::IS_RULE_ENABLED));
        // The lexical forms of false in `xsd:boolean`.
        let enabled = enabled.map(|value| !["false", "0"].contains(&&*value));
        let (origins, annotations): (Vec<_>, Vec<_>) =
            annotations.into_iter().partition(|annotation| &*annotation.property == ORIGIN);
        let body = rule.body.iter().filter_map(|atom| self.atom(atom)).collect();
        let head = rule.head.iter().filter_map(|atom| self.atom(atom)).collect();
        let ontology = self.iri("");
        let rule = Rule { ontology, position: 0, iri: None, label, enabled, annotations, body, head };
        // horned-owl merges equal rules without variables; such a rule has several origins.
        let indices = origins.into_iter().filter_map(|origin| match origin.value {
            AnnotationValue::Literal(index) => index.lexical.parse().ok(),
            AnnotationValue::Iri(_) => None,
        });
        self.rules.extend(indices.map(|index| (index, rule.clone())));
    }

    /// Converts an atom of a rule. Returns `None` for the marker atom that normalisation adds to an empty
    /// body or head.
    fn atom(&mut self, atom: &ho::Atom<RcStr>) -> Option<Atom> {
        Some(match atom {
            ho::Atom::BuiltInAtom { pred, args } => {
                Atom::BuiltIn(self.iri(pred), args.iter().map(|argument| self.data(argument)).collect())
            }
            ho::Atom::ClassAtom { pred, arg } => Atom::Class(self.class(pred), self.individual(arg)),
            ho::Atom::DataPropertyAtom { pred, args } => {
                Atom::DataProperty(self.iri(pred), self.data(&args.0), self.data(&args.1))
            }
            ho::Atom::DataRangeAtom { pred, arg } => Atom::DataRange(self.range(pred), self.data(arg)),
            ho::Atom::DifferentIndividualsAtom(first, second) => {
                Atom::DifferentIndividuals(self.individual(first), self.individual(second))
            }
            ho::Atom::ObjectPropertyAtom { pred, args } => {
                Atom::ObjectProperty(self.object(pred), self.individual(&args.0), self.individual(&args.1))
            }
            ho::Atom::SameIndividualAtom(first, second) => {
                let (first, second) = (self.individual(first), self.individual(second));
                if matches!(&first, Argument::Individual(iri) if &**iri == TRUE) {
                    return None;
                }
                Atom::SameIndividual(first, second)
            }
        })
    }

    fn individual(&mut self, argument: &ho::IArgument<RcStr>) -> Argument {
        match argument {
            ho::IArgument::Individual(individual) => Argument::Individual(self.named(individual)),
            ho::IArgument::Variable(variable) => self.variable(&variable.0),
        }
    }

    fn data(&mut self, argument: &ho::DArgument<RcStr>) -> Argument {
        match argument {
            ho::DArgument::Literal(literal) => Argument::Literal(self.literal(literal)),
            ho::DArgument::Variable(variable) => self.variable(&variable.0),
        }
    }

    fn variable(&mut self, name: &str) -> Argument {
        if let Some(individual) = name.strip_prefix(INDIVIDUAL) {
            return Argument::Individual(self.iri(individual));
        }
        // Normalised variables contain the index of their rule: `VARIABLE`, index, colon, original name.
        let numbered = name.strip_prefix(VARIABLE).and_then(|suffix| suffix.split_once(':'));
        Argument::Variable(self.iri(numbered.map_or(name, |(_, original)| original)))
    }

    fn named(&mut self, individual: &ho::Individual<RcStr>) -> Iri {
        match individual {
            ho::Individual::Named(node) => self.iri(node),
            ho::Individual::Anonymous(node) => self.iri(&format!("{ANONYMOUS}{}", &**node)),
        }
    }

    fn individuals(&mut self, individuals: &[ho::Individual<RcStr>]) -> Vec<Iri> {
        individuals.iter().map(|individual| self.named(individual)).collect()
    }

    fn literal(&mut self, literal: &ho::Literal<RcStr>) -> Literal {
        let lexical = Arc::from(literal.literal().as_str());
        match literal {
            ho::Literal::Simple { .. } => Literal { lexical, datatype: None, language: None },
            ho::Literal::Language { lang, .. } => {
                Literal { lexical, datatype: None, language: Some(Arc::from(lang.as_str())) }
            }
            ho::Literal::Datatype { datatype_iri, .. } => {
                Literal { lexical, datatype: Some(self.iri(datatype_iri)), language: None }
            }
        }
    }

    fn object(&mut self, property: &ho::ObjectPropertyExpression<RcStr>) -> ObjectPropertyExpression {
        let name = match property {
            ho::ObjectPropertyExpression::ObjectProperty(iri)
            | ho::ObjectPropertyExpression::InverseObjectProperty(iri) => iri,
        };
        // `normalize::forms` names inverse properties where horned-owl requires a name.
        if let Some(inverse) = name.strip_prefix(INVERSE) {
            return ObjectPropertyExpression::Inverse(self.iri(inverse));
        }
        match property {
            ho::ObjectPropertyExpression::ObjectProperty(iri) => {
                ObjectPropertyExpression::Property(self.iri(iri))
            }
            ho::ObjectPropertyExpression::InverseObjectProperty(iri) => {
                ObjectPropertyExpression::Inverse(self.iri(iri))
            }
        }
    }

    fn objects(
        &mut self,
        properties: &[ho::ObjectPropertyExpression<RcStr>],
    ) -> Vec<ObjectPropertyExpression> {
        properties.iter().map(|property| self.object(property)).collect()
    }

    fn ranges(&mut self, ranges: &[ho::DataRange<RcStr>]) -> Vec<DataRange> {
        ranges.iter().map(|range| self.range(range)).collect()
    }

    fn range(&mut self, range: &ho::DataRange<RcStr>) -> DataRange {
        match range {
            // A definition is unavailable within itself, so that a cyclic definition ends here.
            ho::DataRange::Datatype(iri) => match self.ranges.remove_entry::<str>(iri) {
                Some((name, definition)) => {
                    let range = self.range(&definition);
                    self.ranges.insert(name, definition);
                    range
                }
                None => DataRange::Datatype(self.iri(iri)),
            },
            ho::DataRange::DataIntersectionOf(ranges) => DataRange::IntersectionOf(self.ranges(ranges)),
            ho::DataRange::DataUnionOf(ranges) => DataRange::UnionOf(self.ranges(ranges)),
            ho::DataRange::DataComplementOf(range) => DataRange::ComplementOf(Box::new(self.range(range))),
            ho::DataRange::DataOneOf(literals) => {
                DataRange::OneOf(literals.iter().map(|literal| self.literal(literal)).collect())
            }
            ho::DataRange::DatatypeRestriction(datatype, facets) => DataRange::Restriction(
                self.iri(datatype),
                facets.iter().map(|facet| (self.iri(facet.f.as_ref()), self.literal(&facet.l))).collect(),
            ),
        }
    }

    fn classes(&mut self, classes: &[ho::ClassExpression<RcStr>]) -> Vec<ClassExpression> {
        classes.iter().map(|class| self.class(class)).collect()
    }

    fn boxed(&mut self, class: &ho::ClassExpression<RcStr>) -> Box<ClassExpression> {
        Box::new(self.class(class))
    }

    fn class(&mut self, class: &ho::ClassExpression<RcStr>) -> ClassExpression {
        use ClassExpression as Ours;
        use ho::ClassExpression as Theirs;
        match class {
            Theirs::Class(iri) => Ours::Class(self.iri(iri)),
            Theirs::ObjectIntersectionOf(classes) => Ours::IntersectionOf(self.classes(classes)),
            Theirs::ObjectUnionOf(classes) => Ours::UnionOf(self.classes(classes)),
            Theirs::ObjectComplementOf(class) => Ours::ComplementOf(self.boxed(class)),
            Theirs::ObjectOneOf(individuals) => Ours::OneOf(self.individuals(individuals)),
            Theirs::ObjectSomeValuesFrom { ope, bce } => {
                Ours::SomeValuesFrom(self.object(ope), self.boxed(bce))
            }
            Theirs::ObjectAllValuesFrom { ope, bce } => {
                Ours::AllValuesFrom(self.object(ope), self.boxed(bce))
            }
            Theirs::ObjectHasValue { ope, i } => Ours::HasValue(self.object(ope), self.named(i)),
            Theirs::ObjectHasSelf(ope) => Ours::HasSelf(self.object(ope)),
            Theirs::ObjectMinCardinality { n, ope, bce } => {
                Ours::Cardinality(Bound::Min, *n, self.object(ope), self.boxed(bce))
            }
            Theirs::ObjectMaxCardinality { n, ope, bce } => {
                Ours::Cardinality(Bound::Max, *n, self.object(ope), self.boxed(bce))
            }
            Theirs::ObjectExactCardinality { n, ope, bce } => {
                Ours::Cardinality(Bound::Exact, *n, self.object(ope), self.boxed(bce))
            }
            Theirs::DataSomeValuesFrom { dp, dr } => Ours::DataSomeValuesFrom(self.iri(dp), self.range(dr)),
            Theirs::DataAllValuesFrom { dp, dr } => Ours::DataAllValuesFrom(self.iri(dp), self.range(dr)),
            Theirs::DataHasValue { dp, l } => Ours::DataHasValue(self.iri(dp), self.literal(l)),
            Theirs::DataMinCardinality { n, dp, dr } => {
                Ours::DataCardinality(Bound::Min, *n, self.iri(dp), self.range(dr))
            }
            Theirs::DataMaxCardinality { n, dp, dr } => {
                Ours::DataCardinality(Bound::Max, *n, self.iri(dp), self.range(dr))
            }
            Theirs::DataExactCardinality { n, dp, dr } => {
                Ours::DataCardinality(Bound::Exact, *n, self.iri(dp), self.range(dr))
            }
        }
    }

    fn axiom(&mut self, component: &Component<RcStr>) -> Option<Axiom> {
        use Characteristic as C;
        let characteristic =
            |builder: &mut Self, characteristic, property: &ho::ObjectPropertyExpression<RcStr>| {
                Axiom::ObjectPropertyCharacteristic(characteristic, builder.object(property))
            };
        Some(match component {
            Component::SubClassOf(a) => Axiom::SubClassOf(self.class(&a.sub), self.class(&a.sup)),
            Component::EquivalentClasses(a) => Axiom::EquivalentClasses(self.classes(&a.0)),
            Component::DisjointClasses(a) => Axiom::DisjointClasses(self.classes(&a.0)),
            Component::DisjointUnion(a) => Axiom::DisjointUnion(self.iri(&a.0), self.classes(&a.1)),
            Component::SubObjectPropertyOf(a) => match &a.sub {
                ho::SubObjectPropertyExpression::ObjectPropertyChain(chain) => {
                    Axiom::SubPropertyChainOf(self.objects(chain), self.object(&a.sup))
                }
                ho::SubObjectPropertyExpression::ObjectPropertyExpression(sub) => {
                    Axiom::SubObjectPropertyOf(self.object(sub), self.object(&a.sup))
                }
            },
            Component::EquivalentObjectProperties(a) => Axiom::EquivalentObjectProperties(self.objects(&a.0)),
            Component::DisjointObjectProperties(a) => Axiom::DisjointObjectProperties(self.objects(&a.0)),
            Component::InverseObjectProperties(a) => {
                Axiom::InverseObjectProperties(self.iri(&a.0), self.iri(&a.1))
            }
            Component::ObjectPropertyDomain(a) => {
                Axiom::ObjectPropertyDomain(self.object(&a.ope), self.class(&a.ce))
            }
            Component::ObjectPropertyRange(a) => {
                Axiom::ObjectPropertyRange(self.object(&a.ope), self.class(&a.ce))
            }
            Component::FunctionalObjectProperty(a) => characteristic(self, C::Functional, &a.0),
            Component::InverseFunctionalObjectProperty(a) => characteristic(self, C::InverseFunctional, &a.0),
            Component::ReflexiveObjectProperty(a) => characteristic(self, C::Reflexive, &a.0),
            Component::IrreflexiveObjectProperty(a) => characteristic(self, C::Irreflexive, &a.0),
            Component::SymmetricObjectProperty(a) => characteristic(self, C::Symmetric, &a.0),
            Component::AsymmetricObjectProperty(a) => characteristic(self, C::Asymmetric, &a.0),
            Component::TransitiveObjectProperty(a) => characteristic(self, C::Transitive, &a.0),
            Component::SubDataPropertyOf(a) => Axiom::SubDataPropertyOf(self.iri(&a.sub), self.iri(&a.sup)),
            Component::EquivalentDataProperties(a) => Axiom::EquivalentDataProperties(self.iris(&a.0)),
            Component::DisjointDataProperties(a) => Axiom::DisjointDataProperties(self.iris(&a.0)),
            Component::DataPropertyDomain(a) => Axiom::DataPropertyDomain(self.iri(&a.dp), self.class(&a.ce)),
            Component::DataPropertyRange(a) => Axiom::DataPropertyRange(self.iri(&a.dp), self.range(&a.dr)),
            Component::FunctionalDataProperty(a) => Axiom::FunctionalDataProperty(self.iri(&a.0)),
            Component::DatatypeDefinition(a) => {
                Axiom::DatatypeDefinition(self.iri(&a.kind), self.range(&a.range))
            }
            Component::HasKey(a) => self.key(a),
            Component::SameIndividual(a) => Axiom::SameIndividual(self.individuals(&a.0)),
            Component::DifferentIndividuals(a) => Axiom::DifferentIndividuals(self.individuals(&a.0)),
            Component::ClassAssertion(a) => Axiom::ClassAssertion(self.class(&a.ce), self.named(&a.i)),
            Component::ObjectPropertyAssertion(a) => {
                Axiom::ObjectPropertyAssertion(self.object(&a.ope), self.named(&a.from), self.named(&a.to))
            }
            Component::NegativeObjectPropertyAssertion(a) => Axiom::NegativeObjectPropertyAssertion(
                self.object(&a.ope),
                self.named(&a.from),
                self.named(&a.to),
            ),
            Component::DataPropertyAssertion(a) => {
                Axiom::DataPropertyAssertion(self.iri(&a.dp), self.named(&a.from), self.literal(&a.to))
            }
            Component::NegativeDataPropertyAssertion(a) => Axiom::NegativeDataPropertyAssertion(
                self.iri(&a.dp),
                self.named(&a.from),
                self.literal(&a.to),
            ),
            _ => return None,
        })
    }

    fn leftovers(&mut self, incomplete: &IncompleteParse<RcStr>) -> Vec<Warning> {
        let triple = |[subject, predicate, object]: &[Term<RcStr>; 3]| {
            format!("{} {} {}", term(subject), term(predicate), term(object))
        };
        let simple = incomplete.simple.iter().map(|entry| triple(entry.triple()));
        let nodes = incomplete.bnode.iter().flat_map(|entry| entry.vec_triple().iter().map(triple));
        let lists = incomplete.bnode_seq.iter().map(|items| {
            let items: Vec<_> = items.iter().map(term).collect();
            format!("the list ({})", items.join(" "))
        });
        let classes =
            incomplete.class_expression.iter().map(|class| format!("{UNUSED_CLASS}{}", self.class(class)));
        let annotations =
            incomplete.ann_map.keys().map(|about| format!("an annotation of {}", triple(about)));
        let statements = simple.chain(nodes).chain(lists).chain(classes).chain(annotations);
        let reason = || "part of no axiom or rule".to_owned();
        statements.map(|statement| Warning::Unread { statement, reason: reason() }).collect()
    }

    fn key(&mut self, key: &ho::HasKey<RcStr>) -> Axiom {
        let (mut objects, mut data) = (Vec::new(), Vec::new());
        for property in &key.vpe {
            match property {
                ho::PropertyExpression::ObjectPropertyExpression(property) => {
                    objects.push(self.object(property));
                }
                ho::PropertyExpression::DataProperty(property) => data.push(self.iri(property)),
                ho::PropertyExpression::AnnotationProperty(_) => {}
            }
        }
        Axiom::HasKey(self.class(&key.ce), objects, data)
    }
}

fn entity(component: &Component<RcStr>) -> Option<(EntityKind, &str)> {
    Some(match component {
        Component::DeclareClass(d) => (EntityKind::Class, &*d.0),
        // Auxiliary names of inverse properties are not entities of the ontology.
        Component::DeclareObjectProperty(d) if d.0.starts_with(INVERSE) => return None,
        Component::DeclareObjectProperty(d) => (EntityKind::ObjectProperty, &*d.0),
        Component::DeclareDataProperty(d) => (EntityKind::DataProperty, &*d.0),
        Component::DeclareAnnotationProperty(d) if !d.0.starts_with(ORIGIN) => {
            (EntityKind::AnnotationProperty, &*d.0)
        }
        Component::DeclareDatatype(d) if d.0.starts_with(RANGE) => return None,
        Component::DeclareDatatype(d) => (EntityKind::Datatype, &*d.0),
        Component::DeclareNamedIndividual(d) => (EntityKind::NamedIndividual, &*d.0),
        _ => return None,
    })
}

/// Reduces a message of horned-owl, which contains debug output, to its summary and the IRIs.
fn plain_text(message: &str) -> String {
    let Some((summary, details)) = message.split_once(": ").filter(|(_, details)| details.contains('"'))
    else {
        return message.to_owned();
    };
    let names: Vec<_> = details.split('"').skip(1).step_by(2).map(|name| format!("<{name}>")).collect();
    format!("{summary}: {}", names.join(" "))
}

fn term(term: &Term<RcStr>) -> String {
    match term {
        Term::Iri(iri) => format!("<{}>", &**iri),
        Term::Literal(literal) => format!("{:?}", literal.literal()),
        Term::OWL(word) => format!("<{}>", &***word),
        Term::RDF(word) => format!("<{}>", &***word),
        Term::RDFS(word) => format!("<{}>", &***word),
        Term::SWRL(word) => format!("<{}>", &***word),
        // `Term` does not expose the label of a blank node, but its debug output quotes it.
        blank => {
            let text = format!("{blank:?}");
            text.split('"').nth(1).map_or_else(|| text.clone(), |label| format!("_:{label}"))
        }
    }
}
