//! Checks actions, effects and derived predicates.

use rustc_hash::FxHashMap;

use crate::ast::{Action, ActionBody, Atom, Domain, Effect, Identifier, Name};
use crate::strata::{NegativeCycle, Strata};

use super::condition::Kind;
use super::{Checker, Scope};

impl<'a> Checker<'a> {
    pub(super) fn derived(&mut self, domain: &'a Domain) {
        for axiom in &domain.derived {
            let Identifier { name, span } = &axiom.head.identifier;
            self.parameters(&axiom.head.parameters);
            let mut scope: Scope<'a> = axiom.head.parameters.iter().collect();
            self.axiom_head(axiom);
            self.condition(&axiom.condition, &mut scope);
            if self.symbols.functions.contains_key(name) && !self.symbols.predicates.contains_key(name) {
                self.sink.error("P129", *span, format!("the function `{name}` cannot be derived"));
            }
        }
        if let Err(NegativeCycle(name)) = Strata::of(domain) {
            let axiom = domain.derived.iter().find(|axiom| axiom.head.identifier.name == *name);
            let span = axiom.map_or(domain.name.span, |axiom| axiom.head.identifier.span);
            let message = format!("the derived predicate `{name}` depends on its own negation");
            self.sink.error("P130", span, message).help("such axioms have no meaning in PDDL");
        }
    }

    fn axiom_head(&mut self, axiom: &'a crate::ast::Derived) {
        let Identifier { name, span } = &axiom.head.identifier;
        let symbols = self.symbols;
        let Some(declaration) = symbols.predicates.get(name) else {
            let predicates = symbols.predicates.keys().copied();
            self.undeclared("P121", *span, "predicate", name, predicates);
            return;
        };
        let (expected, actual) = (declaration.parameters.len(), axiom.head.parameters.len());
        let source = self.sink.source();
        if expected != actual {
            self.sink
                .error(
                    "P125",
                    *span,
                    format!(
                        "the predicate `{name}` is declared with {expected} arguments, here it has {actual}"
                    ),
                )
                .related(source, declaration.identifier.span, "it is declared here");
            return;
        }
        for (parameter, declared) in axiom.head.parameters.iter().zip(&declaration.parameters) {
            if !symbols.types.overlap(&parameter.r#type, &declared.r#type) {
                let message = format!(
                    "the type of `?{}` contradicts the declaration of `{name}`",
                    parameter.identifier.name
                );
                self.sink.error("P126", parameter.identifier.span, message).related(
                    source,
                    declared.identifier.span,
                    "it is declared here",
                );
            }
        }
    }

    pub(super) fn actions(&mut self, domain: &'a Domain) {
        let mut by_name: FxHashMap<&Name, &Identifier> = FxHashMap::default();
        for action in &domain.actions {
            self.action(action);
            let Some(earlier) = by_name.insert(&action.identifier.name, &action.identifier) else { continue };
            let source = self.sink.source();
            self.sink
                .warning(
                    "P127",
                    action.identifier.span,
                    format!("two actions are named `{}`", action.identifier.name),
                )
                .related(source, earlier.span, "the other one is here")
                .help("in plans they are told apart by their arguments; other planners reject the domain");
        }
    }

    fn action(&mut self, action: &'a Action) {
        self.parameters(&action.parameters);
        let mut scope: Scope<'a> = action.parameters.iter().collect();
        match &action.body {
            ActionBody::Instantaneous { precondition, effect } => {
                self.condition(precondition, &mut scope);
                self.preferences(&action.preferences, &mut scope);
                self.effect(effect, &mut scope);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                self.in_durative_action = true;
                for constraint in duration {
                    self.expression(&constraint.expression, &scope);
                }
                for (_, condition) in conditions {
                    self.condition(condition, &mut scope);
                }
                self.preferences(&action.preferences, &mut scope);
                for (_, effect) in effects {
                    self.effect(effect, &mut scope);
                }
                self.in_durative_action = false;
            }
        }
    }

    fn effect(&mut self, effect: &'a Effect, scope: &mut Scope<'a>) {
        match effect {
            Effect::And(parts) => {
                for part in parts {
                    self.effect(part, scope);
                }
            }
            Effect::Add(atom) | Effect::Delete(atom) => {
                self.atom(atom, Kind::Predicate, scope);
                self.check_basic(atom);
                if matches!(effect, Effect::Add(_))
                    && self.symbols.object_fluents.contains(&atom.predicate.name)
                {
                    self.assigned_value(atom, scope);
                }
            }
            Effect::ForAll(variables, body) => {
                self.quantified(variables, scope, |checker, scope| checker.effect(body, scope));
            }
            Effect::When(condition, body) => {
                self.condition(condition, scope);
                self.effect(body, scope);
            }
            Effect::Assign(_, target, value, _) => {
                self.atom(target, Kind::Function, scope);
                self.expression(value, scope);
            }
        }
    }

    /// Checks that an atom to be set is not derived. A derived predicate follows from its axioms,
    /// so neither effects nor the initial state can set it.
    pub(super) fn check_basic(&mut self, atom: &'a Atom) {
        let Identifier { name, span } = &atom.predicate;
        if self.symbols.derived.contains(name) {
            self.sink
                .error("P129", *span, format!("`{name}` is derived and cannot be set"))
                .help("set the predicates that it follows from");
        }
    }
}
