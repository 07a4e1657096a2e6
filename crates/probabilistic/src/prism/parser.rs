//! Parses PRISM models.

use crate::error::{Diagnostic, Error, Place};
use crate::prism::ast::{
    Command, Constant, Expr, Model, ModelKind, Module, Named, RewardItem, Rewards, Type, Update, Variable,
};
use crate::prism::expression::{Cursor, Read};
use crate::prism::lexer::{Kind, Token, tokens};
use crate::prism::rename::{self, Formulas};

/// Parses a PRISM model.
///
/// ```
/// use metaplan_probabilistic::prism;
///
/// let error = prism::parse("mdp\nmodule m\n s:[0..1] init 0;\n [] s=0 -> (s'=1)\nendmodule").expect_err("no semicolon");
/// assert_eq!(error.diagnostics()[0].place.line, 5);
/// ```
///
/// # Errors
/// The syntax errors and unsupported constructs; after an error, parsing continues with the next
/// declaration or command. If the text contains invalid characters or unclosed quotation marks, only
/// these are reported.
pub fn parse(text: &str) -> Result<Model, Error> {
    let tokens = tokens(text).map_err(|problems| Error::Model(problems.into()))?;
    let mut cursor = Cursor::new(&tokens);
    let mut model = Model {
        kind: ModelKind::Mdp,
        remark: String::new(),
        constants: Vec::new(),
        formulas: Vec::new(),
        globals: Vec::new(),
        modules: Vec::new(),
        rewards: Vec::new(),
        labels: Vec::new(),
        initial: None,
    };
    let mut problems = Vec::new();
    let mut kind = None;
    let formulas = Formulas::new(formulas(&tokens));
    while *cursor.peek() != Kind::End {
        let before = cursor.position();
        if let Err(problem) = part(&mut cursor, &mut model, &mut kind, &formulas, &mut problems) {
            problems.push(problem);
            skip(&mut cursor);
            // An error at a keyword consumes no token, so one is skipped to make progress.
            if cursor.position() == before {
                cursor.advance();
            }
        }
    }
    if model.modules.is_empty() && problems.is_empty() {
        problems.push(Diagnostic::new("Q107", cursor.place(), "the model has no module"));
    }
    model.kind = kind.unwrap_or(ModelKind::Mdp);
    if problems.is_empty() { Ok(model) } else { Err(Error::Model(problems.into())) }
}

/// Recovers from an error: skips tokens past the next `;`, or up to a keyword such as `module` or `endmodule`.
fn skip(cursor: &mut Cursor<'_>) {
    cursor.reset();
    loop {
        match cursor.peek() {
            Kind::End => return,
            Kind::Sign(";") => {
                cursor.advance();
                return;
            }
            Kind::Name(word)
                if ["endmodule", "module", "rewards", "label", "formula", "const"]
                    .contains(&word.as_str()) =>
            {
                return;
            }
            _ => cursor.advance(),
        }
    }
}

fn part(
    cursor: &mut Cursor<'_>,
    model: &mut Model,
    kind: &mut Option<ModelKind>,
    formulas: &Formulas,
    problems: &mut Vec<Diagnostic>,
) -> Read<()> {
    let place = cursor.place();
    let Kind::Name(word) = cursor.peek() else { return Err(cursor.expected("a declaration")) };
    let mut is_kind = |declared: ModelKind| match kind.replace(declared) {
        None => Ok(()),
        Some(_) => Err(Diagnostic::new("Q107", place, "the model type is already given")),
    };
    match word.as_str() {
        "mdp" | "nondeterministic" => is_kind(ModelKind::Mdp)?,
        "dtmc" | "probabilistic" => is_kind(ModelKind::Dtmc)?,
        "const" => return constant(cursor, model),
        "formula" | "label" => return named(cursor, model),
        "global" => {
            cursor.advance();
            let variable = variable(cursor)?;
            model.globals.push(variable);
            return Ok(());
        }
        "module" => return module(cursor, model, formulas, problems),
        "rewards" => return rewards(cursor, model),
        "ctmc" | "stochastic" | "pta" | "pomdp" | "popta" | "smg" | "csg" | "idtmc" | "imdp" | "ma" => {
            cursor.advance();
            let text = format!("models of the kind `{word}` are not supported; use `mdp` or `dtmc`");
            return Err(Diagnostic::new("Q401", place, text));
        }
        "init" => return initial(cursor, model),
        "system" | "observables" | "invariant" | "player" => {
            cursor.advance();
            let text = format!("`{word}` declarations are not supported");
            return Err(Diagnostic::new("Q401", place, text));
        }
        _ => return Err(cursor.expected("a declaration (`const`, `formula`, `module`, `rewards`, `label`)")),
    }
    cursor.advance();
    Ok(())
}

fn initial(cursor: &mut Cursor<'_>, model: &mut Model) -> Read<()> {
    let place = cursor.place();
    cursor.advance();
    let states = cursor.expression()?;
    cursor.need_word("endinit")?;
    match model.initial.replace(states) {
        None => Ok(()),
        Some(_) => Err(Diagnostic::new("Q107", place, "the initial states are already given")),
    }
}

fn constant(cursor: &mut Cursor<'_>, model: &mut Model) -> Read<()> {
    model.constants.push(constant_declaration(cursor)?);
    Ok(())
}

/// Parses the declaration of a constant, `const type name = value;`. Type and value are optional.
pub fn constant_declaration(cursor: &mut Cursor<'_>) -> Read<Constant> {
    cursor.advance();
    let kind = match cursor.peek() {
        Kind::Name(word) => match word.as_str() {
            "int" => Some(Type::Int),
            "double" | "rate" | "prob" => Some(Type::Double),
            "bool" => Some(Type::Bool),
            _ => None,
        },
        _ => None,
    };
    // Without a type, the constant is an `int`, and no token has to be skipped.
    if kind.is_some() {
        cursor.advance();
    }
    let (name, place) = cursor.name("the name of a constant")?;
    let value = if cursor.take("=") { Some(cursor.expression()?) } else { None };
    cursor.need(";")?;
    Ok(Constant { name, kind: kind.unwrap_or(Type::Int), value, place })
}

/// Returns the formulas of the whole text, without those that have errors. A module may be renamed above the
/// formulas that it uses.
fn formulas(tokens: &[Token]) -> Vec<Named> {
    let mut cursor = Cursor::new(tokens);
    let mut formulas = Vec::new();
    while *cursor.peek() != Kind::End {
        if cursor.is_word("formula") {
            formulas.extend(named_expression(&mut cursor).ok());
        } else {
            cursor.advance();
        }
    }
    formulas
}

fn named(cursor: &mut Cursor<'_>, model: &mut Model) -> Read<()> {
    let is_label = cursor.is_word("label");
    let named = named_expression(cursor)?;
    if is_label { &mut model.labels } else { &mut model.formulas }.push(named);
    Ok(())
}

pub fn named_expression(cursor: &mut Cursor<'_>) -> Read<Named> {
    let is_label = cursor.is_word("label");
    cursor.advance();
    let place = cursor.place();
    let name = match cursor.peek() {
        Kind::Quoted(label) if is_label => {
            cursor.advance();
            label.clone()
        }
        _ if is_label => return Err(cursor.expected("the name of a label in quotation marks")),
        _ => cursor.name("the name of a formula")?.0,
    };
    cursor.need("=")?;
    let expression = cursor.expression()?;
    cursor.need(";")?;
    Ok(Named { name, expression, place })
}

fn variable(cursor: &mut Cursor<'_>) -> Read<Variable> {
    let (name, place) = cursor.name("the name of a variable")?;
    cursor.need(":")?;
    let range = if cursor.take_word("bool") {
        None
    } else if cursor.take("[") {
        let least = cursor.expression()?;
        cursor.need("..")?;
        let greatest = cursor.expression()?;
        cursor.need("]")?;
        Some((least, greatest))
    } else if cursor.is_word("int") || cursor.is_word("clock") || cursor.is_word("double") {
        let text = "variables need a finite range: write `[least..greatest]` or `bool`";
        return Err(Diagnostic::new("Q402", cursor.place(), text));
    } else {
        return Err(cursor.expected("`bool` or a range `[least..greatest]`"));
    };
    let initial = if cursor.take_word("init") { Some(cursor.expression()?) } else { None };
    cursor.need(";")?;
    Ok(Variable { name, range, initial, place })
}

fn module(
    cursor: &mut Cursor<'_>,
    model: &mut Model,
    formulas: &Formulas,
    problems: &mut Vec<Diagnostic>,
) -> Read<()> {
    cursor.advance();
    let (name, place) = cursor.name("the name of a module")?;
    if cursor.take("=") {
        let (original, original_place) = cursor.name("the name of a module")?;
        let mut pairs = Vec::new();
        cursor.need("[")?;
        while !cursor.is("]") {
            let (old, _) = cursor.name("a name to replace")?;
            cursor.need("=")?;
            pairs.push((old, cursor.name("a new name")?.0));
            if !cursor.take(",") {
                break;
            }
        }
        cursor.need("]")?;
        cursor.need_word("endmodule")?;
        let original_module = model.modules.iter().find(|module| module.name == original);
        let Some(original_module) = original_module else {
            let text = format!("there is no module `{original}` above");
            return Err(Diagnostic::new("Q201", original_place, text));
        };
        let module = rename::module(original_module, &name, place, &pairs, formulas)?;
        model.modules.push(module);
        return Ok(());
    }
    let mut module = Module { name, variables: Vec::new(), commands: Vec::new(), place };
    while !cursor.take_word("endmodule") {
        if let Err(problem) = member(cursor, &mut module) {
            problems.push(problem);
            skip(cursor);
        }
        let is_over =
            ["module", "rewards", "label", "formula", "const"].iter().any(|word| cursor.is_word(word));
        if is_over || *cursor.peek() == Kind::End {
            return Err(cursor.expected("`endmodule`"));
        }
    }
    model.modules.push(module);
    Ok(())
}

fn member(cursor: &mut Cursor<'_>, module: &mut Module) -> Read<()> {
    if cursor.is("[") {
        module.commands.push(command(cursor)?);
    } else if cursor.is_word("invariant") {
        return Err(Diagnostic::new("Q401", cursor.place(), "`invariant` is not handled"));
    } else if matches!(cursor.peek(), Kind::Name(_)) && matches!(cursor.peek_at(1), Kind::Sign(":")) {
        module.variables.push(variable(cursor)?);
    } else {
        return Err(cursor.expected("a variable, a command `[action] guard -> updates;` or `endmodule`"));
    }
    Ok(())
}

fn action(cursor: &mut Cursor<'_>) -> Read<Option<String>> {
    cursor.need("[")?;
    let action = if cursor.is("]") { None } else { Some(cursor.name("the name of an action")?.0) };
    cursor.need("]")?;
    Ok(action)
}

fn command(cursor: &mut Cursor<'_>) -> Read<Command> {
    let place = cursor.place();
    let action = action(cursor)?;
    let guard = cursor.expression()?;
    cursor.need("->")?;
    let mut updates = Vec::new();
    if starts_assignments(cursor) {
        updates.push(Update { probability: None, assignments: assignments(cursor)? });
    } else {
        loop {
            let probability = cursor.expression()?;
            cursor.need(":")?;
            updates.push(Update { probability: Some(probability), assignments: assignments(cursor)? });
            if !cursor.take("+") {
                break;
            }
        }
    }
    cursor.need(";")?;
    Ok(Command { action, guard, updates, place })
}

fn starts_assignments(cursor: &Cursor<'_>) -> bool {
    let is_true = cursor.is_word("true") && matches!(cursor.peek_at(1), Kind::Sign(";"));
    is_true || cursor.is("(") && matches!(cursor.peek_at(2), Kind::Sign("'"))
}

fn assignments(cursor: &mut Cursor<'_>) -> Read<Vec<(String, Expr, Place)>> {
    if cursor.take_word("true") {
        return Ok(Vec::new());
    }
    let mut assignments = Vec::new();
    loop {
        cursor.need("(")?;
        let (name, place) = cursor.name("the variable of an assignment")?;
        cursor.need("'")?;
        cursor.need("=")?;
        assignments.push((name, cursor.expression()?, place));
        cursor.need(")")?;
        if !cursor.take("&") {
            return Ok(assignments);
        }
    }
}

fn rewards(cursor: &mut Cursor<'_>, model: &mut Model) -> Read<()> {
    let place = cursor.place();
    cursor.advance();
    let mut name = String::new();
    if let Kind::Quoted(text) = cursor.peek() {
        name.clone_from(text);
        cursor.advance();
    }
    let mut items = Vec::new();
    while !cursor.take_word("endrewards") {
        let place = cursor.place();
        let action = if cursor.is("[") { Some(action(cursor)?) } else { None };
        let guard = cursor.expression()?;
        cursor.need(":")?;
        let reward = cursor.expression()?;
        cursor.need(";")?;
        items.push(RewardItem { action, guard, reward, place });
    }
    model.rewards.push(Rewards { name, items, place });
    Ok(())
}
