//! Rewrites every SWRL rule in the RDF graph to one canonical form. A rule is a blank node with typed lists
//! of atoms. An atom is a blank node that has only its arguments.
//!
//! Special IRIs encode information that this form cannot express; `crate::horned` decodes them. Variables and
//! individuals have separate namespaces (in real files one IRI can be both). An individual as the first
//! argument of a data atom becomes a variable with the individual's name. An empty body or head becomes one
//! atom that always holds.

use std::collections::{HashMap, HashSet};

use oxrdf::{Literal, NamedNode, NamedOrBlankNode, Term};

use crate::error::Warning;
use crate::graph::{Graph, iri_of, subject_of};
use crate::owl::{ANONYMOUS, Iri};
use crate::vocab::{owl, rdf, rdfs, swrl};

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Origin {
    /// IRI of the ontology that states the rule; the document's name if the ontology has no IRI.
    pub ontology: Iri,
    /// Index of the rule in its document, from 0. Unreadable rules are counted, too.
    pub position: u32,
    pub iri: Option<Iri>,
}

/// Prefix of the IRIs of rule variables; the rule's index and a colon follow. Rules share no variables, because
/// horned-owl would merge equal rules of two ontologies and mix their annotations.
pub(crate) const VARIABLE: &str = "urn:metaplan:variable:";
/// Prefix of the IRI of a variable that represents an individual.
pub(crate) const INDIVIDUAL: &str = "urn:metaplan:individual:";
/// Individual of the atom `sameAs(TRUE, TRUE)`. Normalisation writes this atom into an empty body or head, and
/// the conversion to rules removes it.
pub(crate) const TRUE: &str = "urn:metaplan:true";
/// Annotation property whose value is the index of a rule in the list of [`Origin`]s.
pub(crate) const ORIGIN: &str = "urn:metaplan:origin";

/// Returns the origin of each rewritten rule. Each element of `parts` is a document: the index of its first
/// triple, and its ontology IRI or name. Unreadable rules are removed with a warning.
pub(crate) fn rewrite(graph: &mut Graph, parts: &[(usize, Iri)], warnings: &mut Vec<Warning>) -> Vec<Origin> {
    let mut pass = Pass::new(graph);
    let (mut origins, mut positions) = (Vec::new(), vec![0; parts.len()]);
    for (index, node) in graph.instances(swrl::IMP) {
        let part = parts.partition_point(|(start, _)| *start <= index).saturating_sub(1);
        let Some((_, ontology)) = parts.get(part) else { continue };
        let iri = match &node {
            NamedOrBlankNode::NamedNode(iri) => Some(Iri::from(iri.as_str())),
            NamedOrBlankNode::BlankNode(_) => None,
        };
        let origin = Origin { ontology: ontology.clone(), position: positions[part], iri };
        positions[part] += 1;
        pass.rule = origins.len();
        match pass.read(graph, &node) {
            Ok((body, head)) => {
                warnings.extend(pass.unknown.drain(..).map(|iri| Warning::UnknownArgument {
                    iri,
                    ontology: origin.ontology.to_string(),
                    position: origin.position,
                }));
                pass.write(graph, &node, &body, &head);
                origins.push(origin);
            }
            Err(reason) => {
                let labels = pass.annotated(&node).flat_map(|node| graph.objects(node, rdfs::LABEL));
                let label = labels.into_iter().find_map(|term| match term {
                    Term::Literal(literal) => Some(literal.value().to_owned()),
                    _ => None,
                });
                let (ontology, position) = (origin.ontology.to_string(), origin.position);
                warnings.push(Warning::UnreadRule { ontology, position, label, reason });
                let indices = pass.annotated(&node).flat_map(|node| graph.of(node)).map(|(index, _)| index);
                let indices: Vec<usize> = indices.collect();
                pass.replaced.extend(indices);
            }
        }
    }
    pass.finish(graph);
    origins
}

/// An atom: its type and its arguments as (predicate, object), in the order that horned-owl requires.
struct RdfAtom {
    class: &'static str,
    arguments: Vec<(&'static str, Term)>,
    list: Option<Vec<Term>>,
}

struct Pass {
    variables: HashSet<Term>,
    /// Terms that occur outside of rules, except as classes.
    described: HashSet<Term>,
    data_properties: HashSet<Term>,
    /// Maps a rule to the nodes of the type `owl:Axiom` with its annotations. horned-owl's RDF writer annotates the type
    /// of the rule instead of the rule.
    annotations: HashMap<NamedOrBlankNode, Vec<NamedOrBlankNode>>,
    /// Indices of the triples that are removed at the end of the pass.
    replaced: HashSet<usize>,
    rule: usize,
    canonical_variables: Vec<NamedNode>,
    /// Arguments of the current rule that are neither variables nor described individuals.
    unknown: Vec<String>,
}

impl Pass {
    fn new(graph: &Graph) -> Self {
        let declared = |class| graph.instances(class).into_iter().map(|(_, node)| Term::from(node));
        let variables: HashSet<Term> = declared(swrl::VARIABLE).collect();
        let object_properties: HashSet<Term> = declared(owl::OBJECT_PROPERTY).collect();
        let data_properties =
            declared(owl::DATATYPE_PROPERTY).filter(|term| !object_properties.contains(term)).collect();
        let mut described = HashSet::new();
        let mut replaced = HashSet::new();
        let mut annotations = HashMap::<_, Vec<_>>::new();
        for (index, triple) in graph.iter() {
            if triple.predicate.as_str() == owl::ANNOTATED_TARGET
                && iri_of(&triple.object) == Some(swrl::IMP)
                && let Some(rule) =
                    graph.object(&triple.subject, owl::ANNOTATED_SOURCE).ok().and_then(subject_of)
            {
                annotations.entry(rule).or_default().push(triple.subject.clone());
            }
            if triple.predicate.as_str().starts_with(swrl::NS) {
                continue;
            }
            if crate::graph::is_type(triple, swrl::VARIABLE) {
                replaced.insert(index);
                continue;
            }
            described.insert(Term::from(triple.subject.clone()));
            // The object of a type triple is a class.
            if triple.predicate.as_str() != rdf::TYPE {
                described.insert(triple.object.clone());
            }
        }
        Self {
            variables,
            described,
            data_properties,
            annotations,
            replaced,
            rule: 0,
            canonical_variables: Vec::new(),
            unknown: Vec::new(),
        }
    }

    /// Returns the nodes whose statements annotate a rule: the rule itself and nodes of the type `owl:Axiom`.
    fn annotated<'a>(
        &'a self,
        rule: &'a NamedOrBlankNode,
    ) -> impl Iterator<Item = &'a NamedOrBlankNode> + use<'a> {
        std::iter::once(rule).chain(self.annotations.get(rule).into_iter().flatten())
    }

    fn read(
        &mut self,
        graph: &Graph,
        rule: &NamedOrBlankNode,
    ) -> Result<(Vec<RdfAtom>, Vec<RdfAtom>), String> {
        self.unknown.clear();
        Ok((self.atoms(graph, rule, swrl::BODY)?, self.atoms(graph, rule, swrl::HEAD)?))
    }

    fn atoms(
        &mut self,
        graph: &Graph,
        rule: &NamedOrBlankNode,
        part: &'static str,
    ) -> Result<Vec<RdfAtom>, String> {
        let Some(list) = graph.objects(rule, part).next() else { return Ok(Vec::new()) };
        // A rule with several bodies or heads is malformed.
        graph.object(rule, part)?;
        let list = graph.list(list)?;
        self.replaced.extend(list.spine);
        list.items.iter().map(|item| self.atom(graph, item)).collect()
    }

    fn atom(&mut self, graph: &Graph, item: &Term) -> Result<RdfAtom, String> {
        let node =
            subject_of(item).ok_or_else(|| format!("the literal {item} stands where an atom should"))?;
        self.replaced.extend(graph.of(&node).map(|(index, _)| index));
        let types: Vec<_> = graph.objects(&node, rdf::TYPE).filter_map(iri_of).collect();
        let typed = |class: &str| types.contains(&class);
        let object = |predicate| graph.object(&node, predicate).cloned();
        let argument_iris = [swrl::ARGUMENT1, swrl::ARGUMENT2];
        if typed(swrl::CLASS_ATOM) {
            let class = (swrl::CLASS_PREDICATE, object(swrl::CLASS_PREDICATE)?);
            let argument = self.individual(&object(argument_iris[0])?)?;
            Ok(RdfAtom::new(swrl::CLASS_ATOM, vec![(argument_iris[0], argument), class]))
        } else if typed(swrl::DATA_RANGE_ATOM) {
            let range = (swrl::DATA_RANGE, object(swrl::DATA_RANGE)?);
            let argument = self.data(&object(argument_iris[0])?)?;
            Ok(RdfAtom::new(swrl::DATA_RANGE_ATOM, vec![(argument_iris[0], argument), range]))
        } else if typed(swrl::INDIVIDUAL_PROPERTY_ATOM) || typed(swrl::DATAVALUED_PROPERTY_ATOM) {
            self.property_atom(
                object(swrl::PROPERTY_PREDICATE)?,
                &object(argument_iris[0])?,
                &object(argument_iris[1])?,
                &typed,
            )
        } else if typed(swrl::SAME_INDIVIDUAL_ATOM) || typed(swrl::DIFFERENT_INDIVIDUALS_ATOM) {
            let is_same = typed(swrl::SAME_INDIVIDUAL_ATOM);
            let class = if is_same { swrl::SAME_INDIVIDUAL_ATOM } else { swrl::DIFFERENT_INDIVIDUALS_ATOM };
            let first = self.individual(&object(argument_iris[0])?)?;
            let second = self.individual(&object(argument_iris[1])?)?;
            Ok(RdfAtom::new(class, vec![(argument_iris[0], first), (argument_iris[1], second)]))
        } else if typed(swrl::BUILTIN_ATOM) || object(swrl::BUILTIN).is_ok() {
            let list = graph.list(&object(swrl::ARGUMENTS)?)?;
            self.replaced.extend(list.spine);
            let arguments = list.items.iter().map(|item| self.data(item)).collect::<Result<_, _>>()?;
            let builtin = (swrl::BUILTIN, object(swrl::BUILTIN)?);
            Ok(RdfAtom { class: swrl::BUILTIN_ATOM, arguments: vec![builtin], list: Some(arguments) })
        } else {
            Err(format!("{node} is not an atom of a known type"))
        }
    }

    fn property_atom(
        &mut self,
        property: Term,
        first: &Term,
        second: &Term,
        typed: &dyn Fn(&str) -> bool,
    ) -> Result<RdfAtom, String> {
        let is_data = typed(swrl::DATAVALUED_PROPERTY_ATOM)
            || self.data_properties.contains(&property)
            || matches!(second, Term::Literal(_));
        let subject = self.individual(first)?;
        let (class, subject, value) = if is_data {
            (swrl::DATAVALUED_PROPERTY_ATOM, self.as_variable(subject), self.data(second)?)
        } else {
            (swrl::INDIVIDUAL_PROPERTY_ATOM, subject, self.individual(second)?)
        };
        let arguments =
            vec![(swrl::ARGUMENT1, subject), (swrl::ARGUMENT2, value), (swrl::PROPERTY_PREDICATE, property)];
        Ok(RdfAtom::new(class, arguments))
    }

    fn individual(&mut self, term: &Term) -> Result<Term, String> {
        if self.variables.contains(term) {
            return Ok(self.variable(term));
        }
        match term {
            Term::NamedNode(node) => {
                // A misspelt variable looks like an individual without description.
                if !self.described.contains(term) {
                    self.unknown.push(node.as_str().to_owned());
                }
                Ok(term.clone())
            }
            Term::BlankNode(node) => {
                Ok(NamedNode::new_unchecked(format!("{ANONYMOUS}{}", node.as_str())).into())
            }
            Term::Literal(_) => Err(format!("the literal {term} stands where an individual should")),
        }
    }

    fn data(&mut self, term: &Term) -> Result<Term, String> {
        if self.variables.contains(term) {
            return Ok(self.variable(term));
        }
        match term {
            Term::Literal(_) => Ok(term.clone()),
            _ => Err(format!(
                "{term} stands where a literal or a variable should, and is not declared a variable"
            )),
        }
    }

    fn variable(&mut self, term: &Term) -> Term {
        let name = match term {
            Term::NamedNode(node) => node.as_str(),
            Term::BlankNode(node) => node.as_str(),
            Term::Literal(literal) => literal.value(),
        };
        self.canonical(format!("{VARIABLE}{}:{name}", self.rule))
    }

    /// Converts the subject of a data atom to a variable, because horned-owl admits only variables
    /// there.
    fn as_variable(&mut self, term: Term) -> Term {
        match &term {
            Term::NamedNode(node) if !node.as_str().starts_with(VARIABLE) => {
                self.canonical(format!("{INDIVIDUAL}{}", node.as_str()))
            }
            _ => term,
        }
    }

    fn canonical(&mut self, iri: String) -> Term {
        let node = NamedNode::new_unchecked(iri);
        self.canonical_variables.push(node.clone());
        node.into()
    }

    fn write(&mut self, graph: &mut Graph, original: &NamedOrBlankNode, body: &[RdfAtom], head: &[RdfAtom]) {
        let rule = NamedOrBlankNode::from(graph.fresh());
        graph.state(&rule, rdf::TYPE, NamedNode::new_unchecked(swrl::IMP));
        for (part, atoms) in [(swrl::BODY, body), (swrl::HEAD, head)] {
            let nodes: Vec<Term> = if atoms.is_empty() {
                vec![RdfAtom::truth().write(graph)]
            } else {
                atoms.iter().map(|atom| atom.write(graph)).collect()
            };
            let list = graph.add_list(nodes, Some(swrl::ATOM_LIST));
            graph.state(&rule, part, list);
        }
        graph.state(&rule, ORIGIN, Literal::new_simple_literal(self.rule.to_string()));
        let annotations = self.annotated(original).flat_map(|node| graph.of(node));
        let annotations: Vec<_> = annotations.map(|(index, triple)| (index, triple.clone())).collect();
        let structure = [owl::ANNOTATED_SOURCE, owl::ANNOTATED_PROPERTY, owl::ANNOTATED_TARGET];
        for (index, triple) in annotations {
            let predicate = triple.predicate.as_str();
            if !predicate.starts_with(rdf::NS)
                && !predicate.starts_with(swrl::NS)
                && !structure.contains(&predicate)
            {
                graph.state(&rule, predicate, triple.object);
            }
            self.replaced.insert(index);
        }
    }

    fn finish(mut self, graph: &mut Graph) {
        for index in self.replaced {
            graph.take(index);
        }
        self.canonical_variables.sort();
        self.canonical_variables.dedup();
        for variable in self.canonical_variables {
            graph.state(&variable.into(), rdf::TYPE, NamedNode::new_unchecked(swrl::VARIABLE));
        }
    }
}

impl RdfAtom {
    fn new(class: &'static str, arguments: Vec<(&'static str, Term)>) -> Self {
        Self { class, arguments, list: None }
    }

    fn truth() -> Self {
        let term = || Term::from(NamedNode::new_unchecked(TRUE));
        Self::new(swrl::SAME_INDIVIDUAL_ATOM, vec![(swrl::ARGUMENT1, term()), (swrl::ARGUMENT2, term())])
    }

    fn write(&self, graph: &mut Graph) -> Term {
        let node = graph.fresh();
        let subject = NamedOrBlankNode::from(node.clone());
        graph.state(&subject, rdf::TYPE, NamedNode::new_unchecked(self.class));
        if let Some(list) = &self.list {
            let list = graph.add_list(list.iter().cloned(), None);
            graph.state(&subject, swrl::ARGUMENTS, list);
        }
        for (predicate, object) in &self.arguments {
            graph.state(&subject, predicate, object.clone());
        }
        node.into()
    }
}
