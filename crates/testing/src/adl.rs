//! Generator of random tasks with conditional effects, derived predicates, quantifiers, disjunctions, a
//! numeric function, and action costs. All tasks have finitely many states.

use std::fmt::Write as _;

use super::random::Random;

/// Generator of random domains and problems in PDDL.
pub struct Generator(pub Random);

impl Generator {
    fn below(&mut self, limit: u64) -> u64 {
        self.0.below(limit).unsigned_abs()
    }

    fn pick<'t>(&mut self, choices: &[&'t str]) -> &'t str {
        choices[self.below(choices.len() as u64) as usize]
    }

    fn term(&mut self, variables: &[&'static str]) -> &'static str {
        let constants = ["o1", "o2"];
        if variables.is_empty() || self.below(4) == 0 {
            constants[self.below(2) as usize]
        } else {
            variables[self.below(variables.len() as u64) as usize]
        }
    }

    /// Returns a random condition over the basic predicates p, q and r, the first `derived` of the derived
    /// predicates d1 and d2, and the number n.
    fn condition(&mut self, depth: u64, variables: &[&'static str], derived: u64) -> String {
        let connective = if depth == 0 { 0 } else { self.below(8) };
        let extended =
            |variable: &'static str| variables.iter().copied().chain([variable]).collect::<Vec<_>>();
        let quantified = ["?u", "?v", "?w"][depth.min(2) as usize];
        match connective {
            4 => format!(
                "(and {} {})",
                self.condition(depth - 1, variables, derived),
                self.condition(depth - 1, variables, derived)
            ),
            5 => format!(
                "(or {} {})",
                self.condition(depth - 1, variables, derived),
                self.condition(depth - 1, variables, derived)
            ),
            6 => format!(
                "(exists ({quantified}) {})",
                self.condition(depth - 1, &extended(quantified), derived)
            ),
            7 => format!(
                "(forall ({quantified}) {})",
                self.condition(depth - 1, &extended(quantified), derived)
            ),
            _ => {
                let atom = match self.below(5 + 2 * derived) {
                    0 | 1 => format!("(p {})", self.term(variables)),
                    2 => format!("(q {} {})", self.term(variables), self.term(variables)),
                    3 => "(r)".into(),
                    4 => format!("({} (n) {})", self.pick(&["<", "<=", ">=", ">"]), self.below(3)),
                    5 | 6 => format!("(d1 {})", self.term(variables)),
                    _ => format!("(d2 {})", self.term(variables)),
                };
                if self.below(3) == 0 { format!("(not {atom})") } else { atom }
            }
        }
    }

    fn effect(&mut self, variables: &[&'static str]) -> String {
        let atom = match self.below(5) {
            0 | 1 => format!("(p {})", self.term(variables)),
            2 => format!("(q {} {})", self.term(variables), self.term(variables)),
            3 => "(r)".into(),
            // The number stays between 0 and 3, so the state space is finite.
            _ => {
                let change = [
                    "(when (< (n) 3) (increase (n) 1))",
                    "(when (> (n) 0) (decrease (n) 1))",
                    "(when (r) (assign (n) 2))",
                    "(assign (n) 3)",
                ];
                return self.pick(&change).into();
            }
        };
        if self.below(3) == 0 { format!("(not {atom})") } else { atom }
    }

    /// Returns a random domain in PDDL.
    pub fn domain(&mut self) -> String {
        let mut text = String::from(
            "(define (domain d) (:constants o1 o2) (:predicates (p ?x) (q ?x ?y) (r) (d1 ?x) (d2 ?x)) (:functions (n) (total-cost))",
        );
        // Of the derived predicates, d1 depends only on itself, and without negation; d2 may negate d1. So the
        // axioms are stratified.
        let seed = self.condition(1, &["?x"], 0);
        let _ = write!(
            text,
            "(:derived (d1 ?x) {seed}) (:derived (d1 ?x) (exists (?y) (and (q ?x ?y) (d1 ?y))))"
        );
        let condition = self.condition(2, &["?x"], 1);
        let _ = write!(text, "(:derived (d2 ?x) {condition})");
        for action in 0..3 + self.below(2) {
            let variables: &[&'static str] = if self.below(2) == 0 { &["?a"] } else { &[] };
            let precondition = self.condition(2, variables, 2);
            let _ = write!(
                text,
                "(:action a{action} :parameters ({}) :precondition {precondition} :effect (and (increase (total-cost) {})",
                variables.join(" "),
                1 + self.below(3)
            );
            for _ in 0..=self.below(3) {
                match self.below(4) {
                    0 | 1 => {
                        let effect = self.effect(variables);
                        let _ = write!(text, " {effect}");
                    }
                    2 => {
                        let (condition, effect) = (self.condition(1, variables, 2), self.effect(variables));
                        let _ = write!(text, " (when {condition} {effect})");
                    }
                    _ => {
                        let mut extended = variables.to_vec();
                        extended.push("?e");
                        let condition = self.condition(1, &extended, 2);
                        let effect = format!("(p {})", self.term(&extended));
                        let effect = if self.below(2) == 0 { format!("(not {effect})") } else { effect };
                        let _ = write!(text, " (forall (?e) (when {condition} {effect}))");
                    }
                }
            }
            text.push_str("))");
        }
        text.push(')');
        text
    }

    /// Returns a random problem in PDDL, which fits every domain of [`Self::domain`].
    pub fn problem(&mut self) -> String {
        let mut text =
            String::from("(define (problem p) (:domain d) (:objects o3) (:init (= (n) 1) (= (total-cost) 0)");
        for fact in ["(p o1)", "(p o3)", "(q o1 o2)", "(q o2 o3)", "(q o3 o1)", "(r)"] {
            if self.below(3) == 0 {
                let _ = write!(text, " {fact}");
            }
        }
        let goal = format!("(and {} {})", self.condition(2, &[], 2), self.condition(1, &[], 2));
        let _ = write!(text, ") (:goal {goal}) (:metric minimize (total-cost)))");
        text
    }
}
