//! Functions with objects as values (PDDL 3.1), compiled away while they are read.
//!
//! `(place-of ?x - tool) - place` becomes a predicate with one more argument, which holds for the value and for no other. A term in
//! a condition becomes a variable below `exists`, one in an effect a variable below `forall` and `when`. An assignment adds its value
//! and deletes all, where additions count over deletions. What an effect asks of the state becomes a condition of its action.

use crate::ast::{
    Atom, Condition, ConditionTime, Declaration, Domain, Effect, EffectTime, Identifier, InitialElement,
    Name, Span, Term, TypeExpression, TypedName,
};
use crate::number::{Literal, literal};
use crate::sexp::Item;

use super::fluents::{Assigned, Mark, Value};
use super::{Parser, at_start};

/// What stands for no value.
const UNDEFINED: &str = "undefined";

impl Parser<'_> {
    /// Declares a function with objects as values.
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

    /// Reports names that stand for such a function and for something else.
    pub(super) fn object_fluents_clash(&mut self, domain: &Domain) {
        for name in &domain.object_fluents {
            let others = domain.predicates.iter().filter(|own| own.identifier.name == *name);
            let predicate = others.map(|own| &own.identifier).find(|own| {
                self.objects.functions.get(name).is_some_and(|known| known.identifier.span != own.span)
            });
            let function = domain.functions.iter().map(|own| &own.identifier).find(|own| own.name == *name);
            let derived = domain.derived.iter().map(|own| &own.head.identifier).find(|own| own.name == *name);
            for (other, what) in [(predicate, "predicate"), (function, "function"), (derived, "predicate")] {
                let Some(other) = other else { continue };
                let message = format!("`{name}` is a function with an object as its value, and this {what}");
                self.sink
                    .error("P127", other.span, message)
                    .help("it becomes a predicate of its name; give one of them another name");
                self.declarations_intact = false;
            }
        }
    }

    /// A variable that the text does not have.
    #[expect(clippy::arithmetic_side_effects, reason = "a file has fewer terms than bytes")]
    pub(super) fn new_variable(&mut self, span: Span) -> Identifier {
        if self.objects.prefix.is_none() {
            let text = self.sink.source().text().to_ascii_lowercase();
            let mut prefix = "value".to_owned();
            while text.contains(&format!("?{prefix}")) {
                prefix.push('-');
            }
            self.objects.prefix = Some(prefix);
        }
        self.objects.count += 1;
        let name = format!("{}{}", self.objects.prefix.as_deref().unwrap_or_default(), self.objects.count);
        self.identifier(&name, span)
    }

    /// A new variable for the values of a function.
    fn value_variable(&mut self, function: &Name, span: Span) -> TypedName {
        let declaration = self.objects.functions.get(function);
        let mut r#type = declaration
            .and_then(|own| own.parameters.last())
            .map_or_else(TypeExpression::default, |own| own.r#type.clone());
        // A type that is unknown was reported where it is declared, and restricts nothing.
        r#type.alternatives.retain(|one| self.objects.types.contains(&one.name));
        r#type.alternatives.iter_mut().for_each(|one| one.span = span);
        TypedName { identifier: self.new_variable(span), r#type }
    }

    /// Whether an item is a function with an object as its value, applied to terms.
    pub(super) fn is_object_fluent(&self, item: Item<'_>) -> bool {
        item.head().is_some_and(|head| self.objects.contains(&Name::new(head)))
    }

    /// Such a function where a predicate or a number is to stand.
    pub(super) fn misplaced_object_fluent<T>(&mut self, item: Item<'_>, name: &Name) -> Option<T> {
        self.sink
            .error("P106", at_start(item), format!("`{name}` is a function with an object as its value"))
            .help(format!(
                "a condition compares it: `(= ({name} …) ?x)`; an effect sets it: `(assign ({name} …) ?x)`"
            ));
        None
    }

    /// The variable that stands for the value of a term.
    pub(super) fn value_of(&mut self, item: Item<'_>) -> Option<Term> {
        if !self.is_object_fluent(item) {
            self.expected(item, "a variable or an object").help(
                "a function stands here only where objects are its values: `(:functions (place-of ?x - tool) - place)`",
            );
            return None;
        }
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

    /// The function of a term and its arguments.
    fn object_term(&mut self, item: Item<'_>) -> Option<(Identifier, Vec<Term>)> {
        let function = self.name_item(item.items().next()?, "a function")?;
        let before = self.sink.len();
        let arguments: Vec<_> = item.rest().filter_map(|item| self.term(item)).collect();
        if self.sink.len() != before {
            return None;
        }
        let declaration = self.objects.functions.get(&function.name)?;
        let (value, parameters) = declaration.parameters.split_last()?;
        if parameters.len() != arguments.len() {
            let (wanted, found) = (parameters.len(), arguments.len());
            let identifier = declaration.identifier.clone();
            let parameters = parameters.to_vec();
            let form = crate::print::signature(&Declaration { identifier, parameters });
            let form = format!("{form} - {}", crate::print::type_text(&value.r#type));
            let plural = if wanted == 1 { "" } else { "s" };
            let message =
                format!("the function `{}` takes {wanted} argument{plural}, found {found}", function.name);
            self.sink.error("P125", item.span(), message).help(format!("it is declared as `{form}`"));
            return None;
        }
        Some((function, arguments))
    }

    /// An object, or a term for one.
    fn object(&mut self, item: Item<'_>) -> Option<Term> {
        let is_number =
            |symbol: &str| literal(symbol) != Literal::Name || symbol.eq_ignore_ascii_case("?duration");
        if item.symbol().is_some_and(is_number) || (item.is_list() && !self.is_object_fluent(item)) {
            self.expected(item, "an object").help("the function on the other side has objects as values");
            return None;
        }
        self.term(item)
    }

    /// Reads something in which terms can stand, and gives the values that it asks for.
    fn with_terms<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<(T, Vec<Value>)> {
        let was_open = std::mem::replace(&mut self.objects.is_open, true);
        let outer = std::mem::take(&mut self.objects.values);
        let found = read(self);
        let values = std::mem::replace(&mut self.objects.values, outer);
        self.objects.is_open = was_open;
        Some((found?, values))
    }

    /// A condition of the values that it asks for. Where there is no value, it is false.
    pub(super) fn with_values(
        &mut self,
        read: impl FnOnce(&mut Self) -> Option<Condition>,
    ) -> Option<Condition> {
        let (condition, values) = self.with_terms(read)?;
        if values.is_empty() {
            return Some(condition);
        }
        let (variables, mut parts) = apart(values);
        parts.push(condition);
        Some(Condition::Exists(variables, Box::new(Condition::And(parts))))
    }

    /// `(= (place-of ?x) ?y)`, in either order, also with a term for `?y` or `undefined`.
    pub(super) fn equal_objects(&mut self, left: Item<'_>, right: Item<'_>) -> Option<Condition> {
        let (term, other) = if self.is_object_fluent(left) { (left, right) } else { (right, left) };
        if is_undefined(other) {
            let (_, values) = self.with_terms(|parser| parser.value_of(term))?;
            return Some(Condition::Not(Box::new(has_value(values))));
        }
        let (predicate, mut arguments) = self.object_term(term)?;
        arguments.push(self.object(other)?);
        Some(Condition::Atom(Atom { predicate, arguments, span: term.span() }))
    }

    /// `(assign (place-of ?x) ?y)`.
    pub(super) fn object_assignment(&mut self, target: Item<'_>, value: Item<'_>) -> Option<Effect> {
        let (function, arguments) = self.object_term(target)?;
        let value = if is_undefined(value) { None } else { Some(self.object(value)?) };
        let atom = |value: Term| {
            let arguments = arguments.iter().cloned().chain([value]).collect();
            Atom { predicate: function.clone(), arguments, span: target.span() }
        };
        let any = self.value_variable(&function.name, target.span());
        let delete = Effect::Delete(atom(Term::Variable(any.identifier.clone())));
        let deletes = Effect::ForAll(vec![any], Box::new(delete));
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

    /// An effect for the values that it asks for, which there must be.
    pub(super) fn for_values(&mut self, read: impl FnOnce(&mut Self) -> Option<Effect>) -> Option<Effect> {
        let mark = self.mark_effects();
        let (effect, values) = self.with_terms(read)?;
        if values.is_empty() {
            return Some(effect);
        }
        let (variables, parts) = apart(values);
        let all = conjunction(parts);
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.values.extend(variables.iter().cloned());
            assigned.conditions.push(all.clone());
        }
        let need = Condition::Exists(variables.clone(), Box::new(all.clone()));
        self.objects.needs.push((self.objects.time(), need));
        Some(Effect::ForAll(variables, Box::new(Effect::When(all, Box::new(effect)))))
    }

    /// Nothing is asked of the state before the effects of an action.
    pub(super) fn begin_effects(&mut self) {
        self.objects.time = None;
        self.objects.needs.clear();
        self.objects.assigned.clear();
    }

    pub(super) fn mark_effects(&self) -> Mark {
        Mark { needs: self.objects.needs.len(), assigned: self.objects.assigned.len() }
    }

    /// What effects behind a mark ask stands below these variables.
    pub(super) fn effects_below(&mut self, mark: Mark, variables: &[TypedName]) {
        for (_, need) in &mut self.objects.needs[mark.needs..] {
            let inner = std::mem::replace(need, Condition::And(Vec::new()));
            *need = Condition::ForAll(variables.to_vec(), Box::new(inner));
        }
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.variables.extend(variables.iter().cloned());
        }
    }

    /// What effects behind a mark ask is asked only under a condition.
    pub(super) fn effects_when(&mut self, mark: Mark, condition: &Condition) {
        for (_, need) in &mut self.objects.needs[mark.needs..] {
            let inner = std::mem::replace(need, Condition::And(Vec::new()));
            *need = Condition::Imply(Box::new(condition.clone()), Box::new(inner));
        }
        for assigned in &mut self.objects.assigned[mark.assigned..] {
            assigned.conditions.push(condition.clone());
        }
    }

    /// What the effects of an action ask of the state: values that they read, and no two values for one term.
    pub(super) fn needs_of_effects(&mut self) -> Vec<(ConditionTime, Condition)> {
        let mut needs = std::mem::take(&mut self.objects.needs);
        let assigned = std::mem::take(&mut self.objects.assigned);
        needs.extend(self.one_value_each(&assigned));
        let at = |time| match time {
            EffectTime::AtStart => ConditionTime::AtStart,
            EffectTime::AtEnd => ConditionTime::AtEnd,
        };
        needs.into_iter().map(|(time, need)| (at(time), need)).collect()
    }

    /// `(= (place-of tool) here)` in the initial state.
    pub(super) fn initial_object(&mut self, left: Item<'_>, right: Item<'_>) -> Option<InitialElement> {
        let (term, other) = if self.is_object_fluent(left) { (left, right) } else { (right, left) };
        let (predicate, mut arguments) = self.object_term(term)?;
        let value = if is_undefined(other) { None } else { Some(self.object(other)?) };
        let name = |term: &Term| match term {
            Term::Variable(identifier) | Term::Constant(identifier) => identifier.name.clone(),
        };
        let key = (predicate.name.clone(), arguments.iter().map(name).collect());
        let (known, span) = (
            value.as_ref().map(name),
            Span {
                start: term.span().start.min(other.span().start),
                end: term.span().end.max(other.span().end),
            },
        );
        if let Some((earlier, place)) = self.objects.initial.insert(key, (known.clone(), span))
            && earlier != known
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

/// The variables of values, and the atoms that give them.
fn apart(values: Vec<Value>) -> (Vec<TypedName>, Vec<Condition>) {
    values.into_iter().map(|value| (value.variable, Condition::Atom(value.atom))).unzip()
}

/// That terms have values.
fn has_value(values: Vec<Value>) -> Condition {
    let (variables, parts) = apart(values);
    Condition::Exists(variables, Box::new(conjunction(parts)))
}

fn conjunction(mut parts: Vec<Condition>) -> Condition {
    if parts.len() == 1 { parts.swap_remove(0) } else { Condition::And(parts) }
}

/// A condition together with what the effects of its action ask.
pub(super) fn with_needs(condition: Condition, needs: Vec<Condition>) -> Condition {
    if needs.is_empty() {
        return condition;
    }
    let mut parts = match condition {
        Condition::And(parts) => parts,
        other => vec![other],
    };
    parts.extend(needs);
    Condition::And(parts)
}
