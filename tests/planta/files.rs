//! Input files of the examples, and functions that run the program.

use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan::file::source;
use metaplan::knowledge::{Knowledge, Sources};
use metaplan::message::Message;
use metaplan::mission::{Bindings, Mission};
use ontology::ReadOptions;
use pddl::ast::{Domain, Problem};

#[derive(Debug, Clone)]
pub struct Input {
    pub domain: PathBuf,
    pub problem: PathBuf,
    pub knowledge: PathBuf,
    /// Directory of imported documents.
    pub directory: PathBuf,
}

pub fn real() -> Option<PathBuf> {
    test_resources::data("real")
}

pub fn metaplan(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_metaplan")).args(arguments).output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

impl Input {
    pub fn new(directory: &Path, domain: &str, problem: &str, knowledge: &str) -> Self {
        Self {
            domain: directory.join(domain),
            problem: directory.join(problem),
            knowledge: directory.join(knowledge),
            directory: real().expect("the files are there").join("owl/pddl_tomasys"),
        }
    }

    pub fn arguments<'a>(&'a self, command: &'a str, options: &[&'a str]) -> Vec<&'a str> {
        let path = |path: &'a Path| path.to_str().expect("UTF-8");
        let mut command_line = vec![command, path(&self.domain), path(&self.problem), "--quiet"];
        command_line.extend(["--kb", path(&self.knowledge), "--directory", path(&self.directory)]);
        command_line.extend(options);
        command_line
    }

    pub fn mission(&self) -> Mission {
        let (domain, problem) = (source(&self.domain), source(&self.problem));
        let options = ReadOptions { directories: vec![self.directory.clone()], ..ReadOptions::default() };
        let documents = vec![self.knowledge.clone()];
        let sources = Sources { documents, options, ..Sources::default() };
        let text = domain.as_ref().map_or("", |domain| domain.text());
        let knowledge = Some(Knowledge::read_for(&sources, text));
        let mission = Mission::new("", knowledge, Bindings::default(), domain, problem);
        mission.unwrap_or_else(|messages| panic!("{}", text_of(&messages)))
    }
}

pub fn text_of(messages: &[Message]) -> String {
    messages.iter().map(Message::text).collect()
}

/// Parses a domain and a problem without checking declarations.
pub fn parsed(domain: &Path, problem: &Path) -> (Domain, Problem) {
    let read = |path: &Path| pddl::Source::new("file", std::fs::read_to_string(path).expect("a file"));
    let (domain, problem) = (read(domain), read(problem));
    let parsed_files = (pddl::parse_domain(&domain).0, pddl::parse_problem(&problem).0);
    (parsed_files.0.expect("a domain"), parsed_files.1.expect("a problem"))
}
