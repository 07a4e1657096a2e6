//! The command `metaplan run`, which runs the adaptation loop: reads lines of events and writes lines of answers.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::answers::{KeeperReadyLine, PlanningLine, ReadyLine};
use crate::configure::{Keeper, KeeperAnswer};
use crate::journal::{Journal, Policy, Sync};
use crate::knowledge::Knowledge;
use crate::mapek::{Answer, Loop, Recoverable, Settings, Watch};
use crate::message::Message;
use crate::setup::Setup;
use clap::{Args, ValueEnum};

use crate::cli::common::{Common, Exit, Failure};
use crate::cli::configure::Wanted;
use crate::cli::output;
use crate::cli::run_keeper::KeeperSession;
use crate::cli::run_lines::Lines;
use crate::cli::run_outlet::{Outlet, Outlets, is_over, unwritten};
use crate::cli::run_session::{Resumed, Session};
use crate::cli::situation::{Situation, consistent};

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; with `--configure`, knowledge bases.
    #[arg(required = true, value_name = "MISSION | DOMAIN PROBLEM | KB")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Run without a task plan: choose a design for every function that needs one, as `metaplan configure` does.
    #[arg(long)]
    configure: bool,
    #[command(flatten)]
    wanted: Wanted,
    /// With `--configure`: a TOML file with the section `[adaptation]` of a manifest; only its filters and `unrecorded` are used.
    #[arg(long, value_name = "FILE", requires = "configure")]
    adaptation: Option<PathBuf>,
    /// Source of events: one JSON object per line, or an MCAP file; `-` is standard input.
    #[arg(long, value_name = "FILE", default_value = "-")]
    events: PathBuf,
    /// Write events and decisions to a journal before they take effect, and resume from it after a crash.
    #[arg(long, value_name = "DIR")]
    journal: Option<PathBuf>,
    /// Time at which the journal is forced to disk.
    #[arg(long, value_enum, default_value_t = Fsync::Effects, requires = "journal")]
    fsync: Fsync,
    /// Write a snapshot to the journal after this many events.
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "journal",
          value_parser = clap::value_parser!(u64).range(1..))]
    snapshot_every: u64,
    #[command(flatten)]
    outlets: Outlets,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Fsync {
    /// After every event.
    Always,
    /// Before effects.
    Effects,
    /// When the operating system decides.
    Never,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if arguments.configure {
        return keep(arguments, common);
    }
    if !arguments.wanted.is_empty() {
        let text = "`--objective`, `--require`, `--budget`, `--exclusive`, `--most` and `--least` require \
                    `--configure`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    let setup = arguments.situation.setup(&arguments.inputs, common)?;
    let painter = arguments.outlets.painter(&setup)?;
    let Setup { mission, settings, .. } = setup;
    output::warnings(common, mission.warnings());
    let name = mission.name.clone();
    let mut control = Loop::new(mission, settings)?;
    let events = Lines::open(&arguments.events)?;
    let resumed = journal(arguments, common, &mut control)?;
    let outlet = Outlet::open(&arguments.outlets, &name, painter)?;
    ended(drive(common, control, resumed, ReadyLine::new(name), events, &outlet), &outlet)
}

fn journal<C: Recoverable>(
    arguments: &Arguments,
    common: &Common,
    control: &mut C,
) -> Result<Option<Resumed<C::Answer>>, Message> {
    let Some(directory) = &arguments.journal else { return Ok(None) };
    let sync = match arguments.fsync {
        Fsync::Always => Sync::Always,
        Fsync::Effects => Sync::Effects,
        Fsync::Never => Sync::Never,
    };
    let policy = Policy { sync, snapshot_every: arguments.snapshot_every };
    let (journal, recovery) = Journal::open(directory, policy, control)?;
    output::warnings(common, &recovery.warnings);
    Ok(Some(Resumed { journal, recovery, answers: Vec::new() }))
}

/// Reacts to an event that the journal contains without a reaction. This precedes the line `ready`, so that the line
/// counts every event of the journal. It follows the opening of all outlets, since a recorded reaction is not printed
/// again.
fn react<C: Recoverable>(resumed: &mut Resumed<C::Answer>, control: &mut C) -> Result<(), Message> {
    resumed.answers = resumed.journal.begin_reacting(control).map_err(|error| unwritten(&error))?;
    Ok(())
}

/// Closes the recording and the web page, also if the loop has failed.
fn ended(result: Result<(), Failure>, outlet: &Outlet) -> Result<Exit, Failure> {
    let closed = outlet.close();
    result?;
    closed?;
    Ok(Exit::Done)
}

fn drive(
    common: &Common,
    mut control: Loop,
    mut resumed: Option<Resumed<Answer>>,
    mut ready: ReadyLine,
    events: Lines,
    outlet: &Outlet,
) -> Result<(), Failure> {
    if let Some(resumed) = &mut resumed {
        react(resumed, &mut control)?;
        ready.resume(control.beliefs(), &resumed.recovery);
    }
    if is_over(outlet.say(&output::line(&ready)))? {
        return Ok(());
    }
    outlet.begin(&control);
    let line = Arc::new(AtomicU64::new(control.beliefs().lines()));
    heartbeat(control.watch(), Arc::clone(&line), outlet.clone());
    let session = Session::new(common, control, resumed, outlet, line);
    if events.is_file() { session.replay(events) } else { session.live(events) }
}

fn keep(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let knowledge = arguments.situation.knowledge(&arguments.inputs, common)?;
    output::warnings(common, knowledge.warnings());
    let configurator = arguments.wanted.configurator(knowledge)?;
    consistent(Some(configurator.knowledge()))?;
    let settings = adaptation(arguments.adaptation.as_deref(), configurator.knowledge())?;
    let keeper = Keeper::new(configurator, None).with_filters(&settings.filters);
    let mut keeper = keeper.with_unrecorded(settings.unrecorded);
    let events = Lines::open(&arguments.events)?;
    let resumed = journal(arguments, common, &mut keeper)?;
    let outlet = Outlet::open(&arguments.outlets, "", None)?;
    ended(keep_going(common, keeper, resumed, events, &outlet), &outlet)
}

fn adaptation(file: Option<&Path>, knowledge: &Knowledge) -> Result<Settings, Failure> {
    let Some(file) = file else { return Ok(Settings::default()) };
    Ok(Settings::read(file, Some(knowledge))?)
}

fn keep_going(
    common: &Common,
    mut keeper: Keeper,
    mut resumed: Option<Resumed<KeeperAnswer>>,
    events: Lines,
    outlet: &Outlet,
) -> Result<(), Failure> {
    if let Some(resumed) = &mut resumed {
        react(resumed, &mut keeper)?;
    }
    let ready = KeeperReadyLine::new(&keeper, resumed.as_ref().map(|resumed| &resumed.recovery));
    if is_over(outlet.say(&output::line(&ready)))? {
        return Ok(());
    }
    let session = KeeperSession::new(common, keeper, resumed, outlet);
    if events.is_file() { session.replay(events) } else { session.live(events) }
}

/// Time of planning before the first progress line, and between two.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Starts a thread that prints the progress every second while a plan is being computed. The thread runs until the
/// program ends.
fn heartbeat(watch: Watch, line: Arc<AtomicU64>, outlet: Outlet) {
    std::thread::spawn(move || {
        let mut reported: Option<(u64, Instant, Instant)> = None;
        loop {
            std::thread::sleep(HEARTBEAT / 10);
            let Some(planning) = watch.look() else {
                reported = None;
                continue;
            };
            let now = Instant::now();
            let (begun, said) = match reported {
                Some((number, begun, said)) if number == planning.number => (begun, said),
                _ => (now, now),
            };
            reported = Some((planning.number, begun, said));
            if now - said >= HEARTBEAT {
                reported = Some((planning.number, begun, now));
                let line =
                    PlanningLine::new(&planning, (now - begun).as_secs(), line.load(Ordering::Relaxed));
                // A closed pipe is detected when the answers are written.
                let _ = outlet.say(&output::line(&line));
            }
        }
    });
}
