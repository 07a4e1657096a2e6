//! Input of the loop: lines of a file or of standard input, or messages of an MCAP file.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::Path;
use std::time::Duration;

use crate::mapek::LONGEST_LINE;
use crate::message::Message;
use crate::recording::{FIRST_BYTE, Replay};

use crate::cli::common::Common;
use crate::cli::output;

/// A non-blank line of input, with its time since the start of the mission if the source has times.
pub(super) struct Line {
    pub(super) text: String,
    /// Number of blank lines between the previous line and this line.
    pub(super) blank_lines: u64,
    pub(super) now: Option<Duration>,
}

/// Reader of non-blank lines. A line longer than [`LONGEST_LINE`] is truncated just above this length, and is therefore
/// refused as an event.
pub(super) struct Lines {
    name: String,
    source: Source,
    is_file: bool,
}

type Reader = Box<dyn BufRead + Send>;

enum Source {
    /// Input whose format is not determined yet: this needs the first byte, and reading it may block.
    Fresh(Option<Reader>),
    Text(Reader),
    Recorded(Box<Replay<Reader>>),
}

fn regular(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    #[cfg(unix)]
    let is_pipe = std::os::unix::fs::FileTypeExt::is_fifo(&kind);
    #[cfg(not(unix))]
    let is_pipe = false;
    if kind.is_file() || is_pipe { File::open(path) } else { Err(io::Error::other("it is not a file")) }
}

impl Lines {
    pub(super) fn open(path: &Path) -> Result<Self, Message> {
        let name = path.display().to_string();
        let (is_file, reader): (bool, Reader) = if name == "-" {
            (stdin_is_file(), Box::new(BufReader::new(io::stdin())))
        } else {
            let file = regular(path).map_err(|error| {
                Message::at("M101", &name, None, format!("the file cannot be read: {error}"))
            })?;
            let is_file = file.metadata().is_ok_and(|data| data.is_file());
            (is_file, Box::new(BufReader::new(file)))
        };
        Ok(Self { name, source: Source::Fresh(Some(reader)), is_file })
    }

    pub(super) fn is_file(&self) -> bool {
        self.is_file
    }

    pub(super) fn next(&mut self, common: &Common) -> Result<Option<Line>, Message> {
        let line = self.look().and_then(|()| match &mut self.source {
            Source::Fresh(_) => Ok(None),
            Source::Text(reader) => next_text(reader),
            Source::Recorded(replay) => {
                let line = replay.next_line()?;
                Ok(line.map(|line| Line { text: line.text, blank_lines: 0, now: Some(line.now) }))
            }
        });
        let line = line.map_err(|error| {
            Message::at("M101", &self.name, None, format!("the file cannot be read: {error}"))
        })?;
        if let (None, Source::Recorded(replay)) = (&line, &self.source)
            && replay.is_unfinished()
        {
            let text = format!(
                "{} is truncated: recording was interrupted; all complete messages were read",
                self.name
            );
            output::warnings(common, [&Message::warning("M330", text)]);
        }
        Ok(line)
    }

    /// Determines the format, MCAP or text, from the first byte of the input. Every MCAP file and no text begins with
    /// [`FIRST_BYTE`].
    fn look(&mut self) -> io::Result<()> {
        let Source::Fresh(reader) = &mut self.source else { return Ok(()) };
        let Some(mut reader) = reader.take() else { return Ok(()) };
        let is_recorded = reader.fill_buf()?.first() == Some(&FIRST_BYTE);
        self.source =
            if is_recorded { Source::Recorded(Box::new(Replay::new(reader))) } else { Source::Text(reader) };
        Ok(())
    }
}

fn stdin_is_file() -> bool {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd as _;
        let copy = io::stdin().as_fd().try_clone_to_owned();
        copy.is_ok_and(|copy| File::from(copy).metadata().is_ok_and(|data| data.is_file()))
    }
    #[cfg(windows)]
    {
        winapi_util::file::typ(io::stdin()).is_ok_and(|kind| kind.is_disk())
    }
    #[cfg(not(any(unix, windows)))]
    {
        false
    }
}

fn next_text(reader: &mut Reader) -> io::Result<Option<Line>> {
    let mut blank_lines = 0;
    loop {
        let Some(bytes) = read_line(reader)? else { return Ok(None) };
        let text = String::from_utf8_lossy(&bytes);
        // A byte order mark may precede the first line, and also later lines where files were concatenated.
        let text = text.trim_start_matches('\u{feff}').trim_ascii();
        if !text.is_empty() {
            return Ok(Some(Line { text: text.to_owned(), blank_lines, now: None }));
        }
        blank_lines += 1;
    }
}

fn read_line(reader: &mut Reader) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    let limit = LONGEST_LINE as u64 + 2;
    if reader.by_ref().take(limit).read_until(b'\n', &mut bytes)? == 0 {
        return Ok(None);
    }
    if bytes.len() as u64 == limit && !bytes.ends_with(b"\n") {
        reader.skip_until(b'\n')?;
    }
    Ok(Some(bytes))
}
