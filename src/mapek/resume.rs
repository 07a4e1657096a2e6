//! Compiles the action under way into the PDDL domain, so that each plan of the remaining mission begins with the
//! remainder of this action. The designs of the remainder are open.
//!
//! The paper (see [`crate::mapek`]) plans from the state in which the action has ended. Here, planning starts in the
//! current state, with the remainder of the action as the first step. So the designs of all remaining steps are chosen
//! together. A copy of the action's schema fixes all arguments except designs. Its duration, increases and decreases
//! are scaled to the remainder. The copy adds a gate fact that all other actions require.
//!
//! The copy may read a value that the progress of the action has already changed: in conditions, in the amounts of its
//! effects, and in its duration. The action reads the value without these changes. Therefore, each such function `F`
//! has a companion function `metaplan_done_F`, which contains the past change of each value, and the copy reads
//! `F - metaplan_done_F`. Past changes at start are part of the values that conditions and effects at the end read.
//! Therefore, the copy removes these changes from the companion at its start.
//!
//! The past changes were made with the designs of the past. With other designs, the amounts may differ. A condition such
//! as a sufficient battery level is then about the remaining share of the new amounts. Therefore, conditions read the
//! value as if the past changes had been made with the new designs, too. Conditional and quantified effects are not
//! converted in this way.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::Zero as _;
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Atom, Comparison, Condition, ConditionTime, Declaration,
    Domain, DurationConstraint, Effect, EffectTime, Expression, Identifier, InitialElement, Name, Problem,
    Span, Term,
};
use pddl::validate::Advance;
use pddl::visit::Node;

use crate::mapek::step::PlannedStep;

/// Denominator of the least remaining share of a duration: an unfinished action with full progress still has
/// 1/`LEAST_LEFT` of its duration to go. The share is below the resolution of progress, 1/100.
const LEAST_LEFT: u32 = 1000;

/// Predicate that holds once the action under way has ended. Input files are assumed not to declare it.
const GATE: &str = "metaplan_resumed";

/// Predicate that holds once the remainder of the action under way has started, so that the remainder occurs exactly
/// once. The gate itself cannot ensure this: it is added at the end. If the duration is 0, start and end are one
/// happening, whose condition that the gate is false interferes with the effect that adds it.
const STARTED: &str = "metaplan_remainder_started";

/// Prefix of the names of companion functions.
const DONE: &str = "metaplan_done_";

/// The action under way, and the part of its effects that the state already contains.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Remainder<'a> {
    pub step: &'a PlannedStep,
    /// Completed share of the action, from 0 to 1.
    pub progress: &'a BigRational,
    /// Changes of values by the progress. The keys are the texts of the functions without parentheses.
    pub applied: &'a BTreeMap<String, BigRational>,
    /// Whether the action is known to have started.
    pub has_started: bool,
}

/// Returns `domain` with the gate and, as the first action, a copy of the action's schema that is shortened to the
/// remainder. Returns `problem` with the values of the companion functions that the copy reads.
pub(crate) fn resume<'p>(
    domain: &Domain,
    problem: Cow<'p, Problem>,
    remainder: &Remainder<'_>,
) -> (Domain, Cow<'p, Problem>) {
    let (mut gated, mut problem) = (domain.clone(), problem);
    for name in [GATE, STARTED] {
        gated.predicates.push(Declaration { identifier: identifier(name), parameters: Vec::new() });
    }
    for action in &mut gated.actions {
        require(action, Condition::Atom(flag(GATE)));
    }
    let context = remainder.step.context();
    let mut restored = BTreeSet::new();
    let gradual = gradual_functions(domain, remainder.step);
    for schema in schemas(domain, remainder.step) {
        let mut copy = schema.clone();
        let functions = functions_to_restore(schema, &gradual, remainder);
        if remainder.has_started
            && let Some(facts) = reached_facts(schema, remainder.step, &problem)
        {
            waive_start_conditions(&mut copy, |atom| facts.contains(&ground(atom, schema, remainder.step)));
        }
        let mut shortening = Shortening::new(remainder.progress, &gradual, &functions);
        shortening.compare_designs(schema, remainder);
        shortening.shorten(&mut copy);
        restored.extend(functions);
        for (parameter, value) in schema.parameters.iter().zip(&context) {
            if let Some(value) = value {
                let variable = Term::Variable(parameter.identifier.clone());
                let constant = Term::Constant(identifier(value));
                require(&mut copy, Condition::Equal(variable, constant, Span::default()));
            }
        }
        require(&mut copy, Condition::Not(Box::new(Condition::Atom(flag(STARTED)))));
        open(&mut copy);
        // The copy comes first: if no schema of this name can start, the validator reports the violation of the copy.
        gated.actions.insert(0, copy);
    }
    let companions = domain.functions.iter().filter(|function| restored.contains(&function.identifier.name));
    let companion = |function: &Declaration| Declaration {
        identifier: done(&function.identifier.name),
        parameters: function.parameters.clone(),
    };
    gated.functions.extend(companions.map(companion));
    if !restored.is_empty() {
        state_changes(problem.to_mut(), &restored, remainder.applied);
    }
    (gated, problem)
}

pub(crate) fn resumed_goal(goal: &Condition) -> Condition {
    Condition::And(vec![goal.clone(), Condition::Atom(flag(GATE))])
}

/// Returns the functions whose values change in proportion to the progress of the action: the action increases or
/// decreases them, and neither assigns nor scales any value of them.
pub(crate) fn gradual_functions(domain: &Domain, step: &PlannedStep) -> BTreeSet<Name> {
    let (mut gradual, mut others) = (BTreeSet::new(), BTreeSet::new());
    for effect in schemas(domain, step).flat_map(|schema| schema.body.effects()) {
        effect.walk(&mut |node| {
            if let Node::Effect(Effect::Assign(kind, target, ..)) = node {
                let is_gradual = matches!(kind, Assignment::Increase | Assignment::Decrease);
                let functions = if is_gradual { &mut gradual } else { &mut others };
                functions.insert(target.predicate.name.clone());
            }
        });
    }
    gradual.retain(|function| !others.contains(function));
    gradual
}

/// Removes changes of predicates and functions that exist only in the domain with the remainder.
pub(super) fn remove_internal_changes(change: &mut Advance) {
    let is_internal = |atom: &Atom| {
        let name = atom.predicate.name.as_str();
        [GATE, STARTED].contains(&name) || name.starts_with(DONE)
    };
    change.added.retain(|atom| !is_internal(atom));
    change.values.retain(|value| !is_internal(&value.function));
}

/// Returns a message about the domain with the remainder without its companion functions: `(f a)` in place of
/// `(- (f a) (metaplan_done_f a))`.
pub(super) fn without_companions(message: &str) -> String {
    let mut text = message.to_owned();
    let companion = format!(" ({DONE}");
    while let Some(position) = text.find(&companion) {
        let operation = text[..position].rfind("(- ");
        let end = text[position..].find("))").map(|length| position + length + 2);
        let (Some(operation), Some(end)) = (operation, end) else { break };
        text.replace_range(position..end, "");
        text.replace_range(operation..operation + "(- ".len(), "");
    }
    text
}

fn schemas<'d>(domain: &'d Domain, step: &PlannedStep) -> impl Iterator<Item = &'d Action> {
    let (name, count) = (Name::new(&step.action), step.arguments.len());
    domain
        .actions
        .iter()
        .filter(move |action| action.identifier.name == name && action.parameters.len() == count)
}

/// Returns the gradual functions whose values the copy must not read as they are. These are the functions with changed
/// values, and those that the action changes at its start, because the copy contains only the rest of this change.
fn functions_to_restore(
    schema: &Action,
    gradual: &BTreeSet<Name>,
    remainder: &Remainder<'_>,
) -> BTreeSet<Name> {
    let changed = remainder.applied.iter().filter(|(_, change)| !change.is_zero());
    let mut functions: BTreeSet<Name> =
        changed.filter_map(|(text, _)| text.split_whitespace().next().map(Name::new)).collect();
    if let ActionBody::Durative { effects, .. } = &schema.body
        && !remainder.progress.is_zero()
    {
        for (_, effect) in effects.iter().filter(|(time, _)| *time == EffectTime::AtStart) {
            effect.walk(&mut |node| {
                if let Node::Effect(Effect::Assign(_, target, ..)) = node {
                    functions.insert(target.predicate.name.clone());
                }
            });
        }
    }
    let mut read = BTreeSet::new();
    schema.body.walk(&mut |node| read.extend(node.fluent().map(|atom| atom.predicate.name.clone())));
    for preference in &schema.preferences {
        preference.condition.walk_fluents(&mut |atom| {
            read.insert(atom.predicate.name.clone());
        });
    }
    functions.retain(|function| gradual.contains(function) && read.contains(function));
    functions
}

/// Adds to the initial state, for each value of a function in `restored`, the value of its companion function
/// `metaplan_done_…`: the change in `applied`, or 0. An undefined function gets no companion value.
fn state_changes(problem: &mut Problem, restored: &BTreeSet<Name>, applied: &BTreeMap<String, BigRational>) {
    let applied: BTreeMap<Vec<Name>, &BigRational> = applied
        .iter()
        .map(|(text, change)| (text.split_whitespace().map(Name::new).collect(), change))
        .collect();
    let companion = |element: &InitialElement| match element {
        InitialElement::Value(atom, ..) if restored.contains(&atom.predicate.name) => {
            let words: Vec<Name> = std::iter::once(&atom.predicate.name)
                .chain(atom.arguments.iter().map(Term::name))
                .cloned()
                .collect();
            let change = applied.get(&words).map(|change| (*change).clone()).unwrap_or_default();
            Some(InitialElement::Value(done_atom(atom), change, Span::default()))
        }
        _ => None,
    };
    let companions: Vec<InitialElement> = problem.init.iter().filter_map(companion).collect();
    problem.init.extend(companions);
}

/// Returns `true` if the action changes facts, unconditionally, and the state of `problem` already has all these
/// changes.
pub(super) fn has_reached_facts(domain: &Domain, step: &PlannedStep, problem: &Problem) -> bool {
    schemas(domain, step).any(|schema| reached_facts(schema, step, problem).is_some())
}

type GroundFact = (Name, Vec<Name>);

fn ground(atom: &Atom, schema: &Action, step: &PlannedStep) -> GroundFact {
    let value = |term: &Term| match term {
        Term::Variable(variable) => {
            let position = schema.parameters.iter().position(|p| p.identifier.name == variable.name);
            position.map_or_else(|| variable.name.clone(), |position| Name::new(&step.arguments[position]))
        }
        Term::Constant(constant) => constant.name.clone(),
    };
    (atom.predicate.name.clone(), atom.arguments.iter().map(value).collect())
}

/// Returns the facts that the action changes if the state of `problem` already has all these changes. Returns `None` if
/// it has not, if the action changes no facts, or if changes of facts are conditional or quantified.
fn reached_facts(schema: &Action, step: &PlannedStep, problem: &Problem) -> Option<BTreeSet<GroundFact>> {
    let (mut added, mut deleted) = (BTreeSet::new(), BTreeSet::new());
    let mut parts: Vec<&Effect> = schema.body.effects().collect();
    while let Some(part) = parts.pop() {
        match part {
            Effect::And(subeffects) => parts.extend(subeffects),
            Effect::Add(atom) => {
                added.insert(ground(atom, schema, step));
            }
            Effect::Delete(atom) => {
                deleted.insert(ground(atom, schema, step));
            }
            Effect::ForAll(..) | Effect::When(..) if !changed_predicates(part).is_empty() => return None,
            _ => {}
        }
    }
    deleted.retain(|fact| !added.contains(fact));
    let changed: BTreeSet<GroundFact> = added.union(&deleted).cloned().collect();
    let predicates: BTreeSet<&Name> = changed.iter().map(|(predicate, _)| predicate).collect();
    let mut missing = added;
    for element in &problem.init {
        let InitialElement::Fact(atom) = element else { continue };
        if !predicates.contains(&atom.predicate.name) {
            continue;
        }
        let fact = element.fact()?;
        if deleted.contains(&fact) {
            return None;
        }
        missing.remove(&fact);
    }
    (missing.is_empty() && !changed.is_empty()).then_some(changed)
}

fn changed_predicates(effect: &Effect) -> BTreeSet<Name> {
    let mut predicates = BTreeSet::new();
    effect.walk(&mut |node| {
        if let Node::Effect(Effect::Add(atom) | Effect::Delete(atom)) = node {
            predicates.insert(atom.predicate.name.clone());
        }
    });
    predicates
}

fn waive_start_conditions(action: &mut Action, is_changed: impl Fn(&Atom) -> bool) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => waive(precondition, &is_changed),
        ActionBody::Durative { conditions, .. } => {
            for (_, condition) in conditions.iter_mut().filter(|(time, _)| *time == ConditionTime::AtStart) {
                waive(condition, &is_changed);
            }
        }
    }
}

fn waive(condition: &mut Condition, is_changed: &impl Fn(&Atom) -> bool) {
    let is_waived = match condition {
        Condition::And(parts) => {
            for part in parts {
                waive(part, is_changed);
            }
            false
        }
        Condition::Atom(atom) => is_changed(atom),
        Condition::Not(inner) => matches!(&**inner, Condition::Atom(atom) if is_changed(atom)),
        _ => false,
    };
    if is_waived {
        *condition = Condition::And(Vec::new());
    }
}

struct Shortening<'a> {
    progress: &'a BigRational,
    remaining_share: BigRational,
    /// Remaining share of the duration, which is not 0. Without a duration, start and end would be one happening, in
    /// which the end effects could violate start conditions.
    time_left: BigRational,
    gradual: &'a BTreeSet<Name>,
    restored: &'a BTreeSet<Name>,
    /// Changed values, each with the difference between its changes by the whole action: with the open designs, minus
    /// with the past designs.
    differences: Vec<(Atom, Expression)>,
}

impl<'a> Shortening<'a> {
    fn new(progress: &'a BigRational, gradual: &'a BTreeSet<Name>, restored: &'a BTreeSet<Name>) -> Self {
        let remaining_share = BigRational::from_integer(1.into()) - progress;
        let time_left = remaining_share.clone().max(BigRational::new(1.into(), LEAST_LEFT.into()));
        Self { progress, remaining_share, time_left, gradual, restored, differences: Vec::new() }
    }

    fn compare_designs(&mut self, schema: &Action, remainder: &Remainder<'_>) {
        let step = remainder.step;
        let context = step.context();
        let parameters = schema.parameters.iter().zip(&step.arguments).zip(&context);
        let designs: BTreeMap<&Name, &String> = parameters
            .filter(|(_, value)| value.is_none())
            .map(|((parameter, design), _)| (&parameter.identifier.name, design))
            .collect();
        if self.progress.is_zero() || designs.is_empty() {
            return;
        }
        let (changes, conditional) = self.changes(schema);
        for (target, is_increase, open) in &changes {
            let is_same_function = |atom: &Atom| atom.predicate.name == target.predicate.name;
            let of_function = || changes.iter().filter(|(other, ..)| is_same_function(other));
            let is_only_target = of_function().all(|(other, ..)| is_same(other, target));
            let signed = |open: &Expression, is_increase: bool| {
                if is_increase {
                    open.clone()
                } else {
                    product(&BigRational::from_integer((-1).into()), open.clone())
                }
            };
            let Some(present) = with_designs(open, &designs) else { continue };
            let is_open = target.arguments.iter().any(|term| designs.contains_key(term.name()));
            if is_open || !is_only_target || conditional.contains(&target.predicate.name) {
                let difference = vec![signed(open, *is_increase), signed(&present, !*is_increase)];
                let difference = Expression::Operation(Arithmetic::Add, difference, Span::default());
                self.differences.push((target.clone(), difference));
                continue;
            }
            // One difference for all changes of this value. The progress may have been made with other designs than the
            // present ones, so the changes that it has made are constants.
            if self.differences.iter().any(|(other, _)| is_same(other, target)) {
                continue;
            }
            let mut sum: Vec<Expression> =
                of_function().map(|(_, is_increase, open)| signed(open, *is_increase)).collect();
            let (function, arguments) = ground(target, schema, step);
            let words: Vec<&str> = std::iter::once(&function).chain(&arguments).map(Name::as_str).collect();
            let applied = remainder.applied.get(&words.join(" ")).cloned().unwrap_or_default();
            sum.push(Expression::Number(-applied / self.progress, Span::default()));
            let difference = Expression::Operation(Arithmetic::Add, sum, Span::default());
            self.differences.push((target.clone(), difference));
        }
    }

    /// Returns the unconditional changes of gradual functions: target, whether it is increased, and amount. Also returns
    /// the functions that conditional and quantified effects change.
    fn changes(&self, schema: &Action) -> (Vec<(Atom, bool, Expression)>, BTreeSet<Name>) {
        let whole =
            schema.body.durations().iter().find(|constraint| constraint.operator == Comparison::Equal);
        let (mut changes, mut conditional) = (Vec::new(), BTreeSet::new());
        let mut parts: Vec<&Effect> = schema.body.effects().collect();
        while let Some(part) = parts.pop() {
            match part {
                Effect::And(subeffects) => parts.extend(subeffects),
                Effect::ForAll(..) | Effect::When(..) => conditional.extend(changed_functions(part)),
                Effect::Assign(kind, target, value, _) if self.gradual.contains(&target.predicate.name) => {
                    let mut open = value.clone();
                    open.change_leaves(&mut |leaf| {
                        if let (Expression::Duration(_), Some(whole)) = (&*leaf, whole) {
                            leaf.clone_from(&whole.expression);
                        }
                    });
                    open.change_leaves(&mut |leaf| self.restore(leaf));
                    changes.push((target.clone(), *kind == Assignment::Increase, open));
                }
                _ => {}
            }
        }
        (changes, conditional)
    }

    /// Scales the duration, increases and decreases of an action to the remaining share, and restores the values that
    /// the action reads.
    fn shorten(&self, action: &mut Action) {
        let changed: BTreeSet<Name> = action.body.effects().flat_map(changed_functions).collect();
        for preference in &mut action.preferences {
            preference.condition.change_leaves(&mut |leaf| self.restore_in_condition(leaf));
        }
        match &mut action.body {
            // The robot can report progress of an action without duration, too.
            ActionBody::Instantaneous { precondition, effect } => {
                precondition.change_leaves(&mut |leaf| self.restore_in_condition(leaf));
                effect.change_leaves(&mut |leaf| self.restore(leaf));
                self.shorten_effect(effect, false);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                let whole = duration.iter().find(|constraint| constraint.operator == Comparison::Equal);
                let whole = whole.map(|constraint| constraint.expression.clone());
                let whole = self.whole_duration(whole, &changed);
                for (_, condition) in conditions {
                    condition.change_leaves(&mut |leaf| self.restore_in_condition(leaf));
                }
                for (time, effect) in effects {
                    effect.change_leaves(&mut |leaf| match leaf {
                        Expression::Duration(_) => leaf.clone_from(&whole),
                        leaf => self.restore(leaf),
                    });
                    self.shorten_effect(effect, *time == EffectTime::AtStart);
                }
                for DurationConstraint { expression, .. } in duration {
                    expression.change_leaves(&mut |leaf| self.restore(leaf));
                    *expression = product(&self.time_left, expression.clone());
                }
            }
        }
    }

    /// Returns the duration of the whole action, which replaces `?duration` in effects: the expression of its equality
    /// constraint, if there is one and the action does not change its value. Otherwise, the duration of the remainder
    /// divided by its share.
    fn whole_duration(&self, stated: Option<Expression>, changed: &BTreeSet<Name>) -> Expression {
        let is_constant = |expression: &Expression| {
            let mut is_constant = true;
            expression.walk_fluents(&mut |atom| is_constant &= !changed.contains(&atom.predicate.name));
            is_constant
        };
        stated
            .filter(is_constant)
            .unwrap_or_else(|| product(&self.time_left.recip(), Expression::Duration(Span::default())))
    }

    /// Multiplies increases and decreases of gradual functions by the remaining share. At the start, each one also
    /// removes its past share from the companion.
    fn shorten_effect(&self, effect: &mut Effect, is_start: bool) {
        let Effect::Assign(kind, target, value, _) = effect else {
            effect.parts_mut().iter_mut().for_each(|part| self.shorten_effect(part, is_start));
            return;
        };
        if !self.gradual.contains(&target.predicate.name) {
            return;
        }
        let past_share = product(self.progress, value.clone());
        *value = product(&self.remaining_share, value.clone());
        if is_start && self.restored.contains(&target.predicate.name) {
            let opposite =
                if *kind == Assignment::Increase { Assignment::Decrease } else { Assignment::Increase };
            let companion = Effect::Assign(opposite, done_atom(target), past_share, Span::default());
            *effect = Effect::And(vec![effect.clone(), companion]);
        }
    }

    /// Makes a condition of the copy read a value without the progress of the action: subtracts the changes that the
    /// progress would have made with the designs of the copy.
    fn restore_in_condition(&self, leaf: &mut Expression) {
        let Expression::Fluent(atom) = &*leaf else { return };
        let differences = self.differences.iter().filter(|(target, _)| is_same(target, atom));
        let differences: Vec<Expression> =
            differences.map(|(_, difference)| product(self.progress, difference.clone())).collect();
        self.restore(leaf);
        for difference in differences {
            *leaf =
                Expression::Operation(Arithmetic::Subtract, vec![leaf.clone(), difference], Span::default());
        }
    }

    fn restore(&self, leaf: &mut Expression) {
        if let Expression::Fluent(atom) = leaf
            && self.restored.contains(&atom.predicate.name)
        {
            let so_far = Expression::Fluent(done_atom(atom));
            *leaf = Expression::Operation(Arithmetic::Subtract, vec![leaf.clone(), so_far], Span::default());
        }
    }
}

/// Replaces open designs by the present ones. Returns `None` if no design is open, or if the value depends on a chosen
/// duration, which is unknown for the present designs.
fn with_designs(expression: &Expression, designs: &BTreeMap<&Name, &String>) -> Option<Expression> {
    let mut present = expression.clone();
    let (mut is_open, mut is_chosen) = (false, false);
    present.change_leaves(&mut |leaf| match leaf {
        Expression::Fluent(atom) => {
            for term in &mut atom.arguments {
                if let Some(design) = designs.get(term.name()) {
                    *term = Term::Constant(identifier(design));
                    is_open = true;
                }
            }
        }
        Expression::Duration(_) => is_chosen = true,
        _ => {}
    });
    (is_open && !is_chosen).then_some(present)
}

fn is_same(left: &Atom, right: &Atom) -> bool {
    left.predicate.name == right.predicate.name
        && left.arguments.iter().map(Term::name).eq(right.arguments.iter().map(Term::name))
}

fn changed_functions(effect: &Effect) -> BTreeSet<Name> {
    let mut functions = BTreeSet::new();
    effect.walk(&mut |node| {
        if let Node::Effect(Effect::Assign(_, target, ..)) = node {
            functions.insert(target.predicate.name.clone());
        }
    });
    functions
}

/// Returns the product. Constants are folded, because the planner treats constant durations and amounts more
/// efficiently.
fn product(factor: &BigRational, expression: Expression) -> Expression {
    match expression {
        Expression::Number(value, span) => Expression::Number(factor * value, span),
        expression if *factor == BigRational::from_integer(1.into()) => expression,
        expression => {
            let factor = Expression::Number(factor.clone(), Span::default());
            Expression::Operation(Arithmetic::Multiply, vec![factor, expression], Span::default())
        }
    }
}

fn require(action: &mut Action, added: Condition) {
    match &mut action.body {
        ActionBody::Instantaneous { precondition, .. } => {
            let before = std::mem::replace(precondition, Condition::And(Vec::new()));
            *precondition = Condition::And(vec![before, added]);
        }
        ActionBody::Durative { conditions, .. } => conditions.push((ConditionTime::AtStart, added)),
    }
}

fn open(action: &mut Action) {
    match &mut action.body {
        ActionBody::Instantaneous { effect, .. } => {
            let before = std::mem::replace(effect, Effect::And(Vec::new()));
            *effect = Effect::And(vec![before, Effect::Add(flag(STARTED)), Effect::Add(flag(GATE))]);
        }
        ActionBody::Durative { effects, .. } => {
            effects.push((EffectTime::AtStart, Effect::Add(flag(STARTED))));
            effects.push((EffectTime::AtEnd, Effect::Add(flag(GATE))));
        }
    }
}

fn flag(predicate: &str) -> Atom {
    Atom { predicate: identifier(predicate), arguments: Vec::new(), span: Span::default() }
}

fn done(function: &Name) -> Identifier {
    identifier(&format!("{DONE}{function}"))
}

fn done_atom(atom: &Atom) -> Atom {
    Atom { predicate: done(&atom.predicate.name), ..atom.clone() }
}

fn identifier(name: &str) -> Identifier {
    Identifier { name: Name::new(name), span: Span::default() }
}
