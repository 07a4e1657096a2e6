//! Regression of conditions on the state after a happening to conditions on the state before it (R.
//! Reiter: Knowledge in Action, 2001, chapter 4).

use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Atom, Condition, Effect, EffectTime, Expression, Name, Span,
    Term, TypedName,
};

use super::instances::{Binding, atom_instance, expression, instance};
use super::simplify::{all, any, equal, exists, falsity, identifier, is_false, not};

const MAX_CASES: usize = 64;

pub(super) struct Happening {
    changes: Vec<Change>,
}

struct Change {
    bound: Vec<TypedName>,
    conditions: Vec<Condition>,
    effect: Effect,
}

/// One case of a case distinction over numeric effects: the condition of the case, and the value of each
/// function after the happening.
type Way = (Condition, Vec<(Atom, Expression)>);

pub(super) struct NotRegressable(pub(super) &'static str);

const TOO_MANY_CASES: NotRegressable =
    NotRegressable("a comparison of many functions that one action changes");

impl Happening {
    pub(super) fn of(action: &Action, time: EffectTime) -> Self {
        let mut flattening =
            Flattening { scope: &action.parameters, renaming: Vec::new(), changes: Vec::new() };
        match &action.body {
            ActionBody::Instantaneous { effect, .. } if time == EffectTime::AtStart => {
                flattening.add(effect, &[], &[]);
            }
            ActionBody::Instantaneous { .. } => {}
            ActionBody::Durative { effects, .. } => {
                for (_, effect) in effects.iter().filter(|(at, _)| *at == time) {
                    flattening.add(effect, &[], &[]);
                }
            }
        }
        Self { changes: flattening.changes }
    }

    pub(super) fn changes_function(&self, name: &Name) -> bool {
        self.changes
            .iter()
            .map(|change| target(&change.effect))
            .any(|(own, numeric)| numeric && own.predicate.name == *name)
    }

    /// Returns a necessary condition, on the state before the happening, for a change of the truth value of
    /// `condition`, which has no free variables. Conditions of effects are ignored, so the truth value need
    /// not change.
    pub(super) fn touches(&self, condition: &Condition) -> Condition {
        let mut conditions_of_change = Vec::new();
        self.touching(condition, &mut Vec::new(), &mut conditions_of_change);
        any(conditions_of_change)
    }

    fn touching(&self, condition: &Condition, inner: &mut Vec<TypedName>, found: &mut Vec<Condition>) {
        match condition {
            Condition::Exists(variables, body) | Condition::ForAll(variables, body) => {
                let outer = inner.len();
                inner.extend(variables.iter().cloned());
                self.touching(body, inner, found);
                inner.truncate(outer);
            }
            Condition::Atom(atom) => self.touched(atom, false, inner, found),
            Condition::Compare(_, left, right, _) => {
                let mut functions = Vec::new();
                functions_of(left, &mut functions);
                functions_of(right, &mut functions);
                for atom in &functions {
                    self.touched(atom, true, inner, found);
                }
            }
            other => other.parts().for_each(|part| self.touching(part, inner, found)),
        }
    }

    /// Adds to `found` the conditions under which the arguments of an effect equal those of the atom or function.
    /// Conditions of the effect are ignored. A variable in `inner` (quantified in the examined condition) equals any
    /// argument.
    fn touched(&self, atom: &Atom, is_function: bool, inner: &[TypedName], found: &mut Vec<Condition>) {
        for change in &self.changes {
            let (target, numeric) = target(&change.effect);
            if numeric != is_function || !is_same_symbol(target, atom) {
                continue;
            }
            let is_inner = |term: &Term| match term {
                Term::Variable(variable) => inner.iter().any(|own| own.identifier.name == variable.name),
                Term::Constant(_) => false,
            };
            let pairs = target.arguments.iter().zip(&atom.arguments).filter(|(_, own)| !is_inner(own));
            let matches = all(pairs.map(|(changed, own)| equal(changed, own)));
            let is_affected = exists(&change.bound, matches);
            if !found.contains(&is_affected) {
                found.push(is_affected);
            }
        }
    }

    /// Returns the condition on the state before the happening that is equivalent to `condition` after it.
    /// Fails if a quantified effect may change a compared function, or a comparison has more than `MAX_CASES`
    /// cases.
    pub(super) fn regress(&self, condition: &Condition) -> Result<Condition, NotRegressable> {
        let each =
            |parts: &[Condition]| parts.iter().map(|part| self.regress(part)).collect::<Result<Vec<_>, _>>();
        Ok(match condition {
            Condition::And(parts) => all(each(parts)?),
            Condition::Or(parts) => any(each(parts)?),
            Condition::Not(inner) => not(self.regress(inner)?),
            Condition::Imply(premise, conclusion) => {
                any([not(self.regress(premise)?), self.regress(conclusion)?])
            }
            Condition::Exists(variables, body) => {
                Condition::Exists(variables.clone(), Box::new(self.regress(body)?))
            }
            Condition::ForAll(variables, body) => {
                Condition::ForAll(variables.clone(), Box::new(self.regress(body)?))
            }
            Condition::Atom(atom) => {
                let added = self.occurs(atom, |effect| matches!(effect, Effect::Add(_)));
                let deleted = self.occurs(atom, |effect| matches!(effect, Effect::Delete(_)));
                // Addition takes precedence over deletion.
                any([added, all([Condition::Atom(atom.clone()), not(deleted)])])
            }
            Condition::Equal(..) => condition.clone(),
            Condition::Compare(operator, left, right, span) => {
                let mut functions = Vec::new();
                functions_of(left, &mut functions);
                functions_of(right, &mut functions);
                let ways = self.ways(&functions)?;
                any(ways.into_iter().map(|(condition, values)| {
                    let (left, right) = (substitute(left, &values), substitute(right, &values));
                    all([condition, Condition::Compare(*operator, left, right, *span)])
                }))
            }
        })
    }

    fn occurs(&self, atom: &Atom, is_kind: impl Fn(&Effect) -> bool) -> Condition {
        let changes = self.changes.iter().filter(|change| is_kind(&change.effect));
        any(changes.map(|change| {
            let (target, _) = target(&change.effect);
            if is_same_symbol(target, atom) {
                exists(&change.bound, change.hits(target, atom))
            } else {
                falsity()
            }
        }))
    }

    fn ways(&self, functions: &[Atom]) -> Result<Vec<Way>, NotRegressable> {
        let mut ways = vec![(super::simplify::truth(), Vec::new())];
        for function in functions {
            let mut values = vec![(super::simplify::truth(), Expression::Fluent(function.clone()))];
            for change in &self.changes {
                let Effect::Assign(kind, target, by, _) = &change.effect else { continue };
                let hits =
                    if is_same_symbol(target, function) { change.hits(target, function) } else { falsity() };
                if is_false(&hits) {
                    continue;
                }
                if !change.bound.is_empty() {
                    return Err(NotRegressable("a number that an effect changes for all objects"));
                }
                let mut cases = Vec::new();
                for (condition, value) in values {
                    cases.push((all([condition.clone(), hits.clone()]), changed(*kind, &value, by)));
                    cases.push((all([condition, not(hits.clone())]), value));
                }
                cases.retain(|(condition, _)| !is_false(condition));
                // The cases may double with each effect, so the limit must be checked before the next one.
                if cases.len() > MAX_CASES {
                    return Err(TOO_MANY_CASES);
                }
                values = cases;
            }
            let longer = ways.iter().flat_map(|(condition, assigned): &Way| {
                values.iter().map(|(own, value)| {
                    let mut assigned = assigned.clone();
                    assigned.push((function.clone(), value.clone()));
                    (all([condition.clone(), own.clone()]), assigned)
                })
            });
            ways = longer.collect();
            if ways.len() > MAX_CASES {
                return Err(TOO_MANY_CASES);
            }
        }
        Ok(ways)
    }
}

impl Change {
    fn hits(&self, target: &Atom, atom: &Atom) -> Condition {
        let matches = target.arguments.iter().zip(&atom.arguments).map(|(changed, own)| equal(changed, own));
        all(self.conditions.iter().cloned().chain(matches))
    }
}

/// Splits effects into single changes.
struct Flattening<'a> {
    /// Parameters of the action.
    scope: &'a [TypedName],
    /// New names of variables that hide others. They are in force until the end of their quantifier.
    renaming: Binding,
    changes: Vec<Change>,
}

impl Flattening<'_> {
    /// Adds the changes of an effect inside of quantifiers over `bound` and of `conditions`.
    fn add(&mut self, effect: &Effect, bound: &[TypedName], conditions: &[Condition]) {
        // Conditions have been renamed already. Their quantified variables are not captured, whatever their names.
        let mut unused = u64::MAX / 2;
        match effect {
            Effect::And(parts) => parts.iter().for_each(|part| self.add(part, bound, conditions)),
            Effect::ForAll(variables, body) => {
                let depth = self.renaming.len();
                let mut inner = bound.to_vec();
                for variable in variables {
                    let name = &variable.identifier.name;
                    let is_hiding = |outer: &TypedName| outer.identifier.name == *name;
                    let mut variable = variable.clone();
                    if inner.iter().chain(self.scope).any(is_hiding) {
                        let new =
                            identifier(&format!("{name} of change {}.{}", self.changes.len(), inner.len()));
                        let old = std::mem::replace(&mut variable.identifier, new.clone());
                        self.renaming.push((old.name, Term::Variable(new)));
                    }
                    inner.push(variable);
                }
                self.add(body, &inner, conditions);
                self.renaming.truncate(depth);
            }
            Effect::When(condition, body) => {
                let condition = match self.renaming[..] {
                    [] => condition.clone(),
                    _ => instance(condition, &mut self.renaming, &mut unused),
                };
                let conditions: Vec<_> = conditions.iter().cloned().chain([condition]).collect();
                self.add(body, bound, &conditions);
            }
            Effect::Add(_) | Effect::Delete(_) | Effect::Assign(..) => {
                let effect = match effect {
                    Effect::Add(atom) => Effect::Add(atom_instance(atom, &self.renaming)),
                    Effect::Delete(atom) => Effect::Delete(atom_instance(atom, &self.renaming)),
                    Effect::Assign(kind, target, value, span) => {
                        let target = atom_instance(target, &self.renaming);
                        Effect::Assign(*kind, target, expression(value, &self.renaming), *span)
                    }
                    other => other.clone(),
                };
                self.changes.push(Change { bound: bound.to_vec(), conditions: conditions.to_vec(), effect });
            }
        }
    }
}

fn target(effect: &Effect) -> (&Atom, bool) {
    match effect {
        Effect::Assign(_, target, ..) => (target, true),
        Effect::Add(atom) | Effect::Delete(atom) => (atom, false),
        Effect::And(_) | Effect::ForAll(..) | Effect::When(..) => unreachable!("invariant: changes are flat"),
    }
}

fn is_same_symbol(left: &Atom, right: &Atom) -> bool {
    left.predicate.name == right.predicate.name && left.arguments.len() == right.arguments.len()
}

fn is_same(left: &Atom, right: &Atom) -> bool {
    let is_equal = |(left, right): (&Term, &Term)| match (left, right) {
        (Term::Variable(left), Term::Variable(right)) | (Term::Constant(left), Term::Constant(right)) => {
            left.name == right.name
        }
        _ => false,
    };
    is_same_symbol(left, right) && left.arguments.iter().zip(&right.arguments).all(is_equal)
}

fn functions_of(expression: &Expression, found: &mut Vec<Atom>) {
    expression.walk_fluents(&mut |atom| {
        if !found.iter().any(|known| is_same(known, atom)) {
            found.push(atom.clone());
        }
    });
}

fn substitute(expression: &Expression, values: &[(Atom, Expression)]) -> Expression {
    match expression {
        Expression::Fluent(atom) => {
            let value = values.iter().find(|(known, _)| is_same(known, atom));
            value.map_or_else(|| expression.clone(), |(_, value)| value.clone())
        }
        Expression::Operation(operation, operands, span) => {
            let operands = operands.iter().map(|operand| substitute(operand, values)).collect();
            Expression::Operation(*operation, operands, *span)
        }
        other => other.clone(),
    }
}

fn changed(kind: Assignment, value: &Expression, by: &Expression) -> Expression {
    let with = |operation| Expression::Operation(operation, vec![value.clone(), by.clone()], Span::default());
    match kind {
        Assignment::Assign => by.clone(),
        Assignment::Increase => with(Arithmetic::Add),
        Assignment::Decrease => with(Arithmetic::Subtract),
        Assignment::ScaleUp => with(Arithmetic::Multiply),
        Assignment::ScaleDown => with(Arithmetic::Divide),
    }
}
