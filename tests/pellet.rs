//! Benchmark against Pellet, the reasoner of current TOMASys robots: one process per cycle, a resident
//! process, and large knowledge bases.
//!
//! ```sh
//! apt-get install openjdk-17-jdk-headless
//! python3 -m venv pellet && pellet/bin/pip install owlready2==0.47
//! METAPLAN_PYTHON=$PWD/pellet/bin/python cargo test --release --test pellet -- --ignored --nocapture
//! ```
//!
//! Pellet is started with the command line of owlready2's `sync_reasoner_pellet`, so that the overhead of
//! Python is excluded.
//! Processor time includes child processes. Wall time depends on the load of the machine.

#![allow(clippy::print_stdout)] // Measurements are printed.

use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use ontology::runtime::{Mode, NewObjective, Runtime};
use ontology::{ReadOptions, lower, read_files, vocab};
use rules::{Engine, Literal, Symbols};
use test_resources::{Resource, data, program, python_with};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const OURS: &str = env!("CARGO_BIN_EXE_metaplan");

/// Assertions of a mission for SUAVE's knowledge base: an objective grounded in a design whose thruster has failed.
const MISSION: &str = "@prefix t: <http://metacontrol.org/tomasys#> .
@prefix s: <http://www.metacontrol.org/suave#> .
t:o a t:Objective ; t:typeF s:f_maintain_motion .
t:fg a t:FunctionGrounding ; t:solvesO t:o ; t:typeFD s:fd_all_thrusters .
s:c_thruster_1 t:c_status \"FALSE\" .
";

/// Running times in milliseconds.
#[derive(Clone, Copy, Debug)]
struct Times {
    wall: f64,
    processor: f64,
}

struct Peer {
    class_path: String,
    owl: PathBuf,
}

impl Peer {
    fn find() -> Option<Self> {
        let owl = data("real/owl")?;
        program(Resource::Java, &["java"])?;
        let python = python_with(Resource::Owlready2, "METAPLAN_PYTHON", "owlready2.reasoning")?;
        let script = "import owlready2.reasoning as r; print(r._PELLET_CLASSPATH)";
        let output = Command::new(python).args(["-c", script]).output().expect("Python starts");
        let class_path = String::from_utf8(output.stdout).expect("UTF-8").trim().to_owned();
        assert!(!class_path.is_empty(), "owlready2 contains no Pellet");
        Some(Self { class_path, owl })
    }

    /// Returns the command line with which owlready2 starts Pellet on an N-Triples document. `class` is the
    /// main class with its options.
    fn command<'a>(&'a self, class: &'a [&'a str], document: &'a str) -> Vec<&'a str> {
        let mut command = vec!["java", "-Xmx2000M", "-cp", &self.class_path];
        command.extend(class);
        command.extend(["realize", "--loader", "Jena", "--input-format", "N-Triples", "--infer-prop-values"]);
        command.extend(["--infer-data-prop-values", "--ignore-imports", document]);
        command
    }

    fn owl(&self, file: &str) -> String {
        self.owl.join(file).display().to_string()
    }
}

/// Returns the median times of several runs of a command, including child processes.
fn measure_command(command: &[&str], runs: usize) -> Times {
    let script = "TIMEFORMAT='%R %U %S'; time \"$@\" > /dev/null 2>&1 || echo failed >&2";
    let run = || {
        let mut bash = Command::new("bash");
        let output = bash.args(["-c", script, "--"]).args(command).output().expect("bash runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!text.contains("failed"), "{command:?}");
        let times: Vec<f64> = text.split_whitespace().filter_map(|time| time.parse().ok()).collect();
        (times[0] * 1e3, (times[1] + times[2]) * 1e3)
    };
    let times: Vec<(f64, f64)> = (0..runs).map(|_| run()).collect();
    Times {
        wall: median(times.iter().map(|time| time.0).collect()),
        processor: median(times.iter().map(|time| time.1).collect()),
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the times of a call in this process: the median wall time, and the mean processor time. Thread
/// clocks have a coarse resolution, so the processor time of a single call is not meaningful. On systems that
/// do not report processor times, the wall time replaces them.
fn measure_call(runs: usize, mut call: impl FnMut()) -> Times {
    let start_time = thread_processor_time();
    let times = (0..runs).map(|_| {
        let start = Instant::now();
        call();
        start.elapsed().as_secs_f64() * 1e3
    });
    let wall = median(times.collect());
    let mean = |(start_time, end_time): (f64, f64)| (end_time - start_time) / runs as f64;
    Times { wall, processor: start_time.zip(thread_processor_time()).map_or(wall, mean) }
}

/// Returns the processor time of this thread in milliseconds; `None` on systems that do not report it.
fn thread_processor_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e6)
}

fn report(label: &str, ours: Times, pellet: Times) {
    println!(
        "{label}: Pellet {:.0} ms wall, {:.0} ms processor; ours {:.3} and {:.3}; ratios {:.0} and {:.0}",
        pellet.wall,
        pellet.processor,
        ours.wall,
        ours.processor,
        pellet.wall / ours.wall.max(1e-3),
        pellet.processor / ours.processor.max(1e-3)
    );
}

fn engine(files: &[&str], options: &ReadOptions) -> Engine {
    let ontology = read_files(files, options).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules")
}

#[test]
#[ignore = "needs Java and owlready2"]
fn suave_deployed_and_resident() {
    let Some(peer) = Peer::find() else { return };
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = |name: &str| directory.path().join(name).display().to_string();
    let (mission, merged) = (path("mission.ttl"), path("merged.nt"));
    std::fs::write(&mission, MISSION).expect("written");
    let (suave, real) = (peer.owl("suave/suave.owl"), peer.owl(""));
    let convert =
        [OURS, "convert", &suave, &mission, "--directory", &real, "--to", "ntriples", "-o", &merged];
    measure_command(&convert, 1);

    let ours = [OURS, "reason", &suave, &mission, "--directory", &real, "--format", "ntriples", "-q"];
    let deployed = measure_command(&peer.command(&["pellet.Pellet"], &merged), 5);
    report("SUAVE, a process a cycle", measure_command(&ours, 5), deployed);

    let warm = format!("{ROOT}/tests/pellet/Warm.java");
    let class = [warm.as_str(), "30"];
    let command = peer.command(&class, &merged);
    let output = Command::new(command[0]).args(&command[1..]).output().expect("java runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let times: Vec<f64> = text.split_whitespace().filter_map(|time| time.parse().ok()).collect();
    let [wall, processor] = times[..] else { panic!("the JDK's source launcher: {output:?}") };
    let resident = Times { wall, processor };

    let options = ReadOptions { directories: vec![PathBuf::from(&real)], ..ReadOptions::default() };
    let scratch = measure_call(30, || drop(engine(&[&suave, &mission], &options)));
    report("SUAVE, resident, read and reasoned from scratch", scratch, resident);

    let mut runtime = Runtime::new(engine(&[&suave], &options), Mode::Retract);
    let (name, function) = ("search", "f_generate_search_path");
    let objective = NewObjective { name, function, requirements: Vec::new(), always_improve: false };
    runtime.add_objective(&objective).expect("known");
    let best = &runtime.available_designs(Some(function)).expect("known")[0];
    runtime.ground(name, &best.name).expect("known");
    let mut turn = 0;
    let change = measure_call(2_001, || {
        turn = 1 - turn;
        let value = Literal::parse(["0.5", "3.5"][turn], Some(vocab::xsd::DECIMAL), None);
        runtime.measure("water_visibility", value).expect("known");
        assert_eq!(runtime.objectives()[0].wants_design(), turn == 0);
    });
    report("SUAVE, resident, a measured value changes a status", change, resident);
}

#[test]
#[ignore = "needs Java and owlready2, and takes minutes"]
fn knowledge_bases_at_scale() {
    let (Some(peer), Some(generator)) = (Peer::find(), data("tools/scale_kb.py")) else { return };
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = |name: &str| directory.path().join(name).display().to_string();
    let generator = generator.display().to_string();
    let (tomasys, mros) = (peer.owl("mc_mdl_tomasys/tomasys.owl"), peer.owl("mros_ontology/mros.owl"));
    let real = peer.owl("");
    for (functions, designs) in [(2, 5), (10, 10), (100, 10), (50, 100)] {
        let (scaled, merged) = (path("scaled.nt"), path("merged.nt"));
        let (n, m) = (functions.to_string(), designs.to_string());
        let generate = ["python3", &generator, "-n", &n, "-m", &m, "-c", "2", "-q", "2"];
        let options = ["--fail", "0.1", "--violate", "0.2", "-o", &scaled];
        measure_command(&[&generate[..], &options].concat(), 1);
        let documents = [&tomasys[..], &mros, &scaled, "--directory", &real];
        measure_command(
            &[&[OURS, "convert"], &documents[..], &["--to", "ntriples", "-o", &merged]].concat(),
            1,
        );
        let ours = [&[OURS, "reason"], &documents[..], &["--format", "ntriples", "-q"]].concat();
        // For large knowledge bases, one run of Pellet is long enough for a measurement.
        let runs = if functions * designs < 1_000 { 3 } else { 1 };
        let (ours, pellet) =
            (measure_command(&ours, 3), measure_command(&peer.command(&["pellet.Pellet"], &merged), runs));
        report(&format!("{} designs, files to conclusions", functions * designs), ours, pellet);
    }
}
