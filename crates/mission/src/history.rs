//! Conditions on the past of a mission, which a plan for its remainder cannot take into account.

use pddl::ast::{Constraint, InitialElement, Span, Trajectory};
use pddl::{Diagnostic, Severity, Source};

use crate::joined::Mission;
use crate::message::Message;

impl Mission {
    /// Returns an error (M310) for each timed initial literal and for each constraint whose satisfaction by the rest
    /// of a plan can depend on earlier states. The adaptation loop plans from the present state and does not store
    /// earlier states.
    pub fn depends_on_past(&self) -> Vec<Message> {
        let error = |source: &Source, span: Span, text: &str| {
            let diagnostic = Diagnostic::new(source, span, Severity::Error, "M310", text);
            Message::from_pddl(&[diagnostic], &[source])
        };
        let constraints = |source, constraints: &[Constraint]| -> Vec<Message> {
            let constraints = constraints.iter().filter(|constraint| constrains_past(constraint));
            let text =
                "the adaptation loop cannot satisfy this constraint, because it depends on earlier states";
            constraints.flat_map(|constraint| error(source, constraint.span, text)).collect()
        };
        let mut errors = constraints(&self.domain_source, &self.domain.constraints);
        errors.extend(constraints(&self.problem_source, &self.problem.constraints));
        for element in &self.problem.init {
            if let InitialElement::Timed(.., span) = element {
                let text = "the adaptation loop does not support timed initial literals; report the change as a fact when it happens";
                errors.extend(error(&self.problem_source, *span, text));
            }
        }
        errors
    }
}

/// Returns `true` if the satisfaction of the constraint by the rest of a plan can depend on earlier states. It cannot if
/// the constraint consists of `at end` and, unless it is a preference, of `always`. A preference with `always` may be
/// violated already.
fn constrains_past(constraint: &Constraint) -> bool {
    fn is_allowed(trajectory: &Trajectory, is_mandatory: bool) -> bool {
        match trajectory {
            Trajectory::And(parts) => parts.iter().all(|part| is_allowed(part, is_mandatory)),
            Trajectory::ForAll(_, part) => is_allowed(part, is_mandatory),
            Trajectory::AtEnd(_) => true,
            Trajectory::Always(_) => is_mandatory,
            _ => false,
        }
    }
    !is_allowed(&constraint.trajectory, constraint.preference.is_none())
}
