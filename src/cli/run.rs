//! `metaplan run`: lines of events to lines of adaptations.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use metaplan::answers::{HandledLine, KeeperReadyLine, NumberedAnswer, PlanningLine, ReadyLine};
use metaplan::configure::Keeper;
use metaplan::journal::{Journal, Policy, Sync};
use metaplan::mapek::{Clock as _, LONGEST_LINE, Loop, Observation, SystemClock, Watch};
use metaplan::message::Message;
use metaplan::setup::Setup;
use metaplan::visible::visible_json;
use serde::Serialize;

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::configure::Wanted;
use crate::cli::output;
use crate::cli::situation::{Situation, consistent};

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; with `--configure`, knowledge bases.
    #[arg(required = true, value_name = "MISSION | DOMAIN PROBLEM | KB")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Without a task plan: a design for every function in need, as `metaplan configure` chooses it.
    #[arg(long, conflicts_with = "journal")]
    configure: bool,
    #[command(flatten)]
    wanted: Wanted,
    /// Where events come from, one JSON object a line; `-` is standard input.
    #[arg(long, value_name = "FILE", default_value = "-")]
    events: PathBuf,
    /// Write events and decisions there first, and go on from there after a crash.
    #[arg(long, value_name = "DIR")]
    journal: Option<PathBuf>,
    /// When the journal is forced to the disk.
    #[arg(long, value_enum, default_value_t = Fsync::Effects, requires = "journal")]
    fsync: Fsync,
    /// After so many events the journal gets a snapshot.
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "journal",
          value_parser = clap::value_parser!(u64).range(1..))]
    snapshot_every: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Fsync {
    /// After every event.
    Always,
    /// Before effects.
    Effects,
    /// When the operating system sees fit.
    Never,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if arguments.configure {
        return keep(arguments, common);
    }
    if !arguments.wanted.is_empty() {
        let text = "`--objective`, `--require`, `--budget`, `--exclusive`, `--most` and `--least` go with `--configure`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    let Setup { mission, settings, .. } = arguments.situation.setup(&arguments.inputs)?;
    output::warnings(common, mission.warnings());
    let name = mission.name.clone();
    let mut control = Loop::new(mission, settings)?;
    let mut events = Lines::open(&arguments.events)?;
    let mut stdout = io::stdout();
    let mut ready = ReadyLine::new(name);
    let mut journal = match &arguments.journal {
        None => None,
        Some(directory) => {
            let sync = match arguments.fsync {
                Fsync::Always => Sync::Always,
                Fsync::Effects => Sync::Effects,
                Fsync::Never => Sync::Never,
            };
            let policy = Policy { sync, snapshot_every: arguments.snapshot_every };
            let (journal, recovery) = Journal::open(directory, policy, &mut control)?;
            ready.resume(control.beliefs(), &recovery);
            output::warnings(common, &recovery.warnings);
            Some(journal)
        }
    };
    let first = write!(stdout, "{}", visible_json(&output::line(&ready))).and_then(|()| stdout.flush());
    match first {
        // Who does not read any more has had enough.
        Err(error) if is_gone(&error) => return Ok(Exit::Done),
        other => other.map_err(|error| lost(&error))?,
    }
    let line = Arc::new(AtomicU64::new(control.beliefs().lines()));
    heartbeat(control.watch(), Arc::clone(&line));
    let read = Instant::now();
    let answers = match &mut journal {
        None => control.start(),
        Some(journal) => journal.begin(&mut control).map_err(|error| unwritten(&error))?,
    };
    let number = control.beliefs().lines();
    match write(&mut stdout, number, &answers, read) {
        Err(error) if is_gone(&error) => return Ok(Exit::Done),
        other => other.map_err(|error| lost(&error))?,
    }
    let mut clock = SystemClock::default();
    let begun = control.beliefs().now();
    while let Some(text) = events.next()? {
        let read = Instant::now();
        let now = begun + clock.now();
        line.store(control.beliefs().lines() + 1, Ordering::Relaxed);
        let answers = match &mut journal {
            None => control.handle(&Observation::parse(&text), now),
            Some(journal) => journal.handle(&mut control, &text, now).map_err(|error| unwritten(&error))?,
        };
        let number = control.beliefs().lines();
        let written = write(&mut stdout, number, &answers, read);
        match written {
            Err(error) if is_gone(&error) => return Ok(Exit::Done),
            other => other.map_err(|error| lost(&error))?,
        }
    }
    Ok(Exit::Done)
}

/// The loop without a task plan.
fn keep(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let knowledge = arguments.situation.knowledge(&arguments.inputs)?;
    output::warnings(common, knowledge.warnings());
    let configurator = arguments.wanted.configurator(knowledge)?;
    consistent(Some(configurator.knowledge()))?;
    let objectives = configurator.objectives().into_iter().map(|own| own.individual.name).collect();
    let mut keeper = Keeper::new(configurator, None);
    let mut events = Lines::open(&arguments.events)?;
    let mut stdout = io::stdout();
    let ready = output::line(&KeeperReadyLine::new(objectives));
    let mut written = stdout.write_all(visible_json(&ready).as_bytes()).and_then(|()| stdout.flush());
    let (mut line, mut read) = (0, Instant::now());
    let mut answers = keeper.start();
    loop {
        match written.and_then(|()| write(&mut stdout, line, &answers, read)) {
            // Who does not read any more has had enough.
            Err(error) if is_gone(&error) => return Ok(Exit::Done),
            other => other.map_err(|error| lost(&error))?,
        }
        let Some(next) = events.next()? else { return Ok(Exit::Done) };
        read = Instant::now();
        line += 1;
        answers = keeper.handle(&Observation::parse(&next));
        written = Ok(());
    }
}

fn lost(error: &io::Error) -> Message {
    Message::error("M109", format!("the answer cannot be written: {error}"))
}

fn is_gone(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::BrokenPipe
}

fn unwritten(error: &io::Error) -> Message {
    Message::error("M321", format!("the journal cannot be written: {error}"))
}

/// So long planning may take before a word is said, and from one word to the next.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Says every second how planning goes, for as long as the program runs.
fn heartbeat(watch: Watch, line: Arc<AtomicU64>) {
    std::thread::spawn(move || {
        let mut known: Option<(u64, Instant, Instant)> = None;
        loop {
            std::thread::sleep(HEARTBEAT / 10);
            let Some(planning) = watch.look() else {
                known = None;
                continue;
            };
            let now = Instant::now();
            let (begun, said) = match known {
                Some((number, begun, said)) if number == planning.number => (begun, said),
                _ => (now, now),
            };
            known = Some((planning.number, begun, said));
            if now - said >= HEARTBEAT {
                known = Some((planning.number, begun, now));
                let line =
                    PlanningLine::new(&planning, (now - begun).as_secs(), line.load(Ordering::Relaxed));
                // Who does not read any more will be noticed when the answers are written.
                let _ = io::stdout().write_all(output::line(&line).as_bytes());
            }
        }
    });
}

/// Writes the answers to a line, each with the line's number, and that it was handled.
fn write(
    stdout: &mut impl io::Write,
    line: u64,
    answers: &[impl Serialize],
    read: Instant,
) -> io::Result<()> {
    let mut text = String::new();
    for answer in answers {
        text += &output::line(&NumberedAnswer::new(answer, line));
    }
    text += &output::line(&HandledLine::new(line, read.elapsed().as_micros()));
    // At once, so that no other thread's line comes in between.
    stdout.write_all(visible_json(&text).as_bytes())?;
    stdout.flush()
}

/// Lines of a file or of standard input, without those that are blank. Of a line that is far too long only the
/// beginning is kept, which is no event.
struct Lines {
    name: String,
    reader: Box<dyn BufRead>,
}

/// Opens a file; a pipe is read as it comes, and anything else that is no file is not.
fn regular(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    #[cfg(unix)]
    let is_pipe = std::os::unix::fs::FileTypeExt::is_fifo(&kind);
    #[cfg(not(unix))]
    let is_pipe = false;
    if kind.is_file() || is_pipe { File::open(path) } else { Err(io::Error::other("it is no file")) }
}

impl Lines {
    fn open(path: &Path) -> Result<Self, Message> {
        let name = path.display().to_string();
        let reader: Box<dyn BufRead> = if name == "-" {
            Box::new(BufReader::new(io::stdin()))
        } else {
            let file = regular(path)
                .map_err(|error| Message::at("M101", &name, None, format!("cannot be read: {error}")))?;
            Box::new(BufReader::new(file))
        };
        Ok(Self { name, reader })
    }

    fn next(&mut self) -> Result<Option<String>, Message> {
        loop {
            let line = self
                .read_line()
                .map_err(|error| Message::at("M101", &self.name, None, format!("cannot be read: {error}")))?;
            match line {
                Some(bytes) if bytes.trim_ascii().is_empty() => {}
                Some(bytes) => return Ok(Some(String::from_utf8_lossy(bytes.trim_ascii()).into_owned())),
                None => return Ok(None),
            }
        }
    }

    fn read_line(&mut self) -> io::Result<Option<Vec<u8>>> {
        let mut bytes = Vec::new();
        let limit = LONGEST_LINE as u64 + 2;
        if self.reader.by_ref().take(limit).read_until(b'\n', &mut bytes)? == 0 {
            return Ok(None);
        }
        if bytes.len() as u64 == limit && !bytes.ends_with(b"\n") {
            self.reader.skip_until(b'\n')?;
        }
        Ok(Some(bytes))
    }
}
