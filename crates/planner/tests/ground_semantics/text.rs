//! Generated files must be read without errors, and printing and reading must yield equal trees. The
//! validator must judge plans as the interpreter does.

use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, has_errors, parse_domain, parse_problem, print_domain, print_problem, read, render};

use crate::ground_semantics::interpret::{State, Step};
use crate::ground_semantics::model::{Number, OBJECTS, Task, function_text};

pub fn trees(task: &Task) -> (Domain, Problem) {
    let (domain, problem) = (Source::new("domain", task.domain()), Source::new("problem", task.problem()));
    match read(&domain, &problem) {
        Ok((domain, problem, _)) => (domain, problem),
        Err(found) => panic!("{}", render(&found, &[&domain, &problem], false)),
    }
}

fn without_places(tree: &impl std::fmt::Debug) -> String {
    let text = format!("{tree:?}");
    let mut parts = text.split("Span { start: ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |kept, part| kept + part.split_once(" }").map_or(part, |(_, rest)| rest))
}

pub fn check_printing(domain: &Domain, problem: &Problem) {
    let source = Source::new("printed domain", print_domain(domain));
    let (again, found) = parse_domain(&source);
    assert!(!has_errors(&found), "{}", render(&found, &[&source], false));
    assert_eq!(again.map(|tree| without_places(&tree)), Some(without_places(domain)), "{}", source.text());
    let source = Source::new("printed problem", print_problem(problem));
    let (again, found) = parse_problem(&source);
    assert!(!has_errors(&found), "{}", render(&found, &[&source], false));
    assert_eq!(again.map(|tree| without_places(&tree)), Some(without_places(problem)), "{}", source.text());
}

fn decimal(value: Number) -> String {
    // The tolerance of the validator does not matter here, because all stated numbers are multiples of 1/2.
    format!("{}.{}", value.trunc(), if value.is_integer() { 0 } else { 5 })
}

fn step_text((action, objects, duration): &Step) -> String {
    let objects: Vec<_> = objects.iter().map(|object| OBJECTS[*object].0).collect();
    let sign = if duration.is_some_and(|duration| duration < Number::from_integer(0)) { "-" } else { "" };
    let positive = duration.map(|duration| if sign == "-" { -duration } else { duration });
    let duration = positive.map_or(String::new(), |duration| format!(" [{sign}{}]", decimal(duration)));
    format!("(a{action} {}){duration}\n", objects.join(" "))
}

/// Executes a plan. The error is the number of the first inapplicable step (0 for an unsatisfied goal).
fn interpret(task: &Task, plan: &[Step]) -> Result<State, usize> {
    let mut state = State::initial(task);
    for (number, step) in plan.iter().enumerate() {
        state = state.after(task, step).ok_or(number + 1)?;
    }
    if state.is_goal(task) { Ok(state) } else { Err(0) }
}

/// Limit on numerators and denominators. Products of larger numbers could overflow in the interpreter.
const LARGE: i128 = 200;

/// Cuts the plan before the first step that makes a number larger than [`LARGE`]. The goal is thus
/// never evaluated with a larger number.
fn with_small_numbers<'s>(task: &Task, plan: &'s [Step]) -> &'s [Step] {
    let mut state = State::initial(task);
    for (number, step) in plan.iter().enumerate() {
        let Some(after) = state.after(task, step) else { return plan };
        if after
            .values
            .values()
            .chain([&after.time])
            .any(|value| value.numer().abs().max(*value.denom()) > LARGE)
        {
            return &plan[..number];
        }
        state = after;
    }
    plan
}

/// Compares the validator with the interpreter. Returns `true` if the plan is valid.
pub fn check_plan(task: &Task, (domain, problem): &(Domain, Problem), plan: &[Step]) -> bool {
    let plan = with_small_numbers(task, plan);
    let text: String = plan.iter().map(step_text).collect();
    let parsed = PlanText::parse(&Source::new("plan", text.clone())).expect("a generated plan is read");
    let options = Options::default().with_tolerance(num_rational::BigRational::default());
    let verdict = validate(domain, problem, &parsed, &options);
    let found = match &verdict.violation {
        None => Ok(()),
        Some(violation) => Err(violation.step.unwrap_or(0)),
    };
    let expected = interpret(task, plan);
    let context = || format!("{}\n{}\n{text}{:?}", task.domain(), task.problem(), verdict.violation);
    assert_eq!(found, expected.as_ref().map(|_| ()).map_err(|step| *step), "{}", context());
    let Ok(state) = expected else { return false };
    assert_eq!(verdict.total_time.to_string(), state.time.to_string(), "{}", context());
    let metric = |value: Option<String>| value.unwrap_or_default();
    assert_eq!(
        metric(verdict.metric.map(|value| value.to_string())),
        metric(state.metric(task).map(|value| value.to_string())),
    );
    for (name, value) in &verdict.values {
        let own = state.values.iter().find(|(atom, _)| function_text(atom) == *name);
        assert_eq!(own.map(|(_, own)| own.to_string()), Some(value.to_string()), "{name}");
    }
    true
}
