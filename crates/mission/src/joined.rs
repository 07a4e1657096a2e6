//! A mission: what the robot is (a knowledge base) and what it has to do (PDDL), joined.

use std::collections::{BTreeSet, HashSet};

use pddl::ast::{Condition, Direction, Domain, Metric, Name, Problem, Term};
use pddl::{self, Severity, Source};
use tracing::info_span;

use crate::binding::Bindings;
use crate::file::{self, Kind};
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message};
use crate::names::{self, Meeting, NeverNamed};
use crate::native::CoAdaptation;
use crate::planta::Planta;

/// A mission that can be planned.
#[derive(Debug, Clone)]
pub struct Mission {
    /// Its name.
    pub name: String,
    pub(super) knowledge: Option<Knowledge>,
    pub(super) bindings: Bindings,
    pub(super) domain_source: Source,
    pub(super) problem_source: Source,
    pub(super) domain: Domain,
    pub(super) problem: Problem,
    pub(super) adaptation: Option<CoAdaptation>,
    /// Designs about whose availability the problem itself decides.
    pub(super) own: BTreeSet<Name>,
    /// That the problem does not name all designs of the knowledge base: the IRI of one, and what is to be said.
    pub(super) never_named: NeverNamed,
    pub(super) planta: Option<Planta>,
    warnings: Vec<Message>,
}

impl Mission {
    /// Joins a knowledge base, if there is one, with a domain and a problem.
    ///
    /// # Errors
    /// All that is wrong with any of them.
    pub fn new(
        name: &str,
        knowledge: Option<Result<Knowledge, Errors>>,
        bindings: Bindings,
        domain: Result<Source, Message>,
        problem: Result<Source, Message>,
    ) -> Result<Self, Errors> {
        let mut errors = Vec::new();
        let mut knowledge = match knowledge.transpose() {
            Ok(knowledge) => knowledge,
            Err(more) => {
                errors.extend(more);
                None
            }
        };
        let (domain_source, problem_source) = match (domain, problem) {
            (Ok(domain), Ok(problem)) => (domain, problem),
            (domain, problem) => {
                errors.extend([domain.err(), problem.err()].into_iter().flatten());
                return Err(errors.into());
            }
        };
        for (kind, source) in [(Kind::Domain, &domain_source), (Kind::Problem, &problem_source)] {
            errors.extend(file::expect(kind, source.name(), source.text()).err());
        }
        // Of what is not PDDL nothing is shown.
        if errors.iter().any(|error| error.code == file::CODE) {
            return Err(errors.into());
        }
        let parsed = parse(&domain_source, &problem_source);
        let (domain, problem, warnings) = match parsed {
            Ok(parsed) if errors.is_empty() => parsed,
            Ok(_) => return Err(errors.into()),
            Err(more) => {
                errors.extend(more);
                return Err(errors.into());
            }
        };
        let (mut domain, mut problem, mut warnings) = (domain, problem, warnings);
        let planta = knowledge.as_ref().and_then(|knowledge| {
            let (planta, completed, more) = Planta::new(knowledge.terms()?, &domain, &mut problem);
            domain = completed;
            warnings.extend(more);
            Some(planta)
        });
        let (own, never_named) = match &mut knowledge {
            // A template names what the knowledge base has.
            Some(knowledge) if planta.is_none() => {
                let files = ((&domain, &domain_source), (&problem, &problem_source));
                joined_names(files, knowledge, &bindings, &mut warnings)?
            }
            _ => (BTreeSet::new(), None),
        };
        let adaptation = match &knowledge {
            Some(knowledge) if planta.is_none() => {
                CoAdaptation::new(&domain, &problem, &knowledge.view(), &bindings)?
            }
            _ => None,
        };
        let domain = adaptation.as_ref().map_or_else(|| domain.clone(), |own| own.explicit(&domain));
        let name = name.to_owned();
        Ok(Self {
            name,
            knowledge,
            bindings,
            domain_source,
            problem_source,
            domain,
            problem,
            adaptation,
            own,
            never_named,
            planta,
            warnings,
        })
    }

    /// What is questionable about the files.
    pub fn warnings(&self) -> impl Iterator<Item = &Message> {
        self.warnings.iter().chain(self.knowledge.iter().flat_map(Knowledge::warnings))
    }

    /// Changes the warnings of joining, to add what only who has read the mission knows.
    pub fn change_warnings(&mut self, change: impl FnOnce(Vec<Message>) -> Vec<Message>) {
        self.warnings = change(std::mem::take(&mut self.warnings));
    }

    /// Adds [`Mission::doubts`] to the warnings, once the situation is complete.
    pub fn note_doubts(&mut self) {
        self.warnings.extend(self.doubts());
    }

    /// The knowledge base, if the mission has one.
    pub fn knowledge(&self) -> Option<&Knowledge> {
        self.knowledge.as_ref()
    }

    /// Marks a component as failed.
    ///
    /// # Errors
    /// There is no such component, or no knowledge base that could have one.
    pub fn fail(&mut self, component: &str) -> Result<(), Message> {
        match &mut self.knowledge {
            Some(knowledge) => knowledge.fail(component),
            None => Err(Message::error(
                "M103",
                format!("there is no knowledge base that has a component `{component}`"),
            )),
        }
    }

    /// Changes the goal: the last argument of its first atom with this predicate.
    pub fn aim(&mut self, predicate: &str, object: &str) {
        let mut parts = vec![&mut self.problem.goal];
        while let Some(part) = parts.pop() {
            match part {
                Condition::And(more) => parts.extend(more.iter_mut().rev()),
                Condition::Atom(atom) if atom.predicate.name.as_str().eq_ignore_ascii_case(predicate) => {
                    if let Some(Term::Constant(last)) = atom.arguments.last_mut() {
                        last.name = Name::new(object);
                    }
                    return;
                }
                _ => {}
            }
        }
    }

    /// The problem as it is to be planned: with what the knowledge base contributes.
    ///
    /// # Errors
    /// What the knowledge base contributes does not fit the domain.
    pub fn filled(&self) -> Result<(Problem, Vec<Message>), Errors> {
        let _span = info_span!("fill").entered();
        let mut problem = self.problem.clone();
        let mut warnings = self.fill(&mut problem);
        if warnings.iter().any(Message::is_error) {
            return Err(warnings.into());
        }
        let found = pddl::check(&self.domain, &self.domain_source, &problem, &self.problem_source);
        let (errors, questionable): (Vec<_>, Vec<_>) =
            found.into_iter().partition(|diagnostic| diagnostic.severity == Severity::Error);
        let sources = [&self.domain_source, &self.problem_source];
        if errors.is_empty() {
            warnings.extend(Message::from_pddl(&questionable, &sources));
            return Ok((problem, warnings));
        }
        // What settings and the knowledge base have contributed stands in no file.
        let (contributed, own): (Vec<_>, Vec<_>) =
            errors.into_iter().partition(|diagnostic| diagnostic.span == pddl::ast::Span::default());
        let mut messages = Message::from_pddl(&own, &sources);
        if self.planta.is_some() && messages.iter().any(|message| message.code == "P134") {
            messages.retain(|message| message.code != "P134");
            messages.extend(Planta::unknown(&self.domain));
        }
        messages.extend(contributed.iter().map(|diagnostic| {
            let text = format!("{} (from a setting or from the knowledge base)", diagnostic.message);
            Message::error(diagnostic.code, text)
        }));
        Err(messages.into())
    }

    /// The predicates about which the knowledge base says something, if it completes the domain (PLANTA's form); none otherwise.
    pub fn completed_predicates(&self) -> Option<&HashSet<Name>> {
        self.planta.as_ref().map(Planta::known)
    }

    /// A condition as it is shown to people: a plain domain is completed with predicates that its author does not know. That a design
    /// meets a requirement is `(meets DESIGN REQUIREMENT)`.
    pub fn spoken(&self, condition: &str) -> String {
        self.adaptation.as_ref().map_or_else(|| condition.to_owned(), |own| own.spoken(condition))
    }

    /// What the knowledge base adds to the actions of a plain domain; none if the domain is explicit.
    pub fn adaptation(&self) -> Option<&CoAdaptation> {
        self.adaptation.as_ref()
    }

    /// The bindings.
    pub fn bindings(&self) -> &Bindings {
        &self.bindings
    }

    /// The domain as its file has it.
    pub fn domain_source(&self) -> &Source {
        &self.domain_source
    }

    /// The problem as its file has it.
    pub fn problem_source(&self) -> &Source {
        &self.problem_source
    }

    /// The predicates that say which design solves which function.
    pub fn solves(&self) -> Vec<Name> {
        self.bindings.solves()
    }

    /// The domain, in explicit form if its file is plain.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// An objective from its text: an expression as it stands in a metric, or the name of a function without
    /// parameters.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub fn objective(&self, problem: &Problem, text: &str) -> Result<Metric, Errors> {
        let text = text.trim();
        let is_word = !text.starts_with('(') && !text.eq_ignore_ascii_case("total-time");
        let text = if is_word && !text.is_empty() { format!("({text})") } else { text.to_owned() };
        let source = Source::new("objective", text);
        pddl::read_objective(Direction::Minimize, &source, &self.domain, problem)
            .map_err(|diagnostics| Message::from_pddl(&diagnostics, &[&source]).into())
    }
}

/// Gives individuals the names that the bindings say, and compares the names of both sides; returns the designs about whose
/// availability the problem itself decides, and those that it never names.
///
/// # Errors
/// Names that cannot be given, and functions of which no design is known to both sides.
fn joined_names(
    (domain, problem): ((&Domain, &Source), (&Problem, &Source)),
    knowledge: &mut Knowledge,
    bindings: &Bindings,
    warnings: &mut Vec<Message>,
) -> Result<(BTreeSet<Name>, NeverNamed), Errors> {
    let (called, more) = names::resolve(domain.0, problem.0, knowledge, bindings)?;
    warnings.extend(more);
    knowledge.call(called);
    let Meeting { own, errors, warnings: more, never_named } =
        names::meet(domain, problem, knowledge, bindings);
    if !errors.is_empty() {
        return Err(errors.into_iter().chain(more).collect());
    }
    warnings.extend(more);
    Ok((own, never_named))
}

fn parse(domain: &Source, problem: &Source) -> Result<(Domain, Problem, Vec<Message>), Errors> {
    let (domain_tree, mut diagnostics) = pddl::parse_domain(domain);
    let (problem_tree, more) = match &domain_tree {
        Some(tree) => pddl::parse_problem_of(tree, problem),
        None => pddl::parse_problem(problem),
    };
    diagnostics.extend(more);
    let messages = Message::from_pddl(&diagnostics, &[domain, problem]);
    match (domain_tree, problem_tree) {
        (Some(domain), Some(problem)) if !pddl::has_errors(&diagnostics) => Ok((domain, problem, messages)),
        _ => Err(messages.into()),
    }
}
