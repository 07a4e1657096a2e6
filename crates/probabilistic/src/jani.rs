//! Translates PRISM models to JANI (jani-spec.org, version 1).
//!
//! Each module becomes an automaton with a single location. Automata synchronise on their common
//! actions. Labels become transient Boolean variables; reward structures become transient real
//! variables. Formulas, and labels in expressions, are expanded; names of labels and reward
//! structures that collide with other names get a prefix.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::convert::Infallible;

use num_traits::ToPrimitive;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

use crate::error::{Diagnostic, Error, Place};
use crate::graph::visit_components;
use crate::prism::ast::{
    BinaryOp, Command, Expr, ExprKind, Function, Model, ModelKind, Module, Named, RewardItem, Rewards, Type,
    Variable,
};
use crate::prism::{MAX_DEPTH, MAX_LEVELS};

/// Upper limit on the number of subexpressions of all expressions of a document.
const MAX_PARTS: usize = 500_000;
/// The message about a document beyond [`MAX_PARTS`], or about formulas beyond [`MAX_DEPTH`] or [`MAX_LEVELS`].
const TOO_LARGE: &str = "after the expansion of its formulas, the document would be nested too deeply or have more than \
                         500,000 subexpressions";

/// Translates a PRISM model to JANI. Undefined constants become parameters of the JANI model.
///
/// # Errors
/// A construct that JANI cannot express (rewards of commands without an action), a formula whose
/// definition contains itself, or expressions that are too large after the expansion of formulas.
pub fn write(name: &str, model: &Model) -> Result<Value, Error> {
    let recursive = recursive_formulas(model);
    if !recursive.is_empty() {
        return Err(Error::Model(recursive.into()));
    }
    let writer = Writer { model, remaining: Cell::new(MAX_PARTS), open: Cell::new((0, 0)) };
    let mut problems = Vec::new();
    let actions = actions(model);
    let globals = model.modules.iter().flat_map(|module| &module.variables).chain(&model.globals);
    let mut variables: Vec<Value> = globals.map(|variable| writer.variable(variable)).collect();
    for label in &model.labels {
        let name = label_name(model, &label.name);
        variables.push(json!({ "name": name, "type": "bool", "transient": true, "initial-value": false }));
    }
    for rewards in &model.rewards {
        let name = reward_name(model, &rewards.name);
        variables.push(json!({ "name": name, "type": "real", "transient": true, "initial-value": 0 }));
    }
    // Only the first automaton assigns labels and state rewards.
    let automata: Vec<Value> = model
        .modules
        .iter()
        .enumerate()
        .map(|(number, module)| writer.automaton(model, module, number == 0))
        .collect();
    for rewards in &model.rewards {
        for item in rewards.items.iter().filter(|item| item.action == Some(None)) {
            let text =
                "rewards of commands without action cannot be written as JANI; give the commands a name";
            problems.push(Diagnostic::new("Q404", item.place, text));
        }
    }
    if !problems.is_empty() {
        return Err(Error::Model(problems.into()));
    }
    let constants = model.constants.iter().map(|constant| {
        let mut entry = json!({ "name": constant.name, "type": type_name(constant.kind) });
        if let Some(value) = &constant.value {
            entry["value"] = writer.expression(value);
        }
        entry
    });
    let mut document = json!({
        "jani-version": 1,
        "name": name,
        "type": if model.kind == ModelKind::Mdp { "mdp" } else { "dtmc" },
        "features": ["derived-operators"],
        "actions": actions.keys().map(|action| json!({ "name": action })).collect::<Vec<_>>(),
        "constants": constants.collect::<Vec<_>>(),
        "variables": variables,
        "properties": [],
        "automata": automata,
        "system": system(model, &actions),
    });
    if let Some(condition) = &model.initial {
        document["restrict-initial"] = json!({ "exp": writer.expression(condition) });
    }
    if writer.remaining.get() == 0 {
        let place = Place { line: 1, column: 1 };
        return Err(Error::Model(vec![Diagnostic::new("Q104", place, TOO_LARGE)].into()));
    }
    Ok(document)
}

fn is_taken(model: &Model, name: &str) -> bool {
    let declared = model.modules.iter().flat_map(|module| &module.variables).chain(&model.globals);
    let mut names = declared.map(|v| &v.name).chain(model.constants.iter().map(|constant| &constant.name));
    names.any(|existing| existing == name)
}

/// Returns the JANI variable name of a label: the label, with as many prefixes `label_` as are needed to differ from the
/// names of variables, constants and other labels.
fn label_name(model: &Model, label: &str) -> String {
    let mut name = label.to_owned();
    while is_taken(model, &name) || name != label && is_label(model, &name) {
        name.insert_str(0, "label_");
    }
    name
}

/// Returns the JANI variable name of a reward structure: its name (`reward` if it has none), with as many prefixes
/// `reward_` as are needed to differ from the names of variables, constants, labels and other structures.
fn reward_name(model: &Model, structure: &str) -> String {
    let is_structure = |name: &str| model.rewards.iter().any(|rewards| rewards.name == name);
    let is_label_name = |name: &str| model.labels.iter().any(|label| label_name(model, &label.name) == name);
    let mut name = if structure.is_empty() { "reward".to_owned() } else { structure.to_owned() };
    while is_taken(model, &name) || is_label_name(&name) || name != structure && is_structure(&name) {
        name.insert_str(0, "reward_");
    }
    name
}

fn is_label(model: &Model, name: &str) -> bool {
    model.labels.iter().any(|label| label.name == name)
}

fn type_name(kind: Type) -> &'static str {
    if kind == Type::Double { "real" } else { kind.name() }
}

/// Maps each action to the indices of the modules that have commands with this action.
fn actions(model: &Model) -> BTreeMap<&str, Vec<usize>> {
    let mut actions: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (number, module) in model.modules.iter().enumerate() {
        for action in module.commands.iter().filter_map(|command| command.action.as_deref()) {
            let modules = actions.entry(action).or_default();
            if modules.last() != Some(&number) {
                modules.push(number);
            }
        }
    }
    actions
}

fn system(model: &Model, actions: &BTreeMap<&str, Vec<usize>>) -> Value {
    let syncs = actions.iter().map(|(action, modules)| {
        let part = |number: usize| if modules.contains(&number) { json!(action) } else { Value::Null };
        json!({ "synchronise": (0..model.modules.len()).map(part).collect::<Vec<_>>(), "result": action })
    });
    json!({
        "elements": model.modules.iter().map(|module| json!({ "automaton": module.name })).collect::<Vec<_>>(),
        "syncs": syncs.collect::<Vec<_>>(),
    })
}

/// Returns an error for each formula that refers to itself, directly or indirectly, and so cannot be expanded.
fn recursive_formulas(model: &Model) -> Vec<Diagnostic> {
    let positions: FxHashMap<&str, u32> =
        model.formulas.iter().zip(0..).map(|(formula, position)| (&formula.name[..], position)).collect();
    let references: Vec<Vec<u32>> = model
        .formulas
        .iter()
        .map(|formula| {
            let mut names = Vec::new();
            formula.expression.names(&mut names);
            names.iter().filter_map(|(name, _)| positions.get(name).copied()).collect()
        })
        .collect();
    let mut is_recursive = vec![false; references.len()];
    let edges = |position: u32| &references[position as usize][..];
    let Ok(()) = visit_components(references.len(), edges, |component| {
        let is_cyclic = component.len() > 1 || edges(component[0]).contains(&component[0]);
        for position in component {
            is_recursive[*position as usize] = is_cyclic;
        }
        Ok::<(), Infallible>(())
    });
    let recursive = model.formulas.iter().zip(is_recursive).filter(|(_, is_recursive)| *is_recursive);
    let diagnostic = |formula: &Named| {
        let text = format!("the definition of `{name}` contains `{name}` itself", name = formula.name);
        Diagnostic::new("Q204", formula.place, text)
    };
    recursive.map(|(formula, _)| diagnostic(formula)).collect()
}

fn parts(condition: &Expr) -> Vec<&Expr> {
    let (mut stack, mut conjuncts) = (vec![condition], Vec::new());
    while let Some(part) = stack.pop() {
        match &part.kind {
            // The stack yields the left operand first.
            ExprKind::Binary(BinaryOp::And, left, right) => stack.extend([&**right, &**left]),
            _ => conjuncts.push(part),
        }
    }
    conjuncts
}

struct Writer<'a> {
    model: &'a Model,
    /// Number of subexpressions that may still be written; at 0, the document is incomplete.
    remaining: Cell<usize>,
    /// Number of formulas that are being expanded, each inside the one before, and the sum of their levels.
    open: Cell<(usize, usize)>,
}

impl Writer<'_> {
    fn automaton(&self, model: &Model, module: &Module, is_first: bool) -> Value {
        let mut transient = Vec::new();
        if is_first {
            for label in &model.labels {
                let name = label_name(model, &label.name);
                transient.push(json!({ "ref": name, "value": self.expression(&label.expression) }));
            }
            for rewards in &model.rewards {
                let state_items = rewards.items.iter().filter(|item| item.action.is_none());
                if let Some(value) = self.sum(state_items, &[]) {
                    transient.push(json!({ "ref": reward_name(model, &rewards.name), "value": value }));
                }
            }
        }
        let edges: Vec<Value> =
            module.commands.iter().map(|command| self.edge(model, module, command)).collect();
        let mut location = json!({ "name": "run" });
        if !transient.is_empty() {
            location["transient-values"] = json!(transient);
        }
        json!({
            "name": module.name,
            "locations": [location],
            "initial-locations": ["run"],
            "edges": edges,
        })
    }

    fn edge(&self, model: &Model, module: &Module, command: &Command) -> Value {
        // Among the modules that synchronise on an action, only the first assigns the rewards of
        // the action.
        let action = command.action.as_deref();
        let shares = |candidate: &&Module| candidate.commands.iter().any(|c| c.action.as_deref() == action);
        let carries =
            action.is_some() && model.modules.iter().find(shares).is_some_and(|m| m.name == module.name);
        let mut assignments = Vec::new();
        if carries {
            let fixed = self.fixed(&command.guard);
            for Rewards { name, items, .. } in &model.rewards {
                let action_rewards = items.iter().filter(|item| item.action == Some(command.action.clone()));
                if let Some(value) = self.sum(action_rewards, &fixed) {
                    assignments.push(json!({ "ref": reward_name(model, name), "value": value }));
                }
            }
        }
        let destinations: Vec<Value> = command
            .updates
            .iter()
            .map(|update| {
                let mut assignments_and_rewards = assignments.clone();
                assignments_and_rewards.extend(
                    update
                        .assignments
                        .iter()
                        .map(|(name, value, _)| json!({ "ref": name, "value": self.expression(value) })),
                );
                let mut destination = json!({ "location": "run", "assignments": assignments_and_rewards });
                if let Some(probability) = &update.probability {
                    destination["probability"] = json!({ "exp": self.expression(probability) });
                }
                destination
            })
            .collect();
        let mut edge = json!({
            "location": "run",
            "guard": { "exp": self.expression(&command.guard) },
            "destinations": destinations,
        });
        if let Some(action) = &command.action {
            edge["action"] = json!(action);
        }
        edge
    }

    /// Returns the sum of the rewards of `items`, each under its guard. Conjuncts `variable = value` of guards
    /// on a variable in `fixed` (the variables with a known value) are evaluated in advance. Returns `None` if
    /// no item remains.
    fn sum<'a>(&self, items: impl Iterator<Item = &'a RewardItem>, fixed: &[(&str, i64)]) -> Option<Value> {
        items
            .filter_map(|item| {
                let mut remaining: Option<Expr> = None;
                for part in parts(&item.guard) {
                    let static_truth = self.fixes(part).and_then(|(name, value)| {
                        fixed.iter().find(|(fixed, _)| *fixed == name).map(|(_, fixed)| *fixed == value)
                    });
                    match static_truth {
                        Some(true) => {}
                        Some(false) => return None,
                        None if part.kind == ExprKind::Bool(true) => {}
                        None => {
                            remaining = Some(match remaining {
                                Some(before) => before.op(BinaryOp::And, part.clone()),
                                None => part.clone(),
                            });
                        }
                    }
                }
                let reward = self.expression(&item.reward);
                Some(match remaining {
                    None => reward,
                    Some(guard) => {
                        json!({ "op": "ite", "if": self.expression(&guard), "then": reward, "else": 0 })
                    }
                })
            })
            .reduce(|left, right| json!({ "op": "+", "left": left, "right": right }))
    }

    fn fixed<'a>(&self, condition: &'a Expr) -> Vec<(&'a str, i64)> {
        parts(condition).into_iter().filter_map(|part| self.fixes(part)).collect()
    }

    fn fixes<'a>(&self, part: &'a Expr) -> Option<(&'a str, i64)> {
        let ExprKind::Binary(BinaryOp::Equal, left, right) = &part.kind else { return None };
        let (ExprKind::Name(name), ExprKind::Int(value)) = (&left.kind, &right.kind) else { return None };
        let is_formula = self.model.formulas.iter().any(|formula| formula.name == *name);
        (!is_formula).then_some((name.as_str(), *value))
    }

    fn variable(&self, variable: &Variable) -> Value {
        let (kind, least) = match &variable.range {
            None => (json!("bool"), json!(false)),
            Some((least, greatest)) => {
                let (least, greatest) = (self.expression(least), self.expression(greatest));
                let kind = json!({ "kind": "bounded", "base": "int", "lower-bound": least, "upper-bound": greatest });
                (kind, least)
            }
        };
        let mut entry = json!({ "name": variable.name, "type": kind });
        // In JANI, a variable without an initial value can start with every value that `restrict-initial` admits.
        // Initial values are therefore written only if the model has no such condition.
        if self.model.initial.is_none() {
            entry["initial-value"] = variable.initial.as_ref().map_or(least, |value| self.expression(value));
        }
        entry
    }

    fn expression(&self, expression: &Expr) -> Value {
        self.remaining.set(self.remaining.get().saturating_sub(1));
        if self.remaining.get() == 0 {
            return Value::Null;
        }
        match &expression.kind {
            ExprKind::Bool(value) => json!(value),
            ExprKind::Int(value) => json!(value),
            ExprKind::Number(value) => number(value),
            // Labels are expanded, too: while the transient variables are assigned, they still have their old values.
            ExprKind::Label(name) => self.definition(&self.model.labels, name),
            ExprKind::Name(name) => self.definition(&self.model.formulas, name),
            ExprKind::Not(inner) => object([("op", "¬".into()), ("exp", self.expression(inner))]),
            ExprKind::Negative(inner) => binary("-", 0.into(), self.expression(inner)),
            ExprKind::Binary(op, left, right) => {
                binary(sign(*op), self.expression(left), self.expression(right))
            }
            ExprKind::If(condition, then, otherwise) => object([
                ("op", "ite".into()),
                ("if", self.expression(condition)),
                ("then", self.expression(then)),
                ("else", self.expression(otherwise)),
            ]),
            ExprKind::Call(function, arguments) => self.call(*function, arguments),
            // Properties do not occur in models.
            ExprKind::Property(_) | ExprKind::Temporal(_) => json!(true),
        }
    }

    /// Expands the definition of `name` in `definitions`. Another name is written as it is.
    fn definition(&self, definitions: &[Named], name: &str) -> Value {
        let Some(definition) = definitions.iter().find(|definition| definition.name == name) else {
            return json!(name);
        };
        let (depth, levels) = self.open.get();
        let nested = levels.saturating_add(definition.expression.levels());
        if depth >= MAX_DEPTH || nested > MAX_LEVELS {
            self.remaining.set(0);
            return Value::Null;
        }
        self.open.set((depth.saturating_add(1), nested));
        let value = self.expression(&definition.expression);
        self.open.set((depth, levels));
        value
    }

    fn call(&self, function: Function, arguments: &[Expr]) -> Value {
        let values: Vec<Value> = arguments.iter().map(|argument| self.expression(argument)).collect();
        match (function, &values[..]) {
            (Function::Floor | Function::Ceil, [inner]) => json!({ "op": function.name(), "exp": inner }),
            (Function::Round, [inner]) => {
                json!({ "op": "floor", "exp": { "op": "+", "left": inner, "right": 0.5 } })
            }
            (Function::Mod, [left, right]) => json!({ "op": "%", "left": left, "right": right }),
            _ => {
                let pairs = values.into_iter();
                pairs.reduce(|left, right| binary(function.name(), left, right)).unwrap_or(Value::Null)
            }
        }
    }
}

/// Creates an object without a copy of the values, which `json!` would make at each level of an expression.
fn object<const N: usize>(entries: [(&str, Value); N]) -> Value {
    Value::Object(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

fn binary(op: &str, left: Value, right: Value) -> Value {
    object([("op", op.into()), ("left", left), ("right", right)])
}

/// Converts a rational to JANI. A decimal with at most 30 decimal places becomes an exact number
/// literal. Another fraction becomes a division, or a rounded double if its numerator or denominator
/// does not fit into 64 bits.
fn number(value: &num_rational::BigRational) -> Value {
    let (text, _) = crate::prism::decimal(value);
    text.parse::<serde_json::Number>().map_or_else(
        |_| match (value.numer().to_i64(), value.denom().to_i64()) {
            (Some(numerator), Some(denominator)) => {
                json!({ "op": "/", "left": numerator, "right": denominator })
            }
            _ => json!(crate::Number::to_f64(value)),
        },
        Value::Number,
    )
}

fn sign(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Implies => "⇒",
        BinaryOp::Or => "∨",
        BinaryOp::And => "∧",
        BinaryOp::NotEqual => "≠",
        BinaryOp::LessEqual => "≤",
        BinaryOp::GreaterEqual => "≥",
        // JANI has no operator for equivalence, but its equality also compares truth values.
        BinaryOp::Iff => BinaryOp::Equal.sign().0,
        other => other.sign().0,
    }
}
