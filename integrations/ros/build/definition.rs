//! Parses ROS definition files to interfaces. A message has one part, a service two, an action
//! three.
//!
//! The files are `PACKAGE/msg/X.msg`, `PACKAGE/srv/X.srv` and `PACKAGE/action/X.action`.
//! Definitions that differ in another ROS distribution or package version are below
//! `variants/VARIANT/`.

use std::error::Error;
use std::path::{Path, PathBuf};

use hiroz_codegen::parser::msg::parse_msg_string;
use hiroz_codegen::parser::parse_field;
use hiroz_codegen::types::{Constant, Field};

/// A structure of an interface, such as the request of a service.
pub struct Part {
    /// Suffix that the structure adds to the name of the interface: empty, `_Request`, `_Goal`, …
    pub suffix: &'static str,
    /// Fields in the order of the definition, which is the order of serialisation. Never empty.
    pub fields: Vec<Field>,
    /// Constants of the definition.
    pub constants: Vec<Constant>,
}

/// A ROS message, service or action definition.
pub struct Interface {
    /// Distribution or package version to which the definition belongs. `None` for the default.
    pub variant: Option<String>,
    /// Name of the package, such as `std_msgs`.
    pub package: String,
    /// Folder, which shows the kind of the interface: `msg`, `srv` or `action`.
    pub folder: &'static str,
    /// Name of the interface, such as `String`.
    pub name: String,
    /// One structure for a message, two for a service, three for an action.
    pub parts: Vec<Part>,
}

impl Interface {
    /// Full name of the interface, such as `std_msgs/msg/String`.
    pub fn full_name(&self) -> String {
        format!("{}/{}/{}", self.package, self.folder, self.name)
    }
}

/// Kinds of interfaces: folder, and suffixes of the parts of each interface in the folder.
const FOLDERS: [(&str, &[&str]); 3] =
    [("msg", &[""]), ("srv", &["_Request", "_Response"]), ("action", &["_Goal", "_Result", "_Feedback"])];

/// Returns all interfaces below a directory, sorted, with variants last.
pub fn read(root: &Path) -> Result<Vec<Interface>, Box<dyn Error>> {
    let variants = root.join("variants");
    let mut interfaces = Vec::new();
    for package in entries(root)?.into_iter().filter(|path| *path != variants) {
        read_package(&package, None, &mut interfaces)?;
    }
    for variant in entries(&variants)? {
        for package in entries(&variant)? {
            read_package(&package, Some(&file_stem(&variant)), &mut interfaces)?;
        }
    }
    Ok(interfaces)
}

fn entries(directory: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let found = std::fs::read_dir(directory).map_err(|error| format!("{}: {error}", directory.display()))?;
    let mut paths = found.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.sort();
    Ok(paths)
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

fn read_package(
    path: &Path,
    variant: Option<&str>,
    interfaces: &mut Vec<Interface>,
) -> Result<(), Box<dyn Error>> {
    let package = file_stem(path);
    for (folder, suffixes) in FOLDERS.iter().filter(|(folder, _)| path.join(folder).is_dir()) {
        for file in entries(&path.join(folder))? {
            let text = std::fs::read_to_string(&file)?;
            let parts = parts(&text, suffixes, &package, &file)
                .map_err(|error| format!("{}: {error}", file.display()))?;
            interfaces.push(Interface {
                variant: variant.map(str::to_owned),
                package: package.clone(),
                folder,
                name: file_stem(&file),
                parts,
            });
        }
    }
    Ok(())
}

fn parts(
    text: &str,
    suffixes: &[&'static str],
    package: &str,
    file: &Path,
) -> Result<Vec<Part>, Box<dyn Error>> {
    let lines: Vec<&str> = text.lines().collect();
    let sections: Vec<String> =
        lines.split(|line| line.trim() == "---").map(|part| part.join("\n")).collect();
    if sections.len() != suffixes.len() {
        return Err(format!("{} sections instead of {}", sections.len(), suffixes.len()).into());
    }
    let parts = sections.iter().zip(suffixes).map(|(section, suffix)| {
        let parsed = parse_msg_string(section, package, file)?;
        let (mut fields, constants) = (parsed.fields, parsed.constants);
        if fields.is_empty() {
            // The same member as in rosidl, because C structures cannot be empty.
            fields.push(parse_field("uint8 structure_needs_at_least_one_member", package, 0)?);
        }
        Ok(Part { suffix, fields, constants })
    });
    parts.collect()
}
