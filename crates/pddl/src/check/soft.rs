//! Preferences and constraints on trajectories.

use crate::ast::{Atom, Constraint, Preference, Term, Trajectory};

use super::{Checker, Scope};

/// The name of the function that counts how often a preference is violated.
const IS_VIOLATED: &str = "is-violated";

/// Whether an atom is `(is-violated …)`.
pub(super) fn is_violation(atom: &Atom) -> bool {
    atom.predicate.name.as_str().eq_ignore_ascii_case(IS_VIOLATED)
}

impl<'a> Checker<'a> {
    pub(super) fn constraints(&mut self, constraints: &'a [Constraint]) {
        for constraint in constraints {
            let mut scope = Scope::new();
            self.quantified(&constraint.variables, &mut scope, |checker, scope| {
                checker.trajectory(&constraint.trajectory, scope);
            });
        }
    }

    fn trajectory(&mut self, trajectory: &'a Trajectory, scope: &mut Scope<'a>) {
        match trajectory {
            Trajectory::And(parts) => {
                for part in parts {
                    self.trajectory(part, scope);
                }
            }
            Trajectory::ForAll(variables, body) => {
                self.quantified(variables, scope, |checker, scope| checker.trajectory(body, scope));
            }
            Trajectory::AtEnd(what)
            | Trajectory::Always(what)
            | Trajectory::Sometime(what)
            | Trajectory::AtMostOnce(what)
            | Trajectory::Within(_, what)
            | Trajectory::HoldDuring(_, _, what)
            | Trajectory::HoldAfter(_, what) => self.condition(what, scope),
            Trajectory::SometimeAfter(first, second)
            | Trajectory::SometimeBefore(first, second)
            | Trajectory::AlwaysWithin(_, first, second) => {
                self.condition(first, scope);
                self.condition(second, scope);
            }
        }
    }

    pub(super) fn preferences(&mut self, preferences: &'a [Preference], scope: &mut Scope<'a>) {
        for preference in preferences {
            self.quantified(&preference.variables, scope, |checker, scope| {
                checker.condition(&preference.condition, scope);
            });
        }
    }

    /// `(is-violated NAME)` in a metric.
    pub(super) fn violation(&mut self, atom: &'a Atom) {
        let [Term::Constant(name)] = &atom.arguments[..] else {
            self.sink
                .error("P125", atom.span, "`is-violated` takes the name of a preference")
                .help("write `(is-violated name)`");
            return;
        };
        let symbols = self.symbols;
        if !symbols.preferences.contains(&name.name) {
            let known = symbols.preferences.iter().copied();
            self.undeclared("P118", name.span, "preference", &name.name, known);
        }
    }
}
