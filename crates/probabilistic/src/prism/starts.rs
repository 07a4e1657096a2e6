//! `init … endinit`: the states in which it holds.

use crate::error::{Diagnostic, Place};
use crate::prism::code::{Code, Fault};
use crate::prism::command::Variable;
use crate::prism::state::{Layout, Packed, Valuation};

/// Values of variables that are tried at most.
const TRIED: usize = 50_000_000;

/// All states in which a condition holds, by the values of the variables in their order.
///
/// Variables get their values one after the other, and each part of the condition is asked as soon as all of its variables
/// have one.
pub fn starts(
    condition: Code,
    place: Place,
    variables: &[Variable],
    layout: &Layout,
) -> Result<Vec<Packed>, Diagnostic> {
    let parts = match condition {
        Code::All(parts) => parts,
        other => vec![other],
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
    let (mut found, mut tried, mut at) = (Vec::new(), 0_usize, 0_usize);
    if !holds(&ready[0], &values)? {
        return Ok(found);
    }
    // The variables before `at` have values that are fine; the one at `at` is to be tried as it is.
    loop {
        tried = tried.saturating_add(1);
        if tried > TRIED {
            let text =
                format!("more than {TRIED} combinations of values have to be tried to find where it starts");
            return Err(Diagnostic::new("Q307", place, text));
        }
        let next = at.saturating_add(1);
        if at == variables.len() {
            found.push(layout.pack(&values));
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
        // Back to the last variable that has another value.
        loop {
            let Some(before) = at.checked_sub(1) else { return Ok(found) };
            at = before;
            if values[at] < variables[at].greatest {
                values[at] = values[at].saturating_add(1);
                break;
            }
        }
    }
}
