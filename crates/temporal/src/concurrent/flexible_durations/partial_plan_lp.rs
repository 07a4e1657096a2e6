//! Partial plans with open times and durations: the happenings so far and their linear program.
//!
//! As in POPF \[1\] and COLIN \[2\]. Each start has a column for its time, and one for its duration if the planner
//! chooses the duration. Numeric fluents are expressions over the durations so far. So are conditions, each of
//! which is a constraint. Interfering happenings are a separation apart, in the order of the sequence. The end
//! of a running action is constrained as soon as its predecessors have happened. The first column is the makespan.
//!
//! \[1\] A. Coles, A. Coles, M. Fox, D. Long: Forward-chaining partial-order planning, ICAPS 2010.
//! \[2\] A. Coles, A. Coles, M. Fox, D. Long: COLIN: planning with continuous linear numeric change, JAIR 44, 2012.

use task::number::{Int, Rational, dense};
use task::task::number::TaskNumber;
use task::task::quantity::Linear;
use task::task::{OperatorId, State};

use crate::concurrent::flexible_durations::affine::{Affine, Column};
use crate::concurrent::flexible_durations::linear_program::Program;
use crate::concurrent::happening::{Instance, Role};
use crate::concurrent::simple_temporal_network::Key;
use crate::concurrent::temporal_task::TemporalTask;

/// The column of the makespan.
pub(super) const MAKESPAN: Column = 0;

/// The column of the time of a start at a position.
#[expect(clippy::arithmetic_side_effects, reason = "sequences are shorter than 2^28")]
pub(super) fn time_of(position: usize) -> Column {
    2 * dense(position) + 2
}

/// The column of the duration that is chosen at a position.
#[expect(clippy::arithmetic_side_effects, reason = "sequences are shorter than 2^28")]
pub(super) fn duration_of(position: usize) -> Column {
    2 * dense(position) + 3
}

/// An action under way.
#[derive(Debug, Clone)]
pub(super) struct RunningAction {
    pub(super) instance: u32,
    /// When it ends.
    end: Affine,
    /// What the number is that holds how long it takes, if one does: other runs of the instance have other ones.
    number: Option<Affine>,
    /// The last happening that has written what its joint condition over all reads, if it has one.
    last: Option<Affine>,
}

/// A happening of the sequence, with its time.
#[derive(Debug, Clone)]
pub(super) struct Passed {
    pub(super) operator: OperatorId,
    /// Of an end, which of the runs of its instance ends, in the order of their starts; 0 for others.
    pub(super) run: u32,
    pub(super) time: Affine,
    /// Of a start, how long the action takes; 0 for others.
    pub(super) duration: Affine,
    /// What the numbers that only count in the end come to afterwards, in the task's cost unit.
    pub(super) measured: Affine,
}

/// A sequence of happenings that can take place at some times, with some durations.
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub(super) values: Vec<u32>,
    /// The numbers of the task.
    pub(super) numbers: Vec<Affine>,
    /// Ascending by instance; of one instance in the order in which its runs have started.
    pub(super) opens: Vec<RunningAction>,
    pub(super) passed: Vec<Passed>,
    /// What each chosen duration can be at least and at most, by the bounds that rest on nothing else; ascending by column.
    ranges: Vec<(Column, Rational, Option<Rational>)>,
    /// The time of the last timed initial literals.
    floor: Int,
    /// In the task's cost unit.
    pub(super) cost: Int,
    pub(super) program: Program,
}

fn rational(number: Int) -> Rational {
    Rational::from_integer(number)
}

impl Course {
    /// When nothing has happened.
    pub(super) fn new(concurrent: &TemporalTask) -> Self {
        let State { values, numbers } = concurrent.task.initial.clone();
        Self {
            values,
            numbers: numbers.into_iter().map(|number| Affine::constant(rational(number))).collect(),
            opens: Vec::new(),
            passed: Vec::new(),
            ranges: Vec::new(),
            floor: -1,
            cost: 0,
            program: Program::new(Affine::column(MAKESPAN)),
        }
    }

    /// About how many bytes it takes.
    pub(super) fn bytes(&self) -> usize {
        let numbers = self.numbers.iter().map(Affine::bytes);
        // Each happening takes about as much again where sequences are told apart.
        let times = self.passed.iter().map(|passed| {
            let own = passed.time.bytes().saturating_add(passed.duration.bytes());
            own.saturating_add(passed.measured.bytes()).saturating_add(size_of::<Passed>())
        });
        let rest = size_of_val(&self.values[..]).saturating_add(self.program.bytes());
        numbers.chain(times).fold(rest, usize::saturating_add)
    }

    pub(super) fn state(&self, concurrent: &TemporalTask) -> State {
        State { values: self.values.clone(), numbers: concurrent.task.initial.numbers.clone() }
    }

    pub(super) fn instances(&self) -> impl Iterator<Item = u32> {
        self.opens.iter().map(|open| open.instance)
    }

    /// How many runs of an instance are under way.
    fn runs(&self, instance: u32) -> usize {
        self.instances().filter(|open| *open == instance).count()
    }

    /// Where the runs of an instance lie among the actions under way.
    fn position(&self, instance: u32, run: u32) -> Option<usize> {
        let mut runs = (0..self.opens.len()).filter(|position| self.opens[*position].instance == instance);
        runs.nth(run as usize)
    }

    /// What can happen but for starts: the ends of what is under way. Of runs that take as long the first one ends first.
    pub(super) fn ends(&self, concurrent: &TemporalTask) -> impl Iterator<Item = (OperatorId, u32)> {
        let mut before: Option<(u32, u32)> = None;
        let runs = self.instances().map(move |instance| {
            let run = before.filter(|(own, _)| *own == instance).map_or(0, |(_, run)| run.saturating_add(1));
            before = Some((instance, run));
            (&concurrent.instances[instance as usize], run)
        });
        runs.filter(|(own, run)| *run == 0 || own.timer.is_some()).map(|(own, run)| (own.end, run))
    }

    /// The sequence after a happening, an end of the given run; none if it has no times and durations.
    pub(super) fn after(
        &self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
    ) -> Option<Self> {
        let role = concurrent.happenings[operator.index()].role;
        if !self.admits(concurrent, (operator, run), role) {
            return None;
        }
        let state = self.state(concurrent);
        let own = &concurrent.task.operators[operator.index()];
        let mut after = concurrent.task.successor(own, &state, &[])?;
        if let Role::End(instance) = role
            && self.runs(instance) == 1
        {
            concurrent.end_last_run(instance, &mut after);
        }
        let mut next =
            Self { values: after.values, cost: self.cost.checked_add(own.cost.constant)?, ..self.clone() };
        let mut asked = Vec::new();
        next.count(concurrent, (operator, run), role, &mut asked)?;
        next.pass(concurrent, (operator, run), role, &mut asked)?;
        next.keep_up(concurrent, operator, role, &mut asked)?;
        if !next.program.constrain(&asked) {
            return None;
        }
        // Where that is the whole metric, no duration makes it better than it can be.
        if concurrent.is_whole && !concurrent.task.objective.rest.is_empty() {
            let is_bounded = next.program.minimise(&next.value_of_plan(concurrent));
            debug_assert!(is_bounded, "what only grows has a least value");
        }
        Some(next)
    }

    /// Whether a happening can come next, but for numbers and times.
    fn admits(&self, concurrent: &TemporalTask, (operator, run): (OperatorId, u32), role: Role) -> bool {
        let designs = &concurrent.happenings[operator.index()].designs;
        let clashes = || {
            designs.iter().any(|(function, design)| {
                let mut used = self.instances().flat_map(|open| &concurrent.instances[open as usize].designs);
                used.any(|(own, other)| own == function && other != design)
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

    /// The numbers after a happening; what its conditions ask of them is added to `asked`.
    fn count(
        &mut self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
        role: Role,
        asked: &mut Vec<Affine>,
    ) -> Option<()> {
        let own = &concurrent.task.operators[operator.index()];
        let ending = if let Role::End(instance) = role { Some(instance) } else { None };
        let timer = ending.and_then(|instance| concurrent.instances[instance as usize].timer);
        if let (Some(instance), Some((number, _))) = (ending, timer) {
            let ended = &self.opens[self.position(instance, run)?];
            self.numbers[number.index()] = ended.number.clone()?;
        }
        let column = duration_of(self.passed.len());
        let chosen = chosen(concurrent, role);
        if let Some((number, factor)) = chosen.and_then(|own| own.timer) {
            self.numbers[number.index()] = Affine::column(column).times(&rational(factor).recip());
        }
        for linear in own.condition.linears() {
            ask(self.value(linear), asked)?;
        }
        if chosen.is_some() {
            self.note_range(column, rational(concurrent.separation), asked)?;
        }
        let changed: Vec<_> =
            own.numeric_effects.iter().map(|effect| (effect.variable, self.value(&effect.value))).collect();
        for (variable, value) in changed {
            self.numbers[variable.index()] = value;
        }
        if let Some((number, _)) = timer {
            self.numbers[number.index()] = Affine::default();
        }
        Some(())
    }

    /// An expression of the task over durations.
    pub(super) fn value(&self, linear: &Linear<Int>) -> Affine {
        let constant = Affine::constant(linear.quantity.at(&[], &[]).to_rational());
        let terms = linear.coefficients.iter();
        terms.fold(constant, |sum, (variable, factor)| {
            sum.plus(&self.numbers[variable.index()], &rational(*factor))
        })
    }

    /// Notes between what bounds a duration lies. None if there is nothing between them.
    fn note_range(&mut self, column: Column, least: Rational, asked: &mut Vec<Affine>) -> Option<()> {
        asked.push(Affine::column(column).shifted(&-least.clone()));
        let (mut low, mut high) = (least, None);
        for expression in &*asked {
            let Some(factor) = expression.coefficient(column) else { continue };
            let mut rest = expression.clone();
            rest.substitute(column, &Affine::default());
            let Some(most) = self.highest(&rest) else { continue };
            let bound = -most / factor.clone();
            if factor.is_positive() {
                low = low.max(bound);
            } else {
                high = Some(high.map_or(bound.clone(), |known: Rational| known.min(bound)));
            }
        }
        let is_empty = high.as_ref().is_some_and(|high| *high < low);
        self.ranges.push((column, low, high));
        (!is_empty).then_some(())
    }

    /// No more than this is an expression over durations; none if there is no such bound.
    pub(super) fn highest(&self, expression: &Affine) -> Option<Rational> {
        let mut sum = expression.constant.clone();
        for (column, factor) in &expression.terms {
            let position = self.ranges.binary_search_by_key(column, |(own, ..)| *own).ok()?;
            let (_, low, high) = &self.ranges[position];
            let value = if factor.is_positive() { high.clone()? } else { low.clone() };
            sum += value * factor;
        }
        Some(sum)
    }

    /// Notes when a happening takes place: after what it interferes with, and before the ends of what is under way that do.
    fn pass(
        &mut self,
        concurrent: &TemporalTask,
        (operator, run): (OperatorId, u32),
        role: Role,
        asked: &mut Vec<Affine>,
    ) -> Option<()> {
        let position = self.passed.len();
        let mut duration = Affine::default();
        let time = match role {
            Role::Timed(time) => Affine::constant(rational(time)),
            Role::End(instance) => {
                let open = self.position(instance, run)?;
                self.opens.remove(open).end
            }
            _ => Affine::column(time_of(position)),
        };
        if let Role::Start(instance) = role {
            duration = self.duration(concurrent, instance, position);
            let end = time.plus(&duration, &rational(1));
            asked.push(Affine::column(MAKESPAN).minus(&end));
            ask(duration.shifted(&rational(concurrent.separation.saturating_neg())), asked)?;
            // What it marked before the start, its end comes after.
            let after =
                &concurrent.happenings[concurrent.instances[instance as usize].end.index()].accesses.after;
            self.come_after(concurrent, &end, after, asked)?;
            let last = (!concurrent.instances[instance as usize].joint.is_empty()).then(|| time.clone());
            let place = self.opens.partition_point(|open| open.instance <= instance);
            let timer = concurrent.instances[instance as usize].timer;
            let number = timer.map(|(number, _)| self.numbers[number.index()].clone());
            self.opens.insert(place, RunningAction { instance, end, number, last });
        } else if role == Role::Whole {
            asked.push(Affine::column(MAKESPAN).minus(&time));
        }
        let happening = &concurrent.happenings[operator.index()];
        if let Role::Timed(at) = role {
            // Nothing so far is after this, and nothing from now on is before.
            for passed in &self.passed {
                ask(time.minus(&passed.time), asked)?;
            }
            for open in &self.opens {
                ask(open.end.minus(&time), asked)?;
            }
            self.floor = at;
        } else if self.floor > 0 {
            ask(time.shifted(&rational(self.floor.saturating_neg())), asked)?;
        }
        if !matches!(role, Role::End(_)) {
            self.come_after(concurrent, &time, &happening.accesses.after, asked)?;
        }
        for open in &self.opens {
            let end = &concurrent.happenings[concurrent.instances[open.instance as usize].end.index()];
            if let Some(by) = gap(&end.accesses.after, &happening.accesses.marks) {
                ask(open.end.minus(&time).shifted(&rational(by.saturating_neg())), asked)?;
            }
        }
        let measured = self.measured(concurrent);
        self.passed.push(Passed { operator, run, time, duration, measured });
        Some(())
    }

    /// How long an instance takes that starts at a position.
    fn duration(&self, concurrent: &TemporalTask, instance: u32, position: usize) -> Affine {
        let own = &concurrent.instances[instance as usize];
        match own.timer {
            _ if own.is_chosen => Affine::column(duration_of(position)),
            Some((number, factor)) => self.numbers[number.index()].times(&rational(factor)),
            None => Affine::constant(rational(own.duration)),
        }
    }

    /// Asks that a time lies after all accesses so far that a happening waits for.
    fn come_after(
        &self,
        concurrent: &TemporalTask,
        time: &Affine,
        after: &[(Key, Int)],
        asked: &mut Vec<Affine>,
    ) -> Option<()> {
        for passed in &self.passed {
            let marks = &concurrent.happenings[passed.operator.index()].accesses.marks;
            if let Some(by) = gap(after, marks) {
                ask(time.minus(&passed.time).shifted(&rational(by.saturating_neg())), asked)?;
            }
        }
        Some(())
    }

    /// Asks that what must hold over all of the actions under way holds now. None if it does not.
    fn keep_up(
        &mut self,
        concurrent: &TemporalTask,
        operator: OperatorId,
        role: Role,
        asked: &mut Vec<Affine>,
    ) -> Option<()> {
        let writes = &concurrent.task.operators[operator.index()].numeric_effects;
        let time = self.passed.last()?.time.clone();
        for index in 0..self.opens.len() {
            let RunningAction { instance, ref last, .. } = self.opens[index];
            if let Some(last) = last.as_ref().filter(|_| concurrent.touches(operator, instance)) {
                ask(time.minus(last), asked)?;
                self.opens[index].last = Some(time.clone());
            }
            let Some(over_all) = concurrent.instances[instance as usize].over_all else { continue };
            let condition = &concurrent.task.operators[over_all.index()].condition;
            if !condition.holds_propositionally(&self.values) {
                return None;
            }
            for linear in condition.linears() {
                let mentions = |variable| linear.coefficients.iter().any(|(own, _)| *own == variable);
                if role == Role::Start(instance) || writes.iter().any(|effect| mentions(effect.variable)) {
                    ask(self.value(linear), asked)?;
                }
            }
        }
        Some(())
    }

    /// What the numbers that only count in the end come to, in the task's cost unit.
    pub(super) fn measured(&self, concurrent: &TemporalTask) -> Affine {
        let (objective, scale) = (&concurrent.task.objective, concurrent.task.number_scale);
        let unit = rational(objective.scale) / rational(scale);
        objective.rest.iter().fold(Affine::default(), |sum, (variable, factor)| {
            sum.plus(&self.numbers[variable.index()], &(factor.clone() * &unit))
        })
    }

    /// The metric as an expression, in integers of [`crate::concurrent::measure::Measure`].
    pub(super) fn value_of_plan(&self, concurrent: &TemporalTask) -> Affine {
        let measure = &concurrent.measure;
        let whole = Affine::column(MAKESPAN).times(&rational(measure.time));
        let whole = whole.shifted(&(rational(self.cost) * rational(measure.cost)));
        whole.plus(&self.measured(concurrent), &rational(measure.cost))
    }

    /// No plan that begins with this has a lower metric, if numbers that only count in the end only grow.
    pub(super) fn least(&self, concurrent: &TemporalTask) -> Rational {
        self.program.value(&self.value_of_plan(concurrent))
    }

    /// The positions at which durations are chosen.
    pub(super) fn chosen(&self, concurrent: &TemporalTask) -> impl Iterator<Item = usize> {
        let roles = self.passed.iter().map(|passed| concurrent.happenings[passed.operator.index()].role);
        let positions = roles.enumerate().filter(|(_, role)| chosen(concurrent, *role).is_some());
        positions.map(|(position, _)| position)
    }

    /// Whether a plan can end here, but for numbers.
    pub(super) fn is_goal(&self, concurrent: &TemporalTask) -> bool {
        let ends =
            |passed: &Passed| !matches!(concurrent.happenings[passed.operator.index()].role, Role::Timed(_));
        self.opens.is_empty()
            && self.passed.last().is_none_or(ends)
            && concurrent.task.goal.holds_propositionally(&self.values)
    }

    /// What the goal asks for besides: of numbers, and that no timed initial literals come any more.
    pub(super) fn goal(&self, concurrent: &TemporalTask) -> Option<Vec<Affine>> {
        let mut asked = Vec::new();
        for linear in concurrent.task.goal.linears() {
            ask(self.value(linear), &mut asked)?;
        }
        for (time, event) in concurrent.events.iter().filter(|(time, _)| *time > self.floor) {
            let before = Affine::constant(rational(time.saturating_sub(1)));
            asked.push(before.minus(&Affine::column(MAKESPAN)));
            let after = &concurrent.happenings[event.index()].accesses.after;
            self.come_after(concurrent, &Affine::constant(rational(*time)), after, &mut asked)?;
        }
        Some(asked)
    }
}

/// Asks that an expression is not below 0. None if it always is.
fn ask(expression: Affine, asked: &mut Vec<Affine>) -> Option<()> {
    if let Some(value) = expression.known() {
        return (!value.is_negative()).then_some(());
    }
    asked.push(expression);
    Some(())
}

/// The instance that a happening starts, if it takes as long as the planner chooses.
fn chosen(concurrent: &TemporalTask, role: Role) -> Option<&Instance> {
    let Role::Start(instance) = role else { return None };
    Some(&concurrent.instances[instance as usize]).filter(|own| own.is_chosen)
}

/// How long what waits for some kinds of access comes after what makes others; none if it does not have to.
pub(super) fn gap(after: &[(Key, Int)], marks: &[Key]) -> Option<Int> {
    let by = after.iter().filter(|(key, _)| marks.binary_search(key).is_ok());
    by.map(|(_, by)| *by).max()
}
