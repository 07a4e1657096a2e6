//! Every SWRL rule into one shape: a blank node, typed lists, one blank node an atom with nothing but its arguments.
//!
//! What the shape cannot say is said in IRIs that `crate::horned` translates back: variables and individuals live in
//! separate name spaces (real files give them one), an individual as first argument of a data atom is a variable that
//! names it, an empty body or head is one atom that always holds.

use std::collections::HashSet;

use oxrdf::{Literal, NamedNode, NamedOrBlankNode, Term};

use crate::error::Warning;
use crate::graph::{Graph, iri_of, subject_of};
use crate::owl::{ANONYMOUS, Iri};
use crate::vocab::{owl, rdf, swrl};

/// Where a rule comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Origin {
    /// The ontology that states it, or the document's name.
    pub ontology: Iri,
    /// Its place there, from 0.
    pub position: u32,
    /// Its own IRI, if it has one.
    pub iri: Option<Iri>,
}

/// What the IRIs of rule variables start with; the rule's index and a colon follow. Two rules never share a variable,
/// or horned-owl would take equal rules of two ontologies for one and mix their annotations.
pub(crate) const VARIABLE: &str = "urn:metaplan:variable:";
/// What the IRI of a variable starts with that stands for an individual.
pub(crate) const INDIVIDUAL: &str = "urn:metaplan:individual:";
/// `sameAs(TRUE, TRUE)` is the only atom of an empty body or head.
pub(crate) const TRUE: &str = "urn:metaplan:true";
/// The annotation that holds a rule's index among the [`Origin`]s.
pub(crate) const ORIGIN: &str = "urn:metaplan:origin";

/// Rewrites the rules of `graph`, whose parts (first index, ontology) come from one document each.
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
                let label = graph.objects(&node, crate::vocab::rdfs::LABEL).find_map(|term| match term {
                    Term::Literal(literal) => Some(literal.value().to_owned()),
                    _ => None,
                });
                let (ontology, position) = (origin.ontology.to_string(), origin.position);
                warnings.push(Warning::UnreadRule { ontology, position, label, reason });
                pass.rubbish.extend(graph.of(&node).map(|(index, _)| index));
            }
        }
    }
    pass.finish(graph);
    origins
}

/// An atom: its type and its arguments as (predicate, object), in the order in which horned-owl wants them.
struct Atom {
    class: &'static str,
    arguments: Vec<(&'static str, Term)>,
    /// The arguments of a built-in.
    list: Option<Vec<Term>>,
}

/// State of the pass over all rules.
struct Pass {
    /// Variables as written.
    variables: HashSet<Term>,
    /// All terms that are described outside rules.
    known: HashSet<Term>,
    /// Data properties by declaration (and not object properties as well).
    data_properties: HashSet<Term>,
    /// Triples that are replaced.
    rubbish: HashSet<usize>,
    /// Index of the current rule.
    rule: usize,
    /// Canonical variables used.
    used: Vec<NamedNode>,
    /// Arguments of the current rule that are neither variables nor known.
    unknown: Vec<String>,
}

impl Pass {
    fn new(graph: &Graph) -> Self {
        let declared = |class| graph.instances(class).into_iter().map(|(_, node)| Term::from(node));
        let variables: HashSet<Term> = declared(swrl::VARIABLE).collect();
        let object_properties: HashSet<Term> = declared(owl::OBJECT_PROPERTY).collect();
        let data_properties =
            declared(owl::DATATYPE_PROPERTY).filter(|term| !object_properties.contains(term)).collect();
        let mut known = HashSet::new();
        let mut rubbish = HashSet::new();
        for (index, triple) in graph.iter() {
            if triple.predicate.as_str().starts_with(swrl::NS) {
                continue;
            }
            if crate::graph::is_type(triple, swrl::VARIABLE) {
                rubbish.insert(index);
                continue;
            }
            known.insert(Term::from(triple.subject.clone()));
            if triple.predicate.as_str() != rdf::TYPE {
                known.insert(triple.object.clone());
            }
        }
        Self { variables, known, data_properties, rubbish, rule: 0, used: Vec::new(), unknown: Vec::new() }
    }

    fn read(&mut self, graph: &Graph, rule: &NamedOrBlankNode) -> Result<(Vec<Atom>, Vec<Atom>), String> {
        self.unknown.clear();
        Ok((self.atoms(graph, rule, swrl::BODY)?, self.atoms(graph, rule, swrl::HEAD)?))
    }

    fn atoms(
        &mut self,
        graph: &Graph,
        rule: &NamedOrBlankNode,
        part: &'static str,
    ) -> Result<Vec<Atom>, String> {
        let Some(list) = graph.objects(rule, part).next() else { return Ok(Vec::new()) };
        graph.object(rule, part)?;
        let list = graph.list(list)?;
        self.rubbish.extend(list.spine);
        list.items.iter().map(|item| self.atom(graph, item)).collect()
    }

    fn atom(&mut self, graph: &Graph, item: &Term) -> Result<Atom, String> {
        let node =
            subject_of(item).ok_or_else(|| format!("the literal {item} stands where an atom should"))?;
        self.rubbish.extend(graph.of(&node).map(|(index, _)| index));
        let types: Vec<_> = graph.objects(&node, rdf::TYPE).filter_map(iri_of).collect();
        let typed = |class: &str| types.contains(&class);
        let object = |predicate| graph.object(&node, predicate).cloned();
        let two = [swrl::ARGUMENT1, swrl::ARGUMENT2];
        if typed(swrl::CLASS_ATOM) {
            let class = (swrl::CLASS_PREDICATE, object(swrl::CLASS_PREDICATE)?);
            let argument = self.individual(&object(two[0])?)?;
            Ok(Atom::new(swrl::CLASS_ATOM, vec![(two[0], argument), class]))
        } else if typed(swrl::DATA_RANGE_ATOM) {
            let range = (swrl::DATA_RANGE, object(swrl::DATA_RANGE)?);
            let argument = self.data(&object(two[0])?)?;
            Ok(Atom::new(swrl::DATA_RANGE_ATOM, vec![(two[0], argument), range]))
        } else if typed(swrl::INDIVIDUAL_PROPERTY_ATOM) || typed(swrl::DATAVALUED_PROPERTY_ATOM) {
            self.property_atom(object(swrl::PROPERTY_PREDICATE)?, &object(two[0])?, &object(two[1])?, &typed)
        } else if typed(swrl::SAME_INDIVIDUAL_ATOM) || typed(swrl::DIFFERENT_INDIVIDUALS_ATOM) {
            let same = typed(swrl::SAME_INDIVIDUAL_ATOM);
            let class = if same { swrl::SAME_INDIVIDUAL_ATOM } else { swrl::DIFFERENT_INDIVIDUALS_ATOM };
            let first = self.individual(&object(two[0])?)?;
            let second = self.individual(&object(two[1])?)?;
            Ok(Atom::new(class, vec![(two[0], first), (two[1], second)]))
        } else if typed(swrl::BUILTIN_ATOM) || object(swrl::BUILTIN).is_ok() {
            let list = graph.list(&object(swrl::ARGUMENTS)?)?;
            self.rubbish.extend(list.spine);
            let arguments = list.items.iter().map(|item| self.data(item)).collect::<Result<_, _>>()?;
            let builtin = (swrl::BUILTIN, object(swrl::BUILTIN)?);
            Ok(Atom { class: swrl::BUILTIN_ATOM, arguments: vec![builtin], list: Some(arguments) })
        } else {
            Err(format!("{node} is not an atom of a known type"))
        }
    }

    /// A property atom; the declaration of its property decides between the two types where they disagree.
    fn property_atom(
        &mut self,
        property: Term,
        first: &Term,
        second: &Term,
        typed: &dyn Fn(&str) -> bool,
    ) -> Result<Atom, String> {
        let data = typed(swrl::DATAVALUED_PROPERTY_ATOM)
            || self.data_properties.contains(&property)
            || matches!(second, Term::Literal(_));
        let subject = self.individual(first)?;
        let (class, subject, value) = if data {
            (swrl::DATAVALUED_PROPERTY_ATOM, self.as_variable(subject), self.data(second)?)
        } else {
            (swrl::INDIVIDUAL_PROPERTY_ATOM, subject, self.individual(second)?)
        };
        let arguments =
            vec![(swrl::ARGUMENT1, subject), (swrl::ARGUMENT2, value), (swrl::PROPERTY_PREDICATE, property)];
        Ok(Atom::new(class, arguments))
    }

    /// An argument that is an individual or a variable for one.
    fn individual(&mut self, term: &Term) -> Result<Term, String> {
        if self.variables.contains(term) {
            return Ok(self.variable(term));
        }
        match term {
            Term::NamedNode(node) => {
                if !self.known.contains(term) {
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

    /// An argument that is a literal or a variable for one.
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

    /// A data atom's subject: horned-owl has variables there, and no individuals.
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
        self.used.push(node.clone());
        node.into()
    }

    /// Adds the canonical form of a rule, with the annotations of `old`.
    fn write(&mut self, graph: &mut Graph, old: &NamedOrBlankNode, body: &[Atom], head: &[Atom]) {
        let rule = NamedOrBlankNode::from(graph.fresh());
        graph.state(&rule, rdf::TYPE, NamedNode::new_unchecked(swrl::IMP));
        for (part, atoms) in [(swrl::BODY, body), (swrl::HEAD, head)] {
            let nodes: Vec<Term> = if atoms.is_empty() {
                vec![Atom::truth().write(graph)]
            } else {
                atoms.iter().map(|atom| atom.write(graph)).collect()
            };
            let list = graph.add_list(nodes, Some(swrl::ATOM_LIST));
            graph.state(&rule, part, list);
        }
        graph.state(&rule, ORIGIN, Literal::new_simple_literal(self.rule.to_string()));
        let annotations: Vec<_> = graph.of(old).map(|(index, triple)| (index, triple.clone())).collect();
        for (index, triple) in annotations {
            let predicate = triple.predicate.as_str();
            if !predicate.starts_with(rdf::NS) && !predicate.starts_with(swrl::NS) {
                graph.state(&rule, predicate, triple.object);
            }
            self.rubbish.insert(index);
        }
    }

    fn finish(mut self, graph: &mut Graph) {
        for index in self.rubbish {
            graph.take(index);
        }
        self.used.sort();
        self.used.dedup();
        for variable in self.used {
            graph.state(&variable.into(), rdf::TYPE, NamedNode::new_unchecked(swrl::VARIABLE));
        }
    }
}

impl Atom {
    fn new(class: &'static str, arguments: Vec<(&'static str, Term)>) -> Self {
        Self { class, arguments, list: None }
    }

    /// The atom that always holds.
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
