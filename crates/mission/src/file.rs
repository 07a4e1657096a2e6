//! Reads input files and detects their kind. Apart from standard input, only regular files of limited size are read. A
//! file that is recognised as another kind than expected is not quoted in messages, because a hostile manifest may name
//! any file.

use std::collections::BTreeMap;
use std::io::{self, Read as _};
use std::path::Path;

use pddl::Source;

pub use output::{Pending, PendingDirectory, create, create_directory, is_stdout, write};

use crate::message::Message;

mod output;

/// Error code for a file of an unexpected kind.
pub(crate) const CODE: &str = "M131";

/// Limit on the size of the files that `read` reads, in bytes. The limit does not apply to standard input.
const LARGEST: u64 = 1 << 28;

pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::other("is a directory"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    // Reading is bounded as well as checked, because the file may grow after the query of its
    // metadata.
    std::fs::File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(io::Error::other(format!("it has more than {LARGEST} bytes")));
    }
    Ok(bytes)
}

/// Reads a text file, or standard input if the path is `-`.
///
/// # Errors
/// The file cannot be read.
pub fn source(path: &Path) -> Result<Source, Message> {
    let name = path.display().to_string();
    let bytes = if name == "-" {
        let mut bytes = Vec::new();
        io::stdin().read_to_end(&mut bytes).map(|_| bytes)
    } else {
        read(path)
    };
    match bytes {
        Ok(bytes) => Ok(Source::from_bytes(name, &bytes)),
        Err(error) => Err(Message::at("M101", &name, None, format!("the file cannot be read: {error}"))),
    }
}

/// Kind of an input file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A mission's manifest, in TOML.
    Manifest,
    /// A PDDL domain.
    Domain,
    /// A PDDL problem.
    Problem,
    /// A knowledge base.
    Knowledge,
}

impl Kind {
    /// Returns the kind of a text. Returns `None` if the text begins like none of these kinds.
    pub fn of(text: &str) -> Option<Self> {
        let lines = text.lines().map(str::trim_start);
        let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with([';', '#']));
        let first = lines.next()?;
        // A comment of PDDL may also end a line.
        let parts = std::iter::once(first).chain(lines).flat_map(|line| [line.split(';').next(), Some(" ")]);
        let words: String = parts.flatten().flat_map(str::chars).take(200).collect();
        let words = words.to_ascii_lowercase().replace('(', " ( ");
        let words: Vec<&str> = words.split_whitespace().take(4).collect();
        match words[..] {
            ["(", "define", "(", "domain", ..] => Some(Self::Domain),
            ["(", "define", "(", "problem", ..] => Some(Self::Problem),
            ["@prefix" | "@base" | "prefix" | "base", ..] => Some(Self::Knowledge),
            [word, ..]
                if ["<?xml", "<rdf", "<!doctype", "<http", "prefix("]
                    .iter()
                    .any(|own| word.starts_with(own)) =>
            {
                Some(Self::Knowledge)
            }
            _ if is_toml(first) => Some(Self::Manifest),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Manifest => "a mission's manifest",
            Self::Domain => "a PDDL domain",
            Self::Problem => "a PDDL problem",
            Self::Knowledge => "a knowledge base",
        }
    }
}

/// Returns `true` if a line has the form `key = …` or `[table]`.
fn is_toml(line: &str) -> bool {
    let is_key =
        |key: &str| !key.is_empty() && key.chars().all(|c| c.is_alphanumeric() || "_-.\"' ".contains(c));
    match line.split_once('=') {
        Some((key, _)) => is_key(key.trim()),
        None => line.starts_with('['),
    }
}

/// Checks that a text is of the expected kind. A text of unknown kind may be a malformed text of the expected kind.
/// Such a text is accepted as PDDL if it begins with a parenthesis, as a manifest if it does not, and always as a
/// knowledge base. An empty text is accepted.
///
/// # Errors
/// Names the detected kind and, for common mistakes, a remedy. The text itself is not quoted.
pub fn expect(kind: Kind, file: &str, text: &str) -> Result<(), Message> {
    let detected = Kind::of(text);
    // A text that begins with a parenthesis may be malformed PDDL. The parser then reports a more
    // precise error.
    let trimmed = text.lines().map(str::trim_start).find(|line| !line.is_empty() && !line.starts_with(';'));
    let is_list = trimmed.is_none_or(|line| line.starts_with('('));
    let is_pddl = matches!(kind, Kind::Domain | Kind::Problem);
    let fits = match detected {
        Some(detected) => detected == kind,
        None => is_list == is_pddl || trimmed.is_none() || !is_pddl && kind != Kind::Manifest,
    };
    if fits {
        return Ok(());
    }
    let is = detected.map_or_else(|| "something else".to_owned(), |detected| detected.name().to_owned());
    let help = match (kind, detected) {
        (Kind::Manifest, Some(Kind::Domain)) => "; give the problem, too: DOMAIN PROBLEM",
        (Kind::Manifest, Some(Kind::Problem)) => "; give the domain first: DOMAIN PROBLEM",
        (Kind::Manifest, Some(Kind::Knowledge)) => {
            "; a manifest names it under `[knowledge]`, or give it with `--kb`"
        }
        (Kind::Domain, Some(Kind::Problem)) | (Kind::Problem, Some(Kind::Domain)) => {
            "; the domain comes first, and the problem second"
        }
        _ => "",
    };
    let text = format!("this should be {}, but is {is}{help}", kind.name());
    Err(Message::at(CODE, file, None, text))
}

/// Possible beginnings of a knowledge-base document in all supported syntaxes, in lower case.
const BEGINNINGS: [&str; 10] =
    ["@", "prefix", "base", "<", "_:", "[", "(", "ontology", "version", "\u{feff}"];

/// Replaces parse errors of files that do not begin like a knowledge base by a message without
/// quotation. Such a file may be any file of the system, and parse errors quote their input.
pub(crate) fn discreet(messages: Vec<Message>) -> Vec<Message> {
    let mut result: Vec<Message> = Vec::new();
    for message in messages {
        let file =
            message.file.clone().filter(|file| message.code == "O102" && !is_knowledge(Path::new(file)));
        let Some(file) = file else {
            result.push(message);
            continue;
        };
        if !result.iter().any(|message| message.code == CODE && message.file.as_ref() == Some(&file)) {
            let text = format!("this should be {}, but is something else", Kind::Knowledge.name());
            result.push(Message::at(CODE, &file, None, text));
        }
    }
    result
}

/// Adds source lines to messages about knowledge-base documents, if the file begins like such a
/// document.
pub(crate) fn quoted(messages: Vec<Message>) -> Vec<Message> {
    let mut texts: BTreeMap<String, Option<String>> = BTreeMap::new();
    let quoted = |message: Message| {
        let Some(file) = message.file.clone().filter(|_| message.line.is_some()) else { return message };
        let text = texts.entry(file).or_insert_with_key(|file| {
            let path = Path::new(file);
            let bytes = is_knowledge(path).then(|| read(path).ok()).flatten()?;
            // A byte order mark does not count as a column.
            let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
            String::from_utf8(bytes.to_vec()).ok().filter(|text| !text.contains('\0'))
        });
        match text {
            Some(text) => message.with_source(text),
            None => message,
        }
    };
    messages.into_iter().map(quoted).collect()
}

/// Returns `true` if a file begins like a knowledge base, is empty, or cannot be read. No message can quote the
/// content of an unreadable file.
fn is_knowledge(path: &Path) -> bool {
    let Ok(file) = std::fs::File::open(path) else { return true };
    let mut bytes = Vec::new();
    if file.take(1 << 16).read_to_end(&mut bytes).is_err() {
        return true;
    }
    // ASCII text in UTF-16 has a zero byte in each character.
    let text: String = String::from_utf8_lossy(&bytes).chars().filter(|c| *c != '\0').collect();
    let first = text.lines().map(str::trim_start).find(|line| !line.is_empty() && !line.starts_with('#'));
    let first = first.unwrap_or("@").to_ascii_lowercase();
    BEGINNINGS.iter().any(|word| first.starts_with(word))
}

#[cfg(test)]
mod tests {
    use super::{Kind, expect};

    fn check(text: &str, expected: Option<Kind>) {
        assert_eq!(Kind::of(text), expected, "{text}");
    }

    #[test]
    fn kinds_are_detected_by_their_first_words() {
        check("; a domain\n\n ( define(domain d)", Some(Kind::Domain));
        check("(define (problem p)", Some(Kind::Problem));
        check("; see (define (problem p))\n(define\n; of the robot\n(domain d)", Some(Kind::Domain));
        check("; see (define (domain d))\n(define ; (domain d)\n  (problem p)", Some(Kind::Problem));
        check("# a robot\n@prefix : <http://e.org/> .", Some(Kind::Knowledge));
        check("<?xml version=\"1.0\"?>", Some(Kind::Knowledge));
        check("# a mission\nname = \"ugv\"", Some(Kind::Manifest));
        check("[knowledge]\n", Some(Kind::Manifest));
        check("root:*:20228:0:99999:7:::", None);
        check("", None);
    }

    #[test]
    fn expected_kinds_are_accepted_and_other_files_are_not_quoted() {
        let secret = "root:*:20228:0:99999:7:::\n";
        for kind in [Kind::Domain, Kind::Problem] {
            let message = expect(kind, "f", secret).expect_err("no PDDL").text().to_owned();
            assert!(!message.contains("20228"), "{message}");
            assert!(expect(kind, "f", "(define (domai d)").is_ok());
            assert!(expect(kind, "f", "").is_ok());
        }
        assert!(expect(Kind::Domain, "f", "(define (problem p)").is_err());
        assert!(expect(Kind::Manifest, "f", "name = 1").is_ok());
        assert!(expect(Kind::Manifest, "f", "(define (domain d)").is_err());
    }
}
