//! The log: what a node says on `/rosout`, and on standard error as `rcutils` writes it.

use std::io::Write as _;
use std::sync::PoisonError;
use std::time::{SystemTime, UNIX_EPOCH};

use metaplan::visible::visible;
use ros2_client::builtin_interfaces::Time;
use ros2_client::ros2::LogLevel;
use ros2_client::rosout::RosoutRaw as _;

use crate::node::Node;

/// So many warnings are remembered, so as to say each once.
const WARNED: usize = 1000;

/// How grave it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// For developers.
    Debug,
    /// As it should be.
    Info,
    /// It goes on, but somebody should look at it.
    Warn,
    /// Something could not be done.
    Error,
    /// It does not go on.
    Fatal,
}

impl Severity {
    /// From the word that `--log-level` takes.
    pub(crate) fn parse(word: &str) -> Option<Self> {
        // `node:=level` is for one node of a process; there is one here.
        Some(match word.rsplit(":=").next().unwrap_or(word) {
            "debug" => Self::Debug,
            "info" => Self::Info,
            "warn" | "warning" => Self::Warn,
            "error" => Self::Error,
            "fatal" => Self::Fatal,
            _ => return None,
        })
    }

    fn word(self) -> &'static str {
        match self {
            Self::Debug => "DEBUG",
            Self::Info => "INFO",
            Self::Warn => "WARN",
            Self::Error => "ERROR",
            Self::Fatal => "FATAL",
        }
    }

    fn level(self) -> LogLevel {
        match self {
            Self::Debug => LogLevel::Debug,
            Self::Info => LogLevel::Info,
            Self::Warn => LogLevel::Warn,
            Self::Error => LogLevel::Error,
            Self::Fatal => LogLevel::Fatal,
        }
    }
}

impl Node {
    /// Whether anybody hears what is so grave.
    pub(crate) fn is_logged(&self, severity: Severity) -> bool {
        severity >= self.least
    }

    /// Warns of something, once of the same.
    pub(crate) fn warn_once(&self, text: &str) {
        let mut warned = self.warned.lock().unwrap_or_else(PoisonError::into_inner);
        if warned.len() >= WARNED {
            warned.clear();
        }
        if warned.insert(text.to_owned()) {
            drop(warned);
            self.log(Severity::Warn, text);
        }
    }

    /// Says something to whoever reads logs.
    pub fn log(&self, severity: Severity, text: &str) {
        if !self.is_logged(severity) {
            return;
        }
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let name = self.name.to_string().trim_start_matches('/').replace('/', ".");
        let line = format!(
            "[{}] [{}.{:09}] [{name}]: {text}\n",
            severity.word(),
            since.as_secs(),
            since.subsec_nanos()
        );
        // Who has closed standard error does not want to know.
        let _ = std::io::stderr().write_all(visible(&line).as_bytes());
        self.inner().rosout_raw(Time::now(), severity.level(), &name, text, file!(), "", line!());
    }
}
