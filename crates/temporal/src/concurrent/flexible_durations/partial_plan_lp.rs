//! Partial plans with open times and durations: a prefix of happenings and a linear program.
//!
//! The encoding follows POPF \[1\] and COLIN \[2\]. Each start and each action without duration has
//! a column for its time. A start has another column for its duration if the planner chooses the
//! duration. The values of numeric fluents are affine expressions over earlier durations, so each
//! numeric condition is a linear constraint. Interfering happenings are a separation apart, in the
//! order of the sequence. Each new happening also constrains the ends of running actions that must
//! follow it. The first column is the makespan.
//!
//! \[1\] A. Coles, A. Coles, M. Fox, D. Long: Forward-chaining partial-order planning, ICAPS 2010.
//! \[2\] A. Coles, A. Coles, M. Fox, D. Long: COLIN: planning with continuous linear numeric
//! change, JAIR 44, 2012.

use task::limits::{Interrupted, Limits};
use task::number::{Int, Rational, dense};
use task::task::number::TaskNumber;
use task::task::quantity::Linear;
use task::task::{OperatorId, State};

use crate::concurrent::flexible_durations::affine::{Affine, Column};
use crate::concurrent::flexible_durations::linear_program::Program;
use crate::concurrent::happening::{Instance, Role};
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::temporal_task::TemporalTask;

pub(super) const MAKESPAN: Column = 0;

/// Column of the time of the happening at a position in the sequence. Ends and timed initial
/// literals do not use it.
#[expect(clippy::arithmetic_side_effects, reason = "sequences are shorter than 2^28")]
pub(super) fn time_of(position: usize) -> Column {
    2 * dense(position) + 2
}

#[expect(clippy::arithmetic_side_effects, reason = "sequences are shorter than 2^28")]
pub(super) fn duration_of(position: usize) -> Column {
    2 * dense(position) + 3
}

#[derive(Debug, Clone)]
pub(super) struct RunningAction {
    pub(super) instance: u32,
    end: Affine,
    /// Some instances have a numeric variable for the duration, which all their runs share. This is its value
    /// for this run. `None` if the instance has no such variable.
    number: Option<Affine>,
    /// Time of the start, or of the last later happening that wrote an atom or number in the joint
    /// over-all condition of the instance (see [`Instance::joint`]). `None` if the instance has no
    /// joint condition.
    last: Option<Affine>,
}

/// A happening of a partial plan. Its time, duration and metric contribution are expressions over
/// the columns of the linear program.
#[derive(Debug, Clone)]
pub(super) struct Passed {
    pub(super) operator: OperatorId,
    /// For an end: index of the ended run among the simultaneous runs of its instance, in the order
    /// of their starts. Otherwise 0.
    pub(super) run: u32,
    pub(super) time: Affine,
    /// For a start: duration of the action. Otherwise 0.
    pub(super) duration: Affine,
    pub(super) measured: Affine,
}

/// A partial plan: a sequence of happenings with a feasible linear program.
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub(super) values: Vec<u32>,
    /// Value of each numeric variable of the task, as an expression over durations.
    pub(super) numbers: Vec<Affine>,
    /// Running actions, sorted by instance; runs of one instance in the order of their starts.
    pub(super) opens: Vec<RunningAction>,
    pub(super) passed: Vec<Passed>,
    /// Column, minimum and maximum (`None` if unbounded) of each chosen duration, sorted by column.
    /// These bounds follow from constraints on this duration and earlier ones.
    ranges: Vec<(Column, Rational, Option<Rational>)>,
    /// Time of the last timed initial literals that have taken place, or -1.
    floor: Int,
    /// Time of the last happening if it violates an over-all condition of a running action. The next happening must
    /// then be simultaneous. `None` if all these conditions hold.
    group: Option<Affine>,
    /// `true` if some happenings of the sequence must be simultaneous, because the first of them violates an
    /// over-all condition.
    pub(super) has_simultaneous: bool,
    /// Sum of the costs of the happenings, in the task's cost unit.
    pub(super) cost: Rational,
    pub(super) program: Program,
}

fn rational(number: Int) -> Rational {
    Rational::from_integer(number)
}

impl Course {
    pub(super) fn new(concurrent: &TemporalTask) -> Self {
        let State { values, numbers } = concurrent.task.initial.clone();
        Self {
            values,
            numbers: numbers.into_iter().map(|number| Affine::constant(rational(number))).collect(),
            opens: Vec::new(),
            passed: Vec::new(),
            ranges: Vec::new(),
            floor: -1,
            group: None,
            has_simultaneous: false,
            cost: rational(0),
            program: Program::new(Affine::column(MAKESPAN)),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let numbers = self.numbers.iter().map(Affine::bytes);
        // `Affine::bytes` includes the expression itself. `size_of::<Passed>()` is added for the
        // table of traces, which stores less than this amount for each happening.
        let times = self.passed.iter().map(|passed| {
            let bytes = passed.time.bytes().saturating_add(passed.duration.bytes());
            bytes.saturating_add(passed.measured.bytes()).saturating_add(size_of::<Passed>())
        });
        let runs = self.opens.iter().map(|open| {
            let expressions = [Some(&open.end), open.number.as_ref(), open.last.as_ref()];
            expressions.into_iter().flatten().map(Affine::bytes).fold(0, usize::saturating_add)
        });
        let fixed_size = size_of_val(&self.values[..]).saturating_add(size_of_val(&self.ranges[..]));
        let group = self.group.as_ref().map_or(0, Affine::bytes);
        let fixed_size = fixed_size.saturating_add(group).saturating_add(self.program.bytes());
        numbers.chain(times).chain(runs).fold(fixed_size, usize::saturating_add)
    }

    /// Current propositional state. Its numbers are the initial ones, because the actual values are
    /// expressions in `numbers`.
    pub(super) fn state(&self, concurrent: &TemporalTask) -> State {
        State { values: self.values.clone(), numbers: concurrent.task.initial.numbers.clone() }
    }

    /// Instances of the running actions; an instance occurs once for each of its simultaneous runs.
    pub(super) fn instances(&self) -> impl Iterator<Item = u32> {
        self.opens.iter().map(|open| open.instance)
    }

    /// Returns `true` if the over-all conditions of all running actions hold, apart from comparisons.
    pub(super) fn is_settled(&self) -> bool {
        self.group.is_none()
    }

    fn runs(&self, instance: u32) -> usize {
        self.instances().filter(|open| *open == instance).count()
    }

    /// Position in `opens` of a run of an instance; `run` counts the simultaneous runs of the
    /// instance by start. Returns `None` if there is no such run.
    fn position(&self, instance: u32, run: u32) -> Option<usize> {
        let mut runs = (0..self.opens.len()).filter(|position| self.opens[*position].instance == instance);
        runs.nth(run as usize)
    }

    /// Possible ends of running actions, each with the index of the run. Runs of an instance without a duration
    /// variable have equal durations, so only the first of them can end.
    pub(super) fn ends(&self, concurrent: &TemporalTask) -> impl Iterator<Item = (OperatorId, u32)> {
        let mut before: Option<(u32, u32)> = None;
        let runs = self.instances().map(move |instance| {
            let run = before
                .filter(|(previous, _)| *previous == instance)
                .map_or(0, |(_, run)| run.saturating_add(1));
            before = Some((instance, run));
            (&concurrent.instances[instance as usize], run)
        });
        runs.filter(|(candidate, run)| *run == 0 || candidate.timer.is_some())
            .map(|(candidate, run)| (candidate.end, run))
    }

    /// Returns the partial plan after a happening. `run` identifies the run if the happening is an
    /// end. Returns `None` if the happening is not applicable, or if no times and durations satisfy the
    /// constraints.
    pub(super) fn after(
        &self,
        concurrent: &TemporalTask,
        happening: (OperatorId, u32),
        limits: &Limits,
    ) -> Result<Option<Self>, Interrupted> {
        let Some((mut next, constraints)) = self.extended(concurrent, happening) else { return Ok(None) };
        if !next.program.constrain(&constraints, limits)? {
            return Ok(None);
        }
        // Once the program minimises the metric itself, its optimum is a lower bound for every
        // continuation.
        if concurrent.is_whole && !concurrent.task.objective.rest.is_empty() {
            let is_bounded = next.program.minimise(&next.value_of_plan(concurrent), limits)?;
            debug_assert!(is_bounded, "what only grows has a least value");
        }
        Ok(Some(next))
    }

    /// Returns the partial plan after a happening, and the constraints that its program must still get. Returns
    /// `None` if the happening is not applicable, or if a constraint is certainly violated.
    fn extended(
        &self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
    ) -> Option<(Self, Vec<Affine>)> {
        let role = concurrent.happenings[operator.index()].role;
        if !self.admits(concurrent, (operator, run), role) {
            return None;
        }
        let schema = &concurrent.task.operators[operator.index()];
        let mut after = self.state(concurrent);
        schema.apply_propositionally(&self.values, &mut after.values);
        concurrent.task.evaluate_axioms(&mut after);
        if let Role::End(instance) = role
            && self.runs(instance) == 1
        {
            concurrent.end_last_run(instance, &mut after);
        }
        let mut next = Self { values: after.values, ..self.clone() };
        next.cost += rational(schema.cost.constant);
        let mut constraints = Vec::new();
        next.count(concurrent, (operator, run), role, &mut constraints)?;
        next.pass(concurrent, (operator, run), role, &mut constraints)?;
        next.keep_up(concurrent, operator, role, &mut constraints)?;
        Some((next, constraints))
    }

    /// Returns `true` if a happening is applicable, ignoring numeric conditions, over-all conditions
    /// and times.
    fn admits(&self, concurrent: &TemporalTask, (operator, run): (OperatorId, u32), role: Role) -> bool {
        let designs = &concurrent.happenings[operator.index()].designs;
        let clashes = || {
            designs.iter().any(|(function, design)| {
                let mut used = self.instances().flat_map(|open| &concurrent.instances[open as usize].designs);
                used.any(|(candidate, other)| candidate == function && other != design)
            })
        };
        let is_possible = match role {
            Role::Start(instance) => {
                self.runs(instance) < concurrent.instances[instance as usize].most as usize && !clashes()
            }
            Role::End(instance) => self.position(instance, run).is_some(),
            Role::Whole => !clashes(),
            Role::Timed(_) => true,
            Role::Never => false,
        };
        is_possible
            && concurrent.task.operators[operator.index()].condition.holds_propositionally(&self.values)
    }

    /// Updates the numbers after a happening, and adds its numeric conditions to `constraints`. For
    /// the start of an action with a chosen duration, also stores the bounds of the duration. Returns
    /// `None` if a condition is certainly violated.
    fn count(
        &mut self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
        role: Role,
        constraints: &mut Vec<Affine>,
    ) -> Option<()> {
        let schema = &concurrent.task.operators[operator.index()];
        let ending = if let Role::End(instance) = role { Some(instance) } else { None };
        let timer = ending.and_then(|instance| concurrent.instances[instance as usize].timer);
        if let (Some(instance), Some((number, _))) = (ending, timer) {
            let run_to_end = &self.opens[self.position(instance, run)?];
            self.numbers[number.index()] = run_to_end.number.clone()?;
        }
        let column = duration_of(self.passed.len());
        let chosen = chosen(concurrent, role);
        if let Some((number, factor)) = chosen.and_then(|instance| instance.timer) {
            self.numbers[number.index()] = Affine::column(column).times(&rational(factor).recip());
        }
        for linear in schema.condition.linears() {
            ask(self.value(linear), constraints)?;
        }
        if chosen.is_some() {
            self.note_range(column, rational(concurrent.separation), constraints)?;
        }
        let new_values: Vec<_> = schema
            .numeric_effects
            .iter()
            .map(|effect| (effect.variable, self.value(&effect.value)))
            .collect();
        for (variable, value) in new_values {
            self.numbers[variable.index()] = value;
        }
        if let Some((number, _)) = timer {
            self.numbers[number.index()] = Affine::default();
        }
        Some(())
    }

    pub(super) fn value(&self, linear: &Linear<Int>) -> Affine {
        let constant = Affine::constant(linear.quantity.at(&[], &[]).to_rational());
        let terms = linear.coefficients.iter();
        terms.fold(constant, |sum, (variable, factor)| {
            sum.plus(&self.numbers[variable.index()], &rational(*factor))
        })
    }

    /// Value of an expression in an over-all condition of a running action. All runs of an instance
    /// share one duration variable; the expression reads the duration of this run.
    fn value_during(&self, concurrent: &TemporalTask, open: &RunningAction, linear: &Linear<Int>) -> Affine {
        let value = self.value(linear);
        let timer = concurrent.instances[open.instance as usize].timer;
        let Some(((timer, _), number)) = timer.zip(open.number.as_ref()) else { return value };
        let factor = linear.coefficients.iter().find(|(variable, _)| *variable == timer);
        let Some((_, factor)) = factor else { return value };
        value.plus(&number.minus(&self.numbers[timer.index()]), &rational(*factor))
    }

    /// Adds the constraint that the duration in `column` is at least `least`, and stores the bounds of the
    /// duration that single constraints imply. Returns `None` if the bounds contradict each other.
    fn note_range(&mut self, column: Column, least: Rational, constraints: &mut Vec<Affine>) -> Option<()> {
        constraints.push(Affine::column(column).shifted(&-least.clone()));
        let (mut low, mut high) = (least, None);
        for expression in &*constraints {
            let Some(factor) = expression.coefficient(column) else { continue };
            let mut remainder = expression.clone();
            remainder.substitute(column, &Affine::default());
            let Some(maximum) = self.highest(&remainder) else { continue };
            let bound = -maximum / factor.clone();
            if factor.is_positive() {
                low = low.max(bound);
            } else {
                high = Some(high.map_or(bound.clone(), |least: Rational| least.min(bound)));
            }
        }
        let is_empty = high.as_ref().is_some_and(|high| *high < low);
        self.ranges.push((column, low, high));
        (!is_empty).then_some(())
    }

    /// Upper bound on an expression, from the bounds of the durations in it. Returns `None` if
    /// there is no bound.
    pub(super) fn highest(&self, expression: &Affine) -> Option<Rational> {
        let mut sum = expression.constant.clone();
        for (column, factor) in &expression.terms {
            let position = self.ranges.binary_search_by_key(column, |(candidate, ..)| *candidate).ok()?;
            let (_, low, high) = &self.ranges[position];
            let value = if factor.is_positive() { high.clone()? } else { low.clone() };
            sum += value * factor;
        }
        Some(sum)
    }

    /// Appends a happening with its temporal constraints. Above all, the happening follows the earlier happenings
    /// and precedes the ends of running actions that interfere with it. Returns `None` if a constraint is certainly
    /// violated.
    fn pass(
        &mut self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
        role: Role,
        constraints: &mut Vec<Affine>,
    ) -> Option<()> {
        let position = self.passed.len();
        let mut duration = Affine::default();
        let time = match role {
            Role::Timed(event) => Affine::constant(rational(concurrent.events[event as usize].0)),
            Role::End(instance) => {
                let open = self.position(instance, run)?;
                self.opens.remove(open).end
            }
            _ => Affine::column(time_of(position)),
        };
        if let Some(group) = self.group.take() {
            ask(time.minus(&group), constraints)?;
            ask(group.minus(&time), constraints)?;
        }
        if let Role::Start(instance) = role {
            duration = self.duration(concurrent, instance, position);
            let end = time.plus(&duration, &rational(1));
            constraints.push(Affine::column(MAKESPAN).minus(&end));
            ask(duration.shifted(&rational(concurrent.separation.saturating_neg())), constraints)?;
            // The end must also keep its distances from accesses before the start.
            let after =
                &concurrent.happenings[concurrent.instances[instance as usize].end.index()].accesses.after;
            self.come_after(concurrent, &end, after, constraints)?;
            let last = (!concurrent.instances[instance as usize].joint.is_empty()).then(|| time.clone());
            let place = self.opens.partition_point(|open| open.instance <= instance);
            let timer = concurrent.instances[instance as usize].timer;
            let number = timer.map(|(number, _)| self.numbers[number.index()].clone());
            self.opens.insert(place, RunningAction { instance, end, number, last });
        } else if role == Role::Whole {
            constraints.push(Affine::column(MAKESPAN).minus(&time));
        }
        let happening = &concurrent.happenings[operator.index()];
        if let Role::Timed(event) = role {
            // Earlier happenings are not after the event, and later ones not before it.
            for passed in &self.passed {
                ask(time.minus(&passed.time), constraints)?;
            }
            for open in &self.opens {
                ask(open.end.minus(&time), constraints)?;
            }
            self.floor = concurrent.events[event as usize].0;
        } else if self.floor > 0 {
            ask(time.shifted(&rational(self.floor.saturating_neg())), constraints)?;
        }
        if !matches!(role, Role::End(_)) {
            self.come_after(concurrent, &time, &happening.accesses.after, constraints)?;
        }
        for open in &self.opens {
            let end = &concurrent.happenings[concurrent.instances[open.instance as usize].end.index()];
            if let Some(by) = gap(&end.accesses.after, &happening.accesses.marks) {
                ask(open.end.minus(&time).shifted(&rational(by.saturating_neg())), constraints)?;
            }
        }
        let measured = self.measured(concurrent);
        self.passed.push(Passed { operator, run, time, duration, measured });
        Some(())
    }

    fn duration(&self, concurrent: &TemporalTask, instance: u32, position: usize) -> Affine {
        let action = &concurrent.instances[instance as usize];
        match action.timer {
            _ if action.is_chosen => Affine::column(duration_of(position)),
            Some((number, factor)) => self.numbers[number.index()].times(&rational(factor)),
            None => Affine::constant(rational(action.duration)),
        }
    }

    /// Adds the constraints that `time` is far enough behind earlier happenings. `after` lists the
    /// accesses that `time` must follow, each with the required distance. Returns `None` if a
    /// constraint is certainly violated.
    fn come_after(
        &self,
        concurrent: &TemporalTask,
        time: &Affine,
        after: &[(Key, Int)],
        constraints: &mut Vec<Affine>,
    ) -> Option<()> {
        for passed in &self.passed {
            let marks = &concurrent.happenings[passed.operator.index()].accesses.marks;
            if let Some(by) = gap(after, marks) {
                ask(time.minus(&passed.time).shifted(&rational(by.saturating_neg())), constraints)?;
            }
        }
        Some(())
    }

    /// Adds constraints that the over-all conditions of all running actions hold after the last
    /// happening, `operator`. If a propositional condition does not hold, the next happening must be
    /// simultaneous. Returns `None` if no simultaneous happening can help or a constraint is certainly
    /// violated.
    fn keep_up(
        &mut self,
        concurrent: &TemporalTask,
        operator: OperatorId,
        role: Role,
        constraints: &mut Vec<Affine>,
    ) -> Option<()> {
        let writes = &concurrent.task.operators[operator.index()].numeric_effects;
        let time = self.passed.last()?.time.clone();
        for index in 0..self.opens.len() {
            let RunningAction { instance, ref last, .. } = self.opens[index];
            if let Some(last) = last.as_ref().filter(|_| concurrent.touches(operator, instance)) {
                ask(time.minus(last), constraints)?;
                self.opens[index].last = Some(time.clone());
            }
            let Some(over_all) = concurrent.instances[instance as usize].over_all else { continue };
            let condition = &concurrent.task.operators[over_all.index()].condition;
            if !condition.holds_propositionally(&self.values) {
                if !concurrent.repairs_over_all {
                    return None;
                }
                self.group = Some(time.clone());
                self.has_simultaneous = true;
            }
            for linear in condition.linears() {
                let mentions =
                    |variable| linear.coefficients.iter().any(|(candidate, _)| *candidate == variable);
                if role == Role::Start(instance) || writes.iter().any(|effect| mentions(effect.variable)) {
                    ask(self.value_during(concurrent, &self.opens[index], linear), constraints)?;
                }
            }
        }
        Some(())
    }

    /// Current contribution of the numbers to the metric, in the task's cost unit.
    pub(super) fn measured(&self, concurrent: &TemporalTask) -> Affine {
        let (objective, scale) = (&concurrent.task.objective, concurrent.task.number_scale);
        let unit = rational(objective.scale) / rational(scale);
        objective.rest.iter().fold(Affine::default(), |sum, (variable, factor)| {
            sum.plus(&self.numbers[variable.index()], &(factor.clone() * &unit))
        })
    }

    /// The metric as an expression, in the integer scale of
    /// [`crate::concurrent::measure::Measure`].
    pub(super) fn value_of_plan(&self, concurrent: &TemporalTask) -> Affine {
        let measure = &concurrent.measure;
        let whole = Affine::column(MAKESPAN).times(&rational(measure.time));
        let whole = whole.shifted(&(self.cost.clone() * rational(measure.cost)));
        whole.plus(&self.measured(concurrent), &rational(measure.cost))
    }

    /// Lower bound on the metric of every plan that begins with this sequence. Valid only if the
    /// contribution of numbers to the metric never decreases.
    pub(super) fn least(&self, concurrent: &TemporalTask) -> Rational {
        self.program.value(&self.value_of_plan(concurrent))
    }

    pub(super) fn chosen(&self, concurrent: &TemporalTask) -> impl Iterator<Item = usize> {
        let roles = self.passed.iter().map(|passed| concurrent.happenings[passed.operator.index()].role);
        let positions = roles.enumerate().filter(|(_, role)| chosen(concurrent, *role).is_some());
        positions.map(|(position, _)| position)
    }

    /// Returns `true` if a plan can end here, ignoring numeric goals and times.
    pub(super) fn is_goal(&self, concurrent: &TemporalTask) -> bool {
        let ends =
            |passed: &Passed| !matches!(concurrent.happenings[passed.operator.index()].role, Role::Timed(_));
        self.opens.is_empty()
            && self.passed.last().is_none_or(ends)
            && concurrent.task.goal.holds_propositionally(&self.values)
    }

    /// Further constraints for a plan that ends here: numeric goals, and an end before all pending
    /// timed initial literals. Returns `None` if a constraint is certainly violated.
    pub(super) fn goal(&self, concurrent: &TemporalTask) -> Option<Vec<Affine>> {
        let mut constraints = Vec::new();
        for linear in concurrent.task.goal.linears() {
            ask(self.value(linear), &mut constraints)?;
        }
        for (time, event) in concurrent.events.iter().filter(|(time, _)| *time > self.floor) {
            let before = Affine::constant(rational(time.saturating_sub(1)));
            constraints.push(before.minus(&Affine::column(MAKESPAN)));
            let after = &concurrent.happenings[event.index()].accesses.after;
            self.come_after(concurrent, &Affine::constant(rational(*time)), after, &mut constraints)?;
        }
        Some(constraints)
    }
}

/// Adds the constraint that an expression is at least 0. Returns `None` if the expression is a
/// negative constant.
fn ask(expression: Affine, constraints: &mut Vec<Affine>) -> Option<()> {
    if let Some(value) = expression.known() {
        return (!value.is_negative()).then_some(());
    }
    constraints.push(expression);
    Some(())
}

/// Instance of the action that a happening starts, if the planner chooses its duration; otherwise
/// `None`.
fn chosen(concurrent: &TemporalTask, role: Role) -> Option<&Instance> {
    let Role::Start(instance) = role else { return None };
    Some(&concurrent.instances[instance as usize]).filter(|instance| instance.is_chosen)
}

/// Required distance between an earlier happening with the accesses `marks` and a later one with
/// the constraints `after`. Returns `None` if they do not interfere in this order.
pub(super) fn gap(after: &[(Key, Int)], marks: &[Key]) -> Option<Int> {
    let by = after.iter().filter(|(key, _)| marks.binary_search(key).is_ok());
    by.map(|(_, by)| *by).max()
}
