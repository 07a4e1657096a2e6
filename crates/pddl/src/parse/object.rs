//! Compiles away object fluents (functions with objects as values, PDDL 3.1) during parsing.
//!
//! `(place-of ?x - tool) - place` becomes a predicate with one more argument: the value. The predicate holds
//! for at most one value.
//! - A condition `(= (place-of ?x) ?y)` becomes an atom. Another object-fluent term in a condition becomes a
//!   variable that `exists` binds.
//! - An object-fluent term in an effect becomes a variable that `forall` binds; `when` restricts the effect to the
//!   value of the term.
//! - An assignment adds the atom with the new value and deletes the atoms with all values. Additions override
//!   deletions.
//! - Conditions that an effect imposes on the state, such as the existence of a value, become conditions of
//!   its action.

use crate::ast::{
    Atom, Condition, ConditionTime, Declaration, Domain, Effect, EffectTime, Identifier, InitialElement,
    Name, Span, Term, TypeExpression, TypedName,
};
use crate::number::{Literal, literal};
use crate::sexp::Item;

use super::fluents::{Assigned, Mark, Value};
use super::{Parser, at_start};

const UNDEFINED: &str = "undefined";

impl Parser<'_> {
    pub(super) fn object_fluent(
        &mut self,
        mut declaration: Declaration,
        r#type: TypeExpression,
        domain: &mut Domain,
    ) {
        let Identifier { name, span } = declaration.identifier.clone();
        if let Some(earlier) = self.objects.functions.get(&name) {
            let (source, place) = (self.sink.source(), earlier.identifier.span);
            self.sink.error("P127", span, format!("the function `{name}` is declared twice")).related(
                source,
                place,
                "the first declaration is here",
            );
            return;
        }
        let identifier = self.new_variable(span);
        declaration.parameters.push(TypedName { identifier, r#type });
        self.objects.functions.insert(name.clone(), declaration.clone());
        domain.object_fluents.push(name);
        domain.predicates.push(declaration);
    }

    pub(super) fn object_fluents_clash(&mut self, domain: &Domain) {
        for name in &domain.object_fluents {
            let namesakes = domain.predicates.iter().filter(|candidate| candidate.identifier.name == *name);
            let predicate = namesakes.map(|candidate| &candidate.identifier).find(|candidate| {
                self.objects
                    .functions
                    .get(name)
                    .is_some_and(|declaration| declaration.identifier.span != candidate.span)
            });
            let function = domain
                .functions
                .iter()
                .map(|candidate| &candidate.identifier)
                .find(|candidate| candidate.name == *name);
            let derived = domain
                .derived
                .iter()
                .map(|candidate| &candidate.head.identifier)
                .find(|candidate| candidate.name == *name);
            for (duplicate, kind) in
                [(predicate, "predicate"), (function, "function"), (derived, "predicate")]
            {
                let Some(duplicate) = duplicate else { continue };
                let message = format!("`{name}` is a function with an object as its value, and this {kind}");
                self.sink
                    .error("P127", duplicate.span, message)
                    .help("it becomes a predicate of its name; give one of them another name");
                self.declarations_intact = false;
            }
        }
    }

    /// Returns a variable whose name no variable of the text has.
    #[expect(clippy::arithmetic_side_effects, reason = "a file has fewer terms than bytes")]
    pub(super) fn new_variable(&mut self, span: Span) -> Identifier {
        if self.objects.prefix.is_none() {
            let text = self.sink.source().text().to_ascii_lowercase();
            let mut prefix = "value".to_owned();
            // If no variable of the file begins with the prefix, all names with this prefix are unused.
            while text.contains(&format!("?{prefix}")) {
                prefix.push('-');
            }
            self.objects.prefix = Some(prefix);
        }
        self.objects.count += 1;
        let name = format!("{}{}", self.objects.prefix.as_deref().unwrap_or_default(), self.objects.count);
        self.identifier(&name, span)
    }

    fn value_variable(&mut self, function: &Name, span: Span) -> TypedName {
        let declaration = self.objects.functions.get(function);
        let mut r#type = declaration
            .and_then(|declaration| declaration.parameters.last())
            .map_or_else(TypeExpression::default, |parameter| parameter.r#type.clone());
        // An undeclared value type is reported at the declaration of the function; here it restricts nothing.
        r#type.alternatives.retain(|alternative| self.objects.types.contains(&alternative.name));
        r#type.alternatives.iter_mut().for_each(|alternative| alternative.span = span);
        TypedName { identifier: self.new_variable(span), r#type }
    }

    pub(super) fn is_object_fluent(&self, item: Item<'_>) -> bool {
        item.head().is_some_and(|head| self.objects.contains(&Name::new(head)))
    }

    pub(super) fn misplaced_object_fluent<T>(&mut self, item: Item<'_>, name: &Name) -> Option<T> {
        self.sink
            .error("P106", at_start(item), format!("`{name}` is a function with an object as its value"))
            .help(format!(
                "a condition compares it: `(= ({name} …) ?x)`; an effect sets it: `(assign ({name} …) ?x)`"
            ));
        None
    }

    /// Replaces an object-fluent term by a new variable for its value and records the atom that binds the variable.
    /// Reports an error for any other item, and if the context does not allow object fluents.
    pub(super) fn value_of(&mut self, item: Item<'_>) -> Option<Term> {
        if !self.is_object_fluent(item) {
            self.expected(item, "a variable or an object").help(
                "a function stands here only where objects are its values: `(:functions (place-of ?x - tool) - place)`",
            );
            return None;
        }
        // In these contexts there is no condition to which a quantifier could be added.
        if !self.objects.is_open {
            self.refuse(item, "object fluents in durations, metrics and within initial values").help(
                "let a parameter of the action have the value: `(= (place-of ?x) ?p)` in its condition",
            );
            return None;
        }
        let (function, mut arguments) = self.object_term(item)?;
        let variable = self.value_variable(&function.name, item.span());
        let term = Term::Variable(variable.identifier.clone());
        arguments.push(term.clone());
        let atom = Atom { predicate: function, arguments, span: item.span() };
        self.objects.values.push(Value { variable, atom });
        Some(term)
    }

    fn object_term(&mut self, item: Item<'_>) -> Option<(Identifier, Vec<Term>)> {
        let function = self.name_item(item.items().next()?, "a function")?;
        let message_count = self.sink.len();
        let arguments: Vec<_> = item.rest().filter_map(|item| self.term(item)).collect();
        if self.sink.len() != message_count {
            return None;
        }
        let declaration = self.objects.functions.get(&function.name)?;
        let (value, parameters) = declaration.parameters.split_last()?;
        if parameters.len() != arguments.len() {
            let (expected, actual) = (parameters.len(), arguments.len());
            let identifier = declaration.identifier.clone();
            let parameters = parameters.to_vec();
            let form = crate::print::signature(&Declaration { identifier, parameters });
            let form = format!("{form} - {}", crate::print::type_text(&value.r#type));
            let plural = if expected == 1 { "" } else { "s" };
            let message =
                format!("the function `{}` takes {expected} argument{plural}, found {actual}", function.name);
            self.sink.error("P125", item.span(), message).help(format!("it is declared as `{form}`"));
            return None;
        }
        Some((function, arguments))
    }

    fn object(&mut self, item: Item<'_>) -> Option<Term> {
        let is_number =
            |symbol: &str| literal(symbol) != Literal::Name || symbol.eq_ignore_ascii_case("?duration");
        if item.symbol().is_some_and(is_number) || (item.is_list() && !self.is_object_fluent(item)) {
            self.expected(item, "an object").help("the function on the other side has objects as values");
            return None;
        }
        self.term(item)
    }

    /// Runs `read`, which may encounter object-fluent terms. Returns its result and the variables and atoms
    /// for the values of these terms.
    fn with_terms<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<(T, Vec<Value>)> {
        let was_open = std::mem::replace(&mut self.objects.is_open, true);
        let outer = std::mem::take(&mut self.objects.values);
        let result = read(self);
        let values = std::mem::replace(&mut self.objects.values, outer);
        self.objects.is_open = was_open;
        Some((result?, values))
    }

    /// Parses an atom or a comparison and binds the values of its object-fluent terms by `exists`. An atom about a
    /// missing value is therefore false.
    pub(super) fn with_values(
        &mut self,
        read: impl FnOnce(&mut Self) -> Option<Condition>,
    ) -> Option<Condition> {
        let (condition, values) = self.with_terms(read)?;
        if values.is_empty() {
            return Some(condition);
        }
        let (variables, mut parts) = variables_and_atoms(values);
        parts.push(condition);
        Some(Condition::Exists(variables, Box::new(Condition::And(parts))))
    }

    /// Parses `(= (place-of ?x) ?y)`, in either order. `?y` may also be an object-fluent term or `undefined`.
    pub(super) fn equal_objects(&mut self, left: Item<'_>, right: Item<'_>) -> Option<Condition> {
        let (term, value) = if self.is_object_fluent(left) { (left, right) } else { (right, left) };
        if is_undefined(value) {
            let (_, values) = self.with_terms(|parser| parser.value_of(term))?;
            return Some(Condition::Not(Box::new(has_value(values))));
        }
        let (predicate, mut arguments) = self.object_term(term)?;
        arguments.push(self.object(value)?);
        Some(Condition::Atom(Atom { predicate, arguments, span: term.span() }))
    }

    /// Parses `(assign (place-of ?x) ?y)` and records the assignment in
    /// [`Objects::assigned`](super::fluents::Objects::assigned).
    pub(super) fn object_assignment(&mut self, target: Item<'_>, value: Item<'_>) -> Option<Effect> {
        let (function, arguments) = self.object_term(target)?;
        let value = if is_undefined(value) { None } else { Some(self.object(value)?) };
        let atom = |value: Term| {
            let arguments = arguments.iter().cloned().chain([value]).collect();
            Atom { predicate: function.clone(), arguments, span: target.span() }
        };
        let previous = self.value_variable(&function.name, target.span());
        let delete = Effect::Delete(atom(Term::Variable(previous.identifier.clone())));
        // The new value may be among the deleted ones, because additions override deletions.
        let deletes = Effect::ForAll(vec![previous], Box::new(delete));
        let effect = match &value {
            Some(value) => Effect::And(vec![Effect::Add(atom(value.clone())), deletes]),
            None => deletes,
        };
        let (time, variables) = (self.objects.time(), Vec::new());
        let (values, conditions) = (Vec::new(), Vec::new());
        self.objects.assigned.push(Assigned {
            time,
            function,
            arguments,
            value,
            variables,
            values,
            conditions,
        });
        Some(effect)
    }

    /// Parses an effect and binds the values of its object-fluent terms by `forall` and `when`. The existence
    /// of the values becomes a condition of the action.
    pub(super) fn for_values(&mut self, read: impl FnOnce(&mut Self) -> Option<Effect>) -> Option<Effect> {
        let mark = self.mark_effects();
        let (effect, values) = self.with_terms(read)?;
        if values.is_empty() {
            return Some(effect);
        }
        let (variables, parts) = variables_and_atoms(values);
        let values_hold = conjunction(parts);
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.values.extend(variables.iter().cloned());
            assigned.conditions.push(values_hold.clone());
        }
        let need = Condition::Exists(variables.clone(), Box::new(values_hold.clone()));
        // Without this condition, an effect without a value would silently have no instance.
        self.objects.needs.push((self.objects.time(), need));
        Some(Effect::ForAll(variables, Box::new(Effect::When(values_hold, Box::new(effect)))))
    }

    pub(super) fn begin_effects(&mut self) {
        self.objects.time = None;
        self.objects.needs.clear();
        self.objects.assigned.clear();
    }

    pub(super) fn mark_effects(&self) -> Mark {
        Mark { needs: self.objects.needs.len(), assigned: self.objects.assigned.len() }
    }

    /// Records that a `forall` over `variables` encloses all effects parsed since `mark`. Their needs (conditions on
    /// the state) are quantified over `variables`, and their assignments get these variables. The caller wraps the
    /// effects themselves.
    pub(super) fn effects_below(&mut self, mark: Mark, variables: &[TypedName]) {
        for (_, need) in &mut self.objects.needs[mark.needs..] {
            let inner = std::mem::replace(need, Condition::And(Vec::new()));
            *need = Condition::ForAll(variables.to_vec(), Box::new(inner));
        }
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.variables.extend(variables.iter().cloned());
        }
    }

    /// Records that a `when` encloses all effects parsed since `mark`. Their needs (conditions on the state) then
    /// depend on `condition`, and so do their assignments. The caller wraps the effects themselves.
    pub(super) fn effects_when(&mut self, mark: Mark, condition: &Condition) {
        for (_, need) in &mut self.objects.needs[mark.needs..] {
            let inner = std::mem::replace(need, Condition::And(Vec::new()));
            *need = Condition::Imply(Box::new(condition.clone()), Box::new(inner));
        }
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.conditions.push(condition.clone());
        }
    }

    /// Returns the conditions that the effects of an action impose: the values that they read exist, and no
    /// object fluent receives two values.
    pub(super) fn needs_of_effects(&mut self) -> Vec<(ConditionTime, Condition)> {
        let mut needs = std::mem::take(&mut self.objects.needs);
        let assigned = std::mem::take(&mut self.objects.assigned);
        needs.extend(self.uniqueness_conditions(&assigned));
        let at = |time| match time {
            EffectTime::AtStart => ConditionTime::AtStart,
            EffectTime::AtEnd => ConditionTime::AtEnd,
        };
        needs.into_iter().map(|(time, need)| (at(time), need)).collect()
    }

    /// Parses `(= (place-of tool) here)` in the initial state. Returns `None` for the value `undefined`, and
    /// after a reported error.
    pub(super) fn initial_object(&mut self, left: Item<'_>, right: Item<'_>) -> Option<InitialElement> {
        let (term, value_item) = if self.is_object_fluent(left) { (left, right) } else { (right, left) };
        let (predicate, mut arguments) = self.object_term(term)?;
        let value = if is_undefined(value_item) { None } else { Some(self.object(value_item)?) };
        let name = |term: &Term| term.name().clone();
        let key = (predicate.name.clone(), arguments.iter().map(name).collect());
        let (value_name, span) = (
            value.as_ref().map(name),
            Span {
                start: term.span().start.min(value_item.span().start),
                end: term.span().end.max(value_item.span().end),
            },
        );
        if let Some((earlier, place)) = self.objects.initial.insert(key, (value_name.clone(), span))
            && earlier != value_name
        {
            let source = self.sink.source();
            self.sink.error("P127", span, "this function has another value already").related(
                source,
                place,
                "it stands here",
            );
            return None;
        }
        arguments.push(value?);
        Some(InitialElement::Fact(Atom { predicate, arguments, span }))
    }
}

fn is_undefined(item: Item<'_>) -> bool {
    item.symbol().is_some_and(|symbol| symbol.eq_ignore_ascii_case(UNDEFINED))
}

fn variables_and_atoms(values: Vec<Value>) -> (Vec<TypedName>, Vec<Condition>) {
    values.into_iter().map(|value| (value.variable, Condition::Atom(value.atom))).unzip()
}

fn has_value(values: Vec<Value>) -> Condition {
    let (variables, parts) = variables_and_atoms(values);
    Condition::Exists(variables, Box::new(conjunction(parts)))
}

fn conjunction(mut parts: Vec<Condition>) -> Condition {
    if parts.len() == 1 { parts.swap_remove(0) } else { Condition::And(parts) }
}

pub(super) fn with_needs(condition: Condition, needs: Vec<Condition>) -> Condition {
    if needs.is_empty() {
        return condition;
    }
    let mut parts = match condition {
        Condition::And(parts) => parts,
        condition => vec![condition],
    };
    parts.extend(needs);
    Condition::And(parts)
}
