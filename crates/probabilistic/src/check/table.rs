//! Policies as tables over the values of variables, and their JSON format.

use serde_json::{Map, Value, json};

use crate::error::Error;
use crate::explore::{Explored, Generator};
use crate::mdp::dense;
use crate::number::Number;
use crate::prism::{Packed, Program};
use crate::solve::NONE;

/// A memoryless deterministic policy: its choice in each state that is reachable under the policy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolicyTable {
    /// The variables in the order of the values in each row: name, and `true` for a Boolean
    /// variable.
    pub variables: Vec<(String, bool)>,
    /// One row for each state with a choice.
    pub rows: Vec<Row>,
}

/// The choice of a policy in one state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The values of the variables in this state, in the order of [`PolicyTable::variables`].
    pub values: Vec<i64>,
    /// The action of the choice; empty for a command without an action.
    pub action: String,
    /// Position of the choice among the choices of the state, from 0.
    pub choice: usize,
}

fn numbered(number: usize, description: &str) -> String {
    format!("state {}: {description}", number.saturating_add(1))
}

const FORMAT: &str = "metaplan-policy/1";

impl PolicyTable {
    /// Converts the table to JSON.
    pub fn to_json(&self) -> Value {
        let row = |row: &Row| {
            let values = self.variables.iter().zip(&row.values).map(|((name, is_bool), value)| {
                (name.clone(), if *is_bool { json!(*value != 0) } else { json!(value) })
            });
            let state: Map<String, Value> = values.collect();
            json!({ "state": state, "action": row.action, "choice": row.choice })
        };
        json!({ "format": FORMAT, "states": self.rows.iter().map(row).collect::<Vec<_>>() })
    }

    /// Parses a table in the JSON format of [`Self::to_json`].
    ///
    /// # Errors
    /// The first violation of the format.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let policy_error = |description: String| Error::Policy(description);
        let json: Value =
            serde_json::from_str(text).map_err(|error| policy_error(format!("not JSON: {error}")))?;
        if json["format"] != FORMAT {
            return Err(policy_error(format!("`format` must be `{FORMAT}`")));
        }
        let Some(states) = json["states"].as_array() else {
            return Err(policy_error("`states` must be a list".to_owned()));
        };
        let mut table = Self { variables: Vec::new(), rows: Vec::new() };
        for (number, entry) in states.iter().enumerate() {
            let problem = |description: &str| policy_error(numbered(number, description));
            let Some(state) = entry["state"].as_object() else {
                return Err(problem("`state` must be an object"));
            };
            // The first state determines the names and types of the variables.
            if number == 0 {
                table.variables =
                    state.iter().map(|(name, value)| (name.clone(), value.is_boolean())).collect();
            }
            let mut values = Vec::new();
            for (name, _) in &table.variables {
                let value = state.get(name).and_then(|v| v.as_bool().map(i64::from).or_else(|| v.as_i64()));
                values.push(value.ok_or_else(|| problem(&format!("no value of `{name}`")))?);
            }
            let action = entry["action"].as_str().ok_or_else(|| problem("`action` must be a text"))?;
            let choice = entry["choice"].as_u64().ok_or_else(|| problem("`choice` must be a number"))?;
            let choice = usize::try_from(choice).map_err(|_| problem("`choice` is too large"))?;
            table.rows.push(Row { values, action: action.to_owned(), choice });
        }
        Ok(table)
    }

    /// Returns for each state of an explored model the number of the policy's choice in the process, or
    /// [`NONE`] for a state without a row.
    ///
    /// # Errors
    /// The table does not match the model: a missing variable, an unreached state, a missing choice, or a
    /// choice with another action.
    pub fn choices<N: Number>(
        &self,
        program: &Program<N>,
        explored: &Explored<Packed, N>,
    ) -> Result<Vec<u32>, Error> {
        let mut policy = vec![NONE; explored.mdp.states()];
        // The rows define the variables, so a table without rows has none.
        if self.rows.is_empty() {
            return Ok(policy);
        }
        let mut order = Vec::new();
        for variable in &program.variables {
            let position = self.variables.iter().position(|(name, _)| *name == variable.name);
            let missing = || Error::Policy(format!("the policy has no variable `{}`", variable.name));
            order.push(position.ok_or_else(missing)?);
        }
        for (number, row) in self.rows.iter().enumerate() {
            let problem = |description: &str| Error::Policy(numbered(number, description));
            let values: Vec<i64> = order.iter().map(|at| row.values[*at]).collect();
            let state = program
                .pack(&values)
                .and_then(|packed| explored.states.number(program.code(&packed), &packed));
            let state = state.ok_or_else(|| problem("the model does not reach this state"))?;
            let choices = explored.mdp.choices(state);
            let choice = choices.clone().nth(row.choice);
            let choice = choice.ok_or_else(|| problem("the model has no such choice there"))?;
            if program.action_name(explored.mdp.action(choice)) != row.action {
                return Err(problem("the choice has another action"));
            }
            policy[state] = dense(choice);
        }
        Ok(policy)
    }
}
