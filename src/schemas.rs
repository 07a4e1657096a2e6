//! JSON Schemas of manifests and of the JSON inputs and outputs. Most of them are derived from the types that read and
//! write the documents.

use schemars::{Schema, schema_for};
use serde_json::{Map, Value, json};

use crate::answers::{
    ChangesAnswer, CheckAnswer, ChecksAnswer, CodeAnswer, CompareAnswer, ConfigureAnswer, DesignAnswer,
    EntailmentAnswer, ErrorAnswer, ImportAnswer, InitAnswer, JournalAnswer, LintAnswer, MissionExport,
    ModelExport, ParetoAnswer, PlanAnswer, ReasonAnswer, ReasonsAnswer, SchemaAnswer, SimulateAnswer,
    VerdictAnswer, VerifyAnswer,
};
use crate::mapek::event_schema;
use crate::recording::answer_schema;
use crate::setup;
use crate::sweep::{self, SweepAnswer};

/// Name of a format, its title, and a function that returns its alternative schemas. A document has
/// to satisfy one of them.
type Entry = (&'static str, &'static str, fn() -> Vec<Schema>);

/// The formats with a schema, each with its name. After the first four, the name is the field `format` of an answer
/// without the prefix `metaplan-` and without the version, e.g. `plan` for `metaplan-plan/1`. The format `check`
/// includes `metaplan-checks/1`.
pub const FORMATS: [Entry; 25] = [
    ("manifest", "a mission's manifest", || vec![setup::schema()]),
    ("study", "a study of metaplan sweep", || vec![sweep::schema()]),
    ("event", "a line of events", || vec![event_schema()]),
    ("answer", "an answer of the loop", || vec![answer_schema()]),
    ("check", "metaplan check", || vec![schema_for!(CheckAnswer), schema_for!(ChecksAnswer)]),
    ("code", "metaplan explain CODE", || vec![schema_for!(CodeAnswer)]),
    ("compare", "metaplan compare", || vec![schema_for!(CompareAnswer)]),
    ("configure", "metaplan configure", || vec![schema_for!(ConfigureAnswer)]),
    ("entails", "metaplan reason --entails", || vec![schema_for!(EntailmentAnswer)]),
    ("error", "any command that has failed", || vec![schema_for!(ErrorAnswer)]),
    ("explain", "metaplan explain MISSION", || vec![schema_for!(ChangesAnswer), schema_for!(DesignAnswer)]),
    ("export", "metaplan export", || vec![schema_for!(MissionExport), schema_for!(ModelExport)]),
    ("import", "metaplan import", || vec![schema_for!(ImportAnswer)]),
    ("init", "metaplan init", || vec![schema_for!(InitAnswer)]),
    ("journal-report", "metaplan journal", || vec![schema_for!(JournalAnswer)]),
    ("lint", "metaplan lint", || vec![schema_for!(LintAnswer)]),
    ("pareto", "metaplan plan --pareto", || vec![schema_for!(ParetoAnswer)]),
    ("plan", "metaplan plan", || vec![schema_for!(PlanAnswer)]),
    ("reason", "metaplan reason", || vec![schema_for!(ReasonAnswer)]),
    ("reasons", "metaplan reason --why", || vec![schema_for!(ReasonsAnswer)]),
    ("schema", "metaplan reason --schema", || vec![schema_for!(SchemaAnswer)]),
    ("simulate", "metaplan simulate", || vec![schema_for!(SimulateAnswer)]),
    ("sweep", "metaplan sweep", || vec![schema_for!(SweepAnswer)]),
    ("verdict", "metaplan validate", || vec![schema_for!(VerdictAnswer)]),
    ("verification", "metaplan verify", || vec![schema_for!(VerifyAnswer)]),
];

/// Returns the schema of a format, or `None` if the format does not exist.
pub fn schema(name: &str) -> Option<Value> {
    let (_, about, schemas) = FORMATS.into_iter().find(|(format, ..)| *format == name)?;
    let mut schemas: Vec<Value> = schemas().into_iter().map(Value::from).collect();
    let mut schema = match schemas.len() {
        1 => schemas.remove(0),
        _ => either(schemas),
    };
    if let Some(fields) = schema.as_object_mut() {
        fields.insert("title".to_owned(), about.into());
    }
    Some(schema)
}

/// Joins alternative schemas by `anyOf`. Moves their `$defs` to the root, where `$ref` paths are
/// resolved.
fn either(mut schemas: Vec<Value>) -> Value {
    let mut definitions = Map::new();
    for schema in schemas.iter_mut().filter_map(Value::as_object_mut) {
        schema.remove("$schema");
        if let Some(Value::Object(embedded)) = schema.remove("$defs") {
            definitions.extend(embedded);
        }
    }
    json!({ "$schema": "https://json-schema.org/draft/2020-12/schema", "anyOf": schemas, "$defs": definitions })
}
