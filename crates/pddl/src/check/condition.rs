//! Checks conditions, expressions and atoms.

use crate::ast::{Atom, Condition, Declaration, Expression, Identifier, Term, TypeExpression, TypedName};

use crate::print::{signature, type_text};

use super::soft::is_violation;
use super::{Checker, Scope, did_you_mean};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Predicate,
    Function,
}

impl Kind {
    fn noun(self) -> &'static str {
        match self {
            Self::Predicate => "predicate",
            Self::Function => "function",
        }
    }
}

impl<'a> Checker<'a> {
    pub(super) fn condition(&mut self, condition: &'a Condition, scope: &mut Scope<'a>) {
        match condition {
            Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
                self.quantified(variables, scope, |checker, scope| checker.condition(body, scope));
            }
            Condition::Atom(atom) => self.atom(atom, Kind::Predicate, scope),
            Condition::Equal(left, right, _) => {
                self.term(left, scope);
                self.term(right, scope);
            }
            Condition::Compare(_, left, right, _) => {
                self.expression(left, scope);
                self.expression(right, scope);
            }
            other => other.parts().for_each(|part| self.condition(part, scope)),
        }
    }

    pub(super) fn quantified(
        &mut self,
        variables: &'a [TypedName],
        scope: &mut Scope<'a>,
        body: impl FnOnce(&mut Self, &mut Scope<'a>),
    ) {
        self.parameters(variables);
        let outer = scope.len();
        scope.extend(variables);
        body(self, scope);
        scope.truncate(outer);
    }

    pub(super) fn expression(&mut self, expression: &'a Expression, scope: &Scope<'a>) {
        match expression {
            Expression::Number(..) => {}
            Expression::Fluent(atom) if is_violation(atom) => {
                self.sink.error("P137", atom.span, "`is-violated` has a value in the metric only");
            }
            Expression::Fluent(atom) => self.atom(atom, Kind::Function, scope),
            Expression::Duration(span) => {
                if !self.in_durative_action {
                    self.sink.error("P137", *span, "`?duration` has a value in durative actions only");
                }
            }
            Expression::TotalTime(span) => {
                self.sink.error("P137", *span, "`total-time` has a value in the metric only");
            }
            Expression::Operation(_, operands, _) => {
                for operand in operands {
                    self.expression(operand, scope);
                }
            }
        }
    }

    pub(super) fn atom(&mut self, atom: &'a Atom, kind: Kind, scope: &Scope<'a>) {
        let Identifier { name, span } = &atom.predicate;
        let symbols = self.symbols;
        let declarations = match kind {
            Kind::Predicate => &symbols.predicates,
            Kind::Function => &symbols.functions,
        };
        if let Some(declaration) = declarations.get(name) {
            self.arguments(atom, declaration, kind, scope);
        } else {
            self.unknown_symbol(&atom.predicate, kind);
            for term in &atom.arguments {
                self.term(term, scope);
            }
        }
        if kind == Kind::Function
            && name.as_str().eq_ignore_ascii_case("total-cost")
            && !atom.arguments.is_empty()
        {
            self.sink.error("P125", *span, "`total-cost` takes no arguments");
        }
    }

    fn unknown_symbol(&mut self, identifier: &'a Identifier, kind: Kind) {
        let Identifier { name, span } = identifier;
        let symbols = self.symbols;
        let (declared, other_namespace, other_noun) = match kind {
            Kind::Predicate => (&symbols.predicates, &symbols.functions, "function"),
            Kind::Function => (&symbols.functions, &symbols.predicates, "predicate"),
        };
        if kind == Kind::Function && name.as_str().eq_ignore_ascii_case("total-cost") {
            self.sink
                .warning("P135", *span, "`total-cost` is used without being declared")
                .help("write `(:functions (total-cost) - number)` in the domain");
            return;
        }
        if name.as_str().to_ascii_lowercase().starts_with("inferred-") {
            self.undeclared_inferred.insert(name);
        }
        let (is_in_other_namespace, in_domain) = (other_namespace.contains_key(name), self.in_domain);
        let diagnostic = match kind {
            Kind::Predicate => self.undeclared("P121", *span, kind.noun(), name, declared.keys().copied()),
            Kind::Function => self.undeclared("P122", *span, kind.noun(), name, declared.keys().copied()),
        };
        if is_in_other_namespace {
            diagnostic.help(format!("`{name}` is a {other_noun}"));
        } else if !in_domain && diagnostic.help.is_none() {
            let section = if kind == Kind::Predicate { ":predicates" } else { ":functions" };
            diagnostic
                .help(format!("the domain has to declare it in `{section}`, or it has no meaning here"));
        }
    }

    fn arguments(&mut self, atom: &'a Atom, declaration: &'a Declaration, kind: Kind, scope: &Scope<'a>) {
        let (arity, count) = (declaration.parameters.len(), atom.arguments.len());
        if arity != count {
            let plural = if arity == 1 { "" } else { "s" };
            let name = &atom.predicate.name;
            let message =
                format!("the {} `{name}` takes {arity} argument{plural}, found {count}", kind.noun());
            let form = signature(declaration);
            self.sink.error("P125", atom.span, message).help(format!("it is declared as `{form}`"));
        }
        for (index, term) in atom.arguments.iter().enumerate() {
            let info = self.term(term, scope);
            let (Some(actual), Some(parameter)) = (info, declaration.parameters.get(index)) else { continue };
            // With a wrong number of arguments, arguments and parameters do not correspond.
            if arity == count && !self.argument_fits(&actual, &parameter.r#type) {
                self.argument_type(atom, index, &actual, parameter);
            }
        }
    }

    /// Checks that the value type of an object fluent covers the type of the variable that is assigned to it.
    /// A wider type is an error, because no further condition narrows it.
    pub(super) fn assigned_value(&mut self, atom: &'a Atom, scope: &Scope<'a>) {
        let symbols = self.symbols;
        let declaration = symbols.predicates.get(&atom.predicate.name);
        let (Some(value), Some(parameter)) =
            (atom.arguments.last(), declaration.and_then(|declaration| declaration.parameters.last()))
        else {
            return;
        };
        let Term::Variable(identifier) = value else { return };
        let Some(variable) = scope.iter().rev().find(|entry| entry.identifier.name == identifier.name) else {
            return;
        };
        let is_declared = |alternative: &Identifier| symbols.types.contains(&alternative.name);
        let (actual, expected) = (&variable.r#type, &parameter.r#type);
        let is_wider = |lower: &Identifier| {
            !expected.alternatives.iter().any(|upper| symbols.types.is_a(&lower.name, &upper.name))
        };
        if symbols.types.overlap(actual, expected)
            && expected.alternatives.iter().all(is_declared)
            && !expected.alternatives.is_empty()
            && (actual.alternatives.is_empty() || actual.alternatives.iter().any(is_wider))
        {
            let (name, expected, actual) = (&atom.predicate.name, describe(expected), describe(actual));
            let message = format!("the value of `{name}` is {expected}, but what is assigned is {actual}");
            self.sink.error("P126", identifier.span, message).help("give the variable the narrower type");
        }
    }

    fn argument_fits(&self, argument: &ArgumentType<'a>, expected: &TypeExpression) -> bool {
        // A variable may have a wider type than the parameter, because the atom restricts its values. So it
        // suffices that the types overlap. An object has exactly the types of its declarations.
        match argument {
            ArgumentType::Variable(r#type) => self.symbols.types.overlap(r#type, expected),
            ArgumentType::Object(types) => types.iter().any(|r#type| {
                self.symbols.types.fits(r#type, expected)
                    || r#type.alternatives.iter().any(|r#type| !self.symbols.types.contains(&r#type.name))
            }),
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    fn argument_type(
        &mut self,
        atom: &Atom,
        index: usize,
        argument: &ArgumentType<'_>,
        parameter: &TypedName,
    ) {
        let (span, shown) = match &atom.arguments[index] {
            Term::Variable(identifier) => (identifier.span, format!("?{}", identifier.name)),
            Term::Constant(identifier) => (identifier.span, identifier.name.to_string()),
        };
        // A mismatch is only a warning if the object has no type. Generated files often pass objects without a type to
        // typed parameters.
        let is_untyped = match argument {
            ArgumentType::Variable(_) => false,
            ArgumentType::Object(types) => types.iter().all(|r#type| is_object(r#type)),
        };
        let argument = match argument {
            ArgumentType::Variable(r#type) => describe(r#type),
            ArgumentType::Object(types) => types.first().map_or_else(String::new, |r#type| describe(r#type)),
        };
        let (name, parameter) = (&atom.predicate.name, describe(&parameter.r#type));
        let is_value = index + 1 == atom.arguments.len() && self.symbols.object_fluents.contains(name);
        let subject = if is_value { "the value".to_owned() } else { format!("argument {}", index + 1) };
        let message = format!("{subject} of `{name}` is {parameter}, but `{shown}` is {argument}");
        // With an untyped object as its value, an object fluent could get a second value: an assignment
        // deletes only the values of the declared type.
        if is_untyped && !is_value {
            self.sink.warning("P126", span, message).help("give it a type in `:objects` or `:constants`");
        } else {
            self.sink.error("P126", span, message);
        }
    }

    pub(super) fn term(&mut self, term: &'a Term, scope: &Scope<'a>) -> Option<ArgumentType<'a>> {
        match term {
            Term::Variable(Identifier { name, span }) => {
                if let Some(variable) = scope.iter().rev().find(|entry| entry.identifier.name == *name) {
                    return Some(ArgumentType::Variable(&variable.r#type));
                }
                let variables = scope.iter().map(|entry| &entry.identifier.name);
                let help = did_you_mean(name.as_str(), variables).map(|help| help.replacen('`', "`?", 1));
                self.sink.error("P124", *span, format!("unknown variable `?{name}`")).help = help;
                None
            }
            Term::Constant(identifier) => self.constant(identifier, scope),
        }
    }

    fn constant(&mut self, identifier: &'a Identifier, scope: &Scope<'a>) -> Option<ArgumentType<'a>> {
        let Identifier { name, span } = identifier;
        let symbols = self.symbols;
        if let Some(object) = symbols.objects.get(name) {
            if self.in_domain && !object.is_constant {
                self.sink
                    .warning("P138", *span, format!("the domain uses the object `{name}` of the problem"))
                    .help("declare it in `:constants`; other planners reject the domain");
            }
            return Some(ArgumentType::Object(&object.types));
        }
        let is_variable = scope.iter().any(|entry| entry.identifier.name == *name);
        let diagnostic = self.undeclared("P123", *span, "object", name, symbols.objects.keys().copied());
        if is_variable {
            diagnostic.help(format!("did you mean the variable `?{name}`?"));
        }
        None
    }
}

#[derive(Debug)]
pub(super) enum ArgumentType<'a> {
    Variable(&'a TypeExpression),
    Object(&'a [&'a TypeExpression]),
}

fn is_object(r#type: &TypeExpression) -> bool {
    r#type.alternatives.iter().all(|alternative| alternative.name.as_str().eq_ignore_ascii_case("object"))
}

fn describe(r#type: &TypeExpression) -> String {
    format!("of type `{}`", type_text(r#type))
}
