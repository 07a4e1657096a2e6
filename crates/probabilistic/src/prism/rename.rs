//! `module B = A [x=y] endmodule` to a module of its own.

use crate::error::Place;
use crate::prism::ast::{Command, Expr, ExprKind, Module, Named, Update, Variable};

/// A copy of a module with other names. Formulas in it are written out first, because what they name changes, too.
pub fn module(
    original: &Module,
    name: &str,
    place: Place,
    pairs: &[(String, String)],
    formulas: &[Named],
) -> Module {
    let new = |old: &str| pairs.iter().find(|(from, _)| from == old).map(|(_, to)| to.clone());
    let known = |old: &str| new(old).unwrap_or_else(|| old.to_owned());
    let expression = |e: &Expr| {
        let written_out = write_out(e, formulas, formulas.len());
        written_out.replace(&|name| new(name).map(|name| Expr { kind: ExprKind::Name(name), place: e.place }))
    };
    let variable = |v: &Variable| Variable {
        name: known(&v.name),
        range: v.range.as_ref().map(|(least, greatest)| (expression(least), expression(greatest))),
        initial: v.initial.as_ref().map(expression),
        place,
    };
    let update = |u: &Update| Update {
        probability: u.probability.as_ref().map(expression),
        assignments: u
            .assignments
            .iter()
            .map(|(name, value, place)| (known(name), expression(value), *place))
            .collect(),
    };
    let command = |c: &Command| Command {
        action: c.action.as_deref().map(known),
        guard: expression(&c.guard),
        updates: c.updates.iter().map(update).collect(),
        place: c.place,
    };
    Module {
        name: name.to_owned(),
        variables: original.variables.iter().map(variable).collect(),
        commands: original.commands.iter().map(command).collect(),
        place,
    }
}

/// An expression without names of formulas; `depth` stops at formulas that contain themselves.
fn write_out(expression: &Expr, formulas: &[Named], depth: usize) -> Expr {
    let Some(depth) = depth.checked_sub(1) else { return expression.clone() };
    expression.replace(&|name| {
        let formula = formulas.iter().find(|formula| formula.name == name)?;
        Some(write_out(&formula.expression, formulas, depth))
    })
}
