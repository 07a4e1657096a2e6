//! Expands renamed modules (`module B = A [x=y] endmodule`).

use crate::error::Place;
use crate::prism::ast::{Command, Expr, ExprKind, Module, Named, Update, Variable};

/// Copies a module under a new name and replaces the names in `pairs` (old, new). Formulas are expanded first,
/// because names inside them are replaced, too.
pub fn module(
    original: &Module,
    name: &str,
    place: Place,
    pairs: &[(String, String)],
    formulas: &[Named],
) -> Module {
    let target = |old: &str| pairs.iter().find(|(from, _)| from == old).map(|(_, to)| to.clone());
    let renamed = |old: &str| target(old).unwrap_or_else(|| old.to_owned());
    let expression = |e: &Expr| {
        let expanded = expand_formulas(e, formulas, &[]);
        expanded.replace(&|name| target(name).map(|name| Expr { kind: ExprKind::Name(name), place: e.place }))
    };
    let variable = |v: &Variable| Variable {
        name: renamed(&v.name),
        range: v.range.as_ref().map(|(least, greatest)| (expression(least), expression(greatest))),
        initial: v.initial.as_ref().map(expression),
        place,
    };
    let update = |u: &Update| Update {
        probability: u.probability.as_ref().map(expression),
        assignments: u
            .assignments
            .iter()
            .map(|(name, value, place)| (renamed(name), expression(value), *place))
            .collect(),
    };
    let command = |c: &Command| Command {
        action: c.action.as_deref().map(renamed),
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

/// Expands the formulas in an expression, except those in `open`, the formulas that are being expanded. Circular
/// formulas are errors, which are reported later.
fn expand_formulas(expression: &Expr, formulas: &[Named], open: &[&str]) -> Expr {
    expression.replace(&|name| {
        let formula = formulas.iter().find(|formula| formula.name == name && !open.contains(&name))?;
        let open: Vec<&str> = open.iter().copied().chain([formula.name.as_str()]).collect();
        Some(expand_formulas(&formula.expression, formulas, &open))
    })
}
