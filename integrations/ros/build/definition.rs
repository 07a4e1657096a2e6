//! Reads the definitions of ROS interfaces from files.
//!
//! The files are `PACKAGE/msg/X.msg`, `PACKAGE/srv/X.srv` and `PACKAGE/action/X.action`.
//! Definitions that differ in another ROS distribution or package version are below
//! `variants/VARIANT/`.

use std::error::Error;
use std::path::{Path, PathBuf};

use crate::types::definition::{FOLDERS, Interface};

/// Definitions in the order of [`read`], with their texts.
pub type Definitions = Vec<(Interface, String)>;

/// Returns all interfaces below a directory, sorted, with variants last.
pub fn read(root: &Path) -> Result<Definitions, Box<dyn Error>> {
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
    interfaces: &mut Definitions,
) -> Result<(), Box<dyn Error>> {
    let package = file_stem(path);
    for (folder, _) in FOLDERS.iter().filter(|(folder, _)| path.join(folder).is_dir()) {
        for file in entries(&path.join(folder))? {
            let text = std::fs::read_to_string(&file)?;
            let name = format!("{package}/{folder}/{}", file_stem(&file));
            let mut interface =
                Interface::parse(&name, &text).map_err(|error| format!("{}: {error}", file.display()))?;
            interface.variant = variant.map(str::to_owned);
            interfaces.push((interface, text));
        }
    }
    Ok(())
}
