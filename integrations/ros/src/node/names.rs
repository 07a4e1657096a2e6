//! Expansion and matching of names of nodes, topics and services (ROS 2 design article "Topic and
//! service names").

use std::fmt;

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct FullName {
    /// `/` or `/a/b`.
    namespace: String,
    name: String,
}

impl FullName {
    pub(crate) fn new(namespace: &str, name: &str) -> Self {
        let namespace = format!("/{}", namespace.trim_matches('/'));
        Self { namespace, name: name.to_owned() }
    }

    pub(crate) fn namespace(&self) -> &str {
        &self.namespace
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Expands a name relative to this node: `~/x` is below the node, `x` is below its namespace.
    pub(crate) fn expand(&self, name: &str) -> String {
        if name.starts_with('/') {
            name.to_owned()
        } else if let Some(private) = name.strip_prefix('~') {
            format!("{self}{private}")
        } else if self.namespace == "/" {
            format!("/{name}")
        } else {
            format!("{}/{name}", self.namespace)
        }
    }
}

impl fmt::Display for FullName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let namespace = self.namespace.trim_end_matches('/');
        write!(formatter, "{namespace}/{}", self.name)
    }
}

pub(crate) fn valid_name(kind: &str, name: &str) -> Result<String, String> {
    let is_part = |part: &str| {
        part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && part.chars().all(|character| character.is_ascii_alphanumeric() || character == '_')
    };
    let below = name.strip_prefix("~/").or_else(|| name.strip_prefix('/')).unwrap_or(name);
    if below.split('/').all(is_part) {
        return Ok(name.to_owned());
    }
    Err(format!(
        "`{name}` is not a valid name of a {kind}: use letters, digits and `_` between slashes, and no digit after a slash"
    ))
}

/// Returns `true` if a pattern of a parameter file matches a node: `*` matches one part of the full name (between
/// slashes), `**` any number of parts. A pattern that is a single name matches the nodes of this name in every
/// namespace, even with a leading slash.
pub(crate) fn is_match(pattern: &str, full: &str, name: &str) -> bool {
    let bare = pattern.trim_start_matches('/');
    if bare == name {
        return true;
    }
    let pattern: Vec<&str> = bare.split('/').collect();
    let parts: Vec<&str> = full.trim_start_matches('/').split('/').collect();
    fits(&pattern, &parts)
}

fn fits(pattern: &[&str], parts: &[&str]) -> bool {
    match (pattern.split_first(), parts.split_first()) {
        (None, None) => true,
        (Some((&"**", rest)), _) => (0..=parts.len()).any(|skipped| fits(rest, &parts[skipped..])),
        (Some((first, pattern)), Some((part, parts))) => {
            (*first == "*" || first == part) && fits(pattern, parts)
        }
        _ => false,
    }
}
