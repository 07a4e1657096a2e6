//! Enumerates the states that satisfy `init … endinit`.

use crate::error::{Diagnostic, Place};
use crate::prism::code::{Code, Fault};
use crate::prism::command::Variable;
use crate::prism::state::{Layout, Packed, Valuation};

/// Upper limit on the number of tried assignments of a value to a variable.
const MAX_TRIED: usize = 50_000_000;

/// Returns the states that satisfy `condition`, in lexicographic order of the values of the variables. If there are more
/// than `limit`, returns only one more than `limit`.
///
/// The search backtracks over the variables. A conjunct is evaluated as soon as all of its
/// variables have values. Fails if more than [`MAX_TRIED`] values have to be tried, or if a
/// conjunct cannot be evaluated.
pub fn starts(
    condition: Code,
    place: Place,
    variables: &[Variable],
    layout: &Layout,
    limit: usize,
) -> Result<Vec<Packed>, Diagnostic> {
    let parts = match condition {
        Code::All(parts) => parts,
        conjunct => vec![conjunct],
    };
    let mut ready: Vec<Vec<&Code>> = vec![Vec::new(); variables.len().saturating_add(1)];
    for part in &parts {
        ready[part.variables_below() as usize].push(part);
    }
    let holds = |parts: &[&Code], values: &[i64]| -> Result<bool, Diagnostic> {
        for part in parts {
            if !part.holds(values).map_err(|Fault(text)| Diagnostic::new("Q303", place, text))? {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let mut values: Valuation = variables.iter().map(|variable| variable.least).collect();
    let (mut states, mut tried_values, mut at) = (Vec::new(), 0_usize, 0_usize);
    if !holds(&ready[0], &values)? {
        return Ok(states);
    }
    // Invariant: the variables before `at` satisfy all conjuncts over them; the current value of variable `at` is
    // tried next.
    loop {
        tried_values = tried_values.saturating_add(1);
        if tried_values > MAX_TRIED {
            let text = format!(
                "more than {MAX_TRIED} combinations of values have to be tried to find the initial states"
            );
            return Err(Diagnostic::new("Q307", place, text));
        }
        let next = at.saturating_add(1);
        if at == variables.len() {
            states.push(layout.pack(&values));
            if states.len() > limit {
                return Ok(states);
            }
        } else if holds(&ready[next], &values)? {
            at = next;
            if let Some(variable) = variables.get(at) {
                values[at] = variable.least;
            }
            continue;
        } else if values[at] < variables[at].greatest {
            values[at] = values[at].saturating_add(1);
            continue;
        }
        // Backtrack to the last variable with an untried value.
        loop {
            let Some(before) = at.checked_sub(1) else { return Ok(states) };
            at = before;
            if values[at] < variables[at].greatest {
                values[at] = values[at].saturating_add(1);
                break;
            }
        }
    }
}
