//! Mutates the files of a certificate, driven by random numbers or by the bytes of a fuzzer.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use metaplan_verify::digest::digest;
use serde_json::{Value, json};

pub type Files = BTreeMap<String, Vec<u8>>;

const REPETITION_LIMIT: usize = 300;

/// A source of random decisions.
pub enum Draw<'d> {
    /// Deterministic pseudo-random numbers (`SplitMix64`).
    Random(u64),
    /// The bytes from a fuzzer, followed by zeros.
    Bytes(&'d [u8]),
}

impl Draw<'_> {
    /// Returns a number below `limit`, which must not be 0.
    pub fn below(&mut self, limit: usize) -> usize {
        let number = match self {
            Self::Random(state) => {
                *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
                let mut z = *state;
                z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
                z ^ (z >> 31)
            }
            Self::Bytes(bytes) => {
                let count = if limit <= 256 { 1 } else { 3 }.min(bytes.len());
                let (head, tail) = bytes.split_at(count);
                *bytes = tail;
                head.iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
            }
        };
        usize::try_from(number % limit as u64).expect("below a usize")
    }

    fn choose<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }
}

pub fn certificates(folder: &Path) -> Vec<Files> {
    let entries = |path: &Path| {
        let mut paths: Vec<_> =
            std::fs::read_dir(path).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
        paths.sort();
        paths
    };
    let folders = entries(folder).into_iter().filter(|path| path.join("manifest.json").is_file());
    let files = |folder: PathBuf| {
        // The certificate of a front has subdirectories.
        let inner = entries(&folder).into_iter();
        let inner = inner.flat_map(|path| if path.is_dir() { entries(&path) } else { vec![path] });
        let name = |path: &Path| {
            let name = path.strip_prefix(&folder).expect("a file in the folder");
            name.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
        };
        inner.map(|path| (name(&path), std::fs::read(&path).expect("a file"))).collect()
    };
    folders.map(files).collect()
}

/// Mutates a certificate in up to three places. In most cases, the manifest is updated with the
/// sizes and digests of the mutated files.
pub fn mutate(files: &Files, draw: &mut Draw<'_>) -> Files {
    let mut files = files.clone();
    let names: Vec<String> = files.keys().cloned().collect();
    for _ in 0..=draw.below(3) {
        let name = draw.choose(&names);
        let old = &files[name];
        let text = String::from_utf8_lossy(old);
        let new = match (draw.below(6), serde_json::from_str::<Value>(&text)) {
            (0, _) => bytes(old, draw),
            (1, _) => tokens(&text, draw).into_bytes(),
            (_, Ok(mut document)) => {
                structure(&mut document, draw);
                document.to_string().into_bytes()
            }
            (_, Err(_)) => lists(&text, draw).into_bytes(),
        };
        files.insert(name.clone(), new);
    }
    if draw.below(16) > 0 {
        mend(&mut files);
    }
    files
}

fn mend(files: &mut Files) {
    let manifests: Vec<String> =
        files.keys().filter(|name| name.ends_with("manifest.json")).cloned().collect();
    for name in manifests {
        let Ok(mut manifest) = serde_json::from_slice::<Value>(&files[&name]) else { continue };
        let folder = name.strip_suffix("manifest.json").expect("a manifest");
        let listed = manifest.get_mut("files").and_then(Value::as_array_mut);
        for entry in listed.into_iter().flatten().filter_map(Value::as_object_mut) {
            let file = entry.get("name").and_then(Value::as_str).map(|name| format!("{folder}{name}"));
            if let Some(text) = file.and_then(|name| files.get(&name)) {
                entry.insert("bytes".to_owned(), text.len().into());
                entry.insert("sha256".to_owned(), digest(text).into());
            }
        }
        files.insert(name, manifest.to_string().into_bytes());
    }
}

fn bytes(old: &[u8], draw: &mut Draw<'_>) -> Vec<u8> {
    let start = draw.below(old.len() + 1);
    let end = (start + draw.below(40)).min(old.len());
    let middle = match draw.below(4) {
        0 => Vec::new(),
        1 => old[start..end].repeat(1 + draw.below(REPETITION_LIMIT)),
        2 => (0..=draw.below(8)).map(|_| u8::try_from(draw.below(256)).expect("a byte")).collect(),
        _ => b"([{\"\\0-9 "[draw.below(9)..][..1].repeat(1 + draw.below(REPETITION_LIMIT)),
    };
    [&old[..start], &middle, &old[end..]].concat()
}

/// Replaces a word or number by another word of the text, or by an extreme value.
fn tokens(text: &str, draw: &mut Draw<'_>) -> String {
    let is_part = |c: char| c.is_alphanumeric() || "_-.?:".contains(c);
    let starts = text.match_indices(is_part).filter(|(at, _)| !text[..*at].ends_with(is_part));
    let words: Vec<(usize, &str)> =
        starts.map(|(at, _)| (at, text[at..].split(|c| !is_part(c)).next().unwrap_or_default())).collect();
    if words.is_empty() {
        return text.to_owned();
    }
    let (at, word) = *draw.choose(&words);
    let long = "9".repeat(1 + draw.below(20_000));
    let extremes = ["0", "-1", "4294967295", "18446744073709551616", "1e400", "?x", "and", &long];
    let replacement = if draw.below(2) == 0 { draw.choose(&words).1 } else { *draw.choose(&extremes) };
    format!("{}{replacement}{}", &text[..at], &text[at + word.len()..])
}

fn lists(text: &str, draw: &mut Draw<'_>) -> String {
    let mut open = Vec::new();
    let mut spans: Vec<(usize, usize)> = Vec::new();
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'(' => open.push(at),
            b')' => spans.extend(open.pop().map(|start| (start, at + 1))),
            _ => {}
        }
    }
    if spans.is_empty() {
        return tokens(text, draw);
    }
    let (start, end) = *draw.choose(&spans);
    let list = &text[start..end];
    let (other_start, other_end) = *draw.choose(&spans);
    let other_list = &text[other_start..other_end];
    let count = 1 + draw.below(REPETITION_LIMIT);
    let opening =
        *draw.choose(&["(not ", "(and ", "(or (p) ", "(exists (?x) ", "(forall (?x) ", "(when (p) "]);
    let new = match draw.below(6) {
        0 => String::new(),
        1 => list.repeat(count),
        2 => other_list.to_owned(),
        3 => format!("(and {list} {other_list})"),
        4 => {
            // The number of variable assignments grows exponentially with the nesting of
            // quantifiers.
            let count = if opening.contains('?') { 1 + count % 4 } else { count };
            format!("{}{list}{}", opening.repeat(count), ")".repeat(count))
        }
        _ => {
            let names = (0..=count % 4).fold(String::new(), |names, number| format!("{names} ?x{number}"));
            format!("(exists ({names}) {list})")
        }
    };
    format!("{}{new}{}", &text[..start], &text[end..])
}

fn structure(document: &mut Value, draw: &mut Draw<'_>) {
    let mut paths = Vec::new();
    collect(document, String::new(), &mut paths);
    let replacement = document.pointer(draw.choose(&paths).as_str()).cloned().unwrap_or_default();
    let path = draw.choose(&paths).clone();
    let Some(target) = document.pointer_mut(&path) else { return };
    let count = 1 + draw.below(REPETITION_LIMIT);
    let number = |draw: &mut Draw<'_>| {
        let numbers =
            [json!(0), json!(-1), json!(1), json!(2), json!(u32::MAX), json!(u64::MAX), json!(1_u64 << 40)];
        draw.choose(&numbers).clone()
    };
    *target = match (draw.below(6), &*target) {
        (0, _) => Value::Null,
        (1, _) => replacement,
        (2, Value::Array(items)) if !items.is_empty() => {
            let again = draw.choose(items).clone();
            items.iter().cloned().chain(std::iter::repeat_n(again, count)).collect()
        }
        (3, Value::Array(items)) if !items.is_empty() => {
            let mut items = items.clone();
            items.remove(draw.below(items.len()));
            items.into()
        }
        (4, Value::Array(items)) if !items.is_empty() => {
            let mut items = items.clone();
            let (left, right) = (draw.below(items.len()), draw.below(items.len()));
            items.swap(left, right);
            items.into()
        }
        (_, Value::Object(fields)) if !fields.is_empty() => {
            let mut fields = fields.clone();
            let names: Vec<String> = fields.keys().cloned().collect();
            fields.remove(draw.choose(&names));
            fields.into()
        }
        (5, _) => (0..100).fold(replacement, |inner, _| json!([inner])),
        _ => number(draw),
    };
}

fn collect(value: &Value, path: String, paths: &mut Vec<String>) {
    match value {
        Value::Array(items) => {
            for (place, child) in items.iter().enumerate() {
                collect(child, format!("{path}/{place}"), paths);
            }
        }
        Value::Object(fields) => {
            for (name, child) in fields {
                collect(child, format!("{path}/{name}"), paths);
            }
        }
        _ => {}
    }
    paths.push(path);
}

pub fn write(directory: &Path, files: &Files) {
    for (name, text) in files {
        let path = directory.join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
}
