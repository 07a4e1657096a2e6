//! Monotonicity of numeric variables: whether a higher value is never worse, a lower value is never worse, or
//! neither.
//!
//! A variable is needed upwards if a higher value can make a condition true, and downwards if a lower value
//! can. The need is propagated to the variables from which the variable is computed: in the same direction
//! for positive coefficients, in the opposite direction for negative ones. The least fixpoint determines how
//! search nodes (labels) are compared in a search with resources \[1\]. A variable that is needed in one
//! direction is compared by ≥ or ≤. A variable that is needed in both directions must be equal, and a
//! variable that is not needed is ignored.
//!
//! \[1\] M. Desrochers, F. Soumis: A generalized permanent labelling algorithm for the shortest path problem
//! with time windows, INFOR 26(3), 1988.

use task::task::number::TaskNumber;
use task::task::quantity::Linear;
use task::task::{Condition, Fact, Task};

/// Directions in which a number or a fact is needed: `up` if a higher value (or true) helps, `down` if a
/// lower value (or false) helps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Polarity {
    pub up: bool,
    pub down: bool,
}

const UP: Polarity = Polarity { up: true, down: false };
const BOTH: Polarity = Polarity { up: true, down: true };

impl Polarity {
    fn flipped(self) -> Self {
        Self { up: self.down, down: self.up }
    }

    fn with(self, other: Self) -> Self {
        Self { up: self.up || other.up, down: self.down || other.down }
    }
}

struct PolarityAnalysis<'a, N> {
    task: &'a Task<N>,
    numbers: Vec<Polarity>,
    facts: Vec<Polarity>,
    changed: bool,
}

/// Returns the polarity of each numeric variable of a task. Only conditions, effects and the goal count; a
/// metric that reads numeric variables is ignored.
pub fn directions<N: TaskNumber>(task: &Task<N>) -> Vec<Polarity> {
    let numbers = vec![Polarity::default(); task.initial.numbers.len()];
    let facts = vec![Polarity::default(); task.variables.len()];
    let mut analysis = PolarityAnalysis { task, numbers, facts, changed: true };
    if task.initial.numbers.is_empty() {
        return analysis.numbers;
    }
    while std::mem::take(&mut analysis.changed) {
        analysis.spread();
    }
    analysis.numbers
}

impl<N: TaskNumber> PolarityAnalysis<'_, N> {
    fn spread(&mut self) {
        let task = self.task;
        self.condition(&task.goal, UP);
        for operator in &task.operators {
            self.condition(&operator.condition, UP);
            // A conditional effect may help or hurt, so its condition is needed in both directions.
            for literal in operator.conditional.iter().flat_map(|effect| &effect.condition) {
                self.fact(literal.fact, BOTH);
            }
            for effect in &operator.numeric_effects {
                let polarity = self.numbers[effect.variable.index()];
                self.linear(&effect.value, polarity);
            }
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let head = self.facts[rule.head.variable.index()];
            let polarity = if rule.head.value == 0 { head } else { head.flipped() };
            self.condition(&rule.body, polarity);
        }
    }

    fn condition(&mut self, condition: &Condition<N>, polarity: Polarity) {
        for fact in &condition.facts {
            self.fact(*fact, polarity);
        }
        for literal in condition.clauses.iter().flatten() {
            self.fact(literal.fact, if literal.positive { polarity } else { polarity.flipped() });
        }
        for linear in condition.linears() {
            self.linear(linear, polarity);
        }
    }

    /// Adds the directions in which a fact is needed. They are stored for value 0 of its variable, which
    /// means true if the variable is derived; for another value they are swapped.
    fn fact(&mut self, fact: Fact, polarity: Polarity) {
        let polarity = if fact.value == 0 { polarity } else { polarity.flipped() };
        let current = &mut self.facts[fact.variable.index()];
        let next = current.with(polarity);
        self.changed |= next != *current;
        *current = next;
    }

    fn linear(&mut self, linear: &Linear<N>, polarity: Polarity) {
        for (variable, factor) in &linear.coefficients {
            // A negative coefficient swaps the directions.
            let polarity = if *factor >= N::zero() { polarity } else { polarity.flipped() };
            let current = &mut self.numbers[variable.index()];
            let next = current.with(polarity);
            self.changed |= next != *current;
            *current = next;
        }
    }
}

/// Returns the polarities by which certificates compare states: a higher value is never worse for
/// all numeric variables, or all of them must be equal.
pub(super) fn uniform_directions<N: TaskNumber>(task: &Task<N>) -> Vec<Polarity> {
    vec![if is_monotone(task) { UP } else { BOTH }; task.initial.numbers.len()]
}

/// Returns `true` if a higher value is never worse, for every numeric variable of the task.
pub fn is_monotone<N: TaskNumber>(task: &Task<N>) -> bool {
    directions(task).iter().all(|polarity| !polarity.down)
}
