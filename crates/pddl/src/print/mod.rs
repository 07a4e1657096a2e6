//! Prints syntax trees as PDDL. Parsing the printed text and printing it again yields the same text.
//!
//! Empty sections other than `:init` and `:goal`, and empty preconditions of instantaneous actions, are omitted,
//! because several planners reject them.

mod layout;
mod soft;
mod tree;

use crate::ast::{
    Action, ActionBody, Condition, Declaration, Direction, Domain, Expression, Identifier, InitialElement,
    Problem, TypedName,
};
use layout::{Doc, layout, list, text};
pub(crate) use tree::type_text;
use tree::typed;

/// Prints a domain.
pub fn print_domain(domain: &Domain) -> String {
    let mut sections = vec![text(format!("(domain {})", domain.name.name))];
    sections.extend(requirements(&domain.requirements));
    sections.extend(entries(":types", &domain.types));
    sections.extend(entries(":constants", &domain.constants));
    sections.extend(declarations(":predicates", &domain.predicates));
    sections.extend(declarations(":functions", &domain.functions));
    sections.extend(
        domain.derived.iter().map(|axiom| {
            list(":derived", 2, [text(signature(&axiom.head)), tree::condition(&axiom.condition)])
        }),
    );
    sections.extend(soft::constraints(&domain.constraints.iter().collect::<Vec<_>>()));
    sections.extend(domain.actions.iter().map(action));
    layout(&list("define", 2, sections).broken())
}

/// Prints a problem.
pub fn print_problem(problem: &Problem) -> String {
    let mut sections = vec![
        text(format!("(problem {})", problem.name.name)),
        text(format!("(:domain {})", problem.domain.name)),
    ];
    sections.extend(requirements(&problem.requirements));
    sections.extend(entries(":objects", &problem.objects));
    sections.push(list(":init", 1, problem.init.iter().map(initial)).broken());
    let (goal_preferences, constraints): (Vec<_>, Vec<_>) =
        problem.constraints.iter().partition(|constraint| soft::is_of_goal(constraint));
    sections.push(list(
        ":goal",
        1,
        [soft::with(
            &problem.goal,
            goal_preferences.into_iter().map(|preference| soft::constraint(preference, true)),
        )],
    ));
    sections.extend(soft::constraints(&constraints));
    sections.extend(problem.metric.as_ref().map(|metric| {
        let direction = match metric.direction {
            Direction::Minimize => "minimize",
            Direction::Maximize => "maximize",
        };
        list(":metric", 2, [text(direction), tree::expression(&metric.expression)])
    }));
    layout(&list("define", 2, sections).broken())
}

/// Prints a numeric expression on one line.
pub fn print_expression(expression: &Expression) -> String {
    tree::expression(expression).on_one_line()
}

pub(crate) fn condition_text(condition: &Condition) -> String {
    tree::condition(condition).on_one_line()
}

pub(crate) fn constraint_text(constraint: &crate::ast::Constraint) -> String {
    soft::constraint(constraint, false).on_one_line()
}

pub(crate) fn signature(declaration: &Declaration) -> String {
    let parameters = typed("?", &declaration.parameters);
    let space = if parameters.is_empty() { "" } else { " " };
    format!("({}{space}{})", declaration.identifier.name, parameters.join(" "))
}

fn requirements(flags: &[Identifier]) -> Option<Doc> {
    let flags: Vec<_> = flags.iter().map(|flag| text(format!(":{}", flag.name))).collect();
    (!flags.is_empty()).then(|| list(":requirements", 1, flags))
}

fn entries(keyword: &str, entries: &[TypedName]) -> Option<Doc> {
    let lines = typed("", entries).into_iter().map(text);
    (!entries.is_empty()).then(|| list(keyword, 1, lines).broken())
}

fn declarations(keyword: &str, declarations: &[Declaration]) -> Option<Doc> {
    let lines = declarations.iter().map(|declaration| text(signature(declaration)));
    (!declarations.is_empty()).then(|| list(keyword, 1, lines).broken())
}

fn action(action: &Action) -> Doc {
    let field = |keyword: &str, value: Doc| value.after(keyword);
    let parameters = text(format!("({})", typed("?", &action.parameters).join(" ")));
    let name = text(action.identifier.name.as_str());
    let mut parts = vec![name, field(":parameters", parameters)];
    match &action.body {
        ActionBody::Instantaneous { precondition, effect } => {
            if !matches!(precondition, Condition::And(parts) if parts.is_empty())
                || !action.preferences.is_empty()
            {
                let preferences =
                    action.preferences.iter().map(|preference| soft::preference(preference, false));
                parts.push(field(":precondition", soft::with(precondition, preferences)));
            }
            parts.push(field(":effect", tree::effect(effect)));
            list(":action", 2, parts).broken()
        }
        ActionBody::Durative { duration, conditions, effects } => {
            parts.push(field(":duration", tree::duration(duration)));
            let conditions = conditions.iter().map(tree::timed_condition);
            let preferences = action.preferences.iter().map(|preference| soft::preference(preference, true));
            parts.push(field(":condition", list("and", 1, conditions.chain(preferences))));
            parts.push(field(":effect", list("and", 1, effects.iter().map(tree::timed_effect))));
            list(":durative-action", 2, parts).broken()
        }
    }
}

fn initial(element: &InitialElement) -> Doc {
    match element {
        InitialElement::Fact(atom) => tree::atom(atom),
        InitialElement::NegatedFact(atom) => list("not", 1, [tree::atom(atom)]),
        InitialElement::Value(atom, value, _) => list("=", 1, [tree::atom(atom), tree::number(value)]),
        InitialElement::Timed(time, atom, holds, _) => {
            let atom = tree::atom(atom);
            let literal = if *holds { atom } else { list("not", 1, [atom]) };
            list("at", 1, [tree::number(time), literal])
        }
    }
}
