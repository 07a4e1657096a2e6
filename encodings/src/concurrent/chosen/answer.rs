//! A sequence of happenings that reaches the goal to a plan: the best durations, then the earliest times.

use num_traits::One;

use crate::concurrent::chosen::affine::Affine;
use crate::concurrent::chosen::course::{Course, MAKESPAN, duration_of};
use crate::concurrent::compile::Concurrent;
use crate::concurrent::happening::Role;
use crate::number::Rational;
use crate::plan::{Plan, Step};

/// A plan.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// The metric, as integers of [`crate::concurrent::measure::Measure`] count it.
    pub(super) value: Rational,
    pub(super) plan: Plan,
}

/// The best plan of a sequence; none if its numbers do not reach the goal.
///
/// The metric comes first, then the makespan, then how long actions take, then when they start. A metric without a best value has none here,
/// either: what comes first then is the makespan.
pub(super) fn answer(concurrent: &Concurrent, course: &Course) -> Option<Answer> {
    let mut program = course.program.clone();
    if !program.constrain(&course.goal(concurrent)?) {
        return None;
    }
    let value = value(concurrent, course);
    let durations: Vec<Affine> =
        course.chosen(concurrent).map(|position| Affine::column(duration_of(position))).collect();
    let times: Vec<Affine> = course.passed.iter().map(|passed| passed.time.clone()).collect();
    let sum = |all: &[Affine]| all.iter().fold(Affine::default(), |sum, own| sum.plus(own, &Rational::one()));
    let bounded = program.clone();
    for objective in [value.clone(), Affine::column(MAKESPAN), sum(&durations)] {
        if program.minimise(&objective) {
            let most = Affine::constant(program.least().clone()).minus(&objective);
            let kept = program.constrain([&most]);
            debug_assert!(kept, "the optimum is in reach");
        } else {
            program = bounded.clone();
        }
    }
    let fixed: Vec<Affine> = durations
        .iter()
        .flat_map(|duration| {
            let own = Affine::constant(program.value(duration));
            [own.minus(duration), duration.minus(&own)]
        })
        .collect();
    let kept = program.constrain(&fixed) && program.minimise(&sum(&times));
    debug_assert!(kept, "there are times for these durations");
    let at = |expression: &Affine| program.value(expression);
    let value = at(&value);
    Some(Answer { plan: in_names(concurrent, course, &value, &at), value })
}

/// The metric of a sequence as an expression, in integers of [`crate::concurrent::measure::Measure`].
pub(super) fn value(concurrent: &Concurrent, course: &Course) -> Affine {
    let integer = Rational::from_integer;
    let measure = &concurrent.measure;
    let whole = Affine::column(MAKESPAN).times(&integer(measure.time));
    let whole = whole.shifted(&(integer(course.cost) * integer(measure.cost)));
    whole.plus(&course.measured(concurrent), &integer(measure.cost))
}

/// No plan that begins with a sequence has a lower metric, if numbers that only count in the end only grow.
pub(super) fn least(concurrent: &Concurrent, course: &Course) -> Rational {
    course.program.value(&value(concurrent, course))
}

fn in_names(
    concurrent: &Concurrent,
    course: &Course,
    value: &Rational,
    at: &dyn Fn(&Affine) -> Rational,
) -> Plan {
    let task = &concurrent.task;
    let mut steps = Vec::new();
    let mut before = at(&Course::new(concurrent).measured(concurrent));
    // By instance: the step that it is, and when it ends.
    let mut open: Vec<(u32, usize)> = Vec::new();
    for passed in &course.passed {
        let operator = &task.operators[passed.operator.index()];
        let measured = at(&passed.measured);
        let cost = Rational::from_integer(operator.cost.constant) + &(measured.clone() - &before);
        before = measured;
        let step = (at(&passed.time), passed.operator, at(&passed.duration), cost.clone());
        match concurrent.happenings[passed.operator.index()].role {
            Role::Start(instance) => {
                open.push((instance, steps.len()));
                steps.push(step);
            }
            Role::Whole => steps.push(step),
            Role::End(instance) => {
                let position = open.iter().position(|(own, _)| *own == instance);
                if let Some(position) = position {
                    let (_, start) = open.swap_remove(position);
                    steps[start].3 += cost;
                }
            }
            _ => {}
        }
    }
    steps.sort_by(|one, other| (&one.0, one.1).cmp(&(&other.0, other.1)));
    let steps = steps.into_iter().map(|(start, id, duration, cost)| {
        let cost = if task.objective.maximize { -cost } else { cost };
        Step::new(task, &task.operators[id.index()], &[], (start, duration, cost))
    });
    let mut plan = Plan { steps: steps.collect(), cost: concurrent.measure.metric(value) };
    plan.note_reconfigured();
    plan
}
