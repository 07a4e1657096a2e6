//! Formats models as text in the PRISM language.

use std::fmt::Write as _;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::prism::ast::{BinaryOp, Expr, ExprKind, Model, ModelKind, Variable};
use crate::prism::reserved::is_reserved;

/// Formats a model as text that PRISM and Storm can parse.
pub fn write(model: &Model) -> String {
    let mut text = String::new();
    for line in model.remark.lines() {
        let _ = writeln!(text, "// {line}");
    }
    let kind = if model.kind == ModelKind::Mdp { "mdp" } else { "dtmc" };
    let _ = writeln!(text, "{kind}\n");
    for constant in &model.constants {
        let _ = write!(text, "const {} {}", constant.kind.name(), constant.name);
        if let Some(value) = &constant.value {
            let _ = write!(text, " = {}", expression(value));
        }
        text.push_str(";\n");
    }
    for formula in &model.formulas {
        let _ = writeln!(text, "formula {} = {};", formula.name, expression(&formula.expression));
    }
    for global in &model.globals {
        let _ = writeln!(text, "global {}", variable(global));
    }
    for module in &model.modules {
        let _ = writeln!(text, "\nmodule {}", module.name);
        for declared in &module.variables {
            let _ = writeln!(text, "  {}", variable(declared));
        }
        for command in &module.commands {
            let _ = write!(text, "  [{}] ", command.action.as_deref().unwrap_or(""));
            let _ = write!(text, "{} -> ", expression(&command.guard));
            for (number, update) in command.updates.iter().enumerate() {
                if number > 0 {
                    text.push_str(" + ");
                }
                if let Some(probability) = &update.probability {
                    let _ = write!(text, "{}:", expression(probability));
                }
                let parts = update
                    .assignments
                    .iter()
                    .map(|(name, value, _)| format!("({name}'={})", expression(value)));
                let parts: Vec<_> = parts.collect();
                text.push_str(if parts.is_empty() { "true" } else { "" });
                text.push_str(&parts.join("&"));
            }
            text.push_str(";\n");
        }
        text.push_str("endmodule\n");
    }
    for rewards in &model.rewards {
        let name = if rewards.name.is_empty() { String::new() } else { format!(" \"{}\"", rewards.name) };
        let _ = writeln!(text, "\nrewards{name}");
        for item in &rewards.items {
            text.push_str("  ");
            if let Some(action) = &item.action {
                let _ = write!(text, "[{}] ", action.as_deref().unwrap_or(""));
            }
            let _ = writeln!(text, "{} : {};", expression(&item.guard), expression(&item.reward));
        }
        text.push_str("endrewards\n");
    }
    if let Some(states) = &model.initial {
        let _ = writeln!(text, "\ninit {} endinit", expression(states));
    }
    if !model.labels.is_empty() {
        text.push('\n');
    }
    for label in &model.labels {
        let _ = writeln!(text, "label \"{}\" = {};", label.name, expression(&label.expression));
    }
    text
}

fn variable(variable: &Variable) -> String {
    let range = match &variable.range {
        None => "bool".to_owned(),
        Some((least, greatest)) => format!("[{}..{}]", expression(least), expression(greatest)),
    };
    let initial = variable.initial.as_ref().map(|value| format!(" init {}", expression(value)));
    format!("{} : {range}{};", variable.name, initial.unwrap_or_default())
}

pub fn expression(expression: &Expr) -> String {
    operand(expression, 0)
}

/// Formats an expression as an operand; adds parentheses if its precedence is below `least`.
#[expect(clippy::arithmetic_side_effects, reason = "strengths are below 20")]
fn operand(expression: &Expr, least: u8) -> String {
    let (text, strength) = match &expression.kind {
        ExprKind::Bool(value) => (value.to_string(), 20),
        // A negative number has the precedence of a unary minus.
        ExprKind::Int(value) => (value.to_string(), if *value < 0 { 11 } else { 20 }),
        ExprKind::Number(value) => decimal(value),
        ExprKind::Name(name) => (name.clone(), 20),
        ExprKind::Label(label) => (format!("\"{label}\""), 20),
        ExprKind::Not(inner) => (format!("!{}", operand(inner, 12)), 6),
        ExprKind::Negative(inner) => (format!("-{}", operand(inner, 12)), 11),
        ExprKind::Binary(op, left, right) => {
            let (sign, strength) = op.sign();
            let space = if strength <= 4 { " " } else { "" };
            // Operators associate to the left. In PRISM, `=>` associates to the right since version 4.9, but not
            // earlier, and not in Storm. So an implication as an operand of `=>` gets parentheses on both sides.
            let least_left = if *op == BinaryOp::Implies { strength + 1 } else { strength };
            let least_right = strength + 1;
            let (left, right) = (operand(left, least_left), operand(right, least_right));
            (format!("{left}{space}{sign}{space}{right}"), strength)
        }
        ExprKind::If(condition, then, otherwise) => {
            let condition = operand(condition, 2);
            (format!("{condition} ? {} : {}", operand(then, 2), operand(otherwise, 2)), 1)
        }
        ExprKind::Call(function, arguments) => {
            let arguments: Vec<_> = arguments.iter().map(|argument| operand(argument, 0)).collect();
            (format!("{}({})", function.name(), arguments.join(",")), 20)
        }
        // Models contain no properties.
        ExprKind::Property(_) | ExprKind::Temporal(_) => ("true".to_owned(), 20),
    };
    if strength < least { format!("({text})") } else { text }
}

/// Formats a rational as a decimal if that needs at most 30 decimal places, otherwise as a fraction. Also returns the
/// precedence of the text.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "at most 30 places, and digits are padded to more than there are places"
)]
pub(crate) fn decimal(value: &BigRational) -> (String, u8) {
    let mut scaled = value.clone();
    for places in 0..=30 {
        if scaled.denom().is_one() {
            let digits = scaled.numer().abs().to_string();
            let digits = format!("{digits:0>width$}", width = places + 1);
            let (whole, fraction) = digits.split_at(digits.len() - places);
            let sign = if value.is_negative() { "-" } else { "" };
            let fraction = if fraction.is_empty() { "0" } else { fraction };
            return (format!("{sign}{whole}.{fraction}"), if sign.is_empty() { 20 } else { 11 });
        }
        scaled *= BigInt::from(10);
    }
    (format!("{}/{}", value.numer(), value.denom()), 10)
}

/// Converts any name to an identifier that PRISM accepts: invalid characters become `_`, `_` is inserted into
/// an empty name and before a leading digit, and `_` is appended to reserved words. Different names can yield
/// the same identifier.
pub fn identifier(name: &str) -> String {
    let mut text: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if text.is_empty() || text.starts_with(|c: char| c.is_ascii_digit()) {
        text.insert(0, '_');
    }
    if is_reserved(&text) {
        text.push('_');
    }
    text
}
