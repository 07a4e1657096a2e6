//! Computes the optimal cost of a written task by uniform-cost search over its states. Negative costs count as 0.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use num_rational::BigRational;
use serde_json::Value;

/// Maximum number of states; with more states, the task is not decided.
const STATE_LIMIT: usize = 2_000;

type State = (Vec<i64>, Vec<i64>);

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> Option<i64> {
    value.as_i64()
}

fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_i64()?).ok()
}

struct Task<'t>(&'t Value);

#[derive(Debug, PartialEq, Eq)]
pub enum Best {
    /// In units of the metric.
    Cost(BigRational),
    NoPlan,
}

/// Computes the best metric of a ground task. Returns `None` if the text is not a valid task or the task is
/// too large.
pub fn optimum(text: &str) -> Option<Best> {
    let document: Value = serde_json::from_str(text).ok()?;
    let task = Task(&document);
    let objective = &document["objective"];
    let (scale, offset) = (number(&objective["scale"])?, number(&objective["offset"])?);
    if scale <= 0 {
        return None;
    }
    let sign = if objective["maximize"].as_bool()? { -1 } else { 1 };
    let metric = |cost: i64| BigRational::new((sign * (cost + offset)).into(), scale.into());
    task.cheapest(metric)
}

impl Task<'_> {
    fn cheapest(&self, metric: impl Fn(i64) -> BigRational) -> Option<Best> {
        let values = list(&self.0["values"]).iter().map(number).collect::<Option<Vec<_>>>()?;
        let numbers = list(&self.0["numbers"]).iter().map(number).collect::<Option<Vec<_>>>()?;
        let first = self.derived((values, numbers))?;
        let mut best: HashMap<State, i64> = HashMap::from([(first.clone(), 0)]);
        let mut open: BTreeSet<(i64, State)> = BTreeSet::from([(0, first)]);
        while let Some((cost, state)) = open.pop_first() {
            if best.len() > STATE_LIMIT {
                return None;
            }
            if self.holds(&self.0["goal"], &state, &BTreeMap::new())? {
                return Some(Best::Cost(metric(cost)));
            }
            for operator in list(&self.0["operators"]) {
                for choice in self.choices(operator)? {
                    if !self.holds(&operator["condition"], &state, &choice)? {
                        continue;
                    }
                    let step = self.quantity(&operator["cost"], &choice)?;
                    let next = self.after(operator, &state, &choice)?;
                    // A step that improves the metric only makes plans cheaper, so counting it as 0 conceals
                    // no false claim.
                    let total = cost + step.max(0);
                    if best.get(&next).is_none_or(|known| total < *known) {
                        best.insert(next.clone(), total);
                        open.insert((total, next));
                    }
                }
            }
        }
        Some(Best::NoPlan)
    }

    /// Returns the admitted choices of designs for an operator: for each slot, the index of its design and the number
    /// of its designs.
    fn choices(&self, operator: &Value) -> Option<Vec<BTreeMap<usize, (i64, i64)>>> {
        let mut all = vec![BTreeMap::new()];
        for (slot, uses) in list(self.0["uses"].get(index(&operator["uses"])?)?).iter().enumerate() {
            let size = list(uses.get(1)?).len() as i64;
            let longer = |choice: BTreeMap<usize, (i64, i64)>| {
                (0..size).map(move |design| {
                    let mut own = choice.clone();
                    own.insert(slot, (design, size));
                    own
                })
            };
            all = all.into_iter().flat_map(longer).collect();
        }
        let exclusions = list(self.0["exclusions"].get(index(&operator["exclusions"])?)?);
        all.retain(|choice| {
            !exclusions.iter().any(|exclusion| {
                let chosen: Vec<Value> = list(&exclusion["slots"])
                    .iter()
                    .filter_map(|slot| Some(choice.get(&index(slot)?)?.0.into()))
                    .collect();
                list(&exclusion["combinations"]).iter().any(|own| list(own) == chosen)
            })
        });
        Some(all)
    }

    fn quantity(&self, quantity: &Value, choice: &BTreeMap<usize, (i64, i64)>) -> Option<i64> {
        let mut sum = number(&quantity["constant"])?;
        for table in list(&quantity["tables"]) {
            let mut row = 0;
            for slot in list(table.get(0)?) {
                let (design, size) = choice.get(&index(slot)?)?;
                row = row * size + design;
            }
            sum += number(self.0["tables"].get(index(table.get(1)?)?)?.get(usize::try_from(row).ok()?)?)?;
        }
        Some(sum)
    }

    fn linear(&self, linear: &Value, state: &State, choice: &BTreeMap<usize, (i64, i64)>) -> Option<i64> {
        let mut sum = self.quantity(&linear["quantity"], choice)?;
        for factor in list(&linear["factors"]) {
            let own = state.1.get(index(factor.get(0)?)?)?;
            sum = sum.checked_add(own.checked_mul(number(factor.get(1)?)?)?)?;
        }
        Some(sum)
    }

    fn fact(fact: &Value, state: &State) -> Option<bool> {
        Some(*state.0.get(index(fact.get(0)?)?)? == number(fact.get(1)?)?)
    }

    fn literal(literal: &Value, state: &State) -> Option<bool> {
        Some(Self::fact(literal.get(0)?, state)? == literal.get(1)?.as_bool()?)
    }

    fn holds(&self, condition: &Value, state: &State, choice: &BTreeMap<usize, (i64, i64)>) -> Option<bool> {
        let mut holds = true;
        for fact in list(&condition["facts"]) {
            holds &= Self::fact(fact, state)?;
        }
        for clause in list(&condition["clauses"]) {
            let mut some = false;
            for literal in list(clause) {
                some |= Self::literal(literal, state)?;
            }
            holds &= some;
        }
        for linear in list(&condition["comparisons"]) {
            holds &= self.linear(linear, state, choice)? >= 0;
        }
        Some(holds)
    }

    fn after(&self, operator: &Value, state: &State, choice: &BTreeMap<usize, (i64, i64)>) -> Option<State> {
        let mut next = state.clone();
        let mut set = |facts: &Value| {
            for fact in list(facts) {
                *next.0.get_mut(index(fact.get(0)?)?)? = number(fact.get(1)?)?;
            }
            Some(())
        };
        set(&operator["effects"])?;
        for conditional in list(&operator["conditional"]) {
            let mut holds = true;
            for literal in list(&conditional["condition"]) {
                holds &= Self::literal(literal, state)?;
            }
            if holds {
                set(&conditional["effects"])?;
            }
        }
        for change in list(&operator["changes"]) {
            *next.1.get_mut(index(change.get(0)?)?)? = self.linear(change.get(1)?, state, choice)?;
        }
        self.derived(next)
    }

    /// A derived variable is false unless a rule derives it.
    fn derived(&self, mut state: State) -> Option<State> {
        let basic = index(&self.0["basic"])?;
        for (variable, values) in list(&self.0["variables"]).iter().enumerate().skip(basic) {
            *state.0.get_mut(variable)? = list(values).len() as i64 - 1;
        }
        for layer in list(&self.0["axioms"]) {
            loop {
                let mut news = false;
                for rule in list(&layer["rules"]) {
                    let head = rule.get(0)?;
                    if number(head.get(1)?)? != 0 {
                        return None;
                    }
                    if !Self::fact(head, &state)? && self.holds(rule.get(1)?, &state, &BTreeMap::new())? {
                        *state.0.get_mut(index(head.get(0)?)?)? = number(head.get(1)?)?;
                        news = true;
                    }
                }
                if !news {
                    break;
                }
            }
        }
        Some(state)
    }
}
