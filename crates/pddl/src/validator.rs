//! The front door: the text of a plan to a verdict.

use num_rational::BigRational;

use crate::ast::{Domain, Problem};
use crate::diagnostic::Errors;
use crate::source::Source;
use crate::validate::{Options, PlanText, Verdict, validate};

/// Executes plans for a domain and a problem that have passed [`check`](crate::check()), as those that [`read`](crate::read()) returns
/// have.
///
/// ```
/// use metaplan_pddl::{Source, Validator, read};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = Source::new("d.pddl", "(define (domain d) (:predicates (open))
///   (:action unlock :parameters () :effect (open)))");
/// let problem = Source::new("p.pddl", "(define (problem p) (:domain d) (:init) (:goal (open)))");
/// let (domain, problem, _warnings) = read(&domain, &problem)?;
///
/// let verdict = Validator::new(&domain, &problem).validate(&Source::new("plan", "(unlock)"))?;
/// assert!(verdict.valid);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Validator<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    options: Options,
}

impl<'a> Validator<'a> {
    /// For plans whose actions are executed one after another, with exact durations.
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        Self { domain, problem, options: Options::default() }
    }

    /// How plans are to be read.
    #[must_use]
    pub fn options(self, options: Options) -> Self {
        Self { options, ..self }
    }

    /// Actions may overlap, by the rules of PDDL 2.1; those that interfere have to lie `separation` apart, in the domain's time unit.
    #[must_use]
    pub fn concurrent(self, separation: BigRational) -> Self {
        self.options(Options { concurrent: true, tolerance: separation })
    }

    /// Executes a plan. A plan that is not valid is not an error: see [`Verdict::violation`].
    ///
    /// # Errors
    /// All lines that are not steps of a plan.
    pub fn validate(&self, plan: &Source) -> Result<Verdict, Errors> {
        Ok(validate(self.domain, self.problem, &PlanText::parse(plan)?, &self.options))
    }
}
