//! Random models of two modules that synchronise on common actions.

use probabilistic::Place;
use probabilistic::prism::ast::{
    BinaryOp, Command as Guarded, Expr, ExprKind, Model, ModelKind, Module, Named, RewardItem, Rewards,
    Update, Variable,
};

pub struct Random(pub u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

fn place() -> Place {
    Place::default()
}

fn equals(name: &str, value: usize) -> Expr {
    Expr::name(name).op(BinaryOp::Equal, Expr::int(value as i64))
}

/// Returns a module over `variable` with random commands. The second module synchronises with it on common
/// actions.
fn module(random: &mut Random, name: &str, variable: &str, size: usize, actions: &[&str]) -> Module {
    let mut commands = Vec::new();
    for state in 0..size {
        for _ in 0..random.below(4) {
            let action = random.below(actions.len() + 1);
            let ends = 1 + random.below(3);
            let mut remaining = 100;
            let mut updates = Vec::new();
            // The probabilities are percentages; the last one gets the remainder.
            for end in 0..ends {
                let share = if end + 1 == ends { remaining } else { random.below(remaining + 1) };
                remaining -= share;
                let probability = Expr::int(share as i64).op(BinaryOp::Divide, Expr::int(100));
                let target = Expr::int(random.below(size) as i64);
                updates.push(Update {
                    probability: Some(probability),
                    assignments: vec![(variable.to_owned(), target, place())],
                });
            }
            commands.push(Guarded {
                action: actions.get(action).map(|action| (*action).to_owned()),
                guard: equals(variable, state),
                updates,
                place: place(),
            });
        }
    }
    let range = Some((Expr::int(0), Expr::int(size as i64 - 1)));
    let variable = Variable { name: variable.to_owned(), range, initial: Some(Expr::int(0)), place: place() };
    Module { name: name.to_owned(), variables: vec![variable], commands, place: place() }
}

pub fn random_model(random: &mut Random) -> Model {
    let (m, n) = (2 + random.below(8), 1 + random.below(4));
    let modules = vec![
        module(random, "first", "s", m, &["a", "b"]),
        module(random, "second", "t", n.max(2), &["b", "c"]),
    ];
    let used: Vec<String> =
        modules.iter().flat_map(|m| &m.commands).filter_map(|c| c.action.clone()).collect();
    let mut items = Vec::new();
    for action in ["a", "b", "c"] {
        if used.iter().any(|used_action| used_action == action) && random.below(3) > 0 {
            items.push(RewardItem {
                action: Some(Some(action.to_owned())),
                guard: Expr::bool(true),
                reward: Expr::int(random.below(5) as i64),
                place: place(),
            });
        }
    }
    items.push(RewardItem {
        action: None,
        guard: equals("s", random.below(m)),
        reward: Expr::int(random.below(3) as i64),
        place: place(),
    });
    Model {
        kind: if random.below(5) == 0 { ModelKind::Dtmc } else { ModelKind::Mdp },
        remark: String::new(),
        constants: Vec::new(),
        formulas: Vec::new(),
        globals: Vec::new(),
        modules,
        rewards: vec![Rewards { name: "cost".to_owned(), items, place: place() }],
        labels: vec![
            Named { name: "goal".to_owned(), expression: equals("s", m - 1), place: place() },
            Named {
                name: "good".to_owned(),
                expression: Expr::new(ExprKind::Not(Box::new(equals("t", 1)))),
                place: place(),
            },
        ],
        initial: None,
    }
}

pub fn questions(kind: ModelKind) -> &'static [&'static str] {
    match kind {
        ModelKind::Mdp => &[
            "Pmax=? [ F \"goal\" ]",
            "Pmin=? [ F \"goal\" ]",
            "R{\"cost\"}min=? [ F \"goal\" ]",
            "R{\"cost\"}max=? [ F \"goal\" ]",
            "Pmax=? [ \"good\" U \"goal\" ]",
            "Pmax=? [ F<=5 \"goal\" ]",
        ],
        ModelKind::Dtmc => &["P=? [ F \"goal\" ]", "R{\"cost\"}=? [ F \"goal\" ]"],
    }
}
