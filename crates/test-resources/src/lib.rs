//! Resources that tests need and only some machines have: data outside of the project, programs, Python
//! packages, and rights.
//!
//! The test harness counts a test that returns early as passed. Therefore a test requests each resource from
//! this crate. If the resource is missing, the test either fails or leaves a record:
//!
//! | environment variable | meaning |
//! |---|---|
//! | `METAPLAN_DATA` | Directory of the test data. A relative path begins at the root of the project. By default, each file is looked up in `$XDG_CACHE_HOME/metaplan/data`, to which `data/fetch.py` downloads public files, and then in `../shared`. |
//! | `METAPLAN_REQUIRE` | Names of resources ([`Resource::name`]), separated by commas. A test that lacks one of them fails. `.ci/resources` prints the names of the resources that it detects on a machine. |
//! | `METAPLAN_SKIPPED` | File to which a test that lacks any other resource appends a line: name of the resource, test, and detail, separated by tabs. `.ci/count` counts these lines. |
//!
//! A test that lacks a resource that is not required prints `skipped: needs NAME: DETAIL`. The caller then
//! leaves out what depends on the resource.

#![expect(clippy::print_stdout, reason = "a test that lacks a resource reports it")]

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A resource that only some machines have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// The shell bash.
    Bash,
    /// Chromium or Chrome.
    Browser,
    /// Files that are neither part of the project nor public ([`data`]).
    Data,
    /// A Java runtime.
    Java,
    /// The Python packages `mcap` and `mcap-ros2-support`.
    Mcap,
    /// The right to create namespaces of processes.
    Namespaces,
    /// The server of NATS.
    Nats,
    /// The Python package `owlready2`, which contains Pellet.
    Owlready2,
    /// The program `popf` of `metaplan-ros`.
    Popf,
    /// The programs of the proved checker, built by `proved/build.sh`.
    Proved,
    /// The page of the proved checker, built by `proved/page.sh`.
    ProvedPage,
    /// Public files that are not part of the project, as listed in `data/sources.toml` ([`data`]).
    PublicData,
    /// Python 3, with its standard library.
    Python,
    /// The proof checker `rate`.
    Rate,
    /// The right to create devices and to change the owner of files.
    Root,
    /// A POSIX shell.
    Shell,
    /// Signals that are not ignored. Child processes inherit ignored signals.
    Signals,
    /// SAT solvers as programs: minisat, glucose, cadical, kissat, picosat and cryptominisat5.
    Solvers,
    /// The Python package `stormpy`.
    Stormpy,
    /// The SMT solver Z3.
    Z3,
}

impl Resource {
    /// All resources, each with its name and with a way to get it.
    pub const ALL: [(Self, &str, &str); 20] = [
        (Self::Bash, "bash", "install bash"),
        (Self::Browser, "browser", "install Chromium (Debian: apt-get install chromium)"),
        (Self::Data, "data", "set METAPLAN_DATA to a directory with the test data"),
        (Self::Java, "java", "install a JDK (Debian: apt-get install openjdk-17-jdk-headless)"),
        (Self::Mcap, "mcap", "run .ci/mcap-peers, which installs the packages and sets METAPLAN_PYTHON"),
        (Self::Namespaces, "namespaces", "run the test on Linux where `unshare -rpf true` succeeds"),
        (Self::Nats, "nats", "install nats-server 2.11 or newer, and set NATS_SERVER if it is not in PATH"),
        (
            Self::Owlready2,
            "owlready2",
            "python3 -m venv pellet && pellet/bin/pip install owlready2==0.47, and METAPLAN_PYTHON=$PWD/pellet/bin/python",
        ),
        (Self::Popf, "popf", "cargo build -p metaplan-ros --bins, and add target/debug to PATH"),
        (Self::Proved, "metaplan-proved-check", "run proved/build.sh, and add proved/ocaml to PATH"),
        (Self::ProvedPage, "proved-page", "run proved/page.sh, which needs js_of_ocaml"),
        (
            Self::PublicData,
            "public-data",
            "run data/fetch.py, or set METAPLAN_DATA to a directory with the test data",
        ),
        (Self::Python, "python", "install Python 3 (Debian: apt-get install python3)"),
        (Self::Rate, "rate", "cargo install rate --locked"),
        (Self::Root, "root", "run the test as root, with the right to create devices"),
        (Self::Shell, "shell", "run the test on a system with sh"),
        (Self::Signals, "signals", "run the test in the foreground"),
        (
            Self::Solvers,
            "solvers",
            "install minisat, glucose, cadical, kissat, picosat and cryptominisat5, and add them to PATH",
        ),
        (
            Self::Stormpy,
            "stormpy",
            "python3 -m venv storm && storm/bin/pip install stormpy==2.0.0, and STORM_PYTHON=storm/bin/python",
        ),
        (Self::Z3, "z3", "pip install z3-solver"),
    ];

    /// Returns the name of this resource in `METAPLAN_REQUIRE` and in records.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// Returns the resource of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, other, _)| *other == name).map(|(resource, ..)| *resource)
    }

    fn remedy(self) -> &'static str {
        self.entry().1
    }

    fn entry(self) -> (&'static str, &'static str) {
        let entry = Self::ALL.iter().find(|(resource, ..)| *resource == self);
        entry.map(|(_, name, remedy)| (*name, *remedy)).expect("invariant: all resources are listed")
    }
}

const PUBLIC_FILES: &str = include_str!("../../../data/sources.toml");

/// Returns the directories in which test data is looked up, in this order. They need not exist.
fn data_directories() -> Vec<PathBuf> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if let Some(directory) = variable("METAPLAN_DATA") {
        return vec![from_root(directory)];
    }
    let cache = variable("XDG_CACHE_HOME").or_else(|| variable("HOME").map(|home| home.join(".cache")));
    let downloads = cache.map(|cache| cache.join("metaplan").join("data"));
    downloads.into_iter().chain([from_root("../shared".into())]).collect()
}

/// Returns the path of a file or directory of the test data. If it does not exist, returns where it is looked
/// up first.
pub fn data_path(relative: impl AsRef<Path>) -> PathBuf {
    let mut paths = data_directories().into_iter().map(|directory| directory.join(relative.as_ref()));
    let first = paths.next().unwrap_or_default();
    if first.exists() {
        return first;
    }
    paths.find(|path| path.exists()).unwrap_or(first)
}

/// Returns [`Resource::PublicData`] for files and directories that `data/fetch.py` downloads, and
/// [`Resource::Data`] for others.
fn data_resource(relative: &Path) -> Resource {
    let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
    let path = parts.join("/");
    if PUBLIC_FILES.contains(&format!("\"{path}\"")) || PUBLIC_FILES.contains(&format!("\"{path}/")) {
        Resource::PublicData
    } else {
        Resource::Data
    }
}

/// Returns the path of a file or directory of the test data, or `None` if it does not exist.
///
/// # Panics
/// Panics if the file does not exist and its resource is required: [`Resource::PublicData`] if
/// `data/sources.toml` lists the file or files of the directory, otherwise [`Resource::Data`].
pub fn data(relative: impl AsRef<Path>) -> Option<PathBuf> {
    let path = data_path(&relative);
    if path.exists() {
        return Some(path);
    }
    missing(data_resource(relative.as_ref()), &format!("{} does not exist", path.display()));
    None
}

/// Returns the path of the first of these programs that is in `PATH`, or `None` without any of them.
///
/// # Panics
/// Panics if the resource is missing and required.
pub fn program(resource: Resource, names: &[&str]) -> Option<PathBuf> {
    let path = in_path(names);
    if path.is_none() {
        missing(resource, &format!("{} is not in PATH", names.join(" or ")));
    }
    path
}

/// Returns the path of Python 3, or `None` if it is not in `PATH`.
///
/// # Panics
/// Panics if [`Resource::Python`] is missing and required.
pub fn python() -> Option<PathBuf> {
    program(Resource::Python, &["python3"])
}

/// Returns a Python program that can import these modules, or `None` if they are missing. `variable` is the
/// environment variable that names the program; by default it is `python3`.
///
/// # Panics
/// Panics if the resource is missing and required.
pub fn python_with(resource: Resource, variable: &str, modules: &str) -> Option<String> {
    let python = std::env::var(variable).unwrap_or_else(|_| "python3".to_owned());
    let detail = match Command::new(&python).args(["-c", &format!("import {modules}")]).output() {
        Ok(output) if output.status.success() => return Some(python),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stderr);
            format!("{python}: {}", text.trim().lines().last().unwrap_or_default())
        }
        Err(error) => format!("{python} does not start: {error}"),
    };
    missing(resource, &detail);
    None
}

/// Reports that the current test lacks a resource. `detail` states what is missing.
///
/// # Panics
/// Panics if the resource is required, if `METAPLAN_REQUIRE` contains an unknown name, or if the record cannot
/// be written.
pub fn missing(resource: Resource, detail: &str) {
    // The harness names the thread of a test after the test.
    missing_in(std::thread::current().name().unwrap_or("unknown"), resource, detail);
}

/// Like [`missing`], for a test whose thread is not named after it. `test` is the name of the test.
///
/// # Panics
/// Panics under the same conditions as [`missing`].
pub fn missing_in(test: &str, resource: Resource, detail: &str) {
    // The name of the package, which Cargo sets, is added because tests of different packages may have the
    // same name.
    let test =
        std::env::var("CARGO_PKG_NAME").map_or_else(|_| test.to_owned(), |name| format!("{name} {test}"));
    match Settings::from_environment().report(&test, resource, detail) {
        Ok(message) => println!("{message}"),
        Err(message) => panic!("{message}"),
    }
}

/// Returns `true` if `METAPLAN_REQUIRE` lists this resource.
pub fn is_required(resource: Resource) -> bool {
    Settings::from_environment().requires(resource)
}

/// Returns the path of the first of these programs that is in `PATH`.
pub fn in_path(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let is_program = |path: &PathBuf| path.is_file();
    let candidates = names.iter().map(|name| format!("{name}{}", std::env::consts::EXE_SUFFIX));
    candidates.flat_map(|name| folders.iter().map(move |folder| folder.join(&name))).find(is_program)
}

/// Returns an absolute path. A relative path begins at the root of the project.
fn from_root(path: PathBuf) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("invariant: crates/NAME");
    // Without `..`, so that messages are short.
    match path.strip_prefix("..") {
        Ok(path) => root.parent().expect("invariant: the root has a parent").join(path),
        Err(_) => root.join(path),
    }
}

struct Settings {
    /// Names of required resources, separated by commas.
    required: String,
    record: Option<PathBuf>,
}

impl Settings {
    fn from_environment() -> Self {
        let record = std::env::var_os("METAPLAN_SKIPPED").filter(|file| !file.is_empty());
        Self {
            required: std::env::var("METAPLAN_REQUIRE").unwrap_or_default(),
            record: record.map(|file| from_root(file.into())),
        }
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.required.split(',').map(str::trim).filter(|name| !name.is_empty())
    }

    fn requires(&self, resource: Resource) -> bool {
        self.names().any(|name| name == resource.name())
    }

    /// Records that a test lacks a resource. Returns a message for users. It is an error if the
    /// resource is required, a required name is unknown, or the record cannot be written.
    fn report(&self, test: &str, resource: Resource, detail: &str) -> Result<String, String> {
        if let Some(unknown) = self.names().find(|name| Resource::named(name).is_none()) {
            let names = Resource::ALL.map(|(_, name, _)| name).join(", ");
            return Err(format!("METAPLAN_REQUIRE: unknown resource {unknown}; the resources are {names}"));
        }
        let (name, remedy) = (resource.name(), resource.remedy());
        if self.requires(resource) {
            return Err(format!(
                "{test} needs {name}, which METAPLAN_REQUIRE lists: {detail}. To get it: {remedy}"
            ));
        }
        if let Some(file) = &self.record {
            let detail = detail.replace(['\t', '\n', '\r'], " ");
            let line = format!("{name}\t{test}\t{detail}\n");
            // A single write to a file that is open for appending, because tests run in parallel.
            let appended = OpenOptions::new().append(true).create(true).open(file);
            let written = appended.and_then(|mut file| file.write_all(line.as_bytes()));
            written.map_err(|error| format!("METAPLAN_SKIPPED: {}: {error}", file.display()))?;
        }
        Ok(format!("skipped: needs {name}: {detail}"))
    }
}
