//! Writes the certificates of Pareto fronts. `verify::front` describes what they prove.

use std::path::Path;

use num_bigint::BigInt;
use num_traits::ToPrimitive as _;
use pddl::ast::{Metric, Problem};
use pddl::{print_domain, print_expression, print_problem};
use planner::{Exact, Limits, Point, Status, Task};

use ::verify::front::{MAX_POINTS, can_be_limited, member_directory, member_problem};
use ::verify::manifest::{DOMAIN, FRONT, FRONT_FORMAT, Front, FrontManifest, PROBLEM};

use super::knowledge;
use super::write::{Contents, Ground, write_files, write_manifest, write_with};
use crate::file::create_directory;
use crate::message::{Errors, Message};
use crate::mission::{Mission, Planning as _};

fn wrong(reason: &str) -> Message {
    Message::error("M120", format!("no certificate: {reason}"))
}

/// Writes the certificate of a complete Pareto front into a new directory. `problem` is the problem as it was planned,
/// and `points` are all points of the front, sorted by the first of the `objectives`.
///
/// # Errors
/// Both objectives depend on the total time; the front has no points or too many; one of the certificates that the
/// front needs cannot be written within the limits, or would be rejected (M120); the knowledge base cannot be read again; or the
/// directory cannot be written (M109).
pub fn write_front(
    directory: &Path,
    (mission, problem): (&Mission, &Problem),
    objectives: &[Metric; 2],
    points: &[Point],
    limits: &Limits,
) -> Result<(), Message> {
    // The certificates limit the second objective. The first one takes its place if it cannot be limited.
    let order = match objectives.each_ref().map(can_be_limited) {
        [_, true] => [0, 1],
        [true, false] => [1, 0],
        [false, false] => {
            return Err(wrong("both objectives depend on the total time, which a goal cannot limit"));
        }
    };
    let objectives = order.map(|objective| objectives[objective].clone());
    let mut sorted = Vec::new();
    for point in points {
        let [Some(first), Some(second)] = order.map(|objective| point.values.get(objective)) else {
            return Err(wrong("a point has no values"));
        };
        sorted.push((point, [first, second]));
    }
    if order == [1, 0] {
        sorted.reverse();
    }
    let Some((last, [_, least])) = sorted.last() else { return Err(wrong("the front has no points")) };
    if sorted.len() > MAX_POINTS {
        return Err(wrong(&format!("the front has more than {MAX_POINTS} points")));
    }
    let claim = Front {
        objectives: objectives.each_ref().map(|objective| print_expression(&objective.expression)),
        points: sorted.iter().map(|(_, values)| values.map(ToString::to_string)).collect(),
    };
    let mut files = vec![
        (DOMAIN, print_domain(mission.domain())),
        (PROBLEM, print_problem(problem)),
        (FRONT, claim.text()),
    ];
    files.extend(knowledge::files(mission, limits)?.into_iter().flatten());
    let name = directory.display().to_string();
    let failed = |error: std::io::Error| {
        Message::at("M109", &name, None, format!("the directory cannot be written: {}", error.kind()))
    };
    let whole = create_directory(directory).map_err(failed)?;
    let listed = write_files(whole.path(), &files).map_err(failed)?;
    let member = |position: usize| member_directory(whole.path(), position);
    let mut previous = None;
    for ((point, [first, second]), position) in sorted.iter().zip(0..) {
        let problem = member_problem(problem, &objectives, true, previous.as_ref());
        write_member(&member(position), (mission, &problem), (point, first), limits)?;
        previous = Some(second.to_rational());
    }
    let problem = member_problem(problem, &objectives, false, None);
    write_member(&member(sorted.len()), (mission, &problem), (last, least), limits)?;
    write_manifest(whole.path(), &FrontManifest { format: FRONT_FORMAT.to_owned(), files: listed })
        .map_err(failed)?;
    whole.commit().map_err(failed)
}

fn write_member(
    directory: &Path,
    (mission, problem): (&Mission, &Problem),
    (point, value): (&Point, &Exact),
    limits: &Limits,
) -> Result<(), Message> {
    let first = |errors: Errors| {
        // The front was grounded before, so the limit is not a fault of its task.
        if errors.iter().any(|error| error.code == "E306") {
            return wrong("a limit was reached before the certificates of all points were written");
        }
        let unknown = || wrong("the problem of a point cannot be ground");
        errors.into_vec().into_iter().next().unwrap_or_else(unknown)
    };
    let task = mission.ground(problem, &[], limits).map_err(first)?;
    // The search for the front has used another ground task. The certificate is written and checked for this one, so
    // only the plan and its cost are taken from the point.
    let mut solution = point.solution.clone();
    solution.status = Status::Optimal;
    let (Some(plan), Some(ground), Some(cost)) =
        (&mut solution.plan, &mut solution.ground, operator_costs(&task, value))
    else {
        return Err(wrong("a point has no plan with its values"));
    };
    plan.cost = value.clone();
    ground.cost = cost;
    let text = plan.to_string();
    let contents =
        Contents { mission, problem, task: Ground::Integers(&task), solution: &solution, plan: &text };
    write_with(directory, &contents, [], limits)
}

/// Returns the sum of operator costs that corresponds to this value of the metric. Returns `None` if the sum is not
/// integral, so that no plan has this value, or if it exceeds 128 bits.
fn operator_costs(task: &Task, value: &Exact) -> Option<i128> {
    let scaled = value.to_rational() * BigInt::from(task.objective.scale);
    let scaled = if task.objective.maximize { -scaled } else { scaled };
    let sum = if scaled.is_integer() { scaled.to_integer().to_i128()? } else { return None };
    sum.checked_sub(task.objective.offset)
}
