//! Which names of the problem the knowledge base does not know, and which of its designs the problem never names.
//!
//! With Metaplan's own missions a problem names no designs, and gets all of them from the knowledge base. Where it does name
//! designs, those of the other side are a sign that the two were not made for each other. A design whose functions the
//! knowledge base does not know either is none of its business: the problem itself says whether it is available.
//!
//! A function that an action requires can be solved only with a design that both sides know, or with one that is the problem's
//! own business. Where there is none, every plan would come to nothing for a reason that has nothing to do with the robot;
//! that is an error.

use std::collections::BTreeSet;

use pddl::ast::{Declaration, Domain, Name, Problem, Span};
use pddl::{Diagnostic, Severity, Source};

use super::likeness::{entries, list, pairs};
use super::roles::{ACTION, DESIGN, FUNCTION, Object, Role, Roles, arguments, facts};
use crate::binding::Bindings;
use crate::knowledge::{Catalogue, Knowledge};
use crate::message::Message;

/// How the names of both sides meet.
#[derive(Debug, Default)]
pub(crate) struct Meeting {
    /// Designs about whose availability the problem itself decides.
    pub(crate) own: BTreeSet<Name>,
    /// Functions of which no design is known to both sides.
    pub(crate) errors: Vec<Message>,
    /// Names of one side only, as warnings about the problem or the domain.
    pub(crate) warnings: Vec<Message>,
    /// Designs that the problem never names.
    pub(crate) never_named: NeverNamed,
}

/// Designs that a problem never names, though it names others: the IRI of the first, and what is to be said.
pub(crate) type NeverNamed = Option<(String, String)>;

/// Compares the names of both sides.
pub(crate) fn meet(
    (domain, domain_source): (&Domain, &Source),
    (problem, problem_source): (&Problem, &Source),
    knowledge: &Knowledge,
    bindings: &Bindings,
) -> Meeting {
    let roles = Roles::new(domain, problem, knowledge, bindings);
    let known = knowledge.catalogue();
    let comparison = Comparison { domain, problem, bindings, known, roles: &roles };
    let own = comparison.own_designs();
    let errors = comparison.unsolved(&own);
    let mut meeting = Meeting { own, ..Meeting::default() };
    let message = |finding: Finding, severity: Severity, code: &'static str| {
        let source = if finding.in_domain { domain_source } else { problem_source };
        let mut found = Diagnostic::new(source, finding.span, severity, code, finding.text);
        found.help = finding.help;
        Message::from_pddl(&[found], &[source])
    };
    let is_error = !errors.is_empty();
    meeting.errors = errors.into_iter().flat_map(|own| message(own, Severity::Error, "M222")).collect();
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

/// Something to be said about a place of the problem, or of the domain.
struct Finding {
    in_domain: bool,
    span: Span,
    text: String,
    help: Option<String>,
}

/// Names of a role that the other side does not have.
enum OneSided {
    /// Objects, and perhaps individuals.
    Objects(Finding),
    /// Individuals only: the IRI of the first.
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
    /// Pairs of a design and a function that it solves, as the problem says.
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

    /// Designs that the knowledge base does not know, and whose functions it does not know either.
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

    /// Functions that actions require, each with the place where the problem says so if it does.
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
            let known = &action.individual;
            let mut schemas = self.domain.actions.iter().map(|schema| &schema.identifier.name);
            let mut predicates = self.domain.predicates.iter().map(|declared| &declared.identifier.name);
            let stands = schemas.any(|own| self.bindings.is_action(own, known))
                || predicates.any(|own| self.bindings.says_needs(own, known));
            for function in action.requires.iter().filter(|_| stands) {
                add(&Name::new(&function.name), None);
            }
        }
        required
    }

    /// Required functions that no design can solve, because no name of one is known to both sides.
    fn unsolved(&self, own: &BTreeSet<Name>) -> Vec<Finding> {
        let is_availability =
            |declared: &Declaration| self.bindings.is_availability(&declared.identifier.name);
        if !self.domain.predicates.iter().any(is_availability) {
            return Vec::new();
        }
        let required = self.required();
        required.iter().filter_map(|(function, span)| self.fault(function, *span, own)).collect()
    }

    /// Why a function has no design, if it has none.
    fn fault(&self, function: &Name, span: Option<Span>, own: &BTreeSet<Name>) -> Option<Finding> {
        let (designs, functions) = (self.roles.of(DESIGN), self.roles.of(FUNCTION));
        let all = self.stated();
        let stated: Vec<_> = all.iter().filter(|(_, solved, _)| *solved == function).collect();
        let is_met = |object: &&Object| designs.knows(&object.name);
        let known: Vec<&str> = self
            .known
            .designs()
            .iter()
            .filter(|design| design.solves.iter().any(|own| Name::new(&own.name) == *function))
            .map(|design| design.individual.name.as_str())
            .collect();
        let here = |name: &Name| stated.iter().any(|(design, ..)| *design == name);
        let named = |object: &Object| known.iter().any(|name| Name::new(name) == object.name);
        let is_solved = designs.objects.iter().any(|object| {
            named(object)
                || here(&object.name) && (designs.knows(&object.name) || self.is_usable(object, own))
        });
        // Designs of which the problem does not say what they solve may be meant for anything.
        let says_nothing = |object: &&Object| !all.iter().any(|(design, ..)| **design == object.name);
        let strange = || designs.objects.iter().filter(|object| !is_met(object));
        let mut only_here: Vec<&Object> = strange().filter(|object| here(&object.name)).collect();
        if only_here.is_empty() && stated.is_empty() {
            only_here = strange().filter(says_nothing).collect();
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
            "no design of the required function `{function}` is known to both sides; in the problem only: {}; in the knowledge \
             base only: {}",
            list(&only_here),
            list(&known),
        );
        let help = if is_known {
            suggestion(&known, &only_here, true)
        } else {
            let names: Vec<&str> = functions.individuals.iter().map(|own| own.name.as_str()).collect();
            let meant = pairs(&names, &[function.as_str()]);
            Some(match suggested(&meant) {
                Some(entries) => format!(
                    "the knowledge base knows no function `{function}`; name it as the knowledge base does, or write in \
                     `[bindings.names]`: {entries}"
                ),
                None => format!(
                    "the knowledge base knows no function `{function}`; either it gets one, or the problem says which of its designs \
                     are available"
                ),
            })
        };
        Some(Finding { in_domain, span, text, help })
    }

    /// Whether a design is the problem's own, and available as it says.
    fn is_usable(&self, object: &Object, own: &BTreeSet<Name>) -> bool {
        let mut available =
            facts(self.problem).filter(|atom| self.bindings.is_availability(&atom.predicate.name));
        own.contains(&object.name) && available.any(|atom| arguments(atom) == [&object.name])
    }

    /// Objects of a role that the knowledge base does not know, and designs that the problem never names.
    fn one_sided(&self, role: &Role, own: &BTreeSet<Name>) -> OneSided {
        let always = [FUNCTION, DESIGN].contains(&role.class.as_str());
        if !always && role.individuals.is_empty() {
            return OneSided::Nothing;
        }
        let strange: Vec<&Object> = role.objects.iter().filter(|object| !role.knows(&object.name)).collect();
        let unnamed = role.individuals.iter().filter(|own| !role.has(&Name::new(&own.name)));
        let unnamed: Vec<_> = match role.class.as_str() {
            // What the problem takes from the knowledge base as a whole it does not name.
            DESIGN if role.objects.iter().all(|object| object.in_domain) => Vec::new(),
            DESIGN => unnamed.filter(|design| self.is_of_named_function(&design.iri)).collect(),
            _ => unnamed.collect(),
        };
        let (here, there): (Vec<&str>, Vec<&str>) = (
            strange.iter().map(|object| object.name.as_str()).collect(),
            unnamed.iter().map(|individual| individual.name.as_str()).collect(),
        );
        let what = noun(&role.class);
        let lists =
            format!("in the problem only: {}; in the knowledge base only: {}", list(&here), list(&there));
        match (strange.first(), unnamed.first()) {
            (Some(first), _) => {
                let text = format!("the knowledge base does not know all {what} of the problem; {lists}");
                let help = suggestion(&there, &here, false);
                let ours: Vec<&str> =
                    here.iter().copied().filter(|name| own.contains(&Name::new(name))).collect();
                let decides = (!ours.is_empty()).then(|| {
                    format!("the problem itself decides whether {} can be used, whose functions the knowledge base does not know", list(&ours))
                });
                let help =
                    [help, decides].into_iter().flatten().reduce(|one, other| format!("{one}; {other}"));
                OneSided::Objects(Finding { in_domain: first.in_domain, span: first.span, text, help })
            }
            (None, Some(first)) if role.class == DESIGN => {
                let text = format!("the problem names {what}, but not all of the knowledge base; {lists}");
                OneSided::Individuals(first.iri.clone(), text)
            }
            _ => OneSided::Nothing,
        }
    }

    /// Whether a design solves a function that the problem names, or the problem names none.
    fn is_of_named_function(&self, iri: &str) -> bool {
        let functions = self.roles.of(FUNCTION);
        let design = self.known.designs().iter().find(|design| design.individual.iri == iri);
        functions.objects.is_empty()
            || design.is_some_and(|design| {
                design.solves.iter().any(|function| functions.has(&Name::new(&function.name)))
            })
    }
}

/// Members of a class, in words.
fn noun(class: &str) -> String {
    match class {
        FUNCTION => "functions".to_owned(),
        DESIGN => "designs".to_owned(),
        ACTION => "actions".to_owned(),
        other => format!("members of the class {other}"),
    }
}

/// Entries for names that are alike; where `all` are for the same thing and one is left on each side, for these, too.
fn suggestion<'n>(known: &[&'n str], here: &[&'n str], all: bool) -> Option<String> {
    let mut meant = pairs(known, here);
    let left: Vec<&str> =
        known.iter().copied().filter(|own| meant.iter().all(|pair| pair.0 != *own)).collect();
    let right: Vec<&str> =
        here.iter().copied().filter(|own| meant.iter().all(|pair| pair.1 != *own)).collect();
    if let ([one], [other], true) = (&left[..], &right[..], all) {
        meant.push((one, other));
    }
    let entries = suggested(&meant);
    match (entries, all) {
        (Some(entries), _) => {
            Some(format!("did you mean the same? Then write in `[bindings.names]`: {entries}"))
        }
        (None, true) => Some(
            "say in `[bindings.names]` which individual is which object: INDIVIDUAL = \"OBJECT\"".to_owned(),
        ),
        (None, false) => None,
    }
}

fn suggested(meant: &[(&str, &str)]) -> Option<String> {
    (!meant.is_empty()).then(|| entries(meant).join(", "))
}
