//! Table of the results of a parameter study, and means over its repetitions.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value};

use super::results::{Line, essence};
use super::study::shown;
use crate::simulate::Sample;

/// Column of the exit statuses, of which no mean is computed. Many answers have a field `status`.
const STATUS: &str = "exit_status";

/// Prefix of the columns of an answer's fields that have the name of a varied key.
const ANSWER: &str = "answer.";

/// Value in a cell. `None` if the row has no value for the column.
pub type Cell = Option<Value>;

/// A row of the table: the varied keys of a run, how it ended, and the fields of one JSON value of
/// its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Number of the run to which the row belongs.
    pub run: usize,
    /// Cells in the order of the columns.
    pub cells: Vec<Cell>,
}

/// All rows of a study's table. The columns are the union of the fields of all rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Column names: first the varied keys, then all others; both parts are sorted.
    pub columns: Vec<String>,
    /// Number of columns that are varied keys; they come first.
    pub keys: usize,
    /// Rows sorted by run; the rows of a run are in the order of its answer.
    pub rows: Vec<Row>,
}

type Common = Vec<(String, Value)>;

/// Rows with equal texts and equal values of all varied keys except those that only repeat a run, such as a
/// seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Values that all rows of the group have: varied keys and texts.
    pub common: Common,
    /// Number of rows in the group.
    pub count: usize,
    /// Statistics of each column of numbers or truth values over the rows, except varied keys, the exit
    /// status, and columns that are empty in the group.
    pub samples: Vec<(String, Sample)>,
}

impl Table {
    /// Builds the table. `rows` is the JSON pointer to an object, or a list of objects, in each answer; each
    /// object becomes a row. A run whose answer has nothing there gives one row without fields of an answer;
    /// an empty list gives no row. A field of the answers that has the name of a varied key is in the column
    /// `answer.KEY`, but is omitted if it has the value of the key in all rows.
    /// With `measured`, includes the fields that depend on the machine, such as times.
    pub fn new(lines: &[Line], rows: &str, measured: bool) -> Self {
        let mut rows_of_lines: Vec<(&Line, Map<String, Value>)> = Vec::new();
        // Fields with the name of a varied key that are not just a copy of its value.
        let mut namesakes: BTreeSet<String> = BTreeSet::new();
        for line in lines {
            let answer = if measured { line.answer.clone() } else { essence(&line.answer) };
            let mut fields = Map::new();
            fields.insert(STATUS.to_owned(), line.status.map_or(Value::Null, Into::into));
            fields.insert("timed_out".to_owned(), line.timed_out.into());
            if measured {
                fields.insert("seconds".to_owned(), line.seconds.into());
            }
            let parts = match answer.pointer(rows) {
                Some(Value::Array(parts)) => parts.clone(),
                Some(one) => vec![one.clone()],
                None => vec![Value::Null],
            };
            for part in parts {
                let mut cells = fields.clone();
                flatten("", &part, &mut cells);
                for (key, value) in &line.vary {
                    let Some(cell) = cells.remove(key) else { continue };
                    let namesake = format!("{ANSWER}{key}");
                    // Numbers such as 500 and 500.0 are equal.
                    let numbers = cell.as_f64().zip(value.as_f64());
                    let is_equal = cell.is_null()
                        || shown(&cell) == shown(&joined(value.clone()))
                        || numbers.is_some_and(|(cell, value)| cell.total_cmp(&value).is_eq());
                    if !is_equal {
                        namesakes.insert(namesake.clone());
                    }
                    cells.insert(namesake, cell);
                }
                rows_of_lines.push((line, cells));
            }
        }
        let keys: BTreeSet<String> =
            rows_of_lines.iter().flat_map(|(line, _)| line.vary.keys().cloned()).collect();
        let columns: BTreeSet<String> = rows_of_lines
            .iter()
            .flat_map(|(_, cells)| cells.keys().cloned())
            .filter(|column| {
                let key = column.strip_prefix(ANSWER);
                key.is_none_or(|key| !keys.contains(key)) || namesakes.contains(column)
            })
            .collect();
        let rows = rows_of_lines.into_iter().map(|(line, cells)| {
            let keys = keys.iter().map(|key| line.vary.get(key).cloned().map(joined));
            let cells =
                columns.iter().map(|column| cells.get(column).cloned().filter(|value| !value.is_null()));
            Row { run: line.run, cells: keys.chain(cells).collect() }
        });
        let rows = rows.collect();
        Self { keys: keys.len(), columns: keys.iter().chain(&columns).cloned().collect(), rows }
    }

    /// Formats the table as CSV: one line per row, with all columns; missing values are empty.
    pub fn to_csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header = std::iter::once("run".to_owned()).chain(self.columns.iter().cloned());
        // Writing into memory does not fail.
        let _ = writer.write_record(header);
        for row in &self.rows {
            let cells = row.cells.iter().map(|cell| cell.as_ref().map(shown).unwrap_or_default());
            let _ = writer.write_record(std::iter::once(row.run.to_string()).chain(cells));
        }
        String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
    }

    /// Groups the rows that have equal texts and equal values of all keys except those in
    /// `repetitions`. The mean of truth values is the proportion of true ones.
    pub fn groups(&self, repetitions: &[String]) -> Vec<Group> {
        let is_number = |column: usize| {
            self.rows.iter().filter_map(|row| row.cells[column].as_ref()).all(|value| figure(value).is_some())
        };
        let counts: Vec<bool> =
            (0..self.columns.len()).map(|column| column >= self.keys && is_number(column)).collect();
        let is_status = |column: usize| self.columns[column] == STATUS;
        // A field of the answers with the name of a repeated key differs between repetitions, too.
        let is_repeated = |column: usize| {
            let name = self.columns[column].as_str();
            let key = name.strip_prefix(ANSWER).unwrap_or(name);
            repetitions.iter().any(|repeated| repeated == key)
        };
        let is_common = |column: usize| !counts[column] && !is_status(column) && !is_repeated(column);
        let mut groups: Vec<(Common, Vec<&Row>)> = Vec::new();
        let mut positions: BTreeMap<String, usize> = BTreeMap::new();
        for row in &self.rows {
            let common: Common = (0..self.columns.len())
                .filter(|column| is_common(*column))
                .map(|column| (self.columns[column].clone(), row.cells[column].clone().unwrap_or_default()))
                .collect();
            let name = common.iter().map(|(_, value)| value.clone()).collect::<Value>().to_string();
            let place = *positions.entry(name).or_insert_with(|| {
                groups.push((common, Vec::new()));
                groups.len() - 1
            });
            groups[place].1.push(row);
        }
        let group = |(common, rows): (Common, Vec<&Row>)| {
            let samples = (0..self.columns.len()).filter(|column| counts[*column] && !is_status(*column));
            let samples = samples.filter_map(|column| {
                let values = rows.iter().filter_map(|row| figure(row.cells[column].as_ref()?));
                let values: Vec<f64> = values.collect();
                Some((self.columns[column].clone(), Sample::of(&values)?))
            });
            Group { common, count: rows.len(), samples: samples.collect() }
        };
        groups.into_iter().map(group).collect()
    }
}

fn figure(value: &Value) -> Option<f64> {
    value.as_bool().map(|truth| f64::from(u8::from(truth))).or_else(|| value.as_f64())
}

fn joined(value: Value) -> Value {
    match value {
        Value::Array(values) => {
            let words: Vec<String> = values.iter().map(shown).collect();
            Value::String(words.join(" "))
        }
        other => other,
    }
}

/// Adds the scalar fields of an object, and of objects within it, to `cells`. Names are paths such
/// as `a.b`. Lists are omitted.
fn flatten(path: &str, value: &Value, cells: &mut Map<String, Value>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flatten(&path, value, cells);
            }
        }
        Value::Array(_) => {}
        _ if path.is_empty() => {}
        scalar => {
            cells.insert(path.to_owned(), scalar.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn line(run: usize, seed: u64, fail: &str, answer: Value) -> Line {
        let vary = json!({"fail": [fail], "seed": seed}).as_object().expect("an object").clone();
        Line { run, vary, status: Some(0), timed_out: false, seconds: 1.5, answer, message: String::new() }
    }

    #[test]
    fn rows_have_all_columns_and_groups_their_means() {
        let lines = [
            line(0, 1, "a", json!({"x": {"cost": 2, "kind": "p"}, "statistics": {"n": 9}, "steps": [1]})),
            line(1, 2, "a", json!({"x": {"cost": 4, "kind": "p"}})),
            line(2, 1, "b", json!({"x": {"kind": "p"}})),
        ];
        let table = Table::new(&lines, "", false);
        assert_eq!(table.columns, ["fail", "seed", "exit_status", "timed_out", "x.cost", "x.kind"]);
        assert_eq!(table.rows[2].cells[4], None);
        let groups = table.groups(&["seed".to_owned()]);
        assert_eq!(groups.iter().map(|group| group.count).collect::<Vec<_>>(), [2, 1]);
        let costs = &groups[0].samples.iter().find(|(column, _)| column == "x.cost").expect("costs").1;
        assert_eq!((costs.count, costs.mean), (2, 3.0));
        // Quantile of Student's distribution for one degree of freedom, times the deviation over
        // the square root of two.
        assert!((costs.half_width - 12.706_205).abs() < 1e-9);
        assert!(Table::new(&lines, "", true).columns.contains(&"seconds".to_owned()));
        // The status of an answer is a text that separates groups.
        let answers = ["optimal", "feasible"].map(|status| line(0, 1, "a", json!({"status": status})));
        let table = Table::new(&answers, "", false);
        assert_eq!(table.columns, ["fail", "seed", "exit_status", "status", "timed_out"]);
        assert_eq!(table.groups(&["seed".to_owned()]).len(), 2);
        // A field with the name of a varied key has a column of its own, unless it repeats the key.
        let answers = [1, 5].map(|seed| line(0, 1, "a", json!({"seed": seed, "fail": "a"})));
        let table = Table::new(&answers, "", false);
        assert_eq!(table.columns, ["fail", "seed", "answer.seed", "exit_status", "timed_out"]);
        assert_eq!(table.rows[1].cells[1..3], [Some(json!(1)), Some(json!(5))]);
        let equal = [line(0, 1, "a", json!({"seed": 1.0, "fail": "a"}))];
        assert_eq!(Table::new(&equal, "", false).columns, ["fail", "seed", "exit_status", "timed_out"]);
        // It separates no groups if the key is repeated.
        let answers = ["x", "y"].map(|seed| line(0, 1, "a", json!({"seed": seed})));
        assert_eq!(Table::new(&answers, "", false).groups(&["seed".to_owned()]).len(), 1);
        let parts = Table::new(&[line(0, 1, "a", json!({"l": [{"v": 1}, {"v": 2}]}))], "/l", false);
        assert_eq!(parts.rows.len(), 2);
    }
}
