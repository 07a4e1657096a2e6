//! Monitors of trajectory constraints: auxiliary atoms store the state of an automaton for each constraint,
//! and additional effects of actions update them.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use pddl::ast::{
    Action, ActionBody, Comparison, Condition, Constraint, Domain, DurationConstraint, Effect, EffectTime,
    Expression, InitialElement, Name, Problem, Span, Trajectory,
};
use pddl::visit::Node;
use rustc_hash::FxHashSet;

use crate::error::{Error, File};

use super::deadline::{self, Deadline};
use super::initial::Initial;
use super::instances::{Binding, Objects, instance};
use super::regress::{Happening, NotRegressable};
use super::semantics::PlanSemantics;
use super::simplify::{all, any, assume, flag, holds, is_false, is_true, not, ways};
use super::syntax_edits::{PreferenceInstance, declare, happen, require, unsupported};

/// Limit on the number of ground trajectory constraints, including those of preferences. A conjunction or
/// quantifier counts in addition to its parts.
const INSTANCES: usize = 20_000;

pub(super) struct Monitors<'t> {
    domain: &'t Domain,
    problem: &'t Problem,
    objects: &'t Objects<'t>,
    pub(super) initial: Initial<'t>,
    additions: Vec<[Addition; 2]>,
    memory: Vec<(String, bool)>,
    goals: Vec<Condition>,
    wanted: Vec<PreferenceInstance>,
    /// Names of the auxiliary atoms that timed initial literals add, with their times.
    pub(super) moments: Vec<(String, BigRational)>,
    pub(super) course: PlanSemantics<'t>,
    pub(super) deadlines: Vec<(Deadline, [Condition; 2], Effect)>,
    instances: usize,
    fresh: u64,
}

#[derive(Default)]
pub(super) struct Addition {
    conditions: Vec<Condition>,
    effects: Vec<Effect>,
}

/// Maximum number of ways in which an action may change a condition, up to which the condition is simplified for each way.
const MAX_WAYS: usize = 32;

const TIMES: [EffectTime; 2] = [EffectTime::AtStart, EffectTime::AtEnd];

impl<'t> Monitors<'t> {
    pub(super) fn new(
        domain: &'t Domain,
        problem: &'t Problem,
        objects: &'t Objects<'t>,
        course: PlanSemantics<'t>,
    ) -> Self {
        Self {
            domain,
            problem,
            objects,
            initial: Initial::of(domain, problem, objects),
            additions: domain.actions.iter().map(|_| Default::default()).collect(),
            memory: Vec::new(),
            goals: Vec::new(),
            wanted: Vec::new(),
            moments: Vec::new(),
            course,
            deadlines: Vec::new(),
            instances: 0,
            fresh: 0,
        }
    }

    pub(super) fn is_defined(&self, condition: &Condition, place: (File, Span)) -> Result<(), Error> {
        self.initial.is_defined(condition, place)
    }

    pub(super) fn add_constraint(&mut self, file: File, constraint: &Constraint) -> Result<(), Error> {
        for binding in self.objects.bindings(&constraint.variables, &Vec::new()) {
            let place = (file, constraint.span);
            let last =
                self.trajectory(&constraint.trajectory, binding, constraint.preference.is_none(), place)?;
            match &constraint.preference {
                Some(name) => self.wanted.push((name.name.clone(), last)),
                None => self.goals.push(last),
            }
        }
        Ok(())
    }

    /// Adds the monitor of a trajectory constraint whose variables have the objects in `binding`, and returns
    /// its condition on the last state. Preconditions that prevent violations are added to actions only if
    /// `hard` is `true`.
    fn trajectory(
        &mut self,
        trajectory: &Trajectory,
        mut binding: Binding,
        hard: bool,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        self.instances = self.instances.saturating_add(1);
        if self.instances > INSTANCES {
            let construct = format!("more than {INSTANCES} instances of constraints and preferences");
            return Err(unsupported(construct, "constraints over fewer objects", place));
        }
        let (fresh, initial) = (&mut self.fresh, &self.initial);
        let mut ground = |condition: &Condition| {
            let ground = instance(condition, &mut binding, fresh);
            initial.is_defined(&ground, place).map(|()| ground)
        };
        match trajectory {
            Trajectory::And(parts) => {
                let each = parts.iter().map(|part| self.trajectory(part, binding.clone(), hard, place));
                Ok(all(each.collect::<Result<Vec<_>, _>>()?))
            }
            Trajectory::ForAll(variables, body) => {
                let instances = self.objects.bindings(variables, &binding);
                let each = instances.map(|binding| self.trajectory(body, binding, hard, place));
                Ok(all(each.collect::<Result<Vec<_>, _>>()?))
            }
            Trajectory::AtEnd(condition) => ground(condition),
            Trajectory::Always(condition) => {
                let condition = ground(condition)?;
                self.always(&condition, hard, place)
            }
            Trajectory::Sometime(condition) => {
                let condition = ground(condition)?;
                self.sometime(&condition, place)
            }
            Trajectory::AtMostOnce(condition) => {
                let condition = ground(condition)?;
                self.at_most_once(&condition, hard, place)
            }
            Trajectory::SometimeAfter(first, second) => {
                let (first, second) = (ground(first)?, ground(second)?);
                self.sometime_after(&first, &second, place)
            }
            Trajectory::SometimeBefore(first, second) => {
                let (first, second) = (ground(first)?, ground(second)?);
                self.sometime_before(&first, &second, hard, place)
            }
            Trajectory::Within(time, condition) => {
                let condition = ground(condition)?;
                self.within(time, &condition, place)
            }
            Trajectory::HoldDuring(from, until, condition) => {
                let condition = ground(condition)?;
                self.hold((from, Some(until)), &condition, hard, place)
            }
            Trajectory::HoldAfter(from, condition) => {
                let condition = ground(condition)?;
                self.hold((from, None), &condition, hard, place)
            }
            Trajectory::AlwaysWithin(time, first, second) => {
                let (first, second) = (ground(first)?, ground(second)?);
                self.always_within(time, [&first, &second], hard, place)
            }
        }
    }

    /// Declares an auxiliary atom for the monitor of the current constraint instance and returns its name.
    /// `at_first` is its initial truth value.
    pub(super) fn remember(&mut self, what: &str, at_first: bool) -> String {
        let name = format!("instance {} {what}", self.instances);
        self.memory.push((name.clone(), at_first));
        name
    }

    /// Calls `make` for each start or end of an action that may change one of `conditions`, and adds the returned
    /// preconditions and effects to this start or end. The arguments of `make` are a condition under which the change
    /// may occur, and `conditions` regressed to the state before the change. If the first argument would be a
    /// disjunction, `make` is called once for each disjunct. Start and end are kept apart by
    /// [`separate`](Self::separate).
    ///
    /// Fails if `separate` fails, if a condition cannot be regressed, or if the conditions contain derived predicates
    /// or atoms that timed initial literals change.
    pub(super) fn after_each(
        &mut self,
        conditions: &[&Condition],
        place: (File, Span),
        make: impl Fn(Condition, &[Condition]) -> Addition,
    ) -> Result<(), Error> {
        for condition in conditions {
            self.can_be_watched(condition, place)?;
        }
        self.separate(conditions, place)?;
        for (action, additions) in self.domain.actions.iter().zip(&mut self.additions) {
            let happenings = TIMES.map(|time| Happening::of(action, time));
            let touched = happenings
                .each_ref()
                .map(|one| any(conditions.iter().map(|condition| one.touches(condition))));
            for ((happening, touched), addition) in happenings.iter().zip(touched).zip(additions) {
                if is_false(&touched) {
                    continue;
                }
                let after: Result<Vec<_>, NotRegressable> =
                    conditions.iter().map(|condition| happening.regress(condition)).collect();
                let after = after.map_err(|NotRegressable(what)| {
                    unsupported(
                        format!("a constraint on {what}"),
                        "constraints on atoms, or on numbers that actions change one by one",
                        place,
                    )
                })?;
                let mut ways = ways(touched);
                // Each way has its own copy of the conditions, which would take quadratic space.
                if ways.len() > MAX_WAYS {
                    ways = vec![any(ways)];
                }
                for way in ways {
                    let after: Vec<_> = after.iter().map(|condition| assume(condition, &way)).collect();
                    let addition_of_way = make(way, &after);
                    addition
                        .conditions
                        .extend(addition_of_way.conditions.into_iter().filter(|own| !is_true(own)));
                    addition.effects.extend(addition_of_way.effects);
                }
            }
        }
        Ok(())
    }

    /// Adds the precondition that the duration is positive to each action whose start and end may coincide and may both
    /// change one of `conditions`. Otherwise one of them could read an auxiliary atom that the other changes.
    ///
    /// Fails if the precondition is needed but cannot be required (for example in sequential plans).
    fn separate(&mut self, conditions: &[&Condition], place: (File, Span)) -> Result<(), Error> {
        for (action, additions) in self.domain.actions.iter().zip(&mut self.additions) {
            let may_change = |time| {
                let happening = Happening::of(action, time);
                conditions.iter().any(|condition| !is_false(&happening.touches(condition)))
            };
            // The end is checked first: instantaneous actions change nothing at it.
            if !TIMES.into_iter().rev().all(may_change) || takes_time(self.domain, self.problem, action) {
                continue;
            }
            let takes_time =
                positive(action).filter(|_| matches!(self.course, PlanSemantics::Overlapping(_)));
            let takes_time = takes_time.ok_or_else(|| {
                let construct = format!(
                    "a constraint on what `{}` changes both at its start and at its end, which may be one time",
                    action.identifier.name
                );
                unsupported(construct, "a duration that is known to be above 0", place)
            })?;
            additions[0].conditions.push(takes_time);
        }
        Ok(())
    }

    /// Returns `true` if the monitors do not restrict the times of actions: there are no deadlines, and the monitors
    /// neither add preconditions about the state nor make two actions interfere.
    pub(super) fn keeps_apart_nothing(&self) -> bool {
        let is_plain = |addition: &Addition| {
            addition.conditions.iter().all(reads_nothing)
                && addition.effects.iter().all(|effect| match effect {
                    Effect::When(condition, effect) => {
                        matches!(**effect, Effect::Add(_)) && reads_nothing(condition)
                    }
                    effect => matches!(effect, Effect::Add(_)),
                })
        };
        self.deadlines.is_empty() && self.additions.iter().flatten().all(is_plain)
    }

    pub(super) fn can_be_watched(&self, condition: &Condition, place: (File, Span)) -> Result<(), Error> {
        let mut predicates = FxHashSet::default();
        predicates_of(condition, &mut predicates);
        let derived = self.domain.derived.iter().map(|axiom| &axiom.head.identifier.name);
        if let Some(name) = derived.into_iter().find(|name| predicates.contains(name)) {
            let construct = format!("a constraint on the derived predicate `{name}`");
            return Err(unsupported(construct, "the conditions that it is derived from", place));
        }
        let timed = self.problem.init.iter().filter_map(|element| match element {
            InitialElement::Timed(_, atom, ..) => Some(&atom.predicate.name),
            _ => None,
        });
        if let Some(name) = timed.into_iter().find(|name| predicates.contains(name)) {
            let construct = format!("a constraint on `{name}`, which timed initial literals change");
            return Err(unsupported(construct, "a constraint on what only actions change", place));
        }
        Ok(())
    }

    fn always(&mut self, what: &Condition, hard: bool, place: (File, Span)) -> Result<Condition, Error> {
        let at_first = self.initial.holds(what);
        if hard {
            self.after_each(&[what], place, |touched, after| {
                Addition::needs(any([not(touched), after[0].clone()]))
            })?;
            return Ok(decided(at_first));
        }
        let broken = self.remember("is broken", !at_first);
        self.after_each(&[what], place, |touched, after| {
            Addition::notes(all([touched, not(after[0].clone())]), Effect::Add(flag(&broken)))
        })?;
        Ok(not(holds(&broken)))
    }

    fn sometime(&mut self, what: &Condition, place: (File, Span)) -> Result<Condition, Error> {
        let was_met = self.remember("was met", self.initial.holds(what));
        self.after_each(&[what], place, |touched, after| {
            Addition::notes(all([touched, after[0].clone()]), Effect::Add(flag(&was_met)))
        })?;
        Ok(holds(&was_met))
    }

    fn at_most_once(
        &mut self,
        what: &Condition,
        hard: bool,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        let begun = self.remember("has begun", self.initial.holds(what));
        let broken = if hard { None } else { Some(self.remember("is broken", false)) };
        self.after_each(&[what], place, |touched, after| {
            let after = all([touched, after[0].clone()]);
            let mut addition = Addition::notes(after.clone(), Effect::Add(flag(&begun)));
            let again = all([after, not(what.clone()), holds(&begun)]);
            addition.forbid(again, broken.as_deref());
            addition
        })?;
        Ok(broken.map_or(all([]), |broken| not(holds(&broken))))
    }

    fn sometime_after(
        &mut self,
        first: &Condition,
        second: &Condition,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        let at_first = self.initial.holds(first) && !self.initial.holds(second);
        let open = self.remember("is open", at_first);
        self.after_each(&[first, second], place, |touched, after| {
            let [first, second] = after else { return Addition::default() };
            let mut addition =
                Addition::notes(all([touched.clone(), second.clone()]), Effect::Delete(flag(&open)));
            let opened = all([touched, first.clone(), not(second.clone())]);
            addition.effects.extend(Addition::notes(opened, Effect::Add(flag(&open))).effects);
            addition
        })?;
        Ok(not(holds(&open)))
    }

    fn sometime_before(
        &mut self,
        first: &Condition,
        second: &Condition,
        hard: bool,
        place: (File, Span),
    ) -> Result<Condition, Error> {
        // A happening that changes the first condition reads the atom `was met`, and one that changes the
        // second condition adds it. So the start and the end of one action must not coincide if they change
        // these conditions.
        self.separate(&[first, second], place)?;
        let was_met = self.remember("was met", self.initial.holds(second));
        let at_first = self.initial.holds(first);
        let broken = if hard { None } else { Some(self.remember("is broken", at_first)) };
        self.after_each(&[first], place, |touched, after| {
            let mut addition = Addition::default();
            addition.forbid(all([touched, after[0].clone(), not(holds(&was_met))]), broken.as_deref());
            addition
        })?;
        self.after_each(&[second], place, |touched, after| {
            Addition::notes(all([touched, after[0].clone()]), Effect::Add(flag(&was_met)))
        })?;
        Ok(broken.map_or(decided(!at_first), |broken| not(holds(&broken))))
    }

    pub(super) fn install(
        self,
        domain: &mut Domain,
        problem: &mut Problem,
    ) -> (Vec<PreferenceInstance>, Vec<Deadline>) {
        for (name, time) in self.moments {
            declare(domain, &name);
            problem.init.push(InitialElement::Timed(time, flag(&name), true, Span::default()));
        }
        for (name, at_first) in self.memory {
            declare(domain, &name);
            if at_first {
                problem.init.push(InitialElement::Fact(flag(&name)));
            }
        }
        for (action, additions) in domain.actions.iter_mut().zip(self.additions) {
            for (time, addition) in TIMES.into_iter().zip(additions) {
                for condition in addition.conditions {
                    require(action, time, condition);
                }
                for effect in addition.effects {
                    happen(action, time, effect);
                }
            }
        }
        let goal = std::mem::replace(&mut problem.goal, Condition::And(Vec::new()));
        problem.goal = all([goal].into_iter().chain(self.goals));
        let deadlines = deadline::install(domain, problem, self.deadlines);
        (self.wanted, deadlines)
    }
}

impl Addition {
    fn needs(condition: Condition) -> Self {
        Self { conditions: vec![condition], effects: Vec::new() }
    }

    pub(super) fn notes(condition: Condition, effect: Effect) -> Self {
        let effect = match condition {
            condition if is_false(&condition) => return Self::default(),
            condition if is_true(&condition) => effect,
            condition => Effect::When(condition, Box::new(effect)),
        };
        Self { conditions: Vec::new(), effects: vec![effect] }
    }

    pub(super) fn forbid(&mut self, what: Condition, broken: Option<&str>) {
        match broken {
            None => self.conditions.push(not(what)),
            Some(broken) => self.effects.extend(Self::notes(what, Effect::Add(flag(broken))).effects),
        }
    }
}

fn reads_nothing(condition: &Condition) -> bool {
    let mut reads = false;
    condition.walk(&mut |node| {
        reads |= matches!(node, Node::Condition(Condition::Atom(_) | Condition::Compare(..)));
    });
    !reads
}

pub(super) fn decided(holds: bool) -> Condition {
    if holds { all([]) } else { any([]) }
}

fn predicates_of<'c>(condition: &'c Condition, found: &mut FxHashSet<&'c Name>) {
    condition.walk(&mut |node| found.extend(node.atom().map(|atom| &atom.predicate.name)));
}

/// Returns the condition that the fixed duration of an action is above 0. Returns `None` unless the only
/// duration constraint is an equality.
fn positive(action: &Action) -> Option<Condition> {
    let ActionBody::Durative { duration, .. } = &action.body else { return None };
    let [DurationConstraint { operator: Comparison::Equal, expression, span, .. }] = &duration[..] else {
        return None;
    };
    let zero = Expression::Number(BigRational::zero(), *span);
    Some(Condition::Compare(Comparison::Greater, expression.clone(), zero, *span))
}

/// Returns `true` if an action is instantaneous, or its duration is certainly positive, so that start and end
/// never coincide. The check is conservative.
fn takes_time(domain: &Domain, problem: &Problem, action: &Action) -> bool {
    let ActionBody::Durative { duration, .. } = &action.body else { return true };
    let [DurationConstraint { operator, expression, .. }] = &duration[..] else { return false };
    operator.is_lower_bound()
        && match expression {
            Expression::Number(number, _) => number.is_positive(),
            Expression::Fluent(function) => {
                let name = &function.predicate.name;
                let changes = |action: &Action| {
                    TIMES.iter().any(|time| Happening::of(action, *time).changes_function(name))
                };
                let values = problem.initial_values(name);
                !domain.actions.iter().any(changes) && values.iter().all(Signed::is_positive)
            }
            _ => false,
        }
}
