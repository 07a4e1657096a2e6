//! Makes a task on which something fails smaller, as long as the same fails.

use super::model::{Action, Condition, Effect, Expr, Happening, Task, decimal, text_of, whole};

/// A smaller task that still fails.
pub fn shrink(mut task: Task, fails: &dyn Fn(&Task) -> bool) -> Task {
    loop {
        let smaller = candidates(&task).into_iter().find(|candidate| fails(candidate));
        match smaller {
            Some(smaller) => task = smaller,
            None => return task,
        }
    }
}

/// Tasks that lack one thing, the largest things first.
fn candidates(task: &Task) -> Vec<Task> {
    let mut all = Vec::new();
    for position in 0..task.actions.len() {
        let mut smaller = task.clone();
        smaller.actions.remove(position);
        all.push(smaller);
    }
    if task.metric.is_some() {
        all.push(Task { metric: None, ..task.clone() });
    }
    if let Some((maximize, Expr::Sum(parts))) = &task.metric {
        all.extend(parts.iter().map(|part| Task { metric: Some((*maximize, part.clone())), ..task.clone() }));
    }
    for goal in without_one(&task.goal) {
        all.push(Task { goal, ..task.clone() });
    }
    for atoms in without_one(&task.atoms) {
        all.push(Task { atoms, ..task.clone() });
    }
    for (position, action) in task.actions.iter().enumerate() {
        for smaller in smaller_actions(action) {
            let mut with = task.clone();
            with.actions[position] = smaller;
            all.push(with);
        }
    }
    all.extend(without_unused(task));
    for (position, (_, _, value)) in task.values.iter().enumerate() {
        let text = text_of(value).expect("an initial value is a decimal");
        let short = text.split_once('.').map(|(before, after)| (before, &after[..after.len().min(1)]));
        let short = short.map_or(whole(1), |(before, after)| decimal(&format!("{before}.{after}")));
        for simple in [whole(0), whole(1), short] {
            if text_of(&simple).is_some_and(|simple| simple.len() < text.len()) {
                let mut with = task.clone();
                with.values[position].2 = simple;
                all.push(with);
            }
        }
    }
    all
}

fn without_one<T: Clone>(of: &[T]) -> Vec<Vec<T>> {
    let without = |position| {
        let mut rest = of.to_vec();
        rest.remove(position);
        rest
    };
    (0..of.len()).map(without).collect()
}

fn smaller_actions(action: &Action) -> Vec<Action> {
    let mut all = Vec::new();
    let starts = smaller_happenings(&action.start);
    all.extend(starts.into_iter().map(|start| Action { start, ..action.clone() }));
    if let Some(lasting) = &action.lasting {
        let mut with = |end: Happening, over_all: Vec<Condition>, duration: Expr| {
            let lasting = super::model::Lasting { duration, over_all, end };
            all.push(Action { lasting: Some(lasting), ..action.clone() });
        };
        for end in smaller_happenings(&lasting.end) {
            with(end, lasting.over_all.clone(), lasting.duration.clone());
        }
        for over_all in without_one(&lasting.over_all) {
            with(lasting.end.clone(), over_all, lasting.duration.clone());
        }
        if !matches!(lasting.duration, Expr::Number(_)) {
            with(lasting.end.clone(), lasting.over_all.clone(), Expr::Number(whole(1)));
        }
    }
    all
}

fn smaller_happenings(happening: &Happening) -> Vec<Happening> {
    let Happening { conditions, effects } = happening;
    let with_conditions = without_one(conditions).into_iter();
    let mut all: Vec<Happening> =
        with_conditions.map(|conditions| Happening { conditions, effects: effects.clone() }).collect();
    for effects in without_one(effects) {
        all.push(Happening { conditions: conditions.clone(), effects });
    }
    for (position, effect) in effects.iter().enumerate() {
        if let Effect::When(_, inner) = effect {
            let mut effects = effects.clone();
            effects.splice(position..=position, inner.clone());
            all.push(Happening { conditions: conditions.clone(), effects });
        }
    }
    all
}

/// Without the values of functions that nothing mentions.
fn without_unused(task: &Task) -> Option<Task> {
    let bare = Task { values: Vec::new(), ..task.clone() };
    let (domain, problem) = super::print::print(&bare);
    let mut smaller = task.clone();
    smaller.values.retain(|(function, ..)| {
        let name = &task.functions[*function].name;
        [format!("({name} "), format!("({name})")].iter().any(|f| domain.contains(f) || problem.contains(f))
    });
    // The domain of the bare task declares what it mentions only.
    (smaller.values.len() < task.values.len()).then_some(smaller)
}
