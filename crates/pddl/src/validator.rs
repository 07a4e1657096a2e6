//! Validation of plan texts.

use num_rational::BigRational;

use crate::ast::{Domain, Problem};
use crate::diagnostic::Errors;
use crate::source::Source;
use crate::validate::{Options, PlanText, Verdict, validate};

/// Validator for plans of one domain and problem. The domain and the problem must have passed
/// [`check`](crate::check()); [`read`](crate::read()) returns only checked domains
/// and problems.
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
    /// Creates a validator for sequential plans, with the default tolerance of [`Options`].
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        Self { domain, problem, options: Options::default() }
    }

    /// Sets the execution semantics and the tolerance.
    #[must_use]
    pub fn options(self, options: Options) -> Self {
        Self { options, ..self }
    }

    /// Allows actions to overlap, by the rules of PDDL 2.1, and resets the other options. Interfering happenings
    /// must be at least `separation` apart, in the domain's time unit.
    #[must_use]
    pub fn concurrent(self, separation: BigRational) -> Self {
        self.options(Options::default().with_concurrent(true).with_tolerance(separation))
    }

    /// Parses and executes a plan. An invalid plan is not an error: see [`Verdict::violation`].
    ///
    /// # Errors
    /// Returns the errors of [`PlanText::parse`].
    pub fn validate(&self, plan: &Source) -> Result<Verdict, Errors> {
        Ok(validate(self.domain, self.problem, &PlanText::parse(plan)?, &self.options))
    }
}
