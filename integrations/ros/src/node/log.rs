//! Log of a node on `/rosout`, and on standard error in the format of `rcutils`.

use std::io::Write as _;
use std::sync::PoisonError;
use std::time::{SystemTime, UNIX_EPOCH};

use metaplan::visible::visible;
use ros2_client::builtin_interfaces::Time;
use ros2_client::ros2::LogLevel;
use ros2_client::rosout::RosoutRaw as _;

use crate::node::Node;

/// Upper limit on the number of remembered warnings, each of which is logged only once. All of them are
/// forgotten when the limit is reached.
const MAX_WARNED: usize = 1000;

/// Severity of a log message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Information for developers.
    Debug,
    /// Normal operation.
    Info,
    /// A problem that does not prevent operation.
    Warn,
    /// A failed operation.
    Error,
    /// A failure after which the node cannot perform its role.
    Fatal,
}

impl Severity {
    pub(crate) fn parse(word: &str) -> Option<Self> {
        // The form `node:=level` selects one node of a process. This process has a single node, so
        // the name is ignored.
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
    pub(crate) fn is_logged(&self, severity: Severity) -> bool {
        severity >= self.least
    }

    pub(crate) fn warn_once(&self, text: &str) {
        let mut warned = self.warned.lock().unwrap_or_else(PoisonError::into_inner);
        if warned.len() >= MAX_WARNED {
            warned.clear();
        }
        if warned.insert(text.to_owned()) {
            drop(warned);
            self.log(Severity::Warn, text);
        }
    }

    /// Logs a message to `/rosout` and standard error, unless its severity is below the log level.
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
        // Errors are ignored, for example if standard error is closed.
        let _ = std::io::stderr().write_all(visible(&line).as_bytes());
        self.inner().rosout_raw(Time::now(), severity.level(), &name, text, file!(), "", line!());
    }
}
