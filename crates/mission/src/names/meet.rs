//! Compares the names in the problem with those in the knowledge base: finds objects without an
//! individual, and designs that the problem never names.
//!
//! A problem that names no designs receives all of them from the knowledge base; examples are the
//! missions `ugv` and `uuv`. The problem of `camara_like` names its 18 designs. If a problem names
//! designs, a name that is missing in the problem or in the knowledge base suggests that the two do not
//! belong together. The availability of a design is stated by the problem if the knowledge base has
//! neither the design nor its functions.
//!
//! A required function can be solved only by a design that occurs in both the problem and the knowledge base, or by a
//! design whose availability is stated by the problem. If different names are the reason that a required function has
//! no such design, this is an error: it makes every plan impossible for a reason that is not about the robot.

use std::collections::BTreeSet;

use pddl::ast::{Declaration, Domain, Name, Problem, Span};
use pddl::{Diagnostic, Severity, Source};

use super::likeness::{entries, list, pairs};
use super::roles::{ACTION, DESIGN, FUNCTION, Object, Role, Roles, arguments, facts};
use crate::binding::Bindings;
use crate::knowledge::{Catalogue, Knowledge};
use crate::message::Message;

#[derive(Debug, Default)]
pub(crate) struct Meeting {
    /// Designs whose availability is stated by the problem.
    pub(crate) own: BTreeSet<Name>,
    /// Errors: required functions without a design that occurs in both the problem and the
    /// knowledge base.
    pub(crate) errors: Vec<Message>,
    pub(crate) warnings: Vec<Message>,
    pub(crate) never_named: NeverNamed,
}

/// Warning that the problem declares some designs, but not all that the knowledge base has for the functions named in
/// the problem (if it names none, for any function). Contains the IRI of the first missing design, and the text.
///
/// `None` if no design is missing, or if another message already lists the missing designs. Such a message appears if
/// the problem declares unknown designs, or if a required function has no design.
pub(crate) type NeverNamed = Option<(String, String)>;

pub(crate) fn meet(
    (domain, domain_source): (&Domain, &Source),
    (problem, problem_source): (&Problem, &Source),
    knowledge: &Knowledge,
    bindings: &Bindings,
) -> Meeting {
    let roles = Roles::new(domain, problem, knowledge, bindings);

    let comparison = Comparison { domain, problem, bindings, known: knowledge.catalogue(), roles: &roles };
    let problem_designs = comparison.own_designs();
    let errors = comparison.unsolved(&problem_designs);
    let mut meeting = Meeting { own: problem_designs, ..Meeting::default() };
    let message = |finding: Finding, severity: Severity, code: &'static str| {
        let source = if finding.in_domain { domain_source } else { problem_source };
        let mut diagnostic = Diagnostic::new(source, finding.span, severity, code, finding.text);
        diagnostic.help = finding.help;
        Message::from_pddl(&[diagnostic], &[source])
    };
    let is_error = !errors.is_empty();
    meeting.errors =
        errors.into_iter().flat_map(|finding| message(finding, Severity::Error, "M222")).collect();
    // Warnings about designs would repeat the errors.
    for role in roles.all().iter().filter(|role| role.class != DESIGN || !is_error) {
        match comparison.one_sided(role, &meeting.own) {
            OneSided::Objects(finding) => {
                meeting.warnings.extend(message(finding, Severity::Warning, "M221"));
            }
            OneSided::Individuals(iri, text) => meeting.never_named = Some((iri, text)),
            OneSided::Nothing => {}
        }
    }
    meeting
}

struct Finding {
    in_domain: bool,
    span: Span,
    text: String,
    help: Option<String>,
}

/// Names of a role (class of compared names, such as design or function) that occur only in the problem or only in
/// the knowledge base.
enum OneSided {
    /// Objects without individuals, and possibly individuals without objects.
    Objects(Finding),
    /// Only individuals without objects: the IRI of the first and the text of the warning.
    Individuals(String, String),
    Nothing,
}

struct Comparison<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    bindings: &'a Bindings,
    known: &'a Catalogue,
    roles: &'a Roles,
}

impl Comparison<'_> {
    fn stated(&self) -> Vec<(&Name, &Name, Span)> {
        let solves = self.bindings.solves();
        let pair = |atom| match arguments(atom)[..] {
            [design, function] if solves.contains(&atom.predicate.name) => {
                Some((design, function, atom.span))
            }
            _ => None,
        };
        facts(self.problem).filter_map(pair).collect()
    }

    /// Returns the designs for which the problem states solved functions, if the knowledge base has neither
    /// the design nor any of these functions.
    fn own_designs(&self) -> BTreeSet<Name> {
        let (designs, functions) = (self.roles.of(DESIGN), self.roles.of(FUNCTION));
        let stated = self.stated();
        let is_theirs = |design: &Name| {
            let mut solved = stated.iter().filter(|(other, ..)| *other == design);
            designs.knows(design) || solved.any(|(_, function, _)| functions.knows(function))
        };
        stated
            .iter()
            .filter(|(design, ..)| !is_theirs(design))
            .map(|(design, ..)| (*design).clone())
            .collect()
    }

    /// Returns the functions that actions require according to the problem or, for actions with a counterpart
    /// in the domain, according to the knowledge base. The position is that of the fact if the problem states
    /// the requirement, and otherwise `None`.
    fn required(&self) -> Vec<(Name, Option<Span>)> {
        let functions = self.roles.of(FUNCTION);
        let mut required: Vec<(Name, Option<Span>)> = Vec::new();
        let mut add = |name: &Name, span| {
            if !required.iter().any(|(known, _)| known == name) {
                required.push((name.clone(), span));
            }
        };
        for atom in facts(self.problem).filter(|atom| self.bindings.is_requirement(&atom.predicate.name)) {
            let names = arguments(atom);
            for name in names.into_iter().filter(|name| functions.has(name) || functions.knows(name)) {
                add(name, Some(atom.span));
            }
        }
        for action in self.known.actions() {
            let individual = &action.individual;
            let mut schemas = self.domain.actions.iter().map(|schema| &schema.identifier.name);
            let mut predicates = self.domain.predicates.iter().map(|declared| &declared.identifier.name);
            let stands = schemas.any(|own| self.bindings.is_action(own, individual))
                || predicates.any(|own| self.bindings.says_needs(own, individual));
            for function in action.requires.iter().filter(|_| stands) {
                add(&Name::new(&function.name), None);
            }
        }
        required
    }

    /// Returns an error for each required function that no design can solve because the names in the problem and the
    /// knowledge base differ.
    fn unsolved(&self, own: &BTreeSet<Name>) -> Vec<Finding> {
        let is_availability =
            |declared: &Declaration| self.bindings.is_availability(&declared.identifier.name);
        // Without an availability predicate the knowledge base does not restrict the designs.
        if !self.domain.predicates.iter().any(is_availability) {
            return Vec::new();
        }
        let required = self.required();
        required.iter().filter_map(|(function, span)| self.fault(function, *span, own)).collect()
    }

    /// Returns the error that no design can solve a required function. `None` if a design can, or if
    /// different names are not the cause.
    fn fault(&self, function: &Name, span: Option<Span>, own: &BTreeSet<Name>) -> Option<Finding> {
        let (designs, functions) = (self.roles.of(DESIGN), self.roles.of(FUNCTION));
        let solutions = self.stated();
        let stated: Vec<_> = solutions.iter().filter(|(_, solved, _)| *solved == function).collect();
        let is_met = |object: &&Object| designs.knows(&object.name);
        let base_designs: Vec<&str> = self
            .known
            .designs()
            .iter()
            .filter(|design| design.solves.iter().any(|solved| Name::new(&solved.name) == *function))
            .map(|design| design.individual.name.as_str())
            .collect();
        let here = |name: &Name| stated.iter().any(|(design, ..)| *design == name);
        let named = |object: &Object| base_designs.iter().any(|name| Name::new(name) == object.name);
        let is_solved = designs.objects.iter().any(|object| {
            named(object)
                || here(&object.name) && (designs.knows(&object.name) || self.is_usable(object, own))
        });
        // Designs for which no solved function is stated may be intended for this function.
        let says_nothing = |object: &&Object| !solutions.iter().any(|(design, ..)| **design == object.name);
        let unknown = || designs.objects.iter().filter(|object| !is_met(object));
        let mut only_here: Vec<&Object> = unknown().filter(|object| here(&object.name)).collect();
        if only_here.is_empty() && stated.is_empty() {
            only_here = unknown().filter(says_nothing).collect();
        }
        let is_known = functions.knows(function);
        if is_solved || is_known && only_here.is_empty() {
            return None;
        }
        let (in_domain, span) = match (stated.first(), span, only_here.first()) {
            (Some((.., span)), ..) => (false, *span),
            (None, Some(span), _) => (false, span),
            (None, None, Some(object)) => (object.in_domain, object.span),
            (None, None, None) => return None,
        };
        let only_here: Vec<&str> = only_here.iter().map(|object| object.name.as_str()).collect();
        let text = format!(
            "the problem and the knowledge base have no common design of the required function `{function}`; in the \
             problem only: {}; in the knowledge base only: {}",
            list(&only_here),
            list(&base_designs),
        );
        let help = if is_known {
            suggestion(&base_designs, &only_here, true)
        } else {
            let names: Vec<&str> =
                functions.individuals.iter().map(|individual| individual.name.as_str()).collect();
            let candidates = pairs(&names, &[function.as_str()]);
            Some(match suggested(&candidates) {
                Some(entries) => format!(
                    "the knowledge base has no function `{function}`; name it as the knowledge base does, or write in \
                     `[bindings.names]`: {entries}"
                ),
                None => format!(
                    "the knowledge base has no function `{function}`; add it to the knowledge base, or state in the \
                     problem which of its designs are available"
                ),
            })
        };
        Some(Finding { in_domain, span, text, help })
    }

    fn is_usable(&self, object: &Object, own: &BTreeSet<Name>) -> bool {
        let mut available =
            facts(self.problem).filter(|atom| self.bindings.is_availability(&atom.predicate.name));
        own.contains(&object.name) && available.any(|atom| arguments(atom) == [&object.name])
    }

    /// Finds objects of a role (such as design or function) without an individual, and designs that the problem never
    /// names.
    fn one_sided(&self, role: &Role, own: &BTreeSet<Name>) -> OneSided {
        let always = [FUNCTION, DESIGN].contains(&role.class.as_str());
        if !always && role.individuals.is_empty() {
            return OneSided::Nothing;
        }
        let unknown: Vec<&Object> = role.objects.iter().filter(|object| !role.knows(&object.name)).collect();
        let unnamed = role.individuals.iter().filter(|individual| !role.has(&Name::new(&individual.name)));
        let unnamed: Vec<_> = match role.class.as_str() {
            // A problem that declares no designs itself receives all designs from the knowledge base,
            // so no design needs to be named. Designs in the domain do not count.
            DESIGN if role.objects.iter().all(|object| object.in_domain) => Vec::new(),
            DESIGN => unnamed.filter(|design| self.is_of_named_function(&design.iri)).collect(),
            _ => unnamed.collect(),
        };
        let (here, there): (Vec<&str>, Vec<&str>) = (
            unknown.iter().map(|object| object.name.as_str()).collect(),
            unnamed.iter().map(|individual| individual.name.as_str()).collect(),
        );
        let members = noun(&role.class);
        let lists =
            format!("in the problem only: {}; in the knowledge base only: {}", list(&here), list(&there));
        match (unknown.first(), unnamed.first()) {
            (Some(first), _) => {
                let text = format!("the knowledge base lacks {members} of the problem; {lists}");
                let help = suggestion(&there, &here, false);
                let ours: Vec<&str> =
                    here.iter().copied().filter(|name| own.contains(&Name::new(name))).collect();
                let decides = (!ours.is_empty()).then(|| {
                    format!(
                        "the problem determines whether {} can be used, since the knowledge base does not \
                             have their functions",
                        list(&ours)
                    )
                });
                let help = [help, decides]
                    .into_iter()
                    .flatten()
                    .reduce(|first, second| format!("{first}; {second}"));
                OneSided::Objects(Finding { in_domain: first.in_domain, span: first.span, text, help })
            }
            (None, Some(first)) if role.class == DESIGN => {
                let text = format!("the problem lacks {members} of the knowledge base; {lists}");
                OneSided::Individuals(first.iri.clone(), text)
            }
            _ => OneSided::Nothing,
        }
    }

    /// Returns `true` if the design with this IRI solves a function that the problem names, or if
    /// the problem names no function.
    fn is_of_named_function(&self, iri: &str) -> bool {
        let functions = self.roles.of(FUNCTION);
        let design = self.known.designs().iter().find(|design| design.individual.iri == iri);
        functions.objects.is_empty()
            || design.is_some_and(|design| {
                design.solves.iter().any(|function| functions.has(&Name::new(&function.name)))
            })
    }
}

fn noun(class: &str) -> String {
    match class {
        FUNCTION => "functions".to_owned(),
        DESIGN => "designs".to_owned(),
        ACTION => "actions".to_owned(),
        class => format!("members of the class {class}"),
    }
}

/// Suggests entries of `[bindings.names]` for similar names. If `all` is `true`, the names belong
/// to one function; a single remaining name of the knowledge base and a single remaining object are
/// then paired as well.
fn suggestion<'n>(known: &[&'n str], here: &[&'n str], all: bool) -> Option<String> {
    let mut matches = pairs(known, here);
    let base_names: Vec<&str> =
        known.iter().copied().filter(|name| matches.iter().all(|pair| pair.0 != *name)).collect();
    let object_names: Vec<&str> =
        here.iter().copied().filter(|name| matches.iter().all(|pair| pair.1 != *name)).collect();
    if let ([base_name], [object_name], true) = (&base_names[..], &object_names[..], all) {
        matches.push((base_name, object_name));
    }
    let entries = suggested(&matches);
    match (entries, all) {
        (Some(entries), _) => {
            Some(format!("if these names mean the same, write in `[bindings.names]`: {entries}"))
        }
        (None, true) => {
            Some("map individuals to objects in `[bindings.names]`: INDIVIDUAL = \"OBJECT\"".to_owned())
        }
        (None, false) => None,
    }
}

fn suggested(meant: &[(&str, &str)]) -> Option<String> {
    (!meant.is_empty()).then(|| entries(meant).join(", "))
}
