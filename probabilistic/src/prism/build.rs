//! Declarations, commands and rewards of the syntax tree to those of a program.

use rustc_hash::FxHashMap;

use crate::error::Diagnostic;
use crate::number::Number;
use crate::prism::ast::{self, BinaryOp, Type};
use crate::prism::code::Code;
use crate::prism::compile::Names;
use crate::prism::model::{Command, RewardItem, UNNAMED, Update, Variable};

/// The variables that a guard fixes to one value.
pub fn fixed_values<N: Number>(guard: &Code<N>) -> Vec<(u32, i64)> {
    match guard {
        Code::All(parts) => parts.iter().flat_map(fixed_values).collect(),
        Code::Compare(BinaryOp::Equal, Type::Int, left, right) => match (&**left, &**right) {
            (Code::Variable(variable), Code::Whole(value))
            | (Code::Whole(value), Code::Variable(variable)) => {
                vec![(*variable, *value)]
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

pub fn declare<N: Number>(names: &mut Names<N>, variable: &ast::Variable) -> Result<Variable, Diagnostic> {
    let whole = |names: &mut Names<N>, expression: &ast::Expr, kind| match names.constant(expression, kind)? {
        Code::Whole(value) => Ok(value),
        _ => Err(Diagnostic::new("Q203", expression.place, "a whole number is needed here")),
    };
    let (least, greatest) = match &variable.range {
        None => (0, 1),
        Some((least, greatest)) => (whole(names, least, Type::Int)?, whole(names, greatest, Type::Int)?),
    };
    let is_bool = variable.range.is_none();
    if least > greatest {
        let text = format!("the range [{least}..{greatest}] of `{}` is empty", variable.name);
        return Err(Diagnostic::new("Q207", variable.place, text));
    }
    let initial = match &variable.initial {
        None => least,
        Some(value) => whole(names, value, if is_bool { Type::Bool } else { Type::Int })?,
    };
    if !(least..=greatest).contains(&initial) {
        let text =
            format!("`{}` starts with {initial}, which is not in [{least}..{greatest}]", variable.name);
        return Err(Diagnostic::new("Q207", variable.place, text));
    }
    Ok(Variable { name: variable.name.clone(), is_bool, least, greatest, initial })
}

pub fn compile_command<N: Number>(
    command: &ast::Command,
    names: &mut Names<N>,
    writable: impl Fn(&str) -> bool,
) -> Result<Command<N>, Vec<Diagnostic>> {
    let mut problems = Vec::new();
    let mut keep = |result: Result<Code<N>, Diagnostic>| {
        result.unwrap_or_else(|problem| {
            problems.push(problem);
            Code::Whole(0)
        })
    };
    let guard = keep(names.typed(&command.guard, Type::Bool));
    let mut updates = Vec::new();
    for update in &command.updates {
        let probability = match &update.probability {
            Some(probability) => keep(names.typed(probability, Type::Double)),
            None => Code::Whole(1),
        };
        let probability = match probability.is_constant().then(|| probability.number(&[])) {
            Some(Ok(value)) => Code::Number(value),
            _ => probability,
        };
        let mut assignments = Vec::new();
        for (number, (name, value, place)) in update.assignments.iter().enumerate() {
            let known = names.find_variable(name);
            let problem = match known {
                None => Some(("Q201", format!("`{name}` is no variable of the model"))),
                Some(_) if !writable(name) => {
                    Some(("Q208", format!("this command cannot change `{name}`, which is not of its module")))
                }
                Some(_) if update.assignments[..number].iter().any(|(other, ..)| other == name) => {
                    Some(("Q208", format!("`{name}` is changed twice in one update")))
                }
                Some(_) => None,
            };
            if let Some((code, text)) = problem {
                keep(Err(Diagnostic::new(code, *place, text)));
            } else if let Some((number, kind)) = known {
                assignments.push((number, keep(names.typed(value, kind)), *place));
            }
        }
        updates.push(Update { probability, assignments });
    }
    if problems.is_empty() { Ok(Command { guard, updates, place: command.place }) } else { Err(problems) }
}

pub fn reward_item<N: Number>(
    item: &ast::RewardItem,
    names: &mut Names<N>,
    numbers: &FxHashMap<&str, u32>,
) -> Result<RewardItem<N>, Diagnostic> {
    let action = match &item.action {
        None => None,
        Some(None) => Some(UNNAMED),
        // An action that no command has never happens.
        Some(Some(name)) => Some(numbers.get(name.as_str()).copied().unwrap_or(UNNAMED - 1)),
    };
    let guard = names.typed(&item.guard, Type::Bool)?;
    let reward = names.typed(&item.reward, Type::Double)?;
    Ok(RewardItem { action, guard, reward, place: item.place })
}
