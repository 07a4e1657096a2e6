//! [`Mission`]: a PDDL domain and problem, joined with a knowledge base if there is one.

use std::collections::{BTreeSet, HashSet};
use std::sync::{Arc, OnceLock};

use pddl::ast::{Atom, Condition, Direction, Domain, InitialElement, Metric, Name, Problem, Span, Term};
use pddl::{self, Diagnostic, Severity, Source};
use tracing::info_span;

use crate::binding::{self, Bindings};
use crate::file::{self, Kind};
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message};
use crate::names::{self, Meeting, NeverNamed};
use crate::native::CoAdaptation;
use crate::planta::Planta;
use crate::values::several_values;

/// A mission that is ready for planning: a domain, a problem and, optionally, a knowledge base.
#[derive(Debug, Clone)]
pub struct Mission {
    /// Name of the mission.
    pub name: String,
    pub(super) knowledge: Option<Knowledge>,
    pub(super) bindings: Bindings,
    pub(super) domain_source: Source,
    pub(super) problem_source: Source,
    pub(super) domain: Domain,
    pub(super) problem: Problem,
    /// The filled problem. Every method that changes the problem or the knowledge base calls [`Self::forget`].
    pub(super) current: OnceLock<Arc<Problem>>,
    /// The domain with conditions on designs at the start of actions whose duration may be 0 in the current situation.
    /// `None` if there is no such action. Emptied by [`Self::forget`].
    instantaneous: OnceLock<Option<Arc<Domain>>>,
    pub(super) adaptation: Option<CoAdaptation>,
    /// Designs whose availability is stated by the problem, not inferred from the knowledge base.
    pub(super) own: BTreeSet<Name>,
    pub(super) never_named: NeverNamed,
    pub(super) planta: Option<Planta>,
    warnings: Vec<Message>,
}

/// An objective that replaces the metric of a problem.
#[derive(Debug, Clone)]
pub struct ParsedObjective {
    /// The objective, which is minimised. Its positions refer to `source`.
    pub metric: Metric,
    /// The text of the objective.
    pub source: Source,
}

impl Mission {
    /// Joins a domain and a problem with a knowledge base, if there is one.
    ///
    /// # Errors
    /// Errors of the knowledge base, unreadable files, files of another kind, and syntax errors of the domain and the
    /// problem. Without such errors: errors of `[bindings]` and `[bindings.names]`, required functions without a common
    /// design, errors of co-adaptation, different individuals with one name, and different values of one attribute.
    /// Symbols and types of PDDL are not checked; see [`Mission::filled`].
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
        // The PDDL parser quotes its input. A file of another kind may contain secrets, so it is
        // never parsed.
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
        let terms = knowledge.as_ref().and_then(Knowledge::terms);
        let unused_bindings = terms.map_or_else(Vec::new, |_| bindings.unused_in_planta());
        Errors::unless_empty(unused_bindings)?;
        let planta = terms.map(|terms| {
            let (planta, completed, more) = Planta::new(terms, &domain, &mut problem);
            domain = completed;
            warnings.extend(more);
            planta
        });
        if knowledge.is_some() && planta.is_none() {
            Errors::unless_empty(bindings.misfits(&domain))?;
        }
        let (problem_designs, never_named) = match &mut knowledge {
            // PLANTA's form completes the domain with the names of the knowledge base, so no names
            // need to be aligned.
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
        let domain =
            adaptation.as_ref().map_or_else(|| domain.clone(), |adaptation| adaptation.explicit(&domain));
        let ambiguous = match (&knowledge, &planta) {
            (Some(knowledge), Some(planta)) => names::merged_by_planta(knowledge, planta),
            (Some(knowledge), None) => {
                let adaptation = adaptation.as_ref();
                let mut attributes = binding::attributes(&domain, &problem, &bindings);
                attributes.extend(adaptation.into_iter().flat_map(CoAdaptation::attributes));
                let mut errors = names::merged(&domain, knowledge, &bindings, adaptation, &attributes);
                errors.extend(several_values(knowledge, &attributes));
                errors
            }
            (None, _) => Vec::new(),
        };
        Errors::unless_empty(ambiguous)?;
        let name = name.to_owned();
        Ok(Self {
            name,
            knowledge,
            bindings,
            domain_source,
            problem_source,
            domain,
            problem,
            current: OnceLock::new(),
            instantaneous: OnceLock::new(),
            adaptation,
            own: problem_designs,
            never_named,
            planta,
            warnings,
        })
    }

    /// Returns the warnings about the input files.
    pub fn warnings(&self) -> impl Iterator<Item = &Message> {
        self.warnings.iter().chain(self.knowledge.iter().flat_map(Knowledge::warnings))
    }

    /// Replaces the warnings of the mission, without those of the knowledge base, by the result of
    /// `change`. The caller can thus add context that this crate does not have.
    pub fn change_warnings(&mut self, change: impl FnOnce(Vec<Message>) -> Vec<Message>) {
        self.warnings = change(std::mem::take(&mut self.warnings));
    }

    /// Adds the lint warnings [`Mission::doubts`] to the warnings. Must be called after all
    /// settings and failures have been applied.
    pub fn note_doubts(&mut self) {
        self.warnings.extend(self.doubts());
    }

    /// Returns the knowledge base, if the mission has one.
    pub fn knowledge(&self) -> Option<&Knowledge> {
        self.knowledge.as_ref()
    }

    /// Marks a component of the knowledge base as failed.
    ///
    /// # Errors
    /// The knowledge base has no such component, inference exceeds its limits, or the mission has no knowledge
    /// base.
    pub fn fail(&mut self, component: &str) -> Result<(), Message> {
        self.forget();
        match &mut self.knowledge {
            Some(knowledge) => knowledge.fail(component),
            None => Err(Message::error(
                "M103",
                format!("without a knowledge base there is no component `{component}`"),
            )),
        }
    }

    /// Finds the first atom with this predicate in the conjunction of the goal and replaces its last argument
    /// by `object`. If there is no such atom, the goal is unchanged.
    pub fn aim(&mut self, predicate: &str, object: &str) {
        self.forget();
        let mut parts = vec![&mut self.problem.goal];
        // Popping from a stack with reversed pushes visits the atoms in their textual order.
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

    /// Returns the problem filled with the objects, facts and values of the knowledge base, and
    /// warnings.
    ///
    /// # Errors
    /// The domain or the filled problem has errors, for example undeclared symbols, or contributions of the
    /// knowledge base that do not fit the domain.
    pub fn filled(&self) -> Result<(Problem, Vec<Message>), Errors> {
        let _span = info_span!("fill").entered();
        let mut problem = self.problem.clone();
        let mut warnings = self.fill(&mut problem);
        warnings.extend(unreadable_values(&problem));
        if warnings.iter().any(Message::is_error) {
            return Err(warnings.into());
        }
        let diagnostics = pddl::check(&self.domain, &self.domain_source, &problem, &self.problem_source);
        let (errors, questionable): (Vec<_>, Vec<_>) =
            diagnostics.into_iter().partition(|diagnostic| diagnostic.severity == Severity::Error);
        let sources = [&self.domain_source, &self.problem_source];
        if errors.is_empty() {
            let (contributed, located) = by_origin(questionable);
            warnings.extend(Message::from_pddl(&located, &sources));
            warnings.extend(contributed.iter().map(|(code, text)| Message::warning(code, text)));
            return Ok((problem, warnings));
        }
        let (contributed, located) = by_origin(errors);
        let mut messages = Message::from_pddl(&self.about_sums(located), &sources);
        if self.planta.is_some() && messages.iter().any(|message| message.code == "P134") {
            messages.retain(|message| message.code != "P134");
            messages.extend(Planta::unknown(&self.domain));
        }
        messages.extend(contributed.iter().map(|(code, text)| Message::error(code, text)));
        Err(messages.into())
    }

    /// Rewrites errors about unknown functions that a sum over designs replaces: the domain declares them, but they have
    /// a value only in actions.
    fn about_sums(&self, mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
        for diagnostic in diagnostics.iter_mut().filter(|diagnostic| diagnostic.code == "P122") {
            let name = diagnostic.message.split('`').nth(1).map(ToOwned::to_owned);
            let Some(name) = name.filter(|name| self.stands_for_designs(&Name::new(name))) else { continue };
            diagnostic.message = format!(
                "`{name}` is a sum over the designs that are chosen for an action, so it has a value only in actions"
            );
            diagnostic.help = Some(format!(
                "add it to a number in effects, as in `(increase (total-cost) ({name}))`, and use this number here"
            ));
        }
        diagnostics
    }

    /// Checks the last element of the initial state, which a setting has added, against the domain and the objects.
    ///
    /// # Errors
    /// Unknown symbols or objects, or arguments of other types or of another number.
    pub fn check_last_element(&self) -> Result<(), Errors> {
        let Some(element) = self.problem.init.last() else { return Ok(()) };
        let mut diagnostics =
            pddl::check_element(&self.domain, &self.current(), element, &self.problem_source);
        diagnostics.retain(|diagnostic| diagnostic.severity == Severity::Error);
        let (contributed, located) = by_origin(diagnostics);
        let mut messages = Message::from_pddl(&located, &[&self.problem_source]);
        messages.extend(contributed.iter().map(|(code, text)| Message::error(code, text)));
        Errors::unless_empty(messages)
    }

    /// Returns the predicates of the knowledge base and of numeric comparisons that complete a domain
    /// in PLANTA's form. Includes those that the domain declares itself. `None` for other missions.
    pub fn completed_predicates(&self) -> Option<&HashSet<Name>> {
        self.planta.as_ref().map(Planta::known)
    }

    /// Rewrites a condition for display. In the explicit form of a plain domain, an atom which states that a design
    /// meets a quality bound becomes `(meets DESIGN BOUND)`.
    pub fn spoken(&self, condition: &str) -> String {
        self.adaptation
            .as_ref()
            .map_or_else(|| condition.to_owned(), |adaptation| adaptation.spoken(condition))
    }

    /// Returns the additions of the knowledge base to the actions of a plain domain (without a type of designs). `None`
    /// if the mission has no such additions.
    pub fn adaptation(&self) -> Option<&CoAdaptation> {
        self.adaptation.as_ref()
    }

    /// Returns the bindings.
    pub fn bindings(&self) -> &Bindings {
        &self.bindings
    }

    /// Returns the source text of the domain file.
    pub fn domain_source(&self) -> &Source {
        &self.domain_source
    }

    /// Returns the source text of the problem file.
    pub fn problem_source(&self) -> &Source {
        &self.problem_source
    }

    /// Returns the predicates `(p DESIGN FUNCTION)` that state which design solves which function.
    pub fn solves(&self) -> Vec<Name> {
        self.bindings.solves()
    }

    /// Empties the caches, which a change of the problem or the knowledge base makes outdated.
    pub(super) fn forget(&mut self) {
        self.current.take();
        self.instantaneous.take();
    }

    /// Returns the domain. A plain domain (without a type of designs) is returned in its explicit form, with design
    /// parameters, for the durations in the current situation. A domain in PLANTA's form is returned with the
    /// declarations of the knowledge base.
    pub fn domain(&self) -> &Domain {
        let Some(adaptation) = &self.adaptation else { return &self.domain };
        let instantaneous = || {
            // The problem is filled only if values decide on a duration.
            let depends_on_values = adaptation.may_be_instantaneous(&self.domain);
            depends_on_values.then(|| adaptation.with_starts(&self.domain, &self.current()))?.map(Arc::new)
        };
        self.instantaneous.get_or_init(instantaneous).as_deref().unwrap_or(&self.domain)
    }

    /// Parses an objective: an expression as in a PDDL metric, or the name of a function without
    /// parameters.
    ///
    /// # Errors
    /// All syntax and type errors of the expression.
    pub fn objective(&self, problem: &Problem, text: &str) -> Result<ParsedObjective, Errors> {
        let text = text.trim();
        let is_word = !text.starts_with('(') && !text.eq_ignore_ascii_case("total-time");
        let text = if is_word && !text.is_empty() { format!("({text})") } else { text.to_owned() };
        let source = Source::new("objective", text);
        match pddl::read_objective(Direction::Minimize, &source, &self.domain, problem) {
            Ok(metric) => Ok(ParsedObjective { metric, source }),
            Err(diagnostics) => {
                let diagnostics = self.about_sums(diagnostics.into_iter().collect());
                Err(Message::from_pddl(&diagnostics, &[&source]).into())
            }
        }
    }
}

/// Renames individuals according to `[bindings.names]`, and compares the names in the PDDL files with those in the
/// knowledge base. Returns the designs whose availability is stated by the problem, and the warning about designs that
/// the problem never names.
fn joined_names(
    (domain, problem): ((&Domain, &Source), (&Problem, &Source)),
    knowledge: &mut Knowledge,
    bindings: &Bindings,
    warnings: &mut Vec<Message>,
) -> Result<(BTreeSet<Name>, NeverNamed), Errors> {
    let (called, more) = names::resolve(domain.0, problem.0, knowledge, bindings)?;
    warnings.extend(more);
    // The comparison is by name, so the individuals must be renamed before it.
    knowledge.call(called);
    let Meeting { own: problem_designs, errors, warnings: more, never_named } =
        names::meet(domain, problem, knowledge, bindings);
    if !errors.is_empty() {
        return Err(errors.into_iter().chain(more).collect());
    }
    warnings.extend(more);
    Ok((problem_designs, never_named))
}

/// Separates the diagnostics about contributions of settings and of the knowledge base, which have no source location,
/// so that messages about them do not point into a file. Returns their codes and texts, and all other diagnostics.
fn by_origin(diagnostics: Vec<Diagnostic>) -> (Vec<(&'static str, String)>, Vec<Diagnostic>) {
    let (contributed, located): (Vec<_>, Vec<_>) =
        diagnostics.into_iter().partition(|diagnostic| diagnostic.span == Span::default());
    let text = |diagnostic: Diagnostic| {
        (diagnostic.code, format!("{} (from a setting or from the knowledge base)", diagnostic.message))
    };
    (contributed.into_iter().map(text).collect(), located)
}

/// Returns errors for the values of settings and of the knowledge base that PDDL files, for example those of a
/// certificate, cannot contain, because they have too many digits.
fn unreadable_values(problem: &Problem) -> Vec<Message> {
    let unreadable = problem.init.iter().filter_map(|element| match element {
        InitialElement::Value(atom, value, span) if *span == Span::default() => {
            (!pddl::is_readable(value)).then_some(atom)
        }
        _ => None,
    });
    let error = |atom: &Atom| {
        let words = std::iter::once(&atom.predicate.name).chain(atom.arguments.iter().map(Term::name));
        let words: Vec<&str> = words.map(Name::as_str).collect();
        let text = format!(
            "the value of `({})` has more than 400 digits (from a setting or from the knowledge base)",
            words.join(" ")
        );
        Message::error("P105", text).with_help("write fewer digits")
    };
    unreadable.map(error).collect()
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
