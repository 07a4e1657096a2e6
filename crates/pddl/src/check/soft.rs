//! Checks preferences and trajectory constraints.

use crate::ast::{Atom, Constraint, Preference, Term, Trajectory};

use super::{Checker, Scope};

const IS_VIOLATED: &str = "is-violated";

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
            Trajectory::AtEnd(body)
            | Trajectory::Always(body)
            | Trajectory::Sometime(body)
            | Trajectory::AtMostOnce(body)
            | Trajectory::Within(_, body)
            | Trajectory::HoldDuring(_, _, body)
            | Trajectory::HoldAfter(_, body) => self.condition(body, scope),
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

    pub(super) fn violation(&mut self, atom: &'a Atom) {
        let [Term::Constant(name)] = &atom.arguments[..] else {
            self.sink
                .error("P125", atom.span, "`is-violated` takes the name of a preference")
                .help("write `(is-violated name)`");
            return;
        };
        let symbols = self.symbols;
        if !symbols.preferences.contains(&name.name) {
            let preferences = symbols.preferences.iter().copied();
            self.undeclared("P118", name.span, "preference", &name.name, preferences);
        }
    }
}
