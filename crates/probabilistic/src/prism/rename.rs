//! Expands renamed modules (`module B = A [x=y] endmodule`).

use std::cell::Cell;

use crate::error::{Diagnostic, Place};
use crate::prism::ast::{Command, Expr, ExprKind, Module, Named, Update, Variable};
use crate::prism::compile::{MAX_DEPTH, MAX_LEVELS, MAX_PARTS, TOO_LARGE};

/// The formulas of a model, with a limit on their expansion.
pub struct Formulas {
    formulas: Vec<Named>,
    /// Number of subexpressions that all renamed modules together may still get.
    remaining: Cell<usize>,
}

impl Formulas {
    pub const fn new(formulas: Vec<Named>) -> Self {
        Self { formulas, remaining: Cell::new(MAX_PARTS[1]) }
    }
}

/// Copies a module under a new name and replaces the names in `pairs` (old, new). Formulas are expanded first,
/// because names inside them are replaced, too.
///
/// # Errors
/// An expanded expression is nested too deeply, or the renamed modules have more subexpressions than
/// [`MAX_PARTS`].
pub fn module(
    original: &Module,
    name: &str,
    place: Place,
    pairs: &[(String, String)],
    Formulas { formulas, remaining }: &Formulas,
) -> Result<Module, Diagnostic> {
    let target = |old: &str| pairs.iter().find(|(from, _)| from == old).map(|(_, to)| to.clone());
    let renamed = |old: &str| target(old).unwrap_or_else(|| old.to_owned());
    let expression = |e: &Expr| {
        let limit = MAX_PARTS[0].min(remaining.get());
        let parts = Cell::new(limit);
        let expanded = expand_formulas(e, formulas, (&[], 0), &parts);
        let used = if parts.get() == 0 { MAX_PARTS[1] } else { limit.saturating_sub(parts.get()) };
        remaining.set(remaining.get().saturating_sub(used));
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
    let module = Module {
        name: name.to_owned(),
        variables: original.variables.iter().map(variable).collect(),
        commands: original.commands.iter().map(command).collect(),
        place,
    };
    if remaining.get() == 0 { Err(Diagnostic::new("Q104", place, TOO_LARGE)) } else { Ok(module) }
}

/// Expands the formulas in an expression, except those in `open`, the formulas that are being expanded. The second part
/// of `open` is the sum of their levels without the innermost one. Circular formulas are errors, which are reported
/// later. `remaining` is the number of subexpressions that may still be added;
/// at 0, the result is incomplete.
fn expand_formulas(
    expression: &Expr,
    formulas: &[Named],
    (open, levels): (&[&str], usize),
    remaining: &Cell<usize>,
) -> Expr {
    let levels = levels.saturating_add(expression.levels());
    if open.len() > MAX_DEPTH || levels > MAX_LEVELS {
        remaining.set(0);
    }
    expression.rewrite(&mut |part| {
        remaining.set(remaining.get().saturating_sub(1));
        if remaining.get() == 0 {
            return Some(part.clone());
        }
        let ExprKind::Name(name) = &part.kind else { return None };
        let formula =
            formulas.iter().find(|formula| formula.name == *name && !open.contains(&name.as_str()))?;
        let open: Vec<&str> = open.iter().copied().chain([formula.name.as_str()]).collect();
        Some(expand_formulas(&formula.expression, formulas, (&open, levels), remaining))
    })
}
