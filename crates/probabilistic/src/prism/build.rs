//! Compiles declarations, commands and rewards of the syntax tree to parts of a program.

use num_traits::Signed;

use crate::error::Diagnostic;
use crate::number::Number;
use crate::prism::ast::{self, Type};
use crate::prism::code::{Code, rounded};
use crate::prism::command::{Command, RewardItem, Update, Variable, probabilities};
use crate::prism::compile::Names;
use crate::prism::guard::Guard;

pub fn declare(names: &mut Names, variable: &ast::Variable) -> Result<Variable, Diagnostic> {
    let whole = |names: &mut Names, expression: &ast::Expr, kind| match names.constant(expression, kind)? {
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

/// Compiles a command. `writable` returns `true` if the command may assign the variable with this
/// name. On failure, returns the first error of each part (guard, probability or assignment).
pub fn compile_command<N: Number>(
    command: &ast::Command,
    names: &mut Names,
    writable: impl Fn(&str) -> bool,
) -> Result<Command<N>, Vec<Diagnostic>> {
    let mut problems = Vec::new();
    // A faulty expression is replaced by a constant, so that the problems of the other parts are reported, too.
    let mut keep = |result: Result<Code, Diagnostic>| {
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
            let declared = names.find_variable(name);
            let problem = match declared {
                None => Some(("Q201", format!("`{name}` is not a variable of the model"))),
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
            } else if let Some((number, kind)) = declared {
                assignments.push((number, keep(names.typed(value, kind)), *place));
            }
        }
        updates.push(Update { probability, assignments });
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    // Constant probabilities that do not sum to 1 are reported in the first state in which the command is enabled.
    let constant = updates.iter().all(|update| update.probability.is_constant());
    let certain = constant.then(|| probabilities(&updates, &[], command.place)).and_then(Result::ok);
    Ok(Command { guard: Guard::new(guard), updates, certain, place: command.place })
}

pub fn reward_item<N: Number>(
    item: &ast::RewardItem,
    names: &mut Names,
) -> Result<RewardItem<N>, Diagnostic> {
    let guard = Guard::new(names.typed(&item.guard, Type::Bool)?);
    let reward = names.typed(&item.reward, Type::Double)?;
    // A constant that is negative or cannot be evaluated is reported when the item is evaluated in a state.
    let value = reward.is_constant().then(|| reward.number(&[]));
    let value = value.and_then(Result::ok).filter(|value| !value.is_negative());
    let certain = value.and_then(|value| rounded(&value).ok());
    Ok(RewardItem { guard, reward, certain, place: item.place })
}
