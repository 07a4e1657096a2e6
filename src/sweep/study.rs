//! Reads the file of a parameter study, and enumerates its runs.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use schemars::{JsonSchema, Schema, schema_for};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};

use crate::comparison::Coadaptation;
use crate::manifest::{self, Key, ManifestPath, Part};
use crate::message::{Errors, Message, did_you_mean};
use crate::setup::Setup;

const MAX_RUNS: usize = 10_000_000;

/// The command of a study, and its varied parameters.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Sections {
    /// Description of the study.
    #[serde(default)]
    description: String,
    /// Command of `metaplan` with the arguments that are common to all runs. `{KEY}` is replaced by a
    /// varied value, `{dir}` by a separate directory for each run.
    command: Vec<String>,
    /// Time limit of a run in seconds, including the program that writes its files.
    #[serde(default)]
    time_limit: Option<f64>,
    /// JSON pointer to the rows of the table in an answer: to an object or to a list of objects.
    #[serde(default)]
    rows: String,
    /// Keys whose values are repetitions. Tables contain means over them.
    #[serde(default = "seeds")]
    repetitions: Vec<String>,
    /// Values of each key. A key that does not occur as `{KEY}` is an option of the command.
    #[serde(default)]
    vary: BTreeMap<String, Variation>,
    /// Pairs of places of a mission, as values of the key `pair`.
    #[serde(default)]
    pairs: Option<Pairs>,
    /// A program that writes the files of a run.
    #[serde(default)]
    generate: Option<Generate>,
}

fn seeds() -> Vec<String> {
    vec!["seed".to_owned()]
}

impl Sections {
    fn placeholders(&self) -> BTreeSet<&str> {
        let generator = self.generate.iter().flat_map(|generate| &generate.run);
        self.command.iter().chain(generator).flat_map(|word| placeholders(word)).collect()
    }

    fn values(&self, key: &str, variation: &Variation) -> Result<Vec<Value>, String> {
        if ["format", "quiet"].contains(&key) && !self.placeholders().contains(key) {
            let text = "cannot be varied: every run has the options `--format json` and `--quiet`";
            return Err(text.to_owned());
        }
        values(variation)
    }
}

/// The values of a key.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Variation {
    /// A list of values. A value that is a list repeats the option; a truth value includes or omits the option.
    List(Vec<Scalars>),
    /// Whole numbers.
    Range(Range),
}

/// Whole numbers at equal distances: `from`, `from + step` and so on, up to at most `to`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Range {
    /// The first value.
    from: i64,
    /// Limit of the values, included.
    to: i64,
    /// Difference between consecutive values.
    #[serde(default = "one")]
    step: i64,
}

fn one() -> i64 {
    1
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Scalars {
    Several(Vec<Scalar>),
    One(Scalar),
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Scalar {
    Truth(bool),
    Whole(i64),
    Real(f64),
    Text(String),
}

/// All ordered pairs of places, or some of them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Pairs {
    /// Manifest of a mission whose problem defines places.
    mission: PathBuf,
    /// Maximum number of pairs. If there are more pairs, a selection is used that is evenly spread over all of
    /// them. Default: all.
    #[serde(default)]
    most: Option<usize>,
}

/// A program that writes the files of a run.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Generate {
    /// The program with its arguments; `{KEY}` and `{dir}` as in `command`.
    run: Vec<String>,
}

/// Returns the JSON Schema of a study's file.
pub fn schema() -> Schema {
    schema_for!(Sections)
}

/// A parameter study: the contents of its file, and the values of all keys.
#[derive(Debug, Clone)]
pub struct Study {
    sections: Sections,
    /// Directory of the study's file, which is the working directory of the runs.
    pub directory: PathBuf,
    /// Checksum of the study's command, generator, time limit and values, of the files whose paths are words of the
    /// command or values of its input options, of all files of missions among them, and of the program's version. It does not
    /// cover the imports of a knowledge base that the command names itself, the files of the generator, and files in
    /// `{dir}`.
    pub digest: String,
    /// Varied keys with their values. The value of the last key changes from each run to the next.
    keys: Vec<(String, Vec<Value>)>,
    origin: ManifestPath,
}

/// One run of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Number of the run in the study, from 0.
    pub number: usize,
    /// Varied keys with their values in this run.
    pub vary: Map<String, Value>,
}

/// A shard I/N of a study: every N-th run, beginning with the I-th.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Index of the shard, from 1 to `of`.
    pub index: usize,
    /// Number of shards into which the study is divided.
    pub of: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 1, of: 1 }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((index, of)) if (1..=of).contains(&index) => Ok(Self { index, of }),
            _ => Err(format!("`{text}` is not of the form I/N with I from 1 to N")),
        }
    }
}

impl Study {
    /// Reads the file of a study.
    ///
    /// # Errors
    /// The file cannot be read or parsed; otherwise all mistakes in it, such as invalid values of a key, or `pairs`
    /// with a mission without places.
    pub fn read(file: &Path) -> Result<Self, Errors> {
        let (sections, place): (Sections, ManifestPath) = manifest::read(file)?;
        let wrong_at = |path: &[Key], part: Part, text: String| {
            Message::at("M150", place.file(), place.place_of(path, part), text)
        };
        let wrong = |path: &[Key], text: String| wrong_at(path, Part::Value, text);
        let mut mistakes = Vec::new();
        if sections.command.is_empty() {
            mistakes.push(wrong(
                &["command".into()],
                "`command` is empty; it should begin with a command such as `plan`".to_owned(),
            ));
        }
        let is_time = |limit: f64| limit > 0.0 && Duration::try_from_secs_f64(limit).is_ok();
        if sections.time_limit.is_some_and(|limit| !is_time(limit)) {
            mistakes.push(wrong(
                &["time_limit".into()],
                "`time_limit` should be a number of seconds above 0 and below 10^19".to_owned(),
            ));
        }
        if !sections.rows.is_empty() && !sections.rows.starts_with('/') {
            mistakes.push(wrong(
                &["rows".into()],
                format!("`rows` is `{}`; a JSON pointer begins with `/`", sections.rows),
            ));
        }
        let mut keys: Vec<(String, Vec<Value>)> = Vec::new();
        for (key, variation) in &sections.vary {
            match sections.values(key, variation) {
                Ok(values) => keys.push((key.clone(), values)),
                Err(text) => {
                    mistakes
                        .push(wrong(&["vary".into(), key.as_str().into()], format!("`vary.{key}` {text}")));
                }
            }
        }
        if let Some(pairs) = &sections.pairs {
            match places(&place.path(&pairs.mission), pairs.most) {
                Ok(values) => keys.push(("pair".to_owned(), values)),
                Err(errors) => mistakes.extend(errors),
            }
        }
        let names: BTreeSet<&str> = keys.iter().map(|(key, _)| key.as_str()).collect();
        if sections.pairs.is_some() && sections.vary.contains_key("pair") {
            mistakes.push(wrong(
                &["pairs".into()],
                "`vary.pair` and `pairs` are two lists for one key".to_owned(),
            ));
        }
        let generated = sections.generate.iter().flat_map(|generate| &generate.run).enumerate();
        let generated =
            generated.map(|(index, word)| (vec!["generate".into(), "run".into(), index.into()], word));
        let command = sections.command.iter().enumerate();
        for (path, word) in
            command.map(|(index, word)| (vec![Key::from("command"), index.into()], word)).chain(generated)
        {
            for name in placeholders(word).filter(|name| *name != "dir" && !names.contains(name)) {
                let suggestion = did_you_mean(name, names.iter().copied());
                let text = format!("`{{{name}}}` stands for a key that is not varied{suggestion}");
                mistakes.push(wrong(&path, text));
            }
        }
        for (index, name) in sections.repetitions.iter().enumerate() {
            if sections.repetitions != seeds() && !names.contains(name.as_str()) {
                let suggestion = did_you_mean(name, names.iter().copied());
                let text =
                    format!("`repetitions` names `{name}`, but the study does not vary this key{suggestion}");
                mistakes.push(wrong(&["repetitions".into(), index.into()], text));
            }
        }
        let runs = keys.iter().try_fold(1_usize, |runs, (_, values)| runs.checked_mul(values.len()));
        if runs.is_none_or(|runs| runs > MAX_RUNS) {
            mistakes.push(wrong(&[], format!("the study has more than {MAX_RUNS} runs")));
        }
        if !mistakes.is_empty() {
            return Err(place.quote(mistakes).into());
        }
        let directory = match file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        let digest = digest(&sections, &keys, &directory);
        Ok(Self { sections, directory, digest, keys, origin: place })
    }

    /// Creates a message about a mistake in the study's file. `path` contains the keys that lead to
    /// the mistaken value.
    pub fn mistake(&self, path: &[Key], text: &str) -> Message {
        let place = self.origin.place_of(path, Part::Value);
        self.origin.quote([Message::at("M150", self.origin.file(), place, text)]).swap_remove(0)
    }

    /// Returns a sample of the runs for checking the study. The sample contains the first run and,
    /// for each value of each key, a run that differs from the first run only in this value. Number
    /// ranges and pairs contribute only their last value. Each run has the path of its value in the
    /// file; the first run has the path of the command. The sample of a study without runs is
    /// empty.
    pub fn samples(&self) -> Vec<(Vec<Key>, Planned)> {
        if self.is_empty() {
            return Vec::new();
        }
        let mut samples = vec![(vec!["command".into()], self.planned(0))];
        let mut stride = 1;
        for (key, values) in self.keys.iter().rev() {
            let variation = self.sections.vary.get(key);
            let is_list = matches!(variation, Some(Variation::List(_)));
            let first = if is_list { 1 } else { values.len().saturating_sub(1).max(1) };
            let path = |index: usize| match variation {
                Some(Variation::List(_)) => vec!["vary".into(), key.as_str().into(), index.into()],
                Some(Variation::Range(_)) => vec!["vary".into(), key.as_str().into()],
                None => vec!["pairs".into()],
            };
            samples.extend((first..values.len()).map(|index| (path(index), self.planned(index * stride))));
            stride *= values.len();
        }
        samples
    }

    /// Returns `true` if a program generates files for each run, so that these files do not exist
    /// in advance.
    pub fn generates(&self) -> bool {
        self.sections.generate.is_some()
    }

    /// Returns the number of runs.
    pub fn len(&self) -> usize {
        self.keys.iter().map(|(_, values)| values.len()).product()
    }

    /// Returns `true` if the study has no runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the runs of a shard in ascending order.
    pub fn runs(&self, shard: Shard) -> impl Iterator<Item = Planned> + '_ {
        (shard.index - 1..self.len()).step_by(shard.of).map(|number| self.planned(number))
    }

    fn planned(&self, number: usize) -> Planned {
        let mut remaining = number;
        let mut vary = Vec::new();
        for (key, values) in self.keys.iter().rev() {
            // The number of a run is a mixed-radix number whose digits select the values.
            vary.push((key.clone(), values[remaining % values.len()].clone()));
            remaining /= values.len();
        }
        Planned { number, vary: vary.into_iter().rev().collect() }
    }

    /// Returns the JSON pointer to the part of an answer from which table rows are built.
    pub fn rows(&self) -> &str {
        &self.sections.rows
    }

    /// Returns the description of the study.
    pub fn description(&self) -> &str {
        &self.sections.description
    }

    /// Returns the varied keys in order, each with `true` if it only repeats runs, like a seed.
    pub fn keys(&self) -> Vec<(String, bool)> {
        let is_repetition = |key: &String| self.sections.repetitions.contains(key);
        self.keys.iter().map(|(key, _)| (key.clone(), is_repetition(key))).collect()
    }

    /// Returns the time limit of a run in seconds, or `None` for no limit.
    pub fn time_limit(&self) -> Option<f64> {
        self.sections.time_limit
    }

    /// Returns the arguments of a run's command, without the program's name. `directory` replaces `{dir}`. The last
    /// arguments request an answer in JSON without warnings.
    pub fn words(&self, run: &Planned, directory: &Path) -> Vec<String> {
        let command = self.sections.command.iter();
        let mut words: Vec<String> = command.map(|word| run.filled(word, directory)).collect();
        let named = self.sections.placeholders();
        for (key, value) in run.vary.iter().filter(|(key, _)| !named.contains(key.as_str())) {
            let several = match value {
                Value::Array(values) => values.clone(),
                one => vec![one.clone()],
            };
            for value in several {
                match value {
                    Value::Bool(true) => words.push(format!("--{key}")),
                    Value::Bool(false) => {}
                    value => words.push(format!("--{key}={}", shown(&value))),
                }
            }
        }
        words.extend(["--format".to_owned(), "json".to_owned(), "--quiet".to_owned()]);
        words
    }

    /// Returns the command line of the program that writes the files of a run, if the study has
    /// such a program.
    pub fn generator(&self, run: &Planned, directory: &Path) -> Option<Vec<String>> {
        let generate = self.sections.generate.as_ref()?;
        Some(generate.run.iter().map(|word| run.filled(word, directory)).collect())
    }
}

fn placeholders(word: &str) -> impl Iterator<Item = &str> {
    word.split('{').skip(1).filter_map(|rest| rest.split_once('}').map(|(name, _)| name))
}

impl Planned {
    fn filled(&self, word: &str, directory: &Path) -> String {
        filled(word, |name| match name {
            "dir" => Some(directory.to_string_lossy().into_owned()),
            key => self.vary.get(key).map(shown),
        })
    }
}

/// Replaces each name in braces for which `value` returns a text. Braces in these texts have no meaning.
fn filled(word: &str, value: impl Fn(&str) -> Option<String>) -> String {
    let mut parts = word.split('{');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once('}').and_then(|(name, end)| Some((value(name)?, end))) {
            Some((value, end)) => text += &(value + end),
            None => text.extend(["{", part]),
        }
    }
    text
}

/// Formats a value as in a command: texts without quotes.
pub(super) fn shown(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn values(variation: &Variation) -> Result<Vec<Value>, String> {
    let scalar = |scalar: &Scalar| match scalar {
        Scalar::Truth(value) => json!(value),
        Scalar::Whole(value) => json!(value),
        Scalar::Real(value) => json!(value),
        Scalar::Text(value) => json!(value),
    };
    let values: Vec<Value> = match variation {
        Variation::List(list) => list
            .iter()
            .map(|value| match value {
                Scalars::One(one) => scalar(one),
                Scalars::Several(several) => several.iter().map(scalar).collect(),
            })
            .collect(),
        Variation::Range(Range { step, .. }) if *step <= 0 => {
            return Err(format!("has a step of {step}; it should be above 0"));
        }
        Variation::Range(Range { from, to, step }) => {
            // The difference of two 64-bit numbers can exceed 64 bits.
            let intervals = (i128::from(*to) - i128::from(*from)) / i128::from(*step);
            if intervals >= MAX_RUNS as i128 {
                return Err(format!("has more than {MAX_RUNS} values"));
            }
            (*from..=*to).step_by(*step as usize).map(|value| json!(value)).collect()
        }
    };
    if values.is_empty() { Err("has no value".to_owned()) } else { Ok(values) }
}

/// Returns ordered pairs of a mission's places, as texts `start,goal`. If there are more than
/// `most`, selects `most` pairs (at least one), evenly spread.
fn places(mission: &Path, most: Option<usize>) -> Result<Vec<Value>, Errors> {
    let Setup { mission, roles, .. } = Setup::read(mission)?;
    let (problem, _) = mission.filled()?;
    let places = Coadaptation::new(&mission, &problem, &roles)?.places;
    let pairs: Vec<String> = places
        .iter()
        .flat_map(|start| {
            places.iter().filter(move |goal| *goal != start).map(move |goal| format!("{start},{goal}"))
        })
        .collect();
    let count = most.unwrap_or(pairs.len()).clamp(1, pairs.len().max(1)).min(pairs.len());
    Ok((0..count).map(|number| json!(pairs[number * pairs.len() / count])).collect())
}

/// Returns a word of the command for all values of its keys in braces. `{dir}` is not replaced, because files in the
/// directory of a run are not files of the study.
fn instances(word: &str, keys: &[(String, Vec<Value>)]) -> impl Iterator<Item = String> {
    let is_in_word = |key: &str| key != "dir" && placeholders(word).any(|name| name == key);
    let keys: Vec<_> = keys.iter().filter(|(key, _)| is_in_word(key)).collect();
    let count: usize = keys.iter().map(|(_, values)| values.len()).product();
    (0..count).map(move |number| {
        let mut remaining = number;
        // The number is a mixed-radix number whose digits select the values.
        let digits = keys.iter().rev().map(|(key, values)| {
            let value = &values[remaining % values.len()];
            remaining /= values.len();
            (key.as_str(), value)
        });
        let chosen: BTreeMap<&str, &Value> = digits.collect();
        filled(word, |name| chosen.get(name).map(|value| shown(value)))
    })
}

fn several(value: &Value) -> &[Value] {
    match value {
        Value::Array(values) => values,
        one => std::slice::from_ref(one),
    }
}

/// Options whose values are files that a run reads. Files that runs write do not belong to the digest.
const INPUT_OPTIONS: [&str; 12] = [
    "mission",
    "adaptation",
    "assert",
    "catalog",
    "entails",
    "evaluate",
    "events",
    "kb",
    "props",
    "published",
    "retract",
    "rules",
];

fn digest(sections: &Sections, keys: &[(String, Vec<Value>)], directory: &Path) -> String {
    let mut hash = Sha256::new();
    let mut part = |bytes: &[u8]| {
        // The length separates the parts, so that different studies cannot have the same input.
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    // Another version may give other answers, so its results must not be mixed with these.
    part(env!("CARGO_PKG_VERSION").as_bytes());
    part(format!("{:?} {:?} {:?}", sections.command, sections.time_limit, sections.generate).as_bytes());
    part(json!(keys).to_string().as_bytes());
    // An option is not the path of a file, but its value may be one.
    let words = sections.command.iter().filter_map(|word| match word.split_once('=') {
        Some((option, value)) if option.starts_with('-') => {
            INPUT_OPTIONS.contains(&option.trim_start_matches('-')).then_some(value)
        }
        _ => Some(word.as_str()).filter(|word| !word.starts_with('-')),
    });
    let options = keys.iter().filter(|(key, _)| INPUT_OPTIONS.contains(&key.as_str()));
    let options = options.flat_map(|(_, values)| values);
    let options = options.flat_map(several).filter_map(Value::as_str).map(str::to_owned);
    for word in words.flat_map(|word| instances(word, keys)).chain(options) {
        let path = directory.join(word);
        let Ok(bytes) = std::fs::read(&path) else { continue };
        part(&bytes);
        // Only manifests of missions can be read as such.
        let Ok(setup) = Setup::read(&path) else { continue };
        for bytes in setup.files().iter().filter_map(|file| std::fs::read(file).ok()) {
            part(&bytes);
        }
    }
    hash.finalize().iter().take(16).fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(text: &str) -> Result<Study, Errors> {
        let folder = tempfile::tempdir().expect("a directory");
        let file = folder.path().join("study.toml");
        std::fs::write(&file, text).expect("it can be written");
        Study::read(&file)
    }

    const TEXT: &str = "command = ['plan', 'm-{n}.toml']\n\
        [vary]\nfail = [[], ['a', 'b']]\nn = {from = 1, to = 5, step = 2}\nstay-close = [true, false]\nset = ['x=1']\n";

    #[test]
    fn files_with_placeholders_belong_to_the_digest() {
        let folder = tempfile::tempdir().expect("a directory");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("it can be written");
        };
        let digest = || Study::read(&folder.path().join("study.toml")).expect("a study").digest;
        write("study.toml", TEXT);
        let without = digest();
        write("m-3.toml", "a");
        let with = digest();
        write("m-3.toml", "b");
        assert!(without != with && with != digest());
        write("m-3.toml", "a");
        // No run uses this file.
        write("m-2.toml", "a");
        assert_eq!(with, digest());
    }

    #[test]
    fn files_of_options_belong_to_the_digest() {
        let folder = tempfile::tempdir().expect("a directory");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("it can be written");
        };
        let command = "command = ['plan', 'd.pddl', 'p.pddl', '--rules=r-{n}.txt']";
        write("study.toml", &format!("{command}\n[vary]\nkb = ['a.ttl', ['b.ttl', 'c.ttl']]\nn = [1]\n"));
        let digest = || Study::read(&folder.path().join("study.toml")).expect("a study").digest;
        for name in ["r-1.txt", "a.ttl", "b.ttl", "c.ttl"] {
            let before = digest();
            write(name, "x");
            assert_ne!(before, digest(), "{name}");
        }
    }

    #[test]
    fn braces_in_values_have_no_meaning() {
        let text =
            "command = ['plan', '{a}-{b}{', '{dir}']\n[vary]\na = ['{b}', '{dir}']\nb = ['{a}', 'x']\n";
        let study = study(text).expect("a study");
        let words: Vec<String> =
            study.runs(Shard::default()).map(|run| study.words(&run, Path::new("{a}"))[1].clone()).collect();
        assert_eq!(words, ["{b}-{a}{", "{b}-x{", "{dir}-{a}{", "{dir}-x{"]);
        assert_eq!(instances("{a}-{b}{", &study.keys).collect::<Vec<_>>(), words);
        assert_eq!(study.words(&study.planned(0), Path::new("{a}"))[2], "{a}");
    }

    #[test]
    fn runs_are_the_product_and_shards_divide_it() {
        let study = study(TEXT).expect("a study");
        assert_eq!(study.len(), 12);
        let runs: Vec<Planned> = study.runs(Shard::default()).collect();
        assert_eq!(runs.len(), 12);
        let mut divided: Vec<Planned> =
            (1..=5).flat_map(|index| study.runs(Shard { index, of: 5 }).collect::<Vec<_>>()).collect();
        divided.sort_by_key(|run| run.number);
        assert_eq!(divided, runs);
        let words = |number: usize| study.words(&runs[number], Path::new("d")).join(" ");
        assert_eq!(words(0), "plan m-1.toml --set=x=1 --stay-close --format json --quiet");
        assert_eq!(words(11), "plan m-5.toml --fail=a --fail=b --set=x=1 --format json --quiet");
    }

    #[test]
    fn all_mistakes_are_reported_together() {
        let text =
            "command = []\nrows = 'x'\ntime_limit = 0\n[vary]\na = []\nb = {from = 1, to = 2, step = 0}\n";
        let errors = study(text).expect_err("it is wrong");
        assert_eq!(errors.iter().count(), 5, "{errors}");
        let wide =
            format!("b = {{from = {}, to = {}, step = 3}}\nc = {{from = 3, to = 1}}\n", i64::MIN, i64::MAX);
        let errors =
            study(&format!("command = ['plan']\n[vary]\n{wide}")).expect_err("it is wrong").to_string();
        assert!(errors.contains("`vary.b` has more than 10000000 values"), "{errors}");
        assert!(errors.contains("`vary.c` has no value"), "{errors}");
        for limit in ["-1", "nan", "inf", "1e30"] {
            let errors = study(&format!("command = ['plan']\ntime_limit = {limit}\n")).expect_err(limit);
            assert!(errors.to_string().contains("time_limit"), "{errors}");
        }
        let quiet = study("command = ['plan']\n[vary]\nquiet = [true, false]\nformat = ['json']\n");
        let errors = quiet.expect_err("every run is quiet");
        assert_eq!(errors.iter().count(), 2, "{errors}");
        for key in ["quiet", "format"] {
            let text = format!("`vary.{key}` cannot be varied: every run has the options `--format json`");
            assert!(errors.to_string().contains(&text), "{errors}");
        }
        assert!(study("command = ['plan', '{quiet}']\n[vary]\nquiet = ['a.toml']\n").is_ok());
        let errors = study("command = ['plan', '{x}']").expect_err("x is not varied");
        assert!(errors.to_string().contains("{x}"), "{errors}");
        assert!(
            "0/3".parse::<Shard>().is_err()
                && "4/3".parse::<Shard>().is_err()
                && "x".parse::<Shard>().is_err()
        );
        assert_eq!("3/3".parse(), Ok(Shard { index: 3, of: 3 }));
    }
}
