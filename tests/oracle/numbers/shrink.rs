//! Delta debugging: shrinks a failing task as long as it fails in the same way.

use super::model::{Action, Condition, Effect, Expr, Happening, Task, decimal, text_of, whole};

pub fn shrink(mut task: Task, fails: &dyn Fn(&Task) -> bool) -> Task {
    loop {
        let smaller = candidates(&task).into_iter().find(|candidate| fails(candidate));
        match smaller {
            Some(smaller) => task = smaller,
            None => return task,
        }
    }
}

/// Returns the tasks with one part removed or simplified, large parts first.
fn candidates(task: &Task) -> Vec<Task> {
    let mut candidate_tasks = Vec::new();
    for position in 0..task.actions.len() {
        let mut smaller = task.clone();
        smaller.actions.remove(position);
        candidate_tasks.push(smaller);
    }
    if task.metric.is_some() {
        candidate_tasks.push(Task { metric: None, ..task.clone() });
    }
    if let Some((maximize, Expr::Sum(parts))) = &task.metric {
        candidate_tasks.extend(
            parts.iter().map(|part| Task { metric: Some((*maximize, part.clone())), ..task.clone() }),
        );
    }
    for goal in without_one(&task.goal) {
        candidate_tasks.push(Task { goal, ..task.clone() });
    }
    for atoms in without_one(&task.atoms) {
        candidate_tasks.push(Task { atoms, ..task.clone() });
    }
    for (position, action) in task.actions.iter().enumerate() {
        for smaller in smaller_actions(action) {
            let mut smaller_task = task.clone();
            smaller_task.actions[position] = smaller;
            candidate_tasks.push(smaller_task);
        }
    }
    candidate_tasks.extend(without_unused(task));
    for (position, (_, _, value)) in task.values.iter().enumerate() {
        let text = text_of(value).expect("an initial value is a decimal");
        let shortened = text.split_once('.').map(|(whole_digits, fraction_digits)| {
            (whole_digits, &fraction_digits[..fraction_digits.len().min(1)])
        });
        let shortened = shortened.map_or(whole(1), |(whole_digits, fraction_digits)| {
            decimal(&format!("{whole_digits}.{fraction_digits}"))
        });
        // Simpler numbers make the printed task easier to understand.
        for simple in [whole(0), whole(1), shortened] {
            if text_of(&simple).is_some_and(|simple| simple.len() < text.len()) {
                let mut smaller_task = task.clone();
                smaller_task.values[position].2 = simple;
                candidate_tasks.push(smaller_task);
            }
        }
    }
    candidate_tasks
}

fn without_one<T: Clone>(items: &[T]) -> Vec<Vec<T>> {
    let without = |position| {
        let mut remaining = items.to_vec();
        remaining.remove(position);
        remaining
    };
    (0..items.len()).map(without).collect()
}

fn smaller_actions(action: &Action) -> Vec<Action> {
    let mut smaller = Vec::new();
    let starts = smaller_happenings(&action.start);
    smaller.extend(starts.into_iter().map(|start| Action { start, ..action.clone() }));
    if let Some(lasting) = &action.lasting {
        let mut add = |end: Happening, over_all: Vec<Condition>, duration: Expr| {
            let lasting = super::model::Lasting { duration, over_all, end };
            smaller.push(Action { lasting: Some(lasting), ..action.clone() });
        };
        for end in smaller_happenings(&lasting.end) {
            add(end, lasting.over_all.clone(), lasting.duration.clone());
        }
        for over_all in without_one(&lasting.over_all) {
            add(lasting.end.clone(), over_all, lasting.duration.clone());
        }
        if !matches!(lasting.duration, Expr::Number(_)) {
            add(lasting.end.clone(), lasting.over_all.clone(), Expr::Number(whole(1)));
        }
    }
    smaller
}

fn smaller_happenings(happening: &Happening) -> Vec<Happening> {
    let Happening { conditions, effects } = happening;
    let with_conditions = without_one(conditions).into_iter();
    let mut smaller: Vec<Happening> =
        with_conditions.map(|conditions| Happening { conditions, effects: effects.clone() }).collect();
    for effects in without_one(effects) {
        smaller.push(Happening { conditions: conditions.clone(), effects });
    }
    for (position, effect) in effects.iter().enumerate() {
        if let Effect::When(_, inner) = effect {
            let mut effects = effects.clone();
            effects.splice(position..=position, inner.clone());
            smaller.push(Happening { conditions: conditions.clone(), effects });
        }
    }
    smaller
}

/// Returns the task without the values of functions that no action, goal or metric uses. `None` if there are
/// no such values.
fn without_unused(task: &Task) -> Option<Task> {
    let bare = Task { values: Vec::new(), ..task.clone() };
    // The printed domain of the task without values declares only the used functions.
    let (domain, problem) = super::print::print(&bare);
    let mut smaller = task.clone();
    smaller.values.retain(|(function, ..)| {
        let name = &task.functions[*function].name;
        [format!("({name} "), format!("({name})")].iter().any(|f| domain.contains(f) || problem.contains(f))
    });
    (smaller.values.len() < task.values.len()).then_some(smaller)
}
