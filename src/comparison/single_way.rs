//! Exports a mission as a PRISM model of the published setting. [`program`](super::program()) exports the corrected
//! model.
//!
//! The model follows the models that Cámara, Schmerl and Garlan (SEAMS 2020) generate for each route. There is at
//! most one reconfiguration, before the first move; then the robot follows one of the five shortest routes. Each move
//! that can collide overwrites the flag `collided`, a move never fails, and an empty battery has no consequence. The
//! authors generate one model per route. Here the first choice selects the route, so a single query determines the
//! best route. The constant `ROUTE` can fix the route.

use num_rational::BigRational;
use num_traits::{One, Zero};
use probabilistic::Place;
use probabilistic::prism::ast::{
    BinaryOp, Constant, Expr, ExprKind, Function, Model, Named, Rewards, Type, Variable,
};

use crate::comparison::coadaptation::Coadaptation;
use crate::comparison::program::{
    all, assign, command, equals, flag, item, model, names_of_changes, names_of_moves, not, number, range,
    updates,
};
use crate::comparison::published::{ROUTES, shortest_routes};

/// Returns the model of the published setting. Its variables are the route `r` (0 before it is chosen), the number `p`
/// of traversed arcs, and the configuration `c`. If the mission has a battery, `b` is its level. The flag `rd` is set
/// after a reconfiguration; the flag `collided` is true if the latest risky move has collided.
pub fn published_program(mission: &Coadaptation) -> Model {
    let routes = shortest_routes(mission, ROUTES);
    let writer =
        RouteWriter { mission, routes, sets: names_of_changes(mission), moves: names_of_moves(mission) };
    let route = Constant { name: "ROUTE".to_owned(), kind: Type::Int, value: None, place: Place::default() };
    let parts = (writer.variables(), writer.commands());
    model(writer.remark(), vec![route], parts, writer.rewards(), writer.labels())
}

struct RouteWriter<'a> {
    mission: &'a Coadaptation,
    routes: Vec<Vec<usize>>,
    sets: Vec<String>,
    moves: Vec<String>,
}

impl RouteWriter<'_> {
    fn remark(&self) -> String {
        let place = |place: usize| self.mission.places[place].as_str();
        let routes = self.routes.iter().enumerate().map(|(number, route)| {
            let places = route.iter().map(|arc| place(self.mission.arcs[*arc].to));
            let places: Vec<&str> = std::iter::once(place(self.mission.start)).chain(places).collect();
            format!("route {}: {}", number + 1, places.join(" "))
        });
        let designs = self.mission.configurations.iter().enumerate();
        let designs: Vec<_> = designs.map(|(number, c)| format!("{number} = {}", c.name)).collect();
        let lines: Vec<String> = routes.collect();
        format!(
            "A co-adaptation mission in the published setting. ROUTE fixes the route, 0 leaves it open.\n{}\nc, the \
             configuration: {}",
            lines.join("\n"),
            designs.join(", ")
        )
    }

    fn variables(&self) -> Vec<Variable> {
        let longest = self.routes.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let designs = self.mission.configurations.len();
        let mut variables = vec![
            range("r", self.routes.len().max(1), 0),
            range("p", longest, 0),
            range("c", designs.max(2) - 1, self.mission.initial),
            flag("rd"),
            flag("collided"),
        ];
        let battery = self.mission.battery;
        variables
            .extend(battery.map(|battery| range("b", battery.initial as usize, battery.initial as usize)));
        variables
    }

    fn spent(&self, energy: &BigRational) -> Vec<(String, Expr, Place)> {
        if self.mission.battery.is_none() {
            return Vec::new();
        }
        let levels = i64::from(self.mission.levels(energy));
        if levels == 0 {
            return Vec::new();
        }
        let remaining = Expr::name("b").op(BinaryOp::Minus, Expr::int(levels));
        let remaining = Expr::new(ExprKind::Call(Function::Max, vec![Expr::int(0), remaining]));
        vec![assign("b", remaining)]
    }

    fn commands(&self) -> Vec<probabilistic::prism::ast::Command> {
        let mission = self.mission;
        let mut commands = Vec::new();
        for route in 1..=self.routes.len() {
            let open = Expr::name("ROUTE").op(BinaryOp::Equal, Expr::int(0));
            let is_requested =
                open.op(BinaryOp::Or, Expr::name("ROUTE").op(BinaryOp::Equal, Expr::int(route as i64)));
            let chosen = vec![assign("r", Expr::int(route as i64))];
            let guard = all([equals("r", 0), is_requested]);
            commands.push(command(format!("route_{route}"), guard, updates([(BigRational::one(), chosen)])));
        }
        let chosen = || Expr::name("r").op(BinaryOp::NotEqual, Expr::int(0));
        for (new, _) in mission.configurations.iter().enumerate().filter(|(_, c)| c.available) {
            let Some(switch) = &mission.switches[mission.initial][new] else { continue };
            let guard = all([chosen(), equals("p", 0), not(Expr::name("rd")), equals("c", mission.initial)]);
            let mut changed = self.spent(&switch.energy);
            changed.extend([assign("c", Expr::int(new as i64)), assign("rd", Expr::bool(true))]);
            let updates = updates([(BigRational::one(), changed)]);
            commands.push(command(self.sets[new].clone(), guard, updates));
        }
        for (route, arcs) in self.routes.iter().enumerate() {
            for (position, arc) in arcs.iter().enumerate() {
                for (design, traversal) in mission.arcs[*arc].by.iter().enumerate() {
                    let Some(traversal) =
                        traversal.as_ref().filter(|_| mission.configurations[design].available)
                    else {
                        continue;
                    };
                    let guard = all([equals("r", route + 1), equals("p", position), equals("c", design)]);
                    let mut moved = self.spent(&traversal.energy);
                    moved.push(assign("p", Expr::int(position as i64 + 1)));
                    let with = |collided: bool| {
                        let flag = std::iter::once(assign("collided", Expr::bool(collided)));
                        moved.iter().cloned().chain(flag).collect::<Vec<_>>()
                    };
                    let ends = if traversal.hit.is_zero() {
                        updates([(BigRational::one(), moved.clone())])
                    } else {
                        let missed = BigRational::one() - &traversal.hit;
                        updates([(traversal.hit.clone(), with(true)), (missed, with(false))])
                    };
                    commands.push(command(self.go(*arc), guard, ends));
                }
            }
        }
        commands
    }

    fn go(&self, arc: usize) -> String {
        self.moves[arc].clone()
    }

    fn rewards(&self) -> Vec<Rewards> {
        let mission = self.mission;
        let (mut time, mut energy) = (Vec::new(), Vec::new());
        let mut add_reward = |action: &str, guard: Expr, spent: [&BigRational; 2]| {
            for (list, value) in [&mut time, &mut energy].into_iter().zip(spent) {
                if !value.is_zero() {
                    list.push(item(action, guard.clone(), number(value)));
                }
            }
        };
        for (new, set) in self.sets.iter().enumerate() {
            if let Some(switch) = &mission.switches[mission.initial][new] {
                add_reward(set, Expr::bool(true), [&switch.time, &switch.energy]);
            }
        }
        let arcs: std::collections::BTreeSet<usize> = self.routes.iter().flatten().copied().collect();
        for arc in arcs {
            for (design, traversal) in mission.arcs[arc].by.iter().enumerate() {
                if let Some(traversal) = traversal {
                    add_reward(&self.go(arc), equals("c", design), [&traversal.time, &traversal.energy]);
                }
            }
        }
        let named = [("time", time), ("energy", energy)];
        named
            .into_iter()
            .map(|(name, items)| Rewards { name: name.to_owned(), items, place: Place::default() })
            .collect()
    }

    fn labels(&self) -> Vec<Named> {
        let ends = self.routes.iter().enumerate();
        let ends = ends.map(|(route, arcs)| all([equals("r", route + 1), equals("p", arcs.len())]));
        let goal = ends.reduce(|any, end| any.op(BinaryOp::Or, end)).unwrap_or(Expr::bool(false));
        let label = |name: &str, expression: Expr| Named {
            name: name.to_owned(),
            expression,
            place: Place::default(),
        };
        let safe = all([goal.clone(), not(Expr::name("collided"))]);
        vec![label("goal", goal), label("safe_goal", safe)]
    }
}
