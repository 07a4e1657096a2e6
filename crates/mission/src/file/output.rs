//! Writes output files, atomically where possible. A regular file is replaced by renaming a temporary file
//! over it, and keeps its mode and owner. Any other file (device, FIFO) is opened and written. If the path
//! denotes standard output or standard error, the open descriptor is used, so it may also be a socket. A
//! symbolic link is followed. Neither a special file nor a link is ever replaced.
//!
//! A file is overwritten in place if a rename would change more than its content: it has other hard links,
//! its owner cannot be kept, its directory is not writable, it is a mount point, or the path is a descriptor
//! (`/dev/fd/3`). Vim's `backupcopy=auto` follows the same rule. If overwriting fails, the former content is
//! restored if it could be read.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempDir, TempPath};

use crate::message::Message;

const STDOUT: &str = "-";

/// Limit on consecutive symbolic links, as in Linux; more are treated as a loop.
const MAX_LINKS: usize = 40;

/// Writes a text to a file, atomically where possible, or to standard output if the path is `-`. A closed
/// pipe is not an error.
///
/// # Errors
/// M109: the file cannot be written.
pub fn write(path: &Path, text: &str) -> Result<(), Message> {
    let written = create(path).and_then(|(mut file, pending)| {
        file.write_all(text.as_bytes())?;
        drop(file);
        pending.commit()
    });
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let text = format!("the file cannot be written: {}", error.kind());
            Err(Message::at("M109", &path.display().to_string(), None, text))
        }
        _ => Ok(()),
    }
}

/// Returns `true` if the path is `-` or denotes the file of standard output, as `/dev/stdout` does.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == STDOUT || std::fs::metadata(path).is_ok_and(|named| is_same(&named, stdout().ok()))
}

/// Opens a file for writing. The content of a regular file becomes visible on [`Pending::commit`].
///
/// # Errors
/// The file cannot be opened for writing.
pub fn create(path: &Path) -> io::Result<(File, Pending)> {
    if is_stdout(path) {
        // Previously printed text must precede the new content.
        io::stdout().flush()?;
        return Ok((stdout()?, Pending::written()));
    }
    let existing = match std::fs::metadata(path) {
        Ok(existing) if is_same(&existing, stderr().ok()) => return Ok((stderr()?, Pending::written())),
        Ok(existing) if !existing.is_file() => {
            return Ok((OpenOptions::new().write(true).open(path)?, Pending::written()));
        }
        Ok(existing) => Some(existing),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(error),
    };
    let (target, is_descriptor) = followed(path)?;
    let Some(existing) = existing else {
        return Ok(pending(temporary(&target)?, target, None));
    };
    // Replacement needs only write access to the directory. Opening the file also enforces its own
    // write protection.
    let mut writable = OpenOptions::new();
    writable.write(true);
    let old = writable.clone().read(true).open(path).or_else(|_| writable.open(path))?;
    let replacement =
        if is_descriptor || has_other_links(&existing) { None } else { temporary(&target).ok() };
    Ok(match replacement.filter(|file| adopt(file.as_file(), &existing).is_ok()) {
        Some(replacement) => pending(replacement, target, Some(InPlace { old, is_certain: false })),
        None => pending(NamedTempFile::new()?, target, Some(InPlace { old, is_certain: true })),
    })
}

/// An output file that is being written. [`Pending::commit`] moves its content to the final path. An output
/// that is not a regular file, such as standard output or a device, is written directly, and `commit` has no
/// effect.
#[derive(Debug)]
#[must_use = "a regular file has its content once it is committed"]
pub struct Pending(Option<(TempPath, PathBuf, Option<InPlace>)>);

/// An existing file to overwrite: always if `is_certain`, otherwise only if the rename over the
/// file fails.
#[derive(Debug)]
struct InPlace {
    old: File,
    is_certain: bool,
}

impl Pending {
    fn written() -> Self {
        Self(None)
    }

    /// Moves the content to its final path.
    ///
    /// # Errors
    /// The file cannot be written. An existing file then keeps its former content; if it is overwritten in
    /// place, only as far as the content could be restored.
    pub fn commit(self) -> io::Result<()> {
        let Some((temporary, target, existing)) = self.0 else { return Ok(()) };
        // The content must reach the disk before the rename, or a crash could leave an empty file.
        // Windows flushes only files that are open for writing.
        OpenOptions::new().read(true).write(cfg!(windows)).open(&temporary)?.sync_all()?;
        match existing {
            Some(InPlace { old, is_certain: true }) => overwrite(old, &temporary),
            Some(InPlace { old, is_certain: false }) => match temporary.persist(target) {
                Ok(()) => Ok(()),
                // The rename fails for mount points.
                Err(refused) => overwrite(old, &refused.path),
            },
            None => temporary.persist(target).map_err(|refused| refused.error),
        }
    }
}

fn pending(file: NamedTempFile, target: PathBuf, old: Option<InPlace>) -> (File, Pending) {
    let (file, temporary) = file.into_parts();
    (file, Pending(Some((temporary, target, old))))
}

fn overwrite(mut file: File, source: &Path) -> io::Result<()> {
    let mut former = Vec::new();
    let is_kept = file.read_to_end(&mut former).is_ok();
    let mut fill = |content: &mut dyn io::Read| {
        file.rewind()?;
        let length = io::copy(content, &mut file)?;
        file.set_len(length)?;
        file.sync_all()
    };
    let written = File::open(source).and_then(|mut source| fill(&mut source));
    if written.is_err() && is_kept {
        // A failure to restore is ignored, because the first error is to be reported.
        let _ = fill(&mut &former[..]);
    }
    written
}

/// Follows a path as long as it is a symbolic link; the target need not exist. The returned flag is `true` if one of the
/// links is in `/proc`, as the file descriptor `/dev/fd/3` is.
fn followed(path: &Path) -> io::Result<(PathBuf, bool)> {
    let (mut path, mut is_descriptor) = (path.to_owned(), false);
    for _ in 0..=MAX_LINKS {
        let Ok(next) = std::fs::read_link(&path) else { return Ok((path, is_descriptor)) };
        let directory = directory(&path).to_owned();
        is_descriptor |= directory.canonicalize().is_ok_and(|directory| directory.starts_with("/proc"));
        path = directory.join(next);
    }
    Err(io::Error::other("too many levels of symbolic links"))
}

fn directory(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn temporary(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".metaplan-");
    // Temporary files are private by default. The umask of the process still applies to this mode.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(directory(path))
}

/// A directory whose files are written to a temporary directory first. [`Self::commit`] moves them to the final path.
#[derive(Debug)]
#[must_use = "the directory has its files once it is committed"]
pub struct PendingDirectory {
    files: TempDir,
    target: PathBuf,
    /// `true` if the target already exists; it is then empty.
    exists: bool,
}

/// Starts a new directory. The target must be absent or an empty directory. An existing target
/// keeps its mode and owner, and may be a mount point.
///
/// # Errors
/// The target is not empty, is not a directory, or cannot be written.
pub fn create_directory(path: &Path) -> io::Result<PendingDirectory> {
    let (target, _) = followed(path)?;
    let exists = target.is_dir();
    if exists && std::fs::read_dir(&target)?.next().is_some() {
        return Err(ErrorKind::DirectoryNotEmpty.into());
    }
    if !exists && target.symlink_metadata().is_ok() {
        return Err(ErrorKind::NotADirectory.into());
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".metaplan-");
    // The umask of the process still applies.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    let files = builder.tempdir_in(if exists { &target } else { directory(&target) })?;
    Ok(PendingDirectory { files, target, exists })
}

impl PendingDirectory {
    /// Returns the temporary directory into which the files are to be written.
    pub fn path(&self) -> &Path {
        self.files.path()
    }

    /// Moves the files to the final path of the directory: as a whole if the target is absent, otherwise one
    /// by one into the existing directory.
    ///
    /// # Errors
    /// The directory cannot be written.
    pub fn commit(self) -> io::Result<()> {
        if !self.exists {
            std::fs::rename(self.path(), &self.target)?;
            // The rename has removed the temporary name, so the temporary directory must not be
            // deleted.
            let _ = self.files.keep();
            return Ok(());
        }
        for entry in std::fs::read_dir(self.path())? {
            let entry = entry?;
            std::fs::rename(entry.path(), self.target.join(entry.file_name()))?;
        }
        self.files.close()
    }
}

#[cfg(unix)]
mod system {
    use std::fs::{File, Metadata};
    use std::io;
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, fchown};

    pub(super) fn stdout() -> io::Result<File> {
        io::stdout().as_fd().try_clone_to_owned().map(File::from)
    }

    pub(super) fn stderr() -> io::Result<File> {
        io::stderr().as_fd().try_clone_to_owned().map(File::from)
    }

    pub(super) fn is_same(named: &Metadata, open: Option<File>) -> bool {
        let open = open.and_then(|file| file.metadata().ok());
        open.is_some_and(|open| (named.dev(), named.ino()) == (open.dev(), open.ino()))
    }

    pub(super) fn has_other_links(file: &Metadata) -> bool {
        file.nlink() > 1
    }

    pub(super) fn adopt(file: &File, other: &Metadata) -> io::Result<()> {
        let current = file.metadata()?;
        if (current.uid(), current.gid()) != (other.uid(), other.gid()) {
            fchown(file, Some(other.uid()), Some(other.gid()))?;
        }
        file.set_permissions(std::fs::Permissions::from_mode(other.mode() & 0o7777))
    }
}

#[cfg(windows)]
mod system {
    use std::fs::{File, Metadata};
    use std::io;
    use std::os::windows::io::AsHandle as _;

    pub(super) fn stdout() -> io::Result<File> {
        io::stdout().as_handle().try_clone_to_owned().map(File::from)
    }

    pub(super) fn stderr() -> io::Result<File> {
        io::stderr().as_handle().try_clone_to_owned().map(File::from)
    }

    /// Returns `false`: on Windows no path denotes a standard stream.
    pub(super) fn is_same(_: &Metadata, _: Option<File>) -> bool {
        false
    }

    /// Returns `false`: the standard library does not report hard links on Windows.
    pub(super) fn has_other_links(_: &Metadata) -> bool {
        false
    }

    /// Does nothing: new files inherit the permissions of their directory.
    #[expect(clippy::unnecessary_wraps, reason = "as on other systems, where it can fail")]
    pub(super) fn adopt(_: &File, _: &Metadata) -> io::Result<()> {
        Ok(())
    }
}

use system::{adopt, has_other_links, is_same, stderr, stdout};
